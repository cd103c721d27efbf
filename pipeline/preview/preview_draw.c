/* Pictures of what is there. */
#include "pipeline/preview/preview_priv.h"
#include "proto/base/memory.h"
#include "render/cpu/disk_renderer.h"

#include <math.h>
#include <string.h>

#define NARROWEST (LUMI_PI / 180)
#define WIDEST (170 * LUMI_PI / 180)

int lumi_preview_gaze_check(const struct lumi_preview_gaze *gaze, struct lumi_error *error)
{
    const double place[] = {gaze->x, gaze->y, gaze->z};

    for (int i = 0; i < 3; i++)
        if (!(fabs(place[i]) <= LUMI_PREVIEW_PLACE_MAX))
            return lumi_fail(error, LUMI_ERR_ARG, "a place at most %g m from the centre is wanted",
                             LUMI_PREVIEW_PLACE_MAX);
    if (!(fabs(gaze->yaw) <= 1e3) || !(fabs(gaze->pitch) <= LUMI_PI / 2 + 1e-3))
        return lumi_fail(error, LUMI_ERR_ARG, "a yaw, and a pitch from -90° to 90°, are wanted");
    if (!(gaze->fov >= NARROWEST) || !(gaze->fov <= WIDEST))
        return lumi_fail(error, LUMI_ERR_ARG, "a field of view from 1° to 170° is wanted");
    if (gaze->width < 16 || gaze->height < 16 || gaze->width > LUMI_PREVIEW_SIZE_MAX ||
        gaze->height > LUMI_PREVIEW_SIZE_MAX)
        return lumi_fail(error, LUMI_ERR_ARG, "a size from 16x16 to %dx%d is wanted", LUMI_PREVIEW_SIZE_MAX,
                         LUMI_PREVIEW_SIZE_MAX);
    return LUMI_OK;
}

static int fill_set(struct lumi_preview *preview, int count, struct lumi_view *views, struct lumi_pose *poses,
                    struct lumi_disk *disks, struct lumi_raster *images, struct lumi_error *error)
{
    int at = 0;

    for (guint i = 0; i < preview->frames->len; i++) {
        const struct preview_frame *frame = preview_frame(preview, (int)i);
        if (frame->state == PREVIEW_LOADED)
            poses[at++] = frame->pose;
    }
    LUMI_TRY(preview_disks(count, poses, preview->surface, preview->centre, preview->radius, disks, error));
    at = 0;
    for (guint i = 0; i < preview->frames->len; i++) {
        const struct preview_frame *frame = preview_frame(preview, (int)i);
        if (frame->state != PREVIEW_LOADED)
            continue;
        views[at] =
            (struct lumi_view){.grid = &preview->grid, .pose = frame->pose, .disk = disks[at], .mesh = &frame->mesh};
        images[at++] = frame->image;
    }
    return lumi_viewset_create(count, views, images, LUMI_DISK_OVAL, LUMI_KERNEL_LINEAR, &preview->set, error);
}

static int make_set(struct lumi_preview *preview, struct lumi_error *error)
{
    const int count = preview->status.views;
    int code;

    if (count < 1)
        return lumi_fail(error, LUMI_ERR_BUSY, "%s: no frame that could be shown is here yet", preview->path);
    LUMI_TRY(preview_place_proxies(preview, error));
    struct lumi_view *views = lumi_calloc((size_t)count, sizeof *views);
    struct lumi_pose *poses = lumi_calloc((size_t)count, sizeof *poses);
    struct lumi_disk *disks = lumi_calloc((size_t)count, sizeof *disks);
    struct lumi_raster *images = lumi_calloc((size_t)count, sizeof *images);
    if (views && poses && disks && images)
        code = fill_set(preview, count, views, poses, disks, images, error);
    else
        code = lumi_fail(error, LUMI_ERR_NOMEM, "%s: out of memory", preview->path);
    lumi_free(views);
    lumi_free(poses);
    lumi_free(disks);
    lumi_free(images);
    return code;
}

int lumi_preview_draw(struct lumi_preview *preview, const struct lumi_preview_gaze *gaze, struct lumi_picture *picture,
                      struct lumi_error *error)
{
    const double yaw = gaze->yaw, pitch = gaze->pitch;
    struct lumi_disk_settings settings;
    struct lumi_pose pose;
    struct lumi_lens lens;

    memset(picture, 0, sizeof *picture);
    LUMI_TRY(lumi_preview_gaze_check(gaze, error));
    if (!preview->set)
        LUMI_TRY(make_set(preview, error));
    const struct lumi_vec3 ahead = {cos(pitch) * cos(yaw), cos(pitch) * sin(yaw), sin(pitch)};
    /* Straight up and down the horizon does not say which way the picture's top is; the yaw does. */
    const struct lumi_vec3 up = {-sin(pitch) * cos(yaw), -sin(pitch) * sin(yaw), cos(pitch)};
    lumi_pose_look(lumi_add(preview->centre, lumi_vec3(gaze->x, gaze->y, gaze->z)), ahead, up, &pose);
    lumi_lens_init_pinhole(&lens, gaze->width, gaze->height, gaze->fov);
    lumi_disk_settings_default(&settings);
    settings.threads = preview->options.threads;
    return lumi_render_disks(preview->set, &lens, &pose, &settings, picture, error);
}
