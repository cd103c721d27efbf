/* A line through the quickest round trips. */
#include "daemon/rig/clock_match.h"

#include <math.h>
#include <string.h>

#define GROUPS 32            /* points of the line at most: the quickest of each group of neighbouring samples */
#define DRIFT_SPAN_NS 2e9    /* no drift is told from less */
#define FLOOR_NS 2000.0      /* what a round trip varies by at best: scheduling, a USB frame's jitter aside */
#define JUMP_SLACK_NS 200000 /* beyond half a round trip: the line's own error */

struct point {
    double host, offset, excess; /* ns, against the newest sample; excess: round trip over the quickest of all */
};

void lumi_clock_match_init(struct lumi_clock_match *match)
{
    memset(match, 0, sizeof *match);
}

void lumi_clock_match_restart(struct lumi_clock_match *match)
{
    uint32_t restarts = match->restarts + (match->count > 0);

    memset(match, 0, sizeof *match);
    match->restarts = restarts;
}

static double round_trip(const struct lumi_clock_sample *sample)
{
    double host = (double)(sample->host_received_ns - sample->host_sent_ns);
    double board = (double)(sample->board_sent_ns - sample->board_received_ns);

    return fmax(host - board, 0);
}

/* The middles of the two stays: at the host's the board's clock stood at the board's, give or take half the trip. */
static uint64_t host_middle(const struct lumi_clock_sample *sample)
{
    return sample->host_sent_ns + (sample->host_received_ns - sample->host_sent_ns) / 2;
}

static uint64_t board_middle(const struct lumi_clock_sample *sample)
{
    return sample->board_received_ns + (sample->board_sent_ns - sample->board_received_ns) / 2;
}

static const struct lumi_clock_sample *sample_at(const struct lumi_clock_match *match, int age)
{
    return &match->samples[(match->next - 1 - age + 2 * LUMI_CLOCK_WINDOW) % LUMI_CLOCK_WINDOW];
}

static int pick_points(const struct lumi_clock_match *match, struct point *points)
{
    const struct lumi_clock_sample *newest = sample_at(match, 0);
    int size = (match->count + GROUPS - 1) / GROUPS, count = 0;

    /* Young: groups of one would let every delayed trip in; some are needed to see a slope. */
    if (size < 4 && match->count >= 8)
        size = match->count >= 16 ? 4 : 2;
    for (int first = 0; first < match->count; first += size) {
        const struct lumi_clock_sample *best = sample_at(match, first);
        for (int age = first + 1; age < first + size && age < match->count; age++)
            if (round_trip(sample_at(match, age)) < round_trip(best))
                best = sample_at(match, age);
        double host = (double)(int64_t)(host_middle(best) - host_middle(newest));
        double board = (double)(int64_t)(board_middle(best) - board_middle(newest));
        points[count++] = (struct point){host, board - host, round_trip(best) - match->round_trip_ns};
    }
    return count;
}

static double weight_of(const struct point *point, double floor)
{
    double error = point->excess + floor;

    return 1 / (error * error);
}

static void fit(struct lumi_clock_match *match)
{
    const struct lumi_clock_sample *newest = sample_at(match, 0);
    struct point points[LUMI_CLOCK_WINDOW];
    double sum = 0, host = 0, offset = 0, hh = 0, ho = 0, square = 0, floor, span;
    int count;

    match->round_trip_ns = INFINITY;
    for (int age = 0; age < match->count; age++)
        match->round_trip_ns = fmin(match->round_trip_ns, round_trip(sample_at(match, age)));
    floor = FLOOR_NS + 0.02 * match->round_trip_ns;
    count = pick_points(match, points);
    for (int i = 0; i < count; i++) {
        double weight = weight_of(&points[i], floor);
        sum += weight;
        host += weight * points[i].host;
        offset += weight * points[i].offset;
    }
    host /= sum;
    offset /= sum;
    for (int i = 0; i < count; i++) {
        double weight = weight_of(&points[i], floor), x = points[i].host - host;
        hh += weight * x * x;
        ho += weight * x * (points[i].offset - offset);
    }
    span = points[0].host - points[count - 1].host;
    match->drift = 0;
    match->drift_known = count >= 3 && span >= DRIFT_SPAN_NS && hh > 0;
    if (match->drift_known)
        match->drift = fmax(fmin(ho / hh, LUMI_CLOCK_DRIFT_MAX), -LUMI_CLOCK_DRIFT_MAX);
    for (int i = 0; i < count; i++) {
        double miss = points[i].offset - offset - match->drift * (points[i].host - host);
        square += weight_of(&points[i], floor) * miss * miss;
    }
    match->residual_ns = sqrt(square / sum);
    match->host_at = host_middle(newest);
    match->board_at = board_middle(newest) + (uint64_t)(int64_t)llround(offset - match->drift * host);
}

/* Whether the line, as it is, could have produced this sample. */
static bool jumps(const struct lumi_clock_match *match, const struct lumi_clock_sample *sample)
{
    double elapsed = (double)(int64_t)(host_middle(sample) - match->host_at);
    double expected = elapsed * (1 + match->drift);
    double seen = (double)(int64_t)(board_middle(sample) - match->board_at);
    double allowed =
        round_trip(sample) / 2 + match->round_trip_ns / 2 + JUMP_SLACK_NS + LUMI_CLOCK_DRIFT_MAX * fabs(elapsed);

    return fabs(seen - expected) > allowed;
}

bool lumi_clock_match_add(struct lumi_clock_match *match, const struct lumi_clock_sample *sample)
{
    if (sample->host_received_ns < sample->host_sent_ns || sample->board_sent_ns < sample->board_received_ns)
        return false;
    if (match->count && jumps(match, sample))
        lumi_clock_match_restart(match);
    match->samples[match->next] = *sample;
    match->next = (match->next + 1) % LUMI_CLOCK_WINDOW;
    if (match->count < LUMI_CLOCK_WINDOW)
        match->count++;
    fit(match);
    return true;
}

bool lumi_clock_matched(const struct lumi_clock_match *match)
{
    return match->count > 0;
}

static uint64_t shifted(uint64_t from, double by)
{
    if (by < 0 && -by > (double)from)
        return 0;
    return from + (uint64_t)(int64_t)llround(by);
}

uint64_t lumi_clock_to_host(const struct lumi_clock_match *match, uint64_t board_ns)
{
    if (!match->count)
        return 0;
    return shifted(match->host_at, (double)(int64_t)(board_ns - match->board_at) / (1 + match->drift));
}

uint64_t lumi_clock_to_board(const struct lumi_clock_match *match, uint64_t host_ns)
{
    if (!match->count)
        return 0;
    return shifted(match->board_at, (double)(int64_t)(host_ns - match->host_at) * (1 + match->drift));
}
