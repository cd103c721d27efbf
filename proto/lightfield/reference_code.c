/* Reference images. */
#include "proto/lightfield/reference_code.h"

#include "proto/base/memory.h"
#include "proto/lightfield/vp9_header.h"

#include <string.h>
#include <vpx/vp8cx.h>
#include <vpx/vp8dx.h>
#include <vpx/vpx_decoder.h>
#include <vpx/vpx_encoder.h>

static int init_encoder(vpx_codec_ctx_t *vpx, int width, int height, int quantizer, int speed)
{
    vpx_codec_enc_cfg_t config;

    if (vpx_codec_enc_config_default(vpx_codec_vp9_cx(), &config, 0) != VPX_CODEC_OK)
        return LUMI_ERR_INTERNAL;
    config.g_w = (unsigned)width;
    config.g_h = (unsigned)height;
    config.g_threads = 1;
    config.g_lag_in_frames = 0;
    config.g_pass = VPX_RC_ONE_PASS;
    config.g_timebase = (vpx_rational_t){1, 30};
    config.rc_end_usage = VPX_Q;
    config.rc_min_quantizer = config.rc_max_quantizer = (unsigned)quantizer;
    config.kf_mode = VPX_KF_DISABLED;
    config.kf_max_dist = 1000000000;
    if (vpx_codec_enc_init(vpx, vpx_codec_vp9_cx(), &config, 0) != VPX_CODEC_OK)
        return LUMI_ERR_INTERNAL;
    if (vpx_codec_control(vpx, VP8E_SET_CPUUSED, speed) != VPX_CODEC_OK ||
        vpx_codec_control(vpx, VP8E_SET_CQ_LEVEL, (unsigned)quantizer) != VPX_CODEC_OK ||
        vpx_codec_control(vpx, VP8E_SET_ENABLEAUTOALTREF, 0u) != VPX_CODEC_OK ||
        vpx_codec_control(vpx, VP9E_SET_AQ_MODE, 0u) != VPX_CODEC_OK ||
        vpx_codec_control(vpx, VP9E_SET_TPL, 0) != VPX_CODEC_OK) {
        vpx_codec_destroy(vpx);
        return LUMI_ERR_INTERNAL;
    }
    return LUMI_OK;
}

static int encode_image(vpx_codec_ctx_t *vpx, const struct lumi_yuv *image, int index, uint32_t *size,
                        struct lumi_writer *writer)
{
    vpx_codec_iter_t iterator = NULL;
    const vpx_codec_cx_pkt_t *packet;
    vpx_image_t wrapped;

    vpx_img_wrap(&wrapped, VPX_IMG_FMT_I420, (unsigned)image->width, (unsigned)image->height, 1, image->plane[0]);
    for (int p = 0; p < 3; p++) {
        wrapped.planes[p] = image->plane[p];
        wrapped.stride[p] = lumi_yuv_width(image, p);
    }
    if (vpx_codec_encode(vpx, &wrapped, index, 1, index == 0 ? VPX_EFLAG_FORCE_KF : 0, VPX_DL_GOOD_QUALITY) !=
        VPX_CODEC_OK)
        return LUMI_ERR_INTERNAL;
    *size = 0;
    while ((packet = vpx_codec_get_cx_data(vpx, &iterator)))
        if (packet->kind == VPX_CODEC_CX_FRAME_PKT) {
            bool key;
            if (*size > 0 || packet->data.frame.sz > UINT32_MAX ||
                !lumi_vp9_frame_plain(packet->data.frame.buf, packet->data.frame.sz, image->width, image->height, &key))
                return LUMI_ERR_INTERNAL;
            *size = (uint32_t)packet->data.frame.sz;
            lumi_write_bytes(writer, packet->data.frame.buf, packet->data.frame.sz);
        }
    return *size > 0 ? LUMI_OK : LUMI_ERR_INTERNAL;
}

int lumi_references_encode(const struct lumi_yuv *images, int count, int quantizer, int speed, uint32_t *sizes,
                           struct lumi_writer *writer, struct lumi_error *error)
{
    vpx_codec_ctx_t vpx;

    if (init_encoder(&vpx, images[0].width, images[0].height, quantizer, speed) != LUMI_OK)
        return lumi_fail(error, LUMI_ERR_INTERNAL, "libvpx gives no VP9 encoder for reference images");
    int code = LUMI_OK;
    for (int i = 0; i < count && code == LUMI_OK; i++)
        code = encode_image(&vpx, &images[i], i, &sizes[i], writer);
    vpx_codec_destroy(&vpx);
    if (code != LUMI_OK)
        return lumi_fail(error, code, "libvpx does not encode a reference image");
    return writer->failed ? lumi_fail(error, LUMI_ERR_NOMEM, "no memory for reference images") : LUMI_OK;
}

/* One frame in a superframe index, so that libvpx decodes exactly one. */
static int decode_frame(vpx_codec_ctx_t *vpx, const uint8_t *data, uint32_t size)
{
    enum { INDEX = 6 };
    uint8_t *packet = lumi_alloc((size_t)size + INDEX, 1);

    if (!packet)
        return LUMI_ERR_NOMEM;
    memcpy(packet, data, size);
    packet[size] = packet[size + 5] = 0xc0 | 3 << 3;
    for (int k = 0; k < 4; k++)
        packet[size + 1 + (uint32_t)k] = (uint8_t)(size >> (8 * k));
    vpx_codec_err_t result = vpx_codec_decode(vpx, packet, size + INDEX, NULL, 0);
    lumi_free(packet);
    return result == VPX_CODEC_OK ? LUMI_OK : result == VPX_CODEC_MEM_ERROR ? LUMI_ERR_NOMEM : LUMI_ERR_FORMAT;
}

static int take_image(vpx_codec_ctx_t *vpx, int width, int height, struct lumi_yuv *image)
{
    vpx_codec_iter_t iterator = NULL;
    const vpx_image_t *decoded = vpx_codec_get_frame(vpx, &iterator);
    int corrupted = 0;

    if (!decoded || decoded->fmt != VPX_IMG_FMT_I420 || (int)decoded->d_w != width || (int)decoded->d_h != height ||
        vpx_codec_control(vpx, VP8D_GET_FRAME_CORRUPTED, &corrupted) != VPX_CODEC_OK || corrupted)
        return LUMI_ERR_FORMAT;
    LUMI_TRY(lumi_yuv_create(image, width, height));
    for (int p = 0; p < 3; p++) {
        size_t bytes = (size_t)lumi_yuv_width(image, p);
        for (int y = 0; y < lumi_yuv_height(image, p); y++)
            memcpy(image->plane[p] + (size_t)y * bytes, decoded->planes[p] + (ptrdiff_t)y * decoded->stride[p], bytes);
    }
    return LUMI_OK;
}

int lumi_references_decode(const uint8_t *data, const uint32_t *sizes, int count, int width, int height,
                           struct lumi_yuv *images)
{
    const vpx_codec_dec_cfg_t config = {.threads = 1};
    vpx_codec_ctx_t vpx;

    memset(images, 0, (size_t)count * sizeof *images);
    if (vpx_codec_dec_init(&vpx, vpx_codec_vp9_dx(), &config, 0) != VPX_CODEC_OK)
        return LUMI_ERR_NOMEM;
    int code = LUMI_OK;
    for (int i = 0; i < count && code == LUMI_OK; data += sizes[i], i++) {
        bool key;
        if (!lumi_vp9_frame_plain(data, sizes[i], width, height, &key) || key != (i == 0))
            code = LUMI_ERR_FORMAT;
        else
            code = decode_frame(&vpx, data, sizes[i]);
        if (code == LUMI_OK)
            code = take_image(&vpx, width, height, &images[i]);
    }
    vpx_codec_destroy(&vpx);
    return code;
}
