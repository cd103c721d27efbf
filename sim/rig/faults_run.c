/* A fault script at work: each fault at its time or shot, and undone when its time is over. */
#include "sim/rig/faults_run.h"

#include <glib.h>

#define TICKS(seconds) ((uint64_t)((seconds)*BOARD_TICK_HZ + 0.5))
#define DARK 1.0 /* s without power after a cut in a flash write, unless the script says */

struct due {
    uint64_t at; /* BOARD_NEVER: waits for its shot */
    int shot;
    struct sim_fault fault;
};

struct sim_fault_run {
    GArray *due; /* struct due */
    uint64_t next;
    bool shots; /* some wait for a shot */
    bool cut_armed;
    double dark;
    double supply; /* V, at the beginning; 0: not yet known */
    struct sim_camera_fault cameras[LUMI_RIG_CAMERAS];
    struct sim_drive_fault drive;
};

static void find_next(struct sim_fault_run *run)
{
    run->next = BOARD_NEVER;
    run->shots = false;
    for (guint i = 0; i < run->due->len; i++) {
        const struct due *due = &g_array_index(run->due, struct due, i);
        run->next = MIN(run->next, due->at);
        run->shots |= due->shot >= 0;
    }
}

struct sim_fault_run *sim_fault_run_new(const struct sim_fault_script *script, uint64_t seed, uint64_t now)
{
    struct sim_fault_run *run = g_new0(struct sim_fault_run, 1);

    (void)seed;
    run->due = g_array_new(FALSE, FALSE, sizeof(struct due));
    for (int i = 0; i < script->count; i++) {
        const struct sim_fault *fault = &script->faults[i];
        struct due due = {BOARD_NEVER, -1, *fault};
        if (fault->by_shot)
            due.shot = (int)fault->at;
        else
            due.at = now + TICKS(fault->at);
        g_array_append_val(run->due, due);
    }
    find_next(run);
    return run;
}

void sim_fault_run_free(struct sim_fault_run *run)
{
    if (!run)
        return;
    g_array_free(run->due, TRUE);
    g_free(run);
}

uint64_t sim_fault_run_next(const struct sim_fault_run *run)
{
    return run->next;
}

static void camera(struct sim_fault_run *run, struct sim_machine *machine, const struct sim_fault *fault)
{
    struct sim_camera_fault *state = &run->cameras[fault->index];

    switch (fault->kind) {
    case SIM_FAULT_CAMERA_DEAD:
        state->dead = fault->value != 0;
        break;
    case SIM_FAULT_CAMERA_MUTE:
        state->feedback_off = fault->value != 0;
        break;
    case SIM_FAULT_CAMERA_LAG:
        state->lag = fault->value;
        break;
    case SIM_FAULT_CAMERA_UNPLUG:
        state->unplugged = fault->value != 0;
        break;
    case SIM_FAULT_EXPOSURE:
        state->exposure = fault->value;
        break;
    case SIM_FAULT_FRAMES_DROPPED:
        state->frames_dropped = fault->value != 0;
        break;
    case SIM_FAULT_FRAMES_DOUBLED:
        state->frames_doubled = fault->value != 0;
        break;
    case SIM_FAULT_FRAMES_LATE:
        state->frames_late = fault->value;
        break;
    case SIM_FAULT_PACKETS_LOST:
        state->packets_lost = fault->value;
        break;
    case SIM_FAULT_ASKEW:
        state->askew = fault->value;
        break;
    default:
        state->busy = fault->value;
    }
    sim_mechanics_camera_fault(sim_machine_mechanics(machine), fault->index, state);
}

static void board(struct sim_fault_run *run, struct sim_machine *machine, const struct sim_fault *fault)
{
    struct host_board *b = sim_machine_board(machine);

    switch (fault->kind) {
    case SIM_FAULT_HANG:
        host_board_hang(b, host_board_now(b) + TICKS(fault->value));
        break;
    case SIM_FAULT_RESET:
        sim_machine_reset(machine, (enum board_reset)fault->index);
        break;
    case SIM_FAULT_POWER:
        sim_machine_power(machine, fault->value == 0);
        break;
    default:
        host_board_cut_in_flash(b, (uint64_t)fault->value);
        run->cut_armed = true;
        run->dark = fault->duration > 0 ? fault->duration : DARK;
    }
}

static void mechanics(struct sim_fault_run *run, struct sim_machine *machine, const struct sim_fault *fault)
{
    struct sim_mechanics *m = sim_machine_mechanics(machine);
    bool on = fault->value != 0;

    switch (fault->kind) {
    case SIM_FAULT_INPUT:
        sim_mechanics_force_input(m, (enum board_input)fault->index, (enum sim_force)fault->value);
        break;
    case SIM_FAULT_PULSE:
        sim_mechanics_pulse_input(m, (enum board_input)fault->index, fault->value);
        break;
    case SIM_FAULT_BOUNCE:
        sim_mechanics_set_bounce(m, fault->value);
        break;
    case SIM_FAULT_SNAG:
        sim_mechanics_snag(m, on);
        break;
    case SIM_FAULT_DRIVER:
        sim_mechanics_driver_fault(m, on);
        break;
    case SIM_FAULT_SUPPLY:
        sim_mechanics_set_supply(m, on ? fault->value : run->supply);
        break;
    case SIM_FAULT_DRIVE_ALARM:
        run->drive.alarm = on;
        sim_mechanics_drive_fault(m, &run->drive);
        break;
    case SIM_FAULT_DRIVE_SILENT:
        run->drive.silent = on;
        sim_mechanics_drive_fault(m, &run->drive);
        break;
    default:
        sim_mechanics_slip(m, (int)fault->value);
    }
}

static void act(struct sim_fault_run *run, struct sim_machine *machine, const struct sim_fault *fault)
{
    bool on = fault->value != 0;

    switch (fault->kind) {
    case SIM_FAULT_ESTOP:
        sim_machine_estop(machine, on);
        break;
    case SIM_FAULT_LINK_CUT:
        sim_machine_link_cut(machine, on);
        break;
    case SIM_FAULT_LINK_NOISE:
        sim_machine_link_noise(machine, fault->value);
        break;
    case SIM_FAULT_UNPLUG:
        sim_machine_unplug(machine, on);
        break;
    case SIM_FAULT_HOST_GONE:
        sim_machine_host_gone(machine, on);
        break;
    case SIM_FAULT_CAMERA_DEAD:
    case SIM_FAULT_CAMERA_MUTE:
    case SIM_FAULT_CAMERA_LAG:
    case SIM_FAULT_CAMERA_BUSY:
    case SIM_FAULT_CAMERA_UNPLUG:
    case SIM_FAULT_EXPOSURE:
    case SIM_FAULT_FRAMES_DROPPED:
    case SIM_FAULT_FRAMES_DOUBLED:
    case SIM_FAULT_FRAMES_LATE:
    case SIM_FAULT_PACKETS_LOST:
        camera(run, machine, fault);
        break;
    case SIM_FAULT_HANG:
    case SIM_FAULT_RESET:
    case SIM_FAULT_POWER:
    case SIM_FAULT_CUT_IN_FLASH:
        board(run, machine, fault);
        break;
    default:
        mechanics(run, machine, fault);
    }
}

/* Undone after its duration; what happens at once has nothing to undo. */
static void plan_end(struct sim_fault_run *run, const struct sim_fault *fault, uint64_t now)
{
    struct due end = {now + TICKS(fault->duration), -1, *fault};

    if (fault->duration <= 0 || fault->kind == SIM_FAULT_CUT_IN_FLASH || fault->kind == SIM_FAULT_HANG ||
        fault->kind == SIM_FAULT_RESET || fault->kind == SIM_FAULT_SLIP || fault->kind == SIM_FAULT_PULSE)
        return;
    end.fault.value = fault->kind == SIM_FAULT_BOUNCE ? 0.5e-3 : 0;
    end.fault.duration = 0;
    g_array_append_val(run->due, end);
}

/* Shots so far, by the cameras' own records. */
static int shots_taken(struct sim_fault_run *run, struct sim_machine *machine)
{
    int count, most = 0, per[LUMI_RIG_CAMERAS] = {0};

    if (!run->shots)
        return 0;
    const struct sim_exposure *e = sim_mechanics_exposures(sim_machine_mechanics(machine), &count);
    if (count == 0)
        return 0;
    for (int i = 0; i < count; i++)
        most = MAX(most, ++per[e[i].camera]);
    return most;
}

static void watch_cut(struct sim_fault_run *run, struct sim_machine *machine)
{
    if (!run->cut_armed || host_board_powered(sim_machine_board(machine)))
        return;
    struct due back = {sim_machine_now(machine) + TICKS(run->dark), -1, {.kind = SIM_FAULT_POWER}};
    run->cut_armed = false;
    sim_machine_power(machine, false);
    g_array_append_val(run->due, back);
    find_next(run);
}

void sim_fault_run_poll(struct sim_fault_run *run, struct sim_machine *machine)
{
    uint64_t now = sim_machine_now(machine);

    if (run->supply == 0)
        run->supply = sim_mechanics_supply_mv(sim_machine_mechanics(machine)) / 1000.0;
    watch_cut(run, machine);
    if (run->next > now && !run->shots)
        return;
    int taken = shots_taken(run, machine);
    for (guint i = 0; i < run->due->len; i++) {
        struct due due = g_array_index(run->due, struct due, i);
        if (due.shot >= 0 ? due.shot > taken : due.at > now)
            continue;
        g_array_remove_index(run->due, i--);
        act(run, machine, &due.fault);
        plan_end(run, &due.fault, now);
    }
    find_next(run);
}
