/* make_dng IN.exr OUT.dng BITS: the picture as a camera with a Bayer sensor would have taken it, through the way every
 * frame takes (daemon/camera/frame_file.h). */
#include "daemon/camera/frame_file.h"
#include "proto/base/file.h"
#include "proto/base/memory.h"
#include "proto/image/image.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define BLACK 64
#define RED 0.6f /* of what green sees */
#define BLUE 0.7f

static void expose(const struct lumi_raster *light, int bits, uint16_t *samples)
{
    static const int colours[4] = {0, 1, 1, 2};
    static const float weights[3] = {RED, 1, BLUE};
    float white = (float)((1 << bits) - 1);

    for (int y = 0; y < light->height; y++)
        for (int x = 0; x < light->width; x++) {
            int c = colours[y % 2 * 2 + x % 2];
            float value = fminf(fmaxf(lumi_row_f32(light, y)[3 * x + c], 0) * weights[c], 1);
            samples[y * light->width + x] = (uint16_t)(BLACK + value * (white - BLACK) + 0.5f);
        }
}

static int make(const char *from, const char *to, int bits, struct lumi_error *error)
{
    struct lumi_frame_about about;
    struct lumi_frame_file file;
    struct lumi_raster light;
    FILE *out;

    LUMI_TRY(lumi_image_read(from, 3, &light, NULL, error));
    size_t size = 2 * (size_t)light.width * (size_t)light.height;
    uint16_t *samples = lumi_alloc(size, 1);
    expose(&light, bits, samples);
    struct lumi_camera_frame frame = {
        .format = {LUMI_LAYOUT_BAYER, LUMI_BAYER_RGGB, light.width, light.height, bits, 2 * light.width},
        .data = (const uint8_t *)samples,
        .size = size,
        .exposure_s = 0.01};
    lumi_frame_about_init(&about, NULL);
    about.model = "simulated";
    about.black = BLACK;
    about.white[0] = 1 / (double)RED;
    about.white[1] = 1 / (double)BLUE;
    int code = lumi_frame_file_make(&frame, &about, &file, error);
    if (code == LUMI_OK && (out = fopen(to, "wb")) != NULL) {
        for (int i = 0; i < file.count; i++)
            if (fwrite(file.pieces[i].iov_base, 1, file.pieces[i].iov_len, out) != file.pieces[i].iov_len)
                code = lumi_fail_errno(error, to, "writing");
        fclose(out);
    }
    lumi_frame_file_finish(&file);
    lumi_free(samples);
    lumi_raster_finish(&light);
    return code;
}

int main(int argc, char **argv)
{
    struct lumi_error error = {0};

    if (argc != 4)
        return 2;
    int code = make(argv[1], argv[2], atoi(argv[3]), &error);
    if (code != LUMI_OK)
        fprintf(stderr, "%s\n", error.text);
    return lumi_exit_status(code);
}
