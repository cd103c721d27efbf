/* Videos through libavformat and libavcodec. */
#include "pipeline/exchange/film_priv.h"

#include "proto/base/memory.h"
#include "proto/image/image.h"

#include <errno.h>
#include <glib.h>
#include <libavutil/display.h>
#include <libavutil/pixdesc.h>
#include <math.h>
#include <string.h>

#define IO_BLOCK 65536
#define DAMAGE_MAX 512
#define LOST_TIME 1.5 /* s that a head may say more than there is */
/* What cameras write. Lists of other files (concat, HLS, …) are not among them. */
#define CONTAINERS "mov,mp4,m4a,3gp,3g2,mj2,matroska,webm,avi,mpegts,mpeg,mxf,ogg,flv,asf"

/* Bytes */

static int read_bytes(void *opaque, uint8_t *buffer, int size)
{
    struct lumi_film *film = opaque;
    int64_t rest = film->size - film->at;
    int count = (int)(rest < size ? rest : size);

    if (count <= 0)
        return AVERROR_EOF;
    if (film->file) {
        size_t got = fread(buffer, 1, (size_t)count, film->file);
        if (got == 0)
            return ferror(film->file) ? AVERROR(EIO) : AVERROR_EOF;
        count = (int)got;
    } else {
        memcpy(buffer, film->data + film->at, (size_t)count);
    }
    film->at += count;
    return count;
}

static int64_t seek_bytes(void *opaque, int64_t offset, int whence)
{
    struct lumi_film *film = opaque;

    if (whence == AVSEEK_SIZE)
        return film->size;
    int64_t from = whence == SEEK_CUR ? film->at : whence == SEEK_END ? film->size : 0;
    if (offset < -from || offset > film->size - from)
        return AVERROR(EINVAL);
    if (film->file && fseeko(film->file, (off_t)(from + offset), SEEK_SET) != 0)
        return AVERROR(EIO);
    film->at = from + offset;
    return film->at;
}

/* Invariant 2. */
static int open_nothing(AVFormatContext *format, AVIOContext **io, const char *url, int flags, AVDictionary **options)
{
    (void)format;
    (void)io;
    (void)url;
    (void)flags;
    (void)options;
    return AVERROR(EPERM);
}

/* Opening */

int film_fail(const struct lumi_film *film, struct lumi_error *error, const char *doing, int code)
{
    char text[AV_ERROR_MAX_STRING_SIZE] = "";

    av_strerror(code, text, sizeof text);
    if (code == AVERROR(ENOMEM))
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: %s: out of memory", film->name, doing);
    if (code == AVERROR(EIO))
        return lumi_fail(error, LUMI_ERR_IO, "%s: %s: %s", film->name, doing, text);
    return lumi_fail(error, LUMI_ERR_FORMAT, "%s: %s (%s)", film->name, doing, text);
}

double film_time(const struct lumi_film *film, int stream, int64_t stamp)
{
    const AVStream *of = film->format->streams[stream], *video = film->format->streams[film->stream];
    double begin = video->start_time != AV_NOPTS_VALUE ? (double)video->start_time * av_q2d(video->time_base) : 0;
    double time = stamp != AV_NOPTS_VALUE ? (double)stamp * av_q2d(of->time_base) - begin : NAN;

    return fabs(time) < 1e7 ? time : NAN; /* no film lasts a third of a year */
}

int film_open_codec(struct lumi_film *film, int stream, AVCodecContext **codec, struct lumi_error *error)
{
    const AVCodecParameters *parameters = film->format->streams[stream]->codecpar;
    const AVCodec *decoder = avcodec_find_decoder(parameters->codec_id);

    if (!decoder)
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "%s: there is no decoder for its codec '%s'", film->name,
                         avcodec_get_name(parameters->codec_id));
    *codec = avcodec_alloc_context3(decoder);
    if (!*codec)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: out of memory", film->name);
    int code = avcodec_parameters_to_context(*codec, parameters);
    (*codec)->thread_count = 1;
    (*codec)->pkt_timebase = film->format->streams[stream]->time_base;
    int64_t most = MIN(film->size, (int64_t)LUMI_IMAGE_MAX_PIXELS / LUMI_IMAGE_MAX_RATIO) * LUMI_IMAGE_MAX_RATIO;
    (*codec)->max_pixels = most;
    /* Where every picture stands alone, a damaged one is better missing than made up; where pictures rest on others,
     * the decoder goes on as it can and marks them. */
    const AVCodecDescriptor *about = avcodec_descriptor_get(parameters->codec_id);
    if (about && about->props & AV_CODEC_PROP_INTRA_ONLY)
        (*codec)->err_recognition |= AV_EF_EXPLODE;
    if (code >= 0)
        code = avcodec_open2(*codec, decoder, NULL);
    return code < 0 ? film_fail(film, error, "its decoder cannot be opened", code) : LUMI_OK;
}

static int open_format(struct lumi_film *film, struct lumi_error *error)
{
    AVDictionary *options = NULL;
    uint8_t *buffer = av_malloc(IO_BLOCK);

    film->io = buffer ? avio_alloc_context(buffer, IO_BLOCK, 0, film, read_bytes, NULL, seek_bytes) : NULL;
    film->format = avformat_alloc_context();
    if (!film->io || !film->format) {
        if (!film->io)
            av_free(buffer);
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: out of memory", film->name);
    }
    film->format->pb = film->io;
    film->format->flags |= AVFMT_FLAG_CUSTOM_IO;
    film->format->io_open = open_nothing;
    av_dict_set(&options, "format_whitelist", CONTAINERS, 0);
    av_dict_set(&options, "max_streams", "64", 0);
    int code = avformat_open_input(&film->format, NULL, NULL, &options);
    av_dict_free(&options);
    if (code >= 0)
        code = avformat_find_stream_info(film->format, NULL);
    return code < 0 ? film_fail(film, error, "no video that can be read", code) : LUMI_OK;
}

static const uint8_t *display_matrix(const AVStream *stream)
{
#if LIBAVCODEC_VERSION_MAJOR >= 61
    const AVPacketSideData *data = av_packet_side_data_get(
        stream->codecpar->coded_side_data, stream->codecpar->nb_coded_side_data, AV_PKT_DATA_DISPLAYMATRIX);
    return data && data->size >= 9 * sizeof(int32_t) ? data->data : NULL;
#else
    size_t size = 0;
    const uint8_t *data = av_stream_get_side_data(stream, AV_PKT_DATA_DISPLAYMATRIX, &size);
    return size >= 9 * sizeof(int32_t) ? data : NULL;
#endif
}

static void take_info(struct lumi_film *film)
{
    const AVStream *stream = film->format->streams[film->stream];
    const AVCodecParameters *parameters = stream->codecpar;
    const uint8_t *matrix = display_matrix(stream);
    double duration = stream->duration != AV_NOPTS_VALUE ? (double)stream->duration * av_q2d(stream->time_base)
                      : film->format->duration > 0       ? (double)film->format->duration / AV_TIME_BASE
                                                         : 0;
    double turned = matrix ? -av_display_rotation_get((const int32_t *)(const void *)matrix) : 0;

    film->info.width = parameters->width;
    film->info.height = parameters->height;
    film->info.duration = duration > 0 && duration < 1e7 ? duration : 0;
    film->info.rotation = isfinite(turned) ? ((int)lround(turned) % 360 + 360) % 360 : 0;
    film->info.sound = film->sound >= 0;
    film->info.linearised = parameters->color_trc == AVCOL_TRC_SMPTE2084 ||
                            parameters->color_trc == AVCOL_TRC_ARIB_STD_B67 || parameters->color_trc == AVCOL_TRC_LOG ||
                            parameters->color_trc == AVCOL_TRC_LOG_SQRT;
    g_strlcpy(film->info.codec, avcodec_get_name(parameters->codec_id), sizeof film->info.codec);
}

static int open_all(struct lumi_film *film, struct lumi_error *error)
{
    av_log_set_level(AV_LOG_QUIET);
    LUMI_TRY(open_format(film, error));
    film->stream = av_find_best_stream(film->format, AVMEDIA_TYPE_VIDEO, -1, -1, NULL, 0);
    if (film->stream < 0)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: there is no video in it", film->name);
    film->sound = av_find_best_stream(film->format, AVMEDIA_TYPE_AUDIO, -1, film->stream, NULL, 0);
    take_info(film);
    if (film->info.width < 2 || film->info.height < 2 || film->info.width > LUMI_RASTER_MAX ||
        film->info.height > LUMI_RASTER_MAX)
        return lumi_fail(error, LUMI_ERR_LIMIT, "%s: pictures of %d×%d pixels", film->name, film->info.width,
                         film->info.height);
    for (unsigned i = 0; i < film->format->nb_streams; i++)
        if ((int)i != film->stream && (int)i != film->sound)
            film->format->streams[i]->discard = AVDISCARD_ALL;
    film->packet = av_packet_alloc();
    film->frame = av_frame_alloc();
    if (!film->packet || !film->frame)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: out of memory", film->name);
    return film_open_codec(film, film->stream, &film->codec, error);
}

static struct lumi_film *create(const char *name)
{
    struct lumi_film *film = g_new0(struct lumi_film, 1);

    film->name = g_strdup(name);
    film->stream = film->sound = -1;
    film->last = NAN;
    film->step = 1.0 / 30;
    return film;
}

static int finish_open(struct lumi_film *film, int code, struct lumi_film **result, struct lumi_error *error)
{
    if (code == LUMI_OK)
        code = open_all(film, error);
    if (code != LUMI_OK) {
        lumi_film_close(film);
        film = NULL;
    }
    *result = film;
    return code;
}

int lumi_film_open(const char *path, struct lumi_film **result, struct lumi_error *error)
{
    struct lumi_film *film = create(path);
    int code = LUMI_OK;

    film->file = fopen(path, "rb");
    if (!film->file || fseeko(film->file, 0, SEEK_END) != 0 || (film->size = (int64_t)ftello(film->file)) < 0 ||
        fseeko(film->file, 0, SEEK_SET) != 0)
        code = lumi_fail_errno(error, path, "reading");
    return finish_open(film, code, result, error);
}

int lumi_film_open_memory(const void *data, size_t size, const char *name, struct lumi_film **result,
                          struct lumi_error *error)
{
    struct lumi_film *film = create(name);

    film->data = data;
    film->size = (int64_t)size;
    return finish_open(film, LUMI_OK, result, error);
}

void lumi_film_close(struct lumi_film *film)
{
    if (!film)
        return;
    sws_freeContext(film->to_small);
    sws_freeContext(film->to_rgb);
    av_frame_free(&film->frame);
    av_packet_free(&film->packet);
    avcodec_free_context(&film->codec);
    avformat_close_input(&film->format);
    if (film->io)
        av_freep(&film->io->buffer);
    avio_context_free(&film->io);
    if (film->file)
        fclose(film->file);
    g_free(film->damage);
    g_free(film->name);
    g_free(film);
}

const struct lumi_film_info *lumi_film_info(const struct lumi_film *film)
{
    return &film->info;
}

const char *lumi_film_damage(const struct lumi_film *film)
{
    return film->damage;
}

/* Pictures */

static void G_GNUC_PRINTF(2, 3) note_damage(struct lumi_film *film, const char *format, ...)
{
    va_list arguments;

    if (film->damage)
        return; /* the first tells most */
    va_start(arguments, format);
    film->damage = g_strdup_vprintf(format, arguments);
    va_end(arguments);
}

/* The next packet of the video to the decoder; at the end the word that there are no more. */
static void feed(struct lumi_film *film)
{
    int code;

    while ((code = av_read_frame(film->format, film->packet)) >= 0 && film->packet->stream_index != film->stream)
        av_packet_unref(film->packet);
    if (code < 0) {
        film->draining = true;
        avcodec_send_packet(film->codec, NULL);
        if (code != AVERROR_EOF)
            note_damage(film, "breaks off after %.2f s", isnan(film->last) ? 0 : film->last);
        return;
    }
    if (avcodec_send_packet(film->codec, film->packet) < 0)
        note_damage(film, "a picture that cannot be decoded behind %.2f s", isnan(film->last) ? 0 : film->last);
    av_packet_unref(film->packet);
}

static void note_end(struct lumi_film *film)
{
    film->ended = true;
    if (film->info.duration > 0 && !(film->last > film->info.duration - LOST_TIME - film->step))
        note_damage(film, "ends after %.2f s, its head says %.2f s", isnan(film->last) ? 0 : film->last,
                    film->info.duration);
}

int lumi_film_next(struct lumi_film *film, struct lumi_film_picture *picture, bool *there, struct lumi_error *error)
{
    int code = AVERROR(EAGAIN);

    *there = false;
    while (!film->ended && (code = avcodec_receive_frame(film->codec, film->frame)) < 0) {
        if (code == AVERROR(ENOMEM))
            return film_fail(film, error, "decoding", code);
        if (code == AVERROR_EOF || (film->draining && code == AVERROR(EAGAIN)))
            note_end(film);
        else if (code == AVERROR(EAGAIN))
            feed(film);
        else
            note_damage(film, "a picture that cannot be decoded behind %.2f s", isnan(film->last) ? 0 : film->last);
        if (code != AVERROR(EAGAIN) && film->draining)
            film->ended = true;
    }
    if (film->ended)
        return LUMI_OK;
    if (film->frame->width != film->info.width || film->frame->height != film->info.height)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: its pictures change from %d×%d to %d×%d pixels", film->name,
                         film->info.width, film->info.height, film->frame->width, film->frame->height);
    double time = film_time(film, film->stream, film->frame->best_effort_timestamp);
    if (isnan(time))
        time = isnan(film->last) ? 0 : film->last + film->step;
    if (!isnan(film->last) && time > film->last)
        film->step = time - film->last;
    film->last = time;
    picture->time = time;
    picture->damaged = film->frame->decode_error_flags != 0 || film->frame->flags & AV_FRAME_FLAG_CORRUPT;
    *there = true;
    return LUMI_OK;
}

/* A scaler from the current picture's format, with what it says of its colours. */
static int make_scaler(struct lumi_film *film, struct SwsContext **scaler, int width, int height,
                       enum AVPixelFormat format, int flags, struct lumi_error *error)
{
    const AVFrame *frame = film->frame;
    const AVPixFmtDescriptor *about = av_pix_fmt_desc_get(frame->format);
    bool full = frame->color_range == AVCOL_RANGE_JPEG || (about && strstr(about->name, "yuvj")) ||
                (about && about->flags & AV_PIX_FMT_FLAG_RGB);
    int space = frame->colorspace != AVCOL_SPC_UNSPECIFIED ? (int)frame->colorspace
                : frame->height >= 720                     ? SWS_CS_ITU709
                                                           : SWS_CS_ITU601;

    *scaler = sws_getCachedContext(*scaler, frame->width, frame->height, frame->format, width, height, format,
                                   flags | SWS_ACCURATE_RND | SWS_BITEXACT, NULL, NULL, NULL);
    if (!*scaler)
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "%s: pixels of a kind that cannot be converted (%s)", film->name,
                         about ? about->name : "unknown");
    sws_setColorspaceDetails(*scaler, sws_getCoefficients(space), full, sws_getCoefficients(SWS_CS_DEFAULT), 1, 0,
                             1 << 16, 1 << 16);
    return LUMI_OK;
}

int lumi_film_blocks(struct lumi_film *film, int columns, int rows, float *blocks, struct lumi_error *error)
{
    uint16_t *values = lumi_calloc((size_t)columns * (size_t)rows + 32, sizeof *values);
    uint8_t *data[4] = {(uint8_t *)values};
    int stride[4] = {columns * (int)sizeof *values}, code;

    if (!values)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: out of memory", film->name);
    code = make_scaler(film, &film->to_small, columns, rows, AV_PIX_FMT_GRAY16LE, SWS_AREA, error);
    if (code == LUMI_OK)
        sws_scale(film->to_small, (const uint8_t *const *)film->frame->data, film->frame->linesize, 0,
                  film->frame->height, data, stride);
    for (int i = 0; i < columns * rows; i++)
        blocks[i] = (float)values[i] / 65535;
    lumi_free(values);
    return code;
}

int lumi_film_raster(struct lumi_film *film, struct lumi_raster *raster, struct lumi_error *error)
{
    const AVPixFmtDescriptor *about = av_pix_fmt_desc_get(film->frame->format);
    bool deep = about && about->comp[0].depth > 8;

    *raster = (struct lumi_raster){0};
    if (lumi_raster_create(raster, film->info.width, film->info.height, 3, deep ? LUMI_U16 : LUMI_U8) != LUMI_OK)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: no memory for a picture", film->name);
    uint8_t *data[4] = {raster->data};
    int stride[4] = {(int)raster->stride};
    int code = make_scaler(film, &film->to_rgb, film->info.width, film->info.height,
                           deep ? AV_PIX_FMT_RGB48LE : AV_PIX_FMT_RGB24, SWS_BICUBIC | SWS_FULL_CHR_H_INT, error);
    if (code == LUMI_OK)
        sws_scale(film->to_rgb, (const uint8_t *const *)film->frame->data, film->frame->linesize, 0,
                  film->frame->height, data, stride);
    else
        lumi_raster_finish(raster);
    return code;
}
