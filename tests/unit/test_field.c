/* The field file: what is written is read, tile by tile, in any order; damage is an error. */
#include "synthetic_field.h"

#include "proto/base/parallel.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

static struct lumi_writer file; /* of synthetic_defaults */
static struct synthetic_field *truth;

static int make_file(void **state)
{
    struct lumi_error error = {0};

    (void)state;
    lumi_writer_init(&file);
    if (synthetic_field_create(&synthetic_defaults, &truth, &error) ||
        synthetic_field_bytes(&synthetic_defaults, &file, &error)) {
        print_error("%s\n", error.text);
        return -1;
    }
    return 0;
}

static int drop_file(void **state)
{
    (void)state;
    lumi_writer_finish(&file);
    synthetic_field_finish(truth);
    return 0;
}

static struct lumi_field *open_bytes(const void *data, size_t size)
{
    struct lumi_error error = {0};
    struct lumi_field *field;

    if (lumi_field_open_memory(data, size, "test", 1, &field, &error) != LUMI_OK)
        print_error("%s\n", error.text);
    assert_non_null(field);
    return field;
}

static void every_tile(const struct lumi_field *field, int *tiles, int *damaged)
{
    struct lumi_tile_decoder *decoder;
    struct lumi_tile_pixels pixels;

    *tiles = *damaged = 0;
    assert_int_equal(lumi_tile_decoder_create(field, &decoder, NULL), LUMI_OK);
    for (int level = 0; level < LUMI_LEVELS; level++)
        for (int view = 0; view < lumi_field_info(field)->view_count[level]; view++) {
            const struct lumi_grid *grid = lumi_field_grid(field, lumi_field_view(field, level, view)->grid);
            for (int i = 0; i < grid->cols * grid->rows; i++) {
                int code = lumi_field_decode_tile(decoder, level, view, i % grid->cols, i / grid->cols, &pixels, NULL);
                assert_true(code == LUMI_OK || code == LUMI_ERR_CHECKSUM);
                *damaged += code != LUMI_OK;
                (*tiles)++;
            }
        }
    lumi_tile_decoder_destroy(decoder);
}

static void what_no_reader_would_take_is_not_written(void **state)
{
    struct lumi_field_content content;
    struct lumi_writer bytes;

    (void)state;
    lumi_writer_init(&bytes);
    synthetic_field_content(truth, &content);
    content.radius = INFINITY;
    assert_int_equal(lumi_field_write_memory(&content, &bytes, NULL), LUMI_ERR_ARG);
    content.radius = 1;
    content.centre.y = NAN;
    assert_int_equal(lumi_field_write_memory(&content, &bytes, NULL), LUMI_ERR_ARG);
    lumi_writer_finish(&bytes);
}

static void a_field_reads_back_as_it_was_written(void **state)
{
    struct lumi_field *field = open_bytes(file.data, file.size);
    const struct lumi_field_info *info = lumi_field_info(field);
    uint64_t parts = info->index_bytes;

    (void)state;
    assert_int_equal(info->version, 1);
    assert_int_equal(info->surface, LUMI_SURFACE_PLANE);
    assert_int_equal(info->quality, 70);
    assert_int_equal(info->file_bytes, file.size);
    for (int level = 0; level < LUMI_LEVELS; level++) {
        parts += info->image_bytes[level] + info->geometry_bytes[level];
        assert_int_equal(info->view_count[level], 9);
        assert_int_equal(info->cluster_count[level], 2);
        for (int view = 0; view < 9; view++) {
            const struct lumi_field_view *read = lumi_field_view(field, level, view);
            const struct lumi_field_view *written = &truth->levels[level].views[view];
            const struct lumi_view_mesh *mesh = lumi_field_mesh(field, level, view);
            assert_string_equal(read->name, written->name);
            assert_int_equal(read->reference, view < 5 ? 0 : 5);
            assert_memory_equal(&read->pose, &written->pose, sizeof read->pose);
            assert_memory_equal(&read->disk, &written->disk, sizeof read->disk);
            assert_memory_equal(lumi_field_grid(field, read->grid), &truth->grids[level], sizeof truth->grids[level]);
            assert_non_null(mesh);
            assert_int_equal(mesh->tiles[0].triangle_count, 2);
        }
    }
    assert_int_equal(parts, file.size);
    assert_null(lumi_field_view(field, LUMI_LEVEL_FINE, 9));
    assert_null(lumi_field_grid(field, 2));
    lumi_field_close(field);
}

static double tile_error(const struct lumi_yuv *image, int column, int row, const struct lumi_tile_pixels *pixels)
{
    struct lumi_tile_pixels source;
    double sum = 0;

    lumi_window_copy(image, column * LUMI_TILE, row * LUMI_TILE, &source);
    for (int i = 0; i < LUMI_TILE * LUMI_TILE; i++)
        sum += (source.y[i] - pixels->y[i]) * (source.y[i] - pixels->y[i]);
    return sum / (LUMI_TILE * LUMI_TILE);
}

static void every_tile_shows_its_view(void **state)
{
    struct lumi_field *field = open_bytes(file.data, file.size);
    struct lumi_tile_decoder *decoder;
    struct lumi_tile_pixels pixels;

    (void)state;
    assert_int_equal(lumi_tile_decoder_create(field, &decoder, NULL), LUMI_OK);
    for (int level = 0; level < LUMI_LEVELS; level++)
        for (int view = 0; view < 9; view++)
            for (int i = 0; i < truth->grids[level].cols * truth->grids[level].rows; i++) {
                int column = i % truth->grids[level].cols, row = i / truth->grids[level].cols;
                assert_int_equal(lumi_field_decode_tile(decoder, level, view, column, row, &pixels, NULL), LUMI_OK);
                /* 36 dB: far from what any other view or place has. */
                assert_true(tile_error(&truth->levels[level].images[view], column, row, &pixels) < 16);
            }
    assert_int_equal(lumi_field_decode_tile(decoder, 2, 0, 0, 0, &pixels, NULL), LUMI_ERR_ARG);
    assert_int_equal(lumi_field_decode_tile(decoder, 1, 9, 0, 0, &pixels, NULL), LUMI_ERR_ARG);
    assert_int_equal(lumi_field_decode_tile(decoder, 1, 0, 3, 0, &pixels, NULL), LUMI_ERR_ARG);
    assert_int_equal(lumi_field_decode_tile(decoder, 1, 0, 0, -1, &pixels, NULL), LUMI_ERR_ARG);
    lumi_tile_decoder_destroy(decoder);
    lumi_field_close(field);
}

/* The hash of each tile of both levels, decoded in an order drawn with `seed`. */
enum { HASHES = 9 * 9 + 9 * 4 };
static void hashes_in_order(const struct lumi_field *field, unsigned seed, uint64_t hashes[HASHES])
{
    struct lumi_tile_decoder *decoder;
    struct lumi_tile_pixels pixels;

    assert_int_equal(lumi_tile_decoder_create(field, &decoder, NULL), LUMI_OK);
    for (int i = 0; i < 4 * HASHES; i++) {
        seed = seed * 1664525 + 1013904223;
        int k = i < HASHES ? i : (int)(seed >> 8) % HASHES, level = k >= 9 * 4, tile = level ? k - 9 * 4 : k;
        int tiles = level ? 9 : 4, cols = level ? 3 : 2;
        assert_int_equal(lumi_field_decode_tile(decoder, level, tile / tiles, tile % tiles % cols, tile % tiles / cols,
                                                &pixels, NULL),
                         LUMI_OK);
        uint64_t hash = lumi_tile_hash(&pixels);
        if (i >= HASHES)
            assert_true(hash == hashes[k]);
        hashes[k] = hash;
    }
    lumi_tile_decoder_destroy(decoder);
}

static void tiles_decode_to_the_same_pixels_in_any_order(void **state)
{
    struct lumi_field *field = open_bytes(file.data, file.size);
    uint64_t first[HASHES], second[HASHES];

    (void)state;
    hashes_in_order(field, 1, first);
    hashes_in_order(field, 2, second);
    assert_memory_equal(first, second, sizeof first);
    lumi_field_close(field);
}

static void error_resilient_fields_read_as_well(void **state)
{
    struct synthetic_options options = synthetic_defaults;
    struct lumi_writer bytes;
    int tiles, damaged;

    (void)state;
    options.error_resilient = 1;
    lumi_writer_init(&bytes);
    assert_int_equal(synthetic_field_bytes(&options, &bytes, NULL), LUMI_OK);
    struct lumi_field *field = open_bytes(bytes.data, bytes.size);
    every_tile(field, &tiles, &damaged);
    assert_int_equal(tiles, HASHES);
    assert_int_equal(damaged, 0);
    lumi_field_close(field);
    lumi_writer_finish(&bytes);
}

static void the_same_content_gives_the_same_bytes(void **state)
{
    struct lumi_writer again;

    (void)state;
    lumi_writer_init(&again);
    assert_int_equal(synthetic_field_bytes(&synthetic_defaults, &again, NULL), LUMI_OK);
    assert_int_equal(again.size, file.size);
    assert_memory_equal(again.data, file.data, file.size);
    lumi_writer_finish(&again);
}

static void a_newer_version_is_named_as_such(void **state)
{
    struct lumi_error error = {0};
    struct lumi_field *field;
    uint8_t *copy = lumi_alloc(file.size, 1);

    (void)state;
    memcpy(copy, file.data, file.size);
    copy[8] = 2;
    assert_int_equal(lumi_field_open_memory(copy, file.size, "new.lumi", 1, &field, &error), LUMI_ERR_VERSION);
    assert_null(field);
    assert_non_null(strstr(error.text, "new.lumi"));
    lumi_free(copy);
}

static void a_file_cut_anywhere_is_an_error(void **state)
{
    struct lumi_field *field;
    uint8_t *copy;

    (void)state;
    for (size_t size = 0; size < file.size; size += size < 1024 ? 1 : 97) {
        copy = lumi_alloc(size + 1, 1); /* of this size, so that reading past its end shows */
        memcpy(copy, file.data, size);
        assert_int_not_equal(lumi_field_open_memory(copy, size, "cut", 1, &field, NULL), LUMI_OK);
        assert_null(field);
        lumi_free(copy);
    }
}

/* A flipped byte is an error at opening, or damages tiles, or lies between sections; it never changes a picture
 * silently (12 bits of checksum a tile: none of these flips is the one in 4,096). */
static void a_flipped_byte_is_never_shown(void **state)
{
    uint64_t before[HASHES];
    struct lumi_field *field = open_bytes(file.data, file.size);
    uint8_t *copy = lumi_alloc(file.size, 1);
    int refused = 0, spoilt = 0, harmless = 0;

    (void)state;
    hashes_in_order(field, 1, before);
    lumi_field_close(field);
    memcpy(copy, file.data, file.size);
    for (size_t at = 0; at < file.size; at += at < 600 ? 7 : 211) {
        struct lumi_tile_decoder *decoder;
        struct lumi_tile_pixels pixels;
        int damaged = 0;
        copy[at] ^= (uint8_t)(1u << (at % 8));
        int code = lumi_field_open_memory(copy, file.size, "flipped", 1, &field, NULL);
        refused += code != LUMI_OK;
        if (code == LUMI_OK) {
            assert_int_equal(lumi_tile_decoder_create(field, &decoder, NULL), LUMI_OK);
            for (int k = 0; k < HASHES; k++) {
                int level = k >= 9 * 4, tile = level ? k - 9 * 4 : k, tiles = level ? 9 : 4, cols = level ? 3 : 2;
                code = lumi_field_decode_tile(decoder, level, tile / tiles, tile % tiles % cols, tile % tiles / cols,
                                              &pixels, NULL);
                assert_true(code == LUMI_ERR_CHECKSUM || (code == LUMI_OK && lumi_tile_hash(&pixels) == before[k]));
                damaged += code != LUMI_OK;
            }
            spoilt += damaged > 0;
            harmless += damaged == 0;
            lumi_tile_decoder_destroy(decoder);
            lumi_field_close(field);
        }
        copy[at] = file.data[at];
    }
    assert_true(refused > 20);
    assert_true(spoilt > 20);
    assert_true(harmless < 20);
    lumi_free(copy);
}

static void a_damaged_tile_leaves_the_decoder_usable(void **state)
{
    uint8_t *copy = lumi_alloc(file.size, 1);
    int tiles, damaged;

    (void)state;
    /* The last sections are the fine level's side information and tiles. */
    memcpy(copy, file.data, file.size);
    copy[file.size - 40] ^= 0x55;
    struct lumi_field *field = open_bytes(copy, file.size);
    every_tile(field, &tiles, &damaged);
    assert_int_equal(tiles, HASHES);
    assert_int_equal(damaged, 1);
    lumi_field_close(field);
    lumi_free(copy);
}

static void memory_beyond_the_header_is_refused(void **state)
{
    uint8_t *copy = lumi_alloc(file.size, 1);
    struct lumi_field *field;

    (void)state;
    memcpy(copy, file.data, file.size);
    memset(copy + 24, 0, 8); /* the header's memory figure */
    uint32_t crc = lumi_crc32c(0, copy, 60);
    for (int i = 0; i < 4; i++)
        copy[60 + i] = (uint8_t)(crc >> (8 * i));
    assert_int_equal(lumi_field_open_memory(copy, file.size, "greedy", 1, &field, NULL), LUMI_ERR_LIMIT);
    memset(copy + 24, 0xff, 8);
    crc = lumi_crc32c(0, copy, 60);
    for (int i = 0; i < 4; i++)
        copy[60 + i] = (uint8_t)(crc >> (8 * i));
    assert_int_equal(lumi_field_open_memory(copy, file.size, "greedy", 1, &field, NULL), LUMI_ERR_LIMIT);
    lumi_free(copy);
}

static void failing_memory_is_an_error(void **state)
{
    struct lumi_field *field;

    (void)state;
    for (long successes = 0;; successes++) {
        lumi_alloc_fail_after(successes);
        int code = lumi_field_open_memory(file.data, file.size, "test", 1, &field, NULL);
        lumi_alloc_fail_after(-1);
        if (code == LUMI_OK)
            break;
        assert_int_equal(code, LUMI_ERR_NOMEM);
        assert_true(successes < 1000);
    }
    lumi_field_close(field);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_field_reads_back_as_it_was_written),
        cmocka_unit_test(what_no_reader_would_take_is_not_written),
        cmocka_unit_test(every_tile_shows_its_view),
        cmocka_unit_test(tiles_decode_to_the_same_pixels_in_any_order),
        cmocka_unit_test(error_resilient_fields_read_as_well),
        cmocka_unit_test(the_same_content_gives_the_same_bytes),
        cmocka_unit_test(a_newer_version_is_named_as_such),
        cmocka_unit_test(a_file_cut_anywhere_is_an_error),
        cmocka_unit_test(a_flipped_byte_is_never_shown),
        cmocka_unit_test(a_damaged_tile_leaves_the_decoder_usable),
        cmocka_unit_test(memory_beyond_the_header_is_refused),
        cmocka_unit_test(failing_memory_is_an_error),
    };
    return cmocka_run_group_tests(tests, make_file, drop_file);
}
