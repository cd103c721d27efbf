/* A lens from pictures of a flat board (Zhang: A Flexible New Technique for Camera Calibration, 2000). */
#ifndef LUMI_PIPELINE_CALIBRATE_BOARD_LENS_H
#define LUMI_PIPELINE_CALIBRATE_BOARD_LENS_H

#include "pipeline/calibrate/lens_slope.h"
#include "proto/base/result.h"

#include <stdbool.h>
#include <stddef.h>

#define LUMI_BOARD_CORNERS 1024 /* of a board, at most */

/* One picture of the board. */
struct lumi_board_view {
    const float *corners; /* x, y of columns × rows inner corners, row by row; pixels, centres at half-integers */
    bool used;            /* out */
    double error;         /* out: root mean square distance of its corners, pixels */
    double pose[6];       /* out: board to camera: a rotation vector, and the place in squares */
};

struct lumi_board_lens {
    struct lumi_lens lens;
    double sigma[LUMI_LENS_NUMBERS]; /* one standard deviation of each number; 0: it was not looked for */
    double error;                    /* root mean square of all, pixels */
    double reach;                    /* how far off the axis corners were seen, radians */
};

/* The picture's corners; LUMI_ERR_NOTFOUND: no such board in it. */
int lumi_board_find(const char *path, int columns, int rows, float *corners, int *width, int *height,
                    struct lumi_error *error);

/* The model's lens that suits the views best: BROWN (k1 k2 p1 p2) or FISHEYE (k1 k2, and k3 k4 where corners reach
 * far). LUMI_ERR_FORMAT where they do not tell: too few, or all from one side. */
int lumi_board_solve(enum lumi_lens_model model, int width, int height, int columns, int rows, int count,
                     struct lumi_board_view *views, struct lumi_board_lens *result, struct lumi_error *error);

/* A section [lens NAME] of a rig profile; the length of the whole text, as snprintf. */
int lumi_board_print(const struct lumi_lens *lens, const char *name, char *text, size_t size);

#endif
