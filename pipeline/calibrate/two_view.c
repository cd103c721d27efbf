/* The motion between two pictures. */
#include "pipeline/calibrate/two_view.h"

#include "pipeline/calibrate/rotation.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

enum { UNKNOWNS = 5, ROUNDS = 14, TRIES = 600 };

void lumi_motion_of(const struct lumi_pose *first, const struct lumi_pose *second, struct lumi_motion_between *motion,
                    double *baseline)
{
    const struct lumi_vec3 way = lumi_rotate_back(first->r, lumi_sub(second->t, first->t));

    lumi_rotation_between(first->r, second->r, motion->rotation);
    *baseline = lumi_length(way);
    motion->direction = *baseline > 0 ? lumi_scale(way, 1 / *baseline) : lumi_vec3(1, 0, 0);
}

/* The error before it is divided, and by what. */
static double plain_error(const struct lumi_motion_between *m, const struct lumi_sight *sight, struct lumi_vec3 *c,
                          double *length)
{
    *c = lumi_rotate(m->rotation, sight->b);
    const struct lumi_vec3 tc = lumi_cross(m->direction, *c), at = lumi_cross(sight->a, m->direction);

    *length = sqrt(lumi_dot(tc, tc) + lumi_dot(at, at) + 1e-12);
    return lumi_dot(sight->a, tc);
}

double lumi_motion_error(const struct lumi_motion_between *motion, const struct lumi_sight *sight)
{
    struct lumi_vec3 c;
    double length;
    const double error = plain_error(motion, sight, &c, &length);

    return error / length;
}

/* Symmetric positive definite a x = b in place (Cholesky). */
static bool solve(double a[UNKNOWNS][UNKNOWNS], double b[UNKNOWNS])
{
    for (int i = 0; i < UNKNOWNS; i++) {
        for (int k = 0; k <= i; k++) {
            double sum = a[i][k];
            for (int j = 0; j < k; j++)
                sum -= a[i][j] * a[k][j];
            if (i == k) {
                if (!(sum > 1e-14))
                    return false;
                a[i][i] = sqrt(sum);
            } else {
                a[i][k] = sum / a[k][k];
            }
        }
        for (int j = 0; j < i; j++)
            b[i] -= a[i][j] * b[j];
        b[i] /= a[i][i];
    }
    for (int i = UNKNOWNS - 1; i >= 0; i--) {
        for (int j = i + 1; j < UNKNOWNS; j++)
            b[i] -= a[j][i] * b[j];
        b[i] /= a[i][i];
    }
    return true;
}

static void across(struct lumi_vec3 t, struct lumi_vec3 *u, struct lumi_vec3 *v)
{
    const struct lumi_vec3 off = fabs(t.x) < 0.8 ? lumi_vec3(1, 0, 0) : lumi_vec3(0, 1, 0);

    *u = lumi_normalize(lumi_cross(t, off));
    *v = lumi_cross(t, *u);
}

static bool step(struct lumi_motion_between *m, const struct lumi_sight *sights, int count, double scale)
{
    double normal[UNKNOWNS][UNKNOWNS] = {{0}}, right[UNKNOWNS] = {0}, turn[9], turned[9];
    struct lumi_vec3 u, v;

    across(m->direction, &u, &v);
    for (int i = 0; i < count; i++) {
        const struct lumi_vec3 a = sights[i].a, t = m->direction;
        struct lumi_vec3 c;
        double length;
        const double error = plain_error(m, &sights[i], &c, &length) / length;
        const double weight = 1 / (1 + error * error / (scale * scale));
        /* d det(a, t, c) by a turn of c, and by t. */
        const struct lumi_vec3 by_turn = lumi_sub(lumi_scale(a, lumi_dot(t, c)), lumi_scale(t, lumi_dot(a, c)));
        const struct lumi_vec3 by_way = lumi_cross(c, a);
        const double slope[UNKNOWNS] = {by_turn.x / length, by_turn.y / length, by_turn.z / length,
                                        lumi_dot(by_way, u) / length, lumi_dot(by_way, v) / length};
        for (int j = 0; j < UNKNOWNS; j++) {
            right[j] -= weight * slope[j] * error;
            for (int k = 0; k <= j; k++)
                normal[j][k] += weight * slope[j] * slope[k];
        }
    }
    for (int j = 0; j < UNKNOWNS; j++) /* no long steps where little is known */
        normal[j][j] += 1e-6 * (1 + normal[j][j]) + (j < 3 ? 0 : 1e-3 * count * scale);
    if (!solve(normal, right))
        return false;
    lumi_rotation_exp(right, turn);
    lumi_rotation_multiply(turn, m->rotation, turned);
    memcpy(m->rotation, turned, sizeof turned);
    m->direction = lumi_normalize(lumi_add(m->direction, lumi_add(lumi_scale(u, right[3]), lumi_scale(v, right[4]))));
    return true;
}

bool lumi_motion_refine(struct lumi_motion_between *motion, const struct lumi_sight *sights, int count, double begin,
                        double end)
{
    if (count < UNKNOWNS)
        return false;
    for (int i = 0; i < ROUNDS; i++)
        if (!step(motion, sights, count, end * pow(begin / end, fmax(0, 1 - i / (ROUNDS - 4.0)))))
            return false;
    lumi_rotation_orthonormalize(motion->rotation);
    return true;
}

void lumi_motion_face(struct lumi_motion_between *motion, const struct lumi_sight *sights, int count, double most)
{
    double before = 0;

    /* A point moves away from where the second camera went: c = a − w t, w > 0. */
    for (int i = 0; i < count; i++) {
        const struct lumi_vec3 c = lumi_rotate(motion->rotation, sights[i].b), t = motion->direction;
        const struct lumi_vec3 side = lumi_sub(t, lumi_scale(sights[i].a, lumi_dot(t, sights[i].a)));
        const double moved = -lumi_dot(lumi_sub(c, sights[i].a), side);
        if (fabs(lumi_motion_error(motion, &sights[i])) < most)
            before += fmax(-0.1, fmin(0.1, moved));
    }
    if (before < 0)
        motion->direction = lumi_scale(motion->direction, -1);
}

/* The rotation that brings two directions b onto two directions a as well as can be. */
static bool rotation_of_two(const struct lumi_sight *p, const struct lumi_sight *q, double r[9])
{
    struct lumi_vec3 axes[2][3];

    for (int side = 0; side < 2; side++) {
        const struct lumi_vec3 x = side ? p->b : p->a, y = side ? q->b : q->a, n = lumi_cross(x, y);
        if (lumi_length(n) < 0.05)
            return false;
        axes[side][0] = lumi_normalize(lumi_add(x, y));
        axes[side][2] = lumi_normalize(n);
        axes[side][1] = lumi_cross(axes[side][2], axes[side][0]);
    }
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) {
            double sum = 0;
            for (int axis = 0; axis < 3; axis++) {
                const double a[3] = {axes[0][axis].x, axes[0][axis].y, axes[0][axis].z};
                const double b[3] = {axes[1][axis].x, axes[1][axis].y, axes[1][axis].z};
                sum += a[i] * b[k];
            }
            r[3 * i + k] = sum;
        }
    return true;
}

static double agreement(const double r[9], const struct lumi_sight *sights, int count, double parallax)
{
    const double near = 1 - parallax * parallax / 2;
    double sum = 0;

    for (int i = 0; i < count; i++) {
        const double c = lumi_dot(sights[i].a, lumi_rotate(r, sights[i].b));
        if (c > near)
            sum += (c - near) / (1 - near) + 1;
    }
    return sum;
}

static int fitting(const struct lumi_motion_between *m, const struct lumi_sight *sights, int count, double parallax,
                   double end)
{
    int fit = 0;

    for (int i = 0; i < count; i++)
        fit += fabs(lumi_motion_error(m, &sights[i])) < end &&
               lumi_dot(sights[i].a, lumi_rotate(m->rotation, sights[i].b)) > cos(2 * parallax);
    return fit;
}

/* Brings those that fit a rotation, up to the parallax, to the front; returns how many they are. */
static int gather(const double r[9], struct lumi_sight *sights, int count, double parallax)
{
    int front = 0;

    for (int i = 0; i < count; i++)
        if (lumi_dot(sights[i].a, lumi_rotate(r, sights[i].b)) > cos(1.5 * parallax)) {
            const struct lumi_sight moved = sights[front];
            sights[front++] = sights[i];
            sights[i] = moved;
        }
    return front;
}

int lumi_motion_find(struct lumi_sight *sights, int count, double parallax, double end,
                     struct lumi_motion_between *motion)
{
    static const struct lumi_vec3 ways[] = {{1, 0, 0}, {0, 1, 0}, {0.7, 0.7, 0}, {0.7, -0.7, 0}, {0, 0, 1}};
    double best[9], most = 0, r[9];
    uint64_t state = 1;
    int fit = 0;

    for (int i = 0; i < TRIES && count >= 2; i++) {
        state = state * 6364136223846793005u + 1442695040888963407u;
        const int p = (int)((state >> 33) % (uint64_t)count);
        state = state * 6364136223846793005u + 1442695040888963407u;
        const int q = (int)((state >> 33) % (uint64_t)count);
        if (!rotation_of_two(&sights[p], &sights[q], r))
            continue;
        const double sum = agreement(r, sights, count, parallax);
        if (sum > most) {
            most = sum;
            memcpy(best, r, sizeof best);
        }
    }
    if (most > 0)
        count = gather(best, sights, count, parallax);
    for (unsigned i = 0; most > 0 && i < sizeof ways / sizeof *ways; i++) {
        struct lumi_motion_between found = {.direction = lumi_normalize(ways[i])};
        memcpy(found.rotation, best, sizeof best);
        if (!lumi_motion_refine(&found, sights, count, parallax / 4, end / 2))
            continue;
        const int suits = fitting(&found, sights, count, parallax, end);
        if (suits > fit) {
            fit = suits;
            *motion = found;
        }
    }
    if (fit)
        lumi_motion_face(motion, sights, count, end);
    return fit;
}
