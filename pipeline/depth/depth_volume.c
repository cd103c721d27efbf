/* The plane sweep: costs of every plane at every pixel, over the neighbours that see it best (after Collins 1996, "A
 * space-sweep approach to true multi-image matching"; the choice of neighbours is Kang, Szeliski and Chai 2001,
 * "Handling occlusions in dense multi-view stereo", temporal selection). */
#include "pipeline/depth/mvs_priv.h"
#include "proto/base/parallel.h"

#include <string.h>

struct volume_job {
    const struct mvs_image *image;
    const struct mvs_target *targets;
    const struct mvs_kernels *kernels;
    int count, planes;
    uint8_t *volume;
};

static void order(uint8_t *restrict a, uint8_t *restrict b, int planes)
{
    for (int k = 0; k < planes; k++) {
        uint8_t low = a[k] < b[k] ? a[k] : b[k], high = a[k] < b[k] ? b[k] : a[k];
        a[k] = low;
        b[k] = high;
    }
}

/* Sorts eight costs a plane (Batcher's odd-even merge network). */
static void sort_costs(uint8_t cost[LUMI_MVS_NEIGHBOURS][MVS_PLANES_MAX], int planes)
{
    static const uint8_t pairs[19][2] = {{0, 1}, {2, 3}, {4, 5}, {6, 7}, {0, 2}, {1, 3}, {4, 6}, {5, 7}, {1, 2}, {5, 6},
                                         {0, 4}, {1, 5}, {2, 6}, {3, 7}, {2, 4}, {3, 5}, {1, 2}, {3, 4}, {5, 6}};

    for (int i = 0; i < 19; i++)
        order(cost[pairs[i][0]], cost[pairs[i][1]], planes);
}

/* Mean of the `best` smallest costs, of those that are valid; where none is, a middling cost. */
static void combine(uint8_t cost[LUMI_MVS_NEIGHBOURS][MVS_PLANES_MAX], int best, int planes, uint8_t *result)
{
    static const uint16_t share[LUMI_MVS_NEIGHBOURS + 1] = {0, 256, 128, 85, 64, 51, 43, 37, 32};

    for (int k = 0; k < planes; k++) {
        int sum = 0, valid = 0;
        for (int n = 0; n < best; n++) {
            int counts = cost[n][k] != MVS_INVALID;
            sum += counts * cost[n][k];
            valid += counts;
        }
        result[k] = (uint8_t)(valid ? sum * share[valid] >> 8 : MVS_COST_MAX / 2);
    }
}

static int volume_row(void *context, int y, int thread)
{
    const struct volume_job *job = context;
    const struct mvs_image *image = job->image;
    const int planes = job->planes, best = (job->count + 1) / 2;
    uint8_t cost[LUMI_MVS_NEIGHBOURS][MVS_PLANES_MAX];

    (void)thread;
    for (int x = 0; x < image->width; x++) {
        const size_t at = (size_t)y * (size_t)image->width + (size_t)x;
        memset(cost, MVS_INVALID, sizeof(cost));
        for (int n = 0; n < job->count; n++) {
            const float *r = job->targets[n].rotation;
            float a[3];
            for (int i = 0; i < 3; i++)
                a[i] = r[3 * i] * image->tan_x[x] + r[3 * i + 1] * image->tan_y[y] + r[3 * i + 2];
            job->kernels->sweep(&job->targets[n], a, image->pixels[at], planes, cost[n]);
        }
        sort_costs(cost, planes);
        combine(cost, best, planes, job->volume + at * (size_t)planes);
    }
    return LUMI_OK;
}

int mvs_volume(const struct mvs_image *image, int count, const struct mvs_target *targets, int planes, int threads,
               uint8_t *volume)
{
    struct volume_job job = {image, targets, mvs_kernels(), count, planes, volume};

    return lumi_parallel_for(image->height, threads, volume_row, &job);
}
