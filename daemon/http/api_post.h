/* Letters between the server's thread and the engine's: a list under a lock, read in the thread of a main context.
 *
 * The server has a thread of its own, so that an emergency stop is heard whatever holds the engine's up. Neither
 * touches what is the other's: what is asked of the engine goes over as a letter, and so does what comes of it. */
#ifndef LUMI_DAEMON_HTTP_API_POST_H
#define LUMI_DAEMON_HTTP_API_POST_H

#include "proto/base/result.h"

#include <glib.h>
#include <stdbool.h>

struct lumi_api_letter {
    /* In the thread of the context; the letter is the callee's again. `dropped`: nobody will read it, in whatever
     * thread that is seen: it is only to be freed. */
    void (*read)(struct lumi_api_letter *letter, bool dropped);
    struct lumi_api_letter *next; /* the post's */
};

struct lumi_api_post;
/* Letters are read where `context` runs; NULL: the default one. */
int lumi_api_post_create(GMainContext *context, struct lumi_api_post **post, struct lumi_error *error);
/* From any thread. They are read in this order. */
void lumi_api_post_give(struct lumi_api_post *post, struct lumi_api_letter *letter);
/* What is left is dropped. NULL is fine. */
void lumi_api_post_destroy(struct lumi_api_post *post);

/* Attaches a new source to the context of this thread and keeps it; lumi_api_drop ends it, and forgets it. A source
 * that ends by itself (G_SOURCE_REMOVE) is dropped by its own function. */
GSource *lumi_api_attach(GSource *source, int priority, GSourceFunc function, void *context);
void lumi_api_drop(GSource **source);

#endif
