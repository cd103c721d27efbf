/* A lens with its derivatives, for solving. */
#ifndef LUMI_PIPELINE_CALIBRATE_LENS_SLOPE_H
#define LUMI_PIPELINE_CALIBRATE_LENS_SLOPE_H

#include "proto/base/lens.h"

/* The numbers of a lens in this order, for both models (a model leaves those it has not at 0). */
enum lumi_lens_number {
    LUMI_LENS_FX = 0,
    LUMI_LENS_FY,
    LUMI_LENS_CX,
    LUMI_LENS_CY,
    LUMI_LENS_K1,
    LUMI_LENS_K2,
    LUMI_LENS_K3,
    LUMI_LENS_K4,
    LUMI_LENS_P1,
    LUMI_LENS_P2,
    LUMI_LENS_NUMBERS
};
void lumi_lens_numbers(const struct lumi_lens *lens, double numbers[LUMI_LENS_NUMBERS]);
void lumi_lens_from_numbers(const double numbers[LUMI_LENS_NUMBERS], struct lumi_lens *lens);
/* Whether the lens' model has this number. */
bool lumi_lens_has(const struct lumi_lens *lens, enum lumi_lens_number number);

/* As lumi_lens_project, for BROWN and FISHEYE; where not NULL, by_direction (2 × 3) and by_lens (2 × LUMI_LENS_NUMBERS)
 * get the derivatives, row by row. */
bool lumi_lens_project_slope(const struct lumi_lens *lens, struct lumi_vec3 direction, double xy[2],
                             double by_direction[6], double by_lens[2 * LUMI_LENS_NUMBERS]);

#endif
