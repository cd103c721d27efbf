/* A whole field from memory: opened, its first views' meshes looked at and tiles decoded. In fuzzing builds checksums
 * are not compared, so that what lies behind them is reached. */
#include "checks.h"

#include "proto/lightfield/field.h"

enum { VIEWS = 3, TILES = 3 };

static void look_at_mesh(const struct lumi_view_mesh *mesh)
{
    for (int i = 0; i < mesh->cols * mesh->rows; i++)
        for (int k = 0; k < 3 * mesh->tiles[i].triangle_count; k++)
            if (mesh->tiles[i].indices[k] >= mesh->tiles[i].vertex_count)
                abort();
}

static void look_at_view(const struct lumi_field *field, struct lumi_tile_decoder *decoder, int level, int view)
{
    const struct lumi_grid *grid = lumi_field_grid(field, lumi_field_view(field, level, view)->grid);
    const struct lumi_view_mesh *mesh = lumi_field_mesh(field, level, view);
    struct lumi_tile_pixels pixels;
    struct lumi_error error = {0};

    if (mesh)
        look_at_mesh(mesh);
    for (int i = 0; i < grid->cols * grid->rows && i < TILES; i++)
        checked(lumi_field_decode_tile(decoder, level, view, i % grid->cols, i / grid->cols, &pixels, &error), &error);
}

static void read_field(const uint8_t *data, size_t size)
{
    struct lumi_error error = {0};
    struct lumi_tile_decoder *decoder;
    struct lumi_field *field;

    if (checked(lumi_field_open_memory(data, size, "fuzz", 1, &field, &error), &error) != LUMI_OK)
        return;
    if (checked(lumi_tile_decoder_create(field, &decoder, &error), &error) == LUMI_OK)
        for (int level = 0; level < LUMI_LEVELS; level++)
            for (int view = 0; view < lumi_field_info(field)->view_count[level] && view < VIEWS; view++)
                look_at_view(field, decoder, level, view);
    lumi_tile_decoder_destroy(decoder);
    lumi_field_close(field);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    with_and_without_memory(data, size, read_field);
    return 0;
}
