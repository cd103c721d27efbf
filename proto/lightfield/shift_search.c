/* Finding where in the reference image a tile's content is. */
#include "proto/base/memory.h"
#include "proto/lightfield/block_difference.h"
#include "proto/lightfield/tile_encoder.h"

#include <limits.h>
#include <stdlib.h>

enum { BLOCK = LUMI_DIFFERENCE_BLOCK, BLOCKS = LUMI_TILE / BLOCK, BLOCK_COUNT = BLOCKS * BLOCKS, RANGE_MAX = 64 };
enum { PATCH = LUMI_TILE + 2 * RANGE_MAX };

/* The luma around the tile's seeded place, so that candidates need no clamping. */
static void fill_patch(const struct lumi_yuv *reference, int left, int top, int size, uint8_t *patch)
{
    for (int y = 0; y < size; y++) {
        int from = top + y < 0 ? 0 : top + y >= reference->height ? reference->height - 1 : top + y;
        const uint8_t *row = reference->plane[0] + (size_t)from * (size_t)reference->width;
        for (int x = 0; x < size; x++) {
            int at = left + x < 0 ? 0 : left + x >= reference->width ? reference->width - 1 : left + x;
            patch[y * PATCH + x] = row[at];
        }
    }
}

static void block_differences(const uint8_t *source, const uint8_t *patch, uint16_t sums[BLOCK_COUNT])
{
    for (int b = 0; b < BLOCK_COUNT; b++) {
        const uint8_t *p = source + b / BLOCKS * BLOCK * LUMI_TILE + b % BLOCKS * BLOCK;
        const uint8_t *q = patch + b / BLOCKS * BLOCK * PATCH + b % BLOCKS * BLOCK;
        sums[b] = (uint16_t)lumi_block_difference(p, LUMI_TILE, q, PATCH); /* 256 pixels of at most 255 */
    }
}

/* The candidate with the least sum over blocks of the lesser of `best` and its own. */
static int choose(const uint16_t (*sums)[BLOCK_COUNT], int side, const uint16_t best[BLOCK_COUNT])
{
    long least = LONG_MAX;
    int chosen = 0;

    for (int i = 0; i < side * side; i++) {
        long sum = abs(i % side - side / 2) + abs(i / side - side / 2);
        for (int b = 0; b < BLOCK_COUNT; b++)
            sum += sums[i][b] < best[b] ? sums[i][b] : best[b];
        if (sum < least) {
            least = sum;
            chosen = i;
        }
    }
    return chosen;
}

static int16_t limited(int value)
{
    return (int16_t)(value < -LUMI_SHIFT_MAX ? -LUMI_SHIFT_MAX : value > LUMI_SHIFT_MAX ? LUMI_SHIFT_MAX : value);
}

int lumi_shift_search(const struct lumi_yuv *reference, int x, int y, const struct lumi_tile_pixels *source,
                      struct lumi_shift seed, int range, struct lumi_shift shift[LUMI_WINDOWS],
                      struct lumi_error *error)
{
    int half = (range < 0 ? 0 : range > RANGE_MAX ? RANGE_MAX : range) / 2, side = 2 * half + 1;
    uint16_t(*sums)[BLOCK_COUNT] = lumi_alloc((size_t)side * (size_t)side, sizeof *sums);
    uint8_t *patch = lumi_alloc((size_t)PATCH * PATCH, 1);
    uint16_t best[BLOCK_COUNT];

    if (!sums || !patch) {
        lumi_free(patch);
        lumi_free(sums);
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory to search for a tile");
    }
    seed.x = limited(seed.x & ~1);
    seed.y = limited(seed.y & ~1);
    fill_patch(reference, x + seed.x - 2 * half, y + seed.y - 2 * half, LUMI_TILE + 4 * half, patch);
    for (int i = 0; i < side * side; i++)
        block_differences(source->y, patch + i / side * 2 * PATCH + i % side * 2, sums[i]);
    for (int b = 0; b < BLOCK_COUNT; b++)
        best[b] = UINT16_MAX;
    for (int k = 0; k < LUMI_WINDOWS; k++) {
        int i = choose((const uint16_t(*)[BLOCK_COUNT])sums, side, best);
        for (int b = 0; b < BLOCK_COUNT; b++)
            best[b] = sums[i][b] < best[b] ? sums[i][b] : best[b];
        shift[k].x = limited(seed.x + 2 * (i % side - half));
        shift[k].y = limited(seed.y + 2 * (i / side - half));
    }
    lumi_free(patch);
    lumi_free(sums);
    return LUMI_OK;
}
