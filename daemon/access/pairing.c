/* Codes by which a phone is let in. */
#include "daemon/access/pairing.h"

#include "daemon/access/secret.h"

#include <glib.h>
#include <string.h>

static const char letters[] = "23456789ABCDEFGHJKLMNPQRSTUVWXYZ"; /* none that is taken for another */

static void forget(struct lumi_pairing *pairing, int at)
{
    pairing->count--;
    memmove(&pairing->offer[at], &pairing->offer[at + 1], (size_t)(pairing->count - at) * sizeof *pairing->offer);
}

const struct lumi_pairing_offer *lumi_pairing_make(struct lumi_pairing *pairing, int64_t now_ns, enum lumi_role role,
                                                   const char *by)
{
    unsigned char bytes[8];

    if (pairing->count == LUMI_PAIRING_MAX)
        forget(pairing, 0);
    struct lumi_pairing_offer *made = &pairing->offer[pairing->count++];
    *made = (struct lumi_pairing_offer){.role = role, .until_ns = now_ns + LUMI_PAIRING_NS};
    g_strlcpy(made->by, by, sizeof made->by);
    lumi_secret_random(bytes, sizeof bytes);
    for (int i = 0; i < 8; i++)
        made->code[i + i / 4] = letters[bytes[i] % 32];
    made->code[4] = '-';
    return made;
}

/* As it is shown; false: no code looks like this. */
static bool tidy(const char *text, char code[LUMI_PAIRING_CODE])
{
    int count = 0;

    for (; *text; text++) {
        char letter = g_ascii_toupper(*text);
        if (strchr(" -", letter))
            continue;
        if (count == 8 || !strchr(letters, letter))
            return false;
        code[count + count / 4] = letter;
        count++;
    }
    code[4] = '-';
    code[9] = '\0';
    return count == 8;
}

bool lumi_pairing_take(struct lumi_pairing *pairing, int64_t now_ns, const char *text, struct lumi_pairing_offer *offer)
{
    char code[LUMI_PAIRING_CODE];
    int found = -1;

    if (!tidy(text, code))
        return false;
    for (int i = 0; i < pairing->count; i++)
        if (lumi_secret_equal(pairing->offer[i].code, code) && now_ns < pairing->offer[i].until_ns)
            found = i;
    if (found < 0)
        return false;
    *offer = pairing->offer[found];
    forget(pairing, found);
    return true;
}

void lumi_pairing_sweep(struct lumi_pairing *pairing, int64_t now_ns, const struct lumi_users *users)
{
    for (int i = pairing->count - 1; i >= 0; i--) {
        const struct lumi_pairing_offer *offer = &pairing->offer[i];
        const struct lumi_user *by = lumi_users_find(users, offer->by);
        bool stays = offer->by[0] ? by && by->role == LUMI_ROLE_OPERATE : users->count > 0;
        if (!stays || now_ns >= offer->until_ns)
            forget(pairing, i);
    }
}
