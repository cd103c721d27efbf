/* Numbers that look random and are a function of their place alone: any thread can make any of them. */
#ifndef LUMI_SIM_RANDOM_H
#define LUMI_SIM_RANDOM_H

#include <stdint.h>

/* SplitMix64's finaliser (Steele, Lea, Flood, "Fast splittable pseudorandom number generators", 2014). */
static inline uint64_t sim_random_mix(uint64_t x)
{
    x += UINT64_C(0x9e3779b97f4a7c15);
    x = (x ^ x >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
    x = (x ^ x >> 27) * UINT64_C(0x94d049bb133111eb);
    return x ^ x >> 31;
}

static inline uint64_t sim_random(uint64_t seed, uint64_t index, unsigned channel)
{
    return sim_random_mix(sim_random_mix(sim_random_mix(seed) ^ index) + channel);
}

/* In 0..1, neither 0 nor 1. */
static inline double sim_random_unit(uint64_t bits)
{
    return ((double)(bits >> 12) + 0.5) / 4503599627370496.0;
}

#endif
