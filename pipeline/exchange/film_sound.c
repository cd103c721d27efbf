/* How loud a video is from moment to moment: what two cameras heard tells how their clocks stand to each other. */
#include "pipeline/exchange/film_priv.h"

#include <glib.h>
#include <math.h>

#define SECONDS_MAX 20000 /* of sound that is listened to */

struct loudness {
    double rate;
    GArray *squares, *counts; /* double, of each value */
};

static double sample_at(const AVFrame *frame, int channel, int channels, int index)
{
    enum AVSampleFormat format = (enum AVSampleFormat)frame->format;
    bool planar = av_sample_fmt_is_planar(format);
    const uint8_t *data = frame->extended_data[planar ? channel : 0];
    int at = planar ? index : index * channels + channel;

    switch (av_get_packed_sample_fmt(format)) {
    case AV_SAMPLE_FMT_U8:
        return (data[at] - 128) / 128.0;
    case AV_SAMPLE_FMT_S16:
        return ((const int16_t *)(const void *)data)[at] / 32768.0;
    case AV_SAMPLE_FMT_S32:
        return ((const int32_t *)(const void *)data)[at] / 2147483648.0;
    case AV_SAMPLE_FMT_FLT:
        return (double)((const float *)(const void *)data)[at];
    case AV_SAMPLE_FMT_DBL:
        return ((const double *)(const void *)data)[at];
    default:
        return 0;
    }
}

static void add_frame(const struct lumi_film *film, const AVFrame *frame, int channels, struct loudness *loudness)
{
    double begin = film_time(film, film->sound, frame->best_effort_timestamp);

    if (isnan(begin) || frame->sample_rate < 1 || channels < 1)
        return;
    for (int i = 0; i < frame->nb_samples; i++) {
        double at = (begin + (double)i / frame->sample_rate) * loudness->rate;
        double value = sample_at(frame, 0, channels, i);
        if (!(at >= 0 && at < SECONDS_MAX * loudness->rate) || !(fabs(value) <= 4))
            continue;
        guint index = (guint)at;
        if (index >= loudness->squares->len) {
            g_array_set_size(loudness->squares, index + 1);
            g_array_set_size(loudness->counts, index + 1);
        }
        g_array_index(loudness->squares, double, index) += value * value;
        g_array_index(loudness->counts, double, index) += 1;
    }
}

static int listen(struct lumi_film *film, AVCodecContext *codec, struct loudness *loudness, struct lumi_error *error)
{
    bool more = true;

    while (more) {
        int code = av_read_frame(film->format, film->packet);
        if (code >= 0 && film->packet->stream_index != film->sound) {
            av_packet_unref(film->packet);
            continue;
        }
        more = code >= 0;
        avcodec_send_packet(codec, more ? film->packet : NULL); /* what is damaged is silence */
        av_packet_unref(film->packet);
        while ((code = avcodec_receive_frame(codec, film->frame)) >= 0)
            add_frame(film, film->frame, codec->ch_layout.nb_channels, loudness);
        if (code == AVERROR(ENOMEM))
            return film_fail(film, error, "decoding its sound", code);
    }
    return LUMI_OK;
}

int lumi_film_sound(struct lumi_film *film, double rate, float **values, int *count, struct lumi_error *error)
{
    AVCodecContext *codec = NULL;
    struct loudness loudness = {.rate = rate};

    *values = NULL;
    *count = 0;
    if (film->sound < 0)
        return LUMI_OK;
    loudness.squares = g_array_new(FALSE, TRUE, sizeof(double));
    loudness.counts = g_array_new(FALSE, TRUE, sizeof(double));
    int code = film_open_codec(film, film->sound, &codec, error);
    if (code == LUMI_OK)
        code = listen(film, codec, &loudness, error);
    avcodec_free_context(&codec);
    if (code == LUMI_OK && loudness.squares->len > 0) {
        *count = (int)loudness.squares->len;
        *values = g_new(float, *count);
        for (int i = 0; i < *count; i++) {
            double heard = g_array_index(loudness.counts, double, i);
            (*values)[i] = heard > 0 ? (float)sqrt(g_array_index(loudness.squares, double, i) / heard) : 0;
        }
    }
    g_array_unref(loudness.squares);
    g_array_unref(loudness.counts);
    return code;
}
