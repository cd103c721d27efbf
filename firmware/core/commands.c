/* One handler a command: what a host may ask for, when, and what it begins. */
#include "firmware/core/core_state.h"

#include <math.h>
#include <string.h>

#define JOG_TURNS_MAX 1000.0

void core_refuse(lumi_wire_Reply *reply, lumi_wire_Result result, const char *text)
{
    reply->result = result;
    strncpy(reply->text, text, sizeof reply->text - 1);
    reply->text[sizeof reply->text - 1] = 0;
}

static void append(char *text, size_t size, const char *more)
{
    size_t used = strlen(text);

    while (*more && used + 1 < size)
        text[used++] = *more++;
    text[used] = 0;
}

/* "home: not while sweeping" */
static bool allowed(struct core *core, enum state_event event, const char *command, lumi_wire_Reply *reply)
{
    if (state_next(core->state, event) != STATE_REFUSE)
        return true;
    core_refuse(reply, lumi_wire_Result_REFUSED, command);
    append(reply->text, sizeof reply->text, ": not while the rig is ");
    append(reply->text, sizeof reply->text, state_name(core->state));
    if (core->safety.standing != 0) {
        append(reply->text, sizeof reply->text, " (");
        for (int i = 0, count = 0; i < LUMI_RIG_FAULTS; i++)
            if (core->safety.standing >> i & 1) {
                append(reply->text, sizeof reply->text, count++ ? ", " : "");
                append(reply->text, sizeof reply->text, lumi_rig_fault_names[i]);
            }
        append(reply->text, sizeof reply->text, ")");
    }
    return false;
}

bool core_refuse_unless_rest(const struct core *core, lumi_wire_Reply *reply)
{
    if (state_at_rest(core->state))
        return false;
    core_refuse(reply, lumi_wire_Result_REFUSED, "not while something moves: the rig is ");
    append(reply->text, sizeof reply->text, state_name(core->state));
    return true;
}

static void home(struct core *core, const lumi_wire_Home *home_command, lumi_wire_Reply *reply)
{
    const struct lumi_rig_safety *fitted = &core->rig.control.safety;

    if (!allowed(core, EVENT_HOME, "home", reply))
        return;
    if (home_command->wind_up && !fitted->wound_fitted) {
        core_refuse(reply, lumi_wire_Result_BAD, "home: no switch tells when the string is wound up");
        return;
    }
    if (home_command->turn < -1 || home_command->turn > core->rig.turns) {
        core_refuse(reply, lumi_wire_Result_BAD, "home: the rig has no such turn");
        return;
    }
    if (core_external(core)) {
        /* The drive homes itself, by the host's command: the board takes its word. */
        motion_set_position(&core->motion, llround(home_command->turn * core->steps_per_turn));
        core_state_event(core, EVENT_HOME);
        core_report_homed(core, true, "");
        core_rest(core);
        return;
    }
    core->home_goal = home_command->wind_up ? HOMING_WOUND : HOMING_INDEX;
    core->home_turn = home_command->turn;
    core->begun = false;
    core->homing_asked = true;
    core_state_event(core, EVENT_HOME);
}

static void jog(struct core *core, const lumi_wire_Jog *jog_command, lumi_wire_Reply *reply)
{
    const struct lumi_rig_motion *m = &core->rig.control.motion;
    const double speed = jog_command->speed == 0 ? m->home_speed : jog_command->speed;

    if (!allowed(core, EVENT_JOG, "jog", reply))
        return;
    if (core_external(core)) {
        core_refuse(reply, lumi_wire_Result_UNSUPPORTED, "jog: the drive is not the board's");
        return;
    }
    if (!(fabs(jog_command->turns) <= JOG_TURNS_MAX) || !(speed > 0 && speed <= m->speed_max)) {
        core_refuse(reply, lumi_wire_Result_BAD, "jog: farther or faster than the rig goes");
        return;
    }
    if (jog_command->turns > 0 && ((m->drive == LUMI_RIG_DRIVE_STEPPER && core->rig.control.safety.string_end_fitted &&
                                    core->safety.inputs[BOARD_IN_STRING_END]) ||
                                   (core->rig.control.safety.slack_fitted && core->safety.inputs[BOARD_IN_SLACK]))) {
        core_refuse(reply, lumi_wire_Result_REFUSED, "jog: the string is paid out or loose; it only winds up");
        return;
    }
    int64_t steps = llround(jog_command->turns * core->steps_per_turn);
    if (steps == 0)
        return;
    const double turns = (double)(motion_position(&core->motion) + steps) / core->steps_per_turn;
    if (steps > 0 && !core->rig.string.held && turns * core->rig.string.per_turn > core->rig.string.length) {
        core_refuse(reply, lumi_wire_Result_BAD, "jog: beyond the end of the string");
        return;
    }
    core->jog_target = motion_position(&core->motion) + steps;
    core->jog_limits = core_limits(core, speed);
    core->begun = false;
    core_state_event(core, EVENT_JOG);
}

static void test_triggers(struct core *core, const lumi_wire_TestTriggers *test, lumi_wire_Reply *reply)
{
    if (!allowed(core, EVENT_TEST, "test", reply))
        return;
    if (!(test->exposure >= 0 && test->exposure <= 60) || !(test->gap >= 0 && test->gap <= 60)) {
        core_refuse(reply, lumi_wire_Result_BAD, "test: exposure and gap are 0 to 60 s");
        return;
    }
    if (firing_busy_now(&core->firing)) {
        core_refuse(reply, lumi_wire_Result_REFUSED, "test: a trigger is still up");
        return;
    }
    if (!firing_test(&core->firing, &core->rig, test->cameras, test->exposure, test->gap)) {
        core_refuse(reply, lumi_wire_Result_BAD, "test: none of these cameras has a trigger");
        return;
    }
    core_state_event(core, EVENT_TEST);
}

static bool plan_named(struct core *core, uint32_t crc, lumi_wire_Reply *reply)
{
    if (!core->has_plan)
        core_refuse(reply, lumi_wire_Result_REFUSED, "start: no plan is loaded");
    else if (crc != core->plan_crc)
        core_refuse(reply, lumi_wire_Result_REFUSED, "start: another plan is loaded");
    return core->has_plan && crc == core->plan_crc;
}

static void start_sweep(struct core *core, const lumi_wire_StartSweep *start, lumi_wire_Reply *reply)
{
    if (!allowed(core, EVENT_START, "start", reply) || !plan_named(core, start->plan_crc, reply))
        return;
    if (core_external(core)) {
        core_refuse(reply, lumi_wire_Result_UNSUPPORTED, "start: the host moves the drive and asks for each position");
        return;
    }
    const char *why = sweep_begin(core, start->first_shot, start->only_missing);
    if (why) {
        core_refuse(reply, lumi_wire_Result_REFUSED, "start: ");
        append(reply->text, sizeof reply->text, why);
        return;
    }
    safety_heartbeat(core); /* the command is a sign of life */
    core_state_event(core, EVENT_START);
}

static void fire_here(struct core *core, const lumi_wire_FireHere *fire, lumi_wire_Reply *reply)
{
    if (!allowed(core, EVENT_FIRE, "fire", reply))
        return;
    if (!core_external(core)) {
        core_refuse(reply, lumi_wire_Result_UNSUPPORTED, "fire: only with an external drive");
        return;
    }
    if (!core->has_plan || core->plan.mode != LUMI_PLAN_START_STOP) {
        core_refuse(reply, lumi_wire_Result_REFUSED, "fire: no start-stop plan is loaded");
        return;
    }
    const char *why = sweep_fire_here(core, fire->first_shot, fire->timeout);
    if (why) {
        core_refuse(reply, lumi_wire_Result_BAD, why);
        return;
    }
    safety_heartbeat(core);
    core_state_event(core, EVENT_FIRE);
}

static void pause_sweep(struct core *core, lumi_wire_Reply *reply)
{
    if (!allowed(core, EVENT_PAUSE, "pause", reply))
        return;
    const bool more = state_next(core->state, EVENT_PAUSE) != STATE_STAY;
    core_state_event(core, EVENT_PAUSE);
    if (more && core->sweep.active)
        sweep_finish(core, lumi_wire_SweepEnded_How_PAUSED_BY_HOST);
}

static void stop(struct core *core, bool at_once, lumi_wire_Reply *reply)
{
    if (!allowed(core, EVENT_STOP, "stop", reply))
        return;
    core_state_event(core, EVENT_STOP);
    if (state_at_rest(core->state))
        return;
    if (!core->sweep.active)
        core_stop_soon(core, !at_once);
    else if (at_once)
        sweep_break(core, lumi_wire_SweepEnded_How_STOPPED_BY_HOST);
    else
        sweep_finish(core, lumi_wire_SweepEnded_How_STOPPED_BY_HOST);
}

static void clear(struct core *core, uint32_t faults, lumi_wire_Reply *reply)
{
    const char *why = safety_clear(core, faults);

    if (why)
        core_refuse(reply, lumi_wire_Result_REFUSED, why);
}

static void set_output(struct core *core, const lumi_wire_SetOutput *set, lumi_wire_Reply *reply)
{
    bool done = true;

    if (core_refuse_unless_rest(core, reply))
        return;
    if (core->safety.standing != 0 && set->output != lumi_wire_SetOutput_Output_LAMP) {
        core_refuse(reply, lumi_wire_Result_REFUSED, "not while a fault stands");
        return;
    }
    switch (set->output) {
    case lumi_wire_SetOutput_Output_ENABLE:
        done = drop_string_set_enable(core, set->active);
        if (!motion_known(&core->motion) && core->state != lumi_wire_State_NO_PROFILE)
            core_state_event(core, core->state == lumi_wire_State_LOST ? EVENT_STOP : EVENT_REST_LOST);
        break;
    case lumi_wire_SetOutput_Output_BRAKE_OPEN:
        done = drop_string_set_brake(core, set->active);
        break;
    case lumi_wire_SetOutput_Output_LAMP:
        core->board->output(core->board->port, BOARD_OUT_LAMP, set->active);
        break;
    default:
        core_refuse(reply, lumi_wire_Result_BAD, "no such output");
        return;
    }
    if (!done)
        core_refuse(reply, lumi_wire_Result_REFUSED, "nothing else would hold the arm");
}

static void enter_loader(struct core *core, lumi_wire_Reply *reply)
{
    if (core_refuse_unless_rest(core, reply))
        return;
    /* In the loader no pin of the board is driven. */
    if (core->has_profile && !drop_string_held(core)) {
        drop_string_close(core);
        core_refuse(reply, lumi_wire_Result_REFUSED,
                    core->rig.control.safety.brake_fitted
                        ? "loader: the brake is closing; ask again in a second"
                        : "loader: without current nothing would hold the arm; take it off and use the boot jumper");
        return;
    }
    core->board->enter_loader(core->board->port);
}

/* What is given and taken: commands_store.c. */
static void execute_store(struct core *core, const lumi_wire_Request *request, lumi_wire_Reply *reply)
{
    switch (request->which_command) {
    case lumi_wire_Request_load_plan_tag:
        core_command_load_plan(core, &request->command.load_plan, reply);
        break;
    case lumi_wire_Request_read_shots_tag:
        core_command_read_shots(core, &request->command.read_shots, reply);
        break;
    case lumi_wire_Request_mark_shots_tag:
        core_command_mark_shots(core, &request->command.mark_shots, reply);
        break;
    case lumi_wire_Request_read_profile_tag:
        core_command_read_profile(core, &request->command.read_profile, reply);
        break;
    case lumi_wire_Request_write_profile_tag:
        core_command_write_profile(core, &request->command.write_profile, reply);
        break;
    case lumi_wire_Request_commit_profile_tag:
        core_command_commit_profile(core, &request->command.commit_profile, reply);
        break;
    case lumi_wire_Request_read_plan_tag:
        core_command_read_plan(core, reply);
        break;
    default:
        core_refuse(reply, lumi_wire_Result_UNSUPPORTED, "no such command");
    }
}

void core_execute(void *context, const lumi_wire_Request *request, lumi_wire_Reply *reply)
{
    struct core *core = context;

    switch (request->which_command) {
    case lumi_wire_Request_get_status_tag:
        reply->which_payload = lumi_wire_Reply_status_tag;
        core_status(core, &reply->payload.status);
        break;
    case lumi_wire_Request_home_tag:
        home(core, &request->command.home, reply);
        break;
    case lumi_wire_Request_jog_tag:
        jog(core, &request->command.jog, reply);
        break;
    case lumi_wire_Request_test_triggers_tag:
        test_triggers(core, &request->command.test_triggers, reply);
        break;
    case lumi_wire_Request_start_sweep_tag:
        start_sweep(core, &request->command.start_sweep, reply);
        break;
    case lumi_wire_Request_pause_tag:
        pause_sweep(core, reply);
        break;
    case lumi_wire_Request_stop_tag:
        stop(core, request->command.stop.at_once, reply);
        break;
    case lumi_wire_Request_clear_tag:
        clear(core, request->command.clear.faults, reply);
        break;
    case lumi_wire_Request_enter_loader_tag:
        enter_loader(core, reply);
        break;
    case lumi_wire_Request_fire_here_tag:
        fire_here(core, &request->command.fire_here, reply);
        break;
    case lumi_wire_Request_set_output_tag:
        set_output(core, &request->command.set_output, reply);
        break;
    default:
        execute_store(core, request, reply);
    }
}
