/* Watching a capture as lumid takes it. */
#ifndef LUMI_CLI_CAPTURE_WATCH_H
#define LUMI_CLI_CAPTURE_WATCH_H

#include "cli/lumid_client.h"

struct cli_watch {
    bool json;   /* every event as a line; otherwise words, and one line of progress on a terminal */
    bool follow; /* goes on when the capture has ended */
};
/* Until the capture has ended: LUMI_OK where it is complete, otherwise LUMI_ERR_IO, with what is wrong. */
int cli_watch_capture(struct cli_lumid *lumid, const struct cli_watch *watch, struct lumi_error *error);
/* Until the preflight has a verdict. LUMI_OK: it goes on; LUMI_ERR_IO: it is red. *answer (transfer full) has the
 * checks. */
int cli_capture_await(struct cli_lumid *lumid, JsonNode **answer, char **text, struct lumi_error *error);

#endif
