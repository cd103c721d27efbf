/* Who may use the rig: a file with a line for each, NAME:ROLE:HASH (docs/access.md). */
#ifndef LUMI_DAEMON_ACCESS_USERS_H
#define LUMI_DAEMON_ACCESS_USERS_H

#include "daemon/access/password.h"

#include <stddef.h>

#define LUMI_USERS_MAX 64
#define LUMI_USER_NAME 65         /* bytes, with the zero */
#define LUMI_USERS_FILE (1 << 16) /* bytes at most */

enum lumi_role { LUMI_ROLE_NONE = 0, LUMI_ROLE_WATCH, LUMI_ROLE_OPERATE };
const char *lumi_role_name(enum lumi_role role); /* "watch", "operate" */
/* LUMI_ROLE_NONE: there is no such role. */
enum lumi_role lumi_role_by_name(const char *name);

struct lumi_user {
    char name[LUMI_USER_NAME];
    enum lumi_role role;
    char hash[LUMI_PASSWORD_HASH];
};
struct lumi_users {
    int count;
    struct lumi_user user[LUMI_USERS_MAX];
};

/* 1 to 32 characters, none of them blank, a colon or not printable; no '#' to begin with. */
int lumi_user_check_name(const char *name, struct lumi_error *error);
/* LUMI_ERR_FORMAT names the line. `source`: the file's name, for messages. */
int lumi_users_parse(const char *text, size_t size, const char *source, struct lumi_users *users,
                     struct lumi_error *error);
/* A file that is not there has no users. */
int lumi_users_load(const char *path, struct lumi_users *users, struct lumi_error *error);
int lumi_users_save(const char *path, const struct lumi_users *users, struct lumi_error *error);
/* NULL: there is none of that name. */
const struct lumi_user *lumi_users_find(const struct lumi_users *users, const char *name);
/* LUMI_ERR_EXISTS, LUMI_ERR_LIMIT; LUMI_ERR_NOTFOUND. */
int lumi_users_add(struct lumi_users *users, const struct lumi_user *user, struct lumi_error *error);
int lumi_users_remove(struct lumi_users *users, const char *name, struct lumi_error *error);

#endif
