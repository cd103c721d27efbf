/* What becomes of a capture that is complete: the processing command of the configuration, as a separate program of
 * lower priority, its progress tracked; and captures that arrive in a folder, taken in each exactly once. Driven by the
 * GLib main loop of the thread that creates it (its default context); every function and callback is on that thread,
 * while files are copied and read on a thread of its own. docs/handover.md has the journals. */
#ifndef LUMI_DAEMON_HANDOVER_HANDOVER_H
#define LUMI_DAEMON_HANDOVER_HANDOVER_H

#include "proto/base/result.h"

#include <stdbool.h>
#include <stdint.h>

/* ---- processing ---- */

enum lumi_process_state { LUMI_PROCESS_WAITING = 0, LUMI_PROCESS_RUNNING, LUMI_PROCESS_DONE, LUMI_PROCESS_FAILED };
struct lumi_process_status {
    char capture[1024];
    enum lumi_process_state state;
    double progress; /* 0..1, of lines "progress: DONE/TOTAL STAGE" or "… NN%" that it prints; −1 unknown */
    char stage[64];
    int exit_status; /* FAILED: −signal where it was killed; 127 where it cannot be started */
    char text[512];  /* its last line */
};

struct lumi_handover;
struct lumi_handover_options {
    /* As in a shell, but without one: words, quotes; %c the capture, %n its name without ".capture", %w <capture>.work,
     * %o the field beside it (its name with ".lumi"), %% a percent sign. NULL or "": nothing is processed. A cluster's
     * submission is such a command too. It has LUMI_PROGRESS=1 in its environment, its directory is the capture's, and
     * it is a process group of its own. */
    const char *command;
    const char *journal; /* a file: what was handed over and how it ended, so that a restart goes on */
    int parallel;        /* at once (1) */
    int retries;         /* after a failure (0) */
    void (*changed)(void *context, const struct lumi_process_status *status);
    void *context;
};
void lumi_handover_options_init(struct lumi_handover_options *options);
/* LUMI_ERR_FORMAT: a command that cannot be parsed, a damaged journal. What was running when the program died is
 * started again. */
int lumi_handover_create(const struct lumi_handover_options *options, struct lumi_handover **handover,
                         struct lumi_error *error);
/* Running programs are told to end (SIGTERM) and are started again next time. Accepts NULL. */
void lumi_handover_destroy(struct lumi_handover *handover);
/* A capture that is sealed. Given twice, it is processed once, unless `again` (LUMI_ERR_BUSY while it is being
 * processed). When this returns it is in the journal: a program that is killed afterwards processes it next time. */
int lumi_handover_give(struct lumi_handover *handover, const char *capture, bool again, struct lumi_error *error);
int lumi_handover_list(struct lumi_handover *handover, struct lumi_process_status *list, int max); /* newest first */

/* ---- taking captures in ---- */

/* What lies in the folder stays as it is. A capture is known by its seal (SHA-256 of its tagmanifest-sha256.txt): the
 * same one is never taken in twice, whatever it is called; another one of a name that is taken becomes NAME-2. One that
 * is not sealed and that nobody writes any more is sealed on the way. Something that is no capture, or that does not
 * match its checksums, is refused, and looked at again when it changes. */

enum lumi_ingest_state {
    LUMI_INGEST_SEEN = 0,
    LUMI_INGEST_COPYING,
    LUMI_INGEST_VERIFYING,
    LUMI_INGEST_TAKEN,
    LUMI_INGEST_REFUSED
};
struct lumi_ingest_status {
    char source[1024], capture[1024];
    enum lumi_ingest_state state;
    int64_t bytes, total;
    char text[512];
};
struct lumi_ingest;
struct lumi_ingest_options {
    const char *folder;  /* watched */
    const char *into;    /* where captures are kept; on any disk */
    const char *journal; /* a file: what was taken in and what was refused */
    double settle; /* s without a change before what has appeared counts as whole (5); a sealed bag counts at once */
    double look;   /* s from look to look at the folder (1) */
    struct lumi_handover *handover; /* NULL: nothing follows */
    void (*changed)(void *context, const struct lumi_ingest_status *status);
    void *context;
};
void lumi_ingest_options_init(struct lumi_ingest_options *options);
int lumi_ingest_create(const struct lumi_ingest_options *options, struct lumi_ingest **ingest,
                       struct lumi_error *error);
void lumi_ingest_destroy(struct lumi_ingest *ingest); /* leaves what is half copied, to go on there; accepts NULL */
/* Nothing is being taken in, and nothing in the folder waits for it. */
bool lumi_ingest_idle(const struct lumi_ingest *ingest);
int lumi_ingest_list(struct lumi_ingest *ingest, struct lumi_ingest_status *list, int max);

#endif
