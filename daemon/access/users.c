/* The file of users. */
#include "daemon/access/users.h"

#include "daemon/access/secret.h"
#include "proto/base/memory.h"

#include <glib.h>
#include <string.h>

#define NAME_CHARACTERS 32

const char *lumi_role_name(enum lumi_role role)
{
    return role == LUMI_ROLE_OPERATE ? "operate" : role == LUMI_ROLE_WATCH ? "watch" : "";
}

enum lumi_role lumi_role_by_name(const char *name)
{
    return !strcmp(name, "operate") ? LUMI_ROLE_OPERATE : !strcmp(name, "watch") ? LUMI_ROLE_WATCH : LUMI_ROLE_NONE;
}

int lumi_user_check_name(const char *name, struct lumi_error *error)
{
    if (!*name || strlen(name) >= LUMI_USER_NAME || !g_utf8_validate(name, -1, NULL) ||
        g_utf8_strlen(name, -1) > NAME_CHARACTERS)
        return lumi_fail(error, LUMI_ERR_ARG, "a name of 1 to %d characters (64 bytes) wanted", NAME_CHARACTERS);
    for (const char *at = name; *at; at = g_utf8_next_char(at)) {
        gunichar c = g_utf8_get_char(at);
        if (c == ':' || g_unichar_isspace(c) || !g_unichar_isgraph(c) || g_unichar_type(c) == G_UNICODE_FORMAT)
            return lumi_fail(error, LUMI_ERR_ARG, "a name has no blank, no colon and only what can be printed");
    }
    if (name[0] == '#')
        return lumi_fail(error, LUMI_ERR_ARG, "a name does not begin with '#'");
    return LUMI_OK;
}

static int parse_line(char *line, int number, const char *source, struct lumi_users *users, struct lumi_error *error)
{
    struct lumi_user user = {0};
    struct lumi_error why;
    char *role = strchr(line, ':'), *hash = role ? strchr(role + 1, ':') : NULL;

    if (!hash)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s:%d: NAME:ROLE:HASH wanted", source, number);
    *role++ = *hash++ = '\0';
    if (lumi_user_check_name(line, &why) != LUMI_OK)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s:%d: %s", source, number, why.text);
    user.role = lumi_role_by_name(role);
    if (user.role == LUMI_ROLE_NONE)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s:%d: the role is watch or operate", source, number);
    if (!lumi_password_is_hash(hash))
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s:%d: no hash of a password (lumi user password %s)", source, number,
                         line);
    g_strlcpy(user.name, line, sizeof user.name);
    g_strlcpy(user.hash, hash, sizeof user.hash);
    if (lumi_users_add(users, &user, &why) != LUMI_OK)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s:%d: %s", source, number, why.text);
    return LUMI_OK;
}

int lumi_users_parse(const char *text, size_t size, const char *source, struct lumi_users *users,
                     struct lumi_error *error)
{
    char line[1024];

    memset(users, 0, sizeof *users);
    for (int number = 1; size; number++) {
        const char *end = memchr(text, '\n', size);
        size_t length = end ? (size_t)(end - text) : size;
        if (length >= sizeof line || memchr(text, 0, length))
            return lumi_fail(error, LUMI_ERR_FORMAT, "%s:%d: no line of a users file", source, number);
        memcpy(line, text, length);
        line[length] = '\0';
        if (length && line[length - 1] == '\r')
            line[length - 1] = '\0';
        if (line[0] && line[0] != '#')
            LUMI_TRY(parse_line(line, number, source, users, error));
        length += end ? 1 : 0;
        text += length;
        size -= length;
    }
    return LUMI_OK;
}

int lumi_users_load(const char *path, struct lumi_users *users, struct lumi_error *error)
{
    struct lumi_error why = {0};
    char *text = NULL;
    size_t size = 0;
    int code = lumi_secret_read(path, LUMI_USERS_FILE, &text, &size, &why);

    memset(users, 0, sizeof *users);
    if (code == LUMI_ERR_NOTFOUND)
        return LUMI_OK;
    if (code != LUMI_OK)
        return lumi_fail(error, code, "%s", why.text);
    code = lumi_users_parse(text, size, path, users, error);
    lumi_free(text);
    return code;
}

int lumi_users_save(const char *path, const struct lumi_users *users, struct lumi_error *error)
{
    g_autoptr(GString) text = g_string_new("# NAME:ROLE:HASH; written by `lumi user`\n");

    for (int i = 0; i < users->count; i++)
        g_string_append_printf(text, "%s:%s:%s\n", users->user[i].name, lumi_role_name(users->user[i].role),
                               users->user[i].hash);
    return lumi_secret_write(path, text->str, 0600, error);
}

const struct lumi_user *lumi_users_find(const struct lumi_users *users, const char *name)
{
    for (int i = 0; i < users->count; i++)
        if (!strcmp(users->user[i].name, name))
            return &users->user[i];
    return NULL;
}

int lumi_users_add(struct lumi_users *users, const struct lumi_user *user, struct lumi_error *error)
{
    if (lumi_users_find(users, user->name))
        return lumi_fail(error, LUMI_ERR_EXISTS, "%s: there is a user of that name", user->name);
    if (users->count == LUMI_USERS_MAX)
        return lumi_fail(error, LUMI_ERR_LIMIT, "more than %d users", LUMI_USERS_MAX);
    users->user[users->count++] = *user;
    return LUMI_OK;
}

int lumi_users_remove(struct lumi_users *users, const char *name, struct lumi_error *error)
{
    struct lumi_user *found = (struct lumi_user *)lumi_users_find(users, name);

    if (!found)
        return lumi_fail(error, LUMI_ERR_NOTFOUND, "%s: there is no such user", name);
    int at = (int)(found - users->user);
    memmove(found, found + 1, (size_t)(users->count - at - 1) * sizeof *found);
    users->count--;
    return LUMI_OK;
}
