/* The stage "pairs": which features of two pictures are of the same point, for each picture with its partners of higher
 * index, one ".pairs" file a frame (docs/features.md). */
#ifndef LUMI_PIPELINE_CALIBRATE_PAIRS_H
#define LUMI_PIPELINE_CALIBRATE_PAIRS_H

#include "pipeline/run/run.h"

#include <stddef.h>
#include <stdint.h>

struct lumi_match {
    uint32_t a, b;  /* features of this picture and of the partner */
    float distance; /* of their descriptors */
};

struct lumi_pair {
    char name[64]; /* the partner's */
    int match_count;
    struct lumi_match *matches; /* owned; they agree with the prior as far as it can be wrong, and with one another */
    /* A few pairs of every camera are also matched without the prior, to find one that is wrong. Of `free_count`
     * matches that agree with one another on some motion, `free_outside` lie outside the prior's band. Not tried: both
     * 0. */
    int free_count, free_outside;
    /* What the matches (the free ones where there are, else those above) say by themselves: partner's place and
     * orientation in this camera's frame, direction of unit length. All zero where there are too few. */
    double rotation[9];
    struct lumi_vec3 direction;
};

struct lumi_pair_list {
    int count;
    struct lumi_pair *items; /* owned */
};

void lumi_pairs_finish(struct lumi_pair_list *list);

int lumi_pairs_read(const char *path, struct lumi_pair_list *list, struct lumi_error *error);
int lumi_pairs_decode(const void *data, size_t size, const char *name, struct lumi_pair_list *list,
                      struct lumi_error *error);
int lumi_pairs_write(const char *path, const struct lumi_pair_list *list, struct lumi_error *error);

/* The partners of frame `index`, lower indices too, ascending; from the capture's poses alone. *partners is released
 * with g_free. Returns how many (0: it has no neighbour that looks at what it looks at). */
int lumi_pairs_choose(const struct lumi_run *run, int index, int **partners);

extern const struct lumi_stage lumi_stage_pairs;

#endif
