/* Opening a field: the map, the header, what is common to both levels. */
#include "proto/base/bytes.h"
#include "proto/base/memory.h"
#include "proto/lightfield/field_priv.h"

#include <fcntl.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

/* The sections of the file: common ones stand under level 0. */
struct sections {
    struct field_section_bytes bytes[LUMI_LEVELS][SECTION_KINDS];
};

static int malformed(struct lumi_error *error, const char *what)
{
    return lumi_fail(error, LUMI_ERR_FORMAT, "%s", what);
}

static bool is_bulk(unsigned kind)
{
    return kind == SECTION_REFERENCES || kind == SECTION_SIDE || kind == SECTION_TILES;
}

/* Checksums of the bulk are not compared here: clusters and tiles carry their own. */
static int read_entry(struct lumi_field *field, struct lumi_reader *reader, struct sections *sections,
                      struct lumi_error *error)
{
    unsigned kind = lumi_read_u16(reader), level = lumi_read_u16(reader);
    uint32_t crc = lumi_read_u32(reader);
    uint64_t offset = lumi_read_u64(reader), size = lumi_read_u64(reader);

    lumi_read_u64(reader);
    if (offset > field->size || size > field->size - offset)
        return malformed(error, "a section lies outside the file");
    if (kind == 0 || kind >= SECTION_KINDS || level >= LUMI_LEVELS)
        return LUMI_OK; /* of a later minor revision */
    struct field_section_bytes *section = &sections->bytes[level][kind];
    if (section->data)
        return malformed(error, "a section is there twice");
    *section = (struct field_section_bytes){field->data + offset, (size_t)size};
#ifndef FUZZING_BUILD_MODE_UNSAFE_FOR_PRODUCTION
    if (!is_bulk(kind) && lumi_crc32c(0, section->data, section->size) != crc)
        return lumi_fail(error, LUMI_ERR_CHECKSUM, "section %u of the %s level is damaged", kind,
                         level ? "fine" : "coarse");
#else
    (void)crc;
#endif
    return LUMI_OK;
}

static int read_header(struct lumi_field *field, struct sections *sections, struct lumi_error *error)
{
    struct lumi_reader reader;

    lumi_reader_init(&reader, field->data, field->size);
    const uint8_t *magic = lumi_read_bytes(&reader, sizeof field_magic);
    if (!magic || memcmp(magic, field_magic, sizeof field_magic) != 0)
        return malformed(error, "not a light field (.lumi)");
    field->info.version = lumi_read_u32(&reader);
    if (!reader.failed && field->info.version > FIELD_VERSION)
        return lumi_fail(error, LUMI_ERR_VERSION, "version %u of the format; this program knows %d and earlier ones",
                         field->info.version, FIELD_VERSION);
    uint32_t count = lumi_read_u32(&reader);
    uint64_t bytes = lumi_read_u64(&reader);
    field->memory_limit = lumi_read_u64(&reader);
    uint32_t table_crc = lumi_read_u32(&reader);
    if (field->size < FIELD_HEADER_SIZE || field->info.version == 0)
        return malformed(error, "the header is cut off");
    reader.at = FIELD_HEADER_SIZE - 4;
    uint32_t crc = lumi_read_u32(&reader);
#ifndef FUZZING_BUILD_MODE_UNSAFE_FOR_PRODUCTION
    if (crc != lumi_crc32c(0, field->data, FIELD_HEADER_SIZE - 4))
        return lumi_fail(error, LUMI_ERR_CHECKSUM, "the header is damaged");
    if (bytes != field->size)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%zu bytes long, but should be %llu", field->size,
                         (unsigned long long)bytes);
#else
    (void)crc, (void)bytes;
#endif
    if (count > FIELD_SECTIONS_MAX || lumi_reader_left(&reader) < count * FIELD_ENTRY_SIZE)
        return malformed(error, "the table of sections is cut off");
    if (field->memory_limit > FIELD_MEMORY_MAX || field->memory_limit / FIELD_MEMORY_PER_BYTE > field->size)
        return lumi_fail(error, LUMI_ERR_LIMIT, "wants %llu bytes of memory, too much for a file of %zu",
                         (unsigned long long)field->memory_limit, field->size);
#ifndef FUZZING_BUILD_MODE_UNSAFE_FOR_PRODUCTION
    if (table_crc != lumi_crc32c(0, field->data + FIELD_HEADER_SIZE, count * FIELD_ENTRY_SIZE))
        return lumi_fail(error, LUMI_ERR_CHECKSUM, "the table of sections is damaged");
#else
    (void)table_crc;
#endif
    for (uint32_t i = 0; i < count; i++)
        LUMI_TRY(read_entry(field, &reader, sections, error));
    return LUMI_OK;
}

static int read_common(struct lumi_field *field, const struct field_section_bytes *section, struct lumi_error *error)
{
    struct lumi_field_info *info = &field->info;
    struct lumi_reader reader;

    lumi_reader_init(&reader, section->data, section->size);
    unsigned surface = lumi_read_u8(&reader), shape = lumi_read_u8(&reader), kernel = lumi_read_u8(&reader);
    info->quality = lumi_read_u8(&reader);
    info->centre.x = lumi_read_f64(&reader);
    info->centre.y = lumi_read_f64(&reader);
    info->centre.z = lumi_read_f64(&reader);
    info->radius = lumi_read_f64(&reader);
    if (reader.failed || surface > LUMI_SURFACE_PLANE || shape > LUMI_DISK_RECTANGLE || kernel > LUMI_KERNEL_CUBIC ||
        !isfinite(info->centre.x + info->centre.y + info->centre.z) || !(info->radius >= 0) || !isfinite(info->radius))
        return malformed(error, "the description of the field is malformed");
    info->surface = (enum lumi_surface)surface;
    info->disk_shape = (enum lumi_disk_shape)shape;
    info->kernel = (enum lumi_disk_kernel)kernel;
    return LUMI_OK;
}

static int read_grids(struct lumi_field *field, const struct field_section_bytes *section, struct lumi_error *error)
{
    struct lumi_reader reader;

    lumi_reader_init(&reader, section->data, section->size);
    int count = lumi_read_u16(&reader);
    if (reader.failed || count < 1 || count > FIELD_GRIDS_MAX)
        return malformed(error, "the lenses are malformed");
    field->grids = lumi_calloc((size_t)count, sizeof *field->grids);
    if (!field->grids)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for the lenses");
    for (; field->grid_count < count; field->grid_count++) {
        struct lumi_grid *grid = &field->grids[field->grid_count];
        grid->width = lumi_read_u16(&reader);
        grid->height = lumi_read_u16(&reader);
        grid->cols = (grid->width + LUMI_TILE - 1) / LUMI_TILE;
        grid->rows = (grid->height + LUMI_TILE - 1) / LUMI_TILE;
        if (grid->cols > LUMI_GRID_MAX || grid->rows > LUMI_GRID_MAX)
            return malformed(error, "the lenses are malformed");
        for (int k = 0; k <= grid->cols; k++)
            grid->tan_x[k] = lumi_read_f64(&reader);
        for (int k = 0; k <= grid->rows; k++)
            grid->tan_y[k] = lumi_read_f64(&reader);
        if (reader.failed || !lumi_grid_valid(grid))
            return malformed(error, "the lenses are malformed");
    }
    return LUMI_OK;
}

static void sum_sizes(struct lumi_field *field, const struct sections *sections)
{
    struct lumi_field_info *info = &field->info;
    uint64_t rest = field->size;

    info->file_bytes = field->size;
    for (int i = 0; i < LUMI_LEVELS; i++) {
        const struct field_level *level = &field->levels[i];
        const struct field_section_bytes *bytes = sections->bytes[i];
        uint64_t tiles = (uint64_t)(level->cols * level->rows);
        uint64_t coded = (uint64_t)(level->view_count - level->cluster_count) * tiles;

        info->view_count[i] = level->view_count;
        info->reference_bytes[i] = bytes[SECTION_REFERENCES].size;
        info->side_bytes[i] = bytes[SECTION_SIDE].size;
        info->image_bytes[i] = bytes[SECTION_REFERENCES].size + bytes[SECTION_SIDE].size + bytes[SECTION_TILES].size +
                               bytes[SECTION_CODING].size;
        info->geometry_bytes[i] = bytes[SECTION_MESHES].size;
        info->pixels[i] = (uint64_t)level->view_count * (uint64_t)level->width * (uint64_t)level->height;
        info->coded_tiles[i] = coded;
        info->cluster_count[i] = level->cluster_count;
        info->quantizer[i] = level->priming.frame.quantizer;
        rest -= info->image_bytes[i] + info->geometry_bytes[i];
    }
    info->index_bytes = rest;
}

static int read_all(struct lumi_field *field, int threads, struct lumi_error *error)
{
    struct sections sections = {0};

    LUMI_TRY(read_header(field, &sections, error));
    for (int level = 0; level < LUMI_LEVELS; level++)
        for (int kind = level ? SECTION_VIEWS : SECTION_FIELD; kind < SECTION_KINDS; kind++)
            if (!sections.bytes[level][kind].data)
                return lumi_fail(error, LUMI_ERR_FORMAT, "section %d of the %s level is missing", kind,
                                 level ? "fine" : "coarse");
    LUMI_TRY(read_common(field, &sections.bytes[0][SECTION_FIELD], error));
    LUMI_TRY(read_grids(field, &sections.bytes[0][SECTION_GRIDS], error));
    for (int level = 0; level < LUMI_LEVELS; level++)
        LUMI_TRY(lumi_field_level_read(field, level, sections.bytes[level], threads, error));
    sum_sizes(field, &sections);
    return LUMI_OK;
}

static int open_bytes(const void *data, size_t size, bool mapped, const char *name, int threads,
                      struct lumi_field **result, struct lumi_error *error)
{
    struct lumi_field *field = lumi_calloc(1, sizeof *field);
    char *copy = lumi_alloc(strlen(name) + 1, 1);
    int code;

    *result = NULL;
    if (!field || !copy) {
        lumi_free(field);
        lumi_free(copy);
        if (mapped)
            munmap((void *)(uintptr_t)data, size);
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: no memory", name);
    }
    strcpy(copy, name);
    *field = (struct lumi_field){.data = data, .size = size, .mapped = mapped, .name = copy};
    code = read_all(field, threads, error);
    if (code != LUMI_OK) {
        lumi_fail_prefix(error, "%s", name);
        lumi_field_close(field);
        return code;
    }
    *result = field;
    return LUMI_OK;
}

int lumi_field_open_memory(const void *data, size_t size, const char *name, int threads, struct lumi_field **field,
                           struct lumi_error *error)
{
    return open_bytes(data, size, false, name, threads, field, error);
}

int lumi_field_open(const char *path, int threads, struct lumi_field **field, struct lumi_error *error)
{
    struct stat status;
    int file = open(path, O_RDONLY | O_CLOEXEC);

    *field = NULL;
    if (file < 0)
        return lumi_fail_errno(error, path, "open");
    if (fstat(file, &status)) {
        int code = lumi_fail_errno(error, path, "examine");
        close(file);
        return code;
    }
    if (!S_ISREG(status.st_mode) || status.st_size < FIELD_HEADER_SIZE) {
        close(file);
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: not a light field (.lumi)", path);
    }
    void *data = mmap(NULL, (size_t)status.st_size, PROT_READ, MAP_SHARED, file, 0);
    int code = data == MAP_FAILED ? lumi_fail_errno(error, path, "map") : LUMI_OK;
    close(file);
    return code == LUMI_OK ? open_bytes(data, (size_t)status.st_size, true, path, threads, field, error) : code;
}

void lumi_field_close(struct lumi_field *field)
{
    if (!field)
        return;
    for (int i = 0; i < LUMI_LEVELS; i++)
        lumi_field_level_finish(&field->levels[i]);
    lumi_free(field->grids);
    lumi_free(field->name);
    if (field->mapped)
        munmap((void *)(uintptr_t)field->data, field->size);
    lumi_free(field);
}

const struct lumi_field_info *lumi_field_info(const struct lumi_field *field)
{
    return &field->info;
}

static bool has_view(const struct lumi_field *field, int level, int view)
{
    return level >= 0 && level < LUMI_LEVELS && view >= 0 && view < field->levels[level].view_count;
}

const struct lumi_field_view *lumi_field_view(const struct lumi_field *field, int level, int view)
{
    return has_view(field, level, view) ? &field->levels[level].views[view] : NULL;
}

const struct lumi_grid *lumi_field_grid(const struct lumi_field *field, int grid)
{
    return grid >= 0 && grid < field->grid_count ? &field->grids[grid] : NULL;
}

const struct lumi_view_mesh *lumi_field_mesh(const struct lumi_field *field, int level, int view)
{
    const struct lumi_view_mesh *mesh = has_view(field, level, view) ? &field->levels[level].meshes[view] : NULL;

    return mesh && mesh->tiles ? mesh : NULL;
}
