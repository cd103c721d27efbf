/* The second pass: sums divided by weights, out of the blocks into a picture. */
#ifndef LUMI_RENDER_CPU_COMPOSE_H
#define LUMI_RENDER_CPU_COMPOSE_H

#include "render/cpu/picture.h"
#include "render/cpu/rays.h"
#include "render/cpu/view_shade.h"

#ifdef __cplusplus
extern "C" {
#endif

int lumi_sums_create(struct lumi_sums *sums, size_t pixels, struct lumi_error *error);
void lumi_sums_finish(struct lumi_sums *sums);

/* `linear`: the sums are of linear light, else of sRGB-encoded values. */
int lumi_compose(const struct lumi_rays *rays, const struct lumi_sums *sums, bool linear, enum lumi_sample sample,
                 int threads, struct lumi_picture *picture, struct lumi_error *error);

#ifdef __cplusplus
}
#endif
#endif
