/* What the steps of multi-view stereo share. */
#ifndef LUMI_PIPELINE_DEPTH_MVS_PRIV_H
#define LUMI_PIPELINE_DEPTH_MVS_PRIV_H

#include "pipeline/depth/mvs.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define MVS_AXIS_CELLS 1024
#define MVS_PLANES_MAX 192 /* a multiple of 16 */
#define MVS_COST_MAX 120   /* differences of colour count no more than this */
#define MVS_INVALID 255    /* cost of a plane that falls outside the neighbour's image */

/* Tangent to position along one image axis: in cell i = (tangent − origin) · scale, position = a[i] + b[i] · tangent.
 * The cells at both ends go on outwards. */
struct mvs_axis {
    float origin, scale;
    bool linear; /* a[0], b[0] hold everywhere: a pinhole */
    float a[MVS_AXIS_CELLS], b[MVS_AXIS_CELLS];
};

/* A view ready for matching, at 1/divisor of its size. */
struct mvs_image {
    int width, height;
    float *tan_x, *tan_y; /* of pixel centres */
    uint32_t *pixels;     /* bytes R G B and local contrast */
};

/* A neighbour: its pixels at twice the density (even places are its own pixels, the others lie between), and the way
 * from the view's rays into it: direction = rotation · ray + w · shift. */
struct mvs_target {
    int width, height; /* of `pixels` */
    uint32_t *pixels;
    struct mvs_axis x, y; /* positions are indices into `pixels`, to be rounded */
    float rotation[9], shift[3];
    float plane_x[MVS_PLANES_MAX], plane_y[MVS_PLANES_MAX], plane_z[MVS_PLANES_MAX]; /* w_k · shift */
};

/* LUMI_ERR_ARG for a view whose lens, pose or image (with `depth`, also its map) cannot be used. */
int mvs_check(const struct lumi_mvs_view *view, bool depth, struct lumi_error *error);

int mvs_image_init(struct mvs_image *image, const struct lumi_mvs_view *view, int divisor);
void mvs_image_finish(struct mvs_image *image);
int mvs_target_init(struct mvs_target *target, const struct lumi_mvs_view *view, const struct lumi_mvs_view *neighbour,
                    int divisor);
void mvs_target_finish(struct mvs_target *target);
void mvs_target_planes(struct mvs_target *target, int planes, float w_first, float w_step);

/* The kernels; x86/ has variants that give the same numbers. */
struct mvs_kernels {
    /* cost[k] for k < planes (a multiple of 16): how far the neighbour's colour, where plane k puts the ray (a: the ray
     * turned into the neighbour's frame), lies from `colour`; MVS_INVALID outside its image. */
    void (*sweep)(const struct mvs_target *target, const float a[3], uint32_t colour, int planes, uint8_t *cost);
    /* One step of a path of semi-global matching: path[k] = cost[k] + min(previous[k], previous[k ± 1] + p1, lowest +
     * p2) − lowest, sum[k] += path[k]; returns the smallest path[k]. `previous` has one writable element before and one
     * after its planes. planes: a multiple of 16. */
    int (*path)(const uint8_t *cost, int16_t *previous, int lowest, int p1, int p2, int planes, int16_t *path,
                uint16_t *sum);
    /* result[k]: the mean of the `best` (1..4) smallest costs of plane k, of those that are valid; where none is, a
     * middling cost. Sorts `cost`. */
    void (*combine)(uint8_t cost[LUMI_MVS_NEIGHBOURS][MVS_PLANES_MAX], int best, int planes, uint8_t *result);
};

const struct mvs_kernels *mvs_kernels(void);
extern const struct mvs_kernels mvs_kernels_c;
#if defined(__x86_64__)
extern const struct mvs_kernels mvs_kernels_avx2;
#endif

/* Plane costs of every pixel of `image`: volume[(y · width + x) · planes + k]. */
int mvs_volume(const struct mvs_image *image, int count, const struct mvs_target *targets, int planes, int threads,
               uint8_t *volume);

/* Picks a plane a pixel, to a fraction of a plane: result[y · width + x] in [0, planes − 1]. */
int mvs_sgm(const struct mvs_image *image, const uint8_t *volume, int planes, int threads, float *result);

#endif
