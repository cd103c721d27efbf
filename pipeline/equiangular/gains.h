/* What the stage "equalize" found: by how much each picture is brighter than the others, and how each lens darkens its
 * picture's edges. A JSON file (docs/color.md):
 *
 *   {"format": "lumisphere gains", "version": 1,
 *    "lenses": [{"vignetting": [b1, b2, b3]}, ...],
 *    "images": [{"name": "...", "lens": 0, "gain": [red, green, blue]}, ...]}
 *
 * A picture shows gain · exp(b1 r² + b2 r⁴ + b3 r⁶) times the light, r the distance from the lens's principal point by
 * half the picture's diagonal. */
#ifndef LUMI_PIPELINE_EQUIANGULAR_GAINS_H
#define LUMI_PIPELINE_EQUIANGULAR_GAINS_H

#include "proto/base/lens.h"
#include "proto/base/raster.h"
#include "proto/base/result.h"

#include <stdbool.h>
#include <stddef.h>

#define LUMI_GAINS_MAX 100000 /* images, and lenses */
#define LUMI_GAIN_MOST 1024   /* and its inverse the least */

struct lumi_gain {
    char name[64];
    int lens; /* index */
    double gain[3];
};

struct lumi_gains {
    int lens_count, count;
    double (*vignetting)[3]; /* a lens */
    struct lumi_gain *items; /* in the order of names (strcmp) */
};

/* *gains is zeroed and its arrays are made; LUMI_ERR_NOMEM. */
int lumi_gains_create(struct lumi_gains *gains, int lens_count, int count, struct lumi_error *error);
void lumi_gains_finish(struct lumi_gains *gains);
/* Sorts the items by name. */
void lumi_gains_sort(struct lumi_gains *gains);
/* NULL: there is none of that name. */
const struct lumi_gain *lumi_gains_find(const struct lumi_gains *gains, const char *name);

/* `source` stands for the file in errors. */
int lumi_gains_parse(const char *text, size_t size, const char *source, struct lumi_gains *gains,
                     struct lumi_error *error);
int lumi_gains_read(const char *path, struct lumi_gains *gains, struct lumi_error *error);
/* 17 digits: reading gives the same numbers. */
int lumi_gains_write(const char *path, const struct lumi_gains *gains, struct lumi_error *error);

/* Divides a picture (3-channel F32, linear light, taken through `lens`) by what `gain` says; pictures that are not in
 * the list (NULL) stay as they are. `clipped`: where a channel nears 1 the sensor may have clipped: such pixels are
 * made no darker and get no colour, so that white stays white. */
void lumi_gains_apply(const struct lumi_gains *gains, const struct lumi_gain *gain, const struct lumi_lens *lens,
                      bool clipped, struct lumi_raster *picture);
/* ln of the factor of a lens at squared radius r2. */
double lumi_vignetting_log(const double vignetting[3], double r2);
/* The squared radius of a pixel, by half the picture's diagonal. */
double lumi_vignetting_radius2(const struct lumi_lens *lens, double x, double y);

#endif
