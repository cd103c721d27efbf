/* What the files of this folder share. */
#ifndef LUMI_DAEMON_STORE_STORE_PRIV_H
#define LUMI_DAEMON_STORE_STORE_PRIV_H

#include "daemon/store/store.h"

#include <pthread.h>

enum store_stage {
    STORE_WAITING = 0, /* a frame whose bytes are not on the disk yet */
    STORE_WRITING,
    STORE_READY /* for its rows; or failed (code) */
};

/* A job on its way. */
struct store_entry {
    struct store_entry *next;
    struct lumi_store_job job;
    enum store_stage stage;
    uint64_t number; /* in the order given */
    size_t bytes;    /* counted as waiting */
    int64_t given_ns;
    char temporary[40]; /* in the folder of frames; "" none */
    int64_t written;
    char sha256[65];
    int code;
    struct lumi_store_done done;
    char text[512]; /* of a failure */
};

#define STORE_SECONDS 60
#define STORE_WRITERS 16
#define STORE_GROUP 256 /* jobs of one commit */

struct lumi_store {
    struct lumi_capture *capture; /* the commit thread's */
    struct lumi_store_options options;
    char *second_copy;
    int folder; /* descriptor of data/frames; the capture's */

    pthread_mutex_t lock;      /* guards what follows */
    pthread_cond_t to_write;   /* something waits for a writer, or it is over */
    pthread_cond_t to_commit;  /* something may be ready for the commit thread, or it is over */
    struct store_entry *first; /* given and not done, in that order */
    struct store_entry **last; /* where the next is hung */
    struct store_entry *done;  /* finished, the oldest first */
    struct store_entry **done_last;
    int jobs, committing;
    size_t waiting;
    uint64_t count;
    bool stopping, sealed;
    int64_t stored_bytes;
    struct {
        int64_t second, bytes;
        double slowest;
    } seconds[STORE_SECONDS];
    pthread_t writers[STORE_WRITERS], committer;
    int writer_count;
    bool has_committer;
};

/* ---- store_write.c ---- */

/* Brings a frame's bytes to the disk under entry->temporary, synced, with their checksum; sets entry->code. */
void store_write(struct lumi_store *store, struct store_entry *entry);

/* ---- store_commit.c ---- */

/* Does what these jobs say, in one transaction; sets their codes. Only on the thread that owns the capture. */
void store_commit(struct lumi_store *store, struct store_entry **group, int count);

#endif
