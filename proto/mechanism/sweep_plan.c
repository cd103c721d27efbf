/* The plan of a sweep: its totals and times. Linked into firmware: no stdio. */
#include "proto/mechanism/sweep_plan_priv.h"

#include "proto/mechanism/kinematics.h"
#include "proto/mechanism/ramp_time.h"

#include <math.h>
#include <string.h>

void lumi_plan_init(struct lumi_plan *plan, const struct lumi_rig *rig)
{
    memset(plan, 0, sizeof *plan);
    memcpy(plan->name, rig->name, sizeof plan->name);
    plan->mode = rig->control.motion.drive == LUMI_RIG_DRIVE_EXTERNAL ? LUMI_PLAN_START_STOP : LUMI_PLAN_CONTINUOUS;
    plan->wind = LUMI_PLAN_WIND_PLAN;
    plan->positions = rig->positions;
    plan->turns = rig->turns;
    plan->turn_time = plan->mode == LUMI_PLAN_START_STOP ? 120 : 30;
    plan->settle = -1;
    plan->bracket = 1;
    plan->exposures[0] = 1.0 / 250;
}

int lumi_plan_shots(const struct lumi_plan *plan)
{
    return plan->mode == LUMI_PLAN_VIDEO ? 0 : plan->positions * plan->turns * plan->bracket;
}

uint32_t lumi_plan_cameras(const struct lumi_plan *plan, const struct lumi_rig *rig)
{
    uint32_t wired = 0;

    for (int i = 0; i < rig->camera_count; i++)
        if (rig->control.triggers[i].channel >= 0)
            wired |= UINT32_C(1) << i;
    return plan->cameras ? plan->cameras : wired;
}

static int takes_part(const struct lumi_plan *plan, const struct lumi_rig *rig, int camera)
{
    return lumi_plan_cameras(plan, rig) >> camera & 1;
}

int lumi_plan_frames(const struct lumi_plan *plan, const struct lumi_rig *rig)
{
    int cameras = 0;

    for (int i = 0; i < rig->camera_count; i++)
        cameras += takes_part(plan, rig, i);
    return lumi_plan_shots(plan) * cameras;
}

int64_t lumi_plan_position_step(const struct lumi_plan *plan, const struct lumi_rig *rig, int position)
{
    /* In whole numbers: below 2^58 for every rig and plan that were checked. */
    int64_t steps = (int64_t)rig->motor_steps * rig->microsteps * rig->gear_motor;
    int64_t parts = (int64_t)rig->gear_platform * plan->positions;
    int64_t place = (int64_t)plan->first_turn * plan->positions + position;

    return (2 * steps * place + parts) / (2 * parts);
}

/* ---- One position ---- */

double lumi_plan_position_seconds(const struct lumi_plan *plan)
{
    return plan->position_time > 0 ? plan->position_time : plan->turn_time / plan->positions;
}

double lumi_plan_settle(const struct lumi_plan *plan, const struct lumi_rig *rig)
{
    return plan->settle >= 0 ? plan->settle : rig->control.motion.settle;
}

double lumi_plan_exposure_spacing(const struct lumi_plan *plan, const struct lumi_rig *rig, int k)
{
    double least = 0;

    /* A trigger comes its lag before the exposure; the camera takes it when it is no longer busy, the board gives it
     * when its lines have been low. */
    for (int i = 0; i < rig->camera_count; i++) {
        const struct lumi_rig_trigger *t = &rig->control.triggers[i];
        if (!takes_part(plan, rig, i))
            continue;
        double camera = plan->exposures[k] + fmax(t->busy, plan->bracket_gap) + t->shutter_lag;
        double lines = t->focus_lead + t->pulse + LUMI_PLAN_PULSE_GAP;
        least = fmax(least, fmax(camera, lines));
    }
    return least + LUMI_PLAN_SHOT_MARGIN;
}

double lumi_plan_exposure_offset(const struct lumi_plan *plan, const struct lumi_rig *rig, int k)
{
    double offset = 0;

    for (int i = 0; i < k; i++)
        offset += lumi_plan_exposure_spacing(plan, rig, i);
    return offset;
}

double plan_position_wait(const struct lumi_plan *plan, const struct lumi_rig *rig, double distance)
{
    const struct lumi_rig_motion *m = &rig->control.motion;
    double move = lumi_move_time(distance, m->speed_max, m->acceleration_max, m->jerk_max);
    double lead = 0;

    /* Focus lines and triggers that must be up before the exposure may go up in the move, but not before it. */
    for (int i = 0; i < rig->camera_count; i++)
        if (takes_part(plan, rig, i))
            lead = fmax(lead, rig->control.triggers[i].focus_lead + rig->control.triggers[i].shutter_lag);
    return fmax(move + lumi_plan_settle(plan, rig), lead);
}

double plan_bracket_length(const struct lumi_plan *plan, const struct lumi_rig *rig)
{
    int last = plan->bracket - 1;
    double end = plan->exposures[last];

    /* The move waits for the last line to fall, too. */
    for (int i = 0; i < rig->camera_count; i++)
        if (takes_part(plan, rig, i))
            end = fmax(end, rig->control.triggers[i].pulse - rig->control.triggers[i].shutter_lag);
    return lumi_plan_exposure_offset(plan, rig, last) + end;
}

/* ---- While turning ---- */

double lumi_plan_speed(const struct lumi_plan *plan)
{
    return 2 * LUMI_PI / plan->turn_time;
}

static double longest_exposure(const struct lumi_plan *plan)
{
    double longest = 0;

    for (int k = 0; k < plan->bracket; k++)
        longest = fmax(longest, plan->exposures[k]);
    return longest;
}

static double ramp_seconds(const struct lumi_plan *plan, const struct lumi_rig *rig)
{
    const struct lumi_rig_motion *m = &rig->control.motion;

    return lumi_ramp_time(lumi_plan_speed(plan), m->acceleration_max, m->jerk_max);
}

/* The speed is held for so long before position 0, and behind the last place. */
static double held_seconds(const struct lumi_plan *plan)
{
    return LUMI_PLAN_CRUISE_MARGIN + (plan->mode == LUMI_PLAN_VIDEO ? 0 : plan->exposures[0] / 2);
}

double lumi_plan_run_down(const struct lumi_plan *plan, const struct lumi_rig *rig)
{
    return (ramp_seconds(plan, rig) / 2 + held_seconds(plan)) / plan->turn_time;
}

/* The play may end only when the speed is reached: the platform gets a knock then, which has to swing out. */
static double up_seconds(const struct lumi_plan *plan, const struct lumi_rig *rig)
{
    return rig->control.motion.backlash / lumi_plan_speed(plan) + LUMI_PLAN_SWING_MARGIN + held_seconds(plan);
}

double lumi_plan_run_up(const struct lumi_plan *plan, const struct lumi_rig *rig)
{
    return (ramp_seconds(plan, rig) / 2 + up_seconds(plan, rig)) / plan->turn_time;
}

double lumi_plan_span(const struct lumi_plan *plan)
{
    if (plan->mode == LUMI_PLAN_VIDEO)
        return plan->turns;
    return plan->turns - 1.0 / plan->positions;
}

double lumi_plan_seconds(const struct lumi_plan *plan, const struct lumi_rig *rig)
{
    int moves = plan->positions * plan->turns - 1;

    if (plan->mode != LUMI_PLAN_START_STOP)
        return lumi_plan_span(plan) * plan->turn_time + 2 * ramp_seconds(plan, rig) + up_seconds(plan, rig) +
               held_seconds(plan);
    /* The first position is approached from where its backlash is taken up. */
    double first = fmax(rig->control.motion.backlash, 2 * LUMI_PI / lumi_rig_steps_per_turn(rig));
    return moves * lumi_plan_position_seconds(plan) + plan_bracket_length(plan, rig) +
           plan_position_wait(plan, rig, moves ? 2 * LUMI_PI / plan->positions : first);
}

double lumi_plan_blur(const struct lumi_plan *plan, const struct lumi_rig *rig)
{
    double most = 0;

    if (plan->mode == LUMI_PLAN_START_STOP)
        return 0;
    /* A camera that turns with the platform sees the horizon pass at the platform's angular speed; a lens images an
     * angle about its axis with its focal length in pixels, along x, or along y where the camera lies on its side. */
    for (int i = 0; i < rig->camera_count; i++) {
        const struct lumi_lens *lens = &rig->lenses[rig->cameras[i].lens].lens;
        double roll = rig->cameras[i].roll;
        if (takes_part(plan, rig, i))
            most = fmax(most, hypot(lens->fx * cos(roll), lens->fy * sin(roll)));
    }
    return longest_exposure(plan) * lumi_plan_speed(plan) * most;
}
