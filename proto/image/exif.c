/* The one thing an EXIF block is asked for: the orientation (Exif 2.32, section 4.6.4 A, tag 0x0112). */
#include "proto/base/memory.h"
#include "proto/image/image_priv.h"

#include <string.h>

#define TAG_ORIENTATION 0x0112
#define TYPE_SHORT 3

struct tiff {
    const uint8_t *data;
    size_t size;
    bool big;
};

static unsigned get16(const struct tiff *tiff, size_t at)
{
    if (tiff->size < 2 || at > tiff->size - 2)
        return 0;
    const uint8_t *p = tiff->data + at;
    return tiff->big ? (unsigned)(p[0] << 8 | p[1]) : (unsigned)(p[1] << 8 | p[0]);
}

static uint32_t get32(const struct tiff *tiff, size_t at)
{
    uint32_t first = get16(tiff, at), second = get16(tiff, at + 2);

    return tiff->big ? first << 16 | second : second << 16 | first;
}

int image_exif_orientation(const uint8_t *exif, size_t size)
{
    struct tiff tiff = {exif, size, size > 0 && exif[0] == 'M'};

    if (size < 8 || (memcmp(exif, "II*\0", 4) != 0 && memcmp(exif, "MM\0*", 4) != 0))
        return 1;
    size_t directory = get32(&tiff, 4);
    unsigned count = get16(&tiff, directory);
    for (unsigned i = 0; i < count; i++) {
        size_t entry = directory + 2 + (size_t)i * 12;
        if (entry + 12 > size)
            break;
        if (get16(&tiff, entry) != TAG_ORIENTATION)
            continue;
        unsigned value = get16(&tiff, entry + 8);
        return get16(&tiff, entry + 2) == TYPE_SHORT && value >= 1 && value <= 8 ? (int)value : 1;
    }
    return 1;
}

int image_keep_exif(const struct image_source *source, const void *exif, size_t size, struct lumi_image_meta *meta)
{
    if (size == 0 || meta->exif)
        return LUMI_OK;
    meta->exif = lumi_alloc(size, 1);
    if (!meta->exif)
        return lumi_fail(source->error, LUMI_ERR_NOMEM, "%s: no memory for its EXIF block", source->name);
    memcpy(meta->exif, exif, size);
    meta->exif_size = size;
    meta->info.orientation = image_exif_orientation(exif, size);
    return LUMI_OK;
}
