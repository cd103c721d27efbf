/* Points from the directions they are seen in. */
#include "pipeline/calibrate/bundle.h"

/* Directions in the world; false where the lens has none there, or the observation does not count. */
static bool ray_of(const struct lumi_bundle *b, const struct lumi_bundle_observation *o, struct lumi_vec3 *ray)
{
    const struct lumi_bundle_camera *camera = &b->cameras[o->camera];
    struct lumi_vec3 direction;

    if (o->outlier || !camera->used || !lumi_lens_unproject(&b->lenses[camera->lens].lens, o->x, o->y, &direction))
        return false;
    *ray = lumi_rotate(camera->pose.r, direction);
    return true;
}

/* Two directions across `d`. */
static void across(struct lumi_vec3 d, struct lumi_vec3 *e1, struct lumi_vec3 *e2)
{
    struct lumi_vec3 other = fabs(d.z) < 0.7 ? lumi_vec3(0, 0, 1) : lumi_vec3(1, 0, 0);

    *e1 = lumi_normalize(lumi_cross(other, d));
    *e2 = lumi_cross(d, *e1);
}

/* Solves the symmetric a x = v; false where it is singular. */
static bool solve3(const double a[9], const double v[3], double x[3])
{
    double c0 = a[4] * a[8] - a[5] * a[7], c1 = a[5] * a[6] - a[3] * a[8], c2 = a[3] * a[7] - a[4] * a[6];
    double det = a[0] * c0 + a[1] * c1 + a[2] * c2;

    if (!(fabs(det) > 1e-18))
        return false;
    x[0] = (v[0] * c0 + v[1] * (a[2] * a[7] - a[1] * a[8]) + v[2] * (a[1] * a[5] - a[2] * a[4])) / det;
    x[1] = (v[0] * c1 + v[1] * (a[0] * a[8] - a[2] * a[6]) + v[2] * (a[2] * a[3] - a[0] * a[5])) / det;
    x[2] = (v[0] * c2 + v[1] * (a[1] * a[6] - a[0] * a[7]) + v[2] * (a[0] * a[4] - a[1] * a[3])) / det;
    return true;
}

/* What is left of (direction + a e1 + b e2 + inverse (anchor − eye)) across every ray is least: linear in the three. */
static bool least_squares(const struct lumi_bundle *b, int point, struct lumi_bundle_point *p)
{
    double normal[9] = {0}, right[3] = {0};

    for (int i = b->first[point]; i < b->first[point + 1]; i++) {
        struct lumi_vec3 ray;
        if (!ray_of(b, &b->observations[i], &ray))
            continue;
        const struct lumi_vec3 eye = b->cameras[b->observations[i].camera].pose.t;
        const struct lumi_vec3 columns[4] = {p->e1, p->e2, lumi_sub(p->anchor, eye), p->direction};
        struct lumi_vec3 left[4];
        for (int k = 0; k < 4; k++)
            left[k] = lumi_sub(columns[k], lumi_scale(ray, lumi_dot(ray, columns[k])));
        for (int k = 0; k < 3; k++) {
            right[k] -= lumi_dot(left[k], left[3]);
            for (int m = 0; m < 3; m++)
                normal[3 * k + m] += lumi_dot(left[k], left[m]);
        }
    }
    /* Rays that are all but parallel leave the distance open: a little weight towards far away. */
    normal[8] += 1e-9;
    return solve3(normal, right, p->block);
}

static bool in_front(const struct lumi_bundle *b, int point, const struct lumi_bundle_point *p)
{
    struct lumi_vec3 d = lumi_bundle_ray(p);

    for (int i = b->first[point]; i < b->first[point + 1]; i++) {
        struct lumi_vec3 ray;
        if (!ray_of(b, &b->observations[i], &ray))
            continue;
        const struct lumi_vec3 eye = b->cameras[b->observations[i].camera].pose.t;
        if (!(lumi_dot(ray, lumi_add(d, lumi_scale(lumi_sub(p->anchor, eye), p->block[2]))) > 0))
            return false;
    }
    return true;
}

static void triangulate(struct lumi_bundle *b, int point, int fewest)
{
    struct lumi_bundle_point *p = &b->points[point];
    struct lumi_vec3 anchor = {0}, direction = {0}, first = {0};
    double baseline = 0;
    int count = 0;

    p->used = false;
    for (int i = b->first[point]; i < b->first[point + 1]; i++) {
        struct lumi_vec3 ray;
        if (!ray_of(b, &b->observations[i], &ray))
            continue;
        const struct lumi_vec3 eye = b->cameras[b->observations[i].camera].pose.t;
        if (count++ == 0)
            first = eye;
        baseline = fmax(baseline, lumi_length(lumi_sub(eye, first)));
        anchor = lumi_add(anchor, eye);
        direction = lumi_add(direction, ray);
    }
    if (count < fewest || count < 2 || !(baseline > 1e-6) || !(lumi_length(direction) > 0.1 * count))
        return;
    p->anchor = lumi_scale(anchor, 1.0 / count);
    p->direction = lumi_normalize(direction);
    across(p->direction, &p->e1, &p->e2);
    p->used = least_squares(b, point, p) && in_front(b, point, p);
}

void lumi_bundle_triangulate(struct lumi_bundle *b, int fewest)
{
    for (int point = 0; point < b->point_count; point++)
        triangulate(b, point, fewest);
}
