/* Tracks: what is the same point in many pictures, joined from pairs. */
#ifndef LUMI_PIPELINE_CALIBRATE_TRACKS_H
#define LUMI_PIPELINE_CALIBRATE_TRACKS_H

#include "pipeline/calibrate/pairs.h"

struct lumi_observation {
    int image, feature;
    float x, y;  /* pixels of the picture, centres at half-integers */
    float sigma; /* standard deviation that is to be expected of them, pixels */
};

struct lumi_track {
    int first, count; /* its observations, ascending by image, each image once */
};

struct lumi_tracks {
    int track_count, observation_count;
    struct lumi_track *tracks;
    struct lumi_observation *observations;
};

struct lumi_tracks_settings {
    int per_image; /* so many observations of a picture are aimed at, evenly over it; long tracks first; 0: all */
    int shortest;  /* tracks of fewer observations are left out */
};

void lumi_tracks_defaults(struct lumi_tracks_settings *settings);

/* From what the stages features and pairs left. Tracks that hold two features of one picture are left out. */
int lumi_tracks_build(const struct lumi_run *run, const struct lumi_tracks_settings *settings,
                      struct lumi_tracks *tracks, struct lumi_error *error);
void lumi_tracks_finish(struct lumi_tracks *tracks);

#endif
