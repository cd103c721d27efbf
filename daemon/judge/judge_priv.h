/* What the parts of judgement share. */
#ifndef LUMI_DAEMON_JUDGE_JUDGE_PRIV_H
#define LUMI_DAEMON_JUDGE_JUDGE_PRIV_H

#include "daemon/judge/judge.h"

#include <stdint.h>

#define JUDGE_SMALL 320 /* longer side of the picture that is kept, at most */

/* Linear light, one channel, rows without padding. Raw: 1 is the sensor's white. */
struct judge_plane {
    int width, height;
    float *data;
};

struct lumi_judge_picture {
    int width, height;        /* of the frame */
    struct judge_plane small; /* means of `step` × `step` pixels */
    int step;
    double sharpness, blur_pixels, blur_angle, clipped, dark, mean;
    double blur_explained, blur_depth, blur_length; /* of the best smear, found or not */
    double blur_groups[4]; /* the depth in each quarter of the picture; NaN: nothing to be seen there */
    double noise;          /* standard deviation of a pixel of the frame, linear */
};

/* The whole frame as light; counts pixels at white and at black on the way. The caller releases plane->data. */
int judge_decode(const struct lumi_camera_frame *frame, struct judge_plane *plane, double *clipped, double *dark,
                 struct lumi_error *error);

/* Sharpness and smear of a plane, from spectra of parts of it. LUMI_ERR_NOMEM. */
int judge_spectrum(const struct judge_plane *plane, double noise, struct lumi_judge_picture *picture);

/* In place; `count` is a power of two up to 256. */
void judge_fft(float *re, float *im, int count);

/* Exposure, shift and moved things, against neighbours. */
int judge_compare(const struct lumi_judge_picture *picture, const struct lumi_lens *lens, const struct lumi_pose *pose,
                  double exposure_s, double gain, const struct lumi_judge_neighbour *neighbours, int count,
                  struct lumi_judge_numbers *numbers);

#endif
