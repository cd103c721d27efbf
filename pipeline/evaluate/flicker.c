/* Flicker. */
#include "pipeline/evaluate/flicker.h"

#include <glib.h>
#include <stdlib.h>
#include <string.h>

/* A frame: rendered, and true. */
struct frame {
    struct lumi_picture rendered;
    struct lumi_raster truth;
};

static void frame_finish(struct frame *frame)
{
    lumi_picture_finish(&frame->rendered);
    lumi_raster_finish(&frame->truth);
    memset(frame, 0, sizeof *frame);
}

static int read_frame(struct lumi_renderer *renderer, const struct lumi_truth *truth, struct frame *frame,
                      struct lumi_error *error)
{
    LUMI_TRY(lumi_truth_picture(truth, &frame->truth, error));
    return lumi_renderer_draw(renderer, &truth->lens, &truth->pose, &frame->rendered, error);
}

static void add(const struct frame *before, const struct frame *after, struct lumi_flicker *result)
{
    const int values = 3 * before->truth.width;
    long long rendered = 0, truth = 0, flicker = 0, jumps = 0;

    for (int y = 0; y < before->truth.height; y++) {
        const uint8_t *r0 = lumi_row_u8(&before->rendered.color, y), *r1 = lumi_row_u8(&after->rendered.color, y);
        const uint8_t *t0 = lumi_row_u8(&before->truth, y), *t1 = lumi_row_u8(&after->truth, y);
        for (int i = 0; i < values; i++) {
            const int r = r1[i] - r0[i], t = t1[i] - t0[i];
            rendered += abs(r);
            truth += abs(t);
            flicker += abs(r - t);
            jumps += abs(r) > abs(t) + LUMI_FLICKER_JUMP;
        }
    }
    const double count = (double)values * before->truth.height;
    result->rendered += (double)rendered / count;
    result->truth += (double)truth / count;
    result->flicker += (double)flicker / count;
    result->jumps += (double)jumps / count;
}

static int check_frames(const struct lumi_truth_set *truth, struct lumi_error *error)
{
    if (truth->count < 2)
        return lumi_fail(error, LUMI_ERR_ARG, "flicker wants two frames of the truth or more");
    for (int i = 1; i < truth->count; i++)
        if (truth->items[i].lens.width != truth->items[0].lens.width ||
            truth->items[i].lens.height != truth->items[0].lens.height)
            return lumi_fail(error, LUMI_ERR_FORMAT, "%s: is not as large as %s: they are no frames of one path",
                             truth->items[i].path, truth->items[0].path);
    return LUMI_OK;
}

int lumi_flicker(const char *field, const struct lumi_truth_set *truth, const struct lumi_evaluate_options *options,
                 struct lumi_flicker *result, struct lumi_error *error)
{
    struct lumi_render_options render = options->render;
    struct lumi_renderer *renderer = NULL;
    struct frame before = {0}, after = {0};
    int code;

    *result = (struct lumi_flicker){.frames = truth->count};
    render.disks.sample = LUMI_U8;
    LUMI_TRY(check_frames(truth, error));
    LUMI_GOTO(code, out, lumi_renderer_open(field, &render, &renderer, error));
    if (render.method == LUMI_METHOD_PLANE)
        lumi_renderer_set_plane(renderer, render.plane_distance > 0 ? 1 / render.plane_distance : 0);
    for (int i = 0; i < truth->count; i++) {
        if (options->progress)
            options->progress(options->context, "frames", i, truth->count);
        LUMI_GOTO(code, out, read_frame(renderer, &truth->items[i], &after, error));
        if (i > 0)
            add(&before, &after, result);
        frame_finish(&before);
        before = after;
        after = (struct frame){0};
    }
    result->rendered /= truth->count - 1;
    result->truth /= truth->count - 1;
    result->flicker /= truth->count - 1;
    result->jumps /= truth->count - 1;
out:
    frame_finish(&before);
    frame_finish(&after);
    lumi_renderer_close(renderer);
    return code;
}

char *lumi_flicker_text(const struct lumi_flicker *f)
{
    return g_strdup_printf("%d frames; mean difference between neighbours, grey levels: rendered %.3f, truth %.3f, "
                           "flicker (of one from the other) %.3f; %.3f %% change by over %d more than the truth\n",
                           f->frames, f->rendered, f->truth, f->flicker, 100 * f->jumps, LUMI_FLICKER_JUMP);
}

char *lumi_flicker_json(const struct lumi_flicker *f)
{
    return g_strdup_printf("{\"frames\":%d,\"rendered\":%.6f,\"truth\":%.6f,\"flicker\":%.6f,\"jumps\":%.6f}",
                           f->frames, f->rendered, f->truth, f->flicker, f->jumps);
}
