/* The options `lumi process` and `lumi stage` share. */
#include "cli/process_options.h"

#include "proto/base/geometry.h"

#include <stdio.h>

#include <string.h>

#define NOT_GIVEN (-1000000)

/* What an option holds that was not given. */
/* clang-format off */
#define DEFAULTS \
    { \
        .density = NOT_GIVEN, \
        .pixels_per_degree = NOT_GIVEN, \
        .near_m = NOT_GIVEN, \
        .far_m = NOT_GIVEN, \
        .gp = NOT_GIVEN, \
        .disk_scale = NOT_GIVEN, \
        .neighbours = NOT_GIVEN, \
        .quality = NOT_GIVEN, \
        .cluster = NOT_GIVEN, \
        .target_bytes = NOT_GIVEN, \
    }
/* clang-format on */

const struct process_options process_defaults = DEFAULTS;
struct process_options process_options = DEFAULTS;

static int check_range(const char *name, double value, double least, double most, struct lumi_error *error)
{
    if (value >= least && value <= most)
        return LUMI_OK;
    return lumi_fail(error, LUMI_ERR_ARG, "%s %g: %g to %g wanted", name, value, least, most);
}

static int read_names(struct lumi_parameters *parameters, struct lumi_error *error)
{
    static const char *const projections[] = {"auto", "equiangular", "rectilinear", NULL};
    static const char *const shapes[] = {"oval", "rectangle", NULL};
    static const char *const kernels[] = {"linear", "gaussian", "cubic", NULL};
    int choice;

    if (process_options.projection) {
        LUMI_TRY(cli_parse_choice("--projection", process_options.projection, projections, &choice, error));
        parameters->projection = (enum lumi_projection)choice;
    }
    if (process_options.shape) {
        LUMI_TRY(cli_parse_choice("--disk-shape", process_options.shape, shapes, &choice, error));
        parameters->disk_shape = (enum lumi_disk_shape)choice;
    }
    if (process_options.kernel) {
        LUMI_TRY(cli_parse_choice("--kernel", process_options.kernel, kernels, &choice, error));
        parameters->kernel = (enum lumi_disk_kernel)choice;
    }
    return LUMI_OK;
}

static int read_choice(const char *option, const char *given, enum lumi_choice *choice, struct lumi_error *error)
{
    static const char *const names[] = {"auto", "no", "yes", NULL};
    int index;

    if (!given)
        return LUMI_OK;
    LUMI_TRY(cli_parse_choice(option, given, names, &index, error));
    *choice = (enum lumi_choice)index;
    return LUMI_OK;
}

static int read_stages(struct lumi_parameters *parameters, struct lumi_error *error)
{
    const struct process_options *o = &process_options;

    if (o->masks && !g_file_test(o->masks, G_FILE_TEST_IS_DIR))
        return lumi_fail(error, LUMI_ERR_ARG, "--masks %s: is no folder", o->masks);
    parameters->masks = o->masks;
    parameters->rolling_shutter = o->rolling_shutter;
    parameters->backwards = o->backwards;
    parameters->exchange = o->exchange;
    LUMI_TRY(read_choice("--calibrate", o->calibrate, &parameters->calibrate, error));
    LUMI_TRY(read_choice("--equalize", o->equalize, &parameters->equalize, error));
    LUMI_TRY(read_choice("--synthesize", o->synthesize, &parameters->synthesize, error));
    LUMI_TRY(read_choice("--subsample", o->subsample, &parameters->subsample, error));
    if (o->prefilter && strcmp(o->prefilter, "auto") != 0) {
        LUMI_TRY(cli_parse_ints("--prefilter", o->prefilter, ',', 1, &parameters->prefilter, error));
        LUMI_TRY(check_range("--prefilter", parameters->prefilter, 0, 65536, error));
    } else if (o->prefilter) {
        parameters->prefilter = -1;
    }
    if (o->density != NOT_GIVEN) {
        LUMI_TRY(check_range("--density", o->density, 0.01, 100, error));
        parameters->density = o->density;
    }
    if (o->stand && strcmp(o->stand, "auto") != 0) {
        LUMI_TRY(cli_parse_doubles("--stand", o->stand, ',', 1, &parameters->stand_m, error));
        LUMI_TRY(check_range("--stand", parameters->stand_m, 0, 10, error));
    }
    return LUMI_OK;
}

/* Numbers that were not given leave the defaults. */
static int read_numbers(struct lumi_parameters *parameters, struct lumi_error *error)
{
    const struct process_options *o = &process_options;

    if (o->pixels_per_degree != NOT_GIVEN) {
        LUMI_TRY(check_range("--pixels-per-degree", o->pixels_per_degree, 0.1, 1000, error));
        parameters->pixels_per_degree = o->pixels_per_degree;
    }
    if (o->near_m != NOT_GIVEN) {
        LUMI_TRY(check_range("--near", o->near_m, 1e-4, 1e6, error));
        parameters->near_m = o->near_m;
    }
    if (o->far_m != NOT_GIVEN) {
        LUMI_TRY(check_range("--far", o->far_m, 1e-4, 1e9, error));
        parameters->far_m = o->far_m;
    }
    if (o->near_m > 0 && o->far_m > 0 && o->near_m >= o->far_m)
        return lumi_fail(error, LUMI_ERR_ARG, "--near %g is not before --far %g", o->near_m, o->far_m);
    if (o->neighbours != NOT_GIVEN) {
        LUMI_TRY(check_range("--neighbours", o->neighbours, 1, 8, error));
        parameters->depth_neighbours = o->neighbours;
    }
    if (o->gp != NOT_GIVEN) {
        LUMI_TRY(check_range("--gp", o->gp, 1, 1000, error));
        parameters->geometry_precision = o->gp;
    }
    if (o->disk_scale != NOT_GIVEN) {
        LUMI_TRY(check_range("--disk-scale", o->disk_scale, 0.1, 10, error));
        parameters->disk_scale = o->disk_scale;
    }
    if (o->cluster != NOT_GIVEN) {
        LUMI_TRY(check_range("--cluster", o->cluster, 1, 1000, error));
        parameters->cluster_size = o->cluster;
    }
    return LUMI_OK;
}

int process_options_read(struct lumi_parameters *parameters, struct lumi_error *error)
{
    const struct process_options *o = &process_options;

    lumi_run_defaults(parameters);
    LUMI_TRY(cli_check_threads(o->threads, error));
    LUMI_TRY(read_names(parameters, error));
    LUMI_TRY(read_stages(parameters, error));
    LUMI_TRY(color_options_read(parameters, error));
    LUMI_TRY(read_numbers(parameters, error));
    if (o->quality != NOT_GIVEN) {
        LUMI_TRY(check_range("--quality", o->quality, 0, 100, error));
        parameters->quality = o->quality;
    }
    if (o->target_bytes != NOT_GIVEN) {
        if (o->target_bytes < 1000 || o->quality != NOT_GIVEN)
            return lumi_fail(error, LUMI_ERR_ARG, "--target-bytes: at least 1000, and not together with --quality");
        parameters->target_bytes = o->target_bytes;
    }
    if (o->fov) {
        double degrees[2];
        LUMI_TRY(cli_parse_doubles("--fov", o->fov, 'x', 2, degrees, error));
        LUMI_TRY(check_range("--fov", degrees[0], 1, 175, error));
        LUMI_TRY(check_range("--fov", degrees[1], 1, 175, error));
        parameters->fov_x = degrees[0] * LUMI_PI / 180;
        parameters->fov_y = degrees[1] * LUMI_PI / 180;
    }
    return LUMI_OK;
}

void process_options_say(const char *line)
{
    cli_progress_end();
    fprintf(stderr, "lumi: %s\n", line);
}
