/* The rounds of a calibration. */
#include "pipeline/calibrate/solve.h"

#include "pipeline/calibrate/align.h"
#include "proto/base/memory.h"

#include <string.h>

/* Priors of the bundle: the mechanism's poses, or those given, and how sure they are. */
static void set_priors(struct lumi_bundle *b, const struct lumi_mechanism *m, double position, double rotation)
{
    for (int i = 0; i < b->camera_count; i++) {
        struct lumi_bundle_camera *camera = &b->cameras[i];
        if (m && m->frames[i].camera >= 0)
            lumi_mechanism_pose(m, i, &camera->prior);
        for (int k = 0; k < 3; k++)
            camera->prior_position[k] = position;
        camera->prior_rotation = rotation;
    }
}

/* Triangulates, takes out what does not agree, and says how well the rest does. */
static double sift(struct lumi_bundle *b, double sigmas, double least)
{
    lumi_bundle_residuals(b);
    double spread = lumi_bundle_spread(b);
    lumi_bundle_reject(b, fmax(sigmas * spread, least));
    return spread;
}

/* `wide`: the residuals to begin with, in sigmas. As long as poses are off by that, what is right and what is wrong is
 * not told apart by less. */
static int free_rounds(struct lumi_bundle *b, const struct lumi_solve_settings *s, bool lenses, double wide,
                       struct lumi_solve_result *result, struct lumi_error *error)
{
    const int rounds = 3;

    for (int round = 0; round < rounds; round++) {
        const struct lumi_bundle_settings settings = {.lenses = s->lenses && lenses,
                                                      .shutter = s->shutter && lenses,
                                                      .loss = round == 0   ? fmax(4, wide)
                                                              : round == 1 ? fmax(4, wide / 4)
                                                                           : 2,
                                                      .iterations = 12,
                                                      .tolerance = round + 1 < rounds ? 1e-3 : 1e-5};
        lumi_bundle_triangulate(b, 2);
        LUMI_TRY(lumi_bundle_solve(b, &settings, NULL, error));
        result->spread = sift(b, round == 0 ? 6 : 4, round == 0 ? 8 : round == 1 ? 2 : 1);
    }
    return LUMI_OK;
}

/* With places seen better, once more from where it is. */
static int refined_rounds(struct lumi_bundle *b, const struct lumi_solve_settings *s, struct lumi_solve_result *result,
                          struct lumi_error *error)
{
    if (!s->refine)
        return LUMI_OK;
    LUMI_TRY(s->refine(s->context, b, error));
    return free_rounds(b, s, true, 0, result, error);
}

/* Lays the bundle over where its cameras were believed to be. */
static int fix_gauge(struct lumi_bundle *b, const struct lumi_pose *believed, struct lumi_error *error)
{
    struct lumi_pose *from = lumi_calloc((size_t)b->camera_count + 1, sizeof *from);
    struct lumi_pose *to = lumi_calloc((size_t)b->camera_count + 1, sizeof *to);
    struct lumi_similarity similarity;
    int count = 0, code = LUMI_OK;

    if (!from || !to)
        code = lumi_fail(error, LUMI_ERR_NOMEM, "calibration: not enough memory");
    for (int i = 0; i < b->camera_count && code == LUMI_OK; i++)
        if (b->cameras[i].used) {
            from[count] = b->cameras[i].pose;
            to[count++] = believed[i];
        }
    if (code == LUMI_OK)
        code = lumi_align_robust(count, from, to, &similarity, error);
    for (int i = 0; i < b->camera_count && code == LUMI_OK; i++)
        lumi_similarity_apply(&similarity, &b->cameras[i].pose, &b->cameras[i].pose);
    lumi_free(from);
    lumi_free(to);
    return code;
}

static int rounds(struct lumi_bundle *b, struct lumi_mechanism *m, const struct lumi_solve_settings *s,
                  struct lumi_solve_result *result, struct lumi_error *error)
{
    double position = s->position_sigma, rotation = s->rotation_sigma;

    if (m) {
        /* A prior's error is many pixels: what is thrown away now is only what is far beside all else. */
        for (int round = 0; round < 2; round++) {
            lumi_bundle_triangulate(b, 2);
            LUMI_TRY(lumi_mechanism_solve(m, b, round == 0 ? 20 : 10, 10, error));
            /* With lenses that are wrong, what is far beside says nothing yet. */
            result->mechanism_spread = sift(b, s->lenses_first ? 30 : 8, 4);
        }
        position = fmax(m->rig.uncertainty.position_m, 1e-4);
        rotation = fmax(m->rig.uncertainty.rotation, 1e-4);
    }
    lumi_bundle_triangulate(b, 2);
    lumi_bundle_residuals(b);
    const double wide = lumi_bundle_spread(b);
    set_priors(b, m, position, rotation);
    LUMI_TRY(free_rounds(b, s, !m || s->lenses_first, wide, result, error));
    if (!m)
        return refined_rounds(b, s, result, error);
    LUMI_TRY(lumi_mechanism_fit(m, b, error));
    result->position_spread = m->position_spread;
    result->rotation_spread = m->rotation_spread;
    set_priors(b, m, fmax(m->position_spread, 1e-4), fmax(m->rotation_spread, 1e-4));
    LUMI_TRY(free_rounds(b, s, true, 0, result, error));
    LUMI_TRY(refined_rounds(b, s, result, error));
    LUMI_TRY(lumi_mechanism_fit(m, b, error));
    return LUMI_OK;
}

int lumi_solve(struct lumi_bundle *b, struct lumi_mechanism *m, const struct lumi_solve_settings *s,
               struct lumi_solve_result *result, struct lumi_error *error)
{
    struct lumi_pose *believed = lumi_calloc((size_t)b->camera_count + 1, sizeof *believed);
    int code = believed ? LUMI_OK : lumi_fail(error, LUMI_ERR_NOMEM, "calibration: not enough memory");

    *result = (struct lumi_solve_result){0};
    for (int i = 0; i < b->camera_count && code == LUMI_OK; i++)
        believed[i] = b->cameras[i].prior;
    if (code == LUMI_OK)
        code = rounds(b, m, s, result, error);
    if (code == LUMI_OK)
        code = fix_gauge(b, believed, error);
    for (int i = 0; i < b->observation_count && code == LUMI_OK; i++) {
        result->observations += lumi_bundle_counts(b, i);
        result->outliers += b->observations[i].outlier;
    }
    for (int i = 0; i < b->point_count && code == LUMI_OK; i++)
        result->points += b->points[i].used;
    lumi_free(believed);
    return code;
}
