/* The stages there are, in the order in which they are made, and a run through those that a capture wants. */
#include "pipeline/graph/graph.h"

#include "pipeline/calibrate/calibrate_stage.h"
#include "pipeline/calibrate/features.h"
#include "pipeline/calibrate/pairs.h"
#include "pipeline/calibrate/rig_mask.h"
#include "pipeline/color/color_stage.h"
#include "pipeline/color/equalize_stage.h"
#include "pipeline/compress/compress.h"
#include "pipeline/depth/depth.h"
#include "pipeline/equiangular/equiangular.h"
#include "pipeline/equiangular/plan.h"
#include "pipeline/geometry/disks.h"
#include "pipeline/geometry/geometry.h"
#include "pipeline/graph/deliver.h"
#include "pipeline/hdr/merge_stage.h"
#include "pipeline/prefilter/prefilter.h"
#include "pipeline/subsample/subsample.h"
#include "pipeline/synthesize/synthesize.h"
#include "proto/base/file.h"

#include <glib.h>
#include <string.h>

const struct lumi_stage *const lumi_stages[] = {
    /* clang-format off */
    &lumi_stage_response,
    &lumi_stage_merge,
    &lumi_stage_masks,
    &lumi_stage_features,
    &lumi_stage_pairs,
    &lumi_stage_calibrate,
    &lumi_stage_subsample,
    &lumi_stage_equalize,
    &lumi_stage_equiangular,
    &lumi_stage_match,
    &lumi_stage_depth,
    &lumi_stage_synthesize,
    &lumi_stage_geometry,
    &lumi_stage_geometry_coarse,
    &lumi_stage_prefilter,
    &lumi_stage_grade,
    &lumi_stage_color,
    &lumi_stage_compress,
    /* clang-format on */
    NULL,
};

const struct lumi_stage *lumi_stage_by_name(const char *name)
{
    for (int i = 0; lumi_stages[i]; i++)
        if (!strcmp(lumi_stages[i]->name, name))
            return lumi_stages[i];
    return NULL;
}

static bool first_phase_wanted(const struct lumi_run *run)
{
    for (int i = 0; lumi_stages[i]; i++)
        if (lumi_stages[i]->set == LUMI_SET_FRAMES && lumi_stage_count(run, lumi_stages[i]) > 0)
            return true;
    return false;
}

int lumi_graph_place(struct lumi_run *run, struct lumi_error *error)
{
    if (run->placed)
        return LUMI_OK;
    LUMI_TRY(lumi_run_place(run, error));
    LUMI_TRY(lumi_equiangular_plan(run, error));
    g_autofree struct lumi_pose *poses = g_new(struct lumi_pose, (gsize)run->dense);
    for (int i = 0; i < run->dense; i++)
        poses[i] = run->sources[i].pose;
    lumi_surface_fit(run->dense, poses, &run->surface, &run->centre, &run->radius);
    return LUMI_OK;
}

int lumi_graph_open(const char *capture, const char *work, const struct lumi_parameters *parameters, int threads,
                    enum lumi_run_use use, struct lumi_run **result, struct lumi_error *error)
{
    struct lumi_run *run;
    int code = LUMI_OK;

    *result = NULL;
    LUMI_TRY(lumi_run_open(capture, work, parameters, threads, use, &run, error));
    if (!first_phase_wanted(run))
        code = lumi_graph_place(run, error);
    if (code != LUMI_OK) {
        lumi_run_close(run);
        return code;
    }
    *result = run;
    return LUMI_OK;
}

int lumi_graph_prepare(struct lumi_run *run, const struct lumi_stage *stage, struct lumi_error *error)
{
    return stage->set == LUMI_SET_FRAMES ? LUMI_OK : lumi_graph_place(run, error);
}

int lumi_graph_process(struct lumi_run *run, const char *output, lumi_graph_report report, struct lumi_error *error)
{
    const struct lumi_stage *last = NULL;

    LUMI_TRY(lumi_file_check_output(output, run->capture, error));
    LUMI_TRY(lumi_file_check_place(output, error));
    for (int i = 0; lumi_stages[i]; i++) {
        int skipped = 0;
        last = lumi_stages[i];
        LUMI_TRY(lumi_graph_prepare(run, last, error));
        const int outputs = lumi_stage_count(run, last);
        if (outputs == 0)
            continue;
        if (report)
            report(last, false, 0, 0);
        LUMI_TRY(lumi_run_stage(run, last, 0, -1, &skipped, error));
        if (report)
            report(last, true, outputs, skipped);
    }
    g_autofree char *made = lumi_run_path(run, last->name, -1, last->extension);
    return lumi_deliver(made, output, error);
}
