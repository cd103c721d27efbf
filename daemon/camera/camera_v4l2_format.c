/* V4L2's pixel formats: which are ours, and which one a setting wants. */
#include "daemon/camera/camera_v4l2_priv.h"

#include <stdio.h>
#include <string.h>

#define BAYER(suffix, depth, is_packed)                                                                                \
    {V4L2_PIX_FMT_SRGGB##suffix, LUMI_LAYOUT_BAYER, LUMI_BAYER_RGGB, depth, 1, is_packed},                             \
        {V4L2_PIX_FMT_SGRBG##suffix, LUMI_LAYOUT_BAYER, LUMI_BAYER_GRBG, depth, 1, is_packed},                         \
        {V4L2_PIX_FMT_SGBRG##suffix, LUMI_LAYOUT_BAYER, LUMI_BAYER_GBRG, depth, 1, is_packed},                         \
    {                                                                                                                  \
        V4L2_PIX_FMT_SBGGR##suffix, LUMI_LAYOUT_BAYER, LUMI_BAYER_BGGR, depth, 1, is_packed                            \
    }

/* What is earlier is preferred where a setting says nothing: raw, then JPEG, then what there is. */
static const struct v4l2_pixel pixels[] = {
    BAYER(16, 16, false),
    BAYER(12, 12, false),
    BAYER(12P, 12, true),
    BAYER(10, 10, false),
    BAYER(10P, 10, true),
    BAYER(8, 8, false),
    {V4L2_PIX_FMT_MJPEG, LUMI_LAYOUT_JPEG, LUMI_BAYER_RGGB, 8, 1, false},
    {V4L2_PIX_FMT_JPEG, LUMI_LAYOUT_JPEG, LUMI_BAYER_RGGB, 8, 1, false},
    {V4L2_PIX_FMT_YUYV, LUMI_LAYOUT_YUYV, LUMI_BAYER_RGGB, 8, 1, false},
    {V4L2_PIX_FMT_NV12, LUMI_LAYOUT_NV12, LUMI_BAYER_RGGB, 8, 1, false},
    {V4L2_PIX_FMT_NV12M, LUMI_LAYOUT_NV12, LUMI_BAYER_RGGB, 8, 2, false},
    {V4L2_PIX_FMT_RGB24, LUMI_LAYOUT_RGB, LUMI_BAYER_RGGB, 8, 1, false},
    {V4L2_PIX_FMT_Y16, LUMI_LAYOUT_GREY, LUMI_BAYER_RGGB, 16, 1, false},
    {V4L2_PIX_FMT_Y12, LUMI_LAYOUT_GREY, LUMI_BAYER_RGGB, 12, 1, false},
    {V4L2_PIX_FMT_Y10, LUMI_LAYOUT_GREY, LUMI_BAYER_RGGB, 10, 1, false},
    {V4L2_PIX_FMT_GREY, LUMI_LAYOUT_GREY, LUMI_BAYER_RGGB, 8, 1, false},
};
#define PIXELS (int)(sizeof pixels / sizeof pixels[0])

const struct v4l2_pixel *v4l2_pixel_find(uint32_t fourcc)
{
    for (int i = 0; i < PIXELS; i++)
        if (pixels[i].fourcc == fourcc)
            return &pixels[i];
    return NULL;
}

int v4l2_pixel_option(const struct lumi_camera_setting *setting, uint32_t *fourcc, struct lumi_error *error)
{
    const char *text = setting->options;
    struct camera_option option;
    int more;

    *fourcc = 0;
    while ((more = camera_option_next(&text, &option, error)) > 0) {
        const size_t length = strlen(option.value);

        if (strcmp(option.name, V4L2_OPTION_FORMAT) != 0)
            continue;
        for (size_t i = 0; i < 4; i++)
            *fourcc |= (uint32_t)(unsigned char)(i < length ? option.value[i] : ' ') << (8 * i);
        if (length > 4 || !v4l2_pixel_find(*fourcc))
            return lumi_fail(error, LUMI_ERR_ARG, "option %s=%s: not a format of ours", option.name, option.value);
    }
    return more;
}

static bool fits(const struct v4l2_pixel *pixel, const struct lumi_camera_setting *setting, uint32_t fourcc)
{
    return (fourcc == 0 || fourcc == pixel->fourcc) &&
           (setting->layout == LUMI_LAYOUT_NONE || setting->layout == pixel->layout) &&
           (setting->bits == 0 || setting->bits == pixel->bits) &&
           (!setting->dmabuf || (pixel->planes == 1 && !pixel->packed));
}

const struct v4l2_pixel *v4l2_pixel_choose(const uint32_t *fourccs, int count,
                                           const struct lumi_camera_setting *setting, struct lumi_error *error)
{
    char there[256] = "";
    uint32_t fourcc;

    if (v4l2_pixel_option(setting, &fourcc, error) != LUMI_OK)
        return NULL;

    for (int i = 0; i < PIXELS; i++)
        for (int k = 0; k < count; k++)
            if (fourccs[k] == pixels[i].fourcc && fits(&pixels[i], setting, fourcc))
                return &pixels[i];
    for (int k = 0; k < count && strlen(there) + 6 < sizeof there; k++) {
        const uint32_t f = fourccs[k];

        for (int i = 0; i < 4; i++) {
            const char c = (char)(f >> (8 * i) & 127);

            snprintf(there + strlen(there), sizeof there - strlen(there), i ? "%c" : " %c", c > ' ' ? c : '_');
        }
    }
    lumi_fail(error, LUMI_ERR_UNSUPPORTED, "no format as it was asked for%s; it has%s",
              setting->dmabuf ? " (one plane, for dmabuf)" : "", there[0] ? there : " none");
    return NULL;
}
