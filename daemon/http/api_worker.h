/* One thread for what would hold the main loop up: looking for devices, reading the folder of captures. Jobs are done
 * one after another; what comes of one is told in the thread of the main loop. */
#ifndef LUMI_DAEMON_HTTP_API_WORKER_H
#define LUMI_DAEMON_HTTP_API_WORKER_H

#include "proto/base/result.h"

#include <stdbool.h>

struct lumi_api_worker;
struct lumi_api_job {
    void (*work)(struct lumi_api_job *job); /* in the thread */
    void (*done)(struct lumi_api_job *job); /* in the main loop; the job is the callee's again */
    struct lumi_api_job *next;              /* the worker's */
};

int lumi_api_worker_create(struct lumi_api_worker **worker, struct lumi_error *error);
/* Waits for the job that is being done; then `done` is called for all that are left, done or not. */
void lumi_api_worker_destroy(struct lumi_api_worker *worker);
/* False: too many wait already. */
bool lumi_api_worker_give(struct lumi_api_worker *worker, struct lumi_api_job *job);

#endif
