/* Reading and writing images: which codec, what limits, which name. */
#include "proto/image/image.h"

#include "proto/base/file.h"
#include "proto/base/memory.h"
#include "proto/image/image_priv.h"

#include <fcntl.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

#define MAX_FILE ((size_t)1 << 32)
#define HEADER_BYTES ((size_t)256 << 10) /* enough for the header of nearly every file but TIFF */

static const struct image_codec *const codecs[] = {
    [LUMI_IMAGE_JPEG] = &image_jpeg, [LUMI_IMAGE_PNG] = &image_png, [LUMI_IMAGE_TIFF] = &image_tiff,
    [LUMI_IMAGE_EXR] = &image_exr,   [LUMI_IMAGE_RAW] = &image_raw,
};

void lumi_image_meta_finish(struct lumi_image_meta *meta)
{
    lumi_free(meta->exif);
    *meta = (struct lumi_image_meta){0};
}

int image_describe(const struct image_source *source, uint64_t width, uint64_t height, int channels,
                   enum lumi_sample sample, struct lumi_image_info *info)
{
    if (width < 1 || height < 1)
        return lumi_fail(source->error, LUMI_ERR_FORMAT, "%s: an image without pixels", source->name);
    if (width > LUMI_RASTER_MAX || height > LUMI_RASTER_MAX || width * height > LUMI_IMAGE_MAX_PIXELS)
        return lumi_fail(source->error, LUMI_ERR_LIMIT, "%s: %llux%llu pixels are more than this program accepts",
                         source->name, (unsigned long long)width, (unsigned long long)height);
    if (width * height / LUMI_IMAGE_MAX_RATIO > source->file_size)
        return lumi_fail(source->error, LUMI_ERR_FORMAT, "%s: claims %llux%llu pixels, but has only %llu bytes",
                         source->name, (unsigned long long)width, (unsigned long long)height,
                         (unsigned long long)source->file_size);
    info->width = (int)width;
    info->height = (int)height;
    info->channels = channels;
    info->sample = sample;
    return LUMI_OK;
}

int image_claim(const struct image_source *source, const struct lumi_image_info *info, struct lumi_raster *raster)
{
    int code = lumi_raster_create(raster, info->width, info->height, info->channels, info->sample);

    if (code != LUMI_OK)
        lumi_fail(source->error, code, "%s: no memory for %dx%d pixels", source->name, info->width, info->height);
    return code;
}

static const struct image_codec *find(const struct image_source *source, enum lumi_image_format *format)
{
    /* Raw files first: most of them are TIFF as well. */
    for (int i = LUMI_IMAGE_RAW; i >= LUMI_IMAGE_JPEG; i--)
        if (codecs[i]->probe(source->data, source->size)) {
            *format = (enum lumi_image_format)i;
            return codecs[i];
        }
    return NULL;
}

static int read_source(const struct image_source *source, struct lumi_raster *raster, struct lumi_image_meta *meta)
{
    enum lumi_image_format format;

    if (source->file_size == 0)
        return lumi_fail(source->error, LUMI_ERR_FORMAT, "%s: the file is empty", source->name);
    const struct image_codec *codec = find(source, &format);
    if (!codec)
        return lumi_fail(source->error, LUMI_ERR_UNSUPPORTED, "%s: not a JPEG, PNG, TIFF, OpenEXR or raw image",
                         source->name);
    meta->info.format = format;
    meta->info.orientation = 1;
    return codec->read(source, raster, meta);
}

/* Grey copied to three channels, alpha dropped. */
static int to_rgb(const struct image_source *source, struct lumi_raster *raster)
{
    struct lumi_raster rgb;
    size_t sample = (size_t)raster->sample;
    size_t step = raster->channels == 1 ? 0 : sample;

    int code = lumi_raster_create(&rgb, raster->width, raster->height, 3, raster->sample);
    if (code != LUMI_OK)
        return lumi_fail(source->error, code, "%s: no memory for %dx%d pixels", source->name, raster->width,
                         raster->height);
    for (int y = 0; y < raster->height; y++) {
        const uint8_t *in = lumi_row_u8(raster, y);
        uint8_t *out = lumi_row_u8(&rgb, y);
        for (int x = 0; x < raster->width; x++, in += sample * (size_t)raster->channels, out += 3 * sample)
            for (size_t c = 0; c < 3; c++)
                memcpy(out + c * sample, in + c * step, sample);
    }
    lumi_raster_finish(raster);
    *raster = rgb;
    return LUMI_OK;
}

static int read_all(const struct image_source *source, int channels, struct lumi_raster *raster,
                    struct lumi_image_meta *meta)
{
    struct lumi_image_meta own = {0};

    *raster = (struct lumi_raster){0};
    if (meta)
        *meta = own;
    if (channels != 0 && channels != 3)
        return lumi_fail(source->error, LUMI_ERR_ARG, "%s: images are read with their own channels or as RGB",
                         source->name);
    int code = read_source(source, raster, &own);
    if (code == LUMI_OK && channels == 3 && raster->channels != 3)
        code = to_rgb(source, raster);
    if (code != LUMI_OK)
        lumi_raster_finish(raster);
    if (code == LUMI_OK && meta)
        *meta = own;
    else
        lumi_image_meta_finish(&own);
    return code;
}

int lumi_image_read_memory(const void *data, size_t size, const char *name, int channels, struct lumi_raster *raster,
                           struct lumi_image_meta *meta, struct lumi_error *error)
{
    struct image_source source = {data, size, size, name, error, 0, NULL};

    return read_all(&source, channels, raster, meta);
}

int lumi_image_read_reduced(const void *data, size_t size, const char *name, int most, struct lumi_raster *raster,
                            struct lumi_image_info *info, struct lumi_error *error)
{
    struct image_source source = {data, size, size, name, error, most, NULL};
    struct lumi_image_meta meta = {0};

    *raster = (struct lumi_raster){0};
    int code = read_source(&source, raster, &meta);
    if (code != LUMI_OK)
        lumi_raster_finish(raster);
    if (info)
        *info = code == LUMI_OK ? meta.info : (struct lumi_image_info){0};
    lumi_image_meta_finish(&meta);
    return code;
}

int lumi_image_read_developed(const char *path, int channels, const struct lumi_image_development *development,
                              struct lumi_raster *raster, struct lumi_image_meta *meta, struct lumi_error *error)
{
    uint8_t *data;
    size_t size;

    *raster = (struct lumi_raster){0};
    if (meta)
        *meta = (struct lumi_image_meta){0};
    LUMI_TRY(lumi_file_read(path, MAX_FILE, &data, &size, error));
    struct image_source source = {data, size, size, path, error, 0, development};
    int code = read_all(&source, channels, raster, meta);
    lumi_free(data);
    return code;
}

int lumi_image_read(const char *path, int channels, struct lumi_raster *raster, struct lumi_image_meta *meta,
                    struct lumi_error *error)
{
    return lumi_image_read_developed(path, channels, NULL, raster, meta, error);
}

int lumi_image_read_channel(const char *path, const char *channel, struct lumi_raster *raster, struct lumi_error *error)
{
    uint8_t *data;
    size_t size;

    *raster = (struct lumi_raster){0};
    LUMI_TRY(lumi_file_read(path, MAX_FILE, &data, &size, error));
    struct image_source source = {data, size, size, path, error, 0, NULL};
    int code = image_exr.probe(data, size) ? image_exr_channel(&source, channel, raster)
                                           : lumi_fail(error, LUMI_ERR_FORMAT, "%s: not an OpenEXR image", path);
    if (code != LUMI_OK)
        lumi_raster_finish(raster);
    lumi_free(data);
    return code;
}

int lumi_image_info_memory(const void *data, size_t size, const char *name, struct lumi_image_info *info,
                           struct lumi_error *error)
{
    struct image_source source = {data, size, size, name, error, 0, NULL};
    struct lumi_image_meta meta = {0};
    int code = read_source(&source, NULL, &meta);

    *info = code == LUMI_OK ? meta.info : (struct lumi_image_info){0};
    lumi_image_meta_finish(&meta);
    return code;
}

/* Tries the file's first bytes. False if they do not say it all, or not well: then the whole file decides. */
static bool meta_from_beginning(const char *path, struct lumi_image_meta *meta)
{
    struct stat status;
    bool done = false;
    int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);

    if (fd < 0)
        return false;
    uint8_t *data = lumi_alloc(HEADER_BYTES, 1);
    if (data && !fstat(fd, &status) && S_ISREG(status.st_mode)) {
        ssize_t got = read(fd, data, HEADER_BYTES);
        struct image_source source = {data, got > 0 ? (size_t)got : 0, (uint64_t)status.st_size, path, NULL, 0, NULL};
        done = got > 0 && !image_tiff.probe(data, source.size) && !image_raw.probe(data, source.size) &&
               read_source(&source, NULL, meta) == LUMI_OK;
        if (!done)
            lumi_image_meta_finish(meta);
    }
    lumi_free(data);
    close(fd);
    return done;
}

int lumi_image_read_meta(const char *path, struct lumi_image_meta *meta, struct lumi_error *error)
{
    uint8_t *data;
    size_t size;

    *meta = (struct lumi_image_meta){0};
    if (meta_from_beginning(path, meta))
        return LUMI_OK;
    LUMI_TRY(lumi_file_read(path, MAX_FILE, &data, &size, error));
    struct image_source source = {data, size, size, path, error, 0, NULL};
    int code = read_source(&source, NULL, meta);
    if (code != LUMI_OK)
        lumi_image_meta_finish(meta);
    lumi_free(data);
    return code;
}

int lumi_image_info(const char *path, struct lumi_image_info *info, struct lumi_error *error)
{
    struct lumi_image_meta meta;
    int code = lumi_image_read_meta(path, &meta, error);

    *info = meta.info;
    lumi_image_meta_finish(&meta);
    return code;
}

void lumi_image_options_init(struct lumi_image_options *options)
{
    *options = (struct lumi_image_options){.quality = 95, .half = true};
}

enum lumi_image_format lumi_image_format_of_name(const char *path)
{
    static const struct {
        const char *extension;
        enum lumi_image_format format;
    } known[] = {
        {".jpg", LUMI_IMAGE_JPEG},  {".jpeg", LUMI_IMAGE_JPEG}, {".png", LUMI_IMAGE_PNG}, {".tif", LUMI_IMAGE_TIFF},
        {".tiff", LUMI_IMAGE_TIFF}, {".exr", LUMI_IMAGE_EXR},   {".dng", LUMI_IMAGE_RAW}, {".nef", LUMI_IMAGE_RAW},
        {".nrw", LUMI_IMAGE_RAW},   {".cr2", LUMI_IMAGE_RAW},   {".cr3", LUMI_IMAGE_RAW}, {".crw", LUMI_IMAGE_RAW},
        {".arw", LUMI_IMAGE_RAW},   {".srf", LUMI_IMAGE_RAW},   {".sr2", LUMI_IMAGE_RAW}, {".raf", LUMI_IMAGE_RAW},
        {".orf", LUMI_IMAGE_RAW},   {".rw2", LUMI_IMAGE_RAW},   {".pef", LUMI_IMAGE_RAW}, {".srw", LUMI_IMAGE_RAW},
        {".3fr", LUMI_IMAGE_RAW},   {".iiq", LUMI_IMAGE_RAW},   {".mrw", LUMI_IMAGE_RAW}, {".erf", LUMI_IMAGE_RAW},
        {".kdc", LUMI_IMAGE_RAW},   {".dcr", LUMI_IMAGE_RAW},   {".mef", LUMI_IMAGE_RAW}, {".mos", LUMI_IMAGE_RAW},
        {".rwl", LUMI_IMAGE_RAW},   {".raw", LUMI_IMAGE_RAW},
    };
    const char *slash = strrchr(path, '/');
    const char *dot = strrchr(slash ? slash : path, '.');

    for (size_t i = 0; dot && i < sizeof known / sizeof *known; i++)
        if (!strcasecmp(dot, known[i].extension))
            return known[i].format;
    return LUMI_IMAGE_AUTO;
}

/* The sample type a format is written with. */
static enum lumi_sample sample_for(enum lumi_sample sample, const struct lumi_image_options *options)
{
    switch (options->format) {
    case LUMI_IMAGE_JPEG:
        return LUMI_U8;
    case LUMI_IMAGE_EXR:
        return LUMI_F32;
    default:
        break;
    }
    if (options->bits)
        return options->bits == 8 ? LUMI_U8 : options->bits == 16 ? LUMI_U16 : LUMI_F32;
    return sample == LUMI_F32 && options->format == LUMI_IMAGE_PNG ? LUMI_U16 : sample;
}

static int check_options(const struct lumi_raster *raster, const struct lumi_image_options *options,
                         struct lumi_error *error)
{
    bool wide = options->format == LUMI_IMAGE_TIFF && options->bits == 32;

    if (options->format < LUMI_IMAGE_JPEG || options->format > LUMI_IMAGE_EXR)
        return lumi_fail(error, LUMI_ERR_ARG, "no image format chosen: .jpg, .png, .tif or .exr");
    if (options->quality < 1 || options->quality > 100)
        return lumi_fail(error, LUMI_ERR_ARG, "JPEG quality %d is not in 1..100", options->quality);
    if (options->bits != 0 && options->bits != 8 && options->bits != 16 && !wide)
        return lumi_fail(error, LUMI_ERR_ARG, "%d bits a sample are not to be had", options->bits);
    if (options->level < -1 || options->level > 9)
        return lumi_fail(error, LUMI_ERR_ARG, "compression level %d is not in -1..9", options->level);
    if (raster->channels != 1 && raster->channels != 3 &&
        !(raster->channels == 4 && options->format != LUMI_IMAGE_JPEG))
        return lumi_fail(error, LUMI_ERR_ARG, "an image of %d channels cannot be written so", raster->channels);
    return LUMI_OK;
}

int lumi_image_encode(const struct lumi_raster *raster, const struct lumi_image_options *options, uint8_t **data,
                      size_t *size, struct lumi_error *error)
{
    struct lumi_raster converted = {0};
    struct lumi_writer out;

    *data = NULL;
    *size = 0;
    LUMI_TRY(check_options(raster, options, error));
    enum lumi_sample sample = sample_for(raster->sample, options);
    if (sample != raster->sample) {
        int code = lumi_raster_convert(raster, sample, &converted);
        if (code != LUMI_OK)
            return lumi_fail(error, code, "no memory to convert the image");
        raster = &converted;
    }
    lumi_writer_init(&out);
    int code = codecs[options->format]->encode(raster, options, &out, error);
    if (code == LUMI_OK && out.failed)
        code = lumi_fail(error, LUMI_ERR_NOMEM, "no memory for the encoded image");
    if (code == LUMI_OK) {
        *data = out.data;
        *size = out.size;
    } else {
        lumi_writer_finish(&out);
    }
    lumi_raster_finish(&converted);
    return code;
}

int lumi_image_write(const char *path, const struct lumi_raster *raster, const struct lumi_image_options *options,
                     struct lumi_error *error)
{
    struct lumi_image_options own;
    uint8_t *data;
    size_t size;

    lumi_image_options_init(&own);
    if (options)
        own = *options;
    if (own.format == LUMI_IMAGE_AUTO)
        own.format = lumi_image_format_of_name(path);
    int code = lumi_image_encode(raster, &own, &data, &size, error);
    if (code != LUMI_OK) {
        lumi_fail_prefix(error, "%s", path);
        return code;
    }
    code = lumi_file_write(path, data, size, own.sync, error);
    lumi_free(data);
    return code;
}
