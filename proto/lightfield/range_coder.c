/* Adaptive binary range coding. */
#include "proto/lightfield/range_coder.h"

#define TOP (UINT32_C(1) << 24)

void lumi_bit_models_init(struct lumi_bit_model *models, int count)
{
    for (int i = 0; i < count; i++)
        models[i] = (struct lumi_bit_model){32768, 32768};
}

static inline uint32_t zero_share(const struct lumi_bit_model *model, uint32_t range)
{
    uint32_t chance = ((uint32_t)model->fast + model->slow) / 2;

    return (range >> 16) * (chance < 32 ? 32 : chance > 65504 ? 65504 : chance);
}

static inline void adapt(struct lumi_bit_model *model, int bit)
{
    if (bit) {
        model->fast = (uint16_t)(model->fast - (model->fast >> 5));
        model->slow = (uint16_t)(model->slow - (model->slow >> 7));
    } else {
        model->fast = (uint16_t)(model->fast + ((65535 - model->fast) >> 5));
        model->slow = (uint16_t)(model->slow + ((65535 - model->slow) >> 7));
    }
}

void lumi_range_encoder_init(struct lumi_range_encoder *coder, struct lumi_writer *writer)
{
    *coder = (struct lumi_range_encoder){.writer = writer, .range = UINT32_MAX};
}

/* Moves the top byte of `low` out. A carry may still come into it, so it and the 0xff after it are held back. */
static void shift_out(struct lumi_range_encoder *coder)
{
    if (coder->held_count == 0 || coder->low < UINT64_C(0xff000000) || coder->low > UINT32_MAX) {
        uint8_t carry = (uint8_t)(coder->low >> 32);
        if (coder->held_count > 0)
            lumi_write_u8(coder->writer, (uint8_t)(coder->held + carry));
        for (; coder->held_count > 1; coder->held_count--)
            lumi_write_u8(coder->writer, (uint8_t)(0xff + carry));
        coder->held = (uint8_t)(coder->low >> 24);
        coder->held_count = 0;
    }
    coder->held_count++;
    coder->low = (coder->low & 0x00ffffff) << 8;
}

void lumi_range_encode(struct lumi_range_encoder *coder, struct lumi_bit_model *model, int bit)
{
    uint32_t bound = zero_share(model, coder->range);

    if (bit) {
        coder->low += bound;
        coder->range -= bound;
    } else {
        coder->range = bound;
    }
    adapt(model, bit);
    while (coder->range < TOP) {
        coder->range <<= 8;
        shift_out(coder);
    }
}

void lumi_range_encode_raw(struct lumi_range_encoder *coder, uint32_t value, int count)
{
    while (count-- > 0) {
        coder->range >>= 1;
        if (value >> count & 1)
            coder->low += coder->range;
        while (coder->range < TOP) {
            coder->range <<= 8;
            shift_out(coder);
        }
    }
}

void lumi_range_encoder_finish(struct lumi_range_encoder *coder)
{
    /* Any number in [low, low + range) will do: the one with the most zero bits at its end. */
    for (int bits = 31; bits >= 0; bits--) {
        uint64_t mask = (UINT64_C(1) << bits) - 1, value = (coder->low + mask) & ~mask;
        if (value < coder->low + coder->range) {
            coder->low = value;
            break;
        }
    }
    for (int i = 0; i < 5; i++)
        shift_out(coder);
    while (coder->writer->size > 0 && coder->writer->data[coder->writer->size - 1] == 0)
        coder->writer->size--;
}

void lumi_range_decoder_init(struct lumi_range_decoder *coder, const void *data, size_t size)
{
    *coder = (struct lumi_range_decoder){.data = data, .size = size, .range = UINT32_MAX};
    for (int i = 0; i < 4; i++)
        coder->code = coder->code << 8 | (coder->at < size ? coder->data[coder->at++] : 0u);
}

static inline void refill(struct lumi_range_decoder *coder)
{
    while (coder->range < TOP) {
        coder->range <<= 8;
        coder->code = coder->code << 8 | (coder->at < coder->size ? coder->data[coder->at++] : 0u);
    }
}

int lumi_range_decode(struct lumi_range_decoder *coder, struct lumi_bit_model *model)
{
    uint32_t bound = zero_share(model, coder->range);
    int bit = coder->code >= bound;

    if (bit) {
        coder->code -= bound;
        coder->range -= bound;
    } else {
        coder->range = bound;
    }
    adapt(model, bit);
    refill(coder);
    return bit;
}

uint32_t lumi_range_decode_raw(struct lumi_range_decoder *coder, int count)
{
    uint32_t value = 0;

    while (count-- > 0) {
        coder->range >>= 1;
        uint32_t bit = coder->code >= coder->range;
        coder->code -= bit ? coder->range : 0;
        value = value << 1 | bit;
        refill(coder);
    }
    return value;
}

void lumi_range_encode_tree(struct lumi_range_encoder *coder, struct lumi_bit_model *models, int bits, unsigned value)
{
    unsigned node = 1;

    while (bits-- > 0) {
        int bit = (int)(value >> bits & 1);
        lumi_range_encode(coder, &models[node], bit);
        node = node << 1 | (unsigned)bit;
    }
}

unsigned lumi_range_decode_tree(struct lumi_range_decoder *coder, struct lumi_bit_model *models, int bits)
{
    unsigned node = 1, top = 1u << bits;

    while (bits-- > 0)
        node = node << 1 | (unsigned)lumi_range_decode(coder, &models[node]);
    return node - top;
}

void lumi_number_model_init(struct lumi_number_model *model)
{
    lumi_bit_models_init(model->length, 32);
    lumi_bit_models_init(&model->mantissa[0][0], 17 * 4);
}

static int bit_length(unsigned value)
{
    int length = 0;

    while (value >> length)
        length++;
    return length;
}

void lumi_range_encode_number(struct lumi_range_encoder *coder, struct lumi_number_model *model, unsigned value)
{
    int length = bit_length(value);
    int rest = length > 1 ? length - 1 : 0, modelled = rest < 2 ? rest : 2;

    lumi_range_encode_tree(coder, model->length, 5, (unsigned)length);
    rest -= modelled;
    lumi_range_encode_tree(coder, model->mantissa[length], modelled, value >> rest & ((1u << modelled) - 1));
    lumi_range_encode_raw(coder, value, rest);
}

unsigned lumi_range_decode_number(struct lumi_range_decoder *coder, struct lumi_number_model *model)
{
    int length = (int)lumi_range_decode_tree(coder, model->length, 5);

    if (length > 16)
        length = 16;
    int rest = length > 1 ? length - 1 : 0, modelled = rest < 2 ? rest : 2;
    unsigned value = length > 0;
    value = value << modelled | lumi_range_decode_tree(coder, model->mantissa[length], modelled);
    rest -= modelled;
    return value << rest | lumi_range_decode_raw(coder, rest);
}
