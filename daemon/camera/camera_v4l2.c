/* Cameras that the kernel drives (V4L2): opened, set up, fired. */
#include "daemon/camera/camera_unpack.h"
#include "daemon/camera/camera_v4l2_priv.h"
#include "proto/base/memory.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>

#define LISTED_MAX 64
#define FORMATS_MAX 256
#define LENT_MAX (VIDEO_MAX_FRAME - 2) /* the driver needs two to go on */

int v4l2_ioctl(int fd, unsigned long request, void *argument)
{
    int code;

    do
        code = ioctl(fd, request, argument);
    while (code != 0 && errno == EINTR);
    return code;
}

int v4l2_fail(const struct v4l2_camera *camera, struct lumi_error *error, const char *doing)
{
    const int code = errno == ENODEV || errno == ENXIO ? LUMI_ERR_IO
                     : errno == EBUSY                  ? LUMI_ERR_BUSY
                     : errno == ENOMEM                 ? LUMI_ERR_NOMEM
                                                       : LUMI_ERR_UNSUPPORTED;

    return lumi_fail(error, code, "%s (%s): %s: %s", camera->camera.identity.address, camera->camera.identity.serial,
                     doing, strerror(errno));
}

/* ---- setting up ---- */

static const struct v4l2_pixel *choose_pixel(struct v4l2_camera *camera, const struct lumi_camera_setting *setting,
                                             struct lumi_error *error)
{
    uint32_t fourccs[FORMATS_MAX];
    const struct v4l2_pixel *pixel;
    int count = 0;

    while (count < FORMATS_MAX) {
        struct v4l2_fmtdesc format = {.index = (uint32_t)count, .type = camera->type};

        if (v4l2_ioctl(camera->fd, VIDIOC_ENUM_FMT, &format) != 0)
            break;
        fourccs[count++] = format.pixelformat;
    }
    pixel = v4l2_pixel_choose(fourccs, count, setting, error);
    if (!pixel)
        lumi_fail_prefix(error, "%s", camera->camera.identity.address);
    return pixel;
}

/* As large as it goes in this format. */
static void largest(const struct v4l2_camera *camera, uint32_t fourcc, int *width, int *height)
{
    for (uint32_t i = 0;; i++) {
        struct v4l2_frmsizeenum size = {.index = i, .pixel_format = fourcc};
        uint32_t w, h;

        if (v4l2_ioctl(camera->fd, VIDIOC_ENUM_FRAMESIZES, &size) != 0)
            return;
        w = size.type == V4L2_FRMSIZE_TYPE_DISCRETE ? size.discrete.width : size.stepwise.max_width;
        h = size.type == V4L2_FRMSIZE_TYPE_DISCRETE ? size.discrete.height : size.stepwise.max_height;
        if ((uint64_t)w * h > (uint64_t)*width * (uint64_t)*height && w < 65536 && h < 65536) {
            *width = (int)w;
            *height = (int)h;
        }
    }
}

struct accepted { /* the same of both interfaces */
    uint32_t fourcc, width, height, field, colorspace, encoding, quantization, planes, stride[2];
};

static int try_format(struct v4l2_camera *camera, uint32_t fourcc, int width, int height, struct accepted *got,
                      struct lumi_error *error)
{
    struct v4l2_format format = {.type = camera->type};
    const bool many = camera->type == V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE;
    struct v4l2_pix_format_mplane *mp = &format.fmt.pix_mp;
    struct v4l2_pix_format *sp = &format.fmt.pix;

    if (v4l2_ioctl(camera->fd, VIDIOC_G_FMT, &format) != 0)
        return v4l2_fail(camera, error, "asking for its format");
    if (many) {
        memset(mp->plane_fmt, 0, sizeof mp->plane_fmt);
        mp->pixelformat = fourcc;
        mp->field = V4L2_FIELD_NONE;
        mp->width = width ? (uint32_t)width : mp->width;
        mp->height = height ? (uint32_t)height : mp->height;
    } else {
        sp->bytesperline = sp->sizeimage = 0;
        sp->pixelformat = fourcc;
        sp->field = V4L2_FIELD_NONE;
        sp->width = width ? (uint32_t)width : sp->width;
        sp->height = height ? (uint32_t)height : sp->height;
    }
    if (v4l2_ioctl(camera->fd, VIDIOC_S_FMT, &format) != 0)
        return v4l2_fail(camera, error, "setting its format");
    if (many)
        *got = (struct accepted){
            mp->pixelformat,  mp->width,      mp->height,
            mp->field,        mp->colorspace, mp->ycbcr_enc,
            mp->quantization, mp->num_planes, {mp->plane_fmt[0].bytesperline, mp->plane_fmt[1].bytesperline}};
    else
        *got = (struct accepted){sp->pixelformat,      sp->width,     sp->height,       sp->field,
                                 sp->colorspace,       sp->ycbcr_enc, sp->quantization, 1,
                                 {sp->bytesperline, 0}};
    return LUMI_OK;
}

static int bytes_of_row(const struct v4l2_pixel *pixel, int width)
{
    switch (pixel->layout) {
    case LUMI_LAYOUT_RGB:
        return 3 * width;
    case LUMI_LAYOUT_YUYV:
        return 2 * (width + width % 2);
    case LUMI_LAYOUT_NV12:
        return width + width % 2;
    case LUMI_LAYOUT_JPEG:
        return 0;
    default:
        return pixel->bits > 8 ? 2 * width : width;
    }
}

static int set_format(struct v4l2_camera *camera, const struct v4l2_pixel *pixel,
                      const struct lumi_camera_setting *setting, struct lumi_error *error)
{
    int width = setting->width, height = setting->height, row;
    struct accepted got;

    if (!width || !height)
        largest(camera, pixel->fourcc, &width, &height);
    LUMI_TRY(try_format(camera, pixel->fourcc, width, height, &got, error));
    if (got.fourcc != pixel->fourcc || (width && (int)got.width != width) || (height && (int)got.height != height))
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "%s: %d x %d of %.4s: it would give %u x %u of %.4s",
                         camera->camera.identity.address, width, height, (const char *)&pixel->fourcc, got.width,
                         got.height, (const char *)&got.fourcc);
    row = bytes_of_row(pixel, (int)got.width);
    if (got.field != V4L2_FIELD_NONE || got.width > 65535 || got.height > 65535 ||
        got.planes != (uint32_t)pixel->planes || (!pixel->packed && row && got.stride[0] < (uint32_t)row) ||
        (pixel->packed && got.stride[0] < camera_packed_row((int)got.width, pixel->bits)))
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "%s: its frames are interlaced or laid out unlike their format",
                         camera->camera.identity.address);
    camera->pixel = pixel;
    camera->plane_stride[0] = (int)got.stride[0];
    camera->plane_stride[1] = (int)got.stride[1];
    camera->format = (struct lumi_frame_format){.layout = pixel->layout,
                                                .bayer = pixel->bayer,
                                                .width = (int)got.width,
                                                .height = (int)got.height,
                                                .bits = pixel->bits,
                                                .stride = pixel->packed ? row
                                                          : row         ? (int)got.stride[0]
                                                                        : 0};
    /* videodev2.h: what "default" stands for in a colour space. */
    camera->format.bt709 =
        got.encoding == V4L2_YCBCR_ENC_709 || (got.encoding == 0 && got.colorspace == V4L2_COLORSPACE_REC709);
    camera->format.full_range = got.quantization == V4L2_QUANTIZATION_FULL_RANGE ||
                                (got.quantization == 0 && got.colorspace == V4L2_COLORSPACE_JPEG);
    return LUMI_OK;
}

static int set_rate(struct v4l2_camera *camera, double rate, struct lumi_error *error)
{
    struct v4l2_streamparm parameters = {.type = camera->type};
    struct v4l2_fract *time = &parameters.parm.capture.timeperframe;
    double got;

    if (rate <= 0)
        return LUMI_OK;
    if (v4l2_ioctl(camera->fd, VIDIOC_G_PARM, &parameters) != 0 ||
        !(parameters.parm.capture.capability & V4L2_CAP_TIMEPERFRAME))
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "%s: its frame rate cannot be set",
                         camera->camera.identity.address);
    time->numerator = 1000;
    time->denominator = (uint32_t)lround(rate * 1000);
    if (v4l2_ioctl(camera->fd, VIDIOC_S_PARM, &parameters) != 0)
        return v4l2_fail(camera, error, "setting its frame rate");
    got = time->numerator ? (double)time->denominator / time->numerator : 0;
    if (fabs(got - rate) > 0.02 * rate)
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "%s: %g frames a second: it would give %g",
                         camera->camera.identity.address, rate, got);
    return LUMI_OK;
}

static int configure(struct lumi_camera *base, const struct lumi_camera_setting *setting, struct lumi_error *error)
{
    struct v4l2_camera *camera = (struct v4l2_camera *)base;
    const struct v4l2_pixel *pixel;
    uint32_t asked;

    LUMI_TRY(v4l2_stream_stop(camera, error));
    camera->pixel = NULL;
    if (setting->frame_rate < 0 || setting->frame_rate > 1e6 || setting->buffers < 0 ||
        setting->buffers > (setting->dmabuf ? LENT_MAX : 256))
        return lumi_fail(error, LUMI_ERR_ARG, "%s: %g frames a second into %d buffers", base->identity.address,
                         setting->frame_rate, setting->buffers);
    LUMI_TRY(v4l2_pixel_option(setting, &asked, error));
    pixel = choose_pixel(camera, setting, error);
    if (!pixel)
        return LUMI_ERR_UNSUPPORTED;
    LUMI_TRY(set_format(camera, pixel, setting, error));
    camera->pixel = NULL; /* until the rest is done */
    LUMI_TRY(set_rate(camera, setting->trigger == LUMI_TRIGGER_FREE ? setting->frame_rate : 0, error));
    LUMI_TRY(v4l2_control_apply(camera, setting, error));
    camera->pixel = pixel;
    camera->setting = *setting;
    return LUMI_OK;
}

/* ---- the rest of the interface ---- */

static int arm(struct lumi_camera *base, struct lumi_error *error)
{
    struct v4l2_camera *camera = (struct v4l2_camera *)base;

    if (camera->stream)
        return LUMI_OK;
    if (!camera->pixel)
        LUMI_TRY(configure(base, &camera->setting, error));
    return v4l2_stream_start(camera, error);
}

static int disarm(struct lumi_camera *base, struct lumi_error *error)
{
    return v4l2_stream_stop((struct v4l2_camera *)base, error);
}

static int trigger(struct lumi_camera *base, struct lumi_error *error)
{
    return v4l2_control_trigger((struct v4l2_camera *)base, error);
}

static int expose(struct lumi_camera *base, double exposure_s, double gain, struct lumi_error *error)
{
    if (exposure_s > 0)
        LUMI_TRY(v4l2_control_exposure((struct v4l2_camera *)base, exposure_s, error));
    return gain > 0 ? v4l2_control_gain((struct v4l2_camera *)base, gain, error) : LUMI_OK;
}

static int status(struct lumi_camera *base, struct lumi_camera_status *filled, struct lumi_error *error)
{
    struct v4l2_camera *camera = (struct v4l2_camera *)base;
    struct v4l2_capability capability;

    if (v4l2_ioctl(camera->fd, VIDIOC_QUERYCAP, &capability) != 0) {
        v4l2_fail(camera, error, "asking how it is");
        return LUMI_ERR_IO;
    }
    *filled = (struct lumi_camera_status){.armed = camera->stream != NULL,
                                          .format = camera->format,
                                          .temperature = NAN,
                                          .battery = NAN,
                                          .card_free_bytes = -1,
                                          .frames = camera->frames,
                                          .dropped = camera->dropped,
                                          .damaged = camera->damaged};
    v4l2_control_read(camera, &filled->exposure_s, &filled->gain);
    return LUMI_OK;
}

static int poll_fds(struct lumi_camera *base, struct pollfd *fds, int max)
{
    struct v4l2_camera *camera = (struct v4l2_camera *)base;

    if (!camera->stream || max < 1)
        return 0;
    fds[0] = (struct pollfd){.fd = camera->fd, .events = POLLIN};
    return 1;
}

static int frame(struct lumi_camera *base, struct lumi_camera_frame **taken, struct lumi_error *error)
{
    struct v4l2_camera *camera = (struct v4l2_camera *)base;

    *taken = NULL;
    return camera->stream ? v4l2_stream_frame(camera, taken, error) : LUMI_OK;
}

static void close_camera(struct lumi_camera *base)
{
    struct v4l2_camera *camera = (struct v4l2_camera *)base;

    v4l2_stream_stop(camera, NULL);
    close(camera->fd);
    lumi_free(camera);
}

static const struct lumi_camera_ops ops = {configure, arm,      disarm, trigger,     expose,
                                           status,    poll_fds, frame,  close_camera};

/* ---- opening ---- */

static int open_node(const struct lumi_camera_identity *identity, struct lumi_camera **opened, struct lumi_error *error)
{
    struct v4l2_camera *camera = lumi_calloc(1, sizeof *camera);
    struct v4l2_capability capability;
    uint32_t can;

    if (!camera)
        return lumi_fail(error, LUMI_ERR_NOMEM, "camera %s: no memory", identity->serial);
    camera->camera.ops = &ops;
    camera->camera.identity = *identity;
    lumi_camera_setting_init(&camera->setting);
    camera->fd = open(identity->address, O_RDWR | O_NONBLOCK | O_CLOEXEC);
    if (camera->fd < 0) {
        const int code = errno == EBUSY
                             ? lumi_fail(error, LUMI_ERR_BUSY, "%s: another program has it", identity->address)
                             : lumi_fail_errno(error, identity->address, "opening");

        lumi_free(camera);
        return code;
    }
    memset(&capability, 0, sizeof capability);
    if (v4l2_ioctl(camera->fd, VIDIOC_QUERYCAP, &capability) != 0)
        capability.capabilities = 0;
    can = capability.capabilities & V4L2_CAP_DEVICE_CAPS ? capability.device_caps : capability.capabilities;
    camera->type = can & V4L2_CAP_VIDEO_CAPTURE          ? V4L2_BUF_TYPE_VIDEO_CAPTURE
                   : can & V4L2_CAP_VIDEO_CAPTURE_MPLANE ? V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE
                                                         : 0;
    if (!camera->type || !(can & V4L2_CAP_STREAMING)) {
        close_camera(&camera->camera);
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "%s: is no camera that streams", identity->address);
    }
    v4l2_control_identify(camera);
    *opened = &camera->camera;
    return LUMI_OK;
}

int camera_v4l2_open(const char *what, struct lumi_camera **camera, struct lumi_error *error)
{
    struct lumi_camera_identity *listed = lumi_calloc(LISTED_MAX, sizeof *listed);
    int code;

    if (!listed)
        return lumi_fail(error, LUMI_ERR_NOMEM, "camera %s: no memory", what);
    code = camera_v4l2_list(listed, LISTED_MAX, error);
    if (code >= 0)
        code = camera_pick(listed, code < LISTED_MAX ? code : LISTED_MAX, what, error);
    if (code >= 0)
        code = open_node(&listed[code], camera, error);
    lumi_free(listed);
    return code;
}
