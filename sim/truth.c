/* Views, poses and depth into a folder. */
#include "sim/truth.h"

#include "proto/base/file.h"
#include "proto/base/memory.h"
#include "proto/image/image.h"
#include "proto/image/image_head.h"
#include "sim/camera.h"
#include "sim/exposure.h"

#include <errno.h>
#include <glib.h>
#include <glib/gstdio.h>
#include <math.h>
#include <string.h>
#include <unistd.h>

void sim_output_init(struct sim_output *output)
{
    *output = (struct sim_output){.format = SIM_FORMAT_PNG};
    sim_sensor_init(&output->sensor);
}

const char *sim_format_extension(enum sim_format format)
{
    static const char *const extensions[] = {".png", ".jpg", ".exr", ".dng"};

    return extensions[format];
}

static void image_options(const struct sim_output *output, struct lumi_image_options *options)
{
    lumi_image_options_init(options);
    options->format = output->format == SIM_FORMAT_JPEG  ? LUMI_IMAGE_JPEG
                      : output->format == SIM_FORMAT_EXR ? LUMI_IMAGE_EXR
                                                         : LUMI_IMAGE_PNG;
    options->quality = 97;
    options->bits = output->sensor.bits > 8 ? 16 : 8;
    options->half = false;
}

static int write_depth(const char *path, const struct lumi_raster *depth, struct lumi_error *error)
{
    struct lumi_image_options options;

    lumi_image_options_init(&options);
    options.format = LUMI_IMAGE_EXR;
    options.half = false;
    options.channel = "Z";
    return lumi_image_write(path, depth, &options, error);
}

/* Sensor values as the simulated cameras of a rig send them and lumid stores them. */
static int encode_raw(const struct sim_output *output, int index, const struct lumi_raster *color, uint8_t **data,
                      size_t *size, struct lumi_error *error)
{
    const int bits = output->sensor.bits ? output->sensor.bits : 12, bytes = bits > 8 ? 2 : 1;
    struct lumi_raster raw = {0};
    struct lumi_head head;
    uint8_t *top = NULL;
    size_t top_size;
    int code;

    LUMI_GOTO(code, done, sim_sensor_filter(color, color->width, color->height, &raw));
    sim_sensor_apply(&output->sensor, (uint64_t)index, &raw);
    lumi_head_init(&head);
    head.kind = LUMI_HEAD_BAYER;
    head.width = raw.width;
    head.height = raw.height;
    head.bits = bits;
    memcpy(head.filter, (uint8_t[]){0, 1, 1, 2}, 4);
    head.software = "Lumisphere";
    LUMI_GOTO(code, done, lumi_head_make(&head, &top, &top_size, error));
    *size = top_size + (size_t)raw.width * (size_t)raw.height * (size_t)bytes;
    *data = lumi_alloc(*size, 1);
    code = *data ? LUMI_OK : LUMI_ERR_NOMEM;
    if (*data)
        memcpy(*data, top, top_size);
    for (int y = 0; *data && y < raw.height; y++) {
        uint8_t *to = *data + top_size + (size_t)y * (size_t)raw.width * (size_t)bytes;
        for (int x = 0; x < raw.width; x++) {
            const unsigned value =
                (unsigned)(fminf(fmaxf(lumi_row_f32(&raw, y)[x], 0), 1) * (float)((1 << bits) - 1) + 0.5f);
            *to++ = (uint8_t)value;
            if (bytes == 2)
                *to++ = (uint8_t)(value >> 8);
        }
    }
done:
    if (code == LUMI_ERR_NOMEM)
        lumi_fail(error, code, "no memory for a picture");
    lumi_free(top);
    lumi_raster_finish(&raw);
    return code;
}

static int render(const struct sim_scene *scene, const struct sim_view *view, const struct sim_output *output,
                  struct lumi_raster *color, struct lumi_raster *depth, struct lumi_error *error)
{
    const struct sim_moment moment = {view->turn_angle, view->drop, output->turned, 0,
                                      output->given_poses ? &view->pose : NULL};

    if (output->turned == 0)
        return sim_camera_render(scene, &view->lens, &view->pose, output->threads, color, depth, error);
    LUMI_TRY(sim_exposure_render(scene, output->profile, view->camera, &moment, output->threads, color, error));
    if (depth) { /* of the middle */
        struct lumi_raster sharp = {0};
        int code = sim_camera_render(scene, &view->lens, &view->pose, output->threads, &sharp, depth, error);
        lumi_raster_finish(&sharp);
        return code;
    }
    return LUMI_OK;
}

int sim_view_render(const struct sim_scene *scene, const struct sim_view *view, const struct sim_output *output,
                    const char *depth_path, struct lumi_raster *light, struct lumi_error *error)
{
    struct lumi_raster depth = {0};

    *light = (struct lumi_raster){0};
    int code = render(scene, view, output, light, depth_path ? &depth : NULL, error);
    if (code == LUMI_OK && depth_path)
        code = write_depth(depth_path, &depth, error);
    lumi_raster_finish(&depth);
    if (code != LUMI_OK)
        lumi_raster_finish(light);
    return code;
}

/* What stands in the file: sRGB, but for OpenEXR. */
static int encode_picture(const struct sim_output *output, const struct lumi_raster *color, uint8_t **data,
                          size_t *size, struct lumi_error *error)
{
    struct lumi_image_options options;
    struct lumi_raster coded = {0};

    image_options(output, &options);
    if (output->format == SIM_FORMAT_EXR)
        return lumi_image_encode(color, &options, data, size, error);
    int code =
        lumi_raster_convert(color, options.bits == 16 && options.format == LUMI_IMAGE_PNG ? LUMI_U16 : LUMI_U8, &coded);
    if (code != LUMI_OK)
        return lumi_fail(error, code, "no memory for a picture");
    code = lumi_image_encode(&coded, &options, data, size, error);
    lumi_raster_finish(&coded);
    return code;
}

int sim_view_encode(const struct lumi_raster *light, int index, double stops, const struct sim_output *output,
                    uint8_t **data, size_t *size, struct lumi_error *error)
{
    struct sim_output shot = *output;
    struct lumi_raster color;

    shot.sensor.exposure += stops;
    if (output->format == SIM_FORMAT_DNG)
        return encode_raw(&shot, index, light, data, size, error);
    if (lumi_raster_create(&color, light->width, light->height, light->channels, LUMI_F32) != LUMI_OK)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a picture");
    for (int y = 0; y < light->height; y++)
        memcpy(lumi_row_f32(&color, y), lumi_row_f32(light, y),
               (size_t)light->width * (size_t)light->channels * sizeof(float));
    sim_sensor_apply(&shot.sensor, (uint64_t)index, &color);
    int code = encode_picture(&shot, &color, data, size, error);
    lumi_raster_finish(&color);
    return code;
}

/* A number in JSON, whatever the locale, exact. */
static void number(GString *json, const char *key, double value)
{
    char text[G_ASCII_DTOSTR_BUF_SIZE];

    g_string_append_printf(json, "\"%s\": %s", key, g_ascii_dtostr(text, sizeof text, value));
}

static void append_lens(GString *json, const struct lumi_lens *l)
{
    bool fisheye = l->model == LUMI_LENS_FISHEYE;
    const char *const keys[] = {"fl_x", "fl_y", "cx", "cy", "k1", "k2", fisheye ? "k3" : "p1", fisheye ? "k4" : "p2"};
    const double values[] = {
        l->fx, l->fy, l->cx, l->cy, l->k1, l->k2, fisheye ? l->k3 : l->p1, fisheye ? l->k4 : l->p2};

    g_string_append_printf(json, "\"camera_model\": \"%s\", \"w\": %d, \"h\": %d",
                           fisheye ? "OPENCV_FISHEYE" : "OPENCV", l->width, l->height);
    for (int i = 0; i < 8; i++) {
        g_string_append(json, ", ");
        number(json, keys[i], values[i]);
    }
}

static void append_frame(GString *json, const struct sim_view *view, const char *name, const struct sim_output *output)
{
    const double *r = view->pose.r;
    const double t[3] = {view->pose.t.x, view->pose.t.y, view->pose.t.z};

    g_string_append_printf(json, "    {\"file_path\": \"images/%s%s\", ", name, sim_format_extension(output->format));
    if (output->depth)
        g_string_append_printf(json, "\"depth_file_path\": \"depth/%s.exr\", ", name);
    append_lens(json, &view->lens);
    g_string_append_printf(json, ", \"row\": %d, \"col\": %d,\n     \"transform_matrix\": [", view->row, view->column);
    for (int i = 0; i < 3; i++) {
        /* From y down, z forward to y up, z backward. */
        const double row[4] = {r[3 * i], -r[3 * i + 1], -r[3 * i + 2], t[i]};
        for (int k = 0; k < 4; k++) {
            char text[G_ASCII_DTOSTR_BUF_SIZE];
            g_string_append_printf(json, "%s%s", k ? ", " : "[", g_ascii_dtostr(text, sizeof text, row[k] + 0.0));
        }
        g_string_append(json, "], ");
    }
    g_string_append(json, "[0, 0, 0, 1]]}");
}

static int make_folder(const char *path, struct lumi_error *error)
{
    if (g_mkdir_with_parents(path, 0777) == 0)
        return LUMI_OK;
    return lumi_fail_errno(error, path, "cannot make the folder");
}

struct places {
    char *images, *depths;
};

char *sim_frame_name(const struct sim_view *view)
{
    return g_strdup_printf("r%02dc%02d", view->row, view->column);
}

static char *view_name(const struct sim_rig *views, int index)
{
    return views->rows > 1 ? sim_frame_name(&views->views[index]) : g_strdup_printf("v%04d", index);
}

static void view_paths(const struct places *places, const struct sim_output *output, const char *name, char **image,
                       char **depth)
{
    *image = g_strconcat(places->images, "/", name, sim_format_extension(output->format), NULL);
    *depth = output->depth ? g_strconcat(places->depths, "/", name, ".exr", NULL) : NULL;
}

static int write_views(const struct sim_scene *scene, const struct sim_rig *views, const struct sim_output *output,
                       const struct places *places, int *begun, GString *json, struct lumi_error *error)
{
    for (int i = 0; i < views->count; i++) {
        const struct sim_view *view = &views->views[i];
        g_autofree char *name = view_name(views, i), *path = NULL, *depth = NULL;
        struct lumi_raster light;
        uint8_t *data = NULL;
        size_t size = 0;
        view_paths(places, output, name, &path, &depth);
        *begun = i + 1;
        LUMI_TRY(sim_view_render(scene, view, output, depth, &light, error));
        int code = sim_view_encode(&light, i, 0, output, &data, &size, error);
        lumi_raster_finish(&light);
        if (code == LUMI_OK)
            code = lumi_file_write(path, data, size, false, error);
        lumi_free(data);
        LUMI_TRY(code);
        append_frame(json, view, name, output);
        g_string_append(json, i + 1 < views->count ? ",\n" : "\n");
        if (output->progress)
            output->progress(output->context, i + 1, views->count);
    }
    return LUMI_OK;
}

/* Half a set of views is no truth. Folders that hold something else stay. */
static void remove_views(const struct sim_rig *views, const struct sim_output *output, const struct places *places,
                         int begun, const char *dir)
{
    for (int i = 0; i < begun; i++) {
        g_autofree char *name = view_name(views, i), *path = NULL, *depth = NULL;
        view_paths(places, output, name, &path, &depth);
        unlink(path);
        if (depth)
            unlink(depth);
    }
    rmdir(places->images);
    rmdir(places->depths);
    rmdir(dir);
}

int sim_truth_poses(const struct sim_rig *views, enum sim_format format, const char *path, struct lumi_error *error)
{
    g_autoptr(GString) json = g_string_new("{\"frames\": [\n");
    const struct sim_output output = {.format = format};

    for (int i = 0; i < views->count; i++) {
        g_autofree char *name = sim_frame_name(&views->views[i]);
        append_frame(json, &views->views[i], name, &output);
        g_string_append(json, i + 1 < views->count ? ",\n" : "\n");
    }
    g_string_append(json, "]}\n");
    return lumi_file_write(path, json->str, json->len, false, error);
}

int sim_truth_write(const struct sim_scene *scene, const struct sim_rig *views, const struct sim_output *output,
                    const char *dir, struct lumi_error *error)
{
    g_autofree char *images = g_build_filename(dir, "images", NULL), *depths = g_build_filename(dir, "depth", NULL);
    g_autofree char *poses = g_build_filename(dir, "transforms.json", NULL);
    g_autoptr(GString) json = g_string_new("{\"frames\": [\n");
    struct places places = {images, depths};
    int begun = 0, code;

    if (!output->overwrite && g_file_test(poses, G_FILE_TEST_EXISTS))
        return lumi_fail(error, LUMI_ERR_EXISTS, "%s: is there already", poses);
    LUMI_TRY(sim_sensor_check(&output->sensor, error));
    LUMI_TRY(make_folder(images, error));
    if (output->depth)
        LUMI_GOTO(code, failed, make_folder(depths, error));
    LUMI_GOTO(code, failed, write_views(scene, views, output, &places, &begun, json, error));
    g_string_append(json, "]}\n");
    LUMI_GOTO(code, failed, lumi_file_write(poses, json->str, json->len, false, error));
    return LUMI_OK;
failed:
    remove_views(views, output, &places, begun, dir);
    return code;
}
