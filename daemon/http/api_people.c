/* Who is there. Whoever moves a rig sees who else is looking at it. */
#include "daemon/http/api_door.h"

#include <string.h>
#include <sys/socket.h>

#define GONE_NS (60 * INT64_C(1000000000)) /* after the last they asked for, without a stream */
#define PARTIES 256

/* An answer that goes on: events, live pictures. */
struct stream {
    struct lumi_api_door *door;
    SoupServerMessage *message;
    char key[sizeof((struct lumi_api_visitor *)0)->key];
};

static struct lumi_api_party *find(const struct lumi_api_door *door, const char *key)
{
    for (guint i = 0; i < door->parties->len; i++) {
        struct lumi_api_party *party = door->parties->pdata[i];
        if (!strcmp(party->who.key, key))
            return party;
    }
    return NULL;
}

void lumi_api_people_seen(struct lumi_api_door *door, const struct lumi_api_visitor *who)
{
    struct lumi_api_party *party = find(door, who->key);

    if (who->role == LUMI_API_ANYBODY)
        return;
    if (!party) {
        if (door->parties->len >= PARTIES)
            return;
        party = g_new0(struct lumi_api_party, 1);
        party->since_ns = lumi_api_now(door->http);
        g_ptr_array_add(door->parties, party);
        door->people++;
    } else if (party->who.role != who->role)
        door->people++;
    party->who = *who;
    memset(party->who.secret, 0, sizeof party->who.secret);
    party->seen_ns = lumi_api_now(door->http);
}

static bool is_over(const struct lumi_api_door *door, const struct lumi_api_party *party)
{
    bool session = party->who.via == LUMI_API_PASSWORD || party->who.via == LUMI_API_PAIR;

    if (session && !lumi_sessions_by_id(door->sessions, party->who.key))
        return true;
    if (party->who.via == LUMI_API_LOCAL && !party->who.token && door->users.count)
        return true;
    return !party->streams && lumi_api_now(door->http) - party->seen_ns > GONE_NS;
}

void lumi_api_people_tick(struct lumi_api_door *door)
{
    for (guint i = 0; i < door->streams->len; i++) {
        const struct stream *stream = door->streams->pdata[i];
        lumi_sessions_use(door->sessions, lumi_api_now(door->http), stream->key);
    }
    for (guint i = door->parties->len; i > 0; i--)
        if (is_over(door, door->parties->pdata[i - 1])) {
            g_ptr_array_remove_index(door->parties, i - 1);
            door->people++;
        }
    door->told = door->people;
}

/* ---- streams ---- */

static void on_finished(SoupServerMessage *message, void *context)
{
    struct stream *stream = context;
    struct lumi_api_party *party = find(stream->door, stream->key);

    g_signal_handlers_disconnect_by_data(message, stream);
    if (party && party->streams > 0) { /* it may be another of this name by now */
        party->streams--;
        party->seen_ns = lumi_api_now(stream->door->http);
        stream->door->people++;
    }
    g_ptr_array_remove_fast(stream->door->streams, stream);
    g_free(stream);
}

void lumi_api_people_stream(struct lumi_http *http, SoupServerMessage *message)
{
    const struct lumi_api_visitor *who = lumi_api_visitor(message);
    struct lumi_api_party *party = find(http->door, who->key);

    if (!party)
        return;
    struct stream *made = g_new0(struct stream, 1);
    made->door = http->door;
    made->message = message;
    g_strlcpy(made->key, who->key, sizeof made->key);
    g_ptr_array_add(http->door->streams, made);
    g_signal_connect(message, "finished", G_CALLBACK(on_finished), made);
    party->streams++;
    http->door->people++;
}

/* Whom nobody knows any more gets nothing more: the next write fails, and the message is finished. */
void lumi_api_door_swept(struct lumi_api_door *door)
{
    for (guint i = 0; i < door->streams->len; i++) {
        struct stream *stream = door->streams->pdata[i];
        const struct lumi_api_visitor *who = lumi_api_visitor(stream->message);
        GSocket *socket = lumi_api_socket(stream->message);
        bool known = who->via == LUMI_API_TOKEN || (who->via == LUMI_API_LOCAL && (!door->users.count || who->token));
        if (who->via == LUMI_API_PASSWORD || who->via == LUMI_API_PAIR)
            known = lumi_sessions_by_id(door->sessions, who->key) != NULL;
        if (!known && socket)
            g_socket_shutdown(socket, TRUE, TRUE, NULL);
    }
    lumi_api_people_tick(door);
}

/* ---- as it is told ---- */

static const char *role_name(enum lumi_api_role role)
{
    return role == LUMI_API_OPERATE ? "operate" : "watch";
}

void lumi_api_people_put(struct lumi_http *http, SoupServerMessage *message, JsonBuilder *builder)
{
    const char *key = lumi_api_visitor(message)->key;
    const struct lumi_api_door *door = http->door;

    lumi_api_put_array(builder, "people");
    for (guint i = 0; i < door->parties->len; i++) {
        const struct lumi_api_party *party = door->parties->pdata[i];
        json_builder_begin_object(builder);
        lumi_api_put_text(builder, "id", party->who.key);
        lumi_api_put_text(builder, "name", party->who.name);
        lumi_api_put_text(builder, "role", role_name(party->who.role));
        lumi_api_put_text(builder, "address", party->who.address);
        lumi_api_put_time(builder, "since", lumi_api_unix_us_at(http, party->since_ns));
        lumi_api_put_int(builder, "streams", party->streams);
        lumi_api_put_bool(builder, "you", !strcmp(party->who.key, key));
        json_builder_end_object(builder);
    }
    json_builder_end_array(builder);
}

uint64_t lumi_api_people_number(const struct lumi_http *http)
{
    return http->door->told;
}

void lumi_api_people_finish(struct lumi_api_door *door)
{
    for (guint i = 0; i < door->streams->len; i++) {
        struct stream *stream = door->streams->pdata[i];
        g_signal_handlers_disconnect_by_data(stream->message, stream);
        g_free(stream);
    }
    g_ptr_array_set_size(door->streams, 0);
}
