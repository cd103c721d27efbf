/* A USB camera (uvc_device) through a backend: its pictures are numbered, so that none is lost or doubled unseen, and
 * tell the exposure that they were taken with. Unplugged and plugged in again in mid-stream. usage: camera_uvc ADDRESS
 */
#include "daemon/camera/camera_host.h"
#include "tests/hardware/numbered_picture.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <jpeglib.h>

static struct lumi_error error;
static struct lumi_camera_host *host;
static uint32_t commands;

#define CHECK(condition, ...)                                                                                          \
    do {                                                                                                               \
        if (!(condition)) {                                                                                            \
            printf("FAILED line %d: %s: ", __LINE__, #condition);                                                      \
            printf(__VA_ARGS__);                                                                                       \
            printf("\n");                                                                                              \
            exit(1);                                                                                                   \
        }                                                                                                              \
    } while (0)

static struct lumi_camera_notice next(enum lumi_camera_notice_kind kind)
{
    struct lumi_camera_notice notice;

    for (int i = 0; i < 12000; i++) {
        while (lumi_camera_host_notice(host, &notice)) {
            if (notice.kind == kind)
                return notice;
            if (notice.kind == LUMI_CAMERA_GONE || (notice.kind == LUMI_CAMERA_STATUS && notice.code))
                printf("%s\n", notice.text);
            if (notice.kind == LUMI_CAMERA_FRAME)
                lumi_camera_frame_release(notice.frame);
        }
        poll(NULL, 0, 5);
    }
    CHECK(false, "no notice of kind %d in a minute", (int)kind);
    return notice;
}

static void command(const struct lumi_camera_command *asked)
{
    struct lumi_camera_notice notice;

    CHECK(lumi_camera_host_command(host, ++commands, asked) == LUMI_OK, "no memory");
    notice = next(LUMI_CAMERA_DONE);
    CHECK(notice.command == commands && notice.code == LUMI_OK, "command %u: %s", notice.command, notice.text);
}

/* A JPEG's luma, one byte a pixel. */
static uint8_t *decode(const struct lumi_camera_frame *frame, int *stride)
{
    struct jpeg_decompress_struct jpeg;
    struct jpeg_error_mgr errors;
    uint8_t *luma;

    jpeg.err = jpeg_std_error(&errors);
    jpeg_create_decompress(&jpeg);
    jpeg_mem_src(&jpeg, frame->data, frame->size);
    jpeg_read_header(&jpeg, TRUE);
    jpeg.out_color_space = JCS_GRAYSCALE;
    jpeg_start_decompress(&jpeg);
    *stride = (int)jpeg.output_width;
    CHECK((int)jpeg.output_width == frame->format.width && (int)jpeg.output_height == frame->format.height,
          "a picture of %u x %u", jpeg.output_width, jpeg.output_height);
    luma = malloc((size_t)jpeg.output_width * jpeg.output_height);
    while (jpeg.output_scanline < jpeg.output_height) {
        JSAMPROW row = luma + (size_t)jpeg.output_scanline * (size_t)*stride;

        jpeg_read_scanlines(&jpeg, &row, 1);
    }
    jpeg_finish_decompress(&jpeg);
    jpeg_destroy_decompress(&jpeg);
    return luma;
}

static void read_numbers(const struct lumi_camera_frame *frame, unsigned *number, unsigned *exposure)
{
    if (frame->format.layout == LUMI_LAYOUT_JPEG) {
        int stride;
        uint8_t *luma = decode(frame, &stride);

        picture_read(luma, 1, stride, number, exposure);
        free(luma);
    } else {
        CHECK(frame->size >= lumi_frame_bytes(&frame->format), "%zu bytes", frame->size);
        picture_read(frame->data, 2, frame->format.stride, number, exposure);
    }
}

/* `count` frames: every number once, or told as lost. Returns the last one's exposure, in 100 µs. */
static unsigned check_frames(int count, enum lumi_frame_layout layout)
{
    unsigned number = 0, exposure = 0;
    uint64_t sequence = 0;
    int64_t device_ns = 0;

    for (int i = 0; i < count; i++) {
        struct lumi_camera_frame *frame = next(LUMI_CAMERA_FRAME).frame;
        const unsigned before = number;

        CHECK(frame->format.layout == layout && !frame->damaged, "layout %d", (int)frame->format.layout);
        read_numbers(frame, &number, &exposure);
        if (i > 0) {
            CHECK(((number - before) & 0xffff) == frame->gap + 1, "picture %u after %u, gap %u", number, before,
                  frame->gap);
            CHECK(frame->sequence - sequence == frame->gap + 1, "frame %llu after %llu, gap %u",
                  (unsigned long long)frame->sequence, (unsigned long long)sequence, frame->gap);
            CHECK(frame->device_ns > device_ns, "%lld", (long long)frame->device_ns);
        }
        CHECK(llabs(frame->host_ns - frame->device_ns) < 2000000000, "%lld, %lld", (long long)frame->host_ns,
              (long long)frame->device_ns);
        sequence = frame->sequence;
        device_ns = frame->device_ns;
        lumi_camera_frame_release(frame);
    }
    printf("%d frames, the last is picture %u, frame %llu, exposure %.4f s\n", count, number,
           (unsigned long long)sequence, exposure * 1e-4);
    return exposure;
}

/* Until pictures say so: some are under way. */
static void check_exposure(unsigned wanted, enum lumi_frame_layout layout)
{
    for (int i = 0; i < 60; i++)
        if (check_frames(1, layout) == wanted)
            return;
    CHECK(false, "the exposure does not become %u", wanted);
}

/* A picture that breaks off in the middle comes as it is, and is told to be damaged. */
static void check_damaged(void)
{
    for (int i = 0; i < 200; i++) {
        struct lumi_camera_frame *frame = next(LUMI_CAMERA_FRAME).frame;
        const bool damaged = frame->damaged;

        if (damaged)
            printf("a damaged frame of %zu bytes\n", frame->size);
        lumi_camera_frame_release(frame);
        if (damaged)
            return;
    }
    CHECK(false, "no frame is damaged");
}

int main(int count, char **argument)
{
    struct lumi_camera_host_options options;
    struct lumi_camera_command asked = {.kind = LUMI_CAMERA_CONFIGURE};
    struct lumi_camera_notice notice;

    setvbuf(stdout, NULL, _IOLBF, 0);
    if (count != 2)
        return 2;
    lumi_camera_host_options_init(&options);
    options.frames_max = 4;
    CHECK(lumi_camera_host_start(argument[1], &options, &host, &error) == LUMI_OK, "%s", error.text);
    notice = next(LUMI_CAMERA_CAME);
    printf("%s: %s, %s %s at %s\n", argument[1], notice.identity.serial, notice.identity.vendor, notice.identity.model,
           notice.identity.address);
    CHECK(notice.identity.exposure_control, "no exposure control");

    lumi_camera_setting_init(&asked.setting);
    asked.setting.layout = LUMI_LAYOUT_JPEG;
    asked.setting.exposure_s = 0.01;
    command(&asked);
    asked.kind = LUMI_CAMERA_ARM;
    command(&asked);
    check_exposure(100, LUMI_LAYOUT_JPEG);
    check_frames(40, LUMI_LAYOUT_JPEG);
    asked.kind = LUMI_CAMERA_EXPOSE;
    asked.exposure_s = 0.02;
    asked.gain = 1;
    command(&asked);
    check_exposure(200, LUMI_LAYOUT_JPEG);

    printf("host: break\n");
    check_damaged();

    printf("host: unplug\n");
    notice = next(LUMI_CAMERA_GONE);
    printf("gone: %s\n", notice.text);
    next(LUMI_CAMERA_CAME);
    check_exposure(200, LUMI_LAYOUT_JPEG);
    check_frames(20, LUMI_LAYOUT_JPEG);

    asked.kind = LUMI_CAMERA_CONFIGURE;
    asked.setting.layout = LUMI_LAYOUT_YUYV;
    asked.setting.width = 320;
    asked.setting.height = 240;
    asked.setting.exposure_s = 0.005;
    command(&asked);
    asked.kind = LUMI_CAMERA_ARM;
    command(&asked);
    check_exposure(50, LUMI_LAYOUT_YUYV);
    check_frames(20, LUMI_LAYOUT_YUYV);
    lumi_camera_host_stop(host);
    printf("camera_uvc %s: PASSED\n", argument[1]);
    return 0;
}
