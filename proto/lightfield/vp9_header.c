/* The uncompressed header of VP9 frames. */
#include "proto/lightfield/vp9_header.h"

struct bits {
    const uint8_t *data;
    size_t size, at; /* at: in bits */
    bool failed;
};

static unsigned get(struct bits *bits, int count)
{
    unsigned value = 0;

    while (count-- > 0) {
        if (bits->at / 8 >= bits->size) {
            bits->failed = true;
            return 0;
        }
        value = value << 1 | (bits->data[bits->at / 8] >> (7 - bits->at % 8) & 1u);
        bits->at++;
    }
    return value;
}

static void put(uint8_t *data, size_t *at, unsigned value, int count)
{
    while (count-- > 0) {
        if (*at % 8 == 0)
            data[*at / 8] = 0;
        data[*at / 8] |= (uint8_t)((value >> count & 1u) << (7 - *at % 8));
        (*at)++;
    }
}

enum { MARKER = 2, SWITCHABLE = 4, DELTA_COUNT = 6 };
static const signed char default_deltas[DELTA_COUNT] = {1, 0, -1, -1, 0, 0};

static void put_deltas(uint8_t *data, size_t *at)
{
    for (int i = 0; i < DELTA_COUNT; i++) {
        int delta = default_deltas[i];
        put(data, at, delta != 0, 1);
        if (delta != 0) {
            put(data, at, (unsigned)(delta < 0 ? -delta : delta), 6);
            put(data, at, delta < 0, 1);
        }
    }
}

size_t lumi_tile_header_build(const struct lumi_tile_frame *frame, const struct lumi_tile_fields *fields,
                              size_t compressed, uint8_t header[LUMI_TILE_HEADER_MAX])
{
    size_t at = 0;

    put(header, &at, MARKER, 2);
    put(header, &at, 0, 2);                      /* profile 0 */
    put(header, &at, 0, 1);                      /* show_existing_frame */
    put(header, &at, 1, 1);                      /* frame_type: not a key frame */
    put(header, &at, 1, 1);                      /* show_frame */
    put(header, &at, frame->error_resilient, 1); /* error_resilient_mode */
    if (!frame->error_resilient)
        put(header, &at, 0, 2); /* reset_frame_context */
    put(header, &at, 0, 8);     /* refresh_frame_flags */
    for (unsigned i = 0; i < 3; i++)
        put(header, &at, i << 1, 4); /* ref_frame_idx, ref_frame_sign_bias */
    put(header, &at, 1, 1);          /* size from the first reference */
    put(header, &at, 0, 1);          /* render_and_frame_size_different */
    put(header, &at, fields->precise, 1);
    if (fields->interpolation == SWITCHABLE)
        put(header, &at, 1, 1);
    else
        put(header, &at, fields->interpolation, 3);
    if (!frame->error_resilient) {
        put(header, &at, 0, 1); /* refresh_frame_context */
        put(header, &at, 1, 1); /* frame_parallel_decoding_mode */
    }
    put(header, &at, 0, 2); /* frame_context_idx */
    put(header, &at, fields->filter_level, 6);
    put(header, &at, frame->sharpness, 3);
    put(header, &at, 1, 1); /* loop_filter_delta_enabled */
    put(header, &at, frame->deltas, 1);
    if (frame->deltas)
        put_deltas(header, &at);
    put(header, &at, frame->quantizer, 8);
    put(header, &at, 0, 3); /* no quantizer deltas */
    put(header, &at, 0, 1); /* segmentation_enabled */
    put(header, &at, 0, 1); /* one tile row; columns need no bit at this width */
    put(header, &at, (unsigned)compressed, 16);
    return (at + 7) / 8;
}

/* Deltas must be absent or the defaults, since they stay in force for later frames. */
static bool get_deltas(struct bits *bits)
{
    bool plain = true;

    for (int i = 0; i < DELTA_COUNT; i++)
        if (get(bits, 1)) {
            int magnitude = (int)get(bits, 6);
            int delta = get(bits, 1) ? -magnitude : magnitude;
            plain = plain && delta == default_deltas[i];
        }
    return plain;
}

/* The part that is the same for all tiles. */
static bool get_to_references(struct bits *bits, struct lumi_tile_frame *frame)
{
    /* marker, profile, show_existing_frame, frame_type, show_frame */
    if (get(bits, 2) != MARKER || get(bits, 5) != 3)
        return false;
    frame->error_resilient = (uint8_t)get(bits, 1);
    if (!frame->error_resilient && get(bits, 2) != 0)
        return false;
    /* refresh_frame_flags; references 0, 1, 2; size from the first; no render size */
    return get(bits, 8) == 0 && get(bits, 12) == 0x024 && get(bits, 2) == 2;
}

bool lumi_tile_header_parse(const uint8_t *data, size_t size, struct lumi_tile_frame *frame,
                            struct lumi_tile_fields *fields, size_t *header, size_t *compressed)
{
    struct bits bits = {.data = data, .size = size};

    if (!get_to_references(&bits, frame))
        return false;
    fields->precise = (uint8_t)get(&bits, 1);
    fields->interpolation = (uint8_t)(get(&bits, 1) ? SWITCHABLE : get(&bits, 2));
    if (!frame->error_resilient && get(&bits, 1)) /* refresh_frame_context */
        return false;
    if (!frame->error_resilient)
        get(&bits, 1);      /* frame_parallel_decoding_mode: without effect on contexts that are not kept */
    if (get(&bits, 2) != 0) /* frame_context_idx */
        return false;
    fields->filter_level = (uint8_t)get(&bits, 6);
    frame->sharpness = (uint8_t)get(&bits, 3);
    if (get(&bits, 1) != 1) /* loop_filter_delta_enabled */
        return false;
    frame->deltas = (uint8_t)get(&bits, 1);
    if (frame->deltas && !get_deltas(&bits))
        return false;
    frame->quantizer = (uint8_t)get(&bits, 8);
    if (get(&bits, 3 + 1 + 1) != 0) /* quantizer deltas, segmentation, tile rows */
        return false;
    *compressed = get(&bits, 16);
    *header = (bits.at + 7) / 8;
    return !bits.failed && *compressed > 0 && *header + *compressed <= size;
}

static bool key_frame_plain(struct bits *bits, int width, int height)
{
    if (get(bits, 24) != 0x498342) /* sync code */
        return false;
    get(bits, 3 + 1); /* color_space, color_range */
    int coded_width = (int)get(bits, 16) + 1, coded_height = (int)get(bits, 16) + 1;
    return !bits->failed && coded_width == width && coded_height == height;
}

bool lumi_vp9_frame_plain(const uint8_t *data, size_t size, int width, int height, bool *key)
{
    struct bits bits = {.data = data, .size = size};

    if (get(&bits, 2) != MARKER || get(&bits, 2) != 0 || get(&bits, 1) != 0)
        return false;
    *key = get(&bits, 1) == 0;
    if (get(&bits, 1) != 1) /* show_frame */
        return false;
    bool error_resilient = get(&bits, 1) != 0;
    if (*key)
        return key_frame_plain(&bits, width, height);
    if (!error_resilient)
        get(&bits, 2);
    get(&bits, 8 + 12);
    for (int i = 0; i < 3; i++)
        if (get(&bits, 1))
            return !bits.failed;
    return false;
}
