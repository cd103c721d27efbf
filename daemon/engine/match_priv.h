/* What match.c and match_clock.c share. */
#ifndef LUMI_DAEMON_ENGINE_MATCH_PRIV_H
#define LUMI_DAEMON_ENGINE_MATCH_PRIV_H

#include "daemon/engine/match.h"

#define MATCH_EXPOSURES 8192
#define MATCH_WAITING (LUMI_MATCH_FRAMES + 8)
#define MATCH_EDGES 128
#define MATCH_PAIRS 128
#define NULL_EXPOSURE (-1)

struct match_exposure {
    int64_t at; /* its beginning, of the host's clock */
    double length;
    int shot;
    bool matched; /* has its frame, or was given up */
    bool seen;    /* by an edge */
    bool told;    /* that no edge came, or one did: nothing more is to be said */
    uint64_t sequence;
    int64_t frame_ns;
};

struct match_pair {
    int64_t device, host;
};

struct lumi_match {
    struct lumi_match_options options;
    struct match_exposure *exposures; /* by time */
    int exposure_count;
    int last; /* the latest that has a frame; below 0: before the first that is kept */
    uint64_t last_sequence;
    bool sequence_known;
    struct lumi_match_frame frames[MATCH_WAITING]; /* as they arrived */
    int frame_count;
    bool overflow, finished;
    int strays;         /* frames of no exposure since the last that had one */
    int64_t decided_ns; /* when the frame arrived that was decided last */
    int64_t deaf_ns;    /* until when nobody could tell of exposures */
    int64_t edges[MATCH_EDGES];
    int edge_count;
    /* The camera's clock: host = host_at + (device − device_at) · (1 + drift). */
    bool clock_known;
    int64_t device_at, host_at;
    double drift;
    struct match_pair pairs[MATCH_PAIRS];
    int pair_count, pair_next;
    double latency;                 /* s, usual; 0 unknown */
    double period;                  /* s, of frames that come by themselves, as measured; 0: they do not */
    struct lumi_match_frame before; /* the last that came: what the period is measured from */
    struct lumi_match_clock counts;
    double residual_sum; /* of squares */
    uint64_t residual_count;
};

double match_half(const struct lumi_match *match);
int match_nearest(const struct lumi_match *match, int64_t at, bool open);
int match_nearest_within(const struct lumi_match *match, int64_t at, double best, bool open);
/* By its arrival: not before the exposure's end, not beyond patience. */
bool match_could_be(const struct lumi_match *match, int i, const struct lumi_match_frame *frame);
bool match_prune(struct lumi_match *match, int64_t now);

/* match_clock.c */
int64_t match_to_host(const struct lumi_match *match, int64_t device_ns);
int64_t match_when(const struct lumi_match *match, const struct lumi_match_frame *frame); /* as well as is known */
/* The clock says that it was taken after it had arrived. */
bool match_from_future(const struct lumi_match *match, const struct lumi_match_frame *frame);
void match_forget(struct lumi_match *match);
/* Without a clock: how long a frame waits for others, and then the exposure that fits it and them best: none of them
 * may arrive before it was taken, and the fewest may be of no exposure; of several the latest, for delays are short. */
double match_cold_wait(const struct lumi_match *match);
int match_cold(const struct lumi_match *match, int place, int64_t now);
/* Adds a pair; returns by how many seconds the line missed it before (0: there was none, or no clock). */
double match_clock_add(struct lumi_match *match, const struct lumi_match_frame *frame, int64_t host_ns);
void match_latency_add(struct lumi_match *match, double latency);
/* Whether the camera's clock was set: this frame and another that waits lie where arrival says that exposures are
 * open, and where the clock says that none is. Then the clock is forgotten. */
bool match_clock_stepped(struct lumi_match *match, int place, int64_t now);

#endif
