/* Side information of tiles, entropy-coded.
 *
 * One coder serves both directions: with an encoder it writes an entry, with a decoder it fills it, so that the two
 * cannot drift apart. */
#include "proto/lightfield/side_info.h"

#include "proto/lightfield/range_coder.h"
#include "proto/lightfield/tile_core.h"

enum { SIZE_CLASSES = 6 };

struct models {
    struct lumi_number_model size[SIZE_CLASSES];
    struct lumi_number_model shift[LUMI_WINDOWS][2]; /* of window k in x and y */
    struct lumi_bit_model together;                  /* the second window lies where the first does */
    struct lumi_bit_model level_same[3], level[64];
    struct lumi_bit_model interpolation[8], precise;
    struct lumi_bit_model dictionary[64];
    struct lumi_bit_model quantizer_other;
};

struct coder {
    struct lumi_range_encoder *encoder; /* one of the two is NULL */
    struct lumi_range_decoder *decoder;
    struct models models;
};

static void init_models(struct models *models)
{
    for (int i = 0; i < SIZE_CLASSES; i++)
        lumi_number_model_init(&models->size[i]);
    for (int k = 0; k < LUMI_WINDOWS; k++)
        for (int i = 0; i < 2; i++)
            lumi_number_model_init(&models->shift[k][i]);
    lumi_bit_models_init(&models->together, 1);
    lumi_bit_models_init(models->level_same, 3);
    lumi_bit_models_init(models->level, 64);
    lumi_bit_models_init(models->interpolation, 8);
    lumi_bit_models_init(&models->precise, 1);
    lumi_bit_models_init(models->dictionary, 64);
    lumi_bit_models_init(&models->quantizer_other, 1);
}

static int code_bit(struct coder *coder, struct lumi_bit_model *model, int bit)
{
    if (coder->decoder)
        return lumi_range_decode(coder->decoder, model);
    lumi_range_encode(coder->encoder, model, bit);
    return bit;
}

static unsigned code_tree(struct coder *coder, struct lumi_bit_model *models, int bits, unsigned value)
{
    if (coder->decoder)
        return lumi_range_decode_tree(coder->decoder, models, bits);
    lumi_range_encode_tree(coder->encoder, models, bits, value);
    return value;
}

static unsigned code_number(struct coder *coder, struct lumi_number_model *model, unsigned value)
{
    if (coder->decoder)
        return lumi_range_decode_number(coder->decoder, model);
    lumi_range_encode_number(coder->encoder, model, value);
    return value;
}

static unsigned code_raw(struct coder *coder, unsigned value, int bits)
{
    if (coder->decoder)
        return lumi_range_decode_raw(coder->decoder, bits);
    lumi_range_encode_raw(coder->encoder, value & ((1u << bits) - 1), bits);
    return value;
}

/* Left and above, and what is predicted from them: the median of left, above and left + above − above left. */
struct neighbours {
    const struct lumi_tile_entry *left, *above, *corner; /* NULL outside the image */
};

static int predict(int left, int above, int corner)
{
    int low = left < above ? left : above, high = left < above ? above : left;

    return corner >= high ? low : corner <= low ? high : left + above - corner;
}

static struct lumi_shift predicted_shift(const struct neighbours *near)
{
    if (near->left && near->above)
        return (struct lumi_shift){
            (int16_t)predict(near->left->shift[0].x, near->above->shift[0].x, near->corner->shift[0].x),
            (int16_t)predict(near->left->shift[0].y, near->above->shift[0].y, near->corner->shift[0].y)};
    if (near->left)
        return near->left->shift[0];
    return near->above ? near->above->shift[0] : (struct lumi_shift){0, 0};
}

static int16_t code_difference(struct coder *coder, struct lumi_number_model *model, int value, int predicted)
{
    unsigned coded = code_number(coder, model, (unsigned)lumi_zigzag((value - predicted) / 2));

    return (int16_t)(predicted + 2 * (int)lumi_unzigzag(coded));
}

static void code_shifts(struct coder *coder, const struct neighbours *near, struct lumi_tile_entry *entry)
{
    struct lumi_shift from = predicted_shift(near);
    struct models *models = &coder->models;

    entry->shift[0].x = code_difference(coder, &models->shift[0][0], entry->shift[0].x, from.x);
    entry->shift[0].y = code_difference(coder, &models->shift[0][1], entry->shift[0].y, from.y);
    from = entry->shift[0];
    if (code_bit(coder, &models->together, entry->shift[1].x == from.x && entry->shift[1].y == from.y)) {
        entry->shift[1] = from;
        return;
    }
    entry->shift[1].x = code_difference(coder, &models->shift[1][0], entry->shift[1].x, from.x);
    entry->shift[1].y = code_difference(coder, &models->shift[1][1], entry->shift[1].y, from.y);
}

/* The larger neighbour's size, in classes of powers of two. */
static int size_class(const struct neighbours *near)
{
    unsigned size = near->left ? near->left->size : 0;
    int class = 0;

    if (near->above)
        size = near->left ? (size + near->above->size + 1) / 2 : near->above->size;
    for (size >>= 3; size > 0 && class < SIZE_CLASSES - 1; size >>= 1)
        class ++;
    return class;
}

static void code_level(struct coder *coder, const struct neighbours *near, struct lumi_tile_entry *entry)
{
    const struct lumi_tile_entry *beside = near->left ? near->left : near->above;
    int context =
        near->left && near->above ? 1 + (near->left->fields.filter_level != near->above->fields.filter_level) : 0;
    uint8_t guess = beside ? beside->fields.filter_level : 0;

    if (code_bit(coder, &coder->models.level_same[context], entry->fields.filter_level == guess))
        entry->fields.filter_level = guess;
    else
        entry->fields.filter_level = (uint8_t)code_tree(coder, coder->models.level, 6, entry->fields.filter_level);
}

static void code_entry(struct coder *coder, const struct neighbours *near, int quantizer, struct lumi_tile_entry *entry)
{
    struct models *models = &coder->models;

    entry->size = (uint16_t)code_number(coder, &models->size[size_class(near)], entry->size);
    code_shifts(coder, near, entry);
    code_level(coder, near, entry);
    entry->fields.interpolation = (uint8_t)code_tree(coder, models->interpolation, 3, entry->fields.interpolation);
    entry->fields.precise = (uint8_t)code_bit(coder, &models->precise, entry->fields.precise);
    entry->dictionary = (uint8_t)code_tree(coder, models->dictionary, 6, entry->dictionary);
    if (code_bit(coder, &models->quantizer_other, entry->quantizer != quantizer))
        entry->quantizer = (uint8_t)code_raw(coder, entry->quantizer, 8);
    else
        entry->quantizer = (uint8_t)quantizer;
    entry->check = (uint16_t)code_raw(coder, entry->check, LUMI_CHECK_BITS);
}

static struct neighbours around(const struct lumi_tile_entry *entry, int column, int row, int cols)
{
    return (struct neighbours){column > 0 ? entry - 1 : NULL, row > 0 ? entry - cols : NULL,
                               column > 0 && row > 0 ? entry - cols - 1 : NULL};
}

void lumi_side_encode(const struct lumi_tile_entry *entries, int views, int cols, int rows, int quantizer,
                      struct lumi_writer *writer)
{
    struct lumi_range_encoder encoder;
    struct coder coder = {.encoder = &encoder};
    const struct lumi_tile_entry *entry = entries;

    lumi_range_encoder_init(&encoder, writer);
    init_models(&coder.models);
    for (int view = 0; view < views; view++)
        for (int tile = 0; tile < cols * rows; tile++, entry++) {
            struct neighbours near = around(entry, tile % cols, tile / cols, cols);
            struct lumi_tile_entry copy = *entry;
            code_entry(&coder, &near, quantizer, &copy);
        }
    lumi_range_encoder_finish(&encoder);
}

static bool in_range(const struct lumi_tile_entry *entry, int dictionary_count)
{
    for (int k = 0; k < LUMI_WINDOWS; k++)
        if (entry->shift[k].x < -LUMI_SHIFT_MAX || entry->shift[k].x > LUMI_SHIFT_MAX ||
            entry->shift[k].y < -LUMI_SHIFT_MAX || entry->shift[k].y > LUMI_SHIFT_MAX)
            return false;
    return entry->size <= LUMI_TILE_DATA_MAX + 1 + LUMI_TILE_COMPRESSED_MAX && entry->fields.interpolation <= 4 &&
           (entry->dictionary < dictionary_count || entry->dictionary == LUMI_DICTIONARY_NONE);
}

uint64_t lumi_side_offsets(struct lumi_tile_entry *entries, int views, int tiles)
{
    uint64_t at = 0;

    for (int tile = 0; tile < tiles; tile++)
        for (int view = 0; view < views; view++) {
            struct lumi_tile_entry *entry = &entries[(size_t)view * (size_t)tiles + (size_t)tile];
            entry->offset = (uint32_t)at;
            at += entry->size;
        }
    return at;
}

int lumi_side_decode(const void *data, size_t size, int views, int cols, int rows, int quantizer, int dictionary_count,
                     struct lumi_tile_entry *entries, uint64_t *total)
{
    struct lumi_range_decoder decoder;
    struct coder coder = {.decoder = &decoder};
    struct lumi_tile_entry *entry = entries;

    lumi_range_decoder_init(&decoder, data, size);
    init_models(&coder.models);
    for (int view = 0; view < views; view++)
        for (int tile = 0; tile < cols * rows; tile++, entry++) {
            struct neighbours near = around(entry, tile % cols, tile / cols, cols);
            *entry = (struct lumi_tile_entry){0};
            code_entry(&coder, &near, quantizer, entry);
            if (!in_range(entry, dictionary_count))
                return LUMI_ERR_FORMAT;
        }
    *total = lumi_side_offsets(entries, views, cols * rows);
    return *total > UINT32_MAX ? LUMI_ERR_FORMAT : LUMI_OK;
}
