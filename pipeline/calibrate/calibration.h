/* A capture's calibration: from what its pictures have in common to where they were taken, and what a person should
 * know about it. */
#ifndef LUMI_PIPELINE_CALIBRATE_CALIBRATION_H
#define LUMI_PIPELINE_CALIBRATE_CALIBRATION_H

#include "pipeline/calibrate/refine.h"
#include "pipeline/calibrate/solve.h"
#include "pipeline/calibrate/tracks.h"

#include <glib.h>

/* What is known of a frame before anything is solved. */
struct lumi_frame_evidence {
    int features;
    double mean, sharpness; /* as in struct lumi_features */
    int partners;           /* that share matches with it */
    int matches;            /* with all of them */
    int foreign;            /* of these, with pictures of other cameras */
};

/* What two pictures say of one another by themselves, as in struct lumi_pair. */
struct lumi_motion {
    int a, b; /* frames */
    int free_count, free_outside;
    double rotation[9];
    struct lumi_vec3 direction;
};

struct lumi_evidence {
    struct lumi_frame_evidence *frames; /* one a frame of the run */
    int motion_count;
    struct lumi_motion *motions;
    bool pictures; /* can be read: points are matched anew in them (refine.h) */
};

/* Something a person should know, and do. */
struct lumi_finding {
    char what[64];   /* "camera c03", "frame r01c20", "lens wide", "rig" */
    char text[320];  /* what it is, and what to do about it */
    int frames_lost; /* not used because of it */
};

struct lumi_frame_outcome {
    bool used;
    char why[128];                    /* not used */
    int seen;                         /* observations that count */
    double rms, worst;                /* pixels */
    double moved_m, moved_rotation;   /* from the capture's pose */
    double beside_m, beside_rotation; /* from where the mechanism has it; 0 without one */
    bool weak;                        /* few observations, or far beside the mechanism */
};

#define LUMI_COVERAGE_COLUMNS 12
#define LUMI_COVERAGE_ROWS 10

struct lumi_lens_outcome {
    char name[64]; /* of a camera that has it */
    struct lumi_lens before, after;
    int observations, frames;
    double covered; /* share of the picture's cells in which something was seen */
    bool self_calibrated;
};

struct lumi_calibration {
    int frame_count, used;
    struct lumi_frame_outcome *frames;
    struct lumi_pose *poses; /* of every frame; of one that is not used: the capture's */
    int *lens_of;            /* of every frame: index into lenses */
    int lens_count;
    struct lumi_lens_outcome *lenses;
    bool has_mechanism;
    struct lumi_mechanism mechanism;
    double shutter; /* of the rig's turn while a picture is read, radians, where that was asked for */
    struct lumi_refined refined;
    struct lumi_solve_result solved;
    double rms;       /* pixels, of all observations that count */
    GArray *findings; /* struct lumi_finding */
};

/* Poses of all frames that can be had. LUMI_ERR_FORMAT where the whole cannot: too little in common, or a prior that is
 * wrong as a whole; the text says what to do, and what was found until then is in `calibration`, to be finished too. */
int lumi_calibrate(const struct lumi_run *run, const struct lumi_evidence *evidence, const struct lumi_tracks *tracks,
                   struct lumi_calibration *calibration, struct lumi_error *error);
void lumi_calibration_finish(struct lumi_calibration *calibration);

void lumi_calibration_find(struct lumi_calibration *calibration, int frames_lost, const char *what, const char *format,
                           ...) G_GNUC_PRINTF(4, 5);
/* A frame is left out; the first reason stays. */
void lumi_calibration_drop(struct lumi_calibration *calibration, int frame, const char *format, ...)
    G_GNUC_PRINTF(3, 4);

/* What is wrong before anything is solved: pictures that are missing, black or blurred, short brackets, cameras and
 * frames that share nothing with others, cameras whose prior is another's, a sweep that turned the other way. Drops,
 * and finds. */
int lumi_calibration_suspects(const struct lumi_run *run, const struct lumi_evidence *evidence,
                              struct lumi_calibration *calibration, struct lumi_error *error);
/* Its parts: what never came; cameras whose prior their own pictures contradict. */
void lumi_calibration_missing(const struct lumi_run *run, struct lumi_calibration *calibration);
int lumi_calibration_wrong_priors(const struct lumi_run *run, const struct lumi_evidence *evidence,
                                  struct lumi_calibration *calibration, struct lumi_error *error);

/* The heading above the findings in the report, one to an indented line. */
#define TO_LOOK_AT "To look at"

/* The report, for a person and as one JSON object; free with g_free. And in a line. */
char *lumi_calibration_text(const struct lumi_run *run, const struct lumi_calibration *calibration);
char *lumi_calibration_json(const struct lumi_run *run, const struct lumi_calibration *calibration);

/* The report of one that came to nothing. */
char *lumi_calibration_refusal(const struct lumi_calibration *calibration, const char *why);

/* The frame's camera in run->rig, by name; −1. */
int lumi_calibration_rig_camera(const struct lumi_run *run, int frame);

#endif
