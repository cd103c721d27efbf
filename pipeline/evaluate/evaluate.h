/* A field against the truth: its views rendered and compared, one by one. */
#ifndef LUMI_PIPELINE_EVALUATE_EVALUATE_H
#define LUMI_PIPELINE_EVALUATE_EVALUATE_H

#include "pipeline/evaluate/metrics.h"
#include "pipeline/evaluate/renderer.h"
#include "proto/base/lens.h"

#include <stdbool.h>

/* One picture of the truth. */
struct lumi_truth {
    char *name; /* of the file, without folder and extension */
    char *path;
    struct lumi_lens lens;
    struct lumi_pose pose;
};

struct lumi_truth_set {
    struct lumi_truth *items;
    int count;
};

/* Reads the poses and lenses of a transforms.json; pictures are read when they are needed. `frames` (may be NULL) is a
 * regular expression that the names begin with; others are left out. `poses_only`: the pictures need not be there. */
int lumi_truth_read(const char *path, const char *frames, bool poses_only, struct lumi_truth_set *truth,
                    struct lumi_error *error);
void lumi_truth_finish(struct lumi_truth_set *truth);
/* A truth's pixels, RGB bytes of its lens's size. */
int lumi_truth_picture(const struct lumi_truth *truth, struct lumi_raster *picture, struct lumi_error *error);

struct lumi_evaluate_options {
    struct lumi_render_options render;
    const char *difference; /* folder for difference pictures, made if need be; NULL: none */
    const char *sheet;      /* contact sheet (PNG); NULL: none */
    int sheet_views;        /* at most so many on it, evenly chosen */
    void (*progress)(void *context, const char *what, int done, int total); /* may be NULL */
    void *context;
};

struct lumi_evaluated_view {
    const char *name; /* the truth's */
    struct lumi_comparison comparison;
    double uncovered; /* share of the pixels the lens images */
};

struct lumi_evaluation {
    struct lumi_evaluated_view *views;
    int count, worst; /* by PSNR of RGB */
    struct lumi_comparison mean;
    double uncovered;      /* mean */
    double plane_distance; /* metres, infinity for 0; method plane only */
    int damaged;           /* tiles of the field */
};

/* Renders every view of the truth and compares. `evaluation` borrows names from `truth`. */
int lumi_evaluate(const char *field, const struct lumi_truth_set *truth, const struct lumi_evaluate_options *options,
                  struct lumi_evaluation *evaluation, struct lumi_error *error);
void lumi_evaluation_finish(struct lumi_evaluation *evaluation);

/* As a table for people, and as JSON; both are freed with g_free. */
char *lumi_evaluation_text(const struct lumi_evaluation *evaluation);
char *lumi_evaluation_json(const struct lumi_evaluation *evaluation);

#endif
