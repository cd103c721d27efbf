/* What a view's pixels lie on: a sphere about the place at first, then what matching finds. */
#include "pipeline/geometry/simplify.h"
#include "pipeline/preview/preview_priv.h"
#include "proto/base/memory.h"

#include <math.h>
#include <string.h>

#define FIRST_DISTANCE 3.0   /* metres, before anything is known */
#define PROXY_CELLS 4        /* of a tile, each way */
#define PROXY_EDGE (PROXY_CELLS + 1)
#define TRIANGLES_A_TILE 24 /* tiles of these views are large: a full view's is a quarter of its angle or less */

/* ---- the sphere ---- */

/* Inverse depth along the axis where the ray (x, y, 1) of the camera meets the sphere. 0: nowhere ahead. */
static double sphere_depth(const struct lumi_pose *pose, struct lumi_vec3 centre, double distance, double x, double y)
{
    const struct lumi_vec3 ray = lumi_rotate(pose->r, lumi_vec3(x, y, 1)), o = lumi_sub(pose->t, centre);
    const double a = lumi_dot(ray, ray), b = lumi_dot(ray, o), c = lumi_dot(o, o) - distance * distance;
    const double root = b * b - a * c;
    const double z = root >= 0 ? (-b + sqrt(root)) / a : 0;

    return z > 0 ? 1 / z : 0;
}

static void fill_tile(const struct lumi_view_mesh *mesh, int tile, const double w[PROXY_EDGE][PROXY_EDGE])
{
    struct lumi_mesh_vertex *vertex = lumi_mesh_vertices(mesh, tile);
    uint16_t *index = lumi_mesh_indices(mesh, tile);

    mesh->tiles[tile].shift = 8;
    for (int y = 0; y < PROXY_EDGE; y++)
        for (int x = 0; x < PROXY_EDGE; x++) {
            const uint16_t a = (uint16_t)(y * PROXY_EDGE + x), b = (uint16_t)(a + 1), c = (uint16_t)(a + PROXY_EDGE);
            const uint16_t two[6] = {a, b, (uint16_t)(c + 1), a, (uint16_t)(c + 1), c};
            *vertex++ = (struct lumi_mesh_vertex){(uint8_t)(255 * x / PROXY_CELLS), (uint8_t)(255 * y / PROXY_CELLS),
                                                  (uint8_t)fmin(w[y][x] / mesh->w_step / 256 + 0.5, 255)};
            if (x < PROXY_CELLS && y < PROXY_CELLS) {
                memcpy(index, two, sizeof two);
                index += 6;
            }
        }
}

static int make_proxy(const struct lumi_preview *preview, struct preview_frame *frame, double distance)
{
    const struct lumi_grid *grid = &preview->grid;
    const int tiles = grid->cols * grid->rows;
    int counts[2][LUMI_GRID_MAX * LUMI_GRID_MAX];
    double w[PROXY_EDGE][PROXY_EDGE];

    for (int i = 0; i < tiles; i++) {
        counts[0][i] = PROXY_EDGE * PROXY_EDGE;
        counts[1][i] = 2 * PROXY_CELLS * PROXY_CELLS;
    }
    lumi_view_mesh_finish(&frame->mesh);
    LUMI_TRY(lumi_view_mesh_create(&frame->mesh, grid->cols, grid->rows, counts[0], counts[1]));
    /* The greatest inverse depth: the sphere is nowhere nearer than along the axis divided by the tangents' length. */
    const double nearest = fmax(distance - lumi_length(lumi_sub(frame->pose.t, preview->centre)), distance / 8);
    frame->mesh.w_step = (float)(4 / nearest / 65535);
    for (int tile = 0; tile < tiles; tile++) {
        for (int y = 0; y < PROXY_EDGE; y++)
            for (int x = 0; x < PROXY_EDGE; x++) {
                double tan_x, tan_y;
                lumi_grid_unproject(grid, LUMI_TILE * (tile % grid->cols + (255 * x / PROXY_CELLS) / 255.0),
                                    LUMI_TILE * (tile / grid->cols + (255 * y / PROXY_CELLS) / 255.0), &tan_x, &tan_y);
                w[y][x] = sphere_depth(&frame->pose, preview->centre, distance, tan_x, tan_y);
            }
        fill_tile(&frame->mesh, tile, w);
    }
    return LUMI_OK;
}

int preview_place_proxies(struct lumi_preview *preview, struct lumi_error *error)
{
    const double most = preview->radius > 0 ? 1 / (1.5 * preview->radius) : 1e3;
    double nearness = preview->nearness > 0 ? preview->nearness : 1 / fmax(FIRST_DISTANCE, 3 * preview->radius);

    nearness = fmin(fmax(nearness, 1e-4), most);
    for (guint i = 0; i < preview->frames->len; i++) {
        struct preview_frame *frame = preview_frame(preview, (int)i);
        if (frame->state != PREVIEW_LOADED || frame->shaped || frame->proxy == nearness)
            continue;
        if (make_proxy(preview, frame, 1 / nearness) != LUMI_OK)
            return lumi_fail(error, LUMI_ERR_NOMEM, "%s: out of memory", preview->path);
        frame->proxy = nearness;
    }
    return LUMI_OK;
}

/* ---- matching ---- */

static struct lumi_mvs_view small_view(const struct lumi_preview *preview, const struct preview_frame *frame)
{
    return (struct lumi_mvs_view){.grid = &preview->half, .pose = frame->pose, .image = frame->small};
}

/* At the view's own size: the nearest pixel, so that edges stay steps. */
static int enlarge(const struct lumi_preview *preview, const struct lumi_raster *half, struct lumi_raster *full)
{
    const struct lumi_grid *grid = &preview->grid;
    g_autofree int *columns = g_new(int, grid->width);
    double tan_x, tan_y, x, y = 0;

    LUMI_TRY(lumi_raster_create(full, grid->width, grid->height, 1, LUMI_F32));
    for (int i = 0; i < grid->width; i++) {
        lumi_grid_unproject(grid, i + 0.5, 0.5, &tan_x, &tan_y);
        lumi_grid_project(&preview->half, lumi_vec3(tan_x, tan_y, 1), &x, &y);
        columns[i] = CLAMP((int)x, 0, half->width - 1);
    }
    for (int j = 0; j < grid->height; j++) {
        lumi_grid_unproject(grid, 0.5, j + 0.5, &tan_x, &tan_y);
        lumi_grid_project(&preview->half, lumi_vec3(tan_x, tan_y, 1), &x, &y);
        const float *in = lumi_row_f32(half, CLAMP((int)y, 0, half->height - 1));
        float *out = lumi_row_f32(full, j);
        for (int i = 0; i < grid->width; i++)
            out[i] = in[columns[i]];
    }
    return LUMI_OK;
}

/* Mean inverse distance from the centre of what the map shows. */
static double nearness_of(const struct lumi_preview *preview, const struct preview_frame *frame,
                          const struct lumi_raster *half)
{
    enum { STEP = 8 };
    double sum = 0;
    int count = 0;

    for (int j = STEP / 2; j < half->height; j += STEP)
        for (int i = STEP / 2; i < half->width; i += STEP, count++) {
            const double w = (double)lumi_row_f32(half, j)[i];
            double x, y;
            if (!(w > 1e-6))
                continue;
            lumi_grid_unproject(&preview->half, i + 0.5, j + 0.5, &x, &y);
            const struct lumi_vec3 point =
                lumi_to_world(&frame->pose, lumi_scale(lumi_vec3(x, y, 1), 1 / w));
            sum += 1 / fmax(lumi_length(lumi_sub(point, preview->centre)), 1e-3);
        }
    return count ? sum / count : 0;
}

void preview_measure_nearness(struct lumi_preview *preview)
{
    double sum = 0;
    int count = 0;

    for (guint i = 0; i < preview->frames->len; i++) {
        const struct preview_frame *frame = preview_frame(preview, (int)i);
        if (frame->state != PREVIEW_LOADED || !frame->shaped)
            continue;
        sum += frame->nearness;
        count++;
    }
    if (count)
        preview->nearness = sum / count;
}

/* Pixels that 1/m of inverse depth moves a point from one view to the next. */
static double disparity_of(const struct lumi_preview *preview, const struct preview_frame *frame,
                           struct preview_frame *const *neighbours, int count)
{
    const struct lumi_grid *grid = &preview->grid;
    const int middle = grid->cols / 2;
    double sum = 0;

    for (int i = 0; i < count; i++)
        sum += lumi_length(lumi_sub(neighbours[i]->pose.t, frame->pose.t)) / count;
    return sum * LUMI_TILE / (grid->tan_x[middle + 1] - grid->tan_x[middle]);
}

static int take_mesh(struct lumi_preview *preview, struct preview_frame *frame, const struct lumi_raster *half,
                     double disparity, struct lumi_error *error)
{
    struct lumi_simplify_options options;
    struct lumi_view_mesh mesh = {0};
    struct lumi_raster full = {0};

    lumi_simplify_defaults(&options);
    options.triangles_per_tile = TRIANGLES_A_TILE;
    options.disparity = disparity;
    if (enlarge(preview, half, &full) != LUMI_OK)
        return lumi_fail(error, LUMI_ERR_NOMEM, "out of memory");
    const int code = lumi_simplify(&full, NULL, &preview->grid, &options, &mesh, error);
    lumi_raster_finish(&full);
    if (code != LUMI_OK)
        return code;
    lumi_view_mesh_finish(&frame->mesh);
    frame->mesh = mesh;
    frame->proxy = -1;
    return LUMI_OK;
}

int preview_shape(struct lumi_preview *preview, struct preview_frame *frame, struct preview_frame *const *neighbours,
                  int neighbour_count, struct lumi_error *error)
{
    const struct lumi_mvs_view view = small_view(preview, frame);
    struct lumi_mvs_view others[LUMI_MVS_NEIGHBOURS];
    struct lumi_mvs_settings settings;
    struct lumi_raster depth = {0};
    int code;

    for (int i = 0; i < neighbour_count; i++)
        others[i] = small_view(preview, neighbours[i]);
    lumi_mvs_defaults(&settings);
    LUMI_GOTO(code, out,
              lumi_mvs_match(&view, neighbour_count, others, &settings, preview->options.threads, &depth, error));
    LUMI_GOTO(code, out,
              take_mesh(preview, frame, &depth, disparity_of(preview, frame, neighbours, neighbour_count), error));
    frame->nearness = nearness_of(preview, frame, &depth);
    frame->shaped = true;
    frame->stale = false;
    frame->neighbour_count = neighbour_count;
    for (int i = 0; i < neighbour_count; i++)
        frame->neighbours[i] = neighbours[i]->id;
out:
    lumi_raster_finish(&depth);
    if (code != LUMI_OK)
        lumi_fail_prefix(error, "%s: %s", preview->path, frame->name);
    return code;
}
