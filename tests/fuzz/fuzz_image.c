/* Every image reader, from memory: pixels, header and one OpenEXR channel. */
#include "proto/image/image.h"

#include <stdint.h>
#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct lumi_image_info info;
    struct lumi_image_meta meta;
    struct lumi_raster raster;
    struct lumi_error error = {0};

    int header = lumi_image_info_memory(data, size, "fuzz", &info, &error);
    int code = LUMI_ERR_LIMIT;
    if (header != LUMI_OK || (uint64_t)info.width * (uint64_t)info.height <= 1 << 20) /* larger ones are only slow */
        code = lumi_image_read_memory(data, size, "fuzz", 0, &raster, &meta, &error);
    else
        return 0;
    if (code == LUMI_OK && (raster.width != info.width || raster.height != info.height || raster.channels < 1))
        abort();
    if (code != LUMI_OK && (raster.data || meta.exif))
        abort();
    lumi_raster_finish(&raster);
    lumi_image_meta_finish(&meta);
    return 0;
}
