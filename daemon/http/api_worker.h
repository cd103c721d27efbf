/* One thread for what would hold the server up: looking for devices, reading the folder of captures. Jobs are done
 * one after another; what comes of one is told by a letter. */
#ifndef LUMI_DAEMON_HTTP_API_WORKER_H
#define LUMI_DAEMON_HTTP_API_WORKER_H

#include "daemon/http/api_post.h"

struct lumi_api_worker;
struct lumi_api_job {
    struct lumi_api_letter letter;          /* posted when it is done; dropped when it will not be */
    void (*work)(struct lumi_api_job *job); /* in the thread */
    struct lumi_api_job *next;              /* the worker's */
};

int lumi_api_worker_create(struct lumi_api_post *back, struct lumi_api_worker **worker, struct lumi_error *error);
/* Waits for the job that is being done; those that wait are dropped. NULL is fine. */
void lumi_api_worker_destroy(struct lumi_api_worker *worker);
/* False: too many wait already. */
bool lumi_api_worker_give(struct lumi_api_worker *worker, struct lumi_api_job *job);

#endif
