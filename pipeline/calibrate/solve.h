/* From priors to poses: the rounds of a whole calibration, on a bundle whose observations are there. */
#ifndef LUMI_PIPELINE_CALIBRATE_SOLVE_H
#define LUMI_PIPELINE_CALIBRATE_SOLVE_H

#include "pipeline/calibrate/bundle.h"
#include "pipeline/calibrate/mechanism.h"

struct lumi_solve_settings {
    bool lenses;       /* lenses with sigmas are solved for, at last */
    bool lenses_first; /* and from the first on: they are known badly */
    bool shutter;      /* so is the rolling shutter */
    /* Called once poses are good: may change where points were seen, and how sure that is; then all is solved once
     * more. NULL: nobody. */
    int (*refine)(void *context, struct lumi_bundle *bundle, struct lumi_error *error);
    void *context;
    double position_sigma, rotation_sigma; /* of the priors, where there is no mechanism */
};

struct lumi_solve_result {
    double spread; /* of the residuals, in their sigmas */
    int outliers, observations, points;
    double mechanism_spread; /* of the residuals when only the mechanism was solved for; 0: there is none */
    /* Robust standard deviations of a camera's place and orientation against the mechanism's, one axis. */
    double position_spread, rotation_spread;
};

/* In: priors, poses at them, observations with their sigmas. First the mechanism's numbers (NULL: there is none), then
 * every camera with the mechanism's pose as a soft term, outliers taken out between. At last the whole is laid over the
 * priors by a similarity: centre, axis, azimuth and scale are the rig's. */
int lumi_solve(struct lumi_bundle *bundle, struct lumi_mechanism *mechanism, const struct lumi_solve_settings *settings,
               struct lumi_solve_result *result, struct lumi_error *error);

#endif
