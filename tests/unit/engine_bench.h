/* A capture engine on a bench: a board and two cameras that do as they are told, driven by hand in virtual time. The
 * thorough world, with the firmware itself and everything that goes wrong, is in tests/scenario. */
#ifndef LUMI_TESTS_UNIT_ENGINE_BENCH_H
#define LUMI_TESTS_UNIT_ENGINE_BENCH_H

#include "daemon/engine/engine.h"

#define BENCH_CAMERAS 2
#define BENCH_NS 1000000000LL

/* What the cameras do with one shot. */
enum bench_flaw { BENCH_NO_FRAME = 1, BENCH_TWICE = 2, BENCH_LATE = 4, BENCH_DAMAGED = 8, BENCH_EXPOSURE = 16 };

struct bench_due {
    int64_t at;
    int kind; /* 1 reply, 2 profile, 3 camera done, 4 event, 5 frame, 6 end, 7 judged */
    uint32_t number;
    uint64_t id;
    int camera, shot;
    int64_t begin;
    lumi_wire_Reply reply;
    lumi_wire_Event event;
    double exposure_s; /* of what the camera is set to */
    bool damaged;
};

struct bench {
    char folder[64];
    struct lumi_rig rig;
    struct lumi_engine_config config;
    struct lumi_engine *engine;
    int64_t now;
    struct bench_due *due;
    int due_count, due_room;
    /* the board */
    struct lumi_plan plan;
    uint8_t shots[64];
    lumi_wire_State state;
    uint32_t faults, event_number, stored; /* stored: events acknowledged */
    bool connected, known;
    int64_t sweep_until;
    int starts, homes;
    bool lit;
    uint32_t home_turn; /* that the last one was told */
    double jogged;      /* turns, of the last jog */
    int64_t step;
    /* the cameras */
    int64_t clock_offset[BENCH_CAMERAS];
    uint64_t sequence[BENCH_CAMERAS];
    double exposure[BENCH_CAMERAS];
    int told_exposures;
    bool by_software;                                /* they have a software trigger */
    enum lumi_camera_trigger trigger[BENCH_CAMERAS]; /* as set */
    bool armed[BENCH_CAMERAS];
    int fired[BENCH_CAMERAS];          /* by software */
    int tests_fired;                   /* by the board */
    bool silent;                       /* their frames tell no exposure time */
    bool exchanged;                    /* their trigger wires */
    int tests_lost;                    /* so many frames of test shots do not come */
    double battery;                    /* told by the cameras if not 0 */
    int64_t card;                      /* likewise: bytes free */
    bool tests_twice;                  /* frames of test shots come once more, 0.4 s later */
    unsigned flaws[64][BENCH_CAMERAS]; /* taken away when they have happened */
    int frames_out;
    /* the drive, if drive_says: how it answers */
    const char *drive_says;
    int drive_code;
    /* the disk */
    bool disk_full;
    /* what was shown: frames of shots, others */
    int shown, looked;
    /* what was told */
    char handed[1024], last_incident[512];
    unsigned states_told;           /* a bit each */
    char letters[64];               /* of each frame, as told last; '.' none */
    int incidents, verdict_rejects; /* the judge rejects so many more */
    double smears[4];               /* pixels that it finds in the next ones, until 0 */
    struct lumi_engine_status status;
};

/* `mode` of a plan with four positions; `bracket` exposures. */
void bench_begin(struct bench *bench, enum lumi_plan_mode mode, int bracket);
void bench_end(struct bench *bench);
void bench_engine(struct bench *bench); /* makes the engine; after a kill once more */
void bench_kill(struct bench *bench);   /* what the engine held in memory is gone */
int bench_start(struct bench *bench, bool preflight_only, struct lumi_error *error);
/* Time passes until the engine is in this state, or so many seconds are over: false. */
bool bench_until(struct bench *bench, enum lumi_engine_state state, double seconds);
void bench_run(struct bench *bench, double seconds);
const struct lumi_engine_status *bench_status(struct bench *bench);
const struct lumi_engine_check *bench_check(struct bench *bench, const char *name);
void bench_event(struct bench *bench, const lumi_wire_Event *event);
void bench_stand_still(struct bench *bench); /* what the board has begun is finished, nothing more happens */
void bench_restart_board(struct bench *bench);

#endif
