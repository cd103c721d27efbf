/* What the files of the server share. */
#ifndef LUMI_DAEMON_HTTP_API_PRIV_H
#define LUMI_DAEMON_HTTP_API_PRIV_H

#include "daemon/http/api_json.h"
#include "daemon/http/api_post.h"
#include "daemon/http/api_request.h"
#include "daemon/http/api_server.h"
#include "daemon/http/api_worker.h"

#include <libsoup/soup.h>
#include <pthread.h>

struct lumi_api_events;
struct lumi_api_field_views;
struct lumi_api_guard;
struct lumi_api_live;
struct lumi_api_pictures;
struct lumi_api_door;
struct lumi_api_shelf;
struct lumi_http {
    struct lumi_http_options options; /* its strings are copies */
    GMainContext *context;            /* of the server's thread */
    pthread_t thread;
    bool running;
    struct lumi_api_post *to_server, *to_engine;
    /* In the server's thread. */
    GMainLoop *loop;
    SoupServer *server;
    struct lumi_api_worker *worker;
    struct lumi_api_guard *guard;
    struct lumi_api_door *door;
    GPtrArray *refusals;
    struct lumi_api_live *live;
    struct lumi_api_pictures *pictures;
    struct lumi_api_shelf *shelf;
    struct lumi_api_field_views *field;
    /* In both: each has members of its own. */
    struct lumi_api_events *events;
    /* In the engine's. */
    struct lumi_engine_status *status; /* for one handler at a time */
    bool https;
    int port;
};

/* ---- answers (api_answer.c) ---- */

struct lumi_api_answer {
    unsigned status; /* 0: none yet */
    const char *type;
    char *text;
};
/* Takes over `text`. */
void lumi_api_answer(struct lumi_api_answer *answer, unsigned status, const char *type, char *text);
/* Ends the builder. */
void lumi_api_answer_json(struct lumi_api_answer *answer, unsigned status, JsonBuilder *builder);
/* A problem document (RFC 9457). `word` becomes its type, "urn:lumid:WORD". */
void lumi_api_problem(struct lumi_api_answer *answer, unsigned status, const char *word, const char *detail);
/* For a code of the tree. */
void lumi_api_problem_of(struct lumi_api_answer *answer, int code, const char *text);
/* Becomes the message's; takes over what is in it. In the server's thread, as all that has to do with messages. */
void lumi_api_send(SoupServerMessage *message, struct lumi_api_answer *answer);
void lumi_api_send_problem(SoupServerMessage *message, unsigned status, const char *word, const char *detail);
/* (transfer full) The whole answer, for a connection that the server has nothing to do with; closes it. */
char *lumi_api_problem_message(unsigned status, const char *word, const char *detail);

/* ---- what is asked for (api_calls.c, api_lists.c) ---- */

/* The least who may. */
enum lumi_api_role { LUMI_API_ANYBODY = 0, LUMI_API_WATCH, LUMI_API_OPERATE };
struct lumi_api_route {
    const char *path; /* may hold one {name}: lumi_api_path_match */
    const char *method;
    enum lumi_api_role role;
    const struct lumi_api_field *fields; /* of a POST's body, of a GET's query; NULL: none is read */
    /* In the engine's thread; its answer is sent if there is nothing else. NULL: the engine is not asked. */
    void (*call)(struct lumi_http *http, struct lumi_api_answer *answer, const struct lumi_api_body *body);
    /* In the server's thread, after it, unless that has answered. */
    void (*serve)(struct lumi_http *http, SoupServerMessage *message, const struct lumi_api_body *body);
};
extern const struct lumi_api_route lumi_api_routes[]; /* path NULL ends it */

void lumi_api_serve_devices(struct lumi_http *http, SoupServerMessage *message, const struct lumi_api_body *body);

/* ---- captures on the disk (api_captures.c, api_shelf.h) ---- */

int lumi_api_shelf_create(struct lumi_http *http, struct lumi_api_shelf **shelf, struct lumi_error *error);
void lumi_api_shelf_close(
    struct lumi_api_shelf *shelf); /* its threads end; then letters are dropped, then the rest goes */
void lumi_api_shelf_destroy(struct lumi_api_shelf *shelf);
void lumi_api_serve_captures(struct lumi_http *http, SoupServerMessage *message, const struct lumi_api_body *body);
void lumi_api_serve_thumbnail(struct lumi_http *http, SoupServerMessage *message, const struct lumi_api_body *body);
void lumi_api_serve_bundle(struct lumi_http *http, SoupServerMessage *message, const struct lumi_api_body *body);
extern const struct lumi_api_field lumi_api_verify_fields[], lumi_api_delete_fields[];
/* In the engine's thread: not what is under way. */
void lumi_api_see_verify(struct lumi_http *http, struct lumi_api_answer *answer, const struct lumi_api_body *body);
void lumi_api_see_delete(struct lumi_http *http, struct lumi_api_answer *answer, const struct lumi_api_body *body);
void lumi_api_serve_verify(struct lumi_http *http, SoupServerMessage *message, const struct lumi_api_body *body);
void lumi_api_serve_delete(struct lumi_http *http, SoupServerMessage *message, const struct lumi_api_body *body);
/* "verified": what was found of the capture as this seal says it is, or null. From any thread. */
void lumi_api_put_verified(JsonBuilder *builder, struct lumi_api_shelf *shelf, const char *name, const char *seal);

/* What an operator wanted was taken (202: what comes of it is told by events), or not. */
void lumi_api_answer_wish(struct lumi_http *http, struct lumi_api_answer *answer, int code,
                          const struct lumi_error *error);

/* ---- frames on the sphere, by hand (api_frames.c) ---- */

void lumi_api_get_frames(struct lumi_http *http, struct lumi_api_answer *answer, const struct lumi_api_body *body);
extern const struct lumi_api_field lumi_api_jog_fields[];
void lumi_api_post_jog(struct lumi_http *http, struct lumi_api_answer *answer, const struct lumi_api_body *body);

/* ---- profile and plans (api_plans.c) ---- */

void lumi_api_get_profile(struct lumi_http *http, struct lumi_api_answer *answer, const struct lumi_api_body *body);
void lumi_api_get_plans(struct lumi_http *http, struct lumi_api_answer *answer, const struct lumi_api_body *body);
extern const struct lumi_api_field lumi_api_check_fields[];
void lumi_api_post_check(struct lumi_http *http, struct lumi_api_answer *answer, const struct lumi_api_body *body);

/* ---- the page (api_page.c) ---- */

/* Headers that every answer has: what a browser may do with it. */
void lumi_api_harden(SoupServerMessage *message);
void lumi_api_serve_page(struct lumi_http *http, SoupServerMessage *message, const struct lumi_api_body *body);
/* Name of each file of the page: "index.html"; NULL ends them. */
const char *const *lumi_api_page_files(void);

/* ---- who asks (api_door.c, api_people.c, api_access.c, api_secure.c) ---- */

/* After the guard; it opens what the folder of access says. */
int lumi_api_door_create(struct lumi_http *http, struct lumi_api_door **door, struct lumi_error *error);
/* Its thread ends; then the letters are dropped, then the rest is destroyed. NULL is fine. */
void lumi_api_door_close(struct lumi_api_door *door);
void lumi_api_door_destroy(struct lumi_api_door *door);
/* False: whoever asks may not, and is answered already. */
bool lumi_api_admit(struct lumi_http *http, SoupServerMessage *message, const char *path, enum lumi_api_role role);
/* Bytes of a body that are taken of whoever sends this: before a login there is room for that alone. */
size_t lumi_api_body_most(struct lumi_http *http, SoupServerMessage *message);
/* The connection's, also where TLS stands between. NULL: it is closed. */
GSocket *lumi_api_socket(SoupServerMessage *message);
bool lumi_api_is_tls(const struct lumi_http *http, SoupServerMessage *message);
/* The answer goes on until it is finished; it ends with the session. By lumi_api_guard_spare. */
void lumi_api_people_stream(struct lumi_http *http, SoupServerMessage *message);
/* Another whenever somebody has come or gone; "people", as whoever sent the message sees them. */
uint64_t lumi_api_people_number(const struct lumi_http *http);
void lumi_api_people_put(struct lumi_http *http, SoupServerMessage *message, JsonBuilder *builder);

extern const struct lumi_api_field lumi_api_login_fields[], lumi_api_pair_fields[], lumi_api_revoke_fields[];
void lumi_api_serve_session(struct lumi_http *http, SoupServerMessage *message, const struct lumi_api_body *body);
void lumi_api_serve_people(struct lumi_http *http, SoupServerMessage *message, const struct lumi_api_body *body);
void lumi_api_serve_login(struct lumi_http *http, SoupServerMessage *message, const struct lumi_api_body *body);
void lumi_api_serve_logout(struct lumi_http *http, SoupServerMessage *message, const struct lumi_api_body *body);
void lumi_api_serve_pair(struct lumi_http *http, SoupServerMessage *message, const struct lumi_api_body *body);
void lumi_api_serve_revoke(struct lumi_http *http, SoupServerMessage *message, const struct lumi_api_body *body);

/* ---- events (api_events.c) ---- */

int lumi_api_events_create(struct lumi_http *http, struct lumi_api_events **events, struct lumi_error *error);
void lumi_api_events_destroy(struct lumi_api_events *events);
/* Server's thread: somebody listens. Before it the engine's brings the ring up to that moment. */
void lumi_api_serve_events(struct lumi_http *http, SoupServerMessage *message, const struct lumi_api_body *body);
void lumi_api_see_events(struct lumi_http *http, struct lumi_api_answer *answer, const struct lumi_api_body *body);
/* Engine's thread. */
void lumi_api_events_told(struct lumi_api_events *events, const struct lumi_engine_told *told);
void lumi_api_events_processing(struct lumi_api_events *events, const struct lumi_process_status *status);
void lumi_api_events_ingest(struct lumi_api_events *events, const struct lumi_ingest_status *status);
/* Server's thread: an event without an id, of which the newest of this kind and name is kept, also for who comes later.
 * Takes over `data`, one line of JSON; `kind` is static. */
void lumi_api_events_latest(struct lumi_api_events *events, const char *kind, const char *name, char *data);
/* Nobody tells a server that does not read that the other side has closed. */
bool lumi_api_has_hung_up(GSocket *socket);

/* ---- pictures (api_pictures.c, api_live.c) ---- */

struct lumi_api_pictures *lumi_api_pictures_create(struct lumi_http *http); /* before the server's thread begins */
void lumi_api_pictures_silence(struct lumi_api_pictures *pictures);         /* nothing comes from outside any more */
void lumi_api_pictures_destroy(struct lumi_api_pictures *pictures);
void lumi_api_get_cameras(struct lumi_http *http, struct lumi_api_answer *answer, const struct lumi_api_body *body);
void lumi_api_serve_last(struct lumi_http *http, SoupServerMessage *message, const struct lumi_api_body *body);
void lumi_api_serve_live(struct lumi_http *http, SoupServerMessage *message, const struct lumi_api_body *body);
/* Who watches. A camera has a new picture: it goes to those who have taken the last one. */
struct lumi_api_live *lumi_api_live_create(struct lumi_http *http);
void lumi_api_live_destroy(struct lumi_api_live *live);
void lumi_api_live_picture(struct lumi_api_live *live, int camera);
/* Adds the members of an object that is open. */
void lumi_api_picture(JsonBuilder *builder, struct lumi_pictures *pictures, const struct lumi_picture *picture);
/* (transfer full) The picture's file; the bytes hold the picture. */
GBytes *lumi_api_picture_bytes(struct lumi_picture *picture);

/* ---- the light field so far (api_field.c) ---- */

int lumi_api_field_create(struct lumi_http *http, struct lumi_api_field_views **views, struct lumi_error *error);
void lumi_api_field_destroy(struct lumi_api_field_views *views); /* the server's thread is no more */
extern const struct lumi_api_field lumi_api_view_fields[];
void lumi_api_serve_field(struct lumi_http *http, SoupServerMessage *message, const struct lumi_api_body *body);
void lumi_api_serve_view(struct lumi_http *http, SoupServerMessage *message, const struct lumi_api_body *body);

/* ---- connections (api_guard.c) ---- */

/* From now on; lumi_api_guard_listeners when the server listens. */
struct lumi_api_guard *lumi_api_guard_create(struct lumi_http *http);
void lumi_api_guard_listeners(struct lumi_api_guard *guard);
void lumi_api_guard_destroy(struct lumi_api_guard *guard);
/* A connection that was accepted elsewhere. False: it is one too many, and shut down. */
bool lumi_api_guard_take(struct lumi_api_guard *guard, GSocket *socket);
/* Somebody was let in on this message's connection: it gives way to no other. */
void lumi_api_guard_known(struct lumi_api_guard *guard, SoupServerMessage *message);
/* Bytes that stand for the peer of a message, an IPv6 one's network; returns how many. */
size_t lumi_api_guard_peer(SoupServerMessage *message, unsigned char peer[16], bool *here);
/* This answer may take as long as it likes: as long as the session lasts. */
void lumi_api_guard_spare(struct lumi_api_guard *guard, SoupServerMessage *message);

/* ---- a request that is too large (api_refuse.c) ---- */

/* Answers with a problem before the body has been read, and closes the connection; reads little of what is on its way
 * so that who sends it sees the answer. */
void lumi_api_refuse_early(struct lumi_http *http, SoupServerMessage *message, unsigned status, const char *word,
                           const char *detail);
/* Ends those that still read. */
void lumi_api_refuse_finish(struct lumi_http *http);

extern const char lumi_api_openapi[]; /* openapi.json, put into the program by the build */

#endif
