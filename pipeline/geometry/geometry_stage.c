/* The stages `geometry` and `geometry-coarse` (Overbeck et al. 2018, section 4.5). */
#include "pipeline/geometry/geometry.h"

#include "pipeline/equiangular/warp.h"
#include "pipeline/geometry/simplify.h"
#include "proto/base/file.h"
#include "proto/image/image.h"

#include <glib.h>
#include <math.h>

enum { NEIGHBOURS = 4 };

double lumi_geometry_disparity(const struct lumi_run *run, int index)
{
    const struct lumi_grid *grid = &run->grid;
    const int column = grid->cols / 2, row = grid->rows / 2;
    const double across = (grid->tan_x[column + (column < grid->cols)] - grid->tan_x[column - (column == grid->cols)]);
    const double down = (grid->tan_y[row + (row < grid->rows)] - grid->tan_y[row - (row == grid->rows)]);
    double nearest[NEIGHBOURS + 1], sum = 0;
    int count = 0;

    for (int n = 0; n < run->kept_count; n++) {
        const int i = run->kept[n];
        const double d = lumi_length(lumi_sub(run->sources[i].pose.t, run->sources[index].pose.t));
        if (i == index || !(d > 0))
            continue;
        int k = count < NEIGHBOURS ? count++ : NEIGHBOURS;
        for (; k > 0 && nearest[k - 1] > d; k--)
            nearest[k] = nearest[k - 1];
        nearest[k] = d;
    }
    for (int k = 0; k < count; k++)
        sum += nearest[k];
    /* A view alone has no disparity; 5 cm then says how exact its depth should be. */
    return sqrt(LUMI_TILE / across * (LUMI_TILE / down)) * (count ? sum / count : 0.05);
}

static int key(struct lumi_run *run, int index, struct lumi_key *k, struct lumi_error *error)
{
    (void)error;
    lumi_key_double(k, run->parameters.geometry_precision);
    lumi_key_double(k, lumi_geometry_disparity(run, index));
    lumi_key_view(k, run, index, LUMI_VIEW_PICTURE);
    lumi_key_view(k, run, index, LUMI_VIEW_DEPTH);
    return LUMI_OK;
}

/* A view's picture and depth. */
struct input {
    struct lumi_raster colour, depth;
};

static void input_finish(struct input *input)
{
    lumi_raster_finish(&input->colour);
    lumi_raster_finish(&input->depth);
}

static int read_input(const struct lumi_run *run, int index, struct input *input, struct lumi_error *error)
{
    g_autofree char *colour = lumi_run_view(run, index, LUMI_VIEW_PICTURE);
    g_autofree char *depth = lumi_run_view(run, index, LUMI_VIEW_DEPTH);

    *input = (struct input){0};
    LUMI_TRY(lumi_image_read(colour, 3, &input->colour, NULL, error));
    LUMI_TRY(lumi_run_check_view(run, &input->colour, colour, error));
    LUMI_TRY(lumi_image_read_channel(depth, "W", &input->depth, error));
    return lumi_run_check_view(run, &input->depth, depth, error);
}

static int write_mesh(const struct lumi_run *run, int index, const struct input *input, const struct lumi_grid *grid,
                      double disparity, const char *path, struct lumi_error *error)
{
    struct lumi_simplify_options options;
    struct lumi_view_mesh mesh;
    struct lumi_writer writer;

    lumi_simplify_defaults(&options);
    options.triangles_per_tile = 2 * run->parameters.geometry_precision;
    options.disparity = disparity;
    int result = lumi_simplify(&input->depth, &input->colour, grid, &options, &mesh, error);
    if (result != LUMI_OK)
        return lumi_fail_prefix(error, "%s", run->sources[index].name);
    lumi_writer_init(&writer);
    lumi_view_mesh_encode(&mesh, &writer);
    if (writer.failed)
        result = lumi_fail(error, LUMI_ERR_NOMEM, "%s: out of memory", run->sources[index].name);
    else
        result = lumi_file_write(path, writer.data, writer.size, false, error);
    lumi_writer_finish(&writer);
    lumi_view_mesh_finish(&mesh);
    return result;
}

static int make(struct lumi_run *run, void *state, int index, int thread, const char *path, struct lumi_error *error)
{
    struct input input;

    (void)state;
    (void)thread;
    int result = read_input(run, index, &input, error);
    if (result == LUMI_OK)
        result = write_mesh(run, index, &input, &run->grid, lumi_geometry_disparity(run, index), path, error);
    input_finish(&input);
    return result;
}

struct coarse {
    struct lumi_grid grid;
    struct lumi_warp *warp;
};

static int coarse_begin(struct lumi_run *run, void **state, struct lumi_error *error)
{
    struct coarse *coarse = g_new0(struct coarse, 1);

    lumi_grid_init_half(&coarse->grid, &run->grid);
    const int result = lumi_warp_create_half(&run->grid, &coarse->grid, &coarse->warp, error);
    if (result != LUMI_OK)
        g_clear_pointer(&coarse, g_free);
    *state = coarse;
    return result;
}

static void coarse_end(struct lumi_run *run, void *state)
{
    struct coarse *coarse = state;

    (void)run;
    if (coarse)
        lumi_warp_destroy(coarse->warp);
    g_free(coarse);
}

static int coarse_make(struct lumi_run *run, void *state, int index, int thread, const char *path,
                       struct lumi_error *error)
{
    const struct coarse *coarse = state;
    struct input input, half = {0};

    (void)thread;
    int result = read_input(run, index, &input, error);
    if (result == LUMI_OK)
        result = lumi_warp_apply(coarse->warp, &input.colour, &half.colour, error);
    if (result == LUMI_OK && lumi_halve_inverse_depth(&input.depth, &run->grid, &coarse->grid, &half.depth) != LUMI_OK)
        result = lumi_fail(error, LUMI_ERR_NOMEM, "%s: out of memory", run->sources[index].name);
    if (result == LUMI_OK)
        result = write_mesh(run, index, &half, &coarse->grid, lumi_geometry_disparity(run, index) / 2, path, error);
    input_finish(&input);
    input_finish(&half);
    return result;
}

const struct lumi_stage lumi_stage_geometry = {
    .name = "geometry",
    .title = "geometry",
    .version = 2,
    .extension = ".mesh",
    .set = LUMI_SET_KEPT,
    .bytes_per_pixel = 45,
    .key = key,
    .make = make,
};

const struct lumi_stage lumi_stage_geometry_coarse = {
    .name = "geometry-coarse",
    .title = "coarse geometry",
    .version = 2,
    .extension = ".mesh",
    .set = LUMI_SET_KEPT,
    .bytes_per_pixel = 45,
    .key = key,
    .begin = coarse_begin,
    .end = coarse_end,
    .make = coarse_make,
};
