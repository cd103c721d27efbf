/* What the files of the server share. */
#ifndef LUMI_DAEMON_HTTP_API_PRIV_H
#define LUMI_DAEMON_HTTP_API_PRIV_H

#include "daemon/http/api_json.h"
#include "daemon/http/api_request.h"
#include "daemon/http/api_server.h"
#include "daemon/http/api_worker.h"

#include <libsoup/soup.h>

struct lumi_api_events;
struct lumi_api_guard;
struct lumi_http {
    struct lumi_http_options options; /* its strings are copies */
    SoupServer *server;
    struct lumi_api_worker *worker;
    struct lumi_api_events *events;
    struct lumi_api_guard *guard;
    struct lumi_engine_status *status; /* for one handler at a time */
    bool https;
    int port;
};

/* ---- answers (api_answer.c) ---- */

/* Takes over `text`. */
void lumi_api_answer(SoupServerMessage *message, unsigned status, const char *type, char *text);
/* Ends the builder. */
void lumi_api_answer_json(SoupServerMessage *message, unsigned status, JsonBuilder *builder);
/* A problem document (RFC 9457). `word` becomes its type, "urn:lumid:WORD". */
void lumi_api_problem(SoupServerMessage *message, unsigned status, const char *word, const char *detail);
/* (transfer full) The document itself. */
char *lumi_api_problem_text(unsigned status, const char *word, const char *detail);
/* (transfer full) The whole answer, for a connection that the server has nothing to do with; closes it. */
char *lumi_api_problem_message(unsigned status, const char *word, const char *detail);
/* For a code of the tree. */
void lumi_api_problem_of(SoupServerMessage *message, int code, const char *text);

/* ---- what is asked for (api_calls.c, api_lists.c) ---- */

typedef void (*lumi_api_call)(struct lumi_http *http, SoupServerMessage *message, const struct lumi_api_body *body);
struct lumi_api_route {
    const char *path, *method;
    const struct lumi_api_field *fields; /* of the body; NULL: none is read */
    lumi_api_call call;
};
extern const struct lumi_api_route lumi_api_routes[]; /* path NULL ends it */

void lumi_api_get_captures(struct lumi_http *http, SoupServerMessage *message, const struct lumi_api_body *body);
void lumi_api_get_devices(struct lumi_http *http, SoupServerMessage *message, const struct lumi_api_body *body);

/* ---- events (api_events.c) ---- */

int lumi_api_events_create(struct lumi_http *http, struct lumi_api_events **events, struct lumi_error *error);
void lumi_api_events_destroy(struct lumi_api_events *events);
void lumi_api_get_events(struct lumi_http *http, SoupServerMessage *message, const struct lumi_api_body *body);
void lumi_api_events_told(struct lumi_api_events *events, const struct lumi_engine_told *told);
void lumi_api_events_processing(struct lumi_api_events *events, const struct lumi_process_status *status);
void lumi_api_events_ingest(struct lumi_api_events *events, const struct lumi_ingest_status *status);

/* ---- connections (api_guard.c) ---- */

/* From now on; lumi_api_guard_listeners when the server listens. */
struct lumi_api_guard *lumi_api_guard_create(struct lumi_http *http);
void lumi_api_guard_listeners(struct lumi_api_guard *guard);
void lumi_api_guard_destroy(struct lumi_api_guard *guard);
/* This answer may take as long as it likes. */
void lumi_api_guard_spare(struct lumi_api_guard *guard, SoupServerMessage *message);

/* ---- a request that is too large (api_refuse.c) ---- */

/* Answers with a problem before the body has been read, and closes the connection; reads little of what is on its way
 * so that who sends it sees the answer. */
void lumi_api_refuse_early(SoupServerMessage *message, unsigned status, const char *word, const char *detail);

extern const char lumi_api_openapi[]; /* openapi.json, put into the program by the build */

#endif
