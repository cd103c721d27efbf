/* A capture copied from where it lies to where captures are kept: whole and verified, or not at all. For a thread that
 * may wait. */
#ifndef LUMI_DAEMON_HANDOVER_INGEST_COPY_H
#define LUMI_DAEMON_HANDOVER_INGEST_COPY_H

#include "proto/base/result.h"

#include <stdbool.h>
#include <stdint.h>

#define INGEST_IDENTITY 65 /* with its end */

/* The SHA-256 of its seal, in hexadecimal. LUMI_ERR_NOTFOUND: it is not sealed. */
int ingest_seal_of(const char *capture, char identity[INGEST_IDENTITY], struct lumi_error *error);
/* What lies in a folder. */
struct ingest_look {
    uint64_t sum;         /* over names, sizes and times of everything */
    int64_t bytes, files; /* below data/ */
};
void ingest_look(const char *folder, struct ingest_look *look);
/* Whether so much lies there as the bag says it has (Payload-Oxum; RFC 8493, 2.2.2). */
bool ingest_is_whole(const char *capture, const struct ingest_look *look);
/* Whether somebody has it open for writing. */
bool ingest_is_held(const char *capture);

struct ingest_task {
    const char *source, *partial, *target;
    const char *identity; /* of the seal; "" for one that is not sealed: it is sealed here */
    /* Told before every block; non-zero: LUMI_ERR_CANCELLED. */
    int (*progress)(void *context, bool verifying, int64_t bytes);
    void *context;
};
/* Goes on with what an earlier attempt has left in `partial`. LUMI_ERR_CHECKSUM and other codes of bad input: it cannot
 * be taken in, and partial is removed. */
int ingest_copy(const struct ingest_task *task, struct lumi_error *error);

#endif
