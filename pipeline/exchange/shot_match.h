/* Which of the pictures that a camera wrote by itself belongs to which shot of a sweep.
 *
 * All cameras of a rig fire together, each tells the time by a clock of its own, and each may lack pictures or have
 * some more. So the clocks are laid over each other first (an offset and a drift each, found by a vote of all
 * differences); pictures of one moment are an event; and the events are laid over the shots by the beat of the sweep,
 * as cheaply as can be: a pause costs, a shot that no camera has costs, an event that is no shot costs the more the
 * more cameras took part. */
#ifndef LUMI_PIPELINE_EXCHANGE_SHOT_MATCH_H
#define LUMI_PIPELINE_EXCHANGE_SHOT_MATCH_H

#include "proto/base/result.h"

#include <stdbool.h>

#define LUMI_SHOT_BRACKET 9

struct lumi_shot_item {
    double time;  /* s by the camera's clock; NaN: not known */
    double stops; /* log2 of what it was exposed with (time, sensitivity); NaN: not known */
};

struct lumi_shot_camera {
    const struct lumi_shot_item *items; /* in the order they were taken */
    int count;
    int *shots; /* out, of each item: number of the shot, −1: of none. The caller's memory */
    /* out */
    bool by_order;        /* its times were of no use */
    bool ambiguous;       /* another offset fits as well: whether its first or its last shots are missing is a guess */
    bool coarse;          /* whole seconds that are longer than the beat */
    int matched;          /* items that have a shot */
    double offset, drift; /* its clock = offset + (1 + drift) · the first camera's that has times */
    double residual, worst; /* s, root mean square and largest, against the shots' times */
};

struct lumi_shot_plan {
    int shots;                         /* positions times bracket */
    int bracket;                       /* shots a position */
    double offsets[LUMI_SHOT_BRACKET]; /* of each, in stops, in the order they are taken */
};

/* LUMI_ERR_ARG for a plan without shots, LUMI_ERR_LIMIT for more items than a sweep can have. */
int lumi_shot_match(const struct lumi_shot_plan *plan, struct lumi_shot_camera *cameras, int count,
                    struct lumi_error *error);

/* The bracket that a camera's exposures repeat: how many shots a position has (1: no pattern), their offsets in stops
 * about the middle one. */
int lumi_shot_find_bracket(const struct lumi_shot_item *items, int count, double offsets[LUMI_SHOT_BRACKET]);

#endif
