/* pipeline/geometry/disks: the surface of the centres, the camera mesh, the disks' extents. */
#include "pipeline/geometry/disks.h"
#include "proto/base/memory.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#define ROWS 8
#define COLS 24

/* An outward sphere of radius 0.35 about (1, 2, 3), rows at even elevations within ±75°. */
static void make_sphere(struct lumi_pose *poses)
{
    for (int r = 0; r < ROWS; r++)
        for (int c = 0; c < COLS; c++) {
            double e = (75 - 150.0 * r / (ROWS - 1)) * LUMI_PI / 180, a = 2 * LUMI_PI * c / COLS;
            struct lumi_vec3 d = lumi_vec3(cos(e) * cos(a), cos(e) * sin(a), sin(e));
            lumi_pose_look(lumi_add(lumi_vec3(1, 2, 3), lumi_scale(d, 0.35)), d, lumi_vec3(0, 0, 1),
                           &poses[r * COLS + c]);
        }
}

static void make_grid(struct lumi_pose *poses, int rows, int cols, double dx, double dy)
{
    for (int r = 0; r < rows; r++)
        for (int c = 0; c < cols; c++)
            lumi_pose_look(lumi_vec3(c * dx, 5, -r * dy), lumi_vec3(0, 1, 0), lumi_vec3(0, 0, 1), &poses[r * cols + c]);
}

static void a_sphere_is_fitted_to_its_centre_and_radius(void **state)
{
    struct lumi_pose poses[ROWS * COLS];
    enum lumi_surface surface;
    struct lumi_vec3 centre;
    double radius;

    (void)state;
    make_sphere(poses);
    lumi_surface_fit(ROWS * COLS, poses, &surface, &centre, &radius);
    assert_int_equal(surface, LUMI_SURFACE_SPHERE);
    assert_true(lumi_length(lumi_sub(centre, lumi_vec3(1, 2, 3))) < 1e-9);
    assert_true(fabs(radius - 0.35) < 1e-9);
}

static void a_grid_is_a_plane_and_a_ring_is_a_sphere(void **state)
{
    struct lumi_pose poses[72];
    enum lumi_surface surface;
    struct lumi_vec3 centre;
    double radius;

    (void)state;
    make_grid(poses, 4, 5, 0.1, 0.2);
    lumi_surface_fit(20, poses, &surface, &centre, &radius);
    assert_int_equal(surface, LUMI_SURFACE_PLANE);
    assert_true(lumi_length(lumi_sub(centre, lumi_vec3(0.2, 5, -0.3))) < 1e-9);
    for (int i = 0; i < 72; i++) {
        double a = 2 * LUMI_PI * i / 72;
        lumi_pose_look(lumi_vec3(0.3 * cos(a), 0.3 * sin(a), 0), lumi_vec3(cos(a), sin(a), 0), lumi_vec3(0, 0, 1),
                       &poses[i]);
    }
    lumi_surface_fit(72, poses, &surface, &centre, &radius);
    assert_int_equal(surface, LUMI_SURFACE_SPHERE);
    assert_true(fabs(radius - 0.3) < 1e-9);
}

static void cameras_on_a_line_or_in_one_place_are_a_plane(void **state)
{
    struct lumi_pose poses[9];
    struct lumi_disk disks[9];
    enum lumi_surface surface;
    struct lumi_vec3 centre;
    double radius;

    (void)state;
    for (int slope = 0; slope < 3; slope++) { /* a slider that runs along an axis, or aslant, wherever it stands */
        for (int i = 0; i < 9; i++)
            lumi_pose_look(lumi_vec3(7 + 0.05 * i, 0.01 * slope * i, -0.02 * slope * i), lumi_vec3(0, 1, 0),
                           lumi_vec3(0, 0, 1), &poses[i]);
        lumi_surface_fit(9, poses, &surface, &centre, &radius);
        assert_int_equal(surface, LUMI_SURFACE_PLANE);
        assert_int_equal(lumi_disks_make(9, poses, surface, centre, radius, 1, disks, NULL), LUMI_OK);
        for (int i = 0; i < 9; i++)
            assert_true(fabsf(disks[i].u_pos - 0.05f) < 1e-6f && fabsf(disks[i].u_neg - 0.05f) < 1e-6f);
    }
    for (int i = 0; i < 9; i++)
        poses[i] = poses[1];
    lumi_surface_fit(9, poses, &surface, &centre, &radius);
    assert_int_equal(surface, LUMI_SURFACE_PLANE);
    assert_true(radius == 0);
}

static void the_camera_mesh_of_a_grid_covers_it_once(void **state)
{
    struct lumi_pose poses[20];
    int *triangles, count;
    double area = 0;

    (void)state;
    make_grid(poses, 4, 5, 0.1, 0.2);
    assert_int_equal(
        lumi_camera_triangles(20, poses, LUMI_SURFACE_PLANE, lumi_vec3(0.2, 5, -0.3), &triangles, &count, NULL),
        LUMI_OK);
    assert_int_equal(count, 2 * 3 * 4);
    for (int i = 0; i < count; i++) {
        struct lumi_vec3 a = poses[triangles[3 * i]].t, b = poses[triangles[3 * i + 1]].t,
                         c = poses[triangles[3 * i + 2]].t;
        area += lumi_length(lumi_cross(lumi_sub(b, a), lumi_sub(c, a))) / 2;
    }
    assert_true(fabs(area - 0.4 * 0.6) < 1e-9);
    lumi_free(triangles);
}

static void the_camera_mesh_of_a_sphere_is_closed(void **state)
{
    struct lumi_pose poses[ROWS * COLS];
    int *triangles, count;

    (void)state;
    make_sphere(poses);
    assert_int_equal(
        lumi_camera_triangles(ROWS * COLS, poses, LUMI_SURFACE_SPHERE, lumi_vec3(1, 2, 3), &triangles, &count, NULL),
        LUMI_OK);
    assert_int_equal(count, 2 * ROWS * COLS - 4); /* Euler */
    lumi_free(triangles);
}

static void disks_of_a_grid_reach_the_neighbours_and_borders_mirror(void **state)
{
    struct lumi_pose poses[20];
    struct lumi_disk disks[20];

    (void)state;
    make_grid(poses, 4, 5, 0.1, 0.2);
    assert_int_equal(lumi_disks_make(20, poses, LUMI_SURFACE_PLANE, lumi_vec3(0.2, 5, -0.3), 1, 1.5, disks, NULL),
                     LUMI_OK);
    for (int i = 0; i < 20; i++) {
        assert_true(fabsf(disks[i].u_neg - 0.15f) < 1e-6f && fabsf(disks[i].u_pos - 0.15f) < 1e-6f);
        assert_true(fabsf(disks[i].v_neg - 0.3f) < 1e-6f && fabsf(disks[i].v_pos - 0.3f) < 1e-6f);
    }
}

/* Every direction from the centre must meet some disk with weight: no holes between rows, columns, or at the poles. */
static void disks_of_a_sphere_leave_no_hole(void **state)
{
    struct lumi_pose poses[ROWS * COLS];
    struct lumi_disk disks[ROWS * COLS];

    (void)state;
    make_sphere(poses);
    assert_int_equal(lumi_disks_make(ROWS * COLS, poses, LUMI_SURFACE_SPHERE, lumi_vec3(1, 2, 3), 0.35, 1, disks, NULL),
                     LUMI_OK);
    for (int n = 0; n < 2000; n++) {
        double z = 1 - (n + 0.5) / 1000, a = n * 2.399963, s = sqrt(1 - z * z), sum = 0;
        struct lumi_vec3 e = lumi_vec3(s * cos(a), s * sin(a), z);
        for (int i = 0; i < ROWS * COLS; i++) {
            struct lumi_vec3 f = lumi_rotate_back(poses[i].r, e);
            struct lumi_vec3 o = lumi_to_camera(&poses[i], lumi_vec3(1, 2, 3));
            if (f.z > 0.1)
                sum += lumi_disk_weight(&disks[i], LUMI_DISK_OVAL, LUMI_KERNEL_LINEAR, 1,
                                        (float)(o.x - o.z * f.x / f.z), (float)(o.y - o.z * f.y / f.z));
        }
        assert_true(sum > 0.05);
    }
}

static void few_cameras_still_get_disks(void **state)
{
    struct lumi_pose poses[3];
    struct lumi_disk disks[3];

    (void)state;
    make_grid(poses, 1, 3, 0.1, 0.2);
    for (int count = 1; count <= 3; count++) {
        assert_int_equal(lumi_disks_make(count, poses, LUMI_SURFACE_PLANE, lumi_vec3(0.1, 5, 0), 0.1, 1, disks, NULL),
                         LUMI_OK);
        for (int i = 0; i < count; i++)
            assert_true(disks[i].u_neg > 0.01f && disks[i].u_pos > 0.01f && disks[i].v_neg > 0.01f &&
                        disks[i].v_pos > 0.01f);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_sphere_is_fitted_to_its_centre_and_radius),
        cmocka_unit_test(a_grid_is_a_plane_and_a_ring_is_a_sphere),
        cmocka_unit_test(cameras_on_a_line_or_in_one_place_are_a_plane),
        cmocka_unit_test(the_camera_mesh_of_a_grid_covers_it_once),
        cmocka_unit_test(the_camera_mesh_of_a_sphere_is_closed),
        cmocka_unit_test(disks_of_a_grid_reach_the_neighbours_and_borders_mirror),
        cmocka_unit_test(disks_of_a_sphere_leave_no_hole),
        cmocka_unit_test(few_cameras_still_get_disks),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
