/* proto/lightfield/mesh.h: coding of meshes. */
#include "proto/base/memory.h"
#include "proto/lightfield/grid.h"
#include "proto/lightfield/mesh.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
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
        assert_memory_equal(s->indices, t->indices, 3u * s->triangle_count * sizeof *s->indices);
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
    lumi_write_u8(&writer, 77);
    lumi_reader_init(&reader, writer.data, writer.size);
    assert_int_equal(lumi_view_mesh_decode(&reader, 2, 1, &back, &error), LUMI_OK);
    assert_same(&mesh, &back);
    assert_int_equal(lumi_read_u8(&reader), 77);
    lumi_view_mesh_finish(&mesh);
    lumi_view_mesh_finish(&back);
    lumi_writer_finish(&writer);
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
        cmocka_unit_test(every_truncation_is_refused),
        cmocka_unit_test(every_flipped_bit_is_refused_or_gives_a_mesh_within_its_limits),
        cmocka_unit_test(limits_and_lack_of_memory_are_reported),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
