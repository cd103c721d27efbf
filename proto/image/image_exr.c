/* OpenEXR through OpenEXRCore, its C library: half and float, scanlines and tiles of one level. Written are scanlines,
 * PIZ unless a ZIP level is asked for: of the compressions without loss it is both the smallest and the fastest on
 * photographs in halves (960x640 RGB: PIZ 1.1 MB in 28 ms, ZIP at level 1 2.5 MB in 84 ms, none 3.7 MB in 4 ms). */
#include "proto/base/memory.h"
#include "proto/image/image_priv.h"

#include <stdio.h>
#include <string.h>

#include <openexr.h>

#define MAX_CHUNK ((uint64_t)1 << 29) /* bytes of one block of lines, unpacked */

/* What the library reads from or writes to, and its first complaint. */
struct stream {
    const uint8_t *data;
    size_t size;
    uint64_t file_size;
    struct lumi_writer *out;
    char text[200];
};

static void on_error(exr_const_context_t context, exr_result_t code, const char *message)
{
    void *user = NULL;

    (void)code;
    if (exr_get_user_data(context, &user) != EXR_ERR_SUCCESS || !user)
        return;
    struct stream *stream = user;
    if (!stream->text[0])
        snprintf(stream->text, sizeof stream->text, "%s", message);
}

static int64_t stream_size(exr_const_context_t context, void *user)
{
    const struct stream *stream = user;

    (void)context;
    return (int64_t)stream->file_size;
}

/* The header is read in blocks that may reach past the end: fewer bytes are no error here, the library compares where
 * it needs them all. */
static int64_t stream_read(exr_const_context_t context, void *user, void *buffer, uint64_t size, uint64_t offset,
                           exr_stream_error_func_ptr_t fail)
{
    const struct stream *stream = user;
    uint64_t left = offset < stream->size ? stream->size - offset : 0;
    uint64_t take = size < left ? size : left;

    (void)context;
    (void)fail;
    if (take > 0)
        memcpy(buffer, stream->data + offset, take);
    return (int64_t)take;
}

static int64_t stream_write(exr_const_context_t context, void *user, const void *buffer, uint64_t size, uint64_t offset,
                            exr_stream_error_func_ptr_t fail)
{
    static const uint8_t zeros[256];
    struct lumi_writer *out = ((struct stream *)user)->out;

    /* The table of chunks is left out at first and filled in at the end. */
    while (!out->failed && out->size < offset)
        lumi_write_bytes(out, zeros, offset - out->size < sizeof zeros ? offset - out->size : sizeof zeros);
    size_t over = out->failed ? 0 : out->size - offset < size ? out->size - offset : size;
    if (over > 0)
        memcpy(out->data + offset, buffer, over);
    lumi_write_bytes(out, (const uint8_t *)buffer + over, size - over);
    if (out->failed) {
        fail(context, EXR_ERR_OUT_OF_MEMORY, "no memory");
        return -1;
    }
    return (int64_t)size;
}

/* OpenEXR is given the tree's allocator, for tests that make it fail. */
static void *get_memory(size_t size)
{
    return lumi_alloc(size, 1);
}

static exr_context_initializer_t initializer(struct stream *stream)
{
    exr_context_initializer_t init = EXR_DEFAULT_CONTEXT_INITIALIZER;

    init.error_handler_fn = on_error;
    init.alloc_fn = get_memory;
    init.free_fn = lumi_free;
    init.user_data = stream;
    init.max_image_width = init.max_image_height = LUMI_RASTER_MAX;
    init.flags = EXR_CONTEXT_FLAG_DISABLE_CHUNK_RECONSTRUCTION;
    return init;
}

static int fail_exr(const struct image_source *source, const struct stream *stream, exr_result_t code)
{
    int result = LUMI_ERR_FORMAT;

    if (code == EXR_ERR_OUT_OF_MEMORY)
        result = LUMI_ERR_NOMEM;
    else if (code == EXR_ERR_FEATURE_NOT_IMPLEMENTED)
        result = LUMI_ERR_UNSUPPORTED;
    return lumi_fail(source->error, result, "%s: %s", source->name,
                     stream->text[0] ? stream->text : exr_get_default_error_message(code));
}

/* Reading */

struct read_job {
    const struct image_source *source;
    struct stream stream;
    exr_context_t context;
    exr_attr_box2i_t window;
    int channels;
    const char *names[4]; /* of the channels wanted, in the raster's order */
    const char *single;   /* the one channel asked for by name, or NULL */
    float *spare;         /* a row for the channels not wanted */
};

static bool probe_exr(const uint8_t *data, size_t size)
{
    return size >= 4 && !memcmp(data, "\x76\x2f\x31\x01", 4);
}

static const exr_attr_chlist_entry_t *find_channel(const exr_attr_chlist_t *list, const char *name)
{
    for (int i = 0; i < list->num_channels; i++)
        if (!strcmp(list->entries[i].name.str, name))
            return &list->entries[i];
    return NULL;
}

static int choose_channels(struct read_job *job, const exr_attr_chlist_t *list)
{
    static const char *const colour[4] = {"R", "G", "B", "A"};
    const struct image_source *source = job->source;

    if (job->single) {
        job->names[0] = job->single;
        job->channels = 1;
        if (!find_channel(list, job->single))
            return lumi_fail(source->error, LUMI_ERR_NOTFOUND, "%s: has no channel '%s'", source->name, job->single);
    } else if (find_channel(list, "R") && find_channel(list, "G") && find_channel(list, "B")) {
        memcpy(job->names, colour, sizeof colour);
        job->channels = find_channel(list, "A") ? 4 : 3;
    } else if (list->num_channels == 1) {
        job->names[0] = list->entries[0].name.str;
        job->channels = 1;
    } else {
        return lumi_fail(source->error, LUMI_ERR_UNSUPPORTED, "%s: channels that are neither R, G, B nor a single one",
                         source->name);
    }
    for (int i = 0; i < job->channels; i++) {
        const exr_attr_chlist_entry_t *entry = find_channel(list, job->names[i]);
        if (entry->pixel_type == EXR_PIXEL_UINT || entry->x_sampling != 1 || entry->y_sampling != 1)
            return lumi_fail(source->error, LUMI_ERR_UNSUPPORTED, "%s: channel '%s' is of whole numbers, or subsampled",
                             source->name, job->names[i]);
    }
    return LUMI_OK;
}

static int describe(struct read_job *job, struct lumi_image_info *info)
{
    const exr_attr_chlist_t *list;
    uint64_t chunk_bytes;
    exr_storage_t storage;

    exr_result_t code = exr_get_storage(job->context, 0, &storage);
    if (code == EXR_ERR_SUCCESS && storage != EXR_STORAGE_SCANLINE && storage != EXR_STORAGE_TILED)
        return lumi_fail(job->source->error, LUMI_ERR_UNSUPPORTED, "%s: a deep OpenEXR image", job->source->name);
    if (code == EXR_ERR_SUCCESS)
        code = exr_get_data_window(job->context, 0, &job->window);
    if (code == EXR_ERR_SUCCESS)
        code = exr_get_channels(job->context, 0, &list);
    if (code == EXR_ERR_SUCCESS)
        code = exr_get_chunk_unpacked_size(job->context, 0, &chunk_bytes);
    if (code != EXR_ERR_SUCCESS)
        return fail_exr(job->source, &job->stream, code);
    LUMI_TRY(choose_channels(job, list));
    if (chunk_bytes > MAX_CHUNK)
        return lumi_fail(job->source->error, LUMI_ERR_LIMIT,
                         "%s: blocks of %llu bytes are more than this program accepts", job->source->name,
                         (unsigned long long)chunk_bytes);
    int64_t width = (int64_t)job->window.max.x - job->window.min.x + 1;
    int64_t height = (int64_t)job->window.max.y - job->window.min.y + 1;
    return image_describe(job->source, width > 0 ? (uint64_t)width : 0, height > 0 ? (uint64_t)height : 0,
                          job->channels, LUMI_F32, info);
}

/* Points the decoder at the chunk's place in the raster. Channels that are not wanted go into a spare row: OpenEXR 3.1
 * has unpackers that write through the NULL which should mean just that. */
static void aim(const struct read_job *job, exr_decode_pipeline_t *decode, const struct lumi_raster *raster, int x,
                int y)
{
    for (int i = 0; i < decode->channel_count; i++) {
        exr_coding_channel_info_t *channel = &decode->channels[i];
        channel->decode_to_ptr = (uint8_t *)job->spare;
        channel->user_bytes_per_element = channel->bytes_per_element;
        channel->user_data_type = channel->data_type;
        channel->user_pixel_stride = channel->bytes_per_element;
        channel->user_line_stride = 0;
        for (int c = 0; c < job->channels; c++) {
            if (strcmp(channel->channel_name, job->names[c]))
                continue;
            channel->decode_to_ptr = (uint8_t *)(lumi_row_f32(raster, y) + (size_t)x * (size_t)job->channels + c);
            channel->user_bytes_per_element = sizeof(float);
            channel->user_data_type = EXR_PIXEL_FLOAT;
            channel->user_pixel_stride = job->channels * (int)sizeof(float);
            channel->user_line_stride = (int)raster->stride;
        }
    }
}

/* One chunk; `decode` is kept from one to the next. */
static exr_result_t decode_chunk(const struct read_job *job, exr_decode_pipeline_t *decode,
                                 const exr_chunk_info_t *chunk, const struct lumi_raster *raster, int x, int y)
{
    bool first = !decode->context;
    exr_result_t code = first ? exr_decoding_initialize(job->context, 0, chunk, decode)
                              : exr_decoding_update(job->context, 0, chunk, decode);

    if (code == EXR_ERR_SUCCESS) {
        aim(job, decode, raster, x, y);
        if (first)
            code = exr_decoding_choose_default_routines(job->context, 0, decode);
    }
    return code == EXR_ERR_SUCCESS ? exr_decoding_run(job->context, 0, decode) : code;
}

static exr_result_t read_scanlines(const struct read_job *job, exr_decode_pipeline_t *decode,
                                   const struct lumi_raster *raster)
{
    exr_chunk_info_t chunk;
    int32_t lines;

    exr_result_t code = exr_get_scanlines_per_chunk(job->context, 0, &lines);
    if (code == EXR_ERR_SUCCESS && lines < 1)
        code = EXR_ERR_BAD_CHUNK_LEADER;
    for (int y = 0; code == EXR_ERR_SUCCESS && y < raster->height; y += lines) {
        code = exr_read_scanline_chunk_info(job->context, 0, job->window.min.y + y, &chunk);
        if (code == EXR_ERR_SUCCESS && chunk.height > raster->height - y)
            code = EXR_ERR_BAD_CHUNK_LEADER;
        if (code == EXR_ERR_SUCCESS)
            code = decode_chunk(job, decode, &chunk, raster, 0, y);
    }
    return code;
}

static exr_result_t read_tiles(const struct read_job *job, exr_decode_pipeline_t *decode,
                               const struct lumi_raster *raster)
{
    exr_chunk_info_t chunk;
    int32_t tile_w, tile_h;

    exr_result_t code = exr_get_tile_sizes(job->context, 0, 0, 0, &tile_w, &tile_h);
    if (code == EXR_ERR_SUCCESS && (tile_w < 1 || tile_h < 1))
        code = EXR_ERR_BAD_CHUNK_LEADER;
    for (int y = 0; code == EXR_ERR_SUCCESS && y < raster->height; y += tile_h)
        for (int x = 0; code == EXR_ERR_SUCCESS && x < raster->width; x += tile_w) {
            code = exr_read_tile_chunk_info(job->context, 0, x / tile_w, y / tile_h, 0, 0, &chunk);
            if (code == EXR_ERR_SUCCESS && (chunk.height > raster->height - y || chunk.width > raster->width - x))
                code = EXR_ERR_BAD_CHUNK_LEADER;
            if (code == EXR_ERR_SUCCESS)
                code = decode_chunk(job, decode, &chunk, raster, x, y);
        }
    return code;
}

static int read_pixels(struct read_job *job, const struct lumi_raster *raster)
{
    exr_decode_pipeline_t decode = EXR_DECODE_PIPELINE_INITIALIZER;
    exr_storage_t storage = EXR_STORAGE_SCANLINE;

    job->spare = lumi_alloc((size_t)raster->width, sizeof *job->spare);
    if (!job->spare)
        return lumi_fail(job->source->error, LUMI_ERR_NOMEM, "%s: no memory for a row", job->source->name);
    exr_get_storage(job->context, 0, &storage);
    exr_result_t code =
        storage == EXR_STORAGE_TILED ? read_tiles(job, &decode, raster) : read_scanlines(job, &decode, raster);
    exr_decoding_destroy(job->context, &decode);
    lumi_free(job->spare);
    return code == EXR_ERR_SUCCESS ? LUMI_OK : fail_exr(job->source, &job->stream, code);
}

static int read_job(struct read_job *job, struct lumi_raster *raster, struct lumi_image_info *info)
{
    const struct image_source *source = job->source;

    job->stream = (struct stream){.data = source->data, .size = source->size, .file_size = source->file_size};
    exr_context_initializer_t init = initializer(&job->stream);
    init.read_fn = stream_read;
    init.size_fn = stream_size;
    exr_result_t opened = exr_start_read(&job->context, source->name, &init);
    if (opened != EXR_ERR_SUCCESS)
        return fail_exr(source, &job->stream, opened);
    int code = describe(job, info);
    if (code == LUMI_OK && raster)
        code = image_claim(source, info, raster);
    if (code == LUMI_OK && raster)
        code = read_pixels(job, raster);
    exr_finish(&job->context);
    return code;
}

static int read_exr(const struct image_source *source, struct lumi_raster *raster, struct lumi_image_meta *meta)
{
    struct read_job job = {.source = source};

    return read_job(&job, raster, &meta->info);
}

int image_exr_channel(const struct image_source *source, const char *channel, struct lumi_raster *raster)
{
    struct read_job job = {.source = source, .single = channel};
    struct lumi_image_info info = {0};

    return read_job(&job, raster, &info);
}

/* Writing */

/* Which channel of the file the raster's c-th is. A fourth that was given a name is no colour: it keeps all its bits.
 */
static const char *channel_name(const struct lumi_raster *raster, const struct lumi_image_options *options, int c)
{
    static const char *const colour[4] = {"R", "G", "B", "A"};

    if (raster->channels == 1)
        return options->channel ? options->channel : "Y";
    return c == 3 && options->channel ? options->channel : colour[c];
}

static exr_result_t declare(exr_context_t context, const struct lumi_raster *raster,
                            const struct lumi_image_options *options)
{
    exr_compression_t compression = options->level < 0    ? EXR_COMPRESSION_NONE
                                    : options->level == 0 ? EXR_COMPRESSION_PIZ
                                                          : EXR_COMPRESSION_ZIP;
    int part;

    exr_result_t code = exr_add_part(context, "image", EXR_STORAGE_SCANLINE, &part);
    if (code == EXR_ERR_SUCCESS)
        code = exr_initialize_required_attr_simple(context, part, raster->width, raster->height, compression);
    if (code == EXR_ERR_SUCCESS && options->level > 0)
        code = exr_set_zip_compression_level(context, part, options->level);
    for (int c = 0; code == EXR_ERR_SUCCESS && c < raster->channels; c++) {
        const bool half = options->half && !(c == 3 && options->channel);
        code = exr_add_channel(context, part, channel_name(raster, options, c), half ? EXR_PIXEL_HALF : EXR_PIXEL_FLOAT,
                               EXR_PERCEPTUALLY_LOGARITHMIC, 1, 1);
    }
    return code == EXR_ERR_SUCCESS ? exr_write_header(context) : code;
}

static exr_result_t write_chunk(exr_context_t context, exr_encode_pipeline_t *encode, const struct lumi_raster *raster,
                                const struct lumi_image_options *options, int y)
{
    bool first = !encode->context;
    exr_chunk_info_t chunk;

    exr_result_t code = exr_write_scanline_chunk_info(context, 0, y, &chunk);
    if (code == EXR_ERR_SUCCESS)
        code = first ? exr_encoding_initialize(context, 0, &chunk, encode)
                     : exr_encoding_update(context, 0, &chunk, encode);
    if (code != EXR_ERR_SUCCESS)
        return code;
    for (int i = 0; i < encode->channel_count; i++) {
        exr_coding_channel_info_t *channel = &encode->channels[i];
        int c = 0;
        while (c + 1 < raster->channels && strcmp(channel_name(raster, options, c), channel->channel_name) != 0)
            c++;
        channel->encode_from_ptr = (const uint8_t *)(lumi_row_f32(raster, y) + c);
        channel->user_bytes_per_element = sizeof(float);
        channel->user_data_type = EXR_PIXEL_FLOAT;
        channel->user_pixel_stride = raster->channels * (int)sizeof(float);
        channel->user_line_stride = (int)raster->stride;
    }
    if (first)
        code = exr_encoding_choose_default_routines(context, 0, encode);
    return code == EXR_ERR_SUCCESS ? exr_encoding_run(context, 0, encode) : code;
}

static int encode_exr(const struct lumi_raster *raster, const struct lumi_image_options *options,
                      struct lumi_writer *out, struct lumi_error *error)
{
    exr_encode_pipeline_t encode = EXR_ENCODE_PIPELINE_INITIALIZER;
    struct stream stream = {.out = out};
    exr_context_initializer_t init = initializer(&stream);
    exr_context_t context = NULL;
    int32_t lines = 1;

    init.write_fn = stream_write;
    exr_result_t code = exr_start_write(&context, "image", EXR_WRITE_FILE_DIRECTLY, &init);
    if (code == EXR_ERR_SUCCESS)
        code = declare(context, raster, options);
    if (code == EXR_ERR_SUCCESS)
        code = exr_get_scanlines_per_chunk(context, 0, &lines);
    for (int y = 0; code == EXR_ERR_SUCCESS && y < raster->height; y += lines)
        code = write_chunk(context, &encode, raster, options, y);
    if (context) {
        exr_encoding_destroy(context, &encode);
        exr_result_t finished = exr_finish(&context);
        code = code == EXR_ERR_SUCCESS ? finished : code;
    }
    if (code == EXR_ERR_SUCCESS)
        return LUMI_OK;
    return lumi_fail(error, code == EXR_ERR_OUT_OF_MEMORY ? LUMI_ERR_NOMEM : LUMI_ERR_ARG, "OpenEXR: %s",
                     stream.text[0] ? stream.text : exr_get_default_error_message(code));
}

const struct image_codec image_exr = {probe_exr, read_exr, encode_exr};
