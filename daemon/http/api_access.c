/* Logging in and out, letting a phone in, who is there. A password is looked at in the door's worker: hashing it takes
 * a tenth of a second, in which this thread may have to stop the rig. */
#include "daemon/access/qr.h"
#include "daemon/http/api_door.h"

#include <stdio.h>
#include <string.h>

#define SECOND INT64_C(1000000000)

const struct lumi_api_field lumi_api_login_fields[] = {
    {.name = "name", .type = LUMI_API_STRING, .max = 64},
    {.name = "password", .type = LUMI_API_STRING, .max = LUMI_PASSWORD_MAX},
    {.name = "code", .type = LUMI_API_STRING, .max = 32},
    {0},
};
enum { LOGIN_NAME, LOGIN_PASSWORD, LOGIN_CODE };
const struct lumi_api_field lumi_api_pair_fields[] = {
    {.name = "role", .type = LUMI_API_STRING, .max = 16},
    {0},
};
const struct lumi_api_field lumi_api_revoke_fields[] = {
    {.name = "id", .type = LUMI_API_STRING, .required = true, .max = 64},
    {0},
};

/* ---- the session, as it is told ---- */

static void put_you(struct lumi_http *http, const struct lumi_api_visitor *who, JsonBuilder *builder)
{
    static const char *const ways[] = {"local", "password", "pair", "token"};
    const struct lumi_session *session = lumi_sessions_by_id(http->door->sessions, who->key);
    char csrf[LUMI_SECRET_TEXT];

    lumi_api_put_object(builder, "you");
    lumi_api_put_text(builder, "id", who->key);
    lumi_api_put_text(builder, "name", who->name);
    lumi_api_put_text(builder, "role", who->role == LUMI_API_OPERATE ? "operate" : "watch");
    lumi_api_put_text(builder, "via", ways[who->via]);
    json_builder_end_object(builder);
    if (session && who->secret[0]) {
        lumi_session_csrf(who->secret, csrf);
        lumi_api_put_text(builder, "csrf", csrf);
        lumi_api_put_time(builder, "expires",
                          lumi_api_unix_us_at(http, lumi_sessions_until(http->door->sessions, session)));
    } else {
        json_builder_add_null_value(json_builder_set_member_name(builder, "csrf"));
        json_builder_add_null_value(json_builder_set_member_name(builder, "expires"));
    }
    lumi_api_secure_put(http->door, builder);
}

static void answer_session(struct lumi_http *http, SoupServerMessage *message, const struct lumi_api_visitor *who)
{
    static const char *const nothing[] = {"you", "csrf", "expires", "secure"};
    g_autoptr(JsonBuilder) builder = json_builder_new();
    struct lumi_api_answer answer = {0};

    json_builder_begin_object(builder);
    lumi_api_put_bool(builder, "users", http->door->users.count > 0);
    if (who->role != LUMI_API_ANYBODY)
        put_you(http, who, builder);
    else
        for (int i = 0; i < 4; i++)
            json_builder_add_null_value(json_builder_set_member_name(builder, nothing[i]));
    json_builder_end_object(builder);
    lumi_api_answer_json(&answer, 200, builder);
    lumi_api_send(message, &answer);
}

void lumi_api_serve_session(struct lumi_http *http, SoupServerMessage *message, const struct lumi_api_body *body)
{
    (void)body;
    answer_session(http, message, lumi_api_visitor(message));
}

void lumi_api_serve_people(struct lumi_http *http, SoupServerMessage *message, const struct lumi_api_body *body)
{
    g_autoptr(JsonBuilder) builder = json_builder_new();
    struct lumi_api_answer answer = {0};

    (void)body;
    json_builder_begin_object(builder);
    lumi_api_people_put(http, message, builder);
    json_builder_end_object(builder);
    lumi_api_answer_json(&answer, 200, builder);
    lumi_api_send(message, &answer);
}

/* ---- in ---- */

/* 0: go on. */
static int64_t may_try(struct lumi_http *http, SoupServerMessage *message)
{
    unsigned char peer[16];
    bool here;
    size_t size = lumi_api_guard_peer(message, peer, &here);

    return lumi_attempts_ask(http->door->attempts, lumi_api_now(http), peer, size, here);
}

static void attempt_was_good(struct lumi_http *http, SoupServerMessage *message)
{
    unsigned char peer[16];
    bool here;
    size_t size = lumi_api_guard_peer(message, peer, &here);

    lumi_attempts_good(http->door->attempts, lumi_api_now(http), peer, size, here);
}

/* Somebody who wants in, while their password is looked at. */
struct login {
    struct lumi_api_job job;
    struct lumi_http *http;
    SoupServerMessage *message;
    bool gone; /* who asked has hung up */
    char name[LUMI_USER_NAME], password[LUMI_PASSWORD_MAX + 1], hash[LUMI_PASSWORD_HASH];
    bool good;
};

static void let_in(struct lumi_http *http, SoupServerMessage *message, struct lumi_session *like)
{
    const struct lumi_api_visitor *before = lumi_api_visitor(message);
    struct lumi_api_visitor who = *before;
    struct lumi_api_door *door = http->door;

    if (before->secret[0] && lumi_sessions_end(door->sessions, before->key))
        lumi_api_door_swept(door);
    g_strlcpy(like->address, before->address, sizeof like->address);
    const struct lumi_session *session =
        lumi_sessions_open(door->sessions, lumi_api_now(http), like, &door->users, who.secret);
    who.via = like->via == LUMI_VIA_PAIR ? LUMI_API_PAIR : LUMI_API_PASSWORD;
    who.role = like->role == LUMI_ROLE_OPERATE ? LUMI_API_OPERATE : LUMI_API_WATCH;
    g_strlcpy(who.name, like->name, sizeof who.name);
    g_strlcpy(who.key, session->id, sizeof who.key);
    attempt_was_good(http, message);
    lumi_api_people_seen(door, &who);
    lumi_api_guard_known(http->guard, message);
    lumi_api_set_cookie(message, who.secret, http->options.session_most_ns / SECOND, who.tls);
    answer_session(http, message, &who);
}

static void look_at_password(struct lumi_api_job *job)
{
    struct login *login = (struct login *)job;

    login->good = lumi_password_matches(login->password, login->hash[0] ? login->hash : NULL);
}

static void on_finished(SoupServerMessage *message, void *context)
{
    (void)message;
    ((struct login *)context)->gone = true;
}

static void end_login(struct login *login)
{
    g_signal_handlers_disconnect_by_data(login->message, login);
    g_object_unref(login->message);
    memset(login->password, 0, sizeof login->password);
    g_free(login);
}

static void looked_at(struct lumi_api_letter *letter, bool dropped)
{
    struct login *login = (struct login *)letter;
    struct lumi_http *http = login->http;

    if (!dropped && !login->gone) {
        const struct lumi_user *user = lumi_users_find(&http->door->users, login->name);
        struct lumi_session like = {.via = LUMI_VIA_PASSWORD};
        if (login->good && user && !strcmp(user->hash, login->hash)) {
            like.role = user->role;
            g_strlcpy(like.name, user->name, sizeof like.name);
            g_strlcpy(like.by, user->name, sizeof like.by);
            let_in(http, login->message, &like);
        } else
            lumi_api_send_problem(login->message, 401, "login", "the name or the password is wrong");
        soup_server_message_unpause(login->message);
    }
    end_login(login);
}

static void log_in(struct lumi_http *http, SoupServerMessage *message, const char *name, const char *password)
{
    const struct lumi_user *user = lumi_users_find(&http->door->users, name);
    struct login *login = g_new0(struct login, 1);

    *login = (struct login){.job = {.work = look_at_password, .letter.read = looked_at}, .http = http};
    login->message = g_object_ref(message);
    g_strlcpy(login->name, name, sizeof login->name);
    g_strlcpy(login->password, password, sizeof login->password);
    if (user)
        g_strlcpy(login->hash, user->hash, sizeof login->hash);
    g_signal_connect(message, "finished", G_CALLBACK(on_finished), login);
    if (lumi_api_worker_give(http->door->worker, &login->job)) {
        soup_server_message_pause(message);
        return;
    }
    end_login(login);
    lumi_api_send_problem(message, 503, "busy", "too many want to log in at once; try again");
}

static void pair_in(struct lumi_http *http, SoupServerMessage *message, const char *code, const char *name)
{
    struct lumi_session like = {.via = LUMI_VIA_PAIR};
    struct lumi_pairing_offer offer;

    if (!lumi_pairing_take(&http->door->pairing, lumi_api_now(http), code, &offer)) {
        lumi_api_send_problem(message, 401, "login", "this code is none, or was used, or ran out: make a new one");
        return;
    }
    like.role = offer.role;
    g_strlcpy(like.by, offer.by, sizeof like.by);
    if (name)
        g_strlcpy(like.name, name, sizeof like.name);
    else
        snprintf(like.name, sizeof like.name, "phone-%d", ++http->door->guests);
    let_in(http, message, &like);
}

void lumi_api_serve_login(struct lumi_http *http, SoupServerMessage *message, const struct lumi_api_body *body)
{
    const char *name = body->values[LOGIN_NAME].string, *password = body->values[LOGIN_PASSWORD].string;
    const char *code = body->values[LOGIN_CODE].string;
    struct lumi_error error;
    int64_t wait;

    if (!http->door->users.count)
        lumi_api_send_problem(message, 409, "busy", "there is no user yet: lumi user add NAME, at the rig's computer");
    else if (code ? password != NULL : !name || !password)
        lumi_api_send_problem(message, 422, "format", "'name' and 'password' wanted, or 'code'");
    else if (code && name && lumi_user_check_name(name, &error) != LUMI_OK)
        lumi_api_send_problem(message, 422, "format", error.text);
    else if ((wait = may_try(http, message)) > 0) {
        g_autofree char *seconds = g_strdup_printf("%" G_GINT64_FORMAT, (wait + SECOND - 1) / SECOND);
        g_autofree char *text = g_strdup_printf("too many tries: wait %s s", seconds);
        soup_message_headers_replace(soup_server_message_get_response_headers(message), "Retry-After", seconds);
        lumi_api_send_problem(message, 429, "limit", text);
    } else if (code)
        pair_in(http, message, code, name);
    else
        log_in(http, message, name, password);
}

/* ---- out ---- */

void lumi_api_serve_logout(struct lumi_http *http, SoupServerMessage *message, const struct lumi_api_body *body)
{
    const struct lumi_api_visitor *who = lumi_api_visitor(message);
    const struct lumi_api_visitor nobody = {.here = who->here, .tls = who->tls};

    (void)body;
    if (!who->secret[0]) { /* whoever has no session stays who they are */
        answer_session(http, message, who);
        return;
    }
    lumi_sessions_end(http->door->sessions, who->key);
    lumi_api_door_swept(http->door);
    lumi_api_set_cookie(message, "", 0, who->tls);
    answer_session(http, message, &nobody);
}

void lumi_api_serve_revoke(struct lumi_http *http, SoupServerMessage *message, const struct lumi_api_body *body)
{
    if (!lumi_sessions_end(http->door->sessions, body->values[0].string)) {
        lumi_api_send_problem(message, 404, "notfound", "there is no such session any more");
        return;
    }
    lumi_api_door_swept(http->door);
    lumi_api_serve_people(http, message, body);
}

/* ---- a phone ---- */

static void answer_pair(struct lumi_http *http, SoupServerMessage *message, const struct lumi_pairing_offer *offer,
                        const char *url)
{
    g_autoptr(JsonBuilder) builder = json_builder_new();
    struct lumi_api_answer answer = {0};
    struct lumi_error error;
    g_autofree char *svg = NULL;

    if (lumi_qr_svg(url, &svg, &error) != LUMI_OK) {
        lumi_api_send_problem(message, 500, "internal", error.text);
        return;
    }
    json_builder_begin_object(builder);
    lumi_api_put_text(builder, "code", offer->code);
    lumi_api_put_text(builder, "role", lumi_role_name(offer->role));
    lumi_api_put_text(builder, "url", url);
    lumi_api_put_text(builder, "qr", svg);
    lumi_api_put_time(builder, "expires", lumi_api_unix_us_at(http, offer->until_ns));
    lumi_api_put_text(builder, "fingerprint", lumi_api_secure_fingerprint(http->door));
    json_builder_end_object(builder);
    lumi_api_answer_json(&answer, 200, builder);
    lumi_api_send(message, &answer);
}

/* The code stands behind the '#': no browser sends that, and no log has it. */
void lumi_api_serve_pair(struct lumi_http *http, SoupServerMessage *message, const struct lumi_api_body *body)
{
    const struct lumi_api_visitor *who = lumi_api_visitor(message);
    const char *word = body->values[0].string ? body->values[0].string : "operate";
    enum lumi_role role = lumi_role_by_name(word);
    g_autofree char *base = lumi_api_secure_url(http->door);
    const struct lumi_session *session = lumi_sessions_by_id(http->door->sessions, who->key);

    if (role == LUMI_ROLE_NONE) {
        lumi_api_send_problem(message, 422, "format", "'role': watch or operate wanted");
        return;
    }
    if (!http->door->users.count || !base) {
        lumi_api_send_problem(message, 409, "busy",
                              http->door->users.count
                                  ? "no phone can reach this computer: it has no network, or [http] secure is closed"
                                  : "there is no user yet: lumi user add NAME, at the rig's computer");
        return;
    }
    const struct lumi_pairing_offer *offer =
        lumi_pairing_make(&http->door->pairing, lumi_api_now(http), role, session ? session->by : "");
    g_autofree char *url = g_strdup_printf("%s#code=%s", base, offer->code);
    answer_pair(http, message, offer, url);
}
