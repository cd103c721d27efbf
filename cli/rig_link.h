/* What the commands that talk to a rig's board share. */
#ifndef LUMI_CLI_RIG_LINK_H
#define LUMI_CLI_RIG_LINK_H

#include "cli/command.h"
#include "daemon/rig/bench.h"

#define CLI_RIG_LINK_OPTION(variable)                                                                                  \
    {                                                                                                                  \
        "link", 'l', 0, G_OPTION_ARG_STRING, &(variable),                                                              \
            "usb:SERIAL, serial:/dev/ttyUSB0[,baud=N][,rs485], unix:PATH (the one board on USB)", "ADDRESS"            \
    }
#define CLI_RIG_JSON_OPTION(variable)                                                                                  \
    {                                                                                                                  \
        "json", 0, 0, G_OPTION_ARG_NONE, &(variable), "one JSON object on standard output", NULL                       \
    }

/* Waits some seconds for the board. The link only looks (bench.h). */
int cli_rig_open(const char *address, struct lumi_rig_link **link, struct lumi_error *error);
/* From here on Ctrl-C is counted; cli_rig_interrupts says how often. */
void cli_rig_catch_interrupts(void);
int cli_rig_interrupts(void *context);
/* Progress of what moves. */
void cli_rig_progress(void *context, const lumi_wire_Status *status);
/* Unix time less CLOCK_MONOTONIC, now. */
int64_t cli_rig_utc_offset_ns(void);

#endif
