/* pipeline/run: stages are run once, skipped when nothing changed, resumed after a failure, atomic. */
#include "pipeline/run/run.h"
#include "pipeline/run/temporary.h"
#include "tests/unit/run_fixture.h"

#include <glib.h>
#include <glib/gstdio.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>
#include <utime.h>

#include <cmocka.h>

#define IMAGES 12

static char *folder;
static atomic_int made;
static int fail_at = -1, parameter = 1;

static int make_capture(void **state)
{
    static const struct run_fixture fixture = {8, 6, IMAGES, 4, IMAGES - 1, wall_pose}; /* the last one has no pose */

    (void)state;
    folder = make_run_fixture(&fixture);
    return 0;
}

static int remove_capture(void **state)
{
    (void)state;
    return remove_run_fixture(folder);
}

static struct lumi_run *open_run(bool alone)
{
    g_autofree char *path = g_build_filename(folder, "capture/", NULL);
    struct lumi_parameters parameters;
    struct lumi_run *run;
    struct lumi_error error = {0};

    lumi_run_defaults(&parameters);
    if (lumi_run_open(path, NULL, &parameters, 4, alone, &run, &error) != LUMI_OK)
        fail_msg("%s", error.text);
    return run;
}

static int key_first(struct lumi_run *run, int index, struct lumi_key *key, struct lumi_error *error)
{
    (void)error;
    lumi_key_bytes(key, run->sources[index].sha256, 64);
    lumi_key_int(key, parameter);
    return LUMI_OK;
}

static int make_first(struct lumi_run *run, void *state, int index, int thread, const char *path,
                      struct lumi_error *error)
{
    g_autofree char *text = g_strdup_printf("%s %d\n", run->sources[index].name, parameter);

    (void)state;
    (void)thread;
    g_file_set_contents(path, index == fail_at ? "half" : text, -1, NULL);
    if (index == fail_at)
        return lumi_fail(error, LUMI_ERR_IO, "image %d failed", index);
    made++;
    return LUMI_OK;
}

static int key_all(struct lumi_run *run, int index, struct lumi_key *key, struct lumi_error *error)
{
    (void)error;
    (void)index;
    for (int i = 0; i < run->count; i++)
        lumi_key_input(key, run, "first", i);
    return LUMI_OK;
}

static int make_all(struct lumi_run *run, void *state, int index, int thread, const char *path,
                    struct lumi_error *error)
{
    g_autoptr(GString) text = g_string_new(NULL);

    (void)state;
    (void)thread;
    (void)error;
    assert_int_equal(index, -1);
    for (int i = 0; i < run->count; i++) {
        g_autofree char *input = lumi_run_path(run, "first", i, ".txt"), *line = NULL;
        assert_true(g_file_get_contents(input, &line, NULL, NULL));
        g_string_append(text, line);
    }
    made++;
    return g_file_set_contents(path, text->str, -1, NULL) ? LUMI_OK : LUMI_ERR_IO;
}

static const struct lumi_stage first = {
    .name = "first", .title = "first", .version = 1, .extension = ".txt", .key = key_first, .make = make_first};
static const struct lumi_stage all = {.name = "everything",
                                      .title = "everything",
                                      .version = 1,
                                      .extension = ".out",
                                      .whole = true,
                                      .key = key_all,
                                      .make = make_all};

static int run_count(struct lumi_run *run, const struct lumi_stage *stage, int from, int to, int *skipped)
{
    struct lumi_error error = {0};

    made = 0;
    assert_int_equal(lumi_run_stage(run, stage, from, to, skipped, &error), LUMI_OK);
    return made;
}

static void frames_with_a_pose_become_sources_in_order(void **state)
{
    struct lumi_run *run = open_run(true);

    (void)state;
    assert_int_equal(run->count, IMAGES - 1);
    assert_string_equal(run->sources[5].name, "view05");
    assert_int_equal(run->sources[5].row, 1);
    assert_true(run->sources[5].pose.t.x == 1);
    assert_true(g_file_test(run->sources[5].path, G_FILE_TEST_EXISTS));
    assert_true(g_str_has_suffix(run->work, "/capture.work"));
    lumi_run_close(run);
}

static void a_stage_is_run_once_and_again_when_a_parameter_changes(void **state)
{
    struct lumi_run *run = open_run(true);
    int skipped;

    (void)state;
    assert_int_equal(run_count(run, &first, 0, 4, &skipped), 4);
    assert_int_equal(run_count(run, &first, 0, run->count, &skipped), IMAGES - 5);
    assert_int_equal(skipped, 4);
    assert_int_equal(run_count(run, &all, 0, run->count, &skipped), 1);
    lumi_run_close(run);

    run = open_run(true); /* another program */
    assert_int_equal(run_count(run, &first, 0, run->count, &skipped), 0);
    assert_int_equal(run_count(run, &all, 0, run->count, &skipped), 0);
    parameter = 2;
    assert_int_equal(run_count(run, &first, 3, 4, &skipped), 1);
    assert_int_equal(run_count(run, &all, 0, run->count, &skipped), 1);
    parameter = 1;
    assert_int_equal(run_count(run, &first, 0, run->count, &skipped), 1);
    lumi_run_close(run);
}

static void an_output_that_was_cut_short_is_made_again(void **state)
{
    struct lumi_run *run = open_run(true);
    int skipped;

    (void)state;
    run_count(run, &first, 0, run->count, &skipped);
    g_autofree char *path = lumi_run_path(run, "first", 2, ".txt");
    assert_true(g_file_set_contents(path, "v", -1, NULL));
    lumi_run_close(run);
    run = open_run(true);
    assert_int_equal(run_count(run, &first, 0, run->count, &skipped), 1);
    lumi_run_close(run);
}

static void a_failed_image_leaves_nothing_and_is_named(void **state)
{
    struct lumi_run *run = open_run(true);
    struct lumi_error error = {0};
    int skipped;

    (void)state;
    parameter = 7;
    fail_at = 6;
    assert_int_equal(lumi_run_stage(run, &first, 0, run->count, &skipped, &error), LUMI_ERR_IO);
    assert_string_equal(error.text, "image 6 failed");
    g_autofree char *folder_path = g_build_filename(run->work, "first", NULL);
    g_autoptr(GDir) dir = g_dir_open(folder_path, 0, NULL);
    for (const char *name; (name = g_dir_read_name(dir));)
        assert_null(strstr(name, ".tmp-"));
    fail_at = -1;
    assert_true(run_count(run, &first, 0, run->count, &skipped) <= IMAGES - 1 - 6);
    lumi_run_close(run);
}

static void a_stage_whose_input_is_missing_says_which_stage_to_run(void **state)
{
    g_autofree char *path = g_build_filename(folder, "capture", NULL);
    g_autofree char *work = g_build_filename(folder, "elsewhere", NULL);
    struct lumi_parameters parameters;
    struct lumi_run *run;
    struct lumi_error error = {0};

    (void)state;
    lumi_run_defaults(&parameters);
    assert_int_equal(lumi_run_open(path, work, &parameters, 1, true, &run, &error), LUMI_OK);
    assert_int_equal(lumi_run_stage(run, &all, 0, run->count, NULL, &error), LUMI_ERR_NOTFOUND);
    assert_non_null(strstr(error.text, "'first' of view00"));
    assert_int_equal(lumi_run_stage(run, &first, 3, 100, NULL, &error), LUMI_ERR_ARG);
    lumi_run_close(run);
}

/* The number of a process that is no more. */
static long dead_process(void)
{
    const pid_t child = fork();

    if (child == 0)
        _exit(0);
    assert_int_equal(waitpid(child, NULL, 0), child);
    return (long)child;
}

static char *leave(const char *name)
{
    g_autofree char *in = g_build_filename(folder, "capture.work/first", NULL);
    char *path = g_build_filename(in, name, NULL);

    assert_int_equal(g_mkdir_with_parents(in, 0777), 0);
    assert_true(g_file_set_contents(path, "half", -1, NULL));
    return path;
}

static void what_other_computers_are_writing_stays(void **state)
{
    g_autofree char *mine = lumi_run_temporary("x", ".txt");
    g_autofree char *place = g_strndup(mine + strlen("x.tmp-"), 8);
    g_autofree char *dead = g_strdup_printf("v.txt.tmp-%s-%ld.txt", place, dead_process());
    g_autofree char *alive = g_strdup_printf("v.txt.tmp-%s-%ld.txt", place, (long)getppid());
    g_autofree char *gone = leave(dead), *stays = leave(alive);
    g_autofree char *young = leave("v.txt.tmp-0123abcd-1.txt"), *old = leave("w.txt.tmp-0123abcd-1.txt");
    const struct utimbuf long_ago = {.actime = 1000000000, .modtime = 1000000000};

    (void)state;
    assert_int_equal(g_utime(old, (struct utimbuf *)&long_ago), 0);
    lumi_run_close(open_run(true));
    assert_false(g_file_test(gone, G_FILE_TEST_EXISTS));
    assert_true(g_file_test(stays, G_FILE_TEST_EXISTS));
    assert_true(g_file_test(young, G_FILE_TEST_EXISTS));
    assert_false(g_file_test(old, G_FILE_TEST_EXISTS));
    assert_int_equal(unlink(stays) | unlink(young), 0);
}

static void one_run_alone_keeps_others_out_and_clears_what_a_killed_one_left(void **state)
{
    g_autofree char *path = g_build_filename(folder, "capture", NULL);
    g_autofree char *name = g_strdup_printf("view00.size.tmp-%ld-0", dead_process()), *left = leave(name);
    struct lumi_parameters parameters;
    struct lumi_run *run, *second;
    struct lumi_error error = {0};

    (void)state;
    run = open_run(true);
    assert_false(g_file_test(left, G_FILE_TEST_EXISTS));
    lumi_run_defaults(&parameters);
    assert_int_equal(lumi_run_open(path, NULL, &parameters, 1, true, &second, &error), LUMI_ERR_BUSY);
    assert_int_equal(lumi_run_open(path, NULL, &parameters, 1, false, &second, &error), LUMI_ERR_BUSY);
    lumi_run_close(run);
    run = open_run(false);
    assert_int_equal(lumi_run_open(path, NULL, &parameters, 1, false, &second, &error), LUMI_OK);
    lumi_run_close(second);
    lumi_run_close(run);
    assert_int_equal(lumi_run_open("/nonexistent", NULL, &parameters, 1, true, &run, &error), LUMI_ERR_NOTFOUND);
    assert_non_null(strstr(error.text, "/nonexistent"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(frames_with_a_pose_become_sources_in_order),
        cmocka_unit_test(a_stage_is_run_once_and_again_when_a_parameter_changes),
        cmocka_unit_test(an_output_that_was_cut_short_is_made_again),
        cmocka_unit_test(a_failed_image_leaves_nothing_and_is_named),
        cmocka_unit_test(a_stage_whose_input_is_missing_says_which_stage_to_run),
        cmocka_unit_test(what_other_computers_are_writing_stays),
        cmocka_unit_test(one_run_alone_keeps_others_out_and_clears_what_a_killed_one_left),
    };
    return cmocka_run_group_tests(tests, make_capture, remove_capture);
}
