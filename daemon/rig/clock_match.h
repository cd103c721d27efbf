/* The board's clock against the host's, from round trips: where it stands (offset), how much faster it goes (drift),
 * and how well that fits (residual). Reads no clock.
 *
 * Of every few round trips the quickest counts: it had the least time to be delayed on one way only (Mills 1991,
 * "Internet time synchronization: the Network Time Protocol", clock filter). A weighted straight line through those of
 * the last minutes gives offset and drift. A round trip's offset is never wrong by more than half of it: a sample that
 * the line misses by more than that says that the board has started again (or the host was asleep), and the past is
 * forgotten. */
#ifndef LUMI_DAEMON_RIG_CLOCK_MATCH_H
#define LUMI_DAEMON_RIG_CLOCK_MATCH_H

#include <stdbool.h>
#include <stdint.h>

#define LUMI_CLOCK_WINDOW 256     /* round trips: two minutes of heartbeats */
#define LUMI_CLOCK_DRIFT_MAX 1e-3 /* no crystal is worse */

struct lumi_clock_sample {
    uint64_t host_sent_ns, board_received_ns, board_sent_ns, host_received_ns;
};

struct lumi_clock_match {
    struct lumi_clock_sample samples[LUMI_CLOCK_WINDOW];
    int count, next;
    uint32_t restarts; /* how often the past was forgotten */
    /* The line: board = board_at + (host − host_at) · (1 + drift). */
    uint64_t host_at, board_at;
    double drift;
    bool drift_known;     /* two seconds of round trips; before, drift and residual are 0 */
    double residual_ns;   /* root of the weighted mean square */
    double round_trip_ns; /* the quickest: half of it bounds the error of the offset that no fit can see */
};

void lumi_clock_match_init(struct lumi_clock_match *match);
/* Forgets all: another start of the board (Welcome.boot). */
void lumi_clock_match_restart(struct lumi_clock_match *match);
/* False: a sample that cannot be (times run backwards); it is left out. */
bool lumi_clock_match_add(struct lumi_clock_match *match, const struct lumi_clock_sample *sample);

bool lumi_clock_matched(const struct lumi_clock_match *match);
/* 0 where nothing is known, or before the clock began. */
uint64_t lumi_clock_to_host(const struct lumi_clock_match *match, uint64_t board_ns);
uint64_t lumi_clock_to_board(const struct lumi_clock_match *match, uint64_t host_ns);

#endif
