/* Damaged images give one line that names the file, and no pixels. */
#include "image_samples.h"
#include "proto/base/memory.h"
#include "proto/image/image.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

struct file {
    uint8_t *data;
    size_t size;
};

static struct file encode(enum lumi_image_format format, enum lumi_sample sample)
{
    struct lumi_image_options options;
    struct lumi_error error = {0};
    struct lumi_raster raster;
    struct file file;

    lumi_image_options_init(&options);
    options.format = format;
    make_picture(&raster, 61, 43, 3, sample);
    assert_int_equal(lumi_image_encode(&raster, &options, &file.data, &file.size, &error), LUMI_OK);
    lumi_raster_finish(&raster);
    return file;
}

/* Reads and checks the contract of failure. Returns the code. */
static int try_read(const uint8_t *data, size_t size)
{
    struct lumi_image_meta meta;
    struct lumi_raster raster;
    struct lumi_error error = {0};
    int code = lumi_image_read_memory(data, size, "photo", 0, &raster, &meta, &error);

    if (code != LUMI_OK) {
        assert_null(raster.data);
        assert_null(meta.exif);
        assert_int_equal(error.code, code);
        assert_memory_equal(error.text, "photo: ", 7);
        assert_null(strchr(error.text, '\n'));
    }
    lumi_raster_finish(&raster);
    lumi_image_meta_finish(&meta);
    return code;
}

static const enum lumi_image_format formats[] = {LUMI_IMAGE_JPEG, LUMI_IMAGE_PNG, LUMI_IMAGE_TIFF, LUMI_IMAGE_EXR};

static void every_truncation_is_an_error(void **state)
{
    (void)state;
    for (int i = 0; i < 4; i++) {
        struct file file = encode(formats[i], LUMI_U8);
        assert_int_equal(try_read(file.data, file.size), LUMI_OK);
        /* The last byte of a TIFF may be padding or the end of a table that libtiff does not need. */
        for (size_t size = 0; size + (formats[i] == LUMI_IMAGE_TIFF ? 8 : 1) < file.size; size++) {
            uint8_t *cut = lumi_alloc(size ? size : 1, 1); /* exactly so long, for the address sanitizer */
            memcpy(cut, file.data, size);
            if (try_read(cut, size) == LUMI_OK)
                fail_msg("format %d cut to %zu of %zu bytes was read", formats[i], size, file.size);
            lumi_free(cut);
        }
        lumi_free(file.data);
    }
}

static void flipped_bytes_never_do_harm(void **state)
{
    (void)state;
    for (int i = 0; i < 4; i++) {
        struct file file = encode(formats[i], formats[i] == LUMI_IMAGE_PNG ? LUMI_U16 : LUMI_U8);
        int noticed = 0;
        for (size_t at = 0; at < file.size; at++)
            for (int bit = 0; bit < 8; bit += 7) {
                file.data[at] ^= (uint8_t)(1 << bit);
                noticed += try_read(file.data, file.size) != LUMI_OK;
                file.data[at] ^= (uint8_t)(1 << bit);
            }
        /* PNG carries a CRC over everything; the others notice what breaks their structure. */
        if (formats[i] == LUMI_IMAGE_PNG)
            assert_int_equal(noticed, 2 * file.size);
        assert_true(noticed > 10);
        lumi_free(file.data);
    }
}

static void a_small_file_cannot_ask_for_much_memory(void **state)
{
    struct file jpeg = encode(LUMI_IMAGE_JPEG, LUMI_U8);
    struct lumi_image_info info;
    struct lumi_error error = {0};

    (void)state;
    for (size_t at = 0; at + 9 < jpeg.size; at++)
        if (jpeg.data[at] == 0xff && jpeg.data[at + 1] == 0xc0) /* height and width in the frame header */
            memcpy(jpeg.data + at + 5, "\xff\xdc\xff\xdc", 4);
    assert_int_equal(try_read(jpeg.data, jpeg.size), LUMI_ERR_LIMIT);
    assert_int_equal(lumi_image_info_memory(jpeg.data, jpeg.size, "photo", &info, &error), LUMI_ERR_LIMIT);
    assert_int_equal(info.width, 0);
    lumi_free(jpeg.data);
}

static void put32(uint8_t *to, uint32_t value)
{
    for (int i = 0; i < 4; i++)
        to[i] = (uint8_t)(value >> (24 - 8 * i));
}

/* A PNG with an EXIF chunk before its pixels, said to be `length` bytes long. */
static struct file png_with_exif(const uint8_t *exif, size_t size, uint32_t length)
{
    enum { FRONT = 8 + 25 }; /* signature and IHDR */
    struct file png = encode(LUMI_IMAGE_PNG, LUMI_U8);
    struct file with = {lumi_alloc(png.size + size + 12, 1), png.size + size + 12};
    uint8_t *chunk = with.data + FRONT;

    memcpy(with.data, png.data, FRONT);
    put32(chunk, length);
    memcpy(chunk + 4, "eXIf", 4);
    memcpy(chunk + 8, exif, size);
    uint32_t crc = 0xffffffff;
    for (size_t i = 4; i < size + 8; i++) {
        crc ^= chunk[i];
        for (int k = 0; k < 8; k++)
            crc = crc >> 1 ^ (crc & 1 ? 0xedb88320 : 0);
    }
    put32(chunk + 8 + size, ~crc);
    memcpy(chunk + 12 + size, png.data + FRONT, png.size - FRONT);
    lumi_free(png.data);
    return with;
}

/* The most address space this program ever had, in KiB. */
static long peak(void)
{
    FILE *status = fopen("/proc/self/status", "r");
    char line[256];
    long value = 0;

    assert_non_null(status);
    while (fgets(line, sizeof line, status))
        if (sscanf(line, "VmPeak: %ld", &value) == 1)
            break;
    fclose(status);
    return value;
}

/* libpng asks for as much memory as a chunk says it needs, before it looks whether the chunk is there. */
static void a_png_chunk_longer_than_its_file_is_no_matter_of_memory(void **state)
{
    struct file file = png_with_exif((const uint8_t *)"II*", 4, 0x70000000);
    long before = peak();

    (void)state;
    assert_int_equal(try_read(file.data, file.size), LUMI_ERR_FORMAT);
    assert_in_range(peak() - before, 0, 256 << 10);
    lumi_free(file.data);
}

/* 65,535 entries that each lead to the directory they stand in: were each followed, this would take a minute. */
static void an_exif_block_that_points_at_itself_is_read_once(void **state)
{
    enum { ENTRIES = 65535, SIZE = 8 + 2 + ENTRIES * 12 };
    static const uint8_t front[] = {'I', 'I', '*', 0, 8, 0, 0, 0, 0xff, 0xff};
    static const uint8_t entry[] = {0x69, 0x87, 4, 0, 1, 0, 0, 0, 8, 0, 0, 0};
    uint8_t *exif = lumi_alloc(SIZE, 1);

    (void)state;
    memcpy(exif, front, sizeof front);
    for (int i = 0; i < ENTRIES; i++)
        memcpy(exif + sizeof front + (size_t)i * sizeof entry, entry, sizeof entry);
    struct file file = png_with_exif(exif, SIZE, SIZE);
    for (int i = 0; i < 20; i++)
        assert_int_equal(try_read(file.data, file.size), LUMI_OK);
    lumi_free(file.data);
    lumi_free(exif);
}

static void what_is_no_image_is_said_to_be_none(void **state)
{
    (void)state;
    assert_int_equal(try_read((const uint8_t *)"", 0), LUMI_ERR_FORMAT);
    assert_int_equal(try_read((const uint8_t *)"hello, world", 12), LUMI_ERR_UNSUPPORTED);
}

static void a_missing_file_and_a_folder_are_named(void **state)
{
    struct lumi_error error = {0};
    struct lumi_image_info info;
    struct lumi_raster raster;

    (void)state;
    assert_int_equal(lumi_image_read("no-such.jpg", 0, &raster, NULL, &error), LUMI_ERR_NOTFOUND);
    assert_non_null(strstr(error.text, "no-such.jpg"));
    assert_int_equal(lumi_image_info("no-such.jpg", &info, &error), LUMI_ERR_NOTFOUND);
    assert_int_equal(lumi_image_read(".", 0, &raster, NULL, &error), LUMI_ERR_FORMAT);
}

static void running_out_of_memory_is_an_error_at_every_allocation(void **state)
{
    (void)state;
    for (int i = 0; i < 4; i++) {
        struct file file = encode(formats[i], LUMI_U8);
        int code = LUMI_ERR_NOMEM;
        for (long n = 0; code != LUMI_OK && n < 500; n++) {
            lumi_alloc_fail_after(n);
            code = try_read(file.data, file.size);
            lumi_alloc_fail_after(-1);
        }
        assert_int_equal(code, LUMI_OK);
        lumi_free(file.data);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_truncation_is_an_error),
        cmocka_unit_test(flipped_bytes_never_do_harm),
        cmocka_unit_test(a_small_file_cannot_ask_for_much_memory),
        cmocka_unit_test(a_png_chunk_longer_than_its_file_is_no_matter_of_memory),
        cmocka_unit_test(an_exif_block_that_points_at_itself_is_read_once),
        cmocka_unit_test(what_is_no_image_is_said_to_be_none),
        cmocka_unit_test(a_missing_file_and_a_folder_are_named),
        cmocka_unit_test(running_out_of_memory_is_an_error_at_every_allocation),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
