/* What the engine's files share.
 *
 *   engine.c            life, time, what is told        engine_account.c   shots, frames, jobs of the store
 *   engine_rig.c        the board: asks, events         engine_frames.c    frames: matching, storing
 *   engine_cameras.c    the cameras: commands, notices  engine_judge.c     judgement
 *   engine_preflight.c  checks                          engine_triggers.c  the test shots
 *   engine_take.c       home, arm, load, mark, start    engine_sweep.c     the sweep goes on; what interrupts it
 *   engine_end.c        drain, retakes, seal            engine_open.c      making and opening captures, recovering
 *   engine_status.c     what can be seen                engine_control.c   what an operator wants
 *   engine_look.c       frames for who shows pictures, and pictures while nothing is under way
 *   engine_sphere.c     frames on the sphere, the arm   engine_retake.c    retakes that somebody asks for
 *
 * A capture goes through stages, one at a time; each stage's function is asked again whenever something has happened,
 * until it goes on to another stage.
 *
 * Cameras are counted as in the configuration everywhere in here; `cameras[c].rig` is the place in the rig's profile.
 */
#ifndef LUMI_DAEMON_ENGINE_ENGINE_PRIV_H
#define LUMI_DAEMON_ENGINE_ENGINE_PRIV_H

#include "daemon/camera/frame_file.h"
#include "daemon/engine/engine.h"
#include "daemon/engine/match.h"

#define ENGINE_NS 1000000000LL
#define ENGINE_EVENTS_MAX 16384 /* of the board that wait to be acknowledged */
#define ENGINE_PICTURES 3       /* of a camera that are kept for judging its neighbours */
#define ENGINE_TRIES 4          /* beginnings without a new frame until somebody has to look */

enum engine_stage {
    STAGE_REST = 0, /* idle, red, done, failed: nothing is under way */
    STAGE_LINK,
    STAGE_PROFILE,
    STAGE_CAMERAS,
    STAGE_TRIGGERS,
    STAGE_VERDICT,
    STAGE_ROWS, /* retakes get their rows */
    STAGE_HOME,
    STAGE_ARM,
    STAGE_TEST, /* a test shot for cameras of whose clock nothing is known any more */
    STAGE_LOAD,
    STAGE_READ,
    STAGE_MARK,
    STAGE_START,
    STAGE_SWEEP,
    STAGE_PAUSED,
    STAGE_INTERRUPTED,
    STAGE_AFTER, /* what the board says of shots that no event told of */
    STAGE_DRAIN,
    STAGE_SEAL,
    STAGE_CLOSE
};
#define ENGINE_STAGES 21

/* Where a planned frame is. */
enum engine_at {
    AT_NONE = 0, /* the plan wants none of this camera */
    AT_PLANNED,
    AT_TRIGGERED,
    AT_RECEIVED, /* in memory, on its way to the disk */
    AT_STORED,
    AT_ACCEPTED,
    AT_REJECTED, /* stored, and judged bad */
    AT_MISSING   /* never came, or could not be kept */
};

struct engine_frame {
    int64_t row;        /* of the frame in the capture: the latest retake */
    int64_t exposed_ns; /* by a sync edge; LUMI_NO_TIME */
    uint8_t at;         /* enum engine_at */
    bool dead_row;      /* the row is rejected: a retake needs another */
    bool flying;        /* its row is wanted of the store (retake) */
    bool judge_due;     /* stored, to be judged from its file */
    bool judging;
    bool asked;               /* somebody wants it again, good or not */
    uint8_t fault;            /* enum lumi_judge_fault, of the rejected */
    bool stuck;               /* the store makes no row for another attempt */
    int retakes;              /* rows before this one */
    float smear, smear_angle; /* of the picture judged last: pixels, radians; 0: none */
    char *reason;             /* NULL: none */
};

enum engine_shot_state { SHOT_PLANNED = 0, SHOT_FIRED, SHOT_LOST };
struct engine_shot {
    uint8_t state;
    double turns;        /* where it was taken, of the platform since step 0; NaN: as planned */
    int64_t expected_ns; /* host: begin of the exposures as told last; LUMI_NO_TIME */
};

/* A frame that came of a test shot. */
struct engine_test_answer {
    int64_t fired_ns;
    struct lumi_match_frame frame;
};
#define ENGINE_ANSWERS 8

/* A frame in memory: who needs it. */
struct engine_held {
    struct lumi_camera_frame *frame;
    int users;
    size_t bytes;
    int *of; /* counts those of a camera */
};

/* What a frame's file is made of, in a writer's thread. */
struct engine_filing {
    struct lumi_frame_file file;
    struct lumi_frame_about about;
    char vendor[LUMI_CAMERA_TEXT], model[LUMI_CAMERA_TEXT], serial[LUMI_CAMERA_TEXT]; /* the camera's, as it was then */
};

/* A job of the store that is not done, with all that is needed to give it once more. */
struct engine_flight {
    bool used, given;
    uint32_t generation;
    int shot, camera;
    uint64_t event; /* serial of the board's event that waits for it; 0 none */
    int64_t retry_ns;
    int tries;
    struct engine_held *held;
    struct engine_filing *filing; /* of FRAME */
    char *path;
    struct lumi_store_job job;
};

struct engine_event {
    uint64_t serial;
    int pending; /* jobs */
    bool taken;  /* accounted for */
    int64_t noticed_ns;
    lumi_wire_Event event;
};

struct engine_picture {
    struct lumi_judge_picture *picture;
    int users;
    int shot;
    double exposure_s, gain;
    struct lumi_pose pose;
};

struct engine_camera {
    int rig; /* −1: the rig has none of that name */
    bool used;
    bool there, configured, armed, status_known;
    bool given_up; /* away for longer than anybody waits: the capture goes on without it */
    int64_t away_ns;
    struct lumi_camera_identity identity;
    struct lumi_camera_status status;
    uint32_t command; /* that is waited for; 0 none */
    enum lumi_camera_command_kind command_kind;
    int command_code;
    char command_text[256];
    double exposure_s; /* as it was told last */
    struct lumi_match *match;
    struct engine_held **files; /* FILE frames, matched when the sweep is over */
    int file_count, file_room;
    int64_t file_ns; /* when the last came */
    uint32_t seen;   /* bit a camera that answered its trigger in the test */
    bool round_seen; /* it answered the test shot that was fired last */
    struct engine_test_answer answers[ENGINE_ANSWERS];
    int answer_count;
    bool trusted;    /* where its clock or count stands is known */
    bool doubtful;   /* it did not answer the last test as it should: of no frame of it is the shot known */
    uint32_t misses; /* frames that never came, and frames of no shot, since */
    bool edge_seen;  /* of its sync line, in the test */
    size_t frame_bytes;
    struct engine_held *test;
    int held;        /* its frames that are in memory here */
    bool looking;    /* it is set up for pictures while nothing is under way */
    int64_t look_ns; /* not before this the next */
    struct engine_picture *pictures[ENGINE_PICTURES];
    struct lumi_judge_usual usual;
    uint32_t unseen, wrong_exposure; /* told of: the first few by name, then counted */
    uint64_t surplus;                /* beside the matcher's: frames that were good already */
};

struct engine_ask {
    uint32_t number; /* 0: nothing is asked */
    bool answered;
    int code;
    char text[512];
    bool has_reply;
    lumi_wire_Reply reply;
};

enum engine_pause { PAUSE_NONE = 0, PAUSE_OPERATOR, PAUSE_DISK, PAUSE_CAMERA };

struct lumi_engine {
    struct lumi_engine_config config;
    struct lumi_engine_ports ports;
    int64_t now, utc_offset;
    uint64_t told_number;
    enum lumi_engine_state state;
    char text[512];
    bool stepping;
    bool lit; /* the lamp */

    enum engine_stage stage;
    int64_t stage_ns; /* since when */
    int stage_at;     /* how far a stage with several steps is */
    int64_t wake;     /* when the stage wants to be asked again */

    /* the board */
    bool connected, link_known;
    struct lumi_rig_link_snapshot link;
    int64_t connected_ns, lost_ns;
    uint32_t next_number;
    struct engine_ask ask;
    uint32_t side; /* of a request whose answer matters only if it fails */
    uint32_t look; /* of a test trigger for a picture; 0: none is out */
    int64_t cleared_ns;
    struct lumi_rig rig;
    bool rig_known;
    struct lumi_rig board_rig; /* of the board that was asked last, whatever the capture's is */
    bool board_rig_known;
    struct engine_event *events;
    int event_count, event_room;
    uint64_t event_serial;
    uint32_t faults; /* bit a fault, as events and status say */
    bool estop;
    bool jogging;
    int64_t jog_ns;
    bool home_wanted;       /* by the operator, beside a capture */
    bool homed, home_found; /* a Homed event came since it was asked for */
    char home_text[128];
    bool ended;
    lumi_wire_SweepEnded_How how;
    int64_t begun_ns, rest_ns;
    bool moving;       /* a sweep was started and its end is not known */
    bool position_set; /* this engine has homed, or found it homed, and no restart since */
    uint32_t events_gone;

    /* the plan */
    char *plan_text;
    struct lumi_plan plan;
    bool plan_known;
    int shots;
    uint8_t *board_shots; /* as the board says */
    uint8_t *drive_states;
    bool driving;       /* the sweep is a drive's */
    bool drive_reset;   /* somebody has said that it goes on: an alarm that the drive has may be reset */
    uint32_t drive_out; /* number of the drive_sweep that is to be answered; 0 none */
    bool check_rig;     /* the capture's profile has not been compared with the board's yet */
    char name[256], title[256];
    char **override;
    int override_count;
    bool preflight_only;

    /* the capture */
    char capture[1024];
    struct lumi_store *store;
    struct engine_shot *account_shots;
    struct engine_frame *frames; /* shot × camera_count + camera */
    char (*names)[LUMI_CAPTURE_NAME];
    int64_t shots_fired_events;
    int at_count[8];
    int shots_lost, shots_fired;
    int64_t bytes;
    int sweep_number, round;
    bool sweep_open;
    bool fresh; /* nothing of it was ever fired: the sweep winds as the plan says */
    int tries;  /* beginnings since the last new frame */
    bool go_on; /* an interruption that ends by itself */
    bool want_pause, want_stop, want_seal, stop_at_once;
    enum engine_pause pause;
    int retakes_left;
    bool *chosen; /* frames to be retaken by name; NULL: all that are not good */
    bool sealed_ok;

    struct engine_flight **flights;
    int flight_count, flight_room, flying;
    bool disk_full;
    char disk_text[256];
    int64_t disk_free;
    double disk_speed;

    /* judgement */
    int judging;
    int judge_due;
    struct engine_judging *jobs;
    uint64_t judge_serial;

    /* preflight */
    struct lumi_engine_check checks[LUMI_ENGINE_CHECKS];
    bool check_hard[LUMI_ENGINE_CHECKS];
    int check_count;
    int test_camera;
    int64_t test_ns; /* when the test shot was fired; 0: none was */
    bool test_told;  /* the board has said so */
    int test_again;  /* tests of this camera that nothing came of */
    int test_rounds;
    int64_t test_first_ns; /* when the camera that is tested was fired first */
    struct engine_camera cameras[LUMI_RIG_CAMERAS];
};

/* ---- engine.c ---- */
void engine_tell(struct lumi_engine *e, enum lumi_engine_tale kind, int shot, int camera, const char *text);
void engine_state(struct lumi_engine *e, enum lumi_engine_state state, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
void engine_go(struct lumi_engine *e, enum engine_stage stage);
void engine_step(struct lumi_engine *e); /* asks the stage until it waits */
void engine_wake(struct lumi_engine *e, double seconds);
double engine_since(const struct lumi_engine *e, int64_t ns);
int64_t engine_unix_us(const struct lumi_engine *e, int64_t host_ns);
/* A line for the capture's log and for whoever listens; camera −1: none. */
void engine_incident(struct lumi_engine *e, int camera, const char *kind, const char *format, ...)
    __attribute__((format(printf, 4, 5)));
/* The row only: it is told otherwise. */
void engine_incident_row(struct lumi_engine *e, int camera, const char *kind, const char *text);
char *engine_copy(const char *text); /* lumi_free; NULL for NULL or no memory */

/* ---- engine_rig.c ---- */
void engine_ask(struct lumi_engine *e, const lumi_wire_Request *request);
bool engine_asked(const struct lumi_engine *e);
void engine_ask_none(struct lumi_engine *e); /* an answer that is still to come is of no interest */
void engine_send(struct lumi_engine *e, const lumi_wire_Request *request);
bool engine_board_rests(const struct lumi_engine *e);
lumi_wire_State engine_board_state(const struct lumi_engine *e);
void engine_events_settle(struct lumi_engine *e); /* takes those that can be, acknowledges those that are kept */
void engine_faults_text(uint32_t faults, char *text, size_t size);
bool engine_clear_host_lost(struct lumi_engine *e);

/* ---- engine_cameras.c ---- */
void engine_camera_do(struct lumi_engine *e, int camera, enum lumi_camera_command_kind kind, double exposure_s);
int engine_camera_of(const struct lumi_engine *e, int rig_camera); /* −1 */
bool engine_camera_ready(const struct lumi_engine *e, int camera);
void engine_camera_reset(struct lumi_engine *e, int camera);

/* ---- engine_account.c ---- */
struct engine_frame *engine_frame_at(struct lumi_engine *e, int shot, int camera);
void engine_frame_go(struct lumi_engine *e, int shot, int camera, enum engine_at at, const char *reason);
struct engine_flight *engine_flight(struct lumi_engine *e, enum lumi_store_job_kind kind);
void engine_flight_give(struct lumi_engine *e, struct engine_flight *flight);
void engine_store_collect(struct lumi_engine *e); /* what the store has done; what has to be given once more */
void engine_shot_event(struct lumi_engine *e, struct engine_event *event);
/* A shot that was fired, at a time that may be unknown. */
void engine_shot_fired(struct lumi_engine *e, int shot, const int64_t *begin_ns, uint32_t cameras, uint64_t event);
void engine_frame_lost(struct lumi_engine *e, int shot, int camera, const char *format, ...)
    __attribute__((format(printf, 4, 5)));
bool engine_frame_needed(const struct engine_frame *frame);
int engine_frames_needed(const struct lumi_engine *e);
bool engine_shot_needed(const struct lumi_engine *e, int shot);
void engine_account_free(struct lumi_engine *e);
void engine_held_drop(struct engine_held *held);

/* ---- engine_sphere.c ---- */
char engine_frame_letter(const struct lumi_engine *e, const struct engine_frame *frame);
int engine_frame_number(const struct lumi_engine *e, int shot, int camera);
void engine_arm(const struct lumi_engine *e, struct lumi_engine_arm *arm);

/* ---- engine_retake.c ---- */
/* A frame that is stored, and that somebody wants again. */
void engine_reject_asked(struct lumi_engine *e, int shot, int camera);
bool engine_resting(const struct lumi_engine *e); /* nothing is under way, and no capture is open */
int engine_busy(const struct lumi_engine *e, struct lumi_error *error); /* says what is under way */

/* ---- engine_frames.c ---- */
void engine_frame_came(struct lumi_engine *e, int camera, struct lumi_camera_frame *frame);
void engine_match_all(struct lumi_engine *e);
void engine_match_options(const struct lumi_engine *e, int camera, struct lumi_match_options *options);
void engine_match_begin(struct lumi_engine *e); /* of a sweep */
void engine_match_files(struct lumi_engine *e, int camera);
int64_t engine_match_wake(const struct lumi_engine *e);

/* ---- engine_judge.c ---- */
struct engine_judging {
    bool used;
    uint64_t id;
    int shot, camera;
    struct engine_held *held;
    struct engine_picture *neighbours[4];
    struct lumi_pose pose;
    double exposure_s, gain;
    struct lumi_camera_frame file; /* where it is judged from the disk */
    char path[1280];
};
#define ENGINE_JUDGING 32
/* Where it was taken, or will be. */
void engine_shot_pose(const struct lumi_engine *e, int shot, int camera, struct lumi_pose *pose);
void engine_judge(struct lumi_engine *e, int shot, int camera, struct engine_held *held);
void engine_judge_due(struct lumi_engine *e);
void engine_judge_forget(struct lumi_engine *e); /* verdicts that are still to come are of no account */
void engine_judge_reset(struct lumi_engine *e);

/* ---- engine_look.c ---- */
void engine_picture(struct lumi_engine *e, int shot, int camera, struct lumi_camera_frame *frame);
void engine_look_none(struct lumi_engine *e); /* something begins */
/* What came of a command to a camera that is looked through; of a test trigger. */
void engine_look_done(struct lumi_engine *e, int camera);
void engine_look_reply(struct lumi_engine *e, uint32_t number);

/* ---- the stages ---- */
typedef bool (*engine_stage_fn)(struct lumi_engine *e); /* true: another stage */
bool engine_stage_link(struct lumi_engine *e);
bool engine_stage_profile(struct lumi_engine *e);
bool engine_stage_cameras(struct lumi_engine *e);
bool engine_stage_triggers(struct lumi_engine *e);
bool engine_stage_verdict(struct lumi_engine *e);
bool engine_stage_rows(struct lumi_engine *e);
bool engine_stage_home(struct lumi_engine *e);
bool engine_youngest(const struct lumi_engine *e, char *found, size_t size); /* capture in the folder, by name */
bool engine_stage_arm(struct lumi_engine *e);
bool engine_stage_test(struct lumi_engine *e);
bool engine_stage_load(struct lumi_engine *e);
bool engine_stage_read(struct lumi_engine *e);
bool engine_stage_mark(struct lumi_engine *e);
bool engine_stage_start(struct lumi_engine *e);
bool engine_stage_sweep(struct lumi_engine *e);
bool engine_stage_paused(struct lumi_engine *e);
bool engine_stage_interrupted(struct lumi_engine *e);
bool engine_stage_after(struct lumi_engine *e);
bool engine_stage_drain(struct lumi_engine *e);
bool engine_stage_seal(struct lumi_engine *e);
bool engine_stage_close(struct lumi_engine *e);

/* ---- engine_preflight.c ---- */
void engine_check(struct lumi_engine *e, bool hard, enum lumi_verdict verdict, const char *name, const char *format,
                  ...) __attribute__((format(printf, 5, 6)));
int engine_map_cameras(struct lumi_engine *e, struct lumi_error *error);
int engine_parse_plan(struct lumi_engine *e, struct lumi_error *error);
void engine_test_frame(struct lumi_engine *e, int camera, struct lumi_camera_frame *frame);
void engine_test_judged(struct lumi_engine *e, int camera, int code, const char *text,
                        const struct lumi_judge_numbers *numbers);
double engine_spacing(const struct lumi_engine *e); /* s, least between two exposures */

/* ---- engine_take.c, engine_sweep.c, engine_end.c ---- */
void engine_take(struct lumi_engine *e); /* whatever is needed is taken */
void engine_interrupt(struct lumi_engine *e, bool go_on, const char *format, ...) __attribute__((format(printf, 3, 4)));
bool engine_taking(const struct lumi_engine *e); /* a capture is open and under way */
void engine_watch(struct lumi_engine *e);        /* faults, board, disk, cameras */
void engine_ended(struct lumi_engine *e, const lumi_wire_Event *event);
void engine_restarted(struct lumi_engine *e);
bool engine_disk_eased(const struct lumi_engine *e);
void engine_sweep_row(struct lumi_engine *e, bool ended, const char *text);
void engine_fail(struct lumi_engine *e, const char *format, ...) __attribute__((format(printf, 2, 3)));
void engine_rest(struct lumi_engine *e, enum lumi_engine_state state);

/* ---- engine_open.c ---- */
int engine_make(struct lumi_engine *e, struct lumi_error *error); /* the capture of a plan that passed */
int engine_look(struct lumi_engine *e, const char *path, struct lumi_error *error); /* its account, unchanged */
int engine_reopen(struct lumi_engine *e, const char *path, struct lumi_error *error);

#endif
