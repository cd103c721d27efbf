/* From a source to a capture: which frames, are they what the source says, and storing them. */
#include "pipeline/exchange/exchange.h"

#include "pipeline/exchange/import_source.h"
#include "proto/base/parallel.h"
#include "proto/capture/capture.h"
#include "proto/image/image.h"

#include <pthread.h>
#include <stdio.h>
#include <string.h>

void lumi_import_options_init(struct lumi_import_options *options)
{
    *options = (struct lumi_import_options){0};
}

/* Which frames */

static int choose(struct lumi_exchange *exchange, const char *source, const struct lumi_import_options *options,
                  struct lumi_error *error)
{
    GArray *kept = g_array_new(FALSE, TRUE, sizeof(struct lumi_exchange_image));
    int first_row = INT32_MAX, first_column = INT32_MAX, limit = options->limit > 0 ? options->limit : INT32_MAX;
    int count = (int)exchange->images->len;
    bool grid = options->every_row > 0 && options->every_column > 0;

    for (int i = 0; i < count; i++) {
        const struct lumi_exchange_image *image = lumi_exchange_image(exchange, i);
        if (grid && (image->row < 0 || image->column < 0)) {
            g_array_unref(kept);
            return lumi_fail(error, LUMI_ERR_ARG,
                             "%s: image '%s' has no row and column: take every k-th frame with --every K", source,
                             image->original);
        }
        first_row = MIN(first_row, image->row);
        first_column = MIN(first_column, image->column);
    }
    for (int i = 0; i < count; i++) {
        struct lumi_exchange_image *image = lumi_exchange_image(exchange, i);
        bool wanted = grid ? (image->row - first_row) % options->every_row == 0 &&
                                 (image->column - first_column) % options->every_column == 0
                      : options->every_row > 0 ? i % options->every_row == 0
                                               : true;
        if (wanted && (int)kept->len < limit) {
            g_array_append_val(kept, *image);
            *image = (struct lumi_exchange_image){0}; /* what it owns has moved */
        }
    }
    g_array_set_size(exchange->images, 0);
    g_array_append_vals(exchange->images, kept->data, kept->len);
    g_array_unref(kept); /* without a clear function: the images live on in the list */
    return LUMI_OK;
}

/* Are they there, and as their cameras say */

/* Cameras that leave their size to the pictures get the first one's. */
static int complete_cameras(struct lumi_exchange *exchange, struct lumi_error *error)
{
    for (guint i = 0; i < exchange->images->len; i++) {
        struct lumi_exchange_image *image = lumi_exchange_image(exchange, (int)i);
        struct lumi_exchange_camera *camera = lumi_exchange_camera(exchange, image->camera);
        struct lumi_lens lens;
        if (camera->parameter_count > 0 && camera->width > 0)
            continue;
        if (camera->width < 1 || camera->height < 1) {
            struct lumi_image_info info;
            LUMI_TRY(lumi_image_info(image->path, &info, error));
            camera->width = info.width;
            camera->height = info.height;
        }
        LUMI_TRY(lumi_exchange_lens(camera, image->path, &lens, error));
        lumi_exchange_describe_lens(&lens, camera);
    }
    return LUMI_OK;
}

struct check {
    const struct lumi_exchange *exchange;
    const struct lumi_import_options *options;
    const char *source;
    pthread_mutex_t lock; /* guards the rest */
    struct lumi_error *error;
    int failed; /* the lowest index that failed */
    long done;
};

static int check_image(const struct check *check, int index, struct lumi_error *error)
{
    const struct lumi_exchange_image *image = lumi_exchange_image(check->exchange, index);
    const struct lumi_exchange_camera *camera = lumi_exchange_camera(check->exchange, image->camera);
    struct lumi_image_info info;

    if (!g_file_test(image->path, G_FILE_TEST_EXISTS))
        return lumi_fail(error, LUMI_ERR_NOTFOUND, "%s: the image is missing (it is named by %s)", image->path,
                         check->source);
    LUMI_TRY(lumi_image_info(image->path, &info, error));
    if (info.width != camera->width || info.height != camera->height)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: the image has %dx%d pixels, its camera %dx%d", image->path,
                         info.width, info.height, camera->width, camera->height);
    if (check->options->trust)
        return LUMI_OK;
    struct lumi_raster raster;
    LUMI_TRY(lumi_image_read(image->path, 0, &raster, NULL, error));
    lumi_raster_finish(&raster);
    return LUMI_OK;
}

static int check_one(void *context, int index, int thread)
{
    struct check *check = context;
    struct lumi_error error = {0};
    int code = check_image(check, index, &error);

    (void)thread;
    pthread_mutex_lock(&check->lock);
    if (code != LUMI_OK && index < check->failed) {
        check->failed = index;
        if (check->error)
            *check->error = error;
    }
    check->done++;
    if (check->options->progress)
        check->options->progress("checking", check->done, (long)check->exchange->images->len);
    pthread_mutex_unlock(&check->lock);
    return code;
}

/* Into metres. */
static int scale_places(struct lumi_exchange *exchange, const struct lumi_import_options *options,
                        struct lumi_error *error)
{
    if (!(options->unit > 0) || options->unit == 1)
        return LUMI_OK;
    for (guint i = 0; i < exchange->images->len; i++) {
        struct lumi_exchange_image *image = lumi_exchange_image(exchange, (int)i);
        if (image->in_metres)
            continue;
        image->pose.t = lumi_scale(image->pose.t, options->unit);
        image->numbers = LUMI_EXCHANGE_NONE;
        if (!lumi_place_valid(image->pose.t))
            return lumi_fail(error, LUMI_ERR_FORMAT,
                             "%s: in units of %g m its pose is farther than %g m from the origin", image->original,
                             options->unit, LUMI_PLACE_MAX);
    }
    return LUMI_OK;
}

int lumi_import_list(const char *source, const struct lumi_import_options *options, struct lumi_exchange *exchange,
                     struct lumi_error *error)
{
    LUMI_TRY(exchange_read_source(source, options, exchange, error));
    LUMI_TRY(exchange_name_images(exchange, source, error));
    LUMI_TRY(choose(exchange, source, options, error));
    LUMI_TRY(complete_cameras(exchange, error));
    LUMI_TRY(scale_places(exchange, options, error));
    if (options->poses_only)
        return LUMI_OK;
    struct check check = {.exchange = exchange,
                          .options = options,
                          .source = source,
                          .lock = PTHREAD_MUTEX_INITIALIZER,
                          .error = error,
                          .failed = INT32_MAX};
    return lumi_parallel_for((int)exchange->images->len, options->threads, check_one, &check);
}

/* Storing */

static int store_cameras(struct lumi_capture *capture, const struct lumi_exchange *exchange, int64_t *cameras,
                         struct lumi_error *error)
{
    int used = 0;

    for (guint i = 0; i < exchange->images->len; i++)
        cameras[lumi_exchange_image(exchange, (int)i)->camera] = -1;
    for (guint i = 0; i < exchange->cameras->len; i++) {
        const struct lumi_exchange_camera *camera = lumi_exchange_camera(exchange, (int)i);
        struct lumi_capture_lens lens = {.parameter_count = camera->parameter_count};
        int64_t id;
        if (cameras[i] == 0)
            continue;
        snprintf(lens.name, sizeof lens.name, "camera%d", used++);
        g_strlcpy(lens.model, camera->model, sizeof lens.model);
        memcpy(lens.parameters, camera->parameters, sizeof(double) * (size_t)camera->parameter_count);
        LUMI_TRY(lumi_exchange_lens(camera, lens.name, &lens.lens, error));
        LUMI_TRY(lumi_capture_add_lens(capture, &lens, &id, error));
        LUMI_TRY(lumi_capture_add_camera(capture, lens.name, id, &cameras[i], error));
    }
    return LUMI_OK;
}

/* The source's own numbers, where the pose does not give them back: under a key that lumi_export_list looks for. */
static int keep_numbers(struct lumi_capture *capture, const struct lumi_exchange_image *image, struct lumi_error *error)
{
    g_autofree char *key = g_strdup_printf("source pose %s", image->name);
    g_autoptr(GString) value = g_string_new(NULL);
    char digits[G_ASCII_DTOSTR_BUF_SIZE];

    if (image->numbers == LUMI_EXCHANGE_NONE)
        return LUMI_OK;
    for (int i = 0; i < (int)image->numbers; i++)
        g_string_append_printf(value, "%s%s", i ? " " : "",
                               g_ascii_formatd(digits, sizeof digits, "%.17g", image->source[i]));
    return lumi_capture_set_meta(capture, key, value->str, error);
}

static const char *extension_for(const char *path, enum lumi_image_format format)
{
    static const char *const canonical[] = {"", ".jpg", ".png", ".tif", ".exr", ".dng"};
    const char *dot = strrchr(path, '.');

    return lumi_image_format_of_name(path) == format ? dot : canonical[format];
}

static int store_image(struct lumi_capture *capture, const struct lumi_exchange_image *image, int64_t camera,
                       const char *origin, struct lumi_error *error)
{
    struct lumi_capture_new_frame frame = {
        .name = image->name, .original = image->original, .camera = camera, .row = image->row, .column = image->column};
    struct lumi_image_meta meta;
    int64_t id;

    LUMI_TRY(lumi_image_read_meta(image->path, &meta, error));
    struct lumi_capture_file file = {.extension = extension_for(image->path, meta.info.format),
                                     .width = meta.info.width,
                                     .height = meta.info.height,
                                     .exposure_s = meta.exposure_s,
                                     .iso = meta.iso,
                                     .camera_time_us = LUMI_NO_TIME,
                                     .exif = meta.exif,
                                     .exif_size = meta.exif_size,
                                     .label = image->path};
    int code;
    LUMI_GOTO(code, out, lumi_capture_add_frame(capture, &frame, &id, error));
    LUMI_GOTO(code, out, lumi_capture_store_file(capture, id, image->path, &file, error));
    LUMI_GOTO(code, out, lumi_capture_set_pose(capture, id, &image->pose, LUMI_POSE_IMPORTED, origin, error));
    code = keep_numbers(capture, image, error);
out:
    lumi_image_meta_finish(&meta);
    return code;
}

static int store_all(struct lumi_capture *capture, const struct lumi_exchange *exchange, const char *source,
                     const struct lumi_import_options *options, struct lumi_error *error)
{
    g_autofree int64_t *cameras = g_new0(int64_t, exchange->cameras->len);
    g_autofree char *base = g_path_get_basename(source);
    g_autofree char *made_by = g_strdup_printf("import %s", base);

    LUMI_TRY(lumi_capture_begin(capture, error));
    LUMI_TRY(lumi_capture_set_meta(capture, "source", made_by, error));
    LUMI_TRY(lumi_capture_set_meta(capture, "software", "lumi " LUMI_VERSION, error));
    LUMI_TRY(lumi_capture_set_meta(capture, "surface", "unknown", error));
    if (options->date)
        LUMI_TRY(lumi_capture_set_meta(capture, "created", options->date, error));
    LUMI_TRY(store_cameras(capture, exchange, cameras, error));
    for (guint i = 0; i < exchange->images->len; i++) {
        const struct lumi_exchange_image *image = lumi_exchange_image(exchange, (int)i);
        LUMI_TRY(store_image(capture, image, cameras[image->camera], base, error));
        if (options->progress)
            options->progress("importing", (long)i + 1, (long)exchange->images->len);
    }
    return lumi_capture_commit(capture, error);
}

int lumi_import(const char *source, const char *path, const struct lumi_import_options *options,
                struct lumi_error *error)
{
    struct lumi_capture *capture = NULL;
    struct lumi_exchange exchange;
    int code;

    lumi_exchange_init(&exchange);
    if (g_file_test(path, G_FILE_TEST_EXISTS))
        LUMI_GOTO(code, out, lumi_fail(error, LUMI_ERR_EXISTS, "%s: is there already", path));
    LUMI_GOTO(code, out, lumi_import_list(source, options, &exchange, error));
    LUMI_GOTO(code, out, lumi_capture_create(path, &capture, error));
    LUMI_GOTO(code, out, store_all(capture, &exchange, source, options, error));
    code = lumi_capture_publish(capture, options->date, error);
out:
    lumi_capture_close(capture);
    lumi_exchange_finish(&exchange);
    return code;
}
