/* A sweep with an industrial drive, all of it but the metal: the firmware's core on the board in virtual time (which
 * here goes with the clock), the host's library at the other end of a line, and libmodbus' server as the drive, whose
 * enable and position-reached lines are the board's. */
#define _GNU_SOURCE
#include "daemon/rig/bench.h"
#include "daemon/rig/sweep_run.h"
#include "firmware/host/host_board.h"
#include "tests/unit/fake_drive.h"

#include <poll.h>
#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include <cmocka.h>

#define POSITIONS 6

static struct fake_drive drive;
static struct lumi_rig rig;
static struct lumi_plan plan;

/* The board, in its own thread. */
static struct host_board *board;
static int board_end;
static bool ending, reached_told;
static atomic_int estop_after, fired;
static atomic_bool pressed, release;
static uint16_t lines;
static int32_t fired_at[64];

static bool input(void *context, enum board_input which)
{
    (void)context;
    if (which == BOARD_IN_ESTOP)
        return pressed;
    return which == BOARD_IN_REACHED && fake_drive_reached(&drive);
}

static void output(void *context, uint64_t at, enum board_output which, bool active)
{
    (void)context;
    (void)at;
    if (which != BOARD_OUT_ENABLE)
        return;
    pthread_mutex_lock(&drive.lock);
    drive.enabled = active;
    pthread_mutex_unlock(&drive.lock);
}

static void trigger_lines(void *context, uint64_t at, uint16_t now)
{
    (void)context;
    (void)at;
    if ((now & 1) && !(lines & 1) && fired < 64)
        fired_at[fired++] = fake_drive_position(&drive);
    lines = now;
}

static void tell_inputs(void)
{
    bool reached = fake_drive_reached(&drive);

    if (reached != reached_told)
        host_board_input(board, BOARD_IN_REACHED, reached, host_board_now(board));
    reached_told = reached;
    if (estop_after && fired >= estop_after) {
        pressed = true;
        host_board_input(board, BOARD_IN_ESTOP, true, host_board_now(board));
        estop_after = 0;
    }
    if (release && pressed) {
        pressed = false;
        host_board_input(board, BOARD_IN_ESTOP, false, host_board_now(board));
    }
}

static uint64_t ticks_now(void)
{
    struct timespec now;

    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * BOARD_TICK_HZ + (uint64_t)now.tv_nsec / 250 * 21;
}

static void *run_board(void *context)
{
    uint64_t began = ticks_now();
    uint8_t data[2048];

    (void)context;
    while (!__atomic_load_n(&ending, __ATOMIC_RELAXED)) {
        struct pollfd one = {.fd = board_end, .events = POLLIN};
        if (poll(&one, 1, 1) > 0) {
            ssize_t count = recv(board_end, data, sizeof data, MSG_DONTWAIT);
            if (count > 0)
                host_board_link_push(board, BOARD_LINK_SERIAL, data, (size_t)count);
        }
        host_board_run(board, ticks_now() - began);
        tell_inputs();
        size_t size = host_board_link_pull(board, BOARD_LINK_SERIAL, data, sizeof data);
        if (size && send(board_end, data, size, MSG_NOSIGNAL) < 0)
            break;
    }
    return NULL;
}

static pthread_t thread;

static void start(struct lumi_rig_sweep_run *run)
{
    const struct host_board_wires wires = {.input = input, .output = output, .trigger_lines = trigger_lines};
    struct lumi_drive_map map;
    struct lumi_error error = {0};
    char address[16];
    int ends[2];

    memset(&drive, 0, sizeof drive);
    memset(&rig, 0, sizeof rig);
    ending = reached_told = false;
    fired = estop_after = 0;
    pressed = release = false;
    lines = 0;
    fake_drive_start(&drive, true);
    board = host_board_create(&wires);
    assert_non_null(board);
    assert_true(host_board_attach_core(board));
    host_board_link_set_up(board, BOARD_LINK_SERIAL, true);
    assert_false(socketpair(AF_UNIX, SOCK_STREAM, 0, ends));
    board_end = ends[1];
    assert_false(pthread_create(&thread, NULL, run_board, NULL));

    assert_int_equal(lumi_rig_builtin("arc16", &rig, &error), LUMI_OK);
    rig.control.motion.drive = LUMI_RIG_DRIVE_EXTERNAL;
    lumi_rig_sweep_run_init(run);
    snprintf(address, sizeof address, "fd:%d", ends[0]);
    assert_int_equal(lumi_rig_link_open(address, NULL, &run->link, &error), LUMI_OK);
    if (lumi_rig_link_wait(run->link, 20, false, &error) ||
        lumi_rig_bench_write_profile(run->link, &rig, false, &error))
        fail_msg("%s", error.text);
    lumi_plan_init(&plan, &rig);
    plan.mode = LUMI_PLAN_START_STOP;
    plan.positions = POSITIONS;
    plan.turn_time = 120;
    plan.settle = 0.02;
    assert_int_equal(lumi_drive_map_parse(FAKE_DRIVE_MAP, strlen(FAKE_DRIVE_MAP), "map", &map, &error), LUMI_OK);
    assert_int_equal(lumi_rig_drive_open(drive.address, &map, &run->drive, &error), LUMI_OK);
    run->rig = &rig;
    run->plan = &plan;
    run->home_drive = true;
}

static void finish(struct lumi_rig_sweep_run *run)
{
    lumi_rig_drive_close(run->drive);
    lumi_rig_link_close(run->link);
    __atomic_store_n(&ending, true, __ATOMIC_RELAXED);
    pthread_join(thread, NULL);
    close(board_end);
    host_board_destroy(board);
    fake_drive_stop(&drive);
}

static void the_board_fires_where_the_drive_stands(void **state)
{
    struct lumi_rig_sweep_run run;
    struct lumi_error error = {0};

    (void)state;
    start(&run);
    if (lumi_rig_sweep_run(&run, &error))
        fail_msg("%s", error.text);
    assert_int_equal(run.fired, POSITIONS);
    assert_int_equal(run.missing, 0);
    assert_int_equal(fired, POSITIONS);
    for (int i = 0; i < POSITIONS; i++)
        assert_int_equal(fired_at[i], 500 - 36000 / POSITIONS * i);
    finish(&run);
}

static void an_emergency_stop_takes_the_drives_power_and_the_rest_is_taken_later(void **state)
{
    struct lumi_rig_sweep_run run;
    struct lumi_error error = {0};
    lumi_wire_Status status;
    uint32_t cleared;

    (void)state;
    start(&run);
    estop_after = 3;
    assert_int_not_equal(lumi_rig_sweep_run(&run, &error), LUMI_OK);
    assert_non_null(strstr(error.text, "estop"));
    pthread_mutex_lock(&drive.lock);
    int moves = drive.moves;
    assert_false(drive.enabled);
    pthread_mutex_unlock(&drive.lock);
    assert_true(moves <= 4);
    assert_int_equal(lumi_rig_bench_status(run.link, &status, &error), LUMI_OK);
    assert_int_equal(status.faults, 1u << LUMI_RIG_FAULT_ESTOP);
    assert_int_equal(lumi_rig_bench_clear(run.link, &cleared, &error), LUMI_ERR_BUSY);
    release = true;
    for (int tries = 0; tries < 100 && lumi_rig_bench_clear(run.link, &cleared, &error); tries++)
        nanosleep(&(struct timespec){.tv_nsec = 20000000}, NULL);
    assert_int_equal(cleared, 1u << LUMI_RIG_FAULT_ESTOP);
    run.resume = true;
    if (lumi_rig_sweep_run(&run, &error))
        fail_msg("%s", error.text);
    assert_int_equal(run.missing, 0);
    assert_int_equal(run.fired, POSITIONS);
    assert_int_equal(fired_at[fired - 1], 500 - 36000 / POSITIONS * (POSITIONS - 1));

    /* A hole in the middle, and nothing that follows it. */
    lumi_wire_Request mark = {.which_command = lumi_wire_Request_mark_shots_tag};
    int before = fired;
    mark.command.mark_shots = (lumi_wire_MarkShots){.first = 1, .count = 1};
    assert_int_equal(lumi_rig_link_command(run.link, &mark, 10, NULL, &error), LUMI_OK);
    if (lumi_rig_sweep_run(&run, &error))
        fail_msg("%s", error.text);
    assert_int_equal(fired, before + 1);
    assert_int_equal(fired_at[before], 500 - 36000 / POSITIONS);
    finish(&run);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_board_fires_where_the_drive_stands),
        cmocka_unit_test(an_emergency_stop_takes_the_drives_power_and_the_rest_is_taken_later),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
