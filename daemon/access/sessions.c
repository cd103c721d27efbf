/* Who is logged in. */
#include "daemon/access/sessions.h"

#include <glib.h>
#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#define SECOND INT64_C(1000000000)
#define HEAD "lumid-sessions 1 "

struct lumi_sessions {
    int64_t idle_ns, most_ns;
    uint64_t version;
    int count;
    struct lumi_session session[LUMI_SESSIONS_MAX];
};

struct lumi_sessions *lumi_sessions_create(int64_t idle_ns, int64_t most_ns)
{
    struct lumi_sessions *made = g_new0(struct lumi_sessions, 1);

    made->idle_ns = idle_ns;
    made->most_ns = most_ns;
    return made;
}

void lumi_sessions_destroy(struct lumi_sessions *sessions)
{
    g_free(sessions);
}

static void remove_at(struct lumi_sessions *sessions, int at)
{
    sessions->count--;
    memmove(&sessions->session[at], &sessions->session[at + 1],
            (size_t)(sessions->count - at) * sizeof *sessions->session);
    sessions->version++;
}

static void make_room(struct lumi_sessions *sessions)
{
    int oldest = 0;

    if (sessions->count < LUMI_SESSIONS_MAX)
        return;
    for (int i = 1; i < sessions->count; i++)
        if (sessions->session[i].used_ns < sessions->session[oldest].used_ns)
            oldest = i;
    remove_at(sessions, oldest);
}

/* Of a user's password, so that another one ends what began with the last. */
static void mark_of(const struct lumi_user *user, char mark[LUMI_SECRET_TEXT])
{
    mark[0] = '\0';
    if (user)
        lumi_secret_hash("mark", user->hash, mark);
}

static void name_it(struct lumi_session *session)
{
    char text[LUMI_SECRET_TEXT];

    lumi_secret_hash("id", session->hash, text);
    g_strlcpy(session->id, text, sizeof session->id);
}

const struct lumi_session *lumi_sessions_open(struct lumi_sessions *sessions, int64_t now_ns,
                                              const struct lumi_session *like, const struct lumi_users *users,
                                              char secret[LUMI_SECRET_TEXT])
{
    make_room(sessions);
    struct lumi_session *made = &sessions->session[sessions->count++];
    *made = *like;
    made->began_ns = made->used_ns = now_ns;
    mark_of(lumi_users_find(users, like->by), made->mark);
    lumi_secret_make(secret);
    lumi_secret_hash("session", secret, made->hash);
    name_it(made);
    sessions->version++;
    return made;
}

int64_t lumi_sessions_until(const struct lumi_sessions *sessions, const struct lumi_session *session)
{
    return MIN(session->began_ns + sessions->most_ns, session->used_ns + sessions->idle_ns);
}

/* The table is of hashes: what the time of looking into it tells is nothing of a secret. */
const struct lumi_session *lumi_sessions_find(struct lumi_sessions *sessions, int64_t now_ns, const char *secret)
{
    char hash[LUMI_SECRET_TEXT];

    lumi_secret_hash("session", secret, hash);
    for (int i = 0; i < sessions->count; i++) {
        struct lumi_session *session = &sessions->session[i];
        if (strcmp(session->hash, hash))
            continue;
        if (now_ns >= lumi_sessions_until(sessions, session))
            return NULL;
        session->used_ns = now_ns;
        return session;
    }
    return NULL;
}

const struct lumi_session *lumi_sessions_by_id(const struct lumi_sessions *sessions, const char *id)
{
    for (int i = 0; i < sessions->count; i++)
        if (!strcmp(sessions->session[i].id, id))
            return &sessions->session[i];
    return NULL;
}

void lumi_sessions_use(struct lumi_sessions *sessions, int64_t now_ns, const char *id)
{
    struct lumi_session *found = (struct lumi_session *)lumi_sessions_by_id(sessions, id);

    if (found && now_ns < lumi_sessions_until(sessions, found))
        found->used_ns = now_ns;
}

bool lumi_sessions_end(struct lumi_sessions *sessions, const char *id)
{
    const struct lumi_session *found = lumi_sessions_by_id(sessions, id);

    if (found)
        remove_at(sessions, (int)(found - sessions->session));
    return found != NULL;
}

/* False: whom it hangs on is gone, or is somebody else by now. */
static bool still_hangs(struct lumi_session *session, const struct lumi_users *users)
{
    const struct lumi_user *user = lumi_users_find(users, session->by);
    char mark[LUMI_SECRET_TEXT];

    if (!session->by[0])
        return users->count > 0;
    mark_of(user, mark);
    if (!user || strcmp(mark, session->mark))
        return false;
    if (session->via == LUMI_VIA_PASSWORD || user->role < session->role)
        session->role = user->role;
    return true;
}

void lumi_sessions_sweep(struct lumi_sessions *sessions, int64_t now_ns, const struct lumi_users *users)
{
    for (int i = sessions->count - 1; i >= 0; i--) {
        struct lumi_session *session = &sessions->session[i];
        if (now_ns >= lumi_sessions_until(sessions, session) || !still_hangs(session, users))
            remove_at(sessions, i);
    }
}

int lumi_sessions_count(const struct lumi_sessions *sessions)
{
    return sessions->count;
}

const struct lumi_session *lumi_sessions_at(const struct lumi_sessions *sessions, int index)
{
    return &sessions->session[index];
}

uint64_t lumi_sessions_version(const struct lumi_sessions *sessions)
{
    return sessions->version;
}

/* ---- the file ---- */

/* "lumid-sessions 1 UNIX_S", then a line for each: HASH MARK|- ROLE VIA AGE_S IDLE_S ADDRESS|- NAME :BY */
char *lumi_sessions_print(const struct lumi_sessions *sessions, int64_t now_ns, int64_t unix_s)
{
    GString *text = g_string_new(NULL);

    g_string_append_printf(text, HEAD "%" PRId64 "\n", unix_s);
    for (int i = 0; i < sessions->count; i++) {
        const struct lumi_session *session = &sessions->session[i];
        g_string_append_printf(text, "%s %s %s %s %" PRId64 " %" PRId64 " %s %s :%s\n", session->hash,
                               session->mark[0] ? session->mark : "-", lumi_role_name(session->role),
                               session->via == LUMI_VIA_PAIR ? "pair" : "password",
                               (now_ns - session->began_ns) / SECOND, (now_ns - session->used_ns) / SECOND,
                               session->address[0] ? session->address : "-", session->name, session->by);
    }
    return g_string_free(text, FALSE);
}

static bool is_hex(const char *text)
{
    return strlen(text) == LUMI_SECRET_TEXT - 1 && strspn(text, "0123456789abcdef") == LUMI_SECRET_TEXT - 1;
}

static bool take_number(const char *text, int64_t *number)
{
    guint64 value = 0;

    if (!g_ascii_string_to_unsigned(text, 10, 0, G_MAXINT64 / SECOND / 4, &value, NULL))
        return false;
    *number = (int64_t)value;
    return true;
}

static bool take_line(char **words, struct lumi_session *session, int64_t now_ns, int64_t away_s)
{
    int64_t age, idle;

    if (g_strv_length(words) != 9 || !is_hex(words[0]) || (strcmp(words[1], "-") && !is_hex(words[1])))
        return false;
    session->role = lumi_role_by_name(words[2]);
    session->via = !strcmp(words[3], "pair") ? LUMI_VIA_PAIR : LUMI_VIA_PASSWORD;
    if (!session->role || (strcmp(words[3], "pair") && strcmp(words[3], "password")) || !take_number(words[4], &age) ||
        !take_number(words[5], &idle) || strlen(words[6]) >= LUMI_SESSION_ADDRESS ||
        lumi_user_check_name(words[7], NULL) != LUMI_OK || words[8][0] != ':' ||
        (words[8][1] && lumi_user_check_name(words[8] + 1, NULL) != LUMI_OK))
        return false;
    g_strlcpy(session->hash, words[0], sizeof session->hash);
    g_strlcpy(session->mark, strcmp(words[1], "-") ? words[1] : "", sizeof session->mark);
    g_strlcpy(session->address, strcmp(words[6], "-") ? words[6] : "", sizeof session->address);
    g_strlcpy(session->name, words[7], sizeof session->name);
    g_strlcpy(session->by, words[8] + 1, sizeof session->by);
    session->began_ns = now_ns - (age + away_s) * SECOND;
    session->used_ns = now_ns - (idle + away_s) * SECOND;
    name_it(session);
    return true;
}

int lumi_sessions_parse(struct lumi_sessions *sessions, const char *text, size_t size, int64_t now_ns, int64_t unix_s,
                        struct lumi_error *error)
{
    g_autofree char *copy = g_strndup(text, size);
    g_auto(GStrv) lines = g_strsplit(copy, "\n", LUMI_SESSIONS_MAX + 3);
    g_autofree struct lumi_sessions *read = g_new0(struct lumi_sessions, 1);
    int64_t saved;

    if (!g_utf8_validate(text, (gssize)size, NULL) || !lines[0] || !g_str_has_prefix(lines[0], HEAD) ||
        !take_number(lines[0] + strlen(HEAD), &saved))
        return lumi_fail(error, LUMI_ERR_FORMAT, "no file of sessions");
    for (int i = 1; lines[i]; i++) {
        g_auto(GStrv) words = g_strsplit(lines[i], " ", 10);
        if (!lines[i][0])
            continue;
        /* A clock that went back has not made anything younger. */
        if (read->count == LUMI_SESSIONS_MAX ||
            !take_line(words, &read->session[read->count++], now_ns, CLAMP(unix_s - saved, 0, INT32_MAX)))
            return lumi_fail(error, LUMI_ERR_FORMAT, "line %d is no session", i + 1);
    }
    memcpy(sessions->session, read->session, sizeof read->session);
    sessions->count = read->count;
    sessions->version++;
    return LUMI_OK;
}

/* ---- what a browser shows ---- */

void lumi_session_csrf(const char *secret, char text[LUMI_SECRET_TEXT])
{
    lumi_secret_hash("csrf", secret, text);
}

bool lumi_session_cookie(const char *header, const char *name, char secret[LUMI_SECRET_TEXT])
{
    size_t size = strlen(name);

    while (header && *header) {
        header += strspn(header, " \t;");
        size_t length = strcspn(header, ";"), digits;
        while (length && (header[length - 1] == ' ' || header[length - 1] == '\t'))
            length--;
        digits = length > size && !strncmp(header, name, size) && header[size] == '='
                     ? strspn(header + size + 1, "0123456789abcdef")
                     : 0;
        if (digits == LUMI_SECRET_TEXT - 1 && length == size + 1 + digits) {
            g_strlcpy(secret, header + size + 1, LUMI_SECRET_TEXT);
            return true;
        }
        header += strcspn(header, ";");
    }
    return false;
}
