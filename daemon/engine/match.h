/* Which frame is of which exposure: one camera's frames against the exposures that its rig made, by hardware time, as
 * both come in. No thread, no clock, no allocation but at creation; deterministic.
 *
 * What is known of an exposure: when it began by the host's clock (the board's, matched). What is known of a frame:
 * when it began by the camera's clock, when it arrived, its place in the camera's own count. The camera's clock is
 * fitted to the host's by a straight line through the pairs found so far, so that a frame that comes late, or out of
 * order, still finds its exposure. Where a camera has no clock, the time of arrival less its usual delay stands for it,
 * and the camera's count decides where that is not enough.
 *
 * 1. Every frame given ends in one verdict: of an exposure (HIT), of one that has its frame (DOUBLED), of none
 *    (SURPLUS). Every exposure given ends with a frame (HIT) or without (DROPPED).
 * 2. A frame waits until the exposures that it could be of are known; what comes first, frame or exposure, is the same.
 */
#ifndef LUMI_DAEMON_ENGINE_MATCH_H
#define LUMI_DAEMON_ENGINE_MATCH_H

#include "proto/base/result.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define LUMI_MATCH_NO_TIME INT64_MIN
#define LUMI_MATCH_FRAMES 128 /* that wait for their exposure; the oldest of more is SURPLUS */

struct lumi_match_options {
    double spacing;  /* s, least between two exposures */
    double window;   /* s, about an expected time; 0: the spacing */
    double patience; /* s after an exposure until its frame counts as dropped */
    double settle;   /* s, that an exposure may be known later than its frame arrives (0.5) */
    double early;    /* s, by which a frame without clock may seem to arrive before it was taken (0.002) */
    /* s; above 0: frames come by themselves, about one in this time (it is measured from there on), and an exposure
     * gets one that began about when it did. The others are of none, which is no news: they are not counted.
     * device_clock then says that the camera's clock is the host's. */
    double period;
    bool device_clock;
    bool edges; /* every exposure should be seen by an edge (lumi_match_edge) */
};
void lumi_match_options_init(struct lumi_match_options *options);

struct lumi_match_frame {
    int64_t device_ns; /* LUMI_MATCH_NO_TIME: none */
    int64_t host_ns;   /* of its arrival */
    uint64_t sequence; /* the camera's count */
    uint32_t gap;      /* frames that it says were lost just before */
    void *tag;
};

enum lumi_match_kind {
    LUMI_MATCH_HIT = 0,
    LUMI_MATCH_DOUBLED, /* `shot` has a frame already */
    LUMI_MATCH_SURPLUS, /* a frame of no exposure */
    LUMI_MATCH_DROPPED, /* an exposure without a frame */
    LUMI_MATCH_EXPOSED, /* an edge: `at_ns` */
    LUMI_MATCH_UNSEEN   /* an exposure without an edge, where there should be one */
};
struct lumi_match_result {
    enum lumi_match_kind kind;
    int shot;    /* the tag of the exposure; −1 none */
    void *frame; /* the tag of the frame; NULL none */
    int64_t at_ns;
    bool late, out_of_order;
    uint32_t gap;
    double latency, residual; /* s; of a HIT: arrival after the exposure's begin; by how much the clocks miss */
};

struct lumi_match_clock {
    bool known;                          /* the camera's clock has a place */
    double offset_s;                     /* host less camera, at the last frame */
    double drift_ppm;                    /* of the camera's clock against the host's; 0 until some seconds are known */
    double residual_s, residual_worst_s; /* root mean square and worst, of the sweep */
    double latency_s;                    /* usual; 0 unknown */
    uint64_t matched, dropped, doubled, late, out_of_order, surplus; /* of the sweep */
};

struct lumi_match;
int lumi_match_create(const struct lumi_match_options *options, struct lumi_match **match, struct lumi_error *error);
void lumi_match_destroy(struct lumi_match *match); /* NULL is fine; frames that wait are the caller's */

/* Another sweep: counts and residuals begin anew, what is known of the clock stays. */
void lumi_match_sweep(struct lumi_match *match, const struct lumi_match_options *options);
/* A frame of a test whose time is known to some milliseconds: where the clock stands, and the usual delay. */
void lumi_match_prior(struct lumi_match *match, const struct lumi_match_frame *frame, int64_t exposed_ns);
/* What holds from now on; all that is known stays. */
void lumi_match_change(struct lumi_match *match, const struct lumi_match_options *options);
/* The camera was away: its clock and its count have begun anew. */
void lumi_match_restart(struct lumi_match *match);

/* An exposure that began at at_ns (host) and took exposure_s. Its verdict comes once. False: no room (over 8192). */
bool lumi_match_expect(struct lumi_match *match, int64_t at_ns, double exposure_s, int shot);
void lumi_match_edge(struct lumi_match *match, int64_t at_ns);
void lumi_match_frame(struct lumi_match *match, const struct lumi_match_frame *frame);
/* Until now nobody could tell of exposures (the board is away): frames wait for them from now on, not from when they
 * came. */
void lumi_match_deaf(struct lumi_match *match, int64_t now_ns);
/* The next verdict; false: none now. */
bool lumi_match_next(struct lumi_match *match, int64_t now_ns, struct lumi_match_result *result);
/* When time alone will bring one; INT64_MAX: never. */
int64_t lumi_match_wake(const struct lumi_match *match);
/* Nothing more will come: every frame and exposure that waits gets its verdict from the next calls. */
void lumi_match_finish(struct lumi_match *match);
int lumi_match_open(const struct lumi_match *match); /* exposures that wait for their frame */
void lumi_match_clock(const struct lumi_match *match, struct lumi_match_clock *clock);

/* For cameras that record by themselves: the times of their files (any clock, in order of their names) against the
 * exposures', all at once. `pairs` gets for every file the exposure's index or −1. Equal numbers go by order; otherwise
 * the offset under which most agree within `tolerance` s decides. Returns how many pairs there are; `offset_s` (may be
 * NULL) the exposures' clock less the files'. */
int lumi_match_files(const int64_t *files_ns, int files, const int64_t *exposures_ns, int exposures, double tolerance,
                     int *pairs, double *offset_s);

#endif
