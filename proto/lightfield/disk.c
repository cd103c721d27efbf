/* The blending disks. */
#include "proto/lightfield/disk.h"

#include <math.h>

static float falloff(enum lumi_disk_kernel kernel, float r)
{
    if (!(r < 1))
        return 0;
    switch (kernel) {
    case LUMI_KERNEL_GAUSSIAN: {
        const float edge = 0.043936934f; /* exp(-1 / 0.32) */
        return (expf(-r * r / 0.32f) - edge) / (1 - edge);
    }
    case LUMI_KERNEL_CUBIC:
        return 1 - r * r * (3 - 2 * r);
    case LUMI_KERNEL_LINEAR:
    default:
        return 1 - r;
    }
}

float lumi_disk_weight(const struct lumi_disk *disk, enum lumi_disk_shape shape, enum lumi_disk_kernel kernel,
                       float scale, float u, float v)
{
    float a = fabsf(u) / (scale * (u < 0 ? disk->u_neg : disk->u_pos));
    float b = fabsf(v) / (scale * (v < 0 ? disk->v_neg : disk->v_pos));

    if (shape == LUMI_DISK_RECTANGLE)
        return falloff(kernel, a) * falloff(kernel, b);
    return falloff(kernel, sqrtf(a * a + b * b));
}
