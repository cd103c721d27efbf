/* Encoding tiles: the other side of tile_core.h. */
#ifndef LUMI_PROTO_LIGHTFIELD_TILE_ENCODER_H
#define LUMI_PROTO_LIGHTFIELD_TILE_ENCODER_H

#include "proto/lightfield/tile_core.h"

#ifdef __cplusplus
extern "C" {
#endif

struct lumi_tile_encoder_settings {
    int quantizer;       /* 0..63, libvpx's scale: 0 finest */
    int speed;           /* libvpx's cpu-used, 0 slow .. 5 fast */
    int error_resilient; /* 1: no contexts are kept, training does nothing; 4 to 9 % more bytes */
};

/* A tile that trains the contexts, which all encoders of a level start from. */
struct lumi_training_tile {
    struct lumi_tile_pixels source;
    int reference;
    struct lumi_shift at[LUMI_WINDOWS]; /* top left of the windows in the reference image */
};

struct lumi_tile_encoder;

/* Primes and trains. The arrays and images stay the caller's and must outlive the encoder. Encoders with the same
 * arguments make the same bytes. */
int lumi_tile_encoder_create(const struct lumi_tile_encoder_settings *settings, const struct lumi_training_tile *tiles,
                             int count, const struct lumi_yuv *references, struct lumi_tile_encoder **encoder,
                             struct lumi_error *error);
void lumi_tile_encoder_destroy(struct lumi_tile_encoder *encoder);

/* What a decoder needs; owned by the encoder. */
const struct lumi_priming *lumi_tile_encoder_priming(const struct lumi_tile_encoder *encoder);

/* Encodes `source`, the tile whose top left is (x, y), with windows of `reference` at `shift`, and checks that a
 * decoder gets the pixels that went into `check`. The bytes of `code` are the encoder's, until the next call. `decoded`
 * may be NULL. */
int lumi_tile_encode(struct lumi_tile_encoder *encoder, const struct lumi_yuv *reference, int x, int y,
                     const struct lumi_shift shift[LUMI_WINDOWS], const struct lumi_tile_pixels *source,
                     struct lumi_tile_code *code, struct lumi_tile_pixels *decoded, struct lumi_error *error);

/* Finds the shifts for a tile: the first has the least sum of absolute luma differences, with a small price on
 * distance from `seed`; the second the least where each block of 16×16 takes the better of both. Both even, within
 * `range` (at most 64) of the seed. */
int lumi_shift_search(const struct lumi_yuv *reference, int x, int y, const struct lumi_tile_pixels *source,
                      struct lumi_shift seed, int range, struct lumi_shift shift[LUMI_WINDOWS],
                      struct lumi_error *error);

#ifdef __cplusplus
}
#endif
#endif
