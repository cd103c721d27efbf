/* From the surface a ray meets in a view to the view's colour and weight. */
#include "render/cpu/view_shade.h"

#include <math.h>
#include <pthread.h>

static float byte_linear[256], byte_unit[256];

static void fill_tables(void)
{
    for (int i = 0; i < 256; i++) {
        byte_unit[i] = (float)i / 255;
        byte_linear[i] = lumi_srgb_decode((float)i / 255);
    }
}

void lumi_shade_tables(void)
{
    static pthread_once_t once = PTHREAD_ONCE_INIT;

    pthread_once(&once, fill_tables);
}

static int clamp(int value, int count)
{
    return value < 0 ? 0 : value >= count ? count - 1 : value;
}

/* Weights of taps at −1, 0, 1, 2 for position t in [0, 1): Catmull and Rom, 1974 (interpolating, no overshoot control).
 */
static void cubic_weights(float t, float w[4])
{
    w[0] = t * (-0.5f + t * (1 - 0.5f * t));
    w[1] = 1 + t * t * (-2.5f + 1.5f * t);
    w[2] = t * (0.5f + t * (2 - 1.5f * t));
    w[3] = t * t * (-0.5f + 0.5f * t);
}

static void gather(const struct lumi_source_image *image, int x0, int y0, int taps, const float *wx, const float *wy,
                   float color[3])
{
    const struct lumi_raster *p = &image->pixels;
    const float *table = image->linear ? byte_linear : byte_unit;
    float r = 0, g = 0, b = 0;

    for (int j = 0; j < taps; j++) {
        float row_r = 0, row_g = 0, row_b = 0;
        int y = clamp(y0 + j, p->height);
        for (int i = 0; i < taps; i++) {
            int x = 3 * clamp(x0 + i, p->width);
            if (p->sample == LUMI_U8) {
                const uint8_t *pixel = lumi_row_u8(p, y) + x;
                row_r += wx[i] * table[pixel[0]];
                row_g += wx[i] * table[pixel[1]];
                row_b += wx[i] * table[pixel[2]];
            } else {
                const float *pixel = lumi_row_f32(p, y) + x;
                row_r += wx[i] * pixel[0];
                row_g += wx[i] * pixel[1];
                row_b += wx[i] * pixel[2];
            }
        }
        r += wy[j] * row_r, g += wy[j] * row_g, b += wy[j] * row_b;
    }
    color[0] = r, color[1] = g, color[2] = b;
}

void lumi_sample_image(const struct lumi_source_image *image, float x, float y, float color[3])
{
    /* Positions far outside (a patch drawn out beyond its image) must not overflow the conversion. */
    x = fminf(fmaxf(x - 0.5f, -1), (float)image->pixels.width);
    y = fminf(fmaxf(y - 0.5f, -1), (float)image->pixels.height);
    float fx = floorf(x), fy = floorf(y);

    if (image->filter == LUMI_FILTER_CUBIC) {
        float wx[4], wy[4];
        cubic_weights(x - fx, wx);
        cubic_weights(y - fy, wy);
        gather(image, (int)fx - 1, (int)fy - 1, 4, wx, wy, color);
    } else {
        const float wx[2] = {1 - (x - fx), x - fx}, wy[2] = {1 - (y - fy), y - fy};
        gather(image, (int)fx, (int)fy, 2, wx, wy, color);
    }
    if (image->pixels.sample == LUMI_F32 && !image->linear)
        for (int i = 0; i < 3; i++)
            color[i] = lumi_srgb_encode(color[i]);
}

float lumi_shade_weight(const struct lumi_surface_view *surface, const struct lumi_shade_settings *settings, float x,
                        float y, float z, float *u, float *v)
{
    const float *r = surface->rt;
    float cz = r[6] * x + r[7] * y + r[8] * z;

    if (!(cz > 1e-6f))
        return 0;
    float back = -surface->ez / cz;
    *u = surface->ex + back * (r[0] * x + r[1] * y + r[2] * z);
    *v = surface->ey + back * (r[3] * x + r[4] * y + r[5] * z);
    return lumi_disk_weight(&surface->view->disk, settings->shape, settings->kernel, settings->disk_scale, *u, *v);
}

/* Seen from (u, v) on the disk, a surface of inverse depth w(tx, ty) is spread 1 − (u, v)·∇w times as wide as in the
 * view itself. Never quite zero, so that nothing becomes a hole for it. */
static float stretch_factor(const struct lumi_triangle_record *record, float stretch, float u, float v)
{
    float over = -(u * record->gx + v * record->gy) / stretch;

    return over > 0 ? fmaxf(1 / (1 + over * over), 1e-4f) : 1;
}

void lumi_shade_block(const struct lumi_block_buffer *buffer, const struct lumi_rays *rays, int block,
                      const struct lumi_surface_view *surface, const struct lumi_source_image *image,
                      const struct lumi_shade_settings *settings, const float *nearest, struct lumi_sums *sums)
{
    const float *r = surface->rt;
    int cols = surface->view->grid->cols;
    size_t first = (size_t)block * LUMI_BLOCK_PIXELS;

    for (int i = 0; i < LUMI_BLOCK_PIXELS; i++) {
        if (buffer->record[i] < 0)
            continue;
        const struct lumi_triangle_record *record = &buffer->records[buffer->record[i]];
        float x = rays->x[first + (size_t)i], y = rays->y[first + (size_t)i], z = rays->z[first + (size_t)i];
        float s = buffer->nearness[i], u, v;
        if (nearest && 1.02f * s < nearest[i])
            continue;
        float weight = lumi_shade_weight(surface, settings, x, y, z, &u, &v);
        if (!(weight > 0))
            continue;
        if (settings->stretch > 0)
            weight *= stretch_factor(record, settings->stretch, u, v);
        /* The point met, times s: finite at infinity too. */
        float px = r[0] * x + r[1] * y + r[2] * z + s * surface->ex;
        float py = r[3] * x + r[4] * y + r[5] * z + s * surface->ey;
        float pz = r[6] * x + r[7] * y + r[8] * z + s * surface->ez;
        if (!(pz > 0))
            continue;
        const float *map_x = surface->tile_x + 2 * (record->tile % cols);
        const float *map_y = surface->tile_y + 2 * (record->tile / cols);
        float color[3];
        lumi_sample_image(image, map_x[0] * (px / pz) + map_x[1], map_y[0] * (py / pz) + map_y[1], color);
        sums->r[first + (size_t)i] += weight * color[0];
        sums->g[first + (size_t)i] += weight * color[1];
        sums->b[first + (size_t)i] += weight * color[2];
        sums->weight[first + (size_t)i] += weight;
        sums->nearness[first + (size_t)i] += weight * s;
    }
}
