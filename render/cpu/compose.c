/* The second pass. */
#include "render/cpu/compose.h"

#include "proto/base/memory.h"
#include "proto/base/parallel.h"

#include <math.h>
#include <string.h>

int lumi_sums_create(struct lumi_sums *sums, size_t pixels, struct lumi_error *error)
{
    float *all = lumi_calloc(5 * pixels, sizeof(float));

    if (!all)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a picture");
    *sums = (struct lumi_sums){all, all + pixels, all + 2 * pixels, all + 3 * pixels, all + 4 * pixels};
    return LUMI_OK;
}

void lumi_sums_finish(struct lumi_sums *sums)
{
    lumi_free(sums->r);
    memset(sums, 0, sizeof *sums);
}

struct compose {
    const struct lumi_rays *rays;
    const struct lumi_sums *sums;
    bool linear;
    struct lumi_picture *picture;
    long *covered; /* a row */
};

static void put(const struct compose *compose, int x, int y, int channel, float value)
{
    const struct lumi_raster *raster = &compose->picture->color;

    if (raster->sample == LUMI_F32) {
        lumi_row_f32(raster, y)[3 * x + channel] = compose->linear ? value : lumi_srgb_decode(value);
        return;
    }
    float encoded = fminf(fmaxf(compose->linear ? lumi_srgb_encode(value) : value, 0), 1);
    if (raster->sample == LUMI_U8)
        lumi_row_u8(raster, y)[3 * x + channel] = (uint8_t)(encoded * 255 + 0.5f);
    else
        lumi_row_u16(raster, y)[3 * x + channel] = (uint16_t)(encoded * 65535 + 0.5f);
}

static int compose_row(void *context, int y, int thread)
{
    struct compose *compose = context;
    const struct lumi_sums *sums = compose->sums;

    (void)thread;
    for (int x = 0; x < compose->rays->width; x++) {
        size_t at = lumi_rays_at(compose->rays, x, y);
        float weight = sums->weight[at];
        if (!(weight > 0))
            continue;
        put(compose, x, y, 0, sums->r[at] / weight);
        put(compose, x, y, 1, sums->g[at] / weight);
        put(compose, x, y, 2, sums->b[at] / weight);
        lumi_row_f32(&compose->picture->weight, y)[x] = weight;
        lumi_row_f32(&compose->picture->inverse_distance, y)[x] = sums->nearness[at] / weight;
        compose->covered[y]++;
    }
    return LUMI_OK;
}

void lumi_picture_finish(struct lumi_picture *picture)
{
    lumi_raster_finish(&picture->color);
    lumi_raster_finish(&picture->weight);
    lumi_raster_finish(&picture->inverse_distance);
    memset(picture, 0, sizeof *picture);
}

int lumi_compose(const struct lumi_rays *rays, const struct lumi_sums *sums, bool linear, enum lumi_sample sample,
                 int threads, struct lumi_picture *picture, struct lumi_error *error)
{
    long *covered = lumi_calloc((size_t)rays->height, sizeof *covered);

    memset(picture, 0, sizeof *picture);
    if (!covered || lumi_raster_create(&picture->color, rays->width, rays->height, 3, sample) != LUMI_OK ||
        lumi_raster_create(&picture->weight, rays->width, rays->height, 1, LUMI_F32) != LUMI_OK ||
        lumi_raster_create(&picture->inverse_distance, rays->width, rays->height, 1, LUMI_F32) != LUMI_OK) {
        lumi_free(covered);
        lumi_picture_finish(picture);
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a picture of %d×%d", rays->width, rays->height);
    }
    struct compose compose = {rays, sums, linear, picture, covered};
    lumi_parallel_for(rays->height, threads, compose_row, &compose);
    picture->imaged = rays->imaged;
    for (int y = 0; y < rays->height; y++)
        picture->covered += covered[y];
    lumi_free(covered);
    return LUMI_OK;
}
