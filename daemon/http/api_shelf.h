/* What the files about captures on the shelf share: who is at one, what verifying found. */
#ifndef LUMI_DAEMON_HTTP_API_SHELF_H
#define LUMI_DAEMON_HTTP_API_SHELF_H

#include "daemon/http/api_priv.h"
#include "daemon/shelf/shelf.h"

#include <stdatomic.h>

struct journal;
struct lumi_api_shelf {
    struct lumi_http *http;
    struct lumi_api_worker *slow;    /* verifies, removes: minutes */
    struct lumi_api_worker *carrier; /* reads bundles, takes away: soon done */
    atomic_bool ending;
    struct journal *journal; /* the slow worker's; NULL: results are kept for this run only */
    pthread_mutex_t lock;
    GHashTable *results; /* under the lock: name → struct lumi_api_verified */
    /* In the server's thread. */
    GHashTable *busy; /* name → what is done with it, a word; none twice */
    GPtrArray *downloads;
    GSource *tick;
};

struct lumi_api_verified {
    char seal[65];
    int64_t unix_us;
    bool good;
    char text[512];
};

/* Takes the name for this, or says (409) what is done with it already. Server's thread, as the next. */
bool lumi_api_shelf_take(struct lumi_api_shelf *shelf, SoupServerMessage *message, const char *name, const char *what);
void lumi_api_shelf_give_back(struct lumi_api_shelf *shelf, const char *name);

/* api_bundle.c */
void lumi_api_bundles_end(struct lumi_api_shelf *shelf); /* the server's thread is no more, the carrier has ended */

/* api_delete.c: what is left of captures that were thrown away, in the slow worker. */
void lumi_api_shelf_tidy(struct lumi_api_shelf *shelf);
/* api_verify.c */
int lumi_api_shelf_remember(void *shelf, const char *name, const struct lumi_api_verified *verified);
struct journal *lumi_api_verified_open(struct lumi_api_shelf *shelf);
/* Reads every file of `path`; `problem` gets the first of what was found, `progress` is told now and then. */
int lumi_api_shelf_verify(struct lumi_api_shelf *shelf, const char *name, const char *path,
                          struct lumi_api_verified *found, struct lumi_error *error);
void lumi_api_tell_verify(struct lumi_api_shelf *shelf, const char *name, const char *state, int64_t done,
                          int64_t total, const char *text);

#endif
