/* Raw files: behind the head of a DNG file, so that most of what is tried gets as far as LibRaw's decoders; an EXIF
 * block. The first byte chooses. */
#include "checks.h"

#include "proto/image/image_head.h"
#include "proto/image/image_priv.h"

#include <string.h>

#define SIDE_MAX 64

/* What the bytes say, over the head of a small DNG: pairs of offset and value, then pixels. */
static void read_raw(const uint8_t *data, size_t size)
{
    struct lumi_error error = {0};
    struct lumi_head head;
    struct lumi_raster raster;
    struct lumi_image_meta meta;
    uint8_t *file = NULL;
    size_t head_size;

    lumi_head_init(&head);
    head.kind = data[0] % 2 ? LUMI_HEAD_GREY : LUMI_HEAD_BAYER;
    head.width = data[1] % SIDE_MAX + 1;
    head.height = data[2] % SIDE_MAX + 1;
    head.bits = 8 + data[3] % 9;
    head.black = data[4];
    head.exposure_s = 1.0 / (data[5] + 1);
    memcpy(head.filter, (const uint8_t[4]){0, 1, 1, 2}, 4);
    head.model = "fuzz";
    if (checked(lumi_head_make(&head, &file, &head_size, &error), &error) != LUMI_OK)
        return;
    int edits = data[6] % 16;
    size_t at = 7, pixels = (size_t)head.width * (size_t)head.height * 2;
    uint8_t *all = lumi_calloc(head_size + pixels, 1);
    if (all) {
        memcpy(all, file, head_size);
        for (; edits > 0 && at + 3 <= size; edits--, at += 3)
            all[(data[at] | data[at + 1] << 8) % 1024] = data[at + 2];
        memcpy(all + head_size, data + at, size - at < pixels ? size - at : pixels);
        size_t length = head_size + pixels;
        int code = checked(lumi_image_info_memory(all, length, "fuzz", &meta.info, &error), &error);
        if (code == LUMI_OK && (uint64_t)meta.info.width * (uint64_t)meta.info.height <= 1 << 16) {
            code = checked(lumi_image_read_memory(all, length, "fuzz", 0, &raster, &meta, &error), &error);
            if (code != LUMI_OK && raster.data)
                abort();
            lumi_raster_finish(&raster);
            lumi_image_meta_finish(&meta);
        }
    }
    lumi_free(all);
    lumi_free(file);
}

static void read_exif(const uint8_t *data, size_t size)
{
    struct lumi_image_meta meta = {0};

    image_scan_exif(data, size, &meta);
    if (memchr(meta.serial, 0, sizeof meta.serial) == NULL || memchr(meta.model, 0, sizeof meta.model) == NULL)
        abort();
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size < 8)
        return 0;
    if (data[0] & 0x80)
        with_and_without_memory(data + 1, size - 1, read_exif);
    else
        with_and_without_memory(data, size, read_raw);
    return 0;
}
