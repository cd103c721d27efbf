/* The capture: one directory with a database and the frames' files, a BagIt bag (RFC 8493) when sealed.
 * docs/capture-format.md has the schema, the states and the guarantees.
 *
 * Guarantees.
 * 1. When a storing function returns 0 outside a batch, or lumi_capture_commit returns 0, the frame's file is on the
 *    disk under its final name and its row is committed: both survive a kill and a pulled plug.
 * 2. No row says "received" before its file is there. A file without a row is moved to `unclaimed/` when the capture is
 *    next opened for writing; pictures are never deleted.
 * 3. All paths inside are relative; a copied directory is a whole capture.
 * 4. One writer at a time (LUMI_ERR_BUSY), any number of readers. A handle is used by one thread at a time. */
#ifndef LUMI_PROTO_CAPTURE_CAPTURE_H
#define LUMI_PROTO_CAPTURE_CAPTURE_H

#include "proto/base/geometry.h"
#include "proto/base/lens.h"
#include "proto/base/result.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define LUMI_CAPTURE_VERSION 2
#define LUMI_CAPTURE_NAME 64       /* frame and camera names, with their end; safe as file names */
#define LUMI_CAPTURE_PATH 160      /* relative paths, with their end */
#define LUMI_CAPTURE_PARAMETERS 16 /* of a source's lens model, at most */

struct lumi_capture;

/* ---- Life ---- */

/* A new capture that appears at `path` only when it is whole: everything happens in "<path>.partial";
 * lumi_capture_publish seals and renames it, lumi_capture_close without it removes it. For import and simulation.
 * LUMI_ERR_EXISTS if path is there; a .partial that a killed program left is replaced. */
int lumi_capture_create(const char *path, struct lumi_capture **capture, struct lumi_error *error);
/* A new capture at `path` itself, open from the start: for a rig, where what was taken must survive a crash. */
int lumi_capture_create_live(const char *path, struct lumi_capture **capture, struct lumi_error *error);

enum lumi_capture_mode { LUMI_CAPTURE_READ = 0, LUMI_CAPTURE_WRITE = 1 };
/* READ: sealed or open, never changes it. WRITE: unseals it, and mends what a crash left (temporary files removed,
 * files without a row set aside, received rows whose file is gone sent back to "rejected"). LUMI_ERR_VERSION for a
 * newer capture; an older one is upgraded by WRITE and by READ in memory. */
int lumi_capture_open(const char *path, enum lumi_capture_mode mode, struct lumi_capture **capture,
                      struct lumi_error *error);

/* Reads a copy in memory, made without any lock (docs/capture-format.md, "Looking at an open capture"): whoever looks,
 * and however slowly, the writer never waits and can always seal. What was committed when it was called is seen.
 * LUMI_ERR_BUSY: it is written faster than it can be read; try later. */
int lumi_capture_open_copy(const char *path, struct lumi_capture **capture, struct lumi_error *error);
/* Whether rows may have come or gone since the stamp was taken (all zero: never); takes it anew. */
struct lumi_capture_stamp {
    uint64_t numbers[6];
};
int lumi_capture_changed(const char *path, struct lumi_capture_stamp *stamp, bool *changed, struct lumi_error *error);

/* Seals (below), makes the directory appear under its name. The capture is closed afterwards for writing: only
 * lumi_capture_close may follow. */
int lumi_capture_publish(struct lumi_capture *capture, const char *date, struct lumi_error *error);
/* Checkpoints the database into one file and writes the bag's manifests. `date` "YYYY-MM-DD" goes into bag-info.txt,
 * NULL leaves it out. Afterwards only lumi_capture_close may follow. */
int lumi_capture_seal(struct lumi_capture *capture, const char *date, struct lumi_error *error);
/* Accepts NULL. A batch that was not committed is rolled back; a capture from lumi_capture_create that was not
 * published is removed. */
void lumi_capture_close(struct lumi_capture *capture);
/* Closes it and removes the whole directory: for one of lumi_capture_create_live that cannot be begun after all. */
void lumi_capture_discard(struct lumi_capture *capture);

/* Between these, rows are committed and files synced once, at the commit, instead of one by one. Not nested. */
int lumi_capture_begin(struct lumi_capture *capture, struct lumi_error *error);
int lumi_capture_commit(struct lumi_capture *capture, struct lumi_error *error);
/* What was begun is undone, rows and files. A batch whose commit failed is still there until this. `again`: adopted
 * files get their temporary names back. */
void lumi_capture_rollback(struct lumi_capture *capture, bool again);
/* Whether a batch has begun and is still whole: after some failures (disk full) SQLite has undone all of it by itself;
 * then only lumi_capture_rollback may follow. */
bool lumi_capture_in_batch(const struct lumi_capture *capture);

/* Inside a batch: what is done between these is kept whole or undone alone. `code` 0 keeps; returns code, or why it
 * could not be kept. Not nested. */
int lumi_capture_guard(struct lumi_capture *capture, struct lumi_error *error);
int lumi_capture_guarded(struct lumi_capture *capture, int code, struct lumi_error *error);

bool lumi_capture_sealed(const struct lumi_capture *capture);
/* What a sealed capture is known by wherever it is: the SHA-256 of its tagmanifest-sha256.txt; "" for an open one. */
int lumi_capture_seal_of(const char *path, char seal[65], struct lumi_error *error);
/* The directory as it was opened (the .partial one while it is that); owned by the capture. */
const char *lumi_capture_path(const struct lumi_capture *capture);

/* ---- What it is of ---- */

/* Any text under a key. Keys the tree knows: "surface" (sphere, plane, unknown), "source" (what made it: "import
 * transforms.json", "sim room"), "title", "created" (ISO 8601), "software". */
int lumi_capture_set_meta(struct lumi_capture *capture, const char *key, const char *value, struct lumi_error *error);
/* Copies the value (cut to size); "" where there is none. */
int lumi_capture_get_meta(struct lumi_capture *capture, const char *key, char *value, size_t size,
                          struct lumi_error *error);

/* The rig profile as text (proto/mechanism/rig.h); checked by parsing it. LUMI_ERR_NOTFOUND where there is none.
 * `text` is allocated; release with lumi_free. */
int lumi_capture_set_profile(struct lumi_capture *capture, const char *text, struct lumi_error *error);
int lumi_capture_get_profile(struct lumi_capture *capture, char **text, struct lumi_error *error);
/* The plan as text (the daemon's business), stored and given back as it is. */
int lumi_capture_set_plan(struct lumi_capture *capture, const char *text, struct lumi_error *error);
int lumi_capture_get_plan(struct lumi_capture *capture, char **text, struct lumi_error *error);

struct lumi_capture_lens {
    char name[LUMI_CAPTURE_NAME]; /* may be empty */
    struct lumi_lens lens;        /* what the tree computes with */
    char model[32];               /* as the source called it: "SIMPLE_RADIAL", "OPENCV_FISHEYE"; may be empty */
    int parameter_count;          /* the source's own parameters, in its own order, for exact export */
    double parameters[LUMI_CAPTURE_PARAMETERS];
};

struct lumi_capture_position {
    int number; /* order in the sweep, from 0; unique */
    int turn;
    int64_t step;      /* of the motor; 0 where there is none */
    double turn_angle; /* radians from the index mark */
    double drop;       /* radians, lumi_rig_drop */
};

int lumi_capture_add_lens(struct lumi_capture *capture, const struct lumi_capture_lens *lens, int64_t *id,
                          struct lumi_error *error);
int lumi_capture_add_camera(struct lumi_capture *capture, const char *name, int64_t lens, int64_t *id,
                            struct lumi_error *error);
int lumi_capture_add_position(struct lumi_capture *capture, const struct lumi_capture_position *position, int64_t *id,
                              struct lumi_error *error);
/* `number` counts the shots of a position from 0; exposure_offset in stops against the plan's exposure. */
int lumi_capture_add_shot(struct lumi_capture *capture, int64_t position, int number, double exposure_offset,
                          int64_t *id, struct lumi_error *error);
/* Which shot of the plan it is (lumi_plan_shots), and the sweep in which it was fired; −1: none. */
int lumi_capture_set_shot(struct lumi_capture *capture, int64_t shot, int plan_shot, int sweep,
                          struct lumi_error *error);
/* The shot of this frame was fired in that sweep. */
int lumi_capture_fire_shot(struct lumi_capture *capture, int64_t frame, int sweep, struct lumi_error *error);
int lumi_capture_shot_of(struct lumi_capture *capture, int64_t frame, int64_t *shot, struct lumi_error *error);

/* The device that took the frames of a camera of the capture. */
struct lumi_capture_device {
    char vendor[64], model[64], serial[64], firmware[64], address[256];
};
int lumi_capture_set_device(struct lumi_capture *capture, int64_t camera, const struct lumi_capture_device *device,
                            struct lumi_error *error);
/* All empty where none is known. */
int lumi_capture_get_device(struct lumi_capture *capture, int64_t camera, struct lumi_capture_device *device,
                            struct lumi_error *error);
/* The camera that was added as number `index`, from 0. LUMI_ERR_NOTFOUND. */
int lumi_capture_camera(struct lumi_capture *capture, int index, int64_t *id, char name[LUMI_CAPTURE_NAME],
                        struct lumi_error *error);

/* ---- Frames ---- */

enum lumi_frame_state {
    LUMI_FRAME_PLANNED = 0,
    LUMI_FRAME_TRIGGERED = 1,
    LUMI_FRAME_RECEIVED = 2,
    LUMI_FRAME_ACCEPTED = 3,
    LUMI_FRAME_REJECTED = 4,
    LUMI_FRAME_RETAKEN = 5
};
const char *lumi_frame_state_name(enum lumi_frame_state state);

enum lumi_pose_source {
    LUMI_POSE_TRUE = 1,      /* from a simulation */
    LUMI_POSE_ESTIMATED = 2, /* by calibration */
    LUMI_POSE_PRIOR = 3,     /* from the rig's mechanism */
    LUMI_POSE_IMPORTED = 4   /* came with the pictures */
};
const char *lumi_pose_source_name(enum lumi_pose_source source);

#define LUMI_NO_TIME INT64_MIN

struct lumi_capture_new_frame {
    const char *name; /* unique; letters, digits, '.', '_', '-', not a dot first; the file's name without extension */
    const char *original; /* what the source called the file ("images/0001.png"), for export; NULL: none */
    int64_t camera;
    int64_t lens;    /* 0: the camera's */
    int64_t shot;    /* 0: it gets a position and a shot of its own, after all others */
    int row, column; /* place in the sweep's grid, −1 where there is none */
};
int lumi_capture_add_frame(struct lumi_capture *capture, const struct lumi_capture_new_frame *frame, int64_t *id,
                           struct lumi_error *error);

/* planned → triggered. Microseconds of the rig's clock, or LUMI_NO_TIME. A frame that has gone further only gets its
 * time, if it has none. */
int lumi_capture_trigger_frame(struct lumi_capture *capture, int64_t frame, int64_t trigger_time_us,
                               struct lumi_error *error);

/* The middle of the exposure as an edge of its sync line told it, in the clock of the trigger; whatever the state. */
int lumi_capture_expose_frame(struct lumi_capture *capture, int64_t frame, int64_t exposed_time_us,
                              struct lumi_error *error);
/* It will not come, and why: triggered → rejected, and a planned one keeps its state. Should its file come all the
 * same, it can be stored. */
int lumi_capture_lose_frame(struct lumi_capture *capture, int64_t frame, const char *reason, struct lumi_error *error);

/* What is known of a stored file; zero (LUMI_NO_TIME) where it is not. */
struct lumi_capture_file {
    const char *extension; /* with its dot: ".jpg"; letters and digits */
    int width, height;     /* must be the lens's, otherwise LUMI_ERR_FORMAT */
    double exposure_s;
    double iso;
    int64_t camera_time_us;
    const void *exif; /* the raw EXIF block (TIFF header onwards), stored beside the row */
    size_t exif_size;
    const char *label; /* what error texts call the source file; NULL: the frame's name */
};
/* planned, triggered or lost → received: copies the file in under data/frames/<name><extension>, with its checksum. */
int lumi_capture_store_file(struct lumi_capture *capture, int64_t frame, const char *source_path,
                            const struct lumi_capture_file *file, struct lumi_error *error);
int lumi_capture_store_bytes(struct lumi_capture *capture, int64_t frame, const void *data, size_t size,
                             const struct lumi_capture_file *file, struct lumi_error *error);

/* For a writer that brings the bytes to the disk by itself, in threads of its own: the folder of the frames' files as a
 * descriptor (the capture's), in which it makes files called ".<anything>.tmp", synced; in a batch this then gives such
 * a file its name and its row. On failure the temporary file is still there. */
/* From there: a file that keeps room for rows; gone when it is sealed. */
#define LUMI_CAPTURE_RESERVE "../../.rows.tmp"
struct lumi_capture_written {
    const char *temporary;
    int64_t bytes;
    const char *sha256;           /* 64 hexadecimal digits */
    char file[LUMI_CAPTURE_PATH]; /* out: where it is now, relative to the capture */
};
int lumi_capture_frames_folder(const struct lumi_capture *capture);
int lumi_capture_adopt_file(struct lumi_capture *capture, int64_t frame, struct lumi_capture_written *written,
                            const struct lumi_capture_file *file, struct lumi_error *error);

/* received → accepted or rejected, accepted ↔ rejected, triggered → rejected (lost). `sharpness` and `reason` (NULL:
 * none) are kept. LUMI_ERR_ARG for any other transition. */
int lumi_capture_judge_frame(struct lumi_capture *capture, int64_t frame, bool accepted, double sharpness,
                             const char *reason, struct lumi_error *error);
/* What was measured when it was judged; NaN: not measured. The latest is kept. */
struct lumi_capture_judgement {
    double blur_pixels, clipped, dark, mean, exposure_stops, shift_pixels, moved;
};
int lumi_capture_set_judgement(struct lumi_capture *capture, int64_t frame,
                               const struct lumi_capture_judgement *judgement, struct lumi_error *error);
/* rejected → retaken; a new planned frame of the same camera, position and place, named "<name>.<n>", takes over. It
 * joins the other retakes of its shot in a new shot that has not been fired yet, and has the prior pose of the first.
 */
int lumi_capture_retake_frame(struct lumi_capture *capture, int64_t frame, int64_t *id, struct lumi_error *error);

/* A pose becomes the frame's current one; earlier ones are kept. `origin`: where it came from ("lumi sim shoot room
 * seed 1", "transforms.json"). LUMI_ERR_FORMAT for a pose that is not finite or no rotation. */
int lumi_capture_set_pose(struct lumi_capture *capture, int64_t frame, const struct lumi_pose *pose,
                          enum lumi_pose_source source, const char *origin, struct lumi_error *error);

/* A frame joined with all that belongs to it. */
struct lumi_capture_frame {
    int64_t id, camera, lens_id, position_id, shot_id;
    int64_t retake_of; /* the frame it replaces, 0: none */
    char name[LUMI_CAPTURE_NAME];
    char original[256];
    char camera_name[LUMI_CAPTURE_NAME];
    enum lumi_frame_state state;
    char file[LUMI_CAPTURE_PATH]; /* relative to the capture: "data/frames/c00-0001.jpg"; "" before it is received */
    char sha256[65];
    int64_t bytes;
    int width, height;
    struct lumi_lens lens;
    char lens_model[32];
    bool has_pose;
    struct lumi_pose pose; /* the current one */
    enum lumi_pose_source pose_source;
    int row, column;
    int position, turn, shot; /* their numbers */
    int64_t step;
    double turn_angle, drop;
    double exposure_offset, exposure_s, iso, sharpness;
    int64_t trigger_time_us, camera_time_us, exposed_time_us;
    int plan_shot, sweep; /* −1: none */
    char reason[256];     /* why it was judged so, or lost */
    struct lumi_capture_judgement judgement;
};

enum lumi_frame_filter {
    LUMI_FRAMES_ALL = 0,
    LUMI_FRAMES_USABLE = 1 /* received or accepted */
};
/* All frames in the order position, shot, camera, id. One allocation; release with lumi_free. */
int lumi_capture_frames(struct lumi_capture *capture, enum lumi_frame_filter filter, struct lumi_capture_frame **frames,
                        int *count, struct lumi_error *error);
/* The lens with the source's own parameters. */
int lumi_capture_lens(struct lumi_capture *capture, int64_t id, struct lumi_capture_lens *lens,
                      struct lumi_error *error);
/* EXIF as it was stored; *data NULL where there is none; release with lumi_free. */
int lumi_capture_exif(struct lumi_capture *capture, int64_t frame, void **data, size_t *size, struct lumi_error *error);
/* "<capture>/<relative>", allocated; release with lumi_free. NULL: out of memory. */
char *lumi_capture_join(const struct lumi_capture *capture, const char *relative);

struct lumi_capture_info {
    int version;
    bool sealed;
    int cameras, lenses, positions, shots, frames;
    int in_state[6]; /* by enum lumi_frame_state */
    int with_pose;
    int64_t frame_bytes, database_bytes;
};
int lumi_capture_info(struct lumi_capture *capture, struct lumi_capture_info *info, struct lumi_error *error);

/* ---- What happened ---- */

/* One run over all positions or a part of them. */
struct lumi_capture_sweep {
    int number;
    int64_t began_us, ended_us; /* Unix; LUMI_NO_TIME */
    char outcome[512];          /* "" while it runs */
};
/* A new one, or the same number again. */
int lumi_capture_set_sweep(struct lumi_capture *capture, const struct lumi_capture_sweep *sweep,
                           struct lumi_error *error);
/* A camera's clock fitted against the rig's, over the frames of a sweep. */
struct lumi_capture_clock {
    int frames;
    double offset_s, drift_ppm, residual_s, worst_s;
};
int lumi_capture_set_clock(struct lumi_capture *capture, int sweep, int64_t camera,
                           const struct lumi_capture_clock *clock, struct lumi_error *error);
/* LUMI_ERR_NOTFOUND: none. */
int lumi_capture_get_clock(struct lumi_capture *capture, int sweep, int64_t camera, struct lumi_capture_clock *clock,
                           struct lumi_error *error);

/* A line for the log: dropped, doubled, late, camera gone … */
struct lumi_capture_incident {
    int64_t id;      /* when reading */
    int64_t time_us; /* Unix; LUMI_NO_TIME */
    char kind[64];
    int64_t camera, frame; /* 0: none */
    char text[512];
};
int lumi_capture_add_incident(struct lumi_capture *capture, const struct lumi_capture_incident *incident,
                              struct lumi_error *error);
/* In the order they were added, sweeps by number. One allocation; release with lumi_free. */
int lumi_capture_incidents(struct lumi_capture *capture, struct lumi_capture_incident **incidents, int *count,
                           struct lumi_error *error);
int lumi_capture_sweeps(struct lumi_capture *capture, struct lumi_capture_sweep **sweeps, int *count,
                        struct lumi_error *error);
/* The frames of a shot: their ids by the number of their camera (lumi_capture_camera), 0 where it has none. */
int lumi_capture_shot_frames(struct lumi_capture *capture, int64_t shot, int64_t *frames, int cameras,
                             struct lumi_error *error);

/* ---- Verifying ---- */

/* One problem: `file` relative to the capture, `text` what is wrong with it. */
typedef void (*lumi_verify_fn)(void *context, const char *file, const char *text);
/* `done` of `total` bytes have been read; may be NULL. Non-zero cancels. */
typedef int (*lumi_verify_progress_fn)(void *context, int64_t done, int64_t total);
struct lumi_verify_result {
    int files, problems;
    int64_t bytes;
    bool sealed;
};
/* Checks rows against files, files against checksums, and in a sealed capture the bag's manifests. Returns 0 when the
 * check could be made, whatever it found (result->problems). Errors are for a directory that is no capture. */
int lumi_capture_verify(const char *path, lumi_verify_fn problem, lumi_verify_progress_fn progress, void *context,
                        struct lumi_verify_result *result, struct lumi_error *error);

#ifdef __cplusplus
}
#endif
#endif
