/* Codes by which a phone is let in: eight characters that can be typed, five minutes, once. 40 bits against the limits
 * of attempts.h: whoever guesses has a few hundred tries in that time. */
#ifndef LUMI_DAEMON_ACCESS_PAIRING_H
#define LUMI_DAEMON_ACCESS_PAIRING_H

#include "daemon/access/users.h"

#include <stdint.h>

#define LUMI_PAIRING_CODE 10 /* "ABCD-EFGH" and the zero */
#define LUMI_PAIRING_MAX 8
#define LUMI_PAIRING_NS (300 * INT64_C(1000000000))

struct lumi_pairing_offer {
    char code[LUMI_PAIRING_CODE];
    enum lumi_role role;
    char by[LUMI_USER_NAME]; /* "": made at the rig's own computer */
    int64_t until_ns;
};
struct lumi_pairing {
    int count;
    struct lumi_pairing_offer offer[LUMI_PAIRING_MAX];
};

/* Where there are too many the oldest is forgotten. */
const struct lumi_pairing_offer *lumi_pairing_make(struct lumi_pairing *pairing, int64_t now_ns, enum lumi_role role,
                                                   const char *by);
/* True: it was one; it is none any more. Blanks, hyphens and small letters do not matter. */
bool lumi_pairing_take(struct lumi_pairing *pairing, int64_t now_ns, const char *text,
                       struct lumi_pairing_offer *offer);
/* Those of somebody who is gone or may no longer let others in are forgotten. */
void lumi_pairing_sweep(struct lumi_pairing *pairing, int64_t now_ns, const struct lumi_users *users);

#endif
