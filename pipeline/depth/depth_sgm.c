/* Semi-global matching (Hirschmüller 2008, "Stereo processing by semiglobal matching and mutual information"): eight
 * paths, the penalty of a jump lower where the colour jumps. The image is worked in bands that overlap, so that the
 * sums need little memory and threads have something to share. */
#include "pipeline/depth/mvs_priv.h"
#include "proto/base/memory.h"
#include "proto/base/parallel.h"

#include <stdlib.h>
#include <string.h>

enum { BAND_ROWS = 128, BAND_OVERLAP = 32, PAD = 16 };

struct sgm_job {
    const struct mvs_image *image;
    const struct mvs_kernels *kernels;
    const uint8_t *volume;
    int planes;
    float *result;
};

/* The three paths that come from the row before, and the one along the row. lines[d][x] with PAD before and after. */
struct sgm_scratch {
    int16_t *before[3], *now[3], *along[2];
    int *lowest_before[3], *lowest_now[3];
    uint16_t *sum;
    void *block, *lowest_block;
};

static int p1_of = 4, p2_low = 12, p2_high = 60, p2_slope = 2;

static int jump_penalty(uint32_t a, uint32_t b)
{
    int largest = 0;

    for (int shift = 0; shift < 24; shift += 8) {
        int difference = abs((int)(a >> shift & 255) - (int)(b >> shift & 255));
        largest = difference > largest ? difference : largest;
    }
    int penalty = p2_high - p2_slope * largest;
    return penalty > p2_low ? penalty : p2_low;
}

static int scratch_init(struct sgm_scratch *scratch, int width, int rows, int planes)
{
    const size_t line = (size_t)planes + 2 * PAD, lines = line * (size_t)width;

    memset(scratch, 0, sizeof(*scratch));
    scratch->block = lumi_alloc(6 * lines + 2 * line, sizeof(int16_t));
    scratch->lowest_block = lumi_alloc(6 * (size_t)width, sizeof(int));
    scratch->sum = lumi_calloc((size_t)rows * (size_t)width * (size_t)planes, sizeof(uint16_t));
    if (!scratch->block || !scratch->lowest_block || !scratch->sum)
        return LUMI_ERR_NOMEM;
    int16_t *at = (int16_t *)scratch->block + PAD;
    for (int d = 0; d < 3; d++) {
        scratch->before[d] = at + (size_t)(2 * d) * lines;
        scratch->now[d] = at + (size_t)(2 * d + 1) * lines;
        scratch->lowest_before[d] = (int *)scratch->lowest_block + (size_t)(2 * d) * (size_t)width;
        scratch->lowest_now[d] = (int *)scratch->lowest_block + (size_t)(2 * d + 1) * (size_t)width;
    }
    scratch->along[0] = at + 6 * lines;
    scratch->along[1] = at + 6 * lines + line;
    return LUMI_OK;
}

static void scratch_finish(struct sgm_scratch *scratch)
{
    lumi_free(scratch->block);
    lumi_free(scratch->lowest_block);
    lumi_free(scratch->sum);
}

/* A path begins: its costs are the pixel's own. */
static int path_begin(const uint8_t *cost, int planes, int16_t *path, uint16_t *sum)
{
    int lowest = INT16_MAX;

    for (int k = 0; k < planes; k++) {
        path[k] = cost[k];
        sum[k] = (uint16_t)(sum[k] + cost[k]);
        lowest = cost[k] < lowest ? cost[k] : lowest;
    }
    return lowest;
}

/* One row of a pass. step: +1 rightwards and from above, −1 leftwards and from below. */
static void pass_row(const struct sgm_job *job, struct sgm_scratch *s, int y, bool first, int step, uint16_t *sums)
{
    const int width = job->image->width, planes = job->planes;
    const size_t line = (size_t)planes + 2 * PAD;
    const uint32_t *pixels = job->image->pixels + (size_t)y * (size_t)width;
    const uint32_t *pixels_before = first ? pixels : pixels - step * width;
    int lowest_along = 0;

    for (int i = 0; i < width; i++) {
        const int x = step > 0 ? i : width - 1 - i;
        const uint8_t *cost = job->volume + ((size_t)y * (size_t)width + (size_t)x) * (size_t)planes;
        uint16_t *sum = sums + (size_t)x * (size_t)planes;
        if (i == 0)
            lowest_along = path_begin(cost, planes, s->along[i & 1], sum);
        else
            lowest_along = job->kernels->path(cost, s->along[(i - 1) & 1], lowest_along, p1_of,
                                              jump_penalty(pixels[x], pixels[x - step]), planes, s->along[i & 1], sum);
        for (int d = 0; d < 3; d++) {
            const int from = x + d - 1;
            int16_t *now = s->now[d] + (size_t)x * line;
            if (first || from < 0 || from >= width)
                s->lowest_now[d][x] = path_begin(cost, planes, now, sum);
            else
                s->lowest_now[d][x] =
                    job->kernels->path(cost, s->before[d] + (size_t)from * line, s->lowest_before[d][from], p1_of,
                                       jump_penalty(pixels[x], pixels_before[from]), planes, now, sum);
        }
    }
    for (int d = 0; d < 3; d++) {
        int16_t *lines = s->before[d];
        int *lowest = s->lowest_before[d];
        s->before[d] = s->now[d];
        s->now[d] = lines;
        s->lowest_before[d] = s->lowest_now[d];
        s->lowest_now[d] = lowest;
    }
}

/* The plane with the smallest sum, to a fraction by the parabola through its neighbours. */
static float pick(const uint16_t *sum, int planes)
{
    unsigned lowest = UINT16_MAX + 1u;
    int best = 0;

    for (int k = 0; k < planes; k++)
        if (sum[k] < lowest) {
            lowest = sum[k];
            best = k;
        }
    if (best == 0 || best == planes - 1)
        return (float)best;
    float before = sum[best - 1], after = sum[best + 1], curve = before - 2 * (float)lowest + after;
    return (float)best + (curve > 0 ? 0.5f * (before - after) / curve : 0);
}

static int sgm_band(void *context, int band, int thread)
{
    const struct sgm_job *job = context;
    const int width = job->image->width, height = job->image->height, planes = job->planes;
    const int top = band * BAND_ROWS, bottom = top + BAND_ROWS < height ? top + BAND_ROWS : height;
    const int first = top > BAND_OVERLAP ? top - BAND_OVERLAP : 0;
    const int last = bottom + BAND_OVERLAP < height ? bottom + BAND_OVERLAP : height;
    const size_t row = (size_t)width * (size_t)planes;
    struct sgm_scratch scratch;
    int code;

    (void)thread;
    LUMI_GOTO(code, done, scratch_init(&scratch, width, last - first, planes));
    for (int y = first; y < bottom; y++)
        pass_row(job, &scratch, y, y == first, 1, scratch.sum + (size_t)(y - first) * row);
    for (int y = last - 1; y >= top; y--)
        pass_row(job, &scratch, y, y == last - 1, -1, scratch.sum + (size_t)(y - first) * row);
    for (int y = top; y < bottom; y++)
        for (int x = 0; x < width; x++)
            job->result[(size_t)y * (size_t)width + (size_t)x] =
                pick(scratch.sum + (size_t)(y - first) * row + (size_t)x * (size_t)planes, planes);
done:
    scratch_finish(&scratch);
    return code;
}

int mvs_sgm(const struct mvs_image *image, const uint8_t *volume, int planes, int threads, float *result)
{
    struct sgm_job job = {image, mvs_kernels(), volume, planes, result};
    const int bands = (image->height + BAND_ROWS - 1) / BAND_ROWS;

    return lumi_parallel_for(bands, threads, sgm_band, &job);
}
