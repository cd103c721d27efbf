/* From a capture to other people's formats. */
#include "pipeline/exchange/exchange.h"

#include "proto/base/file.h"
#include "proto/base/memory.h"
#include "proto/capture/capture.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* How one gets from a folder to a file: "../a.capture/data/frames/x.jpg". Both may be relative. */
static char *relative_path(const char *folder, const char *file)
{
    g_autofree char *from = g_canonicalize_filename(folder, NULL);
    g_autofree char *to = g_canonicalize_filename(file, NULL);
    g_auto(GStrv) a = g_strsplit(from[1] ? from + 1 : "", "/", -1);
    g_auto(GStrv) b = g_strsplit(to + 1, "/", -1);
    GString *path = g_string_new(NULL);
    guint same = 0;

    while (a[same] && b[same] && !strcmp(a[same], b[same]))
        same++;
    for (guint i = same; a[i]; i++)
        g_string_append(path, "../");
    for (guint i = same; b[i]; i++)
        g_string_append_printf(path, "%s%s", i > same ? "/" : "", b[i]);
    return g_string_free(path, FALSE);
}

/* The lens as the source had it, if it still is the one the tree computes with. */
static int describe_camera(struct lumi_capture *capture, const struct lumi_capture_frame *frame,
                           struct lumi_exchange_camera *camera, struct lumi_error *error)
{
    struct lumi_capture_lens stored;
    struct lumi_lens lens;

    LUMI_TRY(lumi_capture_lens(capture, frame->lens_id, &stored, error));
    *camera = (struct lumi_exchange_camera){.width = stored.lens.width, .height = stored.lens.height};
    g_strlcpy(camera->model, stored.model, sizeof camera->model);
    camera->parameter_count = stored.parameter_count;
    memcpy(camera->parameters, stored.parameters, sizeof stored.parameters);
    if (stored.parameter_count > 0 && lumi_exchange_lens(camera, frame->name, &lens, NULL) == LUMI_OK &&
        lumi_lens_equal(&lens, &stored.lens))
        return LUMI_OK;
    if (!lumi_exchange_describe_lens(&stored.lens, camera))
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "%s: frame '%s': a lens that the format cannot describe",
                         lumi_capture_path(capture), frame->name);
    return LUMI_OK;
}

/* What lumi_import kept of the source's own numbers, if they still mean the current pose. */
static void recall_numbers(struct lumi_capture *capture, const struct lumi_capture_frame *frame,
                           struct lumi_exchange_image *image)
{
    g_autofree char *key = g_strdup_printf("source pose %s", frame->name);
    char value[512];
    struct lumi_pose pose;
    int count = 0;

    if (lumi_capture_get_meta(capture, key, value, sizeof value, NULL) != LUMI_OK)
        return;
    for (char *at = value, *end; *at && count < 12; at = end) {
        image->source[count] = g_ascii_strtod(at, &end);
        if (end == at)
            return;
        count++;
    }
    if (count != LUMI_EXCHANGE_MATRIX && count != LUMI_EXCHANGE_QUATERNION)
        return;
    if (lumi_exchange_pose_from((enum lumi_exchange_numbers)count, image->source, "", &pose, NULL) == LUMI_OK &&
        !memcmp(pose.r, frame->pose.r, sizeof pose.r) && pose.t.x == frame->pose.t.x && pose.t.y == frame->pose.t.y &&
        pose.t.z == frame->pose.t.z)
        image->numbers = (enum lumi_exchange_numbers)count;
}

static int compare_ids(const void *a, const void *b)
{
    int64_t p = *(const int64_t *)a, q = *(const int64_t *)b;

    return p < q ? -1 : p > q;
}

/* Cameras in the order of the capture's lenses, those without a frame left out. */
static int list_cameras(struct lumi_capture *capture, const struct lumi_capture_frame *frames, int count,
                        GArray *lenses, struct lumi_exchange *exchange, struct lumi_error *error)
{
    for (int i = 0; i < count; i++)
        g_array_append_val(lenses, frames[i].lens_id);
    g_array_sort(lenses, compare_ids);
    for (guint i = lenses->len; i-- > 1;)
        if (g_array_index(lenses, int64_t, i) == g_array_index(lenses, int64_t, i - 1))
            g_array_remove_index(lenses, i);
    for (guint k = 0; k < lenses->len; k++) {
        struct lumi_exchange_camera camera;
        for (int i = 0; i < count; i++)
            if (frames[i].lens_id == g_array_index(lenses, int64_t, k)) {
                LUMI_TRY(describe_camera(capture, &frames[i], &camera, error));
                break;
            }
        g_array_append_val(exchange->cameras, camera);
    }
    return LUMI_OK;
}

static int list_frames(struct lumi_capture *capture, const struct lumi_capture_frame *frames, int count,
                       const char *folder, bool original_names, struct lumi_exchange *exchange,
                       struct lumi_error *error)
{
    g_autoptr(GArray) lenses = g_array_new(FALSE, FALSE, sizeof(int64_t));

    LUMI_TRY(list_cameras(capture, frames, count, lenses, exchange, error));
    for (int i = 0; i < count; i++) {
        struct lumi_exchange_image image = {.row = frames[i].row, .column = frames[i].column, .pose = frames[i].pose};
        if (!frames[i].has_pose)
            continue;
        while (g_array_index(lenses, int64_t, image.camera) != frames[i].lens_id)
            image.camera++;
        recall_numbers(capture, &frames[i], &image);
        image.name = g_strdup(frames[i].name);
        image.path = g_build_filename(lumi_capture_path(capture), frames[i].file, NULL);
        image.original =
            original_names && frames[i].original[0] ? g_strdup(frames[i].original) : relative_path(folder, image.path);
        g_array_append_val(exchange->images, image);
    }
    if (exchange->images->len == 0)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: no frame of it has a pose", lumi_capture_path(capture));
    return LUMI_OK;
}

int lumi_export_list(const char *path, const char *folder, bool original_names, struct lumi_exchange *exchange,
                     struct lumi_error *error)
{
    struct lumi_capture *capture;
    struct lumi_capture_frame *frames = NULL;
    int count, code;

    LUMI_TRY(lumi_capture_open(path, LUMI_CAPTURE_READ, &capture, error));
    code = lumi_capture_frames(capture, LUMI_FRAMES_USABLE, &frames, &count, error);
    if (code == LUMI_OK)
        code = list_frames(capture, frames, count, folder, original_names, exchange, error);
    lumi_free(frames);
    lumi_capture_close(capture);
    return code;
}

int lumi_export_transforms(const char *capture, const char *path, bool original_names, struct lumi_error *error)
{
    g_autofree char *folder = g_path_get_dirname(path);
    g_autofree char *text = NULL;
    struct lumi_exchange exchange;

    LUMI_TRY(lumi_file_check_output(path, capture, error));
    lumi_exchange_init(&exchange);
    int code = lumi_export_list(capture, folder, original_names, &exchange, error);
    if (code == LUMI_OK)
        code = lumi_exchange_format_transforms(&exchange, &text, error);
    if (code == LUMI_OK)
        code = lumi_file_write(path, text, strlen(text), true, error);
    lumi_exchange_finish(&exchange);
    return code;
}

static int write_part(const char *folder, const char *stem, bool text, const GByteArray *bytes,
                      struct lumi_error *error)
{
    g_autofree char *name = g_strconcat(stem, text ? ".txt" : ".bin", NULL);
    g_autofree char *path = g_build_filename(folder, name, NULL);

    return lumi_file_write(path, bytes->data ? bytes->data : (const guint8 *)"", bytes->len, true, error);
}

static int write_colmap(const struct lumi_exchange *exchange, const char *folder, bool text, struct lumi_error *error)
{
    static const guint8 no_points[8];
    g_autoptr(GByteArray) cameras = g_byte_array_new();
    g_autoptr(GByteArray) images = g_byte_array_new();
    g_autoptr(GByteArray) points = g_byte_array_new();

    if (g_mkdir_with_parents(folder, 0777) != 0)
        return lumi_fail_errno(error, folder, "cannot make the folder");
    lumi_exchange_format_colmap_cameras(exchange, !text, cameras);
    lumi_exchange_format_colmap_images(exchange, !text, images);
    if (!text)
        g_byte_array_append(points, no_points, sizeof no_points);
    LUMI_TRY(write_part(folder, "points3D", text, points, error));
    LUMI_TRY(write_part(folder, "images", text, images, error));
    return write_part(folder, "cameras", text, cameras, error);
}

int lumi_export_colmap(const char *capture, const char *folder, bool text, bool original_names,
                       struct lumi_error *error)
{
    g_autofree char *frames = g_build_filename(capture, "data", "frames", NULL);
    struct lumi_exchange exchange;

    LUMI_TRY(lumi_file_check_output(folder, capture, error));
    /* COLMAP's names are relative to a folder of images, which is given to it apart from the model. */
    lumi_exchange_init(&exchange);
    int code = lumi_export_list(capture, frames, original_names, &exchange, error);
    if (code == LUMI_OK)
        code = write_colmap(&exchange, folder, text, error);
    lumi_exchange_finish(&exchange);
    return code;
}
