/* daemon/http: the operator's page as it is served. */
#include "daemon/http/api_priv.h"
#include "tests/unit/api_fixture.h"

static char *header_of(const struct answer *answer, const char *name)
{
    g_autofree char *start = g_strdup_printf("\r\n%s: ", name);
    const char *at = strstr(answer->head, start);

    return at ? g_strndup(at + strlen(start), strcspn(at + strlen(start), "\r")) : NULL;
}

static void the_page_is_at_the_root(void **state)
{
    struct answer root = fixture_ask(*state, "GET", "/", NULL, NULL);
    struct answer file = fixture_ask(*state, "GET", "/page/index.html", NULL, NULL);
    g_autofree char *type = header_of(&root, "Content-Type");

    assert_int_equal(root.status, 200);
    assert_string_equal(type, "text/html; charset=utf-8");
    assert_non_null(strstr(root.body, "<!doctype html>"));
    assert_string_equal(root.body, file.body);
    answer_clear(&root);
    answer_clear(&file);
}

static void every_file_says_its_type_and_forbids_strangers(void **state)
{
    const char *const *files = lumi_api_page_files();

    assert_non_null(files[0]);
    for (int i = 0; files[i]; i++) {
        g_autofree char *path = g_strconcat("/page/", files[i], NULL);
        struct answer answer = fixture_ask(*state, "GET", path, NULL, NULL);
        g_autofree char *type = header_of(&answer, "Content-Type");
        g_autofree char *policy = header_of(&answer, "Content-Security-Policy");
        assert_int_equal(answer.status, 200);
        assert_string_not_equal(type, "application/octet-stream");
        assert_non_null(strstr(policy, "default-src 'none'"));
        assert_null(strstr(policy, "unsafe"));
        assert_non_null(strstr(answer.head, "X-Content-Type-Options: nosniff"));
        answer_clear(&answer);
    }
}

static void what_a_browser_has_is_not_sent_again(void **state)
{
    struct answer answer = fixture_ask(*state, "GET", "/", NULL, NULL);
    g_autofree char *tag = header_of(&answer, "ETag");
    g_autofree char *known = g_strdup_printf("If-None-Match: %s\r\n", tag);

    answer_clear(&answer);
    answer = fixture_ask(*state, "GET", "/", known, NULL);
    assert_int_equal(answer.status, 304);
    assert_string_equal(answer.body, "");
    answer_clear(&answer);
    answer = fixture_ask(*state, "GET", "/", "If-None-Match: \"other\"\r\n", NULL);
    assert_int_equal(answer.status, 200);
    answer_clear(&answer);
}

static void a_browser_that_unpacks_gets_it_packed(void **state)
{
    struct answer plain = fixture_ask(*state, "GET", "/page/style.css", NULL, NULL);
    struct answer packed = fixture_ask(*state, "GET", "/page/style.css", "Accept-Encoding: gzip, br\r\n", NULL);
    g_autofree char *plain_size = header_of(&plain, "Content-Length");
    g_autofree char *packed_size = header_of(&packed, "Content-Length");
    g_autofree char *encoding = header_of(&packed, "Content-Encoding");

    assert_int_equal(packed.status, 200);
    assert_string_equal(encoding, "gzip");
    assert_true(atoi(packed_size) < atoi(plain_size));
    answer_clear(&plain);
    answer_clear(&packed);
}

static void nothing_but_its_files_can_be_had(void **state)
{
    static const char *const paths[] = {"/page/", "/page/..%2fopenapi.json", "/page/nothing.js", "/index.html"};

    for (size_t i = 0; i < sizeof paths / sizeof paths[0]; i++) {
        struct answer answer = fixture_ask(*state, "GET", paths[i], NULL, NULL);
        if (answer.status != 404)
            fail_msg("%s: %d, %.60s", paths[i], answer.status, answer.body);
        answer_clear(&answer);
    }
}

int main(void)
{
#define CASE(name) cmocka_unit_test_setup_teardown(name, fixture_set_up, fixture_tear_down)
    const struct CMUnitTest tests[] = {
        CASE(the_page_is_at_the_root),
        CASE(every_file_says_its_type_and_forbids_strangers),
        CASE(what_a_browser_has_is_not_sent_again),
        CASE(a_browser_that_unpacks_gets_it_packed),
        CASE(nothing_but_its_files_can_be_had),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
