/* Tiles and images: windows of reference images, decoded tiles put in their place, the hash that tells tiles apart. */
#ifndef LUMI_PROTO_LIGHTFIELD_TILE_WINDOW_H
#define LUMI_PROTO_LIGHTFIELD_TILE_WINDOW_H

#include "proto/lightfield/grid.h"
#include "proto/lightfield/yuv.h"

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define LUMI_WINDOWS 2      /* windows of the reference image a tile is predicted from */
#define LUMI_SHIFT_MAX 8190 /* largest magnitude of a shift; shifts are even */

/* A decoded tile: 64×64 luma, 32×32 chroma, sRGB 8 bit YUV 4:2:0 BT.709 full range, rows without padding. */
struct lumi_tile_pixels {
    uint8_t y[LUMI_TILE * LUMI_TILE], u[LUMI_TILE * LUMI_TILE / 4], v[LUMI_TILE * LUMI_TILE / 4];
};

/* Where a tile's windows lie, relative to the tile, in luma pixels; even. */
struct lumi_shift {
    int16_t x, y;
};

/* Copies the 64×64 luma pixels (and their chroma) whose top left is (x, y), both even, from an image; beyond its edge
 * the nearest pixels are repeated. */
void lumi_window_copy(const struct lumi_yuv *image, int x, int y, struct lumi_tile_pixels *window);

/* Puts a decoded tile where it belongs in its image; what lies beyond the image's edge is dropped. */
void lumi_tile_place(const struct lumi_tile_pixels *tile, int column, int row, const struct lumi_yuv *image);

/* A 64-bit hash of a tile's pixels (docs/lumi-format.md, "Tile checksum"). */
uint64_t lumi_tile_hash(const struct lumi_tile_pixels *pixels);

#ifdef __cplusplus
}
#endif
#endif
