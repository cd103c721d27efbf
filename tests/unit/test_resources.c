/* pipeline/engine: what a run may use of a computer, read from a kernel's files that the test writes. */
#include "pipeline/engine/local.h"
#include "pipeline/engine/resources.h"

#include <glib.h>
#include <glib/gstdio.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

static char *root;

static void put(const char *name, const char *text)
{
    g_autofree char *path = g_build_filename(root, name, NULL), *folder = g_path_get_dirname(path);

    assert_int_equal(g_mkdir_with_parents(folder, 0777), 0);
    assert_true(g_file_set_contents(path, text, -1, NULL));
}

static int make_root(void **state)
{
    (void)state;
    root = g_dir_make_tmp("lumi-resources-XXXXXX", NULL);
    for (const char *const *name = (const char *const[]){"SLURM_JOB_ID", "SLURM_CPUS_PER_TASK", "SLURM_CPUS_ON_NODE",
                                                         "SLURM_MEM_PER_NODE", "SLURM_MEM_PER_CPU", NULL};
         *name; name++)
        unsetenv(*name);
    put("proc/meminfo", "MemTotal:       32000000 kB\nMemFree:  1 kB\nMemAvailable:   20000000 kB\n");
    return 0;
}

static int remove_root(void **state)
{
    g_autofree char *command = g_strdup_printf("rm -rf '%s'", root);

    (void)state;
    g_free(root);
    return g_spawn_command_line_sync(command, NULL, NULL, NULL, NULL) ? 0 : 1;
}

static struct lumi_resources found(void)
{
    struct lumi_resources resources;

    lumi_resources_find(root, &resources);
    assert_true(resources.cores >= 1);
    return resources;
}

static void memory_is_what_the_kernel_calls_available(void **state)
{
    (void)state;
    assert_int_equal(found().memory, 20000000LL * 1024);
    assert_string_equal(found().memory_by, "the computer");
    put("proc/meminfo", "");
    assert_int_equal(found().memory, INT64_MAX);
}

static void a_group_above_limits_what_is_below_it(void **state)
{
    (void)state;
    put("proc/self/cgroup", "0::/a.slice/b\n");
    put("sys/fs/cgroup/a.slice/memory.max", "4000000000\n");
    put("sys/fs/cgroup/a.slice/memory.current", "1500000000\n");
    put("sys/fs/cgroup/a.slice/memory.stat", "anon 1000000000\ninactive_file 500000000\n");
    put("sys/fs/cgroup/a.slice/b/memory.max", "max\n");
    put("sys/fs/cgroup/a.slice/cpu.max", "100000 100000\n");
    put("sys/fs/cgroup/a.slice/b/cpu.max", "max 100000\n");
    assert_int_equal(found().memory, 3000000000LL);
    assert_string_equal(found().memory_by, "its cgroup");
    assert_int_equal(found().cores, 1);
    put("sys/fs/cgroup/a.slice/memory.current", "5000000000\n"); /* over its limit: nothing is left */
    assert_int_equal(found().memory, 0);
}

static void groups_of_the_first_version_count_too(void **state)
{
    (void)state;
    put("proc/self/cgroup", "5:cpu,cpuacct:/\n4:memory:/job\n0::/\n");
    put("sys/fs/cgroup/memory/job/memory.limit_in_bytes", "2000000000\n");
    put("sys/fs/cgroup/memory/job/memory.usage_in_bytes", "400000000\n");
    put("sys/fs/cgroup/memory/job/memory.stat", "cache 9\ntotal_inactive_file 100000000\n");
    put("sys/fs/cgroup/memory/memory.limit_in_bytes", "9223372036854771712\n"); /* none */
    assert_int_equal(found().memory, 1700000000LL);
}

static void an_allocation_of_slurm_limits_both(void **state)
{
    (void)state;
    setenv("SLURM_CPUS_PER_TASK", "1", 1);
    setenv("SLURM_MEM_PER_NODE", "512", 1);
    assert_int_equal(found().memory, 20000000LL * 1024); /* outside of a job they mean nothing */
    setenv("SLURM_JOB_ID", "7", 1);
    assert_int_equal(found().memory, 512LL << 20);
    assert_int_equal(found().cores, 1);
    setenv("SLURM_MEM_PER_NODE", "0", 1); /* all of the node */
    assert_int_equal(found().memory, 20000000LL * 1024);
    setenv("SLURM_MEM_PER_CPU", "300", 1);
    assert_int_equal(found().memory, 300LL << 20);
}

static void rubbish_limits_nothing(void **state)
{
    (void)state;
    put("proc/self/cgroup", ":\n0\n0::\n::::::/../..\n0::////\n-1:memory:x");
    put("sys/fs/cgroup/memory.max", "-5");
    put("sys/fs/cgroup/cpu.max", "1 0");
    put("proc/meminfo", "MemAvailable:");
    assert_int_equal(found().memory, INT64_MAX);
}

static void no_more_images_at_once_than_there_is_memory_for(void **state)
{
    const struct lumi_resources eight = {.cores = 8, .memory = 10000000000LL};
    const struct lumi_resources unknown = {.cores = 8, .memory = INT64_MAX};

    (void)state;
    assert_int_equal(lumi_engine_threads(&eight, 0, 0), 8);
    assert_int_equal(lumi_engine_threads(&eight, 1000000000, 0), 8);
    assert_int_equal(lumi_engine_threads(&eight, 3000000000LL, 0), 3);
    assert_int_equal(lumi_engine_threads(&eight, 3000000000LL, 2), 2);
    assert_int_equal(lumi_engine_threads(&eight, 30000000000LL, 0), 1); /* it is tried all the same */
    assert_int_equal(lumi_engine_threads(&unknown, 3000000000LL, 0), 8);
}

#define WITH_ROOT(test) cmocka_unit_test_setup_teardown(test, make_root, remove_root)

int main(void)
{
    const struct CMUnitTest tests[] = {
        WITH_ROOT(memory_is_what_the_kernel_calls_available),
        WITH_ROOT(a_group_above_limits_what_is_below_it),
        WITH_ROOT(groups_of_the_first_version_count_too),
        WITH_ROOT(an_allocation_of_slurm_limits_both),
        WITH_ROOT(rubbish_limits_nothing),
        cmocka_unit_test(no_more_images_at_once_than_there_is_memory_for),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
