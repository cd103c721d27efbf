/* What happens to the colours of every view of a capture, the same to all. */
#ifndef LUMI_PIPELINE_COLOR_GRADE_H
#define LUMI_PIPELINE_COLOR_GRADE_H

#include "pipeline/color/cube.h"
#include "pipeline/color/icc.h"
#include "pipeline/color/tone.h"
#include "pipeline/run/run.h"

struct lumi_grade {
    bool linear; /* the capture's pictures are linear in light: the profile's matrix is what counts */
    struct lumi_tone_map map;
    double balance[3]; /* factors */
    bool has_matrix, has_cube;
    double matrix[9];
    struct lumi_icc *icc; /* NULL: none */
    struct lumi_cube cube;
};

/* What the run's parameters say, but for `linear`, which it is given, and the map, which changes nothing yet. */
int lumi_grade_open(const struct lumi_run *run, bool linear, struct lumi_grade *grade, struct lumi_error *error);
void lumi_grade_finish(struct lumi_grade *grade);
/* Whether the files that the parameters name can be read and are what they are named for: told before the first stage
 * rather than after hours, at the last. */
int lumi_grade_check(const struct lumi_parameters *parameters, struct lumi_error *error);

/* A view (3-channel F32, linear light) in place: white balance, profile or matrix; with `whole` also exposure and tone,
 * and the look-up table, which is given and gives sRGB-encoded values. */
void lumi_grade_apply(const struct lumi_grade *grade, bool whole, struct lumi_raster *picture);

/* The text form of what depends on the capture (docs/color.md): linear and map. */
int lumi_grade_parse(const char *text, size_t size, const char *name, struct lumi_grade *grade,
                     struct lumi_error *error);
int lumi_grade_write(const char *path, const struct lumi_grade *grade, struct lumi_error *error);

#endif
