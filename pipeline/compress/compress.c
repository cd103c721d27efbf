/* The stage `compress`. */
#include "pipeline/compress/compress.h"

#include "pipeline/compress/level.h"
#include "pipeline/compress/sample.h"
#include "pipeline/compress/size_search.h"
#include "pipeline/geometry/disks.h"
#include "pipeline/run/key.h"
#include "proto/base/file.h"
#include "proto/base/memory.h"
#include "proto/lightfield/field_write.h"

#include <errno.h>
#include <glib.h>
#include <glib/gstdio.h>
#include <string.h>

/* What a field depends on besides its quality. */
static void key_content(struct lumi_run *run, struct lumi_key *k)
{
    const struct lumi_parameters *parameters = &run->parameters;

    lumi_key_int(k, parameters->cluster_size);
    lumi_key_int(k, parameters->disk_shape);
    lumi_key_int(k, parameters->kernel);
    lumi_key_double(k, parameters->disk_scale);
    for (int n = 0; n < run->kept_count; n++) {
        const int i = run->kept[n];
        lumi_key_bytes(k, run->sources[i].name, sizeof run->sources[i].name);
        lumi_key_bytes(k, &run->sources[i].pose, sizeof run->sources[i].pose);
        lumi_key_view(k, run, i, LUMI_VIEW_FINAL);
        lumi_key_view(k, run, i, LUMI_VIEW_DEPTH);
        lumi_key_input(k, run, "geometry", i);
        lumi_key_input(k, run, "geometry-coarse", i);
    }
}

static int key(struct lumi_run *run, int index, struct lumi_key *k, struct lumi_error *error)
{
    (void)index;
    (void)error;
    lumi_key_int(k, run->parameters.quality);
    lumi_key_int(k, run->parameters.target_bytes);
    key_content(run, k);
    return LUMI_OK;
}

/* Both levels, and what the file's writer asks of them. */
struct assembly {
    struct compress_level levels[LUMI_LEVELS];
    struct lumi_grid grids[LUMI_LEVELS];
    struct lumi_field_view *views[LUMI_LEVELS];
};

static int mesh(void *context, int index, int view, struct lumi_writer *bytes, struct lumi_error *error)
{
    const struct assembly *assembly = context;
    const struct compress_level *level = &assembly->levels[index];
    g_autofree char *path = lumi_run_path(level->run, index == LUMI_LEVEL_COARSE ? "geometry-coarse" : "geometry",
                                          level->sources[view], ".mesh");
    uint8_t *data;
    size_t size;

    LUMI_TRY(lumi_file_read(path, (size_t)1 << 30, &data, &size, error));
    lumi_write_bytes(bytes, data, size);
    lumi_free(data);
    return LUMI_OK;
}

static int references(void *context, int level, int run, uint32_t *sizes, struct lumi_writer *bytes,
                      struct lumi_error *error)
{
    const struct assembly *assembly = context;

    return compress_level_references(&assembly->levels[level], run, sizes, bytes, error);
}

static int cluster(void *context, int level, int index, struct lumi_writer *bytes, struct lumi_error *error)
{
    const struct assembly *assembly = context;

    return compress_level_cluster(&assembly->levels[level], index, bytes, error);
}

static int make_views(const struct compress_level *level, struct lumi_field_view **views, struct lumi_error *error)
{
    const struct lumi_run *run = level->run;
    struct lumi_disk *disks = lumi_calloc((size_t)level->count, sizeof *disks);
    int code;

    *views = lumi_calloc((size_t)level->count, sizeof **views);
    if (!disks || !*views) {
        lumi_free(disks);
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for the views of a level");
    }
    code = lumi_disks_make(level->count, level->poses, run->surface, run->centre, run->radius,
                           run->parameters.disk_scale, disks, error);
    for (int i = 0; code == LUMI_OK && i < level->count; i++) {
        struct lumi_field_view *view = &(*views)[i];
        g_strlcpy(view->name, run->sources[level->sources[i]].name, sizeof view->name);
        view->grid = level->index;
        view->pose = level->poses[i];
        view->disk = disks[i];
    }
    lumi_free(disks);
    return code;
}

static int assemble(struct assembly *assembly, const char *path, int quality, struct lumi_error *error)
{
    const struct lumi_run *run = assembly->levels[0].run;
    struct lumi_field_content content = {.surface = run->surface,
                                         .centre = run->centre,
                                         .radius = run->radius,
                                         .disk_shape = run->parameters.disk_shape,
                                         .kernel = run->parameters.kernel,
                                         .quality = quality,
                                         .grid_count = LUMI_LEVELS,
                                         .grids = assembly->grids,
                                         .context = assembly,
                                         .mesh = mesh,
                                         .references = references,
                                         .cluster = cluster};

    for (int i = 0; i < LUMI_LEVELS; i++) {
        const struct compress_level *level = &assembly->levels[i];
        assembly->grids[i] = level->grid;
        content.levels[i] = (struct lumi_field_level_content){.view_count = level->count,
                                                              .views = assembly->views[i],
                                                              .cluster_count = level->clusters.count,
                                                              .first = level->clusters.first,
                                                              .members = level->clusters.members,
                                                              .priming = lumi_tile_encoder_priming(level->encoder)};
    }
    return lumi_field_write(path, &content, error);
}

/* Codes everything at one quality and writes the file. */
static int write_at(struct lumi_run *run, int quality, const char *path, struct lumi_error *error)
{
    struct assembly *assembly = lumi_calloc(1, sizeof *assembly);
    int code = assembly ? LUMI_OK : lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a field");

    for (int i = 0; code == LUMI_OK && i < LUMI_LEVELS; i++) {
        code = compress_level_init(&assembly->levels[i], run, i, quality, error);
        if (code == LUMI_OK)
            code = make_views(&assembly->levels[i], &assembly->views[i], error);
        if (code == LUMI_OK)
            code = compress_level_code(&assembly->levels[i], error);
    }
    if (code == LUMI_OK)
        code = assemble(assembly, path, quality, error);
    for (int i = 0; assembly && i < LUMI_LEVELS; i++) {
        compress_level_finish(&assembly->levels[i]);
        lumi_free(assembly->views[i]);
    }
    lumi_free(assembly);
    return code;
}

static int file_size(const char *path, long long *size, struct lumi_error *error)
{
    GStatBuf status;

    if (g_stat(path, &status))
        return lumi_fail_errno(error, path, "examine");
    *size = (long long)status.st_size;
    return LUMI_OK;
}

/* A search for a size. */
struct search {
    struct lumi_run *run;
    const char *path; /* where fields are written */
    int at_path;      /* the quality of the one that lies there; −1: none */
};

typedef int (*size_fn)(struct search *search, int quality, long long *size, struct lumi_error *error);

/* A size at a quality; once known, it is kept in a file, so that a search that was stopped need not code again. */
static int size_kept(struct search *search, const char *kind, size_fn find, int quality, long long *size,
                     struct lumi_error *error)
{
    g_autofree char *all = lumi_run_path(search->run, "compress", -1, ""), *folder = g_path_get_dirname(all);
    g_autofree char *kept = g_strdup_printf("%s/%s-%03d.txt", folder, kind, quality);
    g_autofree char *kept_key = g_strdup_printf("%s/%s-%03d.key", folder, kind, quality), *text = NULL;
    char hex[LUMI_KEY_HEX], there[LUMI_KEY_HEX];
    struct lumi_key k;

    lumi_key_init(&k, kind, lumi_stage_compress.version);
    lumi_key_int(&k, quality);
    key_content(search->run, &k);
    lumi_key_hex(&k, hex);
    if (lumi_key_load(kept_key, there) && !strcmp(there, hex) && g_file_get_contents(kept, &text, NULL, NULL)) {
        *size = g_ascii_strtoll(text, NULL, 10);
        return LUMI_OK;
    }
    LUMI_TRY(find(search, quality, size, error));
    text = g_strdup_printf("%lld\n", *size);
    if (g_unlink(kept_key) && errno != ENOENT)
        return lumi_fail_errno(error, kept_key, "remove");
    LUMI_TRY(lumi_file_write(kept, text, strlen(text), false, error));
    return lumi_key_save(kept_key, kept, hex, error);
}

static int code_all(struct search *search, int quality, long long *size, struct lumi_error *error)
{
    LUMI_TRY(write_at(search->run, quality, search->path, error));
    search->at_path = quality;
    return file_size(search->path, size, error);
}

static int code_sample(struct search *search, int quality, long long *size, struct lumi_error *error)
{
    return compress_sample_size(search->run, quality, size, error);
}

/* Neighbouring qualities may mean the same quantizers: the lowest of them. */
static int lowest_alike(int quality)
{
    struct compress_quality wanted, lower;

    compress_quality_init(&wanted, quality);
    for (; quality > 0; quality--) {
        compress_quality_init(&lower, quality - 1);
        if (lower.tile_quantizer != wanted.tile_quantizer)
            break;
    }
    return quality;
}

static int measure(void *context, int quality, long long *size, struct lumi_error *error)
{
    return size_kept(context, "size", code_all, lowest_alike(quality), size, error);
}

static int estimate(void *context, int quality, long long *size, struct lumi_error *error)
{
    return size_kept(context, "sample", code_sample, lowest_alike(quality), size, error);
}

static int write_within(struct lumi_run *run, long long target, const char *path, struct lumi_error *error)
{
    bool sample = compress_sample_pays(run->kept_count, run->parameters.cluster_size);
    struct search search = {run, path, -1};
    long long size = 0;
    int quality;

    LUMI_TRY(compress_size_search(target, sample ? estimate : NULL, measure, &search, &quality, error));
    if (quality < 0) {
        LUMI_TRY(measure(&search, 0, &size, error));
        return lumi_fail(error, LUMI_ERR_LIMIT,
                         "the smallest field of this capture has %lld bytes, %lld were asked for", size, target);
    }
    quality = lowest_alike(quality);
    return search.at_path == quality ? LUMI_OK : write_at(run, quality, path, error);
}

static int make(struct lumi_run *run, void *state, int index, int thread, const char *path, struct lumi_error *error)
{
    (void)state;
    (void)index;
    (void)thread;
    if (run->parameters.target_bytes > 0)
        return write_within(run, run->parameters.target_bytes, path, error);
    return write_at(run, run->parameters.quality, path, error);
}

const struct lumi_stage lumi_stage_compress = {
    .name = "compress",
    .title = "compress",
    .version = 2,
    .extension = ".lumi",
    .whole = true,
    .set = LUMI_SET_KEPT,
    .serial = true,
    .key = key,
    .make = make,
};
