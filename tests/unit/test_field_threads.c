/* Several threads read one field: each with a decoder of its own they get the same pixels as one thread. */
#include "synthetic_field.h"

#include "proto/base/parallel.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

enum { THREADS = 4, ITEMS = 32, DECODED = 60 };

struct shared {
    const struct lumi_field *field;
    uint64_t hashes[ITEMS];
};

static int decode_some(void *context, int index, int thread)
{
    struct shared *shared = context;
    struct lumi_tile_decoder *decoder;
    struct lumi_tile_pixels pixels;
    unsigned seed = (unsigned)index;

    (void)thread;
    LUMI_TRY(lumi_tile_decoder_create(shared->field, &decoder, NULL));
    int code = LUMI_OK;
    for (int i = 0; i < DECODED && code == LUMI_OK; i++) {
        seed = seed * 1664525 + 1013904223;
        int level = (int)(seed >> 8 & 1), view = (int)(seed >> 10) % 9, tile = (int)(seed >> 16) % 4;
        code = lumi_field_decode_tile(decoder, level, view, tile % 2, tile / 2, &pixels, NULL);
        shared->hashes[index] = shared->hashes[index] * 31 + lumi_tile_hash(&pixels);
    }
    lumi_tile_decoder_destroy(decoder);
    return code;
}

static void threads_get_the_pixels_that_one_gets(void **state)
{
    struct shared *many = lumi_calloc(1, sizeof *many), *one = lumi_calloc(1, sizeof *one);
    struct lumi_writer bytes;
    struct lumi_field *field;

    (void)state;
    lumi_writer_init(&bytes);
    assert_int_equal(synthetic_field_bytes(&synthetic_defaults, &bytes, NULL), LUMI_OK);
    assert_int_equal(lumi_field_open_memory(bytes.data, bytes.size, "test", THREADS, &field, NULL), LUMI_OK);
    many->field = one->field = field;
    assert_int_equal(lumi_parallel_for(ITEMS, THREADS, decode_some, many), LUMI_OK);
    assert_int_equal(lumi_parallel_for(ITEMS, 1, decode_some, one), LUMI_OK);
    assert_memory_equal(many->hashes, one->hashes, sizeof one->hashes);
    lumi_field_close(field);
    lumi_writer_finish(&bytes);
    lumi_free(many);
    lumi_free(one);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(threads_get_the_pixels_that_one_gets)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
