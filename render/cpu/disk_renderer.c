/* The reference renderer: views in groups, output blocks in parallel, every pixel's views in the set's order. */
#include "render/cpu/disk_renderer.h"

#include "proto/base/memory.h"
#include "proto/base/parallel.h"
#include "render/cpu/compose.h"
#include "render/cpu/ray_renderer.h"
#include "render/cpu/view_shade.h"

#include <string.h>

#define GROUP 16      /* views prepared and held at a time */
#define GROUP_DENSE 4 /* the same where they have dense depth, which takes some 30 bytes a pixel */

struct render {
    struct lumi_viewset *set;
    struct lumi_vec3 eye;
    const struct lumi_disk_settings *settings;
    struct lumi_shade_settings shade;
    const struct lumi_rays *rays;
    int *visible, visible_count; /* views, in the set's order */
    struct lumi_surface_view surfaces[GROUP];
    struct lumi_source_image images[GROUP];
    struct lumi_error errors[GROUP];
    const int *group; /* of `visible` */
    int group_count;
    bool depth_pass; /* only finds the nearest surface (inter-image test) */
    struct lumi_sums *sums;
    float *nearest;                    /* inter-image test: of all views */
    struct lumi_block_buffer *buffers; /* one a thread */
    int threads;
};

void lumi_disk_settings_default(struct lumi_disk_settings *settings)
{
    *settings = (struct lumi_disk_settings){
        .kernel = -1, .disk_scale = 1, .filter = LUMI_FILTER_CUBIC, .stretch = 1, .sample = LUMI_U8};
}

static int check_settings(const struct lumi_disk_settings *s, struct lumi_error *error)
{
    if (!(s->disk_scale > 0) || !(s->disk_scale < 1000))
        return lumi_fail(error, LUMI_ERR_ARG, "disk scale %g is not in (0, 1000)", (double)s->disk_scale);
    if (!(s->stretch >= 0) || !(s->stretch < 1e6f))
        return lumi_fail(error, LUMI_ERR_ARG, "stretch %g is not in [0, 1e6)", (double)s->stretch);
    if (s->kernel > LUMI_KERNEL_CUBIC || s->depth_test > LUMI_DEPTH_INTER || s->filter > LUMI_FILTER_CUBIC ||
        (s->sample != LUMI_U8 && s->sample != LUMI_U16 && s->sample != LUMI_F32))
        return lumi_fail(error, LUMI_ERR_ARG, "a kernel, depth test, filter or sample type that does not exist");
    return LUMI_OK;
}

/* Which views any block sees through their disks. */
static int find_visible(void *context, int index, int thread)
{
    struct render *render = context;
    struct lumi_surface_view surface;

    (void)thread;
    lumi_surface_place(&surface, lumi_viewset_view(render->set, index), render->eye, render->settings->disk_scale);
    render->visible[index] = -1;
    for (int b = 0; b < render->rays->block_cols * render->rays->block_rows; b++)
        if (!lumi_surface_hidden(&surface, &render->rays->blocks[b])) {
            render->visible[index] = index;
            break;
        }
    return LUMI_OK;
}

static int prepare_view(void *context, int index, int thread)
{
    struct render *render = context;
    struct lumi_source_image *image = &render->images[index];
    struct lumi_surface_view *surface = &render->surfaces[index];
    int view = render->group[index];

    (void)thread;
    image->filter = render->settings->filter;
    image->linear = render->settings->linear_light;
    image->missing = NULL;
    lumi_surface_place(surface, lumi_viewset_view(render->set, view), render->eye, render->settings->disk_scale);
    LUMI_TRY(lumi_viewset_acquire(render->set, view, &image->pixels, &image->missing, &render->errors[index]));
    int code = lumi_surface_build(surface);
    if (code == LUMI_OK)
        return LUMI_OK;
    lumi_viewset_release(render->set, view);
    return lumi_fail(&render->errors[index], code, "no memory for view %d's surface", view);
}

static int draw_view_undepthed(struct render *render, struct lumi_block_buffer *buffer, int block, int index)
{
    const struct lumi_surface_view *surface = &render->surfaces[index];

    for (int p = 0; p < surface->patch_count; p++) {
        const struct lumi_patch *patch = &surface->patches[p];
        if ((render->images[index].missing && render->images[index].missing[patch->tile]) ||
            lumi_cones_apart(&patch->cone, &render->rays->blocks[block]))
            continue;
        for (int i = 0; i < patch->triangle_count; i++) {
            int drawn = lumi_block_draw_one(buffer, render->rays, block, surface, patch, i);
            if (drawn < 0)
                return drawn;
            if (!drawn)
                continue;
            lumi_shade_block(buffer, render->rays, block, surface, &render->images[index], &render->shade, NULL,
                             render->sums);
            lumi_block_clear(buffer);
        }
    }
    return LUMI_OK;
}

/* The nearest surface of those that carry weight. */
static void note_nearest(struct render *render, const struct lumi_block_buffer *buffer, int block, int index)
{
    size_t first = (size_t)block * LUMI_BLOCK_PIXELS;

    for (int i = 0; i < LUMI_BLOCK_PIXELS; i++) {
        size_t at = first + (size_t)i;
        float u, v;
        if (buffer->record[i] >= 0 && buffer->nearness[i] > render->nearest[at] &&
            lumi_shade_weight(&render->surfaces[index], &render->shade, render->rays->x[at], render->rays->y[at],
                              render->rays->z[at], &u, &v) > 0)
            render->nearest[at] = buffer->nearness[i];
    }
}

static int draw_block(void *context, int block, int thread)
{
    struct render *render = context;
    struct lumi_block_buffer *buffer = &render->buffers[thread];
    const struct lumi_cone *cone = &render->rays->blocks[block];

    for (int k = 0; k < render->group_count; k++) {
        const struct lumi_surface_view *surface = &render->surfaces[k];
        if (lumi_surface_hidden(surface, cone))
            continue;
        lumi_block_clear(buffer);
        if (render->settings->depth_test == LUMI_DEPTH_NONE) {
            LUMI_TRY(draw_view_undepthed(render, buffer, block, k));
            continue;
        }
        for (int p = 0; p < surface->patch_count; p++)
            if (!render->images[k].missing || !render->images[k].missing[surface->patches[p].tile])
                LUMI_TRY(lumi_block_draw(buffer, render->rays, block, surface, &surface->patches[p]));
        if (render->depth_pass)
            note_nearest(render, buffer, block, k);
        else
            lumi_shade_block(buffer, render->rays, block, surface, &render->images[k], &render->shade,
                             render->nearest ? render->nearest + (size_t)block * LUMI_BLOCK_PIXELS : NULL,
                             render->sums);
    }
    return LUMI_OK;
}

static int draw_group(struct render *render, const int *group, int count, struct lumi_error *error)
{
    render->group = group;
    render->group_count = count;
    memset(render->surfaces, 0, sizeof render->surfaces);
    memset(render->images, 0, sizeof render->images);
    int code = lumi_parallel_for(count, render->threads, prepare_view, render);
    if (code != LUMI_OK) {
        for (int i = count - 1; i >= 0; i--)
            if (render->errors[i].code == code && error)
                *error = render->errors[i];
    } else {
        code =
            lumi_parallel_for(render->rays->block_cols * render->rays->block_rows, render->threads, draw_block, render);
        if (code != LUMI_OK)
            lumi_fail(error, code, "no memory while drawing");
    }
    for (int i = 0; i < count; i++)
        if (render->surfaces[i].tile_x) { /* made, and its view held */
            lumi_surface_finish(&render->surfaces[i]);
            lumi_viewset_release(render->set, group[i]);
        }
    return code;
}

static int draw_all(struct render *render, struct lumi_error *error)
{
    int at = 0;

    while (at < render->visible_count) {
        bool dense = !lumi_viewset_view(render->set, render->visible[at])->mesh;
        int count = render->visible_count - at, most = dense ? GROUP_DENSE : GROUP;
        if (count > most)
            count = most;
        LUMI_TRY(draw_group(render, render->visible + at, count, error));
        at += count;
    }
    return LUMI_OK;
}

/* All views' sums for all rays. */
static int sum_views(struct render *render, struct lumi_error *error)
{
    int views = lumi_viewset_count(render->set), count = 0;

    render->visible = lumi_calloc((size_t)views, sizeof(int));
    render->buffers = lumi_calloc((size_t)render->threads, sizeof *render->buffers);
    if (!render->visible || !render->buffers)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory to render");
    lumi_parallel_for(views, render->threads, find_visible, render);
    for (int i = 0; i < views; i++)
        if (render->visible[i] >= 0)
            render->visible[count++] = i;
    render->visible_count = count;
    if (render->settings->depth_test == LUMI_DEPTH_INTER) {
        render->nearest = lumi_calloc(render->rays->pixels, sizeof(float));
        if (!render->nearest)
            return lumi_fail(error, LUMI_ERR_NOMEM, "no memory to render");
        render->depth_pass = true;
        LUMI_TRY(draw_all(render, error));
        render->depth_pass = false;
    }
    return draw_all(render, error);
}

int lumi_render_rays(struct lumi_viewset *set, const struct lumi_rays *rays, struct lumi_vec3 eye,
                     const struct lumi_disk_settings *settings, struct lumi_sums *sums, struct lumi_error *error)
{
    struct lumi_disk_settings defaults;
    struct render *render;

    lumi_disk_settings_default(&defaults);
    settings = settings ? settings : &defaults;
    LUMI_TRY(check_settings(settings, error));
    lumi_shade_tables();
    render = lumi_calloc(1, sizeof *render);
    if (!render)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory to render");
    render->set = set;
    render->eye = eye;
    render->settings = settings;
    render->rays = rays;
    render->sums = sums;
    render->threads = settings->threads > 0 ? settings->threads : lumi_thread_count();
    render->shade = (struct lumi_shade_settings){
        .shape = lumi_viewset_shape(set),
        .kernel = settings->kernel >= 0 ? (enum lumi_disk_kernel)settings->kernel : lumi_viewset_kernel(set),
        .disk_scale = settings->disk_scale,
        .stretch = settings->stretch};
    int code = sum_views(render, error);
    for (int i = 0; render->buffers && i < render->threads; i++)
        lumi_block_finish(&render->buffers[i]);
    lumi_free(render->buffers);
    lumi_free(render->visible);
    lumi_free(render->nearest);
    lumi_free(render);
    return code;
}

int lumi_render_disks(struct lumi_viewset *set, const struct lumi_lens *lens, const struct lumi_pose *pose,
                      const struct lumi_disk_settings *settings, struct lumi_picture *picture, struct lumi_error *error)
{
    struct lumi_disk_settings defaults;
    struct lumi_rays rays;
    struct lumi_sums sums = {0};
    int code;

    lumi_disk_settings_default(&defaults);
    settings = settings ? settings : &defaults;
    const int threads = settings->threads > 0 ? settings->threads : lumi_thread_count();
    LUMI_TRY(check_settings(settings, error));
    LUMI_TRY(lumi_rays_init(&rays, lens, pose, threads, error));
    LUMI_GOTO(code, done, lumi_sums_create(&sums, rays.pixels, error));
    LUMI_GOTO(code, done, lumi_render_rays(set, &rays, pose->t, settings, &sums, error));
    code = lumi_compose(&rays, &sums, settings->linear_light, settings->sample, threads, picture, error);
done:
    lumi_sums_finish(&sums);
    lumi_rays_finish(&rays);
    return code;
}
