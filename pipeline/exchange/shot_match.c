/* From cameras' own lists of pictures to the shots of a sweep. */
#include "pipeline/exchange/shot_match_priv.h"

#include "proto/base/sort.h"

#include <math.h>

#define FINE 0.01 /* s, of a clock that tells parts of seconds */
#define LINE 0.1  /* s, of times that a steady pace stands for */
#define SAME 0.17 /* stops: exposures that are meant to be one */
#define JOIN 0.35 /* of the least time between two shots: pictures of one moment */
#define ITEMS_MAX 65536

/* Sorts; NaN where there is none. */
static double median(GArray *values)
{
    return values->len ? lumi_sort_median((double *)(void *)values->data, (int)values->len) : NAN;
}

/* Brackets */

/* Where in a repetition of `period` items a position begins: behind the longest of the pauses; by the first item where
 * times do not tell. */
static int find_begin(const struct lumi_shot_item *items, int count, int period)
{
    int begin = 0;
    double longest = 0, shortest = INFINITY;

    for (int phase = 0; phase < period; phase++) {
        g_autoptr(GArray) gaps = g_array_new(FALSE, FALSE, sizeof(double));
        for (int i = phase ? phase : period; i < count; i += period) {
            double gap = items[i].time - items[i - 1].time;
            if (isfinite(gap))
                g_array_append_val(gaps, gap);
        }
        double gap = median(gaps);
        shortest = fmin(shortest, gap);
        if (gap > longest) {
            longest = gap;
            begin = phase;
        }
    }
    return longest > 1.2 * shortest ? begin : 0;
}

static bool repeats(const struct lumi_shot_item *items, int count, int period)
{
    int same = 0, known = 0;

    for (int i = period; i < count; i++) {
        double off = items[i].stops - items[i - period].stops;
        known += isfinite(off) ? 1 : 0;
        same += fabs(off) < SAME ? 1 : 0;
    }
    return known >= 2 * period && same >= 0.8 * known;
}

int lumi_shot_find_bracket(const struct lumi_shot_item *items, int count, double offsets[LUMI_SHOT_BRACKET])
{
    double sorted[LUMI_SHOT_BRACKET];
    int period = 1;

    offsets[0] = 0;
    while (period <= LUMI_SHOT_BRACKET && !repeats(items, count, period))
        period++;
    if (period == 1 || period > LUMI_SHOT_BRACKET)
        return 1;
    int begin = find_begin(items, count, period);
    for (int k = 0; k < period; k++) {
        g_autoptr(GArray) stops = g_array_new(FALSE, FALSE, sizeof(double));
        for (int i = (begin + k) % period; i < count; i += period)
            if (isfinite(items[i].stops))
                g_array_append_val(stops, items[i].stops);
        sorted[k] = offsets[k] = median(stops);
    }
    lumi_sort_doubles(sorted, period);
    for (int k = 0; k < period; k++)
        offsets[k] = round((offsets[k] - sorted[period / 2]) * 3) / 3;
    return period;
}

/* Places in the bracket by exposure: about the level at which most items fit. */
static void label_by_exposure(struct shot_track *track, const struct lumi_shot_plan *plan)
{
    const struct lumi_shot_item *items = track->camera->items;
    double level = NAN;
    int most = 0;

    for (int i = 0; i < track->count; i += 1 + track->count / 32)
        for (int k = 0; k < plan->bracket && isfinite(items[i].stops); k++) {
            double base = items[i].stops - plan->offsets[k];
            int fit = 0;
            for (int j = 0; j < track->count; j++)
                for (int l = 0; l < plan->bracket; l++)
                    fit += fabs(items[j].stops - base - plan->offsets[l]) < SAME ? 1 : 0;
            if (fit > most) {
                most = fit;
                level = base;
            }
        }
    for (int i = 0; i < track->count; i++) {
        int fits = 0;
        track->labels[i] = -1;
        for (int k = 0; k < plan->bracket; k++)
            if (fabs(items[i].stops - level - plan->offsets[k]) < 2 * SAME) {
                track->labels[i] = k;
                fits++;
            }
        if (fits > 1)
            track->labels[i] = -1;
    }
}

static double middle_gap(const struct shot_track *track)
{
    g_autoptr(GArray) gaps = g_array_new(FALSE, FALSE, sizeof(double));

    for (int i = 1; i < track->count; i++) {
        double gap = track->times[i] - track->times[i - 1];
        g_array_append_val(gaps, gap);
    }
    return median(gaps);
}

/* Where exposures do not tell: by the pauses between brackets. */
static void label_by_pauses(struct shot_track *track, int bracket)
{
    double longest = 1.5 * middle_gap(track);
    int label = -1;

    for (int i = 1; i < track->count; i++) {
        if (track->times[i] - track->times[i - 1] > longest)
            label = 0;
        else if (label >= 0)
            label++;
        track->labels[i] = label < bracket ? label : -1;
    }
}

static void set_labels(struct shot_track *track, const struct lumi_shot_plan *plan)
{
    int known = 0;

    if (plan->bracket == 1)
        return;
    label_by_exposure(track, plan);
    for (int i = 0; i < track->count; i++)
        known += track->labels[i] >= 0 ? 1 : 0;
    if (known < track->count / 2 && track->timed)
        label_by_pauses(track, plan->bracket);
}

/* Tracks */

/* Items whose time is not known stand midway between those around them. */
static void fill_times(struct shot_track *track)
{
    for (int i = 0; i < track->count; i++) {
        if (isfinite(track->times[i]))
            continue;
        int next = i;
        while (next < track->count && !isfinite(track->times[next]))
            next++;
        double before = i > 0 ? track->times[i - 1] : track->times[next] - 1;
        double step = next < track->count ? (track->times[next] - before) / (next - i + 1)
                      : i > 1             ? track->times[i - 1] - track->times[i - 2]
                                          : 1;
        for (int k = i; k < next; k++)
            track->times[k] = before + step * (k - i + 1);
        i = next;
    }
}

/* Whole seconds that a steady pace explains are replaced by it: the line through them, where each lies within its
 * second. Otherwise pictures of one second lie evenly in it. */
static void spread_seconds(struct shot_track *track)
{
    double middle = (track->count - 1) / 2.0, mean = 0, slope = 0, squares = 0;
    bool steady = track->count > 8;

    for (int i = 0; i < track->count; i++)
        mean += (track->times[i] + 0.5) / track->count;
    for (int i = 0; i < track->count; i++) {
        slope += (i - middle) * (track->times[i] + 0.5 - mean);
        squares += (i - middle) * (i - middle);
    }
    slope /= fmax(squares, 1);
    for (int i = 0; i < track->count; i++)
        steady = steady && fabs(mean + slope * (i - middle) - track->times[i] - 0.5) < 0.75;
    for (int i = 0; steady && i < track->count; i++)
        track->times[i] = mean + slope * (i - middle);
    if (steady) {
        track->resolution = LINE;
        return;
    }
    for (int i = 0; i < track->count;) {
        int same = i;
        while (same < track->count && track->times[same] == track->times[i])
            same++;
        double second = track->times[i];
        for (int k = i; k < same; k++)
            track->times[k] = second + (k - i + 0.5) / (same - i);
        i = same;
    }
}

static void init_track(struct shot_track *track, const struct lumi_shot_camera *camera)
{
    int known = 0, whole = 0;

    *track = (struct shot_track){.camera = camera, .count = camera->count, .resolution = FINE};
    track->times = g_new(double, MAX(camera->count, 1));
    track->labels = g_new(int, MAX(camera->count, 1));
    for (int i = 0; i < camera->count; i++) {
        track->times[i] = camera->items[i].time;
        track->labels[i] = -1;
        known += isfinite(track->times[i]) ? 1 : 0;
        whole += track->times[i] == floor(track->times[i]) ? 1 : 0;
    }
    track->timed = known >= 2 && 2 * known > camera->count;
    if (!track->timed)
        return;
    if (whole == known && known > 3) {
        track->resolution = 1;
        fill_times(track);
        spread_seconds(track);
    }
    fill_times(track);
}

/* The finest and longest track. */
static int choose_reference(const struct shot_track *tracks, int count)
{
    int best = -1;

    for (int c = 0; c < count; c++) {
        if (!tracks[c].timed)
            continue;
        if (best < 0 || tracks[c].resolution < tracks[best].resolution ||
            (tracks[c].resolution == tracks[best].resolution && tracks[c].count > tracks[best].count))
            best = c;
    }
    return best;
}

/* The median time from an item to the one `ahead` of it, among those of a place in the bracket (−1: any). */
static double typical_step(const struct shot_track *tracks, int count, double resolution, int label, int ahead, int to)
{
    g_autoptr(GArray) steps = g_array_new(FALSE, FALSE, sizeof(double));

    for (int c = 0; c < count; c++)
        for (int i = 0; tracks[c].timed && tracks[c].resolution <= resolution && i + ahead < tracks[c].count; i++) {
            double step = tracks[c].times[i + ahead] - tracks[c].times[i];
            if (label < 0 || (tracks[c].labels[i] == label && tracks[c].labels[i + ahead] == to))
                g_array_append_val(steps, step);
        }
    return median(steps);
}

static void find_beat(const struct shot_track *tracks, int count, int reference, const struct lumi_shot_plan *plan,
                      struct shot_beat *beat)
{
    const struct shot_track *track = &tracks[reference];
    double resolution = track->resolution;

    *beat = (struct shot_beat){.bracket = plan->bracket};
    beat->period = typical_step(tracks, count, resolution, -1, plan->bracket, -1);
    if (plan->bracket == 1 && resolution > beat->period / 2 && track->count > 4) {
        /* Whole seconds: the middle of the list as a whole says more than any two of it. */
        int from = track->count / 8, to = track->count - 1 - from;
        beat->period = (track->times[to] - track->times[from]) / (to - from);
    }
    if (!(beat->period > 0))
        beat->period = 1;
    beat->least = beat->period;
    for (int k = 1; k < plan->bracket; k++) {
        double step = typical_step(tracks, count, resolution, k - 1, 1, k);
        if (!(step > 0) || beat->within[k - 1] + step > beat->period)
            step = (beat->period - beat->within[k - 1]) / (plan->bracket - k + 1);
        beat->within[k] = beat->within[k - 1] + step;
        beat->least = fmin(beat->least, step);
    }
    beat->least = fmin(beat->least, beat->period - beat->within[plan->bracket - 1]);
}

/* Results */

/* As many items between two with shots as there are shots between those: they are meant, where their times are a guess
 * or near. */
static void fill_between(const struct shot_track *track, struct lumi_shot_camera *camera, const struct shot_beat *beat)
{
    int last = -1;

    for (int i = 0; i < camera->count; i++) {
        if (camera->shots[i] < 0)
            continue;
        int items = i - last - 1, shots = last < 0 ? 0 : camera->shots[i] - camera->shots[last] - 1;
        for (int k = 1; items > 0 && items == shots && k <= items; k++) {
            double from = track->times[last];
            double part = (track->times[last + k] - from) / (track->times[i] - from) * (shots + 1);
            if (isnan(camera->items[last + k].time) || track->resolution > beat->least || fabs(part - k) < 0.5)
                camera->shots[last + k] = camera->shots[last] + k;
        }
        last = i;
    }
}

static void match_in_order(struct lumi_shot_camera *camera, int shots)
{
    camera->by_order = true;
    for (int i = 0; i < camera->count; i++)
        camera->shots[i] = i < shots ? i : -1;
    camera->ambiguous = camera->count != shots;
}

static void take_results(const struct shot_track *track, const GArray *events, const int *member,
                         const struct shot_beat *beat, struct lumi_shot_camera *camera)
{
    int fitted = 0, last = -1;

    for (int i = 0; i < camera->count; i++) {
        const struct shot_event *event = member[i] >= 0 ? &g_array_index(events, struct shot_event, member[i]) : NULL;
        camera->shots[i] = event && event->shot > last ? event->shot : -1;
        if (camera->shots[i] < 0)
            continue;
        double off = shot_common_time(track, track->times[i]) - event->time;
        last = camera->shots[i];
        fitted++;
        camera->residual += off * off;
        camera->worst = fmax(camera->worst, fabs(off));
    }
    camera->residual = fitted ? sqrt(camera->residual / fitted) : 0;
    camera->offset = track->offset;
    camera->drift = track->drift;
    camera->ambiguous = track->ambiguous;
    camera->coarse = track->resolution > beat->least;
    fill_between(track, camera, beat);
}

static int match_timed(struct shot_track *tracks, struct lumi_shot_camera *cameras, int count, int reference,
                       const struct lumi_shot_plan *plan, struct lumi_error *error)
{
    int *member[SHOT_TRACKS] = {0};
    struct shot_beat beat;
    int timed = 0;

    find_beat(tracks, count, reference, plan, &beat);
    shot_align_clocks(tracks, count, reference, &beat);
    for (int c = 0; c < count; c++)
        timed += tracks[c].timed ? 1 : 0;
    g_autoptr(GArray) events = shot_join_events(tracks, count, JOIN * beat.least, member);
    int code = shot_lay_events(events, timed, plan->shots, &beat, error);
    for (int c = 0; c < count; c++) {
        if (code == LUMI_OK && tracks[c].timed)
            take_results(&tracks[c], events, member[c], &beat, &cameras[c]);
        g_free(member[c]);
    }
    return code;
}

int lumi_shot_match(const struct lumi_shot_plan *plan, struct lumi_shot_camera *cameras, int count,
                    struct lumi_error *error)
{
    struct shot_track tracks[SHOT_TRACKS];
    int code = LUMI_OK;

    if (plan->shots < 1 || plan->bracket < 1 || plan->bracket > LUMI_SHOT_BRACKET || count < 1 || count > SHOT_TRACKS)
        return lumi_fail(error, LUMI_ERR_ARG, "%d shots in brackets of %d by %d cameras are no sweep", plan->shots,
                         plan->bracket, count);
    for (int c = 0; c < count; c++)
        if (cameras[c].count > ITEMS_MAX)
            return lumi_fail(error, LUMI_ERR_LIMIT, "a camera of %d pictures; %d are the most", cameras[c].count,
                             ITEMS_MAX);
    for (int c = 0; c < count; c++) {
        init_track(&tracks[c], &cameras[c]);
        set_labels(&tracks[c], plan);
    }
    int reference = choose_reference(tracks, count);
    if (reference >= 0)
        code = match_timed(tracks, cameras, count, reference, plan, error);
    for (int c = 0; c < count; c++) {
        if (!tracks[c].timed)
            match_in_order(&cameras[c], plan->shots);
        for (int i = 0; code == LUMI_OK && i < cameras[c].count; i++)
            cameras[c].matched += cameras[c].shots[i] >= 0 ? 1 : 0;
        g_free(tracks[c].times);
        g_free(tracks[c].labels);
    }
    return code;
}
