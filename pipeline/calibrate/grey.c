/* A picture's file in grey. */
#include "pipeline/calibrate/grey.h"

#include "proto/base/memory.h"
#include "proto/image/image.h"

#include <math.h>

static float grey_of(const struct lumi_raster *raster, int x, int y)
{
    static const float weight[3] = {0.2126f, 0.7152f, 0.0722f};
    const int channels = raster->channels, used = channels < 3 ? 1 : 3;
    float sum = 0;

    for (int c = 0; c < used; c++) {
        const int i = x * channels + c;
        const float value = raster->sample == LUMI_U8    ? lumi_row_u8(raster, y)[i]
                            : raster->sample == LUMI_U16 ? lumi_row_u16(raster, y)[i] * (1 / 257.0f)
                                                         : lumi_row_f32(raster, y)[i];
        sum += used == 1 ? value : weight[c] * value;
    }
    if (raster->sample == LUMI_F32)
        sum = isfinite(sum) ? 255 * lumi_srgb_encode(sum < 0 ? 0 : sum > 16 ? 16 : sum) : 0;
    return sum;
}

int lumi_grey_read(const char *path, float **grey, int *width, int *height, struct lumi_error *error)
{
    struct lumi_raster raster;

    *grey = NULL;
    LUMI_TRY(lumi_image_read(path, 0, &raster, NULL, error));
    *width = raster.width;
    *height = raster.height;
    *grey = lumi_alloc((size_t)raster.width * (size_t)raster.height, sizeof **grey);
    for (int y = 0; *grey && y < raster.height; y++)
        for (int x = 0; x < raster.width; x++)
            (*grey)[(size_t)y * (size_t)raster.width + (size_t)x] = grey_of(&raster, x, y);
    lumi_raster_finish(&raster);
    return *grey ? LUMI_OK : lumi_fail(error, LUMI_ERR_NOMEM, "%s: not enough memory", path);
}
