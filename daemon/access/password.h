/* Passwords: yescrypt by libcrypt. Both take a tenth of a second and some megabytes, on purpose: not for a thread that
 * others wait for. */
#ifndef LUMI_DAEMON_ACCESS_PASSWORD_H
#define LUMI_DAEMON_ACCESS_PASSWORD_H

#include "proto/base/result.h"

#include <stdbool.h>

#define LUMI_PASSWORD_LEAST 8 /* characters */
#define LUMI_PASSWORD_MAX 256 /* bytes */
#define LUMI_PASSWORD_HASH 384

/* LUMI_ERR_ARG: too short, too long, no UTF-8, control characters. */
int lumi_password_check(const char *password, struct lumi_error *error);
int lumi_password_hash(const char *password, char hash[LUMI_PASSWORD_HASH], struct lumi_error *error);
/* `hash` NULL: there is no such user, which takes as long. */
bool lumi_password_matches(const char *password, const char *hash);
/* Whether libcrypt takes this for a hash that still protects something. */
bool lumi_password_is_hash(const char *hash);

#endif
