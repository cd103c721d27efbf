/* Kinematics with what the rig's profile has wrong, and their derivatives. */
#include "pipeline/calibrate/mechanism_pose.h"

#include "pipeline/calibrate/rotation.h"
#include "proto/mechanism/kinematics.h"

#include <string.h>

const int mechanism_sizes[MECHANISM_BLOCKS] = {LUMI_MOUNT_NUMBERS, LUMI_PLATFORM_NUMBERS, 1, 1, 1};

/* The knot before a frame, and how far it is towards the next. */
static int knot_of(const struct lumi_mechanism *m, int frame, double *share)
{
    double at = fmax(m->frames[frame].turns / m->knot_step, 0);
    int knot = at < m->knot_count - 1 ? (int)at : m->knot_count - 2;

    *share = fmin(at - knot, 1);
    return knot;
}

void mechanism_blocks(struct lumi_mechanism *m, int frame, double *blocks[MECHANISM_BLOCKS])
{
    double share;
    int knot = knot_of(m, frame, &share);

    blocks[0] = m->mount[m->frames[frame].camera];
    blocks[1] = m->platform;
    blocks[2] = &m->turn[m->frames[frame].shot];
    blocks[3] = &m->drop[knot];
    blocks[4] = &m->drop[knot + 1];
}

/* All numbers in a row: mount, platform, turn, drop. */
static void pose_of(const struct lumi_mechanism *m, int frame, const double numbers[MECHANISM_NUMBERS],
                    struct lumi_pose *pose)
{
    const struct lumi_mechanism_frame *f = &m->frames[frame];
    const double *platform = numbers + LUMI_MOUNT_NUMBERS;
    struct lumi_rig_camera *camera;
    struct lumi_pose lean = {0};
    struct lumi_rig one; /* a rig with this camera alone: all that is read is the camera */

    one.cameras[0] = m->rig.cameras[f->camera];
    camera = &one.cameras[0];
    camera->angle += numbers[LUMI_MOUNT_ANGLE];
    camera->azimuth += numbers[LUMI_MOUNT_AZIMUTH];
    camera->radius += numbers[LUMI_MOUNT_RADIUS];
    camera->offset_m += numbers[LUMI_MOUNT_OFFSET];
    camera->pan += numbers[LUMI_MOUNT_PAN];
    camera->tilt += numbers[LUMI_MOUNT_TILT];
    camera->roll += numbers[LUMI_MOUNT_ROLL];
    double angle = f->turn_angle + platform[LUMI_PLATFORM_NUMBERS];
    lumi_rig_camera_pose_at(&one, 0, angle, f->drop + platform[LUMI_PLATFORM_NUMBERS + 1], pose);
    double c = cos(angle), s = sin(angle);
    double x = platform[LUMI_PLATFORM_X], y = platform[LUMI_PLATFORM_Y];
    pose->t = lumi_add(pose->t, lumi_vec3(c * x - s * y, s * x + c * y, 0));
    x = platform[LUMI_PLATFORM_LEAN_X];
    y = platform[LUMI_PLATFORM_LEAN_Y];
    const double about[3] = {c * x - s * y, s * x + c * y, 0};
    lumi_rotation_exp(about, lean.r);
    lumi_pose_multiply(&lean, pose, pose);
}

void mechanism_pose(const struct lumi_mechanism *m, int frame, const double *const *blocks, struct lumi_pose *pose,
                    double *rotation, double *place)
{
    const double step = 1e-5; /* differences of second order: 1e-10 of a number near 1 */
    double numbers[MECHANISM_NUMBERS], share;

    knot_of(m, frame, &share);
    memcpy(numbers, blocks[0], sizeof(double) * LUMI_MOUNT_NUMBERS);
    memcpy(numbers + LUMI_MOUNT_NUMBERS, blocks[1], sizeof(double) * LUMI_PLATFORM_NUMBERS);
    numbers[MECHANISM_NUMBERS - 2] = blocks[2][0];
    numbers[MECHANISM_NUMBERS - 1] = (1 - share) * blocks[3][0] + share * blocks[4][0];
    pose_of(m, frame, numbers, pose);
    for (int i = 0; rotation && i < MECHANISM_NUMBERS; i++) {
        struct lumi_pose less, more;
        double was = numbers[i], between[9], w[3];
        numbers[i] = was - step;
        pose_of(m, frame, numbers, &less);
        numbers[i] = was + step;
        pose_of(m, frame, numbers, &more);
        numbers[i] = was;
        lumi_rotation_between(less.r, more.r, between);
        lumi_rotation_log(between, w);
        const double moved[3] = {more.t.x - less.t.x, more.t.y - less.t.y, more.t.z - less.t.z};
        for (int k = 0; k < 3; k++) {
            rotation[MECHANISM_NUMBERS * k + i] = w[k] / (2 * step);
            place[MECHANISM_NUMBERS * k + i] = moved[k] / (2 * step);
        }
    }
}

void mechanism_chain(const struct lumi_mechanism *m, int frame, int rows, const double *by_rotation,
                     const double *by_place, const double *rotation, const double *place, double **jacobians)
{
    double share;

    knot_of(m, frame, &share);
    for (int row = 0; row < rows; row++) {
        double all[MECHANISM_NUMBERS];
        for (int i = 0; i < MECHANISM_NUMBERS; i++) {
            all[i] = 0;
            for (int k = 0; k < 3; k++)
                all[i] += by_rotation[3 * row + k] * rotation[MECHANISM_NUMBERS * k + i] +
                          by_place[3 * row + k] * place[MECHANISM_NUMBERS * k + i];
        }
        if (jacobians[0])
            memcpy(jacobians[0] + row * LUMI_MOUNT_NUMBERS, all, sizeof(double) * LUMI_MOUNT_NUMBERS);
        if (jacobians[1])
            memcpy(jacobians[1] + row * LUMI_PLATFORM_NUMBERS, all + LUMI_MOUNT_NUMBERS,
                   sizeof(double) * LUMI_PLATFORM_NUMBERS);
        if (jacobians[2])
            jacobians[2][row] = all[MECHANISM_NUMBERS - 2];
        if (jacobians[3])
            jacobians[3][row] = (1 - share) * all[MECHANISM_NUMBERS - 1];
        if (jacobians[4])
            jacobians[4][row] = share * all[MECHANISM_NUMBERS - 1];
    }
}

void lumi_mechanism_pose(const struct lumi_mechanism *m, int frame, struct lumi_pose *pose)
{
    double share;
    int knot = knot_of(m, frame, &share);
    const struct lumi_mechanism_frame *f = &m->frames[frame];
    const double *const blocks[MECHANISM_BLOCKS] = {m->mount[f->camera], m->platform, &m->turn[f->shot], &m->drop[knot],
                                                    &m->drop[knot + 1]};

    mechanism_pose(m, frame, blocks, pose, NULL, NULL);
}
