/* The least recently used goes first. */
#include "pipeline/run/recent.h"

#include <assert.h>

void lumi_recent_init(struct lumi_recent *recent, int count)
{
    assert(count > 0 && count <= LUMI_RECENT_MAX);
    *recent = (struct lumi_recent){.count = count};
    for (int i = 0; i < count; i++)
        recent->slots[i].index = -1;
}

bool lumi_recent_find(struct lumi_recent *recent, int index, int *slot)
{
    int oldest = 0;

    for (int i = 0; i < recent->count; i++) {
        if (recent->slots[i].index == index) {
            recent->slots[i].used = ++recent->clock;
            *slot = i;
            return true;
        }
        if (recent->slots[i].used < recent->slots[oldest].used)
            oldest = i;
    }
    recent->slots[oldest].index = -1;
    *slot = oldest;
    return false;
}

void lumi_recent_take(struct lumi_recent *recent, int slot, int index)
{
    recent->slots[slot].index = index;
    recent->slots[slot].used = ++recent->clock;
}
