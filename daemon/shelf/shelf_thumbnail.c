/* A small picture of a capture: a frame from its middle. */
#include "daemon/shelf/shelf.h"
#include "proto/base/file.h"
#include "proto/base/memory.h"
#include "proto/capture/capture.h"
#include "proto/image/image.h"

#include <string.h>

#define LONGER_SIDE 320
#define FILE_MOST ((size_t)512 << 20)

/* Means of step × step pixels. */
static int shrink(const struct lumi_raster *large, struct lumi_raster *small)
{
    const int longer = large->width > large->height ? large->width : large->height;
    const int step = (longer + LONGER_SIDE - 1) / LONGER_SIDE, channels = large->channels;
    const int width = large->width / step, height = large->height / step;

    if (width < 1 || height < 1)
        return LUMI_ERR_FORMAT;
    LUMI_TRY(lumi_raster_create(small, width, height, channels, LUMI_U8));
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width * channels; x++) {
            unsigned sum = 0;
            for (int j = 0; j < step; j++) {
                const uint8_t *row = lumi_row_u8(large, y * step + j) + (x / channels) * step * channels + x % channels;
                for (int i = 0; i < step; i++)
                    sum += row[i * channels];
            }
            lumi_row_u8(small, y)[x] = (uint8_t)(sum / (unsigned)(step * step));
        }
    return LUMI_OK;
}

static int convert(const char *path, const char *file, struct lumi_error *error)
{
    struct lumi_raster read = {0}, bytes = {0}, small = {0};
    struct lumi_image_options options;
    uint8_t *data = NULL;
    size_t size;
    int code;

    LUMI_GOTO(code, done, lumi_file_read(path, FILE_MOST, &data, &size, error));
    LUMI_GOTO(code, done, lumi_image_read_reduced(data, size, path, 2 * LONGER_SIDE, &read, NULL, error));
    LUMI_GOTO(code, done, lumi_raster_convert(&read, LUMI_U8, &bytes));
    LUMI_GOTO(code, done, shrink(&bytes, &small));
    lumi_image_options_init(&options);
    options.format = LUMI_IMAGE_JPEG;
    options.quality = 80;
    options.subsample = true;
    code = lumi_image_write(file, &small, &options, error);
done:
    lumi_raster_finish(&small);
    lumi_raster_finish(&bytes);
    lumi_raster_finish(&read);
    lumi_free(data);
    return code;
}

int lumi_shelf_thumbnail(const char *capture, const char *file, struct lumi_error *error)
{
    struct lumi_capture *opened = NULL;
    struct lumi_capture_frame *frames = NULL;
    char *path = NULL;
    int count, code;

    *error = (struct lumi_error){0};
    LUMI_TRY(lumi_capture_open(capture, LUMI_CAPTURE_READ, &opened, error));
    LUMI_GOTO(code, done, lumi_capture_frames(opened, LUMI_FRAMES_USABLE, &frames, &count, error));
    if (!count) {
        code = lumi_fail(error, LUMI_ERR_NOTFOUND, "%s: it has no picture", capture);
        goto done;
    }
    path = lumi_capture_join(opened, frames[count / 2].file);
    code = path ? convert(path, file, error) : LUMI_ERR_NOMEM;
    if (code != LUMI_OK && !error->text[0])
        lumi_fail(error, code, "%s: no picture could be made", capture);
done:
    lumi_free(path);
    lumi_free(frames);
    lumi_capture_close(opened);
    return code;
}
