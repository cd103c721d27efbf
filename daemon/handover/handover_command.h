/* The processing command: its words for a capture, and what its output says of its progress. */
#ifndef LUMI_DAEMON_HANDOVER_HANDOVER_COMMAND_H
#define LUMI_DAEMON_HANDOVER_HANDOVER_COMMAND_H

#include "daemon/handover/handover.h"

/* Words as a shell would split them, with %c, %n, %w, %o and %% replaced. *words is NULL-terminated; release with
 * g_strfreev. LUMI_ERR_FORMAT. */
int handover_words(const char *command, const char *capture, char ***words, struct lumi_error *error);

/* What a line of output says; it is kept as status->text where it is not empty. Whether anything changed. */
bool handover_read_line(const char *line, struct lumi_process_status *status);

#endif
