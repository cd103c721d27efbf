/* Rays that meet dense depth, by search: for many rays through few views whose depth is known at every pixel, where
 * drawing two triangles a pixel would cost more than the rays do.
 *
 * In a view's tangents a ray is a line. With d its direction and m the eye, both in the view's frame, the point of the
 * ray whose inverse depth in the view is w lies at the tangents d.xy / d.z + w · (u, v), where (u, v) is where the
 * ray's line meets the view's disk. What the ray meets is the largest w at which the view's own inverse depth there
 * reaches w: found between the bounds of the pixels around, at steps of a pixel from the near end, then on the straight
 * line between two steps. Weights, colours and sums are those of the disk renderer (view_shade.h); depth is bilinear
 * between pixel centres where that draws two triangles. */
#ifndef LUMI_RENDER_CPU_DENSE_CAST_H
#define LUMI_RENDER_CPU_DENSE_CAST_H

#include "render/cpu/disk_renderer.h"
#include "render/cpu/rays.h"
#include "render/cpu/view_shade.h"

#ifdef __cplusplus
extern "C" {
#endif

struct lumi_cast;     /* views, prepared; any number of threads may cast */
struct lumi_cast_eye; /* where they lie about an eye */

/* The set's views must have dense depth and F32 images, and the set outlive this; meshes are not looked at. Of
 * `settings` (NULL: the default ones) kernel, disk_scale, stretch and filter count. The images' numbers are blended as
 * they are, whatever they mean. */
int lumi_cast_create(struct lumi_viewset *set, const struct lumi_disk_settings *settings, struct lumi_cast **cast,
                     struct lumi_error *error);
void lumi_cast_destroy(struct lumi_cast *cast);

int lumi_cast_eye_create(const struct lumi_cast *cast, struct lumi_vec3 eye, struct lumi_cast_eye **result,
                         struct lumi_error *error);
void lumi_cast_eye_destroy(struct lumi_cast_eye *eye);

/* Adds to `sums` what the rays of one block see, directions and sums in the block's layout (rays.h): unit directions in
 * the world, zero where there is no ray. sums->nearness may be NULL. */
void lumi_cast_block(const struct lumi_cast *cast, const struct lumi_cast_eye *eye, const float *x, const float *y,
                     const float *z, struct lumi_sums *sums);

#ifdef __cplusplus
}
#endif
#endif
