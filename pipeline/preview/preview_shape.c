/* What a view's pixels lie on: a sphere about the place at first, then what matching finds. */
#include "pipeline/preview/preview_priv.h"
#include "proto/base/memory.h"

#include <math.h>
#include <string.h>

#define FIRST_DISTANCE 3.0 /* metres, before anything is known */
#define PROXY_CELLS 4      /* of a tile, each way */
#define SHAPE_CELLS 16

/* ---- meshes ---- */

/* A lattice of cells × cells squares a tile, whose corners lie where `depth_at` (inverse, along the axis) says. The
 * finished field's meshes take a hundred times as long to make; these show as much in views of this size. */
struct lattice {
    int cells;
    double w_max; /* nothing is nearer */
    double (*depth_at)(const struct lattice *lattice, double tan_x, double tan_y);
    const struct lumi_preview *preview;
    const struct preview_frame *frame;
    double distance;                /* of the sphere */
    const struct lumi_raster *half; /* a map of inverse depths */
};

static void fill_tile(const struct lattice *lattice, const struct lumi_view_mesh *mesh, int tile)
{
    const struct lumi_grid *grid = &lattice->preview->grid;
    struct lumi_mesh_vertex *vertex = lumi_mesh_vertices(mesh, tile);
    uint16_t *index = lumi_mesh_indices(mesh, tile);
    const int cells = lattice->cells;

    /* One step for all tiles: their edges meet. */
    mesh->tiles[tile].shift = 8;
    for (int y = 0; y <= cells; y++)
        for (int x = 0; x <= cells; x++) {
            const int s = 255 * x / cells, t = 255 * y / cells;
            const uint16_t a = (uint16_t)(y * (cells + 1) + x), c = (uint16_t)(a + cells + 1);
            const uint16_t two[6] = {a, (uint16_t)(a + 1), (uint16_t)(c + 1), a, (uint16_t)(c + 1), c};
            double tan_x, tan_y;
            lumi_grid_unproject(grid, LUMI_TILE * (tile % grid->cols + s / 255.0),
                                LUMI_TILE * (tile / grid->cols + t / 255.0), &tan_x, &tan_y);
            const double d = lattice->depth_at(lattice, tan_x, tan_y) / lattice->w_max * 255;
            *vertex++ = (struct lumi_mesh_vertex){(uint8_t)s, (uint8_t)t, (uint8_t)fmin(fmax(d + 0.5, 0), 255)};
            if (x < cells && y < cells) {
                memcpy(index, two, sizeof two);
                index += 6;
            }
        }
}

static int make_mesh(const struct lattice *lattice, struct lumi_view_mesh *mesh)
{
    const struct lumi_grid *grid = &lattice->preview->grid;
    const int tiles = grid->cols * grid->rows, cells = lattice->cells;
    g_autofree int *vertices = g_new(int, tiles), *triangles = g_new(int, tiles);
    struct lumi_view_mesh made = {0};

    for (int i = 0; i < tiles; i++) {
        vertices[i] = (cells + 1) * (cells + 1);
        triangles[i] = 2 * cells * cells;
    }
    LUMI_TRY(lumi_view_mesh_create(&made, grid->cols, grid->rows, vertices, triangles));
    made.w_step = (float)(lattice->w_max / (255 * 256));
    for (int i = 0; i < tiles; i++)
        fill_tile(lattice, &made, i);
    lumi_view_mesh_finish(mesh);
    *mesh = made;
    return LUMI_OK;
}

/* ---- the sphere ---- */

/* Where the ray (x, y, 1) of the camera meets the sphere. 0: nowhere ahead. */
static double sphere_depth(const struct lattice *lattice, double x, double y)
{
    const struct lumi_pose *pose = &lattice->frame->pose;
    const struct lumi_vec3 ray = lumi_rotate(pose->r, lumi_vec3(x, y, 1));
    const struct lumi_vec3 o = lumi_sub(pose->t, lattice->preview->centre);
    const double a = lumi_dot(ray, ray), b = lumi_dot(ray, o);
    const double c = lumi_dot(o, o) - lattice->distance * lattice->distance, root = b * b - a * c;
    const double z = root >= 0 ? (-b + sqrt(root)) / a : 0;

    return z > 0 ? 1 / z : 0;
}

static int make_proxy(const struct lumi_preview *preview, struct preview_frame *frame, double distance)
{
    const struct lumi_grid *grid = &preview->grid;
    struct lattice lattice = {
        .cells = PROXY_CELLS, .depth_at = sphere_depth, .preview = preview, .frame = frame, .distance = distance};

    for (int i = 0; i <= grid->cols; i++)
        for (int k = 0; k <= grid->rows; k++)
            lattice.w_max = fmax(lattice.w_max, sphere_depth(&lattice, grid->tan_x[i], grid->tan_y[k]));
    lattice.w_max = fmax(1.2 * lattice.w_max, 1e-6);
    return make_mesh(&lattice, &frame->mesh);
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
            const struct lumi_vec3 point = lumi_to_world(&frame->pose, lumi_scale(lumi_vec3(x, y, 1), 1 / w));
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

/* Of the four pixels around a corner the second nearest: edges stay steps, and things two pixels wide stay. */
static double map_depth(const struct lattice *lattice, double tan_x, double tan_y)
{
    const struct lumi_raster *half = lattice->half;
    float w[4];
    double x, y;

    if (!lumi_grid_project(&lattice->preview->half, lumi_vec3(tan_x, tan_y, 1), &x, &y))
        return 0;
    for (int i = 0; i < 4; i++) {
        const int column = CLAMP((int)floor(x - 0.5) + (i & 1), 0, half->width - 1);
        const int row = CLAMP((int)floor(y - 0.5) + (i >> 1), 0, half->height - 1);
        w[i] = lumi_row_f32(half, row)[column];
    }
    const float first = fmaxf(w[0], w[1]), second = fminf(w[0], w[1]);
    const float third = fmaxf(w[2], w[3]), fourth = fminf(w[2], w[3]);
    return (double)(first > third ? fmaxf(second, third) : fmaxf(first, fourth));
}

static int take_mesh(struct lumi_preview *preview, struct preview_frame *frame, const struct lumi_raster *half,
                     struct lumi_error *error)
{
    struct lattice lattice = {
        .cells = SHAPE_CELLS, .depth_at = map_depth, .preview = preview, .frame = frame, .half = half};
    float most = 0;

    for (int y = 0; y < half->height; y++)
        for (int x = 0; x < half->width; x++)
            most = fmaxf(most, lumi_row_f32(half, y)[x]);
    lattice.w_max = fmax((double)most, 1e-6);
    if (make_mesh(&lattice, &frame->mesh) != LUMI_OK)
        return lumi_fail(error, LUMI_ERR_NOMEM, "out of memory");
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
    LUMI_GOTO(code, out, take_mesh(preview, frame, &depth, error));
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
