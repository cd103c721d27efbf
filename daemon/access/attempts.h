/* How often somebody may try to log in. Each address has a few tries, then waits twice as long each time; all strangers
 * together have so many in a minute. This computer counts for itself, and an address from which somebody was let in
 * does not wait for strangers: whatever they do, the operator gets in. */
#ifndef LUMI_DAEMON_ACCESS_ATTEMPTS_H
#define LUMI_DAEMON_ACCESS_ATTEMPTS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define LUMI_ATTEMPTS_KEY 16

struct lumi_attempts;
struct lumi_attempts *lumi_attempts_create(void);
void lumi_attempts_destroy(struct lumi_attempts *attempts);
/* One more from this address (`key`, an IPv6 one by its network); `here`: this computer. 0: go on, it counts as one
 * that failed until lumi_attempts_good. Otherwise it is not to be looked at, and this is how long to wait. */
int64_t lumi_attempts_ask(struct lumi_attempts *attempts, int64_t now_ns, const void *key, size_t size, bool here);
/* It was right, and is no failed one; those before it stay: who has a name of their own guesses another's no faster. */
void lumi_attempts_good(struct lumi_attempts *attempts, int64_t now_ns, const void *key, size_t size, bool here);

#endif
