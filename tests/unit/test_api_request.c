/* daemon/http: what a request's path and query say. */
#include "daemon/http/api_request.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <string.h>

static const char *part_of(const char *pattern, const char *path)
{
    static char part[LUMI_API_STRING_MAX + 1];

    return lumi_api_path_match(pattern, path, part) ? part : NULL;
}

static void a_path_without_a_name_is_itself(void **state)
{
    (void)state;
    assert_string_equal(part_of("/metrics", "/metrics"), "");
    assert_null(part_of("/metrics", "/metrics/"));
    assert_null(part_of("/", ""));
}

static void a_name_in_a_path_is_decoded(void **state)
{
    (void)state;
    assert_string_equal(part_of("/a/{name}/b.jpg", "/a/c%2003/b.jpg"), "c 03");
    assert_string_equal(part_of("/page/{name}", "/page/style.css"), "style.css");
    assert_string_equal(part_of("/page/{name}", "/page/%C3%A4"), "\xc3\xa4");
    assert_null(part_of("/a/{name}/b.jpg", "/a/c/b.png"));
    assert_null(part_of("/a/{name}/b.jpg", "/a/b.jpg"));
}

static void a_name_leads_nowhere_else(void **state)
{
    static const char *const bad[] = {"/p/",        "/p/..",   "/p/%2e%2e", "/p/a/b",      "/p/a%2Fb",
                                      "/p/.hidden", "/p/%00a", "/p/a%00",   "/p/a%0ab",    "/p/%ff",
                                      "/p/%",       "/p/%zz",  "/p/..%2fx", "/p/%2e%2e%2f"};
    char path[400] = "/p/";

    (void)state;
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
        if (part_of("/p/{name}", bad[i]))
            fail_msg("%s was taken", bad[i]);
    memset(path + 3, 'n', LUMI_API_STRING_MAX);
    assert_non_null(part_of("/p/{name}", path));
    path[3 + LUMI_API_STRING_MAX] = 'n';
    assert_null(part_of("/p/{name}", path));
}

enum { YAW, WIDTH, FAST, WORD };
static const struct lumi_api_field fields[] = {
    {.name = "yaw", .type = LUMI_API_NUMBER, .least = -4, .most = 4},
    {.name = "width", .type = LUMI_API_INT, .max = 4096},
    {.name = "fast", .type = LUMI_API_BOOL, .initially = true},
    {.name = "word", .type = LUMI_API_STRING, .max = 8},
    {0},
};

static void a_query_fills_the_fields(void **state)
{
    struct lumi_api_body body = {.part = "c03"};
    struct lumi_error error;

    (void)state;
    assert_int_equal(lumi_api_query_parse("yaw=-1.5&width=640&fast=false&word=a%20b", fields, &body, &error), LUMI_OK);
    assert_float_equal(body.values[YAW].real, -1.5, 0);
    assert_int_equal(body.values[WIDTH].number, 640);
    assert_false(body.values[FAST].boolean);
    assert_string_equal(body.values[WORD].string, "a b");
    assert_string_equal(body.part, "c03");
    lumi_api_body_clear(&body);
    assert_int_equal(lumi_api_query_parse(NULL, fields, &body, &error), LUMI_OK);
    assert_true(body.values[FAST].boolean);
    assert_false(body.values[YAW].given);
    lumi_api_body_clear(&body);
}

static void a_query_that_is_wrong_says_what(void **state)
{
    static const struct {
        const char *query, *part;
        int code;
    } bad[] = {
        {"yaw=5", "'yaw': a number from -4 to 4", LUMI_ERR_FORMAT},
        {"yaw=nan", "'yaw'", LUMI_ERR_FORMAT},
        {"yaw=1x", "'yaw'", LUMI_ERR_FORMAT},
        {"yaw=", "'yaw'", LUMI_ERR_FORMAT},
        {"yaw=1&yaw=2", "twice", LUMI_ERR_FORMAT},
        {"width=-1", "'width'", LUMI_ERR_FORMAT},
        {"width=4097", "4096", LUMI_ERR_FORMAT},
        {"width=99999999999999999999", "'width'", LUMI_ERR_FORMAT},
        {"fast=1", "true or false", LUMI_ERR_FORMAT},
        {"word=123456789", "9 bytes, 8", LUMI_ERR_FORMAT},
        {"speed=1", "'speed': there is no such field", LUMI_ERR_FORMAT},
        {"word=%zz", "encoded", LUMI_ERR_ARG},
        {"word=%ff", "encoded", LUMI_ERR_ARG},
    };

    (void)state;
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        struct lumi_api_body body = {0};
        struct lumi_error error;
        int code = lumi_api_query_parse(bad[i].query, fields, &body, &error);
        if (code != bad[i].code || !strstr(error.text, bad[i].part))
            fail_msg("%s: %d, %s", bad[i].query, code, code == LUMI_OK ? "" : error.text);
        lumi_api_body_clear(&body);
    }
}

static void a_number_in_a_body_has_its_bounds(void **state)
{
    struct lumi_api_body body = {0};
    struct lumi_error error;

    (void)state;
    assert_int_equal(lumi_api_body_parse("{\"yaw\":2}", 9, fields, &body, &error), LUMI_OK);
    assert_float_equal(body.values[YAW].real, 2, 0);
    lumi_api_body_clear(&body);
    assert_int_equal(lumi_api_body_parse("{\"yaw\":4.1}", 11, fields, &body, &error), LUMI_ERR_FORMAT);
    lumi_api_body_clear(&body);
    assert_int_equal(lumi_api_body_parse("{\"yaw\":\"2\"}", 11, fields, &body, &error), LUMI_ERR_FORMAT);
    lumi_api_body_clear(&body);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_path_without_a_name_is_itself), cmocka_unit_test(a_name_in_a_path_is_decoded),
        cmocka_unit_test(a_name_leads_nowhere_else),       cmocka_unit_test(a_query_fills_the_fields),
        cmocka_unit_test(a_query_that_is_wrong_says_what), cmocka_unit_test(a_number_in_a_body_has_its_bounds),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
