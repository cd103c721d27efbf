/* What `lumi render` makes: picture files, films, stereo pairs, depth maps. */
#ifndef LUMI_PIPELINE_EVALUATE_PICTURES_H
#define LUMI_PIPELINE_EVALUATE_PICTURES_H

#include "pipeline/evaluate/renderer.h"
#include "pipeline/evaluate/shots.h"

#include <stdbool.h>

struct lumi_shot {
    char *name; /* for files in a folder */
    struct lumi_lens lens;
    struct lumi_pose pose;
};

struct lumi_picture_options {
    struct lumi_render_options render;
    bool stereo;         /* two eyes side by side, left one left */
    double eye_distance; /* metres */
    int bits;            /* PNG, TIFF: 8 or 16 */
    int frames_per_second, video_quality;
    const char *depth; /* EXR file (a folder for several shots): channel Z, metres; NULL: none */
    void (*progress)(void *context, const char *what, int done, int total); /* may be NULL */
    void *context;
};

/* What was rendered, for people. */
struct lumi_picture_report {
    int pictures, damaged; /* tiles */
    long imaged, covered;  /* pixels, all pictures together */
};

/* The sample type to render in for an output of this name: linear floats for .exr, 16 bits for a PNG or TIFF of so
 * many, else bytes. */
enum lumi_sample lumi_picture_sample(const char *output, int bits);

/* Renders `shots` to `output`: a film if it ends in .webm (all shots of one size); a folder of PNG files if there are
 * several shots (made if need be); else one picture, its format told by the name's end. */
int lumi_pictures_write(struct lumi_renderer *renderer, const struct lumi_shot *shots, int count, const char *output,
                        const struct lumi_picture_options *options, struct lumi_picture_report *report,
                        struct lumi_error *error);

#endif
