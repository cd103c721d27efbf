/* Where the points of a bundle are seen, to hundredths of a pixel: every observation of a track is matched anew against
 * one of them in the pictures themselves, now that poses and points say how the one looks stretched from the other. */
#ifndef LUMI_PIPELINE_CALIBRATE_REFINE_H
#define LUMI_PIPELINE_CALIBRATE_REFINE_H

#include "pipeline/calibrate/bundle.h"
#include "pipeline/run/run.h"

struct lumi_refined {
    int matched, left; /* observations that were found anew; that stay as they were */
    double moved;      /* median of how far, pixels */
};

/* Places and sigmas of the observations that count change; those that cannot be matched stay. The bundle's cameras are
 * the run's sources. Results do not depend on the number of threads. */
int lumi_refine(const struct lumi_run *run, struct lumi_bundle *bundle, struct lumi_refined *refined,
                struct lumi_error *error);

#endif
