/* What a decoder must know of every tile beside its bytes, coded cluster by cluster (docs/lumi-format.md, "Side
 * information"). */
#ifndef LUMI_PROTO_LIGHTFIELD_SIDE_INFO_H
#define LUMI_PROTO_LIGHTFIELD_SIDE_INFO_H

#include "proto/base/bytes.h"
#include "proto/base/result.h"
#include "proto/lightfield/tile_window.h"
#include "proto/lightfield/vp9_header.h"

#ifdef __cplusplus
extern "C" {
#endif

#define LUMI_DICTIONARY_MAX 32
#define LUMI_DICTIONARY_NONE 32 /* the compressed header stands before the tile's data, after its length */
#define LUMI_CHECK_BITS 12      /* of a tile's hash; a damaged tile passes once in 4,096 */

/* A tile as the reader keeps it. */
struct lumi_tile_entry {
    uint32_t offset; /* of its bytes, from the start of the cluster's */
    uint16_t size, check;
    struct lumi_shift shift[LUMI_WINDOWS];
    struct lumi_tile_fields fields;
    uint8_t quantizer;
    uint8_t dictionary; /* index, or LUMI_DICTIONARY_NONE */
};

/* The tiles of `views` images of cols × rows tiles each, row by row; `quantizer` is the level's. */
void lumi_side_encode(const struct lumi_tile_entry *entries, int views, int cols, int rows, int quantizer,
                      struct lumi_writer *writer);

/* Fills the entries, their offsets in the order of the file: tile by tile in each image, image by image in each tile.
 * LUMI_ERR_FORMAT for a value out of range. *total: the bytes of all tiles. */
int lumi_side_decode(const void *data, size_t size, int views, int cols, int rows, int quantizer, int dictionary_count,
                     struct lumi_tile_entry *entries, uint64_t *total);

/* Sets the offsets as above; returns the bytes of all tiles. */
uint64_t lumi_side_offsets(struct lumi_tile_entry *entries, int views, int tiles);

#ifdef __cplusplus
}
#endif
#endif
