/* The head of an uncompressed file whose pixels are somebody else's bytes, as a camera delivered them: the file is the
 * head, then the pixels, unchanged. Raw sensor data become DNG (Adobe, Digital Negative Specification 1.4), finished
 * pictures TIFF (Adobe, TIFF Revision 6.0).
 *
 * 1. The head is a multiple of LUMI_HEAD_BLOCK bytes long, so that aligned pixels stay aligned in the file and can go
 *    to the disk without being copied.
 * 2. Nothing is made up: what is 0 or empty in the description is left out of the file, but for the colour matrix that
 *    DNG demands of a Bayer sensor: linear sRGB primaries, white D65. */
#ifndef LUMI_PROTO_IMAGE_IMAGE_HEAD_H
#define LUMI_PROTO_IMAGE_IMAGE_HEAD_H

#include "proto/base/result.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define LUMI_HEAD_BLOCK 4096

enum lumi_head_kind {
    LUMI_HEAD_BAYER = 0, /* DNG: one sample a pixel, behind the colour filter `filter` */
    LUMI_HEAD_GREY,      /* DNG: one linear sample a pixel, no filter */
    LUMI_HEAD_RGB,       /* TIFF: 8 bits, R G B, sRGB */
    LUMI_HEAD_YCBCR_422, /* TIFF: 8 bits, Y Y Cb Cr for every two pixels of a row (TIFF 6.0, section 21) */
    LUMI_HEAD_YCBCR_420  /* TIFF: 8 bits, Y Y Y Y Cb Cr for every 2 × 2 pixels, rows of them from the top */
};

struct lumi_head {
    enum lumi_head_kind kind;
    int width, height;
    int stride;        /* bytes a row of pixels; 0: no padding. YCBCR kinds have none */
    int bits;          /* BAYER, GREY: 8, or 9..16 in little-endian 16-bit words, low bits used */
    uint8_t filter[4]; /* BAYER: 0 red, 1 green, 2 blue; upper left, upper right, lower left, lower right */
    double black;      /* sample value of no light */
    double white[2];   /* white balance: what red and blue are multiplied with to match green; 0: unknown (then 1) */
    double matrix[9];  /* XYZ (D65) → camera's red, green, blue, row by row; all zero: linear sRGB */
    bool narrow;       /* YCBCR: Y 16..235, C 16..240 instead of 0..255 */
    bool bt709;        /* YCBCR: the matrix of ITU-R BT.709 instead of BT.601's */
    double exposure_s, iso;
    int64_t unix_us;                              /* when it was taken; INT64_MIN: unknown */
    const char *make, *model, *serial, *software; /* NULL: unknown */
};
void lumi_head_init(struct lumi_head *head);

/* *data is released with lumi_free. LUMI_ERR_ARG: a size, bits or stride that no file can say. */
int lumi_head_make(const struct lumi_head *head, uint8_t **data, size_t *size, struct lumi_error *error);

#ifdef __cplusplus
}
#endif
#endif
