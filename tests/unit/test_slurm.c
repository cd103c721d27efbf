/* pipeline/engine: records of runs, what Slurm says, how a stage is divided, what rests on what. */
#include "pipeline/engine/clear_work.h"
#include "pipeline/engine/dependence.h"
#include "pipeline/engine/slurm.h"
#include "pipeline/graph/graph.h"

#include <glib.h>
#include <glib/gstdio.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

static int number_of(const char *name)
{
    for (int i = 0; lumi_stages[i]; i++)
        if (!strcmp(lumi_stages[i]->name, name))
            return i;
    fail_msg("no stage %s", name);
    return -1;
}

static void a_record_is_read_as_it_was_written(void **state)
{
    g_autofree char *folder = g_dir_make_tmp("lumi-record-XXXXXX", NULL);
    g_autofree char *path = g_build_filename(folder, LUMI_RECORD_FILE, NULL);
    const struct lumi_record_job job = {"geometry-coarse", 123456789012LL, 7};
    struct lumi_record record, again;
    struct lumi_error error = {0};

    (void)state;
    lumi_record_init(&record);
    assert_int_equal(lumi_record_read(folder, &record, &error), LUMI_ERR_NOTFOUND);
    record.engine = LUMI_ENGINE_SLURM;
    record.folder = g_strdup("/a b\\c\n\"d");
    record.capture = g_strdup("/ä/ capture ");
    record.output = g_strdup("/o.lumi");
    record.command = g_strdup("apptainer exec 'x y.sif' lumi");
    g_ptr_array_add(record.arguments, g_strdup("--gp=0.1"));
    g_ptr_array_add(record.options, g_strdup("depth:mem=8G"));
    record.chunk = 3, record.retries = 1, record.threads = 4;
    g_array_append_val(record.jobs, job);
    assert_int_equal(lumi_record_write(folder, &record, &error), LUMI_OK);
    lumi_record_init(&again);
    assert_int_equal(lumi_record_read(folder, &again, &error), LUMI_OK);
    assert_int_equal(again.engine, LUMI_ENGINE_SLURM);
    assert_string_equal(again.folder, record.folder);
    assert_string_equal(again.capture, record.capture);
    assert_string_equal(again.output, record.output);
    assert_string_equal(again.command, record.command);
    assert_int_equal(again.arguments->len, 1);
    assert_string_equal(g_ptr_array_index(again.arguments, 0), "--gp=0.1");
    assert_string_equal(g_ptr_array_index(again.options, 0), "depth:mem=8G");
    assert_int_equal(again.chunk * 100 + again.retries * 10 + again.threads, 314);
    const struct lumi_record_job *back = &g_array_index(again.jobs, struct lumi_record_job, 0);
    assert_string_equal(back->stage, job.stage);
    assert_true(back->id == job.id && back->shares == job.shares);
    lumi_record_finish(&again);
    lumi_record_finish(&record);
    assert_int_equal(g_unlink(path) | g_rmdir(folder), 0);
}

static void a_record_that_makes_no_sense_is_refused_with_its_line(void **state)
{
    static const char start[] = "lumi run 1\nfolder /\ncapture /c\noutput /o\ncommand l\n";
    static const char *const bad[] = {"engine cloud\n", "job depth 0 1\n",  "job ../x 1 1\n", "retries -1\n",
                                      "folder /\n",     "surprise 1\n",     "chunk 1x\n",     "job depth 1 1 1\n",
                                      "argument\n",     "\nengine local\n", "threads 99999\n"};

    (void)state;
    for (size_t i = 0; i < G_N_ELEMENTS(bad); i++) {
        g_autofree char *text = g_strconcat(start, bad[i], NULL);
        struct lumi_record record;
        struct lumi_error error = {0};
        lumi_record_init(&record);
        assert_int_equal(lumi_record_parse(text, strlen(text), "r", &record, &error), LUMI_ERR_FORMAT);
        assert_non_null(strstr(error.text, "r: line 6"));
        lumi_record_finish(&record);
    }
}

static void shares_cover_a_stage_once(void **state)
{
    (void)state;
    for (int count = 0; count < 40; count++)
        for (int shares = 1; shares < 20; shares++) {
            int next = 0;
            for (int share = 1; share <= shares; share++) {
                int first, last;
                lumi_share_range(share, shares, count, &first, &last);
                assert_int_equal(first, next);
                assert_true(last >= first && last - first <= count / shares + 1);
                next = last;
            }
            assert_int_equal(next, count);
        }
    assert_int_equal(lumi_slurm_shares(1290, 0), 81);
    assert_int_equal(lumi_slurm_shares(1290, 1), 1000); /* no array is larger */
    assert_int_equal(lumi_slurm_shares(5, 3), 2);
    assert_int_equal(lumi_slurm_shares(0, 3), 1);
}

static void only_shares_with_something_to_do_are_handed_over(void **state)
{
    bool made[10] = {1, 1, 0, 1, 1, 1, 1, 1, 0, 0};
    struct lumi_progress progress = {.wanted = true, .known = true, .count = 10, .made = made};
    g_autofree char *some = lumi_slurm_array(&progress, 5);

    (void)state;
    assert_string_equal(some, "2,5");
    progress.known = false; /* then its images are not those that will be */
    g_autofree char *all = lumi_slurm_array(&progress, 5);
    assert_string_equal(all, "1-5");
}

static void what_slurm_says_is_counted_by_stage(void **state)
{
    static const char text[] = "12_3|lumi.depth.0123abcd|RUNNING|None\n"
                               "13_4|lumi.geometry-coarse.0123abcd|PENDING|DependencyNeverSatisfied\n"
                               "14|lumi.depth.0123abcd|CANCELLED by 1000\n"
                               "15_[1-4]|lumi.depth.0123abcd|PENDING|Dependency\n"
                               "16_1|lumi.depth.ffffffff|RUNNING|None\n"
                               "17_1|other|RUNNING|None\n"
                               "18_5|lumi.geometry.0123abcd|PENDING|launch failed requeued held\n\n";
    g_autoptr(GArray) tasks = g_array_new(FALSE, TRUE, sizeof(struct lumi_task));
    struct lumi_error error = {0};

    (void)state;
    assert_int_equal(lumi_slurm_parse_tasks(text, "0123abcd", tasks, &error), LUMI_OK);
    assert_int_equal(tasks->len, 5);
    const struct lumi_task *task = &g_array_index(tasks, struct lumi_task, 0);
    assert_int_equal(task[0].job, 12);
    assert_int_equal(task[0].share, 3);
    assert_int_equal(task[0].state, LUMI_TASK_RUNNING);
    assert_true(task[1].never);
    assert_string_equal(task[1].stage, "geometry-coarse");
    assert_int_equal(task[2].state, LUMI_TASK_FAILED);
    assert_int_equal(task[3].state, LUMI_TASK_WAITING);
    assert_false(task[3].never);
    assert_true(task[4].never); /* in the queue it stays, but it will not run */
    assert_int_equal(lumi_slurm_count_live(tasks), 4);
    assert_int_equal(lumi_slurm_parse_tasks("slurm_load_jobs error\n", "0123abcd", tasks, &error), LUMI_ERR_FORMAT);
}

static void the_number_of_a_job_is_read(void **state)
{
    struct lumi_error error = {0};
    long long job;

    (void)state;
    assert_int_equal(lumi_slurm_parse_job("77;cluster\n", &job, &error), LUMI_OK);
    assert_int_equal(job, 77);
    for (const char *const *bad = (const char *const[]){"", "x", "0", "-3", "7x", NULL}; *bad; bad++)
        assert_int_equal(lumi_slurm_parse_job(*bad, &job, &error), LUMI_ERR_FORMAT);
}

static void what_rests_on_a_stage_goes_with_it(void **state)
{
    int count = 0;

    (void)state;
    while (lumi_stages[count])
        count++;
    g_autofree bool *chosen = g_new0(bool, (gsize)count);
    struct lumi_error error = {0};
    const char *const names[] = {"match", NULL}, *const wrong[] = {"mach", NULL};
    assert_int_equal(lumi_clear_choose(names, chosen, &error), LUMI_OK);
    assert_true(chosen[number_of("match")] && chosen[number_of("depth")] && chosen[number_of("compress")]);
    assert_true(chosen[number_of("geometry")]);
    assert_false(chosen[number_of("equiangular")]);
    assert_int_equal(lumi_clear_choose(wrong, chosen, &error), LUMI_ERR_ARG);
    assert_false(lumi_stage_rests_on(number_of("geometry"), number_of("geometry-coarse")));
    assert_true(lumi_stage_rests_on(number_of("compress"), 0));
    for (int i = 0; i < count; i++) /* nothing rests on itself, or on what comes later */
        for (int j = i; j < count; j++)
            assert_false(lumi_stage_rests_on(i, j));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_record_is_read_as_it_was_written),
        cmocka_unit_test(a_record_that_makes_no_sense_is_refused_with_its_line),
        cmocka_unit_test(shares_cover_a_stage_once),
        cmocka_unit_test(only_shares_with_something_to_do_are_handed_over),
        cmocka_unit_test(what_slurm_says_is_counted_by_stage),
        cmocka_unit_test(the_number_of_a_job_is_read),
        cmocka_unit_test(what_rests_on_a_stage_goes_with_it),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
