/* Who asks, and what they may: the files of the door share this (api_door.c, api_people.c, api_access.c, api_secure.c).
 * All of it is of the server's thread. */
#ifndef LUMI_DAEMON_HTTP_API_DOOR_H
#define LUMI_DAEMON_HTTP_API_DOOR_H

#include "daemon/access/attempts.h"
#include "daemon/access/certificate.h"
#include "daemon/access/pairing.h"
#include "daemon/access/sessions.h"
#include "daemon/http/api_priv.h"

enum lumi_api_via { LUMI_API_LOCAL = 0, LUMI_API_PASSWORD, LUMI_API_PAIR, LUMI_API_TOKEN };

/* Who sent a message, once the door has let it in. */
struct lumi_api_visitor {
    enum lumi_api_role role; /* ANYBODY: nobody is logged in */
    enum lumi_api_via via;
    char key[80]; /* who they are among all: the session's id, or whence they come */
    char name[LUMI_USER_NAME];
    char address[LUMI_SESSION_ADDRESS];
    char secret[LUMI_SECRET_TEXT]; /* of the session; "": there is none */
    bool here, tls, token;         /* by a token that was shown */
};

/* Somebody who is there: a stream of theirs is open, or they asked for something a moment ago. */
struct lumi_api_party {
    struct lumi_api_visitor who; /* without the secret */
    int64_t since_ns, seen_ns;
    int streams;
};

struct lumi_api_door {
    struct lumi_http *http;
    struct lumi_users users;
    struct lumi_sessions *sessions;
    struct lumi_pairing pairing;
    struct lumi_attempts *attempts;
    struct lumi_api_worker *worker; /* passwords, and files: nobody's stop waits for either */
    GPtrArray *parties, *streams;
    uint64_t people, told; /* changes among them; those that were told, at most once a second */
    char *folder, *users_file;
    char local[LUMI_SECRET_TEXT]; /* what `lumi` on this computer shows; "": it is not kept */
    GSource *tick;
    /* api_secure.c */
    struct lumi_api_secure *secure;
    bool looking, saving;
    uint64_t saved; /* version of the sessions in the file */
    int guests;     /* that were paired, to give them numbers */
};

int64_t lumi_api_now(const struct lumi_http *http);
int64_t lumi_api_unix_us(const struct lumi_http *http);
/* Of the moment `at_ns` on the clock of now_ns. */
int64_t lumi_api_unix_us_at(const struct lumi_http *http, int64_t at_ns);

/* ---- api_door.c ---- */

/* (transfer none) Who sent it; ANYBODY with all else empty where nobody asked the door. */
const struct lumi_api_visitor *lumi_api_visitor(SoupServerMessage *message);
void lumi_api_set_cookie(SoupServerMessage *message, const char *secret, int64_t seconds, bool tls);
/* Sessions may have ended: their streams end as well. */
void lumi_api_door_swept(struct lumi_api_door *door);

/* ---- api_people.c ---- */

/* They asked for something. */
void lumi_api_people_seen(struct lumi_api_door *door, const struct lumi_api_visitor *who);
void lumi_api_people_tick(struct lumi_api_door *door);
void lumi_api_people_finish(struct lumi_api_door *door);

/* ---- api_secure.c: what lies in the folder, and the listener with TLS ---- */

int lumi_api_secure_create(struct lumi_api_door *door, struct lumi_error *error);
void lumi_api_secure_destroy(struct lumi_api_door *door);
void lumi_api_secure_tick(struct lumi_api_door *door);
/* Adds "secure", an object. */
void lumi_api_secure_put(const struct lumi_api_door *door, JsonBuilder *builder);
/* (transfer full) "https://192.168.1.5:8471/"; NULL: it does not listen, or no address leads there. */
char *lumi_api_secure_url(const struct lumi_api_door *door);
const char *lumi_api_secure_fingerprint(const struct lumi_api_door *door);

#endif
