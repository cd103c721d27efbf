/* Shared by the sources of view sets: memory and field. */
#ifndef LUMI_RENDER_VIEWSET_VIEWSET_PRIV_H
#define LUMI_RENDER_VIEWSET_VIEWSET_PRIV_H

#include "render/viewset/viewset.h"

#include <pthread.h>
#include <stdbool.h>

/* A view's pixels. Fields are guarded by the set's lock; the pixels themselves are written by the one thread that set
 * `decoding` and read by those that hold a reference. */
struct lumi_slot {
    struct lumi_raster pixels; /* data NULL: not decoded */
    uint8_t *missing;          /* a byte a tile, 1: nothing is known there; NULL: all is there */
    bool decoding;
    int references;
    int damaged;   /* tiles found damaged; known once the view was decoded, also after it was let go */
    uint64_t used; /* the set's clock when last acquired */
};

struct lumi_viewset_source {
    /* Fills what the caller's slot will hold; several threads at once, for different views. */
    int (*decode)(void *state, int view, struct lumi_slot *slot, struct lumi_error *error);
    void (*destroy)(void *state);
};

struct lumi_viewset {
    int count;
    struct lumi_view *views;
    struct lumi_slot *slots;
    struct lumi_vec3 centre;
    enum lumi_disk_shape shape;
    enum lumi_disk_kernel kernel;
    /* NULL for a set from memory. decode makes a view's pixels; it is called without the lock. */
    const struct lumi_viewset_source *source;
    void *state; /* the source's */
    size_t cache_bytes, cached_bytes;
    uint64_t clock;
    pthread_mutex_t lock;
    pthread_cond_t decoded;
};

/* An empty set of `count` views, to be filled. */
int lumi_viewset_alloc(int count, struct lumi_viewset **result, struct lumi_error *error);

#endif
