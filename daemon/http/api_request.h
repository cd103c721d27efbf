/* What a request says, taken apart: path, names, token, body. Reads what comes from outside; knows no connection. */
#ifndef LUMI_DAEMON_HTTP_API_REQUEST_H
#define LUMI_DAEMON_HTTP_API_REQUEST_H

#include "proto/base/result.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* "localhost:8470" (both loopback addresses: *host is "localhost"), "ADDRESS:PORT", "[ADDRESS6]:PORT", "*:PORT". */
struct lumi_api_listen {
    char host[64];
    int port;
    bool loopback;
};
int lumi_api_listen_parse(const char *text, struct lumi_api_listen *listen, struct lumi_error *error);

/* Whether a Host header names this computer as a browser on it would: localhost, 127.0.0.1, [::1], with or without a
 * port. A name that leads to 127.0.0.1 by a foreign DNS server (rebinding) is none. */
bool lumi_api_host_is_local(const char *host);
/* Whether an Origin header is the page's own: SCHEME://HOST as the Host header has it. */
bool lumi_api_origin_is_own(const char *origin, const char *scheme, const char *host);
/* "Bearer TOKEN" against the token; the time it takes does not tell how much of it is right. */
bool lumi_api_token_matches(const char *authorization, const char *token);
/* "EPOCH-NUMBER" of an event, as in Last-Event-ID. */
bool lumi_api_event_id_parse(const char *text, uint32_t *epoch, uint64_t *number);

enum lumi_api_type { LUMI_API_STRING = 0, LUMI_API_BOOL, LUMI_API_STRINGS, LUMI_API_INT, LUMI_API_NUMBER };
struct lumi_api_field {
    const char *name; /* NULL ends a table */
    enum lumi_api_type type;
    bool required;
    bool initially;     /* BOOL: where it is not given */
    size_t max;         /* bytes of the string; number of strings, each of 255 bytes; the greatest INT, from 0 on */
    double least, most; /* NUMBER */
};
#define LUMI_API_FIELDS 12
#define LUMI_API_STRING_MAX 255
struct lumi_api_value {
    bool given, boolean;
    int number;  /* INT: 0 where it is not given */
    double real; /* NUMBER: likewise */
    char *string;
    char **strings; /* NULL-terminated */
};
struct lumi_api_body {
    struct lumi_api_value values[LUMI_API_FIELDS]; /* in the order of the fields */
    char part[LUMI_API_STRING_MAX + 1];            /* what stands for the path's {name}; "" where it has none */
};
/* Whether a path, as it came, is one of this pattern, which may hold one "{name}" in place of a whole segment: what
 * stands there is decoded into `part`. A name that could lead elsewhere (empty, with '/', control characters or a dot
 * at its beginning, no UTF-8, over 255 bytes) fits no pattern. */
bool lumi_api_path_match(const char *pattern, const char *path, char part[LUMI_API_STRING_MAX + 1]);
/* `size` 0 is an empty object. Fields of another name are refused. LUMI_ERR_ARG: no JSON, and where; LUMI_ERR_FORMAT: a
 * field that is missing, of another type, too long, unknown. `part` stays. The body is to be cleared in either case. */
int lumi_api_body_parse(const char *text, size_t size, const struct lumi_api_field *fields, struct lumi_api_body *body,
                        struct lumi_error *error);
/* The same for the query of a GET ("a=1&b=two", NULL none): BOOL is true or false, STRINGS cannot be. */
int lumi_api_query_parse(const char *query, const struct lumi_api_field *fields, struct lumi_api_body *body,
                         struct lumi_error *error);
void lumi_api_body_clear(struct lumi_api_body *body);

#endif
