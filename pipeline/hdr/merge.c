/* Merging a bracket.
 *
 * Each shot k says of a pixel's light H that it is v_k / e_k, with variance σ²(v_k) / e_k². Weighted by the inverse, as
 * in Granados et al., "Optimal HDR reconstruction with linear digital cameras", 2010: weights that come from the noisy
 * values themselves would favour the ones that happen to be dark, so a first merge gives the light that the second's
 * variances are computed from. */
#include "pipeline/hdr/merge.h"

#include "pipeline/hdr/ghosts.h"
#include "proto/base/memory.h"

#include <math.h>

#define LEAST_RATIO_PIXELS 500
#define THIRD_STOP 0.3334
#define ROUNDING 0.02 /* stops: told and measured exposures nearer than that are the same */
#define LOST 3.0      /* stops by which a shot must be off to be black or white */
#define LEAST_SHIFT 0.05
#define HALF_MOST 65504.0f

void lumi_merge_options_init(struct lumi_merge_options *options)
{
    *options = (struct lumi_merge_options){.full_well = 10000, .read_noise = 10, .align = true, .ghosts = true};
}

/* Share of the pixels that are neither dark nor bright. */
static double well_exposed(const struct lumi_raster *light)
{
    long good = 0, all = 0;

    for (int y = 1; y < light->height; y += 3)
        for (int x = 1; x < light->width; x += 3, all++) {
            const float *p = lumi_row_f32(light, y) + 3 * x;
            float most = fmaxf(p[0], fmaxf(p[1], p[2]));
            good += most > 0.03f && most < 0.9f;
        }
    return all ? (double)good / (double)all : 0;
}

static int choose_reference(const struct lumi_shot *shots, int count, double nominal)
{
    double best = -INFINITY;
    int reference = 0;

    for (int k = 0; k < count; k++) {
        double away = nominal > 0 && shots[k].exposure > 0 ? fabs(log2(shots[k].exposure / nominal)) : 0;
        double score = well_exposed(&shots[k].light) - 0.03 * away;
        if (score > best) {
            best = score;
            reference = k;
        }
    }
    return reference;
}

/* What the pictures say of the shot's exposure by the reference's; 0: nothing. */
static double measure(const struct lumi_shot *reference, const struct lumi_shot *shot)
{
    long pixels;
    double ratio = lumi_shot_ratio(&reference->light, &shot->light, &pixels);

    return pixels >= LEAST_RATIO_PIXELS ? ratio : 0;
}

/* Before the shot is aligned: an exposure where none was told, and whether it shows anything. */
static void guess_exposure(const struct lumi_shot *reference, struct lumi_shot *shot, struct lumi_shot_report *report)
{
    report->measured = measure(reference, shot);
    if (!(shot->exposure > 0)) {
        report->guessed = true;
        shot->exposure = reference->exposure * (report->measured > 0 ? report->measured : 1);
        if (!(report->measured > 0) && well_exposed(&shot->light) < 0.01)
            report->fate = LUMI_SHOT_BLACK;
    } else if (report->measured > 0) {
        double stops = log2(report->measured * reference->exposure / shot->exposure);
        if (fabs(stops) >= LOST)
            report->fate = stops < 0 ? LUMI_SHOT_BLACK : LUMI_SHOT_WHITE;
    }
    report->exposure = shot->exposure;
}

/* Afterwards: what was told, refined by the pictures within a third of a stop (cameras round what they report). */
static void refine_exposure(const struct lumi_shot *reference, struct lumi_shot *shot, struct lumi_shot_report *report)
{
    const double ratio = measure(reference, shot);

    if (!(ratio > 0))
        return;
    report->measured = ratio;
    const double stops = fabs(log2(ratio * reference->exposure / shot->exposure));
    if (stops > THIRD_STOP && !report->guessed)
        report->contrary = true;
    else if (stops > ROUNDING)
        shot->exposure = reference->exposure * ratio;
    report->exposure = shot->exposure;
}

/* Where no pixel can be compared: of those that the exposures say are in the middle of the shot's range, most are at
 * one of its ends. */
static enum lumi_shot_fate look_for_lost(const struct lumi_shot *reference, const struct lumi_shot *shot)
{
    const float by = (float)(shot->exposure / reference->exposure);
    long expected = 0, black = 0, white = 0;

    for (int y = 1; y < shot->light.height; y += 3)
        for (int x = 1; x < shot->light.width; x += 3) {
            const float *r = lumi_row_f32(&reference->light, y) + 3 * x, *s = lumi_row_f32(&shot->light, y) + 3 * x;
            float there = fmaxf(r[0], fmaxf(r[1], r[2])), most = fmaxf(s[0], fmaxf(s[1], s[2]));
            if (there < 0.004f || there > 0.93f || there * by < 0.08f || there * by > 0.8f)
                continue;
            expected++;
            black += most < there * by / 8;
            white += most > 0.98f;
        }
    if (expected < 50)
        return LUMI_SHOT_USED;
    return 2 * black > expected ? LUMI_SHOT_BLACK : 2 * white > expected && by < 1 ? LUMI_SHOT_WHITE : LUMI_SHOT_USED;
}

static int align(const struct lumi_shot *reference, struct lumi_shot *shot, struct lumi_shot_report *report,
                 struct lumi_error *error)
{
    struct lumi_raster moved;

    /* By the pictures' own measure where there is one: a wrong exposure would look like a shift of every slope. */
    const double scale = report->measured > 0 ? 1 / report->measured : reference->exposure / shot->exposure;
    LUMI_TRY(lumi_shot_shift(&reference->light, &shot->light, scale, &report->shift, error));
    if (fabs(report->shift.x) < LEAST_SHIFT && fabs(report->shift.y) < LEAST_SHIFT)
        return LUMI_OK;
    LUMI_TRY(lumi_shot_move(&shot->light, &report->shift, &moved, error));
    lumi_raster_finish(&shot->light);
    shot->light = moved;
    return LUMI_OK;
}

/* Everything the last loop reads. */
struct merging {
    struct lumi_shot *shots;
    const struct lumi_merge_options *options;
    struct lumi_merge_report *report;
    int count, shortest;
    float nominal;
    struct lumi_raster ghosts[LUMI_SHOTS_MAX]; /* none for the reference */
};

/* One pixel. A trace of the reference is left in every sum, and a little more of the shortest shot where nothing says
 * that it shows something else: where all shots are clipped, or the reference alone counts, they say what is known. */
static bool merge_pixel(const struct merging *m, int x, int y, float out[3])
{
    float trust[LUMI_SHOTS_MAX], share[LUMI_SHOTS_MAX], light[3] = {0, 0, 0}, best = 0;
    const int reference = m->report->reference;

    for (int k = 0; k < m->count; k++) {
        bool used = m->report->shots[k].fate == LUMI_SHOT_USED;
        float ghost = m->ghosts[k].data ? lumi_row_f32(&m->ghosts[k], y)[x] : 0;
        const float *pixel = lumi_row_f32(&m->shots[k].light, y) + 3 * x;
        trust[k] = used ? lumi_shot_trust(pixel) * (1 - ghost) : 0;
        best = fmaxf(best, trust[k]);
        share[k] = trust[k] + (k == reference ? 1e-7f : 0) + (k == m->shortest ? 1e-5f * (1 - ghost) : 0);
    }
    for (int round = 0; round < 2; round++) {
        for (int c = 0; c < 3; c++) {
            float sum = 0, weights = 0;
            for (int k = 0; k < m->count; k++) {
                if (!(share[k] > 0))
                    continue;
                float exposure = (float)m->shots[k].exposure / m->nominal;
                float value = lumi_row_f32(&m->shots[k].light, y)[3 * x + c];
                float expected = round == 0 ? value : fminf(light[c] * exposure, 1);
                float weight = share[k] * exposure * exposure / lumi_shot_variance(&m->shots[k], m->options, expected);
                sum += weight * value / exposure;
                weights += weight;
            }
            out[c] = weights > 0 ? sum / weights : 0;
        }
        for (int c = 0; c < 3; c++)
            light[c] = out[c];
    }
    for (int c = 0; c < 3; c++)
        out[c] = fminf(fmaxf(out[c], 0), HALF_MOST);
    return best <= 0;
}

static int prepare(struct merging *m, struct lumi_error *error)
{
    const struct lumi_shot *reference = &m->shots[m->report->reference];

    for (int k = 0; k < m->count; k++) {
        struct lumi_shot_report *report = &m->report->shots[k];
        if (k == m->report->reference) {
            report->exposure = reference->exposure;
            report->measured = 1;
            continue;
        }
        guess_exposure(reference, &m->shots[k], report);
        if (report->fate == LUMI_SHOT_USED && !report->guessed)
            report->fate = look_for_lost(reference, &m->shots[k]);
        if (report->fate != LUMI_SHOT_USED)
            continue;
        if (m->options->align)
            LUMI_TRY(align(reference, &m->shots[k], report, error));
        refine_exposure(reference, &m->shots[k], report);
        if (m->options->ghosts)
            LUMI_TRY(lumi_ghosts_find(reference, &m->shots[k], (float)(reference->exposure / m->shots[k].exposure),
                                      m->options, &m->ghosts[k], &report->ghosts, error));
    }
    m->shortest = m->report->reference;
    for (int k = 0; k < m->count; k++)
        if (m->report->shots[k].fate == LUMI_SHOT_USED && m->shots[k].exposure < m->shots[m->shortest].exposure)
            m->shortest = k;
    return LUMI_OK;
}

int lumi_merge(struct lumi_shot *shots, int count, const struct lumi_merge_options *options, struct lumi_raster *result,
               struct lumi_merge_report *report, struct lumi_error *error)
{
    struct merging m = {.shots = shots, .options = options, .report = report, .count = count};
    long clipped = 0;
    int code;

    *result = (struct lumi_raster){0};
    *report = (struct lumi_merge_report){0};
    if (count < 1 || count > LUMI_SHOTS_MAX)
        return lumi_fail(error, LUMI_ERR_ARG, "%d shots: 1 to %d can be merged", count, LUMI_SHOTS_MAX);
    for (int k = 1; k < count; k++)
        if (shots[k].light.width != shots[0].light.width || shots[k].light.height != shots[0].light.height)
            return lumi_fail(error, LUMI_ERR_ARG, "shots of different sizes");
    report->reference = choose_reference(shots, count, options->nominal);
    struct lumi_shot *reference = &shots[report->reference];
    if (!(reference->exposure > 0)) {
        reference->exposure = options->nominal > 0 ? options->nominal : 1;
        report->shots[report->reference].guessed = true;
    }
    m.nominal = (float)(options->nominal > 0 ? options->nominal : reference->exposure);
    LUMI_GOTO(code, done, prepare(&m, error));
    if (lumi_raster_create(result, reference->light.width, reference->light.height, 3, LUMI_F32) != LUMI_OK) {
        code = lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a merged picture");
        goto done;
    }
    for (int y = 0; y < result->height; y++)
        for (int x = 0; x < result->width; x++)
            clipped += merge_pixel(&m, x, y, lumi_row_f32(result, y) + 3 * x);
    report->clipped = (double)clipped / ((double)result->width * result->height);
done:
    for (int k = 0; k < count; k++)
        lumi_raster_finish(&m.ghosts[k]);
    return code;
}
