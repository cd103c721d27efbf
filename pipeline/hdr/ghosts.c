/* What moved between two shots: their difference over 3 × 3 pixels against what noise, a slightly wrong exposure and a
 * quarter of a pixel of shift explain. */
#include "pipeline/hdr/ghosts.h"

#include <math.h>

#define WHITE 0.98f     /* at and above: clipped */
#define NEAR_WHITE 0.9f /* from here on a value counts less */
#define RELATIVE 0.03f  /* of the value: response and exposure are not exact */
#define SHIFT 0.25f     /* pixels */
#define AGREES 2.0f     /* standard deviations: up to here nothing moved */
#define DIFFERS 4.0f    /* and from here on something did */
enum { GROW = 4, SOFTEN = 3 };

float lumi_shot_variance(const struct lumi_shot *shot, const struct lumi_merge_options *options, float v)
{
    const float well = (float)options->full_well, noise = (float)options->read_noise / well;
    const float light = fmaxf(v, 0);
    /* How steeply light rises with an sRGB code here. */
    const float slope = fmaxf(2.27f * powf(light, 0.583f), 1 / 12.92f), step = shot->quantum * slope;

    return light / well + noise * noise + step * step / 6; /* twice a uniform code's: pictures were compressed */
}

float lumi_shot_trust(const float pixel[3])
{
    float t = (WHITE - fmaxf(pixel[0], fmaxf(pixel[1], pixel[2]))) / (WHITE - NEAR_WHITE);

    t = fminf(fmaxf(t, 0), 1);
    return t * t * (3 - 2 * t);
}

static int clamp(int value, int size)
{
    return value < 0 ? 0 : value >= size ? size - 1 : value;
}

/* Of one pixel, in the reference's units: the difference by its standard deviation, with its sign. */
static void differ(const struct lumi_shot *reference, const struct lumi_shot *shot, float scale,
                   const struct lumi_merge_options *options, int x, int y, float out[3])
{
    const struct lumi_raster *r = &reference->light;
    const float *here = lumi_row_f32(r, y) + 3 * x, *other = lumi_row_f32(&shot->light, y) + 3 * x;
    const float *left = lumi_row_f32(r, y) + 3 * clamp(x - 1, r->width);
    const float *right = lumi_row_f32(r, y) + 3 * clamp(x + 1, r->width);
    const float *above = lumi_row_f32(r, clamp(y - 1, r->height)) + 3 * x;
    const float *below = lumi_row_f32(r, clamp(y + 1, r->height)) + 3 * x;
    const bool clipped = fmaxf(here[0], fmaxf(here[1], here[2])) >= WHITE;

    if (lumi_shot_trust(other) < 0.5f) {
        /* A clipped shot says that there was at least so much light: the reference must have seen that too. */
        for (int c = 0; c < 3; c++) {
            float least = other[c] >= WHITE ? WHITE * scale : 0, sigma = RELATIVE * least + 1e-4f;
            out[c] = clipped ? 0 : fmaxf(least - here[c], 0) / sigma;
        }
        return;
    }
    for (int c = 0; c < 3; c++) {
        float value = other[c] * scale;
        float edge = SHIFT * (fmaxf(fabsf(right[c] - here[c]), fabsf(here[c] - left[c])) +
                              fmaxf(fabsf(below[c] - here[c]), fabsf(here[c] - above[c])));
        float relative = RELATIVE * fmaxf(value, here[c]);
        float variance = lumi_shot_variance(reference, options, here[c]) +
                         scale * scale * lumi_shot_variance(shot, options, other[c]) + relative * relative +
                         edge * edge;
        float difference = value - here[c];
        /* What the reference clipped may have been any brighter. */
        if (clipped)
            difference = here[c] >= WHITE ? fminf(value - WHITE, 0) : 0;
        out[c] = difference / sqrtf(variance);
    }
}

/* Largest (grow) or mean value of a row or column of 2 · reach + 1. */
static void spread(const struct lumi_raster *from, struct lumi_raster *to, bool across, int reach, bool grow)
{
    for (int y = 0; y < from->height; y++)
        for (int x = 0; x < from->width; x++) {
            float most = 0, sum = 0;
            for (int i = -reach; i <= reach; i++) {
                float v =
                    lumi_row_f32(from, across ? y : clamp(y + i, from->height))[across ? clamp(x + i, from->width) : x];
                most = fmaxf(most, v);
                sum += v;
            }
            lumi_row_f32(to, y)[x] = grow ? most : sum / (float)(2 * reach + 1);
        }
}

/* The strongest channel of the mean over 3 × 3 pixels, as a share between agreeing and differing. */
static void judge(const struct lumi_raster *differences, struct lumi_raster *map)
{
    for (int y = 0; y < map->height; y++)
        for (int x = 0; x < map->width; x++) {
            float sum[3] = {0, 0, 0}, most = 0;
            for (int i = 0; i < 9; i++) {
                const float *d =
                    lumi_row_f32(differences, clamp(y - 1 + i / 3, map->height)) + 3 * clamp(x - 1 + i % 3, map->width);
                for (int c = 0; c < 3; c++)
                    sum[c] += d[c] / 9;
            }
            for (int c = 0; c < 3; c++)
                most = fmaxf(most, fabsf(sum[c]));
            float t = fminf(fmaxf((most - AGREES) / (DIFFERS - AGREES), 0), 1);
            lumi_row_f32(map, y)[x] = t;
        }
}

int lumi_ghosts_find(const struct lumi_shot *reference, const struct lumi_shot *shot, float scale,
                     const struct lumi_merge_options *options, struct lumi_raster *map, double *share,
                     struct lumi_error *error)
{
    const int width = reference->light.width, height = reference->light.height;
    struct lumi_raster differences = {0}, other = {0};
    long many = 0;

    *map = (struct lumi_raster){0};
    int code = lumi_raster_create(&differences, width, height, 3, LUMI_F32);
    if (code == LUMI_OK)
        code = lumi_raster_create(map, width, height, 1, LUMI_F32);
    if (code == LUMI_OK)
        code = lumi_raster_create(&other, width, height, 1, LUMI_F32);
    if (code != LUMI_OK) {
        lumi_raster_finish(map);
        lumi_fail(error, code, "no memory to look for what moved");
        goto done;
    }
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++)
            differ(reference, shot, scale, options, x, y, lumi_row_f32(&differences, y) + 3 * x);
    judge(&differences, map);
    spread(map, &other, true, GROW, true);
    spread(&other, map, false, GROW, true);
    spread(map, &other, true, SOFTEN, false);
    spread(&other, map, false, SOFTEN, false);
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++)
            many += lumi_row_f32(map, y)[x] > 0.5f;
    *share = (double)many / ((double)width * height);
done:
    lumi_raster_finish(&differences);
    lumi_raster_finish(&other);
    return code;
}
