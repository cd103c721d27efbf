/* Two sets of poses of the same cameras laid over one another. */
#include "pipeline/calibrate/align.h"

#include "pipeline/calibrate/rotation.h"
#include "proto/base/memory.h"
#include "proto/base/sort.h"

#include <stdbool.h>
#include <string.h>

/* How far from its centre the ends of a camera's axes stand, in the cameras' mean distance from their middle: a
 * camera half a millimetre beside its place counts about as much as one turned by a fiftieth of a degree, where they
 * stand on a sphere of 70 cm. */
#define LEVER 2.0

static double median_of(double *values, int count)
{
    lumi_sort_doubles(values, count);
    return count % 2 ? values[count / 2] : (values[count / 2 - 1] + values[count / 2]) / 2;
}

/* The eigenvector of the largest eigenvalue of a symmetric 4 × 4 matrix, by Jacobi's rotations; `second`: the next
 * eigenvalue. */
static double largest(double a[4][4], double vector[4], double *second)
{
    double v[4][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}};
    int best = 0;

    for (int sweep = 0; sweep < 50; sweep++)
        for (int p = 0; p < 3; p++)
            for (int q = p + 1; q < 4; q++) {
                if (a[p][q] == 0)
                    continue;
                double theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
                double t = (theta >= 0 ? 1 : -1) / (fabs(theta) + sqrt(theta * theta + 1));
                double c = 1 / sqrt(t * t + 1), s = t * c;
                for (int k = 0; k < 4; k++) {
                    double x = a[k][p], y = a[k][q];
                    a[k][p] = c * x - s * y;
                    a[k][q] = s * x + c * y;
                }
                for (int k = 0; k < 4; k++) {
                    double x = a[p][k], y = a[q][k];
                    a[p][k] = c * x - s * y;
                    a[q][k] = s * x + c * y;
                    x = v[k][p], y = v[k][q];
                    v[k][p] = c * x - s * y;
                    v[k][q] = s * x + c * y;
                }
            }
    for (int i = 1; i < 4; i++)
        if (a[i][i] > a[best][best])
            best = i;
    *second = -INFINITY;
    for (int i = 0; i < 4; i++) {
        vector[i] = v[i][best];
        if (i != best)
            *second = fmax(*second, a[i][i]);
    }
    return a[best][best];
}

static struct lumi_vec3 mean_of(int count, const struct lumi_pose *poses, const bool *left_out)
{
    struct lumi_vec3 sum = {0};
    int taken = 0;

    for (int i = 0; i < count; i++)
        if (!left_out || !left_out[i]) {
            sum = lumi_add(sum, poses[i].t);
            taken++;
        }
    return lumi_scale(sum, 1.0 / (taken ? taken : 1));
}

/* Horn's quaternion for the sums m of products (Closed-form solution of absolute orientation using unit quaternions,
 * 1987), which is Umeyama's rotation without a decomposition of a 3 × 3 matrix. Returns the first eigenvalue. */
static double turn_of(const double m[9], double q[4], double *second)
{
    double n[4][4] = {{m[0] + m[4] + m[8], m[5] - m[7], m[6] - m[2], m[1] - m[3]},
                      {m[5] - m[7], m[0] - m[4] - m[8], m[1] + m[3], m[6] + m[2]},
                      {m[6] - m[2], m[1] + m[3], m[4] - m[0] - m[8], m[5] + m[7]},
                      {m[1] - m[3], m[6] + m[2], m[5] + m[7], m[8] - m[0] - m[4]}};

    return largest(n, q, second);
}

static void add_products(struct lumi_vec3 a, struct lumi_vec3 b, double weight, double m[9])
{
    const double x[3] = {a.x, a.y, a.z}, y[3] = {b.x, b.y, b.z};

    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++)
            m[3 * r + c] += weight * x[r] * y[c];
}

/* Of m's products how much a rotation keeps: the sum of y · (rotation x). */
static double kept_by(const double rotation[9], const double m[9])
{
    double sum = 0;

    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++)
            sum += rotation[3 * c + r] * m[3 * r + c];
    return sum;
}

/* Centres alone say little of a rotation, where the cameras stand close together: their axes count as points, too. */
static int align(int count, const struct lumi_pose *from, const struct lumi_pose *to, const bool *left_out,
                 struct lumi_similarity *s, struct lumi_error *error)
{
    struct lumi_vec3 mean_from = mean_of(count, from, left_out), mean_to = mean_of(count, to, left_out);
    double m[9] = {0}, both[9], spread_from = 0, spread_to = 0, q[4], second;
    int taken = 0;

    for (int i = 0; i < count; i++) {
        if (left_out && left_out[i])
            continue;
        struct lumi_vec3 a = lumi_sub(from[i].t, mean_from), b = lumi_sub(to[i].t, mean_to);
        add_products(a, b, 1, m);
        spread_from += lumi_dot(a, a);
        spread_to += lumi_dot(b, b);
        taken++;
    }
    double first = turn_of(m, q, &second), size = sqrt(spread_from * spread_to);
    if (taken < 3 || !(size > 0) || !(first - second > 1e-9 * size))
        return lumi_fail(error, LUMI_ERR_FORMAT,
                         "poses: %d cameras in common, which do not determine how to lay the sets over one another",
                         taken);
    memcpy(both, m, sizeof both);
    for (int i = 0; i < count; i++)
        for (int k = 0; k < 3 && !(left_out && left_out[i]); k++)
            add_products(lumi_axis(&from[i], k), lumi_axis(&to[i], k), LEVER * LEVER * size / taken, both);
    turn_of(both, q, &second);
    lumi_rotation_from_quaternion(q, s->rotation);
    s->scale = kept_by(s->rotation, m) / spread_from;
    if (!(s->scale > 0))
        return lumi_fail(error, LUMI_ERR_FORMAT, "poses: the two sets have nothing to do with one another");
    s->shift = lumi_sub(mean_to, lumi_scale(lumi_rotate(s->rotation, mean_from), s->scale));
    return LUMI_OK;
}

void lumi_similarity_apply(const struct lumi_similarity *s, const struct lumi_pose *pose, struct lumi_pose *result)
{
    struct lumi_pose moved;

    lumi_rotation_multiply(s->rotation, pose->r, moved.r);
    moved.t = lumi_add(lumi_scale(lumi_rotate(s->rotation, pose->t), s->scale), s->shift);
    *result = moved;
}

static double apart(const struct lumi_similarity *s, const struct lumi_pose *from, const struct lumi_pose *to)
{
    struct lumi_pose moved;

    lumi_similarity_apply(s, from, &moved);
    return lumi_length(lumi_sub(moved.t, to->t));
}

int lumi_align(int count, const struct lumi_pose *from, const struct lumi_pose *to, struct lumi_similarity *similarity,
               struct lumi_error *error)
{
    return align(count, from, to, NULL, similarity, error);
}

int lumi_align_robust(int count, const struct lumi_pose *from, const struct lumi_pose *to,
                      struct lumi_similarity *similarity, struct lumi_error *error)
{
    bool *left_out = lumi_calloc((size_t)count + 1, sizeof *left_out);
    double *distance = lumi_alloc((size_t)count + 1, sizeof *distance);
    int code = left_out && distance ? LUMI_OK : lumi_fail(error, LUMI_ERR_NOMEM, "poses: not enough memory");

    for (int round = 0; round < 5 && code == LUMI_OK; round++) {
        code = align(count, from, to, left_out, similarity, error);
        for (int i = 0; i < count && code == LUMI_OK; i++)
            distance[i] = apart(similarity, &from[i], &to[i]);
        if (code != LUMI_OK)
            break;
        double limit =
            fmax(5 * 0.6501 * median_of(distance, count), 1e-12); /* the median length of three of spread 1 is 1.538 */
        for (int i = 0; i < count; i++)
            left_out[i] = apart(similarity, &from[i], &to[i]) > limit;
    }
    lumi_free(left_out);
    lumi_free(distance);
    return code;
}

int lumi_pose_compare(int count, const struct lumi_pose *from, const struct lumi_pose *to,
                      const struct lumi_similarity *similarity, struct lumi_pose_distance *d, struct lumi_error *error)
{
    double *place = lumi_alloc((size_t)count + 1, sizeof *place), *turn = lumi_alloc((size_t)count + 1, sizeof *turn);

    *d = (struct lumi_pose_distance){.count = count};
    for (int i = 0; i < count && place && turn; i++) {
        struct lumi_pose moved;
        lumi_similarity_apply(similarity, &from[i], &moved);
        place[i] = lumi_length(lumi_sub(moved.t, to[i].t));
        turn[i] = lumi_rotation_angle(moved.r, to[i].r);
        d->rms_m += place[i] * place[i] / count;
        d->rms_rotation += turn[i] * turn[i] / count;
        if (place[i] > d->worst_m) {
            d->worst_m = place[i];
            d->worst = i;
        }
        if (turn[i] > d->worst_rotation) {
            d->worst_rotation = turn[i];
            d->worst_turned = i;
        }
    }
    d->rms_m = sqrt(d->rms_m);
    d->rms_rotation = sqrt(d->rms_rotation);
    bool ok = place && turn;
    if (ok && count > 0) {
        d->median_m = median_of(place, count);
        d->median_rotation = median_of(turn, count);
    }
    lumi_free(place);
    lumi_free(turn);
    return ok ? LUMI_OK : lumi_fail(error, LUMI_ERR_NOMEM, "poses: not enough memory");
}
