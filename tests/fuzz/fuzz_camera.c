/* What a camera is told in words: its address, its options, a driver's name for a control; and rows of packed pixels
 * that end too early. */
#include "checks.h"

#include "daemon/camera/camera_priv.h"
#include "daemon/camera/camera_unpack.h"
#include "daemon/camera/camera_v4l2_priv.h"

#include <stdio.h>

static void read_address(const char *text)
{
    struct lumi_error error = {0};
    enum lumi_camera_backend backend;
    const char *what;

    if (checked(camera_address_parse(text, &backend, &what, &error), &error) != LUMI_OK)
        return;
    if (what < text || what >= text + strlen(text) || backend > LUMI_CAMERA_BACKENDS || strchr(what, '\n'))
        abort();
}

static void read_options(const char *text)
{
    static const uint32_t fourccs[] = {V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_MJPEG, V4L2_PIX_FMT_SRGGB10P, 0xffffffff};
    struct lumi_camera_setting setting;
    struct lumi_error error = {0};
    struct camera_option option;
    const struct v4l2_pixel *pixel;
    const char *at = text;
    char name[40];

    while (camera_option_next(&at, &option, &error) > 0) {
        if (!option.name[0] || !option.value[0] || strpbrk(option.name, " =") || strchr(option.value, ' ') ||
            at > text + strlen(text))
            abort();
        v4l2_control_name(option.name, name, sizeof name);
        if (strlen(name) > strlen(option.name) || strpbrk(name, " ABCXYZ"))
            abort();
    }
    lumi_camera_setting_init(&setting);
    snprintf(setting.options, sizeof setting.options, "%s", text);
    pixel = v4l2_pixel_choose(fourccs, 4, &setting, &error);
    if (!pixel && (!error.text[0] || strchr(error.text, '\n')))
        abort();
}

static void read_rows(const uint8_t *data, size_t size)
{
    const int width = 1 + data[0] % 40, bits = data[1] & 1 ? 10 : 12, count = 1 + data[2] % 8;
    struct camera_rows rows = {.size = size - 4,
                               .stride = (int)camera_packed_row(width, bits) + data[3] % 4,
                               .count = count,
                               .packed_width = data[1] & 2 ? width : 0,
                               .packed_bits = data[1] & 2 ? bits : 0};
    const int stride = 2 * width;
    uint8_t *in = malloc(size), *out = malloc((size_t)(stride * count));

    if (!in || !out)
        abort();
    memcpy(in, data + 4, size - 4);
    rows.bytes = in;
    camera_copy_rows(&rows, out, stride);
    for (int i = 0; rows.packed_bits && i < width * count; i++)
        if ((out[2 * i] | out[2 * i + 1] << 8) >> bits)
            abort();
    free(in);
    free(out);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    char text[400];

    if (size > 4)
        read_rows(data, size);
    if (size >= sizeof text)
        return 0;
    if (size)
        memcpy(text, data, size);
    text[size] = '\0';
    read_address(text);
    read_options(text);
    return 0;
}
