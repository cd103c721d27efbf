/* damage_field FOLDER: writes FOLDER/whole.lumi, a small field, and copies of it damaged here and there. */
#include "field_damage.h"
#include "synthetic_field.h"

#include "proto/base/file.h"

static int failed;

static void write_copy(void *context, const char *name, const uint8_t *data, size_t size, bool mended)
{
    struct lumi_error error = {0};
    char path[512];

    (void)mended;
    if (strstr(name, "-full"))
        return;
    snprintf(path, sizeof path, "%s/%s.lumi", (const char *)context, name);
    if (lumi_file_write(path, data, size, false, &error) != LUMI_OK) {
        fprintf(stderr, "%s\n", error.text);
        failed = 1;
    }
}

int main(int argc, char **argv)
{
    static const struct synthetic_options small = {2, 130, 70, 2, 30, 2, 0};
    struct lumi_error error = {0};
    struct lumi_writer file;

    if (argc != 2) {
        fprintf(stderr, "usage: %s FOLDER\n", argv[0]);
        return 2;
    }
    lumi_writer_init(&file);
    if (synthetic_field_bytes(&small, &file, &error) != LUMI_OK) {
        fprintf(stderr, "%s\n", error.text);
        return 1;
    }
    const struct damage damage = {file.data, file.size, write_copy, argv[1]};
    write_copy(argv[1], "whole", file.data, file.size, false);
    damage_everywhere(&damage, 43, 2);
    lumi_writer_finish(&file);
    return failed;
}
