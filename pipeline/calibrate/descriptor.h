/* How far descriptors are from one another. */
#ifndef LUMI_PIPELINE_CALIBRATE_DESCRIPTOR_H
#define LUMI_PIPELINE_CALIBRATE_DESCRIPTOR_H

#include <stdint.h>

/* The sum of the squared differences of the LUMI_DESCRIPTOR_SIZE bytes. */
typedef uint32_t (*lumi_descriptor_fn)(const uint8_t *a, const uint8_t *b);

uint32_t lumi_descriptor_distance_c(const uint8_t *a, const uint8_t *b);
#if defined(__x86_64__)
uint32_t lumi_descriptor_distance_avx2(const uint8_t *a, const uint8_t *b);
#endif

/* The fastest this processor has; all give the same numbers. */
lumi_descriptor_fn lumi_descriptor_distance(void);

#endif
