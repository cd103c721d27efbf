/* The options that `lumi render` and `lumi eval` share. */
#ifndef LUMI_CLI_RENDER_OPTIONS_H
#define LUMI_CLI_RENDER_OPTIONS_H

#include "pipeline/evaluate/renderer.h"

#include <glib.h>

struct cli_render_options {
    char *method, *level, *depth_test, *kernel, *filter, *blend, *stretch;
    double disk_scale, plane_distance;
    int threads;
};

/* For a command's own table: put these first, end with {0}. */
#define CLI_RENDER_OPTIONS(o)                                                                                          \
    {"method",    0,                                                                                                   \
     0,           G_OPTION_ARG_STRING,                                                                                 \
     &(o).method, "disks (default), or plane: the cameras' mesh over one plane, for comparison",                       \
     "METHOD"},                                                                                                        \
        {"plane-distance",                                                                                             \
         0,                                                                                                            \
         0,                                                                                                            \
         G_OPTION_ARG_DOUBLE,                                                                                          \
         &(o).plane_distance,                                                                                          \
         "metres from the cameras' centre to that plane",                                                              \
         "M"},                                                                                                         \
        {"level", 0, 0, G_OPTION_ARG_STRING, &(o).level, "coarse or fine (default)", "LEVEL"},                         \
        {"depth-test",                                                                                                 \
         0,                                                                                                            \
         0,                                                                                                            \
         G_OPTION_ARG_STRING,                                                                                          \
         &(o).depth_test,                                                                                              \
         "what hides what: intra (within a view, default), none, inter (between views)",                               \
         "TEST"},                                                                                                      \
        {"kernel", 0, 0, G_OPTION_ARG_STRING, &(o).kernel, "linear, gaussian or cubic (the file's)", "KERNEL"},        \
        {"disk-scale", 0, 0, G_OPTION_ARG_DOUBLE, &(o).disk_scale, "widens every disk (1)", "S"},                      \
        {"filter", 0, 0, G_OPTION_ARG_STRING, &(o).filter, "between a view's pixels: bilinear or cubic (default)",     \
         "FILTER"},                                                                                                    \
        {"stretch",                                                                                                    \
         0,                                                                                                            \
         0,                                                                                                            \
         G_OPTION_ARG_STRING,                                                                                          \
         &(o).stretch,                                                                                                 \
         "how soon surfaces that are drawn wider than a view saw them weigh less: a number, or off",                   \
         "S"},                                                                                                         \
        {"blend", 0, 0, G_OPTION_ARG_STRING, &(o).blend, "display (sRGB values, default) or linear light", "SPACE"},   \
    {                                                                                                                  \
        "threads", 'j', 0, G_OPTION_ARG_INT, &(o).threads, "threads (all)", "N"                                        \
    }

int cli_render_options_apply(const struct cli_render_options *options, struct lumi_render_options *render,
                             struct lumi_error *error);

#endif
