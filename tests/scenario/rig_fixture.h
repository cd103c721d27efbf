/* What the scenarios of a whole rig share: a rig that is configured and homed, a sweep that is run and judged by the
 * cameras' own records and the true place of the platform. */
#ifndef LUMI_TESTS_SCENARIO_RIG_FIXTURE_H
#define LUMI_TESTS_SCENARIO_RIG_FIXTURE_H

#include "proto/mechanism/kinematics.h"
#include "sim/rig/faults.h"
#include "sim/rig/machine.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

#define DEGREE (LUMI_PI / 180)

#define OK(expression)                                                                                                 \
    do {                                                                                                               \
        struct lumi_error ok_error_ = {0};                                                                             \
        struct lumi_error *error = &ok_error_;                                                                         \
        if ((expression) != LUMI_OK)                                                                                   \
            fail_msg("%s: %s", #expression, ok_error_.text);                                                           \
    } while (0)

struct rig_fixture {
    struct lumi_rig rig;
    struct lumi_plan plan;
    struct sim_machine_options options;
    struct sim_machine *machine;
    clock_t began;
};

static inline void rig_fixture_init(struct rig_fixture *f, const char *name)
{
    memset(f, 0, sizeof *f);
    OK(lumi_rig_builtin(name, &f->rig, error));
    lumi_plan_init(&f->plan, &f->rig);
    sim_machine_options_init(&f->options, &f->rig);
    f->began = clock();
}

/* Creates the machine, gives it its profile and homes it. */
static inline void rig_fixture_start(struct rig_fixture *f)
{
    OK(lumi_plan_check(&f->plan, &f->rig, error));
    f->machine = sim_machine_create(&f->rig, &f->options);
    assert_non_null(f->machine);
    OK(sim_machine_configure(f->machine, &f->rig, error));
    OK(sim_machine_home(f->machine, !f->rig.string.held, 0, error));
}

static inline void rig_fixture_finish(struct rig_fixture *f)
{
    sim_machine_destroy(f->machine);
    f->machine = NULL;
}

/* Degrees and seconds; mean is signed. */
struct rig_figures {
    int exposures;
    double angle_mean, angle_deviation, angle_worst; /* of the exposures' middles from their angles */
    double swing_worst, moved_worst, drop_worst, zero;
    double virtual_seconds, sweep_seconds, cpu_seconds;
};

/* For calls that are meant to fail, whatever they say. */
static struct lumi_error expected_error __attribute__((unused));

/* Where the platform stands when the board says 0, as homing left it, in microsteps: at rest after the sweep. */
static inline double zero_of(struct rig_fixture *f)
{
    lumi_wire_Status status;

    sim_machine_run(f->machine, 4);
    OK(sim_machine_status(f->machine, &status, error));
    return sim_mechanics_turns(sim_machine_mechanics(f->machine)) * lumi_rig_steps_per_turn(&f->rig) -
           (double)status.step;
}

/* Every camera took every shot once and in order; how far from its angle. */
static inline struct rig_figures judge_exposures(struct rig_fixture *f)
{
    struct rig_figures figures = {0};
    int count, taken[LUMI_RIG_CAMERAS] = {0}, shots = lumi_plan_shots(&f->plan);
    double zero = zero_of(f) / lumi_rig_steps_per_turn(&f->rig), sum = 0, square = 0;
    const struct sim_exposure *e = sim_mechanics_exposures(sim_machine_mechanics(f->machine), &count);
    uint32_t cameras = lumi_plan_cameras(&f->plan, &f->rig);

    for (int i = 0; i < count; i++) {
        assert_false(e[i].lost);
        assert_true(e[i].done);
        int shot = taken[e[i].camera]++;
        assert_in_range(shot, 0, shots - 1);
        double position = shot / f->plan.bracket;
        double turns = f->plan.first_turn + position / f->plan.positions;
        double want = lumi_rig_turn_angle(&f->rig, turns + zero);
        double error = (e[i].angle - want) / DEGREE;
        double drop = lumi_rig_drop(&f->rig, turns) - e[i].drop;
        assert_int_equal(e[i].exposure, shot % f->plan.bracket);
        sum += error;
        square += error * error;
        figures.angle_worst = fmax(figures.angle_worst, fabs(error));
        figures.swing_worst = fmax(figures.swing_worst, e[i].swing / DEGREE);
        figures.moved_worst = fmax(figures.moved_worst, fabs(e[i].moved) / DEGREE);
        figures.drop_worst = fmax(figures.drop_worst, fabs(drop) / DEGREE);
    }
    for (int camera = 0; camera < f->rig.camera_count; camera++)
        assert_int_equal(taken[camera], cameras >> camera & 1 ? shots : 0);
    figures.exposures = count;
    figures.zero = zero * 360;
    if (count > 0) {
        figures.angle_mean = sum / count;
        figures.angle_deviation = sqrt(fmax(square / count - figures.angle_mean * figures.angle_mean, 0));
    }
    return figures;
}

/* The board reported every shot once, as fired. */
static inline void judge_events(struct rig_fixture *f)
{
    int count, shots = lumi_plan_shots(&f->plan);
    const struct sim_machine_event *events = sim_machine_events(f->machine, &count);
    uint8_t *seen = calloc((size_t)shots + 1, 1), *states = calloc((size_t)shots + 1, 1);

    assert_int_equal(sim_machine_events_lost(f->machine), 0);
    for (int i = 0; i < count; i++)
        if (events[i].event.which_kind == lumi_wire_Event_shot_tag) {
            const lumi_wire_Shot *shot = &events[i].event.kind.shot;
            assert_in_range(shot->number, 0, shots - 1);
            assert_false(shot->lost);
            seen[shot->number]++;
        }
    if (shots > 0)
        OK(sim_machine_shots(f->machine, states, shots, error));
    for (int i = 0; i < shots; i++) {
        assert_int_equal(seen[i], 1);
        assert_int_equal(states[i], 1);
    }
    free(seen);
    free(states);
}

/* Runs the loaded plan to its end and judges it. */
static inline struct rig_figures rig_fixture_sweep(struct rig_fixture *f)
{
    const lumi_wire_Event *event;
    int from;

    OK(sim_machine_load_plan(f->machine, &f->plan, error));
    sim_machine_events(f->machine, &from);
    OK(sim_machine_start(f->machine, 0, false, error));
    OK(sim_machine_wait_sweep(f->machine, 4000, error));
    event = sim_machine_find(f->machine, from, lumi_wire_Event_sweep_ended_tag);
    assert_int_equal(event->kind.sweep_ended.how, lumi_wire_SweepEnded_How_COMPLETE);
    assert_int_equal(event->kind.sweep_ended.fired, lumi_plan_shots(&f->plan));
    assert_int_equal(event->kind.sweep_ended.lost, 0);
    struct rig_figures figures = judge_exposures(f);
    judge_events(f);
    assert_true(sim_mechanics_missed_steps(sim_machine_mechanics(f->machine)) == 0);
    assert_true(sim_mechanics_fallen(sim_machine_mechanics(f->machine)) == 0);
    figures.virtual_seconds = sim_machine_seconds(f->machine);
    int steps;
    const uint64_t *ticks = sim_machine_step_ticks(f->machine, &steps);
    (void)ticks;
    figures.cpu_seconds = (double)(clock() - f->began) / CLOCKS_PER_SEC;
    return figures;
}

static inline void print_figures(const char *what, const struct rig_figures *r)
{
    print_message(
        "%s: %d exposures, middle %+.5f +- %.5f worst %.5f deg, swing %.5f, moved %.4f, drop %.4f, zero %+.5f; "
        "%.1f virtual s in %.2f s of CPU\n",
        what, r->exposures, r->angle_mean, r->angle_deviation, r->angle_worst, r->swing_worst, r->moved_worst,
        r->drop_worst, r->zero, r->virtual_seconds, r->cpu_seconds);
}

#endif
