/* The stage "features". */
#include "pipeline/calibrate/features.h"

#include "pipeline/calibrate/grey.h"
#include "pipeline/calibrate/rig_mask.h"
#include "pipeline/calibrate/sift.h"
#include "pipeline/calibrate/sphere_warp.h"
#include "pipeline/run/key.h"
#include "proto/base/memory.h"
#include "proto/base/parallel.h"

#include <glib.h>
#include <math.h>
#include <string.h>

/* Lenses that stretch small things more than this are resampled (docs/features.md). */
#define STRETCH_MOST 1.3

struct worker {
    struct lumi_sift *sift;
    struct lumi_lens lens; /* whose stretch is known; zero: none */
    bool warped;
    struct lumi_sphere_warp warp; /* of that lens, where it is warped */
};

struct features_state {
    int count;
    struct worker *workers;
};

static bool wanted(const struct lumi_run *run, int index)
{
    (void)index;
    return run->wants.calibrate || run->wants.equalize;
}

static int key(struct lumi_run *run, int index, struct lumi_key *key, struct lumi_error *error)
{
    lumi_key_image(key, run, index);
    lumi_key_lens(key, &run->sources[index].lens);
    return lumi_rig_mask_key(key, run, index, error);
}

static int begin(struct lumi_run *run, void **result, struct lumi_error *error)
{
    struct features_state *state = g_new0(struct features_state, 1);

    (void)error;
    state->count = run->threads > 0 ? run->threads : lumi_thread_count();
    state->workers = g_new0(struct worker, (gsize)state->count);
    *result = state;
    return LUMI_OK;
}

static void end(struct lumi_run *run, void *data)
{
    struct features_state *state = data;

    (void)run;
    for (int i = 0; i < state->count; i++) {
        lumi_sift_destroy(state->workers[i].sift);
        lumi_sphere_warp_finish(&state->workers[i].warp);
    }
    g_free(state->workers);
    g_free(state);
}

static int prepare(struct worker *worker, const struct lumi_lens *lens, struct lumi_error *error)
{
    if (!worker->sift)
        worker->sift = lumi_sift_create();
    if (!worker->sift)
        return lumi_fail(error, LUMI_ERR_NOMEM, "not enough memory to find features");
    if (lumi_lens_equal(&worker->lens, lens))
        return LUMI_OK;
    lumi_sphere_warp_finish(&worker->warp);
    worker->warped = lumi_lens_stretch(lens) > STRETCH_MOST;
    if (worker->warped)
        LUMI_TRY(lumi_sphere_warp_init(&worker->warp, lens, error));
    worker->lens = *lens;
    return LUMI_OK;
}

/* The picture in grey, and its mean. *grey is released with lumi_free. */
static int read_grey(const char *path, const struct lumi_lens *lens, float **grey, float *mean,
                     struct lumi_error *error)
{
    int width, height;
    double sum = 0;

    LUMI_TRY(lumi_grey_read(path, grey, &width, &height, error));
    if (width != lens->width || height != lens->height)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: is %d×%d pixels, its lens %d×%d", path, width, height,
                         lens->width, lens->height);
    const size_t count = (size_t)width * (size_t)height;
    for (size_t i = 0; i < count; i++)
        sum += (*grey)[i];
    *mean = (float)(sum / (double)count / 255);
    return LUMI_OK;
}

/* Places in the resampled picture become places in the original. */
static void bring_back(const struct lumi_sphere_warp *warp, struct lumi_features *features)
{
    int kept = 0;

    for (int i = 0; i < features->count; i++) {
        struct lumi_feature item = features->items[i];
        const double c = cos(item.orientation), s = sin(item.orientation);
        double x, y, ahead[2];
        if (!lumi_sphere_warp_back(warp, item.x, item.y, &x, &y) ||
            !lumi_sphere_warp_back(warp, item.x + 0.5 * c, item.y + 0.5 * s, &ahead[0], &ahead[1]) || x < 0 || y < 0 ||
            x > features->width || y > features->height)
            continue;
        item.scale *= (float)(2 * hypot(ahead[0] - x, ahead[1] - y));
        item.orientation = (float)atan2(ahead[1] - y, ahead[0] - x);
        item.x = (float)x;
        item.y = (float)y;
        if (item.scale > 0)
            features->items[kept++] = item;
    }
    features->count = kept;
}

static bool masked(const struct lumi_raster *mask, float x, float y)
{
    const int column = (int)x, row = (int)y;

    return mask->data && column < mask->width && row < mask->height && lumi_row_u8(mask, row)[column] == 0;
}

/* What may be used of the picture in which is searched: nothing of the rig. NULL: all. */
static int usable(const struct worker *worker, const struct lumi_raster *mask, int width, int height, uint8_t **use)
{
    *use = NULL;
    if (!mask->data && !worker->warped)
        return LUMI_OK;
    *use = lumi_alloc((size_t)width, (size_t)height);
    if (!*use)
        return LUMI_ERR_NOMEM;
    for (size_t i = 0; i < (size_t)width * (size_t)height; i++) {
        const float *at = worker->warped ? worker->warp.at + 2 * i : NULL;
        const float x = at ? at[0] : (float)(i % (size_t)width), y = at ? at[1] : (float)(i / (size_t)width);
        (*use)[i] = (!worker->warped || worker->warp.use[i]) && !masked(mask, x, y);
    }
    return LUMI_OK;
}

static int find(const struct worker *worker, const float *grey, const struct lumi_raster *mask,
                struct lumi_features *features, struct lumi_error *error)
{
    const int width = worker->warped ? worker->warp.width : features->width;
    const int height = worker->warped ? worker->warp.height : features->height;
    const double pixels = (double)features->width * features->height;
    struct lumi_sift_settings settings;
    float *warped = NULL;
    uint8_t *use;

    lumi_sift_defaults(&settings);
    settings.most = (int)fmin(4000, fmax(1000, 1.75 * sqrt(pixels)));
    settings.first_octave = pixels < 400e3 ? -1 : 0;
    int code = usable(worker, mask, width, height, &use);
    settings.use = use;
    if (code == LUMI_OK && worker->warped && !(warped = lumi_alloc((size_t)width * (size_t)height, sizeof *warped)))
        code = LUMI_ERR_NOMEM;
    if (code != LUMI_OK)
        lumi_fail(error, code, "not enough memory to find features");
    else if (worker->warped)
        lumi_sphere_warp_apply(&worker->warp, grey, warped);
    if (code == LUMI_OK)
        code = lumi_sift_find(worker->sift, warped ? warped : grey, width, height, &settings, &features->items,
                              &features->count, &features->sharpness, error);
    if (code == LUMI_OK && worker->warped)
        bring_back(&worker->warp, features);
    lumi_free(warped);
    lumi_free(use);
    return code;
}

static int make(struct lumi_run *run, void *data, int index, int thread, const char *path, struct lumi_error *error)
{
    struct features_state *state = data;
    struct worker *worker = &state->workers[thread];
    const struct lumi_lens *lens = &run->sources[index].lens;
    struct lumi_features features = {.width = lens->width, .height = lens->height};
    struct lumi_raster mask = {0};
    g_autofree char *image = lumi_run_image(run, index);
    float *grey = NULL;
    int code;

    LUMI_GOTO(code, done, prepare(worker, lens, error));
    LUMI_GOTO(code, done, read_grey(image, lens, &grey, &features.mean, error));
    LUMI_GOTO(code, done, lumi_rig_mask_read(run, index, &mask, error));
    LUMI_GOTO(code, done, find(worker, grey, &mask, &features, error));
    code = lumi_features_write(path, &features, error);
done:
    lumi_free(grey);
    lumi_raster_finish(&mask);
    lumi_features_finish(&features);
    return code;
}

const struct lumi_stage lumi_stage_features = {
    .name = "features",
    .title = "finding features",
    .version = 2,
    .extension = ".feat",
    .set = LUMI_SET_FRAMES,
    .wanted = wanted,
    .key = key,
    .begin = begin,
    .end = end,
    .make = make,
    .bytes_per_pixel = 120,
};
