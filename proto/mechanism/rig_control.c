/* What a board does unless its profile says otherwise. */
#include "proto/mechanism/rig_priv.h"

#include <string.h>

const char *const lumi_rig_fault_names[LUMI_RIG_FAULTS] = {
    "estop",     "host-lost", "index-missed", "index-early", "string-end", "slack",
    "overspeed", "driver",    "supply",       "internal",    "watchdog",
};

static void init_reactions(struct lumi_rig_reaction *reactions)
{
    /* Where something may break or a person may be caught, not one step more. Where only the numbers are wrong, or the
     * end of the string is near, slowing down keeps the position. Whoever went away may come back: the row is ended. */
    static const struct {
        enum lumi_rig_motor_reaction motor;
        bool brake;
        enum lumi_rig_trigger_reaction triggers;
    } usual[LUMI_RIG_FAULTS] = {
        [LUMI_RIG_FAULT_ESTOP] = {LUMI_RIG_MOTOR_HALT, true, LUMI_RIG_TRIGGERS_OFF},
        [LUMI_RIG_FAULT_HOST_LOST] = {LUMI_RIG_MOTOR_ROW_END, false, LUMI_RIG_TRIGGERS_FINISH},
        [LUMI_RIG_FAULT_INDEX_MISSED] = {LUMI_RIG_MOTOR_RAMP, false, LUMI_RIG_TRIGGERS_OFF},
        [LUMI_RIG_FAULT_INDEX_EARLY] = {LUMI_RIG_MOTOR_RAMP, false, LUMI_RIG_TRIGGERS_OFF},
        [LUMI_RIG_FAULT_STRING_END] = {LUMI_RIG_MOTOR_RAMP, true, LUMI_RIG_TRIGGERS_FINISH},
        [LUMI_RIG_FAULT_SLACK] = {LUMI_RIG_MOTOR_HALT, true, LUMI_RIG_TRIGGERS_OFF},
        [LUMI_RIG_FAULT_OVERSPEED] = {LUMI_RIG_MOTOR_HALT, true, LUMI_RIG_TRIGGERS_OFF},
        [LUMI_RIG_FAULT_DRIVER] = {LUMI_RIG_MOTOR_HALT, true, LUMI_RIG_TRIGGERS_OFF},
        [LUMI_RIG_FAULT_SUPPLY] = {LUMI_RIG_MOTOR_HALT, true, LUMI_RIG_TRIGGERS_OFF},
        [LUMI_RIG_FAULT_INTERNAL] = {LUMI_RIG_MOTOR_HALT, true, LUMI_RIG_TRIGGERS_OFF},
        [LUMI_RIG_FAULT_WATCHDOG] = {LUMI_RIG_MOTOR_HALT, true, LUMI_RIG_TRIGGERS_OFF},
    };

    for (int f = 0; f < LUMI_RIG_FAULTS; f++) {
        reactions[f].motor = usual[f].motor;
        reactions[f].brake = usual[f].brake;
        reactions[f].triggers = usual[f].triggers;
    }
}

void lumi_rig_control_init(struct lumi_rig_control *control)
{
    memset(control, 0, sizeof *control);
    /* 5° from rest to rest in 0.42 s, 30 s a turn reached in 0.14 s: within reach of a NEMA 23 stepper behind a belt of
     * 9:1 and half a kilogram square metre. */
    control->motion.drive = LUMI_RIG_DRIVE_STEPPER;
    control->motion.speed_max = 60 * RIG_DEGREE;
    control->motion.acceleration_max = 180 * RIG_DEGREE;
    control->motion.jerk_max = 2400 * RIG_DEGREE;
    control->motion.home_speed = 12 * RIG_DEGREE;
    control->motion.wind_speed = 45 * RIG_DEGREE;
    control->motion.backlash = 0.5 * RIG_DEGREE;
    control->motion.index_window = 1 * RIG_DEGREE;
    control->motion.settle = 0.3;
    control->motion.step_pulse = 5e-6;
    control->motion.direction_setup = 2e-5;
    for (int i = 0; i < 16; i++) {
        control->triggers[i].channel = i;
        control->triggers[i].shutter_lag = 0.04;
        control->triggers[i].pulse = 0.05;
        control->triggers[i].focus_channel = -1;
        control->triggers[i].busy = 0.15;
        control->triggers[i].feedback = -1;
    }
    control->video.record_pulse = 0.2;
    control->video.record_lead = 2;
    control->video.lamp_bit = 0.2;
    control->safety.host_timeout = 5;
    init_reactions(control->safety.reactions);
}
