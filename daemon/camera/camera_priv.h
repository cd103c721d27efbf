/* What the backends share: the table of them, frames in a pool, options, serial numbers. */
#ifndef LUMI_DAEMON_CAMERA_CAMERA_PRIV_H
#define LUMI_DAEMON_CAMERA_CAMERA_PRIV_H

#include "daemon/camera/camera_device.h"

/* ---- backends ---- */

/* `what`: what follows "v4l2:", a serial number or a place; (transfer full). */
typedef int (*camera_open_fn)(const char *what, struct lumi_camera **camera, struct lumi_error *error);
/* At most `max`; returns how many there are (of which the first `max` are filled in) or a negative code. */
typedef int (*camera_list_fn)(struct lumi_camera_identity *cameras, int max, struct lumi_error *error);

int camera_v4l2_open(const char *what, struct lumi_camera **camera, struct lumi_error *error);
int camera_v4l2_list(struct lumi_camera_identity *cameras, int max, struct lumi_error *error);
int camera_libcamera_open(const char *what, struct lumi_camera **camera, struct lumi_error *error);
int camera_libcamera_list(struct lumi_camera_identity *cameras, int max, struct lumi_error *error);
int camera_aravis_open(const char *what, struct lumi_camera **camera, struct lumi_error *error);
int camera_aravis_list(struct lumi_camera_identity *cameras, int max, struct lumi_error *error);
int camera_files_open(const char *folder, struct lumi_camera **camera, struct lumi_error *error);

/* The one of `count` listed cameras that `what` names, by serial number or by address. Its index, or
 * LUMI_ERR_NOTFOUND, LUMI_ERR_EXISTS. */
int camera_pick(const struct lumi_camera_identity *cameras, int count, const char *what, struct lumi_error *error);

/* Which backend an address names, and what follows; LUMI_CAMERA_BACKENDS: none, a serial number alone. Only what is
 * malformed is an error (LUMI_ERR_ARG). */
int camera_address_parse(const char *address, enum lumi_camera_backend *backend, const char **what,
                         struct lumi_error *error);

/* ---- lumi_camera_setting.options: "Name=value Name=value" ---- */

struct camera_option {
    char name[64], value[128];
};
/* The next one at *text, which moves on: 1, 0 at the end, or LUMI_ERR_ARG. */
int camera_option_next(const char **text, struct camera_option *option, struct lumi_error *error);

/* ---- frames ---- */

/* `count` buffers, each made as big as the frames that come; whoever made it and every frame that is out hold it. */
struct camera_pool;
int camera_pool_create(int count, struct camera_pool **pool, struct lumi_error *error);
/* A frame with room for `bytes` (also the memory for FILE's path); NULL: all are out, or no memory. All zero but
 * `release`, `data`, `size`, and what says that something is not known. */
struct lumi_camera_frame *camera_pool_take(struct camera_pool *pool, size_t bytes);
uint8_t *camera_pool_bytes(struct lumi_camera_frame *frame); /* its memory, to be written */
void camera_pool_drop(struct camera_pool *pool);             /* NULL is fine; frames that are out stay valid */
void camera_frame_init(struct lumi_camera_frame *frame);     /* "not known" everywhere, for frames of one's own */

int64_t camera_now_ns(void); /* CLOCK_MONOTONIC */

#endif
