/* Holes take what is around them: push and pull over a pyramid (Gortler et al. 1996), in which of the pixels that meet
 * only the farthest are averaged, so that what is behind closes in, not what stands before it. */
#include "pipeline/synthesize/view_synthesis.h"
#include "proto/base/memory.h"

#include <string.h>

enum { LEVELS = 18 };

struct level {
    int width, height;
    float *values; /* R, G, B, inverse depth; then weight */
};

static float *at(const struct level *level, int x, int y)
{
    return level->values + 5 * ((size_t)y * (size_t)level->width + (size_t)x);
}

/* The mean of those within `tolerance` of the farthest. */
static void mean_of_farthest(const float *const *items, const float *weights, int count, float tolerance, float *result)
{
    float farthest = INFINITY, sum[4] = {0}, weight = 0, most = 0;

    for (int i = 0; i < count; i++)
        if (weights[i] > 0 && items[i][3] < farthest)
            farthest = items[i][3];
    for (int i = 0; i < count; i++) {
        if (!(weights[i] > 0) || items[i][3] > farthest + tolerance)
            continue;
        for (int c = 0; c < 4; c++)
            sum[c] += weights[i] * items[i][c];
        weight += weights[i];
        most = fmaxf(most, items[i][4]);
    }
    for (int c = 0; c < 4 && weight > 0; c++)
        result[c] = sum[c] / weight;
    result[4] = weight > 0 ? most : 0;
}

static void push(const struct level *fine, const struct level *coarse, float tolerance)
{
    for (int y = 0; y < coarse->height; y++)
        for (int x = 0; x < coarse->width; x++) {
            const float *items[4];
            float weights[4];
            int count = 0;
            for (int i = 0; i < 4; i++) {
                const int fx = 2 * x + (i & 1), fy = 2 * y + (i >> 1);
                if (fx < fine->width && fy < fine->height) {
                    items[count] = at(fine, fx, fy);
                    weights[count] = items[count][4];
                    count++;
                }
            }
            mean_of_farthest(items, weights, count, tolerance, at(coarse, x, y));
        }
}

/* Pixels without a weight, between the four coarse ones around them. */
static void pull(const struct level *fine, const struct level *coarse, float tolerance)
{
    for (int y = 0; y < fine->height; y++)
        for (int x = 0; x < fine->width; x++) {
            const float *items[4];
            float weights[4];
            const int x0 = x / 2, y0 = y / 2, x1 = x0 + (x & 1 ? 1 : -1), y1 = y0 + (y & 1 ? 1 : -1);
            if (at(fine, x, y)[4] > 0)
                continue;
            for (int i = 0; i < 4; i++) {
                const int cx = i & 1 ? x1 : x0, cy = i & 2 ? y1 : y0;
                const bool there = cx >= 0 && cy >= 0 && cx < coarse->width && cy < coarse->height;
                items[i] = at(coarse, there ? cx : x0, there ? cy : y0);
                weights[i] = items[i][4] > 0 ? (i & 1 ? 0.25f : 0.75f) * (i & 2 ? 0.25f : 0.75f) : 0;
            }
            mean_of_farthest(items, weights, 4, tolerance, at(fine, x, y));
        }
}

static void load(const struct lumi_raster *image, const struct lumi_raster *depth, const uint8_t *known,
                 const struct level *level)
{
    for (int y = 0; y < image->height; y++)
        for (int x = 0; x < image->width; x++) {
            float *value = at(level, x, y);
            memcpy(value, lumi_row_f32(image, y) + 3 * (size_t)x, 3 * sizeof *value);
            value[3] = lumi_row_f32(depth, y)[x];
            value[4] = known[(size_t)y * (size_t)image->width + (size_t)x] ? 1 : 0;
        }
}

static void store(const struct level *level, const uint8_t *known, struct lumi_raster *image, struct lumi_raster *depth)
{
    for (int y = 0; y < image->height; y++)
        for (int x = 0; x < image->width; x++) {
            const float *value = at(level, x, y);
            if (known[(size_t)y * (size_t)image->width + (size_t)x] || !(value[4] > 0))
                continue;
            memcpy(lumi_row_f32(image, y) + 3 * (size_t)x, value, 3 * sizeof *value);
            lumi_row_f32(depth, y)[x] = value[3];
        }
}

int lumi_synthesis_fill(struct lumi_raster *image, struct lumi_raster *depth, const uint8_t *known, double tolerance)
{
    struct level levels[LEVELS];
    int count = 0, code = LUMI_OK, width = image->width, height = image->height;

    do {
        levels[count] = (struct level){width, height, lumi_calloc((size_t)width * (size_t)height, 5 * sizeof(float))};
        if (!levels[count].values)
            code = LUMI_ERR_NOMEM;
        count++;
        if (width == 1 && height == 1)
            break;
        width = (width + 1) / 2;
        height = (height + 1) / 2;
    } while (count < LEVELS && code == LUMI_OK);
    if (code == LUMI_OK) {
        load(image, depth, known, &levels[0]);
        for (int i = 0; i + 1 < count; i++)
            push(&levels[i], &levels[i + 1], (float)tolerance);
        for (int i = count - 2; i >= 0; i--)
            pull(&levels[i], &levels[i + 1], (float)tolerance);
        store(&levels[0], known, image, depth);
    }
    for (int i = 0; i < count; i++)
        lumi_free(levels[i].values);
    return code;
}
