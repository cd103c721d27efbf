/* The board in virtual time, as the firmware sees it: struct board over numbers in memory. */
#include "firmware/host/host_board_priv.h"

#include <string.h>

/* Flash of the STM32F405 at 32-bit parallelism: DS8626 rev 9, section 5.3.12, "Flash memory programming", typical: 16
 * µs a word, 250 ms to erase a sector of 16 KiB. */
#define FLASH_WORD_TICKS ((uint64_t)BOARD_TICK_HZ * 16 / 1000000)
#define FLASH_ERASE_TICKS ((uint64_t)BOARD_TICK_HZ / 4)

static uint64_t port_now(void *port)
{
    const struct host_board *board = port;

    return board->now;
}

static unsigned port_lock(void *port)
{
    struct host_board *board = port;

    return board->locks++;
}

static void port_unlock(void *port, unsigned state)
{
    struct host_board *board = port;

    board->locks = state;
}

static void port_steps_start(void *port, uint64_t at, bool forward, uint32_t first)
{
    struct host_board *board = port;

    if (!board->powered)
        return;
    board->stepping = true;
    board->forward = forward;
    board->step_at = at > board->now ? at : board->now + 1;
    board->step_gap = first;
    board->steps_called++;
}

static void port_steps_stop(void *port)
{
    struct host_board *board = port;

    board->stepping = false;
    board->steps_called++;
}

static void port_step_pulse_width(void *port, uint32_t ticks)
{
    (void)port;
    (void)ticks; /* the simulated driver takes any width */
}

static void port_trigger_at(void *port, uint64_t at, uint16_t lines)
{
    struct host_board *board = port;

    if (!board->powered)
        return;
    if (at < board->now)
        board->counts.late_triggers++;
    board->triggering = true;
    board->trigger_at = at > board->now ? at : board->now;
    board->trigger_lines = lines;
}

static void port_trigger_cancel(void *port)
{
    struct host_board *board = port;

    board->triggering = false;
}

static void port_trigger_lines(void *port, uint16_t lines)
{
    host_set_lines(port, lines);
}

static bool port_input(void *port, enum board_input input)
{
    const struct host_board *board = port;

    return board->wires.input && board->wires.input(board->wires.context, input);
}

static void port_output(void *port, enum board_output output, bool active)
{
    struct host_board *board = port;

    if (board->powered)
        host_set_output(board, output, active);
}

static bool port_feedback(void *port, int input)
{
    const struct host_board *board = port;

    return board->wires.feedback && board->wires.feedback(board->wires.context, input);
}

static int port_supply_mv(void *port)
{
    const struct host_board *board = port;

    return board->wires.supply_mv ? board->wires.supply_mv(board->wires.context) : 24000;
}

static enum board_reset port_reset_cause(void *port)
{
    const struct host_board *board = port;

    return board->cause;
}

static void port_watchdog_kick(void *port)
{
    struct host_board *board = port;

    board->kicked = board->now;
}

static void port_unique_id(void *port, uint8_t id[BOARD_UNIQUE_ID])
{
    const struct host_board *board = port;

    memcpy(id, board->id, BOARD_UNIQUE_ID);
}

static size_t port_link_read(void *port, enum board_link link, uint8_t *data, size_t size)
{
    struct host_board *board = port;

    return board->powered ? host_queue_get(&board->links[link].in, data, size) : 0;
}

static size_t port_link_write(void *port, enum board_link link, const uint8_t *data, size_t size)
{
    struct host_board *board = port;

    return board->powered ? host_queue_put(&board->links[link].out, data, size) : 0;
}

static bool port_link_up(void *port, enum board_link link)
{
    const struct host_board *board = port;

    return board->links[link].up;
}

/* How many of `size` bytes are still done before the power goes. */
static size_t before_cut(struct host_board *board, size_t size)
{
    if (board->flash_cut == UINT64_MAX)
        return size;
    if (board->flash_cut >= size) {
        board->flash_cut -= size;
        return size;
    }
    size = (size_t)board->flash_cut;
    board->flash_cut = UINT64_MAX;
    host_power_gone(board);
    return size;
}

static bool port_flash_erase(void *port, int slot)
{
    struct host_board *board = port;
    size_t done;

    if (!board->powered || slot < 0 || slot >= BOARD_PROFILE_SLOTS)
        return false;
    done = before_cut(board, BOARD_PROFILE_SLOT_SIZE);
    memset(board->flash[slot], 0xff, done);
    /* Cells caught in the middle of an erase read as anything: here, some bits have gone to 1 already. */
    for (size_t i = done; i < BOARD_PROFILE_SLOT_SIZE && !board->powered; i++)
        board->flash[slot][i] |= (uint8_t)(i * 0x9du >> 3);
    board->now += FLASH_ERASE_TICKS;
    return board->powered;
}

static bool port_flash_write(void *port, int slot, uint32_t offset, const void *data, size_t size)
{
    struct host_board *board = port;
    const uint8_t *bytes = data;
    size_t done;

    if (!board->powered || slot < 0 || slot >= BOARD_PROFILE_SLOTS || offset % 4 || size % 4 ||
        offset > BOARD_PROFILE_SLOT_SIZE || size > BOARD_PROFILE_SLOT_SIZE - offset)
        return false;
    done = before_cut(board, size);
    for (size_t i = 0; i < done; i++) {
        uint8_t *cell = &board->flash[slot][offset + i];
        board->counts.flash_faults += (*cell & bytes[i]) != bytes[i]; /* the same bits once more are no fault */
        *cell &= bytes[i];                                            /* programming only takes bits from 1 to 0 */
    }
    if (done < size)
        board->flash[slot][offset + done] &= bytes[done] | 0x55; /* half of the bits made it */
    board->now += (size + 3) / 4 * FLASH_WORD_TICKS;
    return board->powered;
}

static const uint8_t *port_flash_map(void *port, int slot)
{
    const struct host_board *board = port;

    return board->flash[slot];
}

static void port_enter_loader(void *port)
{
    struct host_board *board = port;

    board->counts.loader++;
    host_power_gone(board); /* the firmware runs no more; only a power cycle brings it back */
}

static void port_restart(void *port)
{
    struct host_board *board = port;

    board->reset_wanted = true;
    board->cause = BOARD_RESET_SOFTWARE;
}

/* No noise here: starts are counted, and boards differ. */
static uint32_t port_boot_number(void *port)
{
    const struct host_board *board = port;
    uint32_t mixed = board->counts.resets + 1;

    for (int i = 0; i < BOARD_UNIQUE_ID; i++)
        mixed = (mixed ^ board->id[i]) * 0x01000193u; /* FNV-1a (Fowler, Noll, Vo) */
    return mixed;
}

void host_port_init(struct host_board *board)
{
    board->port = (struct board){
        .name = "host",
        .port = board,
        .now = port_now,
        .lock = port_lock,
        .unlock = port_unlock,
        .steps_start = port_steps_start,
        .steps_stop = port_steps_stop,
        .step_pulse_width = port_step_pulse_width,
        .trigger_at = port_trigger_at,
        .trigger_cancel = port_trigger_cancel,
        .trigger_lines = port_trigger_lines,
        .input = port_input,
        .output = port_output,
        .feedback = port_feedback,
        .supply_mv = port_supply_mv,
        .reset_cause = port_reset_cause,
        .watchdog_kick = port_watchdog_kick,
        .unique_id = port_unique_id,
        .boot_number = port_boot_number,
        .link_read = port_link_read,
        .link_write = port_link_write,
        .link_up = port_link_up,
        .flash_erase = port_flash_erase,
        .flash_write = port_flash_write,
        .flash_map = port_flash_map,
        .enter_loader = port_enter_loader,
        .restart = port_restart,
    };
}
