/* Choosing the tiles that train a level's contexts. */
#include "proto/lightfield/training.h"

int lumi_training_count(long coded_tiles)
{
    long count = coded_tiles / 40;

    return (int)(count > 320 ? 320 : count);
}

int lumi_training_pick(const struct lumi_yuv *image, int reference_index, const struct lumi_yuv *reference,
                       const struct lumi_shift *seeds, int range, int count, uint64_t seed,
                       struct lumi_training_tile *tiles, struct lumi_error *error)
{
    int cols = (image->width + LUMI_TILE - 1) / LUMI_TILE, rows = (image->height + LUMI_TILE - 1) / LUMI_TILE;
    struct lumi_shift shift[LUMI_WINDOWS];

    for (int i = 0; i < count; i++) {
        seed = seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407); /* Knuth's MMIX generator */
        int tile = (int)((seed >> 33) % (uint64_t)(cols * rows));
        int x = tile % cols * LUMI_TILE, y = tile / cols * LUMI_TILE;
        lumi_window_copy(image, x, y, &tiles[i].source);
        LUMI_TRY(lumi_shift_search(reference, x, y, &tiles[i].source, seeds ? seeds[tile] : (struct lumi_shift){0, 0},
                                   range, shift, error));
        tiles[i].reference = reference_index;
        for (int k = 0; k < LUMI_WINDOWS; k++)
            tiles[i].at[k] = (struct lumi_shift){(int16_t)(x + shift[k].x), (int16_t)(y + shift[k].y)};
    }
    return LUMI_OK;
}
