/* Clocks laid over each other, and pictures of one moment joined. */
#include "pipeline/exchange/shot_match_priv.h"

#include "proto/base/sort.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PAIRS 300000    /* differences that vote, about */
#define CANDIDATES 24   /* offsets that are looked at closely */
#define DRIFT_MAX 1e-3  /* no camera's clock is worse */
#define ROUNDS 6        /* of a fit */
#define STEPS 256       /* of climbing, at most */
#define SAME_SCORE 0.75 /* items: scores nearer to each other than this say nothing */

/* A track's clock against the reference's. */
struct fit {
    double offset, drift;
    double score; /* items that match, less what they are off by */
    double first; /* of its first item that matches, by the reference's clock */
};

/* Pairs of a track's item and the reference's nearest in time, both used once, in order. */
static int pair_items(const struct shot_track *reference, const struct shot_track *track, const struct fit *fit,
                      double tolerance, int *partner)
{
    int pairs = 0, j = 0;

    for (int i = 0; i < track->count; i++) {
        partner[i] = -1;
        double at = (track->times[i] - fit->offset) / (1 + fit->drift);
        while (j + 1 < reference->count && fabs(reference->times[j + 1] - at) <= fabs(reference->times[j] - at))
            j++;
        if (j >= reference->count || fabs(reference->times[j] - at) > tolerance)
            continue;
        if (track->labels[i] >= 0 && reference->labels[j] >= 0 && track->labels[i] != reference->labels[j])
            continue;
        partner[i] = j++;
        pairs++;
        if (j == reference->count) {
            for (i++; i < track->count; i++)
                partner[i] = -1;
            break;
        }
    }
    return pairs;
}

/* Least squares of track = offset + (1 + drift) · reference over the pairs. */
static void solve_fit(const struct shot_track *reference, const struct shot_track *track, const int *partner, int pairs,
                      struct fit *fit)
{
    double x0 = 0, d0 = 0, xx = 0, xd = 0;

    for (int i = 0; i < track->count; i++)
        if (partner[i] >= 0) {
            x0 += reference->times[partner[i]] / pairs;
            d0 += (track->times[i] - reference->times[partner[i]]) / pairs;
        }
    for (int i = 0; i < track->count; i++)
        if (partner[i] >= 0) {
            double x = reference->times[partner[i]] - x0;
            xx += x * x;
            xd += x * (track->times[i] - reference->times[partner[i]] - d0);
        }
    /* A slope of few pictures is noise. */
    fit->drift = pairs >= 8 && xx > 0 ? fmax(-DRIFT_MAX, fmin(DRIFT_MAX, xd / xx)) : 0;
    fit->offset = d0 - fit->drift * x0;
}

static void refine(const struct shot_track *reference, const struct shot_track *track, double tolerance,
                   struct fit *fit)
{
    g_autofree int *partner = g_new(int, track->count);
    int pairs = 0;

    for (int round = 0; round < ROUNDS; round++) {
        pairs = pair_items(reference, track, fit, tolerance, partner);
        if (pairs < 2)
            break;
        solve_fit(reference, track, partner, pairs, fit);
    }
    pairs = pair_items(reference, track, fit, tolerance, partner);
    fit->score = 0;
    fit->first = NAN;
    for (int i = 0; i < track->count; i++)
        if (partner[i] >= 0) {
            double at = (track->times[i] - fit->offset) / (1 + fit->drift);
            double off = (at - reference->times[partner[i]]) / tolerance;
            fit->score += 1 - off * off;
            if (isnan(fit->first))
                fit->first = at;
        }
}

/* All differences between the clocks, as far as they can be of one shot. */
static GArray *differences(const struct shot_track *reference, const struct shot_track *track)
{
    GArray *all = g_array_new(FALSE, FALSE, sizeof(double));
    int stride = 1 + (int)((double)reference->count * track->count / PAIRS);

    for (int i = 0; i < track->count; i += stride)
        for (int j = 0; j < reference->count; j++) {
            double d = track->times[i] - reference->times[j];
            bool other = track->labels[i] >= 0 && reference->labels[j] >= 0 && track->labels[i] != reference->labels[j];
            if (!other)
                g_array_append_val(all, d);
        }
    lumi_sort_doubles((double *)(void *)all->data, (int)all->len);
    return all;
}

struct candidate {
    double offset;
    int votes;
};

static int by_votes(const void *a, const void *b)
{
    const struct candidate *p = a, *q = b;

    return p->votes != q->votes ? q->votes - p->votes : p->offset < q->offset ? -1 : p->offset > q->offset;
}

/* Differences that many pairs have: windows of `width`, none overlapping. */
static GArray *vote(const GArray *all, double width)
{
    GArray *found = g_array_new(FALSE, FALSE, sizeof(struct candidate));
    guint last = 0;

    for (guint i = 0; i < all->len; i++) {
        double from = g_array_index(all, double, i);
        while (last < all->len && g_array_index(all, double, last) <= from + width)
            last++;
        struct candidate here = {g_array_index(all, double, (i + last - 1) / 2), (int)(last - i)};
        struct candidate *before = found->len ? &g_array_index(found, struct candidate, found->len - 1) : NULL;
        if (before && here.offset - before->offset < width) {
            if (here.votes > before->votes)
                *before = here;
        } else {
            g_array_append_val(found, here);
        }
    }
    if (found->len > 0)
        qsort(found->data, found->len, sizeof(struct candidate), by_votes);
    return found;
}

/* Where two offsets fit as well: the one by which clocks that were set together agree, else that in which the camera
 * begins with the reference. */
static bool better(const struct fit *a, const struct fit *b, double begin, double least)
{
    if (fabs(a->score - b->score) > SAME_SCORE)
        return a->score > b->score;
    if ((fabs(a->offset) < least / 2) != (fabs(b->offset) < least / 2))
        return fabs(a->offset) < least / 2;
    return fabs(a->first - begin) < fabs(b->first - begin) - least / 2;
}

/* Shots lie evenly: from a good offset to the best it is a number of whole beats, and each is as good as the one before
 * until the lists lie over each other. */
static struct fit climb(const struct shot_track *reference, const struct shot_track *track, double tolerance,
                        const struct shot_beat *beat, struct fit best)
{
    int longest = MAX(reference->count, track->count) / beat->bracket + 1;

    for (int beats = 1, steps = 0; beats <= longest && steps < STEPS; steps++) {
        bool found = false;
        for (int way = -1; way <= 1; way += 2) {
            struct fit fit = {.offset = best.offset + way * beats * beat->period, .drift = best.drift};
            refine(reference, track, tolerance, &fit);
            if (better(&fit, &best, reference->times[0], beat->least)) {
                best = fit;
                found = true;
            }
        }
        beats = found ? 1 : beats * 2;
    }
    return best;
}

static void align(const struct shot_track *reference, struct shot_track *track, const struct shot_beat *beat)
{
    double resolution = fmax(track->resolution, reference->resolution);
    double tolerance = fmax(0.3 * beat->least, 0.6 * resolution), begin = reference->times[0];
    g_autoptr(GArray) all = differences(reference, track);
    g_autoptr(GArray) found = vote(all, tolerance);
    struct fit best = {0};
    g_autofree struct fit *fits = g_new0(struct fit, CANDIDATES);
    int count = 0;

    for (guint i = 0; i < found->len && count < CANDIDATES; i++, count++) {
        fits[count].offset = g_array_index(found, struct candidate, i).offset;
        refine(reference, track, tolerance, &fits[count]);
        if (count == 0 || better(&fits[count], &best, begin, beat->least))
            best = fits[count];
    }
    best = climb(reference, track, tolerance, beat, best);
    track->offset = best.offset;
    track->drift = best.drift;
    for (int way = -1; way <= 1; way += 2) {
        struct fit fit = {.offset = best.offset + way * beat->period, .drift = best.drift};
        refine(reference, track, tolerance, &fit);
        if (fabs(fit.score - best.score) <= SAME_SCORE && fabs(fit.offset - best.offset) > beat->least / 2 &&
            fabs(best.offset) >= beat->least / 2)
            track->ambiguous = true;
    }
}

void shot_align_clocks(struct shot_track *tracks, int count, int reference, const struct shot_beat *beat)
{
    for (int c = 0; c < count; c++)
        if (c != reference && tracks[c].timed)
            align(&tracks[reference], &tracks[c], beat);
}

/* Events */

struct moment {
    double time;
    int track, item;
};

static int by_time(const void *a, const void *b)
{
    const struct moment *p = a, *q = b;

    if (p->time != q->time)
        return p->time < q->time ? -1 : 1;
    return p->track != q->track ? p->track - q->track : p->item - q->item;
}

/* Of a coarse clock the place in time is a guess: such items join events of others and begin none where another
 * camera's clock is fine. */
static GArray *list_moments(const struct shot_track *tracks, int count, bool coarse, double limit)
{
    GArray *moments = g_array_new(FALSE, FALSE, sizeof(struct moment));

    for (int c = 0; c < count; c++)
        for (int i = 0; tracks[c].timed && (tracks[c].resolution > limit) == coarse && i < tracks[c].count; i++) {
            struct moment moment = {shot_common_time(&tracks[c], tracks[c].times[i]), c, i};
            g_array_append_val(moments, moment);
        }
    if (moments->len > 0)
        qsort(moments->data, moments->len, sizeof(struct moment), by_time);
    return moments;
}

static void add_moments(const GArray *moments, const struct shot_track *tracks, double tolerance, GArray *events,
                        int **member)
{
    g_autofree int *latest = g_new(int, SHOT_TRACKS); /* of each track: the event it took part in last */
    guint first = 0;

    for (int c = 0; c < SHOT_TRACKS; c++)
        latest[c] = -1;
    for (guint m = 0; m < moments->len; m++) {
        const struct moment *moment = &g_array_index(moments, struct moment, m);
        int label = tracks[moment->track].labels[moment->item], chosen = -1;
        double nearest = tolerance;
        while (first < events->len && g_array_index(events, struct shot_event, first).time < moment->time - tolerance)
            first++;
        for (guint e = first; e < events->len; e++) {
            const struct shot_event *event = &g_array_index(events, struct shot_event, e);
            double off = fabs(event->time - moment->time);
            if (event->time > moment->time + tolerance)
                break;
            if (off <= nearest && (int)e > latest[moment->track] &&
                (label < 0 || event->label < 0 || label == event->label)) {
                nearest = off;
                chosen = (int)e;
            }
        }
        if (chosen < 0) {
            struct shot_event event = {moment->time, label, 0, -1};
            g_array_append_val(events, event);
            chosen = (int)events->len - 1;
        }
        struct shot_event *event = &g_array_index(events, struct shot_event, chosen);
        event->time += (moment->time - event->time) / ++event->cameras;
        event->label = event->label >= 0 ? event->label : label;
        latest[moment->track] = chosen;
        member[moment->track][moment->item] = chosen;
    }
}

/* Of a coarse clock: to the nearest event behind the one its last item joined. */
static void attach_coarse(const GArray *moments, double tolerance, GArray *events, int **member)
{
    g_autofree int *latest = g_new(int, SHOT_TRACKS);

    for (int c = 0; c < SHOT_TRACKS; c++)
        latest[c] = -1;
    for (guint m = 0; m < moments->len; m++) {
        const struct moment *moment = &g_array_index(moments, struct moment, m);
        int chosen = -1;
        double nearest = tolerance;
        for (guint e = (guint)(latest[moment->track] + 1); e < events->len; e++) {
            double off = fabs(g_array_index(events, struct shot_event, e).time - moment->time);
            if (off <= nearest) {
                nearest = off;
                chosen = (int)e;
            } else if (g_array_index(events, struct shot_event, e).time > moment->time + tolerance) {
                break;
            }
        }
        if (chosen < 0)
            continue;
        g_array_index(events, struct shot_event, chosen).cameras++;
        latest[moment->track] = chosen;
        member[moment->track][moment->item] = chosen;
    }
}

GArray *shot_join_events(const struct shot_track *tracks, int count, double tolerance, int **member)
{
    GArray *events = g_array_new(FALSE, FALSE, sizeof(struct shot_event));
    bool fine = false;

    for (int c = 0; c < count; c++) {
        member[c] = g_new(int, MAX(tracks[c].count, 1));
        for (int i = 0; i < tracks[c].count; i++)
            member[c][i] = -1;
        fine = fine || (tracks[c].timed && tracks[c].resolution <= 2 * tolerance);
    }
    double limit = fine ? 2 * tolerance : INFINITY;
    g_autoptr(GArray) moments = list_moments(tracks, count, false, limit);
    g_autoptr(GArray) coarse = list_moments(tracks, count, true, limit);
    add_moments(moments, tracks, tolerance, events, member);
    attach_coarse(coarse, 1.0, events, member);
    return events;
}
