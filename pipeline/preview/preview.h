/* The light field so far: views from inside a capture that may still be taken (docs/preview.md).
 *
 * Frames that are stored become small views in memory, those first that are farthest from what is there; what they show
 * lies on a sphere at first, then, view by view, where matching against the neighbours finds it. Any time a picture can
 * be drawn from what is there.
 *
 * 1. The capture is only read, without a lock: whoever writes it never waits (lumi_capture_open_copy).
 * 2. Work is done in pieces, each a fraction of a second for small frames; nothing happens between calls.
 * 3. The same pieces in the same order give the same pictures, on one thread or many. */
#ifndef LUMI_PIPELINE_PREVIEW_PREVIEW_H
#define LUMI_PIPELINE_PREVIEW_PREVIEW_H

#include "proto/base/geometry.h"
#include "render/cpu/picture.h"

#include <stdbool.h>
#include <stddef.h>

struct lumi_preview;

struct lumi_preview_options {
    size_t memory_bytes;      /* of views; the finest size at which all frames that are planned fit is taken */
    double pixels_per_degree; /* at most, in the middle of a view */
    bool shapes;              /* match views; else all lies on one sphere */
    int threads;              /* as lumi_parallel_for */
    /* A frame that cannot be used, in one line; may be NULL. */
    void (*skipped)(void *context, const char *text);
    void *context;
};
/* 512 MiB, 6 pixels a degree, shapes. */
void lumi_preview_options_init(struct lumi_preview_options *options);

/* LUMI_ERR_NOTFOUND, LUMI_ERR_FORMAT: no capture. One without frames is fine. `path` is copied. */
int lumi_preview_open(const char *path, const struct lumi_preview_options *options, struct lumi_preview **preview,
                      struct lumi_error *error);
void lumi_preview_close(struct lumi_preview *preview);

struct lumi_preview_status {
    int frames; /* stored, with a pose, not rejected */
    int rows;   /* lines of the sweep that are whole: rows where the rig goes round several times, else positions */
    int views;  /* of the frames, in memory */
    int shapes; /* of the views, matched */
    bool sealed;
};
void lumi_preview_status(const struct lumi_preview *preview, struct lumi_preview_status *status);

/* Looks at the rows of the capture; *news (may be NULL): frames have come or gone. A failure (the capture is gone, or
 * somebody writes it faster than it can be read, LUMI_ERR_BUSY) leaves what is known. */
int lumi_preview_look(struct lumi_preview *preview, bool *news, struct lumi_error *error);

/* One piece of work: a frame becomes a view, or a view gets its shape. False: there is nothing to do. A frame that is
 * damaged or gone is told once and left out. */
bool lumi_preview_work(struct lumi_preview *preview);

/* Where somebody looks from: metres from the centre of the capture, radians; yaw 0 looks along +X, 90° along +Y, pitch
 * 90° along +Z; fov is across the width. */
struct lumi_preview_gaze {
    double x, y, z, yaw, pitch, fov;
    int width, height;
};
#define LUMI_PREVIEW_SIZE_MAX 4096
#define LUMI_PREVIEW_PLACE_MAX 1000.0 /* metres */
/* LUMI_ERR_ARG says which number cannot be. */
int lumi_preview_gaze_check(const struct lumi_preview_gaze *gaze, struct lumi_error *error);

/* The picture (U8 sRGB). LUMI_ERR_BUSY: there is no view yet. */
int lumi_preview_draw(struct lumi_preview *preview, const struct lumi_preview_gaze *gaze, struct lumi_picture *picture,
                      struct lumi_error *error);

#endif
