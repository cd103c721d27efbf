/* pipeline/geometry: meshes from depth maps. */
#include "pipeline/geometry/simplify.h"
#include "proto/base/memory.h"
#include "proto/lightfield/mesh_raster.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

typedef float (*scene)(double x, double y);

static float plane(double x, double y)
{
    return (float)(0.3 + 0.0004 * x - 0.0002 * y);
}

/* A step along a slanted line, both sides tilted. */
static float step(double x, double y)
{
    return x + 0.3 * y < 190 ? (float)(0.2 + 0.0001 * y) : (float)(0.8 - 0.0001 * x);
}

static float clutter(double x, double y)
{
    float w = (float)(0.05 + 0.0003 * y);

    if (hypot(x - 90, y - 80) < 55)
        w = (float)(0.6 + 0.2 * sqrt(1 - pow(hypot(x - 90, y - 80) / 56, 2)));
    for (int k = 0; k < 5; k++)
        if (fabs(x - 170 - 30 * k - 0.15 * y) < 3)
            w = 1.0f + 0.05f * (float)k;
    if (y > 170 && y < 230 && x > 40 && x < 130)
        w = 0.4f;
    return w;
}

static void paint(scene f, int width, int height, struct lumi_grid *grid, struct lumi_raster *depth)
{
    assert_true(lumi_grid_init_pinhole(grid, width, height, 300, 300, width / 2.0, height / 2.0));
    assert_int_equal(lumi_raster_create(depth, width, height, 1, LUMI_F32), LUMI_OK);
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++)
            lumi_row_f32(depth, y)[x] = f(x + 0.5, y + 0.5);
}

static void simplify(scene f, int width, int height, double triangles, struct lumi_raster *depth,
                     struct lumi_view_mesh *mesh)
{
    struct lumi_simplify_options options;
    struct lumi_grid grid;
    struct lumi_error error;

    paint(f, width, height, &grid, depth);
    lumi_simplify_defaults(&options);
    options.triangles_per_tile = triangles;
    assert_int_equal(lumi_simplify(depth, NULL, &grid, &options, mesh, &error), LUMI_OK);
}

/* Root mean square error in pixels of disparity (30 px · m), large ones held to 4 pixels as the simplifier does, and
 * the share of pixels that are off by more than one. */
static double compare(const struct lumi_view_mesh *mesh, const struct lumi_raster *depth, double *wrong)
{
    struct lumi_raster dense;
    double sum = 0;
    long off = 0;

    assert_int_equal(lumi_mesh_rasterize(mesh, depth->width, depth->height, &dense), LUMI_OK);
    for (int y = 0; y < depth->height; y++)
        for (int x = 0; x < depth->width; x++) {
            const double e = 30 * ((double)lumi_row_f32(depth, y)[x] - (double)lumi_row_f32(&dense, y)[x]);
            sum += e * e / (1 + e * e / 16);
            off += fabs(e) > 1;
        }
    lumi_raster_finish(&dense);
    if (wrong)
        *wrong = (double)off / depth->width / depth->height;
    return sqrt(sum / depth->width / depth->height);
}

static long triangles_of(const struct lumi_view_mesh *mesh)
{
    long count = 0;

    for (int i = 0; i < mesh->cols * mesh->rows; i++)
        count += mesh->tiles[i].triangle_count;
    return count;
}

/* Every triangle upright, their areas the tile's whole area. In lattice units. */
static void assert_covers(const struct lumi_view_mesh *mesh, int width, int height)
{
    for (int i = 0; i < mesh->cols * mesh->rows; i++) {
        const struct lumi_tile_mesh *tile = &mesh->tiles[i];
        const int right = width - i % mesh->cols * 64, bottom = height - i / mesh->cols * 64;
        const int across = right >= 64 ? 255 : (right * 255 + 63) / 64,
                  down = bottom >= 64 ? 255 : (bottom * 255 + 63) / 64;
        long area = 0;
        for (int k = 0; k < tile->triangle_count; k++) {
            const struct lumi_mesh_vertex *a = &tile->vertices[tile->indices[3 * k]],
                                          *b = &tile->vertices[tile->indices[3 * k + 1]],
                                          *c = &tile->vertices[tile->indices[3 * k + 2]];
            const int twice = (b->s - a->s) * (c->t - a->t) - (b->t - a->t) * (c->s - a->s);
            assert_true(twice > 0);
            area += twice;
        }
        assert_int_equal(area, 2L * across * down);
    }
}

/* The vertices on the line s (or t, if `vertical` is false) = at, as (position, code) pairs in order. */
static int edge_of(const struct lumi_tile_mesh *tile, bool vertical, int at, int codes[256])
{
    int count = 0;

    for (int i = 0; i < 256; i++)
        codes[i] = -1;
    for (int v = 0; v < tile->vertex_count; v++) {
        const struct lumi_mesh_vertex *p = &tile->vertices[v];
        if ((vertical ? p->s : p->t) == at) {
            codes[vertical ? p->t : p->s] = tile->base + (p->d << tile->shift);
            count++;
        }
    }
    return count;
}

static void assert_no_cracks(const struct lumi_view_mesh *mesh)
{
    int a[256], b[256];

    for (int row = 0; row < mesh->rows; row++)
        for (int column = 0; column < mesh->cols; column++) {
            const struct lumi_tile_mesh *tile = &mesh->tiles[row * mesh->cols + column];
            assert_int_equal(tile->base % (1 << tile->shift), 0);
            if (column + 1 < mesh->cols) {
                assert_true(edge_of(tile, true, 255, a) == edge_of(tile + 1, true, 0, b));
                assert_memory_equal(a, b, sizeof a);
            }
            if (row + 1 < mesh->rows) {
                assert_true(edge_of(tile, false, 255, a) == edge_of(tile + mesh->cols, false, 0, b));
                assert_memory_equal(a, b, sizeof a);
            }
        }
}

static void a_plane_takes_two_triangles_a_tile_and_is_met_to_the_quantisation(void **state)
{
    struct lumi_raster depth;
    struct lumi_view_mesh mesh;

    (void)state;
    simplify(plane, 256, 192, 10, &depth, &mesh);
    assert_true(compare(&mesh, &depth, NULL) < 0.03);
    assert_covers(&mesh, 256, 192);
    lumi_view_mesh_finish(&mesh);
    lumi_raster_finish(&depth);
    simplify(plane, 256, 192, 2, &depth, &mesh);
    assert_int_equal(triangles_of(&mesh), 2 * 12);
    assert_true(compare(&mesh, &depth, NULL) < 0.03);
    lumi_view_mesh_finish(&mesh);
    lumi_raster_finish(&depth);
}

static void tiles_are_covered_and_meet_without_cracks_whatever_the_size(void **state)
{
    static const int sizes[][2] = {{320, 256}, {300, 250}, {65, 1}, {64, 129}};

    (void)state;
    for (int k = 0; k < 4; k++) {
        struct lumi_raster depth;
        struct lumi_view_mesh mesh;
        simplify(clutter, sizes[k][0], sizes[k][1], 10, &depth, &mesh);
        assert_covers(&mesh, sizes[k][0], sizes[k][1]);
        assert_no_cracks(&mesh);
        assert_true(triangles_of(&mesh) <= 10L * mesh.cols * mesh.rows);
        lumi_view_mesh_finish(&mesh);
        lumi_raster_finish(&depth);
    }
}

static void a_step_is_kept_as_a_step(void **state)
{
    struct lumi_raster depth, dense;
    struct lumi_view_mesh mesh;
    double wrong;

    (void)state;
    simplify(step, 320, 256, 10, &depth, &mesh);
    compare(&mesh, &depth, &wrong);
    /* The step is 261 pixels long: at most one wrong pixel on each side of it, on average. */
    assert_true(wrong * 320 * 256 < 2 * 261);
    assert_int_equal(lumi_mesh_rasterize(&mesh, 320, 256, &dense), LUMI_OK);
    long between = 0;
    for (int y = 0; y < 256; y++)
        for (int x = 0; x < 320; x++)
            between += lumi_row_f32(&dense, y)[x] > 0.3f && lumi_row_f32(&dense, y)[x] < 0.7f;
    assert_true(between < 261 * 3 / 2); /* the sheet between both sides is thin */
    lumi_raster_finish(&dense);
    lumi_view_mesh_finish(&mesh);
    lumi_raster_finish(&depth);
}

static void more_triangles_mean_less_error(void **state)
{
    double last = INFINITY;

    (void)state;
    for (int k = 0; k < 4; k++) {
        const double triangles[] = {2, 6, 10, 20};
        struct lumi_raster depth;
        struct lumi_view_mesh mesh;
        simplify(clutter, 320, 256, triangles[k], &depth, &mesh);
        const double error = compare(&mesh, &depth, NULL);
        assert_true(triangles_of(&mesh) <= triangles[k] * mesh.cols * mesh.rows);
        assert_true(error < 0.9 * last);
        last = error;
        lumi_view_mesh_finish(&mesh);
        lumi_raster_finish(&depth);
    }
    assert_true(last < 0.9);
}

static void the_same_depth_gives_the_same_bytes(void **state)
{
    struct lumi_writer writers[2];

    (void)state;
    for (int k = 0; k < 2; k++) {
        struct lumi_raster depth;
        struct lumi_view_mesh mesh;
        simplify(clutter, 320, 256, 10, &depth, &mesh);
        lumi_writer_init(&writers[k]);
        lumi_view_mesh_encode(&mesh, &writers[k]);
        lumi_view_mesh_finish(&mesh);
        lumi_raster_finish(&depth);
    }
    assert_int_equal(writers[0].size, writers[1].size);
    assert_memory_equal(writers[0].data, writers[1].data, writers[0].size);
    lumi_writer_finish(&writers[0]);
    lumi_writer_finish(&writers[1]);
}

static void a_view_survives_its_coding_in_few_bytes(void **state)
{
    (void)state;
    for (int k = 0; k < 3; k++) {
        static const int sizes[][2] = {{320, 256}, {300, 250}, {65, 1}};
        struct lumi_raster depth, dense, again;
        struct lumi_view_mesh mesh, back;
        struct lumi_writer writer;
        struct lumi_reader reader;
        struct lumi_error error;
        simplify(clutter, sizes[k][0], sizes[k][1], 10, &depth, &mesh);
        lumi_writer_init(&writer);
        lumi_view_mesh_encode(&mesh, &writer);
        assert_int_equal(writer.data[0], 1); /* the compact form */
        assert_true(writer.size < 30u + 22u * (size_t)(mesh.cols * mesh.rows));
        lumi_reader_init(&reader, writer.data, writer.size);
        assert_int_equal(lumi_view_mesh_decode(&reader, mesh.cols, mesh.rows, &back, &error), LUMI_OK);
        assert_covers(&back, sizes[k][0], sizes[k][1]);
        assert_no_cracks(&back);
        assert_int_equal(triangles_of(&back), triangles_of(&mesh));
        assert_int_equal(lumi_mesh_rasterize(&mesh, depth.width, depth.height, &dense), LUMI_OK);
        assert_int_equal(lumi_mesh_rasterize(&back, depth.width, depth.height, &again), LUMI_OK);
        for (int y = 0; y < depth.height; y++)
            for (int x = 0; x < depth.width; x++)
                assert_true(fabsf(lumi_row_f32(&dense, y)[x] - lumi_row_f32(&again, y)[x]) < 1e-5f);
        lumi_writer_finish(&writer);
        lumi_view_mesh_finish(&mesh);
        lumi_view_mesh_finish(&back);
        lumi_raster_finish(&dense);
        lumi_raster_finish(&again);
        lumi_raster_finish(&depth);
    }
}

static void nonsense_in_a_depth_map_becomes_infinity(void **state)
{
    struct lumi_simplify_options options;
    struct lumi_grid grid;
    struct lumi_raster depth;
    struct lumi_view_mesh mesh;
    struct lumi_error error;

    (void)state;
    paint(plane, 128, 128, &grid, &depth);
    for (int i = 0; i < 128; i++) {
        lumi_row_f32(&depth, i)[i] = NAN;
        lumi_row_f32(&depth, i)[127 - i] = i % 2 ? -5 : INFINITY;
        lumi_row_f32(&depth, 64)[i] = -INFINITY;
        lumi_row_f32(&depth, 10)[i] = 1e30f;
    }
    lumi_simplify_defaults(&options);
    assert_int_equal(lumi_simplify(&depth, NULL, &grid, &options, &mesh, &error), LUMI_OK);
    assert_covers(&mesh, 128, 128);
    assert_true(isfinite(mesh.w_min) && mesh.w_min >= 0 && mesh.w_step < 1);
    lumi_view_mesh_finish(&mesh);
    options.triangles_per_tile = 1;
    assert_int_equal(lumi_simplify(&depth, NULL, &grid, &options, &mesh, &error), LUMI_ERR_ARG);
    options.triangles_per_tile = 10;
    depth.width--;
    assert_int_equal(lumi_simplify(&depth, NULL, &grid, &options, &mesh, &error), LUMI_ERR_ARG);
    depth.width++;
    lumi_alloc_fail_after(2);
    assert_int_equal(lumi_simplify(&depth, NULL, &grid, &options, &mesh, &error), LUMI_ERR_NOMEM);
    lumi_alloc_fail_after(-1);
    lumi_raster_finish(&depth);
}

static void half_resolution_keeps_steps_and_directions(void **state)
{
    struct lumi_grid grid, half;
    struct lumi_raster depth, small;
    double tan_x, tan_y, x, y;

    (void)state;
    assert_true(lumi_grid_init_equiangular(&grid, 320, 256, 1.9, 1.5));
    assert_true(lumi_grid_init_half(&half, &grid));
    assert_int_equal(half.width, 160);
    assert_int_equal(half.cols, 3);
    lumi_grid_unproject(&half, 128, 64, &tan_x, &tan_y); /* a corner of tiles in both */
    assert_true(lumi_grid_project(&grid, lumi_vec3(tan_x, tan_y, 1), &x, &y));
    assert_true(fabs(x - 256) < 1e-9 && fabs(y - 128) < 1e-9);
    assert_int_equal(lumi_raster_create(&depth, 320, 256, 1, LUMI_F32), LUMI_OK);
    for (y = 0; y < 256; y++)
        for (x = 0; x < 320; x++)
            lumi_row_f32(&depth, (int)y)[(int)x] = x < 111 ? 0.25f : 0.75f;
    assert_int_equal(lumi_halve_inverse_depth(&depth, &grid, &half, &small), LUMI_OK);
    for (int j = 0; j < 128; j++)
        for (int i = 0; i < 160; i++)
            assert_true(lumi_row_f32(&small, j)[i] == 0.25f || lumi_row_f32(&small, j)[i] == 0.75f);
    lumi_raster_finish(&depth);
    lumi_raster_finish(&small);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_plane_takes_two_triangles_a_tile_and_is_met_to_the_quantisation),
        cmocka_unit_test(tiles_are_covered_and_meet_without_cracks_whatever_the_size),
        cmocka_unit_test(a_step_is_kept_as_a_step),
        cmocka_unit_test(more_triangles_mean_less_error),
        cmocka_unit_test(the_same_depth_gives_the_same_bytes),
        cmocka_unit_test(a_view_survives_its_coding_in_few_bytes),
        cmocka_unit_test(nonsense_in_a_depth_map_becomes_infinity),
        cmocka_unit_test(half_resolution_keeps_steps_and_directions),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
