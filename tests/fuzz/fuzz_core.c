/* A script of requests, switches, time and bytes for the whole board. Whatever comes: not a step under an emergency
 * stop or with the position unknown (but to home), never a free arm, no shot fired twice unless asked for again.
 *
 * A script is a row of: a letter, and what it takes. 'r' length, an encoded HostFrame: a request, executed without a
 * session. 't' two bytes: so many ms. 'i' input (bits 0–3) and level (bit 7). 's' supply in 100 mV. 'f' feedback input.
 * 'h' a heartbeat. 'b' length, bytes on the link. 'g' home, load a plan, start; its bits choose. 'w' the watchdog
 * bites. */
#include "firmware/core/core_state.h"
#include "firmware/host/host_board.h"
#include "proto/mechanism/kinematics.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

#define MS (BOARD_TICK_HZ / 1000)
#define BUDGET_MS 120000 /* of virtual time a script */

static struct bench {
    struct host_board *board;
    struct core *core;
    struct lumi_rig rig;
    double steps_per_turn;
    int64_t position;
    bool inputs[BOARD_INPUTS], outputs[BOARD_OUTPUTS];
    uint64_t brake_at;
    int supply_mv;
} bench;

static void demand(bool holds)
{
    if (!holds)
        abort();
}

static void set_input(int input, bool active)
{
    if (bench.inputs[input] == active)
        return;
    bench.inputs[input] = active;
    host_board_input(bench.board, (enum board_input)input, active, host_board_now(bench.board));
}

static void on_step(void *context, uint64_t at, bool forward)
{
    (void)context;
    const lumi_wire_State state = bench.core->state;
    demand(!bench.inputs[BOARD_IN_ESTOP] && bench.outputs[BOARD_OUT_ENABLE]);
    demand(bench.outputs[BOARD_OUT_BRAKE] && at >= bench.brake_at + DROP_STRING_BRAKE_TICKS);
    demand(motion_known(&bench.core->motion) || motion_starved(&bench.core->motion) ||
           state == lumi_wire_State_HOMING || state == lumi_wire_State_STOPPING);
    demand(!state_at_rest(state) || motion_starved(&bench.core->motion));
    bench.position += forward ? 1 : -1;
    double turns = (double)bench.position / bench.steps_per_turn;
    set_input(BOARD_IN_INDEX, turns - floor(turns) < 0.02);
}

static void on_output(void *context, uint64_t at, enum board_output output, bool active)
{
    (void)context;
    bench.outputs[output] = active;
    if (output == BOARD_OUT_BRAKE)
        bench.brake_at = at;
}

static bool on_input(void *context, enum board_input input)
{
    (void)context;
    return bench.inputs[input];
}

static int on_supply(void *context)
{
    (void)context;
    return bench.supply_mv;
}

static void run(uint64_t ms)
{
    host_board_run(bench.board, host_board_now(bench.board) + ms * MS);
    demand((unsigned)bench.core->state < STATES);
    if (!bench.outputs[BOARD_OUT_ENABLE]) /* the brake holds the arm */
        demand(!bench.outputs[BOARD_OUT_BRAKE] &&
               host_board_now(bench.board) >= bench.brake_at + DROP_STRING_BRAKE_TICKS);
}

static void ask(const lumi_wire_Request *request)
{
    static lumi_wire_Reply reply;

    /* The loader and profiles have no way back to this rig. */
    if (request->which_command == lumi_wire_Request_enter_loader_tag ||
        request->which_command == lumi_wire_Request_commit_profile_tag)
        return;
    memset(&reply, 0, sizeof reply);
    core_execute(bench.core, request, &reply);
    demand(memchr(reply.text, 0, sizeof reply.text) != NULL);
}

static void get_going(uint8_t how)
{
    struct lumi_plan plan;
    lumi_wire_Request request = {.which_command = lumi_wire_Request_home_tag};

    ask(&request);
    run(30000);
    lumi_plan_init(&plan, &bench.rig);
    plan.positions = 8;
    plan.turns = 2;
    plan.turn_time = 10;
    plan.exposures[0] = 0.001;
    plan.mode = (enum lumi_plan_mode)(how % 3);
    plan.wind = (enum lumi_plan_wind)(how / 3 % 3);
    if (plan.mode == LUMI_PLAN_START_STOP) {
        plan.turn_time = 24;
        plan.bracket = 2;
        plan.exposures[1] = 0.02;
    }
    request.which_command = lumi_wire_Request_load_plan_tag;
    request.command.load_plan.has_plan = true;
    lumi_wire_from_plan(&plan, &request.command.load_plan.plan);
    ask(&request);
    memset(&request, 0, sizeof request);
    request.which_command = lumi_wire_Request_start_sweep_tag;
    request.command.start_sweep.plan_crc = bench.core->plan_crc;
    request.command.start_sweep.only_missing = how & 64;
    ask(&request);
}

static bool begin(void)
{
    static lumi_wire_Profile scratch;
    static uint8_t data[LUMI_WIRE_PROFILE_MAX];
    const struct host_board_wires wires = {
        .step = on_step, .output = on_output, .input = on_input, .supply_mv = on_supply};

    memset(&bench, 0, sizeof bench);
    bench.supply_mv = 24000;
    if (lumi_rig_bar(&bench.rig, 8, 4, 0.4, 0.03, 640, 480, 2.0, 1.6, NULL) != LUMI_OK)
        return false;
    struct lumi_rig_safety *safety = &bench.rig.control.safety;
    safety->brake_fitted = safety->slack_fitted = safety->string_end_fitted = true;
    safety->wound_fitted = safety->driver_fault_fitted = true;
    safety->supply_minimum = 20;
    safety->reactions[LUMI_RIG_FAULT_DRIVER].motor = LUMI_RIG_MOTOR_OFF;
    bench.rig.motor_steps = 200;
    bench.rig.microsteps = 2; /* few steps: quick */
    bench.steps_per_turn = lumi_rig_steps_per_turn(&bench.rig);
    bench.position = (int64_t)bench.steps_per_turn / 3;
    bench.board = host_board_create(&wires);
    if (!bench.board)
        return false;
    size_t size = lumi_wire_encode_profile(&bench.rig, &scratch, data, sizeof data);
    demand(profile_store_save(host_board_port(bench.board), data, size, false, NULL) == LUMI_OK);
    if (!host_board_attach_core(bench.board))
        return false;
    bench.core = host_board_core(bench.board);
    demand(bench.core->has_profile);
    return true;
}

/* One item of the script; how many bytes it took, 0 at the end. */
static size_t item(const uint8_t *data, size_t size, uint32_t *budget)
{
    static lumi_wire_HostFrame frame;
    size_t length = size > 1 ? data[1] : 0;
    uint32_t ms;

    if (size < 3)
        return 0;
    switch (data[0]) {
    case 'r':
        length = length < size - 2 ? length : size - 2;
        if (lumi_wire_decode_host(data + 2, length, &frame) && frame.which_body == lumi_wire_HostFrame_request_tag)
            ask(&frame.body.request);
        return 2 + length;
    case 'b':
        length = length < size - 2 ? length : size - 2;
        host_board_link_push(bench.board, BOARD_LINK_SERIAL, data + 2, length);
        return 2 + length;
    case 't':
        ms = (uint32_t)data[1] << 8 | data[2];
        ms = ms < *budget ? ms : *budget;
        *budget -= ms;
        run(ms);
        return 3;
    case 'i':
        set_input((data[1] & 15) % BOARD_INPUTS, data[1] >> 7);
        return 2;
    case 's':
        bench.supply_mv = data[1] * 100;
        return 2;
    case 'f':
        host_board_feedback(bench.board, data[1] % 6, data[1] >> 7, host_board_now(bench.board));
        return 2;
    case 'h':
        safety_heartbeat(bench.core);
        return 1;
    case 'g':
        if (*budget < 30000)
            return 0;
        *budget -= 30000;
        get_going(data[1]);
        return 2;
    case 'w':
        host_board_reset(bench.board, BOARD_RESET_WATCHDOG);
        return 1;
    default:
        return 1;
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    uint32_t budget = BUDGET_MS;

    if (begin())
        for (size_t at = 0, taken; at < size && (taken = item(data + at, size - at, &budget)) > 0; at += taken)
            ;
    if (bench.board)
        host_board_destroy(bench.board);
    return 0;
}
