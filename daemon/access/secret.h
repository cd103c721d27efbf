/* Secrets: random ones, their hashes, comparing them, and the files they lie in. */
#ifndef LUMI_DAEMON_ACCESS_SECRET_H
#define LUMI_DAEMON_ACCESS_SECRET_H

#include "proto/base/result.h"

#include <stdbool.h>
#include <stddef.h>

#define LUMI_SECRET_TEXT 65 /* 256 bits in hexadecimal, and the zero */

/* From the kernel's generator; there is no other. */
void lumi_secret_random(void *bytes, size_t size);
void lumi_secret_make(char text[LUMI_SECRET_TEXT]);
/* SHA-256 of `purpose`, a zero byte and the secret: what is kept in place of it, and what may be told for one use. */
void lumi_secret_hash(const char *purpose, const char *secret, char text[LUMI_SECRET_TEXT]);
/* Whether two are the same; the time it takes does not tell how much of them is. */
bool lumi_secret_equal(const char *a, const char *b);
/* Makes or replaces a file, whole or not at all, that has these rights from its first byte on. Who is root leaves it to
 * the owner of the file that was there, or of its folder. */
int lumi_secret_write(const char *path, const char *text, unsigned mode, struct lumi_error *error);
/* Of at most `limit` bytes. LUMI_ERR_UNSUPPORTED: everybody on this computer can read or write it. *text is released
 * with lumi_free. */
int lumi_secret_read(const char *path, size_t limit, char **text, size_t *size, struct lumi_error *error);
/* Makes the folder that they lie in, where the one it is in is there (0750; root: its owner's). */
int lumi_secret_folder(const char *path, struct lumi_error *error);

#endif
