/* A view's surface as the eye sees it. */
#include "render/cpu/view_surface.h"

#include "proto/base/memory.h"

#include <math.h>
#include <string.h>

#define DENSE 16 /* pixels a side of a patch made from dense depth */

void lumi_surface_place(struct lumi_surface_view *surface, const struct lumi_view *view, struct lumi_vec3 eye,
                        float disk_scale)
{
    const double *r = view->pose.r;
    struct lumi_vec3 m = lumi_rotate_back(r, lumi_sub(eye, view->pose.t));
    /* The ray's line meets the disk's plane at u = a·dx/dz + m.x, v = a·dy/dz + m.y, with a = −m.z the plane's distance
     * ahead and d the direction in the camera's frame. u ≤ U is a·dx − (U − m.x)·dz ≤ 0, a half-space of directions,
     * and so are the other three. */
    double a = -m.z, s = disk_scale;
    const double normals[4][3] = {{-a, 0, s * view->disk.u_pos - m.x},
                                  {a, 0, s * view->disk.u_neg + m.x},
                                  {0, -a, s * view->disk.v_pos - m.y},
                                  {0, a, s * view->disk.v_neg + m.y}};

    memset(surface, 0, sizeof *surface);
    surface->view = view;
    surface->ex = (float)m.x, surface->ey = (float)m.y, surface->ez = (float)m.z;
    for (int i = 0; i < 3; i++) {
        surface->forward[i] = (float)r[3 * i + 2];
        for (int j = 0; j < 3; j++)
            surface->rt[3 * i + j] = (float)r[3 * j + i];
    }
    for (int i = 0; i < 4; i++) {
        struct lumi_vec3 n = lumi_rotate(r, lumi_vec3(normals[i][0], normals[i][1], normals[i][2]));
        double length = lumi_length(n);
        if (length > 0)
            n = lumi_scale(n, 1 / length);
        surface->sides[i][0] = (float)n.x, surface->sides[i][1] = (float)n.y, surface->sides[i][2] = (float)n.z;
    }
}

int lumi_surface_hidden(const struct lumi_surface_view *surface, const struct lumi_cone *cone)
{
    if (cone->cosine > 1)
        return 1;
    for (int i = 0; i < 4; i++)
        if (lumi_cone_behind(cone, surface->sides[i][0], surface->sides[i][1], surface->sides[i][2], 1))
            return 1;
    return lumi_cone_behind(cone, surface->forward[0], surface->forward[1], surface->forward[2], 1);
}

static struct lumi_surface_vertex make_vertex(const struct lumi_surface_view *surface, double tx, double ty, double w)
{
    const double *r = surface->view->pose.r;
    struct lumi_vec3 d = lumi_vec3(tx - w * surface->ex, ty - w * surface->ey, 1 - w * surface->ez);
    double length = lumi_length(d);
    struct lumi_surface_vertex vertex = {.tx = (float)tx, .ty = (float)ty, .depth = (float)w};

    if (length > 1e-12) {
        d = lumi_rotate(r, lumi_scale(d, 1 / length));
        vertex.x = (float)d.x, vertex.y = (float)d.y, vertex.z = (float)d.z;
        vertex.w = (float)(w / length);
    }
    return vertex;
}

static struct lumi_cone patch_cone(const struct lumi_surface_vertex *v, int count)
{
    const struct lumi_cone all = {0, 0, 1, -1, 2};

    for (int i = 0; i < count; i++)
        if (v[i].x == 0 && v[i].y == 0 && v[i].z == 0) /* the eye sits on a vertex */
            return all;
    return lumi_cone_around(&v->x, &v->y, &v->z, count, (int)(sizeof *v / sizeof(float)));
}

/* The tangent at place s (of 255) between two tile corners; the far corner exactly, as the next tile has it. */
static double corner_tangent(const double *tangents, int tile, int s)
{
    return s == 255 ? tangents[tile + 1] : tangents[tile] + s / 255.0 * (tangents[tile + 1] - tangents[tile]);
}

static int build_mesh(struct lumi_surface_view *surface)
{
    const struct lumi_view_mesh *mesh = surface->view->mesh;
    const struct lumi_grid *grid = surface->view->grid;
    size_t tiles = (size_t)mesh->cols * (size_t)mesh->rows, total = 0;

    for (size_t i = 0; i < tiles; i++)
        total += mesh->tiles[i].vertex_count;
    surface->vertices = lumi_alloc(total + 1, sizeof *surface->vertices);
    surface->patches = lumi_calloc(tiles, sizeof *surface->patches);
    if (!surface->vertices || !surface->patches)
        return LUMI_ERR_NOMEM;
    int at = 0;
    for (int i = 0; i < (int)tiles; i++) {
        const struct lumi_tile_mesh *tile = &mesh->tiles[i];
        struct lumi_patch *patch = &surface->patches[surface->patch_count++];
        *patch = (struct lumi_patch){.tile = i,
                                     .first_vertex = at,
                                     .vertex_count = tile->vertex_count,
                                     .indices = tile->indices,
                                     .triangle_count = tile->triangle_count};
        for (int k = 0; k < tile->vertex_count; k++)
            surface->vertices[at + k] =
                make_vertex(surface, corner_tangent(grid->tan_x, i % mesh->cols, tile->vertices[k].s),
                            corner_tangent(grid->tan_y, i / mesh->cols, tile->vertices[k].t),
                            lumi_mesh_inverse_depth(mesh, tile, tile->vertices[k].d));
        at += tile->vertex_count;
        patch->cone = patch_cone(surface->vertices + patch->first_vertex, patch->vertex_count);
    }
    return LUMI_OK;
}

/* The image position of a dense vertex: pixel centres, the outermost drawn out to the image's edge. */
static double dense_place(int index, int count)
{
    return index <= 0 ? 0 : index >= count - 1 ? count : index + 0.5;
}

/* Two triangles a square of a lattice of cols × rows vertices, clockwise. */
static int lattice(uint16_t *indices, int cols, int rows)
{
    int count = 0;

    for (int y = 0; y + 1 < rows; y++)
        for (int x = 0; x + 1 < cols; x++) {
            uint16_t a = (uint16_t)(y * cols + x), b = (uint16_t)(a + 1), c = (uint16_t)(a + cols),
                     d = (uint16_t)(c + 1);
            const uint16_t two[6] = {a, b, d, a, d, c};
            memcpy(indices + count, two, sizeof two);
            count += 6;
        }
    return count / 3;
}

static void dense_patch(struct lumi_surface_view *surface, struct lumi_patch *patch, int x0, int y0, int cols, int rows)
{
    const struct lumi_grid *grid = surface->view->grid;
    const struct lumi_raster *depth = surface->view->inverse_depth;
    struct lumi_surface_vertex *vertices = surface->vertices + patch->first_vertex;

    for (int y = 0; y < rows; y++)
        for (int x = 0; x < cols; x++) {
            double tx, ty;
            /* A picture one pixel wide still has two sides. */
            int px = x0 + x < grid->width ? x0 + x : grid->width - 1, py = y0 + y < grid->height ? y0 + y : y0 + y - 1;
            lumi_grid_unproject(grid, grid->width == 1 ? x : dense_place(px, grid->width),
                                grid->height == 1 ? y : dense_place(py, grid->height), &tx, &ty);
            vertices[y * cols + x] = make_vertex(surface, tx, ty, fmaxf(0, lumi_row_f32(depth, py)[px]));
        }
    patch->vertex_count = cols * rows;
    patch->tile = y0 / LUMI_TILE * grid->cols + x0 / LUMI_TILE;
    patch->cone = patch_cone(vertices, patch->vertex_count);
}

static int build_dense(struct lumi_surface_view *surface)
{
    const struct lumi_grid *grid = surface->view->grid;
    int squares_x = grid->width > 1 ? grid->width - 1 : 1, squares_y = grid->height > 1 ? grid->height - 1 : 1;
    int cols = (squares_x + DENSE - 1) / DENSE, rows = (squares_y + DENSE - 1) / DENSE;
    const size_t per_patch = (DENSE + 1) * (DENSE + 1), per_lattice = DENSE * DENSE * 6;

    surface->vertices = lumi_alloc((size_t)cols * (size_t)rows * per_patch, sizeof *surface->vertices);
    surface->patches = lumi_calloc((size_t)cols * (size_t)rows, sizeof *surface->patches);
    surface->block_indices = lumi_alloc(4 * per_lattice, sizeof *surface->block_indices);
    if (!surface->vertices || !surface->patches || !surface->block_indices)
        return LUMI_ERR_NOMEM;
    /* Full patches, those cut on the right, at the bottom, and the one cut on both sides. */
    int last_x = squares_x - (cols - 1) * DENSE, last_y = squares_y - (rows - 1) * DENSE, triangles[4];
    for (int i = 0; i < 4; i++)
        triangles[i] = lattice(surface->block_indices + (size_t)i * per_lattice, (i & 1 ? last_x : DENSE) + 1,
                               (i & 2 ? last_y : DENSE) + 1);
    for (int y = 0; y < rows; y++)
        for (int x = 0; x < cols; x++) {
            int kind = (x == cols - 1 ? 1 : 0) | (y == rows - 1 ? 2 : 0);
            struct lumi_patch *patch = &surface->patches[surface->patch_count];
            patch->first_vertex = (int)((size_t)surface->patch_count * per_patch);
            patch->indices = surface->block_indices + (size_t)kind * per_lattice;
            patch->triangle_count = triangles[kind];
            dense_patch(surface, patch, x * DENSE, y * DENSE, (kind & 1 ? last_x : DENSE) + 1,
                        (kind & 2 ? last_y : DENSE) + 1);
            surface->patch_count++;
        }
    return LUMI_OK;
}

static void tile_maps(float *map, const double *tangents, int tiles)
{
    for (int i = 0; i < tiles; i++) {
        double slope = LUMI_TILE / (tangents[i + 1] - tangents[i]);
        map[2 * i] = (float)slope;
        map[2 * i + 1] = (float)(LUMI_TILE * i - slope * tangents[i]);
    }
}

int lumi_surface_build(struct lumi_surface_view *surface)
{
    const struct lumi_grid *grid = surface->view->grid;

    surface->tile_x = lumi_alloc((size_t)grid->cols * 2, sizeof(float));
    surface->tile_y = lumi_alloc((size_t)grid->rows * 2, sizeof(float));
    int code = surface->tile_x && surface->tile_y ? LUMI_OK : LUMI_ERR_NOMEM;
    if (code == LUMI_OK && surface->view->mesh)
        code = build_mesh(surface);
    else if (code == LUMI_OK && surface->view->inverse_depth)
        code = build_dense(surface);
    if (code != LUMI_OK) {
        lumi_surface_finish(surface);
        return code;
    }
    tile_maps(surface->tile_x, grid->tan_x, grid->cols);
    tile_maps(surface->tile_y, grid->tan_y, grid->rows);
    return LUMI_OK;
}

void lumi_surface_finish(struct lumi_surface_view *surface)
{
    lumi_free(surface->vertices);
    lumi_free(surface->patches);
    lumi_free(surface->block_indices);
    lumi_free(surface->tile_x);
    lumi_free(surface->tile_y);
    surface->vertices = NULL;
    surface->patches = NULL;
    surface->block_indices = NULL;
    surface->tile_x = surface->tile_y = NULL;
    surface->patch_count = 0;
}
