/* firmware/core: homing: the mark is found to the step, from anywhere, or it is said why not. */
#include "firmware/core/homing_state.h"
#include "proto/mechanism/kinematics.h"
#include "step_board.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#define MS (BOARD_TICK_HZ / 1000)
#define BOUNCES 8

/* A platform behind a belt with play, a switch over its mark that bounces, an arm that comes up. All in steps. */
struct plant {
    struct motion motion;
    struct homing homing;
    struct step_board board;
    struct lumi_rig rig;
    double turn, start, play, mark, width, hysteresis, wound_below, bounce;
    double platform;
    bool closed; /* the switch, without its bouncing */
    bool stuck_open, stuck_closed;
    uint64_t edges[BOUNCES]; /* of the bounce going on; each flips the switch */
    int edge, edge_count;
    uint64_t seed, halt_at;
    double slack_above, slack_below; /* the string is slack in between */
};

static uint64_t random_below(struct plant *p, uint64_t n)
{
    p->seed = p->seed * 6364136223846793005u + 1442695040888963407u;
    return (p->seed >> 33) % n;
}

static void input(struct plant *p, enum board_input in, bool active, uint64_t at)
{
    if (p->board.inputs[in] == active)
        return;
    p->board.inputs[in] = active;
    homing_on_input(&p->homing, in, active, at);
}

static double motor(const struct plant *p)
{
    return p->start + (double)p->board.steps;
}

/* Where the platform is follows from where the motor was; what the switches say from where the platform is. */
static void follow(struct step_board *board)
{
    struct plant *p = board->context;
    double m = motor(p);

    p->platform = fmin(fmax(p->platform, m - p->play), m);
    double place = p->platform - p->mark, in_turn = place - floor(place / p->turn) * p->turn;
    double h = p->closed ? p->hysteresis : 0;
    bool closed = (in_turn < p->width + h || in_turn >= p->turn - h || p->stuck_closed) && !p->stuck_open;
    if (closed != p->closed) {
        p->closed = closed;
        /* An odd number of edges, the first at once. */
        p->edge = 0;
        p->edge_count = p->bounce > 0 ? 1 + 2 * (int)random_below(p, BOUNCES / 2) : 1;
        p->edges[0] = board->now;
        for (int i = 1; i < p->edge_count; i++)
            p->edges[i] = p->edges[i - 1] + 1 + random_below(p, (uint64_t)(p->bounce * BOARD_TICK_HZ) / BOUNCES);
    }
    input(p, BOARD_IN_WOUND, p->platform < p->wound_below, board->now);
    board->inputs[BOARD_IN_SLACK] = m > p->slack_above && m < p->slack_below;
}

static void advance(struct plant *p, uint64_t to)
{
    struct step_board *b = &p->board;

    for (;;) {
        uint64_t pulse = b->stepping && b->next <= to ? b->next : BOARD_NEVER;
        uint64_t edge = p->edge < p->edge_count && p->edges[p->edge] <= to ? p->edges[p->edge] : BOARD_NEVER;
        if (pulse == BOARD_NEVER && edge == BOARD_NEVER)
            break;
        if (edge <= pulse) {
            p->edge++;
            input(p, BOARD_IN_INDEX, !b->inputs[BOARD_IN_INDEX], edge);
        } else {
            step_board_pulse(b);
        }
    }
    b->now = to;
}

static struct plant *plant_new(const char *name, double start)
{
    struct plant *p = calloc(1, sizeof *p);
    struct lumi_error error;

    assert_non_null(p);
    assert_int_equal(lumi_rig_builtin(name, &p->rig, &error), LUMI_OK);
    step_board_init(&p->board, &p->motion);
    p->board.on_pulse = follow;
    p->board.context = p;
    homing_init(&p->homing, &p->board.board);
    p->turn = lumi_rig_steps_per_turn(&p->rig);
    p->start = p->platform = floor(start);
    p->width = p->turn / 60;
    p->hysteresis = p->turn / 720;
    p->play = p->rig.control.motion.backlash / (2 * LUMI_PI) * p->turn * 0.87;
    p->wound_below = p->slack_above = -INFINITY;
    p->slack_below = -INFINITY;
    p->bounce = 0.004;
    p->seed = (uint64_t)(start * 977);
    p->rig.control.safety.wound_fitted = false;
    p->rig.control.safety.slack_fitted = false;
    return p;
}

static void plant_free(struct plant *p)
{
    assert_int_equal(p->board.locks, 0);
    step_board_finish(&p->board);
    free(p);
}

static enum homing_result home(struct plant *p, enum homing_goal goal, int turn, const char **reason)
{
    enum homing_result result;

    follow(&p->board); /* what the switches say to begin with */
    advance(p, p->board.now + 50 * MS);
    homing_start(&p->homing, &p->motion, &p->rig, goal, turn);
    assert_true(homing_active(&p->homing));
    for (;;) {
        motion_poll(&p->motion);
        result = homing_poll(&p->homing, reason);
        if (result != HOMING_RUNNING)
            break;
        assert_true(p->board.now < (uint64_t)3600 * BOARD_TICK_HZ);
        if (p->homing.phase == HOMING_APPROACH) {
            double slow = p->rig.control.motion.home_speed / 4 / (2 * LUMI_PI) * p->turn;
            double speed = motion_speed(&p->motion, p->board.now);
            assert_true(speed >= 0 && speed <= slow * 1.000001);
        }
        if (p->halt_at && p->board.now >= p->halt_at)
            motion_halt(&p->motion);
        advance(p, p->board.now + MS + random_below(p, MS));
    }
    assert_false(homing_active(&p->homing));
    assert_false(motion_moving(&p->motion));
    assert_false(motion_starved(&p->motion));
    return result;
}

static void assert_home(struct plant *p, enum homing_goal goal, int turn, double mark_turn, int as_turn)
{
    const char *reason;

    if (home(p, goal, turn, &reason) != HOMING_DONE)
        fail_msg("from %g: %s", p->start, reason);
    assert_true(motion_known(&p->motion));
    /* The first step at which the platform, the play taken up, is on the mark. */
    double first = ceil(p->mark + mark_turn * p->turn + p->play);
    int64_t wanted = lumi_rig_position_step(&p->rig, as_turn * p->rig.positions);
    assert_int_equal(motion_position(&p->motion) - wanted, (int64_t)(motor(p) - first));
}

static void assert_fails(struct plant *p, enum homing_goal goal, const char *text)
{
    const char *reason = "";

    assert_int_equal(home(p, goal, 0, &reason), HOMING_FAILED);
    assert_string_equal(reason, text);
    assert_false(motion_known(&p->motion));
}

static void the_mark_is_found_to_the_step_from_anywhere(void **state)
{
    (void)state;
    for (int i = 0; i < 36; i++) {
        struct plant *p = plant_new("arc16", (i + 0.37) * 800);
        /* Where the platform stands on the mark or on its rim, it is the same turn. */
        assert_home(p, HOMING_INDEX, 0, 0, 0);
        /* And again, from where it now is: the same step. */
        int64_t steps = p->board.steps, position = motion_position(&p->motion);
        const char *reason;
        assert_int_equal(home(p, HOMING_INDEX, 0, &reason), HOMING_DONE);
        assert_int_equal(motion_position(&p->motion) - position, p->board.steps - steps);
        plant_free(p);
    }
}

static void it_may_stand_on_the_mark_or_at_its_rims(void **state)
{
    (void)state;
    for (int i = 0; i <= 560; i += 7) {
        struct plant *p = plant_new("arc16", i);
        p->platform = i - p->play / 2;
        if (p->platform >= 0) /* or it stands in the turn before */
            assert_home(p, HOMING_INDEX, 0, 0, 0);
        plant_free(p);
    }
}

static void the_turn_is_the_one_it_stands_in_and_the_operator_says_which(void **state)
{
    (void)state;
    struct plant *p = plant_new("bar2", 28800 * 0.4);

    assert_home(p, HOMING_INDEX, 7, 0, 7);
    plant_free(p);
    p = plant_new("bar2", -300); /* before turn 0 */
    const char *reason;
    assert_int_equal(home(p, HOMING_INDEX, -1, &reason), HOMING_DONE);
    assert_int_equal(motion_position(&p->motion), (int64_t)(motor(p) - ceil(p->play)));
    plant_free(p);
    p = plant_new("bar2", 28800 * 0.4);
    p->rig.gear_motor = 91; /* turns of steps and a fraction */
    p->rig.gear_platform = 9;
    p->turn = lumi_rig_steps_per_turn(&p->rig);
    assert_home(p, HOMING_INDEX, 5, 0, 5);
    plant_free(p);
}

static void a_bounce_of_any_length_up_to_the_debouncing_does_not_move_the_mark(void **state)
{
    (void)state;
    for (int i = 0; i <= 20; i++) {
        struct plant *p = plant_new("arc16", 12345 + i);
        p->bounce = i * 0.001; /* 8 edges in up to 20 ms: less than 5 ms between two */
        assert_home(p, HOMING_INDEX, 0, 0, 0);
        plant_free(p);
    }
}

static void winding_up_finds_turn_0(void **state)
{
    (void)state;
    static const double starts[] = {17.3, 17.99, 5, 0.5, 0.1, 0.01, 0, -0.05, -0.1, -0.24};
    for (size_t i = 0; i < sizeof starts / sizeof *starts; i++) {
        struct plant *p = plant_new("bar2", starts[i] * 28800);
        p->rig.control.safety.wound_fitted = true;
        p->wound_below = -0.15 * 28800;
        assert_home(p, HOMING_WOUND, 9, 0, 0);
        plant_free(p);
    }
}

static void an_arm_that_is_up_before_a_mark_comes_stands_before_turn_0(void **state)
{
    (void)state;
    struct plant *p = plant_new("bar2", -500);

    p->rig.control.safety.wound_fitted = true;
    p->wound_below = -0.15 * 28800;
    assert_home(p, HOMING_INDEX, 4, 0, 0);
    plant_free(p);
}

static void what_cannot_be_found_is_said(void **state)
{
    (void)state;
    struct plant *p = plant_new("arc16", 5000);

    p->stuck_open = true;
    assert_fails(p, HOMING_INDEX, "homing: no index mark within a turn and a tenth");
    assert_true(fabs(motor(p) - 5000) < 1.2 * p->turn);
    plant_free(p);

    p = plant_new("arc16", 5000);
    p->stuck_closed = true;
    assert_fails(p, HOMING_INDEX, "homing: the index switch does not open within half a turn");
    assert_true(fabs(motor(p) - 5000) < 0.6 * p->turn);
    plant_free(p);

    p = plant_new("bar2", 28800 * 3);
    assert_fails(p, HOMING_WOUND, "homing: the profile has no switch for the arm's upper end");
    assert_int_equal(p->board.steps, 0);
    p->rig.control.safety.wound_fitted = true;
    assert_fails(p, HOMING_WOUND, "homing: the arm did not come up, its switch never closed");
    double string = fmax(p->rig.turns, p->rig.string.length / p->rig.string.per_turn);
    assert_true(-(double)p->board.steps <= (string + 1.1) * 28800);
    plant_free(p);

    p = plant_new("bar2", 0.5 * 28800);
    p->rig.control.safety.wound_fitted = true;
    p->wound_below = 5000; /* on the mark */
    p->width = 9000;
    assert_fails(p, HOMING_WOUND,
                 "homing: the arm is up while the index switch is closed: one of the two must be moved");
    plant_free(p);
}

static void a_string_that_stays_slack_fails_it(void **state)
{
    (void)state;
    struct plant *p = plant_new("bar2", 5 * 28800);

    p->rig.control.safety.wound_fitted = p->rig.control.safety.slack_fitted = true;
    p->wound_below = -0.15 * 28800;
    p->slack_above = 0;
    p->slack_below = 4 * 28800;
    assert_fails(p, HOMING_WOUND, "homing: the string is slack while it is wound up");
    assert_true(motor(p) > 3.5 * 28800);
    plant_free(p);

    /* Loose from the start, and tight after half a turn. */
    p = plant_new("bar2", 5 * 28800);
    p->rig.control.safety.wound_fitted = p->rig.control.safety.slack_fitted = true;
    p->wound_below = -0.15 * 28800;
    p->slack_above = 4.5 * 28800;
    p->slack_below = 10 * 28800;
    assert_home(p, HOMING_WOUND, 0, 0, 0);
    plant_free(p);
}

static void a_halt_ends_it_and_nothing_is_known(void **state)
{
    (void)state;
    /* In every phase: after so many milliseconds. */
    for (uint64_t ms = 60; ms < 8000; ms += 211) {
        struct plant *p = plant_new("arc16", 4000);
        const char *reason = "";
        p->halt_at = ms * MS;
        if (home(p, HOMING_INDEX, 0, &reason) == HOMING_FAILED) {
            assert_string_equal(reason, "homing: the motor was halted");
            assert_false(motion_known(&p->motion));
            int64_t steps = p->board.steps;
            advance(p, p->board.now + BOARD_TICK_HZ);
            assert_int_equal(p->board.steps, steps);
            /* Latched: it does not home either before it is released. */
            assert_fails(p, HOMING_INDEX, "homing: the motor was halted");
            p->halt_at = 0;
            motion_release(&p->motion);
            assert_home(p, HOMING_INDEX, 0, p->platform >= 0 || p->closed ? 0 : -1, 0);
        } else {
            assert_true(ms > 5000);
        }
        plant_free(p);
    }
}

static void cancelling_it_slows_down_and_forgets(void **state)
{
    (void)state;
    struct plant *p = plant_new("arc16", 9000);

    follow(&p->board);
    homing_start(&p->homing, &p->motion, &p->rig, HOMING_INDEX, 0);
    for (int i = 0; i < 500; i++) {
        const char *reason;
        motion_poll(&p->motion);
        homing_poll(&p->homing, &reason);
        advance(p, p->board.now + MS);
    }
    assert_true(motion_moving(&p->motion));
    homing_cancel(&p->homing);
    assert_false(homing_active(&p->homing));
    for (int i = 0; i < 1000; i++) {
        motion_poll(&p->motion);
        advance(p, p->board.now + MS);
    }
    assert_false(motion_moving(&p->motion));
    assert_false(motion_starved(&p->motion));
    assert_false(motion_known(&p->motion));
    plant_free(p);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_mark_is_found_to_the_step_from_anywhere),
        cmocka_unit_test(it_may_stand_on_the_mark_or_at_its_rims),
        cmocka_unit_test(the_turn_is_the_one_it_stands_in_and_the_operator_says_which),
        cmocka_unit_test(a_bounce_of_any_length_up_to_the_debouncing_does_not_move_the_mark),
        cmocka_unit_test(winding_up_finds_turn_0),
        cmocka_unit_test(an_arm_that_is_up_before_a_mark_comes_stands_before_turn_0),
        cmocka_unit_test(what_cannot_be_found_is_said),
        cmocka_unit_test(a_string_that_stays_slack_fails_it),
        cmocka_unit_test(a_halt_ends_it_and_nothing_is_known),
        cmocka_unit_test(cancelling_it_slows_down_and_forgets),
    };

    return cmocka_run_group_tests_name("homing", tests, NULL, NULL);
}
