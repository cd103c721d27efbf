/* How far a run is, by what lies in its work folder. */
#ifndef LUMI_PIPELINE_ENGINE_OUTSTANDING_H
#define LUMI_PIPELINE_ENGINE_OUTSTANDING_H

#include "pipeline/run/run.h"

struct lumi_progress {
    bool wanted; /* false: the capture and the parameters have no use for it; the rest is zero */
    bool known;  /* how many outputs it has; false: the first phase decides that and is not over */
    int count;   /* outputs; where that is not known, as many as there can be, to divide work by */
    int done;    /* made from what they would be made from now */
    bool *made;  /* count of them; all false where that is not known */
    int files;   /* outputs that lie there, whatever they were made from */
};

/* One a stage, in the order of lumi_stages; free with lumi_outstanding_free. The run has been opened to look, and not
 * been placed yet unless nothing of the first phase is wanted; it is, afterwards, if it can be. */
struct lumi_progress *lumi_outstanding_find(struct lumi_run *run);
void lumi_outstanding_free(struct lumi_progress *progress);
/* Whether all that is wanted is done. */
bool lumi_outstanding_none(const struct lumi_progress *progress);

/* Share `share` (1 .. shares) of `count` images: [*first, *last). */
void lumi_share_range(int share, int shares, int count, int *first, int *last);

#endif
