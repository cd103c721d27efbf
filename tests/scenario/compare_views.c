/* compare_views A.exr B.exr [SHEET.png]: how alike two pictures in linear light are, seen as sRGB: prints PSNR over R,
 * G and B in dB, and the share of pixels off by more than 0.15 of white; the sheet shows A, B and four times what
 * differs. */
#include "proto/image/image.h"

#include <math.h>
#include <stdio.h>

static float shown(float linear)
{
    return lumi_srgb_encode(fminf(fmaxf(linear, 0), 1));
}

int main(int argc, char **argv)
{
    struct lumi_raster a, b, sheet = {0};
    struct lumi_error error = {0};
    double sum = 0;
    long off = 0;

    if (argc < 3 || lumi_image_read(argv[1], 3, &a, NULL, &error) || lumi_image_read(argv[2], 3, &b, NULL, &error) ||
        a.width != b.width || a.height != b.height || lumi_raster_create(&sheet, 3 * a.width, a.height, 3, LUMI_U8)) {
        fprintf(stderr, "compare_views: %s\n", error.text[0] ? error.text : "two pictures of one size are wanted");
        return 3;
    }
    for (int y = 0; y < a.height; y++)
        for (int x = 0; x < a.width; x++) {
            float most = 0;
            for (int c = 0; c < 3; c++) {
                const float p = shown(lumi_row_f32(&a, y)[3 * x + c]), q = shown(lumi_row_f32(&b, y)[3 * x + c]);
                sum += (double)((p - q) * (p - q));
                most = fmaxf(most, fabsf(p - q));
                lumi_row_u8(&sheet, y)[3 * x + c] = (uint8_t)lroundf(255 * p);
                lumi_row_u8(&sheet, y)[3 * (x + a.width) + c] = (uint8_t)lroundf(255 * q);
                lumi_row_u8(&sheet, y)[3 * (x + 2 * a.width) + c] = (uint8_t)fminf(255, roundf(1020 * fabsf(p - q)));
            }
            off += most > 0.15f;
        }
    printf("%.2f dB, off %.3f %%\n", -10 * log10(fmax(sum / (3.0 * a.width * a.height), 1e-12)),
           100.0 * (double)off / ((double)a.width * a.height));
    if (argc > 3 && lumi_image_write(argv[3], &sheet, NULL, &error)) {
        fprintf(stderr, "compare_views: %s\n", error.text);
        return 1;
    }
    lumi_raster_finish(&sheet);
    lumi_raster_finish(&b);
    lumi_raster_finish(&a);
    return 0;
}
