/* libcamera's pixel formats (DRM's codes): which are ours, and which one a setting wants. */
#include "daemon/camera/camera_libcamera_priv.h"

#define FOURCC(a, b, c, d)                                                                                             \
    ((uint32_t)(a) | (uint32_t)(b) << 8 | (uint32_t)(c) << 16 | (uint32_t)(unsigned char)(d) << 24)
#define RAW(rggb, grbg, gbrg, bggr, modifier, bits)                                                                    \
    {rggb, modifier, LUMI_LAYOUT_BAYER, LUMI_BAYER_RGGB, bits},                                                        \
        {grbg, modifier, LUMI_LAYOUT_BAYER, LUMI_BAYER_GRBG, bits},                                                    \
        {gbrg, modifier, LUMI_LAYOUT_BAYER, LUMI_BAYER_GBRG, bits},                                                    \
    {                                                                                                                  \
        bggr, modifier, LUMI_LAYOUT_BAYER, LUMI_BAYER_BGGR, bits                                                       \
    }
#define RAW10(modifier)                                                                                                \
    RAW(FOURCC('R', 'G', '1', '0'), FOURCC('B', 'A', '1', '0'), FOURCC('G', 'B', '1', '0'),                            \
        FOURCC('B', 'G', '1', '0'), modifier, 10)
#define RAW12(modifier)                                                                                                \
    RAW(FOURCC('R', 'G', '1', '2'), FOURCC('B', 'A', '1', '2'), FOURCC('G', 'B', '1', '2'),                            \
        FOURCC('B', 'G', '1', '2'), modifier, 12)
#define OTHER(a, b, c, d, layout, bits)                                                                                \
    {                                                                                                                  \
        FOURCC(a, b, c, d), 0, layout, LUMI_BAYER_RGGB, bits                                                           \
    }
/* What is earlier is preferred. */
static const struct libcamera_pixel pixels[] = {
    RAW(FOURCC('R', 'G', 'B', '6'), FOURCC('G', 'R', '1', '6'), FOURCC('G', 'B', '1', '6'), FOURCC('B', 'Y', 'R', '2'),
        0, 16),
    RAW12(0),
    RAW12(LIBCAMERA_PACKED),
    RAW10(0),
    RAW10(LIBCAMERA_PACKED),
    RAW(FOURCC('R', 'G', 'G', 'B'), FOURCC('G', 'R', 'B', 'G'), FOURCC('G', 'B', 'R', 'G'), FOURCC('B', 'A', '8', '1'),
        0, 8),
    OTHER('M', 'J', 'P', 'G', LUMI_LAYOUT_JPEG, 8),
    OTHER('Y', 'U', 'Y', 'V', LUMI_LAYOUT_YUYV, 8),
    OTHER('N', 'V', '1', '2', LUMI_LAYOUT_NV12, 8),
    OTHER('B', 'G', '2', '4', LUMI_LAYOUT_RGB, 8), /* DRM names them from the highest bits down */
    OTHER('R', '1', '6', ' ', LUMI_LAYOUT_GREY, 16),
    OTHER('R', '1', '2', ' ', LUMI_LAYOUT_GREY, 12),
    OTHER('R', '1', '0', ' ', LUMI_LAYOUT_GREY, 10),
    OTHER('R', '8', ' ', ' ', LUMI_LAYOUT_GREY, 8),
};
#define PIXELS (int)(sizeof pixels / sizeof pixels[0])

void libcamera_add_format(void *context, const struct shim_format *format)
{
    struct libcamera_formats *all = context;

    if (all->count < LIBCAMERA_FORMATS)
        all->all[all->count++] = *format;
}

const struct libcamera_pixel *libcamera_choose(const struct libcamera_formats *formats,
                                               const struct lumi_camera_setting *setting, struct shim_format *chosen)
{
    for (int i = 0; i < PIXELS; i++)
        for (int k = 0; k < formats->count; k++)
            if (formats->all[k].fourcc == pixels[i].fourcc && formats->all[k].modifier == pixels[i].modifier &&
                (setting->layout == LUMI_LAYOUT_NONE || setting->layout == pixels[i].layout) &&
                (setting->bits == 0 || setting->bits == pixels[i].bits)) {
                *chosen = formats->all[k];
                return &pixels[i];
            }
    return NULL;
}
