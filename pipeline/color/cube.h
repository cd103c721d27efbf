/* Look-up tables in .cube files (Adobe, "Cube LUT Specification", version 1.0, 2013; IRIDAS before that). */
#ifndef LUMI_PIPELINE_COLOR_CUBE_H
#define LUMI_PIPELINE_COLOR_CUBE_H

#include "proto/base/result.h"

#include <stddef.h>

#define LUMI_CUBE_MOST_3D 129
#define LUMI_CUBE_MOST_1D 65536

struct lumi_cube {
    int dimensions;          /* 1: a curve a channel; 3: a lattice */
    int size;                /* points a side */
    float least[3], most[3]; /* the domain: what the first and last points stand for */
    float *values;           /* three a point; of a lattice red runs fastest; owned */
};

/* `name` stands for the file in errors, which name the line. Besides the specification: LUT_1D_INPUT_RANGE and
 * LUT_3D_INPUT_RANGE (one domain for all channels), as other programs write. LUMI_ERR_UNSUPPORTED for other keywords,
 * LUMI_ERR_LIMIT over LUMI_CUBE_MOST_3D or _1D points a side. */
int lumi_cube_parse(const char *text, size_t size, const char *name, struct lumi_cube *cube, struct lumi_error *error);
int lumi_cube_read(const char *path, struct lumi_cube *cube, struct lumi_error *error);
void lumi_cube_finish(struct lumi_cube *cube);

/* One colour, held to the domain: linear along curves, tetrahedral in a lattice (Kasson, Nin, Plouffe, Hafner 1995). */
void lumi_cube_apply(const struct lumi_cube *cube, const float in[3], float out[3]);

#endif
