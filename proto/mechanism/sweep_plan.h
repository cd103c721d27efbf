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
    double settle; /* s, start-stop: from the last step of a move to the first exposure; below 0: the profile's */
    int bracket;   /* shots a position, 1 … 9; more than one in start-stop only */
    double exposures[LUMI_PLAN_BRACKET]; /* s, of each, in the order they are taken */
    double bracket_gap; /* s, between the end of one exposure and the trigger of the next, at least; the cameras'
                           busy time rules if longer */
    uint32_t cameras;   /* bit a camera of the rig; 0: all that have a channel */
    double blur_max;    /* pixels an exposure may smear while turning; 0: the default, LUMI_PLAN_BLUR */
};
/* The paper's limit: 1/250 s at 12°/s and 20 pixels a degree smear 0.96 of a pixel (Overbeck et al. 2018, section 3).
 */
#define LUMI_PLAN_BLUR 1.0
#define LUMI_PLAN_PULSE_GAP 0.005    /* s a trigger line is low between two pulses, at least */
#define LUMI_PLAN_SHOT_MARGIN 0.001  /* s between two shots that the board keeps for itself */
#define LUMI_PLAN_CRUISE_MARGIN 0.05 /* s of constant speed before the first exposure and behind the last */
#define LUMI_PLAN_SWING_MARGIN 0.1   /* s more of it before the first: what ramp and play have stirred swings out */
#define LUMI_PLAN_MOVE_MARGIN 0.02   /* s of a position's time that the board keeps for itself */

/* One turn count, 72 positions, 30 s, continuous, one exposure of 1/250 s, all cameras: what `rig` is meant for. */
void lumi_plan_init(struct lumi_plan *plan, const struct lumi_rig *rig);

/* Plans to begin with, for a rig that can do them (otherwise as lumi_plan_check says): "turn" (lumi_plan_init), "slow"
 * (twice its time and exposure), "still" (start-stop, 1/60 s, as fast as the rig can), "hdr" (the same with -2, 0 and
 * +2 stops). LUMI_ERR_NOTFOUND: there is none of this name. */
extern const char *const lumi_plan_builtin_names[]; /* NULL-terminated */
int lumi_plan_builtin(const char *name, const struct lumi_rig *rig, struct lumi_plan *plan, struct lumi_error *error);

/* Whether this rig can do it: LUMI_ERR_FORMAT with the reason (outruns the motor, the cameras or the positions' time;
 * blurs; more turns than string; drop with a brake that holds; too many shots). For a rig that passed lumi_rig_check;
 * what follows is for plans that passed this. */
int lumi_plan_check(const struct lumi_plan *plan, const struct lumi_rig *rig, struct lumi_error *error);

/* Shots are numbered 0 … lumi_plan_shots − 1 in the order they are taken: bracket fastest, then position, then turn; a
 * video has none. Frames: shots times cameras. Seconds: from the first motion of the sweep itself (run-up) to the last
 * motion or exposure, without homing, winding and the lead of a video. */
int lumi_plan_shots(const struct lumi_plan *plan);
int lumi_plan_frames(const struct lumi_plan *plan, const struct lumi_rig *rig);
double lumi_plan_seconds(const struct lumi_plan *plan, const struct lumi_rig *rig);
/* How far in pixels one exposure smears at the sphere's equator while turning; the largest of all cameras. 0 in
 * start-stop. */
double lumi_plan_blur(const struct lumi_plan *plan, const struct lumi_rig *rig);

/* Bit a camera that takes part: the plan's, or all that have a channel. */
uint32_t lumi_plan_cameras(const struct lumi_plan *plan, const struct lumi_rig *rig);
/* The step nearest to position `position` of the plan (0: at the beginning of first_turn), without drift. */
int64_t lumi_plan_position_step(const struct lumi_plan *plan, const struct lumi_rig *rig, int position);

/* Start-stop. Seconds from position to position, from the last step of a move to the first exposure's begin, and from
 * there to the begin of exposure `k` of the bracket (k = bracket: until another position's first may begin). The next
 * move begins position_seconds after the one before. */
double lumi_plan_position_seconds(const struct lumi_plan *plan);
double lumi_plan_settle(const struct lumi_plan *plan, const struct lumi_rig *rig);
double lumi_plan_exposure_offset(const struct lumi_plan *plan, const struct lumi_rig *rig, int k);
/* Least seconds from the begin of exposure `k` to the begin of the next, whatever comes next: until every camera takes
 * a trigger again and its lines have been low. */
double lumi_plan_exposure_spacing(const struct lumi_plan *plan, const struct lumi_rig *rig, int k);

/* Continuous and video: the platform's speed; how far before position 0 it starts from rest and how far behind the
 * sweep's last place it comes to rest, in turns: the ramp, the backlash before the sweep, and what it turns at
 * constant speed besides. */
double lumi_plan_speed(const struct lumi_plan *plan); /* rad/s */
double lumi_plan_run_up(const struct lumi_plan *plan, const struct lumi_rig *rig);
double lumi_plan_run_down(const struct lumi_plan *plan, const struct lumi_rig *rig);
/* From position 0 to the last place of the sweep, in turns: the last position, or for a video the end of its last turn.
 */
double lumi_plan_span(const struct lumi_plan *plan);

/* The text form (docs/rig-plan.md), as with rig profiles; cameras are called by the rig's names. Parsing begins with
 * lumi_plan_init and ends with lumi_plan_check. */
int lumi_plan_parse(const char *text, size_t size, const char *source, const struct lumi_rig *rig,
                    struct lumi_plan *plan, struct lumi_error *error);
/* What can be said of it without a rig: whether it is a plan at all. */
int lumi_plan_check_text(const char *text, size_t size, const char *source, struct lumi_error *error);
/* Every line that is wrong; where none is, what the rig cannot do, with the line that the rig could do without, if
 * there is one. Returns how many, at most `max` filled in; 0: *plan can be run. */
struct lumi_plan_problem {
    int line; /* from 1; 0: of no line */
    char text[256];
};
int lumi_plan_problems(const char *text, size_t size, const struct lumi_rig *rig, struct lumi_plan *plan,
                       struct lumi_plan_problem *problems, int max);
size_t lumi_plan_print(const struct lumi_plan *plan, const struct lumi_rig *rig, char *text, size_t size);
#define LUMI_PLAN_TEXT_MAX 4096

#ifdef __cplusplus
}
#endif
#endif
