/* TIFF through libtiff: grey, RGB, RGBA of 8 or 16 bit integers or 32-bit floats; strips or tiles; the compressions
 * without loss. */
#include "proto/base/memory.h"
#include "proto/image/image_priv.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <tiffio.h>

#define MAX_ALLOCATION ((tmsize_t)1 << 30) /* of libtiff, at once */

/* The file in memory, where libtiff stands in it, and its first complaint. */
struct stream {
    const uint8_t *data;
    uint64_t size, at;
    struct lumi_writer *out;
    char text[200];
};

static bool probe_tiff(const uint8_t *data, size_t size)
{
    return size >= 4 && (!memcmp(data, "II*\0", 4) || !memcmp(data, "MM\0*", 4) || !memcmp(data, "II+\0", 4) ||
                         !memcmp(data, "MM\0+", 4));
}

static int on_error(TIFF *tiff, void *user, const char *module, const char *format, va_list args)
{
    struct stream *stream = user;

    (void)tiff;
    (void)module;
    if (!stream->text[0])
        vsnprintf(stream->text, sizeof stream->text, format, args);
    return 1;
}

/* Unknown tags and the like; what costs pixels is an error. */
static int on_warning(TIFF *tiff, void *user, const char *module, const char *format, va_list args)
{
    (void)tiff;
    (void)user;
    (void)module;
    (void)format;
    (void)args;
    return 1;
}

static tmsize_t stream_read(thandle_t handle, void *buffer, tmsize_t count)
{
    struct stream *stream = handle;
    const uint8_t *data = stream->out ? stream->out->data : stream->data;
    uint64_t size = stream->out ? stream->out->size : stream->size;
    uint64_t left = stream->at < size ? size - stream->at : 0;
    uint64_t take = count > 0 ? (uint64_t)count : 0;

    take = take < left ? take : left;
    if (take > 0)
        memcpy(buffer, data + stream->at, take);
    stream->at += take;
    return (tmsize_t)take;
}

static tmsize_t stream_write(thandle_t handle, void *buffer, tmsize_t count)
{
    struct stream *stream = handle;
    struct lumi_writer *out = stream->out;

    if (!out || count < 0)
        return 0;
    while (!out->failed && out->size < stream->at)
        lumi_write_u8(out, 0);
    if (out->failed)
        return 0;
    uint64_t size = (uint64_t)count, behind = out->size - stream->at;
    uint64_t over = behind < size ? behind : size;
    if (over > 0)
        memcpy(out->data + stream->at, buffer, over);
    lumi_write_bytes(out, (const uint8_t *)buffer + over, size - over);
    stream->at += size;
    return out->failed ? 0 : count;
}

static toff_t stream_size(thandle_t handle)
{
    struct stream *stream = handle;

    return stream->out ? stream->out->size : stream->size;
}

static toff_t stream_seek(thandle_t handle, toff_t offset, int whence)
{
    struct stream *stream = handle;

    if (whence == SEEK_SET)
        stream->at = offset;
    else if (whence == SEEK_CUR)
        stream->at += offset;
    else
        stream->at = stream_size(handle) + offset;
    return stream->at;
}

static int stream_close(thandle_t handle)
{
    (void)handle;
    return 0;
}

static TIFF *open_stream(struct stream *stream, const char *name, const char *mode)
{
    TIFFOpenOptions *options = TIFFOpenOptionsAlloc();

    if (!options)
        return NULL;
    TIFFOpenOptionsSetMaxSingleMemAlloc(options, MAX_ALLOCATION);
    TIFFOpenOptionsSetErrorHandlerExtR(options, on_error, stream);
    TIFFOpenOptionsSetWarningHandlerExtR(options, on_warning, stream);
    TIFF *tiff = TIFFClientOpenExt(name, mode, stream, stream_read, stream_write, stream_seek, stream_close,
                                   stream_size, NULL, NULL, options);
    TIFFOpenOptionsFree(options);
    return tiff;
}

/* Reading */

struct read_job {
    const struct image_source *source;
    struct stream stream;
    TIFF *tiff;
    bool separate, inverted, ycbcr;
    struct lumi_raster *raster;
};

static int fail_tiff(const struct read_job *job, const char *otherwise)
{
    return lumi_fail(job->source->error, LUMI_ERR_FORMAT, "%s: %s", job->source->name,
                     job->stream.text[0] ? job->stream.text : otherwise);
}

static bool known_compression(unsigned compression)
{
    return compression == COMPRESSION_NONE || compression == COMPRESSION_LZW ||
           compression == COMPRESSION_ADOBE_DEFLATE || compression == COMPRESSION_DEFLATE ||
           compression == COMPRESSION_PACKBITS || compression == COMPRESSION_ZSTD || compression == COMPRESSION_LZMA;
}

static int describe(struct read_job *job, struct lumi_image_info *info)
{
    uint16_t bits = 1, samples = 1, format = SAMPLEFORMAT_UINT, planar = PLANARCONFIG_CONTIG, compression = 1;
    uint16_t photometric = PHOTOMETRIC_MINISBLACK, orientation = 1;
    uint32_t width = 0, height = 0;

    TIFFGetField(job->tiff, TIFFTAG_IMAGEWIDTH, &width);
    TIFFGetField(job->tiff, TIFFTAG_IMAGELENGTH, &height);
    TIFFGetFieldDefaulted(job->tiff, TIFFTAG_BITSPERSAMPLE, &bits);
    TIFFGetFieldDefaulted(job->tiff, TIFFTAG_SAMPLESPERPIXEL, &samples);
    TIFFGetFieldDefaulted(job->tiff, TIFFTAG_SAMPLEFORMAT, &format);
    TIFFGetFieldDefaulted(job->tiff, TIFFTAG_PLANARCONFIG, &planar);
    TIFFGetFieldDefaulted(job->tiff, TIFFTAG_COMPRESSION, &compression);
    TIFFGetFieldDefaulted(job->tiff, TIFFTAG_ORIENTATION, &orientation);
    TIFFGetField(job->tiff, TIFFTAG_PHOTOMETRIC, &photometric);
    bool grey = photometric == PHOTOMETRIC_MINISBLACK || photometric == PHOTOMETRIC_MINISWHITE;
    bool integer = format == SAMPLEFORMAT_UINT && (bits == 8 || bits == 16);
    bool real = format == SAMPLEFORMAT_IEEEFP && bits == 32;
    job->ycbcr = photometric == PHOTOMETRIC_YCBCR && samples == 3 && bits == 8 && integer &&
                 compression == COMPRESSION_NONE && planar == PLANARCONFIG_CONTIG && !TIFFIsTiled(job->tiff);
    if (!(integer || real) || !known_compression(compression) ||
        !((grey && samples == 1) || (photometric == PHOTOMETRIC_RGB && (samples == 3 || samples == 4)) || job->ycbcr))
        return lumi_fail(job->source->error, LUMI_ERR_UNSUPPORTED,
                         "%s: a TIFF of %u samples of %u bits (format %u, photometric %u, compression %u)",
                         job->source->name, samples, bits, format, photometric, compression);
    job->separate = planar == PLANARCONFIG_SEPARATE && samples > 1;
    job->inverted = photometric == PHOTOMETRIC_MINISWHITE;
    info->orientation = orientation >= 1 && orientation <= 8 ? orientation : 1;
    return image_describe(job->source, width, height, samples, (enum lumi_sample)(bits / 8), info);
}

/* Copies `count` pixels of a decoded row or tile row into the raster; of one plane, or of all channels. */
static void place(const struct read_job *job, const uint8_t *from, int x, int y, int count, int plane)
{
    const struct lumi_raster *raster = job->raster;
    size_t sample = (size_t)raster->sample, pixel = sample * (size_t)raster->channels;
    uint8_t *to = lumi_row_u8(raster, y) + (size_t)x * pixel;

    if (!job->separate) {
        memcpy(to, from, (size_t)count * pixel);
        return;
    }
    to += (size_t)plane * sample;
    for (int i = 0; i < count; i++)
        memcpy(to + (size_t)i * pixel, from + (size_t)i * sample, sample);
}

static int read_strips(struct read_job *job)
{
    const struct lumi_raster *raster = job->raster;
    tmsize_t bytes = TIFFScanlineSize(job->tiff);
    size_t wanted = (size_t)raster->width * (size_t)raster->sample * (size_t)(job->separate ? 1 : raster->channels);
    int planes = job->separate ? raster->channels : 1;
    int code = LUMI_OK;

    if (bytes <= 0 || (size_t)bytes < wanted)
        return fail_tiff(job, "rows of a size that does not fit the image");
    uint8_t *row = lumi_alloc((size_t)bytes, 1);
    if (!row)
        return lumi_fail(job->source->error, LUMI_ERR_NOMEM, "%s: no memory for a row", job->source->name);
    for (int plane = 0; plane < planes && code == LUMI_OK; plane++)
        for (int y = 0; y < raster->height && code == LUMI_OK; y++) {
            if (TIFFReadScanline(job->tiff, row, (uint32_t)y, (uint16_t)plane) != 1)
                code = fail_tiff(job, "a row cannot be decoded");
            else
                place(job, row, 0, y, raster->width, plane);
        }
    lumi_free(row);
    return code;
}

static int read_tiles(struct read_job *job)
{
    const struct lumi_raster *raster = job->raster;
    int planes = job->separate ? raster->channels : 1;
    uint32_t tile_w = 0, tile_h = 0;
    int code = LUMI_OK;

    TIFFGetField(job->tiff, TIFFTAG_TILEWIDTH, &tile_w);
    TIFFGetField(job->tiff, TIFFTAG_TILELENGTH, &tile_h);
    tmsize_t bytes = TIFFTileSize(job->tiff), row_bytes = TIFFTileRowSize(job->tiff);
    size_t pixel = (size_t)raster->sample * (size_t)(job->separate ? 1 : raster->channels);
    if (tile_w < 1 || tile_h < 1 || tile_w > LUMI_RASTER_MAX || tile_h > LUMI_RASTER_MAX || bytes <= 0 ||
        (size_t)row_bytes < tile_w * pixel || (size_t)bytes < (size_t)row_bytes * tile_h || bytes > MAX_ALLOCATION)
        return fail_tiff(job, "tiles of a size that does not fit the image");
    uint8_t *tile = lumi_alloc((size_t)bytes, 1);
    if (!tile)
        return lumi_fail(job->source->error, LUMI_ERR_NOMEM, "%s: no memory for a tile", job->source->name);
    for (int plane = 0; plane < planes; plane++)
        for (int y = 0; y < raster->height; y += (int)tile_h)
            for (int x = 0; x < raster->width && code == LUMI_OK; x += (int)tile_w) {
                int w = raster->width - x < (int)tile_w ? raster->width - x : (int)tile_w;
                int h = raster->height - y < (int)tile_h ? raster->height - y : (int)tile_h;
                if (TIFFReadTile(job->tiff, tile, (uint32_t)x, (uint32_t)y, 0, (uint16_t)plane) < 0)
                    code = fail_tiff(job, "a tile cannot be decoded");
                for (int i = 0; i < h && code == LUMI_OK; i++)
                    place(job, tile + (size_t)i * (size_t)row_bytes, x, y + i, w, plane);
            }
    lumi_free(tile);
    return code;
}

/* Luminance and colour differences, as video cameras deliver them, to RGB. */
static int read_ycbcr(struct read_job *job, int orientation)
{
    const struct lumi_raster *raster = job->raster;
    uint32_t width = (uint32_t)raster->width, height = (uint32_t)raster->height;
    int code = LUMI_OK;
    uint32_t *pixels = lumi_alloc((size_t)width * height, sizeof *pixels);

    if (!pixels)
        return lumi_fail(job->source->error, LUMI_ERR_NOMEM, "%s: no memory for the image", job->source->name);
    /* Asked for in the orientation it has, the picture is left as it lies in the file. */
    if (TIFFReadRGBAImageOriented(job->tiff, width, height, pixels, orientation, 1) != 1 || job->stream.text[0])
        code = fail_tiff(job, "the image cannot be decoded");
    for (uint32_t y = 0; code == LUMI_OK && y < height; y++) {
        uint8_t *out = lumi_row_u8(raster, (int)y);
        for (uint32_t x = 0; x < width; x++) {
            uint32_t pixel = pixels[(size_t)y * width + x];
            out[3 * x] = (uint8_t)TIFFGetR(pixel);
            out[3 * x + 1] = (uint8_t)TIFFGetG(pixel);
            out[3 * x + 2] = (uint8_t)TIFFGetB(pixel);
        }
    }
    lumi_free(pixels);
    return code;
}

/* MINISWHITE: 0 is white. */
static void invert(const struct lumi_raster *raster)
{
    for (int y = 0; y < raster->height; y++)
        for (int x = 0; x < raster->width; x++) {
            if (raster->sample == LUMI_U8)
                lumi_row_u8(raster, y)[x] = (uint8_t)(255 - lumi_row_u8(raster, y)[x]);
            else if (raster->sample == LUMI_U16)
                lumi_row_u16(raster, y)[x] = (uint16_t)(65535 - lumi_row_u16(raster, y)[x]);
            else
                lumi_row_f32(raster, y)[x] = 1 - lumi_row_f32(raster, y)[x];
        }
}

static int read_tiff(const struct image_source *source, struct lumi_raster *raster, struct lumi_image_meta *meta)
{
    struct read_job job = {.source = source, .raster = raster};

    job.stream.data = source->data;
    job.stream.size = source->size;
    job.tiff = open_stream(&job.stream, source->name, "rm");
    if (!job.tiff)
        return fail_tiff(&job, "not a TIFF that can be read");
    int code = describe(&job, &meta->info);
    if (code == LUMI_OK && raster)
        code = image_claim(source, &meta->info, raster);
    if (code == LUMI_OK && raster && job.ycbcr)
        code = read_ycbcr(&job, meta->info.orientation);
    else if (code == LUMI_OK && raster)
        code = TIFFIsTiled(job.tiff) ? read_tiles(&job) : read_strips(&job);
    if (code == LUMI_OK && raster && job.inverted)
        invert(raster);
    TIFFClose(job.tiff);
    if (code == LUMI_OK)
        image_scan_exif(source->data, source->size, meta);
    return code;
}

/* Writing */

static int write_rows(TIFF *tiff, const struct lumi_raster *raster, const struct lumi_image_options *options)
{
    bool real = raster->sample == LUMI_F32;
    uint16_t alpha = EXTRASAMPLE_UNASSALPHA;

    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, (uint32_t)raster->width);
    TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, (uint32_t)raster->height);
    TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, (uint16_t)raster->channels);
    TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, (uint16_t)(8 * (int)raster->sample));
    TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, real ? SAMPLEFORMAT_IEEEFP : SAMPLEFORMAT_UINT);
    TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, raster->channels == 1 ? PHOTOMETRIC_MINISBLACK : PHOTOMETRIC_RGB);
    TIFFSetField(tiff, TIFFTAG_ORIENTATION, ORIENTATION_TOPLEFT);
    if (raster->channels == 4)
        TIFFSetField(tiff, TIFFTAG_EXTRASAMPLES, 1, &alpha);
    if (options->level >= 0) {
        TIFFSetField(tiff, TIFFTAG_COMPRESSION, COMPRESSION_ADOBE_DEFLATE);
        TIFFSetField(tiff, TIFFTAG_PREDICTOR, real ? PREDICTOR_FLOATINGPOINT : PREDICTOR_HORIZONTAL);
        TIFFSetField(tiff, TIFFTAG_ZIPQUALITY, options->level ? options->level : 1);
    }
    TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, 64);
    size_t bytes = (size_t)raster->width * (size_t)raster->channels * (size_t)raster->sample;
    uint8_t *row = lumi_alloc(bytes, 1); /* libtiff's predictor works in place */
    int done = row != NULL;
    for (int y = 0; done && y < raster->height; y++) {
        memcpy(row, lumi_row_u8(raster, y), bytes);
        done = TIFFWriteScanline(tiff, row, (uint32_t)y, 0) == 1;
    }
    lumi_free(row);
    return done && TIFFFlush(tiff) == 1;
}

static int encode_tiff(const struct lumi_raster *raster, const struct lumi_image_options *options,
                       struct lumi_writer *out, struct lumi_error *error)
{
    struct stream stream = {.out = out};
    TIFF *tiff = open_stream(&stream, "image", "wl");

    if (!tiff)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory to write the image");
    int done = write_rows(tiff, raster, options);
    TIFFClose(tiff);
    if (done && !stream.text[0])
        return LUMI_OK;
    return lumi_fail(error, LUMI_ERR_NOMEM, "TIFF: %s", stream.text[0] ? stream.text : "no memory");
}

const struct image_codec image_tiff = {probe_tiff, read_tiff, encode_tiff};
