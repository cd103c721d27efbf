/* The whole firmware on the board in virtual time. */
#include "firmware/host/host_board_priv.h"

#include "firmware/core/core.h"
#include "proto/base/memory.h"

#include <string.h>

/* RAM is lost: whatever the core does not set at its start shows as garbage, not as zeros. */
static void on_reset(void *context)
{
    struct host_board *board = context;

    memset(board->core, 0xa5, core_size());
    core_init(board->core, &board->port);
}

static void on_poll(void *context)
{
    struct host_board *board = context;

    core_poll(board->core);
}

static uint64_t on_next_poll(void *context)
{
    const struct host_board *board = context;

    return core_next_poll(board->core);
}

static uint32_t on_step(void *context, uint64_t at)
{
    struct host_board *board = context;

    return core_on_step(board->core, at);
}

static void on_trigger(void *context, uint64_t at)
{
    struct host_board *board = context;

    core_on_trigger(board->core, at);
}

static void on_input(void *context, enum board_input input, bool active, uint64_t at)
{
    struct host_board *board = context;

    core_on_input(board->core, input, active, at);
}

static void on_feedback(void *context, int input, bool active, uint64_t at)
{
    struct host_board *board = context;

    core_on_feedback(board->core, input, active, at);
}

bool host_board_attach_core(struct host_board *board)
{
    const struct host_board_handlers handlers = {board,   on_reset,   on_poll,  on_next_poll,
                                                 on_step, on_trigger, on_input, on_feedback};

    board->core = lumi_alloc(1, core_size());
    if (!board->core)
        return false;
    host_board_attach(board, &handlers);
    return true;
}
