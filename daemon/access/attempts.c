/* How often somebody may try. */
#include "daemon/access/attempts.h"

#include <glib.h>
#include <string.h>

#define SECOND INT64_C(1000000000)
#define ADDRESSES 512
#define FREE_TRIES 5
#define WAIT_MOST (900 * SECOND)
#define WAIT_MOST_HERE (10 * SECOND)
#define FORGET (3600 * SECOND)     /* after the last try */
#define KNOWN_FOR (86400 * SECOND) /* somebody was let in from there */
#define ALL_TRIES 30               /* of all strangers at once ... */
#define ALL_EVERY (2 * SECOND)     /* ... and one more each */

struct address {
    unsigned char key[LUMI_ATTEMPTS_KEY];
    size_t size;
    int failed;
    int64_t last_ns, until_ns;
    int64_t known_ns; /* until when it is known; 0: it is not */
};

struct lumi_attempts {
    int count;
    struct address address[ADDRESSES];
    /* Tries that are left, as a time: a try moves it on, and it must not be far ahead. */
    int64_t all_ns;
};

struct lumi_attempts *lumi_attempts_create(void)
{
    struct lumi_attempts *made = g_new0(struct lumi_attempts, 1);

    made->all_ns = INT64_MIN / 2;
    return made;
}

void lumi_attempts_destroy(struct lumi_attempts *attempts)
{
    g_free(attempts);
}

/* That of the key, a new one, or that in place of the one that matters least. */
static struct address *look_up(struct lumi_attempts *attempts, int64_t now_ns, const void *key, size_t size, bool here)
{
    struct address *least = NULL, *found = NULL;

    size = here ? 0 : MIN(size, sizeof found->key); /* both loopback addresses are one */
    for (int i = 0; i < attempts->count && !found; i++) {
        struct address *at = &attempts->address[i];
        if (at->size == size && !memcmp(at->key, key, size))
            found = at;
        if (at->size && (!least || MAX(at->last_ns, at->known_ns) < MAX(least->last_ns, least->known_ns)))
            least = at;
    }
    if (found && now_ns - found->last_ns < FORGET)
        return found;
    int64_t known = found ? found->known_ns : 0;
    if (!found)
        found = attempts->count < ADDRESSES ? &attempts->address[attempts->count++] : least;
    *found = (struct address){.size = size, .last_ns = now_ns, .known_ns = known};
    memcpy(found->key, key, size);
    return found;
}

static int64_t backoff(int failed, bool here)
{
    int64_t most = here ? WAIT_MOST_HERE : WAIT_MOST;

    if (failed < FREE_TRIES)
        return 0;
    return MIN(SECOND << MIN(failed - FREE_TRIES, 20), most);
}

int64_t lumi_attempts_ask(struct lumi_attempts *attempts, int64_t now_ns, const void *key, size_t size, bool here)
{
    struct address *address = look_up(attempts, now_ns, key, size, here);

    if (now_ns < address->until_ns)
        return address->until_ns - now_ns;
    if (!here && now_ns >= address->known_ns) {
        int64_t next = MAX(attempts->all_ns, now_ns - ALL_TRIES * ALL_EVERY) + ALL_EVERY;
        if (next > now_ns)
            return next - now_ns;
        attempts->all_ns = next;
    }
    address->failed++;
    address->last_ns = now_ns;
    address->until_ns = now_ns + backoff(address->failed, here);
    return 0;
}

void lumi_attempts_good(struct lumi_attempts *attempts, int64_t now_ns, const void *key, size_t size, bool here)
{
    struct address *address = look_up(attempts, now_ns, key, size, here);

    if (!here && now_ns >= address->known_ns)
        attempts->all_ns -= ALL_EVERY;
    if (address->failed > 0)
        address->failed--;
    address->until_ns = 0;
    address->known_ns = now_ns + KNOWN_FOR;
}
