/* The prefilter of one view (Overbeck et al. 2018, section 5, equations 4 and 5): the picture that a camera with the
 * view's disk for its aperture takes of the dense light field. */
#ifndef LUMI_PIPELINE_PREFILTER_VIEW_FILTER_H
#define LUMI_PIPELINE_PREFILTER_VIEW_FILTER_H

#include "render/viewset/viewset.h"

#define LUMI_PREFILTER_BASE 4  /* samples every pixel takes where nothing else is said */
#define LUMI_PREFILTER_MOST 32 /* and the most, where the first ones disagree */

/* What is filtered. */
struct lumi_prefilter_view {
    const struct lumi_grid *grid;
    struct lumi_pose pose;
    struct lumi_disk disk;
    enum lumi_disk_shape shape;
    enum lumi_disk_kernel kernel;
    const struct lumi_raster *surface; /* inverse depth of the view's own mesh at the pixels' centres, F32 */
    const struct lumi_raster *picture; /* RGB F32: what stands where no dense view sees anything */
};

struct lumi_prefilter_settings {
    int base, most;  /* samples a pixel: of all, and of blocks over the tolerance; powers of two, 2 at least */
    float tolerance; /* standard error a block is left alone at, in units of the picture */
    uint32_t seed;
    int threads;
};

/* base and most as above, half a grey level of 255, one thread a core. */
void lumi_prefilter_defaults(struct lumi_prefilter_settings *settings);

struct lumi_prefilter_report {
    double samples;   /* a pixel, on average */
    double error;     /* standard error as estimated, mean over the pixels */
    double rms;       /* the same, root mean square */
    double over;      /* share of the pixels whose block stays over the tolerance */
    double worst;     /* standard error of the worst block */
    double uncovered; /* share of the pixels that no dense view sees */
};

/* `dense` holds views with dense depth and F32 pixels, whose numbers are blended as they are: sRGB-encoded ones give
 * the blend that is displayed. `result` is made, F32 in the same numbers; the same bytes for any number of threads. */
int lumi_prefilter(struct lumi_viewset *dense, const struct lumi_prefilter_view *view,
                   const struct lumi_prefilter_settings *settings, struct lumi_raster *result,
                   struct lumi_prefilter_report *report, struct lumi_error *error);

/* A view's mesh as inverse depth at the pixels' centres. */
int lumi_prefilter_surface(const struct lumi_grid *grid, const struct lumi_view_mesh *mesh, struct lumi_raster *surface,
                           struct lumi_error *error);

#endif
