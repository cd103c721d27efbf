/* The light field so far: views of a capture that is being taken, drawn by a program of its own (`lumi preview`).
 *
 * 1. It is started when somebody first asks for a view, killed when nobody has for a minute, and started again when it
 *    has died, later each time. Whatever becomes of it, nobody here waits for it.
 * 2. It has one question at a time. The others wait, the newest of each who asks; what is pushed out, and what waits
 * too long, is told so.
 * 3. All in one thread: that of the main context it was made with. */
#ifndef LUMI_DAEMON_PREVIEW_PREVIEW_FIELD_H
#define LUMI_DAEMON_PREVIEW_PREVIEW_FIELD_H

#include "proto/base/result.h"

#include <glib.h>
#include <stdbool.h>
#include <stdint.h>

struct lumi_field_gaze {
    double x, y, z; /* metres from the centre */
    double yaw, pitch, fov;
    int width, height;
};

enum lumi_field_outcome {
    LUMI_FIELD_DRAWN = 0,
    LUMI_FIELD_NOTHING,    /* there is nothing to draw yet, or nobody to draw it; `text` says why */
    LUMI_FIELD_SUPERSEDED, /* who asked has asked again */
    LUMI_FIELD_LATE        /* the computer had no time for it */
};
struct lumi_field_result {
    enum lumi_field_outcome outcome;
    GBytes *jpeg; /* DRAWN */
    int frames;   /* that it was made of */
    const char *text;
};

struct lumi_field_options {
    const char *command; /* words and quotes as in a shell, %c is the capture; empty: none */
    GMainContext *context;
    void (*news)(void *user);                  /* more has come in: lumi_field_status */
    void (*log)(void *user, const char *text); /* a line for the log; may be NULL */
    void *user;
};
struct lumi_field;
/* LUMI_ERR_FORMAT: the command cannot be taken apart. Strings are copied. */
int lumi_field_create(const struct lumi_field_options *options, struct lumi_field **field, struct lumi_error *error);
/* What waits is answered first (NOTHING). NULL is fine. */
void lumi_field_destroy(struct lumi_field *field);

/* `answered` is called once for every question, later or at once; `who` tells those who ask apart. */
typedef void (*lumi_field_answered)(void *context, const struct lumi_field_result *result);
void lumi_field_ask(struct lumi_field *field, const char *capture, const char *who, const struct lumi_field_gaze *gaze,
                    lumi_field_answered answered, void *context);
/* Nobody waits for what was asked with this context any more. */
void lumi_field_forget(struct lumi_field *field, const void *context);

struct lumi_field_status {
    bool running;
    int frames, rows, views; /* of the capture; 0 until it is known */
    char capture[1024], text[256];
    int pid; /* 0: none */
};
void lumi_field_status(const struct lumi_field *field, struct lumi_field_status *status);

#endif
