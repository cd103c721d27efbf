/* pipeline/evaluate: poses from words, eyes; pipeline/exchange: films. */
#include "pipeline/evaluate/shots.h"
#include "pipeline/exchange/video.h"
#include "proto/base/file.h"
#include "proto/base/memory.h"
#include "synthetic_field.h"

#include <glib.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

static void assert_vector(struct lumi_vec3 v, double x, double y, double z)
{
    if (lumi_length(lumi_sub(v, lumi_vec3(x, y, z))) > 1e-9)
        fail_msg("(%g %g %g) is not (%g %g %g)", v.x, v.y, v.z, x, y, z);
}

static void yaw_pitch_and_roll_turn_the_camera_as_documented(void **state)
{
    struct lumi_pose pose;
    const double h = sqrt(0.5);

    (void)state;
    assert_int_equal(lumi_pose_parse("1,2,3,0,0", &pose, NULL), LUMI_OK);
    assert_vector(pose.t, 1, 2, 3);
    assert_vector(lumi_axis(&pose, 2), 1, 0, 0);
    assert_vector(lumi_axis(&pose, 1), 0, 0, -1);
    assert_true(lumi_pose_valid(&pose, 1e-12));
    assert_int_equal(lumi_pose_parse("0,0,0,90,45", &pose, NULL), LUMI_OK);
    assert_vector(lumi_axis(&pose, 2), 0, h, h);
    /* Straight down with the picture's top towards +Y. */
    assert_int_equal(lumi_pose_parse("0,0,0,90,-90", &pose, NULL), LUMI_OK);
    assert_vector(lumi_axis(&pose, 2), 0, 0, -1);
    assert_vector(lumi_axis(&pose, 1), 0, -1, 0);
    /* Turned clockwise, what was right of the camera lies at its top: its right now points down. */
    assert_int_equal(lumi_pose_parse("0,0,0,0,0,90", &pose, NULL), LUMI_OK);
    assert_vector(lumi_axis(&pose, 0), 0, 0, -1);
    assert_vector(lumi_axis(&pose, 2), 1, 0, 0);
}

static void a_described_pose_is_read_back(void **state)
{
    const char *texts[] = {"0.1,-2,3.5,30,20,10", "0,0,0,-170,-60,-45", "1,1,1,45,-90,0", "1,1,1,45,90,0"};

    (void)state;
    for (int i = 0; i < 4; i++) {
        struct lumi_pose a, b;
        double n[6];
        assert_int_equal(lumi_pose_parse(texts[i], &a, NULL), LUMI_OK);
        lumi_pose_describe(&a, n);
        g_autofree char *text =
            g_strdup_printf("%.12f,%.12f,%.12f,%.12f,%.12f,%.12f", n[0], n[1], n[2], n[3], n[4], n[5]);
        assert_int_equal(lumi_pose_parse(text, &b, NULL), LUMI_OK);
        for (int k = 0; k < 9; k++)
            assert_true(fabs(a.r[k] - b.r[k]) < 1e-7);
    }
}

static void words_that_are_no_pose_are_refused(void **state)
{
    const char *texts[] = {"", "1,2,3,4", "1,2,3,4,x", "1,2,3,4,5,6,7", "1,2,3,4,nan", "1 2 3 4 5", "1,2,3,4,5,"};
    struct lumi_pose pose;
    struct lumi_error error;

    (void)state;
    for (int i = 0; i < 7; i++)
        assert_int_equal(lumi_pose_parse(texts[i], &pose, &error), LUMI_ERR_ARG);
}

static void eyes_lie_apart_along_the_picture_s_right(void **state)
{
    struct lumi_pose pose, left, right;

    (void)state;
    assert_int_equal(lumi_pose_parse("1,2,3,0,0", &pose, NULL), LUMI_OK);
    lumi_eye_pose(&pose, -1, 0.06, &left);
    lumi_eye_pose(&pose, 1, 0.06, &right);
    assert_vector(left.t, 1, 2.03, 3); /* looking along +X, left is +Y */
    assert_vector(right.t, 1, 1.97, 3);
}

static void lenses_span_the_field_of_view_that_was_asked_for(void **state)
{
    struct lumi_lens lens;
    struct lumi_vec3 d;

    (void)state;
    for (int i = 0; i < 3; i++) {
        double fov = i == 2 ? 2 * LUMI_PI : 1.5;
        assert_int_equal(lumi_output_lens((enum lumi_output_projection)i, 400, 200, fov, &lens, NULL), LUMI_OK);
        assert_true(lumi_lens_unproject(&lens, 100, 100, &d));
        double angle = atan2(-d.x, d.z);
        assert_true(fabs(i == 0 ? tan(angle) - tan(fov / 2) / 2 : angle - fov / 4) < 1e-9);
    }
    assert_int_equal(lumi_output_lens(LUMI_OUTPUT_PERSPECTIVE, 400, 200, LUMI_PI, &lens, NULL), LUMI_ERR_ARG);
    assert_int_equal(lumi_output_lens(LUMI_OUTPUT_PERSPECTIVE, 0, 200, 1, &lens, NULL), LUMI_ERR_ARG);
}

static int film(const char *path, int frames)
{
    struct lumi_video *video;
    struct lumi_raster picture;

    LUMI_TRY(lumi_video_create(path, 64, 48, 25, 30, &video, NULL));
    assert_int_equal(lumi_raster_create(&picture, 64, 48, 3, LUMI_U8), LUMI_OK);
    for (int i = 0; i < frames; i++) {
        for (int y = 0; y < 48; y++)
            for (int x = 0; x < 3 * 64; x++)
                lumi_row_u8(&picture, y)[x] = (uint8_t)(x + 3 * y + 5 * i);
        assert_int_equal(lumi_video_add(video, &picture, NULL), LUMI_OK);
    }
    lumi_raster_finish(&picture);
    return lumi_video_finish(video, NULL);
}

static void the_same_pictures_make_the_same_film(void **state)
{
    g_autofree char *folder = g_dir_make_tmp("film-XXXXXX", NULL);
    g_autofree char *a = g_build_filename(folder, "a.webm", NULL), *b = g_build_filename(folder, "b.webm", NULL);
    uint8_t *bytes[2];
    size_t sizes[2];

    (void)state;
    assert_int_equal(film(a, 20), LUMI_OK);
    assert_int_equal(film(b, 20), LUMI_OK);
    assert_int_equal(lumi_file_read(a, 1 << 20, &bytes[0], &sizes[0], NULL), LUMI_OK);
    assert_int_equal(lumi_file_read(b, 1 << 20, &bytes[1], &sizes[1], NULL), LUMI_OK);
    assert_int_equal(sizes[0], sizes[1]);
    assert_memory_equal(bytes[0], bytes[1], sizes[0]);
    assert_memory_equal(bytes[0], "\x1a\x45\xdf\xa3", 4); /* EBML */
    assert_true(g_strstr_len((const char *)bytes[0], 64, "webm") != NULL);
    lumi_free(bytes[0]);
    lumi_free(bytes[1]);
    unlink(a);
    unlink(b);
    assert_int_equal(rmdir(folder), 0);
}

static void an_abandoned_film_leaves_nothing(void **state)
{
    g_autofree char *folder = g_dir_make_tmp("film-XXXXXX", NULL);
    g_autofree char *path = g_build_filename(folder, "a.webm", NULL);
    g_autofree char *nowhere = g_build_filename(folder, "no", "a.webm", NULL);
    struct lumi_video *video;
    struct lumi_error error = {0};

    (void)state;
    assert_int_equal(lumi_video_create(path, 64, 48, 25, 30, &video, NULL), LUMI_OK);
    lumi_video_abandon(video);
    assert_true(lumi_video_create(nowhere, 64, 48, 25, 30, &video, &error) != LUMI_OK);
    assert_non_null(strstr(error.text, nowhere));
    assert_int_equal(rmdir(folder), 0); /* empty */
}

/* The synthetic views' pictures have their tops towards −Y, as those of a COLMAP model mostly do. */
static void paths_about_a_sphere_stand_as_upright_as_its_views(void **state)
{
    struct synthetic_options options = {2, 64, 64, 4, 20, 0, 0};
    struct lumi_field_content content;
    struct synthetic_field *synthetic;
    struct lumi_field *field;
    struct lumi_writer bytes;
    struct lumi_pose pose;

    (void)state;
    lumi_writer_init(&bytes);
    assert_int_equal(synthetic_field_create(&options, &synthetic, NULL), LUMI_OK);
    synthetic_field_content(synthetic, &content);
    content.surface = LUMI_SURFACE_SPHERE;
    content.centre = lumi_vec3(1, 2, 3);
    content.radius = 0.5;
    assert_int_equal(lumi_field_write_memory(&content, &bytes, NULL), LUMI_OK);
    assert_int_equal(lumi_field_open_memory(bytes.data, bytes.size, "test", 1, &field, NULL), LUMI_OK);
    for (int i = 0; i < 10; i++) {
        lumi_path_pose(field, i < 5 ? LUMI_PATH_ORBIT : LUMI_PATH_DOLLY, i, 5, &pose);
        assert_true(lumi_pose_valid(&pose, 1e-9));
        assert_vector(lumi_axis(&pose, 1), 0, 1, 0);
        assert_true(fabs(pose.t.y - 2) < 1e-9);
    }
    lumi_field_close(field);
    synthetic_field_finish(synthetic);
    lumi_writer_finish(&bytes);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(yaw_pitch_and_roll_turn_the_camera_as_documented),
        cmocka_unit_test(a_described_pose_is_read_back),
        cmocka_unit_test(words_that_are_no_pose_are_refused),
        cmocka_unit_test(eyes_lie_apart_along_the_picture_s_right),
        cmocka_unit_test(lenses_span_the_field_of_view_that_was_asked_for),
        cmocka_unit_test(the_same_pictures_make_the_same_film),
        cmocka_unit_test(an_abandoned_film_leaves_nothing),
        cmocka_unit_test(paths_about_a_sphere_stand_as_upright_as_its_views),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
