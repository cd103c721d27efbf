/* A small field in memory: views of a textured wall two metres away, from a grid of cameras 2 cm apart. */
#ifndef LUMI_TESTS_SYNTHETIC_FIELD_H
#define LUMI_TESTS_SYNTHETIC_FIELD_H

#include "proto/base/memory.h"
#include "proto/lightfield/cluster_code.h"
#include "proto/lightfield/field_write.h"
#include "proto/lightfield/training.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { SYNTHETIC_SIDE_MAX = 8, SYNTHETIC_VIEWS_MAX = SYNTHETIC_SIDE_MAX * SYNTHETIC_SIDE_MAX };
#define SYNTHETIC_DEPTH 2.0
#define SYNTHETIC_SPACING 0.02

struct synthetic_options {
    int side;          /* side × side views */
    int width, height; /* of the fine level; the coarse one has half, and every view */
    int cluster_size;
    int quantizer; /* 0..63 */
    int training;  /* tiles */
    int error_resilient;
};

static const struct synthetic_options synthetic_defaults = {3, 160, 130, 5, 20, 8, 0};

struct synthetic_level {
    struct lumi_grid grid;
    int count, cluster_count;
    struct lumi_yuv images[SYNTHETIC_VIEWS_MAX], references[SYNTHETIC_VIEWS_MAX];
    struct lumi_field_view views[SYNTHETIC_VIEWS_MAX];
    int first[SYNTHETIC_VIEWS_MAX + 1], members[SYNTHETIC_VIEWS_MAX];
    struct lumi_training_tile *training;
    struct lumi_tile_encoder *encoder;
};

struct synthetic_field {
    struct synthetic_options options;
    struct lumi_grid grids[LUMI_LEVELS];
    struct synthetic_level levels[LUMI_LEVELS];
};

/* The wall's colour at a place in metres, a few waves and a checkerboard; linear light. */
static inline void synthetic_wall(double x, double y, float rgb[3])
{
    double checks = (fmod(floor(x * 9) + floor(y * 9), 2) != 0) ? 0.2 : 0;

    rgb[0] = (float)(0.4 + 0.2 * sin(7 * x + 3 * y) + 0.1 * sin(41 * x) + checks);
    rgb[1] = (float)(0.4 + 0.2 * sin(5 * y - 2 * x) + 0.1 * sin(37 * y) + checks);
    rgb[2] = (float)(0.3 + 0.2 * sin(4 * x + 6 * y) + checks);
}

static inline int synthetic_image(const struct lumi_grid *grid, const struct lumi_pose *pose, struct lumi_yuv *image)
{
    struct lumi_raster raster;

    LUMI_TRY(lumi_raster_create(&raster, grid->width, grid->height, 3, LUMI_F32));
    for (int y = 0; y < grid->height; y++)
        for (int x = 0; x < grid->width; x++) {
            double tan_x, tan_y;
            lumi_grid_unproject(grid, x + 0.5, y + 0.5, &tan_x, &tan_y);
            synthetic_wall(pose->t.x + SYNTHETIC_DEPTH * tan_x, pose->t.y + SYNTHETIC_DEPTH * tan_y,
                           lumi_row_f32(&raster, y) + 3 * x);
        }
    int code = lumi_yuv_from_raster(&raster, image);
    lumi_raster_finish(&raster);
    return code;
}

static inline int synthetic_level_init(struct synthetic_field *field, int index, struct lumi_error *error)
{
    const struct synthetic_options *options = &field->options;
    struct synthetic_level *level = &field->levels[index];
    int half = index == LUMI_LEVEL_COARSE ? 2 : 1, trained = 0;
    int width = (options->width + half - 1) / half, height = (options->height + half - 1) / half;
    const struct lumi_tile_encoder_settings settings = {options->quantizer, 4, options->error_resilient};

    lumi_grid_init_pinhole(&level->grid, width, height, 0.9 * width, 0.9 * width, width / 2.0, height / 2.0);
    field->grids[index] = level->grid;
    level->count = options->side * options->side;
    level->cluster_count = (level->count + options->cluster_size - 1) / options->cluster_size;
    for (int i = 0; i < level->count; i++) {
        struct lumi_field_view *view = &level->views[i];
        int column = i % options->side, row = i / options->side;
        snprintf(view->name, sizeof view->name, "r%02dc%02d", row, column);
        view->grid = index;
        view->pose =
            (struct lumi_pose){{1, 0, 0, 0, 1, 0, 0, 0, 1}, {column * SYNTHETIC_SPACING, row * SYNTHETIC_SPACING, 0}};
        view->disk = (struct lumi_disk){SYNTHETIC_SPACING, SYNTHETIC_SPACING, SYNTHETIC_SPACING, SYNTHETIC_SPACING};
        level->members[i] = i;
        LUMI_TRY(synthetic_image(&level->grid, &view->pose, &level->images[i]));
    }
    for (int i = 0; i <= level->cluster_count; i++)
        level->first[i] = i * options->cluster_size < level->count ? i * options->cluster_size : level->count;

    /* References as a reader gets them. */
    struct lumi_yuv sources[LUMI_REFERENCE_RUN];
    for (int run = 0; run < level->cluster_count; run += LUMI_REFERENCE_RUN) {
        struct lumi_writer bytes;
        uint32_t sizes[LUMI_REFERENCE_RUN];
        int count = 0;
        for (; count < LUMI_REFERENCE_RUN && run + count < level->cluster_count; count++)
            sources[count] = level->images[level->members[level->first[run + count]]];
        lumi_writer_init(&bytes);
        LUMI_TRY(lumi_references_encode(sources, count, options->quantizer / 3, 4, sizes, &bytes, error));
        LUMI_TRY(lumi_references_decode(bytes.data, sizes, count, width, height, level->references + run));
        lumi_writer_finish(&bytes);
    }
    level->training = lumi_calloc((size_t)options->training + 1, sizeof *level->training);
    if (!level->training)
        return LUMI_ERR_NOMEM;
    if (level->first[1] > 1 && options->training > 0) {
        LUMI_TRY(lumi_training_pick(&level->images[level->members[1]], 0, &level->references[0], NULL, 8,
                                    options->training, 1, level->training, error));
        trained = options->training;
    }
    return lumi_tile_encoder_create(&settings, level->training, trained, level->references, &level->encoder, error);
}

/* A rectangle a tile, on the wall. */
static inline int synthetic_mesh(void *context, int index, int view, struct lumi_writer *bytes,
                                 struct lumi_error *error)
{
    static const struct lumi_mesh_vertex vertices[4] = {{0, 0, 0}, {255, 0, 0}, {255, 255, 0}, {0, 255, 0}};
    static const uint16_t indices[6] = {0, 1, 2, 0, 2, 3};
    const struct synthetic_field *field = context;
    const struct lumi_grid *grid = &field->levels[index].grid;
    struct lumi_view_mesh mesh = {.w_min = 0.4f, .w_step = 0.1f / 16384, .cols = grid->cols, .rows = grid->rows};

    (void)view;
    mesh.tiles = lumi_calloc((size_t)(grid->cols * grid->rows), sizeof *mesh.tiles);
    if (!mesh.tiles)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a mesh");
    for (int i = 0; i < grid->cols * grid->rows; i++)
        mesh.tiles[i] = (struct lumi_tile_mesh){16384, 0, 4, 2, vertices, indices};
    lumi_view_mesh_encode(&mesh, bytes);
    lumi_free(mesh.tiles);
    return LUMI_OK;
}

static inline int synthetic_references(void *context, int index, int run, uint32_t *sizes, struct lumi_writer *bytes,
                                       struct lumi_error *error)
{
    const struct synthetic_field *field = context;
    const struct synthetic_level *level = &field->levels[index];
    struct lumi_yuv sources[LUMI_REFERENCE_RUN];
    int first = run * LUMI_REFERENCE_RUN, count = 0;

    for (; count < LUMI_REFERENCE_RUN && first + count < level->cluster_count; count++)
        sources[count] = level->images[level->members[level->first[first + count]]];
    return lumi_references_encode(sources, count, field->options.quantizer / 3, 4, sizes, bytes, error);
}

static inline int synthetic_cluster(void *context, int index, int cluster, struct lumi_writer *bytes,
                                    struct lumi_error *error)
{
    const struct synthetic_field *field = context;
    const struct synthetic_level *level = &field->levels[index];
    struct lumi_tile_encoder *encoder;
    const struct lumi_tile_encoder_settings settings = {field->options.quantizer, 4, field->options.error_resilient};
    int trained = level->first[1] > 1 ? field->options.training : 0, code = LUMI_OK;

    /* An encoder of its own each time: what is asked for twice must be the same twice. */
    LUMI_TRY(lumi_tile_encoder_create(&settings, level->training, trained, level->references, &encoder, error));
    for (int i = level->first[cluster] + 1; code == LUMI_OK && i < level->first[cluster + 1]; i++)
        code = lumi_cluster_encode_image(encoder, &level->references[cluster], &level->images[level->members[i]], NULL,
                                         8, bytes, NULL, error);
    lumi_tile_encoder_destroy(encoder);
    return code;
}

static inline void synthetic_field_finish(struct synthetic_field *field)
{
    for (int i = 0; i < LUMI_LEVELS; i++) {
        struct synthetic_level *level = &field->levels[i];
        for (int k = 0; k < level->count; k++) {
            lumi_yuv_finish(&level->images[k]);
            lumi_yuv_finish(&level->references[k]);
        }
        lumi_tile_encoder_destroy(level->encoder);
        lumi_free(level->training);
    }
    lumi_free(field);
}

static inline int synthetic_field_create(const struct synthetic_options *options, struct synthetic_field **field,
                                         struct lumi_error *error)
{
    *field = lumi_calloc(1, sizeof **field);
    if (!*field)
        return LUMI_ERR_NOMEM;
    (*field)->options = *options;
    for (int i = 0; i < LUMI_LEVELS; i++)
        LUMI_TRY(synthetic_level_init(*field, i, error));
    return LUMI_OK;
}

static inline void synthetic_field_content(struct synthetic_field *field, struct lumi_field_content *content)
{
    *content = (struct lumi_field_content){.surface = LUMI_SURFACE_PLANE,
                                           .radius = SYNTHETIC_SPACING * field->options.side,
                                           .quality = 70,
                                           .grid_count = LUMI_LEVELS,
                                           .grids = field->grids,
                                           .context = field,
                                           .mesh = synthetic_mesh,
                                           .references = synthetic_references,
                                           .cluster = synthetic_cluster};
    for (int i = 0; i < LUMI_LEVELS; i++) {
        struct synthetic_level *level = &field->levels[i];
        content->levels[i] = (struct lumi_field_level_content){.view_count = level->count,
                                                               .views = level->views,
                                                               .cluster_count = level->cluster_count,
                                                               .first = level->first,
                                                               .members = level->members,
                                                               .priming = lumi_tile_encoder_priming(level->encoder)};
    }
}

/* The bytes of a .lumi file, appended to `bytes` (initialized by the caller). */
static inline int synthetic_field_bytes(const struct synthetic_options *options, struct lumi_writer *bytes,
                                        struct lumi_error *error)
{
    struct lumi_field_content content;
    struct synthetic_field *field;
    int code = synthetic_field_create(options, &field, error);

    if (code == LUMI_OK) {
        synthetic_field_content(field, &content);
        code = lumi_field_write_memory(&content, bytes, error);
    }
    if (field)
        synthetic_field_finish(field);
    return code;
}

#endif
