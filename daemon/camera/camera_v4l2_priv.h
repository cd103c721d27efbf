/* A V4L2 capture device: what its files share. Kernel documentation: userspace-api/media/v4l. */
#ifndef LUMI_DAEMON_CAMERA_CAMERA_V4L2_PRIV_H
#define LUMI_DAEMON_CAMERA_CAMERA_V4L2_PRIV_H

#include "daemon/camera/camera_priv.h"

#include <linux/videodev2.h>

/* ---- pixel formats ---- */

struct v4l2_pixel {
    uint32_t fourcc;
    enum lumi_frame_layout layout;
    enum lumi_bayer bayer;
    int bits;
    int planes;  /* in memory: 2 for NM12 */
    bool packed; /* MIPI CSI-2's packing, unpacked to words as it is copied */
};
const struct v4l2_pixel *v4l2_pixel_find(uint32_t fourcc); /* NULL: not of ours */
/* What the option PixelFormat=NM12 asks for; 0: nothing. */
#define V4L2_OPTION_FORMAT "PixelFormat"
int v4l2_pixel_option(const struct lumi_camera_setting *setting, uint32_t *fourcc, struct lumi_error *error);
/* Which of the device's formats a setting wants; NULL: none, with what there is in `error`. Zero-copy frames lie in one
 * plane and are not unpacked. */
const struct v4l2_pixel *v4l2_pixel_choose(const uint32_t *fourccs, int count,
                                           const struct lumi_camera_setting *setting, struct lumi_error *error);

/* ---- the device ---- */

struct v4l2_stream;
struct v4l2_camera {
    struct lumi_camera camera;
    int fd;
    uint32_t type; /* V4L2_BUF_TYPE_VIDEO_CAPTURE, or _MPLANE */
    struct lumi_camera_setting setting;
    const struct v4l2_pixel *pixel; /* NULL: not configured */
    struct lumi_frame_format format;
    int plane_stride[2];
    struct camera_pool *pool;
    struct v4l2_stream *stream; /* NULL: not armed */
    uint64_t frames, dropped, damaged;
    double gain_unit; /* the control's value at gain 1; 0: not known */
    double line_s;    /* V4L2_CID_EXPOSURE's unit; 0: not known */
};

/* ioctl, again when a signal interrupted it: 0 or −1 with errno. */
int v4l2_ioctl(int fd, unsigned long request, void *argument);
/* From errno: a device that is gone is LUMI_ERR_IO, a busy one LUMI_ERR_BUSY, what it does not take
 * LUMI_ERR_UNSUPPORTED. */
int v4l2_fail(const struct v4l2_camera *camera, struct lumi_error *error, const char *doing);

/* camera_v4l2_control.c */
void v4l2_control_identify(struct v4l2_camera *camera); /* what of exposure, gain, trigger the device has */
int v4l2_control_apply(struct v4l2_camera *camera, const struct lumi_camera_setting *setting, struct lumi_error *error);
int v4l2_control_exposure(struct v4l2_camera *camera, double exposure_s, struct lumi_error *error);
int v4l2_control_gain(struct v4l2_camera *camera, double gain, struct lumi_error *error);
int v4l2_control_trigger(struct v4l2_camera *camera, struct lumi_error *error);
void v4l2_control_read(struct v4l2_camera *camera, double *exposure_s, double *gain); /* 0: unknown */
/* A control's name as options write it: "White Balance, Automatic" is white_balance_automatic. */
void v4l2_control_name(const char *name, char *option, size_t size);

/* camera_v4l2_stream.c */
int v4l2_stream_start(struct v4l2_camera *camera, struct lumi_error *error);
int v4l2_stream_stop(struct v4l2_camera *camera, struct lumi_error *error); /* frames that are out stay valid */
int v4l2_stream_frame(struct v4l2_camera *camera, struct lumi_camera_frame **frame, struct lumi_error *error);

#endif
