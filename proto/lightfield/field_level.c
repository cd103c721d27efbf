/* Reading one level of a field. */
#include "proto/base/bytes.h"
#include "proto/base/memory.h"
#include "proto/base/parallel.h"
#include "proto/lightfield/field_priv.h"

#include <string.h>

static int malformed(struct lumi_error *error, const char *what)
{
    return lumi_fail(error, LUMI_ERR_FORMAT, "%s", what);
}

static int no_memory(struct lumi_error *error)
{
    return lumi_fail(error, LUMI_ERR_NOMEM, "no memory to read a level");
}

static bool positive(float value)
{
    return value > 0 && isfinite(value);
}

static int read_view(const struct lumi_field *field, struct lumi_reader *reader, struct lumi_field_view *view)
{
    size_t length = lumi_read_u8(reader);
    const uint8_t *name = lumi_read_bytes(reader, length);
    double q[4], norm = 0;

    if (!name || length >= sizeof view->name || memchr(name, 0, length))
        return LUMI_ERR_FORMAT;
    memcpy(view->name, name, length);
    view->grid = lumi_read_u16(reader);
    for (int k = 0; k < 4; k++) {
        q[k] = lumi_read_f64(reader);
        norm += q[k] * q[k];
    }
    view->pose.t.x = lumi_read_f64(reader);
    view->pose.t.y = lumi_read_f64(reader);
    view->pose.t.z = lumi_read_f64(reader);
    view->disk.u_neg = lumi_read_f32(reader);
    view->disk.u_pos = lumi_read_f32(reader);
    view->disk.v_neg = lumi_read_f32(reader);
    view->disk.v_pos = lumi_read_f32(reader);
    if (reader->failed || view->grid >= field->grid_count || !(norm > 0.999 && norm < 1.001))
        return LUMI_ERR_FORMAT;
    lumi_rotation_from_quaternion(q, view->pose.r);
    return lumi_pose_valid(&view->pose, 1e-2) && positive(view->disk.u_neg) && positive(view->disk.u_pos) &&
                   positive(view->disk.v_neg) && positive(view->disk.v_pos)
               ? LUMI_OK
               : LUMI_ERR_FORMAT;
}

static int read_views(const struct lumi_field *field, struct field_level *level,
                      const struct field_section_bytes *section, struct lumi_error *error)
{
    enum { LEAST = 1 + 2 + 7 * 8 + 4 * 4 };
    struct lumi_reader reader;

    lumi_reader_init(&reader, section->data, section->size);
    uint32_t count = lumi_read_u32(&reader);
    if (reader.failed || count < 1 || count > FIELD_VIEWS_MAX || count > lumi_reader_left(&reader) / LEAST)
        return malformed(error, "the table of views is malformed");
    level->views = lumi_calloc(count, sizeof *level->views);
    level->meshes = lumi_calloc(count, sizeof *level->meshes);
    level->cluster_of = lumi_alloc(count, sizeof *level->cluster_of);
    level->member_of = lumi_alloc(count, sizeof *level->member_of);
    if (!level->views || !level->meshes || !level->cluster_of || !level->member_of)
        return no_memory(error);
    level->view_count = (int)count;
    for (uint32_t i = 0; i < count; i++) {
        if (read_view(field, &reader, &level->views[i]) != LUMI_OK)
            return lumi_fail(error, LUMI_ERR_FORMAT, "view %u is malformed", i);
        const struct lumi_grid *grid = &field->grids[level->views[i].grid];
        if (i == 0) {
            level->width = grid->width;
            level->height = grid->height;
            level->cols = grid->cols;
            level->rows = grid->rows;
        }
        if (grid->width != level->width || grid->height != level->height)
            return malformed(error, "the views of a level differ in size");
        level->cluster_of[i] = -1;
    }
    return LUMI_OK;
}

/* Meshes, several threads at once: where each lies is found first. */
struct mesh_job {
    struct field_level *level;
    const uint8_t **data;
    uint32_t *sizes;
};

static int decode_mesh(void *context, int view, int thread)
{
    const struct mesh_job *job = context;
    struct lumi_reader reader;

    (void)thread;
    if (job->sizes[view] == 0)
        return LUMI_OK;
    lumi_reader_init(&reader, job->data[view], job->sizes[view]);
    return lumi_view_mesh_decode(&reader, job->level->cols, job->level->rows, &job->level->meshes[view], NULL);
}

static int read_meshes(struct field_level *level, const struct field_section_bytes *section, int threads,
                       struct lumi_error *error)
{
    struct mesh_job job = {level, lumi_alloc((size_t)level->view_count, sizeof *job.data),
                           lumi_alloc((size_t)level->view_count, sizeof *job.sizes)};
    struct lumi_reader reader;
    int code = LUMI_OK;

    lumi_reader_init(&reader, section->data, section->size);
    if (!job.data || !job.sizes)
        code = no_memory(error);
    for (int i = 0; code == LUMI_OK && i < level->view_count; i++) {
        job.sizes[i] = lumi_read_u32(&reader);
        job.data[i] = lumi_read_bytes(&reader, job.sizes[i]);
        if (!job.data[i])
            code = malformed(error, "the geometry is cut off");
    }
    if (code == LUMI_OK) {
        code = lumi_parallel_for(level->view_count, threads, decode_mesh, &job);
        if (code != LUMI_OK)
            lumi_fail(error, code, "the geometry of a view is malformed");
    }
    lumi_free(job.data);
    lumi_free(job.sizes);
    return code;
}

/* Accounts for memory before it is taken. */
static int claim(struct lumi_field *field, uint64_t bytes, struct lumi_error *error)
{
    if (bytes > field->memory_limit - field->memory)
        return lumi_fail(error, LUMI_ERR_LIMIT, "needs more memory than its header says");
    field->memory += bytes;
    return LUMI_OK;
}

static int read_cluster(struct field_level *level, struct lumi_reader *reader, int index, int *taken)
{
    struct field_cluster *cluster = &level->clusters[index];
    uint64_t count = lumi_read_varint(reader);

    if (reader->failed || count < 1 || count > (uint64_t)(level->view_count - *taken))
        return LUMI_ERR_FORMAT;
    cluster->count = (int)count;
    cluster->members = level->members + *taken;
    for (int i = 0; i < cluster->count; i++) {
        uint64_t view = lumi_read_varint(reader);
        if (reader->failed || view >= (uint64_t)level->view_count || level->cluster_of[view] >= 0)
            return LUMI_ERR_FORMAT;
        level->members[(*taken)++] = (int)view;
        level->cluster_of[view] = index;
        level->member_of[view] = i;
        level->views[view].reference = cluster->members[0];
    }
    cluster->reference_size = lumi_read_u32(reader);
    cluster->reference_crc = lumi_read_u32(reader);
    cluster->side_size = lumi_read_u32(reader);
    cluster->side_crc = lumi_read_u32(reader);
    cluster->tile_size = lumi_read_u32(reader);
    return reader->failed ? LUMI_ERR_FORMAT : LUMI_OK;
}

static int read_coding(struct lumi_field *field, struct field_level *level, const struct field_section_bytes *section,
                       struct lumi_error *error)
{
    enum { LEAST = 1 + 1 + 5 * 4 };
    struct lumi_reader reader;
    int taken = 0;

    lumi_reader_init(&reader, section->data, section->size);
    level->dictionary_count = lumi_read_u8(&reader);
    if (level->dictionary_count > LUMI_DICTIONARY_MAX)
        return malformed(error, "the dictionary of tile headers is malformed");
    for (int i = 0; i < level->dictionary_count; i++) {
        level->dictionary[i].size = lumi_read_u8(&reader);
        level->dictionary[i].bytes = lumi_read_bytes(&reader, level->dictionary[i].size);
        if (!level->dictionary[i].bytes || level->dictionary[i].size < 1)
            return malformed(error, "the dictionary of tile headers is malformed");
    }
    level->run = lumi_read_u8(&reader);
    uint32_t count = lumi_read_u32(&reader);
    if (reader.failed || level->run < 1 || count < 1 || count > (uint32_t)level->view_count ||
        count > lumi_reader_left(&reader) / LEAST)
        return malformed(error, "the table of clusters is malformed");
    LUMI_TRY(claim(field, count * FIELD_IMAGE_BYTES(level->width, level->height), error));
    level->clusters = lumi_calloc(count, sizeof *level->clusters);
    level->references = lumi_calloc(count, sizeof *level->references);
    level->members = lumi_alloc((size_t)level->view_count, sizeof *level->members);
    if (!level->clusters || !level->references || !level->members)
        return no_memory(error);
    level->cluster_count = (int)count;
    for (int i = 0; i < level->cluster_count; i++)
        if (read_cluster(level, &reader, i, &taken) != LUMI_OK)
            return lumi_fail(error, LUMI_ERR_FORMAT, "cluster %d is malformed", i);
    if (taken != level->view_count)
        return malformed(error, "a view is in no cluster");
    return lumi_priming_read(&reader, level->cluster_count, &level->priming, error);
}

/* Where each cluster's bytes lie in the three bulk sections. */
static int place_clusters(struct field_level *level, const struct field_section_bytes *sections,
                          struct lumi_error *error)
{
    struct lumi_reader references, side, tiles;

    lumi_reader_init(&references, sections[SECTION_REFERENCES].data, sections[SECTION_REFERENCES].size);
    lumi_reader_init(&side, sections[SECTION_SIDE].data, sections[SECTION_SIDE].size);
    lumi_reader_init(&tiles, sections[SECTION_TILES].data, sections[SECTION_TILES].size);
    for (int i = 0; i < level->cluster_count; i++) {
        struct field_cluster *cluster = &level->clusters[i];
        cluster->reference = lumi_read_bytes(&references, cluster->reference_size);
        cluster->side = lumi_read_bytes(&side, cluster->side_size);
        cluster->tiles = lumi_read_bytes(&tiles, cluster->tile_size);
        if (!cluster->reference || !cluster->side || !cluster->tiles)
            return malformed(error, "the images are cut off");
    }
    return LUMI_OK;
}

/* Memory for tile entries. Each holds LUMI_CHECK_BITS bits that cannot be squeezed, so their number is bounded by the
 * bytes that are there. */
static int claim_entries(struct lumi_field *field, struct field_level *level, struct lumi_error *error)
{
    uint64_t tiles = (uint64_t)(level->cols * level->rows), total = 0;

    for (int i = 0; i < level->cluster_count; i++) {
        const struct field_cluster *cluster = &level->clusters[i];
        uint64_t count = (uint64_t)(cluster->count - 1) * tiles;
        if (count * LUMI_CHECK_BITS > ((uint64_t)cluster->side_size + 8) * 8)
            return malformed(error, "a cluster has more tiles than its side information can hold");
        total += count;
    }
    LUMI_TRY(claim(field, total * FIELD_TILE_BYTES, error));
    level->entries = lumi_alloc((size_t)total + 1, sizeof *level->entries);
    return level->entries ? LUMI_OK : no_memory(error);
}

static int decode_side(void *context, int index, int thread)
{
    struct field_level *level = context;
    struct field_cluster *cluster = &level->clusters[index];
    size_t tiles = (size_t)(level->cols * level->rows);
    uint64_t total = 0;

    (void)thread;
    /* Clusters follow each other in members, and so in entries: one image fewer a cluster. */
    struct lumi_tile_entry *entries = level->entries + (size_t)(cluster->members - level->members - index) * tiles;
#ifndef FUZZING_BUILD_MODE_UNSAFE_FOR_PRODUCTION
    if (lumi_crc32c(0, cluster->side, cluster->side_size) != cluster->side_crc)
        return LUMI_OK; /* entries stay NULL: its tiles are damaged */
#endif
    if (lumi_side_decode(cluster->side, cluster->side_size, cluster->count - 1, level->cols, level->rows,
                         level->priming.frame.quantizer, level->dictionary_count, entries, &total) == LUMI_OK &&
        total <= cluster->tile_size)
        cluster->entries = entries;
    return LUMI_OK;
}

static int decode_run(void *context, int run, int thread)
{
    struct field_level *level = context;
    int first = run * level->run, count = 0;
    uint32_t sizes[256];

    (void)thread;
    while (count < level->run && first + count < level->cluster_count) {
        const struct field_cluster *cluster = &level->clusters[first + count];
#ifndef FUZZING_BUILD_MODE_UNSAFE_FOR_PRODUCTION
        if (lumi_crc32c(0, cluster->reference, cluster->reference_size) != cluster->reference_crc)
            break; /* it and those after it stay empty */
#endif
        sizes[count++] = cluster->reference_size;
    }
    int code = count > 0 ? lumi_references_decode(level->clusters[first].reference, sizes, count, level->width,
                                                  level->height, level->references + first)
                         : LUMI_OK;
    return code == LUMI_ERR_NOMEM ? code : LUMI_OK;
}

int lumi_field_level_read(struct lumi_field *field, int index, const struct field_section_bytes *sections, int threads,
                          struct lumi_error *error)
{
    struct field_level *level = &field->levels[index];

    LUMI_TRY(read_views(field, level, &sections[SECTION_VIEWS], error));
    LUMI_TRY(read_coding(field, level, &sections[SECTION_CODING], error));
    LUMI_TRY(place_clusters(level, sections, error));
    LUMI_TRY(claim_entries(field, level, error));
    LUMI_TRY(read_meshes(level, &sections[SECTION_MESHES], threads, error));
    LUMI_TRY(lumi_parallel_for(level->cluster_count, threads, decode_side, level));
    int runs = (level->cluster_count + level->run - 1) / level->run;
    if (lumi_parallel_for(runs, threads, decode_run, level) != LUMI_OK)
        return no_memory(error);
    return LUMI_OK;
}

void lumi_field_level_finish(struct field_level *level)
{
    for (int i = 0; level->meshes && i < level->view_count; i++)
        lumi_view_mesh_finish(&level->meshes[i]);
    for (int i = 0; level->references && i < level->cluster_count; i++)
        lumi_yuv_finish(&level->references[i]);
    lumi_priming_finish(&level->priming);
    lumi_free(level->views);
    lumi_free(level->meshes);
    lumi_free(level->clusters);
    lumi_free(level->members);
    lumi_free(level->cluster_of);
    lumi_free(level->member_of);
    lumi_free(level->entries);
    lumi_free(level->references);
}
