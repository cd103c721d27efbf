/* Residual: where a point is seen. */
#include "pipeline/calibrate/reprojection.h"

#include "pipeline/calibrate/rotation.h"

#include <string.h>

/* A 2 × 3 matrix times the vector v. */
static void apply(const double m[6], struct lumi_vec3 v, double scale, double *first, double *second)
{
    *first = scale * (m[0] * v.x + m[1] * v.y + m[2] * v.z);
    *second = scale * (m[3] * v.x + m[4] * v.y + m[5] * v.z);
}

static struct lumi_vec3 about_z(struct lumi_vec3 v, double angle)
{
    double c = cos(angle), s = sin(angle);

    return lumi_vec3(c * v.x - s * v.y, s * v.x + c * v.y, v.z);
}

static void fill_slope(const struct lumi_bundle_point *p, const struct lumi_pose *pose, const double image[6],
                       struct lumi_vec3 turned, struct lumi_vec3 camera, double inverse, double share, double angle,
                       double scale, struct lumi_reprojection_slope *s)
{
    /* A rotation after the pose's: camera × w. */
    const struct lumi_vec3 across[3] = {lumi_vec3(0, camera.z, -camera.y), lumi_vec3(-camera.z, 0, camera.x),
                                        lumi_vec3(camera.y, -camera.x, 0)};
    const struct lumi_vec3 by[3] = {about_z(p->e1, angle), about_z(p->e2, angle),
                                    lumi_sub(about_z(p->anchor, angle), pose->t)};

    for (int i = 0; i < 3; i++) {
        struct lumi_vec3 row = lumi_vec3(pose->r[3 * i], pose->r[3 * i + 1], pose->r[3 * i + 2]);
        apply(image, across[i], scale, &s->rotation[i], &s->rotation[3 + i]);
        apply(image, row, -inverse * scale, &s->place[i], &s->place[3 + i]);
        apply(image, lumi_rotate_back(pose->r, by[i]), scale, &s->point[i], &s->point[3 + i]);
    }
    apply(image, lumi_rotate_back(pose->r, lumi_vec3(-turned.y, turned.x, 0)), -share * scale, &s->shutter[0],
          &s->shutter[1]);
}

bool lumi_reproject(const struct lumi_bundle *bundle, const struct lumi_bundle_observation *o,
                    const struct lumi_pose *pose, const double *lens_block, const double *point, double shutter,
                    double residual[2], struct lumi_reprojection_slope *slope)
{
    const struct lumi_bundle_point *p = &bundle->points[o->point];
    const struct lumi_bundle_lens *l = &bundle->lenses[bundle->cameras[o->camera].lens];
    struct lumi_lens lens = l->lens;
    double numbers[LUMI_LENS_NUMBERS], xy[2], image[6], scale = 1 / o->sigma;

    lumi_lens_numbers(&l->lens, numbers);
    for (int i = 0; i < LUMI_LENS_NUMBERS; i++)
        numbers[i] += l->sigma[i] * lens_block[i];
    lumi_lens_from_numbers(numbers, &lens);
    struct lumi_vec3 world = lumi_add(lumi_add(p->direction, lumi_scale(p->anchor, point[2])),
                                      lumi_add(lumi_scale(p->e1, point[0]), lumi_scale(p->e2, point[1])));
    double share = o->y / lens.height - 0.5, angle = -shutter * share;
    struct lumi_vec3 turned = shutter != 0 ? about_z(world, angle) : world;
    struct lumi_vec3 camera = lumi_rotate_back(pose->r, lumi_sub(turned, lumi_scale(pose->t, point[2])));
    if (!lumi_lens_project_slope(&lens, camera, xy, slope ? image : NULL, slope ? slope->lens : NULL))
        return false;
    residual[0] = (xy[0] - o->x) * scale;
    residual[1] = (xy[1] - o->y) * scale;
    if (!slope)
        return true;
    fill_slope(p, pose, image, turned, camera, point[2], share, angle, scale, slope);
    for (int i = 0; i < 2 * LUMI_LENS_NUMBERS; i++)
        slope->lens[i] *= scale * l->sigma[i % LUMI_LENS_NUMBERS];
    return true;
}

bool lumi_reprojection_residual(const void *context, const double *const *blocks, double *residuals, double **jacobians)
{
    const struct lumi_measured *m = context;
    const struct lumi_bundle_observation *o = &m->bundle->observations[m->observation];
    const double *camera = blocks[0];
    struct lumi_reprojection_slope slope;
    struct lumi_pose pose = {.t = lumi_vec3(camera[3], camera[4], camera[5])};
    double turn[9];

    lumi_rotation_exp(camera, turn);
    lumi_rotation_multiply(m->bundle->cameras[o->camera].pose.r, turn, pose.r);
    if (!lumi_reproject(m->bundle, o, &pose, blocks[1], blocks[2], blocks[3][0], residuals, jacobians ? &slope : NULL))
        return false;
    if (!jacobians)
        return true;
    if (jacobians[0]) {
        double j[9];
        lumi_rotation_slope(camera, j);
        for (int row = 0; row < 2; row++)
            for (int i = 0; i < 3; i++) {
                const double *s = slope.rotation + 3 * row;
                jacobians[0][6 * row + i] = s[0] * j[i] + s[1] * j[3 + i] + s[2] * j[6 + i];
                jacobians[0][6 * row + 3 + i] = slope.place[3 * row + i];
            }
    }
    if (jacobians[1])
        memcpy(jacobians[1], slope.lens, sizeof slope.lens);
    if (jacobians[2])
        memcpy(jacobians[2], slope.point, sizeof slope.point);
    if (jacobians[3])
        memcpy(jacobians[3], slope.shutter, sizeof slope.shutter);
    return true;
}
