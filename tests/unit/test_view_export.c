/* Depth and meshes of a view as other programs get them. */
#include "pipeline/exchange/view_export.h"
#include "proto/base/file.h"
#include "proto/base/memory.h"
#include "proto/image/image.h"
#include "proto/lightfield/mesh_raster.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

static struct lumi_error error;

/* Two tiles side by side, each of two triangles: inverse depth rises from left to right, code = 2 · pixel. */
static void make_mesh(struct lumi_grid *grid, struct lumi_view_mesh *mesh)
{
    static const uint8_t corners[4][2] = {{0, 0}, {255, 0}, {0, 255}, {255, 255}};
    static const uint16_t indices[6] = {0, 1, 2, 1, 3, 2};
    const int vertices[2] = {4, 4}, triangles[2] = {2, 2};

    assert_true(lumi_grid_init_pinhole(grid, 128, 64, 100, 100, 64, 32));
    assert_int_equal(lumi_view_mesh_create(mesh, 2, 1, vertices, triangles), LUMI_OK);
    mesh->w_min = 0;
    mesh->w_step = 1.0f / 512;
    for (int i = 0; i < 2; i++) {
        mesh->tiles[i].base = (uint16_t)(128 * i);
        for (int v = 0; v < 4; v++)
            lumi_mesh_vertices(mesh, i)[v] =
                (struct lumi_mesh_vertex){corners[v][0], corners[v][1], corners[v][0] ? 128 : 0};
        memcpy(lumi_mesh_indices(mesh, i), indices, sizeof indices);
    }
}

static void a_mesh_becomes_the_depth_it_describes(void **state)
{
    char path[] = "lumi-test-depth-XXXXXX";
    struct lumi_grid grid;
    struct lumi_view_mesh mesh;
    struct lumi_raster inverse, depth;

    (void)state;
    close(mkstemp(path));
    make_mesh(&grid, &mesh);
    assert_int_equal(lumi_mesh_rasterize(&mesh, grid.width, grid.height, &inverse), LUMI_OK);
    assert_int_equal(inverse.width, 128);
    for (int y = 0; y < 64; y++)
        for (int x = 0; x < 128; x++)
            assert_true(fabsf(lumi_row_f32(&inverse, y)[x] - (float)(2 * x + 1) / 512) < 1e-6f);
    assert_int_equal(lumi_export_depth(path, &inverse, &error), LUMI_OK);
    assert_int_equal(lumi_image_read_channel(path, "Z", &depth, &error), LUMI_OK);
    assert_true(fabsf(lumi_row_f32(&depth, 9)[50] - 512.0f / 101) < 1e-4f);
    lumi_raster_finish(&inverse);
    lumi_raster_finish(&depth);
    lumi_view_mesh_finish(&mesh);
    unlink(path);
}

static void infinity_and_nothing_stay_what_they_are(void **state)
{
    char path[] = "lumi-test-depth-XXXXXX";
    struct lumi_raster inverse, depth;

    (void)state;
    close(mkstemp(path));
    assert_int_equal(lumi_raster_create(&inverse, 3, 1, 1, LUMI_F32), LUMI_OK);
    lumi_row_f32(&inverse, 0)[1] = NAN;
    lumi_row_f32(&inverse, 0)[2] = 4;
    assert_int_equal(lumi_export_depth(path, &inverse, &error), LUMI_OK);
    assert_int_equal(lumi_image_read_channel(path, "Z", &depth, &error), LUMI_OK);
    assert_true(isinf(lumi_row_f32(&depth, 0)[0]) && isnan(lumi_row_f32(&depth, 0)[1]));
    assert_true(lumi_row_f32(&depth, 0)[2] == 0.25f);
    lumi_raster_finish(&inverse);
    lumi_raster_finish(&depth);
    unlink(path);
}

static void nearer_surfaces_hide_farther_ones(void **state)
{
    struct lumi_grid grid;
    struct lumi_view_mesh mesh;
    struct lumi_raster inverse;

    (void)state;
    make_mesh(&grid, &mesh);
    /* The second triangle of the first tile now covers the same place as the first, at one depth. */
    const uint16_t again[3] = {0, 1, 2};
    memcpy(lumi_mesh_indices(&mesh, 0) + 3, again, sizeof again);
    assert_int_equal(lumi_mesh_rasterize(&mesh, grid.width, grid.height, &inverse), LUMI_OK);
    assert_true(isnan(lumi_row_f32(&inverse, 60)[60]));
    assert_true(fabsf(lumi_row_f32(&inverse, 3)[3] - 7.0f / 512) < 1e-6f);
    lumi_raster_finish(&inverse);
    lumi_view_mesh_finish(&mesh);
}

static float float_at(const uint8_t *data)
{
    struct lumi_reader reader;

    lumi_reader_init(&reader, data, 4);
    return lumi_read_f32(&reader);
}

static void a_ply_file_holds_the_mesh_in_the_world(void **state)
{
    char path[] = "lumi-test-mesh-XXXXXX";
    const struct lumi_pose pose = {{1, 0, 0, 0, 0, 1, 0, -1, 0}, {10, 20, 30}};
    struct lumi_grid grid;
    struct lumi_view_mesh mesh;
    struct lumi_raster image;
    uint8_t *data;
    size_t size;

    (void)state;
    close(mkstemp(path));
    make_mesh(&grid, &mesh);
    assert_int_equal(lumi_raster_create(&image, 128, 64, 3, LUMI_U8), LUMI_OK);
    lumi_row_u8(&image, 63)[3 * 127 + 1] = 200;
    assert_int_equal(lumi_export_mesh(path, &grid, &pose, &mesh, &image, 50, &error), LUMI_OK);
    assert_int_equal(lumi_file_read(path, 1 << 20, &data, &size, &error), LUMI_OK);
    assert_memory_equal(data, "ply\nformat binary_little_endian 1.0\n", 36);
    assert_non_null(strstr((const char *)data, "element vertex 8\n"));
    assert_non_null(strstr((const char *)data, "element face 4\n"));
    const uint8_t *body = (const uint8_t *)strstr((const char *)data, "end_header\n") + 11;
    assert_int_equal(size - (size_t)(body - data), 8 * (5 * 4 + 3) + 4 * 13);
    /* The first vertex is at infinity, so at 50 m: left, up and ahead, ahead being the world's y. */
    assert_true(fabsf(float_at(body) - (10 - 32)) < 1e-4f && fabsf(float_at(body + 4) - 70) < 1e-4f);
    assert_true(fabsf(float_at(body + 8) - (30 + 16)) < 1e-4f);
    /* The last is at the image's lower right corner, 2 m ahead. */
    const uint8_t *last = body + 7 * 23;
    assert_true(fabsf(float_at(last) - 11.28f) < 1e-4f && fabsf(float_at(last + 4) - 22) < 1e-4f);
    assert_true(float_at(last + 12) == 1 && float_at(last + 16) == 1);
    assert_int_equal(last[21], 200);
    lumi_free(data);
    lumi_raster_finish(&image);
    lumi_view_mesh_finish(&mesh);
    unlink(path);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_mesh_becomes_the_depth_it_describes),
        cmocka_unit_test(infinity_and_nothing_stay_what_they_are),
        cmocka_unit_test(nearer_surfaces_hide_farther_ones),
        cmocka_unit_test(a_ply_file_holds_the_mesh_in_the_world),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
