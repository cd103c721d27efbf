/* The options of `lumi process` and `lumi stage` that are about light and colour. */
#ifndef LUMI_CLI_COLOR_OPTIONS_H
#define LUMI_CLI_COLOR_OPTIONS_H

#include "cli/command.h"
#include "pipeline/run/run.h"

struct color_options {
    char *response, *icc, *lut, *matrix, *balance, *tone, *exposure;
};
extern struct color_options color_options;

/* clang-format off */
#define COLOR_OPTIONS                                                                                                  \
    {"response", 0, 0, G_OPTION_ARG_FILENAME, &color_options.response, "of the cameras, to merge brackets: srgb (default), linear, estimate, or a file", "WHICH"}, \
    {"icc", 0, 0, G_OPTION_ARG_FILENAME, &color_options.icc, "ICC profile that the pictures' colours are by", "FILE"}, \
    {"color-matrix", 0, 0, G_OPTION_ARG_STRING, &color_options.matrix, "or nine numbers, row by row: from the camera's to linear sRGB", "M,M,…"}, \
    {"white-balance", 0, 0, G_OPTION_ARG_STRING, &color_options.balance, "factors of the camera's colours (1,1,1)", "R,G,B"}, \
    {"exposure", 0, 0, G_OPTION_ARG_STRING, &color_options.exposure, "makes everything brighter by so much (0)", "STOPS"}, \
    {"tone", 0, 0, G_OPTION_ARG_STRING, &color_options.tone, "auto (reinhard for brackets), none, reinhard, hable", "NAME"}, \
    {"lut", 0, 0, G_OPTION_ARG_FILENAME, &color_options.lut, "look-up table for the finished colours", "FILE.cube"}
/* clang-format on */

int color_options_read(struct lumi_parameters *parameters, struct lumi_error *error);
/* The files that are named there are what they should be. */
int color_options_check(const struct lumi_parameters *parameters, struct lumi_error *error);

#endif
