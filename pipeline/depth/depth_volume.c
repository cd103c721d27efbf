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
        job->kernels->combine(cost, best, planes, job->volume + at * (size_t)planes);
    }
    return LUMI_OK;
}

int mvs_volume(const struct mvs_image *image, int count, const struct mvs_target *targets, int planes, int threads,
               uint8_t *volume)
{
    struct volume_job job = {image, targets, mvs_kernels(), count, planes, volume};

    return lumi_parallel_for(image->height, threads, volume_row, &job);
}
