/* GigE Vision and USB3 Vision cameras, through Aravis: opening, arming, frames. */
#include "daemon/camera/camera_aravis_priv.h"
#include "proto/base/memory.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <sys/eventfd.h>
#include <unistd.h>

#define BUFFERS 8         /* of the pool, where the setting does not say */
#define LEAVE_ROUNDS 5000 /* of a millisecond: far more than it takes to be told that a camera is lost */
#define STREAM_BUFFERS 4  /* that packets are put into; a frame is copied out of them as it comes */

static struct aravis_camera *own(struct lumi_camera *camera)
{
    return (struct aravis_camera *)camera;
}

int aravis_fail(struct aravis_camera *camera, GError *problem, const char *doing, struct lumi_error *error)
{
    const bool silent = g_error_matches(problem, ARV_DEVICE_ERROR, ARV_DEVICE_ERROR_TIMEOUT) ||
                        g_error_matches(problem, ARV_DEVICE_ERROR, ARV_DEVICE_ERROR_NOT_CONNECTED) ||
                        g_error_matches(problem, ARV_DEVICE_ERROR, ARV_DEVICE_ERROR_TRANSFER_ERROR) ||
                        atomic_load(&camera->gone);
    const int code = silent ? LUMI_ERR_IO : LUMI_ERR_UNSUPPORTED;

    lumi_fail(error, code, "camera %s: %s: %s", camera->base.identity.serial, doing, problem->message);
    g_error_free(problem);
    return code;
}

bool aravis_has(struct aravis_camera *camera, const char *feature)
{
    return arv_camera_is_feature_available(camera->camera, feature, NULL);
}

/* ---- Aravis' threads ---- */

static void wake(struct aravis_camera *camera)
{
    const uint64_t one = 1;

    (void)!write(camera->event, &one, sizeof one);
}

static void on_stream(void *context, ArvStreamCallbackType type, ArvBuffer *buffer)
{
    (void)buffer;
    if (type == ARV_STREAM_CALLBACK_TYPE_BUFFER_DONE)
        wake(context);
}

static void on_lost(ArvDevice *device, struct aravis_camera *camera)
{
    (void)device;
    atomic_fetch_add(&camera->telling, 1);
    atomic_store(&camera->gone, true);
    wake(camera);
    atomic_fetch_sub(&camera->telling, 1);
}

/* ---- arming ---- */

static uint64_t stream_count(const struct aravis_camera *camera, const char *name)
{
    for (guint i = 0; i < arv_stream_get_n_infos(camera->stream); i++)
        if (strcmp(arv_stream_get_info_name(camera->stream, i), name) == 0)
            return arv_stream_get_info_uint64(camera->stream, i);
    return 0;
}

static void set_stream(struct aravis_camera *camera)
{
    if (!ARV_IS_GV_STREAM(camera->stream))
        return;
    g_object_set(camera->stream, "socket-buffer", ARV_GV_STREAM_SOCKET_BUFFER_AUTO, "socket-buffer-size", 0,
                 "packet-resend",
                 camera->packet_resend ? ARV_GV_STREAM_PACKET_RESEND_ALWAYS : ARV_GV_STREAM_PACKET_RESEND_NEVER, NULL);
    if (camera->packet_timeout_us > 0)
        g_object_set(camera->stream, "packet-timeout", (guint)camera->packet_timeout_us, NULL);
    if (camera->frame_retention_us > 0)
        g_object_set(camera->stream, "frame-retention", (guint)camera->frame_retention_us, NULL);
}

static void drop_stream(struct aravis_camera *camera)
{
    g_clear_object(&camera->stream);
    camera_pool_drop(camera->pool);
    camera->pool = NULL;
}

static int start_stream(struct aravis_camera *camera, struct lumi_error *error)
{
    const int buffers = camera->setting.buffers > 0 ? camera->setting.buffers : BUFFERS;
    GError *problem = NULL;
    guint payload = arv_camera_get_payload(camera->camera, &problem);

    if (problem)
        return aravis_fail(camera, problem, "the size of its frames", error);
    LUMI_TRY(camera_pool_create(buffers, &camera->pool, error));
    camera->stream = arv_camera_create_stream(camera->camera, on_stream, camera, &problem);
    if (!camera->stream) {
        drop_stream(camera);
        return problem ? aravis_fail(camera, problem, "making a stream", error)
                       : lumi_fail(error, LUMI_ERR_IO, "camera %s: no stream", camera->base.identity.serial);
    }
    set_stream(camera);
    for (int i = 0; i < STREAM_BUFFERS; i++)
        arv_stream_push_buffer(camera->stream, arv_buffer_new(payload, NULL));
    arv_camera_start_acquisition(camera->camera, &problem);
    if (problem) {
        drop_stream(camera);
        return aravis_fail(camera, problem, "starting", error);
    }
    return LUMI_OK;
}

static int arm(struct lumi_camera *base, struct lumi_error *error)
{
    struct aravis_camera *camera = own(base);

    if (!camera->configured)
        return lumi_fail(error, LUMI_ERR_ARG, "camera %s: armed before it was configured", base->identity.serial);
    if (camera->stream)
        return LUMI_OK;
    camera->frames = camera->dropped = camera->damaged = camera->resent = camera->missing = 0;
    camera->seen = false;
    return start_stream(camera, error);
}

static int disarm(struct lumi_camera *base, struct lumi_error *error)
{
    struct aravis_camera *camera = own(base);
    GError *problem = NULL;

    if (!camera->stream)
        return LUMI_OK;
    if (!atomic_load(&camera->gone))
        arv_camera_stop_acquisition(camera->camera, &problem);
    drop_stream(camera);
    return problem ? aravis_fail(camera, problem, "stopping", error) : LUMI_OK;
}

static int trigger(struct lumi_camera *base, struct lumi_error *error)
{
    struct aravis_camera *camera = own(base);
    GError *problem = NULL;

    if (!camera->stream || camera->setting.trigger != LUMI_TRIGGER_SOFTWARE)
        return lumi_fail(error, LUMI_ERR_ARG, "camera %s: not armed for a trigger by software", base->identity.serial);
    if (strncmp(camera->setting.trigger_input, "Action", 6) == 0)
        return aravis_action(camera, error);
    arv_camera_software_trigger(camera->camera, &problem);
    return problem ? aravis_fail(camera, problem, "triggering", error) : LUMI_OK;
}

/* ---- frames ---- */

/* Block ids without the extension have 16 bits and leave out 0 (GigE Vision 2.0, 24.2); USB3 Vision ones have 64. */
static uint32_t gap_before(struct aravis_camera *camera, uint64_t id)
{
    uint64_t step = id - camera->last_id;

    if (camera->seen && id < camera->last_id && camera->last_id <= 0xffff)
        step = id + 0xffff - camera->last_id;
    const uint32_t gap = camera->seen && step > 0 && step < 0x8000 ? (uint32_t)step - 1 : 0;
    camera->seen = true;
    camera->last_id = id;
    return gap;
}

static double chunk_real(struct aravis_camera *camera, ArvBuffer *buffer, const char *name)
{
    GError *problem = NULL;
    double value = arv_chunk_parser_get_float_value(camera->chunks, buffer, name, &problem);

    if (!problem)
        return value;
    g_clear_error(&problem);
    value = (double)arv_chunk_parser_get_integer_value(camera->chunks, buffer, name, &problem);
    if (!problem)
        return value;
    g_clear_error(&problem);
    return NAN;
}

static void read_chunks(struct aravis_camera *camera, ArvBuffer *buffer, struct lumi_camera_frame *frame)
{
    double value;

    if (!camera->chunks || !arv_buffer_has_chunks(buffer))
        return;
    if (camera->chunk_exposure && (value = chunk_real(camera, buffer, camera->chunk_exposure)) > 0)
        frame->exposure_s = value * 1e-6;
    if (camera->chunk_gain && !isnan(value = chunk_real(camera, buffer, camera->chunk_gain)))
        frame->gain = aravis_gain_from(camera, value);
    if (camera->chunk_trigger && !isnan(value = chunk_real(camera, buffer, camera->chunk_trigger)) && value >= 0)
        frame->trigger = (uint64_t)value;
}

/* A JPEG file ends with its last EOI marker; what follows it are chunks and what a larger frame has left. */
static size_t jpeg_size(const uint8_t *data, size_t size)
{
    for (size_t i = size; i >= 4; i--)
        if (data[i - 2] == 0xff && data[i - 1] == 0xd9)
            return data[0] == 0xff && data[1] == 0xd8 ? i : 0;
    return 0;
}

static void copy_pixels(struct aravis_camera *camera, struct lumi_camera_frame *frame, const uint8_t *data, size_t size)
{
    const size_t count = (size_t)frame->format.width * (size_t)frame->format.height;
    const size_t wanted = aravis_packed_bytes(&camera->pixels, count);

    frame->size = lumi_frame_bytes(&frame->format);
    if (size < wanted) { /* told as damaged: what did not come is 0 */
        g_autofree uint8_t *whole = g_malloc0(wanted);
        memcpy(whole, data, size);
        aravis_unpack(&camera->pixels, whole, count, camera_pool_bytes(frame));
        frame->damaged = true;
    } else {
        aravis_unpack(&camera->pixels, data, count, camera_pool_bytes(frame));
    }
}

/* NULL: no frame of the pool is free. */
static struct lumi_camera_frame *copy_frame(struct aravis_camera *camera, ArvBuffer *buffer)
{
    const bool whole = arv_buffer_get_status(buffer) == ARV_BUFFER_STATUS_SUCCESS;
    const bool jpeg = camera->pixels.layout == LUMI_LAYOUT_JPEG;
    size_t size, room = lumi_frame_bytes(&camera->format);
    const uint8_t *data = arv_buffer_get_data(buffer, &size);

    if (jpeg)
        room = size = jpeg_size(data, size);
    struct lumi_camera_frame *frame = camera_pool_take(camera->pool, room);
    if (!frame)
        return NULL;
    frame->format = camera->format;
    frame->damaged = !whole || (jpeg && size == 0);
    if (jpeg)
        memcpy(camera_pool_bytes(frame), data, size);
    else
        copy_pixels(camera, frame, data, size);
    if (whole)
        read_chunks(camera, buffer, frame);
    return frame;
}

static bool has_frame(ArvBuffer *buffer)
{
    switch (arv_buffer_get_status(buffer)) {
    case ARV_BUFFER_STATUS_SUCCESS:
    case ARV_BUFFER_STATUS_TIMEOUT:
    case ARV_BUFFER_STATUS_MISSING_PACKETS:
    case ARV_BUFFER_STATUS_WRONG_PACKET_ID:
    case ARV_BUFFER_STATUS_SIZE_MISMATCH:
        return true;
    default:
        return false;
    }
}

static struct lumi_camera_frame *take_frame(struct aravis_camera *camera, ArvBuffer *buffer)
{
    struct lumi_camera_frame *frame = has_frame(buffer) ? copy_frame(camera, buffer) : NULL;
    const uint64_t resent = stream_count(camera, "n_resent_packets"),
                   missing = stream_count(camera, "n_missing_packets");
    const uint64_t id = arv_buffer_get_frame_id(buffer), stamp = arv_buffer_get_timestamp(buffer);
    const uint32_t gap = has_frame(buffer) ? gap_before(camera, id) : 0;

    camera->dropped += gap;
    if (!frame) {
        if (has_frame(buffer)) {
            camera->dropped++;
            camera->seen = camera->seen && camera->last_id > 0;
            camera->last_id--; /* so that the next frame tells of it */
        }
        return NULL;
    }
    frame->gap = gap;
    frame->sequence = id;
    frame->device_ns = camera->base.identity.device_clock && stamp > 0 ? (int64_t)stamp : LUMI_CAMERA_NO_TIME;
    frame->host_ns = camera_now_ns();
    frame->packets_resent = (uint32_t)(resent - camera->resent);
    frame->packets_missing = (uint32_t)(missing - camera->missing);
    camera->resent = resent;
    camera->missing = missing;
    camera->frames++;
    camera->damaged += frame->damaged;
    return frame;
}

static int next_frame(struct lumi_camera *base, struct lumi_camera_frame **frame, struct lumi_error *error)
{
    struct aravis_camera *camera = own(base);
    uint64_t woken;

    *frame = NULL;
    (void)!read(camera->event, &woken, sizeof woken);
    while (camera->stream && !*frame) {
        ArvBuffer *buffer = arv_stream_try_pop_buffer(camera->stream);

        if (!buffer)
            break;
        *frame = take_frame(camera, buffer);
        arv_stream_push_buffer(camera->stream, buffer);
    }
    if (*frame) {
        wake(camera); /* there may be more */
        return LUMI_OK;
    }
    if (atomic_load(&camera->gone))
        return lumi_fail(error, LUMI_ERR_IO, "camera %s: it does not answer any more", base->identity.serial);
    return LUMI_OK;
}

static int poll_fds(struct lumi_camera *base, struct pollfd *fds, int max)
{
    if (max < 1)
        return 0;
    fds[0] = (struct pollfd){.fd = own(base)->event, .events = POLLIN};
    return 1;
}

static int status(struct lumi_camera *base, struct lumi_camera_status *status, struct lumi_error *error)
{
    struct aravis_camera *camera = own(base);

    memset(status, 0, sizeof *status);
    status->temperature = status->battery = NAN;
    status->card_free_bytes = -1;
    if (atomic_load(&camera->gone))
        return lumi_fail(error, LUMI_ERR_IO, "camera %s: it does not answer any more", base->identity.serial);
    status->armed = camera->stream != NULL;
    status->format = camera->format;
    status->exposure_s = camera->set_exposure;
    status->gain = camera->set_gain;
    if (aravis_has(camera, "DeviceTemperature"))
        status->temperature = arv_camera_get_float(camera->camera, "DeviceTemperature", NULL);
    status->frames = camera->frames;
    status->dropped = camera->dropped;
    status->damaged = camera->damaged;
    status->packets_resent = camera->resent;
    status->packets_missing = camera->missing;
    if (camera->stream) {
        status->packets_resent = stream_count(camera, "n_resent_packets");
        status->packets_missing = stream_count(camera, "n_missing_packets");
        status->dropped += stream_count(camera, "n_underruns");
    }
    return LUMI_OK;
}

/* ---- opening ---- */

/* A thread of the device's own tells that the camera is lost, and holds the device meanwhile. If that were the last
 * hold on it, the thread would end the device and wait in it for itself, for which GLib ends the program. So it is
 * ended here, when nobody else holds it. */
static void end_device(struct aravis_camera *camera)
{
    ArvDevice *device = g_object_ref(arv_camera_get_device(camera->camera));
    int rounds = 0;

    g_signal_handlers_disconnect_by_data(device, camera);
    g_clear_object(&camera->chunks);
    g_clear_object(&camera->camera);
    while ((g_atomic_int_get((gint *)&G_OBJECT(device)->ref_count) > 1 || atomic_load(&camera->telling)) &&
           rounds++ < LEAVE_ROUNDS)
        g_usleep(1000);
    g_object_unref(device); /* and control of it */
}

static void close_camera(struct lumi_camera *base)
{
    struct aravis_camera *camera = own(base);

    disarm(base, NULL);
    if (camera->camera)
        end_device(camera);
    if (camera->event >= 0)
        close(camera->event);
    lumi_free(camera);
}

static const struct lumi_camera_ops ops = {
    .configure = aravis_configure,
    .arm = arm,
    .disarm = disarm,
    .trigger = trigger,
    .expose = aravis_expose,
    .status = status,
    .poll_fds = poll_fds,
    .frame = next_frame,
    .close = close_camera,
};

static int open_found(const struct lumi_camera_identity *found, struct aravis_camera *camera, struct lumi_error *error)
{
    const char *name = found->serial[0] ? found->serial : found->address;
    g_autoptr(GError) problem = NULL;
    ArvDevice *device;

    camera->event = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC); /* before there are threads that write to it */
    if (camera->event < 0)
        return lumi_fail_errno(error, name, "an event descriptor");
    device = aravis_device_open(found, &problem);
    if (!device)
        return lumi_fail(error, LUMI_ERR_NOTFOUND, "camera %s: %s", name, problem ? problem->message : "not there");
    if (ARV_IS_GV_DEVICE(device) && !arv_gv_device_is_controller(ARV_GV_DEVICE(device))) {
        g_object_unref(device);
        return lumi_fail(error, LUMI_ERR_BUSY, "camera %s at %s: another program has it", name, found->address);
    }
    camera->camera = arv_camera_new_with_device(device, &problem);
    g_object_unref(device);
    if (!camera->camera)
        return lumi_fail(error, LUMI_ERR_IO, "camera %s: %s", name, problem ? problem->message : "cannot be opened");
    g_signal_connect(device, "control-lost", G_CALLBACK(on_lost), camera);
    aravis_identify(camera);
    return LUMI_OK;
}

int camera_aravis_open(const char *what, struct lumi_camera **camera, struct lumi_error *error)
{
    struct lumi_camera_identity found;
    struct aravis_camera *made;
    int code;

    *camera = NULL;
    LUMI_TRY(aravis_find(what, &found, error));
    made = lumi_calloc(1, sizeof *made);
    if (!made)
        return lumi_fail(error, LUMI_ERR_NOMEM, "camera %s: no memory", what);
    made->base.ops = &ops;
    made->base.identity = found;
    made->event = -1;
    made->packet_resend = true;
    code = open_found(&found, made, error);
    if (code != LUMI_OK) {
        close_camera(&made->base);
        return code;
    }
    *camera = &made->base;
    return LUMI_OK;
}
