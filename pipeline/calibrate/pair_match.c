/* Matching of two pictures' features. */
#include "pipeline/calibrate/pair_match.h"

#include "pipeline/calibrate/descriptor.h"
#include "proto/base/memory.h"

#include <math.h>
#include <string.h>

/* Two features nearer than this are one place with two directions, pixels. */
#define SAME_PLACE 2.0f
/* Matches of longer descriptor distance are none (the root descriptor is 512 long). */
#define DISTANCE_MOST 400.0
#define TURNED_MOST 0.77 /* cosine of how far orientations may differ from the motion's */
#define GROWN_MOST 2.2f  /* ratio of sizes */

static struct lumi_vec3 top_of(const struct lumi_lens *lens, const struct lumi_feature *item, struct lumi_vec3 way,
                               float *size)
{
    struct lumi_vec3 ahead;
    const double h = 0.5;

    *size = 1e-3f;
    if (!lumi_lens_unproject(lens, item->x + h * cos(item->orientation), item->y + h * sin(item->orientation), &ahead))
        return lumi_vec3(0, 0, 0);
    ahead = lumi_sub(ahead, lumi_scale(way, lumi_dot(ahead, way)));
    const double length = lumi_length(ahead);
    *size = (float)(item->scale * length / h);
    return length > 0 ? lumi_scale(ahead, 1 / length) : ahead;
}

int lumi_sighted_init(struct lumi_sighted *sighted, const struct lumi_lens *lens, struct lumi_features *features,
                      struct lumi_error *error)
{
    const size_t count = (size_t)(features->count ? features->count : 1);

    *sighted = (struct lumi_sighted){.features = *features, .pixel = 1 / sqrt(lens->fx * lens->fy)};
    *features = (struct lumi_features){0};
    sighted->ways = lumi_calloc(count, sizeof *sighted->ways);
    sighted->tops = lumi_calloc(count, sizeof *sighted->tops);
    sighted->sizes = lumi_calloc(count, sizeof *sighted->sizes);
    if (!sighted->ways || !sighted->tops || !sighted->sizes) {
        lumi_sighted_finish(sighted);
        return lumi_fail(error, LUMI_ERR_NOMEM, "not enough memory to match features");
    }
    for (int i = 0; i < sighted->features.count; i++) {
        const struct lumi_feature *item = &sighted->features.items[i];
        if (!lumi_lens_unproject(lens, item->x, item->y, &sighted->ways[i]))
            sighted->ways[i] = lumi_vec3(0, 0, 0);
        else
            sighted->tops[i] = top_of(lens, item, sighted->ways[i], &sighted->sizes[i]);
    }
    return LUMI_OK;
}

void lumi_sighted_finish(struct lumi_sighted *sighted)
{
    lumi_features_finish(&sighted->features);
    lumi_free(sighted->ways);
    lumi_free(sighted->tops);
    lumi_free(sighted->sizes);
    *sighted = (struct lumi_sighted){0};
}

void lumi_matches_finish(struct lumi_matches *matches)
{
    lumi_free(matches->items);
    lumi_free(matches->sights);
    *matches = (struct lumi_matches){0};
}

/* The band of one feature: the half plane in which its point must be seen, and how far along. */
struct strip {
    struct lumi_vec3 way, away, normal; /* seen at infinity, then towards `away` the nearer it is */
    double across;                      /* length of the baseline's part across the way */
    double ahead;                       /* and along it */
    double most;                        /* angle of the nearest */
};

static void strip_of(const struct lumi_motion_between *motion, const struct lumi_band *band, struct lumi_vec3 way,
                     struct strip *strip)
{
    const double ahead = lumi_dot(motion->direction, way);
    const struct lumi_vec3 away = lumi_sub(lumi_scale(way, ahead), motion->direction);
    const double across = lumi_length(away);

    strip->way = way;
    strip->across = across;
    strip->ahead = ahead;
    if (across > 1e-9)
        strip->away = lumi_scale(away, 1 / across);
    else
        strip->away = lumi_normalize(lumi_cross(way, fabs(way.x) < 0.8 ? lumi_vec3(1, 0, 0) : lumi_vec3(0, 1, 0)));
    strip->normal = lumi_cross(way, strip->away);
    strip->most = atan2(band->parallax * across, fmax(0.2, 1 - band->parallax * ahead));
}

static bool strip_holds(const struct strip *strip, const struct lumi_band *band, struct lumi_vec3 c)
{
    const double along = atan2(lumi_dot(c, strip->away), lumi_dot(c, strip->way));
    /* Whatever is nearer moves more when the place is wrong. */
    const double near =
        strip->across > 1e-3 ? fmin(band->parallax, fmax(0, tan(fmin(1.4, along))) / strip->across) : band->parallax;
    const double margin = band->rotation + band->shift * near;

    return fabs(lumi_dot(c, strip->normal)) < margin && along > -margin && along < strip->most + margin;
}

bool lumi_band_holds(const struct lumi_motion_between *motion, const struct lumi_band *band,
                     const struct lumi_sight *sight)
{
    struct strip strip;

    strip_of(motion, band, sight->a, &strip);
    return strip_holds(&strip, band, lumi_rotate(motion->rotation, sight->b));
}

/* The second picture's features turned into the first's frame, and what was found for them. */
struct side {
    int count;
    struct lumi_vec3 *tops;
    float *x, *y, *z;
    uint8_t *near;
    int *best;          /* the first picture's feature, −1: none */
    uint32_t *distance; /* to that */
};

static int side_init(struct side *side, const struct lumi_sighted *second, const struct lumi_motion_between *motion,
                     int most)
{
    const size_t count = (size_t)(second->features.count ? second->features.count : 1);

    *side = (struct side){.count = second->features.count < most ? second->features.count : most};
    side->tops = lumi_alloc(count, sizeof *side->tops);
    side->x = lumi_alloc(count, sizeof *side->x);
    side->y = lumi_alloc(count, sizeof *side->y);
    side->z = lumi_alloc(count, sizeof *side->z);
    side->near = lumi_alloc(count, sizeof *side->near);
    side->best = lumi_alloc(count, sizeof *side->best);
    side->distance = lumi_alloc(count, sizeof *side->distance);
    if (!side->tops || !side->x || !side->y || !side->z || !side->near || !side->best || !side->distance)
        return LUMI_ERR_NOMEM;
    for (int i = 0; i < side->count; i++) {
        const struct lumi_vec3 c = motion ? lumi_rotate(motion->rotation, second->ways[i]) : second->ways[i];
        side->tops[i] = motion ? lumi_rotate(motion->rotation, second->tops[i]) : second->tops[i];
        side->x[i] = (float)c.x;
        side->y[i] = (float)c.y;
        side->z[i] = (float)c.z;
        side->best[i] = -1;
        side->distance[i] = UINT32_MAX;
    }
    return LUMI_OK;
}

static void side_finish(struct side *side)
{
    lumi_free(side->tops);
    lumi_free(side->x);
    lumi_free(side->y);
    lumi_free(side->z);
    lumi_free(side->near);
    lumi_free(side->best);
    lumi_free(side->distance);
}

/* Roughly, for all at once: those in the cone around the strip's middle, and not far from its plane. */
static void mark_near(const struct side *side, const struct strip *strip, const struct lumi_band *band)
{
    const double margin = band->rotation + band->shift * band->parallax;
    const double half = (strip->most + 2 * margin) / 2, middle = strip->most / 2;
    const struct lumi_vec3 m = lumi_add(lumi_scale(strip->way, cos(middle)), lumi_scale(strip->away, sin(middle)));
    const float mx = (float)m.x, my = (float)m.y, mz = (float)m.z;
    const float nx = (float)strip->normal.x, ny = (float)strip->normal.y, nz = (float)strip->normal.z;
    const float cone = (float)cos(fmin(LUMI_PI, hypot(half, margin) + 1e-3)), off = (float)margin + 1e-5f;

    for (int i = 0; i < side->count; i++) {
        const float along = mx * side->x[i] + my * side->y[i] + mz * side->z[i];
        const float across = nx * side->x[i] + ny * side->y[i] + nz * side->z[i];
        side->near[i] = (along > cone) & (fabsf(across) < off);
    }
}

static bool similar(const struct lumi_sighted *first, int a, const struct lumi_sighted *second, int b,
                    struct lumi_vec3 top)
{
    const float grown = first->sizes[a] / second->sizes[b];

    return grown < GROWN_MOST && grown > 1 / GROWN_MOST && lumi_dot(first->tops[a], top) > TURNED_MOST;
}

struct search {
    const struct lumi_sighted *first, *second;
    const struct lumi_motion_between *motion;
    const struct lumi_band *band;
    lumi_descriptor_fn far;
    double ratio;
    struct side side;
};

/* The best candidate of feature a, −1 where none is much better than the rest. */
static int best_of(struct search *s, int a, uint32_t *distance)
{
    const struct lumi_feature *items = s->second->features.items;
    uint32_t best = UINT32_MAX, second = UINT32_MAX;
    struct strip strip;
    int found = -1;

    if (s->motion) {
        strip_of(s->motion, s->band, s->first->ways[a], &strip);
        mark_near(&s->side, &strip, s->band);
    }
    for (int b = 0; b < s->side.count; b++) {
        if (s->motion && (!s->side.near[b] || !similar(s->first, a, s->second, b, s->side.tops[b]) ||
                          !strip_holds(&strip, s->band, lumi_vec3(s->side.x[b], s->side.y[b], s->side.z[b]))))
            continue;
        const uint32_t d = s->far(s->first->features.items[a].descriptor, items[b].descriptor);
        if (d < s->side.distance[b]) {
            s->side.distance[b] = d;
            s->side.best[b] = a;
        }
        const bool same = found >= 0 && fabsf(items[b].x - items[found].x) < SAME_PLACE &&
                          fabsf(items[b].y - items[found].y) < SAME_PLACE;
        if (d < best) {
            if (!same)
                second = best;
            best = d;
            found = b;
        } else if (d < second && !same) {
            second = d;
        }
    }
    *distance = best;
    return found >= 0 && best < DISTANCE_MOST * DISTANCE_MOST && best < s->ratio * s->ratio * second ? found : -1;
}

int lumi_match_features(const struct lumi_sighted *first, const struct lumi_sighted *second,
                        const struct lumi_motion_between *motion, const struct lumi_band *band, double ratio, int most,
                        struct lumi_matches *matches)
{
    struct search s = {first, second, motion, band, lumi_descriptor_distance(), ratio, {0}};
    const int count = first->features.count < most ? first->features.count : most;
    const size_t room = (size_t)(count ? count : 1);
    int code = side_init(&s.side, second, motion, most);

    *matches = (struct lumi_matches){0};
    matches->items = lumi_calloc(room, sizeof *matches->items);
    matches->sights = lumi_calloc(room, sizeof *matches->sights);
    if (!matches->items || !matches->sights)
        code = LUMI_ERR_NOMEM;
    for (int a = 0; code == LUMI_OK && a < count; a++) {
        uint32_t distance;
        const int b = lumi_dot(first->ways[a], first->ways[a]) > 0.5 ? best_of(&s, a, &distance) : -1;
        if (b >= 0 && lumi_dot(second->ways[b], second->ways[b]) > 0.5)
            matches->items[matches->count++] = (struct lumi_match){(uint32_t)a, (uint32_t)b, sqrtf((float)distance)};
    }
    int kept = 0;
    for (int i = 0; code == LUMI_OK && i < matches->count; i++) {
        const struct lumi_match match = matches->items[i];
        if (s.side.best[match.b] != (int)match.a)
            continue;
        matches->sights[kept] = (struct lumi_sight){first->ways[match.a], second->ways[match.b]};
        matches->items[kept++] = match;
    }
    matches->count = kept;
    side_finish(&s.side);
    if (code != LUMI_OK)
        lumi_matches_finish(matches);
    return code;
}

void lumi_matches_keep(struct lumi_matches *matches, const struct lumi_motion_between *motion, double most)
{
    int kept = 0;

    for (int i = 0; i < matches->count; i++)
        if (fabs(lumi_motion_error(motion, &matches->sights[i])) <= most) {
            matches->items[kept] = matches->items[i];
            matches->sights[kept++] = matches->sights[i];
        }
    matches->count = kept;
}
