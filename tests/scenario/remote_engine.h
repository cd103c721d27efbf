/* The engine as a process of its own, so that it can be killed: capture_engine_process holds the real engine and the
 * real store with its threads, remote_engine.c gives the tests' program the engine's functions and sends what they are
 * told over a socket. Every call is answered before the next; what the engine asks of its ports comes back as messages.
 */
#ifndef LUMI_TESTS_SCENARIO_REMOTE_ENGINE_H
#define LUMI_TESTS_SCENARIO_REMOTE_ENGINE_H

#include "daemon/engine/engine.h"

enum remote_op {
    /* calls */
    REMOTE_CREATE = 1,
    REMOTE_RECOVER,
    REMOTE_RUN,
    REMOTE_CLOCK,
    REMOTE_RIG_NOTICE,
    REMOTE_RIG_REPLY,
    REMOTE_RIG_PROFILE,
    REMOTE_RIG_STATUS,
    REMOTE_CAMERA_NOTICE,
    REMOTE_SYNC_EDGE,
    REMOTE_JUDGED,
    REMOTE_DISK,
    REMOTE_START,
    REMOTE_PAUSE,
    REMOTE_RESUME,
    REMOTE_RETAKE,
    REMOTE_CLEAR,
    REMOTE_STATUS,
    /* answers */
    REMOTE_END,
    REMOTE_STATUS_IS,
    REMOTE_REQUEST,
    REMOTE_PROFILE,
    REMOTE_STORED,
    REMOTE_STOP,
    REMOTE_TO_HOST, /* the engine waits for the answer, of the same op */
    REMOTE_CAMERA,
    REMOTE_JUDGE,
    REMOTE_HAND_OVER,
    REMOTE_TOLD,
    REMOTE_RELEASED,
    REMOTE_WAKE
};

struct remote_head {
    uint32_t op, size;
};

/* What most messages need; each op uses some of it. */
struct remote_words {
    int64_t now_ns, at_ns;
    uint64_t id;
    uint32_t number;
    int camera, code, jobs;
    bool flag;
    double rate;
    char text[1024], name[1024];
};

struct remote_message {
    struct remote_words words;
    union {
        struct lumi_engine_config config;
        struct lumi_rig_notice notice;
        lumi_wire_Reply reply;
        lumi_wire_Request request;
        lumi_wire_Event event;
        struct lumi_rig rig;
        struct lumi_rig_link_snapshot snapshot;
        struct lumi_camera_notice camera; /* its frame's header is `frame`, the bytes follow the message */
        struct lumi_camera_command command;
        struct lumi_judge_numbers numbers;
        struct lumi_engine_told told;
        char plan[LUMI_PLAN_TEXT_MAX];
    } u;
    struct lumi_camera_frame frame;
};

/* False: the other end is gone. */
bool remote_write(int fd, enum remote_op op, const void *data, size_t size, const void *more, size_t more_size);
bool remote_read(int fd, void *data, size_t size);

/* ---- for the tests ---- */

/* Where the program lies; set before lumi_engine_create. */
extern const char *remote_engine_program;
/* When the process is to be killed: before or so many microseconds into the call of this op that makes the count zero.
 */
struct remote_kill {
    enum remote_op op; /* 0: any */
    int count;         /* calls until then; 0: not at all */
    int delay_us;      /* −1: before the call is made */
    bool busy;         /* only calls while the store has jobs count */
    bool round;        /* only those in a round of retakes count */
    int jobs;          /* the store had when it died */
    bool crashed;      /* it died by itself */
};
extern struct remote_kill remote_kill;
bool remote_engine_dead(const struct lumi_engine *engine);
int remote_engine_jobs(const struct lumi_engine *engine);

#endif
