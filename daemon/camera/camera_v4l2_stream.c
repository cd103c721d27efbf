/* The buffers of a V4L2 device: mapped and copied into the pool, or exported as dmabufs and lent to whoever has the
 * frame, which gives them back to the driver when it is done. */
#include "daemon/camera/camera_unpack.h"
#include "daemon/camera/camera_v4l2_priv.h"
#include "proto/base/memory.h"

#include <errno.h>
#include <fcntl.h>
#include <linux/dma-buf.h>
#include <pthread.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#define BUFFERS 8
#define BUFFERS_MAX VIDEO_MAX_FRAME
#define PLANES 2

struct v4l2_lent { /* one of the driver's buffers */
    struct lumi_camera_frame frame;
    struct v4l2_stream *stream;
    uint32_t index;
    uint8_t *bytes[PLANES];
    size_t length[PLANES];
    int dmabuf; /* −1: not exported */
    bool out;
};
struct v4l2_stream {
    pthread_mutex_t lock; /* of holders, on, and each buffer's `out` */
    int holders;          /* the camera, and every frame that is lent */
    bool on;              /* frames that come back are queued again */
    int fd;
    uint32_t type;
    uint32_t planes; /* 0: the single-planar interface */
    bool lends;
    uint32_t next_sequence;
    bool sequence_known;
    uint32_t not_taken; /* frames lost here since the last that was handed out, and gaps before them */
    int count;
    struct v4l2_lent buffers[BUFFERS_MAX];
};

static void buffer_init(const struct v4l2_stream *stream, struct v4l2_buffer *buffer, struct v4l2_plane *planes,
                        uint32_t index)
{
    memset(buffer, 0, sizeof *buffer);
    memset(planes, 0, VIDEO_MAX_PLANES * sizeof *planes);
    buffer->type = stream->type;
    buffer->memory = V4L2_MEMORY_MMAP;
    buffer->index = index;
    if (stream->planes) {
        buffer->m.planes = planes;
        buffer->length = VIDEO_MAX_PLANES;
    }
}

static int queue_buffer(const struct v4l2_stream *stream, uint32_t index)
{
    struct v4l2_plane planes[VIDEO_MAX_PLANES];
    struct v4l2_buffer buffer;

    buffer_init(stream, &buffer, planes, index);
    if (stream->planes)
        buffer.length = stream->planes;
    return v4l2_ioctl(stream->fd, VIDIOC_QBUF, &buffer);
}

/* ---- mapping ---- */

static void unmap(struct v4l2_lent *buffer)
{
    for (int p = 0; p < PLANES; p++)
        if (buffer->bytes[p])
            munmap(buffer->bytes[p], buffer->length[p]);
    memset(buffer->bytes, 0, sizeof buffer->bytes);
    if (buffer->dmabuf >= 0)
        close(buffer->dmabuf);
    buffer->dmabuf = -1;
}

static int map_plane(struct v4l2_camera *camera, struct v4l2_lent *buffer, int plane, size_t length, off_t offset,
                     struct lumi_error *error)
{
    int fd = camera->fd;
    void *bytes;

    if (buffer->stream->lends) {
        struct v4l2_exportbuffer exported = {
            .type = buffer->stream->type, .index = buffer->index, .plane = (uint32_t)plane, .flags = O_CLOEXEC};

        if (v4l2_ioctl(camera->fd, VIDIOC_EXPBUF, &exported) != 0) {
            if (errno == ENODEV)
                return v4l2_fail(camera, error, "exporting a buffer as dmabuf");
            return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "%s: its driver exports no dmabuf: %s",
                             camera->camera.identity.address, strerror(errno));
        }
        fd = buffer->dmabuf = exported.fd;
        offset = 0;
    }
    bytes = mmap(NULL, length, PROT_READ, MAP_SHARED, fd, offset);
    if (bytes == MAP_FAILED)
        return v4l2_fail(camera, error, "mapping a buffer");
    buffer->bytes[plane] = bytes;
    buffer->length[plane] = length;
    return LUMI_OK;
}

static int map_buffer(struct v4l2_camera *camera, struct v4l2_lent *lent, struct lumi_error *error)
{
    struct v4l2_plane planes[VIDEO_MAX_PLANES];
    struct v4l2_buffer buffer;
    struct v4l2_stream *stream = lent->stream;

    buffer_init(stream, &buffer, planes, lent->index);
    if (v4l2_ioctl(camera->fd, VIDIOC_QUERYBUF, &buffer) != 0)
        return v4l2_fail(camera, error, "asking for a buffer");
    if (!stream->planes)
        return map_plane(camera, lent, 0, buffer.length, (off_t)buffer.m.offset, error);
    for (uint32_t p = 0; p < stream->planes; p++)
        LUMI_TRY(map_plane(camera, lent, (int)p, planes[p].length, (off_t)planes[p].m.mem_offset, error));
    return LUMI_OK;
}

/* With the lock, which it lets go. */
static void let_go(struct v4l2_stream *stream)
{
    const bool last = --stream->holders == 0;

    pthread_mutex_unlock(&stream->lock);
    if (!last)
        return;
    for (int i = 0; i < stream->count; i++)
        unmap(&stream->buffers[i]);
    pthread_mutex_destroy(&stream->lock);
    lumi_free(stream);
}

/* ---- on and off ---- */

static int request_buffers(struct v4l2_camera *camera, struct v4l2_stream *stream, uint32_t count,
                           struct lumi_error *error)
{
    struct v4l2_requestbuffers request = {.count = count, .type = stream->type, .memory = V4L2_MEMORY_MMAP};

    if (v4l2_ioctl(camera->fd, VIDIOC_REQBUFS, &request) != 0)
        return v4l2_fail(camera, error, "asking for buffers");
    stream->count = request.count > BUFFERS_MAX ? BUFFERS_MAX : (int)request.count;
    for (int i = 0; i < stream->count; i++) {
        stream->buffers[i].stream = stream;
        stream->buffers[i].index = (uint32_t)i;
        stream->buffers[i].dmabuf = -1;
    }
    return LUMI_OK;
}

static int fill_and_start(struct v4l2_camera *camera, struct v4l2_stream *stream, struct lumi_error *error)
{
    const int asked = camera->setting.buffers > 0 ? camera->setting.buffers : BUFFERS;

    /* Frames that are lent are not with the driver, which needs two to go on. */
    LUMI_TRY(request_buffers(camera, stream, stream->lends ? (uint32_t)asked + 2 : 4, error));
    if (stream->count < 2)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: %d buffers", camera->camera.identity.address, stream->count);
    for (int i = 0; i < stream->count; i++) {
        LUMI_TRY(map_buffer(camera, &stream->buffers[i], error));
        if (queue_buffer(stream, (uint32_t)i) != 0)
            return v4l2_fail(camera, error, "queueing a buffer");
    }
    if (!stream->lends)
        LUMI_TRY(camera_pool_create(asked, &camera->pool, error));
    if (v4l2_ioctl(camera->fd, VIDIOC_STREAMON, &stream->type) != 0)
        return v4l2_fail(camera, error, "starting");
    return LUMI_OK;
}

int v4l2_stream_start(struct v4l2_camera *camera, struct lumi_error *error)
{
    struct v4l2_stream *stream = lumi_calloc(1, sizeof *stream);
    int code;

    if (!stream)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: no memory", camera->camera.identity.address);
    pthread_mutex_init(&stream->lock, NULL);
    stream->holders = 1;
    stream->on = true;
    stream->fd = camera->fd;
    stream->type = camera->type;
    stream->planes = camera->type == V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE ? (uint32_t)camera->pixel->planes : 0;
    stream->lends = camera->setting.dmabuf;
    camera->stream = stream;
    camera->frames = camera->dropped = camera->damaged = 0;
    code = fill_and_start(camera, stream, error);
    if (code != LUMI_OK)
        v4l2_stream_stop(camera, NULL);
    return code;
}

int v4l2_stream_stop(struct v4l2_camera *camera, struct lumi_error *error)
{
    struct v4l2_stream *stream = camera->stream;
    int code = LUMI_OK;

    if (!stream)
        return LUMI_OK;
    pthread_mutex_lock(&stream->lock);
    stream->on = false;
    for (int i = 0; i < stream->count; i++)
        if (!stream->buffers[i].out)
            unmap(&stream->buffers[i]);
    pthread_mutex_unlock(&stream->lock);
    if (v4l2_ioctl(camera->fd, VIDIOC_STREAMOFF, &stream->type) != 0)
        code = v4l2_fail(camera, error, "stopping");
    /* The memory of those that are still mapped stays until they are not: the driver only forgets them. */
    v4l2_ioctl(camera->fd, VIDIOC_REQBUFS,
               &(struct v4l2_requestbuffers){.type = stream->type, .memory = V4L2_MEMORY_MMAP});
    pthread_mutex_lock(&stream->lock);
    let_go(stream);
    camera->stream = NULL;
    camera_pool_drop(camera->pool);
    camera->pool = NULL;
    return code;
}

/* ---- frames ---- */

static void sync_dmabuf(const struct v4l2_lent *lent, uint64_t phase)
{
    struct dma_buf_sync sync = {.flags = phase | DMA_BUF_SYNC_READ};

    v4l2_ioctl(lent->dmabuf, DMA_BUF_IOCTL_SYNC, &sync);
}

static void give_back(struct lumi_camera_frame *frame)
{
    struct v4l2_lent *lent = frame->owner;
    struct v4l2_stream *stream = lent->stream;

    sync_dmabuf(lent, DMA_BUF_SYNC_END);
    pthread_mutex_lock(&stream->lock);
    lent->out = false;
    if (stream->on)
        queue_buffer(stream, lent->index); /* fails only where the device is gone, which the camera finds too */
    else
        unmap(lent);
    let_go(stream);
}

static struct lumi_camera_frame *lend(struct v4l2_lent *lent, size_t size, size_t offset)
{
    struct lumi_camera_frame *frame = &lent->frame;

    sync_dmabuf(lent, DMA_BUF_SYNC_START);
    camera_frame_init(frame);
    frame->release = give_back;
    frame->owner = lent;
    frame->data = lent->bytes[0] + offset;
    frame->size = size;
    pthread_mutex_lock(&lent->stream->lock);
    lent->out = true;
    lent->stream->holders++;
    pthread_mutex_unlock(&lent->stream->lock);
    return frame;
}

struct arrived { /* a plane */
    const uint8_t *bytes;
    size_t size;
};

static bool copy_plane(const struct v4l2_camera *camera, const struct arrived *plane, int stride, int count,
                       uint8_t *out)
{
    const bool packed = camera->pixel->packed;
    const struct camera_rows rows = {.bytes = plane->bytes,
                                     .size = plane->size,
                                     .stride = stride,
                                     .count = count,
                                     .packed_width = camera->format.width,
                                     .packed_bits = packed ? camera->pixel->bits : 0};

    return camera_copy_rows(&rows, out, camera->format.stride);
}

static struct lumi_camera_frame *copy(struct v4l2_camera *camera, const struct arrived planes[PLANES])
{
    const struct lumi_frame_format *format = &camera->format;
    const size_t whole = lumi_frame_bytes(format);
    const bool two = camera->pixel->planes == 2;
    struct lumi_camera_frame *frame = camera_pool_take(camera->pool, whole ? whole : planes[0].size);
    uint8_t *out;
    bool all;

    if (!frame)
        return NULL;
    out = camera_pool_bytes(frame);
    if (!whole) {
        if (planes[0].size)
            memcpy(out, planes[0].bytes, planes[0].size);
        return frame;
    }
    all = copy_plane(camera, &planes[0], camera->plane_stride[0],
                     two ? format->height : (int)(whole / (size_t)format->stride), out);
    if (two)
        all &= copy_plane(camera, &planes[1], camera->plane_stride[1], (format->height + 1) / 2,
                          out + (size_t)format->stride * (size_t)format->height);
    frame->damaged = !all;
    return frame;
}

static void where(const struct v4l2_stream *stream, const struct v4l2_buffer *buffer, struct arrived planes[PLANES])
{
    const struct v4l2_lent *lent = &stream->buffers[buffer->index];

    memset(planes, 0, PLANES * sizeof *planes);
    for (uint32_t p = 0; p < (stream->planes ? stream->planes : 1); p++) {
        const size_t used = stream->planes ? buffer->m.planes[p].bytesused : buffer->bytesused;
        const size_t skip = stream->planes ? buffer->m.planes[p].data_offset : 0;
        const size_t end = used < lent->length[p] ? used : lent->length[p];

        planes[p].bytes = lent->bytes[p] + (skip < end ? skip : end);
        planes[p].size = skip < end ? end - skip : 0;
    }
}

static void describe(struct v4l2_camera *camera, const struct v4l2_buffer *buffer, struct lumi_camera_frame *frame,
                     uint32_t gap)
{
    const size_t whole = lumi_frame_bytes(&camera->format);

    frame->format = camera->format;
    frame->host_ns = camera_now_ns();
    if ((buffer->flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC)
        frame->device_ns = (int64_t)buffer->timestamp.tv_sec * 1000000000 + (int64_t)buffer->timestamp.tv_usec * 1000;
    frame->at_end = (buffer->flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) != V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
    frame->sequence = buffer->sequence;
    frame->gap = gap;
    frame->damaged |= (buffer->flags & V4L2_BUF_FLAG_ERROR) != 0 || frame->size < whole;
    if (camera->format.layout == LUMI_LAYOUT_JPEG)
        frame->damaged |= frame->size < 4 || frame->data[0] != 0xff || frame->data[1] != 0xd8;
    camera->damaged += frame->damaged;
    camera->frames++;
}

/* How many the driver counted since the last one it gave. */
static uint32_t count_gap(struct v4l2_camera *camera, uint32_t sequence)
{
    struct v4l2_stream *stream = camera->stream;
    const uint32_t ahead = sequence - stream->next_sequence; /* the count wraps */
    const uint32_t gap = stream->sequence_known && ahead < 0x80000000u ? ahead : 0;

    stream->sequence_known = true;
    stream->next_sequence = sequence + 1;
    camera->dropped += gap;
    return gap;
}

int v4l2_stream_frame(struct v4l2_camera *camera, struct lumi_camera_frame **frame, struct lumi_error *error)
{
    struct v4l2_stream *stream = camera->stream;
    struct v4l2_plane raw_planes[VIDEO_MAX_PLANES];
    struct v4l2_buffer buffer;
    struct arrived planes[PLANES];
    uint32_t gap;

    *frame = NULL;
    buffer_init(stream, &buffer, raw_planes, 0);
    if (v4l2_ioctl(camera->fd, VIDIOC_DQBUF, &buffer) != 0) {
        if (errno == EAGAIN)
            return LUMI_OK;
        v4l2_fail(camera, error, "taking a frame");
        return LUMI_ERR_IO; /* whatever it is, the stream does not go on */
    }
    if (buffer.index >= (uint32_t)stream->count)
        return lumi_fail(error, LUMI_ERR_IO, "%s: a buffer that it was not given", camera->camera.identity.address);
    where(stream, &buffer, planes);
    gap = stream->not_taken + count_gap(camera, buffer.sequence);
    *frame = stream->lends ? lend(&stream->buffers[buffer.index], planes[0].size,
                                  (size_t)(planes[0].bytes - stream->buffers[buffer.index].bytes[0]))
                           : copy(camera, planes);
    stream->not_taken = *frame ? 0 : gap + 1;
    if (*frame)
        describe(camera, &buffer, *frame, gap);
    else
        camera->dropped++;
    if (!stream->lends && queue_buffer(stream, buffer.index) != 0) {
        lumi_camera_frame_release(*frame);
        *frame = NULL;
        v4l2_fail(camera, error, "giving a buffer back");
        return LUMI_ERR_IO;
    }
    return LUMI_OK;
}
