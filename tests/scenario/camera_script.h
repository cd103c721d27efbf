/* What make_cards and make_films share: scripts of what is not as it should be, and a capture's cameras one by one. */
#ifndef LUMI_TESTS_SCENARIO_CAMERA_SCRIPT_H
#define LUMI_TESTS_SCENARIO_CAMERA_SCRIPT_H

#include "proto/base/raster.h"
#include "proto/capture/capture.h"

#include <stdbool.h>

#define SCRIPT_LINES 64

/* "WHAT CAMERA A [B]" */
struct script_line {
    char what[16], camera[32];
    double a, b;
};
extern struct script_line script_lines[SCRIPT_LINES];
extern int script_line_count;

/* The first line of this kind for the camera, of this number (negative: of any); NULL: there is none. */
const struct script_line *script_find(const char *what, const char *camera, double number);

struct camera_script {
    const char *program;
    /* Takes a line that is not of the form above; may be NULL. */
    bool (*setting)(const char *line);
    /* Told the capture's profile, before the first camera; may be NULL. */
    int (*begin)(const char *out, const char *profile, struct lumi_error *error);
    /* Of all frames those whose camera_name it is. */
    int (*write_camera)(struct lumi_capture *capture, const struct lumi_capture_frame *frames, int count,
                        const char *out, const char *camera, struct lumi_error *error);
};

/* PROGRAM CAPTURE OUT SCRIPT: writes OUT.rig and has every camera written. The exit status. */
int camera_script_run(const struct camera_script *script, int argc, char **argv);

/* A frame's picture as 8-bit RGB. */
int camera_script_picture(struct lumi_capture *capture, const struct lumi_capture_frame *frame,
                          struct lumi_raster *bytes, struct lumi_error *error);

#endif
