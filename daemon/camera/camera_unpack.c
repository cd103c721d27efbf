#include "daemon/camera/camera_unpack.h"

#include <string.h>

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

bool camera_copy_rows(const struct camera_rows *rows, uint8_t *out, int stride)
{
    const bool packed = rows->packed_bits > 0;
    const size_t row = packed ? camera_packed_row(rows->packed_width, rows->packed_bits)
                              : (size_t)(stride < rows->stride ? stride : rows->stride);

    if (!packed && rows->stride == stride && rows->size >= (size_t)stride * (size_t)rows->count) {
        memcpy(out, rows->bytes, (size_t)stride * (size_t)rows->count);
        return true;
    }
    for (int y = 0; y < rows->count; y++) {
        const size_t at = (size_t)y * (size_t)rows->stride;
        uint8_t *to = out + (size_t)y * (size_t)stride;

        if (at + row > rows->size) {
            memset(to, 0, (size_t)(rows->count - y) * (size_t)stride);
            return false;
        }
        if (packed)
            camera_unpack_row(rows->bytes + at, to, rows->packed_width, rows->packed_bits);
        else
            memcpy(to, rows->bytes + at, row);
    }
    return true;
}
