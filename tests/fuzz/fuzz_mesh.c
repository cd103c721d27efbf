/* The decoder of meshes against any bytes; what it accepts is within its limits and survives a round trip. */
#include "checks.h"

#include "proto/lightfield/mesh.h"

/* The same bytes where memory ends: an error, or the mesh. */
static void decode(const uint8_t *data, size_t size)
{
    struct lumi_error error = {0};
    struct lumi_view_mesh mesh;
    struct lumi_reader reader;

    lumi_reader_init(&reader, data + 2, size - 2);
    if (checked(lumi_view_mesh_decode(&reader, 1 + data[0] % 8, 1 + data[1] % 8, &mesh, &error), &error) == LUMI_OK)
        lumi_view_mesh_finish(&mesh);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct lumi_view_mesh mesh, back;
    struct lumi_reader reader;
    struct lumi_writer writer;

    if (size < 2)
        return 0;
    const int cols = 1 + data[0] % 8, rows = 1 + data[1] % 8;
    with_and_without_memory(data, size, decode);
    lumi_reader_init(&reader, data + 2, size - 2);
    if (lumi_view_mesh_decode(&reader, cols, rows, &mesh, NULL) != LUMI_OK)
        return 0;
    lumi_writer_init(&writer);
    lumi_view_mesh_encode(&mesh, &writer);
    lumi_reader_init(&reader, writer.data, writer.size);
    if (lumi_view_mesh_decode(&reader, cols, rows, &back, NULL) != LUMI_OK)
        abort();
    for (int i = 0; i < cols * rows; i++) {
        const struct lumi_tile_mesh *a = &mesh.tiles[i], *b = &back.tiles[i];
        if (a->vertex_count != b->vertex_count || a->triangle_count != b->triangle_count || a->shift > 8)
            abort();
        for (int k = 0; k < 3 * a->triangle_count; k++)
            if (a->indices[k] >= a->vertex_count)
                abort();
    }
    lumi_view_mesh_finish(&mesh);
    lumi_view_mesh_finish(&back);
    lumi_writer_finish(&writer);
    return 0;
}
