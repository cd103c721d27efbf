/* Points spread evenly over the four-dimensional cube: Sobol's sequence (direction numbers of Joe and Kuo 2008),
 * randomly permuted as by Owen 1995 through hashing (Burley 2020, "Practical Hash-Based Owen Scrambling"; Laine and
 * Karras 2011). */
#ifndef LUMI_PIPELINE_PREFILTER_SEQUENCE_H
#define LUMI_PIPELINE_PREFILTER_SEQUENCE_H

#include <stdint.h>

/* Point `index` of the sequence that `seed` names, each coordinate in [0, 1). Any 2^k points from a multiple of 2^k on
 * are spread evenly by themselves. */
void prefilter_point(uint32_t seed, uint32_t index, double point[4]);

#endif
