/* A bench for the whole core: the board in virtual time, a platform that is where its steps say, switches on it, wires
 * that record the trigger lines, and a host at the far end of the link. Mechanics with inertia and faults of its own is
 * sim/rig; this is for what the core does by itself. */
#ifndef LUMI_TESTS_UNIT_CORE_BENCH_H
#define LUMI_TESTS_UNIT_CORE_BENCH_H

#include "firmware/core/core_state.h"
#include "firmware/host/host_board.h"
#include "proto/base/bytes.h"
#include "proto/mechanism/kinematics.h"
#include "proto/wire/client.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define BENCH_STEPS 400000
#define BENCH_EDGES 8192
#define BENCH_SHOTS LUMI_PLAN_SHOTS_MAX
#define BENCH_SECOND ((uint64_t)BOARD_TICK_HZ)

struct bench_edge {
    uint64_t at;
    uint16_t rise, fall;
};

struct bench {
    struct host_board *board;
    struct core *core;
    struct lumi_rig rig;
    double steps_per_turn;
    struct lumi_wire_client client;
    bool replied, connected, mute; /* mute: the host sends nothing */
    lumi_wire_Reply reply;
    /* The platform. */
    int64_t position;
    bool inputs[BOARD_INPUTS], outputs[BOARD_OUTPUTS];
    int supply_mv;
    void (*inside)(struct bench *b); /* an interrupt in the middle of a poll, once: behind the look at the inputs */
    int slip;                        /* the platform turns so many steps a step; 0: one */
    bool mark_hidden;                /* the index switch is broken */
    uint64_t last_step;              /* tick */
    uint64_t brake_at;               /* tick of its last change */
    int enable_falls;
    uint64_t *step_at;      /* of each step … */
    int64_t *step_position; /* … and where it led */
    int step_count;
    uint16_t lines;
    struct bench_edge *edges;
    int edge_count;
    uint64_t lamp_at[256];
    int lamp_count;
    /* What the host was told. */
    uint8_t *shot_fired, *shot_lost; /* how often */
    lumi_wire_Shot last_shot;
    uint32_t fired, lost, notes, turn_marks, feedbacks, ended_count, homed_count, starts;
    uint32_t faults_set, faults_cleared; /* bits, ever */
    lumi_wire_SweepEnded ended;
    lumi_wire_Homed homed;
    lumi_wire_Feedback feedback;
    lumi_wire_TurnMark turn_mark; /* the last */
    lumi_wire_State state;
    char note[64];
};

static void bench_set_input(struct bench *b, enum board_input input, bool active)
{
    if (b->inputs[input] == active)
        return;
    b->inputs[input] = active;
    host_board_input(b->board, input, active, host_board_now(b->board));
}

/* Switches that the platform works: the mark just behind every whole turn, the upper end 0.4 turns before turn 0. */
static void bench_switches(struct bench *b)
{
    double turns = (double)b->position / b->steps_per_turn, part = turns - floor(turns);

    bench_set_input(b, BOARD_IN_INDEX, part < 0.01 && !b->mark_hidden);
    if (b->rig.control.safety.wound_fitted)
        bench_set_input(b, BOARD_IN_WOUND, turns < -0.4);
}

static void bench_step(void *context, uint64_t at, bool forward)
{
    struct bench *b = context;

    /* What must hold at every step of every test. */
    assert_true(b->outputs[BOARD_OUT_ENABLE]);
    assert_false(b->inputs[BOARD_IN_ESTOP]);
    if (b->rig.control.safety.brake_fitted && !b->rig.string.held)
        assert_true(b->outputs[BOARD_OUT_BRAKE] && at >= b->brake_at + DROP_STRING_BRAKE_TICKS);
    assert_true(motion_known(&b->core->motion) || b->core->state == lumi_wire_State_HOMING ||
                b->core->state == lumi_wire_State_STOPPING || motion_starved(&b->core->motion));
    b->position += (forward ? 1 : -1) * (b->slip ? b->slip : 1);
    b->last_step = at;
    if (b->step_count < BENCH_STEPS) {
        b->step_at[b->step_count] = at;
        b->step_position[b->step_count++] = b->position;
    }
    bench_switches(b);
}

static void bench_lines(void *context, uint64_t at, uint16_t lines)
{
    struct bench *b = context;

    if (b->edge_count < BENCH_EDGES)
        b->edges[b->edge_count++] =
            (struct bench_edge){at, (uint16_t)(lines & ~b->lines), (uint16_t)(b->lines & ~lines)};
    b->lines = lines;
}

static void bench_output(void *context, uint64_t at, enum board_output output, bool active)
{
    struct bench *b = context;

    b->enable_falls += output == BOARD_OUT_ENABLE && b->outputs[output] && !active;
    b->outputs[output] = active;
    if (output == BOARD_OUT_BRAKE)
        b->brake_at = at;
    if (output == BOARD_OUT_LAMP && b->lamp_count < 256)
        b->lamp_at[b->lamp_count++] = at;
}

static bool bench_input(void *context, enum board_input input)
{
    return ((struct bench *)context)->inputs[input];
}

static int bench_supply(void *context)
{
    struct bench *b = context;
    void (*inside)(struct bench *) = b->inside;

    b->inside = NULL;
    if (inside)
        inside(b);
    return b->supply_mv;
}

/* ---- The host ---- */

static bool bench_send(void *context, const uint8_t *frame, size_t size)
{
    struct bench *b = context;

    return b->mute || host_board_link_push(b->board, BOARD_LINK_USB, frame, size) == size;
}

static void bench_on_reply(void *context, const lumi_wire_Reply *reply)
{
    struct bench *b = context;

    b->reply = *reply;
    b->replied = true;
}

static void bench_on_shot(struct bench *b, const lumi_wire_Shot *shot)
{
    assert_true(shot->number < BENCH_SHOTS);
    b->last_shot = *shot;
    b->fired += !shot->lost;
    b->lost += shot->lost;
    (shot->lost ? b->shot_lost : b->shot_fired)[shot->number]++;
}

static void bench_on_event(void *context, const lumi_wire_Event *event)
{
    struct bench *b = context;

    switch (event->which_kind) {
    case lumi_wire_Event_shot_tag:
        bench_on_shot(b, &event->kind.shot);
        break;
    case lumi_wire_Event_state_changed_tag:
        b->state = event->kind.state_changed.to;
        break;
    case lumi_wire_Event_fault_tag:
        if (event->kind.fault.set)
            b->faults_set |= 1u << event->kind.fault.fault;
        else
            b->faults_cleared |= 1u << event->kind.fault.fault;
        break;
    case lumi_wire_Event_sweep_ended_tag:
        b->ended = event->kind.sweep_ended;
        b->ended_count++;
        break;
    case lumi_wire_Event_homed_tag:
        b->homed = event->kind.homed;
        b->homed_count++;
        break;
    case lumi_wire_Event_feedback_tag:
        b->feedback = event->kind.feedback;
        b->feedbacks++;
        break;
    case lumi_wire_Event_turn_mark_tag:
        b->turn_mark = event->kind.turn_mark;
        b->turn_marks++;
        break;
    case lumi_wire_Event_started_tag:
        b->starts++;
        break;
    default:
        memcpy(b->note, event->kind.note.text, sizeof b->note);
        b->notes++;
    }
}

static void bench_on_lost(void *context, uint32_t count)
{
    (void)context;
    assert_int_equal(count, 0);
}

static void bench_on_welcome(void *context, const lumi_wire_Welcome *welcome, bool restarted)
{
    (void)restarted;
    (void)welcome;
    ((struct bench *)context)->connected = true;
}

static void bench_on_request_lost(void *context, uint32_t number)
{
    (void)context;
    (void)number;
}

static void bench_on_pulse(void *context, const lumi_wire_Pulse *pulse, uint64_t received_ns)
{
    (void)context;
    (void)pulse;
    (void)received_ns;
}

static const struct lumi_wire_client_ops bench_host = {
    bench_send, bench_on_welcome, bench_on_reply, bench_on_request_lost, bench_on_event, bench_on_lost, bench_on_pulse};

/* One beat of 2 ms: the board runs, the host takes what came and sends what is due. */
static void bench_beat(struct bench *b)
{
    uint8_t data[512];
    size_t size;

    host_board_run(b->board, host_board_now(b->board) + BENCH_SECOND / 500);
    if (b->core->has_profile && !b->rig.string.held && !b->outputs[BOARD_OUT_ENABLE]) /* what else holds the arm? */
        assert_true(!b->outputs[BOARD_OUT_BRAKE] && host_board_now(b->board) >= b->brake_at + DROP_STRING_BRAKE_TICKS);
    uint64_t now = core_ns(host_board_now(b->board));
    while ((size = host_board_link_pull(b->board, BOARD_LINK_USB, data, sizeof data)) > 0)
        if (!b->mute)
            lumi_wire_client_receive(&b->client, data, size, now);
    lumi_wire_client_poll(&b->client, now);
}

static void bench_run(struct bench *b, double seconds)
{
    uint64_t end = host_board_now(b->board) + (uint64_t)(seconds * BOARD_TICK_HZ);

    while (host_board_now(b->board) < end)
        bench_beat(b);
}

/* Until the board is in that state, at most so long. */
static inline void bench_until(struct bench *b, lumi_wire_State state, double seconds)
{
    uint64_t end = host_board_now(b->board) + (uint64_t)(seconds * BOARD_TICK_HZ);

    while (b->core->state != state && host_board_now(b->board) < end)
        bench_beat(b);
    assert_int_equal(b->core->state, state);
    bench_run(b, 0.1); /* the events come too */
}

static inline lumi_wire_Result bench_ask(struct bench *b, lumi_wire_Request *request)
{
    struct lumi_error error;

    b->replied = false;
    assert_int_equal(lumi_wire_client_request(&b->client, request, core_ns(host_board_now(b->board)), &error), 0);
    for (int i = 0; i < 1000 && !b->replied; i++)
        bench_beat(b);
    assert_true(b->replied);
    return b->reply.result;
}

#define BENCH_REQUEST(name, ...)                                                                                       \
    &(lumi_wire_Request)                                                                                               \
    {                                                                                                                  \
        .which_command = lumi_wire_Request_##name##_tag, .command.name = { __VA_ARGS__ }                               \
    }

static inline uint32_t bench_load(struct bench *b, const struct lumi_plan *plan)
{
    lumi_wire_Request request = {.which_command = lumi_wire_Request_load_plan_tag};

    request.command.load_plan.has_plan = true;
    lumi_wire_from_plan(plan, &request.command.load_plan.plan);
    lumi_wire_Result result = bench_ask(b, &request);
    if (result != lumi_wire_Result_DONE)
        print_message("%s\n", b->reply.text);
    assert_int_equal(result, lumi_wire_Result_DONE);
    return lumi_wire_plan_crc(plan);
}

static inline void bench_home(struct bench *b)
{
    assert_int_equal(bench_ask(b, BENCH_REQUEST(home, .turn = 0)), lumi_wire_Result_DONE);
    bench_until(b, lumi_wire_State_IDLE, 120);
    assert_true(b->homed.found);
}

static void bench_store_profile(struct bench *b)
{
    static lumi_wire_Profile scratch;
    static uint8_t data[LUMI_WIRE_PROFILE_MAX];
    struct lumi_error error;

    if (lumi_rig_check(&b->rig, &error) != LUMI_OK)
        fail_msg("%s", error.text);
    size_t size = lumi_wire_encode_profile(&b->rig, &scratch, data, sizeof data);
    assert_true(size > 0);
    assert_int_equal(profile_store_save(host_board_port(b->board), data, size, false, &error), LUMI_OK);
}

/* The bench with `rig`'s profile in flash (NULL: none), the host connected. */
static inline struct bench *bench_create(const struct lumi_rig *rig)
{
    struct bench *b = calloc(1, sizeof *b);
    const struct host_board_wires wires = {.context = b,
                                           .step = bench_step,
                                           .trigger_lines = bench_lines,
                                           .output = bench_output,
                                           .input = bench_input,
                                           .supply_mv = bench_supply};

    assert_non_null(b);
    b->step_at = calloc(BENCH_STEPS, sizeof *b->step_at);
    b->step_position = calloc(BENCH_STEPS, sizeof *b->step_position);
    b->edges = calloc(BENCH_EDGES, sizeof *b->edges);
    b->shot_fired = calloc(2, BENCH_SHOTS);
    b->shot_lost = b->shot_fired + BENCH_SHOTS;
    b->supply_mv = 24000;
    b->board = host_board_create(&wires);
    assert_non_null(b->board);
    if (rig) {
        b->rig = *rig;
        b->steps_per_turn = lumi_rig_steps_per_turn(rig);
        b->position = (int64_t)(b->steps_per_turn / 7);
        bench_store_profile(b);
    }
    assert_true(host_board_attach_core(b->board));
    b->core = host_board_core(b->board);
    lumi_wire_client_init(&b->client, &bench_host, b, 0x1234567890abcdefu);
    bench_run(b, 0.5);
    assert_true(b->connected);
    return b;
}

static inline void bench_destroy(struct bench *b)
{
    host_board_destroy(b->board);
    free(b->step_at);
    free(b->step_position);
    free(b->edges);
    free(b->shot_fired);
    free(b);
}

/* Where the platform was at tick `at`, in steps: the pulse of step p comes half-way to it. */
static inline double bench_position_at(const struct bench *b, uint64_t at)
{
    int low = 0, high = b->step_count - 1;

    while (low + 1 < high) {
        int middle = (low + high) / 2;
        if (b->step_at[middle] <= at)
            low = middle;
        else
            high = middle;
    }
    double part = (double)(at - b->step_at[low]) / (double)(b->step_at[low + 1] - b->step_at[low]);
    return (double)b->step_position[low] - 0.5 + (part < 1 ? part : 0.5);
}

#endif
