#include "daemon/camera/camera_unpack.h"

size_t camera_packed_row(int width, int bits)
{
    if (width <= 0)
        return 0;
    return bits == 10 ? ((size_t)width + 3) / 4 * 5 : bits == 12 ? ((size_t)width + 1) / 2 * 3 : 0;
}

void camera_unpack_row(const uint8_t *in, uint8_t *out, int width, int bits)
{
    const int group = bits == 10 ? 4 : 2, low_bits = bits - 8;
    const unsigned mask = (1u << low_bits) - 1;

    for (int x = 0; x < width; x += group) {
        const uint8_t *at = in + (size_t)(x / group) * (size_t)(group + 1);

        for (int i = 0; i < group && x + i < width; i++) {
            const unsigned value = (unsigned)at[i] << low_bits | (at[group] >> (i * low_bits) & mask);

            out[2 * (x + i)] = (uint8_t)value;
            out[2 * (x + i) + 1] = (uint8_t)(value >> 8);
        }
    }
}
