/* Debouncing by quiet time. */
#include "firmware/core/debounce.h"

void debounce_init(struct debounce *debounce, bool active)
{
    *debounce = (struct debounce){.settled = active, .level = active};
}

void debounce_input(struct debounce *debounce, bool active, int64_t position, uint64_t at)
{
    if (active == debounce->level)
        return;
    debounce->level = active;
    debounce->latest = at;
    if (!debounce->bouncing) {
        debounce->bouncing = true;
        debounce->first = (struct debounce_edge){.active = active, .position = position, .at = at};
    }
}

bool debounce_poll(struct debounce *debounce, uint64_t now, struct debounce_edge *edge)
{
    if (!debounce->bouncing || now < debounce->latest + DEBOUNCE_TICKS)
        return false;
    debounce->bouncing = false;
    if (debounce->level == debounce->settled)
        return false;
    debounce->settled = debounce->level;
    *edge = debounce->first;
    return true;
}
