/* The reference renderer: disks over per-view geometry (Overbeck et al. 2018, equations 1 to 3, sections 4.1 to 4.4).
 *
 * For every pixel the ray (o, e) is looked up in every view: where the ray's line crosses the view's disk says how much
 * the view weighs, where it meets the view's own surface says which of its colours. Works for any arrangement of the
 * views, since a disk is crossed in front of the eye or behind it alike; a view takes part where it faces the way the
 * ray runs. docs/rendering.md tells the rest. */
#ifndef LUMI_RENDER_CPU_DISK_RENDERER_H
#define LUMI_RENDER_CPU_DISK_RENDERER_H

#include "render/cpu/picture.h"
#include "render/viewset/viewset.h"

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/* What hides what (figure 4): within a view's mesh; nothing; across all views, to 2 % of the distance. */
enum lumi_depth_test { LUMI_DEPTH_INTRA = 0, LUMI_DEPTH_NONE = 1, LUMI_DEPTH_INTER = 2 };

struct lumi_disk_settings {
    enum lumi_depth_test depth_test;
    int kernel;              /* enum lumi_disk_kernel; −1: the set's */
    float disk_scale;        /* widens every disk */
    enum lumi_filter filter; /* between a view's pixels */
    /* Surfaces drawn wider than their view saw them (the sheets at depth's edges) weigh less: expansion E ≥ 1 across a
     * triangle gives the factor 1 / (1 + ((E − 1) / stretch)²). 0: off, as in the paper. */
    float stretch;
    bool linear_light;       /* blend in linear light; else sRGB-encoded values, as in the paper */
    enum lumi_sample sample; /* of the picture's colour */
    int threads;             /* as lumi_parallel_for; the picture's bytes do not depend on it */
};

void lumi_disk_settings_default(struct lumi_disk_settings *settings);

/* Renders what `lens` sees from `pose`; `settings` NULL: the default ones. The picture is all-zero before; release it
 * with lumi_picture_finish. */
int lumi_render_disks(struct lumi_viewset *set, const struct lumi_lens *lens, const struct lumi_pose *pose,
                      const struct lumi_disk_settings *settings, struct lumi_picture *picture,
                      struct lumi_error *error);

#ifdef __cplusplus
}
#endif
#endif
