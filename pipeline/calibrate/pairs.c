/* The stage "pairs". */
#include "pipeline/calibrate/pairs.h"

#include "pipeline/calibrate/features.h"
#include "pipeline/calibrate/pair_match.h"
#include "pipeline/run/key.h"
#include "proto/base/memory.h"

#include <glib.h>
#include <math.h>
#include <string.h>

#define DEGREE (LUMI_PI / 180)

enum {
    FEWEST = 12,      /* matches that make a pair */
    FREE_FRAMES = 12, /* of a camera are also matched without the prior */
    FREE_FEATURES = 1500
};
#define FIT_PIXELS 1.5     /* a match is no further from the pair's own motion */
#define FREE_PARALLAX 0.08 /* radians: what free matching takes for near enough to a rotation */

static bool wanted(const struct lumi_run *run, int index)
{
    (void)index;
    return run->wants.calibrate || run->wants.equalize;
}

/* What the poses do not know, generously: a band too wide costs little, one too narrow finds nothing. */
static void band_of(const struct lumi_run *run, double baseline, struct lumi_band *band)
{
    static const struct lumi_rig_uncertainty unknown = {0.005, 0.5 * DEGREE, 0.3 * DEGREE, 0.3 * DEGREE};
    const struct lumi_rig_uncertainty *u = run->rig ? &run->rig->uncertainty : &unknown;
    const double turned = sqrt(2 * u->rotation * u->rotation + 2 * u->turn * u->turn + 2 * u->drop * u->drop);
    /* Places that nobody gave in metres are as wrong as their distances are long. */
    const double place = run->rig ? fmax(0.008, 4 * sqrt(2) * u->position_m) : 0.1 * baseline;

    band->rotation = fmax(2 * DEGREE, 4 * turned);
    band->shift = fmin(1, place / fmax(baseline, 1e-9));
    band->parallax = 0.35;
    const double near = run->parameters.near_m;
    if (near > 0)
        band->parallax = fmin(1, 1.2 * baseline / near);
}

/* Whether a frame is one of those few of its camera. */
static bool free_frame(const struct lumi_run *run, int index)
{
    int before = 0, all = 0;

    for (int i = 0; i < run->count; i++)
        if (run->sources[i].camera == run->sources[index].camera) {
            before += i < index;
            all++;
        }
    const int every = all > FREE_FRAMES ? all / FREE_FRAMES : 1;
    return before % every == 0;
}

static int key(struct lumi_run *run, int index, struct lumi_key *key, struct lumi_error *error)
{
    g_autofree int *partners = NULL;
    const int count = lumi_pairs_choose(run, index, &partners);
    struct lumi_band band;

    (void)error;
    band_of(run, 1, &band);
    lumi_key_bytes(key, &band, sizeof band);
    lumi_key_double(key, run->parameters.near_m);
    lumi_key_int(key, run->rig != NULL);
    lumi_key_int(key, free_frame(run, index));
    for (int i = -1; i < count; i++) {
        const int frame = i < 0 ? index : partners[i];
        if (frame < index)
            continue;
        const struct lumi_source *source = &run->sources[frame];
        lumi_key_bytes(key, source->name, strlen(source->name) + 1);
        lumi_key_int(key, source->camera);
        lumi_key_lens(key, &source->lens);
        lumi_key_pose(key, &source->prior);
        lumi_key_input(key, run, lumi_stage_features.name, frame);
    }
    return LUMI_OK;
}

static int load(const struct lumi_run *run, int index, struct lumi_sighted *sighted, struct lumi_error *error)
{
    g_autofree char *path = lumi_run_path(run, lumi_stage_features.name, index, lumi_stage_features.extension);
    struct lumi_features features;

    LUMI_TRY(lumi_features_read(path, &features, error));
    int code = lumi_sighted_init(sighted, &run->sources[index].lens, &features, error);
    lumi_features_finish(&features);
    return code;
}

/* Two pictures being matched. */
struct couple {
    const struct lumi_sighted *first, *second;
    struct lumi_motion_between prior;
    struct lumi_band band;
    double pixel;
};

static void note_motion(struct lumi_pair *pair, const struct lumi_motion_between *motion)
{
    memcpy(pair->rotation, motion->rotation, sizeof pair->rotation);
    pair->direction = motion->direction;
}

/* The matches in a band around a motion, those that agree on one motion (out: that), and of them the rest found again
 * in the narrow band around it. */
static int match_in_band(const struct couple *couple, const struct lumi_band *band, struct lumi_matches *matches,
                         struct lumi_motion_between *motion)
{
    const double fit = FIT_PIXELS * couple->pixel;
    struct lumi_band narrow = {3 * fit, 0, band->parallax};

    *motion = couple->prior;
    LUMI_TRY(lumi_match_features(couple->first, couple->second, motion, band, 0.85, LUMI_FEATURES_MAX, matches));
    bool found = matches->count >= FEWEST &&
                 lumi_motion_refine(motion, matches->sights, matches->count, band->rotation / 2, fit / 3);
    const int all = matches->count;
    if (found)
        lumi_matches_keep(matches, motion, 2 * fit);
    found = found && matches->count >= FEWEST && matches->count >= all / 3;
    lumi_motion_face(motion, matches->sights, matches->count, 2 * fit);
    lumi_matches_finish(matches);
    if (!found)
        return LUMI_OK;
    LUMI_TRY(lumi_match_features(couple->first, couple->second, motion, &narrow, 0.75, LUMI_FEATURES_MAX, matches));
    found = matches->count >= FEWEST && lumi_motion_refine(motion, matches->sights, matches->count, fit, fit / 3);
    if (found)
        lumi_matches_keep(matches, motion, fit);
    if (!found || matches->count < FEWEST)
        lumi_matches_finish(matches);
    return LUMI_OK;
}

static int match_guided(const struct couple *couple, struct lumi_pair *pair)
{
    struct lumi_matches matches;
    struct lumi_motion_between motion;
    struct lumi_band wide = couple->band;

    LUMI_TRY(match_in_band(couple, &couple->band, &matches, &motion));
    if (!matches.count) {
        wide.rotation *= 2.5;
        wide.shift = fmin(1, 2.5 * wide.shift);
        LUMI_TRY(match_in_band(couple, &wide, &matches, &motion));
    }
    if (matches.count)
        note_motion(pair, &motion);
    pair->match_count = matches.count;
    pair->matches = matches.items;
    matches.items = NULL;
    lumi_matches_finish(&matches);
    return LUMI_OK;
}

static int match_freely(const struct couple *couple, struct lumi_pair *pair)
{
    const double fit = FIT_PIXELS * couple->pixel;
    struct lumi_motion_between motion;
    struct lumi_matches matches;

    LUMI_TRY(lumi_match_features(couple->first, couple->second, NULL, NULL, 0.8, FREE_FEATURES, &matches));
    const int count = lumi_motion_find(matches.sights, matches.count, FREE_PARALLAX, fit, &motion);
    if (count >= FEWEST) {
        for (int i = 0; i < matches.count; i++)
            if (fabs(lumi_motion_error(&motion, &matches.sights[i])) < fit &&
                lumi_dot(matches.sights[i].a, lumi_rotate(motion.rotation, matches.sights[i].b)) >
                    cos(2 * FREE_PARALLAX)) {
                pair->free_count++;
                pair->free_outside += !lumi_band_holds(&couple->prior, &couple->band, &matches.sights[i]);
            }
        note_motion(pair, &motion);
    }
    lumi_matches_finish(&matches);
    return LUMI_OK;
}

static int match_pair(const struct lumi_run *run, int index, const struct lumi_sighted *first, int partner, bool freely,
                      struct lumi_pair *pair, struct lumi_error *error)
{
    struct couple couple = {.first = first};
    struct lumi_sighted second;
    double baseline;

    LUMI_TRY(load(run, partner, &second, error));
    couple.second = &second;
    couple.pixel = (first->pixel + second.pixel) / 2;
    lumi_motion_of(&run->sources[index].prior, &run->sources[partner].prior, &couple.prior, &baseline);
    band_of(run, baseline, &couple.band);
    g_strlcpy(pair->name, run->sources[partner].name, sizeof pair->name);
    int code = match_guided(&couple, pair);
    if (code == LUMI_OK && freely)
        code = match_freely(&couple, pair);
    lumi_sighted_finish(&second);
    return code == LUMI_OK ? code : lumi_fail(error, code, "not enough memory to match features");
}

static int make(struct lumi_run *run, void *state, int index, int thread, const char *path, struct lumi_error *error)
{
    g_autofree int *partners = NULL;
    const int count = lumi_pairs_choose(run, index, &partners);
    struct lumi_sighted first = {0};
    struct lumi_pair_list list = {.items = lumi_calloc((size_t)(count ? count : 1), sizeof(struct lumi_pair))};
    bool own = !free_frame(run, index), other = own; /* freely matched already, of the same camera and of another */
    int code = list.items ? LUMI_OK : lumi_fail(error, LUMI_ERR_NOMEM, "not enough memory to match features");

    (void)state, (void)thread;
    if (code == LUMI_OK)
        code = load(run, index, &first, error);
    for (int i = 0; code == LUMI_OK && i < count; i++) {
        if (partners[i] < index)
            continue;
        bool *done = run->sources[partners[i]].camera == run->sources[index].camera ? &own : &other;
        code = match_pair(run, index, &first, partners[i], !*done, &list.items[list.count++], error);
        *done = true;
    }
    if (code == LUMI_OK)
        code = lumi_pairs_write(path, &list, error);
    lumi_pairs_finish(&list);
    lumi_sighted_finish(&first);
    return code;
}

const struct lumi_stage lumi_stage_pairs = {
    .name = "pairs",
    .title = "matching features",
    .version = 1,
    .extension = ".pairs",
    .set = LUMI_SET_FRAMES,
    .wanted = wanted,
    .key = key,
    .make = make,
};
