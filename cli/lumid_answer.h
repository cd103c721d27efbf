/* What lumid answers, taken apart: answers, problem documents, lines of the stream of events (docs/api.md). */
#ifndef LUMI_CLI_LUMID_ANSWER_H
#define LUMI_CLI_LUMID_ANSWER_H

#include "proto/base/result.h"

#include <json-glib/json-glib.h>
#include <stdbool.h>

/* (transfer full) The object that an answer is, its strings without control characters; NULL: it is none. */
JsonNode *cli_answer_parse(const char *text, gssize size);
/* What an answer that is no good means; `root` may be NULL. `url`: whose it is. */
int cli_answer_problem(const char *url, unsigned status, JsonNode *root, struct lumi_error *error);

typedef bool (*cli_lumid_event_fn)(void *context, const char *kind, const char *id, const char *data,
                                   JsonObject *object);
struct cli_event_reader {
    cli_lumid_event_fn event;
    void *context;
    char *id; /* of the last event: where to go on */
    char kind[32], new_id[64];
    GString *data;
    bool more; /* event has not returned false yet */
};
/* A new event begins: what has come of the last one is forgotten. */
void cli_event_begin(struct cli_event_reader *reading);
/* One line of the stream, without its end. */
void cli_event_line(struct cli_event_reader *reading, const char *line);

/* Members that may be missing: "", 0, NaN, false, an empty array. */
const char *cli_json_text(JsonObject *object, const char *name);
long cli_json_int(JsonObject *object, const char *name);
double cli_json_double(JsonObject *object, const char *name);
bool cli_json_bool(JsonObject *object, const char *name);
JsonObject *cli_json_object(JsonObject *object, const char *name); /* NULL: there is none */
int cli_json_count(JsonObject *object, const char *name);          /* of an array */
JsonObject *cli_json_element(JsonObject *object, const char *name, int i);

#endif
