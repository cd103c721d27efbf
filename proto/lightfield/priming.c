/* The frames that prime a tile decoder, in memory and as bytes. */
#include "proto/base/memory.h"
#include "proto/lightfield/tile_core.h"

#include <string.h>

void lumi_priming_finish(struct lumi_priming *priming)
{
    for (int i = 0; i < priming->count; i++)
        lumi_free(priming->frames[i].data);
    lumi_free(priming->frames);
    lumi_free(priming->blank);
    *priming = (struct lumi_priming){0};
}

static bool frames_equal(const struct lumi_priming_frame *a, const struct lumi_priming_frame *b)
{
    return a->size == b->size && memcmp(a->data, b->data, a->size) == 0 && a->reference == b->reference &&
           memcmp(a->at, b->at, sizeof a->at) == 0;
}

bool lumi_priming_equal(const struct lumi_priming *a, const struct lumi_priming *b)
{
    if (memcmp(&a->frame, &b->frame, sizeof a->frame) != 0 || a->count != b->count || a->blank_size != b->blank_size)
        return false;
    if (a->blank_size > 0 && memcmp(a->blank, b->blank, a->blank_size) != 0)
        return false;
    for (int i = 0; i < a->count; i++)
        if (!frames_equal(&a->frames[i], &b->frames[i]))
            return false;
    return true;
}

int lumi_priming_add(struct lumi_priming *priming, const uint8_t *data, size_t size, int reference,
                     const struct lumi_shift at[LUMI_WINDOWS])
{
    if (priming->count >= LUMI_PRIMING_FRAMES_MAX || size < 1 || size > LUMI_PRIMING_FRAME_MAX)
        return LUMI_ERR_LIMIT;
    if (!priming->frames)
        priming->frames = lumi_calloc(LUMI_PRIMING_FRAMES_MAX, sizeof *priming->frames);
    uint8_t *copy = lumi_alloc(size, 1);
    if (!priming->frames || !copy) {
        lumi_free(copy);
        return LUMI_ERR_NOMEM;
    }
    memcpy(copy, data, size);

    struct lumi_priming_frame *frame = &priming->frames[priming->count++];
    *frame = (struct lumi_priming_frame){.data = copy, .size = (uint32_t)size, .reference = reference};
    if (reference >= 0)
        memcpy(frame->at, at, sizeof frame->at);
    return LUMI_OK;
}

void lumi_priming_write(const struct lumi_priming *priming, struct lumi_writer *writer)
{
    lumi_write_u8(writer, priming->frame.quantizer);
    lumi_write_u8(writer, priming->frame.sharpness);
    lumi_write_u8(writer, priming->frame.deltas);
    lumi_write_u8(writer, priming->frame.error_resilient);
    lumi_write_u32(writer, (uint32_t)priming->count);
    for (int i = 0; i < priming->count; i++) {
        const struct lumi_priming_frame *frame = &priming->frames[i];
        lumi_write_u16(writer, (uint16_t)frame->size);
        lumi_write_varint(writer, (uint64_t)(frame->reference + 1));
        for (int k = 0; frame->reference >= 0 && k < LUMI_WINDOWS; k++) {
            lumi_write_u16(writer, (uint16_t)frame->at[k].x);
            lumi_write_u16(writer, (uint16_t)frame->at[k].y);
        }
        lumi_write_bytes(writer, frame->data, frame->size);
    }
    lumi_write_u16(writer, (uint16_t)priming->blank_size);
    lumi_write_bytes(writer, priming->blank, priming->blank_size);
}

static int read_frame(struct lumi_reader *reader, int references, bool first, struct lumi_priming *priming)
{
    struct lumi_shift at[LUMI_WINDOWS] = {{0}};
    size_t size = lumi_read_u16(reader);
    uint64_t reference = lumi_read_varint(reader);
    bool key;

    /* libvpx takes no windows before its first frame: it has nothing to copy them into, and looks not. */
    if (reader->failed || reference > (uint64_t)references || (first && reference > 0))
        return LUMI_ERR_FORMAT;
    for (int k = 0; reference > 0 && k < LUMI_WINDOWS; k++) {
        at[k].x = (int16_t)lumi_read_u16(reader);
        at[k].y = (int16_t)lumi_read_u16(reader);
        if ((at[k].x | at[k].y) & 1)
            return LUMI_ERR_FORMAT;
    }
    const uint8_t *data = lumi_read_bytes(reader, size);
    if (!data || !lumi_vp9_frame_plain(data, size, LUMI_TILE, LUMI_TILE, &key) || key != first)
        return LUMI_ERR_FORMAT;
    return lumi_priming_add(priming, data, size, (int)reference - 1, at);
}

static int read_priming(struct lumi_reader *reader, int references, struct lumi_priming *priming)
{
    bool key;

    priming->frame.quantizer = lumi_read_u8(reader);
    priming->frame.sharpness = lumi_read_u8(reader);
    priming->frame.deltas = lumi_read_u8(reader);
    priming->frame.error_resilient = lumi_read_u8(reader);
    uint32_t count = lumi_read_u32(reader);
    if (reader->failed || priming->frame.sharpness > 7 || priming->frame.deltas > 1 ||
        priming->frame.error_resilient > 1 || count < 1 || count > LUMI_PRIMING_FRAMES_MAX)
        return LUMI_ERR_FORMAT;
    for (uint32_t i = 0; i < count; i++)
        LUMI_TRY(read_frame(reader, references, i == 0, priming));

    size_t size = lumi_read_u16(reader);
    const uint8_t *blank = lumi_read_bytes(reader, size);
    if (!blank || (size == 0) != (priming->frame.error_resilient == 1))
        return LUMI_ERR_FORMAT;
    if (size > 0) {
        if (!lumi_vp9_frame_plain(blank, size, LUMI_TILE, LUMI_TILE, &key) || key)
            return LUMI_ERR_FORMAT;
        priming->blank = lumi_alloc(size, 1);
        if (!priming->blank)
            return LUMI_ERR_NOMEM;
        memcpy(priming->blank, blank, size);
        priming->blank_size = (uint32_t)size;
    }
    return LUMI_OK;
}

int lumi_priming_read(struct lumi_reader *reader, int references, struct lumi_priming *priming,
                      struct lumi_error *error)
{
    *priming = (struct lumi_priming){0};

    int code = read_priming(reader, references, priming);
    if (code == LUMI_OK)
        return code;
    lumi_priming_finish(priming);
    return lumi_fail(error, code, "the frames that prime the tile decoder are malformed");
}
