/* Who gets a turn, and the two threads: one that copies and keeps order, one that makes pictures when nobody else wants
 * the processor. Between them pointers change hands without a lock. */
#include "daemon/preview/camera_pictures.h"

#include "daemon/preview/pictures_priv.h"
#include "proto/base/memory.h"

#include <errno.h>
#include <math.h>
#include <pthread.h>
#include <semaphore.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/resource.h>

#define STALE_NS 2000000000LL /* a copy that was not begun for so long is replaced by a newer one */
#define NUMBERS 8             /* of a camera's latest frames: what the judge found */
#define MOST_LEAST 64

struct sharp {
    int shot;
    double sharpness;
};

struct slot {
    /* Under the lock. */
    struct lumi_camera_frame *frame; /* waits to be copied; NULL: none */
    struct lumi_picture_offer about;
    char name[LUMI_PICTURE_NAME];
    struct lumi_picture *last;
    struct sharp sharp[NUMBERS];
    int sharp_next;
    /* The offering thread's. */
    int64_t due_ns, taken_ns;
    /* Between the threads. */
    _Atomic(struct pictures_small *) small; /* waits for the second thread */
    _Atomic(struct lumi_picture *) made;    /* waits to become the last */
    atomic_bool retell;                     /* more is known of the last */
    atomic_int watchers;
    uint64_t number;
};

struct lumi_pictures {
    struct lumi_pictures_options options;
    pthread_mutex_t lock, listener_lock;
    struct slot slots[LUMI_PICTURES_CAMERAS];
    void (*made)(void *context, int camera);
    void *context;
    sem_t copying, making; /* something waits for the thread */
    pthread_t copier, maker;
    bool has_copier, has_maker;
    atomic_bool ending;
    atomic_uint_fast64_t offered, taken, shed, done, failed;
};

void lumi_pictures_options_init(struct lumi_pictures_options *options)
{
    *options = (struct lumi_pictures_options){.per_second = 1, .watched_per_second = 2, .width = 640, .quality = 75};
}

static bool is_camera(const struct lumi_pictures *pictures, int camera)
{
    return camera >= 0 && camera < pictures->options.cameras;
}

int lumi_pictures_camera(const struct lumi_pictures *pictures, const char *name)
{
    for (int c = 0; c < pictures->options.cameras; c++)
        if (strcmp(pictures->options.names[c], name) == 0)
            return c;
    return -1;
}

const char *lumi_pictures_name(const struct lumi_pictures *pictures, int camera)
{
    return is_camera(pictures, camera) ? pictures->options.names[camera] : "";
}

/* ---- pictures ---- */

void lumi_picture_release(struct lumi_picture *picture)
{
    if (!picture || atomic_fetch_sub(&picture->others, 1) > 0)
        return;
    lumi_free(picture->jpeg);
    lumi_free(picture);
}

struct lumi_picture *lumi_pictures_last(struct lumi_pictures *pictures, int camera)
{
    struct lumi_picture *picture = NULL;

    if (!is_camera(pictures, camera))
        return NULL;
    pthread_mutex_lock(&pictures->lock);
    picture = pictures->slots[camera].last;
    if (picture)
        atomic_fetch_add(&picture->others, 1);
    pthread_mutex_unlock(&pictures->lock);
    return picture;
}

double lumi_pictures_sharpness_of(struct lumi_pictures *pictures, const struct lumi_picture *picture)
{
    double sharpness = NAN;

    if (!is_camera(pictures, picture->camera) || picture->shot < 0)
        return NAN;
    pthread_mutex_lock(&pictures->lock);
    const struct slot *slot = &pictures->slots[picture->camera];
    for (int i = 0; i < NUMBERS; i++)
        if (slot->sharp[i].shot == picture->shot)
            sharpness = slot->sharp[i].sharpness;
    pthread_mutex_unlock(&pictures->lock);
    return sharpness;
}

void lumi_pictures_sharpness(struct lumi_pictures *pictures, int camera, int shot, double sharpness)
{
    if (!is_camera(pictures, camera) || shot < 0 || pthread_mutex_trylock(&pictures->lock) != 0)
        return;
    struct slot *slot = &pictures->slots[camera];
    int at = slot->sharp_next;
    for (int i = 0; i < NUMBERS; i++) /* a retake's takes the place of what was said before */
        if (slot->sharp[i].shot == shot)
            at = i;
    slot->sharp[at] = (struct sharp){shot, sharpness};
    if (at == slot->sharp_next)
        slot->sharp_next = (at + 1) % NUMBERS;
    const bool last = slot->last && slot->last->shot == shot;
    pthread_mutex_unlock(&pictures->lock);
    if (last && !atomic_exchange(&slot->retell, true) && !pictures->options.synchronous)
        sem_post(&pictures->copying);
}

/* ---- whose turn it is ---- */

/* The offering thread never waits: who holds the lock does so for a moment, and the next frame is as good. */
static bool leave(struct lumi_pictures *pictures, const struct lumi_picture_offer *offer)
{
    struct slot *slot = &pictures->slots[offer->camera];
    struct lumi_camera_frame *before;

    if (pthread_mutex_trylock(&pictures->lock) != 0)
        return false;
    before = slot->frame;
    slot->frame = lumi_camera_frame_ref(offer->frame);
    slot->about = *offer;
    snprintf(slot->name, sizeof slot->name, "%s", offer->name ? offer->name : "");
    pthread_mutex_unlock(&pictures->lock);
    if (before)
        lumi_camera_frame_release(before);
    else if (!pictures->options.synchronous)
        sem_post(&pictures->copying);
    return true;
}

bool lumi_pictures_offer(struct lumi_pictures *pictures, int64_t now_ns, const struct lumi_picture_offer *offer)
{
    struct slot *slot;
    double rate;

    if (!is_camera(pictures, offer->camera) || offer->frame->damaged)
        return false;
    slot = &pictures->slots[offer->camera];
    atomic_fetch_add(&pictures->offered, 1);
    if (slot->due_ns && now_ns < slot->due_ns)
        return false;
    if (!offer->spare || (atomic_load(&slot->small) && now_ns - slot->taken_ns < STALE_NS) || !leave(pictures, offer)) {
        atomic_fetch_add(&pictures->shed, 1);
        return false;
    }
    rate = atomic_load(&slot->watchers) > 0 ? pictures->options.watched_per_second : pictures->options.per_second;
    slot->due_ns = now_ns + (int64_t)(1e9 / rate);
    slot->taken_ns = now_ns;
    atomic_fetch_add(&pictures->taken, 1);
    return true;
}

/* ---- copying ---- */

static void drop_small(struct pictures_small *small)
{
    if (small)
        pictures_small_clear(small);
    lumi_free(small);
}

/* One frame, if one waits. */
static void copy_one(struct lumi_pictures *pictures, int camera)
{
    struct slot *slot = &pictures->slots[camera];
    struct lumi_picture_offer about;
    struct lumi_camera_frame *frame;
    struct pictures_small *small;
    char name[LUMI_PICTURE_NAME];
    struct lumi_error error;

    pthread_mutex_lock(&pictures->lock);
    frame = slot->frame;
    slot->frame = NULL;
    about = slot->about;
    memcpy(name, slot->name, sizeof name);
    pthread_mutex_unlock(&pictures->lock);
    if (!frame)
        return;
    small = lumi_calloc(1, sizeof *small);
    const int code =
        small ? pictures_take(frame, pictures->options.width, small, &error) : lumi_fail(&error, LUMI_ERR_NOMEM, "-");
    lumi_camera_frame_release(frame);
    if (code != LUMI_OK) {
        drop_small(small);
        atomic_fetch_add(&pictures->failed, 1);
        return;
    }
    memcpy(small->name, name, sizeof small->name);
    small->shot = about.shot;
    small->unix_us = about.unix_us;
    for (int i = 0; i < 2; i++)
        small->white[i] = about.white[i] > 0 ? about.white[i] : small->white[i];
    small = atomic_exchange(&slot->small, small);
    if (small)
        drop_small(small);
    else if (!pictures->options.synchronous)
        sem_post(&pictures->making);
}

static void tell(struct lumi_pictures *pictures, int camera)
{
    pthread_mutex_lock(&pictures->listener_lock);
    if (pictures->made)
        pictures->made(pictures->context, camera);
    pthread_mutex_unlock(&pictures->listener_lock);
}

/* What was made becomes the last. */
static void publish_one(struct lumi_pictures *pictures, int camera)
{
    struct slot *slot = &pictures->slots[camera];
    struct lumi_picture *picture = atomic_exchange(&slot->made, NULL), *before;

    if (!picture)
        return;
    picture->camera = camera;
    pthread_mutex_lock(&pictures->lock);
    picture->number = ++slot->number;
    before = slot->last;
    slot->last = picture;
    pthread_mutex_unlock(&pictures->lock);
    lumi_picture_release(before);
    tell(pictures, camera);
}

static void copy_all(struct lumi_pictures *pictures)
{
    for (int c = 0; c < pictures->options.cameras; c++) {
        copy_one(pictures, c);
        publish_one(pictures, c);
        if (atomic_exchange(&pictures->slots[c].retell, false))
            tell(pictures, c);
    }
}

/* ---- making ---- */

static void make_all(struct lumi_pictures *pictures)
{
    for (int c = 0; c < pictures->options.cameras && !atomic_load(&pictures->ending); c++) {
        struct pictures_small *small = atomic_exchange(&pictures->slots[c].small, NULL);
        struct lumi_picture *picture;
        struct lumi_error error;

        if (!small)
            continue;
        const int code = pictures_make(small, pictures->options.width, pictures->options.quality, &picture, &error);
        drop_small(small);
        atomic_fetch_add(code == LUMI_OK ? &pictures->done : &pictures->failed, 1);
        if (code != LUMI_OK)
            continue;
        lumi_picture_release(atomic_exchange(&pictures->slots[c].made, picture));
        if (!pictures->options.synchronous)
            sem_post(&pictures->copying);
    }
}

void lumi_pictures_work(struct lumi_pictures *pictures, bool make)
{
    copy_all(pictures);
    if (!make)
        return;
    make_all(pictures);
    copy_all(pictures);
}

/* ---- threads ---- */

static void wait_for(sem_t *semaphore)
{
    while (sem_wait(semaphore) != 0 && errno == EINTR)
        continue;
}

static void *copy_thread(void *context)
{
    struct lumi_pictures *pictures = context;

    while (!atomic_load(&pictures->ending)) {
        wait_for(&pictures->copying);
        if (!atomic_load(&pictures->ending))
            copy_all(pictures);
    }
    return NULL;
}

static void *make_thread(void *context)
{
    struct lumi_pictures *pictures = context;

    (void)setpriority(PRIO_PROCESS, 0, 19); /* this thread alone, on Linux */
    while (!atomic_load(&pictures->ending)) {
        wait_for(&pictures->making);
        make_all(pictures);
    }
    return NULL;
}

/* ---- life ---- */

static int start_threads(struct lumi_pictures *pictures, struct lumi_error *error)
{
    sigset_t all, before;

    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    pictures->has_copier = pthread_create(&pictures->copier, NULL, copy_thread, pictures) == 0;
    pictures->has_maker = pthread_create(&pictures->maker, NULL, make_thread, pictures) == 0;
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    if (!pictures->has_copier || !pictures->has_maker)
        return lumi_fail(error, LUMI_ERR_NOMEM, "pictures: no thread could be started");
    return LUMI_OK;
}

int lumi_pictures_create(const struct lumi_pictures_options *options, struct lumi_pictures **pictures,
                         struct lumi_error *error)
{
    struct lumi_pictures *made;

    *pictures = NULL;
    if (options->cameras < 0 || options->cameras > LUMI_PICTURES_CAMERAS || options->per_second <= 0 ||
        options->watched_per_second <= 0 || options->width < MOST_LEAST || options->quality < 1 ||
        options->quality > 100)
        return lumi_fail(error, LUMI_ERR_ARG, "pictures of %d cameras, %d pixels wide", options->cameras,
                         options->width);
    made = lumi_calloc(1, sizeof *made);
    if (!made)
        return lumi_fail(error, LUMI_ERR_NOMEM, "pictures: no memory");
    made->options = *options;
    pthread_mutex_init(&made->lock, NULL);
    pthread_mutex_init(&made->listener_lock, NULL);
    sem_init(&made->copying, 0, 0);
    sem_init(&made->making, 0, 0);
    for (int c = 0; c < LUMI_PICTURES_CAMERAS; c++)
        for (int i = 0; i < NUMBERS; i++)
            made->slots[c].sharp[i].shot = -1;
    int code = options->synchronous ? LUMI_OK : start_threads(made, error);
    if (code == LUMI_OK)
        *pictures = made;
    else
        lumi_pictures_destroy(made);
    return code;
}

void lumi_pictures_destroy(struct lumi_pictures *pictures)
{
    if (!pictures)
        return;
    atomic_store(&pictures->ending, true);
    sem_post(&pictures->copying);
    sem_post(&pictures->making);
    if (pictures->has_copier)
        pthread_join(pictures->copier, NULL);
    if (pictures->has_maker)
        pthread_join(pictures->maker, NULL);
    for (int c = 0; c < LUMI_PICTURES_CAMERAS; c++) {
        struct slot *slot = &pictures->slots[c];
        lumi_camera_frame_release(slot->frame);
        drop_small(atomic_load(&slot->small));
        lumi_picture_release(atomic_load(&slot->made));
        lumi_picture_release(slot->last);
    }
    sem_destroy(&pictures->copying);
    sem_destroy(&pictures->making);
    pthread_mutex_destroy(&pictures->lock);
    pthread_mutex_destroy(&pictures->listener_lock);
    lumi_free(pictures);
}

/* ---- who looks ---- */

void lumi_pictures_watch(struct lumi_pictures *pictures, int camera, bool watched)
{
    if (is_camera(pictures, camera))
        atomic_fetch_add(&pictures->slots[camera].watchers, watched ? 1 : -1);
}

int lumi_pictures_watchers(struct lumi_pictures *pictures, int camera)
{
    return is_camera(pictures, camera) ? atomic_load(&pictures->slots[camera].watchers) : 0;
}

void lumi_pictures_listen(struct lumi_pictures *pictures, void (*made)(void *context, int camera), void *context)
{
    pthread_mutex_lock(&pictures->listener_lock);
    pictures->made = made;
    pictures->context = context;
    pthread_mutex_unlock(&pictures->listener_lock);
}

void lumi_pictures_figures(struct lumi_pictures *pictures, struct lumi_pictures_figures *figures)
{
    *figures = (struct lumi_pictures_figures){.offered = atomic_load(&pictures->offered),
                                              .taken = atomic_load(&pictures->taken),
                                              .shed = atomic_load(&pictures->shed),
                                              .made = atomic_load(&pictures->done),
                                              .failed = atomic_load(&pictures->failed)};
}
