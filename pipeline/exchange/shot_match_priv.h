/* Within exchange: what clocks, events and beat of a sweep share. */
#ifndef LUMI_PIPELINE_EXCHANGE_SHOT_MATCH_PRIV_H
#define LUMI_PIPELINE_EXCHANGE_SHOT_MATCH_PRIV_H

#include "pipeline/exchange/shot_match.h"

#include <glib.h>

#define SHOT_TRACKS 16 /* cameras of a rig, at most */

/* One camera's items with times that can be compared. */
struct shot_track {
    const struct lumi_shot_camera *camera;
    int count;
    double *times;     /* by its own clock, rising as far as they are known; NaN only where none is known */
    int *labels;       /* place in the bracket, −1: not known */
    double resolution; /* of its clock, s */
    bool timed;
    double offset, drift; /* to the reference's clock */
    bool ambiguous;
};

/* Pictures of one moment. */
struct shot_event {
    double time; /* the reference's clock */
    int label;
    int cameras; /* that took part */
    int shot;    /* −1: of none */
};

/* How far apart shots are: from the begin of a position, and from position to position. */
struct shot_beat {
    int bracket;
    double within[LUMI_SHOT_BRACKET];
    double period;
    double least; /* the shortest time between two shots */
};

static inline double shot_elapsed(const struct shot_beat *beat, int from, int to)
{
    return (to / beat->bracket - from / beat->bracket) * beat->period + beat->within[to % beat->bracket] -
           beat->within[from % beat->bracket];
}

static inline double shot_common_time(const struct shot_track *track, double time)
{
    return (time - track->offset) / (1 + track->drift);
}

/* Offsets and drifts of all tracks against tracks[reference]. */
void shot_align_clocks(struct shot_track *tracks, int count, int reference, const struct shot_beat *beat);

/* Events of all timed tracks in the order of time. Which event item i of track c belongs to: member[c][i], −1: none;
 * the arrays are released with g_free, events with g_array_unref. */
GArray *shot_join_events(const struct shot_track *tracks, int count, double tolerance, int **member);

/* Lays events over shots (event->shot). */
int shot_lay_events(GArray *events, int cameras, int shots, const struct shot_beat *beat, struct lumi_error *error);

#endif
