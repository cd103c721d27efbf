/* Firing on a port of a few lines: which pattern is out when, what becomes of a shot, and the lamp's code. */
#include "firmware/core/firing_state.h"
#include "firmware/core/lamp.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#define MS (BOARD_TICK_HZ / 1000)

struct port {
    uint64_t now, at, late;
    bool pending, lamp;
    uint16_t wanted, lines;
    struct {
        uint64_t at;
        uint16_t lines;
    } out[256];
    int out_count;
    struct shot_record records[32];
    int record_count;
    struct {
        int input;
        bool active;
        uint32_t shot;
    } stamps[8];
    int stamp_count;
    int stop_at; /* everything is stopped by an interrupt just before so many locks more; 0: never */
    struct board board;
    struct firing firing;
    struct firing_edge edges[FIRING_EDGES];
    struct lumi_rig rig;
    struct lumi_plan plan;
};

static uint64_t port_now(void *port)
{
    return ((struct port *)port)->now;
}

static unsigned port_lock(void *port)
{
    struct port *p = port;

    if (p->stop_at > 0 && --p->stop_at == 0)
        firing_stop(&p->firing, false);
    return 0;
}

static void port_unlock(void *port, unsigned state)
{
    (void)port;
    (void)state;
}

static void put_out(struct port *p, uint16_t lines)
{
    if (lines == p->lines)
        return;
    p->lines = lines;
    assert_true(p->out_count < 256);
    p->out[p->out_count].at = p->now;
    p->out[p->out_count++].lines = lines;
}

static void port_trigger_at(void *port, uint64_t at, uint16_t lines)
{
    struct port *p = port;

    assert_false(p->pending); /* one at a time */
    p->pending = true;
    p->at = at;
    p->wanted = lines;
}

static void port_trigger_cancel(void *port)
{
    ((struct port *)port)->pending = false;
}

static void port_trigger_lines(void *port, uint16_t lines)
{
    put_out(port, lines);
}

static void port_output(void *port, enum board_output output, bool active)
{
    assert_int_equal(output, BOARD_OUT_LAMP);
    ((struct port *)port)->lamp = active;
}

static void told(void *context, const struct shot_record *record)
{
    struct port *p = context;

    p->records[p->record_count++ % 32] = *record;
}

static void told_edge(void *context, int input, bool active, uint64_t at, uint32_t shot)
{
    struct port *p = context;

    (void)at;
    p->stamps[p->stamp_count].input = input;
    p->stamps[p->stamp_count].active = active;
    p->stamps[p->stamp_count++].shot = shot;
}

/* `cameras` of them, camera i on channel i: no lag, 20 ms pulse, 50 ms busy, exposures of 10 ms. */
static void begin(struct port *p, int cameras)
{
    memset(p, 0, sizeof *p);
    p->now = 1000 * MS;
    p->board = (struct board){.port = p,
                              .now = port_now,
                              .lock = port_lock,
                              .unlock = port_unlock,
                              .trigger_at = port_trigger_at,
                              .trigger_cancel = port_trigger_cancel,
                              .trigger_lines = port_trigger_lines,
                              .output = port_output};
    assert_int_equal(lumi_rig_builtin("arc16", &p->rig, NULL), LUMI_OK);
    for (int i = 0; i < LUMI_RIG_CHANNELS; i++)
        p->rig.control.triggers[i] = (struct lumi_rig_trigger){
            .channel = i < cameras ? i : -1, .pulse = 0.02, .busy = 0.05, .focus_channel = -1, .feedback = -1};
    lumi_plan_init(&p->plan, &p->rig);
    p->plan.exposures[0] = 0.01;
    firing_init(&p->firing, &p->board, p->edges, told, told_edge, p);
    firing_begin(&p->firing, &p->rig, &p->plan);
}

static void run(struct port *p, uint64_t to)
{
    while (p->pending && p->at + p->late <= to) {
        p->now = p->at + p->late > p->now ? p->at + p->late : p->now;
        p->pending = false;
        put_out(p, p->wanted);
        firing_on_trigger(&p->firing, p->now);
        firing_poll(&p->firing);
    }
    p->now = to;
    firing_poll(&p->firing);
}

static void edges_at_one_tick_are_one_pattern(void **state)
{
    struct port p;

    (void)state;
    begin(&p, 16);
    uint64_t middle = p.now + 100 * MS;
    assert_true(firing_shoot(&p.firing, 0, 0, middle, 12.5));
    assert_int_equal(p.firing.edge_count, 2);
    run(&p, middle + 100 * MS);
    assert_int_equal(p.out_count, 2);
    assert_int_equal(p.out[0].at, middle - 5 * MS);
    assert_int_equal(p.out[0].lines, 0xffff);
    assert_int_equal(p.out[1].at, middle + 15 * MS);
    assert_int_equal(p.out[1].lines, 0);
    assert_int_equal(p.record_count, 1);
    assert_int_equal(p.records[0].state, SHOT_FIRED);
    assert_int_equal(p.records[0].lines, 0xffff);
    assert_true(p.records[0].position == 12.5);
    for (int i = 0; i < 16; i++)
        assert_true(p.records[0].edge[i] == -5 * (int64_t)MS);
    assert_int_equal(firing_state(&p.firing, 0), SHOT_FIRED);
}

static void each_camera_gets_its_lag_and_focus(void **state)
{
    struct port p;

    (void)state;
    begin(&p, 3);
    p.rig.control.triggers[1].shutter_lag = 0.03;
    p.rig.control.triggers[2].shutter_lag = 0.06;
    p.rig.control.triggers[2].focus_channel = 9;
    p.rig.control.triggers[2].focus_lead = 0.2;
    firing_begin(&p.firing, &p.rig, &p.plan);
    assert_int_equal(firing_lead(&p.firing, 0), (60 + 200 + 5) * MS + FIRING_MARGIN_TICKS);
    uint64_t middle = p.now + 400 * MS, begun = middle - 5 * MS;
    assert_true(firing_shoot(&p.firing, 7, 0, middle, 0));
    run(&p, middle + 100 * MS);
    const struct {
        uint64_t at;
        uint16_t lines;
    } want[] = {{begun - 260 * MS, 0x200}, {begun - 60 * MS, 0x204}, {begun - 40 * MS, 0x000}, {begun - 30 * MS, 0x002},
                {begun - 10 * MS, 0x000},  {begun, 0x001},           {begun + 20 * MS, 0x000}};
    assert_int_equal(p.out_count, 7);
    for (int i = 0; i < 7; i++) {
        assert_int_equal(p.out[i].at, want[i].at);
        assert_int_equal(p.out[i].lines, want[i].lines);
    }
    assert_int_equal(p.records[0].state, SHOT_FIRED);
    assert_int_equal(p.records[0].cameras, 7);
    assert_true(p.records[0].edge[2] == -65 * (int64_t)MS);
}

static void lines_of_two_shots_overlap(void **state)
{
    struct port p;

    (void)state;
    begin(&p, 2);
    /* Camera 1's lines for a shot are up while camera 0's for the shot before are. */
    p.rig.control.triggers[1].shutter_lag = 0.3;
    p.rig.control.triggers[1].focus_channel = 15;
    p.rig.control.triggers[1].focus_lead = 0.25;
    firing_begin(&p.firing, &p.rig, &p.plan);
    uint64_t middle = p.now + 600 * MS, rises[3][3] = {{0}};
    for (uint32_t i = 0; i < 3; i++)
        assert_true(firing_shoot(&p.firing, i, 0, middle + i * 400 * MS, 0));
    run(&p, middle + 1200 * MS);
    const int lines[] = {0, 1, 15};
    for (int k = 0; k < 3; k++) {
        int risen = 0;
        for (int i = 0, before = 0; i < p.out_count; before = p.out[i++].lines)
            if (p.out[i].lines >> lines[k] & 1 && !(before >> lines[k] & 1))
                rises[k][risen++] = p.out[i].at;
        assert_int_equal(risen, 3);
    }
    for (uint64_t i = 0; i < 3; i++) {
        uint64_t begun = middle - 5 * MS + i * 400 * MS;
        assert_int_equal(rises[0][i], begun);
        assert_int_equal(rises[1][i], begun - 300 * MS);
        assert_int_equal(rises[2][i], begun - 550 * MS);
        assert_int_equal(p.records[i].number, i);
        assert_int_equal(p.records[i].state, SHOT_FIRED);
    }
    assert_int_equal(p.record_count, 3);
    assert_int_equal(p.lines, 0);
}

static void a_busy_camera_is_not_fired_at_and_the_shot_is_lost(void **state)
{
    struct port p;
    uint32_t fired, lost;

    (void)state;
    begin(&p, 2);
    p.rig.control.triggers[1].busy = 0.3;
    firing_begin(&p.firing, &p.rig, &p.plan);
    uint64_t middle = p.now + 100 * MS;
    assert_true(firing_shoot(&p.firing, 0, 0, middle, 0));
    assert_true(firing_shoot(&p.firing, 1, 0, middle + 309 * MS, 0));
    assert_int_equal(p.record_count, 1);
    assert_int_equal(p.records[0].number, 1);
    assert_int_equal(p.records[0].state, SHOT_LOST);
    assert_int_equal(p.records[0].cameras, 0);
    assert_true(firing_shoot(&p.firing, 2, 0, middle + 310 * MS, 0));
    assert_true(firing_spacing(&p.firing, 0, 0, 0) == 310 * MS);
    run(&p, middle + 600 * MS);
    assert_int_equal(p.out_count, 4);
    firing_count(&p.firing, &fired, &lost);
    assert_int_equal(fired, 2);
    assert_int_equal(lost, 1);
    assert_int_equal(firing_next_planned(&p.firing), 3);
}

static void what_comes_too_near_is_lost_and_a_full_queue_asks_again(void **state)
{
    struct port p;
    uint32_t number = 1;

    (void)state;
    begin(&p, 16);
    assert_true(firing_shoot(&p.firing, 0, 0, p.now + 5 * MS, 0));
    assert_int_equal(p.records[0].state, SHOT_LOST);
    assert_int_equal(p.out_count, 0);
    while (firing_shoot(&p.firing, number, 0, p.now + number * 100 * MS, 0))
        number++;
    assert_int_equal(number, 1 + FIRING_SLOTS);
    assert_true(firing_pending(&p.firing, 1));
    assert_int_equal(firing_state(&p.firing, number), SHOT_PLANNED);
    run(&p, p.now + 150 * MS);
    assert_true(firing_shoot(&p.firing, number, 0, p.now + 700 * MS, 0));
}

static void a_late_edge_loses_its_shot(void **state)
{
    struct port p;

    (void)state;
    begin(&p, 4);
    p.late = FIRING_LATE_TICKS;
    assert_true(firing_shoot(&p.firing, 0, 0, p.now + 100 * MS, 0));
    run(&p, p.now + 300 * MS);
    p.late = FIRING_LATE_TICKS + 1;
    assert_true(firing_shoot(&p.firing, 1, 0, p.now + 100 * MS, 0));
    run(&p, p.now + 300 * MS);
    assert_int_equal(p.record_count, 2);
    assert_int_equal(p.records[0].state, SHOT_FIRED);
    assert_int_equal(p.records[1].state, SHOT_LOST);
    assert_int_equal(p.records[1].cameras, 0xf);
}

static void stopping_finishes_what_has_begun_and_plans_the_rest_again(void **state)
{
    struct port p;

    (void)state;
    begin(&p, 2);
    p.rig.control.triggers[1].shutter_lag = 0.05;
    firing_begin(&p.firing, &p.rig, &p.plan);
    uint64_t middle = p.now + 100 * MS;
    for (uint32_t i = 0; i < 3; i++)
        assert_true(firing_shoot(&p.firing, i, 0, middle + i * 200 * MS, 0));
    run(&p, middle - 30 * MS); /* camera 1's line is up, camera 0's is not */
    assert_true(firing_begun(&p.firing, 0));
    firing_stop(&p.firing, true);
    assert_false(firing_shoot(&p.firing, 5, 0, middle + 900 * MS, 0));
    run(&p, middle + 900 * MS);
    assert_int_equal(p.record_count, 1);
    assert_int_equal(p.records[0].state, SHOT_FIRED);
    assert_int_equal(p.out_count, 4);
    assert_int_equal(firing_state(&p.firing, 1), SHOT_PLANNED);
    assert_int_equal(firing_state(&p.firing, 5), SHOT_PLANNED);
    assert_false(firing_busy_now(&p.firing));
}

static void stopping_at_once_drops_all_lines_and_tells_what_was_lost(void **state)
{
    struct port p;

    (void)state;
    begin(&p, 2);
    uint64_t middle = p.now + 100 * MS;
    assert_true(firing_shoot(&p.firing, 0, 0, middle, 0));
    assert_true(firing_shoot(&p.firing, 1, 0, middle + 200 * MS, 0));
    run(&p, middle);
    assert_int_equal(p.lines, 3);
    firing_stop(&p.firing, false);
    assert_int_equal(p.lines, 0);
    assert_false(p.pending);
    firing_poll(&p.firing);
    assert_int_equal(p.record_count, 1);
    assert_int_equal(p.records[0].number, 0);
    assert_int_equal(p.records[0].state, SHOT_LOST);
    assert_int_equal(p.records[0].cameras, 3);
    assert_int_equal(firing_state(&p.firing, 1), SHOT_PLANNED);
    run(&p, middle + 500 * MS);
    assert_int_equal(p.out_count, 2);
    /* Also between a pulse's end and its exposure's. */
    p.plan.exposures[0] = 0.5;
    firing_begin(&p.firing, &p.rig, &p.plan);
    assert_true(firing_shoot(&p.firing, 1, 0, p.now + 300 * MS, 0));
    run(&p, p.now + 200 * MS);
    assert_int_equal(p.lines, 0);
    firing_stop(&p.firing, false);
    firing_poll(&p.firing);
    assert_int_equal(p.records[1].state, SHOT_LOST);
}

/* Whatever a shot's queueing has come to: no line goes up after the stop, and the shot is planned, or lost and told. */
static void a_stop_in_the_middle_of_queueing_leaves_nothing_behind(void **state)
{
    struct port p;

    (void)state;
    for (int n = 1; n <= 8; n++) {
        begin(&p, 4);
        assert_true(firing_shoot(&p.firing, 0, 0, p.now + 100 * MS, 0));
        p.stop_at = n;
        assert_false(firing_shoot(&p.firing, 1, 0, p.now + 300 * MS, 0));
        assert_int_equal(p.stop_at, 0);
        run(&p, p.now + 1000 * MS);
        assert_int_equal(p.out_count, 0);
        assert_false(firing_busy_now(&p.firing));
        assert_int_equal(p.record_count, 0);
        assert_int_equal(firing_state(&p.firing, 0), SHOT_PLANNED);
        assert_int_equal(firing_state(&p.firing, 1), SHOT_PLANNED);
        assert_false(firing_record(&p.firing, &p.rig, 0, true, p.now + 10 * MS)); /* not before firing_release */
    }
}

static void feedback_is_stamped_and_belongs_to_its_shot(void **state)
{
    struct port p;

    (void)state;
    begin(&p, 2);
    p.rig.control.triggers[1].feedback = 3;
    firing_begin(&p.firing, &p.rig, &p.plan);
    uint64_t middle = p.now + 100 * MS;
    firing_on_feedback(&p.firing, 3, true, p.now);
    run(&p, p.now);
    assert_int_equal(p.stamps[0].shot, FIRING_NO_SHOT);
    assert_true(firing_shoot(&p.firing, 41, 0, middle, 0));
    run(&p, middle);
    firing_on_feedback(&p.firing, 3, true, middle - 5 * MS);
    firing_on_feedback(&p.firing, 3, false, middle);
    firing_on_feedback(&p.firing, 0, true, middle);
    run(&p, middle + 100 * MS);
    assert_int_equal(p.stamp_count, 4);
    assert_int_equal(p.stamps[1].shot, 41);
    assert_int_equal(p.stamps[2].shot, 41);
    assert_false(p.stamps[2].active);
    assert_int_equal(p.stamps[3].shot, FIRING_NO_SHOT); /* no camera is on input 0 */
}

static void recording_is_a_pulse_or_held(void **state)
{
    struct port p;

    (void)state;
    begin(&p, 3);
    p.rig.control.video.record_pulse = 0.1;
    assert_true(firing_record(&p.firing, &p.rig, 0x5, true, p.now + 10 * MS));
    run(&p, p.now + 200 * MS);
    assert_int_equal(p.out_count, 2);
    assert_int_equal(p.out[0].lines, 5);
    assert_int_equal(p.out[1].at - p.out[0].at, 100 * MS);
    p.rig.control.video.record_pulse = 0;
    assert_true(firing_record(&p.firing, &p.rig, 0, true, p.now + 10 * MS));
    run(&p, p.now + 200 * MS);
    assert_int_equal(p.lines, 7);
    assert_false(firing_busy_now(&p.firing));
    assert_true(firing_record(&p.firing, &p.rig, 0, false, p.now + 10 * MS));
    run(&p, p.now + 20 * MS);
    assert_int_equal(p.lines, 0);
}

static void an_exposure_of_a_minute_is_as_long(void **state)
{
    struct port p;

    (void)state;
    begin(&p, 1);
    p.rig.control.triggers[0].busy = 60;
    p.plan.exposures[0] = 60;
    firing_begin(&p.firing, &p.rig, &p.plan);
    assert_true(firing_half(&p.firing, 0) == 30000 * MS);
    assert_true(firing_spacing(&p.firing, 0, 0, 0) == 120000 * (uint64_t)MS);
}

static void the_lamp_sends_its_number_twice_over(void **state)
{
    struct port p;
    struct lamp lamp;

    (void)state;
    begin(&p, 1);
    lamp_init(&lamp, &p.board);
    assert_int_equal(lamp_next_poll(&lamp), BOARD_NEVER);
    lamp_send(&lamp, 0xa53, p.now + MS, 0.2);
    uint64_t bits = 0, begun = p.now + MS;
    for (int i = 0; i < LAMP_HALF_BITS; i++) {
        p.now = lamp_next_poll(&lamp);
        assert_int_equal(p.now, begun + (uint64_t)i * 100 * MS);
        lamp_poll(&lamp);
        bits |= (uint64_t)p.lamp << i;
    }
    p.now = lamp_next_poll(&lamp);
    lamp_poll(&lamp);
    assert_false(p.lamp);
    assert_int_equal(lamp_next_poll(&lamp), BOARD_NEVER);
    assert_true(bits == lamp_code(0xa53));
    unsigned number = 0;
    for (int i = 0; i < 16; i++) {
        unsigned pair = bits >> (1 + 2 * i) & 3;
        assert_true(pair == 1 || pair == 2);
        number = number << 1 | (pair == 1);
    }
    assert_int_equal(number >> 4, 0xa53);
    assert_int_equal(number & 0xf, 0xb); /* 0xa53 · 16 modulo x⁴ + x + 1, worked out on paper */
    for (unsigned other = 0; other < 4096; other++)
        if (other != 0xa53)
            assert_true(lamp_code(other) != bits);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(edges_at_one_tick_are_one_pattern),
        cmocka_unit_test(each_camera_gets_its_lag_and_focus),
        cmocka_unit_test(lines_of_two_shots_overlap),
        cmocka_unit_test(a_busy_camera_is_not_fired_at_and_the_shot_is_lost),
        cmocka_unit_test(what_comes_too_near_is_lost_and_a_full_queue_asks_again),
        cmocka_unit_test(a_late_edge_loses_its_shot),
        cmocka_unit_test(stopping_finishes_what_has_begun_and_plans_the_rest_again),
        cmocka_unit_test(stopping_at_once_drops_all_lines_and_tells_what_was_lost),
        cmocka_unit_test(a_stop_in_the_middle_of_queueing_leaves_nothing_behind),
        cmocka_unit_test(feedback_is_stamped_and_belongs_to_its_shot),
        cmocka_unit_test(recording_is_a_pulse_or_held),
        cmocka_unit_test(an_exposure_of_a_minute_is_as_long),
        cmocka_unit_test(the_lamp_sends_its_number_twice_over),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
