/* An exposure as the mean of pictures along the way. */
#include "sim/exposure.h"

#include "proto/mechanism/kinematics.h"
#include "sim/camera.h"

#include <math.h>

#define STEPS 9

static void add(struct lumi_raster *sum, const struct lumi_raster *picture, float share)
{
    for (int y = 0; y < sum->height; y++) {
        const float *from = lumi_row_f32(picture, y);
        float *to = lumi_row_f32(sum, y);

        for (int i = 0; i < sum->width * sum->channels; i++)
            to[i] += share * from[i];
    }
}

/* About the camera's own y, which points down: towards its right. */
static void turn_aside(struct lumi_pose *pose, double askew)
{
    const double c = cos(askew), s = sin(askew);

    for (int row = 0; row < 3; row++) {
        double *r = &pose->r[3 * row];
        const double x = r[0], z = r[2];

        r[0] = c * x - s * z;
        r[2] = s * x + c * z;
    }
}

/* The middle's pose, turned about the world's axis. */
static void turn_about_axis(const struct lumi_pose *middle, double angle, struct lumi_pose *pose)
{
    const double c = cos(angle), s = sin(angle);
    const struct lumi_pose turn = {{c, -s, 0, s, c, 0, 0, 0, 1}, {0, 0, 0}};

    lumi_pose_multiply(&turn, middle, pose);
}

int sim_exposure_render(const struct sim_scene *scene, const struct lumi_rig *rig, int camera,
                        const struct sim_moment *moment, int threads, struct lumi_raster *picture,
                        struct lumi_error *error)
{
    const struct lumi_lens *lens = &rig->lenses[rig->cameras[camera].lens].lens;
    const int steps = (int)fmin(fmax(ceil(fabs(moment->moved) * lens->fx * 2), 1), STEPS);
    int code = LUMI_OK;

    for (int i = 0; i < steps && code == LUMI_OK; i++) {
        const double moved = moment->moved * ((i + 0.5) / steps - 0.5);
        struct lumi_raster one = {0};
        struct lumi_pose pose;

        if (moment->pose)
            turn_about_axis(moment->pose, moved, &pose);
        else
            lumi_rig_camera_pose_at(rig, camera, moment->angle + moved, moment->drop, &pose);
        turn_aside(&pose, moment->askew);
        code = sim_camera_render(scene, lens, &pose, threads, &one, NULL, error);
        if (code == LUMI_OK && steps > 1) {
            if (i == 0)
                code = lumi_raster_create(picture, one.width, one.height, one.channels, LUMI_F32);
            if (code == LUMI_OK)
                add(picture, &one, 1.0f / (float)steps);
            lumi_raster_finish(&one);
        } else if (code == LUMI_OK) {
            *picture = one;
        }
    }
    return code;
}
