/* A host for the emulated board: the wire protocol's own client (proto/wire) on the serial line or on USB, in the
 * board's virtual time. Functions that wait let the machine run. */
#ifndef LUMI_SIM_BOARD_BOARD_CLIENT_H
#define LUMI_SIM_BOARD_BOARD_CLIENT_H

#include "proto/mechanism/sweep_plan.h"
#include "proto/wire/client.h"
#include "sim/board/f405_machine.h"

struct board_client;

/* `link`: enumerates the device first where it is USB. NULL: no memory, or no device. The machine stays the caller's.
 */
struct board_client *board_client_create(struct f405_machine *machine, enum board_link link);
void board_client_destroy(struct board_client *client);
/* What of the client library is to be seen: session, counters. */
const struct lumi_wire_client *board_client_wire(const struct board_client *client);
/* USB: after an unplugging or a reset of the board, from the beginning again. */
bool board_client_reconnect(struct board_client *client);

/* Lets time pass. LUMI_ERR_INTERNAL with the chip's words where it stopped with a fault. */
int board_client_run(struct board_client *client, double seconds, struct lumi_error *error);
/* Until there is a session. */
int board_client_open(struct board_client *client, double seconds, struct lumi_error *error);
/* Sends a request and waits for its reply (may be NULL): LUMI_ERR_BUSY where it is refused, LUMI_ERR_FORMAT where it is
 * bad, LUMI_ERR_IO where no answer comes or it was lost with a restart. */
int board_client_request(struct board_client *client, lumi_wire_Request *request, lumi_wire_Reply *reply,
                         struct lumi_error *error);
/* The profile's bytes to the board, and the commit; what the commit answered. */
int board_client_configure(struct board_client *client, const struct lumi_rig *rig, struct lumi_error *error);
int board_client_status(struct board_client *client, lumi_wire_Status *status, struct lumi_error *error);
int board_client_home(struct board_client *client, bool wind_up, int turn, struct lumi_error *error);
int board_client_load_plan(struct board_client *client, const struct lumi_plan *plan, struct lumi_error *error);
int board_client_start(struct board_client *client, const struct lumi_plan *plan, uint32_t first_shot,
                       bool only_missing, struct lumi_error *error);
/* Until the sweep ends (however; `ended` may be NULL), or so many seconds have passed. */
int board_client_wait_sweep(struct board_client *client, double seconds, lumi_wire_SweepEnded *ended,
                            struct lumi_error *error);
/* Releases every fault that stands. */
int board_client_clear(struct board_client *client, struct lumi_error *error);

/* Events so far. */
const lumi_wire_Event *board_client_events(const struct board_client *client, int *count);
uint32_t board_client_events_lost(const struct board_client *client);

#endif
