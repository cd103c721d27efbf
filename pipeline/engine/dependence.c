/* Which stages read what others make. */
#include "pipeline/engine/dependence.h"

#include "pipeline/graph/graph.h"

#include <glib.h>
#include <string.h>

/* What a stage reads of; of a stage that is not listed: everything before it. */
static const struct {
    const char *stage, *reads;
} table[] = {
    {"response", ""},
    {"merge", "response"},
    {"masks", "merge"},
    {"features", "merge masks"},
    {"pairs", "features"},
    {"calibrate", "merge masks features pairs"},
    {"subsample", "masks calibrate"},
    {"equalize", "merge masks features pairs calibrate subsample"},
    {"equiangular", "merge masks calibrate subsample equalize"},
    {"match", "equiangular"},
    {"depth", "equiangular match"},
    {"synthesize", "masks equiangular depth"},
    {"geometry", "equiangular depth synthesize"},
    {"geometry-coarse", "equiangular depth synthesize"},
    {"prefilter", "equiangular depth synthesize geometry geometry-coarse"},
    {"grade", "equiangular synthesize prefilter"},
    {"color", "equiangular synthesize prefilter grade"},
};

static bool reads(int stage, int other)
{
    if (other >= stage)
        return false;
    for (size_t i = 0; i < G_N_ELEMENTS(table); i++)
        if (!strcmp(table[i].stage, lumi_stages[stage]->name)) {
            g_auto(GStrv) names = g_strsplit(table[i].reads, " ", -1);
            return g_strv_contains((const char *const *)names, lumi_stages[other]->name);
        }
    return true;
}

bool lumi_stage_rests_on(int stage, int other)
{
    for (int between = other; between < stage; between++)
        if (reads(stage, between) && (between == other || lumi_stage_rests_on(between, other)))
            return true;
    return false;
}
