/* The distance of descriptors in plain C: the definition of what the variants compute. */
#include "pipeline/calibrate/descriptor.h"

#include "pipeline/calibrate/features.h"

uint32_t lumi_descriptor_distance_c(const uint8_t *a, const uint8_t *b)
{
    int32_t sum = 0;

    for (int i = 0; i < LUMI_DESCRIPTOR_SIZE; i++) {
        const int32_t difference = (int32_t)a[i] - (int32_t)b[i];
        sum += difference * difference;
    }
    return (uint32_t)sum;
}

lumi_descriptor_fn lumi_descriptor_distance(void)
{
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx2"))
        return lumi_descriptor_distance_avx2;
#endif
    return lumi_descriptor_distance_c;
}
