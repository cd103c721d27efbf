/* A lens with its derivatives. */
#include "pipeline/calibrate/lens_slope.h"

#include <math.h>
#include <string.h>

void lumi_lens_numbers(const struct lumi_lens *l, double n[LUMI_LENS_NUMBERS])
{
    const double all[LUMI_LENS_NUMBERS] = {l->fx, l->fy, l->cx, l->cy, l->k1, l->k2, l->k3, l->k4, l->p1, l->p2};

    memcpy(n, all, sizeof all);
}

void lumi_lens_from_numbers(const double n[LUMI_LENS_NUMBERS], struct lumi_lens *l)
{
    l->fx = n[LUMI_LENS_FX];
    l->fy = n[LUMI_LENS_FY];
    l->cx = n[LUMI_LENS_CX];
    l->cy = n[LUMI_LENS_CY];
    l->k1 = n[LUMI_LENS_K1];
    l->k2 = n[LUMI_LENS_K2];
    l->k3 = n[LUMI_LENS_K3];
    l->k4 = n[LUMI_LENS_K4];
    l->p1 = n[LUMI_LENS_P1];
    l->p2 = n[LUMI_LENS_P2];
}

bool lumi_lens_has(const struct lumi_lens *lens, enum lumi_lens_number number)
{
    if (number >= LUMI_LENS_P1)
        return lens->model == LUMI_LENS_BROWN;
    return number != LUMI_LENS_K4 || lens->model == LUMI_LENS_FISHEYE;
}

/* The chain's last link: from the plane (u, v) of a focal length 1 to pixels. plane: d (u, v) / d direction; terms:
 * d (u, v) / d (k1, k2, k3, k4, p1, p2). */
static void to_pixels(const struct lumi_lens *l, double u, double v, const double plane[6], const double terms[12],
                      double xy[2], double *by_direction, double *by_lens)
{
    xy[0] = l->fx * u + l->cx;
    xy[1] = l->fy * v + l->cy;
    if (by_direction)
        for (int i = 0; i < 3; i++) {
            by_direction[i] = l->fx * plane[i];
            by_direction[3 + i] = l->fy * plane[3 + i];
        }
    if (by_lens) {
        memset(by_lens, 0, 2 * LUMI_LENS_NUMBERS * sizeof *by_lens);
        by_lens[LUMI_LENS_FX] = u;
        by_lens[LUMI_LENS_NUMBERS + LUMI_LENS_FY] = v;
        by_lens[LUMI_LENS_CX] = by_lens[LUMI_LENS_NUMBERS + LUMI_LENS_CY] = 1;
        for (int i = 0; i < 6; i++) {
            by_lens[LUMI_LENS_K1 + i] = l->fx * terms[i];
            by_lens[LUMI_LENS_NUMBERS + LUMI_LENS_K1 + i] = l->fy * terms[6 + i];
        }
    }
}

static bool brown_slope(const struct lumi_lens *l, struct lumi_vec3 d, double xy[2], double *by_direction,
                        double *by_lens)
{
    if (!(d.z > 1e-12 * (fabs(d.x) + fabs(d.y))))
        return false;
    double x = d.x / d.z, y = d.y / d.z, r2 = x * x + y * y;
    double radial = 1 + r2 * (l->k1 + r2 * (l->k2 + r2 * l->k3));
    double rise = l->k1 + r2 * (2 * l->k2 + r2 * 3 * l->k3); /* d radial / d r2 */
    if (!(radial + 2 * r2 * rise > 0))
        return false;
    double u = x * radial + 2 * l->p1 * x * y + l->p2 * (r2 + 2 * x * x);
    double v = y * radial + l->p1 * (r2 + 2 * y * y) + 2 * l->p2 * x * y;
    double ux = radial + 2 * x * x * rise + 2 * l->p1 * y + 6 * l->p2 * x;
    double uy = 2 * x * y * rise + 2 * l->p1 * x + 2 * l->p2 * y; /* and v by x */
    double vy = radial + 2 * y * y * rise + 6 * l->p1 * y + 2 * l->p2 * x;
    const double plane[6] = {ux / d.z, uy / d.z, -(ux * x + uy * y) / d.z,
                             uy / d.z, vy / d.z, -(uy * x + vy * y) / d.z};
    const double r4 = r2 * r2, r6 = r4 * r2;
    const double terms[12] = {x * r2, x * r4, x * r6, 0, 2 * x * y,      r2 + 2 * x * x,
                              y * r2, y * r4, y * r6, 0, r2 + 2 * y * y, 2 * x * y};
    to_pixels(l, u, v, plane, terms, xy, by_direction, by_lens);
    return true;
}

static bool fisheye_slope(const struct lumi_lens *l, struct lumi_vec3 d, double xy[2], double *by_direction,
                          double *by_lens)
{
    double r = hypot(d.x, d.y), n2 = r * r + d.z * d.z;

    if (!(n2 > 0) || (r == 0 && !(d.z > 0)))
        return false;
    double theta = atan2(r, d.z), t2 = theta * theta;
    double bend = 1 + t2 * (l->k1 + t2 * (l->k2 + t2 * (l->k3 + t2 * l->k4)));
    double slope = 1 + t2 * (3 * l->k1 + t2 * (5 * l->k2 + t2 * (7 * l->k3 + t2 * 9 * l->k4)));
    if (!(slope > 0))
        return false;
    /* On the axis the direction across it is any: cosine and sine of it times what vanishes. */
    double c = r > 0 ? d.x / r : 1, s = r > 0 ? d.y / r : 0, radius = theta * bend;
    double per = r > 1e-9 * d.z ? radius / r : slope / d.z; /* radius over r */
    double out = slope * d.z / n2, along = -slope * r / n2; /* d radius / d r, / d z */
    const double plane[6] = {out * c * c + per * s * s, (out - per) * c * s,       along * c,
                             (out - per) * c * s,       out * s * s + per * c * c, along * s};
    double t3 = theta * t2, t5 = t3 * t2, t7 = t5 * t2, t9 = t7 * t2;
    const double terms[12] = {c * t3, c * t5, c * t7, c * t9, 0, 0, s * t3, s * t5, s * t7, s * t9, 0, 0};
    to_pixels(l, radius * c, radius * s, plane, terms, xy, by_direction, by_lens);
    return true;
}

bool lumi_lens_project_slope(const struct lumi_lens *lens, struct lumi_vec3 direction, double xy[2],
                             double by_direction[6], double by_lens[2 * LUMI_LENS_NUMBERS])
{
    if (lens->model == LUMI_LENS_BROWN)
        return brown_slope(lens, direction, xy, by_direction, by_lens);
    if (lens->model == LUMI_LENS_FISHEYE)
        return fisheye_slope(lens, direction, xy, by_direction, by_lens);
    return false;
}
