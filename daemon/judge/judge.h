/* Is this frame good? Numbers from the picture itself, from the frames beside it, and a verdict. No thread, no clock,
 * no file but those it is given. */
#ifndef LUMI_DAEMON_JUDGE_JUDGE_H
#define LUMI_DAEMON_JUDGE_JUDGE_H

#include "proto/base/geometry.h"
#include "proto/base/lens.h"
#include "proto/base/result.h"
#include "proto/capture/capture.h"

struct lumi_camera_frame;

/* A frame made small, with what is computed of it once; kept of the latest frames of every camera. Allocated. */
struct lumi_judge_picture;
/* Decodes (JPEG, Bayer, YUV, a file) at a fraction of its size where that is enough. LUMI_ERR_FORMAT: it is no picture.
 */
int lumi_judge_picture_create(const struct lumi_camera_frame *frame, struct lumi_judge_picture **picture,
                              struct lumi_error *error);
void lumi_judge_picture_destroy(struct lumi_judge_picture *picture);

struct lumi_judge_numbers {
    double sharpness; /* share of the detail that an ideal lens would leave; comparable between frames of one camera; 0:
                         nothing to tell it by, a plain wall */
    double blur_pixels;    /* length of the smear along its direction, from the picture's spectrum; 0: none seen */
    double blur_angle;     /* its direction, radians from the picture's x towards y, 0..π */
    double clipped;        /* share of pixels at white */
    double dark;           /* share at black */
    double mean;           /* linear, 0..1 */
    double exposure_stops; /* against neighbours, where they overlap; NaN: no neighbour */
    double shift_pixels;   /* of the picture against where its pose says it looks, from its neighbours; NaN unknown */
    double moved; /* share of the overlap that differs beyond parallax and noise: things that moved; NaN unknown */
};
struct lumi_judge_neighbour {
    const struct lumi_judge_picture *picture;
    const struct lumi_lens *lens;
    struct lumi_pose pose;
    double exposure_s, gain; /* as reported; 0: unknown */
};
struct lumi_judge_limits {
    double sharpness_share; /* of the median of the camera's frames so far, below which it is rejected (0.5) */
    double blur_pixels;     /* (2) */
    double clipped;         /* (0.25) */
    double exposure_stops;  /* (0.5) */
    double shift_pixels;    /* (8) */
    double moved;           /* (0.05): a warning, no rejection, unless reject_moved */
    bool reject_moved;
};
void lumi_judge_limits_init(struct lumi_judge_limits *limits);

int lumi_judge_measure(const struct lumi_judge_picture *picture, const struct lumi_lens *lens,
                       const struct lumi_pose *pose, double exposure_s, double gain,
                       const struct lumi_judge_neighbour *neighbours, int count, struct lumi_judge_numbers *numbers,
                       struct lumi_error *error);
/* What a camera's frames usually have: the sharpness of its latest accepted ones. All zero is a new one. */
struct lumi_judge_usual {
    float sharpness[31];
    int count; /* ever */
};
void lumi_judge_usual_add(struct lumi_judge_usual *usual, double sharpness); /* 0, unknown, counts for nothing */
double lumi_judge_usual_sharpness(const struct lumi_judge_usual *usual);     /* their median; 0: less than three */

/* What a rejected frame is rejected for: the first of its reasons, in the order of the verdict. */
enum lumi_judge_fault {
    LUMI_JUDGE_GOOD = 0,
    LUMI_JUDGE_SOFT,    /* not sharp, smeared */
    LUMI_JUDGE_CLIPPED, /* too much of it is white */
    LUMI_JUDGE_MOVED,   /* the camera, or what it sees */
    LUMI_JUDGE_OTHER    /* brighter or darker than its neighbours; whatever is no number */
};
const char *lumi_judge_fault_name(enum lumi_judge_fault fault); /* "", "soft", "clipped", "moved", "other" */

/* Whether it is accepted; `reason` (one line, "" where there is nothing to say) also holds warnings. `fault` may be
 * NULL. */
bool lumi_judge_verdict(const struct lumi_judge_numbers *numbers, const struct lumi_judge_limits *limits,
                        double usual_sharpness, enum lumi_judge_fault *fault, char *reason, size_t size);

#endif
