/* Tiles as VP9 frames. */
#include "proto/lightfield/tile_core.h"

#include "proto/base/memory.h"

#include <string.h>
#include <vpx/vp8dx.h>
#include <vpx/vpx_decoder.h>

enum { PADDING = 64, COMPRESSED_PADDING = 4, INDEX_MAX = 16 };
/* A blank or priming frame, and a tile with its headers; the index. */
enum { PACKET_MAX = 2 * (LUMI_PRIMING_FRAME_MAX + PADDING) + 1024 + INDEX_MAX };

struct lumi_tile_core {
    const struct lumi_priming *priming;
    const struct lumi_yuv *references;
    vpx_codec_ctx_t vpx;
    bool live, primed;
    struct lumi_tile_pixels windows[LUMI_WINDOWS];
    uint8_t packet[PACKET_MAX];
};

int lumi_tile_core_create(const struct lumi_priming *priming, const struct lumi_yuv *references,
                          struct lumi_tile_core **core, struct lumi_error *error)
{
    *core = lumi_calloc(1, sizeof **core);
    if (!*core)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a tile decoder");
    (*core)->priming = priming;
    (*core)->references = references;

    const vpx_codec_dec_cfg_t config = {.threads = 1, .w = LUMI_TILE, .h = LUMI_TILE};
    if (vpx_codec_dec_init(&(*core)->vpx, vpx_codec_vp9_dx(), &config, 0) != VPX_CODEC_OK) {
        lumi_free(*core);
        *core = NULL;
        return lumi_fail(error, LUMI_ERR_NOMEM, "libvpx gives no VP9 decoder");
    }
    (*core)->live = true;
    return LUMI_OK;
}

void lumi_tile_core_destroy(struct lumi_tile_core *core)
{
    if (!core)
        return;
    if (core->live)
        vpx_codec_destroy(&core->vpx);
    lumi_free(core);
}

static bool set_windows(struct lumi_tile_core *core, const struct lumi_tile_pixels *windows)
{
    static const vpx_ref_frame_type_t buffers[LUMI_WINDOWS] = {VP8_LAST_FRAME, VP8_GOLD_FRAME};

    for (int k = 0; k < LUMI_WINDOWS; k++) {
        vpx_ref_frame_t frame = {.frame_type = buffers[k]};
        vpx_img_wrap(&frame.img, VPX_IMG_FMT_I420, LUMI_TILE, LUMI_TILE, 1, (unsigned char *)windows[k].y);
        frame.img.planes[1] = (unsigned char *)windows[k].u;
        frame.img.planes[2] = (unsigned char *)windows[k].v;
        if (vpx_codec_control(&core->vpx, VP8_SET_REFERENCE, &frame) != VPX_CODEC_OK)
            return false;
    }
    return true;
}

static void copy_plane(const uint8_t *source, int stride, int size, uint8_t *target)
{
    for (int y = 0; y < size; y++)
        memcpy(target + y * size, source + (ptrdiff_t)y * stride, (size_t)size);
}

/* Decodes the frames that stand in core->packet, whose sizes are given; the picture of the last one. */
static bool decode_packet(struct lumi_tile_core *core, const size_t *sizes, int count, struct lumi_tile_pixels *pixels)
{
    size_t at = 0;
    uint8_t marker = (uint8_t)(0xc0 | 3 << 3 | (count - 1)); /* sizes of four bytes */
    int corrupted = 0;

    for (int i = 0; i < count; i++)
        at += sizes[i];
    core->packet[at++] = marker;
    for (int i = 0; i < count; i++)
        for (int k = 0; k < 4; k++)
            core->packet[at++] = (uint8_t)(sizes[i] >> (8 * k));
    core->packet[at++] = marker;
    if (vpx_codec_decode(&core->vpx, core->packet, (unsigned)at, NULL, 0) != VPX_CODEC_OK)
        return false;
    if (vpx_codec_control(&core->vpx, VP8D_GET_FRAME_CORRUPTED, &corrupted) != VPX_CODEC_OK || corrupted)
        return false;

    vpx_codec_iter_t iterator = NULL;
    const vpx_image_t *image = NULL, *next;
    while ((next = vpx_codec_get_frame(&core->vpx, &iterator)))
        image = next;
    if (!image || image->fmt != VPX_IMG_FMT_I420 || image->d_w != LUMI_TILE || image->d_h != LUMI_TILE)
        return false;
    if (pixels) {
        copy_plane(image->planes[0], image->stride[0], LUMI_TILE, pixels->y);
        copy_plane(image->planes[1], image->stride[1], LUMI_TILE / 2, pixels->u);
        copy_plane(image->planes[2], image->stride[2], LUMI_TILE / 2, pixels->v);
    }
    return true;
}

/* Appends bytes and their padding to the packet at `at`; returns the frame's size. */
static size_t append_frame(struct lumi_tile_core *core, size_t at, const uint8_t *data, size_t size)
{
    memcpy(core->packet + at, data, size);
    memset(core->packet + at + size, 0, PADDING);
    return size + PADDING;
}

/* A fresh key frame makes libvpx forget an earlier error. */
static int prime(struct lumi_tile_core *core)
{
    const struct lumi_priming *priming = core->priming;

    for (int i = 0; i < priming->count; i++) {
        const struct lumi_priming_frame *frame = &priming->frames[i];
        const struct lumi_yuv *reference = frame->reference >= 0 ? &core->references[frame->reference] : NULL;
        if (reference && reference->width > 0) {
            for (int k = 0; k < LUMI_WINDOWS; k++)
                lumi_window_copy(reference, frame->at[k].x, frame->at[k].y, &core->windows[k]);
            if (!set_windows(core, core->windows))
                return LUMI_ERR_CHECKSUM;
        }
        size_t size = append_frame(core, 0, frame->data, frame->size);
        if (!decode_packet(core, &size, 1, NULL))
            return LUMI_ERR_CHECKSUM;
    }
    core->primed = true;
    return LUMI_OK;
}

int lumi_tile_core_frame(struct lumi_tile_core *core, const struct lumi_tile_pixels windows[LUMI_WINDOWS],
                         const uint8_t *data, size_t size, bool tile, struct lumi_tile_pixels *pixels)
{
    size_t sizes[2] = {0}, at = 0;
    int count = 0;

    if (size > LUMI_PRIMING_FRAME_MAX)
        return LUMI_ERR_LIMIT;
    if (tile && !core->primed)
        LUMI_TRY(prime(core));
    core->primed = false;
    if (windows && !set_windows(core, windows))
        return LUMI_ERR_INTERNAL;
    if (tile && core->priming->blank) {
        sizes[count] = append_frame(core, 0, core->priming->blank, core->priming->blank_size);
        at = sizes[count++];
    }
    sizes[count++] = append_frame(core, at, data, size);
    if (!decode_packet(core, sizes, count, pixels))
        return LUMI_ERR_INTERNAL;
    core->primed = true;
    return LUMI_OK;
}

int lumi_tile_core_decode(struct lumi_tile_core *core, const struct lumi_yuv *reference, int x, int y,
                          const struct lumi_tile_code *code, struct lumi_tile_pixels *pixels)
{
    size_t sizes[2] = {0}, at = 0;
    int count = 0;

    if (code->size > LUMI_TILE_DATA_MAX || code->compressed_size > LUMI_TILE_COMPRESSED_MAX ||
        code->compressed_size < 1)
        return LUMI_ERR_CHECKSUM;
    if (!core->primed)
        LUMI_TRY(prime(core));
    for (int k = 0; k < LUMI_WINDOWS; k++)
        lumi_window_copy(reference, x + code->shift[k].x, y + code->shift[k].y, &core->windows[k]);
    core->primed = false;
    if (!set_windows(core, core->windows))
        return LUMI_ERR_CHECKSUM;
    if (core->priming->blank) {
        sizes[count] = append_frame(core, 0, core->priming->blank, core->priming->blank_size);
        at = sizes[count++];
    }

    struct lumi_tile_frame frame = core->priming->frame;
    frame.quantizer = code->quantizer;
    uint8_t *start = core->packet + at;
    size_t size =
        lumi_tile_header_build(&frame, &code->fields, (size_t)code->compressed_size + COMPRESSED_PADDING, start);
    memcpy(start + size, code->compressed, code->compressed_size);
    size += code->compressed_size;
    memset(start + size, 0, COMPRESSED_PADDING);
    size += COMPRESSED_PADDING;
    if (code->size > 0)
        memcpy(start + size, code->data, code->size);
    memset(start + size + code->size, 0, PADDING);
    sizes[count++] = size + code->size + PADDING;
    if (!decode_packet(core, sizes, count, pixels))
        return LUMI_ERR_CHECKSUM;
    core->primed = true;
    return LUMI_OK;
}
