/* lumid itself: the parts of the daemon joined by one main loop.
 *
 * 1. The loop's thread owns engine, API, handover and ingest. The link, every camera, the store's writers, the GPIO
 *    edges have threads of their own; requests to the board, judging, the drive and looking at the disk are tasks of
 *    pools (tasks.h). Everything comes back through one inbox.
 * 2. An emergency stop goes from its own thread to the link, and to the drive, whatever the loop does: on a GPIO line
 *    from that of the edges, over HTTP from the server's.
 * 3. One lumid a folder of captures: <folder>/.lumid/lock. */
#ifndef LUMI_DAEMON_LUMID_SERVICE_H
#define LUMI_DAEMON_LUMID_SERVICE_H

#include "daemon/lumid/config.h"

struct lumi_service_options {
    const struct lumi_config *config; /* outlives the service */
    const char *ingest;               /* this folder alone is taken in, without a rig; NULL: the rig */
};
/* Starts everything, says that it is ready (sd_notify), runs until SIGTERM or SIGINT, ends everything. LUMI_ERR_BUSY:
 * another lumid has the folder; LUMI_ERR_NOTFOUND, LUMI_ERR_FORMAT, …: what the configuration names is not there. */
int lumi_service_run(const struct lumi_service_options *options, struct lumi_error *error);

/* One line to the journal or to standard error; `priority` as syslog's (3 error, 4 warning, 6 said). */
void lumi_service_log(int priority, const char *format, ...) __attribute__((format(printf, 2, 3)));
/* What the server and GLib say goes the same way, from now on. */
void lumi_service_log_libraries(void);

#endif
