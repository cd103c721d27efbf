/* What the commands are told by whatever answers where lumid should be. The first byte picks: an answer (the second is
 * its status), or a stream of events. What is said to a person is one line that does nothing to a terminal. */
#include "checks.h"

#include "cli/capture_text.h"

#include <math.h>

static void demand(bool holds)
{
    if (!holds)
        abort();
}

static void is_harmless(const char *text)
{
    for (const unsigned char *c = (const unsigned char *)text; *c; c++)
        demand(*c >= 0x20 && *c != 0x7f && !(*c == 0xc2 && c[1] >= 0x80 && c[1] < 0xa0));
}

static void look(JsonObject *object)
{
    static const char *const names[] = {"state", "text", "checks", "shot", "lost", "camera", "time", "seconds_left"};
    char line[256];

    cli_capture_line(object, line, sizeof line);
    is_harmless(line);
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        is_harmless(cli_json_text(object, names[i]));
        demand(labs(cli_json_int(object, names[i])) <= 9000000000000000L);
        cli_json_bool(object, names[i]);
        cli_duration(cli_json_double(object, names[i]), line, sizeof line);
        demand(strlen(line) < 16);
        if (cli_json_object(object, names[i]))
            is_harmless(cli_json_text(cli_json_object(object, names[i]), "text"));
        for (int k = 0; k < cli_json_count(object, names[i]); k++)
            is_harmless(cli_json_text(cli_json_element(object, names[i], k), "name"));
    }
}

static void read_answer(const uint8_t *data, size_t size)
{
    static const unsigned statuses[] = {400, 401, 404, 409, 500};
    struct lumi_error error = {0};
    JsonNode *root = cli_answer_parse((const char *)data + 1, (gssize)size - 1);

    demand(checked(cli_answer_problem("http://localhost:8470", statuses[data[0] % 5], root, &error), &error) < 0);
    if (!root)
        return;
    is_harmless(error.text);
    look(json_node_get_object(root));
    json_node_unref(root);
}

static bool event(void *context, const char *kind, const char *id, const char *data, JsonObject *object)
{
    int *count = context;

    demand(strlen(kind) < 32 && strlen(id) < 64 && *data);
    look(object);
    return ++*count < 100;
}

static void read_events(const uint8_t *data, size_t size)
{
    int count = 0;
    struct cli_event_reader reader = {.event = event, .context = &count, .data = g_string_new(NULL), .more = true};
    g_autofree char *text = g_strndup((const char *)data, size);
    g_auto(GStrv) lines = g_strsplit(text, "\n", -1);

    for (int i = 0; lines[i] && reader.more; i++)
        cli_event_line(&reader, lines[i]);
    g_free(reader.id);
    g_string_free(reader.data, TRUE);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size < 2)
        return 0;
    if (data[0] % 2)
        read_events(data + 1, size - 1);
    else
        read_answer(data + 1, size - 1);
    return 0;
}
