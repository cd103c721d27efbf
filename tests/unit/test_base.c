/* proto/base: what everything else stands on. */
#include "proto/base/bytes.h"
#include "proto/base/file.h"
#include "proto/base/geometry.h"
#include "proto/base/lens.h"
#include "proto/base/memory.h"
#include "proto/base/parallel.h"
#include "proto/base/raster.h"
#include "proto/base/result.h"

#include <dirent.h>
#include <errno.h>
#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmocka.h>

static void crc32c_gives_the_published_check_value(void **state)
{
    (void)state;
    assert_int_equal(lumi_crc32c(0, "123456789", 9), 0xe3069283u);
    assert_int_equal(lumi_crc32c(lumi_crc32c(0, "1234", 4), "56789", 5), 0xe3069283u);
}

static void a_reader_past_its_end_gives_zeros_and_stays_failed(void **state)
{
    const uint8_t bytes[] = {1, 2, 3};
    struct lumi_reader reader;

    (void)state;
    lumi_reader_init(&reader, bytes, sizeof bytes);
    assert_int_equal(lumi_read_u16(&reader), 0x0201);
    assert_int_equal(lumi_read_u32(&reader), 0);
    assert_true(reader.failed);
    assert_int_equal(lumi_read_u8(&reader), 0);
    assert_int_equal(lumi_reader_left(&reader), 0);
}

static void varints_survive_the_round_trip_and_overlong_ones_are_refused(void **state)
{
    const uint64_t values[] = {0, 1, 127, 128, 300, UINT32_MAX, UINT64_MAX};
    const uint8_t overlong[] = {0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0x02};
    struct lumi_writer writer;
    struct lumi_reader reader;

    (void)state;
    lumi_writer_init(&writer);
    for (unsigned i = 0; i < 7; i++)
        lumi_write_varint(&writer, values[i]);
    lumi_reader_init(&reader, writer.data, writer.size);
    for (unsigned i = 0; i < 7; i++)
        assert_true(lumi_read_varint(&reader) == values[i]);
    assert_false(reader.failed);
    lumi_writer_finish(&writer);
    lumi_reader_init(&reader, overlong, sizeof overlong);
    lumi_read_varint(&reader);
    assert_true(reader.failed);
    for (int64_t v = -5; v <= 5; v++)
        assert_true(lumi_unzigzag(lumi_zigzag(v)) == v);
}

static void allocation_refuses_overflow_and_fails_when_told(void **state)
{
    (void)state;
    assert_null(lumi_alloc(SIZE_MAX / 2, 4));
    lumi_alloc_fail_after(1);
    void *first = lumi_alloc(1, 1), *second = lumi_alloc(1, 1), *third = lumi_calloc(1, 1);
    lumi_alloc_fail_after(-1);
    assert_non_null(first);
    assert_null(second);
    assert_null(third);
    lumi_free(first);
}

static void errors_name_the_file_and_map_to_the_exit_status(void **state)
{
    struct lumi_error error;

    (void)state;
    errno = ENOSPC;
    assert_int_equal(lumi_fail_errno(&error, "x.lumi", "write"), LUMI_ERR_NOSPACE);
    assert_string_equal(error.text, "x.lumi: write: No space left on device");
    lumi_fail_prefix(&error, "%s", "process");
    assert_string_equal(error.text, "process: x.lumi: write: No space left on device");
    assert_int_equal(lumi_exit_status(LUMI_ERR_NOSPACE), 1);
    assert_int_equal(lumi_exit_status(LUMI_ERR_ARG), 2);
    assert_int_equal(lumi_exit_status(LUMI_ERR_VERSION), 3);
    assert_int_equal(lumi_exit_status(LUMI_ERR_NOTFOUND), 3);
}

static void every_lens_projects_what_it_unprojects(void **state)
{
    const struct lumi_lens lenses[] = {
        {LUMI_LENS_BROWN, 640, 480, 500, 510, 320, 240, 0, 0, 0, 0, 0, 0},
        {LUMI_LENS_BROWN, 640, 480, 500, 510, 322, 239, -0.2, 0.05, 0.01, 0, 0.001, -0.002},
        {LUMI_LENS_FISHEYE, 640, 480, 250, 250, 320, 240, 0, 0, 0, 0, 0, 0},
        {LUMI_LENS_FISHEYE, 640, 480, 250, 252, 321, 238, -0.03, 0.01, -0.004, 0.0007, 0, 0},
        {LUMI_LENS_EQUIRECTANGULAR, 640, 320, 640 / (2 * LUMI_PI), 640 / (2 * LUMI_PI), 320, 160, 0, 0, 0, 0, 0, 0},
    };

    (void)state;
    for (unsigned i = 0; i < sizeof lenses / sizeof *lenses; i++)
        for (int y = 0; y <= lenses[i].height; y += 40)
            for (int x = 1; x < lenses[i].width; x += 53) {
                struct lumi_vec3 d;
                double px, py;
                assert_true(lumi_lens_unproject(&lenses[i], x, y, &d));
                assert_true(fabs(lumi_length(d) - 1) < 1e-12);
                assert_true(lumi_lens_project(&lenses[i], d, &px, &py));
                if (i == 4 && (y == 0 || y == lenses[i].height))
                    continue; /* longitude is lost at the poles */
                assert_true(fabs(px - x) < 1e-7 && fabs(py - y) < 1e-7);
            }
}

static void a_fisheye_follows_opencvs_formula(void **state)
{
    /* θ = 0.5, k1 = 0.1: r = 0.5 (1 + 0.1 · 0.25) = 0.5125 */
    const struct lumi_lens lens = {LUMI_LENS_FISHEYE, 640, 480, 200, 300, 320, 240, 0.1, 0, 0, 0, 0, 0};
    double x, y;

    (void)state;
    assert_true(lumi_lens_project(&lens, lumi_vec3(sin(0.5), 0, cos(0.5)), &x, &y));
    assert_true(fabs(x - (320 + 200 * 0.5125)) < 1e-9 && fabs(y - 240) < 1e-9);
    assert_true(lumi_lens_project(&lens, lumi_vec3(0, sin(2.0), cos(2.0)), &x, &y)); /* behind the image plane */
}

static void a_pinhole_does_not_see_behind_itself(void **state)
{
    struct lumi_lens lens;
    double x, y;

    (void)state;
    lumi_lens_init_pinhole(&lens, 100, 100, 1);
    assert_false(lumi_lens_project(&lens, lumi_vec3(0, 0, -1), &x, &y));
    assert_false(lumi_lens_project(&lens, lumi_vec3(1, 0, 0), &x, &y));
}

static void poses_look_where_they_are_told(void **state)
{
    struct lumi_pose pose;
    double q[4], r[9];

    (void)state;
    lumi_pose_look(lumi_vec3(1, 2, 3), lumi_vec3(0, 5, 0), lumi_vec3(0, 0, 1), &pose);
    assert_true(lumi_pose_valid(&pose, 1e-12));
    assert_true(fabs(lumi_axis(&pose, 2).y - 1) < 1e-12); /* forward +y */
    assert_true(fabs(lumi_axis(&pose, 1).z + 1) < 1e-12); /* down −z */
    assert_true(fabs(lumi_axis(&pose, 0).x - 1) < 1e-12); /* right +x */
    lumi_rotation_to_quaternion(pose.r, q);
    lumi_rotation_from_quaternion(q, r);
    for (int i = 0; i < 9; i++)
        assert_true(fabs(r[i] - pose.r[i]) < 1e-12);
    pose.r[0] = NAN;
    assert_false(lumi_pose_valid(&pose, 1e-3));
    lumi_pose_look(lumi_vec3(0, 0, 0), lumi_vec3(0, 0, 1), lumi_vec3(0, 0, 1), &pose);
    assert_true(lumi_pose_valid(&pose, 1e-12));
    pose.r[0] = -pose.r[0], pose.r[3] = -pose.r[3], pose.r[6] = -pose.r[6]; /* a mirror */
    assert_false(lumi_pose_valid(&pose, 1e-3));
}

static void rasters_convert_there_and_back_without_loss(void **state)
{
    struct lumi_raster bytes, linear, back;

    (void)state;
    assert_int_equal(lumi_raster_create(&bytes, 256, 1, 1, LUMI_U8), LUMI_OK);
    for (int i = 0; i < 256; i++)
        lumi_row_u8(&bytes, 0)[i] = (uint8_t)i;
    assert_int_equal(lumi_raster_convert(&bytes, LUMI_F32, &linear), LUMI_OK);
    assert_int_equal(lumi_raster_convert(&linear, LUMI_U8, &back), LUMI_OK);
    assert_memory_equal(lumi_row_u8(&bytes, 0), lumi_row_u8(&back, 0), 256);
    assert_true(fabsf(lumi_row_f32(&linear, 0)[188] - 0.502886f) < 1e-5f);
    lumi_raster_finish(&bytes);
    lumi_raster_finish(&linear);
    lumi_raster_finish(&back);
    assert_int_equal(lumi_raster_create(&bytes, 0, 1, 1, LUMI_U8), LUMI_ERR_ARG);
    assert_int_equal(lumi_raster_create(&bytes, 1, LUMI_RASTER_MAX + 1, 1, LUMI_U8), LUMI_ERR_ARG);
}

static int mark(void *context, int index, int thread)
{
    int *marks = context;

    assert_in_range(thread, 0, 3);
    marks[index]++;
    return index == 70 || index == 50 ? -index : 0;
}

static int count_up(void *context, int index, int thread)
{
    (void)thread;
    ((int *)context)[index]++;
    return 0;
}

static void a_parallel_loop_visits_each_item_once_and_reports_a_failure(void **state)
{
    int marks[1000] = {0};

    (void)state;
    assert_int_equal(lumi_parallel_for(1000, 8, count_up, marks), 0);
    for (int i = 0; i < 1000; i++)
        assert_int_equal(marks[i], 1);
    memset(marks, 0, sizeof marks);
    assert_int_equal(lumi_parallel_for(1000, 4, mark, marks), -50);
    for (int i = 0; i <= 50; i++)
        assert_int_equal(marks[i], 1);
}

static void an_error_is_one_line_whatever_the_name_in_it(void **state)
{
    struct lumi_error error;

    (void)state;
    lumi_fail(&error, LUMI_ERR_FORMAT, "frame '%s' is unknown", "a\nb\x1b[2J\x7f\xc3\xa9");
    assert_string_equal(error.text, "frame 'a?b?[2J?\xc3\xa9' is unknown");
    assert_int_equal(lumi_fail_prefix(&error, "%s", "x\ry"), LUMI_ERR_FORMAT);
    assert_string_equal(error.text, "x?y: frame 'a?b?[2J?\xc3\xa9' is unknown");
}

/* A process that dies with a new file open leaves it behind. */
static void die_writing(const char *path)
{
    struct lumi_new_file file;
    pid_t child = fork();

    if (child == 0)
        _exit(lumi_new_file_open(&file, path, NULL) == LUMI_OK && write(file.fd, "half", 4) == 4 ? 0 : 1);
    int status = -1;
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_int_equal(status, 0);
}

/* Files in a folder, and how many of them begin with `begin`. */
static int count_files(const char *folder, const char *begin, int *beginning)
{
    DIR *dir = opendir(folder);
    const struct dirent *entry;
    int count = 0;

    *beginning = 0;
    assert_non_null(dir);
    while ((entry = readdir(dir)))
        if (entry->d_name[0] != '.') {
            count++;
            *beginning += !strncmp(entry->d_name, begin, strlen(begin));
        }
    closedir(dir);
    return count;
}

static void what_a_killed_writer_left_goes_with_the_next_of_that_name(void **state)
{
    char folder[] = "/tmp/lumi-base-XXXXXX", path[64], other[64], mine[96];
    struct lumi_new_file living;
    int left;

    (void)state;
    assert_non_null(mkdtemp(folder));
    snprintf(path, sizeof path, "%s/a.lumi", folder);
    snprintf(other, sizeof other, "%s/b.lumi", folder);
    die_writing(path);
    die_writing(other);
    assert_int_equal(count_files(folder, "a.lumi.tmp-", &left), 2);
    assert_int_equal(left, 1);

    assert_int_equal(lumi_new_file_open(&living, path, NULL), LUMI_OK); /* takes away the dead one's */
    assert_int_equal(count_files(folder, "a.lumi.tmp-", &left), 2);
    assert_int_equal(lumi_file_write(path, "whole", 5, false, NULL), LUMI_OK); /* leaves the living one's */
    assert_int_equal(count_files(folder, "a.lumi.tmp-", &left), 3);
    assert_int_equal(left, 1);

    /* A number that is no process's here, but a writer that holds its lock: it lives where numbers are others. */
    snprintf(mine, sizeof mine, "%s.tmp-%ld-7", path, (long)INT32_MAX);
    assert_int_equal(rename(living.temporary, mine), 0);
    assert_int_equal(lumi_file_write(path, "whole", 5, true, NULL), LUMI_OK);
    assert_int_equal(access(mine, F_OK), 0);
    assert_int_equal(rename(mine, living.temporary), 0);
    assert_int_equal(lumi_new_file_close(&living, LUMI_ERR_CANCELLED, false, NULL), LUMI_ERR_CANCELLED);
    assert_int_equal(count_files(folder, "a.lumi", &left), 2);
    assert_int_equal(left, 1);
    assert_int_equal(lumi_file_write(other, "whole", 5, false, NULL), LUMI_OK);
    assert_int_equal(count_files(folder, "b.lumi", &left), 2);
    assert_int_equal(left, 1);
    assert_int_equal(unlink(path) | unlink(other) | rmdir(folder), 0);
}

static void a_device_is_not_replaced_by_a_file(void **state)
{
    struct lumi_error error = {0};
    struct stat status;
    char name[] = "/tmp/lumi-base-XXXXXX", pipe[64];

    (void)state;
    assert_non_null(mkdtemp(name));
    snprintf(pipe, sizeof pipe, "%s/pipe", name);
    assert_int_equal(mkfifo(pipe, 0600), 0);
    assert_int_equal(lumi_file_check_place(pipe, &error), LUMI_ERR_ARG);
    assert_int_equal(lumi_file_write(pipe, "whole", 5, false, &error), LUMI_ERR_ARG);
    assert_non_null(strstr(error.text, "a device or a pipe"));
    assert_int_equal(stat(pipe, &status), 0);
    assert_true(S_ISFIFO(status.st_mode));
    unlink(pipe);
    rmdir(name);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_error_is_one_line_whatever_the_name_in_it),
        cmocka_unit_test(a_device_is_not_replaced_by_a_file),
        cmocka_unit_test(what_a_killed_writer_left_goes_with_the_next_of_that_name),
        cmocka_unit_test(crc32c_gives_the_published_check_value),
        cmocka_unit_test(a_reader_past_its_end_gives_zeros_and_stays_failed),
        cmocka_unit_test(varints_survive_the_round_trip_and_overlong_ones_are_refused),
        cmocka_unit_test(allocation_refuses_overflow_and_fails_when_told),
        cmocka_unit_test(errors_name_the_file_and_map_to_the_exit_status),
        cmocka_unit_test(every_lens_projects_what_it_unprojects),
        cmocka_unit_test(a_fisheye_follows_opencvs_formula),
        cmocka_unit_test(a_pinhole_does_not_see_behind_itself),
        cmocka_unit_test(poses_look_where_they_are_told),
        cmocka_unit_test(rasters_convert_there_and_back_without_loss),
        cmocka_unit_test(a_parallel_loop_visits_each_item_once_and_reports_a_failure),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
