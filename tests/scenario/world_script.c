/* Faults at their times. */
#include "world_script.h"

#include "capture_world.h"
#include "sim/random.h"

#include <stdio.h>
#include <string.h>

const char *const world_fault_names[WORLD_FAULT_KINDS] = {
    "unplug-camera", "drop",       "vanish",     "late",        "double",       "swap",       "damage",
    "blur",          "exposure",   "stall",      "spurious",    "sync-missing", "sync-extra", "board-reset",
    "board-power",   "link-cut",   "link-noise", "link-unplug", "estop",        "disk-full",  "disk-slow",
    "disk-error",    "clock-step", "hang",       "kill",        "kill-storing", "pause",
};

/* ---- making one ---- */

struct dice {
    uint64_t seed, count;
};

static double unit(struct dice *dice)
{
    return sim_random_unit(sim_random(dice->seed, dice->count++, 4242));
}

static double between(struct dice *dice, double low, double high)
{
    return low + (high - low) * unit(dice);
}

static void choose(struct world_fault *f, struct dice *dice, int shots, int cameras)
{
    memset(f, 0, sizeof *f);
    f->kind = (enum world_fault_kind)(unit(dice) * WORLD_FAULT_KINDS);
    f->shot = unit(dice) < 0.8 ? (int)(unit(dice) * shots) : -1;
    f->at = f->shot >= 0 ? between(dice, 0, 1) : between(dice, 0, 40);
    f->camera = (int)(unit(dice) * cameras);
    f->count = 1 + (int)(unit(dice) * unit(dice) * 4);
    f->duration = between(dice, 0.1, 1);
    f->duration *= f->duration * 12;
    switch (f->kind) {
    case WORLD_FAULT_LATE:
        f->value = unit(dice) < 0.5 ? between(dice, 0.05, 2) : between(dice, 2, 9);
        break;
    case WORLD_FAULT_LINK_NOISE:
        f->value = between(dice, 0.01, 0.3);
        break;
    case WORLD_FAULT_DISK_SLOW:
        f->value = between(dice, 0.2, 3); /* s a job */
        break;
    case WORLD_FAULT_CLOCK_STEP:
        f->value = between(dice, -4000, 4000);
        break;
    case WORLD_FAULT_KILL_STORING:
        f->count = 1 + (int)(unit(dice) * 12);
        break;
    default:
        break;
    }
}

void world_script_random(struct world_script *script, uint64_t seed, int most, int shots, int cameras)
{
    struct dice dice = {seed, 0};

    memset(script, 0, sizeof *script);
    script->count = 1 + (int)(unit(&dice) * most);
    for (int i = 0; i < script->count; i++)
        choose(&script->faults[i], &dice, shots, cameras);
}

size_t world_script_print(const struct world_script *script, char *text, size_t size)
{
    size_t length = 0;

    text[0] = 0;
    for (int i = 0; i < script->count && length < size; i++) {
        const struct world_fault *f = &script->faults[i];
        length += (size_t)snprintf(text + length, size - length,
                                   "  at %s%.3d + %.3f s: %s, camera %d, %d times, value "
                                   "%.3g, for %.2f s\n",
                                   f->shot >= 0 ? "shot " : "", f->shot, f->at, world_fault_names[f->kind], f->camera,
                                   f->count, f->value, f->duration);
    }
    return length;
}

/* ---- running it ---- */

static void frames_fault(struct world *w, const struct world_fault *f)
{
    struct world_camera *c = &w->cameras[f->camera];
    int *const counters[] = {&c->drop, &c->vanish, &c->late, &c->doubled,
                             &c->swap, &c->damage, &c->blur, &c->wrong_exposure};

    *counters[f->kind - WORLD_FAULT_DROP] += f->count;
    if (f->kind == WORLD_FAULT_LATE)
        c->late_by_ns = (int64_t)(f->value * 1e9);
}

static void camera_fault(struct world *w, const struct world_fault *f, bool on)
{
    struct world_camera *c = &w->cameras[f->camera];

    if (f->kind == WORLD_FAULT_UNPLUG_CAMERA)
        world_camera_unplug(w, f->camera, on);
    else if (!on)
        return;
    else if (f->kind == WORLD_FAULT_STALL)
        c->stalled_until_ns = w->now_ns + (int64_t)(f->duration * 1e9);
    else if (f->kind == WORLD_FAULT_SPURIOUS)
        world_spurious_frame(w, f->camera);
    else if (f->kind == WORLD_FAULT_SYNC_MISSING)
        c->sync_missing += f->count;
    else if (f->kind == WORLD_FAULT_SYNC_EXTRA)
        world_spurious_edge(w, f->camera);
    else
        frames_fault(w, f);
}

static void board_fault(struct world *w, const struct world_fault *f, bool on)
{
    switch (f->kind) {
    case WORLD_FAULT_BOARD_RESET:
        if (on)
            sim_machine_reset(w->machine, BOARD_RESET_PIN);
        break;
    case WORLD_FAULT_BOARD_POWER:
        sim_machine_power(w->machine, !on);
        break;
    case WORLD_FAULT_LINK_CUT:
        sim_machine_link_cut(w->machine, on);
        break;
    case WORLD_FAULT_LINK_NOISE:
        sim_machine_link_noise(w->machine, on ? f->value : 0);
        break;
    case WORLD_FAULT_LINK_UNPLUG:
        sim_machine_unplug(w->machine, on);
        break;
    default:
        sim_machine_estop(w->machine, on);
    }
}

static void host_fault(struct world *w, const struct world_fault *f, bool on)
{
    struct lumi_error error;

    switch (f->kind) {
    case WORLD_FAULT_DISK_FULL:
        w->disk.full = on;
        break;
    case WORLD_FAULT_DISK_SLOW:
        w->disk.latency = on ? f->value : 0.5e-3;
        break;
    case WORLD_FAULT_DISK_ERROR:
        w->disk.fail_next += on ? f->count : 0;
        break;
    case WORLD_FAULT_CLOCK_STEP:
        if (on)
            world_clock_step(w, f->value);
        break;
    case WORLD_FAULT_HANG:
        world_hang(w, on);
        break;
    case WORLD_FAULT_KILL:
        if (on)
            world_daemon_kill(w);
        break;
    case WORLD_FAULT_KILL_STORING:
        w->disk.kill_in = on ? f->count : 0;
        break;
    default:
        if (on && w->engine)
            lumi_engine_pause(w->engine, w->now_ns, &error);
    }
}

static void happen(struct world *w, const struct world_fault *f, bool on)
{
    if (w->trace)
        fprintf(stderr, "%9.3f FAULT %s %s camera %d\n", world_seconds(w), world_fault_names[f->kind],
                on ? "begins" : "ends", f->camera);
    if (f->kind < WORLD_FAULT_BOARD_RESET)
        camera_fault(w, f, on);
    else if (f->kind < WORLD_FAULT_DISK_FULL)
        board_fault(w, f, on);
    else
        host_fault(w, f, on);
}

void world_script_service(struct world *w)
{
    for (int i = 0; w->script && i < w->script->count; i++) {
        struct world_fault *f = &w->script->faults[i];
        if (!f->due_ns && f->shot < 0)
            f->due_ns = w->script_began_ns + (int64_t)(f->at * 1e9);
        else if (!f->due_ns && w->shots_fired > f->shot)
            f->due_ns = w->now_ns + (int64_t)(f->at * 1e9);
        if (!f->due_ns || f->due_ns == INT64_MAX || w->now_ns < f->due_ns)
            continue;
        f->on = !f->on;
        f->due_ns = f->on ? w->now_ns + (int64_t)(f->duration * 1e9) : INT64_MAX;
        w->script->happened |= UINT64_C(1) << f->kind;
        happen(w, f, f->on);
    }
}

int64_t world_script_next(const struct world *w)
{
    int64_t next = INT64_MAX;

    for (int i = 0; w->script && i < w->script->count; i++) {
        const struct world_fault *f = &w->script->faults[i];
        if (f->due_ns && f->due_ns < next)
            next = f->due_ns;
    }
    return next;
}
