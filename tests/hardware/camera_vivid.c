/* Two of the kernel's own simulated cameras (vivid: one single-planar, one multiplanar) through the V4L2 backend: every
 * layout with its colours, dmabufs, lost frames, errors that the driver injects, a camera that goes and comes back. */
#include "daemon/camera/camera_host.h"

#include <errno.h>
#include <fcntl.h>
#include <linux/videodev2.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>

#define SINGLE "v4l2:platform:vivid-000"
#define MULTI "v4l2:platform:vivid-001"
#define WIDTH 640
#define HEIGHT 360
#define RED "test_pattern=7"

static struct lumi_error error;

#define CHECK(condition, ...)                                                                                          \
    do {                                                                                                               \
        if (!(condition)) {                                                                                            \
            printf("FAILED line %d: %s: ", __LINE__, #condition);                                                      \
            printf(__VA_ARGS__);                                                                                       \
            printf("\n");                                                                                              \
            exit(1);                                                                                                   \
        }                                                                                                              \
    } while (0)
#define OK(call) CHECK((call) == LUMI_OK, "%s", error.text)

static struct lumi_camera *open_camera(const char *address)
{
    struct lumi_camera *camera;

    OK(lumi_camera_open(address, &camera, &error));
    return camera;
}

static struct lumi_camera_setting setting_of(enum lumi_frame_layout layout, int bits, const char *options)
{
    struct lumi_camera_setting setting;

    lumi_camera_setting_init(&setting);
    setting.width = WIDTH;
    setting.height = HEIGHT;
    setting.layout = layout;
    setting.bits = bits;
    setting.frame_rate = 30;
    snprintf(setting.options, sizeof setting.options, "osd_text_mode=2 %s", options);
    return setting;
}

/* The next frame; NULL after `seconds` without one. */
static struct lumi_camera_frame *take(struct lumi_camera *camera, int seconds)
{
    struct lumi_camera_frame *frame;
    struct pollfd fds[LUMI_CAMERA_POLL];
    const int count = camera->ops->poll_fds(camera, fds, LUMI_CAMERA_POLL);

    CHECK(count == 1, "%d descriptors", count);
    for (int i = 0; i < 4; i++) {
        OK(camera->ops->frame(camera, &frame, &error));
        if (frame || poll(fds, 1, seconds * 250) < 0)
            return frame;
    }
    return NULL;
}

/* ---- colours ---- */

static void near_to(const char *what, int value, int wanted, int tolerance)
{
    CHECK(abs(value - wanted) <= tolerance, "%s is %d, not %d", what, value, wanted);
}

static int sample(const struct lumi_camera_frame *frame, int x, int y)
{
    const uint8_t *row = frame->data + (size_t)y * (size_t)frame->format.stride;

    return frame->format.bits > 8 ? (row[2 * x] | row[2 * x + 1] << 8) >> (frame->format.bits - 8) : row[x];
}

/* The whole picture is red: R 255, G 0, B 0, or in BT.601 Y 81 (full range 76), U 90 (85), V 240 (255). */
static void check_red(const struct lumi_camera_frame *frame)
{
    const struct lumi_frame_format *format = &frame->format;
    const uint8_t *at = frame->data + 100 * (size_t)format->stride;
    const uint8_t *uv = frame->data + ((size_t)format->height + 50) * (size_t)format->stride;
    static const int red_at[4][2] = {{0, 0}, {1, 0}, {0, 1}, {1, 1}}; /* RGGB, GRBG, GBRG, BGGR */

    CHECK(frame->size >= lumi_frame_bytes(format), "%zu bytes", frame->size);
    switch (format->layout) {
    case LUMI_LAYOUT_RGB:
        near_to("red", at[300], 255, 10);
        near_to("green", at[301], 0, 10);
        near_to("blue", at[302], 0, 10);
        break;
    case LUMI_LAYOUT_YUYV:
        near_to("Y", at[200], format->full_range ? 76 : 81, 12);
        near_to("U", at[201], format->full_range ? 85 : 90, 12);
        near_to("V", at[203], 240, 16);
        break;
    case LUMI_LAYOUT_NV12:
        near_to("Y", at[200], format->full_range ? 76 : 81, 12);
        near_to("U", uv[200], format->full_range ? 85 : 90, 12);
        near_to("V", uv[201], 240, 16);
        break;
    case LUMI_LAYOUT_BAYER:
        for (int i = 0; i < 4; i++) {
            const bool red = red_at[format->bayer][0] == (i & 1) && red_at[format->bayer][1] == i >> 1;

            near_to(red ? "red" : "not red", sample(frame, 100 + (i & 1), 100 + (i >> 1)), red ? 255 : 0, 12);
        }
        break;
    default:
        near_to("grey", sample(frame, 200, 100), 76, 24);
        break;
    }
}

static void check_layout(const char *address, enum lumi_frame_layout layout, int bits, bool dmabuf, const char *options)
{
    struct lumi_camera *camera = open_camera(address);
    struct lumi_camera_setting setting = setting_of(layout, bits, options);
    struct lumi_camera_status status;
    int64_t before = 0;

    setting.dmabuf = dmabuf;
    OK(camera->ops->configure(camera, &setting, &error));
    OK(camera->ops->arm(camera, &error));
    for (int i = 0; i < 4; i++) {
        struct lumi_camera_frame *frame = take(camera, 20);

        CHECK(frame, "no frame");
        CHECK(frame->format.layout == layout && frame->format.width == WIDTH && frame->format.height == HEIGHT, "%d",
              frame->format.layout);
        /* vivid gives a frame the time it is due, which may be a little ahead. */
        CHECK(!frame->damaged && frame->device_ns > before && llabs(frame->host_ns - frame->device_ns) < 1000000000,
              "times %lld %lld", (long long)frame->device_ns, (long long)frame->host_ns);
        before = frame->device_ns;
        check_red(frame);
        lumi_camera_frame_release(frame);
    }
    OK(camera->ops->status(camera, &status, &error));
    CHECK(status.armed && status.frames >= 4, "%llu frames", (unsigned long long)status.frames);
    OK(camera->ops->disarm(camera, &error));
    lumi_camera_close(camera);
    printf("passed: %s layout %d, %d bits, %s%s\n", address, layout, bits, options, dmabuf ? ", dmabuf" : "");
}

static void check_layouts(void)
{
    static const int bits[] = {8, 10, 12, 16};

    for (int i = 0; i < 4; i++)
        check_layout(i % 2 ? MULTI : SINGLE, LUMI_LAYOUT_BAYER, bits[i], false, RED);
    check_layout(SINGLE, LUMI_LAYOUT_GREY, 8, false, RED);
    check_layout(SINGLE, LUMI_LAYOUT_GREY, 16, false, RED);
    check_layout(SINGLE, LUMI_LAYOUT_RGB, 0, false, RED);
    check_layout(SINGLE, LUMI_LAYOUT_YUYV, 0, false, RED);
    check_layout(SINGLE, LUMI_LAYOUT_NV12, 0, false, RED);
    check_layout(MULTI, LUMI_LAYOUT_YUYV, 0, false, RED);
    check_layout(MULTI, LUMI_LAYOUT_NV12, 0, false, RED);
    check_layout(MULTI, LUMI_LAYOUT_NV12, 0, false, RED " PixelFormat=NM12");
    check_layout(SINGLE, LUMI_LAYOUT_YUYV, 0, true, RED);
    check_layout(MULTI, LUMI_LAYOUT_BAYER, 12, true, RED);
}

/* ---- what it has not ---- */

static void check_refusals(void)
{
    struct lumi_camera *camera = open_camera(SINGLE), *other;
    struct lumi_camera_setting setting = setting_of(LUMI_LAYOUT_JPEG, 0, "");

    CHECK(camera->ops->configure(camera, &setting, &error) == LUMI_ERR_UNSUPPORTED, "a JPEG that it has not");
    setting = setting_of(LUMI_LAYOUT_YUYV, 0, "no_such_control=1");
    CHECK(camera->ops->configure(camera, &setting, &error) == LUMI_ERR_ARG, "an option that it has not");
    setting = setting_of(LUMI_LAYOUT_YUYV, 0, "");
    setting.width = 641;
    CHECK(camera->ops->configure(camera, &setting, &error) == LUMI_ERR_UNSUPPORTED, "a size that it has not");
    printf("it says: %s\n", error.text);
    setting = setting_of(LUMI_LAYOUT_YUYV, 0, "");
    setting.trigger = LUMI_TRIGGER_HARDWARE;
    CHECK(camera->ops->configure(camera, &setting, &error) == LUMI_ERR_UNSUPPORTED, "a trigger that it has not");
    setting.trigger = LUMI_TRIGGER_FREE;
    OK(camera->ops->configure(camera, &setting, &error));
    OK(camera->ops->arm(camera, &error));
    other = open_camera(SINGLE);
    setting.width = 1280;
    setting.height = 720;
    CHECK(other->ops->configure(other, &setting, &error) == LUMI_ERR_BUSY, "another has it");
    lumi_camera_close(other);
    lumi_camera_close(camera);
    printf("passed: refusals\n");
}

/* ---- a driver that makes mistakes ---- */

/* A control by its name, from another program's side. */
static void poke(const char *node, const char *name, int value)
{
    const int fd = open(node, O_RDWR | O_NONBLOCK);
    struct v4l2_queryctrl query = {.id = V4L2_CTRL_FLAG_NEXT_CTRL};

    CHECK(fd >= 0, "%s: %s", node, strerror(errno));
    while (ioctl(fd, VIDIOC_QUERYCTRL, &query) == 0) {
        if (strcmp((const char *)query.name, name) == 0) {
            struct v4l2_control control = {.id = query.id, .value = value};

            CHECK(ioctl(fd, VIDIOC_S_CTRL, &control) == 0, "%s: %s", name, strerror(errno));
            close(fd);
            return;
        }
        query.id |= V4L2_CTRL_FLAG_NEXT_CTRL;
    }
    CHECK(false, "%s has no control \"%s\"", node, name);
}

static void check_lost_frames(bool dmabuf)
{
    struct lumi_camera *camera = open_camera(SINGLE);
    struct lumi_camera_setting setting = setting_of(LUMI_LAYOUT_GREY, 8, "percentage_of_dropped_buffers=40");
    struct lumi_camera_status status;
    uint64_t expected = 0, lost = 0;

    setting.dmabuf = dmabuf;
    OK(camera->ops->configure(camera, &setting, &error));
    OK(camera->ops->arm(camera, &error));
    for (int i = 0; i < 40; i++) {
        struct lumi_camera_frame *frame = take(camera, 20);

        CHECK(frame, "no frame");
        CHECK(i == 0 || frame->sequence == expected + frame->gap, "frame %llu, gap %u, after %llu",
              (unsigned long long)frame->sequence, frame->gap, (unsigned long long)expected - 1);
        lost += frame->gap;
        expected = frame->sequence + 1;
        lumi_camera_frame_release(frame);
    }
    OK(camera->ops->status(camera, &status, &error));
    CHECK(lost > 0 && status.dropped == lost, "%llu lost, %llu told", (unsigned long long)lost,
          (unsigned long long)status.dropped);
    poke(camera->identity.address, "Percentage of Dropped Buffers", 0);
    lumi_camera_close(camera);
    printf("passed: %llu frames that the driver dropped were seen\n", (unsigned long long)lost);
}

static void check_damaged_frame(void)
{
    struct lumi_camera *camera = open_camera(SINGLE);
    const struct lumi_camera_setting setting = setting_of(LUMI_LAYOUT_GREY, 8, "");
    bool damaged = false;

    OK(camera->ops->configure(camera, &setting, &error));
    OK(camera->ops->arm(camera, &error));
    lumi_camera_frame_release(take(camera, 20));
    poke(camera->identity.address, "Inject V4L2_BUF_FLAG_ERROR", 1);
    for (int i = 0; i < 30 && !damaged; i++) {
        struct lumi_camera_frame *frame = take(camera, 20);

        CHECK(frame, "no frame");
        damaged = frame->damaged;
        lumi_camera_frame_release(frame);
    }
    CHECK(damaged, "no frame was damaged");
    OK(camera->ops->disarm(camera, &error));
    poke(camera->identity.address, "Inject VIDIOC_STREAMON Error", 1);
    CHECK(camera->ops->arm(camera, &error) < 0, "it started");
    OK(camera->ops->arm(camera, &error));
    lumi_camera_frame_release(take(camera, 20));
    lumi_camera_close(camera);
    printf("passed: errors that the driver injects\n");
}

/* Frames that are lent: they keep their bytes, the driver runs dry, the camera closes under them. */
static void check_lent_frames(void)
{
    struct lumi_camera *camera = open_camera(MULTI);
    struct lumi_camera_setting setting = setting_of(LUMI_LAYOUT_NV12, 8, "");
    struct lumi_camera_frame *held[16];
    uint64_t sums[16];
    int count = 0;

    setting.dmabuf = true;
    setting.buffers = 4;
    OK(camera->ops->configure(camera, &setting, &error));
    OK(camera->ops->arm(camera, &error));
    for (; count < 16; count++) {
        held[count] = take(camera, 3);
        if (!held[count])
            break;
        sums[count] = 0;
        for (size_t i = 0; i < held[count]->size; i++)
            sums[count] = sums[count] * 31 + held[count]->data[i];
    }
    CHECK(count >= 4 && count < 16, "%d frames before it ran dry", count);
    lumi_camera_frame_release(held[--count]);
    held[count] = take(camera, 20);
    CHECK(held[count] && held[count]->gap > 0, "the frames that had no room are not counted");
    lumi_camera_frame_release(held[count]);
    OK(camera->ops->disarm(camera, &error));
    OK(camera->ops->arm(camera, &error)); /* new buffers while the old ones are out */
    lumi_camera_frame_release(take(camera, 20));
    lumi_camera_close(camera);
    for (int i = 0; i < count; i++) {
        uint64_t sum = 0;

        for (size_t k = 0; k < held[i]->size; k++)
            sum = sum * 31 + held[i]->data[k];
        CHECK(sum == sums[i], "frame %d changed while it was held", i);
        lumi_camera_frame_release(held[i]);
    }
    printf("passed: %d frames held beyond the camera's end\n", count);
}

/* ---- going and coming ---- */

static struct lumi_camera_notice next(struct lumi_camera_host *host, enum lumi_camera_notice_kind kind)
{
    struct lumi_camera_notice notice;

    for (int i = 0; i < 12000; i++) {
        while (lumi_camera_host_notice(host, &notice)) {
            if (notice.kind == kind)
                return notice;
            CHECK(notice.kind != LUMI_CAMERA_DONE || notice.code == LUMI_OK, "%s", notice.text);
            if (notice.kind == LUMI_CAMERA_FRAME)
                lumi_camera_frame_release(notice.frame);
        }
        poll(NULL, 0, 5);
    }
    CHECK(false, "no notice of kind %d in a minute", (int)kind);
    return notice;
}

static void check_return(const char *how, const char *control)
{
    struct lumi_camera_host_options options;
    struct lumi_camera_host *host;
    struct lumi_camera_command command = {.kind = LUMI_CAMERA_CONFIGURE,
                                          .setting = setting_of(LUMI_LAYOUT_YUYV, 0, RED)};
    struct lumi_camera_notice notice;
    char node[256];

    lumi_camera_host_options_init(&options);
    OK(lumi_camera_host_start("platform:vivid-000", &options, &host, &error));
    lumi_camera_host_command(host, 1, &command);
    command.kind = LUMI_CAMERA_ARM;
    lumi_camera_host_command(host, 2, &command);
    notice = next(host, LUMI_CAMERA_CAME);
    snprintf(node, sizeof node, "%s", notice.identity.address);
    lumi_camera_frame_release(next(host, LUMI_CAMERA_FRAME).frame);
    poke(node, control, 1);
    notice = next(host, LUMI_CAMERA_GONE);
    printf("%s: %s\n", how, notice.text);
    next(host, LUMI_CAMERA_CAME);
    for (int i = 0; i < 3; i++) {
        notice = next(host, LUMI_CAMERA_FRAME);
        check_red(notice.frame);
        lumi_camera_frame_release(notice.frame);
    }
    lumi_camera_host_stop(host);
    printf("passed: %s\n", how);
}

int main(void)
{
    struct lumi_camera_identity listed[8];
    const int count = lumi_camera_list(listed, 8, &error);

    setvbuf(stdout, NULL, _IOLBF, 0);
    CHECK(count >= 2, "%d cameras", count);
    for (int i = 0; i < count; i++)
        printf("%s %s: %s, %s, %s\n", lumi_camera_backend_name(listed[i].backend), listed[i].address, listed[i].serial,
               listed[i].vendor, listed[i].model);
    check_layouts();
    check_refusals();
    check_lost_frames(false);
    check_lost_frames(true);
    check_damaged_frame();
    check_lent_frames();
    check_return("the stream breaks down", "Inject Fatal Streaming Error");
    check_return("unplugged", "Disconnect");
    printf("camera_vivid: PASSED\n");
    return 0;
}
