/* Masks of the rig. */
#include "pipeline/calibrate/rig_mask.h"

#include "pipeline/run/key.h"

int lumi_rig_mask_key(struct lumi_key *key, const struct lumi_run *run, int index, struct lumi_error *error)
{
    (void)key, (void)run, (void)index, (void)error;
    return LUMI_OK;
}

int lumi_rig_mask_read(const struct lumi_run *run, int index, struct lumi_raster *raster, struct lumi_error *error)
{
    (void)run, (void)index, (void)error;
    *raster = (struct lumi_raster){0};
    return LUMI_OK;
}
