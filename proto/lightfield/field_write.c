/* Writing a field: header and section table last, sections one after the other before. */
#include "proto/lightfield/field_write.h"

#include "proto/base/file.h"
#include "proto/base/memory.h"
#include "proto/lightfield/cluster_code.h"
#include "proto/lightfield/field_layout.h"
#include "proto/lightfield/side_info.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

struct entry {
    int kind, level;
    uint64_t offset, size;
    uint32_t crc;
};

struct sink {
    FILE *file;                 /* or */
    struct lumi_writer *memory; /* one of the two */
    const char *path;
    size_t begin; /* of the field in `memory` */
    uint64_t at;
    uint64_t decoded; /* bytes that a reader needs for reference images and tile entries */
    struct entry entries[FIELD_SECTIONS_MAX];
    int count;
};

/* What the writer learns of a level before it writes it. */
struct level_plan {
    int cols, rows;
    int width, height;
    int dictionary_count;
    struct {
        uint8_t bytes[LUMI_TILE_COMPRESSED_MAX];
        uint16_t size;
    } dictionary[LUMI_DICTIONARY_MAX];
    uint32_t *reference_size, *reference_crc, *side_size, *side_crc, *tile_size; /* a cluster each */
    struct lumi_writer side;
};

static int put(struct sink *sink, const void *data, size_t size, struct lumi_error *error)
{
    if (size == 0)
        return LUMI_OK;
    if (sink->file) {
        if (fwrite(data, 1, size, sink->file) != size)
            return lumi_fail_errno(error, sink->path, "write");
    } else {
        lumi_write_bytes(sink->memory, data, size);
        if (sink->memory->failed)
            return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a field");
    }
    sink->at += size;
    return LUMI_OK;
}

static int begin_section(struct sink *sink, enum field_section kind, int level, struct lumi_error *error)
{
    static const uint8_t zeros[FIELD_ALIGNMENT];

    LUMI_TRY(put(sink, zeros, (size_t)(-sink->at % FIELD_ALIGNMENT), error));
    sink->entries[sink->count++] = (struct entry){.kind = (int)kind, .level = level, .offset = sink->at};
    return LUMI_OK;
}

/* Bytes of the section that is being written. */
static int add(struct sink *sink, const void *data, size_t size, struct lumi_error *error)
{
    struct entry *entry = &sink->entries[sink->count - 1];

    entry->crc = lumi_crc32c(entry->crc, data, size);
    entry->size += size;
    return put(sink, data, size, error);
}

/* A whole section; `bytes` is emptied. */
static int put_section(struct sink *sink, enum field_section kind, int level, struct lumi_writer *bytes,
                       struct lumi_error *error)
{
    int code = bytes->failed ? lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a field") : LUMI_OK;

    if (code == LUMI_OK)
        code = begin_section(sink, kind, level, error);
    if (code == LUMI_OK)
        code = add(sink, bytes->data, bytes->size, error);
    lumi_writer_finish(bytes);
    return code;
}

static void write_vec3(struct lumi_writer *writer, struct lumi_vec3 v)
{
    lumi_write_f64(writer, v.x);
    lumi_write_f64(writer, v.y);
    lumi_write_f64(writer, v.z);
}

static int put_common(struct sink *sink, const struct lumi_field_content *content, struct lumi_error *error)
{
    struct lumi_writer writer;

    if (!lumi_place_valid(content->centre) || !(content->radius >= 0 && isfinite(content->radius)))
        return lumi_fail(error, LUMI_ERR_ARG, "a field about (%g, %g, %g) with a radius of %g", content->centre.x,
                         content->centre.y, content->centre.z, content->radius);
    lumi_writer_init(&writer);
    lumi_write_u8(&writer, (uint8_t)content->surface);
    lumi_write_u8(&writer, (uint8_t)content->disk_shape);
    lumi_write_u8(&writer, (uint8_t)content->kernel);
    lumi_write_u8(&writer, (uint8_t)content->quality);
    write_vec3(&writer, content->centre);
    lumi_write_f64(&writer, content->radius);
    LUMI_TRY(put_section(sink, SECTION_FIELD, 0, &writer, error));

    lumi_writer_init(&writer);
    lumi_write_u16(&writer, (uint16_t)content->grid_count);
    for (int i = 0; i < content->grid_count; i++) {
        const struct lumi_grid *grid = &content->grids[i];
        lumi_write_u16(&writer, (uint16_t)grid->width);
        lumi_write_u16(&writer, (uint16_t)grid->height);
        for (int k = 0; k <= grid->cols; k++)
            lumi_write_f64(&writer, grid->tan_x[k]);
        for (int k = 0; k <= grid->rows; k++)
            lumi_write_f64(&writer, grid->tan_y[k]);
    }
    return put_section(sink, SECTION_GRIDS, 0, &writer, error);
}

static int put_views(struct sink *sink, const struct lumi_field_content *content, int level, struct lumi_error *error)
{
    const struct lumi_field_level_content *from = &content->levels[level];
    struct lumi_writer writer;

    lumi_writer_init(&writer);
    lumi_write_u32(&writer, (uint32_t)from->view_count);
    for (int i = 0; i < from->view_count; i++) {
        const struct lumi_field_view *view = &from->views[i];
        double q[4];
        size_t length = strnlen(view->name, sizeof view->name - 1);
        lumi_write_u8(&writer, (uint8_t)length);
        lumi_write_bytes(&writer, view->name, length);
        lumi_write_u16(&writer, (uint16_t)view->grid);
        lumi_rotation_to_quaternion(view->pose.r, q);
        for (int k = 0; k < 4; k++)
            lumi_write_f64(&writer, q[k]);
        write_vec3(&writer, view->pose.t);
        lumi_write_f32(&writer, view->disk.u_neg);
        lumi_write_f32(&writer, view->disk.u_pos);
        lumi_write_f32(&writer, view->disk.v_neg);
        lumi_write_f32(&writer, view->disk.v_pos);
    }
    return put_section(sink, SECTION_VIEWS, level, &writer, error);
}

/* Each view's bytes after their number. */
static int put_meshes(struct sink *sink, const struct lumi_field_content *content, int level, struct lumi_error *error)
{
    int code = begin_section(sink, SECTION_MESHES, level, error);

    for (int view = 0; code == LUMI_OK && view < content->levels[level].view_count; view++) {
        struct lumi_writer bytes, size;
        lumi_writer_init(&bytes);
        lumi_writer_init(&size);
        code = content->mesh(content->context, level, view, &bytes, error);
        lumi_write_u32(&size, (uint32_t)bytes.size);
        if (code == LUMI_OK && (bytes.failed || size.failed))
            code = lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a mesh");
        if (code == LUMI_OK)
            code = add(sink, size.data, size.size, error);
        if (code == LUMI_OK)
            code = add(sink, bytes.data, bytes.size, error);
        lumi_writer_finish(&bytes);
        lumi_writer_finish(&size);
    }
    return code;
}

static int runs(const struct lumi_field_level_content *from)
{
    return (from->cluster_count + LUMI_REFERENCE_RUN - 1) / LUMI_REFERENCE_RUN;
}

/* Puts the frames of all runs, or (sink NULL) only learns their sizes and checksums. */
static int each_run(struct sink *sink, const struct lumi_field_content *content, int level, struct level_plan *plan,
                    struct lumi_error *error)
{
    const struct lumi_field_level_content *from = &content->levels[level];
    int code = LUMI_OK;

    for (int run = 0; code == LUMI_OK && run < runs(from); run++) {
        int first = run * LUMI_REFERENCE_RUN;
        struct lumi_writer bytes;
        lumi_writer_init(&bytes);
        code = content->references(content->context, level, run, plan->reference_size + first, &bytes, error);
        if (code == LUMI_OK && bytes.failed)
            code = lumi_fail(error, LUMI_ERR_NOMEM, "no memory for reference images");
        size_t at = 0;
        for (int i = first; code == LUMI_OK && i < from->cluster_count && i < first + LUMI_REFERENCE_RUN; i++) {
            if (plan->reference_size[i] > bytes.size - at) {
                code = lumi_fail(error, LUMI_ERR_INTERNAL, "reference images are shorter than they say");
                break;
            }
            plan->reference_crc[i] = lumi_crc32c(0, bytes.data + at, plan->reference_size[i]);
            at += plan->reference_size[i];
        }
        if (code == LUMI_OK && sink)
            code = add(sink, bytes.data, at, error);
        lumi_writer_finish(&bytes);
    }
    return code;
}

/* A cluster's tiles in memory. */
struct tiles {
    struct lumi_writer bytes;
    struct lumi_tile_code *codes;
    int count; /* images × tiles */
};

static void finish_tiles(struct tiles *tiles)
{
    lumi_writer_finish(&tiles->bytes);
    lumi_free(tiles->codes);
}

static int load_tiles(const struct lumi_field_content *content, int level, int cluster, const struct level_plan *plan,
                      struct tiles *tiles, struct lumi_error *error)
{
    const struct lumi_field_level_content *from = &content->levels[level];
    int images = from->first[cluster + 1] - from->first[cluster] - 1;
    struct lumi_reader reader;

    *tiles = (struct tiles){.count = images * plan->cols * plan->rows};
    lumi_writer_init(&tiles->bytes);
    tiles->codes = lumi_alloc((size_t)tiles->count + 1, sizeof *tiles->codes);
    int code = tiles->codes ? LUMI_OK : lumi_fail(error, LUMI_ERR_NOMEM, "no memory for tiles");
    if (code == LUMI_OK && images > 0)
        code = content->cluster(content->context, level, cluster, &tiles->bytes, error);
    lumi_reader_init(&reader, tiles->bytes.data, tiles->bytes.size);
    for (int i = 0; code == LUMI_OK && i < tiles->count; i++)
        if (lumi_cluster_read_tile(&reader, &tiles->codes[i]) != LUMI_OK)
            code = lumi_fail(error, LUMI_ERR_FORMAT, "the coded tiles of cluster %d are damaged", cluster);
    if (code != LUMI_OK) {
        finish_tiles(tiles);
        *tiles = (struct tiles){0};
    }
    return code;
}

static int dictionary_find(const struct level_plan *plan, const struct lumi_tile_code *tile)
{
    for (int i = 0; i < plan->dictionary_count; i++)
        if (plan->dictionary[i].size == tile->compressed_size &&
            memcmp(plan->dictionary[i].bytes, tile->compressed, tile->compressed_size) == 0)
            return i;
    return LUMI_DICTIONARY_NONE;
}

/* Distinct compressed headers and how often each was seen. */
struct census {
    struct {
        uint8_t bytes[16];
        uint8_t size;
        uint32_t seen;
    } * headers;
    int count;
};
enum { CENSUS_MAX = 4096 };

static void count_header(struct census *census, const struct lumi_tile_code *tile)
{
    if (tile->compressed_size > sizeof census->headers[0].bytes)
        return;
    for (int i = 0; i < census->count; i++)
        if (census->headers[i].size == tile->compressed_size &&
            memcmp(census->headers[i].bytes, tile->compressed, tile->compressed_size) == 0) {
            census->headers[i].seen++;
            return;
        }
    if (census->count == CENSUS_MAX)
        return;
    memcpy(census->headers[census->count].bytes, tile->compressed, tile->compressed_size);
    census->headers[census->count].size = (uint8_t)tile->compressed_size;
    census->headers[census->count++].seen = 1;
}

/* The most frequent headers; one seen less than four times costs less where it is used. */
static void choose_dictionary(struct census *census, struct level_plan *plan)
{
    while (plan->dictionary_count < LUMI_DICTIONARY_MAX) {
        int most = -1;
        for (int i = 0; i < census->count; i++)
            if (census->headers[i].seen >= 4 && (most < 0 || census->headers[i].seen > census->headers[most].seen))
                most = i;
        if (most < 0)
            return;
        plan->dictionary[plan->dictionary_count].size = census->headers[most].size;
        memcpy(plan->dictionary[plan->dictionary_count++].bytes, census->headers[most].bytes,
               census->headers[most].size);
        census->headers[most].seen = 0;
    }
}

static int make_dictionary(const struct lumi_field_content *content, int level, struct level_plan *plan,
                           struct lumi_error *error)
{
    struct census census = {lumi_calloc(CENSUS_MAX, sizeof *census.headers), 0};
    int code = census.headers ? LUMI_OK : lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a field");

    for (int cluster = 0; code == LUMI_OK && cluster < content->levels[level].cluster_count; cluster++) {
        struct tiles tiles;
        code = load_tiles(content, level, cluster, plan, &tiles, error);
        for (int i = 0; code == LUMI_OK && i < tiles.count; i++)
            count_header(&census, &tiles.codes[i]);
        if (code == LUMI_OK)
            finish_tiles(&tiles);
    }
    if (code == LUMI_OK)
        choose_dictionary(&census, plan);
    lumi_free(census.headers);
    return code;
}

static int make_cluster_side(const struct lumi_field_content *content, int level, int cluster, struct level_plan *plan,
                             struct lumi_error *error)
{
    struct lumi_writer side;
    struct tiles tiles;

    LUMI_TRY(load_tiles(content, level, cluster, plan, &tiles, error));
    int per_image = plan->cols * plan->rows, code = LUMI_OK;
    struct lumi_tile_entry *entries = lumi_calloc((size_t)tiles.count + 1, sizeof *entries);
    lumi_writer_init(&side);
    if (!entries) {
        code = lumi_fail(error, LUMI_ERR_NOMEM, "no memory for side information");
        goto done;
    }
    for (int i = 0; i < tiles.count; i++) {
        const struct lumi_tile_code *tile = &tiles.codes[i];
        int word = dictionary_find(plan, tile), extra = word == LUMI_DICTIONARY_NONE ? 1 + tile->compressed_size : 0;
        entries[i] = (struct lumi_tile_entry){.check = tile->check,
                                              .fields = tile->fields,
                                              .quantizer = tile->quantizer,
                                              .dictionary = (uint8_t)word,
                                              .size = (uint16_t)(tile->size + extra)};
        memcpy(entries[i].shift, tile->shift, sizeof tile->shift);
    }
    plan->tile_size[cluster] = (uint32_t)lumi_side_offsets(entries, tiles.count / per_image, per_image);
    if (tiles.count > 0)
        lumi_side_encode(entries, tiles.count / per_image, plan->cols, plan->rows,
                         content->levels[level].priming->frame.quantizer, &side);
    plan->side_size[cluster] = (uint32_t)side.size;
    plan->side_crc[cluster] = lumi_crc32c(0, side.data, side.size);
    lumi_write_bytes(&plan->side, side.data, side.size);
    if (side.failed || plan->side.failed)
        code = lumi_fail(error, LUMI_ERR_NOMEM, "no memory for side information");
done:
    lumi_writer_finish(&side);
    lumi_free(entries);
    finish_tiles(&tiles);
    return code;
}

static int put_coding(struct sink *sink, const struct lumi_field_content *content, int level,
                      const struct level_plan *plan, struct lumi_error *error)
{
    const struct lumi_field_level_content *from = &content->levels[level];
    struct lumi_writer writer;

    lumi_writer_init(&writer);
    lumi_write_u8(&writer, (uint8_t)plan->dictionary_count);
    for (int i = 0; i < plan->dictionary_count; i++) {
        lumi_write_u8(&writer, (uint8_t)plan->dictionary[i].size);
        lumi_write_bytes(&writer, plan->dictionary[i].bytes, plan->dictionary[i].size);
    }
    lumi_write_u8(&writer, LUMI_REFERENCE_RUN);
    lumi_write_u32(&writer, (uint32_t)from->cluster_count);
    for (int i = 0; i < from->cluster_count; i++) {
        lumi_write_varint(&writer, (uint64_t)(from->first[i + 1] - from->first[i]));
        for (int k = from->first[i]; k < from->first[i + 1]; k++)
            lumi_write_varint(&writer, (uint64_t)from->members[k]);
        lumi_write_u32(&writer, plan->reference_size[i]);
        lumi_write_u32(&writer, plan->reference_crc[i]);
        lumi_write_u32(&writer, plan->side_size[i]);
        lumi_write_u32(&writer, plan->side_crc[i]);
        lumi_write_u32(&writer, plan->tile_size[i]);
    }
    lumi_priming_write(from->priming, &writer);
    return put_section(sink, SECTION_CODING, level, &writer, error);
}

/* Tile by tile, the images of the cluster beside each other. */
static int put_cluster_tiles(struct sink *sink, const struct lumi_field_content *content, int level, int cluster,
                             const struct level_plan *plan, struct lumi_error *error)
{
    struct tiles tiles;

    LUMI_TRY(load_tiles(content, level, cluster, plan, &tiles, error));
    int per_image = plan->cols * plan->rows, images = tiles.count / per_image, code = LUMI_OK;
    for (int i = 0; code == LUMI_OK && i < tiles.count; i++) {
        const struct lumi_tile_code *tile = &tiles.codes[i % images * per_image + i / images];
        uint8_t size = (uint8_t)tile->compressed_size;
        if (dictionary_find(plan, tile) == LUMI_DICTIONARY_NONE) {
            code = add(sink, &size, 1, error);
            if (code == LUMI_OK)
                code = add(sink, tile->compressed, size, error);
        }
        if (code == LUMI_OK)
            code = add(sink, tile->data, tile->size, error);
    }
    finish_tiles(&tiles);
    return code;
}

static int put_images(struct sink *sink, const struct lumi_field_content *content, int level, struct level_plan *plan,
                      struct lumi_error *error)
{
    const int clusters = content->levels[level].cluster_count;

    LUMI_TRY(make_dictionary(content, level, plan, error));
    for (int i = 0; i < clusters; i++)
        LUMI_TRY(make_cluster_side(content, level, i, plan, error));
    LUMI_TRY(each_run(NULL, content, level, plan, error));
    LUMI_TRY(put_coding(sink, content, level, plan, error));
    LUMI_TRY(begin_section(sink, SECTION_REFERENCES, level, error));
    LUMI_TRY(each_run(sink, content, level, plan, error));
    LUMI_TRY(put_section(sink, SECTION_SIDE, level, &plan->side, error));
    LUMI_TRY(begin_section(sink, SECTION_TILES, level, error));
    for (int i = 0; i < clusters; i++)
        LUMI_TRY(put_cluster_tiles(sink, content, level, i, plan, error));
    return LUMI_OK;
}

static int put_level(struct sink *sink, const struct lumi_field_content *content, int level, struct lumi_error *error)
{
    const struct lumi_field_level_content *from = &content->levels[level];
    const struct lumi_grid *grid = &content->grids[from->views[0].grid];
    struct level_plan *plan = lumi_calloc(1, sizeof *plan);
    size_t clusters = (size_t)from->cluster_count;
    uint32_t *sizes = lumi_calloc(5 * clusters, sizeof *sizes);
    int code = LUMI_OK;

    if (!plan || !sizes) {
        code = lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a field");
        goto done;
    }
    plan->width = grid->width;
    plan->height = grid->height;
    plan->cols = grid->cols;
    plan->rows = grid->rows;
    plan->reference_size = sizes;
    plan->reference_crc = sizes + clusters;
    plan->side_size = sizes + 2 * clusters;
    plan->side_crc = sizes + 3 * clusters;
    plan->tile_size = sizes + 4 * clusters;
    lumi_writer_init(&plan->side);
    sink->decoded += clusters * FIELD_IMAGE_BYTES(grid->width, grid->height);
    sink->decoded += ((size_t)from->view_count - clusters) * (size_t)(grid->cols * grid->rows) * FIELD_TILE_BYTES;
    LUMI_GOTO(code, done, put_views(sink, content, level, error));
    LUMI_GOTO(code, done, put_meshes(sink, content, level, error));
    LUMI_GOTO(code, done, put_images(sink, content, level, plan, error));
done:
    if (plan)
        lumi_writer_finish(&plan->side);
    lumi_free(sizes);
    lumi_free(plan);
    return code;
}

/* Header and section table, as they stand at the file's beginning. */
static void write_header(const struct sink *sink, struct lumi_writer *writer)
{
    struct lumi_writer table;

    lumi_writer_init(&table);
    for (int i = 0; i < sink->count; i++) {
        lumi_write_u16(&table, (uint16_t)sink->entries[i].kind);
        lumi_write_u16(&table, (uint16_t)sink->entries[i].level);
        lumi_write_u32(&table, sink->entries[i].crc);
        lumi_write_u64(&table, sink->entries[i].offset);
        lumi_write_u64(&table, sink->entries[i].size);
        lumi_write_u64(&table, 0);
    }
    lumi_write_bytes(writer, field_magic, sizeof field_magic);
    lumi_write_u32(writer, FIELD_VERSION);
    lumi_write_u32(writer, (uint32_t)sink->count);
    lumi_write_u64(writer, sink->at);
    lumi_write_u64(writer, sink->decoded);
    lumi_write_u32(writer, lumi_crc32c(0, table.data, table.size));
    while (writer->size < FIELD_HEADER_SIZE - 4 && !writer->failed)
        lumi_write_u8(writer, 0);
    lumi_write_u32(writer, lumi_crc32c(0, writer->data, writer->size));
    lumi_write_bytes(writer, table.data, table.size);
    writer->failed = writer->failed || table.failed;
    lumi_writer_finish(&table);
}

static int put_all(struct sink *sink, const struct lumi_field_content *content, struct lumi_error *error)
{
    static const uint8_t zeros[FIELD_HEADER_SIZE];
    enum { SECTIONS = 2 + 6 * LUMI_LEVELS };
    struct lumi_writer header;

    LUMI_TRY(put(sink, zeros, FIELD_HEADER_SIZE, error));
    for (int i = 0; i < SECTIONS; i++)
        LUMI_TRY(put(sink, zeros, FIELD_ENTRY_SIZE, error));
    LUMI_TRY(put_common(sink, content, error));
    for (int level = 0; level < LUMI_LEVELS; level++)
        LUMI_TRY(put_level(sink, content, level, error));

    lumi_writer_init(&header);
    write_header(sink, &header);
    int code = header.failed ? lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a field") : LUMI_OK;
    if (code == LUMI_OK && sink->memory)
        memcpy(sink->memory->data + sink->begin, header.data, header.size);
    else if (code == LUMI_OK &&
             (fseeko(sink->file, 0, SEEK_SET) || fwrite(header.data, 1, header.size, sink->file) != header.size))
        code = lumi_fail_errno(error, sink->path, "write");
    lumi_writer_finish(&header);
    return code;
}

int lumi_field_write_memory(const struct lumi_field_content *content, struct lumi_writer *writer,
                            struct lumi_error *error)
{
    struct sink *sink = lumi_calloc(1, sizeof *sink);

    if (!sink)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a field");
    sink->memory = writer;
    sink->begin = writer->size;
    int code = put_all(sink, content, error);
    lumi_free(sink);
    return code;
}

static int write_file(int fd, const char *path, const struct lumi_field_content *content, struct sink *sink,
                      struct lumi_error *error)
{
    int own = dup(fd); /* fclose closes what it is given */

    sink->path = path;
    sink->file = own >= 0 ? fdopen(own, "wb") : NULL;
    if (!sink->file) {
        int code = lumi_fail_errno(error, path, "create");
        if (own >= 0)
            close(own);
        return code;
    }
    int code = put_all(sink, content, error);
    if (fclose(sink->file) && code == LUMI_OK)
        code = lumi_fail_errno(error, path, "write");
    return code;
}

int lumi_field_write(const char *path, const struct lumi_field_content *content, struct lumi_error *error)
{
    struct sink *sink = lumi_calloc(1, sizeof *sink);
    struct lumi_new_file file;

    if (!sink)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a field");
    int code = lumi_new_file_open(&file, path, error);
    if (code == LUMI_OK) {
        code = write_file(file.fd, path, content, sink, error);
        code = lumi_new_file_close(&file, code, true, error);
    }
    lumi_free(sink);
    return code;
}
