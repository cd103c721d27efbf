/* The reference renderer for rays of the caller's own: any table of directions from one eye, some blocks of a picture
 * or rays that no lens has. lumi_render_disks is this for the rays of a lens, to the byte. */
#ifndef LUMI_RENDER_CPU_RAY_RENDERER_H
#define LUMI_RENDER_CPU_RAY_RENDERER_H

#include "render/cpu/compose.h"
#include "render/cpu/disk_renderer.h"
#include "render/cpu/rays.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Adds to `sums` (of rays->pixels; lumi_sums_create) what every ray of the table from `eye` sees: weight · colour,
 * weight and weight · inverse distance, in the table's layout. A ray's colour is its sum over its weight, which is 0
 * where no view knows it: sRGB-encoded values, or linear light where settings->linear_light. `settings` NULL: the
 * default ones; `sample` is not used. */
int lumi_render_rays(struct lumi_viewset *set, const struct lumi_rays *rays, struct lumi_vec3 eye,
                     const struct lumi_disk_settings *settings, struct lumi_sums *sums, struct lumi_error *error);

#ifdef __cplusplus
}
#endif
#endif
