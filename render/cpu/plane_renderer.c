/* Camera-mesh blending over one plane. */
#include "render/cpu/plane_renderer.h"

#include "proto/base/memory.h"
#include "proto/base/parallel.h"
#include "render/cpu/compose.h"
#include "render/cpu/view_shade.h"

#include <float.h>
#include <string.h>

#define NO_TRIANGLE -1

struct plane_render {
    struct lumi_viewset *set;
    const struct lumi_camera_mesh *mesh;
    const struct lumi_pose *pose;
    const struct lumi_plane_settings *settings;
    struct lumi_rays rays;
    struct lumi_surface_view *views; /* placed, without a surface */
    int *triangle;                   /* a pixel: the camera triangle its ray goes through */
    float *weights[3];               /* its barycentric coordinates */
    unsigned char *needed;           /* views some pixel uses */
    struct lumi_source_image image;  /* of the view being drawn */
    int view;
    struct lumi_sums sums;
};

/* The plane's inverse distance along the unit ray e, as seen from the eye; negative: not met. */
static double plane_nearness(const struct plane_render *render, struct lumi_vec3 e)
{
    const struct lumi_plane_settings *s = render->settings;
    struct lumi_vec3 o = lumi_sub(render->pose->t, s->origin);
    double w = s->inverse_depth;

    if (w <= 0)
        return 0;
    if (!s->sphere) {
        double ahead = 1 - w * lumi_dot(o, s->axis), along = w * lumi_dot(e, s->axis);
        return ahead > 1e-9 && along >= 0 ? along / ahead : -1;
    }
    double b = lumi_dot(o, e), c = lumi_dot(o, o) - 1 / (w * w), root = b * b - c;
    double t = root >= 0 ? -b + sqrt(root) : -1;
    return t > 1e-9 ? 1 / t : -1;
}

/* Barycentric coordinates of where the ray's line goes through the triangle of directions V_k (not of unit length:
 * centre minus eye), in front of the eye or behind it; false where it does not. On a shared edge the first triangle
 * that takes the pixel keeps it, so a hair of slack leaves no gap. */
static bool through(const struct lumi_vec3 v[3], struct lumi_vec3 e, float weights[3])
{
    double d[3], sum = 0;

    for (int k = 0; k < 3; k++) {
        d[k] = lumi_dot(lumi_cross(v[(k + 1) % 3], v[(k + 2) % 3]), e);
        sum += d[k];
    }
    /* e = Σ d_k V_k / det: the line meets the triangle's plane at Σ d_k V_k / Σ d_k. */
    if (!(fabs(sum) > DBL_MIN))
        return false;
    for (int k = 0; k < 3; k++) {
        double share = d[k] / sum;
        if (!(share >= -1e-9))
            return false;
        weights[k] = (float)fmax(share, 0);
    }
    return true;
}

static bool faces(const struct plane_render *render, const int *index, struct lumi_vec3 e)
{
    for (int k = 0; k < 3; k++) {
        const float *f = render->views[index[k]].forward;
        if (!(f[0] * e.x + f[1] * e.y + f[2] * e.z > 0))
            return false;
    }
    return true;
}

/* True where no line of the cone goes through the triangle: two of its edges have all of them on opposite sides. */
static bool misses(const struct lumi_vec3 v[3], const struct lumi_cone *cone)
{
    bool positive = false, negative = false;

    for (int k = 0; k < 3; k++) {
        struct lumi_vec3 n = lumi_cross(v[(k + 1) % 3], v[(k + 2) % 3]);
        double dot = n.x * cone->x + n.y * cone->y + n.z * cone->z, slack = lumi_length(n) * cone->sine;
        positive |= dot > slack;
        negative |= dot < -slack;
    }
    return (positive && negative) || cone->cosine > 1;
}

static int find_triangles(void *context, int block, int thread)
{
    struct plane_render *render = context;
    const struct lumi_rays *rays = &render->rays;
    size_t first = (size_t)block * LUMI_BLOCK_PIXELS;

    (void)thread;
    for (size_t i = first; i < first + LUMI_BLOCK_PIXELS; i++)
        render->triangle[i] = NO_TRIANGLE;
    for (int t = 0; t < render->mesh->triangle_count; t++) {
        const int *index = render->mesh->triangles + 3 * t;
        struct lumi_vec3 v[3];
        for (int k = 0; k < 3; k++)
            v[k] = lumi_sub(lumi_viewset_view(render->set, index[k])->pose.t, render->pose->t);
        if (misses(v, &rays->blocks[block]))
            continue;
        for (size_t i = first; i < first + LUMI_BLOCK_PIXELS; i++) {
            struct lumi_vec3 e = lumi_vec3(rays->x[i], rays->y[i], rays->z[i]);
            float weights[3];
            if (render->triangle[i] != NO_TRIANGLE || !faces(render, index, e) || !through(v, e, weights))
                continue;
            render->triangle[i] = t;
            for (int k = 0; k < 3; k++)
                render->weights[k][i] = weights[k];
        }
    }
    return LUMI_OK;
}

static void add(struct plane_render *render, size_t at, float weight)
{
    const struct lumi_surface_view *view = &render->views[render->view];
    const struct lumi_rays *rays = &render->rays;
    const float *r = view->rt;
    float x = rays->x[at], y = rays->y[at], z = rays->z[at], color[3];
    float s = (float)plane_nearness(render, lumi_vec3(x, y, z));
    double px, py;

    if (!(s >= 0))
        return;
    struct lumi_vec3 p =
        lumi_vec3(r[0] * x + r[1] * y + r[2] * z + s * view->ex, r[3] * x + r[4] * y + r[5] * z + s * view->ey,
                  r[6] * x + r[7] * y + r[8] * z + s * view->ez);
    const struct lumi_grid *grid = view->view->grid;
    if (!lumi_grid_project(grid, p, &px, &py) || px < 0 || py < 0 || px > grid->width || py > grid->height)
        return;
    lumi_sample_image(&render->image, (float)px, (float)py, color);
    render->sums.r[at] += weight * color[0];
    render->sums.g[at] += weight * color[1];
    render->sums.b[at] += weight * color[2];
    render->sums.weight[at] += weight;
    render->sums.nearness[at] += weight * s;
}

static int draw_plane_block(void *context, int block, int thread)
{
    struct plane_render *render = context;
    size_t first = (size_t)block * LUMI_BLOCK_PIXELS;

    (void)thread;
    for (size_t i = first; i < first + LUMI_BLOCK_PIXELS; i++) {
        if (render->triangle[i] == NO_TRIANGLE)
            continue;
        const int *index = render->mesh->triangles + 3 * render->triangle[i];
        for (int k = 0; k < 3; k++)
            if (index[k] == render->view && render->weights[k][i] > 0)
                add(render, i, render->weights[k][i]);
    }
    return LUMI_OK;
}

static int prepare_plane(struct plane_render *render, struct lumi_error *error)
{
    int views = lumi_viewset_count(render->set);
    size_t pixels = render->rays.pixels;

    for (int i = 0; i < 3 * render->mesh->triangle_count; i++)
        if (render->mesh->triangles[i] < 0 || render->mesh->triangles[i] >= views)
            return lumi_fail(error, LUMI_ERR_ARG, "the camera mesh names view %d of %d", render->mesh->triangles[i],
                             views);
    render->views = lumi_calloc((size_t)views, sizeof *render->views);
    render->triangle = lumi_alloc(pixels, sizeof(int));
    render->needed = lumi_calloc((size_t)views, 1);
    for (int k = 0; k < 3; k++)
        render->weights[k] = lumi_calloc(pixels, sizeof(float));
    if (!render->views || !render->triangle || !render->needed || !render->weights[0] || !render->weights[1] ||
        !render->weights[2])
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory to render");
    for (int i = 0; i < views; i++)
        lumi_surface_place(&render->views[i], lumi_viewset_view(render->set, i), render->pose->t, 1);
    return lumi_sums_create(&render->sums, pixels, error);
}

static int draw_plane(struct plane_render *render, struct lumi_picture *picture, struct lumi_error *error)
{
    const struct lumi_plane_settings *s = render->settings;
    int blocks = render->rays.block_cols * render->rays.block_rows;

    LUMI_TRY(prepare_plane(render, error));
    lumi_parallel_for(blocks, s->threads, find_triangles, render);
    for (size_t i = 0; i < render->rays.pixels; i++)
        for (int k = 0; k < 3 && render->triangle[i] != NO_TRIANGLE; k++)
            render->needed[render->mesh->triangles[3 * render->triangle[i] + k]] = 1;
    for (int view = 0; view < lumi_viewset_count(render->set); view++) {
        if (!render->needed[view])
            continue;
        render->view = view;
        render->image = (struct lumi_source_image){.filter = s->filter, .linear = s->linear_light};
        LUMI_TRY(lumi_viewset_acquire(render->set, view, &render->image.pixels, NULL, error));
        lumi_parallel_for(blocks, s->threads, draw_plane_block, render);
        lumi_viewset_release(render->set, view);
    }
    return lumi_compose(&render->rays, &render->sums, s->linear_light, s->sample, s->threads, picture, error);
}

int lumi_render_plane(struct lumi_viewset *set, const struct lumi_camera_mesh *mesh, const struct lumi_lens *lens,
                      const struct lumi_pose *pose, const struct lumi_plane_settings *settings,
                      struct lumi_picture *picture, struct lumi_error *error)
{
    struct plane_render render = {.set = set, .mesh = mesh, .pose = pose, .settings = settings};

    lumi_shade_tables();
    int code = lumi_rays_init(&render.rays, lens, pose, settings->threads, error);
    if (code == LUMI_OK)
        code = draw_plane(&render, picture, error);
    for (int k = 0; k < 3; k++)
        lumi_free(render.weights[k]);
    lumi_free(render.triangle);
    lumi_free(render.needed);
    lumi_free(render.views);
    lumi_sums_finish(&render.sums);
    lumi_rays_finish(&render.rays);
    return code;
}
