/* What dense_cast.c and its kernels share. */
#ifndef LUMI_RENDER_CPU_DENSE_CAST_PRIV_H
#define LUMI_RENDER_CPU_DENSE_CAST_PRIV_H

#include "render/cpu/dense_cast.h"

#include <stdbool.h>

#define CAST_BOUND 8         /* pixels a side of the cells whose depths are bounded */
#define CAST_AXIS_CELLS 1024 /* of the table from tangents to pixels */
#define CAST_STEPS_MAX 1024  /* of a search: beyond, they are longer than a pixel */

/* Pixel of a tangent: straight within each of many short cells, exact at their ends. */
struct cast_axis {
    float origin, scale; /* cell = (tangent − origin) · scale, held to the table */
    float offset[CAST_AXIS_CELLS], slope[CAST_AXIS_CELLS];
    int tiles; /* within each the grid itself is straight */
    float tile_tangent[LUMI_GRID_MAX + 1], tile_offset[LUMI_GRID_MAX], tile_slope[LUMI_GRID_MAX];
};

/* Pixel of a tangent where at most two tiles are met: one line up to the border between them, the other from there. */
struct cast_lines {
    bool hold; /* false: more tiles, look into the axis */
    float border, offset[2], slope[2];
};

struct cast_view {
    const struct lumi_view *view;
    struct lumi_raster pixels;
    const float *depth; /* rows of `pitch` */
    int width, height, pitch;
    int bound_cols, bound_rows;
    float *lowest, *highest; /* of the pixels of a cell and those around it */
    float all_lowest, all_highest;
    struct cast_axis *x, *y;
};

/* Lowest and highest of the rays with weight. */
struct cast_reach {
    float ax[2], ay[2], u[2], v[2];
};

/* The rays of a cell about one view. */
struct cast_cell {
    float ax[LUMI_CELL_PIXELS], ay[LUMI_CELL_PIXELS]; /* tangents of the direction in the view */
    float u[LUMI_CELL_PIXELS], v[LUMI_CELL_PIXELS];
    float weight[LUMI_CELL_PIXELS];                   /* 0: this ray has nothing to do with the view */
    float w[LUMI_CELL_PIXELS];                        /* inverse depth, in the view, of what is met */
    float px[LUMI_CELL_PIXELS], py[LUMI_CELL_PIXELS]; /* where, in pixels */
};

/* Where the search begins and ends (lo < hi or equal), in so many steps; 0: so many looks at the depth, each where the
 * last one says, lead there. */
struct cast_search {
    float lo, hi;
    int steps, looks;
    struct cast_lines x, y;
};

struct cast_disk {
    enum lumi_disk_shape shape;
    enum lumi_disk_kernel kernel;
    float scale, stretch;
};

/* The kernels; x86/ has variants that give the same numbers. */
struct cast_kernels {
    /* Fills ax, ay, u, v and weight, and their reach; false where no weight is above 0. */
    bool (*cross)(const struct lumi_surface_view *place, const struct cast_disk *disk, const float *x, const float *y,
                  const float *z, struct cast_cell *cell, struct cast_reach *reach);
    /* Fills w, px and py and lowers weights by the stretch, to 0 where nothing of the view is met. */
    void (*meet)(const struct cast_view *view, const struct cast_search *search, float stretch, struct cast_cell *cell);
    /* Adds to the sums' r, g, b and weight, from place `at`. */
    void (*shade)(const struct cast_view *view, enum lumi_filter filter, const struct cast_cell *cell,
                  struct lumi_sums *sums, size_t at);
};

const struct cast_kernels *cast_kernels(void);
extern const struct cast_kernels cast_kernels_c;
#if defined(__x86_64__)
extern const struct cast_kernels cast_kernels_avx2;
#endif

#endif
