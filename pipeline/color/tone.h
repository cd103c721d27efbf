/* Bringing the light of a place down to what a display shows: global operators, one for a whole capture. */
#ifndef LUMI_PIPELINE_COLOR_TONE_H
#define LUMI_PIPELINE_COLOR_TONE_H

#include "pipeline/run/run.h"
#include "proto/base/raster.h"

/* How much light there is, over many pictures: a histogram of log2 luminance. */
#define LUMI_LIGHT_LEAST (-24) /* stops */
#define LUMI_LIGHT_STOPS 48
#define LUMI_LIGHT_FINE 32 /* bins a stop */
struct lumi_light {
    long long bins[LUMI_LIGHT_STOPS * LUMI_LIGHT_FINE];
    long long count; /* in all bins: pixels of some light */
};

float lumi_luminance(const float rgb[3]);
void lumi_light_add(struct lumi_light *light, float luminance);
/* exp of the mean logarithm; 0 where there is none. */
double lumi_light_average(const struct lumi_light *light);
/* What only `share` of the pixels pass. */
double lumi_light_most(const struct lumi_light *light, double share);

struct lumi_tone_map {
    enum lumi_tone tone; /* never auto */
    double scale;        /* of light, before */
    double white;        /* the scaled light that becomes white */
};

/* Scaled so that the capture's average becomes 18 % grey, times 2^stops; white is what a thousandth of it passes. For
 * LUMI_TONE_NONE only the stops. */
void lumi_tone_choose(const struct lumi_light *light, enum lumi_tone tone, double stops, struct lumi_tone_map *map);

/* One colour, linear sRGB, in place. Reinhard: the extended operator of Reinhard, Stark, Shirley, Ferwerda,
 * "Photographic tone reproduction for digital images", 2002, equation 4, on luminance; what would pass white in a
 * channel loses colour instead of luminance. Hable: the curve of Hable, "Uncharted 2: HDR lighting", 2010, a channel at
 * a time. */
void lumi_tone_apply(const struct lumi_tone_map *map, float rgb[3]);

#endif
