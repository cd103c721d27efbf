/* JPEG through libjpeg-turbo: 8 bit, grey and RGB. */
#include "proto/image/image_priv.h"

#include <setjmp.h>
#include <stdio.h>
#include <string.h>

#include <jpeglib.h>

#include <jerror.h>

#define MAX_SCANS 200 /* a progressive file of a few kB can otherwise ask for hours */
#define EXIF_MARKER (JPEG_APP0 + 1)
#define OUT_CHUNK 65536

static const char exif_signature[6] = "Exif\0";

/* libjpeg leaves by longjmp. Everything it may leave behind lies in the job, which the function that calls setjmp gets
 * by pointer and never keeps in a local variable of its own. */
struct job {
    struct jpeg_error_mgr errors;
    jmp_buf jump;
    int code;
    char text[JMSG_LENGTH_MAX];
};

static void leave(j_common_ptr cinfo)
{
    struct job *job = (struct job *)cinfo->err;

    job->errors.format_message(cinfo, job->text);
    switch (job->errors.msg_code) {
    case JERR_OUT_OF_MEMORY:
        job->code = LUMI_ERR_NOMEM;
        break;
    case JERR_BAD_PRECISION:
    case JERR_SOF_UNSUPPORTED:
    case JERR_CONVERSION_NOTIMPL:
    case JERR_BAD_J_COLORSPACE:
    case JERR_ARITH_NOTIMPL:
    case JERR_CCIR601_NOTIMPL:
    case JERR_NOTIMPL:
        job->code = LUMI_ERR_UNSUPPORTED;
        break;
    default:
        job->code = LUMI_ERR_FORMAT;
    }
    longjmp(job->jump, 1);
}

/* Negative levels are warnings: the data are damaged and libjpeg would go on with grey. */
static void on_message(j_common_ptr cinfo, int level)
{
    if (level < 0)
        leave(cinfo);
}

static void say_nothing(j_common_ptr cinfo)
{
    (void)cinfo;
}

static void init_job(struct job *job)
{
    jpeg_std_error(&job->errors);
    job->errors.error_exit = leave;
    job->errors.emit_message = on_message;
    job->errors.output_message = say_nothing;
}

/* Reading */

struct read_job {
    struct job job;
    struct jpeg_decompress_struct cinfo;
    struct jpeg_progress_mgr progress;
    const struct image_source *source;
    struct lumi_raster *raster;
    struct lumi_image_meta *meta;
};

static bool probe_jpeg(const uint8_t *data, size_t size)
{
    return size >= 3 && data[0] == 0xff && data[1] == 0xd8 && data[2] == 0xff;
}

static void count_scans(j_common_ptr common)
{
    struct jpeg_decompress_struct *cinfo = (struct jpeg_decompress_struct *)common;

    if (cinfo->input_scan_number > MAX_SCANS)
        ERREXIT(cinfo, JERR_BAD_PROGRESSION);
}

static int take_exif(struct read_job *read)
{
    for (jpeg_saved_marker_ptr m = read->cinfo.marker_list; m; m = m->next)
        if (m->marker == EXIF_MARKER && m->data_length > sizeof exif_signature &&
            !memcmp(m->data, exif_signature, sizeof exif_signature))
            return image_keep_exif(read->source, m->data + sizeof exif_signature,
                                   m->data_length - sizeof exif_signature, read->meta);
    return LUMI_OK;
}

/* As small as it is wanted: libjpeg leaves out what such a picture does not show. */
static int claim_rows(struct read_job *read)
{
    struct jpeg_decompress_struct *cinfo = &read->cinfo;
    struct lumi_image_info info = read->meta->info;
    const int most = read->source->most;

    if (most > 0 && info.width > most) {
        cinfo->scale_num = 1;
        cinfo->scale_denom = 8;
        while (cinfo->scale_num < 7 && ((int64_t)info.width * (cinfo->scale_num + 1) + 7) / 8 <= most)
            cinfo->scale_num++;
        jpeg_calc_output_dimensions(cinfo);
        info.width = (int)cinfo->output_width;
        info.height = (int)cinfo->output_height;
    }
    return image_claim(read->source, &info, read->raster);
}

static int read_guarded(struct read_job *read)
{
    struct jpeg_decompress_struct *cinfo = &read->cinfo;

    if (setjmp(read->job.jump))
        return lumi_fail(read->source->error, read->job.code, "%s: %s", read->source->name, read->job.text);
    jpeg_create_decompress(cinfo);
    cinfo->progress = &read->progress;
    jpeg_mem_src(cinfo, read->source->data, (unsigned long)read->source->size);
    jpeg_save_markers(cinfo, EXIF_MARKER, 0xffff);
    jpeg_read_header(cinfo, TRUE);
    LUMI_TRY(take_exif(read));
    if (cinfo->num_components != 1 && cinfo->num_components != 3)
        return lumi_fail(read->source->error, LUMI_ERR_UNSUPPORTED,
                         "%s: a JPEG of %d components (CMYK?); grey and colour ones can be read", read->source->name,
                         cinfo->num_components);
    LUMI_TRY(image_describe(read->source, cinfo->image_width, cinfo->image_height, cinfo->num_components, LUMI_U8,
                            &read->meta->info));
    if (!read->raster)
        return LUMI_OK;
    LUMI_TRY(claim_rows(read));
    cinfo->out_color_space = cinfo->num_components == 1 ? JCS_GRAYSCALE : JCS_RGB;
    cinfo->dct_method = JDCT_ISLOW;
    jpeg_start_decompress(cinfo);
    while (cinfo->output_scanline < cinfo->output_height) {
        JSAMPROW row = lumi_row_u8(read->raster, (int)cinfo->output_scanline);
        jpeg_read_scanlines(cinfo, &row, 1);
    }
    jpeg_finish_decompress(cinfo);
    return LUMI_OK;
}

static int read_jpeg(const struct image_source *source, struct lumi_raster *raster, struct lumi_image_meta *meta)
{
    struct read_job read = {.source = source, .raster = raster, .meta = meta};

    init_job(&read.job);
    read.cinfo.err = &read.job.errors;
    read.progress.progress_monitor = count_scans;
    int code = read_guarded(&read);
    jpeg_destroy_decompress(&read.cinfo);
    return code;
}

/* Writing */

struct write_job {
    struct job job;
    struct jpeg_compress_struct cinfo;
    struct jpeg_destination_mgr destination;
    const struct lumi_raster *raster;
    const struct lumi_image_options *options;
    struct lumi_writer *out;
    struct lumi_error *error;
    JOCTET chunk[OUT_CHUNK];
};

static void start_chunk(j_compress_ptr cinfo)
{
    struct write_job *write = cinfo->client_data;

    write->destination.next_output_byte = write->chunk;
    write->destination.free_in_buffer = OUT_CHUNK;
}

static boolean full_chunk(j_compress_ptr cinfo)
{
    struct write_job *write = cinfo->client_data;

    lumi_write_bytes(write->out, write->chunk, OUT_CHUNK);
    start_chunk(cinfo);
    return TRUE;
}

static void last_chunk(j_compress_ptr cinfo)
{
    struct write_job *write = cinfo->client_data;

    lumi_write_bytes(write->out, write->chunk, OUT_CHUNK - write->destination.free_in_buffer);
}

static void write_exif(struct write_job *write)
{
    const uint8_t *exif = write->options->exif;
    size_t size = write->options->exif_size;

    jpeg_write_m_header(&write->cinfo, EXIF_MARKER, (unsigned)(size + sizeof exif_signature));
    for (size_t i = 0; i < sizeof exif_signature; i++)
        jpeg_write_m_byte(&write->cinfo, exif_signature[i]);
    for (size_t i = 0; i < size; i++)
        jpeg_write_m_byte(&write->cinfo, exif[i]);
}

static int write_guarded(struct write_job *write)
{
    struct jpeg_compress_struct *cinfo = &write->cinfo;
    const struct lumi_raster *raster = write->raster;

    if (setjmp(write->job.jump))
        return lumi_fail(write->error, write->job.code == LUMI_ERR_NOMEM ? LUMI_ERR_NOMEM : LUMI_ERR_ARG, "%s",
                         write->job.text);
    jpeg_create_compress(cinfo);
    cinfo->client_data = write;
    cinfo->dest = &write->destination;
    cinfo->image_width = (JDIMENSION)raster->width;
    cinfo->image_height = (JDIMENSION)raster->height;
    cinfo->input_components = raster->channels;
    cinfo->in_color_space = raster->channels == 1 ? JCS_GRAYSCALE : JCS_RGB;
    jpeg_set_defaults(cinfo);
    jpeg_set_quality(cinfo, write->options->quality, TRUE);
    cinfo->dct_method = JDCT_ISLOW;
    if (raster->channels == 3)
        cinfo->comp_info[0].h_samp_factor = cinfo->comp_info[0].v_samp_factor = write->options->subsample ? 2 : 1;
    jpeg_start_compress(cinfo, TRUE);
    if (write->options->exif && write->options->exif_size)
        write_exif(write);
    while (cinfo->next_scanline < cinfo->image_height) {
        JSAMPROW row = lumi_row_u8(raster, (int)cinfo->next_scanline);
        jpeg_write_scanlines(cinfo, &row, 1);
    }
    jpeg_finish_compress(cinfo);
    return LUMI_OK;
}

static int encode_jpeg(const struct lumi_raster *raster, const struct lumi_image_options *options,
                       struct lumi_writer *out, struct lumi_error *error)
{
    struct write_job write = {.raster = raster, .options = options, .out = out, .error = error};

    if (options->exif_size > 65533 - sizeof exif_signature)
        return lumi_fail(error, LUMI_ERR_ARG, "an EXIF block of %zu bytes does not fit a JPEG", options->exif_size);
    init_job(&write.job);
    write.cinfo.err = &write.job.errors;
    write.destination.init_destination = start_chunk;
    write.destination.empty_output_buffer = full_chunk;
    write.destination.term_destination = last_chunk;
    int code = write_guarded(&write);
    jpeg_destroy_compress(&write.cinfo);
    return code;
}

const struct image_codec image_jpeg = {probe_jpeg, read_jpeg, encode_jpeg};
