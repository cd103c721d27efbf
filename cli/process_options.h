/* The options `lumi process` and `lumi stage` share: the parameters of the pipeline. */
#ifndef LUMI_CLI_PROCESS_OPTIONS_H
#define LUMI_CLI_PROCESS_OPTIONS_H

#include "cli/color_options.h"
#include "cli/command.h"
#include "pipeline/run/run.h"

/* Values that the option tables of both commands write to. */
struct process_options {
    gboolean rolling_shutter, backwards;
    char *exchange;
    char *work, *projection, *fov, *shape, *kernel;
    char *masks, *calibrate, *equalize, *synthesize, *subsample, *prefilter, *stand; /* which stages there are */
    double density, pixels_per_degree, near_m, far_m, gp, disk_scale;
    int neighbours, quality, cluster, threads;
    gint64 target_bytes;
};
extern struct process_options process_options;
extern const struct process_options process_defaults;

/* clang-format off */
#define PROCESS_OPTIONS                                                                                                \
    {"work", 'w', 0, G_OPTION_ARG_FILENAME, &process_options.work, "where the stages keep their files (CAPTURE.work)", "DIR"}, \
    {"threads", 'j', 0, G_OPTION_ARG_INT, &process_options.threads, "threads (all)", "N"},                              \
    {"calibrate", 0, 0, G_OPTION_ARG_STRING, &process_options.calibrate, "find the cameras' poses in the pictures: auto, no, yes", "WHETHER"}, \
    {"masks", 0, 0, G_OPTION_ARG_FILENAME, &process_options.masks, "what is black there is of no use: pictures CAMERA.png or FRAME.png", "FOLDER"}, \
    {"backwards", 0, 0, G_OPTION_ARG_NONE, &process_options.backwards, "the rig turned the other way than the capture says", NULL}, \
    {"exchange", 0, 0, G_OPTION_ARG_STRING, &process_options.exchange, "cameras that are in each other's place on the rig", "A:B[,C:D...]"}, \
    {"rolling-shutter", 0, 0, G_OPTION_ARG_NONE, &process_options.rolling_shutter, "calibration: the rows of a picture were read one after the other while the rig turned", NULL}, \
    {"equalize", 0, 0, G_OPTION_ARG_STRING, &process_options.equalize, "even out exposure and vignetting between cameras: auto, no, yes", "WHETHER"}, \
    {"synthesize", 0, 0, G_OPTION_ARG_STRING, &process_options.synthesize, "views for the poles, and the stand filled in: auto, no, yes", "WHETHER"}, \
    {"subsample", 0, 0, G_OPTION_ARG_STRING, &process_options.subsample, "thin out views where they are dense: auto, no, yes", "WHETHER"}, \
    {"density", 0, 0, G_OPTION_ARG_DOUBLE, &process_options.density, "views kept, as a share of the equator's density (1)", "SHARE"}, \
    {"stand", 0, 0, G_OPTION_ARG_STRING, &process_options.stand, "how far the feet of the rig's stand are from its axis: auto, metres, or 0 for none", "METRES"}, \
    {"prefilter", 0, 0, G_OPTION_ARG_STRING, &process_options.prefilter, "samples a pixel of the prefilter, auto, or 0 for none", "N"}, \
    {"projection", 0, 0, G_OPTION_ARG_STRING, &process_options.projection, "auto, equiangular or rectilinear views (auto)", "NAME"}, \
    {"fov", 0, 0, G_OPTION_ARG_STRING, &process_options.fov, "field of view of the views, degrees (from the lens)", "XxY"}, \
    {"pixels-per-degree", 0, 0, G_OPTION_ARG_DOUBLE, &process_options.pixels_per_degree, "density of the views (from the lens)", "N"}, \
    {"near", 0, 0, G_OPTION_ARG_DOUBLE, &process_options.near_m, "nearest surface (found)", "METRES"},                  \
    {"far", 0, 0, G_OPTION_ARG_DOUBLE, &process_options.far_m, "farthest surface (found)", "METRES"},                   \
    {"neighbours", 0, 0, G_OPTION_ARG_INT, &process_options.neighbours, "views each is matched against (8)", "N"},      \
    {"gp", 0, 0, G_OPTION_ARG_DOUBLE, &process_options.gp, "geometry precision: 2 GP triangles a tile on average (5)", "GP"}, \
    {"disk-shape", 0, 0, G_OPTION_ARG_STRING, &process_options.shape, "oval or rectangle (oval)", "NAME"},              \
    {"disk-scale", 0, 0, G_OPTION_ARG_DOUBLE, &process_options.disk_scale, "widens the blending disks (1)", "FACTOR"},  \
    {"kernel", 0, 0, G_OPTION_ARG_STRING, &process_options.kernel, "linear, gaussian or cubic (linear)", "NAME"},       \
    {"quality", 'q', 0, G_OPTION_ARG_INT, &process_options.quality, "of the images, 0 to 100 (70)", "N"},               \
    {"target-bytes", 0, 0, G_OPTION_ARG_INT64, &process_options.target_bytes, "finds the quality for a file of this size", "N"}, \
    {"cluster", 0, 0, G_OPTION_ARG_INT, &process_options.cluster, "images a reference image (25)", "N"},      \
    COLOR_OPTIONS
/* clang-format on */

/* Checks them and fills the parameters. */
int process_options_read(struct lumi_parameters *parameters, struct lumi_error *error);

/* Those that were given, as `--name=value`, but --work and --threads, appended to `arguments` (char *); and read again
 * from such a list. */
void process_options_list(GPtrArray *arguments);
int process_options_take(const GPtrArray *arguments, struct lumi_error *error);

/* A line about the run on standard error. */
void process_options_say(const char *line);

#endif
