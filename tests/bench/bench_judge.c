/* What judgement finds in pictures of simulated places whose faults are known: one line a picture.
 * usage: bench_judge smear|focus|compare|time [WIDTH] */
#include "../unit/judge_world.h"

#include "daemon/judge/judge_priv.h"

#include <stdio.h>
#include <time.h>

#define VIEWS 10

static int width = 960;

static void view_light(const struct sim_scene *scene, const struct lumi_lens *lens, double azimuth, double elevation,
                       struct lumi_raster *light)
{
    struct lumi_pose pose = world_pose(azimuth, elevation);
    struct lumi_error error;

    if (sim_camera_render(scene, lens, &pose, 0, light, NULL, &error) != LUMI_OK) {
        fprintf(stderr, "%s\n", error.text);
        exit(1);
    }
}

static void smears(const struct lumi_raster *light, const char *name, double full_well)
{
    static const double lengths[] = {0, 1, 2, 2.5, 3, 4, 6, 10, 20};

    for (size_t l = 0; l < sizeof lengths / sizeof *lengths; l++)
        for (int a = 0; a < (lengths[l] > 0 ? 3 : 1); a++) {
            struct fault fault = {.smear = lengths[l], .angle = a * 0.87, .full_well = full_well, .seed = 7};
            struct lumi_judge_picture *p = world_picture(light, &fault);
            printf("%s well %6.0f smear %5.1f at %3.0f: found %5.1f at %3.0f best %5.1f explained %.3f depth %.2f "
                   "sharp %.3f noise %.5f\n",
                   name, full_well, fault.smear, fault.angle * 180 / LUMI_PI, p->blur_pixels,
                   p->blur_angle * 180 / LUMI_PI, p->blur_length, p->blur_explained, p->blur_depth, p->sharpness,
                   p->noise);
            lumi_judge_picture_destroy(p);
        }
}

static void focus(const struct lumi_raster *light, const char *name)
{
    for (double d = 0; d<12; d = d> 0 ? d * 1.5 : 1) {
        struct fault fault = {.defocus = d, .full_well = 10000, .seed = 3};
        struct lumi_judge_picture *p = world_picture(light, &fault);
        printf("%s defocus %5.2f: sharp %.3f found smear %.1f explained %.3f depth %.2f\n", name, d, p->sharpness,
               p->blur_pixels, p->blur_explained, p->blur_depth);
        lumi_judge_picture_destroy(p);
    }
}

static void one_compare(const struct sim_scene *scene, const struct lumi_lens *lens, double azimuth,
                        const struct lumi_raster lights[4], const char *what, const struct fault *fault, double yaw,
                        double pitch)
{
    static const double places[4][2] = {{0, 0}, {0.12, 0}, {-0.12, 0}, {0, 0.12}};
    struct lumi_judge_picture *pictures[4];
    struct lumi_judge_neighbour neighbours[3];
    const struct fault none = {.full_well = 10000, .seed = 2};
    struct lumi_judge_numbers n;
    struct lumi_raster knocked;

    if (yaw != 0 || pitch != 0) {
        struct lumi_pose pose = world_pose(azimuth + yaw, pitch), right = world_pose(azimuth, 0);
        pose.t = right.t;
        sim_camera_render(scene, lens, &pose, 0, &knocked, NULL, NULL);
    }
    bool moved = yaw != 0 || pitch != 0;
    pictures[0] = world_picture(moved ? &knocked : &lights[0], fault);
    for (int i = 1; i < 4; i++) {
        pictures[i] = world_picture(&lights[i], &none);
        neighbours[i - 1] =
            (struct lumi_judge_neighbour){pictures[i], lens, world_pose(azimuth + places[i][0], places[i][1]), 0.01, 1};
    }
    struct lumi_pose pose = world_pose(azimuth, 0);
    struct timespec a, b;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &a);
    lumi_judge_measure(pictures[0], lens, &pose, 0.01, 1, neighbours, 3, &n, NULL);
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &b);
    printf("azimuth %.1f %-24s: stops %+.2f shift %.2f of %.2f pixels, moved %.3f (%.0f ms)\n", azimuth, what,
           n.exposure_stops, n.shift_pixels, hypot(yaw, pitch) * lens->fx, n.moved,
           1e3 * (double)(b.tv_sec - a.tv_sec) + 1e-6 * (double)(b.tv_nsec - a.tv_nsec));
    for (int i = 0; i < 4; i++)
        lumi_judge_picture_destroy(pictures[i]);
    if (moved)
        lumi_raster_finish(&knocked);
}

static void compare(const struct sim_scene *scene, const struct lumi_lens *lens, double azimuth)
{
    static const double places[4][2] = {{0, 0}, {0.12, 0}, {-0.12, 0}, {0, 0.12}};
    struct lumi_raster lights[4];
    struct fault fault = {.full_well = 10000, .seed = 1};
    char name[64];

    for (int i = 0; i < 4; i++)
        view_light(scene, lens, azimuth + places[i][0], places[i][1], &lights[i]);
    one_compare(scene, lens, azimuth, lights, "nothing", &fault, 0, 0);
    for (double stops = -1; stops <= 1; stops += 0.5) {
        fault.stops = stops;
        snprintf(name, sizeof name, "stops %+.1f", stops);
        one_compare(scene, lens, azimuth, lights, name, &fault, 0, 0);
    }
    fault.stops = 0;
    for (double thing = 0.05; thing < 0.5; thing *= 2) {
        fault.thing = thing;
        snprintf(name, sizeof name, "thing %.3f", thing * thing * lens->width / lens->height);
        one_compare(scene, lens, azimuth, lights, name, &fault, 0, 0);
    }
    fault.thing = 0;
    for (double pixels = 2; pixels <= 32; pixels *= 2) {
        snprintf(name, sizeof name, "yaw %.0f", pixels);
        one_compare(scene, lens, azimuth, lights, name, &fault, pixels / lens->fx, 0);
        snprintf(name, sizeof name, "pitch %.0f", pixels);
        one_compare(scene, lens, azimuth, lights, name, &fault, 0, pixels / lens->fx);
    }
    for (int i = 0; i < 4; i++)
        lumi_raster_finish(&lights[i]);
}

/* Milliseconds for a frame of 5 million pixels. */
static void speed(void)
{
    enum { W = 2448, H = 2048 };
    uint8_t *data = lumi_alloc((size_t)W * H, 1);
    struct lumi_camera_frame frame = {
        .format = {LUMI_LAYOUT_BAYER, LUMI_BAYER_RGGB, W, H, 8, W}, .data = data, .size = (size_t)W * H};
    struct timespec a, b;

    for (int y = 0; y < H; y++)
        for (int x = 0; x < W; x++)
            data[y * W + x] = (uint8_t)(60 + 50 * sin(x * 0.05 + y * 0.001 * x) + (x * 7 + y * 13) % 11);
    for (int i = 0; i < 5; i++) {
        struct lumi_judge_picture *p;
        clock_gettime(CLOCK_THREAD_CPUTIME_ID, &a);
        if (lumi_judge_picture_create(&frame, &p, NULL) != LUMI_OK)
            return;
        clock_gettime(CLOCK_THREAD_CPUTIME_ID, &b);
        printf("raw8 %dx%d: %.0f ms of a processor\n", W, H,
               1e3 * (double)(b.tv_sec - a.tv_sec) + 1e-6 * (double)(b.tv_nsec - a.tv_nsec));
        lumi_judge_picture_destroy(p);
    }
    lumi_free(data);
}

int main(int count, char **words)
{
    const char *what = count > 1 ? words[1] : "smear";
    static const char *const places[] = {"room", "court"};
    struct lumi_lens lens;

    setvbuf(stdout, NULL, _IOLBF, 0);
    if (count > 2)
        width = atoi(words[2]);
    if (!strcmp(what, "time")) {
        speed();
        return 0;
    }
    lumi_lens_init_pinhole(&lens, width, width * 3 / 4, 70 * LUMI_PI / 180);
    for (int p = 0; p < 2; p++) {
        struct sim_scene *scene;
        if (sim_place_open(places[p], &scene, NULL) != LUMI_OK)
            return 1;
        for (int v = 0; v < VIEWS / 2; v++) {
            struct lumi_raster light;
            char name[64];
            snprintf(name, sizeof name, "%s/%d", places[p], v);
            if (!strcmp(what, "compare")) {
                if (v < 2)
                    compare(scene, &lens, v * 1.2566);
                continue;
            }
            view_light(scene, &lens, v * 1.2566, v % 2 * 0.2, &light);
            if (!strcmp(what, "smear")) {
                smears(&light, name, 10000);
            } else {
                focus(&light, name);
            }
            lumi_raster_finish(&light);
        }
        sim_scene_destroy(scene);
    }
    return 0;
}
