/* Who is logged in. A session is a secret of 256 bits that only its holder has: here is its hash, in a table, and in a
 * file that the next lumid reads (docs/access.md). Reads no clock: `now_ns` is monotonic, `unix_s` for the file alone.
 */
#ifndef LUMI_DAEMON_ACCESS_SESSIONS_H
#define LUMI_DAEMON_ACCESS_SESSIONS_H

#include "daemon/access/secret.h"
#include "daemon/access/users.h"

#include <stdint.h>

#define LUMI_SESSIONS_MAX 128
#define LUMI_SESSIONS_FILE (1 << 17) /* bytes at most */
#define LUMI_SESSION_ID 13           /* with the zero */
#define LUMI_SESSION_ADDRESS 64

enum lumi_session_via { LUMI_VIA_PASSWORD = 0, LUMI_VIA_PAIR };

struct lumi_session {
    char id[LUMI_SESSION_ID]; /* no secret: how it is named to others */
    char name[LUMI_USER_NAME];
    enum lumi_role role;
    enum lumi_session_via via;
    /* Of whom it hangs: the user who logged in, or who made the code; "": who sits at the rig's own computer. It ends
     * when that one is gone or has another password. */
    char by[LUMI_USER_NAME];
    char address[LUMI_SESSION_ADDRESS];
    int64_t began_ns, used_ns;
    char hash[LUMI_SECRET_TEXT], mark[LUMI_SECRET_TEXT]; /* of the secret; of the password of `by` */
};

struct lumi_sessions;
struct lumi_sessions *lumi_sessions_create(int64_t idle_ns, int64_t most_ns);
void lumi_sessions_destroy(struct lumi_sessions *sessions);
/* Makes one as `like` says (name, role, via, by, address), of a user of `users`. Where there are too many the one that
 * was used longest ago ends. The secret goes to `secret`. */
const struct lumi_session *lumi_sessions_open(struct lumi_sessions *sessions, int64_t now_ns,
                                              const struct lumi_session *like, const struct lumi_users *users,
                                              char secret[LUMI_SECRET_TEXT]);
/* That of this secret; it counts as used. NULL: there is none, or it ran out. */
const struct lumi_session *lumi_sessions_find(struct lumi_sessions *sessions, int64_t now_ns, const char *secret);
const struct lumi_session *lumi_sessions_by_id(const struct lumi_sessions *sessions, const char *id);
void lumi_sessions_use(struct lumi_sessions *sessions, int64_t now_ns, const char *id);
/* When it runs out if nobody uses it. */
int64_t lumi_sessions_until(const struct lumi_sessions *sessions, const struct lumi_session *session);
bool lumi_sessions_end(struct lumi_sessions *sessions, const char *id);
/* Ends what ran out and what hangs on a user who is gone, or has another password; roles become the user's. */
void lumi_sessions_sweep(struct lumi_sessions *sessions, int64_t now_ns, const struct lumi_users *users);
int lumi_sessions_count(const struct lumi_sessions *sessions);
const struct lumi_session *lumi_sessions_at(const struct lumi_sessions *sessions, int index);
/* Another whenever one has begun or ended. */
uint64_t lumi_sessions_version(const struct lumi_sessions *sessions);

/* (transfer full: g_free) For the file. */
char *lumi_sessions_print(const struct lumi_sessions *sessions, int64_t now_ns, int64_t unix_s);
/* Takes what a file says; the time between counts. LUMI_ERR_FORMAT: nothing is taken. */
int lumi_sessions_parse(struct lumi_sessions *sessions, const char *text, size_t size, int64_t now_ns, int64_t unix_s,
                        struct lumi_error *error);

/* What every POST of the session shows besides the cookie: made of its secret, and no way back. */
void lumi_session_csrf(const char *secret, char text[LUMI_SECRET_TEXT]);
/* The value of the cookie NAME in a Cookie header, as a secret looks: 64 hexadecimal digits. Where it is there twice
 * the first that looks so counts. */
bool lumi_session_cookie(const char *header, const char *name, char secret[LUMI_SECRET_TEXT]);

#endif
