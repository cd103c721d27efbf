/* The loop: a picture for whoever asks last, else a piece of work, else waiting. */
#include "pipeline/preview/preview_serve.h"

#include "pipeline/preview/preview_line.h"
#include "proto/base/memory.h"
#include "proto/image/image.h"

#include <errno.h>
#include <glib.h>
#include <poll.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#define WAIT_MS 400     /* between looks at a capture in which nothing happens */
#define PIECES_A_LOOK 8 /* pieces of work between looks otherwise */
#define FIRST_VIEWS 6   /* the first picture waits for so many, or all there are */
#define PICTURE_QUALITY 85

struct serving {
    struct lumi_preview *preview;
    const struct lumi_preview_options *options;
    int in, out;
    bool ended;
    char line[LUMI_PREVIEW_LINE_MAX + 1];
    size_t length;
    bool too_long; /* the rest of this line is not looked at */
    bool asked;
    uint32_t id;
    struct lumi_preview_gaze gaze;
    struct lumi_preview_status told;
    bool told_once;
};

static int write_all(int out, const void *data, size_t size, struct lumi_error *error)
{
    const char *at = data;

    while (size > 0) {
        const ssize_t done = write(out, at, size);
        if (done < 0 && errno == EINTR)
            continue;
        if (done <= 0)
            return lumi_fail_errno(error, "standard output", "write");
        at += done;
        size -= (size_t)done;
    }
    return LUMI_OK;
}

static int say(const struct serving *s, struct lumi_error *error, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

static int say(const struct serving *s, struct lumi_error *error, const char *format, ...)
{
    va_list args;

    va_start(args, format);
    g_autofree char *line = g_strdup_vprintf(format, args);
    va_end(args);
    g_strdelimit(line, "\r\n", ' ');
    const size_t length = strlen(line);
    line[length] = '\n'; /* in place of its end */
    return write_all(s->out, line, length + 1, error);
}

/* ---- what is asked ---- */

static int take_line(struct serving *s, struct lumi_error *error)
{
    struct lumi_error problem = {0};
    struct lumi_preview_gaze gaze;
    uint32_t id;
    const int code = lumi_preview_line_parse(s->line, &id, &gaze, &problem);

    if (code == LUMI_ERR_FORMAT) {
        if (s->options->skipped)
            s->options->skipped(s->options->context, problem.text);
        return LUMI_OK;
    }
    if (code != LUMI_OK)
        return say(s, error, "none %u %s", id, problem.text);
    if (s->asked)
        LUMI_TRY(say(s, error, "none %u a newer view was asked for", s->id));
    s->asked = true;
    s->id = id;
    s->gaze = gaze;
    return LUMI_OK;
}

static int take_bytes(struct serving *s, const char *bytes, size_t count, struct lumi_error *error)
{
    for (size_t i = 0; i < count; i++) {
        if (bytes[i] == '\n') {
            s->line[s->length] = '\0';
            s->length = 0;
            const bool whole = !s->too_long;
            s->too_long = false;
            if (whole)
                LUMI_TRY(take_line(s, error));
        } else if (s->length < LUMI_PREVIEW_LINE_MAX && bytes[i]) {
            s->line[s->length++] = bytes[i];
        } else {
            s->too_long = true;
        }
    }
    return LUMI_OK;
}

/* What has come; waits for it at most so long. */
static int listen_for(struct serving *s, int wait_ms, struct lumi_error *error)
{
    struct pollfd poll_for = {.fd = s->in, .events = POLLIN};
    char bytes[4096];

    while (!s->ended && poll(&poll_for, 1, wait_ms) > 0) {
        const ssize_t got = read(s->in, bytes, sizeof bytes);
        if (got == 0 || (got < 0 && errno != EINTR && errno != EAGAIN))
            s->ended = true;
        if (got > 0)
            LUMI_TRY(take_bytes(s, bytes, (size_t)got, error));
        wait_ms = 0;
    }
    return LUMI_OK;
}

/* ---- what is said ---- */

static int encode(const struct lumi_raster *color, uint8_t **data, size_t *size, struct lumi_error *error)
{
    struct lumi_image_options options;

    lumi_image_options_init(&options);
    options.format = LUMI_IMAGE_JPEG;
    options.quality = PICTURE_QUALITY;
    options.subsample = true;
    return lumi_image_encode(color, &options, data, size, error);
}

static int answer(struct serving *s, struct lumi_error *error)
{
    struct lumi_picture picture = {0};
    struct lumi_preview_status status;
    struct lumi_error problem = {0};
    uint8_t *data = NULL;
    size_t size = 0;
    int code;

    s->asked = false;
    for (lumi_preview_status(s->preview, &status); status.views < MIN(FIRST_VIEWS, status.frames);
         lumi_preview_status(s->preview, &status))
        if (!lumi_preview_work(s->preview))
            break;
    code = lumi_preview_draw(s->preview, &s->gaze, &picture, &problem);
    if (code == LUMI_OK)
        code = encode(&picture.color, &data, &size, &problem);
    lumi_picture_finish(&picture);
    if (code != LUMI_OK)
        return say(s, error, "none %u %s", s->id, problem.text);
    code = say(s, error, "jpeg %u %zu %d", s->id, size, status.views);
    if (code == LUMI_OK)
        code = write_all(s->out, data, size, error);
    lumi_free(data);
    return code;
}

static int tell_news(struct serving *s, struct lumi_error *error)
{
    struct lumi_preview_status status;

    lumi_preview_status(s->preview, &status);
    if (s->told_once && status.frames == s->told.frames && status.rows == s->told.rows &&
        status.views == s->told.views && status.shapes == s->told.shapes)
        return LUMI_OK;
    s->told = status;
    s->told_once = true;
    return say(s, error, "news %d %d %d", status.frames, status.rows, status.views);
}

/* A capture that is written too fast to be read is looked at again; one that is gone is the end. */
static int look(struct serving *s, struct lumi_error *error)
{
    const int code = lumi_preview_look(s->preview, NULL, error);

    return code == LUMI_ERR_BUSY ? LUMI_OK : code;
}

int lumi_preview_serve(struct lumi_preview *preview, const struct lumi_preview_options *options, int in, int out,
                       struct lumi_error *error)
{
    struct serving s = {.preview = preview, .options = options, .in = in, .out = out};
    int pieces = 0;

    LUMI_TRY(tell_news(&s, error));
    while (!s.ended) {
        LUMI_TRY(listen_for(&s, 0, error));
        if (s.asked) {
            LUMI_TRY(answer(&s, error));
            continue;
        }
        const bool worked = lumi_preview_work(preview);
        if (!worked)
            LUMI_TRY(listen_for(&s, WAIT_MS, error));
        if (!worked || ++pieces >= PIECES_A_LOOK) {
            pieces = 0;
            LUMI_TRY(look(&s, error));
            LUMI_TRY(tell_news(&s, error));
        }
    }
    return LUMI_OK;
}
