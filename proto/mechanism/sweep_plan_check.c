/* Which sweeps a rig cannot make. Linked into firmware: no stdio. */
#include "proto/mechanism/kinematics.h"
#include "proto/mechanism/ramp_time.h"
#include "proto/mechanism/rig_priv.h"
#include "proto/mechanism/sweep_plan_priv.h"

#include <math.h>

static int check_numbers(const struct lumi_plan *plan, struct lumi_error *error)
{
    if (!rig_name_ok(plan->name))
        RIG_REFUSE("the plan has no usable name");
    if ((int)plan->mode < LUMI_PLAN_CONTINUOUS || (int)plan->mode > LUMI_PLAN_VIDEO)
        RIG_REFUSE("mode %d is none of continuous, start-stop, video", (int)plan->mode);
    if ((int)plan->wind < LUMI_PLAN_WIND_PLAN || (int)plan->wind > LUMI_PLAN_WIND_NONE)
        RIG_REFUSE("wind %d is none of plan, full, none", (int)plan->wind);
    if (plan->positions < 1 || plan->positions > LUMI_RIG_POSITIONS_MAX)
        RIG_REFUSE("%d positions a turn: 1 to %d wanted", plan->positions, LUMI_RIG_POSITIONS_MAX);
    if (plan->first_turn < 0 || plan->first_turn >= LUMI_RIG_TURNS_MAX)
        RIG_REFUSE("first turn %d: 0 to %d wanted", plan->first_turn, LUMI_RIG_TURNS_MAX - 1);
    if (plan->turns < 1 || plan->turns > LUMI_RIG_TURNS_MAX)
        RIG_REFUSE("%d turns: 1 to %d wanted", plan->turns, LUMI_RIG_TURNS_MAX);
    if (!rig_within(plan->turn_time, 0.1, 86400))
        RIG_REFUSE("a turn in %g s: 0.1 to 86400 wanted", plan->turn_time);
    if (!rig_within(plan->position_time, 0, 86400))
        RIG_REFUSE("a position in %g s: 0 to 86400 wanted", plan->position_time);
    if (!rig_within(plan->settle, -1e9, 60))
        RIG_REFUSE("settle of %g s: up to 60 wanted, or below 0 for the profile's", plan->settle);
    if (!rig_within(plan->bracket_gap, 0, 60))
        RIG_REFUSE("bracket gap of %g s: 0 to 60 wanted", plan->bracket_gap);
    if (!rig_within(plan->blur_max, 0, 1000))
        RIG_REFUSE("a blur of %g pixels: 0 to 1000 wanted", plan->blur_max);
    if (plan->bracket < 1 || plan->bracket > LUMI_PLAN_BRACKET)
        RIG_REFUSE("%d exposures a position: 1 to %d wanted", plan->bracket, LUMI_PLAN_BRACKET);
    for (int k = 0; k < plan->bracket; k++)
        if (!rig_within(plan->exposures[k], 1e-6, 60))
            RIG_REFUSE("an exposure of %g s: 0.000001 to 60 wanted", plan->exposures[k]);
    if (plan->mode != LUMI_PLAN_VIDEO && (int64_t)plan->positions * plan->turns * plan->bracket > LUMI_PLAN_SHOTS_MAX)
        RIG_REFUSE("%d turns of %d positions with %d exposures are %d shots, the board keeps %d", plan->turns,
                   plan->positions, plan->bracket, plan->turns * plan->positions * plan->bracket, LUMI_PLAN_SHOTS_MAX);
    return LUMI_OK;
}

static int check_cameras(const struct lumi_plan *plan, const struct lumi_rig *rig, struct lumi_error *error)
{
    const char *line = plan->mode == LUMI_PLAN_VIDEO ? "record line" : "trigger";

    if (plan->cameras >> rig->camera_count)
        RIG_REFUSE("the plan names camera %d, the rig has %d", 31 - __builtin_clz(plan->cameras), rig->camera_count);
    if (!lumi_plan_cameras(plan, rig))
        RIG_REFUSE("no camera has a channel for its %s", line);
    for (int i = 0; i < rig->camera_count; i++)
        if (plan->cameras >> i & 1 && rig->control.triggers[i].channel < 0)
            RIG_REFUSE("camera '%s' has no channel for its %s", rig->cameras[i].name, line);
    return LUMI_OK;
}

static int check_turns(const struct lumi_plan *plan, const struct lumi_rig *rig, struct lumi_error *error)
{
    const struct lumi_rig_string *s = &rig->string;
    double steps = lumi_rig_steps_per_turn(rig);

    if (steps < plan->positions)
        RIG_REFUSE("%g steps a turn cannot reach %d positions", steps, plan->positions);
    if (s->held) {
        if (plan->turns > 1)
            RIG_REFUSE("%d turns with the arm held by its brake would take the same row %d times", plan->turns,
                       plan->turns);
        if (plan->first_turn)
            RIG_REFUSE("turn %d of an arm that is held by its brake", plan->first_turn);
        return LUMI_OK;
    }
    double last = plan->first_turn + lumi_plan_span(plan);
    if (plan->mode != LUMI_PLAN_START_STOP)
        last += lumi_plan_run_down(plan, rig);
    double end = rig_string_start(rig) + last * s->per_turn;
    if (end > s->length * (1 + 1e-9))
        RIG_REFUSE("the sweep ends after %g turns, which need %g m of string, there are %g m", last, end, s->length);
    if (s->run == LUMI_RIG_RUN_STRAIGHT && end > s->anchor + s->hold)
        RIG_REFUSE("the sweep ends after %g turns, with the arm hanging straight down on a slack string", last);
    if (lumi_rig_drop(rig, last) > LUMI_PI + 0.1)
        RIG_REFUSE("the sweep ends after %g turns, which drop the arm by more than half a circle", last);
    return LUMI_OK;
}

static int check_turning(const struct lumi_plan *plan, const struct lumi_rig *rig, struct lumi_error *error)
{
    const struct lumi_rig_motion *m = &rig->control.motion;
    double speed = lumi_plan_speed(plan), rate = lumi_rig_steps_per_turn(rig) / plan->turn_time;

    if (m->drive == LUMI_RIG_DRIVE_EXTERNAL)
        RIG_REFUSE("an external drive makes start-stop sweeps only");
    if (plan->bracket > 1)
        RIG_REFUSE("%d exposures a position while turning: brackets are for start-stop", plan->bracket);
    if (speed > m->speed_max)
        RIG_REFUSE("a turn in %g s is %g rad/s, the motor makes %g (a turn in %g s)", plan->turn_time, speed,
                   m->speed_max, 2 * LUMI_PI / m->speed_max);
    if (rate > LUMI_RIG_STEP_RATE_MAX)
        RIG_REFUSE("a turn in %g s is %g steps/s, the board makes %g", plan->turn_time, rate, LUMI_RIG_STEP_RATE_MAX);
    double steps = lumi_rig_steps_per_turn(rig) / (2 * LUMI_PI);
    double slowest = lumi_ramp_slowest_step(rate, m->acceleration_max * steps, m->jerk_max * steps);
    if (slowest > LUMI_RAMP_STEP_SECONDS)
        RIG_REFUSE("a turn in %g s has steps %g s apart, at most %g are allowed", plan->turn_time, slowest,
                   LUMI_RAMP_STEP_SECONDS);
    double blur = lumi_plan_blur(plan, rig), most = plan->blur_max > 0 ? plan->blur_max : LUMI_PLAN_BLUR;
    if (!(blur <= most))
        RIG_REFUSE("an exposure of %g s at a turn in %g s smears %g pixels, %g are allowed (%g s)", plan->exposures[0],
                   plan->turn_time, blur, most, plan->exposures[0] * most / blur);
    if (plan->mode == LUMI_PLAN_VIDEO) {
        double code = LUMI_RIG_LAMP_BITS * rig->control.video.lamp_bit;
        if (code >= plan->turn_time)
            RIG_REFUSE("the lamp's code takes %g s, a turn %g s", code, plan->turn_time);
        return LUMI_OK;
    }
    double apart = plan->turn_time / plan->positions, least = lumi_plan_exposure_spacing(plan, rig, 0);
    if (apart < least)
        RIG_REFUSE("positions pass every %g s, the cameras take a picture every %g s", apart, least);
    return LUMI_OK;
}

static int check_start_stop(const struct lumi_plan *plan, const struct lumi_rig *rig, struct lumi_error *error)
{
    const struct lumi_rig_motion *m = &rig->control.motion;
    double distance = 2 * LUMI_PI / plan->positions, wait = plan_position_wait(plan, rig, distance);
    double move = lumi_move_time(distance, m->speed_max, m->acceleration_max, m->jerk_max);
    double busy = wait + plan_bracket_length(plan, rig) + LUMI_PLAN_MOVE_MARGIN;
    double apart = lumi_plan_position_seconds(plan), cameras = lumi_plan_exposure_offset(plan, rig, plan->bracket);

    if (busy > apart)
        RIG_REFUSE("%g s a position: the move takes %g s, the first exposure begins after %g s, and all is done after "
                   "%g s",
                   apart, move, wait, busy);
    if (cameras > apart)
        RIG_REFUSE("%g s a position: the cameras take %d exposures every %g s", apart, plan->bracket, cameras);
    return LUMI_OK;
}

int lumi_plan_check(const struct lumi_plan *plan, const struct lumi_rig *rig, struct lumi_error *error)
{
    LUMI_TRY(check_numbers(plan, error));
    LUMI_TRY(check_cameras(plan, rig, error));
    LUMI_TRY(check_turns(plan, rig, error));
    return plan->mode == LUMI_PLAN_START_STOP ? check_start_stop(plan, rig, error) : check_turning(plan, rig, error);
}
