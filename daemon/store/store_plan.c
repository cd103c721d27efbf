/* Rows for a plan, before its first shot. */
#include "daemon/store/store.h"

#include "proto/base/memory.h"
#include "proto/mechanism/kinematics.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

struct rows {
    struct lumi_capture *capture;
    const struct lumi_plan *plan;
    struct lumi_rig rig; /* with the plan's positions: for the grid */
    const struct lumi_rig *profile;
    int64_t cameras[LUMI_RIG_CAMERAS];
    uint32_t mask;
};

static int add_cameras(struct rows *rows, struct lumi_error *error)
{
    const struct lumi_rig *rig = rows->profile;
    int64_t lenses[LUMI_RIG_LENSES];

    for (int i = 0; i < rig->lens_count; i++) {
        struct lumi_capture_lens lens = {.lens = rig->lenses[i].lens};
        snprintf(lens.name, sizeof lens.name, "%s", rig->lenses[i].name);
        LUMI_TRY(lumi_capture_add_lens(rows->capture, &lens, &lenses[i], error));
    }
    for (int i = 0; i < rig->camera_count; i++)
        LUMI_TRY(lumi_capture_add_camera(rows->capture, rig->cameras[i].name, lenses[rig->cameras[i].lens],
                                         &rows->cameras[i], error));
    return LUMI_OK;
}

static int add_frame(struct rows *rows, int camera, int position, int bracket, int64_t shot,
                     const struct lumi_capture_position *place, struct lumi_error *error)
{
    const int in_turn = position % rows->plan->positions;
    char name[LUMI_CAPTURE_NAME], suffix[16] = "";
    struct lumi_pose pose;
    int64_t id;

    if (rows->plan->bracket > 1)
        snprintf(suffix, sizeof suffix, "-b%d", bracket);
    snprintf(name, sizeof name, "c%02d-t%02d-p%03d%s", camera, place->turn, in_turn, suffix);
    const struct lumi_capture_new_frame frame = {
        .name = name,
        .camera = rows->cameras[camera],
        .shot = shot,
        .row = place->turn < rows->rig.turns ? lumi_rig_row(&rows->rig, camera, place->turn) : -1,
        .column = lumi_rig_column(&rows->rig, camera, in_turn),
    };
    LUMI_TRY(lumi_capture_add_frame(rows->capture, &frame, &id, error));
    lumi_rig_camera_pose_at(rows->profile, camera, place->turn_angle, place->drop, &pose);
    return lumi_capture_set_pose(rows->capture, id, &pose, LUMI_POSE_PRIOR, "the plan and the rig's profile", error);
}

static int add_position(struct rows *rows, int position, struct lumi_error *error)
{
    const struct lumi_plan *plan = rows->plan;
    const int64_t step = lumi_plan_position_step(plan, rows->profile, position);
    const double turns = lumi_rig_step_turns(rows->profile, step);
    const struct lumi_capture_position place = {
        .number = position,
        .turn = plan->first_turn + position / plan->positions,
        .step = step,
        .turn_angle = lumi_rig_turn_angle(rows->profile, turns),
        .drop = lumi_rig_drop(rows->profile, turns),
    };
    int64_t id, shot;

    LUMI_TRY(lumi_capture_add_position(rows->capture, &place, &id, error));
    for (int k = 0; k < plan->bracket; k++) {
        const double stops = log2(plan->exposures[k] / plan->exposures[0]);
        LUMI_TRY(lumi_capture_add_shot(rows->capture, id, k, isfinite(stops) ? stops : 0, &shot, error));
        LUMI_TRY(lumi_capture_set_shot(rows->capture, shot, position * plan->bracket + k, -1, error));
        for (int i = 0; i < rows->profile->camera_count; i++)
            if (rows->mask >> i & 1)
                LUMI_TRY(add_frame(rows, i, position, k, shot, &place, error));
    }
    return LUMI_OK;
}

static int add_texts(struct rows *rows, struct lumi_error *error)
{
    char *text = lumi_alloc(LUMI_RIG_TEXT_MAX + 1, 1);

    if (!text)
        return lumi_fail(error, LUMI_ERR_NOMEM, "plan: out of memory");
    lumi_rig_print(rows->profile, text, LUMI_RIG_TEXT_MAX + 1);
    int code = lumi_capture_set_profile(rows->capture, text, error);
    if (code == LUMI_OK) {
        lumi_plan_print(rows->plan, rows->profile, text, LUMI_RIG_TEXT_MAX + 1);
        code = lumi_capture_set_plan(rows->capture, text, error);
    }
    lumi_free(text);
    return code;
}

static int add_all(struct rows *rows, struct lumi_error *error)
{
    LUMI_TRY(add_texts(rows, error));
    LUMI_TRY(lumi_capture_set_meta(rows->capture, "surface", "sphere", error));
    LUMI_TRY(add_cameras(rows, error));
    if (rows->plan->mode == LUMI_PLAN_VIDEO)
        return LUMI_OK;
    for (int i = 0; i < rows->plan->positions * rows->plan->turns; i++)
        LUMI_TRY(add_position(rows, i, error));
    return LUMI_OK;
}

int lumi_store_plan(struct lumi_capture *capture, const struct lumi_rig *rig, const struct lumi_plan *plan,
                    struct lumi_error *error)
{
    struct rows *rows = lumi_calloc(1, sizeof *rows);

    if (!rows)
        return lumi_fail(error, LUMI_ERR_NOMEM, "plan: out of memory");
    rows->capture = capture;
    rows->plan = plan;
    rows->profile = rig;
    rows->rig = *rig;
    rows->rig.positions = plan->positions;
    rows->mask = lumi_plan_cameras(plan, rig);
    int code = lumi_capture_begin(capture, error);
    if (code == LUMI_OK)
        code = add_all(rows, error);
    if (code == LUMI_OK)
        code = lumi_capture_commit(capture, error);
    if (code != LUMI_OK)
        lumi_capture_rollback(capture, false);
    lumi_free(rows);
    return code;
}
