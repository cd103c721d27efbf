/* Matching frames to exposures as both come in. match.h says what; match_clock.c fits the clocks. */
#include "daemon/engine/match_priv.h"
#include "proto/base/memory.h"

#include <math.h>
#include <string.h>

#define PERIOD_NEW 0.2 /* share of a new interval in the period of frames that come by themselves */
#define PERIOD_MOST_NS 2e9
#define CLOCK_SLACK 0.02  /* s, a fitted clock may be wrong by: jitter of drivers that take the time late */
#define PRIOR_SLACK 0.15  /* before any frame of a sweep was matched */
#define FIRST_LATENCY 0.5 /* s, of a camera of which nothing is known */
#define STRAYS 2          /* frames of no exposure one after another, while exposures want one: the clock is wrong */
#define LATE_SHARE 0.05   /* of the patience, over twice the usual delay, until a frame is called late */

void lumi_match_options_init(struct lumi_match_options *options)
{
    *options = (struct lumi_match_options){.spacing = 0.4, .patience = 5, .settle = 0.5, .early = 0.002};
}

int lumi_match_create(const struct lumi_match_options *options, struct lumi_match **match, struct lumi_error *error)
{
    struct lumi_match *m = lumi_calloc(1, sizeof *m);

    if (m)
        m->exposures = lumi_calloc(MATCH_EXPOSURES, sizeof *m->exposures);
    if (!m || !m->exposures) {
        lumi_free(m);
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for matching frames");
    }
    m->options = *options;
    m->last = NULL_EXPOSURE;
    m->period = options->period;
    *match = m;
    return LUMI_OK;
}

void lumi_match_destroy(struct lumi_match *match)
{
    if (!match)
        return;
    lumi_free(match->exposures);
    lumi_free(match);
}

void lumi_match_change(struct lumi_match *match, const struct lumi_match_options *options)
{
    match->options = *options;
    match->period = options->period > 0 && match->period > 0 ? match->period : options->period;
}

void lumi_match_sweep(struct lumi_match *match, const struct lumi_match_options *options)
{
    lumi_match_change(match, options);
    match->counts = (struct lumi_match_clock){0};
    match->residual_sum = 0;
    match->residual_count = 0;
    match->finished = false;
}

void lumi_match_restart(struct lumi_match *match)
{
    match->pair_count = match->pair_next = 0;
    match->clock_known = false;
    match->drift = 0;
    match->sequence_known = false;
}

void lumi_match_deaf(struct lumi_match *match, int64_t now_ns)
{
    match->deaf_ns = now_ns;
}

bool lumi_match_expect(struct lumi_match *match, int64_t at_ns, double exposure_s, int shot)
{
    int place = match->exposure_count;

    if (match->exposure_count == MATCH_EXPOSURES && !match_prune(match, INT64_MAX))
        return false;
    place = match->exposure_count;
    while (place > 0 && match->exposures[place - 1].at > at_ns)
        place--;
    memmove(match->exposures + place + 1, match->exposures + place,
            (size_t)(match->exposure_count - place) * sizeof *match->exposures);
    match->exposures[place] =
        (struct match_exposure){.at = at_ns, .length = exposure_s, .shot = shot, .frame_ns = LUMI_MATCH_NO_TIME};
    match->exposure_count++;
    if (match->last >= place)
        match->last++;
    match->finished = false;
    return true;
}

void lumi_match_edge(struct lumi_match *match, int64_t at_ns)
{
    if (match->edge_count == MATCH_EDGES)
        memmove(match->edges, match->edges + 1, --match->edge_count * sizeof *match->edges);
    match->edges[match->edge_count++] = at_ns;
}

/* How often they come: by the camera's clock and count where there are any. */
static void measure_period(struct lumi_match *match, const struct lumi_match_frame *frame)
{
    const struct lumi_match_frame *before = &match->before;
    const bool device = frame->device_ns != LUMI_MATCH_NO_TIME && before->device_ns != LUMI_MATCH_NO_TIME;
    const int64_t apart = device ? frame->device_ns - before->device_ns : frame->host_ns - before->host_ns;
    const uint64_t frames = frame->sequence > before->sequence ? frame->sequence - before->sequence : 1;

    if (before->tag && apart > 0 && apart < (int64_t)PERIOD_MOST_NS)
        match->period += PERIOD_NEW * ((double)apart * 1e-9 / (double)frames - match->period);
    match->before = *frame;
}

void lumi_match_frame(struct lumi_match *match, const struct lumi_match_frame *frame)
{
    if (match->period > 0)
        measure_period(match, frame);
    if (match->frame_count == LUMI_MATCH_FRAMES) /* out of next's way: it is of no exposure that is known */
        match->overflow = true;
    if (match->frame_count < MATCH_WAITING)
        match->frames[match->frame_count++] = *frame;
}

/* ---- which exposure ---- */

double match_half(const struct lumi_match *match)
{
    if (match->period > 0) /* a little more than half: frames do not come quite evenly */
        return 0.75 * match->period;
    return (match->options.window > 0 ? match->options.window : match->options.spacing) / 2;
}

/* How far a frame may be from its exposure by the camera's clock: what the line has missed so far, and what a drift
 * that is not known yet can do. A frame that nobody asked for may lie anywhere between two exposures. */
static double clock_slack(const struct lumi_match *match, int64_t device_ns)
{
    const double half = match_half(match);
    double slack = match->pair_count ? CLOCK_SLACK : PRIOR_SLACK;

    if (match->residual_count)
        slack += 6 * sqrt(match->residual_sum / (double)match->residual_count);
    if (match->drift == 0)
        slack += 2e-4 * fabs((double)(device_ns - match->device_at) * 1e-9);
    return slack < half ? slack : half;
}

/* Index of the exposure nearest to `at` within `best` seconds, or −1; `open`: only those without a frame. */
int match_nearest_within(const struct lumi_match *match, int64_t at, double best, bool open)
{
    int found = -1;

    for (int i = 0; i < match->exposure_count; i++) {
        double away = fabs((double)(match->exposures[i].at - at) * 1e-9);
        if (away <= best && !(open && match->exposures[i].matched)) {
            best = away;
            found = i;
        }
    }
    return found;
}

int match_nearest(const struct lumi_match *match, int64_t at, bool open)
{
    return match_nearest_within(match, at, match_half(match), open);
}

bool match_could_be(const struct lumi_match *match, int i, const struct lumi_match_frame *frame)
{
    const struct match_exposure *e = match->exposures + i;
    double latency = (double)(frame->host_ns - e->at) * 1e-9;

    return !e->matched && latency >= e->length - match->options.early && latency <= match->options.patience;
}

/* The only one that it can be; −1: none, or several. */
static int only(const struct lumi_match *match, const struct lumi_match_frame *frame)
{
    int found = -1;

    for (int i = 0; i < match->exposure_count; i++)
        if (match_could_be(match, i, frame)) {
            if (found >= 0)
                return -1;
            found = i;
        }
    return found;
}

/* The latest that it can be: delays are shorter than what lies between two exposures, or the camera would fall behind.
 */
static int latest(const struct lumi_match *match, const struct lumi_match_frame *frame)
{
    for (int i = match->exposure_count - 1; i >= 0; i--)
        if (match_could_be(match, i, frame))
            return i;
    return -1;
}

/* By the camera's own count, from the frame before; −1: it does not say. */
static int by_sequence(const struct lumi_match *match, const struct lumi_match_frame *frame)
{
    if (!match->sequence_known || frame->sequence <= match->last_sequence ||
        frame->sequence - match->last_sequence > MATCH_EXPOSURES)
        return -1;
    int64_t at = match->last + (int64_t)(frame->sequence - match->last_sequence);
    return at >= 0 && at < match->exposure_count && match_could_be(match, (int)at, frame) ? (int)at : -1;
}

/* It says that its exposure is one that is not known yet. */
static bool counts_beyond(const struct lumi_match *match, const struct lumi_match_frame *frame)
{
    return match->sequence_known && frame->sequence > match->last_sequence &&
           match->last + (int64_t)(frame->sequence - match->last_sequence) >= match->exposure_count;
}

enum decision { WAIT = -1, NONE = -2, TWICE = -3 }; /* otherwise the exposure */

static bool overdue(const struct lumi_match *match, const struct lumi_match_frame *frame, int64_t now, double seconds)
{
    const int64_t since = frame->host_ns > match->deaf_ns ? frame->host_ns : match->deaf_ns;

    return match->finished || (double)(now - since) * 1e-9 >= seconds;
}

/* A later frame in the list that came so soon after this one that both had been waiting somewhere: +1; none yet: 0; one
 * that kept its distance: −1. */
static int bunched(const struct lumi_match *match, int place)
{
    if (place + 1 >= match->frame_count)
        return 0;
    double apart = (double)(match->frames[place + 1].host_ns - match->frames[place].host_ns) * 1e-9;
    return apart < 0.6 * match->options.spacing ? 1 : -1;
}

/* By its count it is of an exposure that was given up: it was held up for longer than anybody waits. */
static bool counts_given_up(const struct lumi_match *match, const struct lumi_match_frame *frame, int timed)
{
    if (!match->sequence_known || frame->sequence <= match->last_sequence)
        return false;
    int64_t at = match->last + (int64_t)(frame->sequence - match->last_sequence);
    return at >= 0 && at < timed && match->exposures[at].matched;
}

/* Where no count helps, frames that come at once say that they were held up: when they came says nothing. */
static int alone(const struct lumi_match *match, int place, int64_t now)
{
    const struct lumi_match_frame *frame = match->frames + place;
    const double apart = 0.6 * match->options.spacing;

    if (bunched(match, place) > 0 || (double)(frame->host_ns - match->decided_ns) * 1e-9 < apart)
        return NONE;
    return bunched(match, place) < 0 || overdue(match, frame, now, apart) ? 0 : WAIT;
}

/* Without the camera's clock: by arrival and by the camera's count. */
static int by_arrival(const struct lumi_match *match, int place, int64_t now)
{
    const struct lumi_match_frame *frame = match->frames + place;
    const double settle = match->options.settle;

    if (match->latency <= 0) { /* nothing is known yet: the exposures around it must be, first */
        if (!overdue(match, frame, now, settle))
            return WAIT;
        int first = latest(match, frame);
        if (first >= 0 &&
            (double)(frame->host_ns - match->exposures[first].at) * 1e-9 > fmax(match->options.spacing, FIRST_LATENCY))
            first = only(match, frame);
        return first >= 0 ? first : overdue(match, frame, now, match->options.patience) ? NONE : WAIT;
    }
    int timed = match_nearest(match, frame->host_ns - (int64_t)(match->latency * 1e9), false);
    int counted = by_sequence(match, frame);
    if (timed >= 0 && match->exposures[timed].matched) {
        if (match->sequence_known && match->exposures[timed].sequence == frame->sequence)
            return TWICE;
        if (counted >= 0)
            return counted;
        if (!overdue(match, frame, now, settle))
            return WAIT;
        return frame->sequence > match->exposures[timed].sequence && latest(match, frame) > timed ? latest(match, frame)
                                                                                                  : TWICE;
    }
    if (timed >= 0 && counts_given_up(match, frame, timed))
        return NONE;
    if (timed >= 0 && counted < 0 && match_could_be(match, timed, frame)) {
        int others = match->sequence_known ? 0 : alone(match, place, now);
        return others == 0 ? timed : others;
    }
    if (timed >= 0 && counted == timed)
        return timed;
    if (timed >= 0 && counted >= 0 && counted < timed) {
        /* Late by a whole exposure, or the camera missed a trigger: the next frame tells. */
        int sooner = bunched(match, place);
        if (sooner == 0 && !overdue(match, frame, now, 1.5 * match->options.spacing + settle))
            return WAIT;
        return sooner > 0 ? counted : timed;
    }
    if (!overdue(match, frame, now, settle))
        return WAIT;
    if (counted >= 0)
        return counted;
    /* A frame of a wrong shot is worse than one that has to be taken again. */
    int last = counts_beyond(match, frame) ? -1 : only(match, frame);
    return last >= 0 ? last : overdue(match, frame, now, match->options.patience) ? NONE : WAIT;
}

/* Of a camera that nobody triggers. */
static int free_running(const struct lumi_match *match, const struct lumi_match_frame *frame, int64_t now)
{
    const bool device = match->options.device_clock && frame->device_ns != LUMI_MATCH_NO_TIME;
    const int near =
        match_nearest(match, device ? frame->device_ns : frame->host_ns - (int64_t)(match->period * 1e9), true);

    return near >= 0 ? near : overdue(match, frame, now, match->options.settle) ? NONE : WAIT;
}

static bool known_beyond(const struct lumi_match *match, int64_t at)
{
    return match->exposure_count > 0 &&
           (double)(match->exposures[match->exposure_count - 1].at - at) * 1e-9 > match_half(match);
}

/* Nothing is known of the camera's clock: the frames that come next tell which exposure this one is of. */
static int cold(const struct lumi_match *match, int place, int64_t now)
{
    const struct lumi_match_frame *frame = match->frames + place;

    if (place > 0 || !overdue(match, frame, now, match_cold_wait(match))) /* the first brings the clock */
        return WAIT;
    int first = match_cold(match, place, now);
    return first >= 0 ? first : overdue(match, frame, now, match->options.patience) ? NONE : WAIT;
}

static int decide(struct lumi_match *match, int place, int64_t now)
{
    const struct lumi_match_frame *frame = match->frames + place;

    if (match->overflow && place == 0)
        return NONE;
    if (match->period > 0)
        return free_running(match, frame, now);
    if (!match->options.device_clock || frame->device_ns == LUMI_MATCH_NO_TIME)
        return by_arrival(match, place, now);
    if (match->clock_known && match_from_future(match, frame))
        match_forget(match);
    if (!match->clock_known)
        return cold(match, place, now);
    int64_t at = match_to_host(match, frame->device_ns);
    int near = match_nearest_within(match, at, clock_slack(match, frame->device_ns), false);
    if (near >= 0)
        return match->exposures[near].matched ? TWICE : near;
    if (match_clock_stepped(match, place, now))
        return cold(match, place, now);
    /* Exposures on both sides are known and it is of none; or nothing more will be known of that time. */
    if (known_beyond(match, at) && overdue(match, frame, now, match->options.settle) &&
        overdue(match, frame, now, 2.5 * match->options.spacing + match->options.settle))
        return NONE;
    return overdue(match, frame, now, match->options.patience) ? NONE : WAIT;
}

/* ---- verdicts ---- */

static void hit(struct lumi_match *match, int i, const struct lumi_match_frame *frame, struct lumi_match_result *result)
{
    struct match_exposure *e = match->exposures + i;

    *result = (struct lumi_match_result){.kind = LUMI_MATCH_HIT,
                                         .shot = e->shot,
                                         .frame = frame->tag,
                                         .at_ns = e->at,
                                         .gap = frame->gap,
                                         .latency = (double)(frame->host_ns - e->at) * 1e-9};
    result->out_of_order = match->last > i;
    result->late = match->latency > 0 && result->latency > 2 * match->latency + LATE_SHARE * match->options.patience;
    if (match->period > 0)
        result->late = result->out_of_order = false;
    else
        result->residual = match_clock_add(match, frame, e->at);
    match_latency_add(match, result->latency);
    match->strays = 0;
    e->matched = true;
    e->sequence = frame->sequence;
    e->frame_ns = frame->device_ns;
    if (match->last <= i) {
        match->last = i;
        match->last_sequence = frame->sequence;
        match->sequence_known |= frame->sequence != 0;
    }
    match->counts.matched++;
    match->counts.late += result->late;
    match->counts.out_of_order += result->out_of_order;
}

static void take_out(struct lumi_match *match, int place)
{
    match->frame_count--;
    memmove(match->frames + place, match->frames + place + 1,
            (size_t)(match->frame_count - place) * sizeof *match->frames);
    match->overflow = match->frame_count > LUMI_MATCH_FRAMES;
}

static bool next_frame(struct lumi_match *match, int64_t now, struct lumi_match_result *result)
{
    for (int place = 0; place < match->frame_count; place++) {
        struct lumi_match_frame frame = match->frames[place];
        int at = decide(match, place, now);
        if (at == WAIT && !match->finished)
            continue;
        match->decided_ns = frame.host_ns;
        if (at >= 0) {
            hit(match, at, &frame, result);
        } else {
            if (at == NONE && !match->options.device_clock)
                match->sequence_known = false; /* its count leads nowhere */
            *result = (struct lumi_match_result){
                .kind = at == TWICE ? LUMI_MATCH_DOUBLED : LUMI_MATCH_SURPLUS, .shot = -1, .frame = frame.tag};
            result->gap = frame.gap;
            if (at == TWICE) {
                int near = match_nearest(match, match_when(match, &frame), false);
                result->shot = near >= 0 ? match->exposures[near].shot : -1;
                match->counts.doubled++;
            } else {
                match->counts.surplus += match->period <= 0;
                if (latest(match, &frame) >= 0 && ++match->strays >= STRAYS)
                    match_forget(match);
            }
        }
        take_out(match, place);
        return true;
    }
    return false;
}

static bool next_edge(struct lumi_match *match, struct lumi_match_result *result)
{
    for (int k = 0; k < match->edge_count; k++) {
        int near = match_nearest(match, match->edges[k], false);
        if (near < 0)
            continue;
        struct match_exposure *e = match->exposures + near;
        *result = (struct lumi_match_result){.kind = LUMI_MATCH_EXPOSED, .shot = e->shot, .at_ns = match->edges[k]};
        memmove(match->edges + k, match->edges + k + 1, (size_t)(match->edge_count - k - 1) * sizeof *match->edges);
        match->edge_count--;
        if (e->seen) {
            k--;
            continue; /* bounce, or another one's */
        }
        e->seen = true;
        return true;
    }
    return false;
}

/* What is behind its patience and has been told of goes; returns whether there is room now. */
bool match_prune(struct lumi_match *match, int64_t now)
{
    int gone = 0;

    while (gone < match->exposure_count && match->exposures[gone].matched && match->exposures[gone].told &&
           (now == INT64_MAX || (double)(now - match->exposures[gone].at) * 1e-9 > 2 * match->options.patience))
        gone++;
    match->exposure_count -= gone;
    memmove(match->exposures, match->exposures + gone, (size_t)match->exposure_count * sizeof *match->exposures);
    match->last -= gone; /* below 0: before the first that is kept */
    return match->exposure_count < MATCH_EXPOSURES;
}

static bool past(const struct lumi_match *match, const struct match_exposure *e, int64_t now)
{
    return match->finished || (double)(now - e->at) * 1e-9 > match->options.patience + e->length;
}

static bool next_past(struct lumi_match *match, int64_t now, struct lumi_match_result *result)
{
    for (int i = 0; i < match->exposure_count; i++) {
        struct match_exposure *e = match->exposures + i;
        if (!past(match, e, now))
            break;
        if (!e->matched) {
            e->matched = true;
            match->counts.dropped++;
            *result = (struct lumi_match_result){.kind = LUMI_MATCH_DROPPED, .shot = e->shot, .at_ns = e->at};
            return true;
        }
        if (!e->told) {
            e->told = true;
            *result = (struct lumi_match_result){.kind = LUMI_MATCH_UNSEEN, .shot = e->shot, .at_ns = e->at};
            if (match->options.edges && !e->seen)
                return true;
        }
    }
    return false;
}

bool lumi_match_next(struct lumi_match *match, int64_t now_ns, struct lumi_match_result *result)
{
    if (next_edge(match, result) || next_frame(match, now_ns, result) || next_past(match, now_ns, result))
        return true;
    if (match->edge_count > 0 && (double)(now_ns - match->edges[0]) * 1e-9 > match->options.patience)
        memmove(match->edges, match->edges + 1, (size_t)--match->edge_count * sizeof *match->edges);
    match_prune(match, now_ns);
    return false;
}

int64_t lumi_match_wake(const struct lumi_match *match)
{
    int64_t wake = INT64_MAX;

    if (match->frame_count > 0) /* a frame's waits end at one of several times: asked often while there is one */
        wake = match->frames[match->frame_count - 1].host_ns + (int64_t)(match->options.settle * 1e9);
    for (int i = 0; i < match->exposure_count; i++)
        if (!match->exposures[i].matched || !match->exposures[i].told) {
            int64_t end =
                match->exposures[i].at + (int64_t)((match->options.patience + match->exposures[i].length) * 1e9) + 1000;
            wake = end < wake ? end : wake;
            break;
        }
    return wake;
}

void lumi_match_finish(struct lumi_match *match)
{
    match->finished = true;
}

int lumi_match_open(const struct lumi_match *match)
{
    int open = 0;

    for (int i = 0; i < match->exposure_count; i++)
        open += !match->exposures[i].matched;
    return open;
}
