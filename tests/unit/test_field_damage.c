/* Damaged fields, byte class by byte class: an error, or pictures with tiles missing; never more memory than the header
 * allows. Checksums that were mended by hand let the damage through to where it is believed. */
#include "field_damage.h"
#include "synthetic_field.h"

#include "proto/lightfield/field.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <sys/resource.h>

#include <cmocka.h>

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define MEMORY_IS_BOUNDED 1
#else
#define MEMORY_IS_BOUNDED 0 /* sanitizers map what they like */
#endif

/* Beside what the header speaks of: views, meshes, libvpx's own. */
#define SPARE ((rlim_t)48 << 20)

static struct lumi_writer file;

struct tally {
    int refused, opened, tiles, spoilt;
};

static void limit_memory(const uint8_t *data, size_t size, struct rlimit *before)
{
    unsigned long pages = 0;
    FILE *status = fopen("/proc/self/statm", "r");

    assert_int_equal(getrlimit(RLIMIT_AS, before), 0);
    if (!MEMORY_IS_BOUNDED || !status || size < FIELD_HEADER_SIZE || fscanf(status, "%lu", &pages) != 1)
        pages = 0;
    if (status)
        fclose(status);
    if (pages > 0) {
        uint64_t told = damage_get(data + 24, 8);
        struct rlimit limit = {(rlim_t)pages * 4096 + (told < UINT32_MAX ? told : UINT32_MAX) + SPARE,
                               before->rlim_max};
        assert_int_equal(setrlimit(RLIMIT_AS, &limit), 0);
    }
}

static void decode_all(const struct lumi_field *field, const char *name, bool mended, struct tally *tally)
{
    struct lumi_tile_decoder *decoder;
    struct lumi_tile_pixels pixels;

    assert_int_equal(lumi_tile_decoder_create(field, &decoder, NULL), LUMI_OK);
    for (int level = 0; level < LUMI_LEVELS; level++)
        for (int view = 0; view < lumi_field_info(field)->view_count[level]; view++) {
            const struct lumi_grid *grid = lumi_field_grid(field, lumi_field_view(field, level, view)->grid);
            for (int i = 0; i < grid->cols * grid->rows; i++) {
                struct lumi_error error = {0};
                int code =
                    lumi_field_decode_tile(decoder, level, view, i % grid->cols, i / grid->cols, &pixels, &error);
                if (code != LUMI_OK && code != LUMI_ERR_CHECKSUM && !(mended && code == LUMI_ERR_FORMAT))
                    fail_msg("%s: tile %d of view %d: code %d, %s", name, i, view, code, error.text);
                tally->tiles++;
                tally->spoilt += code != LUMI_OK;
            }
        }
    lumi_tile_decoder_destroy(decoder);
}

static void read_damaged(void *context, const char *name, const uint8_t *data, size_t size, bool mended)
{
    struct tally *tally = context;
    struct lumi_error error = {0};
    struct lumi_field *field;
    struct rlimit before;

    limit_memory(data, size, &before);
    int code = lumi_field_open_memory(data, size, "damaged.lumi", 1, &field, &error);
    if (code == LUMI_OK)
        decode_all(field, name, mended, tally);
    assert_int_equal(setrlimit(RLIMIT_AS, &before), 0);
    lumi_field_close(field);
    tally->opened += code == LUMI_OK;
    tally->refused += code != LUMI_OK;
    if (code == LUMI_OK)
        return;
    if (code != LUMI_ERR_FORMAT && code != LUMI_ERR_CHECKSUM && code != LUMI_ERR_VERSION && code != LUMI_ERR_LIMIT)
        fail_msg("%s: code %d, %s", name, code, error.text);
    if (strncmp(error.text, "damaged.lumi: ", 14) != 0 || strchr(error.text, '\n'))
        fail_msg("%s: '%s' is not one line that names the file", name, error.text);
}

static void damage_of_every_byte_class_is_an_error_or_missing_tiles(void **state)
{
    struct tally tally = {0};
    const struct damage damage = {file.data, file.size, read_damaged, &tally};

    (void)state;
    damage_everywhere(&damage, 1, 24);
    assert_true(tally.refused > 1000);
    assert_true(tally.opened > 100);
    assert_true(tally.spoilt > 100);
    assert_true(tally.spoilt < tally.tiles / 2);
}

int main(void)
{
    static const struct synthetic_options small = {2, 130, 70, 2, 30, 2, 0};
    const struct CMUnitTest tests[] = {cmocka_unit_test(damage_of_every_byte_class_is_an_error_or_missing_tiles)};
    struct lumi_error error = {0};

    lumi_writer_init(&file);
    if (synthetic_field_bytes(&small, &file, &error) != LUMI_OK) {
        fprintf(stderr, "%s\n", error.text);
        return 1;
    }
    int status = cmocka_run_group_tests(tests, NULL, NULL);
    lumi_writer_finish(&file);
    return status;
}
