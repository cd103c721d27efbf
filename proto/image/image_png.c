/* PNG through libpng: 8 and 16 bit; palettes and fewer bits are expanded to 8. */
#include "proto/base/memory.h"
#include "proto/image/image_priv.h"

#include <setjmp.h>
#include <string.h>

#include <png.h>
#include <zlib.h>

/* libpng leaves by longjmp; what it may leave behind lies in the job (see image_jpeg.c). */
/* What libpng needs at once beside the chunks of a file: rows, inflated texts. */
#define MEMORY_SPARE (8 << 20)

struct job {
    png_structp png;
    png_infop info;
    const char *name;
    struct lumi_error *error;
    int code;
    /* reading */
    const struct image_source *source;
    size_t at;
    struct lumi_raster *raster;
    struct lumi_image_meta *meta;
    /* writing */
    const struct lumi_raster *pixels;
    const struct lumi_image_options *options;
    struct lumi_writer *out;
};

static void on_error(png_structp png, png_const_charp text)
{
    struct job *job = png_get_error_ptr(png);

    job->code = lumi_fail(job->error, strstr(text, "emory") ? LUMI_ERR_NOMEM : LUMI_ERR_FORMAT, "%s%s%s", job->name,
                          job->name[0] ? ": " : "", text);
    png_longjmp(png, 1);
}

/* About ancillary chunks only: what damages pixels is an error in libpng. */
static void on_warning(png_structp png, png_const_charp text)
{
    (void)png;
    (void)text;
}

/* libpng asks for as much as a chunk says it holds, before its bytes are seen: nothing is longer than its file. */
static png_voidp get_memory(png_structp png, png_alloc_size_t size)
{
    const struct job *job = png_get_mem_ptr(png);

    if (job->source && size > job->source->file_size + MEMORY_SPARE)
        return NULL;
    return lumi_alloc(size, 1);
}

static void release_memory(png_structp png, png_voidp memory)
{
    (void)png;
    lumi_free(memory);
}

static bool probe_png(const uint8_t *data, size_t size)
{
    return size >= 8 && !memcmp(data, "\x89PNG\r\n\x1a\n", 8);
}

static void get_bytes(png_structp png, png_bytep to, png_size_t count)
{
    struct job *job = png_get_io_ptr(png);

    if (count > job->source->size - job->at)
        png_error(png, "the file ends too early");
    memcpy(to, job->source->data + job->at, count);
    job->at += count;
}

/* Everything to 1, 3 or 4 channels of 8 or 16 bits. */
static void set_transforms(struct job *job)
{
    int type = png_get_color_type(job->png, job->info);
    int depth = png_get_bit_depth(job->png, job->info);
    bool keyed = png_get_valid(job->png, job->info, PNG_INFO_tRNS) != 0;

    if (type == PNG_COLOR_TYPE_PALETTE)
        png_set_palette_to_rgb(job->png);
    if (type == PNG_COLOR_TYPE_GRAY && depth < 8)
        png_set_expand_gray_1_2_4_to_8(job->png);
    if (keyed)
        png_set_tRNS_to_alpha(job->png);
    if (type == PNG_COLOR_TYPE_GRAY_ALPHA || (type == PNG_COLOR_TYPE_GRAY && keyed))
        png_set_gray_to_rgb(job->png);
#if __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__
    if (depth == 16)
        png_set_swap(job->png);
#endif
}

static int take_exif(struct job *job)
{
    png_bytep exif = NULL;
    png_uint_32 size = 0;

    if (!png_get_eXIf_1(job->png, job->info, &size, &exif) || !exif)
        return LUMI_OK;
    return image_keep_exif(job->source, exif, size, job->meta);
}

static int read_guarded(struct job *job)
{
    if (setjmp(png_jmpbuf(job->png)))
        return job->code;
    png_set_read_fn(job->png, job, get_bytes);
    png_set_user_limits(job->png, LUMI_RASTER_MAX, LUMI_RASTER_MAX);
    png_set_crc_action(job->png, PNG_CRC_ERROR_QUIT, PNG_CRC_ERROR_QUIT);
    png_read_info(job->png, job->info);
    set_transforms(job);
    int passes = png_set_interlace_handling(job->png);
    png_read_update_info(job->png, job->info);
    LUMI_TRY(image_describe(job->source, png_get_image_width(job->png, job->info),
                            png_get_image_height(job->png, job->info), png_get_channels(job->png, job->info),
                            png_get_bit_depth(job->png, job->info) == 16 ? LUMI_U16 : LUMI_U8, &job->meta->info));
    if (!job->raster)
        return take_exif(job);
    LUMI_TRY(image_claim(job->source, &job->meta->info, job->raster));
    for (int pass = 0; pass < passes; pass++)
        for (int y = 0; y < job->raster->height; y++)
            png_read_row(job->png, lumi_row_u8(job->raster, y), NULL);
    png_read_end(job->png, job->info);
    return take_exif(job);
}

static int read_png(const struct image_source *source, struct lumi_raster *raster, struct lumi_image_meta *meta)
{
    struct job job = {.name = source->name, .error = source->error, .source = source, .raster = raster, .meta = meta};

    job.png =
        png_create_read_struct_2(PNG_LIBPNG_VER_STRING, &job, on_error, on_warning, &job, get_memory, release_memory);
    job.info = job.png ? png_create_info_struct(job.png) : NULL;
    int code = job.info ? read_guarded(&job) : lumi_fail(source->error, LUMI_ERR_NOMEM, "%s: no memory", source->name);
    png_destroy_read_struct(&job.png, &job.info, NULL);
    return code;
}

static void put_bytes(png_structp png, png_bytep from, png_size_t count)
{
    struct job *job = png_get_io_ptr(png);

    lumi_write_bytes(job->out, from, count);
}

static void flush_nothing(png_structp png)
{
    (void)png;
}

static int write_guarded(struct job *job)
{
    const struct lumi_raster *pixels = job->pixels;
    int type = pixels->channels == 1   ? PNG_COLOR_TYPE_GRAY
               : pixels->channels == 3 ? PNG_COLOR_TYPE_RGB
                                       : PNG_COLOR_TYPE_RGB_ALPHA;

    if (setjmp(png_jmpbuf(job->png)))
        return job->code;
    png_set_write_fn(job->png, job, put_bytes, flush_nothing);
    png_set_user_limits(job->png, LUMI_RASTER_MAX, LUMI_RASTER_MAX);
    png_set_IHDR(job->png, job->info, (png_uint_32)pixels->width, (png_uint_32)pixels->height, (int)pixels->sample * 8,
                 type, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_sRGB(job->png, job->info, PNG_sRGB_INTENT_PERCEPTUAL);
    if (job->options->exif && job->options->exif_size)
        png_set_eXIf_1(job->png, job->info, (png_uint_32)job->options->exif_size, (png_bytep)job->options->exif);
    if (job->options->level < 0) {
        png_set_compression_level(job->png, 0);
        png_set_filter(job->png, PNG_FILTER_TYPE_BASE, PNG_FILTER_NONE);
    } else if (job->options->level == 0) {
        png_set_compression_level(job->png, 2);
        png_set_filter(job->png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB | PNG_FILTER_UP);
    } else {
        png_set_compression_level(job->png, job->options->level);
        png_set_filter(job->png, PNG_FILTER_TYPE_BASE, PNG_ALL_FILTERS);
    }
    png_write_info(job->png, job->info);
#if __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__
    if (pixels->sample == LUMI_U16)
        png_set_swap(job->png);
#endif
    for (int y = 0; y < pixels->height; y++)
        png_write_row(job->png, lumi_row_u8(pixels, y));
    png_write_end(job->png, job->info);
    return LUMI_OK;
}

static int encode_png(const struct lumi_raster *raster, const struct lumi_image_options *options,
                      struct lumi_writer *out, struct lumi_error *error)
{
    struct job job = {.name = "", .error = error, .pixels = raster, .options = options, .out = out};

    if (options->exif_size > 0 && options->exif_size > 0x7fffffff)
        return lumi_fail(error, LUMI_ERR_ARG, "an EXIF block of %zu bytes does not fit a PNG", options->exif_size);
    job.png =
        png_create_write_struct_2(PNG_LIBPNG_VER_STRING, &job, on_error, on_warning, &job, get_memory, release_memory);
    job.info = job.png ? png_create_info_struct(job.png) : NULL;
    int code = job.info ? write_guarded(&job) : lumi_fail(error, LUMI_ERR_NOMEM, "no memory to write the image");
    png_destroy_write_struct(&job.png, &job.info);
    return code;
}

const struct image_codec image_png = {probe_png, read_png, encode_png};
