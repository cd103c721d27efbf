/* The way to the disk: a capture (proto/capture) behind a queue, written as fast as the disk goes, a second copy beside
 * it. Jobs are done in the order they were given as far as one frame is concerned; a job that is done is on the disk
 * and committed.
 *
 * 1. Memory is bounded: lumi_store_room says how many bytes may still be given; what is over is refused
 * (LUMI_ERR_LIMIT).
 * 2. What was reported done survives a kill and a pulled plug. What was not is done whole or not at all.
 * 3. The second copy never holds the first one up: it is made from the first while no frame waits for the disk. A seal
 *    is done when the copy has caught up and is verified, or is given up; which of them done.text tells.
 * 4. With `synchronous` nothing happens but in lumi_store_work, so that a slow disk can be simulated in virtual time.
 */
#ifndef LUMI_DAEMON_STORE_STORE_H
#define LUMI_DAEMON_STORE_STORE_H

#include "proto/capture/capture.h"
#include "proto/mechanism/sweep_plan.h"

#include <sys/uio.h>

struct lumi_store;

enum lumi_store_job_kind {
    LUMI_STORE_SHOT = 0, /* a shot was fired: rows of its frames triggered; those that are already are left alone */
    LUMI_STORE_EXPOSED,  /* a sync edge */
    LUMI_STORE_FRAME,    /* bytes of a frame */
    LUMI_STORE_LOST,     /* a frame that will never come: triggered → rejected; a planned one keeps its state; `text`
                            becomes its reason. Should it come all the same, it can be given. */
    LUMI_STORE_JUDGED,
    LUMI_STORE_RETAKE,   /* a new planned frame for a rejected one; done.frame is its id */
    LUMI_STORE_INCIDENT, /* one line for the capture's log: dropped, doubled, late, camera gone … */
    LUMI_STORE_SWEEP,    /* a sweep begins or has ended, and how */
    LUMI_STORE_CLOCK,    /* a camera's clock as fitted in a sweep */
    LUMI_STORE_DEVICE,   /* which device is a camera of the rig */
    LUMI_STORE_META,
    LUMI_STORE_SEAL /* everything is synced, verified against its checksums if asked, and the bag closed */
};

#define LUMI_STORE_IOV 4
struct lumi_store_job {
    enum lumi_store_job_kind kind;
    uint64_t id;   /* the giver's; comes back */
    int64_t frame; /* row; FRAME, EXPOSED, LOST, JUDGED, RETAKE */
    /* SHOT */
    int64_t frames[LUMI_RIG_CAMERAS];     /* row of each camera's frame (a retake's is of another shot), 0: none */
    int64_t trigger_us[LUMI_RIG_CAMERAS]; /* of it; LUMI_NO_TIME: when is not known */
    /* EXPOSED */
    int64_t exposed_us;
    /* FRAME: the file is these pieces one after another, or the file at `path`. They, and what `file` points to, stay
     * valid until the job is done. */
    struct iovec pieces[LUMI_STORE_IOV];
    int piece_count;
    const char *path;
    /* FRAME: called in a writer's thread before the bytes are wanted, where they have still to be made (may be NULL);
     * fills in pieces and file. `bytes` says about how many they will be. */
    int (*prepare)(void *context, struct lumi_store_job *job, struct lumi_error *error);
    void *context;
    size_t bytes;
    struct lumi_capture_file file;
    /* JUDGED */
    bool accepted;
    double sharpness;
    struct lumi_capture_judgement judgement; /* NaN: not measured */
    /* JUDGED, LOST, INCIDENT, RETAKE, SWEEP: why; META: the value */
    char text[512];
    char key[64];    /* META; INCIDENT: its kind */
    int camera;      /* INCIDENT, CLOCK, DEVICE: of the rig, −1 none */
    int64_t time_us; /* INCIDENT, SWEEP: Unix time */
    int sweep;       /* SHOT, SWEEP, CLOCK: its number in the capture */
    bool ended;      /* SWEEP; otherwise it begins */
    struct lumi_capture_clock clock;
    struct lumi_capture_device device;
    bool verify; /* SEAL: every file is read again first; LUMI_ERR_CHECKSUM, and no seal, where one has changed */
    char date[16];
};

struct lumi_store_done {
    uint64_t id;
    enum lumi_store_job_kind kind;
    int code; /* LUMI_ERR_NOSPACE and the like; the frame is then as it was before */
    char text[512];
    int64_t frame; /* the job's; RETAKE: the new row */
    int64_t shot;  /* RETAKE: the new frame's; the retakes of a shot share one until it is fired */
    size_t bytes;
    double seconds; /* from given to done */
};

struct lumi_store_options {
    size_t memory;               /* bytes of frames that may wait (512 MiB) */
    const char *second_copy;     /* a directory on another disk, the caller's until the store is closed; NULL: none */
    int writers;                 /* threads; 0: by the number of processors */
    bool synchronous;            /* no threads: lumi_store_work does the work, for virtual time */
    void (*wake)(void *context); /* when something is done */
    /* What a disk would answer, for simulated ones: LUMI_OK, or a code with its text (LUMI_ERR_NOSPACE) in place of
     * writing so many bytes; asked before every file. NULL: the disk itself answers. */
    int (*disk)(void *context, size_t bytes, struct lumi_error *error);
    /* For the figures, in nanoseconds; NULL: CLOCK_MONOTONIC, and where synchronous time stands still. */
    int64_t (*now)(void *context);
    void *context;
};
void lumi_store_options_init(struct lumi_store_options *options);

/* The capture is open for writing and becomes the store's if this succeeds; lumi_store_close closes it. */
int lumi_store_open(struct lumi_capture *capture, const struct lumi_store_options *options, struct lumi_store **store,
                    struct lumi_error *error);
/* Finishes what was given, then closes. A second copy that is behind, without a seal, is gone on with next time. */
int lumi_store_close(struct lumi_store *store, struct lumi_error *error);

/* Copies the job (not the pieces). LUMI_ERR_LIMIT: no room for its bytes; one frame always has room where nothing else
 * waits. Jobs of one frame are done in their order, a seal after all that were given before it; otherwise a row does
 * not wait for the bytes of another frame. */
int lumi_store_give(struct lumi_store *store, const struct lumi_store_job *job, struct lumi_error *error);
bool lumi_store_done(struct lumi_store *store, struct lumi_store_done *done); /* the next; false: none */
/* Bytes that may still be given. */
size_t lumi_store_room(struct lumi_store *store);
/* synchronous: does at most `jobs` jobs (0: all) on this thread. */
void lumi_store_work(struct lumi_store *store, int jobs);

struct lumi_store_figures {
    size_t room, waiting; /* bytes */
    int jobs;             /* that wait */
    int64_t stored_bytes;
    double bytes_per_second;   /* of the last seconds; 0 idle */
    double slowest_seconds;    /* a job of the last minute took */
    int64_t copy_behind_bytes; /* of the second copy */
    int copy_code;             /* not 0: the second copy is given up */
    char copy_text[256];
};
void lumi_store_figures(struct lumi_store *store, struct lumi_store_figures *figures);

/* Before a sweep: free bytes where `path` lies, and what writing there gives, by writing `bytes` and taking them away.
 * A failure where nothing can be written to the folder: LUMI_ERR_IO. */
int lumi_store_disk(const char *path, int64_t *free_bytes, struct lumi_error *error);
int lumi_store_measure(const char *path, size_t bytes, double *bytes_per_second, struct lumi_error *error);

/* Rows for a plan of this rig, in a capture that has none: cameras (all of the rig, in its order), lenses, positions,
 * shots (with their number in the plan), frames with their prior poses (proto/mechanism/kinematics.h), names
 * "cCC-tTT-pPPP[-bB]", profile and plan as text. A video has neither positions nor frames. In one transaction; for a
 * plan that passed lumi_plan_check. Called before lumi_store_open. */
int lumi_store_plan(struct lumi_capture *capture, const struct lumi_rig *rig, const struct lumi_plan *plan,
                    struct lumi_error *error);

#endif
