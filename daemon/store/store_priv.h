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
    char sha256[65], file[LUMI_CAPTURE_PATH];
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
    struct store_copy *copy; /* NULL: no second one is wanted */
    int folder;              /* descriptor of data/frames; the capture's */

    pthread_mutex_t lock;      /* guards what follows */
    pthread_cond_t to_write;   /* something waits for a writer, or it is over */
    pthread_cond_t to_commit;  /* something may be ready for the commit thread, or it is over */
    struct store_entry *first; /* given and not done, in that order */
    struct store_entry **last; /* where the next is hung */
    struct store_entry *done;  /* finished, the oldest first */
    struct store_entry **done_last;
    int jobs, committing;
    int unwritten; /* frames whose bytes wait for the disk or are on their way to it */
    bool full;     /* the disk: what was reserved for rows is in use */
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

/* A full disk must still take rows: some bytes are set aside for them, and given up when a commit finds no room; until
 * they can be set aside again no frame is written. LUMI_ERR_NOSPACE. */
int store_reserve_kept(struct lumi_store *store, struct lumi_error *error);
/* False: there is nothing to give up. */
bool store_reserve_spend(struct lumi_store *store);
void store_reserve_remove(struct lumi_store *store);

/* ---- store_copy.c ---- */

/* Begins, or goes on with, the second copy; that it cannot be made is told by store_copy_tell. */
int store_copy_create(struct lumi_store *store, struct lumi_error *error);
void store_copy_destroy(struct store_copy *copy); /* stops where it is; accepts NULL */
/* With the store's lock. */
void store_copy_add(struct store_copy *copy, const char *file, const char *sha256, int64_t bytes);
void store_copy_wake(struct store_copy *copy);   /* store->unwritten became 0 */
void store_copy_finish(struct store_copy *copy); /* the first is sealed: waits until the second is verified, or not */
bool store_copy_step(struct store_copy *copy);   /* one file, on this thread; false: nothing to do */
void store_copy_tell(const struct store_copy *copy, int64_t *behind, int *code, char *text, size_t size);

/* ---- store_commit.c ---- */

/* Does what these jobs say, in one transaction; sets their codes. Only on the thread that owns the capture. */
void store_commit(struct lumi_store *store, struct store_entry **group, int count);

#endif
