/* The thread around one camera: opens it, configures and arms it as it is told, takes its frames, and when it goes away
 * opens, configures and arms it again as soon as it is back. All functions may be called from any thread and return at
 * once; what came of a command is a notice. */
#ifndef LUMI_DAEMON_CAMERA_CAMERA_HOST_H
#define LUMI_DAEMON_CAMERA_CAMERA_HOST_H

#include "daemon/camera/camera_device.h"

enum lumi_camera_notice_kind {
    LUMI_CAMERA_CAME = 0, /* `identity`; configured and armed again if it was before it went */
    LUMI_CAMERA_GONE,     /* `code`, `text`; also when it is not there at the start */
    LUMI_CAMERA_FRAME,    /* `frame`: the taker's to release */
    LUMI_CAMERA_DONE,     /* of command number `command`: `code`, `text` */
    LUMI_CAMERA_STATUS    /* `status`, about once a second, and after every command; `code`, `text`: what went wrong
                             with a frame since the last one */
};
struct lumi_camera_notice {
    enum lumi_camera_notice_kind kind;
    int64_t host_ns; /* CLOCK_MONOTONIC when it was noticed */
    uint32_t command;
    int code;
    char text[512];
    struct lumi_camera_identity identity;
    struct lumi_camera_status status;
    struct lumi_camera_frame *frame;
};

enum lumi_camera_command_kind {
    LUMI_CAMERA_CONFIGURE = 0,
    LUMI_CAMERA_ARM,
    LUMI_CAMERA_DISARM,
    LUMI_CAMERA_TRIGGER,
    LUMI_CAMERA_EXPOSE
};
struct lumi_camera_command {
    enum lumi_camera_command_kind kind;
    struct lumi_camera_setting setting; /* CONFIGURE */
    double exposure_s, gain;            /* EXPOSE */
};

struct lumi_camera_host;
struct lumi_camera_host_options {
    int frames_max; /* that wait to be taken; more are dropped and counted in status.dropped, or, of a camera that
                     * records by itself, not asked for yet (16) */
    int retry_ms;   /* between two attempts to find a camera that is away (500) */
    void (*wake)(void *context); /* in the camera's thread, when there is a notice; must not call the host */
    void *context;
};
void lumi_camera_host_options_init(struct lumi_camera_host_options *options);

/* `address` as for lumi_camera_open. Whether it is there is known by notice. */
int lumi_camera_host_start(const char *address, const struct lumi_camera_host_options *options,
                           struct lumi_camera_host **host, struct lumi_error *error);
/* The same around a camera of one's own making (tests, other backends): `open` is asked again and again. */
typedef int (*lumi_camera_open_fn)(void *context, struct lumi_camera **camera, struct lumi_error *error);
int lumi_camera_host_start_with(lumi_camera_open_fn open, void *open_context,
                                const struct lumi_camera_host_options *options, struct lumi_camera_host **host,
                                struct lumi_error *error);
/* Ends the thread; frames that were taken stay valid. NULL is fine. */
void lumi_camera_host_stop(struct lumi_camera_host *host);

/* Commands are done in order; `number` comes back in LUMI_CAMERA_DONE. While the camera is away, CONFIGURE, ARM, DISARM
 * are kept for when it is back and answered then; TRIGGER and EXPOSE fail. What was set up last and succeeded (setting,
 * exposure, armed) is set up again when it is back, before LUMI_CAMERA_CAME. LUMI_ERR_NOMEM: not taken. */
int lumi_camera_host_command(struct lumi_camera_host *host, uint32_t number, const struct lumi_camera_command *command);
/* False: none now. */
bool lumi_camera_host_notice(struct lumi_camera_host *host, struct lumi_camera_notice *notice);

#endif
