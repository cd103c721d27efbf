/* Renders what a field shows from its middle: view FILE.lumi PICTURE.ppm */
#include "render/cpu/disk_renderer.h"

#include <stdio.h>

int main(int argc, char **argv)
{
    struct lumi_viewset *set = NULL;
    struct lumi_picture picture = {0};
    struct lumi_lens lens;
    struct lumi_error error;

    int code = argc == 3 ? lumi_viewset_open(argv[1], &set, &error)
                         : lumi_fail(&error, LUMI_ERR_ARG, "usage: view FILE.lumi PICTURE.ppm");
    if (code == LUMI_OK) {
        struct lumi_pose pose = lumi_viewset_middle(set);
        lumi_lens_init_pinhole(&lens, 640, 480, 60 * LUMI_PI / 180);
        code = lumi_render_disks(set, &lens, &pose, NULL, &picture, &error);
    }
    if (code == LUMI_OK)
        code = lumi_raster_write_ppm(&picture.color, argv[2], &error);
    if (code != LUMI_OK)
        fprintf(stderr, "%s\n", error.text);
    lumi_picture_finish(&picture);
    lumi_viewset_destroy(set);
    return lumi_exit_status(code);
}
