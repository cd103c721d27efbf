/* daemon/doctor: verdicts on trees of files that stand for computers. */
#include "daemon/doctor/doctor.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <glib.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct found {
    int count;
    struct lumi_doctor_finding list[64];
};

static char root[64];

static int set_up(void **state)
{
    (void)state;
    snprintf(root, sizeof root, "/tmp/test_doctor-XXXXXX");
    return mkdtemp(root) ? 0 : -1;
}

static int tear_down(void **state)
{
    g_autofree char *command = g_strdup_printf("rm -rf '%s'", root);

    (void)state;
    return system(command);
}

static void put(const char *path, const char *text)
{
    g_autofree char *whole = g_strconcat(root, path, NULL);
    g_autofree char *folder = g_path_get_dirname(whole);

    assert_int_equal(g_mkdir_with_parents(folder, 0700), 0);
    assert_true(g_file_set_contents(whole, text, -1, NULL));
}

static void take(void *context, const struct lumi_doctor_finding *finding)
{
    struct found *found = context;

    assert_true(found->count < 64);
    found->list[found->count++] = *finding;
}

static struct found *examine(const struct lumi_doctor_options *wanted)
{
    struct found *found = calloc(1, sizeof *found);
    struct lumi_doctor_options options = *wanted;

    options.root = root;
    options.hardware = false;
    lumi_doctor_run(&options, take, found);
    return found;
}

static void expect(const struct found *found, const char *name, enum lumi_doctor_verdict verdict, const char *part)
{
    for (int i = 0; i < found->count; i++)
        if (!strcmp(found->list[i].name, name) && strstr(found->list[i].found, part)) {
            assert_int_equal(found->list[i].verdict, verdict);
            if (verdict == LUMI_DOCTOR_RED)
                assert_true(found->list[i].remedy[0] != '\0');
            return;
        }
    fail_msg("nothing about %s says '%s'", name, part);
}

static bool is_named(const struct found *found, const char *name)
{
    for (int i = 0; i < found->count; i++)
        if (!strcmp(found->list[i].name, name))
            return true;
    return false;
}

static struct lumi_doctor_options defaults(void)
{
    struct lumi_doctor_options options;

    lumi_doctor_options_init(&options);
    options.lumid = NULL;
    options.captures = root;
    options.unix_s = 1800000000;
    return options;
}

static void a_bare_computer_is_told_what_it_lacks(void **state)
{
    struct lumi_doctor_options options = defaults();

    (void)state;
    options.captures = "/nowhere/captures";
    struct found *found = examine(&options);
    expect(found, "udev rules", LUMI_DOCTOR_YELLOW, "70-lumirig.rules is not installed");
    expect(found, "udev rules", LUMI_DOCTOR_YELLOW, "71-lumid.rules is not installed");
    expect(found, "disk", LUMI_DOCTOR_RED, "/nowhere/captures");
    assert_false(is_named(found, "network buffers"));
    assert_false(is_named(found, "board"));
    free(found);
}

static void a_computer_that_is_set_up_is_green(void **state)
{
    struct lumi_doctor_options options = defaults();

    (void)state;
    put("/etc/udev/rules.d/70-lumirig.rules", "");
    put("/usr/lib/udev/rules.d/71-lumid.rules", "");
    put("/proc/sys/net/core/rmem_max", "33554432\n");
    put("/proc/meminfo", "MemTotal: 9 kB\nMemAvailable:   8388608 kB\n");
    put("/sys/class/net/eth7/mtu", "9000\n");
    put("/sys/class/net/eth7/type", "1\n");
    put("/sys/class/net/eth7/carrier", "1\n");
    struct found *found = examine(&options);
    expect(found, "udev rules", LUMI_DOCTOR_GREEN, "are installed");
    expect(found, "network buffers", LUMI_DOCTOR_GREEN, "32768 KiB");
    expect(found, "network eth7", LUMI_DOCTOR_GREEN, "9000 bytes");
    expect(found, "memory", LUMI_DOCTOR_GREEN, "8.0 GiB");
    expect(found, "disk", LUMI_DOCTOR_GREEN, root);
    free(found);
}

static void rules_that_are_there_in_part_are_yellow_by_name(void **state)
{
    struct lumi_doctor_options options = defaults();

    (void)state;
    put("/lib/udev/rules.d/70-lumirig.rules", "");
    struct found *found = examine(&options);
    expect(found, "udev rules", LUMI_DOCTOR_YELLOW, "71-lumid.rules is not installed");
    for (int i = 0; i < found->count; i++)
        assert_null(strstr(found->list[i].found, "70-lumirig.rules"));
    free(found);
}

static void what_is_too_small_is_yellow(void **state)
{
    struct lumi_doctor_options options = defaults();

    (void)state;
    put("/proc/sys/net/core/rmem_max", "212992\n");
    put("/proc/meminfo", "MemAvailable:   300000 kB\n");
    put("/sys/class/net/lo/mtu", "65536\n");
    put("/sys/class/net/lo/type", "772\n");
    put("/sys/class/net/lo/carrier", "1\n");
    put("/sys/class/net/eth1/mtu", "1500\n");
    put("/sys/class/net/eth1/type", "1\n"); /* no carrier: no cable */
    put("/sys/module/usbcore/parameters/usbfs_memory_mb", "16\n");
    struct found *found = examine(&options);
    expect(found, "network buffers", LUMI_DOCTOR_YELLOW, "208 KiB");
    expect(found, "memory", LUMI_DOCTOR_YELLOW, "0.3 GiB");
    expect(found, "usb memory", LUMI_DOCTOR_YELLOW, "16 MB");
    assert_false(is_named(found, "network lo"));
    assert_false(is_named(found, "network eth1"));
    free(found);
}

static void a_clock_in_the_past_is_red(void **state)
{
    struct lumi_doctor_options options = defaults();

    (void)state;
    options.unix_s = 86400;
    struct found *found = examine(&options);
    expect(found, "clock", LUMI_DOCTOR_RED, "past");
    free(found);
}

static void a_user_is_told_the_groups_it_is_not_in(void **state)
{
    struct lumi_doctor_options options = defaults();

    (void)state;
    put("/etc/group", "root:x:0:\nplugdev:x:4242424:\nvideo:x:4242425:\n");
    options.user = 1000;
    struct found *found = examine(&options);
    expect(found, "groups", LUMI_DOCTOR_YELLOW, "plugdev");
    expect(found, "groups", LUMI_DOCTOR_YELLOW, "video");
    free(found);
    options.user = 0;
    found = examine(&options);
    expect(found, "groups", LUMI_DOCTOR_GREEN, "root");
    free(found);
}

static void lumid_says_what_it_thinks_of_its_configuration(void **state)
{
    struct lumi_doctor_options options = defaults();
    g_autofree char *config = g_strconcat(root, "/lumid.conf", NULL);
    g_autofree char *script = g_strconcat(root, "/check", NULL);
    g_autofree char *command = g_strdup_printf("chmod +x '%s'", script);

    (void)state;
    options.config = config;
    options.lumid = script;
    struct found *found = examine(&options);
    expect(found, "configuration", LUMI_DOCTOR_YELLOW, "not there");
    free(found);
    put("/lumid.conf", "");
    found = examine(&options);
    expect(found, "configuration", LUMI_DOCTOR_YELLOW, "which checks it");
    free(found);
    put("/check", "#!/bin/sh\necho one is wrong >&2; echo two are >&2; exit 3\n");
    assert_int_equal(system(command), 0);
    found = examine(&options);
    expect(found, "configuration", LUMI_DOCTOR_RED, "two are");
    free(found);
    put("/check", "#!/bin/sh\n[ \"$1 $2\" = '--check --config' ]\n");
    assert_int_equal(system(command), 0);
    found = examine(&options);
    expect(found, "configuration", LUMI_DOCTOR_GREEN, "is good");
    free(found);
}

int main(void)
{
#define CASE(name) cmocka_unit_test_setup_teardown(name, set_up, tear_down)
    const struct CMUnitTest tests[] = {
        CASE(a_bare_computer_is_told_what_it_lacks),
        CASE(a_computer_that_is_set_up_is_green),
        CASE(rules_that_are_there_in_part_are_yellow_by_name),
        CASE(what_is_too_small_is_yellow),
        CASE(a_clock_in_the_past_is_red),
        CASE(a_user_is_told_the_groups_it_is_not_in),
        CASE(lumid_says_what_it_thinks_of_its_configuration),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
