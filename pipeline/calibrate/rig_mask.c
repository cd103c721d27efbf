/* The stage "masks", and the masks a frame has: found, drawn by hand. */
#include "pipeline/calibrate/rig_mask.h"

#include "pipeline/calibrate/grey.h"
#include "pipeline/calibrate/mask_find.h"
#include "pipeline/run/key.h"
#include "proto/base/file.h"
#include "proto/base/memory.h"

#include <glib.h>
#include <math.h>
#include <string.h>

enum {
    SAMPLE = 24, /* frames of a camera that are looked at */
    FEWEST = 8,
    ACROSS = 320 /* blocks a picture is looked at in */
};
#define DRAWING_MOST ((size_t)64 << 20)

/* Frames of a camera whose headings differ, evenly chosen. */
static int sample_of(const struct lumi_run *run, int camera, int sample[SAMPLE])
{
    g_autofree int *all = g_new(int, (gsize)run->count);
    int count = 0, taken = 0;

    for (int i = 0; i < run->count; i++)
        if (run->sources[i].camera == camera)
            all[count++] = i;
    if (count < FEWEST)
        return 0;
    /* A stride that is no divisor of a turn: not the same headings turn after turn. */
    for (; taken < SAMPLE && taken < count; taken++)
        sample[taken] = all[(long)taken * count / (count < SAMPLE ? count : SAMPLE)];
    double low = 1e9, high = -1e9;
    for (int i = 0; i < taken; i++) {
        const double angle = run->sources[sample[i]].turn_angle;
        low = fmin(low, angle);
        high = fmax(high, angle);
    }
    return high - low > LUMI_PI ? taken : 0;
}

static bool wanted(const struct lumi_run *run, int index)
{
    (void)index;
    return run->rig && (run->wants.calibrate || run->wants.equalize || run->wants.synthesize);
}

static int key(struct lumi_run *run, int index, struct lumi_key *key, struct lumi_error *error)
{
    (void)index, (void)error;
    lumi_key_int(key, run->count);
    for (int i = 0; i < run->count; i++) {
        lumi_key_int(key, run->sources[i].camera);
        lumi_key_double(key, run->sources[i].turn_angle);
        lumi_key_image(key, run, i);
    }
    return LUMI_OK;
}

/* The means of blocks; NULL where there is no memory. */
static float *shrink(const float *grey, const struct lumi_mask *mask)
{
    const int across = lumi_mask_across(mask), down = lumi_mask_down(mask), block = mask->block;
    float *small = lumi_alloc((size_t)across * (size_t)down, sizeof *small);

    for (int i = 0; small && i < across * down; i++) {
        double sum = 0;
        int count = 0;
        for (int y = i / across * block; y < mask->height && y < (i / across + 1) * block; y++)
            for (int x = i % across * block; x < mask->width && x < (i % across + 1) * block; x++, count++)
                sum += fminf(grey[(size_t)y * (size_t)mask->width + (size_t)x], 255);
        small[i] = (float)(sum / count);
    }
    return small;
}

static int read_small(const struct lumi_run *run, int frame, struct lumi_mask *mask, float **small,
                      struct lumi_error *error)
{
    g_autofree char *path = lumi_run_image(run, frame);
    float *grey;
    int width, height;

    LUMI_TRY(lumi_grey_read(path, &grey, &width, &height, error));
    if (!mask->width)
        *mask =
            (struct lumi_mask){mask->camera, width, height, width > ACROSS ? (width + ACROSS - 1) / ACROSS : 1, NULL};
    int code = LUMI_OK;
    if (width != mask->width || height != mask->height)
        code = lumi_fail(error, LUMI_ERR_FORMAT, "%s: is %d×%d pixels, others of its camera %d×%d", path, width, height,
                         mask->width, mask->height);
    else if (!(*small = shrink(grey, mask)))
        code = lumi_fail(error, LUMI_ERR_NOMEM, "%s: not enough memory", path);
    lumi_free(grey);
    return code;
}

/* The mask of a camera; rig stays NULL where nothing of it is seen. */
static int find(const struct lumi_run *run, const int *sample, int count, struct lumi_mask *mask,
                struct lumi_error *error)
{
    float *small[SAMPLE] = {NULL};
    int code = LUMI_OK;

    for (int i = 0; i < count && code == LUMI_OK; i++)
        code = read_small(run, sample[i], mask, &small[i], error);
    if (code == LUMI_OK) {
        const int across = lumi_mask_across(mask), down = lumi_mask_down(mask);
        mask->rig = lumi_calloc((size_t)across * (size_t)down, 1);
        const int found = mask->rig ? lumi_mask_find((const float *const *)small, count, across, down, mask->rig) : -1;
        if (found < 0)
            code = lumi_fail(error, LUMI_ERR_NOMEM, "not enough memory to find the rig in its pictures");
        if (found <= 0) {
            lumi_free(mask->rig);
            mask->rig = NULL;
        }
    }
    for (int i = 0; i < count; i++)
        lumi_free(small[i]);
    return code;
}

static int make(struct lumi_run *run, void *state, int index, int thread, const char *path, struct lumi_error *error)
{
    struct lumi_masks masks = {0};
    int cameras = 0, code = LUMI_OK, sample[SAMPLE];

    (void)state, (void)index, (void)thread;
    for (int i = 0; i < run->count; i++)
        cameras = run->sources[i].camera >= cameras ? run->sources[i].camera + 1 : cameras;
    masks.items = lumi_calloc((size_t)(cameras ? cameras : 1), sizeof *masks.items);
    if (!masks.items)
        code = lumi_fail(error, LUMI_ERR_NOMEM, "not enough memory to find the rig in its pictures");
    for (int camera = 0; camera < cameras && code == LUMI_OK; camera++) {
        const int count = sample_of(run, camera, sample);
        struct lumi_mask *mask = &masks.items[masks.count];
        mask->camera = camera;
        if (count)
            code = find(run, sample, count, mask, error);
        if (mask->rig)
            masks.count++;
        else
            *mask = (struct lumi_mask){0};
    }
    if (code == LUMI_OK)
        code = lumi_masks_write(path, &masks, error);
    lumi_masks_finish(&masks);
    return code;
}

/* The drawing for a frame, by its own name or its camera's; NULL: none. */
static char *drawing_of(const struct lumi_run *run, int index)
{
    const char *names[2] = {run->sources[index].name, run->sources[index].camera_name};

    for (int i = 0; run->parameters.masks && i < 2; i++) {
        g_autofree char *name = g_strconcat(names[i], ".png", NULL);
        char *path = g_build_filename(run->parameters.masks, name, NULL);
        if (names[i][0] && g_file_test(path, G_FILE_TEST_IS_REGULAR))
            return path;
        g_free(path);
    }
    return NULL;
}

int lumi_rig_mask_key(struct lumi_key *key, const struct lumi_run *run, int index, struct lumi_error *error)
{
    g_autofree char *drawing = drawing_of(run, index);
    uint8_t *data;
    size_t size;

    if (wanted(run, -1))
        lumi_key_input(key, run, lumi_stage_masks.name, -1);
    lumi_key_int(key, drawing != NULL);
    if (!drawing)
        return LUMI_OK;
    LUMI_TRY(lumi_file_read(drawing, DRAWING_MOST, &data, &size, error));
    lumi_key_bytes(key, data, size);
    lumi_free(data);
    return LUMI_OK;
}

static int blank(const struct lumi_run *run, int index, struct lumi_raster *raster, struct lumi_error *error)
{
    const struct lumi_lens *lens = &run->sources[index].lens;

    if (raster->data)
        return LUMI_OK;
    if (lumi_raster_create(raster, lens->width, lens->height, 1, LUMI_U8))
        return lumi_fail(error, LUMI_ERR_NOMEM, "not enough memory for a mask");
    for (int y = 0; y < raster->height; y++)
        memset(lumi_row_u8(raster, y), 255, (size_t)raster->width);
    return LUMI_OK;
}

static int take_found(const struct lumi_run *run, int index, struct lumi_raster *raster, struct lumi_error *error)
{
    g_autofree char *path = lumi_run_path(run, lumi_stage_masks.name, -1, lumi_stage_masks.extension);
    struct lumi_masks masks;
    int code = LUMI_OK;

    LUMI_TRY(lumi_masks_read(path, &masks, error));
    for (int m = 0; m < masks.count && code == LUMI_OK; m++) {
        const struct lumi_mask *mask = &masks.items[m];
        const struct lumi_source *source = &run->sources[index];
        if (mask->camera != source->camera || mask->width != source->lens.width || mask->height != source->lens.height)
            continue;
        code = blank(run, index, raster, error);
        for (int y = 0; code == LUMI_OK && y < raster->height; y++)
            for (int x = 0; x < raster->width; x++)
                if (mask->rig[y / mask->block * lumi_mask_across(mask) + x / mask->block])
                    lumi_row_u8(raster, y)[x] = 0;
    }
    lumi_masks_finish(&masks);
    return code;
}

static int take_drawn(const struct lumi_run *run, int index, const char *path, struct lumi_raster *raster,
                      struct lumi_error *error)
{
    float *grey;
    int width, height;

    LUMI_TRY(lumi_grey_read(path, &grey, &width, &height, error));
    int code = blank(run, index, raster, error);
    if (code == LUMI_OK && (width != raster->width || height != raster->height))
        code = lumi_fail(error, LUMI_ERR_FORMAT, "%s: is %d×%d pixels, the picture of %s %d×%d", path, width, height,
                         run->sources[index].name, raster->width, raster->height);
    for (int y = 0; code == LUMI_OK && y < height; y++)
        for (int x = 0; x < width; x++)
            if (grey[(size_t)y * (size_t)width + (size_t)x] < 128)
                lumi_row_u8(raster, y)[x] = 0;
    lumi_free(grey);
    return code;
}

int lumi_rig_mask_read(const struct lumi_run *run, int index, struct lumi_raster *raster, struct lumi_error *error)
{
    g_autofree char *drawing = drawing_of(run, index);
    int code = LUMI_OK;

    *raster = (struct lumi_raster){0};
    if (run->sources[index].synthetic)
        return LUMI_OK;
    if (wanted(run, -1))
        code = take_found(run, index, raster, error);
    if (code == LUMI_OK && drawing)
        code = take_drawn(run, index, drawing, raster, error);
    if (code != LUMI_OK)
        lumi_raster_finish(raster);
    return code;
}

const struct lumi_stage lumi_stage_masks = {
    .name = "masks",
    .title = "finding the rig in its pictures",
    .version = 1,
    .extension = ".masks",
    .whole = true,
    .set = LUMI_SET_FRAMES,
    .wanted = wanted,
    .key = key,
    .make = make,
    .bytes_per_pixel = 20,
};
