/* Within exchange: an open video, as its reader and the reader of its sound see it. */
#ifndef LUMI_PIPELINE_EXCHANGE_FILM_PRIV_H
#define LUMI_PIPELINE_EXCHANGE_FILM_PRIV_H

#include "pipeline/exchange/film.h"

#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libswscale/swscale.h>
#include <stdio.h>

struct lumi_film {
    char *name;
    struct lumi_film_info info;
    /* Where its bytes come from. */
    FILE *file;
    const uint8_t *data;
    int64_t size, at;
    AVIOContext *io;
    AVFormatContext *format;
    int stream, sound; /* indices, −1: none */
    AVCodecContext *codec;
    AVPacket *packet;
    AVFrame *frame;
    struct SwsContext *to_small, *to_rgb;
    int small_columns, small_rows;
    double last; /* time of the latest picture */
    double step; /* to the one before */
    bool draining, ended;
    char *damage;
};

int film_fail(const struct lumi_film *film, struct lumi_error *error, const char *doing, int code);
/* Opens the decoder of a stream. */
int film_open_codec(struct lumi_film *film, int stream, AVCodecContext **codec, struct lumi_error *error);
/* s from the video's begin; NaN: no time stamp. */
double film_time(const struct lumi_film *film, int stream, int64_t stamp);

#endif
