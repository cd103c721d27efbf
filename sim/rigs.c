/* Where cameras stand. */
#include "sim/rigs.h"

#include "proto/base/memory.h"
#include "proto/base/raster.h"
#include "proto/mechanism/kinematics.h"
#include "sim/random.h"

#include <stdio.h>
#include <string.h>

#define DEGREE (LUMI_PI / 180)
#define VIEWS_MAX 100000

void sim_rig_options_init(struct sim_rig_options *options)
{
    *options = (struct sim_rig_options){.scale = 1};
}

void sim_rig_finish(struct sim_rig *rig)
{
    lumi_free(rig->views);
    *rig = (struct sim_rig){0};
}

static int allocate(struct sim_rig *rig, struct lumi_error *error)
{
    rig->views = lumi_calloc((size_t)rig->count, sizeof *rig->views);
    return rig->views ? LUMI_OK : lumi_fail(error, LUMI_ERR_NOMEM, "no memory for %d views", rig->count);
}

static int scaled(int count, double scale, int least)
{
    int result = (int)lround(count * scale);

    return result < least ? least : result;
}

/* The size that was asked for, or the rig's own, scaled. */
static void picture_size(const struct sim_rig_options *o, int width, int height, int *w, int *h)
{
    *w = o->width ? o->width : scaled(width, o->scale, 1);
    *h = o->height ? o->height : scaled(height, o->scale, 1);
}

static void make_lens(const struct sim_rig_options *o, enum sim_lens_kind usual, double usual_fov, int w, int h,
                      struct lumi_lens *lens)
{
    enum sim_lens_kind kind = o->lens == SIM_LENS_DEFAULT ? usual : o->lens;
    double fov = o->fov > 0 ? o->fov : kind == usual ? usual_fov : kind == SIM_LENS_FISHEYE ? 110 : 65;

    lumi_lens_init_pinhole(lens, w, h, fmin(fov, 170) * DEGREE);
    if (kind == SIM_LENS_FISHEYE) {
        lens->model = LUMI_LENS_FISHEYE;
        lens->fx = lens->fy = w / (fov * DEGREE);
    } else if (kind == SIM_LENS_BROWN) {
        lens->k1 = -0.12;
        lens->k2 = 0.03;
        lens->p1 = 5e-4;
        lens->p2 = -3e-4;
    }
    if (kind == SIM_LENS_FISHEYE && o->lens == SIM_LENS_FISHEYE) {
        /* Asked for by name: one that is not quite equidistant, as real ones are. */
        lens->k1 = 0.012;
        lens->k2 = 0.004;
        lens->k3 = 0.0012;
        lens->k4 = 0.0002;
    }
}

static int init_planar(struct sim_rig *rig, int rows, int columns, double spacing, const struct sim_rig_options *o,
                       struct lumi_error *error)
{
    struct lumi_lens lens;
    double width = (columns - 1) * spacing, height = (rows - 1) * spacing;
    int w, h;

    rig->rows = rows > 1 ? scaled(rows - 1, o->scale, 1) + 1 : 1;
    rig->columns = columns > 1 ? scaled(columns - 1, o->scale, 1) + 1 : 1;
    rig->count = rig->rows * rig->columns;
    rig->cameras = 1;
    rig->plane = true;
    rig->half_x = width / 2;
    rig->half_z = height / 2;
    rig->radius = fmin(rig->half_x, rig->half_z);
    LUMI_TRY(allocate(rig, error));
    picture_size(o, 960, 640, &w, &h);
    make_lens(o, SIM_LENS_PINHOLE, 62, w, h, &lens);
    for (int i = 0; i < rig->count; i++) {
        struct sim_view *view = &rig->views[i];
        *view = (struct sim_view){.lens = lens, .row = i / rig->columns, .column = i % rig->columns, .position = i};
        double x = rig->columns > 1 ? width * (view->column / (rig->columns - 1.0) - 0.5) : 0;
        double z = rig->rows > 1 ? height * (0.5 - view->row / (rig->rows - 1.0)) : 0;
        lumi_pose_look(lumi_vec3(x, 0, z), lumi_vec3(0, 1, 0), lumi_vec3(0, 0, 1), &view->pose);
    }
    return LUMI_OK;
}

static int init_sphere(struct sim_rig *rig, int rows, int columns, double radius, const struct sim_rig_options *o,
                       struct lumi_error *error)
{
    struct lumi_lens lens;
    int w, h;

    rig->rows = scaled(rows, o->scale, 2);
    rig->columns = scaled(columns, o->scale, 3);
    rig->count = rig->rows * rig->columns;
    rig->cameras = 1;
    rig->radius = radius;
    rig->inward = o->inward;
    LUMI_TRY(allocate(rig, error));
    picture_size(o, 640, 512, &w, &h);
    make_lens(o, o->inward ? SIM_LENS_PINHOLE : SIM_LENS_FISHEYE, o->inward ? 45 : 110, w, h, &lens);
    for (int i = 0; i < rig->count; i++) {
        struct sim_view *view = &rig->views[i];
        *view = (struct sim_view){.lens = lens, .row = i / rig->columns, .column = i % rig->columns, .position = i};
        double elevation = LUMI_PI * (0.5 - (view->row + 0.5) / rig->rows);
        double azimuth = 2 * LUMI_PI * view->column / rig->columns;
        struct lumi_vec3 out = lumi_vec3(cos(elevation) * cos(azimuth), cos(elevation) * sin(azimuth), sin(elevation));
        lumi_pose_look(lumi_scale(out, radius), lumi_scale(out, o->inward ? -1 : 1), lumi_vec3(0, 0, 1), &view->pose);
    }
    return LUMI_OK;
}

static int scale_profile(struct lumi_rig *rig, const struct sim_rig_options *o, struct lumi_error *error)
{
    struct lumi_lens lens = rig->lenses[0].lens;
    double fov_x = lens.width / lens.fx, fov_y = lens.height / lens.fy;
    int w, h, positions = scaled(rig->positions, o->scale, 6);
    double radius = rig->cameras[0].radius;

    picture_size(o, lens.width, lens.height, &w, &h);
    if (o->scale == 1 && w == lens.width && h == lens.height)
        return LUMI_OK;
    if (rig->camera_count == 2) {
        int turns = scaled(rig->turns, o->scale, 2);
        double drop = rig->string.per_turn * radius / rig->string.hold * rig->turns / turns;
        return lumi_rig_bar(rig, positions, turns, radius, drop, w, h, fov_x, fov_y, error);
    }
    return lumi_rig_arc(rig, scaled(rig->camera_count, o->scale, 4), positions, rig->turns, radius, w, h, fov_x, fov_y,
                        error);
}

/* A rig by its name, or an arc held by its brake in other numbers. */
static int find_profile(const char *name, struct lumi_rig *profile, struct lumi_error *error)
{
    int cameras, positions, end = 0;
    double radius;

    if (strncmp(name, "arc:", 4) != 0)
        return lumi_rig_builtin(name, profile, error);
    if (sscanf(name + 4, "%dx%d:%lf%n", &cameras, &positions, &radius, &end) != 3 || name[4 + end])
        return lumi_fail(error, LUMI_ERR_ARG, "rig %s: arc:CAMERASxPOSITIONS:RADIUS wanted", name);
    if (cameras < 1 || cameras > LUMI_RIG_CAMERAS || positions < 1 || positions > LUMI_RIG_POSITIONS_MAX ||
        !(radius > 0 && radius < 1000))
        return lumi_fail(error, LUMI_ERR_ARG, "rig %s: cameras, positions or metres out of range", name);
    return lumi_rig_arc(profile, cameras, positions, 1, radius, 640, 512, 110 * DEGREE, 88 * DEGREE, error);
}

static int init_mechanism(struct sim_rig *rig, const char *name, const struct sim_rig_options *o,
                          struct lumi_error *error)
{
    struct lumi_rig *p = &rig->profile;

    LUMI_TRY(find_profile(name, p, error));
    LUMI_TRY(scale_profile(p, o, error));
    rig->mechanism = true;
    rig->cameras = p->camera_count;
    rig->rows = lumi_rig_rows(p);
    rig->columns = p->positions;
    rig->radius = p->cameras[0].radius;
    int positions = p->positions * p->turns;
    rig->count = positions * p->camera_count;
    LUMI_TRY(allocate(rig, error));
    for (int i = 0; i < rig->count; i++) {
        struct sim_view *view = &rig->views[i];
        int camera = i % p->camera_count, position = i / p->camera_count;
        int64_t step = lumi_rig_position_step(p, position);
        double turns = lumi_rig_step_turns(p, step);
        *view = (struct sim_view){.lens = p->lenses[p->cameras[camera].lens].lens,
                                  .camera = camera,
                                  .position = position,
                                  .turn = position / p->positions,
                                  .row = lumi_rig_row(p, camera, position / p->positions),
                                  .column = lumi_rig_column(p, camera, position),
                                  .step = step,
                                  .turn_angle = lumi_rig_turn_angle(p, turns),
                                  .drop = lumi_rig_drop(p, turns)};
        lumi_rig_camera_pose(p, camera, turns, &view->pose);
    }
    return LUMI_OK;
}

int sim_rig_init(struct sim_rig *rig, const char *text, const struct sim_rig_options *o, struct lumi_error *error)
{
    int rows, columns, end = 0, code;
    double length;
    bool planar = !strncmp(text, "planar:", 7), sphere = !strncmp(text, "sphere:", 7);

    *rig = (struct sim_rig){0};
    if (!(o->scale > 0 && o->scale <= 1))
        return lumi_fail(error, LUMI_ERR_ARG, "scale %g: a number over 0, up to 1 wanted", o->scale);
    if (o->width < 0 || o->height < 0 || o->width > LUMI_RASTER_MAX || o->height > LUMI_RASTER_MAX)
        return lumi_fail(error, LUMI_ERR_ARG, "picture size %d x %d is out of range", o->width, o->height);
    bool fisheye = o->lens == SIM_LENS_FISHEYE || (o->lens == SIM_LENS_DEFAULT && sphere && !o->inward);
    if (!(o->fov >= 0 && o->fov <= (fisheye ? 360 : 170)))
        return lumi_fail(error, LUMI_ERR_ARG, "field of view %g: up to %d degrees wanted", o->fov, fisheye ? 360 : 170);
    if (planar || sphere) {
        if (sscanf(text + 7, "%dx%d:%lf%n", &rows, &columns, &length, &end) != 3 || text[7 + end])
            return lumi_fail(error, LUMI_ERR_ARG, "rig %s: %s:ROWSxCOLS:%s wanted", text, planar ? "planar" : "sphere",
                             planar ? "SPACING" : "RADIUS");
        if (rows < 1 || columns < 1 || rows > VIEWS_MAX / columns || !(length > 0 && length < 1000))
            return lumi_fail(error, LUMI_ERR_ARG, "rig %s: rows, columns or metres out of range", text);
        code = planar ? init_planar(rig, rows, columns, length, o, error)
                      : init_sphere(rig, rows, columns, length, o, error);
    } else {
        code = init_mechanism(rig, text, o, error);
    }
    if (code != LUMI_OK)
        sim_rig_finish(rig);
    return code;
}

static double uniform(uint64_t seed, int index, unsigned channel)
{
    return sim_random_unit(sim_random(seed, (uint64_t)index, channel));
}

/* A direction and a place for view `i` of a rig that stands on a sphere. */
static void random_in_ball(const struct sim_rig *rig, double volume, uint64_t seed, int i, struct lumi_pose *pose)
{
    double r = volume * cbrt(uniform(seed, i, 0)), up = 2 * uniform(seed, i, 1) - 1;
    double around = 2 * LUMI_PI * uniform(seed, i, 2), flat = sqrt(1 - up * up);
    double azimuth = 2 * LUMI_PI * uniform(seed, i, 3), elevation = 90 * DEGREE * (uniform(seed, i, 4) - 0.5);
    struct lumi_vec3 eye = lumi_vec3(r * flat * cos(around), r * flat * sin(around), r * up);
    struct lumi_vec3 out = lumi_vec3(cos(elevation) * cos(azimuth), cos(elevation) * sin(azimuth), sin(elevation));

    if (rig->inward) {
        /* Outside, between one and one and a half radii, looking in. */
        eye = lumi_scale(out, rig->radius * (1 + 0.5 * uniform(seed, i, 0)));
        out = lumi_scale(out, -1);
    }
    lumi_pose_look(eye, out, lumi_vec3(0, 0, 1), pose);
}

static void random_in_grid(const struct sim_rig *rig, uint64_t seed, int i, struct lumi_pose *pose)
{
    double x = rig->half_x * 0.9 * (2 * uniform(seed, i, 0) - 1), z = rig->half_z * 0.9 * (2 * uniform(seed, i, 1) - 1);
    double y = 0.1 * rig->radius * (2 * uniform(seed, i, 2) - 1);
    double azimuth = 16 * DEGREE * (uniform(seed, i, 3) - 0.5), elevation = 16 * DEGREE * (uniform(seed, i, 4) - 0.5);

    lumi_pose_look(lumi_vec3(x, y, z), lumi_vec3(sin(azimuth), cos(azimuth) * cos(elevation), sin(elevation)),
                   lumi_vec3(0, 0, 1), pose);
}

int sim_rig_random(const struct sim_rig *around, const struct sim_random_options *o, struct sim_rig *result,
                   struct lumi_error *error)
{
    int count = o->count + (o->eye_distance > 0);

    *result = (struct sim_rig){.count = count, .rows = 1, .columns = count, .cameras = 1};
    if (o->count < 1 || o->count > VIEWS_MAX || o->width < 0 || o->height < 0 || !(o->fov > 0 && o->fov < 179))
        return lumi_fail(error, LUMI_ERR_ARG, "random views: count, size or field of view out of range");
    if (!(o->volume >= 0 && o->volume < 1000) || !(o->eye_distance >= 0 && o->eye_distance < 1000))
        return lumi_fail(error, LUMI_ERR_ARG, "random views: volume %g or stereo %g m out of range", o->volume,
                         o->eye_distance);
    /* In the middle as many pixels a radian as the pictures, 4 by 3. */
    double half = around->views[0].lens.fx * tan(o->fov * DEGREE / 2);
    int width = o->width ? o->width : (int)fmin(2 * round(half), LUMI_RASTER_MAX);
    int height = o->height ? o->height : (int)fmin(2 * round(0.75 * half), LUMI_RASTER_MAX);
    if (width < 1 || height < 1)
        return lumi_fail(error, LUMI_ERR_ARG, "random views: the rig's pictures leave them no pixels");
    LUMI_TRY(allocate(result, error));
    double volume = o->volume > 0 ? o->volume : 0.6 * around->radius;
    for (int i = 0; i < o->count; i++) {
        int place = i > 0 && o->eye_distance > 0 ? i + 1 : i;
        struct sim_view *view = &result->views[place];
        *view = (struct sim_view){.column = place, .position = place};
        lumi_lens_init_pinhole(&view->lens, width, height, o->fov * DEGREE);
        if (around->plane)
            random_in_grid(around, o->seed, i, &view->pose);
        else
            random_in_ball(around, volume, o->seed, i, &view->pose);
    }
    if (o->eye_distance > 0) {
        struct sim_view *right = &result->views[1];
        *right = result->views[0];
        right->column = right->position = 1;
        right->pose.t = lumi_add(right->pose.t, lumi_scale(lumi_axis(&right->pose, 0), o->eye_distance));
    }
    return LUMI_OK;
}
