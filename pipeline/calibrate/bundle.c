/* Bundle adjustment: the problem, and what is said of its solution. */
#include "pipeline/calibrate/bundle.h"

#include "pipeline/calibrate/ceres_shim.h"
#include "pipeline/calibrate/priors.h"
#include "pipeline/calibrate/reprojection.h"
#include "pipeline/calibrate/rotation.h"
#include "proto/base/memory.h"
#include "proto/base/sort.h"

#include <string.h>

int lumi_bundle_init(struct lumi_bundle *b, int lenses, int cameras, int points, int observations,
                     struct lumi_error *error)
{
    *b = (struct lumi_bundle){
        .lens_count = lenses, .camera_count = cameras, .point_count = points, .observation_count = observations};
    b->lenses = lumi_calloc((size_t)lenses + 1, sizeof *b->lenses);
    b->cameras = lumi_calloc((size_t)cameras + 1, sizeof *b->cameras);
    b->points = lumi_calloc((size_t)points + 1, sizeof *b->points);
    b->observations = lumi_calloc((size_t)observations + 1, sizeof *b->observations);
    b->first = lumi_calloc((size_t)points + 1, sizeof *b->first);
    if (b->lenses && b->cameras && b->points && b->observations && b->first)
        return LUMI_OK;
    lumi_bundle_finish(b);
    return lumi_fail(error, LUMI_ERR_NOMEM, "calibration: not enough memory for %d observations", observations);
}

void lumi_bundle_finish(struct lumi_bundle *b)
{
    lumi_free(b->lenses);
    lumi_free(b->cameras);
    lumi_free(b->points);
    lumi_free(b->observations);
    lumi_free(b->first);
    *b = (struct lumi_bundle){0};
}

bool lumi_bundle_counts(const struct lumi_bundle *b, int observation)
{
    const struct lumi_bundle_observation *o = &b->observations[observation];

    return !o->outlier && b->cameras[o->camera].used && b->points[o->point].used;
}

struct lumi_vec3 lumi_bundle_ray(const struct lumi_bundle_point *p)
{
    return lumi_add(p->direction, lumi_add(lumi_scale(p->e1, p->block[0]), lumi_scale(p->e2, p->block[1])));
}

struct problem {
    struct shim_problem *shim;
    struct lumi_measured *measured;
    bool *camera_in, *lens_in;
    struct lumi_near_zero lens_prior, shutter_prior;
    double shutter_sigma;
};

static bool add_observation(const struct lumi_bundle *b, struct problem *p, int i, const struct lumi_bundle_settings *s)
{
    static const int sizes[4] = {6, LUMI_LENS_NUMBERS, 3, 1};
    struct lumi_bundle_observation *o = &b->observations[i];
    struct lumi_bundle_camera *camera = &b->cameras[o->camera];
    double *blocks[4] = {camera->block, b->lenses[camera->lens].block, b->points[o->point].block,
                         (double *)&b->shutter};

    p->measured[i] = (struct lumi_measured){b, i};
    p->camera_in[o->camera] = p->lens_in[camera->lens] = true;
    return shim_add_residual(p->shim, lumi_reprojection_residual, &p->measured[i], 2, blocks, sizes, 4,
                             s->loss > 0 ? SHIM_LOSS_CAUCHY : SHIM_LOSS_NONE, s->loss);
}

static bool add_priors(struct lumi_bundle *b, struct problem *p, const struct lumi_bundle_settings *s)
{
    const int six = 6, numbers = LUMI_LENS_NUMBERS, one = 1;
    bool ok = true, any = false;

    for (int i = 0; i < b->camera_count && ok; i++) {
        struct lumi_bundle_camera *camera = &b->cameras[i];
        double *block = camera->block;
        if (p->camera_in[i])
            any = true;
        if (p->camera_in[i] && camera->prior_rotation > 0)
            ok = shim_add_residual(p->shim, lumi_pose_prior_residual, camera, 6, &block, &six, 1, SHIM_LOSS_NONE, 1);
    }
    p->lens_prior = (struct lumi_near_zero){LUMI_LENS_NUMBERS, NULL};
    for (int i = 0; i < b->lens_count && ok; i++) {
        double *block = b->lenses[i].block;
        if (!p->lens_in[i])
            continue;
        if (s->lenses)
            ok = shim_add_residual(p->shim, lumi_near_zero_residual, &p->lens_prior, LUMI_LENS_NUMBERS, &block,
                                   &numbers, 1, SHIM_LOSS_NONE, 1);
        else
            shim_set_constant(p->shim, block, true);
    }
    double *shutter = &b->shutter;
    p->shutter_sigma = b->shutter_sigma;
    p->shutter_prior = (struct lumi_near_zero){1, &p->shutter_sigma};
    if (ok && any && s->shutter && b->shutter_sigma > 0)
        ok = shim_add_residual(p->shim, lumi_near_zero_residual, &p->shutter_prior, 1, &shutter, &one, 1,
                               SHIM_LOSS_NONE, 1);
    else if (ok && any)
        shim_set_constant(p->shim, shutter, true);
    return ok;
}

/* Blocks hold the poses while Ceres works, and the numbers of the lenses. */
static void take_blocks(struct lumi_bundle *b, const struct problem *p)
{
    for (int i = 0; i < b->camera_count; i++) {
        struct lumi_bundle_camera *camera = &b->cameras[i];
        double turn[9], turned[9];
        if (!p->camera_in[i])
            continue;
        lumi_rotation_exp(camera->block, turn);
        lumi_rotation_multiply(camera->pose.r, turn, turned);
        memcpy(camera->pose.r, turned, sizeof turned);
        lumi_rotation_orthonormalize(camera->pose.r);
        camera->pose.t = lumi_vec3(camera->block[3], camera->block[4], camera->block[5]);
        memset(camera->block, 0, 3 * sizeof(double));
    }
}

static void put_blocks(struct lumi_bundle *b)
{
    for (int i = 0; i < b->camera_count; i++) {
        struct lumi_bundle_camera *camera = &b->cameras[i];
        const double block[6] = {0, 0, 0, camera->pose.t.x, camera->pose.t.y, camera->pose.t.z};
        memcpy(camera->block, block, sizeof block);
    }
}

static int seen_by(const struct lumi_bundle *b, int point)
{
    int count = 0;

    for (int i = b->first[point]; i < b->first[point + 1]; i++)
        count += lumi_bundle_counts(b, i);
    return count;
}

int lumi_bundle_solve(struct lumi_bundle *b, const struct lumi_bundle_settings *s, struct lumi_bundle_result *result,
                      struct lumi_error *error)
{
    struct problem p = {.shim = shim_problem_create()};
    struct shim_summary summary = {0};
    struct shim_options options = {.solver = b->camera_count > 40 ? SHIM_ITERATIVE_SCHUR : SHIM_DENSE_SCHUR,
                                   .iterations = s->iterations,
                                   .function_tolerance = s->tolerance};
    bool ok = p.shim != NULL;

    p.measured = lumi_calloc((size_t)b->observation_count + 1, sizeof *p.measured);
    p.camera_in = lumi_calloc((size_t)b->camera_count + 1, sizeof *p.camera_in);
    p.lens_in = lumi_calloc((size_t)b->lens_count + 1, sizeof *p.lens_in);
    ok = ok && p.measured && p.camera_in && p.lens_in;
    put_blocks(b);
    for (int point = 0; point < b->point_count && ok; point++) {
        if (seen_by(b, point) < 2)
            b->points[point].used = false; /* says nothing */
        for (int i = b->first[point]; i < b->first[point + 1] && ok; i++)
            if (lumi_bundle_counts(b, i))
                ok = add_observation(b, &p, i, s);
        if (ok && b->points[point].used)
            shim_eliminate_first(p.shim, b->points[point].block);
    }
    ok = ok && add_priors(b, &p, s);
    if (ok)
        shim_solve(p.shim, &options, &summary);
    if (ok && summary.usable)
        take_blocks(b, &p);
    shim_problem_destroy(p.shim);
    lumi_free(p.measured);
    lumi_free(p.camera_in);
    lumi_free(p.lens_in);
    if (!ok)
        return lumi_fail(error, LUMI_ERR_NOMEM, "calibration: not enough memory");
    if (!summary.usable)
        return lumi_fail(error, LUMI_ERR_INTERNAL, "calibration: the solver gave up: %s", summary.text);
    if (result)
        *result = (struct lumi_bundle_result){summary.iterations, summary.initial_cost, summary.final_cost,
                                              summary.converged};
    return LUMI_OK;
}

void lumi_bundle_residuals(struct lumi_bundle *b)
{
    for (int i = 0; i < b->observation_count; i++) {
        struct lumi_bundle_observation *o = &b->observations[i];
        const struct lumi_bundle_camera *camera = &b->cameras[o->camera];
        double r[2];

        o->residual[0] = o->residual[1] = NAN;
        if (b->points[o->point].used && lumi_reproject(b, o, &camera->pose, b->lenses[camera->lens].block,
                                                       b->points[o->point].block, b->shutter, r, NULL)) {
            o->residual[0] = r[0] * o->sigma;
            o->residual[1] = r[1] * o->sigma;
        }
    }
}

int lumi_bundle_reject(struct lumi_bundle *b, double sigmas)
{
    int count = 0;

    for (int i = 0; i < b->observation_count; i++) {
        struct lumi_bundle_observation *o = &b->observations[i];
        if (!b->cameras[o->camera].used)
            continue;
        if (b->points[o->point].used)
            o->outlier = !(hypot(o->residual[0], o->residual[1]) <= sigmas * o->sigma);
        count += o->outlier;
    }
    return count;
}

double lumi_bundle_spread(const struct lumi_bundle *b)
{
    double *lengths = lumi_alloc((size_t)b->observation_count + 1, sizeof *lengths), spread = NAN;
    int count = 0;

    if (!lengths)
        return NAN;
    for (int i = 0; i < b->observation_count; i++) {
        const struct lumi_bundle_observation *o = &b->observations[i];
        double length = hypot(o->residual[0], o->residual[1]) / o->sigma;
        if (lumi_bundle_counts(b, i) && length >= 0)
            lengths[count++] = length;
    }
    if (count > 0)
        spread = lumi_sort_median(lengths, count) / 1.17741; /* the median of a Rayleigh distribution of spread 1 */
    lumi_free(lengths);
    return spread;
}
