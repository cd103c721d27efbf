/* Rows of pixels from a driver's buffer to a frame's; raw ones that MIPI CSI-2 packed become little-endian words. */
#ifndef LUMI_DAEMON_CAMERA_CAMERA_UNPACK_H
#define LUMI_DAEMON_CAMERA_CAMERA_UNPACK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Bytes of a packed row; 0 where `bits` is neither 10 nor 12. */
size_t camera_packed_row(int width, int bits);
/* One row of `width` pixels: 4 pixels in 5 bytes (10 bits) or 2 in 3 (12), upper 8 bits first, the lower ones after
 * them, the first pixel's lowest (Linux: userspace-api/media/v4l, "10-bit packed Bayer formats"). */
void camera_unpack_row(const uint8_t *in, uint8_t *out, int width, int bits);

struct camera_rows {
    const uint8_t *bytes;
    size_t size;
    int stride, count;
    int packed_width, packed_bits; /* 0: as they are */
};
/* Into `out`, rows of `stride` bytes. False: some are not there; those are black. */
bool camera_copy_rows(const struct camera_rows *rows, uint8_t *out, int stride);

#endif
