/* What the door reads of others: the file of users, the file of sessions, a Cookie header, a code as it is typed. The
 * first byte picks which. */
#include "checks.h"

#include "daemon/access/pairing.h"
#include "daemon/access/sessions.h"

#include <glib.h>
#include <string.h>

static void read_users(const char *text, size_t size)
{
    static struct lumi_users users, again;
    struct lumi_error error = {0};

    if (checked(lumi_users_parse(text, size, "users", &users, &error), &error) != LUMI_OK)
        return;
    for (int i = 0; i < users.count; i++) {
        const struct lumi_user *user = &users.user[i];
        if (lumi_user_check_name(user->name, &error) != LUMI_OK || user->role == LUMI_ROLE_NONE ||
            !lumi_password_is_hash(user->hash) || lumi_users_find(&users, user->name) != user)
            abort();
    }
    /* What is kept of it is the same again. */
    GString *out = g_string_new(NULL);
    for (int i = 0; i < users.count; i++)
        g_string_append_printf(out, "%s:%s:%s\n", users.user[i].name, lumi_role_name(users.user[i].role),
                               users.user[i].hash);
    if (lumi_users_parse(out->str, out->len, "users", &again, &error) != LUMI_OK || again.count != users.count)
        abort();
    g_string_free(out, TRUE);
}

static void read_sessions(const char *text, size_t size)
{
    struct lumi_sessions *sessions = lumi_sessions_create(INT64_C(1) << 40, INT64_C(1) << 50);
    struct lumi_error error = {0};

    if (checked(lumi_sessions_parse(sessions, text, size, 0, 1000000, &error), &error) == LUMI_OK) {
        g_autofree char *out = lumi_sessions_print(sessions, 0, 1000000);
        int count = lumi_sessions_count(sessions);
        if (count > LUMI_SESSIONS_MAX ||
            lumi_sessions_parse(sessions, out, strlen(out), 0, 1000000, &error) != LUMI_OK ||
            lumi_sessions_count(sessions) != count)
            abort();
        for (int i = 0; i < count; i++)
            if (lumi_sessions_at(sessions, i)->began_ns > 0 || !lumi_sessions_at(sessions, i)->role)
                abort();
    } else if (lumi_sessions_count(sessions))
        abort();
    lumi_sessions_destroy(sessions);
}

static void read_cookie(const char *text)
{
    char secret[LUMI_SECRET_TEXT];

    if (lumi_session_cookie(text, "lumid", secret) && (strlen(secret) != LUMI_SECRET_TEXT - 1 || !strstr(text, secret)))
        abort();
}

static void read_code(const char *text)
{
    struct lumi_pairing pairing = {.count = 1, .offer = {{.code = "ABCD-EFGH", .until_ns = 1}}};
    struct lumi_pairing_offer offer;
    int letters = 0;

    if (!lumi_pairing_take(&pairing, 0, text, &offer))
        return;
    for (const char *at = text; *at; at++)
        letters += g_ascii_isalpha(*at);
    if (letters != 8 || pairing.count)
        abort();
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (!size || size > LUMI_SESSIONS_FILE)
        return 0;
    char *text = g_strndup((const char *)data + 1, size - 1);
    if (data[0] % 4 == 0)
        read_users((const char *)data + 1, size - 1);
    else if (data[0] % 4 == 1)
        read_sessions((const char *)data + 1, size - 1);
    else if (data[0] % 4 == 2)
        read_cookie(text);
    else
        read_code(text);
    g_free(text);
    return 0;
}
