/* What a request says, taken apart. */
#include "daemon/http/api_request.h"

#include "proto/base/json_check.h"

#include <gio/gio.h>
#include <inttypes.h>
#include <json-glib/json-glib.h>
#include <math.h>
#include <string.h>

/* What came from outside, as it may stand in a message: one line of some length. */
static char *quoted(const char *text)
{
    g_autofree char *valid = g_utf8_make_valid(text, -1);
    GString *out = g_string_new(NULL);

    for (const char *at = valid; *at && g_utf8_pointer_to_offset(valid, at) < 60; at = g_utf8_next_char(at))
        g_string_append_unichar(out, g_unichar_isprint(g_utf8_get_char(at)) ? g_utf8_get_char(at) : '?');
    return g_string_free(out, FALSE);
}

/* ---- addresses ---- */

static bool parse_port(const char *text, int *port)
{
    char *end;
    guint64 value = g_ascii_strtoull(text, &end, 10);

    if (!g_ascii_isdigit(text[0]) || *end || value > 65535)
        return false;
    *port = (int)value;
    return true;
}

int lumi_api_listen_parse(const char *text, struct lumi_api_listen *listen, struct lumi_error *error)
{
    const char *colon = strrchr(text, ':');
    size_t size = colon ? (size_t)(colon - text) : 0;
    g_autofree char *shown = quoted(text);

    if (!colon || !size || size >= sizeof listen->host || !parse_port(colon + 1, &listen->port))
        return lumi_fail(error, LUMI_ERR_ARG, "listen on '%s': localhost:PORT, ADDRESS:PORT or [ADDRESS]:PORT wanted",
                         shown);
    memcpy(listen->host, text, size);
    listen->host[size] = '\0';
    if (size > 2 && listen->host[0] == '[' && listen->host[size - 1] == ']') {
        memmove(listen->host, listen->host + 1, size - 2);
        listen->host[size - 2] = '\0';
    } else if (strchr(listen->host, ':'))
        return lumi_fail(error, LUMI_ERR_ARG, "listen on '%s': an IPv6 address stands in brackets: [ADDRESS]:PORT",
                         shown);
    listen->loopback = !strcmp(listen->host, "localhost");
    if (listen->loopback || !strcmp(listen->host, "*"))
        return LUMI_OK;
    g_autoptr(GInetAddress) address = g_inet_address_new_from_string(listen->host);
    if (!address)
        return lumi_fail(error, LUMI_ERR_ARG,
                         "listen on '%s': neither localhost nor an address of this computer in numbers", shown);
    listen->loopback = g_inet_address_get_is_loopback(address);
    return LUMI_OK;
}

bool lumi_api_host_is_local(const char *host)
{
    static const char *const names[] = {"localhost", "127.0.0.1", "[::1]"};

    for (int i = 0; host && i < 3; i++) {
        size_t size = strlen(names[i]);
        int port;
        if (!g_ascii_strncasecmp(host, names[i], size) &&
            (!host[size] || (host[size] == ':' && parse_port(host + size + 1, &port))))
            return true;
    }
    return false;
}

bool lumi_api_origin_is_own(const char *origin, const char *scheme, const char *host)
{
    if (!host)
        return false;
    g_autofree char *own = g_strconcat(scheme, "://", host, NULL);
    return !g_ascii_strcasecmp(origin, own);
}

/* Both are hashed first: what is compared has one length, and a byte of it says nothing about a byte of the token. */
bool lumi_api_token_matches(const char *authorization, const char *token)
{
    static const char scheme[] = "Bearer ";
    const char *given = "";
    bool bearer = authorization && !g_ascii_strncasecmp(authorization, scheme, sizeof scheme - 1);
    unsigned char difference = 0;

    if (bearer)
        for (given = authorization + sizeof scheme - 1; *given == ' ';)
            given++;
    g_autofree char *a = g_compute_checksum_for_string(G_CHECKSUM_SHA256, given, -1);
    g_autofree char *b = g_compute_checksum_for_string(G_CHECKSUM_SHA256, token, -1);
    for (int i = 0; i < 64; i++)
        difference |= (unsigned char)(a[i] ^ b[i]);
    return bearer && !difference;
}

bool lumi_api_event_id_parse(const char *text, uint32_t *epoch, uint64_t *number)
{
    char *end;
    guint64 first;

    if (!text || !g_ascii_isxdigit(text[0]))
        return false;
    first = g_ascii_strtoull(text, &end, 16);
    if (*end != '-' || first > UINT32_MAX || end - text > 8 || !g_ascii_isdigit(end[1]) || strlen(end + 1) > 19)
        return false;
    *epoch = (uint32_t)first;
    *number = g_ascii_strtoull(end + 1, &end, 10);
    return !*end;
}

/* ---- paths ---- */

static bool is_name(const char *text)
{
    size_t size = strlen(text);

    if (!size || size > LUMI_API_STRING_MAX || text[0] == '.' || !g_utf8_validate(text, -1, NULL))
        return false;
    for (size_t i = 0; i < size; i++)
        if (text[i] == '/' || g_ascii_iscntrl(text[i]))
            return false;
    return true;
}

bool lumi_api_path_match(const char *pattern, const char *path, char part[LUMI_API_STRING_MAX + 1])
{
    const char *open = strchr(pattern, '{'), *close = open ? strchr(open, '}') : NULL;
    size_t before = open ? (size_t)(open - pattern) : 0, size = strlen(path);

    part[0] = '\0';
    if (!close)
        return !strcmp(pattern, path);
    size_t after = strlen(close + 1);
    if (size <= before + after || strncmp(pattern, path, before) || strcmp(path + size - after, close + 1) ||
        memchr(path + before, '/', size - before - after))
        return false;
    g_autofree char *name = g_uri_unescape_segment(path + before, path + size - after, NULL);
    if (!name || !is_name(name))
        return false;
    g_strlcpy(part, name, LUMI_API_STRING_MAX + 1);
    return true;
}

/* ---- bodies ---- */

static int take_strings(JsonNode *node, const struct lumi_api_field *field, struct lumi_api_value *value,
                        struct lumi_error *error)
{
    JsonArray *array = JSON_NODE_HOLDS_ARRAY(node) ? json_node_get_array(node) : NULL;
    guint count = array ? json_array_get_length(array) : 0;

    if (!array)
        return lumi_fail(error, LUMI_ERR_FORMAT, "'%s': a list of strings wanted", field->name);
    if (count > field->max)
        return lumi_fail(error, LUMI_ERR_FORMAT, "'%s': %u strings, %zu are the most", field->name, count, field->max);
    value->strings = g_new0(char *, count + 1);
    for (guint i = 0; i < count; i++) {
        JsonNode *element = json_array_get_element(array, i);
        if (json_node_get_value_type(element) != G_TYPE_STRING ||
            strlen(json_node_get_string(element)) > LUMI_API_STRING_MAX)
            return lumi_fail(error, LUMI_ERR_FORMAT, "'%s', element %u: a string of at most %d bytes wanted",
                             field->name, i, LUMI_API_STRING_MAX);
        value->strings[i] = json_node_dup_string(element);
    }
    return LUMI_OK;
}

static int take_int(int64_t number, const struct lumi_api_field *field, struct lumi_api_value *value,
                    struct lumi_error *error)
{
    if (number < 0 || (uint64_t)number > field->max)
        return lumi_fail(error, LUMI_ERR_FORMAT, "'%s': a whole number from 0 to %zu wanted", field->name, field->max);
    value->number = (int)number;
    return LUMI_OK;
}

static int take_real(double number, const struct lumi_api_field *field, struct lumi_api_value *value,
                     struct lumi_error *error)
{
    if (!(number >= field->least && number <= field->most)) /* a NaN is neither */
        return lumi_fail(error, LUMI_ERR_FORMAT, "'%s': a number from %g to %g wanted", field->name, field->least,
                         field->most);
    value->real = number;
    return LUMI_OK;
}

static int take_string(const char *text, const struct lumi_api_field *field, struct lumi_api_value *value,
                       struct lumi_error *error)
{
    if (strlen(text) > field->max)
        return lumi_fail(error, LUMI_ERR_FORMAT, "'%s': %zu bytes, %zu are the most", field->name, strlen(text),
                         field->max);
    value->string = g_strdup(text);
    return LUMI_OK;
}

static int take_value(JsonNode *node, const struct lumi_api_field *field, struct lumi_api_value *value,
                      struct lumi_error *error)
{
    GType type = json_node_get_value_type(node);

    value->given = true;
    if (field->type == LUMI_API_STRINGS)
        return take_strings(node, field, value, error);
    if (field->type == LUMI_API_BOOL) {
        if (type != G_TYPE_BOOLEAN)
            return lumi_fail(error, LUMI_ERR_FORMAT, "'%s': true or false wanted", field->name);
        value->boolean = json_node_get_boolean(node);
        return LUMI_OK;
    }
    if (field->type == LUMI_API_INT)
        return take_int(type == G_TYPE_INT64 ? json_node_get_int(node) : -1, field, value, error);
    if (field->type == LUMI_API_NUMBER)
        return take_real(type == G_TYPE_INT64 || type == G_TYPE_DOUBLE ? json_node_get_double(node) : NAN, field, value,
                         error);
    if (type != G_TYPE_STRING)
        return lumi_fail(error, LUMI_ERR_FORMAT, "'%s': a string wanted", field->name);
    return take_string(json_node_get_string(node), field, value, error);
}

static int find_field(const struct lumi_api_field *fields, const char *name, int *at, struct lumi_error *error)
{
    for (*at = 0; fields[*at].name; ++*at)
        if (!strcmp(fields[*at].name, name))
            return LUMI_OK;
    g_autofree char *shown = quoted(name);
    return lumi_fail(error, LUMI_ERR_FORMAT, "'%s': there is no such field", shown);
}

static int find_missing(const struct lumi_api_field *fields, const struct lumi_api_body *body, struct lumi_error *error)
{
    for (int i = 0; fields[i].name; i++)
        if (fields[i].required && !body->values[i].given)
            return lumi_fail(error, LUMI_ERR_FORMAT, "'%s' is missing", fields[i].name);
    return LUMI_OK;
}

static void begin_body(struct lumi_api_body *body, const struct lumi_api_field *fields)
{
    memset(body->values, 0, sizeof body->values);
    for (int i = 0; fields[i].name; i++)
        body->values[i].boolean = fields[i].initially;
}

static int take_members(JsonObject *object, const struct lumi_api_field *fields, struct lumi_api_body *body,
                        struct lumi_error *error)
{
    JsonObjectIter iter;
    const char *name;
    JsonNode *node;

    json_object_iter_init(&iter, object);
    while (json_object_iter_next(&iter, &name, &node)) {
        int at;
        LUMI_TRY(find_field(fields, name, &at, error));
        if (!JSON_NODE_HOLDS_NULL(node)) /* as if it were not there */
            LUMI_TRY(take_value(node, &fields[at], &body->values[at], error));
    }
    return find_missing(fields, body, error);
}

/* In JSON that is well-formed: what is read as C strings would end there. */
static bool has_zero(const char *text, size_t size)
{
    for (size_t i = 0; i + 5 < size; i++)
        if (text[i] == '\\' && (text[i + 1] != 'u' || memcmp(text + i + 2, "0000", 4) != 0))
            i++; /* what is escaped is no beginning of another */
        else if (text[i] == '\\')
            return true;
    return false;
}

int lumi_api_body_parse(const char *text, size_t size, const struct lumi_api_field *fields, struct lumi_api_body *body,
                        struct lumi_error *error)
{
    g_autoptr(JsonParser) parser = json_parser_new();
    const char *fault;
    JsonNode *root;

    begin_body(body, fields);
    if (!size) {
        text = "{}";
        size = 2;
    }
    fault = lumi_json_fault(text, size);
    if (fault)
        return lumi_fail(error, LUMI_ERR_ARG, "the body is no JSON from byte %td on", fault - text);
    if (has_zero(text, size))
        return lumi_fail(error, LUMI_ERR_FORMAT, "a string with a zero (\\u0000) in it");
    if (!json_parser_load_from_data(parser, text, (gssize)size, NULL))
        return lumi_fail(error, LUMI_ERR_ARG, "the body is no JSON");
    root = json_parser_get_root(parser);
    if (!root || !JSON_NODE_HOLDS_OBJECT(root))
        return lumi_fail(error, LUMI_ERR_FORMAT, "the body is JSON, but no object");
    return take_members(json_node_get_object(root), fields, body, error);
}

static int take_word(const char *text, const struct lumi_api_field *field, struct lumi_api_value *value,
                     struct lumi_error *error)
{
    char *end;

    if (value->given)
        return lumi_fail(error, LUMI_ERR_FORMAT, "'%s' comes twice", field->name);
    value->given = true;
    if (field->type == LUMI_API_BOOL) {
        value->boolean = !strcmp(text, "true");
        return value->boolean || !strcmp(text, "false")
                   ? LUMI_OK
                   : lumi_fail(error, LUMI_ERR_FORMAT, "'%s': true or false wanted", field->name);
    }
    if (field->type == LUMI_API_INT) {
        gint64 number = g_ascii_strtoll(text, &end, 10);
        return take_int(g_ascii_isdigit(text[0]) && !*end ? number : -1, field, value, error);
    }
    if (field->type == LUMI_API_NUMBER) {
        double number = g_ascii_strtod(text, &end);
        return take_real(*text && !*end ? number : NAN, field, value, error);
    }
    return take_string(text, field, value, error);
}

int lumi_api_query_parse(const char *query, const struct lumi_api_field *fields, struct lumi_api_body *body,
                         struct lumi_error *error)
{
    g_auto(GStrv) pairs = g_strsplit(query ? query : "", "&", -1);

    begin_body(body, fields);
    for (int i = 0; pairs[i]; i++) {
        char *equals = strchr(pairs[i], '=');
        g_autofree char *name = g_uri_unescape_segment(pairs[i], equals, NULL);
        g_autofree char *text = g_uri_unescape_string(equals ? equals + 1 : "", NULL);
        int at;
        if (!*pairs[i])
            continue;
        if (!name || !text || !g_utf8_validate(name, -1, NULL) || !g_utf8_validate(text, -1, NULL))
            return lumi_fail(error, LUMI_ERR_ARG, "the query is not encoded as one");
        LUMI_TRY(find_field(fields, name, &at, error));
        LUMI_TRY(take_word(text, &fields[at], &body->values[at], error));
    }
    return find_missing(fields, body, error);
}

void lumi_api_body_clear(struct lumi_api_body *body)
{
    for (int i = 0; i < LUMI_API_FIELDS; i++) {
        g_free(body->values[i].string);
        g_strfreev(body->values[i].strings);
    }
    memset(body, 0, sizeof *body);
}
