/* Cameras behind libcamera: sensors on a CSI bus with their image processor, and USB cameras. Its requests come back in
 * a thread of its own; they wait in a ring, with a descriptor that says so, until the camera's thread takes them,
 * copies the picture and sends the request off again, with the exposure that is wanted by then. */
#include "daemon/camera/camera_libcamera_priv.h"
#include "daemon/camera/camera_unpack.h"
#include "proto/base/memory.h"

#include <errno.h>
#include <linux/dma-buf.h>
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <string.h>
#include <sys/eventfd.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#define LISTED_MAX 64
#define BUFFERS_MAX 32
#define BUFFERS 4
#define POOL 8

struct mapped { /* one plane */
    uint8_t *base;
    size_t base_length;
    int fd;
    const uint8_t *bytes;
    size_t length;
};
struct libcamera_camera {
    struct lumi_camera camera;
    struct shim_camera *shim;
    struct lumi_camera_setting setting;
    struct shim_controls controls;
    const struct libcamera_pixel *pixel; /* NULL: not configured */
    struct shim_format stream;
    struct lumi_frame_format format;
    struct mapped buffers[BUFFERS_MAX][SHIM_PLANES];
    int buffer_count;
    struct camera_pool *pool;
    bool armed, sequence_known;
    uint32_t next_sequence, not_taken;
    uint64_t frames, dropped, damaged;
    double exposure_s, gain, temperature; /* of the last frame */
    int event;
    pthread_mutex_t lock; /* of these: */
    struct shim_result done[BUFFERS_MAX];
    int done_first, done_count;
    bool gone;
};

static int fail(const struct libcamera_camera *camera, struct lumi_error *error, int minus_errno, const char *doing)
{
    const int code = minus_errno == -ENODEV || minus_errno == -ENXIO ? LUMI_ERR_IO
                     : minus_errno == -EBUSY                         ? LUMI_ERR_BUSY
                     : minus_errno == -ENOMEM                        ? LUMI_ERR_NOMEM
                                                                     : LUMI_ERR_UNSUPPORTED;

    return lumi_fail(error, code, "%s (libcamera): %s: %s", camera->camera.identity.serial, doing,
                     strerror(-minus_errno));
}

/* ---- in libcamera's thread ---- */

static void wake(struct libcamera_camera *camera)
{
    const uint64_t one = 1;

    while (write(camera->event, &one, sizeof one) < 0 && errno == EINTR)
        ;
}

static void on_done(void *context, const struct shim_result *result)
{
    struct libcamera_camera *camera = context;

    pthread_mutex_lock(&camera->lock);
    if (camera->done_count < BUFFERS_MAX)
        camera->done[(camera->done_first + camera->done_count++) % BUFFERS_MAX] = *result;
    pthread_mutex_unlock(&camera->lock);
    wake(camera);
}

static void on_gone(void *context)
{
    struct libcamera_camera *camera = context;

    pthread_mutex_lock(&camera->lock);
    camera->gone = true;
    pthread_mutex_unlock(&camera->lock);
    wake(camera);
}

static bool is_gone(struct libcamera_camera *camera)
{
    bool gone;

    pthread_mutex_lock(&camera->lock);
    gone = camera->gone;
    pthread_mutex_unlock(&camera->lock);
    return gone;
}

static bool next_done(struct libcamera_camera *camera, struct shim_result *result)
{
    bool any;

    pthread_mutex_lock(&camera->lock);
    any = camera->done_count > 0;
    if (any) {
        *result = camera->done[camera->done_first];
        camera->done_first = (camera->done_first + 1) % BUFFERS_MAX;
        camera->done_count--;
    }
    pthread_mutex_unlock(&camera->lock);
    return any;
}

/* ---- setting up ---- */

static int stop(struct libcamera_camera *camera, struct lumi_error *error)
{
    struct shim_result left;
    int code;

    if (!camera->armed)
        return LUMI_OK;
    code = shim_stop(camera->shim);
    while (next_done(camera, &left))
        ;
    for (int i = 0; i < camera->buffer_count; i++)
        for (int p = 0; p < SHIM_PLANES; p++)
            if (camera->buffers[i][p].base)
                munmap(camera->buffers[i][p].base, camera->buffers[i][p].base_length);
    memset(camera->buffers, 0, sizeof camera->buffers);
    camera->buffer_count = 0;
    camera_pool_drop(camera->pool);
    camera->pool = NULL;
    camera->armed = false;
    return code == 0 ? LUMI_OK : fail(camera, error, code, "stopping");
}

static int check(const struct libcamera_camera *camera, const struct lumi_camera_setting *setting,
                 struct lumi_error *error)
{
    const struct lumi_camera_identity *identity = &camera->camera.identity;
    const char *text = setting->options;
    struct camera_option option;
    const int more = camera_option_next(&text, &option, error);
    const bool rate = shim_can(camera->shim) & SHIM_CAN_FRAME_TIME;

    LUMI_TRY(more < 0 ? more : LUMI_OK);
    if (more > 0)
        return lumi_fail(error, LUMI_ERR_ARG, "%s (libcamera): option %s: it has no such option", identity->serial,
                         option.name);
    if (setting->buffers < 0 || setting->buffers > 256 || setting->frame_rate < 0)
        return lumi_fail(error, LUMI_ERR_ARG, "%s (libcamera): %g frames a second into %d buffers", identity->serial,
                         setting->frame_rate, setting->buffers);
    if (setting->dmabuf || setting->trigger != LUMI_TRIGGER_FREE || (setting->frame_rate > 0 && !rate) ||
        (setting->exposure_s > 0 && !identity->exposure_control) ||
        (setting->gain > 0 && setting->gain != 1 && !identity->gain_control) ||
        (setting->white_balance > 0 && !identity->white_balance_control))
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "%s (libcamera): it has no %s", identity->serial,
                         setting->dmabuf                                          ? "frames that are lent as dmabufs"
                         : setting->trigger != LUMI_TRIGGER_FREE                  ? "trigger"
                         : setting->frame_rate > 0 && !rate                       ? "frame rate that can be set"
                         : setting->exposure_s > 0 && !identity->exposure_control ? "exposure time that can be set"
                         : setting->white_balance > 0 && !identity->white_balance_control
                             ? "white balance that can be set"
                             : "gain that can be set");
    return LUMI_OK;
}

static int bytes_of_row(const struct libcamera_camera *camera)
{
    const int width = camera->stream.width;

    if (camera->pixel->layout == LUMI_LAYOUT_JPEG)
        return 0;
    return camera->pixel->modifier == LIBCAMERA_PACKED ? 2 * width : camera->stream.stride;
}

static int set_stream(struct libcamera_camera *camera, const struct lumi_camera_setting *setting,
                      struct lumi_error *error)
{
    struct libcamera_formats formats = {.count = 0};
    struct shim_format wanted, got;
    const struct libcamera_pixel *pixel;
    int code;

    shim_formats(camera->shim, true, libcamera_add_format, &formats);
    shim_formats(camera->shim, false, libcamera_add_format, &formats);
    pixel = libcamera_choose(&formats, setting, &wanted);
    if (!pixel)
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "%s (libcamera): none of its %d formats is as it was asked for",
                         camera->camera.identity.serial, formats.count);
    if (setting->width)
        wanted.width = setting->width;
    if (setting->height)
        wanted.height = setting->height;
    wanted.buffers = BUFFERS;
    got = wanted;
    code = shim_configure(camera->shim, &got);
    if (code != 0)
        return fail(camera, error, code, "setting its format");
    if (got.fourcc != wanted.fourcc || got.modifier != wanted.modifier || got.width != wanted.width ||
        got.height != wanted.height)
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "%s (libcamera): %d x %d of %.4s: it would give %d x %d of %.4s",
                         camera->camera.identity.serial, wanted.width, wanted.height, (const char *)&wanted.fourcc,
                         got.width, got.height, (const char *)&got.fourcc);
    camera->stream = got;
    camera->pixel = pixel;
    camera->format = (struct lumi_frame_format){.layout = pixel->layout,
                                                .bayer = pixel->bayer,
                                                .width = got.width,
                                                .height = got.height,
                                                .bits = pixel->bits,
                                                .stride = bytes_of_row(camera),
                                                .bt709 = got.bt709,
                                                .full_range = got.full_range};
    return LUMI_OK;
}

static int configure(struct lumi_camera *base, const struct lumi_camera_setting *setting, struct lumi_error *error)
{
    struct libcamera_camera *camera = (struct libcamera_camera *)base;

    LUMI_TRY(stop(camera, error));
    camera->pixel = NULL;
    LUMI_TRY(check(camera, setting, error));
    LUMI_TRY(set_stream(camera, setting, error));
    camera->setting = *setting;
    camera->controls = (struct shim_controls){.exposure_s = setting->exposure_s,
                                              .gain = setting->gain,
                                              .white_balance = setting->white_balance,
                                              .frame_s = setting->frame_rate > 0 ? 1 / setting->frame_rate : 0};
    return LUMI_OK;
}

/* ---- arming ---- */

/* Planes may share a descriptor; each is mapped from its beginning, as offsets need not be whole pages. */
static int map_buffer(struct libcamera_camera *camera, int buffer, struct lumi_error *error)
{
    struct shim_plane planes[SHIM_PLANES];
    const int count = shim_buffer(camera->shim, buffer, planes);

    for (int p = 0; p < count; p++) {
        struct mapped *mapped = &camera->buffers[buffer][p];
        const size_t length = (size_t)planes[p].offset + planes[p].length;
        void *base = mmap(NULL, length, PROT_READ, MAP_SHARED, planes[p].fd, 0);

        if (base == MAP_FAILED)
            return fail(camera, error, -errno, "mapping a buffer");
        *mapped =
            (struct mapped){base, length, planes[p].fd, (const uint8_t *)base + planes[p].offset, planes[p].length};
    }
    return LUMI_OK;
}

static int arm_stream(struct libcamera_camera *camera, struct lumi_error *error)
{
    int code = shim_allocate(camera->shim);

    if (code < 0 || code > BUFFERS_MAX)
        return fail(camera, error, code < 0 ? code : -ENOMEM, "allocating buffers");
    camera->buffer_count = code;
    LUMI_TRY(camera_pool_create(camera->setting.buffers > 0 ? camera->setting.buffers : POOL, &camera->pool, error));
    for (int i = 0; i < camera->buffer_count; i++)
        LUMI_TRY(map_buffer(camera, i, error));
    code = shim_start(camera->shim, &camera->controls);
    for (int i = 0; code == 0 && i < camera->buffer_count; i++)
        code = shim_queue(camera->shim, i, &camera->controls);
    return code == 0 ? LUMI_OK : fail(camera, error, code, "starting");
}

static int arm(struct lumi_camera *base, struct lumi_error *error)
{
    struct libcamera_camera *camera = (struct libcamera_camera *)base;
    int code;

    if (camera->armed)
        return LUMI_OK;
    if (!camera->pixel)
        LUMI_TRY(configure(base, &camera->setting, error));
    camera->armed = true;
    camera->sequence_known = false;
    camera->not_taken = 0;
    camera->frames = camera->dropped = camera->damaged = 0;
    code = arm_stream(camera, error);
    if (code != LUMI_OK)
        stop(camera, NULL);
    return code;
}

static int disarm(struct lumi_camera *base, struct lumi_error *error)
{
    return stop((struct libcamera_camera *)base, error);
}

static int trigger(struct lumi_camera *base, struct lumi_error *error)
{
    return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "%s (libcamera): it has no trigger", base->identity.serial);
}

static int expose(struct lumi_camera *base, double exposure_s, double gain, struct lumi_error *error)
{
    struct libcamera_camera *camera = (struct libcamera_camera *)base;
    struct lumi_camera_setting setting = camera->setting;

    if (exposure_s > 0)
        setting.exposure_s = exposure_s;
    if (gain > 0)
        setting.gain = gain;
    LUMI_TRY(check(camera, &setting, error));
    camera->controls.exposure_s = setting.exposure_s;
    camera->controls.gain = setting.gain;
    camera->setting = setting;
    return LUMI_OK;
}

/* ---- frames ---- */

static void sync_buffer(const struct mapped *planes, uint64_t phase)
{
    struct dma_buf_sync sync = {.flags = phase | DMA_BUF_SYNC_READ};

    for (int p = 0; p < SHIM_PLANES && planes[p].base; p++)
        if (p == 0 || planes[p].fd != planes[0].fd)
            ioctl(planes[p].fd, DMA_BUF_IOCTL_SYNC, &sync);
}

static bool copy_plane(const struct libcamera_camera *camera, const struct mapped *plane, uint32_t used, int count,
                       uint8_t *out)
{
    const bool packed = camera->pixel->modifier == LIBCAMERA_PACKED;
    const struct camera_rows rows = {.bytes = plane->bytes,
                                     .size = used < plane->length ? used : plane->length,
                                     .stride = camera->stream.stride,
                                     .count = count,
                                     .packed_width = camera->format.width,
                                     .packed_bits = packed ? camera->pixel->bits : 0};

    return camera_copy_rows(&rows, out, camera->format.stride);
}

static struct lumi_camera_frame *copy(struct libcamera_camera *camera, const struct shim_result *result)
{
    const struct lumi_frame_format *format = &camera->format;
    const struct mapped *planes = camera->buffers[result->buffer];
    const bool two = format->layout == LUMI_LAYOUT_NV12 && planes[1].base;
    const size_t whole = lumi_frame_bytes(format);
    const size_t used = result->used[0] < planes[0].length ? result->used[0] : planes[0].length;
    struct lumi_camera_frame *frame = camera_pool_take(camera->pool, whole ? whole : used);
    uint8_t *out;
    bool all = true;

    if (!frame)
        return NULL;
    out = camera_pool_bytes(frame);
    sync_buffer(planes, DMA_BUF_SYNC_START);
    if (!whole) {
        if (used)
            memcpy(out, planes[0].bytes, used);
        all = used >= 4 && out[0] == 0xff && out[1] == 0xd8;
    } else {
        all = copy_plane(camera, &planes[0], result->used[0],
                         two ? format->height : (int)(whole / (size_t)format->stride), out);
        if (two)
            all &= copy_plane(camera, &planes[1], result->used[1], (format->height + 1) / 2,
                              out + (size_t)format->stride * (size_t)format->height);
    }
    sync_buffer(planes, DMA_BUF_SYNC_END);
    frame->damaged = !all || result->status == SHIM_DAMAGED;
    return frame;
}

static void describe(struct libcamera_camera *camera, const struct shim_result *result, struct lumi_camera_frame *frame)
{
    const uint32_t ahead = camera->sequence_known ? result->sequence - camera->next_sequence : 0;
    const uint32_t gap = camera->not_taken + (ahead < 0x80000000u ? ahead : 0);

    camera->dropped += gap - camera->not_taken;
    camera->sequence_known = true;
    camera->next_sequence = result->sequence + 1;
    camera->not_taken = frame ? 0 : gap + 1;
    camera->exposure_s = result->exposure_s;
    camera->gain = result->gain;
    camera->temperature = result->has_temperature ? result->temperature : NAN;
    if (!frame) {
        camera->dropped++;
        return;
    }
    frame->format = camera->format;
    frame->host_ns = camera_now_ns();
    frame->device_ns = result->sensor_ns > 0   ? result->sensor_ns
                       : result->buffer_ns > 0 ? result->buffer_ns
                                               : LUMI_CAMERA_NO_TIME;
    frame->at_end = result->sensor_ns <= 0;
    frame->sequence = result->sequence;
    frame->gap = gap;
    frame->exposure_s = result->exposure_s;
    frame->gain = result->gain;
    if (frame->format.layout == LUMI_LAYOUT_BAYER || frame->format.layout == LUMI_LAYOUT_GREY) {
        frame->black = ldexp(result->black, frame->format.bits - 16);
        frame->white[0] = result->white[0];
        frame->white[1] = result->white[1];
    }
    frame->temperature = camera->temperature;
    camera->frames++;
    camera->damaged += frame->damaged;
}

static int frame(struct lumi_camera *base, struct lumi_camera_frame **taken, struct lumi_error *error)
{
    struct libcamera_camera *camera = (struct libcamera_camera *)base;
    struct shim_result result;
    uint64_t ignored;
    int code;

    *taken = NULL;
    while (read(camera->event, &ignored, sizeof ignored) < 0 && errno == EINTR)
        ;
    if (is_gone(camera))
        return lumi_fail(error, LUMI_ERR_IO, "%s (libcamera): it was unplugged", base->identity.serial);
    if (!camera->armed || !next_done(camera, &result))
        return LUMI_OK;
    if (result.status == SHIM_CANCELLED || result.buffer < 0 || result.buffer >= camera->buffer_count)
        return lumi_fail(error, LUMI_ERR_IO, "%s (libcamera): its stream has ended", base->identity.serial);
    *taken = copy(camera, &result);
    describe(camera, &result, *taken);
    code = shim_queue(camera->shim, result.buffer, &camera->controls);
    if (code != 0) {
        lumi_camera_frame_release(*taken);
        *taken = NULL;
        fail(camera, error, code, "asking for the next frame");
        return LUMI_ERR_IO;
    }
    wake(camera); /* there may be more */
    return LUMI_OK;
}

static int poll_fds(struct lumi_camera *base, struct pollfd *fds, int max)
{
    if (max < 1)
        return 0;
    fds[0] = (struct pollfd){.fd = ((struct libcamera_camera *)base)->event, .events = POLLIN};
    return 1;
}

static int status(struct lumi_camera *base, struct lumi_camera_status *filled, struct lumi_error *error)
{
    struct libcamera_camera *camera = (struct libcamera_camera *)base;

    if (is_gone(camera))
        return lumi_fail(error, LUMI_ERR_IO, "%s (libcamera): it was unplugged", base->identity.serial);
    *filled = (struct lumi_camera_status){.armed = camera->armed,
                                          .format = camera->format,
                                          .exposure_s = camera->exposure_s,
                                          .gain = camera->gain,
                                          .temperature = camera->temperature,
                                          .battery = NAN,
                                          .card_free_bytes = -1,
                                          .frames = camera->frames,
                                          .dropped = camera->dropped,
                                          .damaged = camera->damaged};
    return LUMI_OK;
}

static void close_camera(struct lumi_camera *base)
{
    struct libcamera_camera *camera = (struct libcamera_camera *)base;

    stop(camera, NULL);
    if (camera->shim)
        shim_close(camera->shim);
    pthread_mutex_destroy(&camera->lock);
    close(camera->event);
    lumi_free(camera);
}

static const struct lumi_camera_ops ops = {configure, arm,      disarm, trigger,     expose,
                                           status,    poll_fds, frame,  close_camera};

/* ---- opening ---- */

static int open_listed(const struct lumi_camera_identity *identity, struct lumi_camera **opened,
                       struct lumi_error *error)
{
    struct libcamera_camera *camera = lumi_calloc(1, sizeof *camera);
    unsigned can;
    int code;

    if (!camera)
        return lumi_fail(error, LUMI_ERR_NOMEM, "camera %s: no memory", identity->serial);
    camera->camera.ops = &ops;
    camera->camera.identity = *identity;
    camera->temperature = NAN;
    lumi_camera_setting_init(&camera->setting);
    pthread_mutex_init(&camera->lock, NULL);
    camera->event = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    code = camera->event < 0 ? -errno : shim_open(identity->address, on_done, on_gone, camera, &camera->shim);
    if (code != 0) {
        code = code == -ENODEV ? lumi_fail(error, LUMI_ERR_NOTFOUND, "camera %s: not there", identity->serial)
                               : fail(camera, error, code, "opening");
        close_camera(&camera->camera);
        return code;
    }
    can = shim_can(camera->shim);
    camera->camera.identity.exposure_control = can & SHIM_CAN_EXPOSE;
    camera->camera.identity.gain_control = can & SHIM_CAN_GAIN;
    camera->camera.identity.white_balance_control = can & SHIM_CAN_WHITE_BALANCE;
    *opened = &camera->camera;
    return LUMI_OK;
}

int camera_libcamera_open(const char *what, struct lumi_camera **camera, struct lumi_error *error)
{
    struct lumi_camera_identity *listed = lumi_calloc(LISTED_MAX, sizeof *listed);
    int code;

    if (!listed)
        return lumi_fail(error, LUMI_ERR_NOMEM, "camera %s: no memory", what);
    code = camera_libcamera_list(listed, LISTED_MAX, error);
    if (code >= 0)
        code = camera_pick(listed, code < LISTED_MAX ? code : LISTED_MAX, what, error);
    if (code >= 0)
        code = open_listed(&listed[code], camera, error);
    lumi_free(listed);
    return code;
}
