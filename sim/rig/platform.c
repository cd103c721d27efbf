/* Motor, belt, platform, string and arm.
 *
 * The motor's field moves a microstep a pulse. The load hangs on it as a damped oscillator: near rest the stepper's
 * torque is a spring, T_hold · π/2 a full step of lag, so ω² = T_hold · gear · (π/2 / full step at the platform) /
 * inertia; it weakens as the torque falls with speed. Far from rest the torque is T · sin(π/2 · lag) and the motion is
 * integrated in small steps; beyond two full steps the rotor falls into the next place of rest, four full steps on:
 * steps are lost. Between pulses everything near rest has a closed form, so a sweep costs a few hundred nanoseconds a
 * pulse.
 *
 * What the cameras see is the body plus, by `sway_share`, a second mode (the arm bending sideways): both are driven by
 * the field, as the modes of a linear structure are. The arm's drop follows the string that is paid out as a third. */
#include "sim/rig/mechanics_priv.h"

#include "proto/mechanism/kinematics.h"

#include <math.h>

#define FINE_DT 1e-4       /* s, of the integration far from rest */
#define LINEAR_LAG 0.35    /* full steps up to which sin is taken as straight */
#define SLOWEST 0.1        /* s between two pulses: beyond it the field jumps rather than turns */
#define DAMPING_MOST 0.2   /* share of the torque that damping can make: it is the same current */
#define HOLD_GRACE 0.020   /* s without brake and current until the arm's inertia gives in */
#define FALL_GRAVITY 12.0  /* rad/s², of an arm that nothing holds */
#define FALL_END 3.0       /* rad, where it hits the tripod */
#define SUPPLY_LOCKOUT 9.0 /* V, below which a stepper driver switches itself off and a brake closes */

static double full_step(const struct sim_mechanics *m)
{
    return m->truth.microsteps;
}

static double drop_given(const struct sim_mechanics *m, double place)
{
    double turns = place / m->platform.steps_per_turn;
    double drop = lumi_rig_drop(&m->truth, turns);

    return drop * (1 + m->options.string_stretch);
}

void sim_platform_init(struct sim_mechanics *m)
{
    struct sim_platform *p = &m->platform;
    const struct sim_mechanics_options *o = &m->options;
    double gear = (double)m->truth.gear_motor / m->truth.gear_platform;
    double step_angle = 2 * LUMI_PI / (m->truth.motor_steps * gear);
    double stiffness = o->motor_torque * gear * (LUMI_PI / 2) / step_angle; /* N·m/rad */

    p->steps_per_turn = lumi_rig_steps_per_turn(&m->truth);
    p->omega = sqrt(stiffness / o->inertia);
    p->omega_sway = 2 * LUMI_PI * o->sway_frequency;
    p->omega_arm = 2 * LUMI_PI * o->arm_frequency;
    p->lag_limit = 2 * full_step(m);
    p->play = (o->backlash + 2 * o->friction / stiffness) / (2 * LUMI_PI) * p->steps_per_turn;
    p->field = p->seat = o->start_turns * p->steps_per_turn;
    p->rest = p->given = drop_given(m, p->seat);
    p->brake_holds = true;
    p->loose_since = BOARD_NEVER;
}

double sim_platform_place(const struct sim_mechanics *m)
{
    return m->platform.seat + m->platform.body.y;
}

/* What the string that is out by now does to the arm. */
static void pay_out(struct sim_mechanics *m, double place)
{
    struct sim_platform *p = &m->platform;
    double given = m->truth.string.held ? 0 : drop_given(m, place), by = given - p->given;

    p->given = given;
    if (p->fallen > 0 && by < 0) { /* winding up takes in what had fallen first */
        double taken = fmin(p->fallen, -by);
        p->fallen -= taken;
        p->rest -= taken;
        by += taken;
    }
    if (by > 0 && (p->brake_holds || p->snagged)) {
        p->loose += by;
    } else if (by < 0 && p->loose > 0) {
        double taken = fmin(p->loose, -by);
        p->loose -= taken;
        by += taken;
    }
    if (by != 0 && !(by > 0 && (p->brake_holds || p->snagged))) {
        p->rest += by;
        sim_oscillator_jump(&p->arm, by, p->omega_arm, m->options.arm_damping);
    }
}

/* Microsteps/s. */
static double field_speed(const struct sim_mechanics *m)
{
    return (m->platform.last_forward ? 1 : -1) * m->platform.rate * full_step(m);
}

/* Carried along by the field, so that its torque is a spring. */
static bool near_rest(const struct sim_mechanics *m)
{
    const struct sim_platform *p = &m->platform;

    return fabs(p->body.y) <= LINEAR_LAG * full_step(m) &&
           fabs(p->body.v - field_speed(m)) <= 2 * LINEAR_LAG * full_step(m) * p->omega;
}

/* The seat follows the field through the play; the load's modes are pulled along. */
static void seat_follows(struct sim_mechanics *m)
{
    struct sim_platform *p = &m->platform;
    double seat = fmin(fmax(p->seat, p->field - p->play / 2), p->field + p->play / 2), by = seat - p->seat;

    if (by == 0)
        return;
    p->seat = seat;
    sim_oscillator_jump(&p->body, by, p->omega, near_rest(m) ? m->options.damping : 0);
    sim_oscillator_jump(&p->sway, by, p->omega_sway, m->options.sway_damping);
    pay_out(m, seat);
}

void sim_platform_step(struct sim_mechanics *m, bool forward)
{
    struct sim_platform *p = &m->platform;
    double dt = SECONDS(m->now - p->last_step);
    double top = m->options.rest_turns * p->steps_per_turn;

    p->rate = forward == p->last_forward && dt > 0 && dt < SLOWEST ? 1 / (dt * full_step(m)) : 0;
    p->still_at = m->now + 2 * (m->now - p->last_step);
    p->last_step = m->now;
    p->last_forward = forward;
    p->count += forward ? 1 : -1;
    if (!p->energised) {
        p->missed++;
        return;
    }
    p->field += forward ? 1 : -1;
    if (p->slip > 0 && fabs(fmod(p->field, full_step(m))) < 0.5) {
        /* Something held the rotor back: it falls behind by the four full steps it can slip. */
        p->slip = p->slip > 4 ? p->slip - 4 : 0;
        p->missed += 4;
        p->field -= (forward ? 4 : -4) * full_step(m);
        p->seat -= (forward ? 4 : -4) * full_step(m);
        pay_out(m, p->seat);
    }
    if (!forward && !m->truth.string.held && p->field < top - p->lag_limit) {
        /* The arm lies on its rest and the string is tight: the rotor jumps back into the place it came from. */
        p->field += 4 * full_step(m);
        p->seat = p->field;
        p->body = (struct sim_oscillator){0, 0};
        p->missed += 4;
    }
    seat_follows(m);
}

void sim_platform_carry(struct sim_mechanics *m, double place)
{
    struct sim_platform *p = &m->platform;
    double by = place - p->seat;

    if (by == 0)
        return;
    p->field = p->seat = place;
    p->body = (struct sim_oscillator){0, 0}; /* held by a servo */
    sim_oscillator_jump(&p->sway, by, p->omega_sway, m->options.sway_damping);
    pay_out(m, place);
}

/* Share of the holding torque that is left at the present step rate. */
static double torque_left(const struct sim_mechanics *m)
{
    return 1 / (1 + m->platform.rate / m->options.torque_corner);
}

/* Far from rest, or without a field: small steps. */
static void integrate(struct sim_mechanics *m, double dt)
{
    struct sim_platform *p = &m->platform;
    double fs = full_step(m), left = torque_left(m), stiffness = p->omega * p->omega;
    double speed = field_speed(m);
    double limit = DAMPING_MOST * stiffness * left * (2 / LUMI_PI) * fs;

    while (dt > 0) {
        double h = fmin(dt, FINE_DT), lag = p->body.y / fs;
        double pull = sin(LUMI_PI / 2 * lag) * (2 / LUMI_PI) * fs;
        double damping = -2 * m->options.damping * p->omega * (p->body.v - speed);
        p->body.v += (-stiffness * left * pull + fmin(fmax(damping, -limit), limit)) * h;
        p->body.y += p->body.v * h;
        dt -= h;
        if (fabs(p->body.y) > p->lag_limit) {
            double by = p->body.y > 0 ? 4 * fs : -4 * fs;
            p->field += by;
            p->seat += by;
            p->body.y -= by;
            p->sway.y -= by;
            p->missed += 4;
            pay_out(m, p->seat);
        }
    }
}

/* No current: friction alone brakes the body. */
static void coast(struct sim_mechanics *m, double dt)
{
    struct sim_platform *p = &m->platform;
    double braking = m->options.friction / m->options.inertia / (2 * LUMI_PI) * p->steps_per_turn;
    double stop = fabs(p->body.v) / braking, t = fmin(dt, stop), sign = p->body.v > 0 ? 1 : -1;
    double by = p->body.v * t - sign * 0.5 * braking * t * t;

    p->body.v = t >= stop ? 0 : p->body.v - sign * braking * t;
    p->body.y += by;
    p->seat += p->body.y; /* nothing draws it anywhere else */
    p->field = p->seat;
    p->body.y = 0;
    if (by != 0) {
        sim_oscillator_jump(&p->sway, by, p->omega_sway, m->options.sway_damping);
        pay_out(m, p->seat);
    }
}

static void fall(struct sim_mechanics *m, double dt)
{
    struct sim_platform *p = &m->platform;
    double by = p->fall_speed * dt + 0.5 * FALL_GRAVITY * dt * dt;

    by = fmin(by, fmax(FALL_END - p->rest, 0));
    p->fall_speed += FALL_GRAVITY * dt;
    p->fallen += by;
    p->fallen_total += by;
    p->rest += by;
}

/* What holds the arm changes at `now`. */
static void holding(struct sim_mechanics *m)
{
    struct sim_platform *p = &m->platform;

    if (!p->brake_holds && !p->snagged && p->loose > 0) { /* let go: the arm drops into the string */
        p->rest += p->loose;
        sim_oscillator_jump(&p->arm, p->loose, p->omega_arm, m->options.arm_damping);
        if (p->loose > m->options.slack_angle)
            p->dropped_total += p->loose;
        p->loose = 0;
    }
    if (m->truth.string.held || p->energised || p->brake_holds) {
        p->loose_since = BOARD_NEVER;
        p->fall_speed = 0;
    } else if (p->loose_since == BOARD_NEVER) {
        p->loose_since = m->now;
    }
}

void sim_platform_powers(struct sim_mechanics *m)
{
    struct sim_platform *p = &m->platform;
    bool fitted = m->truth.control.safety.brake_fitted,
         open = m->outputs[BOARD_OUT_BRAKE] && m->supply > SUPPLY_LOCKOUT;
    bool energised = m->outputs[BOARD_OUT_ENABLE] && !m->driver_fault && m->supply > SUPPLY_LOCKOUT;

    if (energised && !p->energised && m->truth.control.motion.drive == LUMI_RIG_DRIVE_STEPPER) {
        /* The rotor takes the nearest place of rest of a field that stands where the pulses left it. */
        double cycle = 4 * full_step(m), phase = m->options.start_turns * p->steps_per_turn + (double)p->count;
        double field = phase + cycle * round((p->seat - phase) / cycle), by = field - p->seat;
        p->field = p->seat = field;
        sim_oscillator_jump(&p->body, by, p->omega, 0);
        p->rate = 0;
    }
    if (!energised && p->energised) {
        p->seat += p->body.y;
        p->body.y = 0;
    }
    p->energised = energised;
    if (!fitted)
        p->brake_holds = false;
    else if (open)
        p->brake_holds = false;
    else if (p->brake_wanted != !open)
        p->brake_at = m->now + TICKS(m->options.brake_delay);
    p->brake_wanted = !open;
    holding(m);
}

static void propagate(struct sim_mechanics *m, double dt)
{
    struct sim_platform *p = &m->platform;

    if (!p->energised)
        coast(m, dt);
    else if (!near_rest(m))
        integrate(m, dt);
    else
        sim_oscillator_advance(&p->body, dt, p->omega * sqrt(torque_left(m)), m->options.damping);
    sim_oscillator_advance(&p->sway, dt, p->omega_sway, m->options.sway_damping);
    sim_oscillator_advance(&p->arm, dt, p->omega_arm, m->options.arm_damping);
    if (p->loose_since != BOARD_NEVER && m->now >= p->loose_since + TICKS(HOLD_GRACE))
        fall(m, dt);
}

void sim_platform_advance(struct sim_mechanics *m, uint64_t to)
{
    struct sim_platform *p = &m->platform;
    double dt = SECONDS(to - m->now);

    if (dt > 0)
        propagate(m, dt);
    if (p->rate > 0 && to >= p->still_at)
        p->rate = 0;
    m->now = to;
    if (p->brake_wanted && !p->brake_holds && m->truth.control.safety.brake_fitted && to >= p->brake_at) {
        p->brake_holds = true;
        holding(m);
    }
}

/* Near an edge of the index the body is looked at this often: its time is interpolated in between. */
#define LOOK_TICKS (BOARD_TICK_HZ / 20000)

uint64_t sim_platform_next(struct sim_mechanics *m)
{
    const struct sim_platform *p = &m->platform;
    uint64_t next = p->rate > 0 ? p->still_at : BOARD_NEVER;
    double reach = fabs(p->body.y) + fabs(p->body.v) / p->omega;

    if (p->brake_wanted && !p->brake_holds && m->truth.control.safety.brake_fitted)
        next = MIN(next, MAX(p->brake_at, m->now + 1));
    if (p->loose_since != BOARD_NEVER && p->fallen < FALL_END)
        next = MIN(next, m->now + BOARD_TICK_HZ / 1000);
    if (p->energised ? reach > 1e-3 && reach > sim_switches_distance(m) : p->body.v != 0)
        next = MIN(next, m->now + LOOK_TICKS);
    return next;
}
