/* The memory of a view's meshes. */
#include "proto/lightfield/mesh.h"

#include "proto/base/memory.h"
#include "proto/lightfield/grid.h"
#include "proto/lightfield/mesh_compact.h"

#include <string.h>

int lumi_view_mesh_create(struct lumi_view_mesh *mesh, int cols, int rows, const int *vertex_counts,
                          const int *triangle_counts)
{
    size_t vertices = 0, indices = 0;

    *mesh = (struct lumi_view_mesh){0};
    if (cols < 1 || rows < 1 || cols > LUMI_GRID_MAX || rows > LUMI_GRID_MAX)
        return LUMI_ERR_ARG;
    for (int i = 0; i < cols * rows; i++) {
        if (vertex_counts[i] < 0 || vertex_counts[i] > LUMI_MESH_MAX_VERTICES || triangle_counts[i] < 0 ||
            triangle_counts[i] > LUMI_MESH_MAX_TRIANGLES)
            return LUMI_ERR_ARG;
        vertices += (size_t)vertex_counts[i];
        indices += 3 * (size_t)triangle_counts[i];
    }
    mesh->tiles = lumi_calloc((size_t)(cols * rows), sizeof *mesh->tiles);
    mesh->block = lumi_calloc(1, indices * sizeof(uint16_t) + vertices * sizeof(struct lumi_mesh_vertex));
    if (!mesh->tiles || !mesh->block) {
        lumi_view_mesh_finish(mesh);
        return LUMI_ERR_NOMEM;
    }
    mesh->cols = cols;
    mesh->rows = rows;
    uint16_t *index = mesh->block;
    struct lumi_mesh_vertex *vertex = (struct lumi_mesh_vertex *)(index + indices);
    for (int i = 0; i < cols * rows; i++) {
        mesh->tiles[i] = (struct lumi_tile_mesh){.vertex_count = (uint16_t)vertex_counts[i],
                                                 .triangle_count = (uint16_t)triangle_counts[i],
                                                 .vertices = vertex,
                                                 .indices = index};
        vertex += vertex_counts[i];
        index += 3 * triangle_counts[i];
    }
    return LUMI_OK;
}

void lumi_view_mesh_finish(struct lumi_view_mesh *mesh)
{
    lumi_free(mesh->tiles);
    lumi_free(mesh->block);
    *mesh = (struct lumi_view_mesh){0};
}

int lumi_view_mesh_copy(const struct lumi_view_mesh *mesh, struct lumi_view_mesh *copy)
{
    const int tiles = mesh->cols * mesh->rows;
    int *counts = lumi_alloc(2 * (size_t)tiles, sizeof *counts);

    *copy = (struct lumi_view_mesh){0};
    if (!counts)
        return LUMI_ERR_NOMEM;
    for (int i = 0; i < tiles; i++) {
        counts[i] = mesh->tiles[i].vertex_count;
        counts[tiles + i] = mesh->tiles[i].triangle_count;
    }
    const int result = lumi_view_mesh_create(copy, mesh->cols, mesh->rows, counts, counts + tiles);
    lumi_free(counts);
    if (result != LUMI_OK)
        return result;
    copy->w_min = mesh->w_min;
    copy->w_step = mesh->w_step;
    for (int i = 0; i < tiles; i++) {
        const struct lumi_tile_mesh *t = &mesh->tiles[i];
        copy->tiles[i].base = t->base;
        copy->tiles[i].shift = t->shift;
        memcpy(lumi_mesh_vertices(copy, i), t->vertices, t->vertex_count * sizeof *t->vertices);
        memcpy(lumi_mesh_indices(copy, i), t->indices, 3u * t->triangle_count * sizeof *t->indices);
    }
    return LUMI_OK;
}

int lumi_mesh_extent(const struct lumi_tile_mesh *tile, bool vertical)
{
    int most = 0;

    for (int k = 0; k < tile->vertex_count; k++) {
        const int at = vertical ? tile->vertices[k].t : tile->vertices[k].s;
        most = at > most ? at : most;
    }
    return most;
}
