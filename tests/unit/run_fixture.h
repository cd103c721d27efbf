/* What tests of the pipeline share: a capture whose pictures are only names, in a scratch folder. */
#ifndef LUMI_TESTS_UNIT_RUN_FIXTURE_H
#define LUMI_TESTS_UNIT_RUN_FIXTURE_H

#include "proto/capture/capture.h"

#include <glib.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

struct run_fixture {
    int width, height;
    int images, columns; /* in the order of rows */
    int posed;           /* the first so many have a pose */
    struct lumi_pose (*pose)(int row, int column);
};

/* For fixtures to which no pose matters but that each is another: columns along x, rows along z, looking along y. */
static inline struct lumi_pose wall_pose(int row, int column)
{
    struct lumi_pose pose;

    lumi_pose_look(lumi_vec3(column, 0, row), lumi_vec3(0.1, 1, 0), lumi_vec3(0, 0, 1), &pose);
    return pose;
}

/* "<folder>/capture", views "view00" and on; the folder is released by remove_run_fixture. */
static inline char *make_run_fixture(const struct run_fixture *fixture)
{
    char *folder = g_dir_make_tmp("lumi-run-XXXXXX", NULL);
    g_autofree char *path = g_build_filename(folder, "capture", NULL);
    struct lumi_capture_lens lens = {.name = "lens"};
    struct lumi_error error = {0};
    struct lumi_capture *capture;
    int64_t lens_id, camera, frame;

    lumi_lens_init_pinhole(&lens.lens, fixture->width, fixture->height, 1);
    assert_int_equal(lumi_capture_create(path, &capture, &error), LUMI_OK);
    assert_int_equal(lumi_capture_add_lens(capture, &lens, &lens_id, &error), LUMI_OK);
    assert_int_equal(lumi_capture_add_camera(capture, "camera", lens_id, &camera, &error), LUMI_OK);
    assert_int_equal(lumi_capture_begin(capture, &error), LUMI_OK);
    for (int i = 0; i < fixture->images; i++) {
        int row = i / fixture->columns, column = i % fixture->columns;
        g_autofree char *name = g_strdup_printf("view%02d", i);
        const struct lumi_capture_new_frame new_frame = {.name = name, .camera = camera, .row = row, .column = column};
        const struct lumi_capture_file file = {
            .extension = ".png", .width = fixture->width, .height = fixture->height, .camera_time_us = LUMI_NO_TIME};
        struct lumi_pose pose = fixture->pose(row, column);
        assert_int_equal(lumi_capture_add_frame(capture, &new_frame, &frame, &error), LUMI_OK);
        assert_int_equal(lumi_capture_store_bytes(capture, frame, name, strlen(name), &file, &error), LUMI_OK);
        if (i < fixture->posed)
            assert_int_equal(lumi_capture_set_pose(capture, frame, &pose, LUMI_POSE_TRUE, "test", &error), LUMI_OK);
    }
    assert_int_equal(lumi_capture_commit(capture, &error), LUMI_OK);
    assert_int_equal(lumi_capture_publish(capture, NULL, &error), LUMI_OK);
    lumi_capture_close(capture);
    return folder;
}

static inline int remove_run_fixture(char *folder)
{
    g_autofree char *command = g_strdup_printf("rm -rf '%s'", folder);

    g_free(folder);
    return g_spawn_command_line_sync(command, NULL, NULL, NULL, NULL) ? 0 : 1;
}

#endif
