/* Picture files, films, stereo pairs, depth maps. */
#include "pipeline/evaluate/pictures.h"

#include "pipeline/exchange/video.h"
#include "proto/base/file.h"
#include "proto/image/image.h"

#include <glib.h>
#include <math.h>
#include <string.h>

struct job {
    struct lumi_renderer *renderer;
    const struct lumi_picture_options *options;
    struct lumi_picture_report *report;
    const char *output;
    struct lumi_video *video;
    bool several; /* files in a folder */
};

/* Two rasters of one height and kind as one. */
static int side_by_side(const struct lumi_raster *left, const struct lumi_raster *right, struct lumi_raster *both,
                        struct lumi_error *error)
{
    size_t bytes = (size_t)left->width * (size_t)left->channels * left->sample;

    if (lumi_raster_create(both, left->width + right->width, left->height, left->channels, left->sample) != LUMI_OK)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a stereo pair of %d×%d", left->width + right->width,
                         left->height);
    for (int y = 0; y < left->height; y++) {
        uint8_t *row = lumi_row_u8(both, y);
        memcpy(row, lumi_row_u8(left, y), bytes);
        memcpy(row + bytes, lumi_row_u8(right, y), bytes);
    }
    return LUMI_OK;
}

/* Inverse distance along the ray becomes metres: along the optical axis for a perspective picture, along the ray for
 * the others. Infinity is infinite, what is not covered 0. */
static void metres(const struct lumi_lens *lens, const struct lumi_picture *picture)
{
    for (int y = 0; y < lens->height; y++) {
        float *row = lumi_row_f32(&picture->inverse_distance, y);
        for (int x = 0; x < lens->width; x++) {
            struct lumi_vec3 d = {0, 0, 1};
            bool covered = lumi_row_f32(&picture->weight, y)[x] > 0;
            if (lens->model == LUMI_LENS_BROWN && !lumi_lens_unproject(lens, x + 0.5, y + 0.5, &d))
                covered = false;
            row[x] = !covered ? 0 : row[x] > 0 ? (float)(d.z / (double)row[x]) : INFINITY;
        }
    }
}

static int draw(struct job *job, const struct lumi_lens *lens, const struct lumi_pose *pose,
                struct lumi_picture *picture, struct lumi_error *error)
{
    LUMI_TRY(lumi_renderer_draw(job->renderer, lens, pose, picture, error));
    job->report->imaged += picture->imaged;
    job->report->covered += picture->covered;
    metres(lens, picture);
    return LUMI_OK;
}

/* Colour and distance of a shot, of both eyes if so asked. */
static int draw_shot(struct job *job, const struct lumi_shot *shot, struct lumi_raster *color,
                     struct lumi_raster *depth, struct lumi_error *error)
{
    struct lumi_picture eyes[2] = {0};
    int code = LUMI_OK;

    if (!job->options->stereo) {
        LUMI_GOTO(code, out, draw(job, &shot->lens, &shot->pose, &eyes[0], error));
        *color = eyes[0].color;
        *depth = eyes[0].inverse_distance;
        memset(&eyes[0].color, 0, sizeof eyes[0].color);
        memset(&eyes[0].inverse_distance, 0, sizeof eyes[0].inverse_distance);
        goto out;
    }
    for (int i = 0; i < 2; i++) {
        struct lumi_pose pose;
        lumi_eye_pose(&shot->pose, i ? 1 : -1, job->options->eye_distance, &pose);
        LUMI_GOTO(code, out, draw(job, &shot->lens, &pose, &eyes[i], error));
    }
    LUMI_GOTO(code, out, side_by_side(&eyes[0].color, &eyes[1].color, color, error));
    code = side_by_side(&eyes[0].inverse_distance, &eyes[1].inverse_distance, depth, error);
out:
    lumi_picture_finish(&eyes[0]);
    lumi_picture_finish(&eyes[1]);
    return code;
}

static char *file_in(const struct job *job, const char *place, const char *name, const char *extension)
{
    if (!job->several)
        return g_strdup(place);
    g_autofree char *file = g_strconcat(name, extension, NULL);
    return g_build_filename(place, file, NULL);
}

static int write_shot(struct job *job, const struct lumi_shot *shot, const struct lumi_raster *color,
                      const struct lumi_raster *depth, struct lumi_error *error)
{
    struct lumi_image_options image;

    lumi_image_options_init(&image);
    if (job->options->depth) {
        g_autofree char *path = file_in(job, job->options->depth, shot->name, ".exr");
        image.channel = "Z";
        image.half = false;
        image.format = LUMI_IMAGE_EXR;
        LUMI_TRY(lumi_image_write(path, depth, &image, error));
        lumi_image_options_init(&image);
    }
    if (job->video)
        return lumi_video_add(job->video, color, error);
    g_autofree char *path = file_in(job, job->output, shot->name, ".png");
    return lumi_image_write(path, color, &image, error);
}

static int make_folder(const char *path, struct lumi_error *error)
{
    return g_mkdir_with_parents(path, 0777) ? lumi_fail_errno(error, path, "making the folder") : LUMI_OK;
}

static int begin(struct job *job, const struct lumi_shot *shots, int count, struct lumi_error *error)
{
    const struct lumi_picture_options *o = job->options;
    bool film = g_str_has_suffix(job->output, ".webm");

    job->several = count > 1;
    if (o->depth && !job->several && lumi_image_format_of_name(o->depth) != LUMI_IMAGE_EXR)
        return lumi_fail(error, LUMI_ERR_ARG, "%s: depth is written as .exr", o->depth);
    if (o->depth && !job->several)
        LUMI_TRY(lumi_file_check_place(o->depth, error));
    if (o->depth && !strcmp(o->depth, job->output))
        return lumi_fail(error, LUMI_ERR_ARG, "%s: pictures and depth need two places", o->depth);
    if (o->depth && job->several)
        LUMI_TRY(make_folder(o->depth, error));
    bool picture = lumi_image_format_of_name(job->output) != LUMI_IMAGE_AUTO;
    if (!film && job->several)
        return picture ? lumi_fail(error, LUMI_ERR_ARG, "%s: %d pictures want a folder, or a film", job->output, count)
                       : make_folder(job->output, error);
    if (!film)
        return picture ? lumi_file_check_place(job->output, error)
                       : lumi_fail(error, LUMI_ERR_ARG, "%s: .png, .jpg, .tif, .exr or .webm wanted", job->output);
    for (int i = 1; i < count; i++)
        if (shots[i].lens.width != shots[0].lens.width || shots[i].lens.height != shots[0].lens.height)
            return lumi_fail(error, LUMI_ERR_ARG, "%s: pictures of different sizes do not make a film", job->output);
    return lumi_video_create(job->output, shots[0].lens.width * (o->stereo ? 2 : 1), shots[0].lens.height,
                             o->frames_per_second, o->video_quality, &job->video, error);
}

enum lumi_sample lumi_picture_sample(const char *output, int bits)
{
    enum lumi_image_format format = lumi_image_format_of_name(output);

    if (format == LUMI_IMAGE_EXR)
        return LUMI_F32;
    /* A name without an ending we know is a folder of PNG files. */
    return bits == 16 && format != LUMI_IMAGE_JPEG && !g_str_has_suffix(output, ".webm") ? LUMI_U16 : LUMI_U8;
}

int lumi_pictures_write(struct lumi_renderer *renderer, const struct lumi_shot *shots, int count, const char *output,
                        const struct lumi_picture_options *options, struct lumi_picture_report *report,
                        struct lumi_error *error)
{
    struct job job = {.renderer = renderer, .options = options, .report = report, .output = output};

    memset(report, 0, sizeof *report);
    if (count < 1)
        return lumi_fail(error, LUMI_ERR_ARG, "%s: no pictures to render", output);
    LUMI_TRY(begin(&job, shots, count, error));
    int code = LUMI_OK;
    for (int i = 0; i < count && code == LUMI_OK; i++) {
        struct lumi_raster color = {0}, depth = {0};
        if (options->progress)
            options->progress(options->context, "pictures", i, count);
        code = draw_shot(&job, &shots[i], &color, &depth, error);
        if (code == LUMI_OK)
            code = write_shot(&job, &shots[i], &color, &depth, error);
        lumi_raster_finish(&color);
        lumi_raster_finish(&depth);
    }
    report->pictures = count;
    report->damaged = lumi_renderer_damaged(renderer);
    if (code != LUMI_OK)
        lumi_video_abandon(job.video);
    else if (job.video)
        code = lumi_video_finish(job.video, error);
    return code;
}
