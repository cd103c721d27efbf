/* What a plan comes to; plan_forecast.h has the formulas. */
#include "proto/mechanism/plan_forecast.h"

#include "proto/mechanism/kinematics.h"

#include <math.h>
#include <string.h>

static bool takes_part(const struct lumi_plan *plan, const struct lumi_rig *rig, int camera)
{
    return lumi_plan_cameras(plan, rig) >> camera & 1;
}

/* ---- the view volume ---- */

/* Between where the camera looks out of the sphere and the middle of an edge of its image, in the camera's frame. An
 * edge that the lens does not image lies beyond all it does: it limits nothing. */
static double edge_angle(const struct lumi_lens *lens, double x, double y, struct lumi_vec3 outwards)
{
    struct lumi_vec3 ray;

    if (!lumi_lens_unproject(lens, x, y, &ray))
        return LUMI_PI / 2;
    return acos(fmax(-1, fmin(1, lumi_dot(ray, outwards))));
}

static void openings(const struct lumi_rig *rig, int camera, double *across, double *up, double *radius)
{
    const struct lumi_lens *lens = &rig->lenses[rig->cameras[camera].lens].lens;
    const double roll = rig->cameras[camera].roll;
    struct lumi_pose pose;
    struct lumi_vec3 out, own;

    lumi_rig_camera_pose_at(rig, camera, 0, 0, &pose);
    *radius = lumi_length(pose.t);
    out = *radius > 0 ? lumi_scale(pose.t, 1 / *radius) : lumi_vec3(pose.r[2], pose.r[5], pose.r[8]);
    own = lumi_vec3(pose.r[0] * out.x + pose.r[3] * out.y + pose.r[6] * out.z,
                    pose.r[1] * out.x + pose.r[4] * out.y + pose.r[7] * out.z,
                    pose.r[2] * out.x + pose.r[5] * out.y + pose.r[8] * out.z);
    double x = fmin(edge_angle(lens, 0, lens->cy, own), edge_angle(lens, lens->width, lens->cy, own));
    double y = fmin(edge_angle(lens, lens->cx, 0, own), edge_angle(lens, lens->cx, lens->height, own));
    const bool sideways = fabs(sin(roll)) > fabs(cos(roll)); /* the camera lies on its side */
    *across = fmin(sideways ? y : x, LUMI_PI / 2);
    *up = fmin(sideways ? x : y, LUMI_PI / 2);
}

static void find_volume(const struct lumi_plan *plan, const struct lumi_rig *rig, struct lumi_plan_forecast *f)
{
    double across, up, radius;

    f->volume = f->volume_height = INFINITY;
    for (int i = 0; i < rig->camera_count; i++)
        if (takes_part(plan, rig, i)) {
            openings(rig, i, &across, &up, &radius);
            f->volume = fmin(f->volume, radius * sin(across));
            f->volume_height = fmin(f->volume_height, radius * sin(up));
        }
}

/* ---- the nearest sharp distance ---- */

/* Above the equator of row `turn` of a camera, in its middle. */
static double elevation(const struct lumi_plan *plan, const struct lumi_rig *rig, int camera, int turn)
{
    const double drop = lumi_rig_drop(rig, rig->string.held ? 0 : plan->first_turn + turn + 0.5);

    return asin(fmax(-1, fmin(1, sin(rig->cameras[camera].angle - drop))));
}

/* From a row down to the next there is; 0: it is the lowest. */
static double row_gap(const struct lumi_plan *plan, const struct lumi_rig *rig, double from)
{
    double next = -INFINITY;

    for (int i = 0; i < rig->camera_count; i++)
        for (int turn = 0; takes_part(plan, rig, i) && turn < plan->turns; turn++) {
            double at = elevation(plan, rig, i, turn);
            if (at < from - 1e-6)
                next = fmax(next, at);
        }
    return isfinite(next) ? from - next : 0;
}

static void find_nearest(const struct lumi_plan *plan, const struct lumi_rig *rig, struct lumi_plan_forecast *f)
{
    double most = 0;

    for (int i = 0; i < rig->camera_count; i++) {
        const struct lumi_lens *lens = &rig->lenses[rig->cameras[i].lens].lens;
        const double cr = cos(rig->cameras[i].roll), sr = sin(rig->cameras[i].roll);
        const double radius = rig->cameras[i].radius;
        for (int turn = 0; takes_part(plan, rig, i) && turn < plan->turns; turn++) {
            double at = elevation(plan, rig, i, turn);
            double along = radius * cos(at) * 2 * LUMI_PI / plan->positions;
            double down = radius * row_gap(plan, rig, at);
            f->spacing = fmax(f->spacing, fmax(along, down));
            most = fmax(most, along * hypot(lens->fx * cr, lens->fy * sr));
            most = fmax(most, down * hypot(lens->fy * cr, lens->fx * sr));
        }
    }
    f->nearest = most / (LUMI_PLAN_DEPTH_LAYERS * LUMI_PLAN_LAYER_PIXELS);
}

static void find_blur(const struct lumi_plan *plan, const struct lumi_rig *rig, struct lumi_plan_forecast *f)
{
    double radius = 0;

    for (int i = 0; i < rig->camera_count; i++)
        if (takes_part(plan, rig, i))
            radius = fmax(radius, rig->cameras[i].radius);
    f->blur = lumi_plan_blur(plan, rig);
    f->blur_near = f->blur > 0 && f->nearest > 0 ? f->blur * (1 + radius / f->nearest) : f->blur;
}

void lumi_plan_forecast(const struct lumi_plan *plan, const struct lumi_rig *rig, const double *pixel_bytes,
                        struct lumi_plan_forecast *f)
{
    memset(f, 0, sizeof *f);
    f->shots = lumi_plan_shots(plan);
    f->frames = lumi_plan_frames(plan, rig);
    f->columns = plan->positions;
    f->seconds = lumi_plan_seconds(plan, rig);
    for (int i = 0; i < rig->camera_count; i++) {
        const struct lumi_lens *lens = &rig->lenses[rig->cameras[i].lens].lens;
        if (!takes_part(plan, rig, i))
            continue;
        f->rows += plan->turns;
        f->bytes += (double)lens->width * lens->height * (pixel_bytes ? pixel_bytes[i] : 1) * f->shots;
    }
    f->bytes_per_second = f->seconds > 0 ? f->bytes / f->seconds : 0;
    find_volume(plan, rig, f);
    find_nearest(plan, rig, f);
    find_blur(plan, rig, f);
}
