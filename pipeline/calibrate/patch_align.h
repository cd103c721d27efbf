/* Where a small piece of one picture lies in another, to hundredths of a pixel: least squares matching (Gruen: Adaptive
 * Least Squares Correlation, 1985), shift, gain and offset solved for; how the piece is stretched and turned is given.
 */
#ifndef LUMI_PIPELINE_CALIBRATE_PATCH_ALIGN_H
#define LUMI_PIPELINE_CALIBRATE_PATCH_ALIGN_H

#include <stdbool.h>
#include <stdint.h>

#define LUMI_PATCH_RADIUS 12 /* pixels that are kept to every side */
#define LUMI_PATCH_SIZE (2 * LUMI_PATCH_RADIUS + 1)

/* A piece of a picture about a place: pixels[j][i] is the pixel (left + i, top + j), grey as seen. */
struct lumi_patch_pixels {
    int left, top;
    bool there; /* whole inside the picture */
    uint8_t pixels[LUMI_PATCH_SIZE][LUMI_PATCH_SIZE];
};

struct lumi_patch_match {
    double x, y;        /* in the second picture, pixels, centres at half-integers */
    double sigma;       /* what noise leaves of doubt, pixels: the root mean square of both axes */
    double correlation; /* of what was matched, −1..1 */
};

/* Cuts the piece about (x, y) out of grey pixels (0..255 and above), row by row. */
void lumi_patch_cut(const float *grey, int width, int height, double x, double y, struct lumi_patch_pixels *patch);

/* The place (x, y) of `reference` in `other`, from match->x, match->y on; `stretch`: row by row, from an offset in the
 * first picture to one in the second. False where the piece has no texture, leaves what is kept, or goes over a pixel
 * away. */
bool lumi_patch_align(const struct lumi_patch_pixels *reference, double x, double y,
                      const struct lumi_patch_pixels *other, const double stretch[4], struct lumi_patch_match *match);

#endif
