/* The capture engine before disks that cannot be written: in a namespace of our own, which is kept from then on. */
#define _GNU_SOURCE /* unshare */
#include "engine_bench.h"

#include <dirent.h>
#include <sched.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>
#include <sys/mount.h>
#include <unistd.h>
/* after those */
#include <cmocka.h>

static bool put_text(const char *path, const char *text)
{
    FILE *file = fopen(path, "w");
    bool good = file && fputs(text, file) >= 0;

    return (!file || fclose(file) == 0) && good;
}

static bool namespace_is_ours(void)
{
    char text[32];
    unsigned user = geteuid();

    if (unshare(user ? CLONE_NEWUSER | CLONE_NEWNS : CLONE_NEWNS) < 0)
        return false;
    snprintf(text, sizeof text, "0 %u 1", user);
    if (user && !put_text("/proc/self/uid_map", text))
        return false;
    return mount(NULL, "/", NULL, MS_REC | MS_PRIVATE, NULL) == 0;
}

static int entries(const char *path)
{
    DIR *folder = opendir(path);
    int count = 0;

    for (struct dirent *entry; folder && (entry = readdir(folder));)
        count += strcmp(entry->d_name, ".") && strcmp(entry->d_name, "..");
    return folder ? closedir(folder), count : -1;
}

static void end_with_disk(struct bench *b)
{
    bench_kill(b);
    assert_int_equal(umount(b->folder), 0);
    bench_end(b);
}

static void a_start_on_a_read_only_disk_is_red_and_makes_nothing(void **state)
{
    struct bench b;
    struct lumi_error error = {0};

    (void)state;
    if (!namespace_is_ours())
        skip();
    bench_begin(&b, LUMI_PLAN_START_STOP, 1);
    lumi_engine_disk(b.engine, b.now, INT64_C(1) << 40, 1e9); /* so it was when it was last looked at */
    assert_int_equal(mount("disk", b.folder, "tmpfs", MS_RDONLY, NULL), 0);
    assert_int_equal(bench_start(&b, false, &error), LUMI_OK);
    assert_true(bench_until(&b, LUMI_ENGINE_RED, 100));
    const struct lumi_engine_check *check = bench_check(&b, "disk");
    assert_non_null(check);
    assert_int_equal(check->verdict, LUMI_RED);
    assert_non_null(strstr(check->reason, "the disk is read-only"));
    assert_int_equal(entries(b.folder), 0);
    end_with_disk(&b);
}

static void a_start_on_a_full_disk_is_refused_and_leaves_nothing(void **state)
{
    int red = 0, failed = 0, begun = 0;

    (void)state;
    if (!namespace_is_ours())
        skip();
    for (int kib = 16; kib <= 4096; kib = kib < 512 ? kib + 16 : kib * 2) {
        struct bench b;
        struct lumi_error error = {0};
        char options[32];
        bench_begin(&b, LUMI_PLAN_START_STOP, 1);
        snprintf(options, sizeof options, "size=%dk", kib);
        assert_int_equal(mount("disk", b.folder, "tmpfs", 0, options), 0);
        assert_int_equal(bench_start(&b, false, &error), LUMI_OK);
        bool arming = bench_until(&b, LUMI_ENGINE_ARMING, 60);
        bench_status(&b);
        begun += arming;
        red += b.status.state == LUMI_ENGINE_RED;
        failed += b.status.state == LUMI_ENGINE_FAILED;
        if (!arming) {
            assert_true(b.status.state == LUMI_ENGINE_RED || b.status.state == LUMI_ENGINE_FAILED);
            assert_true(b.status.text[0] && !strchr(b.status.text, '\n'));
            assert_int_equal(entries(b.folder), 0);
        }
        end_with_disk(&b);
    }
    assert_true(red > 0 && failed > 0 && begun > 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_start_on_a_read_only_disk_is_red_and_makes_nothing),
        cmocka_unit_test(a_start_on_a_full_disk_is_refused_and_leaves_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
