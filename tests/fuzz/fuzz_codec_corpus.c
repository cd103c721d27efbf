/* Writes the seeds of fuzz_field and fuzz_tile: small fields, and tiles as the encoder makes them. */
#include "synthetic_field.h"

#include "proto/base/file.h"

#include <sys/stat.h>

static int fail(const struct lumi_error *error)
{
    fprintf(stderr, "%s\n", error->text);
    return 1;
}

/* A mesh of the compact kind: two triangles a tile, corners first, in order. */
static int compact_mesh(void *context, int index, int view, struct lumi_writer *bytes, struct lumi_error *error)
{
    static const struct lumi_mesh_vertex vertices[4] = {{0, 0, 0}, {255, 0, 9}, {0, 255, 9}, {255, 255, 20}};
    static const uint16_t indices[6] = {0, 1, 3, 0, 3, 2};
    const struct synthetic_field *field = context;
    const struct lumi_grid *grid = &field->levels[index].grid;
    struct lumi_tile_mesh tiles[4];
    const struct lumi_view_mesh mesh = {0.4f, 0.1f / 16384, grid->cols, grid->rows, tiles, NULL};

    if (grid->cols * grid->rows > 4)
        return lumi_fail(error, LUMI_ERR_ARG, "a mesh of at most 4 tiles");
    for (int i = 0; i < grid->cols * grid->rows; i++)
        tiles[i] = (struct lumi_tile_mesh){16384, 0, 4, 2, vertices, indices};
    if (view % 2 == 0) /* the others have no geometry */
        lumi_view_mesh_encode(&mesh, bytes);
    return LUMI_OK;
}

static int field_bytes(const struct synthetic_options *options, struct lumi_writer *bytes, struct lumi_error *error)
{
    struct lumi_field_content content;
    struct synthetic_field *field = NULL;
    int code = synthetic_field_create(options, &field, error);

    if (code == LUMI_OK) {
        synthetic_field_content(field, &content);
        if (options->width <= 128)
            content.mesh = compact_mesh;
        code = lumi_field_write_memory(&content, bytes, error);
    }
    if (field)
        synthetic_field_finish(field);
    return code;
}

static int write_field(const char *folder, const char *name, const struct synthetic_options *options,
                       struct lumi_error *error)
{
    struct lumi_writer bytes;
    char path[512];

    lumi_writer_init(&bytes);
    snprintf(path, sizeof path, "%s/fuzz_field/%s", folder, name);
    int code = field_bytes(options, &bytes, error);
    if (code == LUMI_OK)
        code = lumi_file_write(path, bytes.data, bytes.size, false, error);
    lumi_writer_finish(&bytes);
    return code;
}

static int write_tiles(const char *folder, const char *name, const struct synthetic_options *options,
                       struct lumi_error *error)
{
    struct synthetic_field *field = NULL;
    struct lumi_writer bytes;
    char path[512];

    lumi_writer_init(&bytes);
    snprintf(path, sizeof path, "%s/fuzz_tile/%s", folder, name);
    int code = synthetic_field_create(options, &field, error);
    if (code == LUMI_OK) {
        lumi_priming_write(lumi_tile_encoder_priming(field->levels[1].encoder), &bytes);
        code = synthetic_cluster(field, LUMI_LEVEL_FINE, 0, &bytes, error);
    }
    if (code == LUMI_OK)
        code = lumi_file_write(path, bytes.data, bytes.size, false, error);
    if (field)
        synthetic_field_finish(field);
    lumi_writer_finish(&bytes);
    return code;
}

int main(int argc, char **argv)
{
    /* Side, size, cluster, quantizer, training, error-resilient. */
    static const struct synthetic_options plain = {2, 66, 64, 2, 40, 1, 0}, fine = {2, 64, 60, 4, 12, 0, 0};
    static const struct synthetic_options resilient = {2, 64, 64, 3, 50, 0, 1}, single = {1, 64, 64, 1, 40, 0, 0};
    static const struct synthetic_options many = {2, 128, 68, 1, 63, 0, 0}, large = {2, 130, 66, 2, 60, 2, 0};
    struct lumi_error error = {0};
    char path[512];

    if (argc != 2) {
        fprintf(stderr, "usage: %s FOLDER\n", argv[0]);
        return 2;
    }
    snprintf(path, sizeof path, "%s/fuzz_field", argv[1]);
    mkdir(path, 0777);
    snprintf(path, sizeof path, "%s/fuzz_tile", argv[1]);
    mkdir(path, 0777);
    if (write_field(argv[1], "plain", &plain, &error) || write_field(argv[1], "fine", &fine, &error) ||
        write_field(argv[1], "resilient", &resilient, &error) || write_field(argv[1], "single", &single, &error) ||
        write_field(argv[1], "many", &many, &error) || write_field(argv[1], "large", &large, &error) ||
        write_tiles(argv[1], "plain", &plain, &error) || write_tiles(argv[1], "fine", &fine, &error) ||
        write_tiles(argv[1], "resilient", &resilient, &error))
        return fail(&error);
    return 0;
}
