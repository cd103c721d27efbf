/* Work that may block, done beside the main loop: pools of threads with a first-in-first-out list each, and the inbox
 * through which everything comes back to the loop's thread. */
#ifndef LUMI_DAEMON_LUMID_TASKS_H
#define LUMI_DAEMON_LUMID_TASKS_H

#include "proto/base/result.h"

#include <stdbool.h>

/* The first member of what is allocated by malloc for one piece of work. */
struct lumi_task {
    struct lumi_task *next;
    void (*work)(struct lumi_task *task); /* in a thread of the pool; NULL: posted to the inbox at once */
    void (*done)(struct lumi_task *task); /* in the loop's thread; `task` is freed after it */
};

/* ---- back to the loop ---- */

struct lumi_inbox;
int lumi_inbox_create(struct lumi_inbox **inbox, struct lumi_error *error);
void lumi_inbox_destroy(struct lumi_inbox *inbox); /* frees what was not taken */
int lumi_inbox_fd(const struct lumi_inbox *inbox); /* readable: something has come, or somebody has woken it */
void lumi_inbox_wake(void *inbox);                 /* from any thread; a callback for those who want one */
void lumi_inbox_post(struct lumi_inbox *inbox, struct lumi_task *task); /* from any thread */
void lumi_inbox_run(struct lumi_inbox *inbox);                          /* calls `done` of all that have come */

/* ---- threads ---- */

struct lumi_pool;
/* At most `limit` tasks wait. */
int lumi_pool_create(struct lumi_inbox *inbox, int threads, int limit, struct lumi_pool **pool,
                     struct lumi_error *error);
/* False: the list is full; the task is still the caller's. */
bool lumi_pool_give(struct lumi_pool *pool, struct lumi_task *task);
/* Waits for what is being done; what waits is freed. NULL is fine. */
void lumi_pool_destroy(struct lumi_pool *pool);

#endif
