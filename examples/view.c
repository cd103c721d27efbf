/* Renders what a field shows from its centre, along its first view's axis: view FILE.lumi PICTURE.ppm */
#include "render/cpu/disk_renderer.h"

#include <stdio.h>

int main(int argc, char **argv)
{
    struct lumi_field *field = NULL;
    struct lumi_viewset *set = NULL;
    struct lumi_picture picture = {0};
    struct lumi_disk_settings settings;
    struct lumi_lens lens;
    struct lumi_error error = {0};
    FILE *file = NULL;

    if (argc != 3)
        return fputs("usage: view FILE.lumi PICTURE.ppm\n", stderr), 2;
    int code = lumi_field_open(argv[1], 0, &field, &error);
    if (!code)
        code = lumi_viewset_from_field(field, LUMI_LEVEL_FINE, 256 << 20, &set, &error);
    if (!code) {
        struct lumi_pose pose = lumi_viewset_view(set, 0)->pose;
        pose.t = lumi_field_info(field)->centre;
        lumi_lens_init_pinhole(&lens, 640, 480, 60 * LUMI_PI / 180);
        lumi_disk_settings_default(&settings);
        code = lumi_render_disks(set, &lens, &pose, &settings, &picture, &error);
    }
    if (!code && !(file = fopen(argv[2], "wb")))
        code = lumi_fail_errno(&error, argv[2], "open");
    if (!code) {
        fprintf(file, "P6\n%d %d\n255\n", lens.width, lens.height);
        for (int y = 0; y < lens.height; y++)
            fwrite(lumi_row_u8(&picture.color, y), 3, (size_t)lens.width, file);
        fclose(file);
    } else {
        fprintf(stderr, "view: %s\n", error.text);
    }
    lumi_picture_finish(&picture);
    lumi_viewset_destroy(set);
    lumi_field_close(field);
    return lumi_exit_status(code);
}
