/* From the surface a ray meets in a view to the view's colour and weight. */
#ifndef LUMI_RENDER_CPU_VIEW_SHADE_H
#define LUMI_RENDER_CPU_VIEW_SHADE_H

#include "render/cpu/disk_renderer.h"
#include "render/cpu/raster_block.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Sums over the views, in the layout of the rays. */
struct lumi_sums {
    float *r, *g, *b, *weight, *nearness;
};

/* A view's pixels, ready to be sampled. */
struct lumi_source_image {
    struct lumi_raster pixels;
    const uint8_t *missing; /* as lumi_viewset_acquire gives it */
    enum lumi_filter filter;
    bool linear; /* samples are wanted in linear light; else sRGB-encoded */
};

/* Colour (0..1) at an image position; positions are clamped to the image. */
void lumi_sample_image(const struct lumi_source_image *image, float x, float y, float color[3]);

struct lumi_shade_settings {
    enum lumi_disk_shape shape;
    enum lumi_disk_kernel kernel;
    float disk_scale, stretch;
};

/* The view's weight for direction (x, y, z) and where the ray meets the disk. 0 where the view faces the other way. */
float lumi_shade_weight(const struct lumi_surface_view *surface, const struct lumi_shade_settings *settings, float x,
                        float y, float z, float *u, float *v);

/* Adds what the buffer holds of a block. `nearest` (may be NULL; in the block's layout): surfaces further than 1.02
 * times that are left out. */
void lumi_shade_block(const struct lumi_block_buffer *buffer, const struct lumi_rays *rays, int block,
                      const struct lumi_surface_view *surface, const struct lumi_source_image *image,
                      const struct lumi_shade_settings *settings, const float *nearest, struct lumi_sums *sums);

/* sRGB bytes in linear light: lumi_srgb_decode(i / 255). */
void lumi_shade_tables(void);

#ifdef __cplusplus
}
#endif
#endif
