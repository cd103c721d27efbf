/* bench_memory FOLDER [IMAGES [RANGE [SHRINK]]]: the most memory that each stage holds on a capture of IMAGES (1,300)
 * images of 1280 x 1024, or of a SHRINKth of that each way, every stage in a process of its own.
 *
 * Making that many pictures and depth maps takes hours; how much memory a stage holds depends on their number and size.
 * So all images are one picture with one depth map, linked 1,300 times as the output of the stages before. `compress`
 * then runs whole; the stages that work on one image with its neighbours run on RANGE images (24): enough to fill what
 * they keep. */
#include "pipeline/compress/compress.h"
#include "pipeline/depth/depth.h"
#include "pipeline/geometry/geometry.h"
#include "pipeline/graph/graph.h"
#include "proto/capture/capture.h"
#include "proto/image/image.h"

#include <errno.h>
#include <glib.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

enum { ROWS = 20 };

static const char *folder;
static int images = 1300, range = 24, width = 1280, height = 1024;

static char *in_folder(const char *name)
{
    return g_build_filename(folder, name, NULL);
}

static int fill(struct lumi_capture *capture, struct lumi_error *error)
{
    const struct lumi_capture_file file = {
        .extension = ".png", .width = width, .height = height, .camera_time_us = LUMI_NO_TIME};
    struct lumi_capture_lens lens = {.name = "lens"};
    int columns = (images + ROWS - 1) / ROWS;
    int64_t lens_id, camera, frame;

    lumi_lens_init_pinhole(&lens.lens, width, height, 70 * LUMI_PI / 180); /* its views keep their size */
    LUMI_TRY(lumi_capture_add_lens(capture, &lens, &lens_id, error));
    LUMI_TRY(lumi_capture_add_camera(capture, "camera", lens_id, &camera, error));
    for (int i = 0; i < images; i++) {
        double azimuth = 2 * LUMI_PI * (i / ROWS) / columns, elevation = ((i % ROWS + 0.5) / ROWS - 0.5) * LUMI_PI;
        struct lumi_vec3 out = {cos(elevation) * cos(azimuth), cos(elevation) * sin(azimuth), sin(elevation)};
        struct lumi_pose pose;
        char name[16];
        snprintf(name, sizeof name, "view%04d", i);
        const struct lumi_capture_new_frame add = {.name = name, .camera = camera, .row = i % ROWS, .column = i / ROWS};
        lumi_pose_look(lumi_scale(out, 0.35), out, lumi_vec3(0, 0, 1), &pose);
        LUMI_TRY(lumi_capture_add_frame(capture, &add, &frame, error));
        LUMI_TRY(lumi_capture_store_bytes(capture, frame, name, strlen(name), &file, error));
        LUMI_TRY(lumi_capture_set_pose(capture, frame, &pose, LUMI_POSE_TRUE, "bench_memory", error));
    }
    return LUMI_OK;
}

static int make_capture(struct lumi_error *error)
{
    g_autofree char *path = in_folder("memory.capture");
    struct lumi_capture *capture;

    if (g_file_test(path, G_FILE_TEST_IS_DIR))
        return LUMI_OK;
    LUMI_TRY(lumi_capture_create(path, &capture, error));
    int code = lumi_capture_begin(capture, error);
    if (code == LUMI_OK)
        code = fill(capture, error);
    if (code == LUMI_OK)
        code = lumi_capture_commit(capture, error);
    if (code == LUMI_OK)
        code = lumi_capture_publish(capture, NULL, error);
    lumi_capture_close(capture);
    return code;
}

/* The picture, textured at all scales, and smooth depth between 1 and 5 m. */
static int make_templates(struct lumi_error *error)
{
    g_autofree char *picture_path = in_folder("picture.exr"), *depth_path = in_folder("depth.exr");
    struct lumi_image_options options;
    struct lumi_raster picture = {0}, depth = {0};
    int code;

    LUMI_TRY(lumi_raster_create(&picture, width, height, 3, LUMI_F32));
    LUMI_GOTO(code, out, lumi_raster_create(&depth, width, height, 1, LUMI_F32));
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            double value = 0.4;
            for (double scale = 200, k = 1; scale > 2; scale /= 1.7, k++)
                value += 0.0008 * scale * sin(x / scale * (1 + 0.1 * k) + k) * sin(y / scale + 2 * k);
            for (int c = 0; c < 3; c++)
                lumi_row_f32(&picture, y)[3 * x + c] = (float)(value * (1 - 0.1 * c));
            lumi_row_f32(&depth, y)[x] = (float)(0.6 + 0.4 * sin(x / 150.0) * cos(y / 110.0));
        }
    LUMI_GOTO(code, out, lumi_image_write(picture_path, &picture, NULL, error));
    lumi_image_options_init(&options);
    options.format = LUMI_IMAGE_EXR;
    options.half = false;
    options.channel = "W";
    code = lumi_image_write(depth_path, &depth, &options, error);
out:
    lumi_raster_finish(&picture);
    lumi_raster_finish(&depth);
    return code;
}

/* The stages before: one file as the output for every image. */

static const char *linked;

static int link_key(struct lumi_run *run, int index, struct lumi_key *key, struct lumi_error *error)
{
    (void)run;
    (void)error;
    lumi_key_int(key, index);
    return LUMI_OK;
}

static int link_make(struct lumi_run *run, void *state, int index, int thread, const char *path,
                     struct lumi_error *error)
{
    (void)run;
    (void)state;
    (void)index;
    (void)thread;
    if (unlink(path) && errno != ENOENT)
        return lumi_fail_errno(error, path, "remove");
    return link(linked, path) ? lumi_fail_errno(error, path, "link") : LUMI_OK;
}

static int link_stage(struct lumi_run *run, const char *name, const char *extension, const char *file,
                      struct lumi_error *error)
{
    const struct lumi_stage stage = {
        .name = name, .title = name, .version = 1, .extension = extension, .key = link_key, .make = link_make};
    g_autofree char *path = in_folder(file);

    linked = path;
    return lumi_run_stage(run, &stage, 0, run->count, NULL, error);
}

static int link_early(struct lumi_run *run, struct lumi_error *error)
{
    LUMI_TRY(link_stage(run, "equiangular", ".exr", "picture.exr", error));
    LUMI_TRY(link_stage(run, "match", ".exr", "depth.exr", error));
    return link_stage(run, "depth", ".exr", "depth.exr", error);
}

/* The first image's mesh stands for all. */
static int link_meshes(struct lumi_run *run, struct lumi_error *error)
{
    const char *stages[] = {"geometry", "geometry-coarse"};

    for (int i = 0; i < 2; i++) {
        g_autofree char *made = lumi_run_path(run, stages[i], 0, ".mesh"),
                        *name = g_strconcat(stages[i], ".mesh", NULL);
        g_autofree char *kept = in_folder(name);
        unlink(kept);
        if (link(made, kept))
            return lumi_fail_errno(error, kept, "link");
        LUMI_TRY(link_stage(run, stages[i], ".mesh", name, error));
    }
    return LUMI_OK;
}

struct step {
    const char *name;
    const struct lumi_stage *stage;
    int count; /* of images from the first on, at most; 0: all */
    int (*prepare)(struct lumi_run *run, struct lumi_error *error);
};

static int take_step(const struct step *step, struct lumi_error *error)
{
    g_autofree char *path = in_folder("memory.capture");
    struct lumi_parameters parameters;
    struct lumi_run *run;
    struct rusage usage;

    lumi_run_defaults(&parameters);
    LUMI_TRY(lumi_graph_open(path, NULL, &parameters, 0, true, &run, error));
    int count = step->count ? MIN(step->count, run->count) : run->count, skipped = 0;
    int code = step->prepare ? step->prepare(run, error) : lumi_run_stage(run, step->stage, 0, count, &skipped, error);
    if (code == LUMI_OK && step->stage) {
        getrusage(RUSAGE_SELF, &usage);
        printf("%-18s %4d of %d images %8.0f core-s %8.0f MB at most\n", step->name, count - skipped, run->count,
               (double)usage.ru_utime.tv_sec + (double)usage.ru_stime.tv_sec, (double)usage.ru_maxrss / 1e3 * 1.024);
        fflush(stdout);
    }
    lumi_run_close(run);
    return code;
}

int main(int argc, char **argv)
{
    if (argc > 2)
        images = atoi(argv[2]);
    if (argc > 3)
        range = atoi(argv[3]);
    if (argc > 4) {
        width /= MAX(atoi(argv[4]), 1);
        height /= MAX(atoi(argv[4]), 1);
    }
    if (argc < 2 || argc > 5 || images < 40 || range < 1 || width < 64 || height < 64) {
        fprintf(stderr, "usage: bench_memory FOLDER [IMAGES, at least 40 [RANGE [SHRINK]]]\n");
        return 2;
    }
    const struct step steps[] = {
        {"before", NULL, 0, link_early},
        {"match", &lumi_stage_match, range, NULL},
        {"depth", &lumi_stage_depth, range, NULL},
        {"geometry", &lumi_stage_geometry, 2, NULL},
        {"geometry-coarse", &lumi_stage_geometry_coarse, 2, NULL},
        {"meshes", NULL, 0, link_meshes},
        {"compress", &lumi_stage_compress, 0, NULL},
    };
    struct lumi_error error = {0};

    folder = argv[1];
    int code = make_capture(&error);
    if (code == LUMI_OK)
        code = make_templates(&error);
    for (size_t i = 0; code == LUMI_OK && i < sizeof steps / sizeof *steps; i++) {
        fflush(stdout);
        pid_t child = fork();
        if (child == 0) {
            code = take_step(&steps[i], &error);
            if (code != LUMI_OK)
                fprintf(stderr, "bench_memory: %s: %s\n", steps[i].name, error.text);
            _exit(lumi_exit_status(code));
        }
        int status = 0;
        if (child < 0 || waitpid(child, &status, 0) != child || status)
            return 1;
    }
    if (code != LUMI_OK)
        fprintf(stderr, "bench_memory: %s\n", error.text);
    return lumi_exit_status(code);
}
