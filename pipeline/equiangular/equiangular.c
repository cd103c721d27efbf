/* The stage `equiangular` (Overbeck et al. 2018, section 7.1). */
#include "pipeline/equiangular/equiangular.h"

#include "pipeline/equiangular/gains.h"
#include "pipeline/equiangular/warp.h"
#include "proto/base/memory.h"
#include "proto/base/parallel.h"
#include "proto/image/image.h"

#include <glib.h>
#include <string.h>

/* Lenses whose warps are kept from image to image (10 bytes a pixel and lens); captures with a lens of its own for
 * every image make each warp when its image comes. */
enum { KEPT_WARPS = 16 };

struct state {
    int count;
    struct lumi_lens lenses[KEPT_WARPS];
    struct lumi_warp *warps[KEPT_WARPS];
    struct lumi_gains gains; /* none where nothing is equalised */
};

static int key(struct lumi_run *run, int index, struct lumi_key *k, struct lumi_error *error)
{
    (void)error;
    lumi_key_image(k, run, index);
    lumi_key_lens(k, &run->sources[index].lens);
    lumi_key_grid(k, &run->grid);
    if (run->wants.equalize)
        lumi_key_input(k, run, "equalize", -1);
    return LUMI_OK;
}

static void end(struct lumi_run *run, void *pointer)
{
    struct state *state = pointer;

    (void)run;
    if (!state)
        return;
    for (int i = 0; i < state->count; i++)
        lumi_warp_destroy(state->warps[i]);
    lumi_gains_finish(&state->gains);
    lumi_free(state);
}

struct making {
    struct state *state;
    const struct lumi_grid *grid;
    struct lumi_error errors[KEPT_WARPS];
};

static int make_warp(void *context, int index, int thread)
{
    struct making *making = context;

    (void)thread;
    return lumi_warp_create(&making->state->lenses[index], making->grid, &making->state->warps[index],
                            &making->errors[index]);
}

static int read_gains(const struct lumi_run *run, struct lumi_gains *gains, struct lumi_error *error)
{
    g_autofree char *path = lumi_run_path(run, "equalize", -1, ".json");

    return lumi_gains_read(path, gains, error);
}

static int begin(struct lumi_run *run, void **pointer, struct lumi_error *error)
{
    struct state *state = lumi_calloc(1, sizeof *state);
    struct making *making = lumi_calloc(1, sizeof *making);
    int result = LUMI_OK;

    if (!state || !making) {
        result = lumi_fail(error, LUMI_ERR_NOMEM, "out of memory");
        goto done;
    }
    if (run->wants.equalize)
        LUMI_GOTO(result, done, read_gains(run, &state->gains, error));
    for (int i = 0; i < run->count && state->count < KEPT_WARPS; i++) {
        const struct lumi_lens *lens = &run->sources[i].lens;
        int k = 0;
        while (k < state->count && !lumi_lens_equal(&state->lenses[k], lens))
            k++;
        if (k == state->count && !lumi_warp_is_copy(lens, &run->grid))
            state->lenses[state->count++] = *lens;
    }
    *making = (struct making){.state = state, .grid = &run->grid};
    result = lumi_parallel_for(state->count, run->threads, make_warp, making);
    for (int i = 0; result != LUMI_OK && i < state->count; i++)
        if (making->errors[i].code == result && error)
            *error = making->errors[i];
done:
    lumi_free(making);
    if (result != LUMI_OK) {
        end(run, state);
        state = NULL;
    }
    *pointer = state;
    return result;
}

/* The frame as 3-channel linear floats. */
static int read_linear(const struct lumi_run *run, int index, struct lumi_raster *linear, struct lumi_error *error)
{
    const struct lumi_source *source = &run->sources[index];
    g_autofree char *path = lumi_run_image(run, index);
    struct lumi_raster raster;

    *linear = (struct lumi_raster){0};
    LUMI_TRY(lumi_source_read(source, path, &raster, error));
    int result = LUMI_OK;
    if (raster.width != source->lens.width || raster.height != source->lens.height) {
        result = lumi_fail(error, LUMI_ERR_FORMAT, "%s: the image is %d × %d, its camera %d × %d", path, raster.width,
                           raster.height, source->lens.width, source->lens.height);
    } else if (raster.sample == LUMI_F32) {
        *linear = raster;
        raster = (struct lumi_raster){0};
    } else if (lumi_raster_convert(&raster, LUMI_F32, linear) != LUMI_OK) {
        result = lumi_fail(error, LUMI_ERR_NOMEM, "%s: out of memory", path);
    }
    lumi_raster_finish(&raster);
    return result;
}

static int resample(const struct lumi_run *run, const struct state *state, const struct lumi_source *source,
                    struct lumi_raster *image, struct lumi_error *error)
{
    struct lumi_warp *own = NULL;
    const struct lumi_warp *warp = NULL;
    struct lumi_raster view;

    for (int i = 0; i < state->count && !warp; i++)
        if (lumi_lens_equal(&state->lenses[i], &source->lens))
            warp = state->warps[i];
    if (!warp) {
        LUMI_TRY(lumi_warp_create(&source->lens, &run->grid, &own, error));
        warp = own;
    }
    int result = lumi_warp_apply(warp, image, &view, error);
    lumi_warp_destroy(own);
    if (result == LUMI_OK) {
        lumi_raster_finish(image);
        *image = view;
    }
    return result;
}

static int make(struct lumi_run *run, void *pointer, int index, int thread, const char *path, struct lumi_error *error)
{
    struct state *state = pointer;
    const struct lumi_source *source = &run->sources[index];
    struct lumi_image_options options;
    struct lumi_raster image;

    (void)thread;
    LUMI_TRY(read_linear(run, index, &image, error));
    int result = LUMI_OK;
    if (state->gains.count > 0)
        lumi_gains_apply(&state->gains, lumi_gains_find(&state->gains, source->name), &source->lens,
                         source->part_count == 0, &image);
    if (!lumi_warp_is_copy(&source->lens, &run->grid)) {
        result = resample(run, state, source, &image, error);
        if (result != LUMI_OK)
            lumi_fail_prefix(error, "%s", source->path);
    }
    if (result == LUMI_OK) {
        lumi_image_options_init(&options);
        options.format = LUMI_IMAGE_EXR;
        options.half = true;
        result = lumi_image_write(path, &image, &options, error);
    }
    lumi_raster_finish(&image);
    return result;
}

const struct lumi_stage lumi_stage_equiangular = {
    .name = "equiangular",
    .title = "equiangular",
    .version = 1,
    .extension = ".exr",
    .set = LUMI_SET_DENSE,
    .bytes_per_pixel = 60,
    .key = key,
    .begin = begin,
    .end = end,
    .make = make,
};
