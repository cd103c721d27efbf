/* Where pictures are taken from. */
#include "pipeline/evaluate/shots.h"

#include <glib.h>
#include <math.h>
#include <string.h>

#define DEGREE (LUMI_PI / 180)

/* Columns right, down, forward; then turned about forward by roll. */
static void from_angles(double yaw, double pitch, double roll, double r[9])
{
    struct lumi_vec3 forward = lumi_vec3(cos(pitch) * cos(yaw), cos(pitch) * sin(yaw), sin(pitch));
    struct lumi_vec3 right = lumi_vec3(sin(yaw), -cos(yaw), 0), down = lumi_cross(forward, right);
    double c = cos(roll), s = sin(roll);
    struct lumi_vec3 x = lumi_add(lumi_scale(right, c), lumi_scale(down, s));
    struct lumi_vec3 y = lumi_sub(lumi_scale(down, c), lumi_scale(right, s));
    const double all[9] = {x.x, y.x, forward.x, x.y, y.y, forward.y, x.z, y.z, forward.z};

    memcpy(r, all, sizeof all);
}

int lumi_pose_parse(const char *text, struct lumi_pose *pose, struct lumi_error *error)
{
    double n[6] = {0};
    const char *at = text;
    int count = 0;

    for (;;) {
        char *end;
        n[count] = g_ascii_strtod(at, &end);
        if (end == at || !isfinite(n[count]))
            break;
        count++;
        if (*end == '\0' && count >= 5) {
            from_angles(n[3] * DEGREE, n[4] * DEGREE, n[5] * DEGREE, pose->r);
            pose->t = lumi_vec3(n[0], n[1], n[2]);
            return LUMI_OK;
        }
        if (*end != ',' || count == 6)
            break;
        at = end + 1;
    }
    return lumi_fail(error, LUMI_ERR_ARG, "pose '%s': x,y,z,yaw,pitch[,roll] wanted (metres, degrees)", text);
}

void lumi_pose_describe(const struct lumi_pose *pose, double numbers[6])
{
    struct lumi_vec3 f = lumi_axis(pose, 2), x = lumi_axis(pose, 0);
    double pitch = asin(fmin(fmax(f.z, -1), 1)), flat = hypot(f.x, f.y), level[9];
    struct lumi_vec3 down = lumi_axis(pose, 1);
    /* Looking straight up or down, yaw is where the picture's top (or bottom) points. */
    double yaw = flat > 1e-6 ? atan2(f.y, f.x) : f.z < 0 ? atan2(-down.y, -down.x) : atan2(down.y, down.x);

    from_angles(yaw, pitch, 0, level);
    double roll =
        atan2(x.x * level[1] + x.y * level[4] + x.z * level[7], x.x * level[0] + x.y * level[3] + x.z * level[6]);
    const double all[6] = {pose->t.x, pose->t.y, pose->t.z, yaw / DEGREE, pitch / DEGREE, roll / DEGREE};
    memcpy(numbers, all, sizeof all);
}

void lumi_eye_pose(const struct lumi_pose *pose, int side, double distance, struct lumi_pose *eye)
{
    *eye = *pose;
    eye->t = lumi_add(pose->t, lumi_scale(lumi_axis(pose, 0), side * distance / 2));
}

/* Sums of gaze and down over all views, and how much they look away from the centre. */
struct arrangement {
    int count;
    struct lumi_vec3 gaze, down;
    double outwards, nearness;
};

static void arrange(const struct lumi_field *field, struct arrangement *a)
{
    const struct lumi_field_info *info = lumi_field_info(field);
    int count = info->view_count[LUMI_LEVEL_FINE];

    memset(a, 0, sizeof *a);
    a->count = count;
    for (int i = 0; i < count; i++) {
        const struct lumi_field_view *view = lumi_field_view(field, LUMI_LEVEL_FINE, i);
        const struct lumi_view_mesh *mesh = lumi_field_mesh(field, LUMI_LEVEL_FINE, i);
        struct lumi_vec3 forward = lumi_axis(&view->pose, 2);
        a->gaze = lumi_add(a->gaze, forward);
        a->down = lumi_add(a->down, lumi_axis(&view->pose, 1));
        a->outwards += lumi_dot(forward, lumi_sub(view->pose.t, info->centre));
        a->nearness += mesh ? (double)mesh->w_min + 0.5 * 65535 * (double)mesh->w_step : 0;
    }
    a->nearness /= count > 0 ? count : 1;
}

static void plane_path(const struct lumi_field_info *info, const struct arrangement *a, enum lumi_path path,
                       double phase, struct lumi_pose *pose)
{
    double focus = a->nearness > 1e-6 ? 1 / a->nearness : 100 * info->radius, reach = 0.5 * info->radius;
    struct lumi_vec3 gaze = lumi_normalize(a->gaze), eye = info->centre;
    struct lumi_pose middle;

    lumi_pose_look(info->centre, gaze, lumi_scale(a->down, -1), &middle);
    if (path == LUMI_PATH_ORBIT) {
        eye = lumi_add(eye, lumi_scale(lumi_axis(&middle, 0), reach * cos(phase)));
        eye = lumi_add(eye, lumi_scale(lumi_axis(&middle, 1), reach * sin(phase)));
        gaze = lumi_sub(lumi_add(info->centre, lumi_scale(gaze, focus)), eye);
    } else {
        eye = lumi_add(eye, lumi_scale(gaze, reach * sin(phase)));
    }
    lumi_pose_look(eye, gaze, lumi_scale(a->down, -1), pose);
}

/* Imported captures keep their source's axes, and any of them may point up: the pictures' tops tell which. A rig's own
 * captures, and those whose pictures agree on no top, have +Z. */
static struct lumi_vec3 upwards(const struct arrangement *a)
{
    const struct lumi_vec3 z = lumi_vec3(0, 0, 1);

    if (lumi_length(a->down) < 0.1 * a->count)
        return z;
    struct lumi_vec3 up = lumi_normalize(lumi_scale(a->down, -1));
    return up.z > 0.99 ? z : up;
}

static void sphere_path(const struct lumi_field_info *info, const struct arrangement *a, enum lumi_path path,
                        double phase, struct lumi_pose *pose)
{
    const struct lumi_vec3 up = upwards(a), x = lumi_vec3(1, 0, 0);
    bool inside = a->outwards >= 0;
    /* +X as far as it is level; then a quarter turn on about up. */
    struct lumi_vec3 first = lumi_sub(x, lumi_scale(up, lumi_dot(x, up)));
    first = lumi_normalize(lumi_length(first) > 0.1 ? first : lumi_cross(up, lumi_vec3(0, 0, 1)));
    struct lumi_vec3 second = lumi_cross(up, first);

    if (path == LUMI_PATH_ORBIT) {
        struct lumi_vec3 around = lumi_add(lumi_scale(first, cos(phase)), lumi_scale(second, sin(phase)));
        struct lumi_vec3 eye = lumi_add(info->centre, lumi_scale(around, (inside ? 0.5 : 1) * info->radius));
        lumi_pose_look(eye, lumi_scale(around, inside ? 1 : -1), up, pose);
    } else {
        double reach = (inside ? 0.6 * sin(phase) : 1 - 0.3 * sin(phase)) * info->radius;
        lumi_pose_look(lumi_add(info->centre, lumi_scale(first, reach)), lumi_scale(first, inside ? 1 : -1), up, pose);
    }
}

void lumi_path_pose(const struct lumi_field *field, enum lumi_path path, int frame, int count, struct lumi_pose *pose)
{
    const struct lumi_field_info *info = lumi_field_info(field);
    double phase = 2 * LUMI_PI * frame / (count > 0 ? count : 1);
    struct arrangement a;

    arrange(field, &a);
    if (info->surface == LUMI_SURFACE_PLANE)
        plane_path(info, &a, path, phase, pose);
    else
        sphere_path(info, &a, path, phase, pose);
}

int lumi_output_lens(enum lumi_output_projection projection, int width, int height, double fov, struct lumi_lens *lens,
                     struct lumi_error *error)
{
    const double usual[] = {LUMI_PI / 3, LUMI_PI, 2 * LUMI_PI}, most[] = {179 * DEGREE, 2 * LUMI_PI, 2 * LUMI_PI};
    double f;

    if (width < 1 || height < 1 || width > LUMI_RASTER_MAX || height > LUMI_RASTER_MAX)
        return lumi_fail(error, LUMI_ERR_ARG, "a picture of %d×%d pixels", width, height);
    if (fov == 0)
        fov = usual[projection];
    if (!(fov > 0) || fov > most[projection] + 1e-9)
        return lumi_fail(error, LUMI_ERR_ARG, "a field of view of %g degrees: up to %g can be had", fov / DEGREE,
                         most[projection] / DEGREE);
    if (projection == LUMI_OUTPUT_PERSPECTIVE) {
        lumi_lens_init_pinhole(lens, width, height, fov);
        return LUMI_OK;
    }
    f = width / fov;
    *lens =
        (struct lumi_lens){.model = projection == LUMI_OUTPUT_FISHEYE ? LUMI_LENS_FISHEYE : LUMI_LENS_EQUIRECTANGULAR,
                           .width = width,
                           .height = height,
                           .fx = f,
                           .fy = f,
                           .cx = width / 2.0,
                           .cy = height / 2.0};
    return LUMI_OK;
}
