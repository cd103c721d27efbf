/* Adaptive binary range coding, for the side information of tiles.
 *
 * Arithmetic: 32-bit range, carries propagated as in Martin, "Range encoding" (1979), byte-wise as in LZMA's coder. A
 * probability is the mean of two 16-bit estimates that adapt with rates 1/32 and 1/128. docs/lumi-format.md, "Range
 * coder", has every step. */
#ifndef LUMI_PROTO_LIGHTFIELD_RANGE_CODER_H
#define LUMI_PROTO_LIGHTFIELD_RANGE_CODER_H

#include "proto/base/bytes.h"

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Probability that the bit is 0, of 65536; both start at one half. */
struct lumi_bit_model {
    uint16_t fast, slow;
};

void lumi_bit_models_init(struct lumi_bit_model *models, int count);

struct lumi_range_encoder {
    struct lumi_writer *writer;
    uint64_t low;
    uint32_t range;
    uint8_t held;
    uint64_t held_count; /* bytes not yet written: `held`, then 0xff ... */
};

void lumi_range_encoder_init(struct lumi_range_encoder *coder, struct lumi_writer *writer);
void lumi_range_encode(struct lumi_range_encoder *coder, struct lumi_bit_model *model, int bit);
/* `count` ≤ 24 bits of even chance, high bit first. */
void lumi_range_encode_raw(struct lumi_range_encoder *coder, uint32_t value, int count);
/* Writes what is left; trailing zero bytes are dropped (the decoder reads zeros past the end). */
void lumi_range_encoder_finish(struct lumi_range_encoder *coder);

struct lumi_range_decoder {
    const uint8_t *data;
    size_t size, at;
    uint32_t code, range;
};

void lumi_range_decoder_init(struct lumi_range_decoder *coder, const void *data, size_t size);
int lumi_range_decode(struct lumi_range_decoder *coder, struct lumi_bit_model *model);
uint32_t lumi_range_decode_raw(struct lumi_range_decoder *coder, int count);

/* Numbers. A tree of `bits` binary decisions, high bit first, over models[1 .. 1 << bits). */
void lumi_range_encode_tree(struct lumi_range_encoder *coder, struct lumi_bit_model *models, int bits, unsigned value);
unsigned lumi_range_decode_tree(struct lumi_range_decoder *coder, struct lumi_bit_model *models, int bits);

/* A non-negative number of up to 16 bits: its bit length n as a tree, then the two bits below the highest one with
 * models of their own for each length, then the rest raw. */
struct lumi_number_model {
    struct lumi_bit_model length[32];
    struct lumi_bit_model mantissa[17][4];
};

void lumi_number_model_init(struct lumi_number_model *model);
void lumi_range_encode_number(struct lumi_range_encoder *coder, struct lumi_number_model *model, unsigned value);
unsigned lumi_range_decode_number(struct lumi_range_decoder *coder, struct lumi_number_model *model);

#ifdef __cplusplus
}
#endif
#endif
