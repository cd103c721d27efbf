/* proto/lightfield/mesh.h: coding of meshes. */
#include "proto/base/memory.h"
#include "proto/lightfield/grid.h"
#include "proto/lightfield/mesh.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* Two tiles that share an edge: a vertex in the middle of it, one inside the left tile; a step in depth. */
static void make(struct lumi_view_mesh *mesh)
{
    static const int vertex_counts[] = {6, 5}, triangle_counts[] = {5, 3};
    static const struct lumi_mesh_vertex left[] = {{0, 0, 0},      {255, 0, 50},   {0, 255, 7},
                                                   {255, 255, 60}, {255, 100, 10}, {90, 120, 200}};
    static const struct lumi_mesh_vertex right[] = {
        {0, 0, 100}, {255, 0, 0}, {0, 255, 120}, {255, 255, 255}, {0, 100, 20}};
    static const uint16_t left_indices[] = {0, 1, 5, 1, 4, 5, 4, 3, 5, 3, 2, 5, 2, 0, 5};
    static const uint16_t right_indices[] = {0, 1, 4, 1, 3, 4, 3, 2, 4};

    assert_int_equal(lumi_view_mesh_create(mesh, 2, 1, vertex_counts, triangle_counts), LUMI_OK);
    mesh->w_min = 0.125f;
    mesh->w_step = 0.0001f;
    mesh->tiles[0].base = 1024;
    mesh->tiles[0].shift = 3;
    mesh->tiles[1].base = 1024;
    mesh->tiles[1].shift = 2;
    memcpy(lumi_mesh_vertices(mesh, 0), left, sizeof left);
    memcpy(lumi_mesh_vertices(mesh, 1), right, sizeof right);
    memcpy(lumi_mesh_indices(mesh, 0), left_indices, sizeof left_indices);
    memcpy(lumi_mesh_indices(mesh, 1), right_indices, sizeof right_indices);
}

static int by_value(const void *a, const void *b)
{
    return memcmp(a, b, 3 * sizeof(uint16_t));
}

/* The triangles in one order, each beginning with its lowest index. */
static void normalise(const struct lumi_tile_mesh *tile, uint16_t *indices)
{
    for (int k = 0; k < tile->triangle_count; k++) {
        const uint16_t *v = tile->indices + 3 * k;
        const int first = v[0] < v[1] && v[0] < v[2] ? 0 : v[1] < v[2] ? 1 : 2;
        for (int i = 0; i < 3; i++)
            indices[3 * k + i] = v[(first + i) % 3];
    }
    qsort(indices, tile->triangle_count, 3 * sizeof *indices, by_value);
}

static void assert_same(const struct lumi_view_mesh *a, const struct lumi_view_mesh *b)
{
    assert_true(a->w_min == b->w_min && a->w_step == b->w_step);
    assert_int_equal(a->cols, b->cols);
    assert_int_equal(a->rows, b->rows);
    for (int i = 0; i < a->cols * a->rows; i++) {
        const struct lumi_tile_mesh *s = &a->tiles[i], *t = &b->tiles[i];
        assert_int_equal(s->base, t->base);
        assert_int_equal(s->shift, t->shift);
        assert_int_equal(s->vertex_count, t->vertex_count);
        assert_int_equal(s->triangle_count, t->triangle_count);
        assert_memory_equal(s->vertices, t->vertices, s->vertex_count * sizeof *s->vertices);
        uint16_t first[64], second[64];
        normalise(s, first);
        normalise(t, second);
        assert_memory_equal(first, second, 3u * s->triangle_count * sizeof *first);
    }
}

static void a_mesh_survives_the_round_trip_and_the_reader_stands_behind_it(void **state)
{
    struct lumi_view_mesh mesh, back;
    struct lumi_writer writer;
    struct lumi_reader reader;
    struct lumi_error error;

    (void)state;
    make(&mesh);
    lumi_writer_init(&writer);
    lumi_view_mesh_encode(&mesh, &writer);
    assert_int_equal(writer.data[0], 1); /* compact */
    assert_true(writer.size < 40);
    lumi_write_u8(&writer, 77);
    lumi_reader_init(&reader, writer.data, writer.size);
    assert_int_equal(lumi_view_mesh_decode(&reader, 2, 1, &back, &error), LUMI_OK);
    assert_same(&mesh, &back);
    assert_int_equal(lumi_read_u8(&reader), 77);
    lumi_view_mesh_finish(&mesh);
    lumi_view_mesh_finish(&back);
    lumi_writer_finish(&writer);
}

/* Changes the mesh so that it breaks one promise of the compact form. */
static void spoil(struct lumi_view_mesh *mesh, int how)
{
    struct lumi_mesh_vertex *right = lumi_mesh_vertices(mesh, 1), swapped = right[0];
    uint16_t *indices = lumi_mesh_indices(mesh, 1);

    switch (how) {
    case 0: /* a crack */
        right[4].d++;
        break;
    case 1: /* no vertex at the base */
        mesh->tiles[1].base -= 4;
        for (int i = 0; i < 5; i++)
            right[i].d = (uint8_t)(right[i].d < 255 ? right[i].d + 1 : 255);
        break;
    case 2: /* another order */
        right[0] = right[1];
        right[1] = swapped;
        break;
    case 3: /* a triangle twice, another not at all */
        memcpy(indices, indices + 3, 3 * sizeof *indices);
        break;
    case 4: /* the wrong way round */
        indices[0] = 1;
        indices[1] = 0;
        break;
    case 5: /* a vertex nobody uses */
        right[4].t++;
        break;
    }
}

static void a_mesh_that_breaks_the_compact_forms_promises_is_coded_all_the_same(void **state)
{
    (void)state;
    for (int how = 0; how < 6; how++) {
        struct lumi_view_mesh mesh, back;
        struct lumi_writer writer;
        struct lumi_reader reader;
        struct lumi_error error;
        make(&mesh);
        spoil(&mesh, how);
        lumi_writer_init(&writer);
        lumi_view_mesh_encode(&mesh, &writer);
        assert_int_equal(writer.data[0], 0);
        lumi_reader_init(&reader, writer.data, writer.size);
        assert_int_equal(lumi_view_mesh_decode(&reader, 2, 1, &back, &error), LUMI_OK);
        assert_same(&mesh, &back);
        lumi_view_mesh_finish(&mesh);
        lumi_view_mesh_finish(&back);
        lumi_writer_finish(&writer);
    }
}

static void every_truncation_is_refused(void **state)
{
    struct lumi_view_mesh mesh, back;
    struct lumi_writer writer;
    struct lumi_reader reader;
    struct lumi_error error;

    (void)state;
    make(&mesh);
    lumi_writer_init(&writer);
    lumi_view_mesh_encode(&mesh, &writer);
    for (size_t size = 0; size < writer.size; size++) {
        lumi_reader_init(&reader, writer.data, size);
        assert_int_equal(lumi_view_mesh_decode(&reader, 2, 1, &back, &error), LUMI_ERR_FORMAT);
        assert_null(back.block);
    }
    lumi_view_mesh_finish(&mesh);
    lumi_writer_finish(&writer);
}

static void every_flipped_bit_is_refused_or_gives_a_mesh_within_its_limits(void **state)
{
    struct lumi_view_mesh mesh, back;
    struct lumi_writer writer;
    struct lumi_reader reader;
    struct lumi_error error;

    (void)state;
    make(&mesh);
    lumi_writer_init(&writer);
    lumi_view_mesh_encode(&mesh, &writer);
    for (size_t bit = 0; bit < 8 * writer.size; bit++) {
        writer.data[bit / 8] ^= (uint8_t)(1 << bit % 8);
        lumi_reader_init(&reader, writer.data, writer.size);
        int result = lumi_view_mesh_decode(&reader, 2, 1, &back, &error);
        assert_true(result == LUMI_OK || result == LUMI_ERR_FORMAT);
        for (int i = 0; result == LUMI_OK && i < 2; i++) {
            assert_true(back.tiles[i].shift <= 8);
            for (int k = 0; k < 3 * back.tiles[i].triangle_count; k++)
                assert_true(back.tiles[i].indices[k] < back.tiles[i].vertex_count);
        }
        lumi_view_mesh_finish(&back);
        writer.data[bit / 8] ^= (uint8_t)(1 << bit % 8);
    }
    lumi_view_mesh_finish(&mesh);
    lumi_writer_finish(&writer);
}

static void limits_and_lack_of_memory_are_reported(void **state)
{
    const int many[] = {LUMI_MESH_MAX_VERTICES + 1}, none[] = {0};
    struct lumi_view_mesh mesh, back;
    struct lumi_writer writer;
    struct lumi_reader reader;
    struct lumi_error error;

    (void)state;
    assert_int_equal(lumi_view_mesh_create(&mesh, 1, 1, many, none), LUMI_ERR_ARG);
    assert_int_equal(lumi_view_mesh_create(&mesh, LUMI_GRID_MAX + 1, 1, none, none), LUMI_ERR_ARG);
    make(&mesh);
    lumi_writer_init(&writer);
    lumi_view_mesh_encode(&mesh, &writer);
    lumi_reader_init(&reader, writer.data, writer.size);
    assert_int_equal(lumi_view_mesh_decode(&reader, 0, 1, &back, &error), LUMI_ERR_ARG);
    for (long allowed = 0;; allowed++) {
        lumi_reader_init(&reader, writer.data, writer.size);
        lumi_alloc_fail_after(allowed);
        int result = lumi_view_mesh_decode(&reader, 2, 1, &back, &error);
        lumi_alloc_fail_after(-1);
        lumi_view_mesh_finish(&back);
        if (result == LUMI_OK)
            break;
        assert_int_equal(result, LUMI_ERR_NOMEM);
    }
    lumi_view_mesh_finish(&mesh);
    lumi_writer_finish(&writer);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_mesh_survives_the_round_trip_and_the_reader_stands_behind_it),
        cmocka_unit_test(a_mesh_that_breaks_the_compact_forms_promises_is_coded_all_the_same),
        cmocka_unit_test(every_truncation_is_refused),
        cmocka_unit_test(every_flipped_bit_is_refused_or_gives_a_mesh_within_its_limits),
        cmocka_unit_test(limits_and_lack_of_memory_are_reported),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
