/* Encoding tiles. */
#include "proto/lightfield/tile_encoder.h"

#include "proto/base/memory.h"

#include <limits.h>
#include <string.h>
#include <vpx/vp8cx.h>
#include <vpx/vpx_encoder.h>

enum { NO_UPDATE = VP8_EFLAG_NO_UPD_LAST | VP8_EFLAG_NO_UPD_GF | VP8_EFLAG_NO_UPD_ARF };
enum { NO_REFERENCE = VP8_EFLAG_NO_REF_LAST | VP8_EFLAG_NO_REF_GF | VP8_EFLAG_NO_REF_ARF };
enum { TILE_FLAGS = NO_UPDATE | VP8_EFLAG_NO_UPD_ENTROPY | VP8_EFLAG_NO_REF_ARF };
enum { SHORTENED_MAX = 256, DROP_MAX = 4 };

/* A compressed header as libvpx writes it, and the shortest one that did as well. */
struct shortened {
    uint8_t full[LUMI_TILE_COMPRESSED_MAX], cut[LUMI_TILE_COMPRESSED_MAX];
    size_t full_size, cut_size;
};

struct lumi_tile_encoder {
    vpx_codec_ctx_t vpx;
    bool live;
    vpx_codec_pts_t pts;
    const struct lumi_yuv *references;
    struct lumi_priming priming;
    struct lumi_tile_core *core;
    struct lumi_tile_pixels grey, windows[LUMI_WINDOWS];
    struct shortened shortened[SHORTENED_MAX];
    int shortened_count;
    size_t packet_size;
    uint8_t packet[LUMI_PRIMING_FRAME_MAX];
    uint8_t compressed[LUMI_TILE_COMPRESSED_MAX], data[LUMI_TILE_DATA_MAX];
};

static void wrap(vpx_image_t *image, const struct lumi_tile_pixels *pixels)
{
    vpx_img_wrap(image, VPX_IMG_FMT_I420, LUMI_TILE, LUMI_TILE, 1, (unsigned char *)pixels->y);
    image->planes[1] = (unsigned char *)pixels->u;
    image->planes[2] = (unsigned char *)pixels->v;
}

/* One frame into encoder->packet. */
static int encode_frame(struct lumi_tile_encoder *encoder, const struct lumi_tile_pixels *pixels,
                        vpx_enc_frame_flags_t flags, struct lumi_error *error)
{
    vpx_image_t image;
    vpx_codec_iter_t iterator = NULL;
    const vpx_codec_cx_pkt_t *packet;

    wrap(&image, pixels);
    if (vpx_codec_encode(&encoder->vpx, &image, encoder->pts++, 1, flags, VPX_DL_GOOD_QUALITY) != VPX_CODEC_OK)
        return lumi_fail(error, LUMI_ERR_INTERNAL, "libvpx does not encode a tile: %s", vpx_codec_error(&encoder->vpx));
    encoder->packet_size = 0;
    while ((packet = vpx_codec_get_cx_data(&encoder->vpx, &iterator))) {
        if (packet->kind != VPX_CODEC_CX_FRAME_PKT)
            continue;
        if (encoder->packet_size > 0 || packet->data.frame.sz > sizeof encoder->packet)
            return lumi_fail(error, LUMI_ERR_INTERNAL, "libvpx makes an unexpected packet of a tile");
        memcpy(encoder->packet, packet->data.frame.buf, packet->data.frame.sz);
        encoder->packet_size = packet->data.frame.sz;
    }
    if (encoder->packet_size == 0)
        return lumi_fail(error, LUMI_ERR_INTERNAL, "libvpx makes no packet of a tile");
    return LUMI_OK;
}

static int set_windows(struct lumi_tile_encoder *encoder, struct lumi_error *error)
{
    static const vpx_ref_frame_type_t buffers[LUMI_WINDOWS] = {VP8_LAST_FRAME, VP8_GOLD_FRAME};

    for (int k = 0; k < LUMI_WINDOWS; k++) {
        vpx_ref_frame_t frame = {.frame_type = buffers[k]};
        wrap(&frame.img, &encoder->windows[k]);
        if (vpx_codec_control(&encoder->vpx, VP8_SET_REFERENCE, &frame) != VPX_CODEC_OK)
            return lumi_fail(error, LUMI_ERR_INTERNAL, "libvpx takes no reference window");
    }
    return LUMI_OK;
}

static int init_vpx(struct lumi_tile_encoder *encoder, const struct lumi_tile_encoder_settings *settings)
{
    vpx_codec_enc_cfg_t config;

    if (vpx_codec_enc_config_default(vpx_codec_vp9_cx(), &config, 0) != VPX_CODEC_OK)
        return LUMI_ERR_INTERNAL;
    config.g_w = config.g_h = LUMI_TILE;
    config.g_threads = 1;
    config.g_lag_in_frames = 0;
    config.g_pass = VPX_RC_ONE_PASS;
    config.g_error_resilient = settings->error_resilient ? VPX_ERROR_RESILIENT_DEFAULT : 0;
    config.g_timebase = (vpx_rational_t){1, 30};
    config.rc_end_usage = VPX_Q;
    config.rc_min_quantizer = config.rc_max_quantizer = (unsigned)settings->quantizer;
    config.kf_mode = VPX_KF_DISABLED;
    config.kf_max_dist = 1000000000; /* the default would insert key frames */
    if (vpx_codec_enc_init(&encoder->vpx, vpx_codec_vp9_cx(), &config, 0) != VPX_CODEC_OK)
        return LUMI_ERR_INTERNAL;
    encoder->live = true;
    if (vpx_codec_control(&encoder->vpx, VP8E_SET_CPUUSED, settings->speed) != VPX_CODEC_OK ||
        vpx_codec_control(&encoder->vpx, VP8E_SET_CQ_LEVEL, (unsigned)settings->quantizer) != VPX_CODEC_OK ||
        vpx_codec_control(&encoder->vpx, VP8E_SET_ENABLEAUTOALTREF, 0u) != VPX_CODEC_OK ||
        vpx_codec_control(&encoder->vpx, VP9E_SET_AQ_MODE, 0u) != VPX_CODEC_OK ||
        vpx_codec_control(&encoder->vpx, VP9E_SET_TILE_COLUMNS, 0) != VPX_CODEC_OK ||
        vpx_codec_control(&encoder->vpx, VP9E_SET_TPL, 0) != VPX_CODEC_OK ||
        vpx_codec_control(&encoder->vpx, VP9E_SET_FRAME_PARALLEL_DECODING, 0u) != VPX_CODEC_OK)
        return LUMI_ERR_INTERNAL;
    return LUMI_OK;
}

/* Encodes a frame that becomes part of the priming, and decodes it. */
static int prime_frame(struct lumi_tile_encoder *encoder, const struct lumi_tile_pixels *pixels,
                       vpx_enc_frame_flags_t flags, int reference, const struct lumi_shift *at,
                       struct lumi_error *error)
{
    LUMI_TRY(encode_frame(encoder, pixels, flags, error));
    if (lumi_priming_add(&encoder->priming, encoder->packet, encoder->packet_size, reference, at) != LUMI_OK)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for the priming of a tile encoder");
    if (lumi_tile_core_frame(encoder->core, reference >= 0 ? encoder->windows : NULL, encoder->packet,
                             encoder->packet_size, false, NULL) != LUMI_OK)
        return lumi_fail(error, LUMI_ERR_INTERNAL, "libvpx does not decode its own priming frame");
    return LUMI_OK;
}

/* A key frame, then one frame each for LAST, GOLDEN and ALTREF: until then the three share one buffer. */
static int prime(struct lumi_tile_encoder *encoder, struct lumi_error *error)
{
    static const vpx_enc_frame_flags_t others[3] = {VP8_EFLAG_NO_UPD_GF | VP8_EFLAG_NO_UPD_ARF,
                                                    VP8_EFLAG_NO_UPD_LAST | VP8_EFLAG_NO_UPD_ARF,
                                                    VP8_EFLAG_NO_UPD_LAST | VP8_EFLAG_NO_UPD_GF};

    LUMI_TRY(prime_frame(encoder, &encoder->grey, 0, -1, NULL, error));
    for (int i = 0; i < 3; i++)
        LUMI_TRY(prime_frame(encoder, &encoder->grey, others[i] | VP8_EFLAG_NO_UPD_ENTROPY, -1, NULL, error));
    return LUMI_OK;
}

static int train(struct lumi_tile_encoder *encoder, const struct lumi_training_tile *tile, struct lumi_error *error)
{
    const struct lumi_yuv *reference = &encoder->references[tile->reference];

    for (int k = 0; k < LUMI_WINDOWS; k++)
        lumi_window_copy(reference, tile->at[k].x, tile->at[k].y, &encoder->windows[k]);
    LUMI_TRY(set_windows(encoder, error));
    return prime_frame(encoder, &tile->source, NO_UPDATE | VP8_EFLAG_NO_REF_ARF, tile->reference, tile->at, error);
}

static int encode_blank(struct lumi_tile_encoder *encoder, struct lumi_error *error)
{
    return encode_frame(encoder, &encoder->grey, NO_UPDATE | NO_REFERENCE | VP8_EFLAG_NO_UPD_ENTROPY, error);
}

/* The blank frame that decoders get. The encoder's own may come to differ from it in bytes, but not in what matters:
 * it has no motion vectors and keeps nothing. */
static int find_blank(struct lumi_tile_encoder *encoder, struct lumi_error *error)
{
    struct lumi_priming *priming = &encoder->priming;

    LUMI_TRY(encode_blank(encoder, error));
    priming->blank = lumi_alloc(encoder->packet_size, 1);
    if (!priming->blank)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a tile encoder");
    memcpy(priming->blank, encoder->packet, encoder->packet_size);
    priming->blank_size = (uint32_t)encoder->packet_size;
    return LUMI_OK;
}

static int start(struct lumi_tile_encoder *encoder, const struct lumi_tile_encoder_settings *settings,
                 const struct lumi_training_tile *tiles, int count, struct lumi_error *error)
{
    struct lumi_tile_fields fields;
    size_t header, compressed;

    if (init_vpx(encoder, settings) != LUMI_OK)
        return lumi_fail(error, LUMI_ERR_INTERNAL, "libvpx gives no VP9 encoder");
    memset(&encoder->grey, 128, sizeof encoder->grey);
    LUMI_TRY(lumi_tile_core_create(&encoder->priming, encoder->references, &encoder->core, error));
    LUMI_TRY(prime(encoder, error));
    for (int i = 0; i < count && !settings->error_resilient; i++)
        LUMI_TRY(train(encoder, &tiles[i], error));
    if (vpx_codec_control(&encoder->vpx, VP9E_SET_FRAME_PARALLEL_DECODING, 1u) != VPX_CODEC_OK)
        return lumi_fail(error, LUMI_ERR_INTERNAL, "libvpx does not leave its contexts alone");
    if (!settings->error_resilient)
        LUMI_TRY(find_blank(encoder, error));

    /* What tile headers share, read off one. */
    memcpy(&encoder->windows[0], &encoder->grey, sizeof encoder->grey);
    memcpy(&encoder->windows[1], &encoder->grey, sizeof encoder->grey);
    LUMI_TRY(set_windows(encoder, error));
    LUMI_TRY(encode_frame(encoder, &encoder->grey, TILE_FLAGS, error));
    if (!lumi_tile_header_parse(encoder->packet, encoder->packet_size, &encoder->priming.frame, &fields, &header,
                                &compressed))
        return lumi_fail(error, LUMI_ERR_INTERNAL, "libvpx writes tile headers that cannot be rebuilt");
    return LUMI_OK;
}

int lumi_tile_encoder_create(const struct lumi_tile_encoder_settings *settings, const struct lumi_training_tile *tiles,
                             int count, const struct lumi_yuv *references, struct lumi_tile_encoder **encoder,
                             struct lumi_error *error)
{
    *encoder = lumi_calloc(1, sizeof **encoder);
    if (!*encoder)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a tile encoder");
    (*encoder)->references = references;

    int code = start(*encoder, settings, tiles, count, error);
    if (code != LUMI_OK) {
        lumi_tile_encoder_destroy(*encoder);
        *encoder = NULL;
    }
    return code;
}

void lumi_tile_encoder_destroy(struct lumi_tile_encoder *encoder)
{
    if (!encoder)
        return;
    lumi_tile_core_destroy(encoder->core);
    if (encoder->live)
        vpx_codec_destroy(&encoder->vpx);
    lumi_priming_finish(&encoder->priming);
    lumi_free(encoder);
}

const struct lumi_priming *lumi_tile_encoder_priming(const struct lumi_tile_encoder *encoder)
{
    return &encoder->priming;
}

/* A tile under test: where it is, and what it must decode to. */
struct trial {
    struct lumi_tile_encoder *encoder;
    const struct lumi_yuv *reference;
    int x, y;
    uint64_t hash;
};

static bool decodes(const struct trial *trial, const struct lumi_tile_code *code)
{
    struct lumi_tile_pixels pixels;

    return lumi_tile_core_decode(trial->encoder->core, trial->reference, trial->x, trial->y, code, &pixels) ==
               LUMI_OK &&
           lumi_tile_hash(&pixels) == trial->hash;
}

static size_t without_zeros(const uint8_t *data, size_t size)
{
    while (size > 0 && data[size - 1] == 0)
        size--;
    return size;
}

/* Drops as many bytes as can be spared: the coder's value may be any in an interval, of which the bytes that are left,
 * as they are or with the last one raised, may still name one. Where one more byte cannot be spared no more can. Every
 * attempt is decoded. `bytes` is what *size counts. */
static void cut(const struct trial *trial, const struct lumi_tile_code *code, uint8_t *bytes, uint16_t *size,
                uint16_t least)
{
    const uint16_t full = *size;

    for (int drop = 1; drop <= DROP_MAX && full >= least + drop && full > drop; drop++) {
        uint8_t *last = &bytes[full - drop - 1], saved = *last;
        bool good = false;
        *size = (uint16_t)(full - drop);
        for (int raise = 0; raise < 2 && saved + raise < 256 && !good; raise++) {
            *last = (uint8_t)(saved + raise);
            good = decodes(trial, code);
        }
        if (!good) {
            *last = saved;
            ++*size;
            return;
        }
    }
}

static void cut_compressed(const struct trial *trial, struct lumi_tile_code *code)
{
    struct lumi_tile_encoder *encoder = trial->encoder;
    const uint16_t full_size = code->compressed_size;
    uint8_t full[LUMI_TILE_COMPRESSED_MAX];

    memcpy(full, encoder->compressed, full_size);
    for (int i = 0; i < encoder->shortened_count; i++) {
        const struct shortened *known = &encoder->shortened[i];
        if (known->full_size != full_size || memcmp(known->full, full, full_size) != 0)
            continue;
        memcpy(encoder->compressed, known->cut, known->cut_size);
        code->compressed_size = (uint16_t)known->cut_size;
        if (!decodes(trial, code)) {
            memcpy(encoder->compressed, full, full_size);
            code->compressed_size = full_size;
        }
        return;
    }
    code->compressed_size = (uint16_t)without_zeros(encoder->compressed, full_size);
    if (code->compressed_size < 1)
        code->compressed_size = 1;
    cut(trial, code, encoder->compressed, &code->compressed_size, 1);
    if (encoder->shortened_count < SHORTENED_MAX) {
        struct shortened *known = &encoder->shortened[encoder->shortened_count++];
        memcpy(known->full, full, full_size);
        memcpy(known->cut, encoder->compressed, code->compressed_size);
        known->full_size = full_size;
        known->cut_size = code->compressed_size;
    }
}

/* Encodes into encoder->packet what a tile decoder will see after the blank frame. */
static int encode_packet(struct lumi_tile_encoder *encoder, const struct lumi_tile_pixels *source,
                         struct lumi_error *error)
{
    const struct lumi_priming *priming = &encoder->priming;

    if (priming->blank)
        LUMI_TRY(encode_blank(encoder, error));
    LUMI_TRY(set_windows(encoder, error));
    return encode_frame(encoder, source, TILE_FLAGS, error);
}

/* Whether a decoder, which has the priming's header fields, will see the very header that libvpx wrote. */
static bool header_rebuilt(const struct lumi_tile_encoder *encoder, const struct lumi_tile_frame *written,
                           const struct lumi_tile_fields *fields, size_t size, size_t compressed)
{
    struct lumi_tile_frame frame = encoder->priming.frame;
    uint8_t header[LUMI_TILE_HEADER_MAX];

    frame.quantizer = written->quantizer;
    return lumi_tile_header_build(&frame, fields, compressed, header) == size &&
           memcmp(header, encoder->packet, size) == 0;
}

int lumi_tile_encode(struct lumi_tile_encoder *encoder, const struct lumi_yuv *reference, int x, int y,
                     const struct lumi_shift shift[LUMI_WINDOWS], const struct lumi_tile_pixels *source,
                     struct lumi_tile_code *code, struct lumi_tile_pixels *decoded, struct lumi_error *error)
{
    struct trial trial = {encoder, reference, x, y, 0};
    struct lumi_tile_frame frame;
    struct lumi_tile_pixels truth;
    size_t header, compressed;

    *code = (struct lumi_tile_code){.compressed = encoder->compressed, .data = encoder->data};
    for (int k = 0; k < LUMI_WINDOWS; k++) {
        code->shift[k] = shift[k];
        lumi_window_copy(reference, x + shift[k].x, y + shift[k].y, &encoder->windows[k]);
    }
    LUMI_TRY(encode_packet(encoder, source, error));
    const uint8_t *packet = encoder->packet;
    if (!lumi_tile_header_parse(packet, encoder->packet_size, &frame, &code->fields, &header, &compressed))
        return lumi_fail(error, LUMI_ERR_INTERNAL, "libvpx writes a tile header that cannot be rebuilt");
    size_t size = encoder->packet_size - header - compressed;
    if (compressed > LUMI_TILE_COMPRESSED_MAX || size > LUMI_TILE_DATA_MAX)
        return lumi_fail(error, LUMI_ERR_LIMIT, "a tile of %zu bytes is too large", size);

    memcpy(encoder->compressed, packet + header, compressed);
    memcpy(encoder->data, packet + header + compressed, size);
    code->quantizer = frame.quantizer;
    code->compressed_size = (uint16_t)compressed;
    code->size = (uint16_t)without_zeros(encoder->data, size);
    bool same = header_rebuilt(encoder, &frame, &code->fields, header, compressed);
    int result =
        same ? lumi_tile_core_decode(encoder->core, reference, x, y, code, &truth)
             : lumi_tile_core_frame(encoder->core, encoder->windows, packet, encoder->packet_size, true, &truth);
    if (result != LUMI_OK)
        return lumi_fail(error, LUMI_ERR_INTERNAL, "libvpx does not decode its own tile");
    trial.hash = lumi_tile_hash(&truth);
    code->check = (uint16_t)trial.hash;
    if (!same && !decodes(&trial, code))
        return lumi_fail(error, LUMI_ERR_INTERNAL, "a tile decodes differently under its rebuilt header");
    cut(&trial, code, encoder->data, &code->size, 0);
    code->size = (uint16_t)without_zeros(encoder->data, code->size);
    cut_compressed(&trial, code);
    if (decoded)
        *decoded = truth;
    return LUMI_OK;
}
