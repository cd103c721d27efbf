/* Every image reader, from memory: header, pixels, reduced, RGB whatever the file has, and one OpenEXR channel. */
#include "checks.h"

#include "proto/image/image_priv.h"

/* Larger ones are only slow. */
#define PIXELS_MAX (1 << 18)

static void read_channel(const uint8_t *data, size_t size)
{
    struct lumi_error error = {0};
    struct image_source source = {data, size, size, "fuzz", &error, 0, NULL};
    struct lumi_raster raster = {0};

    if (checked(image_exr_channel(&source, size % 2 ? "Y" : "B", &raster), &error) == LUMI_OK && raster.channels != 1)
        abort();
    lumi_raster_finish(&raster);
}

static void read_reduced(const uint8_t *data, size_t size, const struct lumi_image_info *whole)
{
    struct lumi_image_info info;
    struct lumi_raster raster;
    struct lumi_error error = {0};

    if (checked(lumi_image_read_reduced(data, size, "fuzz", 64, &raster, &info, &error), &error) != LUMI_OK) {
        if (raster.data)
            abort();
        return;
    }
    if (info.width != whole->width || raster.width > info.width || raster.height > info.height)
        abort();
    lumi_raster_finish(&raster);
}

static void read_image(const uint8_t *data, size_t size)
{
    struct lumi_image_info info;
    struct lumi_image_meta meta;
    struct lumi_raster raster;
    struct lumi_error error = {0};
    int channels = size % 4 == 3 ? 3 : 0;

    int header = checked(lumi_image_info_memory(data, size, "fuzz", &info, &error), &error);
    if (header == LUMI_OK && (uint64_t)info.width * (uint64_t)info.height > PIXELS_MAX)
        return;
    int code = checked(lumi_image_read_memory(data, size, "fuzz", channels, &raster, &meta, &error), &error);
    if (code == LUMI_OK && (raster.width != info.width || raster.height != info.height || raster.channels < 1))
        abort();
    if (code != LUMI_OK && (raster.data || meta.exif))
        abort();
    lumi_raster_finish(&raster);
    lumi_image_meta_finish(&meta);
    if (code == LUMI_OK)
        read_reduced(data, size, &info);
    if (image_exr.probe(data, size))
        read_channel(data, size);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    with_and_without_memory(data, size, read_image);
    return 0;
}
