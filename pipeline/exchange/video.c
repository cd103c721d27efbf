/* WebM files. */
#include "pipeline/exchange/video.h"

#include "proto/base/file.h"
#include "proto/base/memory.h"
#include "proto/lightfield/yuv.h"

#include <glib.h>
#include <libavformat/avformat.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <vpx/vp8cx.h>
#include <vpx/vpx_encoder.h>

#define SIDE_MIN 2
#define SIDE_MAX 16384

struct lumi_video {
    char *path;
    struct lumi_new_file file; /* fd −1: not open */
    int width, height;
    long frames;
    AVRational base; /* of the encoder's clock: one picture */
    vpx_codec_ctx_t codec;
    bool codec_ready;
    AVFormatContext *format;
    AVStream *stream;
    AVPacket *packet;
};

static int fail_av(struct lumi_error *error, const struct lumi_video *video, const char *doing, int code)
{
    char text[AV_ERROR_MAX_STRING_SIZE];

    if (code == AVERROR(ENOSPC))
        return lumi_fail(error, LUMI_ERR_NOSPACE, "%s: %s: no space left", video->path, doing);
    av_strerror(code, text, sizeof text);
    return lumi_fail(error, LUMI_ERR_IO, "%s: %s: %s", video->path, doing, text);
}

static int fail_vpx(struct lumi_error *error, struct lumi_video *video, const char *doing)
{
    const char *detail = vpx_codec_error_detail(&video->codec);

    return lumi_fail(error, LUMI_ERR_INTERNAL, "%s: %s: libvpx: %s", video->path, doing,
                     detail ? detail : vpx_codec_error(&video->codec));
}

static int open_codec(struct lumi_video *video, int quality, struct lumi_error *error)
{
    vpx_codec_enc_cfg_t config;

    if (vpx_codec_enc_config_default(vpx_codec_vp9_cx(), &config, 0))
        return lumi_fail(error, LUMI_ERR_INTERNAL, "%s: libvpx has no VP9 encoder", video->path);
    config.g_w = (unsigned)video->width;
    config.g_h = (unsigned)video->height;
    config.g_timebase.num = video->base.num;
    config.g_timebase.den = video->base.den;
    config.g_threads = 1; /* tiles in threads would not change the bytes, but one core is enough here */
    config.rc_end_usage = VPX_Q;
    config.g_lag_in_frames = 16;
    config.kf_max_dist = 128;
    if (vpx_codec_enc_init(&video->codec, vpx_codec_vp9_cx(), &config, 0))
        return fail_vpx(error, video, "starting the encoder");
    video->codec_ready = true;
    if (vpx_codec_control(&video->codec, VP8E_SET_CQ_LEVEL, (unsigned)quality) ||
        vpx_codec_control(&video->codec, VP8E_SET_CPUUSED, 4) ||
        vpx_codec_control(&video->codec, VP9E_SET_COLOR_SPACE, VPX_CS_BT_709) ||
        vpx_codec_control(&video->codec, VP9E_SET_COLOR_RANGE, VPX_CR_FULL_RANGE))
        return fail_vpx(error, video, "setting the encoder");
    return LUMI_OK;
}

static int open_file(struct lumi_video *video, struct lumi_error *error)
{
    int code = avformat_alloc_output_context2(&video->format, NULL, "webm", NULL);

    if (code < 0)
        return fail_av(error, video, "libavformat has no WebM", code);
    video->format->flags |= AVFMT_FLAG_BITEXACT; /* no dates, no random numbers */
    video->stream = avformat_new_stream(video->format, NULL);
    video->packet = av_packet_alloc();
    if (!video->stream || !video->packet)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: no memory for a video", video->path);
    AVCodecParameters *p = video->stream->codecpar;
    p->codec_type = AVMEDIA_TYPE_VIDEO;
    p->codec_id = AV_CODEC_ID_VP9;
    p->width = video->width;
    p->height = video->height;
    p->format = AV_PIX_FMT_YUV420P;
    p->color_space = AVCOL_SPC_BT709;
    p->color_range = AVCOL_RANGE_JPEG;
    p->color_primaries = AVCOL_PRI_BT709;
    p->color_trc = AVCOL_TRC_IEC61966_2_1;
    video->stream->time_base = video->base;
    video->stream->avg_frame_rate = av_inv_q(video->base);
    LUMI_TRY(lumi_new_file_open(&video->file, video->path, error));
    code = avio_open(&video->format->pb, video->file.temporary, AVIO_FLAG_WRITE);
    if (code < 0)
        return fail_av(error, video, "cannot be written", code);
    code = avformat_write_header(video->format, NULL);
    if (code < 0)
        return fail_av(error, video, "writing the header", code);
    return LUMI_OK;
}

int lumi_video_create(const char *path, int width, int height, int frames_per_second, int quality,
                      struct lumi_video **result, struct lumi_error *error)
{
    if (width < SIDE_MIN || height < SIDE_MIN || width > SIDE_MAX || height > SIDE_MAX)
        return lumi_fail(error, LUMI_ERR_ARG, "%s: pictures of %d×%d; a film's have %d to %d pixels a side", path,
                         width, height, SIDE_MIN, SIDE_MAX);
    if (frames_per_second < 1 || frames_per_second > 1000 || quality < 0 || quality > 63)
        return lumi_fail(error, LUMI_ERR_ARG, "%s: %d pictures a second (1 to 1000), quality %d (0 to 63)", path,
                         frames_per_second, quality);
    struct lumi_video *video = lumi_calloc(1, sizeof *video);
    if (!video)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: no memory for a video", path);
    av_log_set_level(AV_LOG_QUIET);
    video->path = g_strdup(path);
    video->file.fd = -1;
    video->width = width;
    video->height = height;
    video->base = (AVRational){1, frames_per_second};
    int code = open_codec(video, quality, error);
    if (code == LUMI_OK)
        code = open_file(video, error);
    if (code != LUMI_OK) {
        lumi_video_abandon(video);
        return code;
    }
    *result = video;
    return LUMI_OK;
}

/* Whatever the encoder has ready. *got: whether it had anything. */
static int write_packets(struct lumi_video *video, bool *got, struct lumi_error *error)
{
    vpx_codec_iter_t at = NULL;
    const vpx_codec_cx_pkt_t *coded;

    *got = false;
    while ((coded = vpx_codec_get_cx_data(&video->codec, &at))) {
        if (coded->kind != VPX_CODEC_CX_FRAME_PKT)
            continue;
        *got = true;
        av_packet_unref(video->packet);
        int code = av_new_packet(video->packet, (int)coded->data.frame.sz);
        if (code < 0)
            return fail_av(error, video, "coding", code);
        memcpy(video->packet->data, coded->data.frame.buf, coded->data.frame.sz);
        video->packet->pts = video->packet->dts = coded->data.frame.pts;
        video->packet->duration = 1;
        video->packet->flags = coded->data.frame.flags & VPX_FRAME_IS_KEY ? AV_PKT_FLAG_KEY : 0;
        video->packet->stream_index = video->stream->index;
        av_packet_rescale_ts(video->packet, video->base, video->stream->time_base);
        code = av_interleaved_write_frame(video->format, video->packet);
        if (code < 0)
            return fail_av(error, video, "writing", code);
    }
    return LUMI_OK;
}

int lumi_video_add(struct lumi_video *video, const struct lumi_raster *picture, struct lumi_error *error)
{
    struct lumi_yuv yuv = {0};
    vpx_image_t image;
    bool got;

    if (picture->width != video->width || picture->height != video->height || picture->channels < 3)
        return lumi_fail(error, LUMI_ERR_ARG, "%s: a picture of %d×%d in a video of %d×%d", video->path, picture->width,
                         picture->height, video->width, video->height);
    if (lumi_yuv_from_raster(picture, &yuv) != LUMI_OK)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: no memory for a picture", video->path);
    vpx_img_wrap(&image, VPX_IMG_FMT_I420, (unsigned)video->width, (unsigned)video->height, 1, yuv.plane[0]);
    for (int plane = 0; plane < 3; plane++) {
        image.planes[plane] = yuv.plane[plane];
        image.stride[plane] = lumi_yuv_width(&yuv, plane);
    }
    image.cs = VPX_CS_BT_709;
    image.range = VPX_CR_FULL_RANGE;
    int code = LUMI_OK;
    if (vpx_codec_encode(&video->codec, &image, video->frames++, 1, 0, VPX_DL_GOOD_QUALITY))
        code = fail_vpx(error, video, "coding");
    lumi_yuv_finish(&yuv);
    return code == LUMI_OK ? write_packets(video, &got, error) : code;
}

static int finish_file(struct lumi_video *video, struct lumi_error *error)
{
    bool got = true;

    while (got) {
        if (vpx_codec_encode(&video->codec, NULL, -1, 1, 0, VPX_DL_GOOD_QUALITY))
            return fail_vpx(error, video, "coding");
        LUMI_TRY(write_packets(video, &got, error));
    }
    int code = av_write_trailer(video->format);
    if (code < 0)
        return fail_av(error, video, "writing the end", code);
    code = avio_closep(&video->format->pb);
    return code < 0 ? fail_av(error, video, "writing the end", code)
                    : lumi_new_file_close(&video->file, LUMI_OK, true, error);
}

int lumi_video_finish(struct lumi_video *video, struct lumi_error *error)
{
    int code = finish_file(video, error);

    lumi_video_abandon(video);
    return code;
}

void lumi_video_abandon(struct lumi_video *video)
{
    if (!video)
        return;
    if (video->format && video->format->pb)
        avio_closep(&video->format->pb);
    if (video->file.fd >= 0)
        lumi_new_file_close(&video->file, LUMI_ERR_CANCELLED, false, NULL);
    av_packet_free(&video->packet);
    avformat_free_context(video->format);
    if (video->codec_ready)
        vpx_codec_destroy(&video->codec);
    g_free(video->path);
    lumi_free(video);
}
