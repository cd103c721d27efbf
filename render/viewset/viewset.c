/* View sets: what is common to both sources, the cache, and the one from memory. */
#include "render/viewset/viewset.h"

#include "proto/base/memory.h"
#include "render/viewset/viewset_priv.h"

#include <string.h>

int lumi_viewset_alloc(int count, struct lumi_viewset **result, struct lumi_error *error)
{
    struct lumi_viewset *set = lumi_calloc(1, sizeof *set);

    if (!set)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a set of views");
    pthread_mutex_init(&set->lock, NULL);
    pthread_cond_init(&set->decoded, NULL);
    set->count = count;
    set->views = lumi_calloc((size_t)count, sizeof *set->views);
    set->slots = lumi_calloc((size_t)count, sizeof *set->slots);
    if (!set->views || !set->slots) {
        lumi_viewset_destroy(set);
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a set of %d views", count);
    }
    *result = set;
    return LUMI_OK;
}

static bool disk_valid(const struct lumi_disk *disk)
{
    const float sides[] = {disk->u_neg, disk->u_pos, disk->v_neg, disk->v_pos};

    for (int i = 0; i < 4; i++)
        if (!(sides[i] > 0) || !isfinite(sides[i]))
            return false;
    return true;
}

static int check(int index, const struct lumi_view *view, const struct lumi_raster *image, struct lumi_error *error)
{
    const struct lumi_raster *depth = view->inverse_depth;
    const struct lumi_view_mesh *mesh = view->mesh;

    if (!view->grid || !lumi_grid_valid(view->grid))
        return lumi_fail(error, LUMI_ERR_ARG, "view %d: its grid is not valid", index);
    if (!lumi_pose_valid(&view->pose, 1e-3))
        return lumi_fail(error, LUMI_ERR_ARG, "view %d: its pose is not a rotation and a place", index);
    if (!disk_valid(&view->disk))
        return lumi_fail(error, LUMI_ERR_ARG, "view %d: its disk has no extent", index);
    if (!mesh && !depth)
        return lumi_fail(error, LUMI_ERR_ARG, "view %d: neither mesh nor depth", index);
    if (mesh && (mesh->cols != view->grid->cols || mesh->rows != view->grid->rows))
        return lumi_fail(error, LUMI_ERR_ARG, "view %d: the mesh has other tiles than the grid", index);
    if (depth && (depth->width != view->grid->width || depth->height != view->grid->height || depth->channels != 1 ||
                  depth->sample != LUMI_F32))
        return lumi_fail(error, LUMI_ERR_ARG, "view %d: the depth map is not of the grid's size and one float channel",
                         index);
    if (image->width != view->grid->width || image->height != view->grid->height || image->channels != 3 ||
        (image->sample != LUMI_U8 && image->sample != LUMI_F32) || !image->data)
        return lumi_fail(error, LUMI_ERR_ARG, "view %d: the image is not of the grid's size and RGB in bytes or floats",
                         index);
    return LUMI_OK;
}

int lumi_viewset_create(int count, const struct lumi_view *views, const struct lumi_raster *images,
                        enum lumi_disk_shape shape, enum lumi_disk_kernel kernel, struct lumi_viewset **result,
                        struct lumi_error *error)
{
    struct lumi_viewset *set;

    if (count < 1)
        return lumi_fail(error, LUMI_ERR_ARG, "a set of %d views", count);
    for (int i = 0; i < count; i++)
        LUMI_TRY(check(i, &views[i], &images[i], error));
    LUMI_TRY(lumi_viewset_alloc(count, &set, error));
    memcpy(set->views, views, (size_t)count * sizeof *views);
    for (int i = 0; i < count; i++) {
        set->slots[i].pixels = images[i];
        set->centre = lumi_add(set->centre, lumi_scale(views[i].pose.t, 1.0 / count));
    }
    set->shape = shape;
    set->kernel = kernel;
    *result = set;
    return LUMI_OK;
}

static void free_slot(struct lumi_slot *slot)
{
    lumi_raster_finish(&slot->pixels);
    lumi_free(slot->missing);
    slot->missing = NULL;
}

void lumi_viewset_destroy(struct lumi_viewset *set)
{
    if (!set)
        return;
    for (int i = 0; set->source && set->slots && i < set->count; i++)
        free_slot(&set->slots[i]);
    if (set->source)
        set->source->destroy(set->state);
    lumi_free(set->views);
    lumi_free(set->slots);
    pthread_mutex_destroy(&set->lock);
    pthread_cond_destroy(&set->decoded);
    lumi_free(set);
}

int lumi_viewset_count(const struct lumi_viewset *set)
{
    return set->count;
}

const struct lumi_view *lumi_viewset_view(const struct lumi_viewset *set, int view)
{
    return &set->views[view];
}

struct lumi_pose lumi_viewset_middle(const struct lumi_viewset *set)
{
    struct lumi_pose pose = set->views[0].pose;

    pose.t = set->centre;
    return pose;
}

enum lumi_disk_shape lumi_viewset_shape(const struct lumi_viewset *set)
{
    return set->shape;
}

enum lumi_disk_kernel lumi_viewset_kernel(const struct lumi_viewset *set)
{
    return set->kernel;
}

int lumi_viewset_damaged(struct lumi_viewset *set)
{
    pthread_mutex_lock(&set->lock);
    int damaged = 0;
    for (int i = 0; i < set->count; i++)
        damaged += set->slots[i].damaged;
    pthread_mutex_unlock(&set->lock);
    return damaged;
}

/* With the lock held: lets the views go that were used longest ago, until what is kept fits. */
static void evict(struct lumi_viewset *set)
{
    while (set->cached_bytes > set->cache_bytes) {
        struct lumi_slot *oldest = NULL;
        for (int i = 0; i < set->count; i++) {
            struct lumi_slot *slot = &set->slots[i];
            if (slot->pixels.data && !slot->references && (!oldest || slot->used < oldest->used))
                oldest = slot;
        }
        if (!oldest)
            return;
        set->cached_bytes -= oldest->pixels.stride * (size_t)oldest->pixels.height;
        free_slot(oldest);
    }
}

/* With the lock held; lets go of it while decoding. */
static int decode_slot(struct lumi_viewset *set, int view, struct lumi_error *error)
{
    struct lumi_slot *slot = &set->slots[view], made = {0};

    slot->decoding = true;
    pthread_mutex_unlock(&set->lock);
    int code = set->source->decode(set->state, view, &made, error);
    pthread_mutex_lock(&set->lock);
    slot->decoding = false;
    pthread_cond_broadcast(&set->decoded);
    if (code != LUMI_OK)
        return code;
    slot->pixels = made.pixels;
    slot->missing = made.missing;
    slot->damaged = made.damaged;
    set->cached_bytes += made.pixels.stride * (size_t)made.pixels.height;
    return LUMI_OK;
}

int lumi_viewset_acquire(struct lumi_viewset *set, int view, struct lumi_raster *pixels, const uint8_t **missing,
                         struct lumi_error *error)
{
    struct lumi_slot *slot = &set->slots[view];
    int code = LUMI_OK;

    pthread_mutex_lock(&set->lock);
    while (slot->decoding)
        pthread_cond_wait(&set->decoded, &set->lock);
    if (!slot->pixels.data)
        code = decode_slot(set, view, error);
    if (code == LUMI_OK) {
        slot->references++;
        slot->used = ++set->clock;
        *pixels = slot->pixels;
        if (missing)
            *missing = slot->missing;
        if (set->source)
            evict(set);
    }
    pthread_mutex_unlock(&set->lock);
    return code;
}

void lumi_viewset_release(struct lumi_viewset *set, int view)
{
    pthread_mutex_lock(&set->lock);
    set->slots[view].references--;
    if (set->source)
        evict(set);
    pthread_mutex_unlock(&set->lock);
}
