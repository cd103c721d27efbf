/* Frames into a capture. */
#include "sim/shoot.h"

#include "proto/base/memory.h"
#include "proto/capture/capture.h"

#include <glib.h>
#include <glib/gstdio.h>

struct shooting {
    const struct sim_scene *scene;
    const struct sim_rig *rig;
    const struct sim_output *output;
    struct lumi_capture *capture;
    const char *origin; /* of the poses */
    int64_t *cameras;   /* ids */
    int64_t shot;       /* of the position that is being shot */
    int position;
};

static int describe(struct shooting *s, const char *place, struct lumi_error *error)
{
    g_autofree char *source = g_strdup_printf("sim %s", place);

    LUMI_TRY(lumi_capture_set_meta(s->capture, "source", source, error));
    LUMI_TRY(lumi_capture_set_meta(s->capture, "surface", s->rig->plane ? "plane" : "sphere", error));
    LUMI_TRY(lumi_capture_set_meta(s->capture, "software", "lumi " LUMI_VERSION, error));
    if (!s->rig->mechanism)
        return LUMI_OK;
    g_autofree char *profile = g_malloc(LUMI_RIG_TEXT_MAX);
    lumi_rig_print(&s->rig->profile, profile, LUMI_RIG_TEXT_MAX);
    return lumi_capture_set_profile(s->capture, profile, error);
}

static int add_cameras(struct shooting *s, struct lumi_error *error)
{
    const struct lumi_rig *profile = &s->rig->profile;

    for (int i = 0; i < s->rig->cameras; i++) {
        struct lumi_capture_lens lens = {.lens = s->rig->views[i].lens};
        int64_t id;
        g_strlcpy(lens.name, s->rig->mechanism ? profile->lenses[profile->cameras[i].lens].name : "lens",
                  sizeof lens.name);
        LUMI_TRY(lumi_capture_add_lens(s->capture, &lens, &id, error));
        LUMI_TRY(lumi_capture_add_camera(s->capture, s->rig->mechanism ? profile->cameras[i].name : "c00", id,
                                         &s->cameras[i], error));
    }
    return LUMI_OK;
}

static int add_position(struct shooting *s, const struct sim_view *view, struct lumi_error *error)
{
    struct lumi_capture_position position = {view->position, view->turn, view->step, view->turn_angle, view->drop};
    int64_t id;

    if (view->position == s->position)
        return LUMI_OK;
    s->position = view->position;
    LUMI_TRY(lumi_capture_add_position(s->capture, &position, &id, error));
    return lumi_capture_add_shot(s->capture, id, 0, 0, &s->shot, error);
}

static int shoot_frame(struct shooting *s, int index, struct lumi_error *error)
{
    const struct sim_view *view = &s->rig->views[index];
    g_autofree char *name = g_strdup_printf("r%02dc%02d", view->row, view->column);
    g_autofree char *depth = s->output->depth_dir ? g_strconcat(s->output->depth_dir, "/", name, ".exr", NULL) : NULL;
    struct lumi_capture_new_frame frame = {
        .name = name, .camera = s->cameras[view->camera], .row = view->row, .column = view->column};
    struct lumi_capture_file file = {.extension = sim_format_extension(s->output->format),
                                     .width = view->lens.width,
                                     .height = view->lens.height,
                                     .camera_time_us = LUMI_NO_TIME};
    uint8_t *data = NULL;
    size_t size = 0;
    int64_t id;
    int code;

    LUMI_GOTO(code, done, add_position(s, view, error));
    frame.shot = s->shot;
    LUMI_GOTO(code, done, lumi_capture_add_frame(s->capture, &frame, &id, error));
    LUMI_GOTO(code, done, lumi_capture_set_pose(s->capture, id, &view->pose, LUMI_POSE_TRUE, s->origin, error));
    LUMI_GOTO(code, done, sim_view_encode(s->scene, view, index, s->output, depth, &data, &size, error));
    LUMI_GOTO(code, done, lumi_capture_store_bytes(s->capture, id, data, size, &file, error));
done:
    lumi_free(data);
    return code;
}

static int shoot_all(struct shooting *s, const char *place, struct lumi_error *error)
{
    LUMI_TRY(lumi_capture_begin(s->capture, error));
    LUMI_TRY(describe(s, place, error));
    LUMI_TRY(add_cameras(s, error));
    for (int i = 0; i < s->rig->count; i++) {
        LUMI_TRY(shoot_frame(s, i, error));
        if (s->output->progress)
            s->output->progress(s->output->context, i + 1, s->rig->count);
    }
    return lumi_capture_commit(s->capture, error);
}

int sim_shoot(const struct sim_scene *scene, const char *place, const struct sim_rig *rig,
              const struct sim_output *output, const char *path, struct lumi_error *error)
{
    g_autofree char *origin = g_strdup_printf("lumi sim shoot %s", place);
    g_autofree int64_t *cameras = g_new0(int64_t, rig->cameras);
    struct shooting s = {
        .scene = scene, .rig = rig, .output = output, .origin = origin, .cameras = cameras, .position = -1};

    LUMI_TRY(sim_sensor_check(&output->sensor, error));
    if (output->depth_dir && g_mkdir_with_parents(output->depth_dir, 0777) != 0)
        return lumi_fail_errno(error, output->depth_dir, "cannot make the folder");
    LUMI_TRY(lumi_capture_create(path, &s.capture, error));
    int code = shoot_all(&s, place, error);
    if (code == LUMI_OK)
        code = lumi_capture_publish(s.capture, NULL, error);
    lumi_capture_close(s.capture);
    return code;
}
