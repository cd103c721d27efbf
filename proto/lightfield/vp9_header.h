/* The uncompressed header of VP9 frames ("VP9 Bitstream & Decoding Process Specification", version 0.6, section 6.2):
 * read to check frames before a decoder sees them, and made anew for tiles, where it is the same for all but a few
 * fields. */
#ifndef LUMI_PROTO_LIGHTFIELD_VP9_HEADER_H
#define LUMI_PROTO_LIGHTFIELD_VP9_HEADER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The fields that tiles of one level share. */
struct lumi_tile_frame {
    uint8_t quantizer;       /* base_q_idx, 0..255 */
    uint8_t sharpness;       /* of the loop filter, 0..7 */
    uint8_t deltas;          /* 1: the loop filter's default deltas are sent again in every frame */
    uint8_t error_resilient; /* 1: contexts are reset before every frame */
};

/* The fields that differ from tile to tile. */
struct lumi_tile_fields {
    uint8_t interpolation; /* literal of interpolation filter, 0..3; 4 switchable */
    uint8_t filter_level;  /* 0..63 */
    uint8_t precise;       /* allow_high_precision_mv */
};

#define LUMI_TILE_HEADER_MAX 24

/* Writes the header of a 64×64 inter frame that is shown, refreshes nothing and keeps the contexts, whose compressed
 * header has `compressed` bytes. Returns its size. */
size_t lumi_tile_header_build(const struct lumi_tile_frame *frame, const struct lumi_tile_fields *fields,
                              size_t compressed, uint8_t header[LUMI_TILE_HEADER_MAX]);

/* Splits an encoder's packet of such a frame. False if it holds anything that lumi_tile_header_build would not build.
 */
bool lumi_tile_header_parse(const uint8_t *data, size_t size, struct lumi_tile_frame *frame,
                            struct lumi_tile_fields *fields, size_t *header, size_t *compressed);

/* True if a frame can be handed to a decoder whose pictures are width × height: profile 0, shown, and either a key
 * frame of that size (8 bit 4:2:0) or an inter frame that takes its size from a reference. `key`: which. */
bool lumi_vp9_frame_plain(const uint8_t *data, size_t size, int width, int height, bool *key);

#ifdef __cplusplus
}
#endif
#endif
