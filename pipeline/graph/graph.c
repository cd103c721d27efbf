/* The stages as a graph: equiangular → match → depth → geometry and geometry-coarse → compress. */
#include "pipeline/graph/graph.h"

#include "pipeline/compress/compress.h"
#include "pipeline/depth/depth.h"
#include "pipeline/equiangular/equiangular.h"
#include "pipeline/equiangular/plan.h"
#include "pipeline/geometry/disks.h"
#include "pipeline/geometry/geometry.h"
#include "pipeline/graph/deliver.h"
#include "proto/base/file.h"

#include <glib.h>
#include <string.h>

const struct lumi_stage *const lumi_stages[] = {
    &lumi_stage_equiangular,
    &lumi_stage_match,
    &lumi_stage_depth,
    &lumi_stage_geometry,
    &lumi_stage_geometry_coarse,
    &lumi_stage_compress,
    NULL,
};

const struct lumi_stage *lumi_stage_by_name(const char *name)
{
    for (int i = 0; lumi_stages[i]; i++)
        if (!strcmp(lumi_stages[i]->name, name))
            return lumi_stages[i];
    return NULL;
}

int lumi_graph_open(const char *capture, const char *work, const struct lumi_parameters *parameters, int threads,
                    bool alone, struct lumi_run **result, struct lumi_error *error)
{
    struct lumi_run *run;

    *result = NULL;
    LUMI_TRY(lumi_run_open(capture, work, parameters, threads, alone, &run, error));
    int code = lumi_equiangular_plan(run, error);
    if (code != LUMI_OK) {
        lumi_run_close(run);
        return code;
    }
    g_autofree struct lumi_pose *poses = g_new(struct lumi_pose, (gsize)run->count);
    for (int i = 0; i < run->count; i++)
        poses[i] = run->sources[i].pose;
    lumi_surface_fit(run->count, poses, &run->surface, &run->centre, &run->radius);
    *result = run;
    return LUMI_OK;
}

int lumi_graph_process(struct lumi_run *run, const char *output, lumi_graph_report report, struct lumi_error *error)
{
    const struct lumi_stage *last = NULL;

    LUMI_TRY(lumi_file_check_output(output, run->capture, error));
    LUMI_TRY(lumi_file_check_place(output, error));
    for (int i = 0; lumi_stages[i]; i++) {
        int skipped = 0;
        last = lumi_stages[i];
        if (report)
            report(last, false, 0, 0);
        LUMI_TRY(lumi_run_stage(run, last, 0, run->count, &skipped, error));
        if (report)
            report(last, true, last->whole ? 1 : run->count, skipped);
    }
    g_autofree char *made = lumi_run_path(run, last->name, -1, last->extension);
    return lumi_deliver(made, output, error);
}
