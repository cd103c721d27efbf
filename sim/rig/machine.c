/* A whole rig in virtual time: the order of all that happens. */
#include "sim/rig/machine_priv.h"

#include "sim/rig/faults_run.h"

#include <string.h>

void sim_machine_options_init(struct sim_machine_options *options, const struct lumi_rig *truth)
{
    memset(options, 0, sizeof *options);
    sim_mechanics_options_init(&options->mechanics, truth);
    options->seed = 1;
    options->link = BOARD_LINK_USB;
    options->link_delay = 0.5e-3;
    options->link_rate = 500e3;
    options->host = true;
}

/* ---- the board's wires ---- */

static void wire_step(void *context, uint64_t at, bool forward)
{
    struct sim_machine *m = context;

    g_array_append_val(m->steps, at);
    sim_mechanics_step(m->mechanics, at, forward);
}

static void wire_lines(void *context, uint64_t at, uint16_t lines)
{
    struct sim_machine *m = context;

    sim_mechanics_trigger_lines(m->mechanics, at, lines);
}

static void wire_output(void *context, uint64_t at, enum board_output output, bool active)
{
    struct sim_machine *m = context;

    sim_mechanics_output(m->mechanics, at, output, active);
}

static bool wire_input(void *context, enum board_input input)
{
    struct sim_machine *m = context;

    return sim_mechanics_input(m->mechanics, input);
}

static bool wire_feedback(void *context, int input)
{
    struct sim_machine *m = context;

    return sim_mechanics_feedback(m->mechanics, input);
}

static int wire_supply(void *context)
{
    struct sim_machine *m = context;

    return sim_mechanics_supply_mv(m->mechanics);
}

/* ---- the mechanics' switches ---- */

static void heard_input(void *context, enum board_input input, bool active, uint64_t at)
{
    struct sim_machine *m = context;

    if (input == BOARD_IN_ESTOP)
        g_array_append_val(m->estops, at);
    host_board_input(m->board, input, active, at);
}

static void heard_feedback(void *context, int input, bool active, uint64_t at)
{
    struct sim_machine *m = context;

    host_board_feedback(m->board, input, active, at);
}

struct sim_machine *sim_machine_create(const struct lumi_rig *truth, const struct sim_machine_options *options)
{
    struct sim_machine *m = g_new0(struct sim_machine, 1);
    const struct host_board_wires wires = {m,          wire_step,     wire_lines, wire_output,
                                           wire_input, wire_feedback, wire_supply};
    struct sim_mechanics_options mechanics = options->mechanics;
    uint64_t start = 0;

    m->truth = *truth;
    m->options = *options;
    mechanics.seed = options->seed;
    m->events = g_array_new(FALSE, FALSE, sizeof(struct sim_machine_event));
    m->steps = g_array_new(FALSE, FALSE, sizeof(uint64_t));
    m->estops = g_array_new(FALSE, FALSE, sizeof(uint64_t));
    m->board_starts = g_array_new(FALSE, FALSE, sizeof(uint64_t));
    m->raw = g_byte_array_new();
    g_array_append_val(m->board_starts, start);
    sim_wire_path_init(&m->to_board, options->seed * 2 + 1, options->link_delay, options->link_rate);
    sim_wire_path_init(&m->to_host, options->seed * 2 + 2, options->link_delay, options->link_rate);
    m->mechanics = sim_mechanics_create(truth, &mechanics);
    m->board = host_board_create(&wires);
    if (!m->board) {
        sim_machine_destroy(m);
        return NULL;
    }
    host_board_set_unique_id(m->board, (uint32_t)options->seed);
    if (options->loop_latency)
        host_board_set_loop(m->board, options->loop_latency, options->loop_longest);
    host_board_link_set_up(m->board, options->link, true);
    if (!host_board_attach_core(m->board)) {
        sim_machine_destroy(m);
        return NULL;
    }
    lumi_wire_client_init(&m->client, &sim_machine_client_ops, m, options->seed + 1);
    return m;
}

void sim_machine_destroy(struct sim_machine *m)
{
    if (!m)
        return;
    sim_fault_run_free(m->faults);
    host_board_destroy(m->board);
    sim_mechanics_destroy(m->mechanics);
    sim_wire_path_finish(&m->to_board);
    sim_wire_path_finish(&m->to_host);
    g_array_free(m->events, TRUE);
    g_array_free(m->steps, TRUE);
    g_array_free(m->estops, TRUE);
    g_array_free(m->board_starts, TRUE);
    g_byte_array_free(m->raw, TRUE);
    g_free(m);
}

struct sim_mechanics *sim_machine_mechanics(struct sim_machine *m)
{
    return m->mechanics;
}

struct host_board *sim_machine_board(struct sim_machine *m)
{
    return m->board;
}

void sim_machine_set_faults(struct sim_machine *m, const struct sim_fault_script *script)
{
    sim_fault_run_free(m->faults);
    m->faults = script ? sim_fault_run_new(script, m->options.seed, m->now) : NULL;
}

uint64_t sim_machine_now(const struct sim_machine *m)
{
    return m->now;
}

double sim_machine_seconds(const struct sim_machine *m)
{
    return (double)m->now / BOARD_TICK_HZ;
}

static uint64_t next_of_all(struct sim_machine *m)
{
    uint64_t next = MIN(sim_mechanics_next(m->mechanics), host_board_next(m->board));

    next = MIN(next, MIN(sim_wire_path_next(&m->to_board), sim_wire_path_next(&m->to_host)));
    if (m->options.host && !m->host_gone)
        next = MIN(next, sim_machine_ticks(lumi_wire_client_next_poll(&m->client)));
    if (m->faults)
        next = MIN(next, sim_fault_run_next(m->faults));
    return MAX(next, m->now);
}

/* What the board has written goes on the line. */
static void collect(struct sim_machine *m)
{
    uint8_t bytes[512];
    size_t size;

    while ((size = host_board_link_pull(m->board, m->options.link, bytes, sizeof bytes)) > 0)
        sim_wire_path_send(&m->to_host, m->now, bytes, size);
}

static void deliver(struct sim_machine *m)
{
    GBytes *bytes;
    gsize size;

    while ((bytes = sim_wire_path_take(&m->to_board, m->now))) {
        const uint8_t *data = g_bytes_get_data(bytes, &size);
        host_board_link_push(m->board, m->options.link, data, size);
        g_bytes_unref(bytes);
    }
    while ((bytes = sim_wire_path_take(&m->to_host, m->now))) {
        const uint8_t *data = g_bytes_get_data(bytes, &size);
        if (!m->options.host)
            g_byte_array_append(m->raw, data, (guint)size);
        else if (!m->host_gone)
            lumi_wire_client_receive(&m->client, data, size, sim_machine_ns(m->now));
        g_bytes_unref(bytes);
    }
    if (m->options.host && !m->host_gone && sim_machine_ticks(lumi_wire_client_next_poll(&m->client)) <= m->now)
        lumi_wire_client_poll(&m->client, sim_machine_ns(m->now));
}

/* Whatever is due next, at most `limit`. */
static void once(struct sim_machine *m, uint64_t limit)
{
    const struct sim_mechanics_listener listener = {m, heard_input, heard_feedback};

    m->now = MIN(next_of_all(m), limit);
    sim_mechanics_advance(m->mechanics, m->now, &listener);
    host_board_run(m->board, m->now);
    collect(m);
    deliver(m);
    if (m->faults)
        sim_fault_run_poll(m->faults, m);
    if (host_board_counts(m->board)->resets != m->resets) {
        m->resets = host_board_counts(m->board)->resets;
        g_array_append_val(m->board_starts, m->now);
    }
}

bool sim_machine_run_until(struct sim_machine *m, sim_machine_condition done, void *context, double seconds)
{
    uint64_t limit = m->now + (uint64_t)(seconds * BOARD_TICK_HZ);

    for (;;) {
        if (done && done(m, context))
            return true;
        if (m->now >= limit)
            return false;
        once(m, limit);
    }
}

void sim_machine_run(struct sim_machine *m, double seconds)
{
    sim_machine_run_until(m, NULL, NULL, seconds);
}

void sim_machine_release_host(struct sim_machine *m)
{
    m->options.host = false;
    sim_wire_path_clear(&m->to_board);
    sim_wire_path_clear(&m->to_host);
}

void sim_machine_put(struct sim_machine *m, const uint8_t *data, size_t size)
{
    if (!m->unplugged)
        sim_wire_path_send(&m->to_board, m->now, data, size);
}

size_t sim_machine_get(struct sim_machine *m, uint8_t *data, size_t size)
{
    size = MIN(size, m->raw->len);
    if (size > 0) {
        memcpy(data, m->raw->data, size);
        g_byte_array_remove_range(m->raw, 0, (guint)size);
    }
    return size;
}

const uint64_t *sim_machine_step_ticks(const struct sim_machine *m, int *count)
{
    *count = (int)m->steps->len;
    return (const uint64_t *)(const void *)m->steps->data;
}

const uint64_t *sim_machine_estop_ticks(const struct sim_machine *m, int *count)
{
    *count = (int)m->estops->len;
    return (const uint64_t *)(const void *)m->estops->data;
}

const uint64_t *sim_machine_start_ticks(const struct sim_machine *m, int *count)
{
    *count = (int)m->board_starts->len;
    return (const uint64_t *)(const void *)m->board_starts->data;
}

/* ---- what goes wrong ---- */

void sim_machine_estop(struct sim_machine *m, bool pressed)
{
    sim_mechanics_force_input(m->mechanics, BOARD_IN_ESTOP, pressed ? SIM_FORCE_ACTIVE : SIM_FORCE_NONE);
}

void sim_machine_power(struct sim_machine *m, bool on)
{
    host_board_power(m->board, on);
    if (m->options.link == BOARD_LINK_USB && !on)
        sim_machine_unplug(m, true);
    else if (m->options.link == BOARD_LINK_USB)
        sim_machine_unplug(m, false);
}

void sim_machine_reset(struct sim_machine *m, enum board_reset cause)
{
    host_board_reset(m->board, cause);
}

void sim_machine_link_cut(struct sim_machine *m, bool cut)
{
    m->to_board.cut = m->to_host.cut = cut;
    if (cut) {
        sim_wire_path_clear(&m->to_board);
        sim_wire_path_clear(&m->to_host);
    }
}

void sim_machine_unplug(struct sim_machine *m, bool unplugged)
{
    if (m->unplugged == unplugged)
        return;
    m->unplugged = unplugged;
    sim_machine_link_cut(m, unplugged);
    host_board_link_set_up(m->board, m->options.link, !unplugged);
    if (!unplugged)
        lumi_wire_client_reconnected(&m->client, sim_machine_ns(m->now));
}

void sim_machine_link_noise(struct sim_machine *m, double share)
{
    m->to_board.noise = m->to_host.noise = share;
}

void sim_machine_host_gone(struct sim_machine *m, bool gone)
{
    m->host_gone = gone;
}
