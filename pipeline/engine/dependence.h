/* Which stages read what others make. Keys find out for every image; this is for handing whole stages to a queue, and
 * for throwing away what rests on something. */
#ifndef LUMI_PIPELINE_ENGINE_DEPENDENCE_H
#define LUMI_PIPELINE_ENGINE_DEPENDENCE_H

#include <stdbool.h>

/* Whether `stage` reads, directly or through others, what `other` makes; both by their place in lumi_stages. */
bool lumi_stage_rests_on(int stage, int other);

#endif
