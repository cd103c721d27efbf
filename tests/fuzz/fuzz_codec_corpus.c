/* Writes the seeds of fuzz_field and fuzz_tile: small fields, and tiles as the encoder makes them. */
#include "synthetic_field.h"

#include "proto/base/file.h"

#include <sys/stat.h>

static int fail(const struct lumi_error *error)
{
    fprintf(stderr, "%s\n", error->text);
    return 1;
}

static int write_field(const char *folder, const char *name, const struct synthetic_options *options,
                       struct lumi_error *error)
{
    struct lumi_writer bytes;
    char path[512];

    lumi_writer_init(&bytes);
    snprintf(path, sizeof path, "%s/fuzz_field/%s", folder, name);
    int code = synthetic_field_bytes(options, &bytes, error);
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
        write_tiles(argv[1], "plain", &plain, &error) || write_tiles(argv[1], "fine", &fine, &error) ||
        write_tiles(argv[1], "resilient", &resilient, &error))
        return fail(&error);
    return 0;
}
