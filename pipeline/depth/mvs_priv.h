/* What the steps of multi-view stereo share. */
#ifndef LUMI_PIPELINE_DEPTH_MVS_PRIV_H
#define LUMI_PIPELINE_DEPTH_MVS_PRIV_H

#include "pipeline/depth/mvs.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define MVS_AXIS_CELLS 1024
#define MVS_PLANES_MAX 192 /* a multiple of 2 · MVS_LANES */
#define MVS_GROUP 8        /* planes that are searched together, or not at all */
#define MVS_GROUPS_MAX (MVS_PLANES_MAX / MVS_GROUP)
#define MVS_LANES 16     /* what the number of planes searched at a pixel is a multiple of */
#define MVS_BLOCK 16     /* pixels, each way, that search the same planes */
#define MVS_COST_MAX 120 /* differences of colour count no more than this */
#define MVS_INVALID 255  /* cost of a plane that falls outside the neighbour's image */

/* Tangent to position along one image axis: in cell i = (tangent − origin) · scale, position = a[i] + b[i] · tangent.
 * The cells at both ends go on outwards. */
struct mvs_axis {
    float origin, scale;
    bool linear; /* a[0], b[0] hold everywhere: a pinhole */
    float a[MVS_AXIS_CELLS], b[MVS_AXIS_CELLS];
};

static inline float mvs_axis_position(const struct mvs_axis *axis, float tangent)
{
    if (axis->linear)
        return axis->a[0] + axis->b[0] * tangent;
    float cell = (tangent - axis->origin) * axis->scale;
    cell = cell > 0 ? cell : 0; /* for a NaN too */
    cell = cell < MVS_AXIS_CELLS - 1 ? cell : MVS_AXIS_CELLS - 1;
    const int i = (int)cell;
    return axis->a[i] + axis->b[i] * tangent;
}

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
};

/* Planes of equal inverse depth. */
struct mvs_planes {
    double first, step; /* w of plane 0, and between planes */
    int count;          /* a multiple of MVS_LANES */
};

/* The planes that the pixels of one block search, and where the block's numbers lie in a volume: those of its pixel
 * (x, y), row by row, at at + (y · MVS_BLOCK + x) · lanes. */
struct mvs_block {
    uint32_t groups; /* bit g: planes MVS_GROUP · g and the next */
    int lanes;       /* MVS_GROUP for every bit, a multiple of MVS_LANES */
    int column;      /* lanes of the blocks to the left */
    size_t at;
};

struct mvs_search {
    int columns, rows; /* blocks */
    int widest;        /* lanes of a row of blocks, at most */
    struct mvs_block *blocks;
    size_t size; /* of a volume */
};

/* What was found at one size: chosen[y · width + x], in planes, to a fraction. */
struct mvs_level {
    int width, height;
    struct mvs_planes planes;
    float *chosen;
};

/* LUMI_ERR_ARG for a view whose lens, pose or image (with `depth`, also its map) cannot be used. */
int mvs_check(const struct lumi_mvs_view *view, bool depth, struct lumi_error *error);

/* The axis of a grid whose tiles' edges lie at `tangents`, for a neighbour at 1/divisor of its size: pixel i's centre
 * is at 2 · i. */
void mvs_axis_init(struct mvs_axis *axis, const double *tangents, int tiles, int divisor);
/* The straight line through the axis at two tangents, if it leaves the axis by little between. */
struct mvs_line mvs_axis_line(const struct mvs_axis *axis, float low, float high);
int mvs_image_init(struct mvs_image *image, const struct lumi_mvs_view *view, int divisor);
void mvs_image_finish(struct mvs_image *image);
int mvs_target_init(struct mvs_target *target, const struct lumi_mvs_view *view, const struct lumi_mvs_view *neighbour,
                    int divisor);
void mvs_target_finish(struct mvs_target *target);

/* Every plane everywhere. */
int mvs_search_all(struct mvs_search *search, int width, int height, int planes);
/* What was found at half the size, with the next planes, and what lies around it. */
int mvs_search_from(struct mvs_search *search, int width, int height, const struct mvs_planes *planes,
                    const struct mvs_level *half);
void mvs_search_finish(struct mvs_search *search);
/* The groups in `bits`, ascending; returns how many. */
int mvs_groups(uint32_t bits, uint8_t groups[MVS_GROUPS_MAX]);

/* Where an axis is as good as straight: position = a + b · tangent. */
struct mvs_line {
    bool straight;
    float a, b;
};

/* w · shift of the planes at which groups end, for one neighbour. Group i reaches from end[i] to the one after it;
 * groups that follow one another share an end. column, row: the neighbour's axes, as far as the block sees them. */
struct mvs_ends {
    struct mvs_line column, row;
    int groups, count; /* count: rounded up to a multiple of 8, the last one repeated */
    uint8_t end[MVS_GROUPS_MAX];
    float x[2 * MVS_GROUPS_MAX], y[2 * MVS_GROUPS_MAX], z[2 * MVS_GROUPS_MAX];
};

/* The four paths that reach a pixel in one pass: along its row, and from the three pixels of the row before. */
#define MVS_PATHS 4
struct mvs_step {
    int lanes;
    const uint8_t *cost;
    const uint8_t *below, *above;         /* penalty of a step from the plane before, or after; 255: there is none */
    const uint8_t *previous[MVS_PATHS];   /* with one readable element before and one after */
    int lowest[MVS_PATHS], p2[MVS_PATHS]; /* of previous[]; the penalty of a jump; together at most 255 */
    uint8_t *path[MVS_PATHS];
    uint16_t *sum;
    bool add; /* sum goes on; else it begins */
};

/* The kernels; x86/ has variants that give the same numbers. */
struct mvs_kernels {
    /* cost[i · MVS_GROUP + k]: how far the neighbour's colour, where plane k of group i puts the ray (a: the ray turned
     * into the neighbour's frame), lies from `colour`; MVS_INVALID outside its image. Exact where groups end, and
     * positions between on the straight line. */
    void (*sweep)(const struct mvs_target *target, const struct mvs_ends *ends, const float a[3], uint32_t colour,
                  uint8_t *cost);
    /* result[k]: the mean of the `best` (1..4) smallest costs of lane k, of those that are valid; where none is, a
     * middling cost. */
    void (*combine)(uint8_t cost[LUMI_MVS_NEIGHBOURS][MVS_PLANES_MAX], int best, int lanes, uint8_t *result);
    /* A step of each path: path[k] = cost[k] + min(previous[k], previous[k − 1] + below[k], previous[k + 1] + above[k],
     * lowest + p2) − lowest, all at most 255; into sum[k]; lowest becomes that of path[]. */
    void (*step)(struct mvs_step *step);
    /* The first of the smallest. */
    int (*smallest)(const uint16_t *sum, int lanes);
};

const struct mvs_kernels *mvs_kernels(void);
extern const struct mvs_kernels mvs_kernels_c;
#if defined(__x86_64__)
extern const struct mvs_kernels mvs_kernels_avx2;
#endif

/* Costs of the planes searched at every pixel of `image`, into a volume. */
int mvs_volume(const struct mvs_image *image, int count, const struct mvs_target *targets,
               const struct mvs_planes *planes, const struct mvs_search *search, int threads, uint8_t *volume);

/* Picks a plane a pixel, to a fraction: planes[y · width + x]. */
int mvs_sgm(const struct mvs_image *image, const uint8_t *volume, const struct mvs_search *search, int threads,
            float *planes);

#endif
