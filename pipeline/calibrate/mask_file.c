/* Reading and writing ".masks" files. */
#include "pipeline/calibrate/mask_find.h"

#include "pipeline/calibrate/sealed.h"
#include "proto/base/file.h"
#include "proto/base/memory.h"
#include "proto/base/raster.h"

static const struct lumi_sealed kind = {"LUMIMASK", 1, "masks"};
enum { MASKS_MAX = 4096 };

void lumi_masks_finish(struct lumi_masks *masks)
{
    for (int i = 0; masks->items && i < masks->count; i++)
        lumi_free(masks->items[i].rig);
    lumi_free(masks->items);
    *masks = (struct lumi_masks){0};
}

static int decode_mask(struct lumi_reader *reader, const char *name, struct lumi_mask *mask, struct lumi_error *error)
{
    const uint32_t camera = lumi_read_u32(reader), width = lumi_read_u32(reader), height = lumi_read_u32(reader),
                   block = lumi_read_u32(reader);

    if (camera > INT32_MAX || width < 1 || height < 1 || width > LUMI_RASTER_MAX || height > LUMI_RASTER_MAX ||
        block < 1 || block > LUMI_RASTER_MAX)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: holds a mask that is none", name);
    *mask = (struct lumi_mask){(int)camera, (int)width, (int)height, (int)block, NULL};
    const size_t size = (size_t)lumi_mask_across(mask) * (size_t)lumi_mask_down(mask);
    const uint8_t *bits = lumi_read_bytes(reader, (size + 7) / 8);
    if (!bits)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: is cut short", name);
    mask->rig = lumi_alloc(size, 1);
    if (!mask->rig)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: not enough memory", name);
    for (size_t i = 0; i < size; i++)
        mask->rig[i] = bits[i / 8] >> (i % 8) & 1;
    return LUMI_OK;
}

static int decode(struct lumi_reader *reader, const char *name, struct lumi_masks *masks, struct lumi_error *error)
{
    const uint32_t count = lumi_read_u32(reader);

    if (reader->failed || count > MASKS_MAX)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: its head is no head of masks", name);
    masks->items = lumi_calloc(count ? count : 1, sizeof *masks->items);
    if (!masks->items)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: not enough memory", name);
    for (masks->count = 0; masks->count < (int)count;) {
        struct lumi_mask *mask = &masks->items[masks->count++];
        LUMI_TRY(decode_mask(reader, name, mask, error));
    }
    return lumi_sealed_end(&kind, reader, name, error);
}

int lumi_masks_decode(const void *data, size_t size, const char *name, struct lumi_masks *masks,
                      struct lumi_error *error)
{
    struct lumi_reader reader;

    *masks = (struct lumi_masks){0};
    int code = lumi_sealed_open(&kind, data, size, name, &reader, error);
    if (code == LUMI_OK)
        code = decode(&reader, name, masks, error);
    if (code != LUMI_OK)
        lumi_masks_finish(masks);
    return code;
}

int lumi_masks_read(const char *path, struct lumi_masks *masks, struct lumi_error *error)
{
    uint8_t *data;
    size_t size;

    *masks = (struct lumi_masks){0};
    LUMI_TRY(lumi_file_read(path, (size_t)1 << 28, &data, &size, error));
    int code = lumi_masks_decode(data, size, path, masks, error);
    lumi_free(data);
    return code;
}

int lumi_masks_write(const char *path, const struct lumi_masks *masks, struct lumi_error *error)
{
    struct lumi_writer writer;

    lumi_sealed_begin(&kind, &writer);
    lumi_write_u32(&writer, (uint32_t)masks->count);
    for (int m = 0; m < masks->count; m++) {
        const struct lumi_mask *mask = &masks->items[m];
        const int size = lumi_mask_across(mask) * lumi_mask_down(mask);
        lumi_write_u32(&writer, (uint32_t)mask->camera);
        lumi_write_u32(&writer, (uint32_t)mask->width);
        lumi_write_u32(&writer, (uint32_t)mask->height);
        lumi_write_u32(&writer, (uint32_t)mask->block);
        for (int i = 0; i < size; i += 8) {
            uint8_t byte = 0;
            for (int k = 0; k < 8 && i + k < size; k++)
                byte |= (uint8_t)((mask->rig[i + k] ? 1 : 0) << k);
            lumi_write_u8(&writer, byte);
        }
    }
    return lumi_sealed_save(&writer, path, error);
}
