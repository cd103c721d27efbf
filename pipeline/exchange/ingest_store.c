/* The second time through the videos: chosen pictures become PNG files. All cameras of a shot are decoded at once; rows
 * are written one by one. */
#include "pipeline/exchange/ingest_film.h"

#include "proto/base/memory.h"
#include "proto/base/parallel.h"
#include "proto/image/image.h"

#include <pthread.h>
#include <string.h>

void ingest_film_finish(struct ingest_film *film)
{
    if (!film)
        return;
    lumi_film_close(film->film);
    g_free(film->damage);
    g_array_unref(film->pictures);
    g_array_unref(film->blocks);
    g_free(film->marks);
    g_free(film->sound);
    lumi_free(film->encoded);
    g_free(film);
}

/* To the picture that was chosen for a shot. */
static int go_to(struct ingest_film *film, const char *path, int picture, struct lumi_error *error)
{
    struct lumi_film_picture here;
    bool there = true;

    if (!film->film) {
        LUMI_TRY(lumi_film_open(path, &film->film, error));
        film->next = 0;
    }
    while (there && film->next <= picture) {
        LUMI_TRY(lumi_film_next(film->film, &here, &there, error));
        film->next++;
    }
    if (!there)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: changed while it was imported", path);
    return LUMI_OK;
}

static int encode(struct ingest_film *film, const char *path, int picture, struct lumi_error *error)
{
    struct lumi_image_options options;
    struct lumi_raster raster;

    lumi_free(film->encoded);
    film->encoded = NULL;
    LUMI_TRY(go_to(film, path, picture, error));
    LUMI_TRY(lumi_film_raster(film->film, &raster, error));
    lumi_image_options_init(&options);
    options.format = LUMI_IMAGE_PNG;
    int code = lumi_image_encode(&raster, &options, &film->encoded, &film->encoded_size, error);
    lumi_raster_finish(&raster);
    return code;
}

struct encoding {
    struct ingest *ingest;
    int shot;
    pthread_mutex_t lock;
    struct lumi_error *error;
    int failed;
};

static int encode_one(void *context, int c, int thread)
{
    struct encoding *encoding = context;
    struct ingest_camera *camera = &encoding->ingest->cameras[c];
    struct lumi_error error = {0};
    int code = LUMI_OK;

    (void)thread;
    if (camera->path && camera->frames[encoding->shot].file >= 0)
        code = encode(camera->film, camera->path, camera->frames[encoding->shot].file, &error);
    if (camera->film)
        camera->film->ready = encoding->shot;
    pthread_mutex_lock(&encoding->lock);
    if (code != LUMI_OK && c < encoding->failed) {
        encoding->failed = c;
        if (encoding->error)
            *encoding->error = error;
    }
    pthread_mutex_unlock(&encoding->lock);
    return code;
}

int ingest_store_picture(struct ingest *ingest, struct lumi_capture *capture, int c, int shot, int64_t frame,
                         struct lumi_error *error)
{
    struct ingest_camera *camera = &ingest->cameras[c];
    struct ingest_film *film = camera->film;

    if (film->ready != shot || !film->encoded) {
        struct encoding encoding = {ingest, shot, PTHREAD_MUTEX_INITIALIZER, error, INT32_MAX};
        LUMI_TRY(lumi_parallel_for(ingest->camera_count, ingest->options->threads, encode_one, &encoding));
    }
    const struct lumi_capture_file file = {
        .extension = ".png",
        .width = camera->lens.width,
        .height = camera->lens.height,
        .camera_time_us =
            (int64_t)(g_array_index(film->pictures, struct ingest_picture, camera->frames[shot].file).time * 1e6),
        .label = camera->path};
    int code = lumi_capture_store_bytes(capture, frame, film->encoded, film->encoded_size, &file, error);
    lumi_free(film->encoded);
    film->encoded = NULL;
    return code;
}
