/* daemon/access: the rig's certificate is made once, and again before it ends. */
#include "daemon/access/certificate.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>
#include <glib.h>

#define DAY INT64_C(86400)
#define BEGIN (20000 * DAY)

static char folder[64], path[80], copy[80];

static int set_up(void **state)
{
    (void)state;
    strcpy(folder, "/tmp/lumi-certificate-XXXXXX");
    assert_non_null(mkdtemp(folder));
    snprintf(path, sizeof path, "%s/rig.pem", folder);
    snprintf(copy, sizeof copy, "%s/rig.crt", folder);
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    unlink(path);
    unlink(copy);
    return rmdir(folder);
}

static void ensure(const char *host, int64_t unix_s, char fingerprint[LUMI_FINGERPRINT])
{
    struct lumi_error error;

    if (lumi_certificate_ensure(path, copy, host, unix_s, fingerprint, &error) != LUMI_OK)
        fail_msg("%s", error.text);
}

static char *key_of(void)
{
    g_autofree char *text = NULL;

    assert_true(g_file_get_contents(path, &text, NULL, NULL));
    return g_strdup(strstr(text, "-----BEGIN PRIVATE KEY-----"));
}

static void it_is_made_once(void **state)
{
    char first[LUMI_FINGERPRINT], again[LUMI_FINGERPRINT];
    struct stat is;

    (void)state;
    ensure("rig", BEGIN, first);
    assert_int_equal(strlen(first), 95);
    assert_int_equal(stat(path, &is), 0);
    assert_int_equal(is.st_mode & 0777, 0600);
    ensure("rig", BEGIN + 700 * DAY, again);
    assert_string_equal(first, again);
    g_autofree char *text = NULL;
    gsize size;
    assert_true(g_file_get_contents(copy, &text, &size, NULL));
    assert_int_equal(lumi_certificate_fingerprint(text, size, again, NULL), LUMI_OK);
    assert_string_equal(first, again);
    assert_null(strstr(text, "PRIVATE KEY"));
}

static void it_is_made_again_before_it_ends_and_for_another_name(void **state)
{
    char first[LUMI_FINGERPRINT], again[LUMI_FINGERPRINT];

    (void)state;
    ensure("rig", BEGIN, first);
    g_autofree char *key = key_of();
    ensure("rig", BEGIN + 760 * DAY, again);
    assert_string_not_equal(first, again);
    g_autofree char *key_again = key_of();
    assert_string_equal(key, key_again);
    ensure("other", BEGIN + 760 * DAY, first);
    assert_string_not_equal(first, again);
    ensure("other", BEGIN - 2 * DAY, again); /* the clock was set back */
    assert_string_not_equal(first, again);
}

static void what_is_broken_or_was_seen_by_others_is_replaced(void **state)
{
    char first[LUMI_FINGERPRINT], again[LUMI_FINGERPRINT];

    (void)state;
    ensure("rig", BEGIN, first);
    g_autofree char *key = key_of();
    assert_int_equal(chmod(path, 0644), 0);
    ensure("rig", BEGIN, again);
    g_autofree char *other = key_of();
    assert_string_not_equal(key, other);
    assert_true(g_file_set_contents(path, "-----BEGIN CERTIFICATE-----\nAAAA\n", -1, NULL));
    assert_int_equal(chmod(path, 0600), 0);
    ensure("rig", BEGIN, first);
    assert_string_not_equal(first, again);
    assert_int_equal(lumi_certificate_fingerprint("x", 1, first, NULL), LUMI_ERR_FORMAT);
}

int main(void)
{
#define CASE(name) cmocka_unit_test_setup_teardown(name, set_up, tear_down)
    const struct CMUnitTest tests[] = {
        CASE(it_is_made_once),
        CASE(it_is_made_again_before_it_ends_and_for_another_name),
        CASE(what_is_broken_or_was_seen_by_others_is_replaced),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
