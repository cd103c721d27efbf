/* How many good frames judgement rejects, and how many smeared ones it finds, in captures that `lumi sim shoot
 * --format exr` made: in the order of a sweep, beside the neighbours that the engine would give, with noise.
 * usage: bench_judge_good [-v] [-g: no smears] CAPTURE... */
#include "../unit/judge_world.h"

#include "daemon/judge/judge_priv.h"
#include "proto/capture/capture.h"
#include "proto/image/image.h"

#include <stdio.h>

#define CAMERAS 32

struct view {
    struct lumi_judge_picture *picture;
    struct lumi_capture_frame *frame;
};

struct camera {
    struct view last[3]; /* newest first */
    struct lumi_judge_usual usual;
};

struct tally {
    int frames, rejected, warned, smeared[8], found[8], right[8];
};

static bool talkative, smears = true;
static const double lengths[] = {2, 3, 4, 6, 10, 20};
#define LENGTHS ((int)(sizeof lengths / sizeof *lengths))

static void add(const struct view *view, struct lumi_judge_neighbour *neighbours, int *count)
{
    if (view->picture)
        neighbours[(*count)++] =
            (struct lumi_judge_neighbour){view->picture, &view->frame->lens, view->frame->pose, 0.01, 1};
}

static void keep(struct camera *c, struct lumi_judge_picture *picture, struct lumi_capture_frame *frame)
{
    lumi_judge_picture_destroy(c->last[2].picture);
    c->last[2] = c->last[1];
    c->last[1] = c->last[0];
    c->last[0] = (struct view){picture, frame};
}

/* `camera` of `cameras`: where the rig is one camera that was carried about, a row is one. */
static void judge_good(struct camera *cameras, int camera, const struct lumi_raster *light,
                       struct lumi_capture_frame *frame, unsigned seed, struct tally *tally)
{
    const struct fault none = {.full_well = 10000, .seed = seed};
    struct lumi_judge_picture *picture = world_picture(light, &none);
    struct lumi_judge_neighbour neighbours[4];
    struct lumi_judge_numbers n;
    struct lumi_judge_limits limits;
    char reason[200];
    int count = 0;

    lumi_judge_limits_init(&limits);
    add(&cameras[camera].last[0], neighbours, &count);
    if (camera > 0)
        add(&cameras[camera - 1].last[0], neighbours, &count);
    if (camera + 1 < CAMERAS)
        add(&cameras[camera + 1].last[0], neighbours, &count);
    lumi_judge_measure(picture, &frame->lens, &frame->pose, 0.01, 1, neighbours, count, &n, NULL);
    double usual = lumi_judge_usual_sharpness(&cameras[camera].usual);
    bool good = lumi_judge_verdict(&n, &limits, usual, NULL, reason, sizeof reason);
    tally->frames++;
    tally->rejected += !good;
    tally->warned += good && reason[0];
    if (good)
        lumi_judge_usual_add(&cameras[camera].usual, n.sharpness);
    if (talkative || !good)
        printf("  %s good: %s sharp %.3f of %.3f best %.1f at %.0f explained %.3f depth %.2f (%.2f %.2f %.2f %.2f) "
               "shift %.1f moved %.2f "
               "stops %.2f  %s\n",
               frame->name, good ? "accepted" : "REJECTED", n.sharpness, usual, picture->blur_length,
               picture->blur_angle * 180 / LUMI_PI, picture->blur_explained, picture->blur_depth,
               picture->blur_groups[0], picture->blur_groups[1], picture->blur_groups[2], picture->blur_groups[3],
               n.shift_pixels, n.moved, n.exposure_stops, reason);
    keep(&cameras[camera], picture, frame);
}

static void judge_smeared(const struct lumi_raster *light, const struct lumi_capture_frame *frame, unsigned seed,
                          struct tally *tally)
{
    for (int l = 0; l < LENGTHS; l++) {
        const struct fault fault = {
            .smear = lengths[l], .angle = fmod(seed * 0.618 + l * 0.4, 1) * LUMI_PI, .full_well = 10000, .seed = seed};
        struct lumi_judge_picture *p = world_picture(light, &fault);
        bool found = p->blur_pixels > 2;
        bool right = found && fabs(p->blur_pixels / fault.smear - 1) < 0.25 &&
                     fabs(remainder(p->blur_angle - fault.angle, LUMI_PI)) < 15 * LUMI_PI / 180;
        tally->smeared[l]++;
        tally->found[l] += found;
        tally->right[l] += right;
        if (talkative)
            printf(
                "  %s smear %.0f at %.0f: found %.1f best %.1f at %.0f explained %.3f depth %.2f (%.2f %.2f %.2f %.2f) "
                "sharp %.3f\n",
                frame->name, fault.smear, fault.angle * 180 / LUMI_PI, p->blur_pixels, p->blur_length,
                p->blur_angle * 180 / LUMI_PI, p->blur_explained, p->blur_depth, p->blur_groups[0], p->blur_groups[1],
                p->blur_groups[2], p->blur_groups[3], p->sharpness);
        lumi_judge_picture_destroy(p);
    }
}

static int one_capture(const char *path, struct tally *tally, struct lumi_error *error)
{
    static struct camera cameras[CAMERAS];
    struct lumi_capture *capture;
    struct lumi_capture_frame *frames;
    int count;

    memset(cameras, 0, sizeof cameras);
    LUMI_TRY(lumi_capture_open(path, LUMI_CAPTURE_READ, &capture, error));
    int code = lumi_capture_frames(capture, LUMI_FRAMES_USABLE, &frames, &count, error);
    for (int i = 0; code == LUMI_OK && i < count; i++) {
        struct lumi_raster light;
        char *file = lumi_capture_join(capture, frames[i].file);
        code = lumi_image_read(file, 3, &light, NULL, error);
        lumi_free(file);
        if (code != LUMI_OK)
            break;
        judge_good(cameras, frames[i].row % CAMERAS, &light, &frames[i], (unsigned)i + 1, tally);
        if (smears)
            judge_smeared(&light, &frames[i], (unsigned)i + 1, tally);
        lumi_raster_finish(&light);
    }
    for (int c = 0; c < CAMERAS; c++)
        for (int k = 0; k < 3; k++)
            lumi_judge_picture_destroy(cameras[c].last[k].picture);
    if (code == LUMI_OK)
        lumi_free(frames);
    lumi_capture_close(capture);
    return code;
}

int main(int count, char **words)
{
    struct lumi_error error;

    for (int i = 1; i < count; i++) {
        struct tally tally = {0};
        if (!strcmp(words[i], "-v")) {
            talkative = true;
            continue;
        }
        if (!strcmp(words[i], "-g")) {
            smears = false;
            continue;
        }
        if (one_capture(words[i], &tally, &error) != LUMI_OK) {
            fprintf(stderr, "%s\n", error.text);
            return 1;
        }
        printf("%s: %d good frames, %d rejected, %d with a warning; smears found (length and direction right):",
               words[i], tally.frames, tally.rejected, tally.warned);
        for (int l = 0; l < LENGTHS; l++)
            printf(" %.0f: %d (%d)", lengths[l], tally.found[l], tally.right[l]);
        printf("\n");
    }
    return 0;
}
