/* A camera's clock against the host's: a straight line through the latest pairs of frame and exposure (least squares),
 * and the usual delay of its frames. */
#include "daemon/engine/match_priv.h"

#include <math.h>

#define DRIFT_SPAN 4.0  /* s of pairs before a drift is believed */
#define DRIFT_MOST 2e-3 /* no camera's crystal is worse; what says so is noise */
#define TOLERANCE 0.01  /* s, between the intervals of two clocks */
#define LATENCY_NEW 0.1 /* share of a new delay in the usual one */

int64_t match_to_host(const struct lumi_match *match, int64_t device_ns)
{
    double away = (double)(device_ns - match->device_at);

    return match->host_at + (device_ns - match->device_at) + (int64_t)(away * match->drift);
}

int64_t match_when(const struct lumi_match *match, const struct lumi_match_frame *frame)
{
    if (match->options.device_clock && match->clock_known && frame->device_ns != LUMI_MATCH_NO_TIME)
        return match_to_host(match, frame->device_ns);
    return frame->host_ns - (int64_t)(match->latency * 1e9);
}

bool match_from_future(const struct lumi_match *match, const struct lumi_match_frame *frame)
{
    double ahead = (double)(match_to_host(match, frame->device_ns) - frame->host_ns) * 1e-9;

    return ahead > match->options.early + (match->pair_count ? 2 * TOLERANCE : match_half(match));
}

void match_forget(struct lumi_match *match)
{
    match->clock_known = false;
    match->pair_count = match->pair_next = 0;
    match->residual_sum = 0;
    match->residual_count = 0;
    match->drift = 0;
    match->strays = 0;
}

double match_cold_wait(const struct lumi_match *match)
{
    double gap = match->options.spacing;
    const int n = match->exposure_count;

    for (int i = n > 4 ? n - 4 : 1; i < n; i++)
        gap = fmax(gap, (double)(match->exposures[i].at - match->exposures[i - 1].at) * 1e-9);
    return fmin(1.6 * gap + match->options.settle, match->options.patience / 2);
}

/* How many of the other frames would be of no exposure if this one were of exposure i; −1: one had come too early. */
static int misfits(const struct lumi_match *match, int place, int i, int64_t now)
{
    const int64_t offset = match->exposures[i].at - match->frames[place].device_ns;
    const int64_t last = match->exposures[match->exposure_count - 1].at;
    const double tolerance = fmin(match_half(match), 2 * TOLERANCE);
    int misfits = 0;

    for (int k = 0; k < match->frame_count; k++) {
        const struct lumi_match_frame *other = match->frames + k;
        if (k == place || other->device_ns == LUMI_MATCH_NO_TIME)
            continue;
        int64_t at = other->device_ns + offset;
        if ((double)(at - other->host_ns) * 1e-9 > match->options.early)
            return -1;
        /* What was exposed just now nobody may have told of yet. */
        const int64_t told = at > match->deaf_ns ? at : match->deaf_ns;
        if ((double)(at - last) * 1e-9 <= tolerance || (double)(now - told) * 1e-9 > match->options.settle)
            misfits += match_nearest_within(match, at, tolerance, false) < 0;
    }
    return misfits;
}

int match_cold(const struct lumi_match *match, int place, int64_t now)
{
    int best = -1, fewest = INT32_MAX;

    for (int i = 0; i < match->exposure_count; i++) {
        if (!match_could_be(match, i, match->frames + place))
            continue;
        int here = misfits(match, place, i, now);
        if (here >= 0 && here <= fewest) {
            fewest = here;
            best = i;
        }
    }
    return best;
}

/* About the newest pair, so that nothing large is squared. */
static void fit(struct lumi_match *match)
{
    const struct match_pair *newest = &match->pairs[(match->pair_next + MATCH_PAIRS - 1) % MATCH_PAIRS];
    double sum_x = 0, sum_y = 0, sum_xx = 0, sum_xy = 0, first = 0;
    const int n = match->pair_count;

    for (int i = 0; i < n; i++) {
        double x = (double)(match->pairs[i].device - newest->device) * 1e-9;
        double y = (double)((match->pairs[i].host - newest->host) - (match->pairs[i].device - newest->device)) * 1e-9;
        sum_x += x;
        sum_y += y;
        sum_xx += x * x;
        sum_xy += x * y;
        first = x < first ? x : first;
    }
    double spread = sum_xx - sum_x * sum_x / n, drift = 0;
    if (-first >= DRIFT_SPAN && spread > 0)
        drift = (sum_xy - sum_x * sum_y / n) / spread;
    if (fabs(drift) > DRIFT_MOST)
        drift = 0;
    match->drift = drift;
    match->device_at = newest->device;
    match->host_at = newest->host + (int64_t)((sum_y - drift * sum_x) / n * 1e9);
    match->clock_known = true;
}

double match_clock_add(struct lumi_match *match, const struct lumi_match_frame *frame, int64_t host_ns)
{
    double residual = 0;

    if (!match->options.device_clock || frame->device_ns == LUMI_MATCH_NO_TIME)
        return 0;
    if (match->clock_known && match->pair_count >= 2) {
        residual = (double)(match_to_host(match, frame->device_ns) - host_ns) * 1e-9;
        match->residual_sum += residual * residual;
        match->residual_count++;
        if (fabs(residual) > match->counts.residual_worst_s)
            match->counts.residual_worst_s = fabs(residual);
    }
    match->pairs[match->pair_next] = (struct match_pair){frame->device_ns, host_ns};
    match->pair_next = (match->pair_next + 1) % MATCH_PAIRS;
    match->pair_count += match->pair_count < MATCH_PAIRS;
    fit(match);
    return residual;
}

void match_latency_add(struct lumi_match *match, double latency)
{
    if (match->latency <= 0)
        match->latency = latency > 0 ? latency : 1e-6;
    else if (latency < 2 * match->latency + 0.1) /* a late one says nothing of the usual */
        match->latency += LATENCY_NEW * (latency - match->latency);
    if (match->latency < 1e-6)
        match->latency = 1e-6;
}

void lumi_match_prior(struct lumi_match *match, const struct lumi_match_frame *frame, int64_t exposed_ns)
{
    double latency = (double)(frame->host_ns - exposed_ns) * 1e-9;

    lumi_match_restart(match);
    match->latency = latency > 1e-6 ? latency : 1e-6;
    match->last = match->exposure_count - 1; /* the next that it counts is the next exposure */
    match->last_sequence = frame->sequence;
    match->sequence_known = true;
    if (frame->device_ns == LUMI_MATCH_NO_TIME || !match->options.device_clock)
        return;
    match->device_at = frame->device_ns;
    match->host_at = exposed_ns;
    match->clock_known = true;
}

bool match_clock_stepped(struct lumi_match *match, int place, int64_t now)
{
    const struct lumi_match_frame *frame = match->frames + place;
    const double half = match_half(match);

    if (match->latency <= 0 || (double)(now - frame->host_ns) * 1e-9 < match->options.settle)
        return false;
    int here = match_nearest(match, frame->host_ns - (int64_t)(match->latency * 1e9), true);
    for (int i = 0; here >= 0 && i < match->frame_count; i++) {
        const struct lumi_match_frame *other = match->frames + i;
        int there = match_nearest(match, other->host_ns - (int64_t)(match->latency * 1e9), true);
        if (i == place || there < 0 || there == here || other->device_ns == LUMI_MATCH_NO_TIME)
            continue;
        double host_apart = (double)(match->exposures[there].at - match->exposures[here].at) * 1e-9;
        double device_apart = (double)(other->device_ns - frame->device_ns) * 1e-9;
        if (fabs(host_apart - device_apart) > half / 2)
            continue;
        match_forget(match);
        return true;
    }
    return false;
}

void lumi_match_clock(const struct lumi_match *match, struct lumi_match_clock *clock)
{
    *clock = match->counts;
    clock->known = match->clock_known;
    clock->offset_s = match->clock_known ? (double)match->host_at * 1e-9 - (double)match->device_at * 1e-9 : 0;
    clock->drift_ppm = match->drift * 1e6;
    clock->residual_s = match->residual_count ? sqrt(match->residual_sum / (double)match->residual_count) : 0;
    clock->latency_s = match->latency;
}
