/* What lumid answers, taken apart. Whatever answers there, nothing it says can do more than be read: text loses its
 * control characters, which a terminal would obey. */
#include "cli/lumid_answer.h"

#include "proto/base/json_check.h"

#include <math.h>
#include <string.h>

#define EVENT_MAX (1 << 20)
#define INTEGER_MAX 9000000000000000L /* sums of some do not overflow */

/* ---- answers ---- */

static char *without_controls(const char *text)
{
    char *copy = g_strdup(text);

    for (unsigned char *c = (unsigned char *)copy; *c; c++)
        if (*c < 0x20 || *c == 0x7f)
            *c = ' ';
        else if (*c == 0xc2 && c[1] >= 0x80 && c[1] < 0xa0) /* U+0080 to U+009F */
            *c = ' ', *++c = ' ';
    return copy;
}

/* As deep as lumi_json_check lets it be. */
static void scrub(JsonNode *node)
{
    if (JSON_NODE_HOLDS_OBJECT(node)) {
        g_autoptr(GList) values = json_object_get_values(json_node_get_object(node));
        for (GList *at = values; at; at = at->next)
            scrub(at->data);
    } else if (JSON_NODE_HOLDS_ARRAY(node)) {
        g_autoptr(GList) values = json_array_get_elements(json_node_get_array(node));
        for (GList *at = values; at; at = at->next)
            scrub(at->data);
    } else if (JSON_NODE_HOLDS_VALUE(node) && json_node_get_value_type(node) == G_TYPE_STRING) {
        g_autofree char *text = without_controls(json_node_get_string(node));
        if (strcmp(text, json_node_get_string(node)))
            json_node_set_string(node, text);
    }
}

JsonNode *cli_answer_parse(const char *text, gssize size)
{
    g_autoptr(JsonParser) parser = json_parser_new();
    JsonNode *root;

    if (!lumi_json_check(text, (size_t)size) || !json_parser_load_from_data(parser, text, size, NULL))
        return NULL;
    root = json_parser_steal_root(parser);
    if (root && !JSON_NODE_HOLDS_OBJECT(root))
        g_clear_pointer(&root, json_node_unref);
    if (root)
        scrub(root);
    return root;
}

/* The word of a problem's type, and what it is in the tree. */
static int code_of(const char *word)
{
    static const struct {
        const char *word;
        int code;
    } table[] = {
        {"nomem", LUMI_ERR_NOMEM},         {"io", LUMI_ERR_IO},
        {"nospace", LUMI_ERR_NOSPACE},     {"busy", LUMI_ERR_BUSY},
        {"cancelled", LUMI_ERR_CANCELLED}, {"internal", LUMI_ERR_INTERNAL},
        {"argument", LUMI_ERR_ARG},        {"format", LUMI_ERR_FORMAT},
        {"version", LUMI_ERR_VERSION},     {"unsupported", LUMI_ERR_UNSUPPORTED},
        {"checksum", LUMI_ERR_CHECKSUM},   {"notfound", LUMI_ERR_NOTFOUND},
        {"exists", LUMI_ERR_EXISTS},       {"limit", LUMI_ERR_LIMIT},
        {"token", LUMI_ERR_ARG},           {"host", LUMI_ERR_ARG},
        {"session", LUMI_ERR_ARG},         {"role", LUMI_ERR_ARG},
    };

    for (size_t i = 0; i < sizeof table / sizeof table[0]; i++)
        if (!strcmp(table[i].word, word))
            return table[i].code;
    return LUMI_ERR_IO;
}

int cli_answer_problem(const char *url, unsigned status, JsonNode *root, struct lumi_error *error)
{
    JsonObject *object = root ? json_node_get_object(root) : NULL;
    const char *type = cli_json_text(object, "type"), *detail = cli_json_text(object, "detail");

    if (!g_str_has_prefix(type, "urn:lumid:"))
        return lumi_fail(error, LUMI_ERR_IO, "%s: what answers there is no lumid of this version (status %u)", url,
                         status);
    if (!*detail)
        return lumi_fail(error, code_of(type + strlen("urn:lumid:")),
                         "lumid at %s refuses, without a reason (status %u)", url, status);
    if (status == 401)
        return lumi_fail(error, LUMI_ERR_ARG, "lumid at %s: %s: --token-file FILE, or LUMID_TOKEN in the environment",
                         url, detail);
    return lumi_fail(error, code_of(type + strlen("urn:lumid:")), "%s", detail);
}

/* ---- events ---- */

void cli_event_begin(struct cli_event_reader *reading)
{
    reading->kind[0] = reading->new_id[0] = '\0';
    g_string_truncate(reading->data, 0);
}

/* One line of the stream (HTML Living Standard, 9.2.6). */
void cli_event_line(struct cli_event_reader *reading, const char *line)
{
    if (g_str_has_prefix(line, "event: "))
        g_strlcpy(reading->kind, line + 7, sizeof reading->kind);
    else if (g_str_has_prefix(line, "id: "))
        g_strlcpy(reading->new_id, line + 4, sizeof reading->new_id);
    else if (g_str_has_prefix(line, "data: ") && reading->data->len + strlen(line) < EVENT_MAX)
        g_string_append(reading->data, line + 6);
    if (*line)
        return;
    if (reading->data->len) {
        JsonNode *root = cli_answer_parse(reading->data->str, (gssize)reading->data->len);
        reading->more = reading->event(reading->context, reading->kind, reading->new_id, reading->data->str,
                                       root ? json_node_get_object(root) : NULL);
        if (root)
            json_node_unref(root);
        if (reading->new_id[0]) {
            g_free(reading->id);
            reading->id = g_strdup(reading->new_id);
        }
    }
    cli_event_begin(reading);
}

/* ---- members that may be missing ---- */

static JsonNode *value_of(JsonObject *object, const char *name)
{
    JsonNode *node = object ? json_object_get_member(object, name) : NULL;

    return node && JSON_NODE_HOLDS_VALUE(node) ? node : NULL;
}

const char *cli_json_text(JsonObject *object, const char *name)
{
    JsonNode *node = value_of(object, name);

    return node && json_node_get_value_type(node) == G_TYPE_STRING ? json_node_get_string(node) : "";
}

long cli_json_int(JsonObject *object, const char *name)
{
    JsonNode *node = value_of(object, name);

    if (node && json_node_get_value_type(node) == G_TYPE_DOUBLE) {
        double number = json_node_get_double(node);
        return fabs(number) <= (double)INTEGER_MAX ? (long)number : 0;
    }
    return node ? CLAMP((long)json_node_get_int(node), -INTEGER_MAX, INTEGER_MAX) : 0;
}

double cli_json_double(JsonObject *object, const char *name)
{
    JsonNode *node = value_of(object, name);

    return node ? json_node_get_double(node) : NAN;
}

bool cli_json_bool(JsonObject *object, const char *name)
{
    JsonNode *node = value_of(object, name);

    return node && json_node_get_boolean(node);
}

JsonObject *cli_json_object(JsonObject *object, const char *name)
{
    JsonNode *node = object ? json_object_get_member(object, name) : NULL;

    return node && JSON_NODE_HOLDS_OBJECT(node) ? json_node_get_object(node) : NULL;
}

static JsonArray *array_of(JsonObject *object, const char *name)
{
    JsonNode *node = object ? json_object_get_member(object, name) : NULL;

    return node && JSON_NODE_HOLDS_ARRAY(node) ? json_node_get_array(node) : NULL;
}

int cli_json_count(JsonObject *object, const char *name)
{
    JsonArray *array = array_of(object, name);

    return array ? (int)json_array_get_length(array) : 0;
}

JsonObject *cli_json_element(JsonObject *object, const char *name, int i)
{
    JsonNode *node = json_array_get_element(array_of(object, name), (guint)i);

    return JSON_NODE_HOLDS_OBJECT(node) ? json_node_get_object(node) : NULL;
}
