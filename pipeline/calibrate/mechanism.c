/* The rig as it is: problems of its numbers. */
#include "pipeline/calibrate/mechanism.h"

#include "pipeline/calibrate/ceres_shim.h"
#include "pipeline/calibrate/mechanism_pose.h"
#include "pipeline/calibrate/mechanism_residual.h"
#include "pipeline/calibrate/priors.h"
#include "pipeline/calibrate/rotation.h"
#include "proto/base/memory.h"
#include "proto/base/sort.h"

#include <string.h>

const char *const lumi_mount_names[LUMI_MOUNT_NUMBERS] = {"angle", "azimuth", "radius", "offset",
                                                          "pan",   "tilt",    "roll"};
const char *const lumi_platform_names[LUMI_PLATFORM_NUMBERS] = {"pivot-x", "pivot-y", "lean-x", "lean-y"};

#define KNOTS_A_TURN 4

int lumi_mechanism_init(struct lumi_mechanism *m, const struct lumi_rig *rig, int frames, int shots,
                        struct lumi_error *error)
{
    *m = (struct lumi_mechanism){.rig = *rig, .frame_count = frames, .shot_count = shots};
    m->knot_step = 1.0 / KNOTS_A_TURN;
    m->knot_count = rig->turns * KNOTS_A_TURN + 1;
    m->frames = lumi_calloc((size_t)frames + 1, sizeof *m->frames);
    m->turn = lumi_calloc((size_t)shots + 1, sizeof *m->turn);
    m->drop = lumi_calloc((size_t)m->knot_count, sizeof *m->drop);
    if (m->frames && m->turn && m->drop)
        return LUMI_OK;
    lumi_mechanism_finish(m);
    return lumi_fail(error, LUMI_ERR_NOMEM, "calibration: not enough memory for %d frames", frames);
}

void lumi_mechanism_finish(struct lumi_mechanism *m)
{
    lumi_free(m->frames);
    lumi_free(m->turn);
    lumi_free(m->drop);
    *m = (struct lumi_mechanism){0};
}

void lumi_mechanism_reset(struct lumi_mechanism *m)
{
    memset(m->mount, 0, sizeof m->mount);
    memset(m->platform, 0, sizeof m->platform);
    memset(m->turn, 0, (size_t)m->shot_count * sizeof *m->turn);
    memset(m->drop, 0, (size_t)m->knot_count * sizeof *m->drop);
}

/* A problem of the mechanism's numbers, with or without points. */
struct problem {
    struct shim_problem *shim;
    double mount_sigma[LUMI_MOUNT_NUMBERS], platform_sigma[LUMI_PLATFORM_NUMBERS], turn_sigma, drop_sigma;
    struct lumi_near_zero mount, platform, turn, drop;
};

/* What the profile says of itself; nothing is known better than a hair. */
static void fill_sigmas(const struct lumi_mechanism *m, double weight, struct problem *p)
{
    const struct lumi_rig_uncertainty *u = &m->rig.uncertainty;
    double place = fmax(u->position_m, 1e-4) / weight, turn = fmax(u->rotation, 1e-4) / weight;
    const double mount[LUMI_MOUNT_NUMBERS] = {turn, turn, place, place, turn, turn, turn};
    const double platform[LUMI_PLATFORM_NUMBERS] = {place, place, turn, turn};

    memcpy(p->mount_sigma, mount, sizeof mount);
    memcpy(p->platform_sigma, platform, sizeof platform);
    p->turn_sigma = fmax(u->turn, 1e-4) / weight;
    p->drop_sigma = fmax(u->drop, 1e-4) / weight;
    p->mount = (struct lumi_near_zero){LUMI_MOUNT_NUMBERS, p->mount_sigma};
    p->platform = (struct lumi_near_zero){LUMI_PLATFORM_NUMBERS, p->platform_sigma};
    p->turn = (struct lumi_near_zero){1, &p->turn_sigma};
    p->drop = (struct lumi_near_zero){1, &p->drop_sigma};
}

static bool add_prior(struct problem *p, const struct lumi_near_zero *near, double *block)
{
    return shim_add_residual(p->shim, lumi_near_zero_residual, near, near->count, &block, &near->count, 1,
                             SHIM_LOSS_NONE, 1);
}

/* All blocks are in the problem, those that nothing speaks of too: their priors hold them. */
static bool begin(struct lumi_mechanism *m, double weight, struct problem *p)
{
    bool ok;

    fill_sigmas(m, weight, p);
    p->shim = shim_problem_create();
    ok = p->shim && add_prior(p, &p->platform, m->platform);
    for (int i = 0; i < m->rig.camera_count && ok; i++)
        ok = add_prior(p, &p->mount, m->mount[i]);
    for (int i = 0; i < m->shot_count && ok; i++)
        ok = add_prior(p, &p->turn, &m->turn[i]);
    for (int i = 0; i < m->knot_count && ok; i++) {
        ok = add_prior(p, &p->drop, &m->drop[i]);
        if (ok && m->rig.string.held)
            shim_set_constant(p->shim, &m->drop[i], true);
    }
    return ok;
}

static int solved(struct problem *p, bool ok, const struct shim_options *options, struct lumi_error *error)
{
    struct shim_summary summary = {0};

    if (!ok)
        return lumi_fail(error, LUMI_ERR_NOMEM, "calibration: not enough memory");
    shim_solve(p->shim, options, &summary);
    if (!summary.usable)
        return lumi_fail(error, LUMI_ERR_INTERNAL, "calibration: the mechanism's solver gave up: %s", summary.text);
    return LUMI_OK;
}

static bool add_seen(struct lumi_mechanism *m, struct lumi_bundle *b, struct problem *p,
                     struct mechanism_measured *measured, struct mechanism_memo *memos, double loss)
{
    int sizes[MECHANISM_BLOCKS + 1];
    bool ok = true;

    memcpy(sizes, mechanism_sizes, sizeof mechanism_sizes);
    sizes[MECHANISM_BLOCKS] = 3;
    for (int point = 0; point < b->point_count && ok; point++) {
        int count = 0;
        for (int i = b->first[point]; i < b->first[point + 1]; i++)
            count += lumi_bundle_counts(b, i) && m->frames[b->observations[i].camera].camera >= 0;
        for (int i = b->first[point]; i < b->first[point + 1] && count > 1 && ok; i++) {
            double *blocks[MECHANISM_BLOCKS + 1];
            int frame = b->observations[i].camera;
            if (!lumi_bundle_counts(b, i) || m->frames[frame].camera < 0)
                continue;
            mechanism_blocks(m, frame, blocks);
            blocks[MECHANISM_BLOCKS] = b->points[point].block;
            measured[i] = (struct mechanism_measured){m, b, i, &memos[frame]};
            ok = shim_add_residual(p->shim, mechanism_seen_residual, &measured[i], 2, blocks, sizes,
                                   MECHANISM_BLOCKS + 1, loss > 0 ? SHIM_LOSS_CAUCHY : SHIM_LOSS_NONE, loss);
        }
        if (ok && count > 1)
            shim_eliminate_first(p->shim, b->points[point].block);
    }
    return ok;
}

/* What single cameras are off by is not noise: it is the same for all that one of them sees. So all of a camera's
 * observations together say as much as one that is off by the residuals' spread, and the priors are weighed against
 * that; otherwise what a camera says of its place that sees the sky alone would outweigh them. */
static double prior_weight(struct lumi_bundle *b)
{
    int used = 0, seen = 0;

    for (int i = 0; i < b->camera_count; i++)
        used += b->cameras[i].used;
    for (int i = 0; i < b->observation_count; i++)
        seen += lumi_bundle_counts(b, i);
    lumi_bundle_residuals(b);
    double spread = lumi_bundle_spread(b);
    return fmax(1, isfinite(spread) ? spread : 1) * sqrt(fmax(1, used ? (double)seen / used : 1));
}

int lumi_mechanism_solve(struct lumi_mechanism *m, struct lumi_bundle *b, double loss, int iterations,
                         struct lumi_error *error)
{
    struct mechanism_measured *measured = lumi_calloc((size_t)b->observation_count + 1, sizeof *measured);
    struct mechanism_memo *memos = lumi_calloc((size_t)b->camera_count + 1, sizeof *memos);
    struct shim_options options = {.solver = SHIM_SPARSE_SCHUR, .iterations = iterations, .function_tolerance = 1e-5};
    struct problem p = {0};
    bool ok = measured && memos && begin(m, prior_weight(b), &p) && add_seen(m, b, &p, measured, memos, loss);
    int code = solved(&p, ok, &options, error);

    shim_problem_destroy(p.shim);
    lumi_free(measured);
    lumi_free(memos);
    for (int i = 0; i < m->frame_count && code == LUMI_OK; i++)
        if (m->frames[i].camera >= 0)
            lumi_mechanism_pose(m, i, &b->cameras[i].pose);
    return code;
}

/* Robust standard deviation of numbers about 0; reorders them. */
static double spread_of(double *values, int count)
{
    for (int i = 0; i < count; i++)
        values[i] = fabs(values[i]);
    return count ? 1.4826 * lumi_sort_median(values, count) : NAN;
}

/* How far the bundle's cameras are beside the mechanism's. */
static bool measure_spread(struct lumi_mechanism *m, const struct lumi_bundle *b)
{
    double *along = lumi_calloc(3 * (size_t)m->frame_count + 1, sizeof *along);
    double *about = lumi_calloc(3 * (size_t)m->frame_count + 1, sizeof *about);
    int count = 0;

    for (int i = 0; along && about && i < m->frame_count; i++) {
        struct lumi_pose pose;
        double between[9];
        if (m->frames[i].camera < 0 || !b->cameras[i].used)
            continue;
        lumi_mechanism_pose(m, i, &pose);
        struct lumi_vec3 moved = lumi_rotate_back(pose.r, lumi_sub(b->cameras[i].pose.t, pose.t));
        memcpy(along + count, &moved, sizeof moved);
        lumi_rotation_between(pose.r, b->cameras[i].pose.r, between);
        lumi_rotation_log(between, about + count);
        count += 3;
    }
    bool ok = along && about;
    if (ok && count > 0) {
        m->position_spread = fmax(spread_of(along, count), 1e-5);
        m->rotation_spread = fmax(spread_of(about, count), 1e-5);
    }
    lumi_free(along);
    lumi_free(about);
    return ok;
}

static bool add_found(struct lumi_mechanism *m, const struct lumi_bundle *b, struct problem *p,
                      struct mechanism_found *found)
{
    bool ok = true;

    for (int i = 0; i < m->frame_count && ok; i++) {
        double *blocks[MECHANISM_BLOCKS];
        if (m->frames[i].camera < 0 || !b->cameras[i].used)
            continue;
        mechanism_blocks(m, i, blocks);
        found[i] = (struct mechanism_found){m, &b->cameras[i].pose, i, m->position_spread, m->rotation_spread};
        ok = shim_add_residual(p->shim, mechanism_found_residual, &found[i], 6, blocks, mechanism_sizes,
                               MECHANISM_BLOCKS, SHIM_LOSS_CAUCHY, 4);
    }
    return ok;
}

/* Standard deviations of mounts and platform; where Ceres cannot tell, the profile's. */
static void fill_found_sigmas(struct lumi_mechanism *m, const struct problem *p)
{
    double *blocks[LUMI_RIG_CAMERAS + 1], *results[LUMI_RIG_CAMERAS + 1] = {0};
    static const int side = LUMI_MOUNT_NUMBERS;
    double matrices[LUMI_RIG_CAMERAS + 1][LUMI_MOUNT_NUMBERS * LUMI_MOUNT_NUMBERS];
    int cameras = m->rig.camera_count;

    for (int i = 0; i < cameras; i++)
        blocks[i] = m->mount[i];
    blocks[cameras] = m->platform;
    for (int i = 0; i <= cameras; i++)
        results[i] = matrices[i];
    bool ok = shim_covariance(p->shim, blocks, cameras + 1, results);
    for (int i = 0; i < cameras; i++)
        for (int k = 0; k < side; k++)
            m->mount_sigma[i][k] = ok ? sqrt(fmax(matrices[i][k * side + k], 0)) : p->mount_sigma[k];
    for (int k = 0; k < LUMI_PLATFORM_NUMBERS; k++)
        m->platform_sigma[k] =
            ok ? sqrt(fmax(matrices[cameras][k * LUMI_PLATFORM_NUMBERS + k], 0)) : p->platform_sigma[k];
}

int lumi_mechanism_fit(struct lumi_mechanism *m, const struct lumi_bundle *b, struct lumi_error *error)
{
    struct mechanism_found *found = lumi_calloc((size_t)m->frame_count + 1, sizeof *found);
    struct shim_options options = {.solver = SHIM_SPARSE_CHOLESKY, .iterations = 30};
    int code = found ? LUMI_OK : lumi_fail(error, LUMI_ERR_NOMEM, "calibration: not enough memory");

    m->position_spread = fmax(m->rig.uncertainty.position_m, 1e-4);
    m->rotation_spread = fmax(m->rig.uncertainty.rotation, 1e-4);
    for (int round = 0; round < 2 && code == LUMI_OK; round++) {
        struct problem p = {0};
        bool ok = begin(m, 1, &p) && add_found(m, b, &p, found);
        code = solved(&p, ok, &options, error);
        if (code == LUMI_OK && round == 1)
            fill_found_sigmas(m, &p);
        shim_problem_destroy(p.shim);
        if (code == LUMI_OK && !measure_spread(m, b))
            code = lumi_fail(error, LUMI_ERR_NOMEM, "calibration: not enough memory");
    }
    lumi_free(found);
    return code;
}
