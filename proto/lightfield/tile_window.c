/* Windows of reference images, and the hash of tiles. */
#include "proto/lightfield/tile_window.h"

#include <string.h>

static inline int clamp(int value, int low, int high)
{
    return value < low ? low : value > high ? high : value;
}

static void copy_plane(const uint8_t *source, int width, int height, int x0, int y0, int size, uint8_t *target)
{
    for (int y = 0; y < size; y++, target += size) {
        const uint8_t *row = source + (size_t)clamp(y0 + y, 0, height - 1) * (size_t)width;
        if (x0 >= 0 && x0 + size <= width) {
            memcpy(target, row + x0, (size_t)size);
            continue;
        }
        for (int x = 0; x < size; x++)
            target[x] = row[clamp(x0 + x, 0, width - 1)];
    }
}

void lumi_window_copy(const struct lumi_yuv *image, int x, int y, struct lumi_tile_pixels *window)
{
    uint8_t *targets[3] = {window->y, window->u, window->v};

    for (int p = 0; p < 3; p++) {
        int half = p > 0;
        copy_plane(image->plane[p], lumi_yuv_width(image, p), lumi_yuv_height(image, p), half ? x / 2 : x,
                   half ? y / 2 : y, half ? LUMI_TILE / 2 : LUMI_TILE, targets[p]);
    }
}

void lumi_tile_place(const struct lumi_tile_pixels *tile, int column, int row, const struct lumi_yuv *image)
{
    const uint8_t *planes[3] = {tile->y, tile->u, tile->v};

    for (int p = 0; p < 3; p++) {
        int size = p ? LUMI_TILE / 2 : LUMI_TILE, width = lumi_yuv_width(image, p), height = lumi_yuv_height(image, p);
        int across = width - column * size < size ? width - column * size : size;
        for (int y = 0; y < size && row * size + y < height; y++)
            memcpy(image->plane[p] + (size_t)(row * size + y) * (size_t)width + (size_t)(column * size),
                   planes[p] + (size_t)y * (size_t)size, (size_t)across);
    }
}

uint64_t lumi_tile_hash(const struct lumi_tile_pixels *pixels)
{
    const uint64_t prime = UINT64_C(0x9e3779b97f4a7c15);
    uint64_t lanes[4] = {1, 2, 3, 4}, hash = 0;
    const uint8_t *bytes = (const uint8_t *)pixels;

    _Static_assert(sizeof *pixels % 32 == 0, "planes follow each other without gaps, in whole groups of 32 bytes");
    for (size_t i = 0; i < sizeof *pixels; i += 32)
        for (size_t k = 0; k < 4; k++) {
            const uint8_t *b = bytes + i + 8 * k;
            uint64_t low = (uint64_t)b[0] | (uint64_t)b[1] << 8 | (uint64_t)b[2] << 16 | (uint64_t)b[3] << 24;
            uint64_t high = (uint64_t)b[4] | (uint64_t)b[5] << 8 | (uint64_t)b[6] << 16 | (uint64_t)b[7] << 24;
            lanes[k] = (lanes[k] ^ (low | high << 32)) * prime;
            lanes[k] ^= lanes[k] >> 29;
        }
    for (size_t k = 0; k < 4; k++) {
        hash = (hash ^ lanes[k]) * prime;
        hash ^= hash >> 32;
    }
    return hash;
}
