/* Pixel formats by their GenICam names (EMVA, Pixel Format Naming Convention 2.1), and bits out of bytes. */
#include "daemon/camera/camera_aravis_priv.h"

#include <string.h>

static bool take(const char **text, const char *word)
{
    const size_t length = strlen(word);

    if (strncmp(*text, word, length) != 0)
        return false;
    *text += length;
    return true;
}

static bool take_layout(const char **name, struct aravis_pixels *pixels)
{
    static const char *const filters[] = {[LUMI_BAYER_RGGB] = "BayerRG",
                                          [LUMI_BAYER_GRBG] = "BayerGR",
                                          [LUMI_BAYER_GBRG] = "BayerGB",
                                          [LUMI_BAYER_BGGR] = "BayerBG"};

    pixels->layout = LUMI_LAYOUT_BAYER;
    for (int i = 0; i < 4; i++)
        if (take(name, filters[i])) {
            pixels->bayer = (enum lumi_bayer)i;
            return true;
        }
    pixels->layout = LUMI_LAYOUT_GREY;
    return take(name, "Mono");
}

bool aravis_pixels_of_name(const char *name, struct aravis_pixels *pixels)
{
    static const struct {
        const char *name;
        struct aravis_pixels pixels;
    } whole[] = {
        {"JPEG", {LUMI_LAYOUT_JPEG, 0, 8, ARAVIS_PLAIN}},       {"RGB8", {LUMI_LAYOUT_RGB, 0, 8, ARAVIS_PLAIN}},
        {"RGB8Packed", {LUMI_LAYOUT_RGB, 0, 8, ARAVIS_PLAIN}},  {"BGR8", {LUMI_LAYOUT_RGB, 0, 8, ARAVIS_BGR}},
        {"BGR8Packed", {LUMI_LAYOUT_RGB, 0, 8, ARAVIS_BGR}},    {"YUV422_8", {LUMI_LAYOUT_YUYV, 0, 8, ARAVIS_PLAIN}},
        {"YCbCr422_8", {LUMI_LAYOUT_YUYV, 0, 8, ARAVIS_PLAIN}},
    };
    static const int depths[] = {8, 10, 12, 14, 16};
    static const char *const digits[] = {"8", "10", "12", "14", "16"};

    for (size_t i = 0; i < G_N_ELEMENTS(whole); i++)
        if (strcmp(name, whole[i].name) == 0) {
            *pixels = whole[i].pixels;
            return true;
        }
    *pixels = (struct aravis_pixels){0};
    if (!take_layout(&name, pixels))
        return false;
    for (size_t i = 0; i < G_N_ELEMENTS(depths) && pixels->bits == 0; i++)
        if (take(&name, digits[i]))
            pixels->bits = depths[i];
    if (*name == '\0')
        return pixels->bits > 0;
    pixels->packing = strcmp(name, "p") == 0 ? ARAVIS_LSB : strcmp(name, "Packed") == 0 ? ARAVIS_GVSP : ARAVIS_BGR;
    return pixels->packing == ARAVIS_LSB ? pixels->bits == 10 || pixels->bits == 12 || pixels->bits == 14
                                         : pixels->packing == ARAVIS_GVSP && (pixels->bits == 10 || pixels->bits == 12);
}

void aravis_format(const struct aravis_pixels *pixels, struct lumi_frame_format *format)
{
    const int words = pixels->bits > 8 ? 2 : 1;

    format->layout = pixels->layout;
    format->bayer = pixels->bayer;
    format->bits = pixels->bits;
    switch (pixels->layout) {
    case LUMI_LAYOUT_RGB:
        format->stride = 3 * format->width;
        break;
    case LUMI_LAYOUT_YUYV:
        format->stride = 2 * format->width;
        break;
    case LUMI_LAYOUT_JPEG:
        format->stride = 0;
        break;
    default:
        format->stride = words * format->width;
    }
}

size_t aravis_packed_bytes(const struct aravis_pixels *pixels, size_t count)
{
    switch (pixels->packing) {
    case ARAVIS_LSB:
        return (count * (size_t)pixels->bits + 7) / 8;
    case ARAVIS_GVSP:
        return (count * 3 + 1) / 2;
    case ARAVIS_BGR:
        return 3 * count;
    case ARAVIS_PLAIN:
        break;
    }
    switch (pixels->layout) {
    case LUMI_LAYOUT_RGB:
        return 3 * count;
    case LUMI_LAYOUT_YUYV:
        return 2 * count;
    default:
        return pixels->bits > 8 ? 2 * count : count;
    }
}

static void put16(uint8_t *to, size_t index, unsigned value)
{
    to[2 * index] = (uint8_t)value;
    to[2 * index + 1] = (uint8_t)(value >> 8);
}

static void unpack_lsb(int bits, const uint8_t *from, size_t count, uint8_t *to)
{
    const unsigned mask = (1u << bits) - 1;
    unsigned held = 0;
    int have = 0;

    for (size_t i = 0; i < count; i++) {
        while (have < bits) {
            held |= (unsigned)*from++ << have;
            have += 8;
        }
        put16(to, i, held & mask);
        held >>= bits;
        have -= bits;
    }
}

/* GigE Vision 2.0, 27.7: the upper 8 bits of each pixel have a byte of their own, what is below shares the middle. */
static void unpack_gvsp(int bits, const uint8_t *from, size_t count, uint8_t *to)
{
    const int low = bits - 8;
    const unsigned mask = (1u << low) - 1;

    for (size_t i = 0; i < count; i++, from += i % 2 == 0 ? 3 : 0) {
        const unsigned middle = from[1];

        if (i % 2 == 0)
            put16(to, i, (unsigned)from[0] << low | (middle & mask));
        else
            put16(to, i, (unsigned)from[2] << low | (middle >> 4 & mask));
    }
}

void aravis_unpack(const struct aravis_pixels *pixels, const uint8_t *from, size_t count, uint8_t *to)
{
    switch (pixels->packing) {
    case ARAVIS_PLAIN:
        memcpy(to, from, aravis_packed_bytes(pixels, count));
        break;
    case ARAVIS_LSB:
        unpack_lsb(pixels->bits, from, count, to);
        break;
    case ARAVIS_GVSP:
        unpack_gvsp(pixels->bits, from, count, to);
        break;
    case ARAVIS_BGR:
        for (size_t i = 0; i < count; i++) {
            to[3 * i] = from[3 * i + 2];
            to[3 * i + 1] = from[3 * i + 1];
            to[3 * i + 2] = from[3 * i];
        }
        break;
    }
}
