/* Inside the board in virtual time: shared by host_board.c (time and interrupts), host_port.c (struct board) and
 * host_core.c (the core on it). */
#ifndef LUMI_FIRMWARE_HOST_BOARD_PRIV_H
#define LUMI_FIRMWARE_HOST_BOARD_PRIV_H

#include "firmware/host/host_board.h"

#define HOST_LINK_BYTES 8192

struct host_queue {
    uint8_t data[HOST_LINK_BYTES];
    size_t head, count;
};
size_t host_queue_put(struct host_queue *queue, const uint8_t *data, size_t size);
size_t host_queue_get(struct host_queue *queue, uint8_t *data, size_t size);

struct host_board {
    struct board port;
    struct host_board_wires wires;
    struct host_board_handlers handlers;
    struct host_board_counts counts;
    struct core *core;
    uint64_t now;
    uint32_t latency, longest;

    bool powered, forward, stepping, triggering, polling;
    bool reset_wanted; /* by the firmware, from inside a poll */
    enum board_reset cause;
    uint64_t step_at, trigger_at, poll_at, last_poll, kicked, hang_until;
    uint32_t step_gap;     /* ticks from the next pulse to the one after; 0: the next is the last */
    uint32_t steps_called; /* starts and stops so far: a handler that calls one rules over what it returns */
    uint16_t trigger_lines, lines;
    bool outputs[BOARD_OUTPUTS];
    unsigned locks;

    struct {
        struct host_queue in, out;
        bool up;
    } links[BOARD_LINKS];
    uint8_t flash[BOARD_PROFILE_SLOTS][BOARD_PROFILE_SLOT_SIZE];
    uint64_t flash_cut; /* bytes until the power goes */
    uint8_t id[BOARD_UNIQUE_ID];
};

void host_port_init(struct host_board *board);
void host_set_lines(struct host_board *board, uint16_t lines);
void host_set_output(struct host_board *board, enum board_output output, bool active);
/* Everything stops where it is; nothing the firmware still asks for has an effect. */
void host_power_gone(struct host_board *board);

#endif
