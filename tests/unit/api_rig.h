/* A rig with users, over the fixture of the API: a folder of its own, an operator and one who watches, logins. */
#ifndef LUMI_TESTS_UNIT_API_RIG_H
#define LUMI_TESTS_UNIT_API_RIG_H

#include "daemon/access/users.h"
#include "daemon/http/api_priv.h"
#include "tests/unit/api_fixture.h"

#define SECOND INT64_C(1000000000)
#define PASSWORD "a good password"

static char operator_hash[LUMI_PASSWORD_HASH], watcher_hash[LUMI_PASSWORD_HASH];

struct rig {
    struct fixture fixture; /* first: it is what the fixture's functions are given */
    char folder[64];
};

/* ---- the rig, its users ---- */

static inline void write_users(const struct rig *rig, bool anna, bool willi)
{
    struct lumi_users users = {0};
    struct lumi_user first = {.name = "anna", .role = LUMI_ROLE_OPERATE}, second = {.name = "willi"};
    g_autofree char *path = g_build_filename(rig->folder, "users", NULL);
    struct lumi_error error;

    second.role = LUMI_ROLE_WATCH;
    strcpy(first.hash, operator_hash);
    strcpy(second.hash, watcher_hash);
    if ((anna && lumi_users_add(&users, &first, &error) != LUMI_OK) ||
        (willi && lumi_users_add(&users, &second, &error) != LUMI_OK) ||
        lumi_users_save(path, &users, &error) != LUMI_OK)
        fail_msg("%s", error.text);
}

static inline int set_up_with(void **state, bool users)
{
    struct rig *rig = calloc(1, sizeof *rig);

    fixture_time = 1000 * SECOND;
    fixture_options(&rig->fixture);
    strcpy(rig->folder, "/tmp/lumi-access-XXXXXX");
    assert_non_null(mkdtemp(rig->folder));
    rig->fixture.options.access = rig->folder;
    rig->fixture.options.secure = "127.0.0.1:0";
    rig->fixture.options.host_name = "rig";
    rig->fixture.options.token = "the-token-of-the-rig";
    if (users)
        write_users(rig, true, true);
    fixture_start(&rig->fixture);
    *state = rig;
    return 0;
}

static inline int set_up(void **state)
{
    return set_up_with(state, true);
}

static inline int set_up_empty(void **state)
{
    return set_up_with(state, false);
}

static inline int tear_down(void **state)
{
    static const char *const files[] = {"users", "sessions", "rig.pem", "rig.crt", "local.token"};
    struct rig *rig = *state;
    char folder[64];

    strcpy(folder, rig->folder);
    fixture_tear_down(state);
    for (size_t i = 0; i < sizeof files / sizeof files[0]; i++) {
        g_autofree char *path = g_build_filename(folder, files[i], NULL);
        unlink(path);
    }
    return rmdir(folder);
}

static inline int set_up_hashes(void **state)
{
    struct lumi_error error;

    (void)state;
    return lumi_password_hash(PASSWORD, operator_hash, &error) || lumi_password_hash(PASSWORD, watcher_hash, &error);
}

/* ---- asking ---- */

static inline void expect(struct answer answer, int status, const char *part)
{
    if (answer.status != status || (part && !strstr(answer.body, part)))
        fail_msg("%d wanted with %s, came %d: %s", status, part ? part : "anything", answer.status, answer.body);
    answer_clear(&answer);
}

/* Header lines of somebody who is logged in: the cookie alone, and with what a POST shows. */
struct login {
    char cookie[256], both[512];
};

static inline char *between(const char *text, const char *before, const char *after)
{
    const char *at = strstr(text, before), *end;

    if (!at || !(end = strstr(at + strlen(before), after)))
        fail_msg("no %s: %s", before, text);
    return g_strndup(at + strlen(before), (gsize)(end - at) - strlen(before));
}

static inline void take_login(struct answer answer, struct login *login)
{
    if (answer.status != 200)
        fail_msg("%d: %s", answer.status, answer.body);
    g_autofree char *secret = between(answer.head, "Set-Cookie: lumid=", ";");
    g_autofree char *csrf = between(answer.body, "\"csrf\":\"", "\"");
    assert_int_equal(strlen(secret), 64);
    snprintf(login->cookie, sizeof login->cookie, "Cookie: other=1; lumid=%s\r\n", secret);
    snprintf(login->both, sizeof login->both, "%sX-Lumid-Csrf: %s\r\n", login->cookie, csrf);
    answer_clear(&answer);
}

static inline struct answer try_login(void *state, const char *name, const char *password)
{
    g_autofree char *body = g_strdup_printf("{\"name\":\"%s\",\"password\":\"%s\"}", name, password);

    return fixture_ask(state, "POST", "/api/v1/session/login", JSON_TYPE, body);
}

static inline struct login log_in(void *state, const char *name)
{
    struct login login;

    take_login(try_login(state, name, PASSWORD), &login);
    return login;
}

#endif
