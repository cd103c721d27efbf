/* daemon/rig/drive: a drive behind libmodbus' server, RTU and TCP, and sweeps with it. */
#include "daemon/rig/drive.h"
#include "fake_board.h"
#include "fake_drive.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static struct fake_drive fake;
static struct fake_board board;
static struct lumi_drive_map map;

static struct lumi_rig_drive *start(bool tcp)
{
    struct lumi_rig_drive *drive;
    struct lumi_error error = {0};

    memset(&fake, 0, sizeof fake);
    fake.enabled = true;
    if (lumi_drive_map_parse(FAKE_DRIVE_MAP, strlen(FAKE_DRIVE_MAP), "fake.map", &map, &error))
        fail_msg("%s", error.text);
    fake_drive_start(&fake, tcp);
    if (lumi_rig_drive_open(fake.address, &map, &drive, &error))
        fail_msg("%s", error.text);
    return drive;
}

static void finish(struct lumi_rig_drive *drive)
{
    lumi_rig_drive_close(drive);
    fake_drive_stop(&fake);
}

static void goes_there(bool tcp)
{
    struct lumi_rig_drive_status status;
    struct lumi_error error = {0};
    struct lumi_rig_drive *drive = start(tcp);

    assert_int_equal(lumi_rig_drive_status(drive, &status, &error), LUMI_OK);
    assert_true(status.enabled && status.ready && status.reached && !status.fault && !status.homed);
    assert_true(status.turns == 0);
    assert_int_equal(lumi_rig_drive_go(drive, 2.25, &error), LUMI_OK);
    assert_int_equal(lumi_rig_drive_status(drive, &status, &error), LUMI_OK);
    assert_false(status.reached);
    while (!status.reached)
        assert_int_equal(lumi_rig_drive_status(drive, &status, &error), LUMI_OK);
    assert_true(status.turns == 2.25);
    assert_int_equal(fake_drive_position(&fake), 500 - 81000);
    assert_int_equal(lumi_rig_drive_home(drive, &error), LUMI_OK);
    while (!status.homed || !status.reached)
        assert_int_equal(lumi_rig_drive_status(drive, &status, &error), LUMI_OK);
    assert_int_equal(fake_drive_position(&fake), 500);
    finish(drive);
}

static void a_drive_goes_where_it_is_told_over_rtu(void **state)
{
    (void)state;
    goes_there(false);
}

static void a_drive_goes_where_it_is_told_over_tcp(void **state)
{
    (void)state;
    goes_there(true);
}

static void set_trouble(int silent, int damaged, int exceptions, int exception)
{
    pthread_mutex_lock(&fake.lock);
    fake.silent = silent;
    fake.damaged = damaged;
    fake.exceptions = exceptions;
    fake.exception = exception;
    fake.requests = 0;
    pthread_mutex_unlock(&fake.lock);
}

static int requests(void)
{
    pthread_mutex_lock(&fake.lock);
    int count = fake.requests;
    pthread_mutex_unlock(&fake.lock);
    return count;
}

static void expect_failure(struct lumi_rig_drive *drive, const char *words, int tries)
{
    struct lumi_rig_drive_status status;
    struct lumi_error error = {0};

    assert_int_equal(lumi_rig_drive_status(drive, &status, &error), LUMI_ERR_IO);
    if (!strstr(error.text, words))
        fail_msg("'%s' is not in: %s", words, error.text);
    assert_non_null(strstr(error.text, "register 0"));
    assert_int_equal(requests(), tries);
    set_trouble(0, 0, 0, 0);
    assert_int_equal(lumi_rig_drive_status(drive, &status, &error), LUMI_OK);
}

static void what_a_drive_does_wrong_is_tried_again_and_said(void **state)
{
    struct lumi_rig_drive_status status;
    struct lumi_error error = {0};

    (void)state;
    for (int tcp = 0; tcp < 2; tcp++) {
        struct lumi_rig_drive *drive = start(tcp);
        set_trouble(2, 0, 0, 0);
        assert_int_equal(lumi_rig_drive_status(drive, &status, &error), LUMI_OK);
        set_trouble(3, 0, 0, 0);
        expect_failure(drive, "no answer within", 3);
        set_trouble(0, 0, 1, MODBUS_EXCEPTION_ILLEGAL_DATA_ADDRESS);
        expect_failure(drive, "exception 2, Illegal data address", 1);
        set_trouble(0, 0, 2, MODBUS_EXCEPTION_SLAVE_OR_SERVER_BUSY);
        assert_int_equal(lumi_rig_drive_status(drive, &status, &error), LUMI_OK);
        set_trouble(0, 0, 3, MODBUS_EXCEPTION_SLAVE_OR_SERVER_BUSY);
        expect_failure(drive, "exception 6", 3);
        finish(drive);
    }
    struct lumi_rig_drive *drive = start(false);
    set_trouble(0, 2, 0, 0);
    assert_int_equal(lumi_rig_drive_status(drive, &status, &error), LUMI_OK);
    set_trouble(0, 3, 0, 0);
    expect_failure(drive, "damaged (CRC)", 3);
    finish(drive);
}

static void a_broken_connection_is_made_again(void **state)
{
    struct lumi_rig_drive_status status;
    struct lumi_error error = {0};
    struct lumi_rig_drive *drive = start(true);

    (void)state;
    for (int i = 0; i < 3; i++) {
        pthread_mutex_lock(&fake.lock);
        fake.hang_up = true;
        pthread_mutex_unlock(&fake.lock);
        if (lumi_rig_drive_status(drive, &status, &error))
            fail_msg("%s", error.text);
    }
    finish(drive);
}

static void a_line_that_another_program_has_is_left_alone(void **state)
{
    struct lumi_rig_drive *drive = start(false), *second;
    struct lumi_error error = {0};

    (void)state;
    assert_int_equal(lumi_rig_drive_open(fake.address, &map, &second, &error), LUMI_ERR_BUSY);
    assert_non_null(strstr(error.text, "locked"));
    finish(drive);
}

static void addresses_of_drives_are_checked(void **state)
{
    static const char *const bad[] = {"/dev/ttyUSB1",
                                      "rtu:",
                                      "rtu:/dev/ttyUSB1,parity=X",
                                      "rtu:/dev/ttyUSB1,baud=1",
                                      "rtu:/dev/ttyUSB1,speed=9600",
                                      "tcp:",
                                      "tcp::502",
                                      "tcp:host:",
                                      "tcp:host:70000"};
    struct lumi_rig_drive *drive;
    struct lumi_error error = {0};

    (void)state;
    assert_int_equal(lumi_drive_map_parse(FAKE_DRIVE_MAP, strlen(FAKE_DRIVE_MAP), "m", &map, &error), LUMI_OK);
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        assert_int_equal(lumi_rig_drive_open(bad[i], &map, &drive, &error), LUMI_ERR_ARG);
        assert_null(drive);
    }
    assert_int_equal(lumi_rig_drive_open("rtu:/dev/lumi-no-line", &map, &drive, &error), LUMI_ERR_NOTFOUND);
    lumi_rig_drive_close(NULL);
}

/* ---- register maps ---- */

static void maps_that_cannot_be_are_refused_with_their_line(void **state)
{
    static const struct {
        const char *from, *to, *words;
    } cases[] = {
        {"unit = 3", "unit = 248", "m:3: unit = 248: from 1 to 247"},
        {"unit = 3", "unit = 3.5", "a whole number"},
        {"unit = 3", "unit = three", "is no number"},
        {"unit = 3", "colour = 3", "m:3: 'colour' is no key of [drive]"},
        {"unit = 3", "name = fake", "m:3: 'name' comes twice"},
        {"[scale]", "[drive]", "comes twice"},
        {"[scale]", "[gears]", "[gears] is no section"},
        {"counts_per_turn = -36000", "counts_per_turn = 0", "counts_per_turn"},
        {"counts_per_turn = -36000", "", "'counts_per_turn' is missing"},
        {"fault = 3", "fault = 32", "from 0 to 31"},
        {"fault = 3", "fault = 16", "bit 16 (fault) of 16"},
        {"[position]\naddress = 2\nwidth = 32", "[position]\naddress = 65535\nwidth = 32", "past the last"},
        {"width = 32\n[speed]", "width = 24\n[speed]", "16 or 32"},
        {"width = 32\n[speed]", "table = input\n[speed]", "cannot be"},
        {"[start]\naddress = 12\nvalue = 1\nclear = 0\n", "", "[start] is missing"},
        {"[position]\naddress = 2\nwidth = 32\n", "", "[position] is missing"},
        {"value = 0xff", "value = 0x1ff00", "from 0 to 65535"},
        {"value = 0xff", "value", "neither"},
        {"[drive]\n", "", "before the first section"},
    };
    char text[2048];

    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const char *at = strstr(FAKE_DRIVE_MAP, cases[i].from);
        struct lumi_error error = {0};
        assert_non_null(at);
        snprintf(text, sizeof text, "%.*s%s%s", (int)(at - FAKE_DRIVE_MAP), FAKE_DRIVE_MAP, cases[i].to,
                 at + strlen(cases[i].from));
        assert_int_equal(lumi_drive_map_parse(text, strlen(text), "m", &map, &error), LUMI_ERR_FORMAT);
        if (!strstr(error.text, cases[i].words))
            fail_msg("'%s' is not in: %s", cases[i].words, error.text);
    }
}

/* ---- sweeps ---- */

static struct lumi_rig rig;
static struct lumi_plan plan;
static int32_t fired_at[64];
static int fired_count, estop_at;

static void fire_here(const lumi_wire_FireHere *here, lumi_wire_Reply *reply)
{
    if (!fake_drive_reached(&fake) || !board.status.position_known) {
        reply->result = lumi_wire_Result_REFUSED;
        snprintf(reply->text, sizeof reply->text, "the position-reached line is not active");
        return;
    }
    for (int i = 0; i < plan.bracket; i++) {
        lumi_wire_Event event = {.which_kind = lumi_wire_Event_shot_tag, .time_ns = fake_board_time(&board)};
        event.kind.shot.number = here->first_shot + (uint32_t)i;
        event.kind.shot.lost = event.kind.shot.number == 5;
        lumi_wire_server_event(&board.server, &event);
        if (fired_count < 64)
            fired_at[fired_count++] = fake_drive_position(&fake);
    }
    lumi_wire_Event ended = {.which_kind = lumi_wire_Event_sweep_ended_tag, .time_ns = fake_board_time(&board)};
    if (!estop_at || fired_count < estop_at)
        lumi_wire_server_event(&board.server, &ended);
    if (estop_at && fired_count >= estop_at) {
        lumi_wire_Event event = {.which_kind = lumi_wire_Event_fault_tag, .time_ns = fake_board_time(&board)};
        event.kind.fault.fault = LUMI_RIG_FAULT_ESTOP;
        event.kind.fault.set = true;
        lumi_wire_server_event(&board.server, &event);
    }
}

static void obey(struct fake_board *self, const lumi_wire_Request *request, lumi_wire_Reply *reply)
{
    if (request->which_command == lumi_wire_Request_get_status_tag) {
        reply->which_payload = lumi_wire_Reply_status_tag;
        reply->payload.status = self->status;
    } else if (request->which_command == lumi_wire_Request_home_tag) {
        self->status.position_known = true;
    } else if (request->which_command == lumi_wire_Request_set_output_tag) {
        pthread_mutex_lock(&fake.lock);
        fake.enabled = request->command.set_output.active;
        pthread_mutex_unlock(&fake.lock);
    } else if (request->which_command == lumi_wire_Request_fire_here_tag) {
        fire_here(&request->command.fire_here, reply);
    }
}

static void start_sweep(struct lumi_rig_drive_sweep *sweep)
{
    struct lumi_error error = {0};
    struct lumi_rig_link *link;

    memset(&board, 0, sizeof board);
    board.execute = obey;
    fired_count = estop_at = 0;
    assert_int_equal(lumi_rig_builtin("arc16", &rig, &error), LUMI_OK);
    rig.control.motion.drive = LUMI_RIG_DRIVE_EXTERNAL;
    lumi_plan_init(&plan, &rig);
    plan.mode = LUMI_PLAN_START_STOP;
    plan.positions = 8;
    plan.turns = 1;
    plan.bracket = 2;
    plan.exposures[0] = plan.exposures[1] = 0.01;
    memset(sweep, 0, sizeof *sweep);
    sweep->drive = start(true);
    fake.enabled = false;
    fake_board_start(&board, "pty");
    assert_int_equal(lumi_rig_link_open(board.address, NULL, &link, &error), LUMI_OK);
    sweep->link = link;
    sweep->rig = &rig;
    sweep->plan = &plan;
}

static void end_sweep(struct lumi_rig_drive_sweep *sweep)
{
    lumi_rig_link_close(sweep->link);
    fake_board_stop(&board);
    finish(sweep->drive);
}

static void a_sweep_fires_every_shot_once_at_its_place(void **state)
{
    struct lumi_rig_drive_sweep sweep;
    struct lumi_error error = {0};

    (void)state;
    start_sweep(&sweep);
    sweep.home = true;
    if (lumi_rig_drive_sweep(&sweep, &error))
        fail_msg("%s", error.text);
    assert_int_equal(fired_count, 16);
    for (int i = 0; i < 16; i++)
        assert_int_equal(fired_at[i], 500 - 36000 / 8 * (i / 2));
    assert_int_equal(sweep.fired, 15);
    assert_int_equal(sweep.lost, 1);
    assert_int_equal(sweep.next_shot, 16);
    end_sweep(&sweep);
}

static void a_sweep_goes_on_from_a_shot(void **state)
{
    struct lumi_rig_drive_sweep sweep;
    struct lumi_error error = {0};

    (void)state;
    start_sweep(&sweep);
    sweep.first_shot = 12;
    assert_int_equal(lumi_rig_drive_sweep(&sweep, &error), LUMI_OK);
    assert_int_equal(fired_count, 4);
    assert_int_equal(fired_at[0], 500 - 27000);
    end_sweep(&sweep);
}

static void an_emergency_stop_on_the_board_ends_the_sweep_and_stops_the_drive(void **state)
{
    struct lumi_rig_drive_sweep sweep;
    struct lumi_error error = {0};

    (void)state;
    start_sweep(&sweep);
    estop_at = 6;
    assert_int_equal(lumi_rig_drive_sweep(&sweep, &error), LUMI_ERR_BUSY);
    assert_non_null(strstr(error.text, "estop"));
    assert_int_equal(fired_count, 6);
    assert_int_equal(fake.stops, 1);
    end_sweep(&sweep);
}

static void trouble_with_the_drive_ends_the_sweep_with_its_reason(void **state)
{
    static const char *const words[] = {"fault 42", "has not reached", "no answer within"};

    (void)state;
    for (int i = 0; i < 3; i++) {
        struct lumi_rig_drive_sweep sweep;
        struct lumi_error error = {0};
        start_sweep(&sweep);
        fake.fault_at_move = i == 0 ? 3 : 0;
        fake.stuck = i == 1;
        fake.silent = i == 2 ? 1000 : 0;
        assert_int_equal(lumi_rig_drive_sweep(&sweep, &error), i == 0 ? LUMI_ERR_BUSY : LUMI_ERR_IO);
        if (!strstr(error.text, words[i]))
            fail_msg("'%s' is not in: %s", words[i], error.text);
        assert_int_equal(fired_count, i == 0 ? 4 : 0);
        fake.silent = 0;
        end_sweep(&sweep);
    }
}

static void an_alarm_from_before_is_reset_on_the_operators_word_only(void **state)
{
    struct lumi_rig_drive_sweep sweep;
    struct lumi_error error = {0};

    (void)state;
    start_sweep(&sweep);
    fake.fault = true;
    fake.fault_code = 7;
    assert_int_equal(lumi_rig_drive_sweep(&sweep, &error), LUMI_ERR_BUSY);
    assert_non_null(strstr(error.text, "fault 7"));
    assert_int_equal(fake.resets, 0);
    sweep.reset = true;
    assert_int_equal(lumi_rig_drive_sweep(&sweep, &error), LUMI_OK);
    assert_int_equal(fake.resets, 1);
    assert_int_equal(fired_count, 16);
    end_sweep(&sweep);
}

static void only_start_stop_and_only_rigs_with_such_a_drive(void **state)
{
    struct lumi_rig_drive_sweep sweep;
    struct lumi_error error = {0};

    (void)state;
    start_sweep(&sweep);
    plan.mode = LUMI_PLAN_CONTINUOUS;
    assert_int_equal(lumi_rig_drive_sweep(&sweep, &error), LUMI_ERR_UNSUPPORTED);
    plan.mode = LUMI_PLAN_START_STOP;
    rig.control.motion.drive = LUMI_RIG_DRIVE_STEPPER;
    assert_int_equal(lumi_rig_drive_sweep(&sweep, &error), LUMI_ERR_UNSUPPORTED);
    assert_int_equal(fake.moves, 0);
    end_sweep(&sweep);
}

static bool after_three(void *context)
{
    return ++*(int *)context > 3;
}

static void a_sweep_can_be_stopped_between_positions(void **state)
{
    struct lumi_rig_drive_sweep sweep;
    struct lumi_error error = {0};
    int asked = 0;

    (void)state;
    start_sweep(&sweep);
    sweep.context = &asked;
    sweep.cancelled = after_three;
    assert_int_equal(lumi_rig_drive_sweep(&sweep, &error), LUMI_ERR_CANCELLED);
    assert_int_equal(fired_count, 6);
    assert_int_equal(sweep.next_shot, 6);
    end_sweep(&sweep);
}

struct stop_here {
    int looks, moves;
};

/* While it moves for the third time. */
static bool in_the_third_move(void *context)
{
    struct stop_here *stop = context;

    pthread_mutex_lock(&fake.lock);
    stop->moves = fake.moves;
    pthread_mutex_unlock(&fake.lock);
    stop->looks += stop->moves == 3;
    return stop->looks > 1;
}

/* The board says nothing at all of it: its link may be cut. */
static void an_emergency_stop_of_the_host_stops_a_drive_that_moves(void **state)
{
    struct lumi_rig_drive_sweep sweep;
    struct lumi_error error = {0};
    struct stop_here stop = {0};

    (void)state;
    start_sweep(&sweep);
    sweep.context = &stop;
    sweep.stopped = in_the_third_move;
    assert_int_equal(lumi_rig_drive_sweep(&sweep, &error), LUMI_ERR_CANCELLED);
    assert_string_equal(error.text, "emergency stop");
    assert_int_equal(fired_count, 4);
    assert_int_equal(fake.moves, 3);
    assert_int_equal(fake.stops, 1);
    end_sweep(&sweep);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_drive_goes_where_it_is_told_over_rtu),
        cmocka_unit_test(a_drive_goes_where_it_is_told_over_tcp),
        cmocka_unit_test(what_a_drive_does_wrong_is_tried_again_and_said),
        cmocka_unit_test(a_broken_connection_is_made_again),
        cmocka_unit_test(a_line_that_another_program_has_is_left_alone),
        cmocka_unit_test(addresses_of_drives_are_checked),
        cmocka_unit_test(maps_that_cannot_be_are_refused_with_their_line),
        cmocka_unit_test(a_sweep_fires_every_shot_once_at_its_place),
        cmocka_unit_test(a_sweep_goes_on_from_a_shot),
        cmocka_unit_test(an_emergency_stop_on_the_board_ends_the_sweep_and_stops_the_drive),
        cmocka_unit_test(trouble_with_the_drive_ends_the_sweep_with_its_reason),
        cmocka_unit_test(an_alarm_from_before_is_reset_on_the_operators_word_only),
        cmocka_unit_test(only_start_stop_and_only_rigs_with_such_a_drive),
        cmocka_unit_test(a_sweep_can_be_stopped_between_positions),
        cmocka_unit_test(an_emergency_stop_of_the_host_stops_a_drive_that_moves),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
