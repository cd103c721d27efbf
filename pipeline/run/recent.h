/* Which of a few places holds an image that was read, and which is the first to be given away. */
#ifndef LUMI_PIPELINE_RUN_RECENT_H
#define LUMI_PIPELINE_RUN_RECENT_H

#include <stdbool.h>

enum { LUMI_RECENT_MAX = 64 };

struct lumi_recent {
    int count;
    long clock;
    struct {
        int index; /* −1: free */
        long used;
    } slots[LUMI_RECENT_MAX];
};

void lumi_recent_init(struct lumi_recent *recent, int count);

/* True: `slot` holds image `index`, used now. False: it is nowhere, and `slot` is that used longest ago; what it holds
 * goes, and once the image stands there lumi_recent_take says so. */
bool lumi_recent_find(struct lumi_recent *recent, int index, int *slot);
void lumi_recent_take(struct lumi_recent *recent, int slot, int index);

#endif
