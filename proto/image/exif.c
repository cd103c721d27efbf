/* What an EXIF block is asked for: orientation, exposure time, sensitivity (Exif 2.32, sections 4.6.4 and 4.6.5). */
#include "proto/base/memory.h"
#include "proto/image/image_priv.h"

#include <string.h>

#define TAG_ORIENTATION 0x0112
#define TAG_EXIF_DIRECTORY 0x8769
#define TAG_EXPOSURE_TIME 0x829a
#define TAG_ISO 0x8827
#define TYPE_SHORT 3
#define TYPE_LONG 4
#define TYPE_RATIONAL 5

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

/* Where the first directory says that the EXIF directory lies, 0 if it does not. Of several the last one is followed,
 * once: a directory that names itself a thousand times costs no more. */
static uint32_t read_directory(const struct tiff *tiff, size_t directory, bool first, struct lumi_image_meta *meta)
{
    unsigned count = get16(tiff, directory);
    uint32_t exif = 0;

    for (unsigned i = 0; i < count; i++) {
        size_t entry = directory + 2 + (size_t)i * 12;
        if (entry + 12 > tiff->size)
            break;
        unsigned tag = get16(tiff, entry), type = get16(tiff, entry + 2), value = get16(tiff, entry + 8);
        uint32_t at = get32(tiff, entry + 8);
        if (first && tag == TAG_ORIENTATION && type == TYPE_SHORT && value >= 1 && value <= 8)
            meta->info.orientation = (int)value;
        else if (first && tag == TAG_EXIF_DIRECTORY && type == TYPE_LONG)
            exif = at;
        else if (!first && tag == TAG_EXPOSURE_TIME && type == TYPE_RATIONAL && get32(tiff, (size_t)at + 4) != 0)
            meta->exposure_s = (double)get32(tiff, at) / get32(tiff, (size_t)at + 4);
        else if (!first && tag == TAG_ISO && type == TYPE_SHORT)
            meta->iso = value;
    }
    return exif;
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
    struct tiff tiff = {meta->exif, size, meta->exif[0] == 'M'};
    if (size >= 8 && (!memcmp(exif, "II*\0", 4) || !memcmp(exif, "MM\0*", 4))) {
        uint32_t directory = read_directory(&tiff, get32(&tiff, 4), true, meta);
        if (directory > 0)
            read_directory(&tiff, directory, false, meta);
    }
    return LUMI_OK;
}
