/* A whole field from memory: opened, every tile of its first views decoded. In fuzzing builds checksums are not
 * compared, so that what lies behind them is reached. */
#include "proto/lightfield/field.h"

enum { VIEWS = 4, TILES = 16 };

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void decode_view(const struct lumi_field *field, struct lumi_tile_decoder *decoder, int level, int view)
{
    const struct lumi_grid *grid = lumi_field_grid(field, lumi_field_view(field, level, view)->grid);
    struct lumi_tile_pixels pixels;

    for (int i = 0; i < grid->cols * grid->rows && i < TILES; i++)
        (void)lumi_field_decode_tile(decoder, level, view, i % grid->cols, i / grid->cols, &pixels, NULL);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct lumi_tile_decoder *decoder;
    struct lumi_field *field;

    if (lumi_field_open_memory(data, size, "fuzz", 1, &field, NULL) != LUMI_OK)
        return 0;
    if (lumi_tile_decoder_create(field, &decoder, NULL) == LUMI_OK)
        for (int level = 0; level < LUMI_LEVELS; level++)
            for (int view = 0; view < lumi_field_info(field)->view_count[level] && view < VIEWS; view++)
                decode_view(field, decoder, level, view);
    lumi_tile_decoder_destroy(decoder);
    lumi_field_close(field);
    return 0;
}
