/* The frames on the sphere: where each looks from, how it stands; where the arm is. */
#include "daemon/engine/engine_priv.h"
#include "proto/mechanism/kinematics.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static char letter_of_rejected(const struct engine_frame *frame)
{
    if (frame->asked)
        return 't';
    return frame->fault == LUMI_JUDGE_SOFT ? 'f' : frame->fault == LUMI_JUDGE_CLIPPED ? 'c' : 'r';
}

char engine_frame_letter(const struct lumi_engine *e, const struct engine_frame *frame)
{
    switch (frame->at) {
    case AT_TRIGGERED:
    case AT_RECEIVED:
        return 'w';
    case AT_STORED:
        if (e->config.judging && e->ports.judge)
            return 's';
        return frame->retakes > 0 ? 'n' : 's';
    case AT_ACCEPTED:
        return frame->retakes > 0 ? 'n' : 'a';
    case AT_REJECTED:
        return letter_of_rejected(frame);
    case AT_MISSING:
        return 'm';
    default:
        return frame->retakes > 0 ? 't' : 'p';
    }
}

int engine_frame_number(const struct lumi_engine *e, int shot, int camera)
{
    int used = 0, before = 0;

    for (int c = 0; c < e->config.camera_count; c++) {
        before += e->cameras[c].used && c < camera;
        used += e->cameras[c].used;
    }
    return shot * used + before;
}

bool lumi_engine_frames(const struct lumi_engine *e, struct lumi_engine_frames *frames)
{
    memset(frames, 0, sizeof *frames);
    if (!e->frames || !e->plan_known)
        return false;
    snprintf(frames->capture, sizeof frames->capture, "%s", e->capture);
    frames->shots = e->shots;
    for (int c = 0; c < e->config.camera_count; c++)
        if (e->cameras[c].used)
            frames->cameras[frames->camera_count++] = c;
    return true;
}

/* Of a rig that passed its check no camera sits in the very centre; should one, it looks from where it looks to. */
static void direction_of(const struct lumi_pose *pose, double direction[3])
{
    const double length = lumi_length(pose->t);
    struct lumi_vec3 unit =
        length > 1e-9 ? lumi_scale(pose->t, 1 / length) : lumi_vec3(pose->r[2], pose->r[5], pose->r[8]);

    direction[0] = unit.x;
    direction[1] = unit.y;
    direction[2] = unit.z;
}

void lumi_engine_frame(const struct lumi_engine *e, const struct lumi_engine_frames *frames, int number,
                       struct lumi_engine_frame *frame)
{
    const int shot = number / frames->camera_count, camera = frames->cameras[number % frames->camera_count];
    const size_t at = (size_t)shot * (size_t)e->config.camera_count + (size_t)camera;
    struct lumi_pose pose;

    engine_shot_pose(e, shot, camera, &pose);
    direction_of(&pose, frame->direction);
    frame->name = e->names[at];
    frame->letter = engine_frame_letter(e, e->frames + at);
}

/* ---- the arm ---- */

void engine_arm(const struct lumi_engine *e, struct lumi_engine_arm *arm)
{
    const lumi_wire_Status *board = &e->link.status;
    const struct lumi_rig *rig = &e->board_rig;
    struct lumi_pose pose;

    memset(arm, 0, sizeof *arm);
    if (!e->connected || !e->link.status_known || !board->position_known || !e->board_rig_known)
        return;
    arm->known = true;
    arm->turn_known = board->turn_known || rig->string.held;
    arm->turn = lumi_rig_step_turns(rig, board->step);
    arm->yaw = remainder(lumi_rig_turn_angle(rig, arm->turn), 2 * LUMI_PI);
    arm->pitch = board->pitch;
    arm->camera_count = rig->camera_count;
    for (int c = 0; c < rig->camera_count; c++) {
        lumi_rig_camera_pose_at(rig, c, arm->yaw, arm->pitch, &pose);
        direction_of(&pose, arm->cameras[c]);
    }
}

bool lumi_engine_profile(const struct lumi_engine *e, struct lumi_rig *rig, const char **source)
{
    if (!e->board_rig_known && !e->rig_known)
        return false;
    *rig = e->board_rig_known ? e->board_rig : e->rig;
    *source = !e->board_rig_known ? "capture" : e->connected ? "board" : "last";
    return true;
}
