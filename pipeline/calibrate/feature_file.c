/* Reading and writing ".feat" files. */
#include "pipeline/calibrate/features.h"

#include "pipeline/calibrate/sealed.h"
#include "proto/base/file.h"
#include "proto/base/memory.h"
#include "proto/base/raster.h"

#include <math.h>
#include <string.h>

static const struct lumi_sealed kind = {"LUMIFEAT", 1, "features"};
enum { PLACE = 16, ITEM = PLACE + LUMI_DESCRIPTOR_SIZE, FILE_MAX = 64 + LUMI_FEATURES_MAX * ITEM };

void lumi_features_finish(struct lumi_features *features)
{
    lumi_free(features->items);
    *features = (struct lumi_features){0};
}

static bool feature_valid(const struct lumi_feature *item, int width, int height)
{
    return item->x >= 0 && item->x <= (float)width && item->y >= 0 && item->y <= (float)height && item->scale > 0 &&
           item->scale <= LUMI_RASTER_MAX && isfinite(item->orientation) && fabsf(item->orientation) < 100;
}

static int decode_items(struct lumi_reader *reader, const char *name, struct lumi_features *features,
                        struct lumi_error *error)
{
    features->items = lumi_calloc((size_t)(features->count ? features->count : 1), sizeof *features->items);
    if (!features->items)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: not enough memory", name);
    for (int i = 0; i < features->count; i++) {
        struct lumi_feature *item = &features->items[i];
        item->x = lumi_read_f32(reader);
        item->y = lumi_read_f32(reader);
        item->scale = lumi_read_f32(reader);
        item->orientation = lumi_read_f32(reader);
        if (!feature_valid(item, features->width, features->height))
            return lumi_fail(error, LUMI_ERR_FORMAT, "%s: feature %d lies outside the picture", name, i);
    }
    for (int i = 0; i < features->count; i++) {
        const uint8_t *bytes = lumi_read_bytes(reader, LUMI_DESCRIPTOR_SIZE);
        if (bytes)
            memcpy(features->items[i].descriptor, bytes, LUMI_DESCRIPTOR_SIZE);
    }
    return LUMI_OK;
}

static int decode(struct lumi_reader *reader, const char *name, struct lumi_features *features,
                  struct lumi_error *error)
{
    const uint32_t width = lumi_read_u32(reader), height = lumi_read_u32(reader), count = lumi_read_u32(reader);
    features->mean = lumi_read_f32(reader);
    features->sharpness = lumi_read_f32(reader);
    if (reader->failed || width < 1 || height < 1 || width > LUMI_RASTER_MAX || height > LUMI_RASTER_MAX ||
        count > LUMI_FEATURES_MAX || !isfinite(features->mean) || !isfinite(features->sharpness))
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: its head is no head of features", name);
    if (lumi_reader_left(reader) != (size_t)count * ITEM)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: is shorter or longer than its %u features", name, count);
    features->width = (int)width;
    features->height = (int)height;
    features->count = (int)count;
    return decode_items(reader, name, features, error);
}

int lumi_features_decode(const void *data, size_t size, const char *name, struct lumi_features *features,
                         struct lumi_error *error)
{
    struct lumi_reader reader;

    *features = (struct lumi_features){0};
    int code = lumi_sealed_open(&kind, data, size, name, &reader, error);
    if (code == LUMI_OK)
        code = decode(&reader, name, features, error);
    if (code != LUMI_OK)
        lumi_features_finish(features);
    return code;
}

int lumi_features_read(const char *path, struct lumi_features *features, struct lumi_error *error)
{
    uint8_t *data;
    size_t size;

    *features = (struct lumi_features){0};
    LUMI_TRY(lumi_file_read(path, FILE_MAX, &data, &size, error));
    int code = lumi_features_decode(data, size, path, features, error);
    lumi_free(data);
    return code;
}

int lumi_features_write(const char *path, const struct lumi_features *features, struct lumi_error *error)
{
    struct lumi_writer writer;

    lumi_sealed_begin(&kind, &writer);
    lumi_write_u32(&writer, (uint32_t)features->width);
    lumi_write_u32(&writer, (uint32_t)features->height);
    lumi_write_u32(&writer, (uint32_t)features->count);
    lumi_write_f32(&writer, features->mean);
    lumi_write_f32(&writer, features->sharpness);
    for (int i = 0; i < features->count; i++) {
        lumi_write_f32(&writer, features->items[i].x);
        lumi_write_f32(&writer, features->items[i].y);
        lumi_write_f32(&writer, features->items[i].scale);
        lumi_write_f32(&writer, features->items[i].orientation);
    }
    for (int i = 0; i < features->count; i++)
        lumi_write_bytes(&writer, features->items[i].descriptor, LUMI_DESCRIPTOR_SIZE);
    return lumi_sealed_save(&writer, path, error);
}
