/* Lenses. */
#include "proto/base/lens.h"

#include "proto/base/raster.h"

#include <math.h>

/* θ_d = θ(1 + k1 θ² + …) and its derivative. */
static double fisheye_radius(const struct lumi_lens *l, double theta, double *slope)
{
    double t2 = theta * theta;

    *slope = 1 + t2 * (3 * l->k1 + t2 * (5 * l->k2 + t2 * (7 * l->k3 + t2 * 9 * l->k4)));
    return theta * (1 + t2 * (l->k1 + t2 * (l->k2 + t2 * (l->k3 + t2 * l->k4))));
}

/* The largest angle up to which the radius rises. */
static double fisheye_limit(const struct lumi_lens *l)
{
    double slope;

    if (l->k1 >= 0 && l->k2 >= 0 && l->k3 >= 0 && l->k4 >= 0)
        return LUMI_PI;
    for (double theta = 0; theta < LUMI_PI; theta += LUMI_PI / 512) {
        fisheye_radius(l, theta, &slope);
        if (slope <= 0)
            return theta - LUMI_PI / 512;
    }
    return LUMI_PI;
}

static void brown_distort(const struct lumi_lens *l, double x, double y, double *u, double *v)
{
    double r2 = x * x + y * y;
    double radial = 1 + r2 * (l->k1 + r2 * (l->k2 + r2 * l->k3));

    *u = x * radial + 2 * l->p1 * x * y + l->p2 * (r2 + 2 * x * x);
    *v = y * radial + l->p1 * (r2 + 2 * y * y) + 2 * l->p2 * x * y;
}

static bool brown_plain(const struct lumi_lens *l)
{
    return l->k1 == 0 && l->k2 == 0 && l->k3 == 0 && l->p1 == 0 && l->p2 == 0;
}

/* True while the radial polynomial still rises at squared radius r2. */
static bool brown_rises(const struct lumi_lens *l, double r2)
{
    return 1 + r2 * (3 * l->k1 + r2 * (5 * l->k2 + r2 * 7 * l->k3)) > 0;
}

bool lumi_lens_project(const struct lumi_lens *lens, struct lumi_vec3 d, double *x, double *y)
{
    switch (lens->model) {
    case LUMI_LENS_BROWN: {
        if (!(d.z > 1e-12 * (fabs(d.x) + fabs(d.y))))
            return false;
        double u = d.x / d.z, v = d.y / d.z;
        if (!brown_plain(lens)) {
            if (!brown_rises(lens, u * u + v * v))
                return false;
            brown_distort(lens, u, v, &u, &v);
        }
        *x = lens->fx * u + lens->cx;
        *y = lens->fy * v + lens->cy;
        return true;
    }
    case LUMI_LENS_FISHEYE: {
        double r = hypot(d.x, d.y), slope;
        double theta = atan2(r, d.z);
        if (r == 0 && !(d.z > 0))
            return false;
        if (theta > fisheye_limit(lens))
            return false;
        double s = r > 0 ? fisheye_radius(lens, theta, &slope) / r : 0;
        *x = lens->fx * d.x * s + lens->cx;
        *y = lens->fy * d.y * s + lens->cy;
        return true;
    }
    case LUMI_LENS_EQUIRECTANGULAR: {
        double r = hypot(d.x, d.z);
        if (r == 0 && d.y == 0)
            return false;
        *x = lens->fx * atan2(d.x, d.z) + lens->cx;
        *y = lens->fy * atan2(d.y, r) + lens->cy;
        return true;
    }
    }
    return false;
}

static bool brown_unproject(const struct lumi_lens *l, double u, double v, struct lumi_vec3 *direction)
{
    double x = u, y = v;

    if (!brown_plain(l)) {
        /* Newton's method with a numerical Jacobian, damped so that it stays where the polynomial rises. */
        for (int i = 0; i < 50; i++) {
            double a, b, ax, bx, ay, by;
            const double h = 1e-6;
            brown_distort(l, x, y, &a, &b);
            double ru = u - a, rv = v - b;
            if (fabs(ru) + fabs(rv) < 1e-14)
                break;
            brown_distort(l, x + h, y, &ax, &bx);
            brown_distort(l, x, y + h, &ay, &by);
            double j00 = (ax - a) / h, j10 = (bx - b) / h, j01 = (ay - a) / h, j11 = (by - b) / h;
            double det = j00 * j11 - j01 * j10;
            if (!(fabs(det) > 1e-12))
                return false;
            double dx = (j11 * ru - j01 * rv) / det, dy = (j00 * rv - j10 * ru) / det;
            while (!brown_rises(l, (x + dx) * (x + dx) + (y + dy) * (y + dy)) && fabs(dx) + fabs(dy) > 1e-15)
                dx /= 2, dy /= 2;
            x += dx;
            y += dy;
        }
        double a, b;
        brown_distort(l, x, y, &a, &b);
        if (!(fabs(a - u) + fabs(b - v) < 1e-9))
            return false;
    }
    *direction = lumi_normalize(lumi_vec3(x, y, 1));
    return true;
}

static bool fisheye_unproject(const struct lumi_lens *l, double u, double v, struct lumi_vec3 *direction)
{
    double r = hypot(u, v), limit = fisheye_limit(l), slope;
    double low = 0, high = limit, theta = fmin(r, limit);

    if (r > fisheye_radius(l, limit, &slope) + 1e-12)
        return false;
    /* Newton's method inside a bracket, bisection where it leaves it. */
    for (int i = 0; i < 100; i++) {
        double e = fisheye_radius(l, theta, &slope) - r;
        if (e > 0)
            high = theta;
        else
            low = theta;
        if (fabs(e) < 1e-15)
            break;
        double next = theta - e / slope;
        theta = next > low && next < high ? next : (low + high) / 2;
    }
    double s = r > 0 ? sin(theta) / r : 1;
    *direction = lumi_vec3(u * s, v * s, cos(theta));
    return true;
}

bool lumi_lens_unproject(const struct lumi_lens *lens, double x, double y, struct lumi_vec3 *direction)
{
    double u = (x - lens->cx) / lens->fx, v = (y - lens->cy) / lens->fy;

    if (!isfinite(u) || !isfinite(v))
        return false;
    switch (lens->model) {
    case LUMI_LENS_BROWN:
        return brown_unproject(lens, u, v, direction);
    case LUMI_LENS_FISHEYE:
        return fisheye_unproject(lens, u, v, direction);
    case LUMI_LENS_EQUIRECTANGULAR:
        if (fabs(u) > LUMI_PI + 1e-9 || fabs(v) > LUMI_PI / 2 + 1e-9)
            return false;
        *direction = lumi_vec3(sin(u) * cos(v), sin(v), cos(u) * cos(v));
        return true;
    }
    return false;
}

bool lumi_lens_valid(const struct lumi_lens *l)
{
    const double all[] = {l->fx, l->fy, l->cx, l->cy, l->k1, l->k2, l->k3, l->k4, l->p1, l->p2};

    for (unsigned i = 0; i < sizeof all / sizeof *all; i++)
        if (!isfinite(all[i]))
            return false;
    return l->fx > 0 && l->fy > 0 && l->width >= 1 && l->height >= 1 && l->width <= LUMI_RASTER_MAX &&
           l->height <= LUMI_RASTER_MAX && l->model >= LUMI_LENS_BROWN && l->model <= LUMI_LENS_EQUIRECTANGULAR;
}

bool lumi_lens_equal(const struct lumi_lens *a, const struct lumi_lens *b)
{
    return a->model == b->model && a->width == b->width && a->height == b->height && a->fx == b->fx && a->fy == b->fy &&
           a->cx == b->cx && a->cy == b->cy && a->k1 == b->k1 && a->k2 == b->k2 && a->k3 == b->k3 && a->k4 == b->k4 &&
           a->p1 == b->p1 && a->p2 == b->p2;
}

void lumi_lens_init_pinhole(struct lumi_lens *lens, int width, int height, double fov_x)
{
    double f = width / 2.0 / tan(fov_x / 2);

    *lens = (struct lumi_lens){.model = LUMI_LENS_BROWN,
                               .width = width,
                               .height = height,
                               .fx = f,
                               .fy = f,
                               .cx = width / 2.0,
                               .cy = height / 2.0};
}
