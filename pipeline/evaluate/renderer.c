/* A field, opened for rendering with one method. */
#include "pipeline/evaluate/renderer.h"

#include "pipeline/geometry/disks.h"
#include "proto/base/memory.h"

#include <string.h>

struct lumi_renderer {
    struct lumi_render_options options;
    struct lumi_field *field;
    struct lumi_viewset *set;
    int *triangles; /* of the camera mesh; for the plane only */
    int triangle_count;
    struct lumi_vec3 axis; /* the views' mean gaze */
    double inverse_distance;
};

void lumi_render_options_default(struct lumi_render_options *options)
{
    memset(options, 0, sizeof *options);
    options->level = LUMI_LEVEL_FINE;
    lumi_disk_settings_default(&options->disks);
}

static int prepare_camera_mesh(struct lumi_renderer *renderer, const char *path, struct lumi_error *error)
{
    const struct lumi_field_info *info = lumi_field_info(renderer->field);
    int count = lumi_viewset_count(renderer->set);
    struct lumi_pose *poses = lumi_alloc((size_t)count, sizeof *poses);
    struct lumi_vec3 axis = {0, 0, 0};

    if (!poses)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: no memory for the camera mesh", path);
    for (int i = 0; i < count; i++) {
        poses[i] = lumi_viewset_view(renderer->set, i)->pose;
        axis = lumi_add(axis, lumi_axis(&poses[i], 2));
    }
    renderer->axis = lumi_length(axis) > 1e-9 ? lumi_normalize(axis) : lumi_vec3(0, 0, 1);
    int code = lumi_camera_triangles(count, poses, info->surface, info->centre, &renderer->triangles,
                                     &renderer->triangle_count, error);
    lumi_free(poses);
    if (code == LUMI_OK && renderer->triangle_count == 0)
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED,
                         "%s: its cameras do not span a surface, so there is no camera mesh", path);
    return code;
}

int lumi_renderer_open(const char *path, const struct lumi_render_options *options, struct lumi_renderer **result,
                       struct lumi_error *error)
{
    struct lumi_renderer *renderer = lumi_calloc(1, sizeof *renderer);
    size_t cache = options->cache_bytes ? options->cache_bytes : (size_t)1 << 30;
    int code;

    if (!renderer)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: no memory", path);
    renderer->options = *options;
    LUMI_GOTO(code, failed, lumi_field_open(path, options->disks.threads, &renderer->field, error));
    LUMI_GOTO(code, failed, lumi_viewset_from_field(renderer->field, options->level, cache, &renderer->set, error));
    if (options->method == LUMI_METHOD_PLANE)
        LUMI_GOTO(code, failed, prepare_camera_mesh(renderer, path, error));
    if (options->plane_distance > 0)
        renderer->inverse_distance = 1 / options->plane_distance;
    *result = renderer;
    return LUMI_OK;
failed:
    lumi_renderer_close(renderer);
    return code;
}

void lumi_renderer_close(struct lumi_renderer *renderer)
{
    if (!renderer)
        return;
    lumi_viewset_destroy(renderer->set);
    lumi_field_close(renderer->field);
    lumi_free(renderer->triangles);
    lumi_free(renderer);
}

const struct lumi_field *lumi_renderer_field(const struct lumi_renderer *renderer)
{
    return renderer->field;
}

int lumi_renderer_damaged(struct lumi_renderer *renderer)
{
    return lumi_viewset_damaged(renderer->set);
}

void lumi_renderer_range(const struct lumi_renderer *renderer, double *low, double *high)
{
    *low = INFINITY;
    *high = 0;
    for (int i = 0; i < lumi_viewset_count(renderer->set); i++) {
        const struct lumi_view_mesh *mesh = lumi_viewset_view(renderer->set, i)->mesh;
        for (int t = 0; mesh && t < mesh->cols * mesh->rows; t++)
            for (int v = 0; v < mesh->tiles[t].vertex_count; v++) {
                double w = lumi_mesh_inverse_depth(mesh, &mesh->tiles[t], mesh->tiles[t].vertices[v].d);
                *low = fmin(*low, w);
                *high = fmax(*high, w);
            }
    }
    *low = fmin(fmax(*low, 0), *high);
}

void lumi_renderer_set_plane(struct lumi_renderer *renderer, double inverse_distance)
{
    renderer->inverse_distance = inverse_distance;
}

int lumi_renderer_draw(struct lumi_renderer *renderer, const struct lumi_lens *lens, const struct lumi_pose *pose,
                       struct lumi_picture *picture, struct lumi_error *error)
{
    const struct lumi_disk_settings *disks = &renderer->options.disks;
    const struct lumi_field_info *info = lumi_field_info(renderer->field);

    memset(picture, 0, sizeof *picture);
    if (renderer->options.method == LUMI_METHOD_DISKS)
        return lumi_render_disks(renderer->set, lens, pose, disks, picture, error);
    const struct lumi_camera_mesh mesh = {renderer->triangles, renderer->triangle_count};
    const struct lumi_plane_settings plane = {.origin = info->centre,
                                              .axis = renderer->axis,
                                              .inverse_depth = renderer->inverse_distance,
                                              .sphere = info->surface == LUMI_SURFACE_SPHERE,
                                              .filter = disks->filter,
                                              .linear_light = disks->linear_light,
                                              .sample = disks->sample,
                                              .threads = disks->threads};
    return lumi_render_plane(renderer->set, &mesh, lens, pose, &plane, picture, error);
}
