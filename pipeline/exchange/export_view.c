/* Depth and mesh of one view, from a field or from a work directory. */
#include "pipeline/exchange/export_view.h"

#include "pipeline/equiangular/plan.h"
#include "pipeline/exchange/view_export.h"
#include "pipeline/run/run.h"
#include "proto/base/file.h"
#include "proto/base/memory.h"
#include "proto/image/image.h"
#include "proto/lightfield/field.h"
#include "proto/lightfield/mesh_raster.h"
#include "proto/lightfield/yuv.h"

#include <glib.h>
#include <stdlib.h>
#include <string.h>

/* The view called so; otherwise its number. −1: neither. */
static int number_of(const char *view, int count)
{
    char *end;
    long number = strtol(view, &end, 10);

    return end != view && !*end && number >= 0 && number < count ? (int)number : -1;
}

/* From a field */

static int decode_tiles(struct lumi_tile_decoder *decoder, const struct lumi_grid *grid, int view,
                        const struct lumi_yuv *image, struct lumi_error *error)
{
    for (int row = 0; row < grid->rows; row++)
        for (int column = 0; column < grid->cols; column++) {
            struct lumi_tile_pixels tile;
            LUMI_TRY(lumi_field_decode_tile(decoder, LUMI_LEVEL_FINE, view, column, row, &tile, error));
            lumi_tile_place(&tile, column, row, image);
        }
    return LUMI_OK;
}

/* The pixels of a view, U8 RGB. */
static int decode_view(const struct lumi_field *field, const struct lumi_grid *grid, int view,
                       struct lumi_raster *image, struct lumi_error *error)
{
    struct lumi_tile_decoder *decoder = NULL;
    struct lumi_yuv yuv = {0};
    int code;

    LUMI_GOTO(code, out, lumi_tile_decoder_create(field, &decoder, error));
    LUMI_GOTO(code, nomem, lumi_yuv_create(&yuv, grid->width, grid->height));
    LUMI_GOTO(code, nomem, lumi_raster_create(image, grid->width, grid->height, 3, LUMI_U8));
    LUMI_GOTO(code, out, decode_tiles(decoder, grid, view, &yuv, error));
    code = lumi_yuv_to_raster(&yuv, image);
    goto out;
nomem:
    lumi_fail(error, code, "no memory for a view of %dx%d pixels", grid->width, grid->height);
out:
    lumi_yuv_finish(&yuv);
    lumi_tile_decoder_destroy(decoder);
    return code;
}

static int export_field_view(const struct lumi_export_view *export, const struct lumi_field *field, int view,
                             struct lumi_error *error)
{
    const struct lumi_field_view *v = lumi_field_view(field, LUMI_LEVEL_FINE, view);
    const struct lumi_grid *grid = lumi_field_grid(field, v->grid);
    const struct lumi_view_mesh *mesh = lumi_field_mesh(field, LUMI_LEVEL_FINE, view);
    struct lumi_raster depth = {0}, image = {0};
    int code = LUMI_OK;

    if (export->depth) {
        code = lumi_mesh_rasterize(mesh, grid->width, grid->height, &depth);
        if (code != LUMI_OK)
            LUMI_GOTO(code, out, lumi_fail(error, code, "%s: no memory for the depth of a view", export->source));
        LUMI_GOTO(code, out, lumi_export_depth(export->depth, &depth, error));
    }
    if (export->mesh) {
        LUMI_GOTO(code, out, decode_view(field, grid, view, &image, error));
        code = lumi_export_mesh(export->mesh, grid, &v->pose, mesh, &image, export->far_m, error);
    }
out:
    lumi_raster_finish(&depth);
    lumi_raster_finish(&image);
    return code;
}

static int export_field(const struct lumi_export_view *export, struct lumi_error *error)
{
    struct lumi_field *field;

    LUMI_TRY(lumi_field_open(export->source, 0, &field, error));
    int count = lumi_field_info(field)->view_count[LUMI_LEVEL_FINE], view = -1;
    for (int i = 0; i < count && view < 0; i++)
        if (!strcmp(lumi_field_view(field, LUMI_LEVEL_FINE, i)->name, export->view))
            view = i;
    view = view >= 0 ? view : number_of(export->view, count);
    int code = view >= 0 ? export_field_view(export, field, view, error)
                         : lumi_fail(error, LUMI_ERR_NOTFOUND, "%s: has no view '%s'", export->source, export->view);
    lumi_field_close(field);
    return code;
}

/* From a work directory */

static int look_for(const char *path, const struct lumi_run *run, const char *stage, int view, struct lumi_error *error)
{
    if (g_file_test(path, G_FILE_TEST_EXISTS))
        return LUMI_OK;
    return lumi_fail(error, LUMI_ERR_NOTFOUND, "%s: is not there: stage '%s' has not been run for view '%s'", path,
                     stage, run->sources[view].name);
}

/* The file a stage made for a view, or a line that says that it has not. */
static int stage_file(const struct lumi_run *run, const char *stage, int view, const char *extension, char **path,
                      struct lumi_error *error)
{
    *path = lumi_run_path(run, stage, view, extension);
    return look_for(*path, run, stage, view, error);
}

static int view_file(const struct lumi_run *run, enum lumi_view_part part, const char *stage, int view, char **path,
                     struct lumi_error *error)
{
    *path = lumi_run_view(run, view, part);
    return look_for(*path, run, stage, view, error);
}

static int export_work_depth(const struct lumi_export_view *export, const struct lumi_run *run, int view,
                             struct lumi_error *error)
{
    g_autofree char *path = NULL;
    struct lumi_raster depth = {0};

    LUMI_TRY(view_file(run, LUMI_VIEW_DEPTH, "depth", view, &path, error));
    int code = lumi_image_read_channel(path, "W", &depth, error);
    if (code == LUMI_OK)
        code = lumi_export_depth(export->depth, &depth, error);
    lumi_raster_finish(&depth);
    return code;
}

static int read_mesh(const struct lumi_grid *grid, const char *path, struct lumi_view_mesh *mesh,
                     struct lumi_error *error)
{
    struct lumi_reader reader;
    uint8_t *data;
    size_t size;

    LUMI_TRY(lumi_file_read(path, (size_t)1 << 30, &data, &size, error));
    lumi_reader_init(&reader, data, size);
    int code = lumi_view_mesh_decode(&reader, grid->cols, grid->rows, mesh, error);
    if (code != LUMI_OK)
        lumi_fail_prefix(error, "%s", path);
    lumi_free(data);
    return code;
}

static int export_work_mesh(const struct lumi_export_view *export, struct lumi_run *run, int view,
                            struct lumi_error *error)
{
    g_autofree char *mesh_path = NULL, *image_path = NULL;
    struct lumi_raster linear = {0}, image = {0};
    struct lumi_view_mesh mesh = {0};
    int code;

    LUMI_TRY(stage_file(run, "geometry", view, ".mesh", &mesh_path, error));
    LUMI_TRY(view_file(run, LUMI_VIEW_PICTURE, "equiangular", view, &image_path, error));
    LUMI_TRY(lumi_equiangular_plan(run, error));
    LUMI_TRY(lumi_image_read(image_path, 3, &linear, NULL, error));
    if (linear.width != run->grid.width || linear.height != run->grid.height)
        LUMI_GOTO(code, out,
                  lumi_fail(error, LUMI_ERR_UNSUPPORTED,
                            "%s: was made with a projection of its own: export from the .lumi file", image_path));
    LUMI_GOTO(code, out, read_mesh(&run->grid, mesh_path, &mesh, error));
    code = lumi_raster_convert(&linear, LUMI_U8, &image);
    if (code != LUMI_OK)
        LUMI_GOTO(code, out, lumi_fail(error, code, "%s: no memory to convert it", image_path));
    code = lumi_export_mesh(export->mesh, &run->grid, &run->sources[view].pose, &mesh, &image, export->far_m, error);
out:
    lumi_view_mesh_finish(&mesh);
    lumi_raster_finish(&linear);
    lumi_raster_finish(&image);
    return code;
}

static int export_work(const struct lumi_export_view *export, struct lumi_error *error)
{
    g_autofree char *beside = g_strconcat(export->source, ".work", NULL);
    const char *work = export->work ? export->work : beside;
    struct lumi_parameters parameters;
    struct lumi_run *run;
    int view = -1, code = LUMI_OK;

    if (!g_file_test(work, G_FILE_TEST_IS_DIR)) /* lumi_run_open would make it */
        return lumi_fail(error, LUMI_ERR_NOTFOUND, "%s: is not there: the capture has not been processed", work);
    lumi_run_defaults(&parameters);
    LUMI_TRY(lumi_run_open(export->source, work, &parameters, 0, false, &run, error));
    code = lumi_run_place(run, error);
    for (int i = 0; code == LUMI_OK && i < run->count && view < 0; i++)
        if (!strcmp(run->sources[i].name, export->view))
            view = i;
    view = view >= 0 ? view : number_of(export->view, run->count);
    if (code == LUMI_OK && view < 0)
        code = lumi_fail(error, LUMI_ERR_NOTFOUND, "%s: has no view '%s'", export->source, export->view);
    if (code == LUMI_OK && export->depth)
        code = export_work_depth(export, run, view, error);
    if (code == LUMI_OK && export->mesh)
        code = export_work_mesh(export, run, view, error);
    lumi_run_close(run);
    return code;
}

int lumi_export_view(const struct lumi_export_view *export, struct lumi_error *error)
{
    if (export->depth)
        LUMI_TRY(lumi_file_check_output(export->depth, export->source, error));
    if (export->mesh)
        LUMI_TRY(lumi_file_check_output(export->mesh, export->source, error));
    return g_file_test(export->source, G_FILE_TEST_IS_DIR) ? export_work(export, error) : export_field(export, error);
}
