/* A capture that grows arc by arc under a preview, and how near its views come to the truth.
 * usage: preview_rows CAPTURE TRUTH.json GROWING ROWS,... [PICTURES]
 * Copies the frames of CAPTURE, in the order of its positions, to the live capture GROWING; after so many rows prints
 * "rows frames PSNR-plain PSNR" (means over the truth: everything on one sphere, and with shapes). Fails if the picture
 * does not get better from one to the next, or the writer ever has to wait. */
#include "pipeline/evaluate/evaluate.h"
#include "pipeline/preview/preview.h"
#include "proto/base/memory.h"
#include "proto/capture/capture.h"
#include "proto/image/image.h"

#include <glib.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct growing {
    struct lumi_capture *from, *to;
    struct lumi_capture_frame *frames;
    int count;
    int64_t *ids; /* in the growing one */
};

static void need(int code, const struct lumi_error *error)
{
    if (code == LUMI_OK)
        return;
    fprintf(stderr, "preview_rows: %s\n", error->text);
    exit(1);
}

/* Everything planned, as the daemon does it: rows and poses first. */
static void plan(struct growing *g, const char *from, const char *to)
{
    struct lumi_error error;
    GHashTable *lenses = g_hash_table_new(g_int64_hash, g_int64_equal), *cameras, *positions;
    int number = 0;

    cameras = g_hash_table_new_full(g_int64_hash, g_int64_equal, NULL, g_free);
    positions = g_hash_table_new_full(g_int64_hash, g_int64_equal, NULL, g_free);
    need(lumi_capture_open(from, LUMI_CAPTURE_READ, &g->from, &error), &error);
    need(lumi_capture_frames(g->from, LUMI_FRAMES_ALL, &g->frames, &g->count, &error), &error);
    need(lumi_capture_create_live(to, &g->to, &error), &error);
    need(lumi_capture_begin(g->to, &error), &error);
    g->ids = g_new0(int64_t, g->count);
    for (int i = 0; i < g->count; i++) {
        struct lumi_capture_frame *f = &g->frames[i];
        int64_t *camera = g_hash_table_lookup(cameras, &f->camera);
        int64_t *shot = g_hash_table_lookup(positions, &f->position_id);
        if (!camera) {
            struct lumi_capture_lens lens = {.lens = f->lens};
            int64_t lens_id;
            camera = g_new(int64_t, 1);
            need(lumi_capture_add_lens(g->to, &lens, &lens_id, &error), &error);
            need(lumi_capture_add_camera(g->to, f->camera_name, lens_id, camera, &error), &error);
            g_hash_table_insert(cameras, &f->camera, camera);
        }
        if (!shot) {
            struct lumi_capture_position position = {.number = number++, .turn_angle = f->turn_angle};
            int64_t position_id;
            shot = g_new(int64_t, 1);
            need(lumi_capture_add_position(g->to, &position, &position_id, &error), &error);
            need(lumi_capture_add_shot(g->to, position_id, 0, 0, shot, &error), &error);
            g_hash_table_insert(positions, &f->position_id, shot);
        }
        const struct lumi_capture_new_frame made = {
            .name = f->name, .camera = *camera, .shot = *shot, .row = f->row, .column = f->column};
        need(lumi_capture_add_frame(g->to, &made, &g->ids[i], &error), &error);
        need(lumi_capture_set_pose(g->to, g->ids[i], &f->pose, LUMI_POSE_PRIOR, "test", &error), &error);
    }
    need(lumi_capture_commit(g->to, &error), &error);
    g_hash_table_unref(lenses);
    g_hash_table_unref(cameras);
    g_hash_table_unref(positions);
}

/* The frames of the positions before `rows` that are not there yet; returns the next. */
static int grow(struct growing *g, int from, int rows)
{
    struct lumi_error error;
    int i = from;

    for (; i < g->count && g->frames[i].position < rows; i++) {
        const struct lumi_capture_frame *f = &g->frames[i];
        const struct lumi_capture_file file = {
            .extension = strrchr(f->file, '.'), .width = f->width, .height = f->height, .camera_time_us = LUMI_NO_TIME};
        char *path = lumi_capture_join(g->from, f->file);
        need(lumi_capture_trigger_frame(g->to, g->ids[i], 1000 * i, &error), &error);
        need(lumi_capture_store_file(g->to, g->ids[i], path, &file, &error), &error);
        need(lumi_capture_judge_frame(g->to, g->ids[i], true, 1, NULL, &error), &error);
        lumi_free(path);
    }
    return i;
}

static struct lumi_preview_gaze gaze_of(const struct lumi_truth *truth)
{
    const struct lumi_vec3 ahead = lumi_axis(&truth->pose, 2), at = truth->pose.t;

    return (struct lumi_preview_gaze){at.x,
                                      at.y,
                                      at.z,
                                      atan2(ahead.y, ahead.x),
                                      asin(fmin(fmax(ahead.z, -1), 1)),
                                      2 * atan(truth->lens.width / (2 * truth->lens.fx)),
                                      truth->lens.width,
                                      truth->lens.height};
}

static double measure(struct lumi_preview *preview, const struct lumi_truth_set *truth, const char *pictures)
{
    double sum = 0;

    for (int i = 0; i < truth->count; i++) {
        const struct lumi_preview_gaze gaze = gaze_of(&truth->items[i]);
        struct lumi_comparison comparison;
        struct lumi_picture picture;
        struct lumi_raster whole, bytes = {0};
        struct lumi_error error;
        need(lumi_preview_draw(preview, &gaze, &picture, &error), &error);
        need(lumi_image_read(truth->items[i].path, 3, &whole, NULL, &error), &error);
        need(lumi_raster_convert(&whole, LUMI_U8, &bytes), &error);
        need(lumi_compare_pictures(&picture.color, &bytes, 0, &comparison, &error), &error);
        sum += comparison.psnr_rgb;
        if (pictures) {
            g_autofree char *name = g_strdup_printf("%s-%s.png", pictures, truth->items[i].name);
            need(lumi_image_write(name, &picture.color, NULL, &error), &error);
        }
        lumi_picture_finish(&picture);
        lumi_raster_finish(&whole);
        lumi_raster_finish(&bytes);
    }
    return sum / truth->count;
}

static double work_and_measure(struct lumi_preview *preview, const struct lumi_truth_set *truth, const char *pictures)
{
    struct lumi_error error;

    need(lumi_preview_look(preview, NULL, &error), &error);
    while (lumi_preview_work(preview))
        continue;
    return measure(preview, truth, pictures);
}

int main(int argc, char **argv)
{
    struct growing g = {0};
    struct lumi_preview *previews[2] = {NULL, NULL};
    struct lumi_preview_options options;
    struct lumi_preview_status status;
    struct lumi_truth_set truth;
    struct lumi_error error;
    double before[2] = {0, 0};
    int next = 0, bad = 0;

    if (argc < 5)
        return 2;
    g_auto(GStrv) rows = g_strsplit(argv[4], ",", -1);
    need(lumi_truth_read(argv[2], NULL, false, &truth, &error), &error);
    plan(&g, argv[1], argv[3]);
    lumi_preview_options_init(&options);
    for (int i = 0; i < 2; i++) {
        options.shapes = i == 1;
        need(lumi_preview_open(argv[3], &options, &previews[i], &error), &error);
    }
    for (int r = 0; rows[r]; r++) {
        double now[2];
        next = grow(&g, next, atoi(rows[r]));
        for (int i = 0; i < 2; i++) {
            g_autofree char *name = argc > 5 ? g_strdup_printf("%s%s%s", argv[5], rows[r], i ? "" : "-plain") : NULL;
            now[i] = work_and_measure(previews[i], &truth, name);
            bad |= !(now[i] > before[i] + 0.5);
            before[i] = now[i];
        }
        lumi_preview_status(previews[1], &status);
        bad |= status.rows != atoi(rows[r]) || status.frames != next || status.views != next;
        printf("%d %d %.2f %.2f\n", status.rows, status.frames, now[0], now[1]);
    }
    /* Both previews still look: the capture can be sealed all the same. */
    need(lumi_capture_seal(g.to, NULL, &error), &error);
    lumi_capture_close(g.to);
    lumi_capture_close(g.from);
    for (int i = 0; i < 2; i++)
        lumi_preview_close(previews[i]);
    lumi_truth_finish(&truth);
    lumi_free(g.frames);
    g_free(g.ids);
    return bad;
}
