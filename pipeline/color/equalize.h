/* Gains of pictures and vignetting of lenses, from what several pictures show of the same points. */
#ifndef LUMI_PIPELINE_COLOR_EQUALIZE_H
#define LUMI_PIPELINE_COLOR_EQUALIZE_H

#include "pipeline/equiangular/gains.h"

/* One point in two pictures. */
struct lumi_same_point {
    int a, b;            /* pictures */
    float r2_a, r2_b;    /* squared radii, lumi_vignetting_radius2 */
    float difference[3]; /* ln of the light in a by that in b */
    float sigma;         /* what noise alone makes of that */
};

struct lumi_equalize_report {
    double spread; /* of the differences that are left: 1.48 times the median of their sizes */
    double before; /* and that before anything was done */
    int *points;   /* a picture: how many count for it; the caller's array, may be NULL */
};

/* Robust least squares over all points, in logarithms: ln gain_a − ln gain_b + vignetting = difference, each point
 * weighted by how well it fits (Geman and McClure 1987). Only ratios are seen: the median gain is 1 in every channel. A
 * picture without points has gain 1. `gains` is made, with `names` and `lenses` (an index each). One thread; the result
 * depends on the order of the points only. */
int lumi_equalize(const struct lumi_same_point *points, int point_count, const char *const *names, const int *lenses,
                  int count, int lens_count, struct lumi_gains *gains, struct lumi_equalize_report *report,
                  struct lumi_error *error);

/* The mean light around (x, y) of a picture (3-channel F32), weighted by a Gaussian of `scale` pixels, held to 1.5 to
 * 6; and, of the mean of the channels, its relative deviation due to noise. False near the border, where something may
 * be clipped (with `clips`: a channel over 0.9), or it is dark. */
bool lumi_light_around(const struct lumi_raster *picture, bool clips, double x, double y, double scale, float light[3],
                       float *sigma);

#endif
