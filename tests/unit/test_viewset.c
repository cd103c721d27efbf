/* render/viewset: views of a field, decoded, kept, let go, patched where they are damaged. */
#include "render/viewset/viewset.h"

#include "proto/base/file.h"
#include "proto/base/parallel.h"
#include "render/cpu/disk_renderer.h"
#include "tests/unit/synthetic_field.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

static struct lumi_writer file;

static int make_file(void **state)
{
    (void)state;
    lumi_writer_init(&file);
    return synthetic_field_bytes(&synthetic_defaults, &file, NULL);
}

static int drop_file(void **state)
{
    (void)state;
    lumi_writer_finish(&file);
    return 0;
}

static struct lumi_field *open_bytes(const void *data)
{
    struct lumi_error error = {0};
    struct lumi_field *field = NULL;

    if (lumi_field_open_memory(data, file.size, "test", 1, &field, &error) != LUMI_OK)
        fail_msg("%s", error.text);
    return field;
}

static struct lumi_viewset *open_set(const struct lumi_field *field, size_t cache)
{
    struct lumi_viewset *set = NULL;

    assert_int_equal(lumi_viewset_from_field(field, LUMI_LEVEL_FINE, cache, &set, NULL), LUMI_OK);
    return set;
}

/* Between the cameras, against the wall itself. */
static void a_view_between_those_of_a_field_is_the_truth(void **state)
{
    struct lumi_field *field = open_bytes(file.data);
    struct lumi_viewset *set = open_set(field, 1 << 20);
    struct lumi_pose pose = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0.027, 0.011, 0}};
    struct lumi_disk_settings settings;
    struct lumi_lens lens;
    struct lumi_picture picture;
    double sum = 0;

    (void)state;
    lumi_disk_settings_default(&settings);
    lumi_lens_init_pinhole(&lens, 120, 96, 0.8);
    assert_int_equal(lumi_render_disks(set, &lens, &pose, &settings, &picture, NULL), LUMI_OK);
    assert_int_equal(picture.covered, picture.imaged);
    for (int y = 0; y < 96; y++)
        for (int x = 0; x < 120; x++) {
            struct lumi_vec3 d;
            float rgb[3];
            assert_true(lumi_lens_unproject(&lens, x + 0.5, y + 0.5, &d));
            synthetic_wall(pose.t.x + SYNTHETIC_DEPTH * d.x / d.z, pose.t.y + SYNTHETIC_DEPTH * d.y / d.z, rgb);
            for (int c = 0; c < 3; c++)
                sum += pow(lumi_row_u8(&picture.color, y)[3 * x + c] - 255 * (double)lumi_srgb_encode(rgb[c]), 2);
        }
    double db = 10 * log10(255.0 * 255.0 * 96 * 120 * 3 / sum);
    print_message("%.2f dB\n", db);
    assert_true(db > 26); /* the wall's checks have hard edges, and chroma is at half resolution */
    lumi_picture_finish(&picture);
    lumi_viewset_destroy(set);
    lumi_field_close(field);
}

static void a_cache_too_small_for_two_views_gives_the_same_pixels(void **state)
{
    struct lumi_field *field = open_bytes(file.data);
    struct lumi_viewset *large = open_set(field, 1 << 24), *small = open_set(field, 1);
    struct lumi_raster a, b, held;

    (void)state;
    assert_int_equal(lumi_viewset_acquire(small, 0, &held, NULL, NULL), LUMI_OK);
    for (int round = 0; round < 2; round++)
        for (int i = 0; i < lumi_viewset_count(large); i++) {
            assert_int_equal(lumi_viewset_acquire(large, i, &a, NULL, NULL), LUMI_OK);
            assert_int_equal(lumi_viewset_acquire(small, i, &b, NULL, NULL), LUMI_OK);
            for (int y = 0; y < a.height; y++)
                assert_memory_equal(lumi_row_u8(&a, y), lumi_row_u8(&b, y), 3 * (size_t)a.width);
            lumi_viewset_release(large, i);
            lumi_viewset_release(small, i);
        }
    /* What is held stays, however small the cache. */
    assert_int_equal(lumi_viewset_acquire(small, 0, &b, NULL, NULL), LUMI_OK);
    assert_ptr_equal(b.data, held.data);
    lumi_viewset_release(small, 0);
    lumi_viewset_release(small, 0);
    lumi_viewset_destroy(large);
    lumi_viewset_destroy(small);
    lumi_field_close(field);
}

struct crowd {
    struct lumi_viewset *set;
    uint64_t hashes[64]; /* an item */
};

static int take_one(void *context, int index, int thread)
{
    struct crowd *crowd = context;
    struct lumi_raster pixels;
    uint64_t hash = LUMI_FNV1A_BASIS;

    (void)thread;
    LUMI_TRY(lumi_viewset_acquire(crowd->set, index % 9, &pixels, NULL, NULL));
    for (int y = 0; y < pixels.height; y++)
        hash = lumi_fnv1a(hash, lumi_row_u8(&pixels, y), 3 * (size_t)pixels.width);
    crowd->hashes[index] = hash;
    lumi_viewset_release(crowd->set, index % 9);
    return LUMI_OK;
}

static void many_threads_may_take_and_release_views(void **state)
{
    struct lumi_field *field = open_bytes(file.data);
    struct crowd crowd = {.set = open_set(field, 200000)};

    (void)state;
    assert_int_equal(lumi_parallel_for(64, 8, take_one, &crowd), LUMI_OK);
    for (int i = 9; i < 64; i++)
        assert_true(crowd.hashes[i] == crowd.hashes[i % 9]);
    assert_true(crowd.hashes[0] != crowd.hashes[1]);
    lumi_viewset_destroy(crowd.set);
    lumi_field_close(field);
}

static void a_damaged_tile_shows_the_coarse_level_s_picture(void **state)
{
    uint8_t *copy = lumi_alloc(file.size, 1);
    struct lumi_field *good = open_bytes(file.data);
    struct lumi_viewset *whole = open_set(good, 1 << 24);
    double difference = 0;
    long pixels = 0;

    (void)state;
    memcpy(copy, file.data, file.size);
    copy[file.size - 40] ^= 0x55; /* the file ends in the fine level's tiles */
    struct lumi_field *field = open_bytes(copy);
    struct lumi_viewset *set = open_set(field, 1 << 24);
    for (int i = 0; i < lumi_viewset_count(set); i++) {
        struct lumi_raster a, b;
        const uint8_t *missing;
        assert_int_equal(lumi_viewset_acquire(whole, i, &a, NULL, NULL), LUMI_OK);
        assert_int_equal(lumi_viewset_acquire(set, i, &b, &missing, NULL), LUMI_OK);
        assert_null(missing);
        for (int y = 0; y < a.height; y++)
            for (int x = 0; x < 3 * a.width; x++)
                if (lumi_row_u8(&a, y)[x] != lumi_row_u8(&b, y)[x]) {
                    difference += abs(lumi_row_u8(&a, y)[x] - lumi_row_u8(&b, y)[x]);
                    pixels++;
                }
        lumi_viewset_release(whole, i);
        lumi_viewset_release(set, i);
    }
    assert_int_equal(lumi_viewset_damaged(set), 1);
    assert_int_equal(lumi_viewset_damaged(whole), 0);
    print_message("%ld samples differ, by %.1f on average\n", pixels, difference / (double)pixels);
    assert_true(pixels > 0 && pixels <= 3 * 66 * 66);
    assert_true(difference < 30 * (double)pixels); /* like it, not grey */
    lumi_viewset_destroy(set);
    lumi_viewset_destroy(whole);
    lumi_field_close(field);
    lumi_field_close(good);
    lumi_free(copy);
}

static void a_set_opened_from_a_file_is_the_field_s_and_renders_as_it_is(void **state)
{
    static const char *const path = "test_viewset.lumi", *const picture_path = "test_viewset.ppm";
    struct lumi_field *field = open_bytes(file.data);
    struct lumi_viewset *set = open_set(field, 1 << 20), *opened = NULL;
    struct lumi_pose pose = lumi_viewset_middle(set);
    struct lumi_disk_settings settings;
    struct lumi_lens lens;
    struct lumi_picture a, b;
    uint8_t *ppm;
    size_t size;

    (void)state;
    assert_int_equal(lumi_viewset_open("no_such.lumi", &opened, NULL), LUMI_ERR_NOTFOUND);
    assert_int_equal(lumi_file_write(path, file.data, file.size, false, NULL), LUMI_OK);
    assert_int_equal(lumi_viewset_open(path, &opened, NULL), LUMI_OK);
    assert_int_equal(lumi_viewset_count(opened), lumi_viewset_count(set));
    assert_memory_equal(&pose.t, &lumi_field_info(field)->centre, sizeof pose.t);
    assert_memory_equal(pose.r, lumi_viewset_view(set, 0)->pose.r, sizeof pose.r);

    lumi_disk_settings_default(&settings);
    lumi_lens_init_pinhole(&lens, 61, 48, 0.8);
    assert_int_equal(lumi_render_disks(set, &lens, &pose, &settings, &a, NULL), LUMI_OK);
    assert_int_equal(lumi_render_disks(opened, &lens, &pose, NULL, &b, NULL), LUMI_OK);
    assert_int_equal(lumi_raster_write_ppm(&b.color, picture_path, NULL), LUMI_OK);
    assert_int_equal(lumi_file_read(picture_path, 1 << 20, &ppm, &size, NULL), LUMI_OK);
    assert_int_equal(size, 13 + 61 * 48 * 3);
    assert_memory_equal(ppm, "P6\n61 48\n255\n", 13);
    for (int y = 0; y < 48; y++)
        assert_memory_equal(ppm + 13 + 61 * 3 * y, lumi_row_u8(&a.color, y), 61 * 3);
    assert_int_equal(lumi_raster_write_ppm(&b.weight, picture_path, NULL), LUMI_ERR_ARG);
    lumi_free(ppm);
    lumi_picture_finish(&a);
    lumi_picture_finish(&b);
    lumi_viewset_destroy(opened);
    lumi_viewset_destroy(set);
    lumi_field_close(field);
    remove(path);
    remove(picture_path);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_view_between_those_of_a_field_is_the_truth),
        cmocka_unit_test(a_cache_too_small_for_two_views_gives_the_same_pixels),
        cmocka_unit_test(many_threads_may_take_and_release_views),
        cmocka_unit_test(a_set_opened_from_a_file_is_the_field_s_and_renders_as_it_is),
        cmocka_unit_test(a_damaged_tile_shows_the_coarse_level_s_picture),
    };

    return cmocka_run_group_tests(tests, make_file, drop_file);
}
