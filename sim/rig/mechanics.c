/* The simulated rig as a whole: order of time, outputs in, inputs out, truth. */
#include "sim/rig/mechanics_priv.h"

#include "proto/mechanism/kinematics.h"

#include <math.h>

#define DEGREE (LUMI_PI / 180)

void sim_mechanics_options_init(struct sim_mechanics_options *options, const struct lumi_rig *rig)
{
    /* Small cameras where there are many, bigger ones on the bar. */
    double mass = rig->camera_count > 4 ? 0.15 : 0.8, inertia = 0.1;

    for (int i = 0; i < rig->camera_count; i++) {
        double arm = rig->cameras[i].radius * cos(rig->cameras[i].angle);
        inertia += mass * arm * arm;
    }
    *options = (struct sim_mechanics_options){
        .seed = 1,
        .motor_torque = 1.9,
        .torque_corner = 1500,
        .inertia = inertia,
        .friction = 0.1,
        .damping = 0.12,
        .backlash = 0.02 * DEGREE,
        .sway_share = 0.2,
        .sway_frequency = 9,
        .sway_damping = 0.1,
        .arm_frequency = 4,
        .arm_damping = 0.15,
        .string_stretch = 1e-4,
        .index_width = 2 * DEGREE,
        .switch_bounce = 0.5e-3,
        .wound_turns = -0.1,
        .rest_turns = -0.4,
        .end_turns = 0.15,
        .slack_angle = 1 * DEGREE,
        .brake_delay = 0.01,
        .start_turns = rig->string.held ? 0.3 : 0.2,
        .camera_jitter = 20e-6,
        .supply = 24,
        .video_rate = 30,
    };
}

struct sim_mechanics *sim_mechanics_create(const struct lumi_rig *truth, const struct sim_mechanics_options *options)
{
    struct sim_mechanics *m = g_new0(struct sim_mechanics, 1);

    m->truth = *truth;
    m->options = *options;
    m->supply = options->supply;
    m->cameras_next = BOARD_NEVER;
    m->records = g_array_new(FALSE, FALSE, sizeof(struct sim_exposure));
    m->video = g_array_new(FALSE, FALSE, sizeof(struct sim_video_frame));
    m->messages = g_array_new(FALSE, FALSE, sizeof(struct sim_message));
    for (int i = 0; i < LUMI_RIG_CAMERAS; i++)
        m->cameras[i].next = m->cameras[i].focused_since = BOARD_NEVER;
    sim_platform_init(m);
    sim_platform_powers(m);
    sim_switches_start(m);
    return m;
}

void sim_mechanics_destroy(struct sim_mechanics *m)
{
    if (!m)
        return;
    g_array_free(m->records, TRUE);
    g_array_free(m->video, TRUE);
    g_array_free(m->messages, TRUE);
    g_free(m);
}

void sim_mechanics_tell(struct sim_mechanics *m, bool feedback, int input, bool active, uint64_t at)
{
    struct sim_message message = {at, input, feedback, active};

    g_array_append_val(m->messages, message);
}

uint64_t sim_mechanics_next(struct sim_mechanics *m)
{
    uint64_t next = MIN(m->cameras_next, sim_platform_next(m));

    if (m->messages->len > 0)
        return m->now;
    if (m->edge_count > 0)
        next = MIN(next, m->edges[0].at);
    return MAX(next, m->now);
}

/* Everything up to `to`, but for telling the caller. */
static void run(struct sim_mechanics *m, uint64_t to)
{
    for (;;) {
        uint64_t next = MIN(m->cameras_next, sim_platform_next(m)), since = m->now;
        double before = sim_platform_place(m);
        if (m->edge_count > 0)
            next = MIN(next, m->edges[0].at);
        next = MAX(next, m->now);
        sim_platform_advance(m, MIN(next, to));
        sim_switches_look(m, before, since);
        sim_switches_run(m);
        sim_cameras_run(m);
        if (next >= to)
            return;
    }
}

void sim_mechanics_advance(struct sim_mechanics *m, uint64_t to, const struct sim_mechanics_listener *listener)
{
    if (to >= m->now)
        run(m, to);
    for (guint i = 0; i < m->messages->len; i++) {
        struct sim_message message = g_array_index(m->messages, struct sim_message, i);
        if (message.feedback && listener && listener->feedback)
            listener->feedback(listener->context, message.input, message.active, message.at);
        if (!message.feedback && listener && listener->input)
            listener->input(listener->context, (enum board_input)message.input, message.active, message.at);
    }
    g_array_set_size(m->messages, 0);
}

void sim_mechanics_step(struct sim_mechanics *m, uint64_t at, bool forward)
{
    if (at > m->now)
        run(m, at);
    double before = sim_platform_place(m);
    sim_platform_step(m, forward);
    sim_switches_look(m, before, m->now);
}

void sim_mechanics_trigger_lines(struct sim_mechanics *m, uint64_t at, uint16_t lines)
{
    if (at > m->now)
        run(m, at);
    sim_cameras_lines(m, lines);
}

void sim_mechanics_output(struct sim_mechanics *m, uint64_t at, enum board_output output, bool active)
{
    if (at > m->now)
        run(m, at);
    m->outputs[output] = active;
    sim_platform_powers(m);
}

bool sim_mechanics_input(const struct sim_mechanics *m, enum board_input input)
{
    return sim_switches_level(m, input);
}

bool sim_mechanics_feedback(const struct sim_mechanics *m, int input)
{
    return m->feedback[input] > 0;
}

int sim_mechanics_supply_mv(const struct sim_mechanics *m)
{
    return (int)lround(m->supply * 1000);
}

bool sim_mechanics_enabled(const struct sim_mechanics *m)
{
    return m->outputs[BOARD_OUT_ENABLE];
}

void sim_mechanics_drive_to(struct sim_mechanics *m, double turns, bool reached)
{
    double before = sim_platform_place(m);

    sim_platform_carry(m, turns * m->platform.steps_per_turn);
    m->reached = reached;
    sim_switches_look(m, before, m->now);
    sim_switches_run(m);
}

const struct sim_drive_fault *sim_mechanics_drive_faults(const struct sim_mechanics *m)
{
    return &m->drive_fault;
}

void sim_mechanics_drive_fault(struct sim_mechanics *m, const struct sim_drive_fault *fault)
{
    m->drive_fault = *fault;
}

double sim_mechanics_turns(const struct sim_mechanics *m)
{
    return sim_platform_place(m) / m->platform.steps_per_turn;
}

double sim_mechanics_angle(const struct sim_mechanics *m)
{
    const struct sim_platform *p = &m->platform;
    double share = m->options.sway_share, place = p->seat + (1 - share) * p->body.y + share * p->sway.y;

    return lumi_rig_turn_angle(&m->truth, place / p->steps_per_turn);
}

double sim_mechanics_drop(const struct sim_mechanics *m)
{
    return m->platform.rest + m->platform.arm.y;
}

double sim_mechanics_swing(const struct sim_mechanics *m)
{
    const struct sim_platform *p = &m->platform;
    double share = m->options.sway_share, step = 2 * LUMI_PI / p->steps_per_turn;
    double body = (1 - share) * sim_oscillator_envelope(&p->body, p->omega) * step;
    double sway = share * sim_oscillator_envelope(&p->sway, p->omega_sway) * step;

    return hypot(body + sway, sim_oscillator_envelope(&p->arm, p->omega_arm));
}

bool sim_mechanics_falling(const struct sim_mechanics *m)
{
    return m->platform.fall_speed > 0;
}

double sim_mechanics_fallen(const struct sim_mechanics *m)
{
    return m->platform.fallen_total;
}

double sim_mechanics_dropped(const struct sim_mechanics *m)
{
    return m->platform.dropped_total;
}

int64_t sim_mechanics_missed_steps(const struct sim_mechanics *m)
{
    return m->platform.missed;
}

int64_t sim_mechanics_steps(const struct sim_mechanics *m)
{
    return m->platform.count;
}

void sim_mechanics_pose(const struct sim_mechanics *m, int camera, struct lumi_pose *pose)
{
    lumi_rig_camera_pose_at(&m->truth, camera, sim_mechanics_angle(m), sim_mechanics_drop(m), pose);
}

void sim_mechanics_set_supply(struct sim_mechanics *m, double volts)
{
    m->supply = volts;
    sim_platform_powers(m);
}

void sim_mechanics_driver_fault(struct sim_mechanics *m, bool fault)
{
    m->driver_fault = fault;
    sim_platform_powers(m);
    sim_switches_look(m, sim_platform_place(m), m->now);
    sim_switches_run(m);
}

void sim_mechanics_snag(struct sim_mechanics *m, bool snagged)
{
    m->platform.snagged = snagged;
    sim_platform_powers(m);
}

void sim_mechanics_slip(struct sim_mechanics *m, int steps)
{
    m->platform.slip += steps;
}
