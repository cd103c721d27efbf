/* The list that all formats are read into: cameras, lenses, poses. */
#include "pipeline/exchange/exchange.h"

#include "proto/base/raster.h"

#include <string.h>

static void clear_image(void *image)
{
    struct lumi_exchange_image *i = image;

    g_free(i->original);
    g_free(i->name);
    g_free(i->path);
}

void lumi_exchange_init(struct lumi_exchange *exchange)
{
    exchange->cameras = g_array_new(FALSE, TRUE, sizeof(struct lumi_exchange_camera));
    exchange->images = g_array_new(FALSE, TRUE, sizeof(struct lumi_exchange_image));
    g_array_set_clear_func(exchange->images, clear_image);
}

void lumi_exchange_finish(struct lumi_exchange *exchange)
{
    g_clear_pointer(&exchange->cameras, g_array_unref);
    g_clear_pointer(&exchange->images, g_array_unref);
}

static bool same_camera(const struct lumi_exchange_camera *a, const struct lumi_exchange_camera *b)
{
    return !strcmp(a->model, b->model) && a->parameter_count == b->parameter_count && a->width == b->width &&
           a->height == b->height && memcmp(&a->angle_x, &b->angle_x, sizeof a->angle_x) == 0 &&
           memcmp(a->parameters, b->parameters, sizeof *a->parameters * (size_t)a->parameter_count) == 0;
}

int lumi_exchange_add_camera(struct lumi_exchange *exchange, const struct lumi_exchange_camera *camera)
{
    /* Backwards: runs of frames share a camera, so this is nearly always the first one looked at. */
    for (int i = (int)exchange->cameras->len - 1; i >= 0; i--)
        if (same_camera(lumi_exchange_camera(exchange, i), camera))
            return i;
    g_array_append_val(exchange->cameras, *camera);
    return (int)exchange->cameras->len - 1;
}

/* Lenses */

static const struct lumi_exchange_model models[] = {
    {0, "SIMPLE_PINHOLE", 3, true},
    {1, "PINHOLE", 4, true},
    {2, "SIMPLE_RADIAL", 4, true},
    {3, "RADIAL", 5, true},
    {4, "OPENCV", 8, true},
    {5, "OPENCV_FISHEYE", 8, true},
    {6, "FULL_OPENCV", 12, true},
    {7, "FOV", 5, false},
    {8, "SIMPLE_RADIAL_FISHEYE", 4, false},
    {9, "RADIAL_FISHEYE", 5, false},
    {10, "THIN_PRISM_FISHEYE", 12, false},
    {11, "RAD_TAN_THIN_PRISM_FISHEYE", 16, false},
};

const struct lumi_exchange_model *lumi_exchange_model_by_name(const char *name)
{
    for (size_t i = 0; i < G_N_ELEMENTS(models); i++)
        if (!strcmp(models[i].name, name))
            return &models[i];
    return NULL;
}

const struct lumi_exchange_model *lumi_exchange_model_by_id(int id)
{
    return id >= 0 && id < (int)G_N_ELEMENTS(models) ? &models[id] : NULL;
}

static void lens_from_parameters(const struct lumi_exchange_model *model, const double *p, struct lumi_lens *lens)
{
    bool single = model->id == 0 || model->id == 2 || model->id == 3; /* one focal length */
    const double *rest = p + (single ? 3 : 4);

    lens->model = model->id == 5 ? LUMI_LENS_FISHEYE : LUMI_LENS_BROWN;
    lens->fx = p[0];
    lens->fy = single ? p[0] : p[1];
    lens->cx = p[single ? 1 : 2];
    lens->cy = p[single ? 2 : 3];
    if (model->id >= 2)
        lens->k1 = rest[0];
    if (model->id >= 3)
        lens->k2 = rest[1];
    if (model->id == 5) {
        lens->k3 = rest[2];
        lens->k4 = rest[3];
    } else if (model->id == 4 || model->id == 6) {
        lens->p1 = rest[2];
        lens->p2 = rest[3];
        lens->k3 = model->id == 6 ? rest[4] : 0;
    }
}

int lumi_exchange_lens(const struct lumi_exchange_camera *camera, const char *what, struct lumi_lens *lens,
                       struct lumi_error *error)
{
    const struct lumi_exchange_model *model = lumi_exchange_model_by_name(camera->model);
    const double *p = camera->parameters;

    *lens = (struct lumi_lens){.width = camera->width, .height = camera->height};
    if (!model || !model->supported)
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "%s: the lens model '%s' is not supported", what, camera->model);
    if (camera->parameter_count == 0 && camera->angle_x > 0 && camera->angle_x < LUMI_PI) {
        lumi_lens_init_pinhole(lens, camera->width, camera->height, camera->angle_x);
    } else {
        if (camera->parameter_count != model->parameter_count)
            return lumi_fail(error, LUMI_ERR_FORMAT, "%s: a camera without its focal length", what);
        if (model->id == 6 && (p[9] != 0 || p[10] != 0 || p[11] != 0))
            return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "%s: FULL_OPENCV with k4, k5 or k6 is not supported", what);
        lens_from_parameters(model, p, lens);
    }
    if (lens->width < 1 || lens->height < 1 || lens->width > LUMI_RASTER_MAX || lens->height > LUMI_RASTER_MAX)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: a camera of %dx%d pixels", what, lens->width, lens->height);
    if (!lumi_lens_valid(lens))
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: a camera whose focal length or other numbers make no sense",
                         what);
    return LUMI_OK;
}

bool lumi_exchange_describe_lens(const struct lumi_lens *lens, struct lumi_exchange_camera *camera)
{
    int id = 1;

    *camera = (struct lumi_exchange_camera){.width = lens->width, .height = lens->height};
    double *p = camera->parameters;
    double common[8] = {lens->fx, lens->fy, lens->cx, lens->cy, lens->k1, lens->k2, lens->p1, lens->p2};
    memcpy(p, common, sizeof common);
    if (lens->model == LUMI_LENS_FISHEYE) {
        id = 5;
        p[6] = lens->k3;
        p[7] = lens->k4;
    } else if (lens->model != LUMI_LENS_BROWN) {
        return false;
    } else if (lens->k3 != 0) {
        id = 6;
        p[8] = lens->k3;
    } else if (lens->k1 != 0 || lens->k2 != 0 || lens->p1 != 0 || lens->p2 != 0) {
        id = 4;
    }
    g_strlcpy(camera->model, models[id].name, sizeof camera->model);
    camera->parameter_count = models[id].parameter_count;
    for (int i = camera->parameter_count; i < LUMI_EXCHANGE_PARAMETERS; i++)
        p[i] = 0;
    return true;
}

/* Poses */

/* nerfstudio's camera has y up and z backward: the second and third column change sign. */
static void pose_from_matrix(const double *m, struct lumi_pose *pose)
{
    for (int i = 0; i < 3; i++) {
        pose->r[3 * i] = m[4 * i];
        pose->r[3 * i + 1] = -m[4 * i + 1];
        pose->r[3 * i + 2] = -m[4 * i + 2];
    }
    pose->t = lumi_vec3(m[3], m[7], m[11]);
}

/* COLMAP: camera = R(q) · world + t. */
static void pose_from_quaternion(const double *q, struct lumi_pose *pose)
{
    double r[9];

    lumi_rotation_from_quaternion(q, r);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            pose->r[3 * i + j] = r[3 * j + i];
    pose->t = lumi_scale(lumi_rotate_back(r, lumi_vec3(q[4], q[5], q[6])), -1);
}

static double determinant(const double r[9])
{
    return r[0] * (r[4] * r[8] - r[5] * r[7]) - r[1] * (r[3] * r[8] - r[5] * r[6]) + r[2] * (r[3] * r[7] - r[4] * r[6]);
}

int lumi_exchange_pose_from(enum lumi_exchange_numbers numbers, const double *source, const char *what,
                            struct lumi_pose *pose, struct lumi_error *error)
{
    for (int i = 0; i < (int)numbers; i++)
        if (!isfinite(source[i]))
            return lumi_fail(error, LUMI_ERR_FORMAT, "%s: its pose holds a number that is not finite", what);
    if (numbers == LUMI_EXCHANGE_QUATERNION) {
        double length =
            sqrt(source[0] * source[0] + source[1] * source[1] + source[2] * source[2] + source[3] * source[3]);
        double unit[7] = {0, 0, 0, 0, source[4], source[5], source[6]};
        if (!(length > 1e-6) || !isfinite(length))
            return lumi_fail(error, LUMI_ERR_FORMAT, "%s: its pose is singular (a quaternion of length %g)", what,
                             length);
        for (int i = 0; i < 4; i++)
            unit[i] = source[i] / length;
        pose_from_quaternion(unit, pose);
    } else {
        pose_from_matrix(source, pose);
    }
    double det = determinant(pose->r);
    if (!isfinite(det) || fabs(det) < 1e-9)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: its pose is singular", what);
    if (!lumi_place_valid(pose->t))
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: its pose is farther than %g from the origin", what,
                         LUMI_PLACE_MAX);
    if (!lumi_pose_valid(pose, 1e-3))
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: its pose is no rotation (%s)", what,
                         det < 0 ? "it mirrors" : "it scales or shears");
    if (!lumi_pose_valid(pose, 1e-12))
        lumi_rotation_orthonormalize(pose->r);
    return LUMI_OK;
}

void lumi_exchange_pose_to(enum lumi_exchange_numbers numbers, const struct lumi_pose *pose, double *source)
{
    if (numbers == LUMI_EXCHANGE_MATRIX) {
        for (int i = 0; i < 3; i++) {
            source[4 * i] = pose->r[3 * i];
            source[4 * i + 1] = 0 - pose->r[3 * i + 1];
            source[4 * i + 2] = 0 - pose->r[3 * i + 2];
        }
        source[3] = pose->t.x;
        source[7] = pose->t.y;
        source[11] = pose->t.z;
    } else {
        double r[9];
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++)
                r[3 * i + j] = pose->r[3 * j + i];
        lumi_rotation_to_quaternion(r, source);
        struct lumi_vec3 t = lumi_rotate(r, pose->t);
        source[4] = 0 - t.x;
        source[5] = 0 - t.y;
        source[6] = 0 - t.z;
    }
}
