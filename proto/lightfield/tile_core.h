/* Tiles as VP9 frames: each is an inter frame of 64×64 pixels whose reference buffers are filled with windows of a
 * reference image, so that it decodes alone, in any order.
 *
 * Invariants.
 * 1. A core that was primed, and the one that the encoder checked its tiles with, are in the same state before every
 *    tile: tiles refresh no buffer and no context; motion vectors of the frame before come from the blank frame, which
 *    has none, and which is decoded before every tile (unless the level is error-resilient, then nothing is kept).
 * 2. Every frame reaches libvpx inside a superframe index that gives its exact size, with 64 zero bytes after its data:
 *    data can be cut off where zeros do as well, and no byte of a tile can pass for another frame.
 * 3. After a decoding error the core is primed again before its next tile. */
#ifndef LUMI_PROTO_LIGHTFIELD_TILE_CORE_H
#define LUMI_PROTO_LIGHTFIELD_TILE_CORE_H

#include "proto/base/bytes.h"
#include "proto/base/result.h"
#include "proto/lightfield/tile_window.h"
#include "proto/lightfield/vp9_header.h"

#ifdef __cplusplus
extern "C" {
#endif

#define LUMI_TILE_DATA_MAX 32767     /* bytes of a tile's data */
#define LUMI_TILE_COMPRESSED_MAX 255 /* bytes of a tile's compressed header */
#define LUMI_PRIMING_FRAMES_MAX 1024
#define LUMI_PRIMING_FRAME_MAX 65535 /* bytes */

/* A frame that is decoded to bring a decoder into the state that tiles expect. */
struct lumi_priming_frame {
    uint8_t *data;
    uint32_t size;
    int reference;                      /* index of the reference image its windows come from, −1: no windows */
    struct lumi_shift at[LUMI_WINDOWS]; /* top left of the windows in the reference image */
};

/* How to prime, and what all tile headers share. */
struct lumi_priming {
    struct lumi_tile_frame frame;
    struct lumi_priming_frame *frames;
    int count;
    uint8_t *blank; /* the blank frame; NULL when error-resilient */
    uint32_t blank_size;
};

void lumi_priming_finish(struct lumi_priming *priming);
bool lumi_priming_equal(const struct lumi_priming *a, const struct lumi_priming *b);
/* Appends a frame, copying its bytes. */
int lumi_priming_add(struct lumi_priming *priming, const uint8_t *data, size_t size, int reference,
                     const struct lumi_shift at[LUMI_WINDOWS]);
void lumi_priming_write(const struct lumi_priming *priming, struct lumi_writer *writer);
/* Trusts nothing; reference images are numbered below `references`. */
int lumi_priming_read(struct lumi_reader *reader, int references, struct lumi_priming *priming,
                      struct lumi_error *error);

/* A coded tile. The bytes are whoever's made the struct. */
struct lumi_tile_code {
    struct lumi_shift shift[LUMI_WINDOWS];
    struct lumi_tile_fields fields;
    uint8_t quantizer; /* base_q_idx; all but always the level's */
    uint16_t check;    /* low bits of lumi_tile_hash of the decoded pixels */
    uint16_t compressed_size, size;
    const uint8_t *compressed, *data; /* compressed header and tile data, without trailing zeros */
};

struct lumi_tile_core;

/* `priming` and `references` stay the caller's and must outlive the core. A reference image that could not be decoded
 * is all zero; priming then goes on without it. Priming happens at the first tile. */
int lumi_tile_core_create(const struct lumi_priming *priming, const struct lumi_yuv *references,
                          struct lumi_tile_core **core, struct lumi_error *error);
void lumi_tile_core_destroy(struct lumi_tile_core *core);

/* Decodes a tile whose top left is (x, y). Does not look at `check`. LUMI_ERR_CHECKSUM when libvpx refuses it. */
int lumi_tile_core_decode(struct lumi_tile_core *core, const struct lumi_yuv *reference, int x, int y,
                          const struct lumi_tile_code *code, struct lumi_tile_pixels *pixels);

/* For the encoder, which primes its core frame by frame and checks whole packets: sets the windows (unless NULL) and
 * decodes a frame as it is; a tile's frame in a primed core and after the blank frame. */
int lumi_tile_core_frame(struct lumi_tile_core *core, const struct lumi_tile_pixels windows[LUMI_WINDOWS],
                         const uint8_t *data, size_t size, bool tile, struct lumi_tile_pixels *pixels);

#ifdef __cplusplus
}
#endif
#endif
