/* The plan of a sweep: what a rig shall do, in numbers, and whether it can. No heap, no files: firmware uses it too. */
#ifndef LUMI_PROTO_MECHANISM_SWEEP_PLAN_H
#define LUMI_PROTO_MECHANISM_SWEEP_PLAN_H

#include "proto/mechanism/rig.h"

#ifdef __cplusplus
extern "C" {
#endif

enum lumi_plan_mode {
    LUMI_PLAN_CONTINUOUS = 0, /* constant angular velocity, cameras fire as positions pass */
    LUMI_PLAN_START_STOP = 1, /* stands at every position */
    LUMI_PLAN_VIDEO = 2       /* constant angular velocity, cameras record by themselves, the lamp marks the turns */
};
enum lumi_plan_wind {
    LUMI_PLAN_WIND_PLAN = 0, /* before the sweep: back to its first turn */
    LUMI_PLAN_WIND_FULL,     /* before the sweep: all the way up (turn 0), then to its first turn */
    LUMI_PLAN_WIND_NONE      /* the sweep begins where the arm is: first_turn must be the turn the rig is at */
};

#define LUMI_PLAN_BRACKET 9      /* exposures of one position, at most */
#define LUMI_PLAN_SHOTS_MAX 8192 /* shots of one sweep, at most */

struct lumi_plan {
    char name[LUMI_RIG_NAME];
    enum lumi_plan_mode mode;
    enum lumi_plan_wind wind;
    int positions;         /* a turn */
    int first_turn, turns; /* the sweep covers turns first_turn .. first_turn + turns − 1 of the profile's string */
    double turn_time;      /* s a turn: continuous and video; start-stop: how long a turn takes in all. */
    double position_time;  /* s from position to position, start-stop; 0: turn_time / positions */
    double settle;         /* s, start-stop; below 0: the profile's */
    int bracket;           /* shots a position, 1 … 9; more than one in start-stop only */
    double exposures[LUMI_PLAN_BRACKET]; /* s, of each, in the order they are taken */
    double bracket_gap; /* s, between the end of one exposure and the trigger of the next, at least; the cameras'
                           busy time rules if longer */
    uint32_t cameras;   /* bit a camera of the rig; 0: all that have a channel */
    double blur_max;    /* pixels an exposure may smear while turning; 0: the default, LUMI_PLAN_BLUR */
};
/* The paper's limit: 1/250 s at 12°/s and 20 pixels a degree smear 0.96 of a pixel (Overbeck et al. 2018, section 3).
 */
#define LUMI_PLAN_BLUR 1.0

/* One turn count, 72 positions, 30 s, continuous, one exposure of 1/250 s, all cameras: what `rig` is meant for. */
void lumi_plan_init(struct lumi_plan *plan, const struct lumi_rig *rig);

/* Whether this rig can do it: LUMI_ERR_FORMAT with the reason (outruns the motor, the cameras or the positions' time;
 * blurs; more turns than string; drop with a brake that holds; too many shots). */
int lumi_plan_check(const struct lumi_plan *plan, const struct lumi_rig *rig, struct lumi_error *error);

/* Shots are numbered 0 … lumi_plan_shots − 1 in the order they are taken: bracket fastest, then position, then turn.
 * Frames: shots times cameras. Seconds: from the first motion of the sweep itself (run-up) to the last, without homing
 * and winding. */
int lumi_plan_shots(const struct lumi_plan *plan);
int lumi_plan_frames(const struct lumi_plan *plan, const struct lumi_rig *rig);
double lumi_plan_seconds(const struct lumi_plan *plan, const struct lumi_rig *rig);
/* How far in pixels one exposure smears at the sphere's equator while turning; the largest of all cameras. */
double lumi_plan_blur(const struct lumi_plan *plan, const struct lumi_rig *rig);

/* The text form (docs/rig-plan.md), as with rig profiles. */
int lumi_plan_parse(const char *text, size_t size, const char *source, const struct lumi_rig *rig,
                    struct lumi_plan *plan, struct lumi_error *error);
size_t lumi_plan_print(const struct lumi_plan *plan, char *text, size_t size);
#define LUMI_PLAN_TEXT_MAX 4096

#ifdef __cplusplus
}
#endif
#endif
