/* daemon/http/openapi.json and the server, held to each other: every path and method, every field that is sent and
 * every field that is taken is in both, with its type. */
#include "daemon/http/api_priv.h"
#include "tests/unit/api_fixture.h"

#include <math.h>

static JsonParser *parser;
static JsonObject *schemas, *paths;

static int set_up(void **state)
{
    JsonObject *root;

    parser = json_parser_new();
    assert_true(json_parser_load_from_file(parser, LUMI_SOURCE_DIR "/daemon/http/openapi.json", NULL));
    root = json_node_get_object(json_parser_get_root(parser));
    schemas = json_object_get_object_member(json_object_get_object_member(root, "components"), "schemas");
    paths = json_object_get_object_member(root, "paths");
    return fixture_set_up(state);
}

static int tear_down(void **state)
{
    g_object_unref(parser);
    return fixture_tear_down(state);
}

static JsonObject *follow(JsonObject *schema)
{
    const char *reference = json_object_get_string_member_with_default(schema, "$ref", NULL);

    if (!reference)
        return schema;
    assert_true(g_str_has_prefix(reference, "#/components/schemas/"));
    reference = strrchr(reference, '/') + 1;
    if (!json_object_has_member(schemas, reference))
        fail_msg("the schema %s is not there", reference);
    return json_object_get_object_member(schemas, reference);
}

static bool is_of_type(JsonNode *node, const char *type)
{
    GType value = JSON_NODE_HOLDS_VALUE(node) ? json_node_get_value_type(node) : G_TYPE_INVALID;

    if (!strcmp(type, "null"))
        return JSON_NODE_HOLDS_NULL(node);
    if (!strcmp(type, "object"))
        return JSON_NODE_HOLDS_OBJECT(node);
    if (!strcmp(type, "array"))
        return JSON_NODE_HOLDS_ARRAY(node);
    if (!strcmp(type, "string"))
        return value == G_TYPE_STRING;
    if (!strcmp(type, "boolean"))
        return value == G_TYPE_BOOLEAN;
    if (!strcmp(type, "integer"))
        return value == G_TYPE_INT64;
    return !strcmp(type, "number") && (value == G_TYPE_DOUBLE || value == G_TYPE_INT64);
}

static void check_type(JsonNode *node, JsonObject *schema, const char *where)
{
    JsonNode *type = json_object_get_member(schema, "type");
    bool good = false;

    assert_non_null(type);
    if (JSON_NODE_HOLDS_ARRAY(type))
        for (guint i = 0; i < json_array_get_length(json_node_get_array(type)); i++)
            good |= is_of_type(node, json_array_get_string_element(json_node_get_array(type), i));
    else
        good = is_of_type(node, json_node_get_string(type));
    if (!good)
        fail_msg("%s is not of the type that the description says", where);
    if (json_object_has_member(schema, "enum")) {
        JsonArray *words = json_object_get_array_member(schema, "enum");
        bool found = false;
        for (guint i = 0; i < json_array_get_length(words); i++)
            found |= !strcmp(json_array_get_string_element(words, i), json_node_get_string(node));
        if (!found)
            fail_msg("%s: '%s' is not in the description", where, json_node_get_string(node));
    }
}

/* Exactly the properties of the schema: none more, and none that is required less. */
static void check(JsonNode *node, JsonObject *schema, const char *where)
{
    schema = follow(schema);
    check_type(node, schema, where);
    if (JSON_NODE_HOLDS_ARRAY(node)) {
        JsonArray *array = json_node_get_array(node);
        for (guint i = 0; i < json_array_get_length(array); i++)
            check(json_array_get_element(array, i), json_object_get_object_member(schema, "items"), where);
    }
    if (!JSON_NODE_HOLDS_OBJECT(node) || !json_object_has_member(schema, "properties"))
        return;
    JsonObject *object = json_node_get_object(node);
    JsonObject *properties = json_object_get_object_member(schema, "properties");
    JsonArray *required = json_object_get_array_member(schema, "required");
    g_autoptr(GList) names = json_object_get_members(object);
    for (GList *name = names; name; name = name->next) {
        g_autofree char *inner = g_strdup_printf("%s.%s", where, (const char *)name->data);
        if (!json_object_has_member(properties, name->data))
            fail_msg("%s is sent, but not described", inner);
        check(json_object_get_member(object, name->data), json_object_get_object_member(properties, name->data), inner);
    }
    for (guint i = 0; i < json_array_get_length(required); i++)
        if (!json_object_has_member(object, json_array_get_string_element(required, i)))
            fail_msg("%s.%s is described, but not sent", where, json_array_get_string_element(required, i));
}

static void check_text(const char *text, const char *schema, const char *where)
{
    g_autoptr(JsonParser) answer = json_parser_new();

    if (!json_parser_load_from_data(answer, text, -1, NULL))
        fail_msg("%s: no JSON: %s", where, text);
    check(json_parser_get_root(answer), json_object_get_object_member(schemas, schema), where);
}

/* The schema of an answer, NULL where it is no JSON. */
static JsonObject *schema_of(JsonObject *operation, int status, const char *type)
{
    g_autofree char *number = g_strdup_printf("%d", status);
    JsonObject *responses = json_object_get_object_member(operation, "responses");

    if (!json_object_has_member(responses, number))
        return NULL;
    JsonObject *content = json_object_get_object_member(json_object_get_object_member(responses, number), "content");
    return json_object_has_member(content, type)
               ? json_object_get_object_member(json_object_get_object_member(content, type), "schema")
               : NULL;
}

static void something_everywhere(void)
{
    struct lumi_engine_status *status = &engine_double.status;

    status->rig.status_known = true;
    status->rig.status.faults = 1;
    engine_double.missing_count = engine_double.processing_count = engine_double.ingest_count = 1;
    engine_double.processing[0].progress = -1;
    engine_double.frames.shots = engine_double.frames.camera_count = 1;
    engine_double.rig_source = "board";
    assert_int_equal(lumi_rig_builtin("arc16x2", &engine_double.rig, NULL), LUMI_OK);
    status->arm = (struct lumi_engine_arm){.known = true, .turn_known = true, .camera_count = 1};
    status->store.bytes_per_second = 1e6;
    status->cameras[0].status.battery = NAN;
}

static const char *body_for(const char *path)
{
    if (strstr(path, "jog"))
        return "{\"degrees\":-5}";
    if (strstr(path, "start") || strstr(path, "preflight") || strstr(path, "plans"))
        return "{\"plan\":\"p\"}";
    if (strstr(path, "captures/"))
        return strstr(path, "delete") ? "{\"capture\":\"c\",\"word\":\"c\"}" : "{\"capture\":\"c\"}";
    return strstr(path, "processing") ? "{\"capture\":\"c\"}" : "{}";
}

/* With the description's examples in place of {name} and for what the query must have. */
static char *example_path(const char *name, JsonObject *operation)
{
    g_autoptr(GString) path = g_string_new(name);
    const char *mark = "?";
    JsonArray *parameters =
        json_object_has_member(operation, "parameters") ? json_object_get_array_member(operation, "parameters") : NULL;

    for (guint i = 0; parameters && i < json_array_get_length(parameters); i++) {
        JsonObject *parameter = json_array_get_object_element(parameters, i);
        if (!json_object_has_member(parameter, "example"))
            continue;
        const char *example = json_object_get_string_member(parameter, "example");
        if (!strcmp(json_object_get_string_member(parameter, "in"), "path"))
            g_string_replace(path, "{name}", example, 1);
        else {
            g_string_append_printf(path, "%s%s=%s", mark, json_object_get_string_member(parameter, "name"), example);
            mark = "&";
        }
    }
    return g_string_free(g_steal_pointer(&path), FALSE);
}

/* What has no name in its path must be well: there is something everywhere. */
static void assert_described(JsonObject *operation, unsigned status, const char *path)
{
    g_autofree char *word = g_strdup_printf("%u", status);

    if (!json_object_has_member(json_object_get_object_member(operation, "responses"), word))
        fail_msg("%s answers %u, which is not described", path, status);
    /* Nobody can log in where there is no user (test_api_access), nor verify where no capture is (test_api_captures).
     */
    if (status >= 300 && !json_object_has_member(operation, "parameters") &&
        !g_str_has_prefix(path, "/api/v1/session/") && !g_str_has_prefix(path, "/api/v1/captures/"))
        fail_msg("%s answers %u", path, status);
}

static void every_path_is_there_and_answers_as_described(void **state)
{
    g_autoptr(GList) names = json_object_get_members(paths);

    something_everywhere();
    for (GList *name = names; name; name = name->next) {
        JsonObject *methods = json_object_get_object_member(paths, name->data);
        g_autoptr(GList) kinds = json_object_get_members(methods);
        for (GList *kind = kinds; kind; kind = kind->next) {
            JsonObject *operation = json_object_get_object_member(methods, kind->data);
            bool post = !strcmp(kind->data, "post");
            if (!strcmp(name->data, "/api/v1/events"))
                continue;
            g_autofree char *path = example_path(name->data, operation);
            struct answer answer = fixture_ask(*state, post ? "POST" : "GET", path, post ? JSON_TYPE : NULL,
                                               post ? body_for(name->data) : NULL);
            assert_described(operation, answer.status, path);
            JsonObject *schema = schema_of(operation, answer.status, "application/json");
            if (schema) {
                g_autoptr(JsonParser) parsed = json_parser_new();
                assert_true(json_parser_load_from_data(parsed, answer.body, -1, NULL));
                check(json_parser_get_root(parsed), schema, name->data);
            }
            answer_clear(&answer);
        }
    }
}

/* The routes of the server, found by what a wrong method is told. */
static void every_route_is_described(void **state)
{
    for (int i = 0; lumi_api_routes[i].path; i++) {
        const struct lumi_api_route *route = &lumi_api_routes[i];
        g_autofree char *method = g_ascii_strdown(route->method, -1);
        if (!json_object_has_member(paths, route->path) ||
            !json_object_has_member(json_object_get_object_member(paths, route->path), method))
            fail_msg("%s %s is not described", route->method, route->path);
    }
    (void)state;
}

static const char *const type_names[] = {"string", "boolean", "array", "integer", "number"};

/* A GET's field is a parameter of the query, a POST's a property of the body. */
static JsonObject *described_field(JsonObject *operation, const char *name)
{
    JsonArray *parameters =
        json_object_has_member(operation, "parameters") ? json_object_get_array_member(operation, "parameters") : NULL;

    for (guint i = 0; parameters && i < json_array_get_length(parameters); i++) {
        JsonObject *parameter = json_array_get_object_element(parameters, i);
        if (!strcmp(json_object_get_string_member(parameter, "in"), "query") &&
            !strcmp(json_object_get_string_member(parameter, "name"), name))
            return json_object_get_object_member(parameter, "schema");
    }
    if (!json_object_has_member(operation, "requestBody"))
        return NULL;
    JsonObject *content =
        json_object_get_object_member(json_object_get_object_member(operation, "requestBody"), "content");
    JsonObject *schema =
        follow(json_object_get_object_member(json_object_get_object_member(content, "application/json"), "schema"));
    JsonObject *properties = json_object_get_object_member(schema, "properties");
    return json_object_has_member(properties, name) ? json_object_get_object_member(properties, name) : NULL;
}

static int described_fields(JsonObject *operation)
{
    int count = 0;

    if (json_object_has_member(operation, "parameters")) {
        JsonArray *parameters = json_object_get_array_member(operation, "parameters");
        for (guint i = 0; i < json_array_get_length(parameters); i++)
            count +=
                !strcmp(json_object_get_string_member(json_array_get_object_element(parameters, i), "in"), "query");
    }
    if (json_object_has_member(operation, "requestBody")) {
        JsonObject *content =
            json_object_get_object_member(json_object_get_object_member(operation, "requestBody"), "content");
        JsonObject *schema =
            follow(json_object_get_object_member(json_object_get_object_member(content, "application/json"), "schema"));
        count += (int)json_object_get_size(json_object_get_object_member(schema, "properties"));
    }
    return count;
}

static void assert_bounds(JsonObject *property, const struct lumi_api_field *field)
{
    static const char *const greatest[] = {"maxLength", NULL, "maxItems", "maximum", NULL};

    assert_string_equal(json_object_get_string_member(property, "type"), type_names[field->type]);
    if (field->type == LUMI_API_BOOL)
        assert_int_equal(json_object_get_boolean_member(property, "default"), field->initially);
    else if (field->type == LUMI_API_NUMBER) {
        assert_float_equal(json_object_get_double_member(property, "minimum"), field->least, 1e-9);
        assert_float_equal(json_object_get_double_member(property, "maximum"), field->most, 1e-9);
    } else
        assert_int_equal(json_object_get_int_member(property, greatest[field->type]), field->max);
}

static void every_field_that_is_taken_is_described(void **state)
{
    (void)state;
    for (int i = 0; lumi_api_routes[i].path; i++) {
        const struct lumi_api_route *route = &lumi_api_routes[i];
        int count = 0;
        if (!route->fields)
            continue;
        g_autofree char *method = g_ascii_strdown(route->method, -1);
        JsonObject *operation =
            json_object_get_object_member(json_object_get_object_member(paths, route->path), method);
        for (; route->fields[count].name; count++) {
            JsonObject *property = described_field(operation, route->fields[count].name);
            if (!property)
                fail_msg("%s takes %s, which is not described", route->path, route->fields[count].name);
            assert_bounds(property, &route->fields[count]);
        }
        assert_int_equal(described_fields(operation), count);
    }
}

static void every_reference_leads_somewhere(void **state)
{
    g_autofree char *text = NULL;
    g_autoptr(GRegex) reference = g_regex_new("\"#/components/schemas/([A-Za-z]+)\"", 0, 0, NULL);
    g_autoptr(GMatchInfo) match = NULL;
    int count = 0;

    (void)state;
    assert_true(g_file_get_contents(LUMI_SOURCE_DIR "/daemon/http/openapi.json", &text, NULL, NULL));
    for (g_regex_match(reference, text, 0, &match); g_match_info_matches(match); g_match_info_next(match, NULL)) {
        g_autofree char *name = g_match_info_fetch(match, 1);
        if (!json_object_has_member(schemas, name))
            fail_msg("the schema %s is not there", name);
        count++;
    }
    assert_true(count > 30);
}

static void a_problem_is_as_described(void **state)
{
    struct answer answer = fixture_ask(*state, "GET", "/nothing", NULL, NULL);

    check_text(answer.body, "Problem", "problem");
    answer_clear(&answer);
}

static void events_are_as_described(void **state)
{
    static const char *const kinds[] = {"State", "Check", "Shot", "Frame", "Incident", "Sealed"};
    static const char request[] = "GET /api/v1/events HTTP/1.1\r\nHost: localhost\r\n\r\n";
    struct fixture *fixture = *state;
    int fd = fixture_connect(fixture);

    fixture_send(fd, request, strlen(request));
    g_string_free(fixture_receive(fd, "retry:"), TRUE);
    for (int i = 0; i < 6; i++) {
        struct lumi_engine_told told = {.kind = (enum lumi_engine_tale)i, .unix_us = 1, .text = "why \"so\"\n"};
        lumi_http_told(fixture->http, &told);
    }
    GString *got = fixture_receive(fd, "event: sealed\ndata: ");
    while (!g_str_has_suffix(got->str, "\n\n\r\n")) {
        GString *rest = fixture_receive(fd, "\n\n\r\n");
        g_string_append_len(got, rest->str, (gssize)rest->len);
        g_string_free(rest, TRUE);
    }
    for (int i = 0; i < 6; i++) {
        g_autofree char *lower = g_ascii_strdown(kinds[i], -1);
        g_autofree char *mark = g_strdup_printf("event: %s\ndata: ", lower);
        g_autofree char *schema = g_strdup_printf("%sEvent", kinds[i]);
        const char *begin = strstr(got->str, mark);
        assert_non_null(begin);
        begin += strlen(mark);
        g_autofree char *data = g_strndup(begin, strcspn(begin, "\n"));
        check_text(data, schema, schema);
    }
    g_string_free(got, TRUE);
    close(fd);
}

int main(void)
{
#define CASE(name) cmocka_unit_test_setup_teardown(name, set_up, tear_down)
    const struct CMUnitTest tests[] = {
        CASE(every_path_is_there_and_answers_as_described),
        CASE(every_route_is_described),
        CASE(every_field_that_is_taken_is_described),
        CASE(every_reference_leads_somewhere),
        CASE(a_problem_is_as_described),
        CASE(events_are_as_described),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
