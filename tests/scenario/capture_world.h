/* A world around the capture engine, in virtual time: the simulated rig with the firmware on it and a link with all its
 * bytes, cameras that answer what the triggers really exposed, a disk that is slow, full or broken, edges of sync
 * lines, an operator, and a store on a real directory. The host's clock, the board's and every camera's go their own
 * ways. The world knows the truth of every frame, and writes it into its bytes.
 *
 * 1. Time passes only in world_run and world_run_until.
 * 2. What the engine asks is only noted when it asks, and happens later: no call goes back into it.
 * 3. The same seed and the same calls give the same run. */
#ifndef LUMI_TESTS_SCENARIO_CAPTURE_WORLD_H
#define LUMI_TESTS_SCENARIO_CAPTURE_WORLD_H

#include "daemon/engine/engine.h"
#include "daemon/rig/clock_match.h"
#include "sim/rig/machine.h"
#include "world_script.h"

#define WORLD_SECOND INT64_C(1000000000)
#define WORLD_MS INT64_C(1000000)
#define WORLD_REQUESTS 64
#define WORLD_CAMERA_COMMANDS 16
#define WORLD_RAW_SIZE 4096 /* bytes the world reads of the link at once */

/* ---- truth ---- */

enum world_flaw { WORLD_BLURRED = 1, WORLD_DAMAGED = 2, WORLD_WRONG_EXPOSURE = 4, WORLD_SPURIOUS = 8 };
/* One exposure of one camera, as it really was. */
struct world_exposure {
    int camera;
    int shot; /* the plan's number; −1: a test, or nobody's */
    int64_t begin_ns;
    double exposure_s; /* as long as it was */
    unsigned flaws;
    bool taken;     /* the camera was armed and made a frame of it */
    bool delivered; /* and the engine was given it */
};
/* What a stored file says of itself. */
struct world_truth {
    int camera, record, shot;
    unsigned flaws;
};
bool world_truth_find(const void *data, size_t size, struct world_truth *truth);

/* ---- its parts ---- */

struct world;

struct world_frame {
    struct lumi_camera_frame frame; /* first: the engine has only this */
    struct world *world;
    int camera, record;
    uint64_t generation; /* of the daemon that it was given to */
    uint8_t *bytes;
};

struct world_camera {
    bool there, known, configured, armed; /* known: the daemon has been told that it came */
    bool want_configured, want_armed;     /* kept over an absence, as the host thread around a camera does */
    struct lumi_camera_setting setting;
    double exposure_s, gain;
    int64_t clock_offset_ns, clock_zero_ns;
    double clock_drift, clock_jitter_ns;
    uint64_t sequence, generation; /* generation: of frames under way; another after every disarm, absence, kill */
    uint32_t gap;                  /* sequence numbers that were skipped since the last frame */
    int out;                       /* frames that are given out */
    uint64_t frames, dropped, damaged;
    int64_t came_ns; /* when it will say that it is there; 0: it has, or is away */
    /* what goes wrong, for so many of its next frames */
    int drop, vanish, late, doubled, swap, damage, blur, wrong_exposure, sync_missing, spurious;
    int64_t late_by_ns, stalled_until_ns;
    int64_t status_ns; /* when it said last how it is */
};

struct world_disk {
    int64_t free_bytes;
    double rate, latency; /* bytes/s; s a job */
    bool full;
    int fail_next;  /* files whose writing fails */
    int64_t due_ns; /* when the job in work is done; 0: none */
    int64_t told_ns;
    int kill_in; /* files until the daemon is killed inside the store; 0: it is not */
};

struct world_request {
    uint32_t number;
    bool profile; /* reads the whole profile */
    lumi_wire_Request request;
    int64_t deadline_ns;
};

enum world_event_kind {
    WORLD_EVENT_NOTICE = 0, /* `notice` */
    WORLD_EVENT_COMMAND,    /* `command` is done now */
    WORLD_EVENT_FRAME,      /* `frame` has arrived */
    WORLD_EVENT_SYNC,
    WORLD_EVENT_JUDGED
};
struct world_event {
    struct world_event *next;
    int64_t at_ns;
    enum world_event_kind kind;
    int camera;
    uint64_t generation; /* of the camera (FRAME), of the daemon (the others); of another time: it is dropped */
    struct lumi_camera_notice notice;
    uint32_t number;
    struct lumi_camera_command command;
    struct lumi_camera_frame frame; /* what is said of it; its bytes are made when it arrives */
    int record;
    unsigned flaws;
    int64_t edge_ns; /* SYNC */
    uint64_t judge;  /* JUDGED: its id, and what came of it */
    int code;
    struct lumi_judge_numbers numbers;
    struct lumi_judge_picture *picture;
};

struct world_options {
    uint64_t seed;
    enum board_link link;
    double link_delay, link_rate;
    bool sync_lines;   /* every camera has one */
    bool raw;          /* cameras give Bayer samples instead of JPEG files */
    bool judge_really; /* the judge of the tree looks at the pictures */
    double blurred;    /* share of frames that come out bad by themselves */
    int width, height;
    size_t store_memory;
    bool (*dead)(const struct lumi_engine *engine); /* an engine in a process of its own may be */
    const char *folder; /* where captures are made; NULL: one of its own in memory, removed at the end */
};

struct world {
    struct world_options options;
    struct lumi_rig rig;
    struct lumi_plan plan;
    char folder[1024];
    bool own_folder;
    char why[4096]; /* what was wrong first; empty: nothing */

    /* the board and the way to it */
    struct sim_machine *machine;
    struct lumi_wire_client client;
    struct lumi_clock_match clock;
    struct lumi_rig_link_snapshot snapshot;
    uint32_t boot;
    bool boot_known, stream_open;
    int64_t stream_try_ns, snapshot_told_ns;
    struct world_request requests[WORLD_REQUESTS];
    int request_count;
    bool in_flight;
    uint8_t *profile; /* being read */
    uint32_t profile_size;
    uint8_t read_ahead[WORLD_RAW_SIZE];
    size_t read_size;
    double host_drift;
    int64_t utc_offset_ns;
    uint64_t client_number;

    /* cameras */
    struct world_camera cameras[LUMI_RIG_CAMERAS];
    struct world_exposure *exposures; /* as the machine's records, and spurious ones behind −1 − n */
    int exposure_count, exposure_room;
    int shots_fired; /* of the plan: one more than the highest that was */
    struct world_script *script;
    int64_t script_began_ns;
    struct world_event *events;
    int64_t now_ns;
    uint64_t drawn;   /* random numbers so far */
    uint8_t *picture; /* a JPEG file of the size, without the truth */
    size_t picture_size;
    int frames_out, frames_out_most;
    size_t bytes_out, bytes_out_most;

    /* the daemon */
    struct lumi_engine *engine;
    struct lumi_engine_config config;
    uint64_t generation; /* of the daemon */
    bool hanging;        /* the daemon does nothing, as a program that is stopped */
    bool killed_inside;  /* the store is to be taken for dead since `snapshot_folder` was taken */
    struct world_disk disk;
    size_t waiting_most; /* bytes in the store's queue */
    char sealed[1024];   /* the capture that was handed over last */
    int sealed_count, incidents, shots_told;
    bool trace; /* LUMI_WORLD_TRACE in the environment: what the engine tells goes to standard error */
    struct lumi_engine_status *status; /* of the last world_status */
    struct world_ack *ack;             /* looks into the database when the board is told that something is stored */
};

/* ---- life ---- */

void world_options_init(struct world_options *options);
/* Of world->rig and world->plan, which the caller has filled in. Board with its profile, cameras there, no daemon yet.
 */
bool world_create(struct world *world, const struct world_options *options);
void world_destroy(struct world *world);
/* Notes what was wrong, the first time; returns false. */
bool world_wrong(struct world *world, const char *format, ...) __attribute__((format(printf, 2, 3)));
double world_random(struct world *world); /* 0 … 1 */

/* The daemon: begins (and recovers what it finds), ends in order, is killed. A kill leaves the directory as it is at
 * this moment. */
bool world_daemon_start(struct world *world);
void world_daemon_stop(struct world *world);
void world_daemon_kill(struct world *world);

/* ---- time ---- */

void world_run(struct world *world, double seconds);
typedef bool (*world_condition)(struct world *world, void *context);
bool world_run_until(struct world *world, world_condition done, void *context, double seconds);
double world_seconds(const struct world *world);
int64_t world_host_ns(const struct world *world, uint64_t ticks);
const struct lumi_engine_status *world_status(struct world *world);

/* ---- what goes wrong ---- */

void world_set_script(struct world *world, struct world_script *script); /* stays the caller's */
void world_camera_unplug(struct world *world, int camera, bool unplugged);
void world_clock_step(struct world *world, double seconds); /* of the wall clock */
void world_spurious_frame(struct world *world, int camera); /* one that no trigger asked for */
void world_spurious_edge(struct world *world, int camera);
void world_hang(struct world *world, bool hanging);

/* ---- between the parts ---- */

/* Board: world_board.c */
bool world_board_create(struct world *world);
void world_board_destroy(struct world *world);
void world_board_restart_host(struct world *world); /* another program with another client */
void world_board_service(struct world *world);
int64_t world_board_next(const struct world *world);
/* What the world itself keeps of every step and exposure since it began. */
size_t world_records_bytes(const struct world *world);
void world_board_request(struct world *world, uint32_t number, bool profile, const lumi_wire_Request *request);

/* Cameras: world_cameras.c */
bool world_cameras_create(struct world *world);
void world_cameras_destroy(struct world *world);
void world_cameras_daemon_gone(struct world *world);
void world_cameras_look(struct world *world); /* what the machine's triggers have exposed since */
void world_cameras_service(struct world *world);
int64_t world_cameras_next(const struct world *world);
void world_camera_command(struct world *world, int camera, uint32_t number, const struct lumi_camera_command *command);
void world_camera_event(struct world *world, struct world_event *event);
void world_judge(struct world *world, const struct lumi_engine_judge_job *job);

/* Frames: world_frames.c */
struct world_frame *world_frame_create(struct world *world, int camera, int record, unsigned flaws);
bool world_pictures_create(struct world *world);

/* Events: capture_world.c */
struct world_event *world_event_add(struct world *world, int64_t at_ns, enum world_event_kind kind, int camera);
void world_event_free(struct world_event *event);

/* The store's disk: world_disk.c */
void world_disk_service(struct world *world);
int64_t world_disk_next(const struct world *world);
int world_disk_answer(void *context, size_t bytes, struct lumi_error *error);
bool world_copy_folder(const char *from, const char *to);
void world_remove_folder(const char *path);

/* Looks whether what the board is told to be stored is: world_ack.c */
void world_ack_check(struct world *world, const lumi_wire_Event *event);
void world_ack_close(struct world *world);

#endif
