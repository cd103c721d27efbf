/* Frames in a pool: the camera's thread takes them, whoever is done with one gives it back, from any thread. The pool
 * goes with the last of its holders. */
#include "daemon/camera/camera_priv.h"
#include "proto/base/memory.h"

#include <math.h>
#include <pthread.h>
#include <string.h>

struct pooled {
    struct lumi_camera_frame frame; /* first: release finds the rest by it */
    struct camera_pool *pool;
    uint8_t *bytes;
    size_t capacity;
    bool out;
};
struct camera_pool {
    pthread_mutex_t lock;
    int holders; /* who made it, and every frame that is out */
    int count;
    struct pooled frames[];
};

void camera_frame_init(struct lumi_camera_frame *frame)
{
    memset(frame, 0, sizeof *frame);
    frame->file_mtime_ns = LUMI_CAMERA_NO_TIME;
    frame->device_ns = LUMI_CAMERA_NO_TIME;
    frame->temperature = NAN;
}

int camera_pool_create(int count, struct camera_pool **pool, struct lumi_error *error)
{
    struct camera_pool *made = lumi_calloc(1, sizeof *made + (size_t)count * sizeof made->frames[0]);

    *pool = made;
    if (!made)
        return lumi_fail(error, LUMI_ERR_NOMEM, "a pool of %d frames: no memory", count);
    pthread_mutex_init(&made->lock, NULL);
    made->holders = 1;
    made->count = count;
    for (int i = 0; i < count; i++)
        made->frames[i].pool = made;
    return LUMI_OK;
}

/* With the lock, which it lets go. */
static void let_go(struct camera_pool *pool)
{
    const bool last = --pool->holders == 0;

    pthread_mutex_unlock(&pool->lock);
    if (!last)
        return;
    for (int i = 0; i < pool->count; i++)
        lumi_free(pool->frames[i].bytes);
    pthread_mutex_destroy(&pool->lock);
    lumi_free(pool);
}

static void give_back(struct lumi_camera_frame *frame)
{
    struct pooled *pooled = (struct pooled *)frame;

    pthread_mutex_lock(&pooled->pool->lock);
    pooled->out = false;
    let_go(pooled->pool);
}

/* Whose memory is big enough, else any. */
static struct pooled *find_free(struct camera_pool *pool, size_t bytes)
{
    struct pooled *any = NULL;

    for (int i = 0; i < pool->count; i++) {
        struct pooled *frame = &pool->frames[i];

        if (frame->out)
            continue;
        if (frame->capacity >= bytes)
            return frame;
        any = frame;
    }
    return any;
}

struct lumi_camera_frame *camera_pool_take(struct camera_pool *pool, size_t bytes)
{
    struct pooled *taken;

    pthread_mutex_lock(&pool->lock);
    taken = find_free(pool, bytes);
    if (taken) {
        taken->out = true;
        pool->holders++;
    }
    pthread_mutex_unlock(&pool->lock);
    if (!taken)
        return NULL;
    if (taken->capacity < bytes) { /* what was in it is of no use: nothing is copied */
        const size_t capacity = bytes + bytes / 8;

        lumi_free(taken->bytes);
        taken->bytes = lumi_alloc(1, capacity);
        taken->capacity = taken->bytes ? capacity : 0;
    }
    camera_frame_init(&taken->frame);
    taken->frame.release = give_back;
    taken->frame.data = taken->bytes;
    taken->frame.size = bytes;
    if (bytes && !taken->bytes) {
        give_back(&taken->frame);
        return NULL;
    }
    return &taken->frame;
}

uint8_t *camera_pool_bytes(struct lumi_camera_frame *frame)
{
    return ((struct pooled *)frame)->bytes;
}

void camera_pool_drop(struct camera_pool *pool)
{
    if (!pool)
        return;
    pthread_mutex_lock(&pool->lock);
    let_go(pool);
}
