/* The coding of a view's meshes (docs/lumi-format.md, "Geometry").
 *
 *   u8   form: 0 plain, 1 compact
 *   f32  w_min, f32 w_step
 *   plain: for each tile its vertex count and triangle count (varints); then for each tile u8 shift, u16 base, three
 *          bytes a vertex (s, t, d), a varint an index.
 *   compact: mesh_compact.c */
#include "proto/lightfield/mesh.h"

#include "proto/base/memory.h"
#include "proto/lightfield/grid.h"
#include "proto/lightfield/mesh_compact.h"

#include <math.h>

enum { FORM_PLAIN = 0, FORM_COMPACT = 1 };

static void encode_plain(const struct lumi_view_mesh *mesh, struct lumi_writer *writer)
{
    for (int i = 0; i < mesh->cols * mesh->rows; i++) {
        lumi_write_varint(writer, mesh->tiles[i].vertex_count);
        lumi_write_varint(writer, mesh->tiles[i].triangle_count);
    }
    for (int i = 0; i < mesh->cols * mesh->rows; i++) {
        const struct lumi_tile_mesh *tile = &mesh->tiles[i];
        lumi_write_u8(writer, tile->shift);
        lumi_write_u16(writer, tile->base);
        for (int v = 0; v < tile->vertex_count; v++) {
            lumi_write_u8(writer, tile->vertices[v].s);
            lumi_write_u8(writer, tile->vertices[v].t);
            lumi_write_u8(writer, tile->vertices[v].d);
        }
        for (int k = 0; k < 3 * tile->triangle_count; k++)
            lumi_write_varint(writer, tile->indices[k]);
    }
}

void lumi_view_mesh_encode(const struct lumi_view_mesh *mesh, struct lumi_writer *writer)
{
    const size_t start = writer->size;

    lumi_write_u8(writer, FORM_COMPACT);
    lumi_write_f32(writer, mesh->w_min);
    lumi_write_f32(writer, mesh->w_step);
    if (writer->failed || lumi_mesh_compact_encode(mesh, writer))
        return;
    writer->data[start] = FORM_PLAIN;
    encode_plain(mesh, writer);
}

/* Reads the counts of all tiles and allocates for them. A vertex takes at least three bytes, a triangle three: counts
 * that the bytes left cannot hold are refused before anything is allocated for them. */
static int create_plain(struct lumi_reader *reader, int cols, int rows, struct lumi_view_mesh *mesh,
                        struct lumi_error *error)
{
    size_t tiles = (size_t)cols * (size_t)rows, total = 0;
    int *counts = lumi_alloc(2 * tiles, sizeof *counts);
    int result = LUMI_OK;

    if (!counts)
        return lumi_fail(error, LUMI_ERR_NOMEM, "mesh: out of memory");
    for (size_t i = 0; i < tiles; i++) {
        uint64_t vertices = lumi_read_varint(reader), triangles = lumi_read_varint(reader);
        if (vertices > LUMI_MESH_MAX_VERTICES || triangles > LUMI_MESH_MAX_TRIANGLES) {
            result = lumi_fail(error, LUMI_ERR_FORMAT, "mesh: too many vertices or triangles in a tile");
            goto done;
        }
        counts[i] = (int)vertices;
        counts[tiles + i] = (int)triangles;
        total += 3 * (vertices + triangles);
    }
    if (reader->failed || total > lumi_reader_left(reader)) {
        result = lumi_fail(error, LUMI_ERR_FORMAT, "mesh: cut short");
        goto done;
    }
    result = lumi_view_mesh_create(mesh, cols, rows, counts, counts + tiles);
    if (result != LUMI_OK)
        lumi_fail(error, result, "mesh: out of memory");
done:
    lumi_free(counts);
    return result;
}

static int decode_plain(struct lumi_reader *reader, struct lumi_view_mesh *mesh, struct lumi_error *error)
{
    for (int i = 0; i < mesh->cols * mesh->rows; i++) {
        struct lumi_tile_mesh *tile = &mesh->tiles[i];
        struct lumi_mesh_vertex *vertices = lumi_mesh_vertices(mesh, i);
        uint16_t *indices = lumi_mesh_indices(mesh, i);
        tile->shift = lumi_read_u8(reader);
        tile->base = lumi_read_u16(reader);
        if (tile->shift > 8)
            return lumi_fail(error, LUMI_ERR_FORMAT, "mesh: a depth step out of range");
        for (int v = 0; v < tile->vertex_count; v++) {
            vertices[v].s = lumi_read_u8(reader);
            vertices[v].t = lumi_read_u8(reader);
            vertices[v].d = lumi_read_u8(reader);
        }
        for (int k = 0; k < 3 * tile->triangle_count; k++) {
            uint64_t index = lumi_read_varint(reader);
            if (index >= tile->vertex_count)
                return lumi_fail(error, LUMI_ERR_FORMAT, "mesh: a triangle names a vertex that is not there");
            indices[k] = (uint16_t)index;
        }
    }
    if (reader->failed)
        return lumi_fail(error, LUMI_ERR_FORMAT, "mesh: cut short");
    return LUMI_OK;
}

int lumi_view_mesh_decode(struct lumi_reader *reader, int cols, int rows, struct lumi_view_mesh *mesh,
                          struct lumi_error *error)
{
    *mesh = (struct lumi_view_mesh){0};
    if (cols < 1 || rows < 1 || cols > LUMI_GRID_MAX || rows > LUMI_GRID_MAX)
        return lumi_fail(error, LUMI_ERR_ARG, "mesh: %d × %d tiles", cols, rows);
    uint8_t form = lumi_read_u8(reader);
    float w_min = lumi_read_f32(reader), w_step = lumi_read_f32(reader);
    if (reader->failed || form > FORM_COMPACT)
        return lumi_fail(error, LUMI_ERR_FORMAT, "mesh: not a mesh");
    if (!isfinite(w_min) || !isfinite(w_step) || w_min < 0 || w_step < 0)
        return lumi_fail(error, LUMI_ERR_FORMAT, "mesh: a range of depth that is none");
    int result;
    if (form == FORM_COMPACT) {
        result = lumi_mesh_compact_decode(reader, cols, rows, mesh, error);
    } else {
        result = create_plain(reader, cols, rows, mesh, error);
        if (result == LUMI_OK)
            result = decode_plain(reader, mesh, error);
        if (result != LUMI_OK)
            lumi_view_mesh_finish(mesh);
    }
    if (result == LUMI_OK) {
        mesh->w_min = w_min;
        mesh->w_step = w_step;
    }
    return result;
}
