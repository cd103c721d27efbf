/* Frames into a capture. */
#include "sim/shoot.h"

#include "proto/base/memory.h"
#include "proto/capture/capture.h"

#include <glib.h>
#include <glib/gstdio.h>

/* A capture that is being written. */
struct target {
    struct lumi_capture *capture;
    bool truth;                 /* has the true poses, whatever the rig believes */
    int64_t *cameras;           /* ids */
    int64_t shots[SIM_BRACKET]; /* of the position that is being shot */
    int position;
};

struct shooting {
    const struct sim_scene *scene;
    const struct sim_rig *rig;
    const struct sim_output *output;
    const struct sim_takes *takes;
    const char *origin; /* of the poses */
    struct target targets[2];
    int target_count;
};

static int describe(const struct shooting *s, struct lumi_capture *capture, const char *place, struct lumi_error *error)
{
    g_autofree char *source = g_strdup_printf("sim %s", place);

    LUMI_TRY(lumi_capture_set_meta(capture, "source", source, error));
    LUMI_TRY(lumi_capture_set_meta(capture, "surface", s->rig->plane ? "plane" : "sphere", error));
    LUMI_TRY(lumi_capture_set_meta(capture, "software", "lumi " LUMI_VERSION, error));
    if (!s->rig->mechanism)
        return LUMI_OK;
    g_autofree char *profile = g_malloc(LUMI_RIG_TEXT_MAX);
    lumi_rig_print(&s->rig->profile, profile, LUMI_RIG_TEXT_MAX);
    return lumi_capture_set_profile(capture, profile, error);
}

static int add_cameras(const struct shooting *s, struct target *target, struct lumi_error *error)
{
    const struct lumi_rig *profile = &s->rig->profile;

    for (int i = 0; i < s->rig->cameras; i++) {
        struct lumi_capture_lens lens = {.lens = s->rig->views[i].lens};
        int64_t id;
        g_strlcpy(lens.name, s->rig->mechanism ? profile->lenses[profile->cameras[i].lens].name : "lens",
                  sizeof lens.name);
        LUMI_TRY(lumi_capture_add_lens(target->capture, &lens, &id, error));
        LUMI_TRY(lumi_capture_add_camera(target->capture, s->rig->mechanism ? profile->cameras[i].name : "c00", id,
                                         &target->cameras[i], error));
    }
    return LUMI_OK;
}

static int shots(const struct shooting *s)
{
    return s->takes->bracket_count > 0 ? s->takes->bracket_count : 1;
}

static int add_position(const struct shooting *s, struct target *target, const struct sim_view *view,
                        struct lumi_error *error)
{
    struct lumi_capture_position position = {view->position, view->turn, view->step, view->turn_angle, view->drop};
    int64_t id;

    if (view->position == target->position)
        return LUMI_OK;
    target->position = view->position;
    LUMI_TRY(lumi_capture_add_position(target->capture, &position, &id, error));
    for (int k = 0; k < shots(s); k++)
        LUMI_TRY(lumi_capture_add_shot(target->capture, id, k, s->takes->bracket_count > 0 ? s->takes->brackets[k] : 0,
                                       &target->shots[k], error));
    return LUMI_OK;
}

/* A frame of a bracket has the view's name where nothing is added to its exposure. */
static char *shot_name(const struct shooting *s, const struct sim_view *view, int shot)
{
    g_autofree char *name = sim_frame_name(view);
    int plain = 0;

    for (int k = shots(s) - 1; k >= 0; k--)
        if (s->takes->bracket_count > 0 && s->takes->brackets[k] == 0)
            plain = k;
    return shot == plain ? g_steal_pointer(&name) : g_strdup_printf("%se%d", name, shot);
}

struct shot {
    const char *name;
    int number;
    struct sim_take take;
    const uint8_t *data;
    size_t size;
};

static int store_frame(const struct shooting *s, struct target *target, const struct sim_view *view,
                       const struct shot *shot, struct lumi_error *error)
{
    const bool prior = s->rig->shaken && !target->truth;
    struct lumi_capture_new_frame frame = {
        .name = shot->name, .camera = target->cameras[view->camera], .row = view->row, .column = view->column};
    struct lumi_capture_file file = {.extension = sim_format_extension(s->output->format),
                                     .width = view->lens.width,
                                     .height = view->lens.height,
                                     .exposure_s = shot->take.exposure_s,
                                     .camera_time_us = LUMI_NO_TIME};
    int64_t id;

    LUMI_TRY(add_position(s, target, view, error));
    frame.shot = target->shots[shot->number];
    LUMI_TRY(lumi_capture_add_frame(target->capture, &frame, &id, error));
    LUMI_TRY(lumi_capture_set_pose(target->capture, id, prior ? &view->prior : &view->pose,
                                   prior ? LUMI_POSE_PRIOR : LUMI_POSE_TRUE, s->origin, error));
    if (shot->take.lost)
        return lumi_capture_lose_frame(target->capture, id, "lost by the simulation", error);
    return lumi_capture_store_bytes(target->capture, id, shot->data, shot->size, &file, error);
}

static int shoot_shot(struct shooting *s, int index, int number, const struct lumi_raster *light,
                      struct lumi_error *error)
{
    const struct sim_view *view = &s->rig->views[index];
    g_autofree char *name = shot_name(s, view, number);
    struct shot shot = {.name = name, .number = number};
    uint8_t *data = NULL;
    int code = LUMI_OK;

    sim_takes_shot(s->takes, s->rig, index, number, &shot.take);
    if (!shot.take.lost)
        code = sim_view_encode(light, index + number * s->rig->count, shot.take.stops, s->output, &data, &shot.size,
                               error);
    shot.data = data;
    for (int i = 0; code == LUMI_OK && i < s->target_count; i++)
        code = store_frame(s, &s->targets[i], view, &shot, error);
    lumi_free(data);
    return code;
}

static int shoot_frame(struct shooting *s, int index, struct lumi_error *error)
{
    const struct sim_view *view = &s->rig->views[index];
    g_autofree char *name = sim_frame_name(view);
    g_autofree char *depth = s->output->depth_dir ? g_strconcat(s->output->depth_dir, "/", name, ".exr", NULL) : NULL;
    struct lumi_raster light;
    int code = LUMI_OK;

    LUMI_TRY(sim_view_render(s->scene, view, s->output, depth, &light, error));
    sim_takes_disturb(s->takes, s->rig, index, &light);
    for (int k = 0; code == LUMI_OK && k < shots(s); k++)
        code = shoot_shot(s, index, k, &light, error);
    lumi_raster_finish(&light);
    return code;
}

static int shoot_all(struct shooting *s, const char *place, struct lumi_error *error)
{
    for (int i = 0; i < s->target_count; i++) {
        LUMI_TRY(lumi_capture_begin(s->targets[i].capture, error));
        LUMI_TRY(describe(s, s->targets[i].capture, place, error));
        LUMI_TRY(add_cameras(s, &s->targets[i], error));
    }
    for (int i = 0; i < s->rig->count; i++) {
        LUMI_TRY(shoot_frame(s, i, error));
        if (s->output->progress)
            s->output->progress(s->output->context, i + 1, s->rig->count);
    }
    for (int i = 0; i < s->target_count; i++)
        LUMI_TRY(lumi_capture_commit(s->targets[i].capture, error));
    return LUMI_OK;
}

static int add_target(struct shooting *s, const char *path, bool truth, int64_t *cameras, struct lumi_error *error)
{
    struct target *target = &s->targets[s->target_count];

    *target = (struct target){.truth = truth, .cameras = cameras, .position = -1};
    LUMI_TRY(lumi_capture_create(path, &target->capture, error));
    s->target_count++;
    return LUMI_OK;
}

int sim_shoot(const struct sim_scene *scene, const char *place, const struct sim_rig *rig,
              const struct sim_output *output, const struct sim_takes *takes, const struct sim_shoot_truth *truth,
              const char *path, struct lumi_error *error)
{
    g_autofree char *origin = g_strdup_printf("lumi sim shoot %s", place);
    g_autofree int64_t *cameras = g_new0(int64_t, 2 * (size_t)rig->cameras);
    const struct sim_takes plain = {0};
    struct shooting s = {
        .scene = scene, .rig = rig, .output = output, .takes = takes ? takes : &plain, .origin = origin};

    LUMI_TRY(sim_sensor_check(&output->sensor, error));
    if (output->depth_dir && g_mkdir_with_parents(output->depth_dir, 0777) != 0)
        return lumi_fail_errno(error, output->depth_dir, "cannot make the folder");
    int code = add_target(&s, path, false, cameras, error);
    if (code == LUMI_OK && truth && truth->capture)
        code = add_target(&s, truth->capture, true, cameras + rig->cameras, error);
    if (code == LUMI_OK)
        code = shoot_all(&s, place, error);
    if (code == LUMI_OK && truth && truth->poses)
        code = sim_truth_poses(rig, output->format, truth->poses, error);
    for (int i = 0; i < s.target_count; i++) {
        if (code == LUMI_OK)
            code = lumi_capture_publish(s.targets[i].capture, NULL, error);
        lumi_capture_close(s.targets[i].capture);
    }
    return code;
}
