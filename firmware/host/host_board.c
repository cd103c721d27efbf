/* The board in virtual time: clock, interrupts, main loop, resets, and the far ends of its links. */
#include "firmware/host/host_board_priv.h"

#include "proto/base/memory.h"

#include <string.h>

size_t host_queue_put(struct host_queue *queue, const uint8_t *data, size_t size)
{
    size_t room = sizeof queue->data - queue->count;

    if (size > room)
        size = room;
    for (size_t i = 0; i < size; i++)
        queue->data[(queue->head + queue->count + i) % sizeof queue->data] = data[i];
    queue->count += size;
    return size;
}

size_t host_queue_get(struct host_queue *queue, uint8_t *data, size_t size)
{
    if (size > queue->count)
        size = queue->count;
    for (size_t i = 0; i < size; i++)
        data[i] = queue->data[(queue->head + i) % sizeof queue->data];
    queue->head = (queue->head + size) % sizeof queue->data;
    queue->count -= size;
    return size;
}

struct host_board *host_board_create(const struct host_board_wires *wires)
{
    struct host_board *board = lumi_calloc(1, sizeof *board);

    if (!board)
        return NULL;
    if (wires)
        board->wires = *wires;
    host_port_init(board);
    host_board_set_loop(board, BOARD_TICK_HZ / 50000, BOARD_TICK_HZ / 20);
    host_board_set_unique_id(board, 1);
    memset(board->flash, 0xff, sizeof board->flash);
    board->flash_cut = UINT64_MAX;
    board->powered = true;
    board->links[BOARD_LINK_SERIAL].up = true;
    board->cause = BOARD_RESET_POWER;
    return board;
}

void host_board_destroy(struct host_board *board)
{
    if (!board)
        return;
    lumi_free(board->core);
    lumi_free(board);
}

const struct board *host_board_port(struct host_board *board)
{
    return &board->port;
}

static void start_firmware(struct host_board *board)
{
    board->kicked = board->now;
    board->hang_until = 0;
    board->reset_wanted = false;
    if (board->handlers.reset)
        board->handlers.reset(board->handlers.context);
    board->last_poll = board->now;
    board->poll_at = board->now + board->latency;
}

void host_board_attach(struct host_board *board, const struct host_board_handlers *handlers)
{
    board->handlers = *handlers;
    start_firmware(board);
}

struct core *host_board_core(struct host_board *board)
{
    return board->core;
}

void host_board_set_loop(struct host_board *board, uint32_t latency, uint32_t longest)
{
    board->latency = latency ? latency : 1;
    board->longest = longest > board->latency ? longest : board->latency;
}

void host_board_set_unique_id(struct host_board *board, uint32_t number)
{
    memset(board->id, 0, sizeof board->id);
    memcpy(board->id, "SIM", 3);
    for (int i = 0; i < 4; i++)
        board->id[4 + i] = (uint8_t)(number >> (8 * i));
}

uint64_t host_board_now(const struct host_board *board)
{
    return board->now;
}

void host_set_lines(struct host_board *board, uint16_t lines)
{
    if (!board->powered || lines == board->lines)
        return;
    board->lines = lines;
    if (board->wires.trigger_lines)
        board->wires.trigger_lines(board->wires.context, board->now, lines);
}

void host_set_output(struct host_board *board, enum board_output output, bool active)
{
    if (board->outputs[output] == active)
        return;
    board->outputs[output] = active;
    if (board->wires.output)
        board->wires.output(board->wires.context, board->now, output, active);
}

/* As after a reset: every pin an input, pulled to inactive on the board. */
static void pins_inactive(struct host_board *board)
{
    board->stepping = board->triggering = false;
    board->steps_called++;
    host_set_lines(board, 0);
    for (int output = 0; output < BOARD_OUTPUTS; output++)
        host_set_output(board, (enum board_output)output, false);
}

static void links_empty(struct host_board *board)
{
    for (int link = 0; link < BOARD_LINKS; link++)
        board->links[link].in.count = board->links[link].out.count = 0;
}

void host_power_gone(struct host_board *board)
{
    pins_inactive(board);
    links_empty(board);
    board->powered = false;
}

void host_board_reset(struct host_board *board, enum board_reset cause)
{
    if (!board->powered)
        return;
    pins_inactive(board);
    links_empty(board);
    board->cause = cause;
    board->counts.resets++;
    start_firmware(board);
}

void host_board_power(struct host_board *board, bool on)
{
    if (on == board->powered)
        return;
    if (!on) {
        host_power_gone(board);
        return;
    }
    board->powered = true;
    host_board_reset(board, BOARD_RESET_POWER);
}

bool host_board_powered(const struct host_board *board)
{
    return board->powered;
}

void host_board_hang(struct host_board *board, uint64_t until)
{
    board->hang_until = until;
}

void host_board_cut_in_flash(struct host_board *board, uint64_t bytes)
{
    board->flash_cut = bytes;
}

const struct host_board_counts *host_board_counts(const struct host_board *board)
{
    return &board->counts;
}

static uint64_t earlier(uint64_t a, uint64_t b)
{
    return a < b ? a : b;
}

/* An interrupt wakes the main loop. */
static void wake(struct host_board *board)
{
    board->poll_at = earlier(board->poll_at, board->now + board->latency);
}

/* When the main loop comes round next. */
static uint64_t next_poll(const struct host_board *board)
{
    return board->poll_at > board->hang_until ? board->poll_at : board->hang_until;
}

static uint64_t watchdog_at(const struct host_board *board)
{
    return board->handlers.poll ? board->kicked + HOST_BOARD_WATCHDOG_TICKS : BOARD_NEVER;
}

uint64_t host_board_next(struct host_board *board)
{
    uint64_t next = BOARD_NEVER;

    if (!board->powered)
        return BOARD_NEVER;
    if (board->stepping)
        next = earlier(next, board->step_at);
    if (board->triggering)
        next = earlier(next, board->trigger_at);
    if (board->handlers.poll)
        next = earlier(next, earlier(next_poll(board), watchdog_at(board)));
    return next > board->now ? next : board->now;
}

static void step_pulse(struct host_board *board)
{
    uint64_t at = board->step_at;
    uint32_t gap = board->step_gap, calls = board->steps_called, after = 0;

    board->counts.steps++;
    if (board->wires.step)
        board->wires.step(board->wires.context, at, board->forward);
    if (board->handlers.on_step)
        after = board->handlers.on_step(board->handlers.context, at);
    if (calls == board->steps_called) {
        board->stepping = gap != 0;
        board->step_at = at + gap;
        board->step_gap = after;
    }
    wake(board);
}

static void trigger_edge(struct host_board *board)
{
    board->triggering = false;
    board->counts.triggers++;
    host_set_lines(board, board->trigger_lines);
    if (board->handlers.on_trigger)
        board->handlers.on_trigger(board->handlers.context, board->now);
    wake(board);
}

static void poll_loop(struct host_board *board)
{
    uint64_t next;

    board->counts.polls++;
    board->last_poll = board->now;
    board->handlers.poll(board->handlers.context);
    if (!board->powered)
        return;
    if (board->reset_wanted) {
        host_board_reset(board, BOARD_RESET_SOFTWARE);
        return;
    }
    next = board->handlers.next_poll ? board->handlers.next_poll(board->handlers.context) : BOARD_NEVER;
    next = earlier(next, board->now + board->longest);
    board->poll_at = next > board->now + board->latency ? next : board->now + board->latency;
}

/* Does the first thing that is due at or before `to`; false: nothing is. */
static bool run_one(struct host_board *board, uint64_t to)
{
    uint64_t next = host_board_next(board);

    if (next > to || next == BOARD_NEVER)
        return false;
    if (next > board->now)
        board->now = next;
    if (board->stepping && board->step_at <= board->now)
        step_pulse(board);
    else if (board->triggering && board->trigger_at <= board->now)
        trigger_edge(board);
    else if (watchdog_at(board) <= board->now)
        host_board_reset(board, BOARD_RESET_WATCHDOG);
    else
        poll_loop(board);
    return true;
}

void host_board_run(struct host_board *board, uint64_t to)
{
    while (run_one(board, to))
        ;
    if (to > board->now)
        board->now = to;
}

void host_board_input(struct host_board *board, enum board_input input, bool active, uint64_t at)
{
    if (at > board->now)
        board->now = at;
    if (!board->powered)
        return;
    if (board->handlers.on_input)
        board->handlers.on_input(board->handlers.context, input, active, at);
    wake(board);
}

void host_board_feedback(struct host_board *board, int input, bool active, uint64_t at)
{
    if (at > board->now)
        board->now = at;
    if (!board->powered)
        return;
    if (board->handlers.on_feedback)
        board->handlers.on_feedback(board->handlers.context, input, active, at);
    wake(board);
}

size_t host_board_link_push(struct host_board *board, enum board_link link, const uint8_t *data, size_t size)
{
    size_t taken;

    if (!board->powered)
        return size; /* into the void */
    taken = host_queue_put(&board->links[link].in, data, size);
    board->counts.overrun += (uint32_t)(size - taken);
    wake(board);
    return taken;
}

size_t host_board_link_pull(struct host_board *board, enum board_link link, uint8_t *data, size_t size)
{
    return host_queue_get(&board->links[link].out, data, size);
}

void host_board_link_set_up(struct host_board *board, enum board_link link, bool up)
{
    board->links[link].up = up;
}
