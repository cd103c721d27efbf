/* Which limits, wirings and reactions there cannot be. Linked into firmware: no stdio. */
#include "proto/mechanism/kinematics.h"
#include "proto/mechanism/ramp_time.h"
#include "proto/mechanism/rig_priv.h"

#include <math.h>

static int check_motion(const struct lumi_rig *rig, struct lumi_error *error)
{
    const struct lumi_rig_motion *m = &rig->control.motion;

    if (m->drive != LUMI_RIG_DRIVE_STEPPER && m->drive != LUMI_RIG_DRIVE_EXTERNAL)
        RIG_REFUSE("motion: drive %d is no kind of drive", (int)m->drive);
    if (!rig_within(m->speed_max, 1e-4, 100))
        RIG_REFUSE("motion: speed_max of %g rad/s: 0.0001 to 100 wanted", m->speed_max);
    if (!rig_within(m->acceleration_max, 1e-4, 1e4))
        RIG_REFUSE("motion: acceleration_max of %g rad/s²: 0.0001 to 10000 wanted", m->acceleration_max);
    if (!rig_within(m->jerk_max, 1e-4, 1e6))
        RIG_REFUSE("motion: jerk_max of %g rad/s³: 0.0001 to 1000000 wanted", m->jerk_max);
    double ramp = lumi_ramp_time(m->speed_max, m->acceleration_max, m->jerk_max);
    if (!(ramp <= LUMI_RIG_RAMP_MAX))
        RIG_REFUSE("motion: speed_max of %g rad/s is reached in %g s, at most %g are allowed: acceleration_max or "
                   "jerk_max is too low",
                   m->speed_max, ramp, LUMI_RIG_RAMP_MAX);
    double rate = m->speed_max / (2 * LUMI_PI) * lumi_rig_steps_per_turn(rig);
    if (!(rate <= LUMI_RIG_STEP_RATE_MAX))
        RIG_REFUSE("motion: speed_max of %g rad/s is %g steps/s, the board makes %g", m->speed_max, rate,
                   LUMI_RIG_STEP_RATE_MAX);
    if (!rig_within(m->home_speed, 1e-4, m->speed_max))
        RIG_REFUSE("motion: home_speed of %g rad/s: 0.0001 to speed_max, %g, wanted", m->home_speed, m->speed_max);
    if (!rig_within(m->wind_speed, 1e-4, m->speed_max))
        RIG_REFUSE("motion: wind_speed of %g rad/s: 0.0001 to speed_max, %g, wanted", m->wind_speed, m->speed_max);
    double steps = lumi_rig_steps_per_turn(rig) / (2 * LUMI_PI), slow = fmin(m->home_speed / 4, m->wind_speed);
    double apart = lumi_ramp_slowest_step(slow * steps, m->acceleration_max * steps, m->jerk_max * steps);
    if (!(apart <= LUMI_RAMP_STEP_SECONDS))
        RIG_REFUSE("motion: home_speed of %g or wind_speed of %g rad/s is too low: steps %g s apart, at most %g",
                   m->home_speed, m->wind_speed, apart, LUMI_RAMP_STEP_SECONDS);
    if (!rig_within(m->backlash, 0, LUMI_PI / 4))
        RIG_REFUSE("motion: backlash of %g rad: 0 to %g wanted", m->backlash, LUMI_PI / 4);
    if (!rig_within(m->index_window, 0, LUMI_PI / 2))
        RIG_REFUSE("motion: index_window of %g rad: 0 to %g wanted", m->index_window, LUMI_PI / 2);
    if (!rig_within(m->settle, 0, 60))
        RIG_REFUSE("motion: settle of %g s: 0 to 60 wanted", m->settle);
    if (!rig_within(m->direction_setup, 0, 1))
        RIG_REFUSE("motion: direction_setup of %g s: 0 to 1 wanted", m->direction_setup);
    if (!rig_within(m->step_pulse, 1e-7, 1e-3))
        RIG_REFUSE("motion: step_pulse of %g s: 0.0000001 to 0.001 wanted", m->step_pulse);
    if (!(m->step_pulse * rate <= 0.5))
        RIG_REFUSE("motion: step_pulse of %g s is more than half of the %g s between steps at speed_max", m->step_pulse,
                   1 / rate);
    return LUMI_OK;
}

static int check_trigger(const struct lumi_rig_camera *camera, const struct lumi_rig_trigger *t,
                         struct lumi_error *error)
{
    if (t->channel < -1 || t->channel >= LUMI_RIG_CHANNELS)
        RIG_REFUSE("camera '%s': channel %d: 0 to %d wanted, or -1 for none", camera->name, t->channel,
                   LUMI_RIG_CHANNELS - 1);
    if (t->focus_channel < -1 || t->focus_channel >= LUMI_RIG_CHANNELS)
        RIG_REFUSE("camera '%s': focus_channel %d: 0 to %d wanted, or -1 for none", camera->name, t->focus_channel,
                   LUMI_RIG_CHANNELS - 1);
    if (t->feedback < -1 || t->feedback >= LUMI_RIG_FEEDBACKS)
        RIG_REFUSE("camera '%s': feedback %d: 0 to %d wanted, or -1 for none", camera->name, t->feedback,
                   LUMI_RIG_FEEDBACKS - 1);
    if (!rig_within(t->shutter_lag, 0, 10))
        RIG_REFUSE("camera '%s': shutter_lag of %g s: 0 to 10 wanted", camera->name, t->shutter_lag);
    if (!rig_within(t->pulse, 1e-5, 10))
        RIG_REFUSE("camera '%s': pulse of %g s: 0.00001 to 10 wanted", camera->name, t->pulse);
    if (!rig_within(t->focus_lead, 0, 10))
        RIG_REFUSE("camera '%s': focus_lead of %g s: 0 to 10 wanted", camera->name, t->focus_lead);
    if (!rig_within(t->busy, 0, 60))
        RIG_REFUSE("camera '%s': busy for %g s: 0 to 60 wanted", camera->name, t->busy);
    if (t->focus_lead > 0 && t->focus_channel < 0)
        RIG_REFUSE("camera '%s': a focus_lead of %g s without a focus_channel", camera->name, t->focus_lead);
    if (t->focus_channel >= 0 && t->focus_lead <= 0)
        RIG_REFUSE("camera '%s': focus_channel %d without a focus_lead", camera->name, t->focus_channel);
    if (t->focus_channel >= 0 && t->channel < 0)
        RIG_REFUSE("camera '%s': focus_channel %d without a channel", camera->name, t->focus_channel);
    return LUMI_OK;
}

/* A line serves one camera, an input too: what is shared cannot be told apart. */
static int check_lines(const struct lumi_rig *rig, struct lumi_error *error)
{
    const char *line_of[LUMI_RIG_CHANNELS] = {0}, *input_of[LUMI_RIG_FEEDBACKS] = {0};

    for (int i = 0; i < rig->camera_count; i++) {
        const struct lumi_rig_trigger *t = &rig->control.triggers[i];
        const char *name = rig->cameras[i].name;
        const int lines[2] = {t->channel, t->focus_channel};
        LUMI_TRY(check_trigger(&rig->cameras[i], t, error));
        for (int k = 0; k < 2; k++) {
            if (lines[k] < 0)
                continue;
            if (line_of[lines[k]])
                RIG_REFUSE("cameras '%s' and '%s' are both on channel %d", line_of[lines[k]], name, lines[k]);
            line_of[lines[k]] = name;
        }
        if (t->feedback >= 0 && input_of[t->feedback])
            RIG_REFUSE("cameras '%s' and '%s' are both on feedback input %d", input_of[t->feedback], name, t->feedback);
        if (t->feedback >= 0)
            input_of[t->feedback] = name;
    }
    return LUMI_OK;
}

static int check_video(const struct lumi_rig_video *video, struct lumi_error *error)
{
    if (!rig_within(video->record_pulse, 0, 10))
        RIG_REFUSE("video: record_pulse of %g s: 0 to 10 wanted", video->record_pulse);
    if (!rig_within(video->record_lead, 0, 60))
        RIG_REFUSE("video: record_lead of %g s: 0 to 60 wanted", video->record_lead);
    if (!rig_within(video->lamp_bit, 1e-3, 10))
        RIG_REFUSE("video: lamp_bit of %g s: 0.001 to 10 wanted", video->lamp_bit);
    return LUMI_OK;
}

static int check_reaction(const struct lumi_rig *rig, int fault, struct lumi_error *error)
{
    const struct lumi_rig_reaction *r = &rig->control.safety.reactions[fault];
    const char *name = lumi_rig_fault_names[fault];

    if ((int)r->motor < LUMI_RIG_MOTOR_ROW_END || (int)r->motor > LUMI_RIG_MOTOR_OFF)
        RIG_REFUSE("safety: %s: %d is nothing a motor can do", name, (int)r->motor);
    if ((int)r->triggers < LUMI_RIG_TRIGGERS_FINISH || (int)r->triggers > LUMI_RIG_TRIGGERS_OFF)
        RIG_REFUSE("safety: %s: %d is nothing triggers can do", name, (int)r->triggers);
    if (r->motor == LUMI_RIG_MOTOR_ROW_END && fault != LUMI_RIG_FAULT_HOST_LOST)
        RIG_REFUSE("safety: %s: row-end is for host-lost only", name);
    if (fault == LUMI_RIG_FAULT_ESTOP && r->motor == LUMI_RIG_MOTOR_RAMP)
        RIG_REFUSE("safety: estop: the motor stops at once: halt or off wanted");
    if (fault == LUMI_RIG_FAULT_ESTOP && r->triggers != LUMI_RIG_TRIGGERS_OFF)
        RIG_REFUSE("safety: estop: triggers-off wanted");
    if (r->motor == LUMI_RIG_MOTOR_OFF && !rig->string.held) {
        if (!rig->control.safety.brake_fitted)
            RIG_REFUSE("safety: %s: with the motor off and no brake fitted the arm falls", name);
        if (!r->brake)
            RIG_REFUSE("safety: %s: with the motor off and the brake open the arm falls", name);
    }
    return LUMI_OK;
}

static int check_safety(const struct lumi_rig *rig, struct lumi_error *error)
{
    const struct lumi_rig_safety *s = &rig->control.safety;

    if (!rig_within(s->host_timeout, 0, 3600))
        RIG_REFUSE("safety: host_timeout of %g s: 0 to 3600 wanted", s->host_timeout);
    if (s->host_timeout > 0 && s->host_timeout < 0.1)
        RIG_REFUSE("safety: host_timeout of %g s is shorter than 0.1 s", s->host_timeout);
    if (!rig_within(s->supply_minimum, 0, 100))
        RIG_REFUSE("safety: supply_minimum of %g V: 0 to 100 wanted", s->supply_minimum);
    if (!rig_within(s->overspeed, 0, 1000))
        RIG_REFUSE("safety: overspeed of %g rad/s: 0 to 1000 wanted", s->overspeed);
    if (s->overspeed > 0 && s->overspeed <= rig->control.motion.speed_max)
        RIG_REFUSE("safety: overspeed of %g rad/s is not above speed_max, %g", s->overspeed,
                   rig->control.motion.speed_max);
    if (rig->control.motion.drive == LUMI_RIG_DRIVE_EXTERNAL && !rig->string.held && !s->brake_fitted)
        RIG_REFUSE("safety: an emergency stop lets go of an external drive: with no brake fitted the arm falls");
    for (int f = 0; f < LUMI_RIG_FAULTS; f++)
        LUMI_TRY(check_reaction(rig, f, error));
    return LUMI_OK;
}

int rig_check_control(const struct lumi_rig *rig, struct lumi_error *error)
{
    LUMI_TRY(check_motion(rig, error));
    LUMI_TRY(check_lines(rig, error));
    LUMI_TRY(check_video(&rig->control.video, error));
    return check_safety(rig, error);
}
