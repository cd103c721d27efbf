/* Coding the images of one level. */
#include "pipeline/compress/level.h"

#include "pipeline/compress/reference_filter.h"
#include "pipeline/run/key.h"
#include "proto/base/file.h"
#include "proto/base/memory.h"
#include "proto/base/parallel.h"
#include "proto/lightfield/cluster_code.h"
#include "proto/lightfield/reference_code.h"

#include <errno.h>
#include <glib.h>
#include <glib/gstdio.h>
#include <pthread.h>
#include <string.h>
#include <unistd.h>

enum { PIECES_VERSION = 2 }; /* raise it when the same inputs give other bytes */

void compress_quality_init(struct compress_quality *quality, int value)
{
    const int coarseness = 100 - CLAMP(value, 0, 100);
    /* Steps of four fifths as far as 48, which is coarse already, then smaller ones, so that each end is an end. */
    const int quantizer = coarseness <= 60 ? coarseness * 4 / 5 : 48 + (coarseness - 60) * 15 / 40;

    *quality = (struct compress_quality){.tile_quantizer = quantizer,
                                         .reference_quantizer = quantizer / 3,
                                         .speed = 2,
                                         .range = 16,
                                         .own_weight = lumi_filter_own_weight(quantizer)};
}

int compress_level_init(struct compress_level *level, struct lumi_run *run, int index, int quality,
                        struct lumi_error *error)
{
    *level = (struct compress_level){.run = run, .index = index, .grid = run->grid};
    compress_quality_init(&level->quality, quality);

    struct lumi_pose *poses = lumi_alloc((size_t)run->kept_count, sizeof *poses);
    if (!poses)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for the views of a level");
    for (int i = 0; i < run->kept_count; i++)
        poses[i] = run->sources[run->kept[i]].pose;
    if (index == LUMI_LEVEL_COARSE) {
        int code = lumi_coarse_views(run->kept_count, poses, &level->sources, &level->count, error);
        for (int i = 0; code == LUMI_OK && i < level->count; i++)
            level->sources[i] = run->kept[level->sources[i]];
        lumi_free(poses);
        LUMI_TRY(code);
        if (!lumi_grid_init_half(&level->grid, &run->grid))
            return lumi_fail(error, LUMI_ERR_INTERNAL, "the views cannot be halved");
        LUMI_TRY(lumi_warp_create_half(&run->grid, &level->grid, &level->half, error));
        poses = lumi_alloc((size_t)level->count, sizeof *poses);
    } else {
        level->count = run->kept_count;
        level->sources = lumi_alloc((size_t)run->kept_count, sizeof *level->sources);
        for (int i = 0; level->sources && i < run->kept_count; i++)
            level->sources[i] = run->kept[i];
    }
    level->poses = poses;
    if (!poses || !level->sources)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for the views of a level");
    for (int i = 0; i < level->count; i++)
        poses[i] = run->sources[level->sources[i]].pose;
    LUMI_TRY(lumi_clusters_make(level->count, level->poses, run->parameters.cluster_size, &level->clusters, error));
    level->references = lumi_calloc((size_t)level->clusters.count, sizeof *level->references);
    if (!level->references)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for reference images");
    return LUMI_OK;
}

void compress_level_finish(struct compress_level *level)
{
    for (int i = 0; level->references && i < level->clusters.count; i++)
        lumi_yuv_finish(&level->references[i]);
    lumi_tile_encoder_destroy(level->encoder);
    lumi_warp_destroy(level->half);
    lumi_clusters_finish(&level->clusters);
    lumi_free(level->references);
    lumi_free(level->training);
    lumi_free(level->sources);
    lumi_free(level->poses);
    *level = (struct compress_level){0};
}

static char *piece_path(const struct compress_level *level, const char *kind, int number, const char *extension)
{
    g_autofree char *all = lumi_run_path(level->run, "compress", -1, "");
    g_autofree char *folder = g_path_get_dirname(all);

    return g_strdup_printf("%s/%s%s-%s-%04d%s", folder, level->sample ? "sample-" : "",
                           level->index == LUMI_LEVEL_COARSE ? "coarse" : "fine", kind, number, extension);
}

static int reference_view(const struct compress_level *level, int cluster)
{
    return level->clusters.members[level->clusters.first[cluster]];
}

/* The clusters of a run of reference images: [*first, returned value). */
static int run_clusters(const struct compress_level *level, int run, int *first)
{
    *first = run * LUMI_REFERENCE_RUN;
    return MIN(*first + LUMI_REFERENCE_RUN, level->clusters.count);
}

static int run_count(const struct compress_level *level)
{
    return (level->clusters.count + LUMI_REFERENCE_RUN - 1) / LUMI_REFERENCE_RUN;
}

static void begin_key(const struct compress_level *level, const char *kind, struct lumi_key *key)
{
    lumi_key_init(key, kind, PIECES_VERSION);
    lumi_key_int(key, level->index);
    lumi_key_bytes(key, &level->quality, sizeof level->quality);
    lumi_key_bytes(key, &level->grid, sizeof level->grid);
}

enum { FILTER_VIEWS = 12 }; /* twice as many would save 2 % more */

/* The views of a level nearest a cluster's reference view, which it is filtered with; returns their number. Not only
 * the cluster's: what is coded is then the same when a cluster is thinned for a sample. */
static int nearest_views(const struct compress_level *level, int cluster, int nearest[FILTER_VIEWS])
{
    const int reference = reference_view(level, cluster);
    double distances[FILTER_VIEWS];
    int count = 0;

    for (int view = 0; view < level->count && level->quality.own_weight > 0; view++) {
        struct lumi_vec3 between = lumi_sub(level->poses[view].t, level->poses[reference].t);
        double distance = lumi_dot(between, between);
        int at = count;
        if (view == reference)
            continue;
        for (; at > 0 && distances[at - 1] > distance; at--)
            if (at < FILTER_VIEWS)
                distances[at] = distances[at - 1], nearest[at] = nearest[at - 1];
        if (at < FILTER_VIEWS)
            distances[at] = distance, nearest[at] = view;
        count = MIN(count + 1, FILTER_VIEWS);
    }
    return count;
}

static void key_view(const struct compress_level *level, int view, struct lumi_key *key)
{
    lumi_key_bytes(key, &level->poses[view], sizeof *level->poses);
    lumi_key_view(key, level->run, level->sources[view], LUMI_VIEW_FINAL);
    lumi_key_view(key, level->run, level->sources[view], LUMI_VIEW_DEPTH);
}

static void run_key(const struct compress_level *level, int run, char hex[LUMI_KEY_HEX])
{
    struct lumi_key key;
    int first, last = run_clusters(level, run, &first);

    begin_key(level, "compress-references", &key);
    for (int i = first; i < last; i++) {
        int nearest[FILTER_VIEWS], count = nearest_views(level, i, nearest);
        key_view(level, reference_view(level, i), &key);
        for (int k = 0; k < count; k++)
            key_view(level, nearest[k], &key);
    }
    lumi_key_hex(&key, hex);
}

/* Names all that a cluster's bytes depend on; the priming stands for the training. */
static int cluster_key(const struct compress_level *level, int cluster, char hex[LUMI_KEY_HEX])
{
    const struct lumi_clusters *clusters = &level->clusters;
    struct lumi_writer priming;
    char references[LUMI_KEY_HEX];
    struct lumi_key key;

    lumi_writer_init(&priming);
    lumi_priming_write(lumi_tile_encoder_priming(level->encoder), &priming);
    begin_key(level, "compress-cluster", &key);
    lumi_key_bytes(&key, priming.data, priming.size);
    int code = priming.failed ? LUMI_ERR_NOMEM : LUMI_OK;
    lumi_writer_finish(&priming);
    run_key(level, cluster / LUMI_REFERENCE_RUN, references);
    lumi_key_bytes(&key, references, sizeof references);
    for (int i = clusters->first[cluster]; i < clusters->first[cluster + 1]; i++)
        key_view(level, clusters->members[i], &key);
    lumi_key_hex(&key, hex);
    return code;
}

/* Whether a piece with this key is there. */
static bool piece_there(const struct compress_level *level, const char *kind, int number, const char *hex)
{
    g_autofree char *path = piece_path(level, kind, number, ".key");
    char there[LUMI_KEY_HEX];

    return lumi_key_load(path, there) && strcmp(there, hex) == 0;
}

static int piece_save(const struct compress_level *level, const char *kind, int number, const char *hex,
                      const struct lumi_writer *bytes, struct lumi_error *error)
{
    g_autofree char *path = piece_path(level, kind, number, ".bin");
    g_autofree char *key = piece_path(level, kind, number, ".key");

    if (bytes->failed)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: no memory for it", path);
    /* The old key goes first, so that it never stands beside new bytes. */
    if (unlink(key) && errno != ENOENT)
        return lumi_fail_errno(error, key, "remove");
    LUMI_TRY(lumi_file_write(path, bytes->data, bytes->size, false, error));
    return lumi_key_save(key, path, hex, error);
}

static int piece_load(const struct compress_level *level, const char *kind, int number, uint8_t **data, size_t *size,
                      struct lumi_error *error)
{
    g_autofree char *path = piece_path(level, kind, number, ".bin");

    return lumi_file_read(path, (size_t)1 << 32, data, size, error);
}

/* The picture of a cluster's reference view, filtered as the quality asks. */
static int reference_image(const struct compress_level *level, int cluster, struct lumi_yuv *image,
                           struct lumi_error *error)
{
    const int reference = reference_view(level, cluster);
    struct lumi_filter_view others[FILTER_VIEWS] = {0};
    struct lumi_yuv images[FILTER_VIEWS] = {0}, filtered;
    struct lumi_shift *seeds[FILTER_VIEWS] = {0};
    int nearest[FILTER_VIEWS], code;

    LUMI_TRY(compress_view_image(level, reference, image, error));
    int count = nearest_views(level, cluster, nearest);
    if (count == 0)
        return LUMI_OK;
    for (int i = 0; i < count; i++) {
        LUMI_GOTO(code, done, compress_view_image(level, nearest[i], &images[i], error));
        LUMI_GOTO(code, done, compress_view_seeds(level, reference, nearest[i], &seeds[i], error));
        others[i] = (struct lumi_filter_view){&images[i], seeds[i]};
    }
    code =
        lumi_reference_filter(image, others, count, level->quality.range, level->quality.own_weight, &filtered, error);
    if (code == LUMI_OK) {
        lumi_yuv_finish(image);
        *image = filtered;
    }
done:
    for (int i = 0; i < count; i++) {
        lumi_yuv_finish(&images[i]);
        lumi_free(seeds[i]);
    }
    return code;
}

/* One reference run: the number of frames' sizes, then the frames. */
static int encode_run(struct compress_level *level, int run, struct lumi_writer *bytes, struct lumi_error *error)
{
    struct lumi_yuv images[LUMI_REFERENCE_RUN] = {0};
    uint32_t sizes[LUMI_REFERENCE_RUN];
    struct lumi_writer frames;
    int first, count = run_clusters(level, run, &first) - first, code = LUMI_OK;

    lumi_writer_init(&frames);
    for (int i = 0; code == LUMI_OK && i < count; i++)
        code = reference_image(level, first + i, &images[i], error);
    if (code == LUMI_OK)
        code = lumi_references_encode(images, count, level->quality.reference_quantizer, level->quality.speed, sizes,
                                      &frames, error);
    for (int i = 0; code == LUMI_OK && i < count; i++)
        lumi_write_u32(bytes, sizes[i]);
    lumi_write_bytes(bytes, frames.data, code == LUMI_OK ? frames.size : 0);
    lumi_writer_finish(&frames);
    for (int i = 0; i < count; i++)
        lumi_yuv_finish(&images[i]);
    return code;
}

int compress_level_references(const struct compress_level *level, int run, uint32_t *sizes, struct lumi_writer *bytes,
                              struct lumi_error *error)
{
    int first, count = run_clusters(level, run, &first) - first;
    struct lumi_reader reader;
    size_t size, total = 0;
    uint8_t *data;

    LUMI_TRY(piece_load(level, "references", run, &data, &size, error));
    lumi_reader_init(&reader, data, size);
    for (int i = 0; i < count; i++) {
        sizes[i] = lumi_read_u32(&reader);
        total += sizes[i];
    }
    int code = reader.failed || total != lumi_reader_left(&reader)
                   ? lumi_fail(error, LUMI_ERR_FORMAT, "%s: its coded reference images are damaged", level->run->work)
                   : LUMI_OK;
    if (code == LUMI_OK)
        lumi_write_bytes(bytes, data + reader.at, total);
    lumi_free(data);
    return code;
}

int compress_level_cluster(const struct compress_level *level, int cluster, struct lumi_writer *bytes,
                           struct lumi_error *error)
{
    size_t size;
    uint8_t *data;

    LUMI_TRY(piece_load(level, "cluster", cluster, &data, &size, error));
    lumi_write_bytes(bytes, data, size);
    lumi_free(data);
    return LUMI_OK;
}

static int piece_bytes(const struct compress_level *level, const char *kind, int number, double *bytes,
                       struct lumi_error *error)
{
    g_autofree char *path = piece_path(level, kind, number, ".bin");
    GStatBuf status;

    if (g_stat(path, &status))
        return lumi_fail_errno(error, path, "examine");
    *bytes += (double)status.st_size;
    return LUMI_OK;
}

int compress_level_bytes(const struct compress_level *level, double *references, double *clusters,
                         struct lumi_error *error)
{
    *references = *clusters = 0;
    for (int i = 0; i < run_count(level); i++)
        LUMI_TRY(piece_bytes(level, "references", i, references, error));
    for (int i = 0; i < level->clusters.count; i++)
        LUMI_TRY(piece_bytes(level, "cluster", i, clusters, error));
    return LUMI_OK;
}

/* The work of several threads, whose first error (by item) counts. */
struct work {
    struct compress_level *level;
    pthread_mutex_t lock; /* guards what follows, and level->done */
    int failed_item;
    struct lumi_error *error;
};

static int note(struct work *work, int item, int code, const struct lumi_error *error)
{
    struct compress_level *level = work->level;

    pthread_mutex_lock(&work->lock);
    if (code != LUMI_OK && item < work->failed_item) {
        work->failed_item = item;
        if (work->error)
            *work->error = *error;
    }
    level->done++;
    if (code == LUMI_OK && level->run->progress)
        level->run->progress(level->index == LUMI_LEVEL_COARSE ? "compress coarse" : "compress", level->done,
                             level->total);
    pthread_mutex_unlock(&work->lock);
    return code;
}

static int for_each(struct compress_level *level, int count, lumi_parallel_fn fn, struct lumi_error *error)
{
    struct work work = {.level = level, .failed_item = G_MAXINT, .error = error};

    pthread_mutex_init(&work.lock, NULL);
    int code = lumi_parallel_for(count, level->run->threads, fn, &work);
    pthread_mutex_destroy(&work.lock);
    return code;
}

static int code_run(struct compress_level *level, int run, struct lumi_error *error)
{
    uint32_t sizes[LUMI_REFERENCE_RUN];
    struct lumi_writer bytes;
    char hex[LUMI_KEY_HEX];
    int first, count = run_clusters(level, run, &first) - first, code = LUMI_OK;

    run_key(level, run, hex);
    lumi_writer_init(&bytes);
    if (!piece_there(level, "references", run, hex)) {
        code = encode_run(level, run, &bytes, error);
        if (code == LUMI_OK)
            code = piece_save(level, "references", run, hex, &bytes, error);
        lumi_writer_finish(&bytes);
        lumi_writer_init(&bytes);
    }
    if (code == LUMI_OK)
        code = compress_level_references(level, run, sizes, &bytes, error);
    if (code == LUMI_OK && lumi_references_decode(bytes.data, sizes, count, level->grid.width, level->grid.height,
                                                  level->references + first) != LUMI_OK)
        code = lumi_fail(error, LUMI_ERR_INTERNAL, "libvpx does not decode its own reference images");
    lumi_writer_finish(&bytes);
    return code;
}

static int run_item(void *context, int run, int thread)
{
    struct work *work = context;
    struct lumi_error error = {0};

    (void)thread;
    return note(work, run, code_run(work->level, run, &error), &error);
}

/* Training tiles, from images spread over the level. */
static int train(struct compress_level *level, struct lumi_error *error)
{
    const struct lumi_clusters *clusters = &level->clusters;
    int coded = clusters->first[clusters->count] - clusters->count, images = MIN(coded, LUMI_TRAINING_IMAGES);
    long all = level->count - (level->sample ? 0 : clusters->count); /* a sample is trained as the whole is */
    int wanted = coded ? lumi_training_count(all * level->grid.cols * level->grid.rows) : 0, code = LUMI_OK;

    level->training = lumi_alloc((size_t)wanted + 1, sizeof *level->training);
    if (!level->training)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for training tiles");
    for (int i = 0; code == LUMI_OK && i < images; i++) {
        /* The (i · coded / images)-th view that is no reference image. */
        int number = (int)((long)i * coded / images), cluster = 0;
        while (number >= clusters->first[cluster + 1] - clusters->first[cluster] - 1)
            number -= clusters->first[cluster + 1] - clusters->first[cluster] - 1, cluster++;
        int view = clusters->members[clusters->first[cluster] + 1 + number];
        int count = wanted * (i + 1) / images - level->training_count;
        struct lumi_shift *seeds = NULL;
        struct lumi_yuv image = {0};
        if (count > 0)
            code = compress_view_image(level, view, &image, error);
        if (count > 0 && code == LUMI_OK)
            code = compress_view_seeds(level, view, reference_view(level, cluster), &seeds, error);
        if (count > 0 && code == LUMI_OK)
            code = lumi_training_pick(&image, cluster, &level->references[cluster], seeds, level->quality.range, count,
                                      (uint64_t)i + 1, level->training + level->training_count, error);
        level->training_count += count;
        lumi_yuv_finish(&image);
        lumi_free(seeds);
    }
    return code;
}

static int make_encoder(const struct compress_level *level, struct lumi_tile_encoder **encoder,
                        struct lumi_error *error)
{
    const struct lumi_tile_encoder_settings settings = {.quantizer = level->quality.tile_quantizer,
                                                        .speed = level->quality.speed};

    LUMI_TRY(
        lumi_tile_encoder_create(&settings, level->training, level->training_count, level->references, encoder, error));
    if (level->encoder &&
        !lumi_priming_equal(lumi_tile_encoder_priming(*encoder), lumi_tile_encoder_priming(level->encoder))) {
        lumi_tile_encoder_destroy(*encoder);
        return lumi_fail(error, LUMI_ERR_INTERNAL, "libvpx encodes the same tiles in different ways");
    }
    return LUMI_OK;
}

static int encode_cluster(const struct compress_level *level, int cluster, struct lumi_writer *bytes,
                          struct lumi_error *error)
{
    const struct lumi_clusters *clusters = &level->clusters;
    struct lumi_tile_encoder *encoder;
    int code = LUMI_OK;

    LUMI_TRY(make_encoder(level, &encoder, error));
    for (int i = clusters->first[cluster] + 1; code == LUMI_OK && i < clusters->first[cluster + 1]; i++) {
        struct lumi_shift *seeds = NULL;
        struct lumi_yuv image;
        int view = clusters->members[i];
        code = compress_view_image(level, view, &image, error);
        if (code == LUMI_OK)
            code = compress_view_seeds(level, view, reference_view(level, cluster), &seeds, error);
        if (code == LUMI_OK)
            code = lumi_cluster_encode_image(encoder, &level->references[cluster], &image, seeds, level->quality.range,
                                             bytes, NULL, error);
        lumi_yuv_finish(&image);
        lumi_free(seeds);
    }
    lumi_tile_encoder_destroy(encoder);
    return code;
}

static int code_cluster(struct compress_level *level, int cluster, struct lumi_error *error)
{
    struct lumi_writer bytes;
    char hex[LUMI_KEY_HEX];

    if (cluster_key(level, cluster, hex) != LUMI_OK)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a key");
    if (piece_there(level, "cluster", cluster, hex))
        return LUMI_OK;
    lumi_writer_init(&bytes);
    int code = encode_cluster(level, cluster, &bytes, error);
    if (code == LUMI_OK)
        code = piece_save(level, "cluster", cluster, hex, &bytes, error);
    lumi_writer_finish(&bytes);
    return code;
}

static int cluster_item(void *context, int cluster, int thread)
{
    struct work *work = context;
    struct lumi_error error = {0};

    (void)thread;
    return note(work, cluster, code_cluster(work->level, cluster, &error), &error);
}

int compress_level_code(struct compress_level *level, struct lumi_error *error)
{
    level->total = run_count(level) + level->clusters.count;
    LUMI_TRY(for_each(level, run_count(level), run_item, error));
    LUMI_TRY(train(level, error));
    LUMI_TRY(make_encoder(level, &level->encoder, error));
    return for_each(level, level->clusters.count, cluster_item, error);
}
