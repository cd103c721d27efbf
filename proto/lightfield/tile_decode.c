/* Decoding the tiles of a field. */
#include "proto/base/memory.h"
#include "proto/lightfield/field_priv.h"

struct lumi_tile_decoder {
    const struct lumi_field *field;
    struct lumi_tile_core *cores[LUMI_LEVELS]; /* made when first needed */
};

int lumi_tile_decoder_create(const struct lumi_field *field, struct lumi_tile_decoder **decoder,
                             struct lumi_error *error)
{
    *decoder = lumi_calloc(1, sizeof **decoder);
    if (!*decoder)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: no memory for a tile decoder", field->name);
    (*decoder)->field = field;
    return LUMI_OK;
}

void lumi_tile_decoder_destroy(struct lumi_tile_decoder *decoder)
{
    if (!decoder)
        return;
    for (int i = 0; i < LUMI_LEVELS; i++)
        lumi_tile_core_destroy(decoder->cores[i]);
    lumi_free(decoder);
}

/* The tile's code from its entry; its bytes were found to lie inside the cluster's. */
static bool unpack(const struct field_level *level, const struct field_cluster *cluster,
                   const struct lumi_tile_entry *entry, struct lumi_tile_code *code)
{
    const uint8_t *data = cluster->tiles + entry->offset;
    uint16_t size = entry->size;

    *code = (struct lumi_tile_code){.fields = entry->fields, .quantizer = entry->quantizer, .check = entry->check};
    for (int k = 0; k < LUMI_WINDOWS; k++)
        code->shift[k] = entry->shift[k];
    if (entry->dictionary < LUMI_DICTIONARY_MAX) {
        code->compressed = level->dictionary[entry->dictionary].bytes;
        code->compressed_size = level->dictionary[entry->dictionary].size;
    } else {
        if (size < 2 || data[0] < 1 || data[0] > size - 1)
            return false;
        code->compressed = data + 1;
        code->compressed_size = data[0];
        size = (uint16_t)(size - 1 - data[0]);
        data += 1 + code->compressed_size;
    }
    code->data = data;
    code->size = size;
    return true;
}

static int decode_coded(struct lumi_tile_decoder *decoder, int level_index, const struct field_cluster *cluster,
                        const struct lumi_yuv *reference, const struct lumi_tile_entry *entry, int x, int y,
                        struct lumi_tile_pixels *pixels, struct lumi_error *error)
{
    const struct field_level *level = &decoder->field->levels[level_index];
    struct lumi_tile_core **core = &decoder->cores[level_index];
    struct lumi_tile_code code;
    const uint16_t mask = (1u << LUMI_CHECK_BITS) - 1;

    if (!*core)
        LUMI_TRY(lumi_tile_core_create(&level->priming, level->references, core, error));
    if (!unpack(level, cluster, entry, &code))
        return LUMI_ERR_CHECKSUM;
    LUMI_TRY(lumi_tile_core_decode(*core, reference, x, y, &code, pixels));
    return ((lumi_tile_hash(pixels) ^ code.check) & mask) == 0 ? LUMI_OK : LUMI_ERR_CHECKSUM;
}

int lumi_field_decode_tile(struct lumi_tile_decoder *decoder, int level_index, int view, int column, int row,
                           struct lumi_tile_pixels *pixels, struct lumi_error *error)
{
    const struct lumi_field *field = decoder->field;
    const struct field_level *level =
        level_index >= 0 && level_index < LUMI_LEVELS ? &field->levels[level_index] : NULL;

    if (!level || view < 0 || view >= level->view_count || column < 0 || column >= level->cols || row < 0 ||
        row >= level->rows)
        return lumi_fail(error, LUMI_ERR_ARG, "%s: no tile %d, %d of view %d in level %d", field->name, column, row,
                         view, level_index);

    int index = level->cluster_of[view], member = level->member_of[view], code;
    const struct field_cluster *cluster = &level->clusters[index];
    const struct lumi_yuv *reference = &level->references[index];
    int x = column * LUMI_TILE, y = row * LUMI_TILE;
    if (reference->width == 0 || (member > 0 && !cluster->entries)) {
        code = LUMI_ERR_CHECKSUM;
    } else if (member == 0) {
        lumi_window_copy(reference, x, y, pixels);
        code = LUMI_OK;
    } else {
        size_t tile = (size_t)(member - 1) * (size_t)(level->cols * level->rows) + (size_t)(row * level->cols + column);
        code = decode_coded(decoder, level_index, cluster, reference, &cluster->entries[tile], x, y, pixels, error);
    }
    if (code == LUMI_ERR_CHECKSUM)
        return lumi_fail(error, code, "%s: tile %d, %d of view %s is damaged", field->name, column, row,
                         level->views[view].name);
    return code;
}
