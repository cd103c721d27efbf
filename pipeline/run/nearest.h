/* The nearest of many views, in order. */
#ifndef LUMI_PIPELINE_RUN_NEAREST_H
#define LUMI_PIPELINE_RUN_NEAREST_H

#include <stdbool.h>

struct lumi_near {
    double distance;
    int index; /* of two as near, the smaller comes first */
};

bool lumi_nearer(struct lumi_near a, struct lumi_near b);

/* Puts `item` in its place among the `count` there are, nearest first, of which at most `limit` are kept; one that is
 * there stays once, one with a negative index is none. Returns how many there are then. */
int lumi_nearest_insert(struct lumi_near *list, int count, int limit, struct lumi_near item);

#endif
