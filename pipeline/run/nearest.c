/* A short list in order, by insertion. */
#include "pipeline/run/nearest.h"

bool lumi_nearer(struct lumi_near a, struct lumi_near b)
{
    return a.distance != b.distance ? a.distance < b.distance : a.index < b.index;
}

int lumi_nearest_insert(struct lumi_near *list, int count, int limit, struct lumi_near item)
{
    int at = count;

    while (at > 0 && lumi_nearer(item, list[at - 1]))
        at--;
    if (item.index < 0 || at >= limit)
        return count;
    for (int i = 0; i < count; i++)
        if (list[i].index == item.index)
            return count;
    count = count < limit ? count + 1 : limit;
    for (int i = count - 1; i > at; i--)
        list[i] = list[i - 1];
    list[at] = item;
    return count;
}
