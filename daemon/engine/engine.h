/* The capture engine: from a plan to a capture that is known to be complete.
 *
 *   plan ─▶ preflight ─▶ home ─▶ arm ─▶ sweep ─▶ drain ─▶ retakes ─▶ seal ─▶ hand over
 *
 * 1. One thread uses it. It blocks nowhere, reads no clock and starts no thread: what happens is told by the functions
 *    below, with the time, and what it wants is asked through `ports`; so a whole capture runs in virtual time.
 * 2. Every frame of the plan is a row in the capture from before the first trigger, and moves on only when what
 * happened is on the disk. A board's event is acknowledged (ports.rig_stored) when the rows that come of it are
 * committed.
 * 3. After a crash lumi_engine_recover finds the capture that was being taken; what store, board and cameras say is
 *    brought together, and the sweep goes on.
 * 4. The ports return at once; what they are asked for is answered later, never from within them.
 * 5. Whatever goes wrong, every planned frame ends as stored (file, checksum) or as missing with a reason. */
#ifndef LUMI_DAEMON_ENGINE_ENGINE_H
#define LUMI_DAEMON_ENGINE_ENGINE_H

#include "daemon/camera/camera_host.h"
#include "daemon/gpio/gpio.h"
#include "daemon/judge/judge.h"
#include "daemon/rig/link.h"
#include "daemon/store/store.h"
#include "proto/mechanism/sweep_plan.h"

/* Cameras are counted as in config.cameras, everywhere below. */
struct lumi_engine;

/* ---- what is configured ---- */

struct lumi_engine_camera {
    char name[LUMI_RIG_NAME];           /* of the rig's profile */
    char address[256];                  /* as for lumi_camera_open: for messages; which camera it is the caller knows */
    struct lumi_camera_setting setting; /* exposure_s 0: the plan's */
    double black, white_red, white_blue; /* raw: sample value of no light; what red and blue are multiplied with. 0:
                                            what the frame says */
    bool sync_line; /* its exposures are seen by an edge (GPIO of the host; the board's feedback needs nothing here) */
    bool optional;  /* a sweep may begin without it */
};

struct lumi_engine_config {
    char folder[1024]; /* where captures are made */
    struct lumi_engine_camera cameras[LUMI_RIG_CAMERAS];
    int camera_count;
    struct lumi_judge_limits judge;
    bool judging;          /* (true) */
    int retakes;           /* rounds, by itself, at most (3) */
    double frame_patience; /* s after a shot until a frame that has not come is missing (5); cameras that record by
                              themselves: after the files have been taken in */
    double match_window;   /* s, half of it on either side of where a frame is expected; 0: by the plan's spacing */
    double disk_reserve;   /* share of the free bytes that a sweep may not use (0.05) */
    double battery_least, temperature_most; /* (0.2; 70 °C) */
    double rig_patience;                    /* s without the board until a sweep is given up as interrupted (60) */
    bool wind_up;                           /* homing winds the string up first, where there is one that drops */
    int home_turn;                          /* otherwise the turn the rig is in */
    bool verify;                            /* all checksums are read again before the capture is sealed (true) */
    struct lumi_store_options store;        /* wake and context are the caller's */
    int64_t utc_offset_ns; /* Unix time less CLOCK_MONOTONIC, at creation; later by lumi_engine_clock */
};
void lumi_engine_config_init(struct lumi_engine_config *config);

/* ---- what it asks ---- */

struct lumi_engine_judge_job {
    uint64_t id;
    int camera;
    int shot; /* −1: a test */
    const struct lumi_camera_frame *frame;
    const struct lumi_lens *lens;
    struct lumi_pose pose;
    double exposure_s, gain;
    struct lumi_judge_neighbour neighbours[4];
    int neighbour_count;
};

/* A frame that has come, for who shows pictures. */
struct lumi_engine_picture {
    int camera;
    struct lumi_camera_frame *frame; /* the engine's: who wants to keep it holds it (lumi_camera_frame_ref), not long */
    const char *name;                /* of the frame in the capture; "": of none */
    int shot;                        /* −1: a test, a look */
    int64_t unix_us;                 /* of the exposure, as far as that is known */
    double white[2];                 /* raw: as configured; 0: as the frame says */
    bool spare; /* the store's queue is less than half full, nobody waits for the judges, and half of the camera's
                   buffers are free */
};

enum lumi_engine_state {
    LUMI_ENGINE_IDLE = 0,
    LUMI_ENGINE_PREFLIGHT,
    LUMI_ENGINE_RED, /* the preflight failed: nothing was started */
    LUMI_ENGINE_HOMING,
    LUMI_ENGINE_ARMING,
    LUMI_ENGINE_SWEEPING,
    LUMI_ENGINE_PAUSING,
    LUMI_ENGINE_PAUSED,      /* by the operator, or because the disk is slow (it goes on by itself then) */
    LUMI_ENGINE_INTERRUPTED, /* fault, board away, e-stop, crash: `text` says what has to be done */
    LUMI_ENGINE_DRAINING,    /* the sweep is over; frames are still coming */
    LUMI_ENGINE_SEALING,
    LUMI_ENGINE_DONE, /* sealed: complete, or with frames that stay missing */
    LUMI_ENGINE_FAILED
};
#define LUMI_ENGINE_STATES 13
const char *lumi_engine_state_name(enum lumi_engine_state state);

enum lumi_engine_tale {
    LUMI_TALE_STATE = 0, /* status.state or its text changed: `state`, `text` */
    LUMI_TALE_CHECK,     /* of the preflight: `check` */
    LUMI_TALE_SHOT,      /* `shot`; `lost` */
    LUMI_TALE_FRAME,     /* `shot`, `camera`, `frame_state`; `text` the reason, if any */
    LUMI_TALE_INCIDENT,  /* `what`, `text`, `camera` or −1 */
    LUMI_TALE_SEALED     /* `text`: the capture */
};
struct lumi_engine_check;
struct lumi_engine_told {
    enum lumi_engine_tale kind;
    uint64_t number; /* 1, 2, 3 … of this engine */
    int64_t unix_us;
    enum lumi_engine_state state; /* at that moment, whatever the tale is about */
    int shot, camera, check;
    bool lost;
    enum lumi_frame_state frame_state;
    int frame;   /* FRAME: as lumi_engine_frame counts */
    char letter; /* FRAME: as there */
    enum lumi_judge_fault fault;
    char what[16]; /* INCIDENT: in a word, as it is in the capture; may be empty */
    char text[512];
};

struct lumi_engine_ports {
    void *context;
    /* Answered by lumi_engine_rig_reply. */
    void (*rig_request)(void *context, uint32_t number, const lumi_wire_Request *request);
    void (*rig_read_profile)(void *context, uint32_t number);        /* answered by lumi_engine_rig_profile */
    void (*rig_stored)(void *context, const lumi_wire_Event *event); /* lumi_rig_link_stored */
    void (*rig_emergency_stop)(void *context);
    int64_t (*rig_to_host)(void *context, uint64_t board_ns); /* CLOCK_MONOTONIC; 0: clocks are not matched yet */
    /* A sweep with an industrial drive (lumi_rig_drive_sweep); `states`: a byte a shot, 1 fired, valid for the
     * call; `reset`: somebody has looked, an alarm of the drive may be reset. Answered by lumi_engine_rig_reply. NULL
     * where there is no drive. */
    void (*drive_sweep)(void *context, uint32_t number, const struct lumi_rig *rig, const struct lumi_plan *plan,
                        uint32_t first_shot, const uint8_t *states, bool reset);
    void (*drive_cancel)(void *context); /* between two positions */
    /* Asks it how it is, for the preflight; answered by lumi_engine_rig_reply with what it said as text. LUMI_ERR_BUSY:
     * it has an alarm; other errors: it does not answer. */
    void (*drive_check)(void *context, uint32_t number);
    /* Answered by a notice of LUMI_CAMERA_DONE. */
    void (*camera_command)(void *context, int camera, uint32_t number, const struct lumi_camera_command *command);
    void (*lamp)(void *context, bool on);                                      /* NULL: there is no line for it */
    void (*judge)(void *context, const struct lumi_engine_judge_job *job);     /* answered by lumi_engine_judged */
    void (*picture)(void *context, const struct lumi_engine_picture *picture); /* NULL: nobody shows any */
    void (*hand_over)(void *context, const char *capture);
    void (*told)(void *context, const struct lumi_engine_told *told);
};

/* ---- life ---- */

int lumi_engine_create(const struct lumi_engine_config *config, const struct lumi_engine_ports *ports, int64_t now_ns,
                       struct lumi_engine **engine, struct lumi_error *error);
/* Closes an open capture as it is: lumi_engine_recover goes on with it. */
void lumi_engine_destroy(struct lumi_engine *engine);

/* Time passes: timers, what the store has done. Call it at lumi_engine_next at the latest, and after every wake. */
void lumi_engine_run(struct lumi_engine *engine, int64_t now_ns);
int64_t lumi_engine_next(const struct lumi_engine *engine);                /* INT64_MAX: nothing is waited for */
void lumi_engine_clock(struct lumi_engine *engine, int64_t utc_offset_ns); /* the wall clock was set */

/* ---- what happens ---- */

void lumi_engine_rig_notice(struct lumi_engine *engine, int64_t now_ns, const struct lumi_rig_notice *notice);
/* `code`, `text` as from lumi_rig_link_command; reply NULL where there is none. */
void lumi_engine_rig_reply(struct lumi_engine *engine, int64_t now_ns, uint32_t number, int code, const char *text,
                           const lumi_wire_Reply *reply);
/* Number 0: nobody asked; it is only where the arm is that it tells. */
void lumi_engine_rig_profile(struct lumi_engine *engine, int64_t now_ns, uint32_t number, int code, const char *text,
                             const struct lumi_rig *rig);
void lumi_engine_rig_status(struct lumi_engine *engine, int64_t now_ns, const struct lumi_rig_link_snapshot *snapshot);
/* Takes over the notice's frame. */
void lumi_engine_camera_notice(struct lumi_engine *engine, int64_t now_ns, int camera,
                               const struct lumi_camera_notice *notice);
void lumi_engine_sync_edge(struct lumi_engine *engine, int64_t now_ns, int camera, int64_t at_ns, uint32_t lost);
void lumi_engine_estop(struct lumi_engine *engine, int64_t now_ns, bool pressed); /* told; the link was told before */
/* `picture` becomes the engine's; NULL on failure. */
void lumi_engine_judged(struct lumi_engine *engine, int64_t now_ns, uint64_t id, int code, const char *text,
                        const struct lumi_judge_numbers *numbers, struct lumi_judge_picture *picture);
void lumi_engine_disk(struct lumi_engine *engine, int64_t now_ns, int64_t free_bytes, double bytes_per_second);

/* ---- what an operator wants ---- */

struct lumi_engine_start {
    const char *name;            /* of the capture's directory, made from date and plan if NULL */
    const char *title;           /* may be NULL */
    const char *const *override; /* checks that may be red, by name; NULL-terminated; NULL none */
    bool preflight_only;         /* ends in IDLE (or RED) with the verdict */
};
/* `plan_text`: docs/rig-plan.md; whether the rig can do it is known when the board's profile is, and comes as a check.
 * LUMI_ERR_FORMAT: it is no plan at all, and in which line. LUMI_ERR_BUSY: another capture is under way.
 * LUMI_ERR_EXISTS: the name is taken. */
int lumi_engine_start(struct lumi_engine *engine, int64_t now_ns, const char *plan_text, size_t plan_size,
                      const struct lumi_engine_start *start, struct lumi_error *error);
int lumi_engine_pause(struct lumi_engine *engine, int64_t now_ns, struct lumi_error *error);
/* After a pause, an interruption, a fault that was cleared, a capture that was recovered. */
int lumi_engine_resume(struct lumi_engine *engine, int64_t now_ns, struct lumi_error *error);
/* Ends the sweep; with what is there the capture is closed as incomplete (its missing frames named), or kept open. */
int lumi_engine_stop(struct lumi_engine *engine, int64_t now_ns, bool at_once, bool seal, struct lumi_error *error);
void lumi_engine_emergency_stop(struct lumi_engine *engine, int64_t now_ns);
/* All missing and rejected frames, or those named (NULL-terminated), again, also good ones; also of a capture that is
 * sealed. `capture` NULL: the last one, or the youngest in the folder. While the sweep of that capture goes on, named
 * frames are taken again after it. */
int lumi_engine_retake(struct lumi_engine *engine, int64_t now_ns, const char *capture, const char *const *frames,
                       struct lumi_error *error);
int lumi_engine_clear(struct lumi_engine *engine, int64_t now_ns, struct lumi_error *error); /* the board's faults */
/* Looks for the index mark, also while a capture waits because nobody knows where the rig is: `turn` is the one the
 * operator says the arm is in, unless it winds up. What came of it is told as an incident. */
int lumi_engine_home(struct lumi_engine *engine, int64_t now_ns, int turn, bool wind_up, struct lumi_error *error);
/* Turns the platform by so many radians, where nothing sweeps and the position is known. */
int lumi_engine_jog(struct lumi_engine *engine, int64_t now_ns, double radians, struct lumi_error *error);
/* Opens a capture that a crash left in config.folder, if there is one; *found. It goes on by itself when board and
 * cameras are there, unless it was paused. One that cannot be gone on with (another rig's, damaged) is an error that
 * names it; it stays as it is, and the engine rests. */
int lumi_engine_recover(struct lumi_engine *engine, int64_t now_ns, bool *found, struct lumi_error *error);

/* One picture of this camera, now, while nothing is under way: for who stands before it. Asked for again and again, the
 * engine sees to what has to be done first: a camera that can is set to fire by software, whatever it is in a capture;
 * one that runs freely is let run; any other is fired by the board's test trigger, once the rig is known. Frames come
 * by ports.picture. Whatever begins ends it, and cameras are set up anew then; nothing is accounted for. LUMI_ERR_BUSY:
 * something is under way, or the board cannot now. LUMI_ERR_NOTFOUND: the camera is not there. LUMI_ERR_UNSUPPORTED: it
 * records by itself, or the rig is not known yet. */
int lumi_engine_look(struct lumi_engine *engine, int64_t now_ns, int camera, struct lumi_error *error);
void lumi_engine_look_end(struct lumi_engine *engine, int64_t now_ns, int camera); /* nobody looks any more */
/* Whether it could be looked through, were nothing under way, and why not. */
int lumi_engine_look_check(const struct lumi_engine *engine, int camera, struct lumi_error *error);

/* ---- what can be seen ---- */

enum lumi_verdict { LUMI_GREEN = 0, LUMI_YELLOW, LUMI_RED, LUMI_UNDECIDED };
const char *lumi_verdict_name(enum lumi_verdict verdict);
struct lumi_engine_check {
    char name[48]; /* "link", "versions", "plan", "homed", "camera c03", "clock c03", "trigger c03", "blur", "disk" … */
    enum lumi_verdict verdict;
    bool overridden;
    char reason[256];
};
#define LUMI_ENGINE_CHECKS 160

struct lumi_engine_camera_status {
    char name[LUMI_RIG_NAME];
    bool there, armed, configured;
    struct lumi_camera_identity identity;
    struct lumi_camera_status status;
    bool clock_fitted;
    double clock_offset_s, clock_drift_ppm, clock_residual_s, clock_residual_worst_s;
    uint64_t matched, dropped, doubled, late, out_of_order, surplus; /* of this capture */
};

/* Where the arm is, as the board says. */
struct lumi_engine_arm {
    bool known, turn_known;              /* without the turn, turn and pitch say nothing */
    double turn;                         /* turns since step 0 */
    double yaw;                          /* of the platform, radians from +X, counter-clockwise, -pi..pi */
    double pitch;                        /* radians that every arm angle has fallen */
    int camera_count;                    /* of the rig's profile */
    double cameras[LUMI_RIG_CAMERAS][3]; /* centre to camera, unit vectors */
};

struct lumi_engine_status {
    enum lumi_engine_state state;
    char text[512];
    char capture[1024], plan_name[LUMI_RIG_NAME];
    int round; /* 0 the sweep, 1 … retakes */
    int shots, fired, lost;
    int frames, planned, triggered, exposed, received, stored, accepted, rejected,
        missing;         /* of frames: where each is now */
    double seconds_left; /* as planned; NaN unknown */
    bool complete;       /* every frame accepted, or stored where nothing is judged */
    int64_t bytes;
    struct lumi_store_figures store;
    int64_t disk_free_bytes;
    double disk_bytes_per_second;
    struct lumi_rig_link_snapshot rig;
    bool estop;
    struct lumi_engine_arm arm;
    int camera_count, check_count;
    struct lumi_engine_camera_status cameras[LUMI_RIG_CAMERAS];
    struct lumi_engine_check checks[LUMI_ENGINE_CHECKS];
};
/* Large: keep it on the heap. */
void lumi_engine_status(const struct lumi_engine *engine, struct lumi_engine_status *status);

struct lumi_engine_missing {
    char frame[LUMI_CAPTURE_NAME], camera[LUMI_RIG_NAME];
    int shot;
    enum lumi_frame_state state;
    enum lumi_judge_fault fault; /* GOOD: it was not judged */
    char reason[256];
};
/* Frames that are neither stored nor accepted, with the reason; returns how many there are, at most `max` filled in. */
int lumi_engine_missing(const struct lumi_engine *engine, struct lumi_engine_missing *list, int max);

/* The frames of the plan on the sphere: number = shot * camera_count + camera, cameras those that take part. */
struct lumi_engine_frames {
    char capture[1024];
    int shots, camera_count;
    int cameras[LUMI_RIG_CAMERAS]; /* as in config.cameras */
};
struct lumi_engine_frame {
    const char *name; /* in the capture, until something happens */
    /* p planned, w on its way, s stored and not judged (yet), a accepted, f soft or smeared, c clipped, r rejected for
     * another reason, m missing, t to be taken again, n taken again and good. */
    char letter;
    double direction[3]; /* from the centre to its camera, where the shot was taken or is planned; a unit vector */
};
bool lumi_engine_frames(const struct lumi_engine *engine, struct lumi_engine_frames *frames); /* false: none yet */
void lumi_engine_frame(const struct lumi_engine *engine, const struct lumi_engine_frames *frames, int number,
                       struct lumi_engine_frame *frame);

/* What the rig is. `source`: "board", which is there; "last", what the board that was there said; "capture": the
 * profile of the capture that was opened. False: nobody has said. */
bool lumi_engine_profile(const struct lumi_engine *engine, struct lumi_rig *rig, const char **source);

struct lumi_store *lumi_engine_store(struct lumi_engine *engine); /* NULL: no capture is open */

#endif
