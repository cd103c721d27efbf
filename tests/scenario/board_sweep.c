/* The bytes that are flashed, run unchanged on the emulated STM32F405 in a simulated rig: commands over both links,
 * a sweep whose pulses on the pins are held against its plan, an emergency stop, and power that goes in a write. */
#include "board_fixture.h"
#include "board_interrupts.h"

#include "proto/mechanism/kinematics.h"

#define CYCLES_OF_NS(ns) ((double)(ns)*0.168)

struct figures {
    double values[16384];
    int count;
};

static int compare(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Microseconds; returns the largest absolute value. */
static double print_figures(const char *name, struct figures *f)
{
    qsort(f->values, (size_t)f->count, sizeof *f->values, compare);
    const double *v = f->values;
    int n = f->count;
    printf("%-26s n %5d  min %7.3f  p1 %7.3f  median %7.3f  p99 %7.3f  max %7.3f us\n", name, n, v[0], v[n / 100],
           v[n / 2], v[n - 1 - n / 100], v[n - 1]);
    return fmax(fabs(v[0]), fabs(v[n - 1]));
}

/* Where the motor's field is at cycle `at`, in steps: whole ones at the rising edges, between two of them in
 * proportion.
 */
static double step_at(const struct f405_machine_edge *edges, int count, double begin, double at)
{
    double position = begin;
    int i = 0;
    while (i < count && (double)edges[i].at <= at)
        position += edges[i++].lines ? 1 : -1;
    if (i == 0 || i == count)
        return position;
    double share = (at - (double)edges[i - 1].at) / (double)(edges[i].at - edges[i - 1].at);
    return position + (edges[i].lines ? share : -share);
}

static int rises(const struct f405_machine_edge *edges, int count, int line, uint64_t *at, int most)
{
    int n = 0;
    unsigned before = 0;
    for (int i = 0; i < count; i++) {
        if (edges[i].lines >> line & 1 && !(before >> line & 1) && n < most)
            at[n++] = edges[i].at;
        before = edges[i].lines;
    }
    return n;
}

/* The board counts from when it started its clock; cycles of that, by the first edge it reported. */
static double clock_origin(struct board_fixture *f, const lumi_wire_Shot *shot)
{
    uint64_t edge[64];
    int count;
    const struct f405_machine_edge *trigger = f405_machine_triggers(f->machine, &count);
    assert_true(rises(trigger, count, f->rig.control.triggers[0].channel, edge, 64) > 0);
    return (double)edge[0] - CYCLES_OF_NS((double)shot->middle_ns + (double)shot->edge_ns[0]);
}

struct judged {
    struct figures planned, reported, place;
    double origin;
};

static void judge_shot(struct board_fixture *f, const lumi_wire_Shot *s, int camera, uint64_t edge, int64_t begin,
                       struct judged *j)
{
    const struct lumi_rig_trigger *wiring = &f->rig.control.triggers[camera];
    double middle = CYCLES_OF_NS(s->middle_ns) + j->origin;
    double lead = (f->plan.exposures[0] / 2 + wiring->shutter_lag) * F405_HZ;
    int steps;
    const struct f405_machine_edge *step = f405_machine_steps(f->machine, &steps);
    j->planned.values[j->planned.count++] = ((double)edge - (middle - lead)) / 168;
    j->reported.values[j->reported.count++] = ((double)edge - middle - CYCLES_OF_NS(s->edge_ns[camera])) / 168;
    if (camera == 0)
        j->place.values[j->place.count++] = step_at(step, steps, (double)begin, middle) -
                                            (double)lumi_plan_position_step(&f->plan, &f->rig, (int)s->number);
}

/* Every line rose once a position, so that the exposure's middle falls on its step, and as the events say. */
static void judge_triggers(struct board_fixture *f, int64_t begin, int from_event)
{
    static struct judged j;
    int triggers, events;
    const struct f405_machine_edge *trigger = f405_machine_triggers(f->machine, &triggers);
    const lumi_wire_Event *event = board_client_events(f->client, &events);
    memset(&j, 0, sizeof j);
    for (int camera = 0; camera < f->rig.camera_count; camera++) {
        uint64_t edge[64];
        uint32_t shot = 0;
        int n = rises(trigger, triggers, f->rig.control.triggers[camera].channel, edge, 64);
        assert_int_equal(n, f->plan.positions);
        for (int i = from_event; i < events; i++) {
            if (event[i].which_kind != lumi_wire_Event_shot_tag)
                continue;
            const lumi_wire_Shot *s = &event[i].kind.shot;
            assert_int_equal(s->number, shot);
            assert_false(s->lost);
            if (j.origin == 0)
                j.origin = clock_origin(f, s);
            judge_shot(f, s, camera, edge[shot], begin, &j);
            shot++;
        }
        assert_int_equal(shot, f->plan.positions);
    }
    assert_true(j.origin > 0 && j.origin < 0.01 * F405_HZ);
    assert_true(print_figures("trigger less plan", &j.planned) < 1);
    assert_true(print_figures("trigger less event", &j.reported) < 1);
    for (int i = 0; i < j.place.count; i++)
        assert_true(fabs(j.place.values[i]) < 1);
}

/* In the cruise between the first and the last shot the steps come at even distances. */
static void judge_steps(struct board_fixture *f, int64_t begin, int64_t end, uint64_t first, uint64_t last)
{
    static struct figures jitter;
    int count;
    int64_t position = begin;
    const struct f405_machine_edge *edge = f405_machine_steps(f->machine, &count);
    double period = f->plan.turn_time * F405_HZ / lumi_rig_steps_per_turn(&f->rig);
    uint64_t origin = 0;
    int since = 0;
    jitter.count = 0;
    for (int i = 0; i < count; i++) {
        position += edge[i].lines ? 1 : -1;
        if (edge[i].at < first || edge[i].at > last)
            continue;
        if (!origin)
            origin = edge[i].at;
        else
            jitter.values[jitter.count++] = ((double)(edge[i].at - origin) - ++since * period) / 168;
    }
    assert_true(position == end);
    assert_true(jitter.count > 100);
    assert_true(print_figures("step less even distance", &jitter) < 1);
}

static void sweep(struct board_fixture *f)
{
    lumi_wire_SweepEnded ended;
    int from, count;
    BOARD_OK(board_client_load_plan(f->client, &f->plan, error));
    f405_clear_stats(f405_machine_chip(f->machine)); /* the profile is in flash: an erase holds every interrupt off */
    lumi_wire_Status before = board_fixture_status(f);
    f405_machine_forget_edges(f->machine);
    board_client_events(f->client, &from);
    BOARD_OK(board_client_start(f->client, &f->plan, 0, false, error));
    BOARD_OK(board_client_wait_sweep(f->client, 60, &ended, error));
    if (ended.how != lumi_wire_SweepEnded_How_COMPLETE)
        board_fixture_tell(f);
    assert_int_equal(ended.how, lumi_wire_SweepEnded_How_COMPLETE);
    assert_int_equal(ended.fired, f->plan.positions);
    assert_int_equal(ended.lost, 0);
    lumi_wire_Status after = board_fixture_status(f);
    judge_triggers(f, before.step, from);
    const struct f405_machine_edge *trigger = f405_machine_triggers(f->machine, &count);
    judge_steps(f, before.step, after.step, trigger[0].at, trigger[count - 1].at);
    sim_mechanics_exposures(f405_machine_mechanics(f->machine), &count);
    assert_int_equal(count, f->plan.positions * f->rig.camera_count);
    board_print_interrupts(f405_machine_chip(f->machine));
}

static void a_board_is_configured_homed_and_sweeps_over_its_serial_line(void **state)
{
    struct board_fixture f;
    (void)state;
    board_fixture_init(&f);
    board_fixture_connect(&f, BOARD_LINK_SERIAL);
    lumi_wire_Status status = board_fixture_status(&f);
    assert_int_equal(status.state, lumi_wire_State_NO_PROFILE);
    assert_true(abs((int)status.supply_mv - 24000) < 200);
    assert_string_equal(board_client_wire(f.client)->welcome.board, "stm32f405");
    f405_uart_break(f405_machine_chip(f.machine), 2); /* a byte is damaged on the line */
    BOARD_OK(board_client_configure(f.client, &f.rig, error));
    assert_int_equal(board_fixture_status(&f).state, lumi_wire_State_LOST);
    BOARD_OK(board_client_home(f.client, false, 0, error));
    assert_int_equal(board_fixture_status(&f).state, lumi_wire_State_IDLE);
    sweep(&f);
    board_fixture_finish(&f);
}

static void and_over_usb(void **state)
{
    struct board_fixture f;
    (void)state;
    board_fixture_init(&f);
    board_fixture_connect(&f, BOARD_LINK_USB);
    BOARD_OK(board_client_configure(f.client, &f.rig, error));
    BOARD_OK(board_client_home(f.client, false, 0, error));
    sweep(&f);
    assert_int_equal(board_client_events_lost(f.client), 0);
    board_fixture_finish(&f);
}

static bool has_fault(struct board_fixture *f)
{
    return board_fixture_status(f).faults != 0;
}

static void an_emergency_stop_ends_the_steps_at_once_and_the_sweep_goes_on_after_it(void **state)
{
    struct board_fixture f;
    lumi_wire_SweepEnded ended;
    lumi_wire_Status status;
    int count;
    (void)state;
    board_fixture_init(&f);
    board_fixture_connect(&f, BOARD_LINK_USB);
    struct sim_mechanics *mechanics = f405_machine_mechanics(f.machine);
    BOARD_OK(board_client_configure(f.client, &f.rig, error));
    f405_clear_stats(f405_machine_chip(f.machine));
    BOARD_OK(board_client_home(f.client, false, 0, error));
    BOARD_OK(board_client_load_plan(f.client, &f.plan, error));
    BOARD_OK(board_client_start(f.client, &f.plan, 0, false, error));
    BOARD_OK(board_client_run(f.client, 3, error));
    f405_machine_forget_edges(f.machine);
    BOARD_OK(board_client_run(f.client, 0.1, error));
    f405_machine_steps(f.machine, &count);
    assert_true(count > 10);
    sim_mechanics_force_input(mechanics, BOARD_IN_ESTOP, SIM_FORCE_ACTIVE);
    uint64_t pressed = f405_machine_now(f.machine);
    BOARD_OK(board_client_run(f.client, 1, error));
    const struct f405_machine_edge *edge = f405_machine_steps(f.machine, &count);
    assert_true(edge[count - 1].at < pressed + F405_HZ / 100000); /* 10 us: less than a step */
    const struct f405_exception_stats *estop = f405_stats(f405_machine_chip(f.machine), 16 + 6);
    printf("emergency stop: taken after %llu cycles, %u instructions; last step %.3f us after the press\n",
           (unsigned long long)estop->latency_max, estop->instructions_max,
           ((double)edge[count - 1].at - (double)pressed) / 168);
    assert_true(estop->latency_max < F405_HZ / 1000000);
    assert_true(has_fault(&f));
    assert_false(sim_mechanics_falling(mechanics));
    struct lumi_error refusal;
    assert_int_not_equal(board_client_start(f.client, &f.plan, 0, true, &refusal), LUMI_OK);
    assert_int_not_equal(board_client_clear(f.client, &refusal), LUMI_OK); /* it is still pressed */
    sim_mechanics_force_input(mechanics, BOARD_IN_ESTOP, SIM_FORCE_NONE);
    BOARD_OK(board_client_run(f.client, 0.5, error));
    BOARD_OK(board_client_clear(f.client, error));
    status = board_fixture_status(&f);
    assert_int_equal(status.faults, 0);
    assert_false(status.position_known); /* it was stopped while moving */
    BOARD_OK(board_client_home(f.client, false, 0, error));
    BOARD_OK(board_client_start(f.client, &f.plan, 0, true, error));
    BOARD_OK(board_client_wait_sweep(f.client, 60, &ended, error));
    assert_int_equal(ended.how, lumi_wire_SweepEnded_How_COMPLETE);
    status = board_fixture_status(&f);
    assert_int_equal(status.shots_fired, f.plan.positions);
    assert_int_equal(status.shots_lost, 0);
    board_print_interrupts(f405_machine_chip(f.machine));
    board_fixture_finish(&f);
}

static void power_that_goes_in_a_flash_write_leaves_the_old_profile(void **state)
{
    static const unsigned operations[] = {1, 2, 100};
    struct board_fixture f;
    (void)state;
    board_fixture_init(&f);
    board_fixture_connect(&f, BOARD_LINK_SERIAL);
    BOARD_OK(board_client_configure(f.client, &f.rig, error));
    uint32_t old = board_fixture_status(&f).profile_crc;
    assert_int_not_equal(old, 0);
    struct lumi_rig other = f.rig;
    other.control.motion.backlash *= 1.5;
    for (size_t i = 0; i < sizeof operations / sizeof *operations; i++) {
        struct lumi_error refusal;
        f405_machine_power_cut_in_flash(f.machine, operations[i]);
        assert_int_not_equal(board_client_configure(f.client, &other, &refusal), LUMI_OK);
        assert_null(f405_fault(f405_machine_chip(f.machine)));
        f405_machine_power(f.machine, true);
        assert_int_equal(board_fixture_status(&f).profile_crc, old);
    }
    BOARD_OK(board_client_configure(f.client, &other, error));
    assert_int_not_equal(board_fixture_status(&f).profile_crc, old);
    board_fixture_finish(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_board_is_configured_homed_and_sweeps_over_its_serial_line),
        cmocka_unit_test(and_over_usb),
        cmocka_unit_test(an_emergency_stop_ends_the_steps_at_once_and_the_sweep_goes_on_after_it),
        cmocka_unit_test(power_that_goes_in_a_flash_write_leaves_the_old_profile),
    };
    return board_image_is_there() ? cmocka_run_group_tests(tests, NULL, NULL) : 77;
}
