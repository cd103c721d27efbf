/* The decoder of a single tile. The input is a priming (lumi_priming_read), then tiles as lumi_cluster_read_tile has
 * them, each decoded with windows of a small reference image. */
#include "checks.h"

#include "proto/lightfield/cluster_code.h"

enum { WIDTH = 96, HEIGHT = 80, TILES = 8 };

static void decode_tiles(struct lumi_reader *reader, const struct lumi_priming *priming,
                         const struct lumi_yuv *reference)
{
    struct lumi_tile_pixels pixels;
    struct lumi_tile_core *core;
    struct lumi_tile_code code;

    if (lumi_tile_core_create(priming, reference, &core, NULL) != LUMI_OK)
        return;
    for (int i = 0; i < TILES && lumi_cluster_read_tile(reader, &code) == LUMI_OK; i++)
        if (code.fields.interpolation <= 4 && code.fields.filter_level <= 63 && code.fields.precise <= 1)
            (void)lumi_tile_core_decode(core, reference, i % 2 * LUMI_TILE, i / 2 % 2 * LUMI_TILE, &code, &pixels);
    lumi_tile_core_destroy(core);
}

static void read_tiles(const uint8_t *data, size_t size)
{
    struct lumi_error error = {0};
    struct lumi_priming priming;
    struct lumi_reader reader;
    struct lumi_yuv reference;

    lumi_reader_init(&reader, data, size);
    if (checked(lumi_priming_read(&reader, 1, &priming, &error), &error) != LUMI_OK)
        return;
    if (lumi_yuv_create(&reference, WIDTH, HEIGHT) == LUMI_OK) {
        for (int i = 0; i < WIDTH * HEIGHT * 3 / 2; i++)
            reference.plane[0][i] = (uint8_t)(i * 7 ^ i / WIDTH * 5);
        decode_tiles(&reader, &priming, &reference);
    }
    lumi_yuv_finish(&reference);
    lumi_priming_finish(&priming);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    with_and_without_memory(data, size, read_tiles);
    return 0;
}
