/* What a plan comes to on a rig, before anything turns. For a plan that passed lumi_plan_check. No heap, no files.
 *
 * View volume. From a point at distance d off the centre every ray leaves the sphere of the cameras, of radius R, at an
 * angle of at most asin(d / R) to the sphere's normal, which is where its camera looks. So with an opening of 2 a all
 * rays are there within
 *     d = R sin a,
 * as Overbeck et al. 2018, section 3, have it: 70 cm across and 110 degrees give "a viewing volume 60cm in diameter"
 * (57), "slightly smaller in height" (88 degrees: 49); 80 cm and 120 degrees give "70cm" (69).
 *
 * Nearest sharp distance. Chai, Tong, Chan and Shum, "Plenoptic sampling", SIGGRAPH 2000: cameras s apart render
 * without aliasing what lies from z to infinity if its disparities, from 0 to f s / z pixels, fall into N layers of
 * depth of at most so many pixels e each (their joint sampling of images and depth; e = 1 is their limit, one layer
 * their case without geometry):
 *     z = f s / (N e).
 * Our depth has at most 192 layers, 0.6 pixels apart (docs/depth.md); s is the largest distance between neighbouring
 * rows or columns of the sphere. Nearer things are rendered, too, but with ghosts. Twice the rows bring it to a half
 * where the rows rule: "for closer subjects, we can double the number of rows" (Overbeck et al., section 3).
 *
 * Blur. lumi_plan_blur is of the horizon. The camera moves as well as it turns: a thing at z from it smears by
 * (1 + R / z) times that. */
#ifndef LUMI_PROTO_MECHANISM_PLAN_FORECAST_H
#define LUMI_PROTO_MECHANISM_PLAN_FORECAST_H

#include "proto/mechanism/sweep_plan.h"

#ifdef __cplusplus
extern "C" {
#endif

#define LUMI_PLAN_DEPTH_LAYERS 192
#define LUMI_PLAN_LAYER_PIXELS 0.6

struct lumi_plan_forecast {
    int shots, frames;
    int rows, columns; /* of the sphere: cameras times turns, positions */
    double seconds;    /* lumi_plan_seconds */
    double bytes, bytes_per_second;
    double blur;          /* pixels, of the horizon */
    double blur_near;     /* of things at `nearest` */
    double volume;        /* m, radius across the axis from which every ray is there */
    double volume_height; /* m, half of its height */
    double spacing;       /* m, the largest between neighbouring views */
    double nearest;       /* m from a camera: what is nearer is not rendered sharp */
};
/* `pixel_bytes`: what a pixel takes on the disk, for each camera of the rig; NULL: 1, as raw frames of 8 bits do. A
 * video's bytes are not known: 0. */
void lumi_plan_forecast(const struct lumi_plan *plan, const struct lumi_rig *rig, const double *pixel_bytes,
                        struct lumi_plan_forecast *forecast);

#ifdef __cplusplus
}
#endif
#endif
