/* The stages `grade` and `color`: files in and out. */
#include "pipeline/color/color_stage.h"

#include "pipeline/color/grade.h"
#include "pipeline/run/key.h"
#include "proto/base/file.h"
#include "proto/base/memory.h"
#include "proto/base/parallel.h"
#include "proto/image/image.h"

#include <glib.h>
#include <string.h>

enum { EVERY = 4 }; /* pixels that the statistics look at, each way */

static bool wanted(const struct lumi_run *run, int index)
{
    (void)index;
    return run->wants.color;
}

static bool bracketed(const struct lumi_run *run)
{
    for (int i = 0; i < run->count; i++)
        if (run->sources[i].part_count > 0)
            return true;
    return false;
}

static enum lumi_tone tone_of(const struct lumi_run *run)
{
    const enum lumi_tone tone = run->parameters.tone;

    return tone != LUMI_TONE_AUTO ? tone : bracketed(run) ? LUMI_TONE_REINHARD : LUMI_TONE_NONE;
}

static int key_file(const char *path, struct lumi_key *k, struct lumi_error *error)
{
    uint8_t *data;
    size_t size;

    lumi_key_int(k, path != NULL);
    if (!path)
        return LUMI_OK;
    LUMI_TRY(lumi_file_read(path, (size_t)256 << 20, &data, &size, error));
    lumi_key_int(k, (long long)size);
    lumi_key_bytes(k, data, size);
    lumi_free(data);
    return LUMI_OK;
}

static int grade_key(struct lumi_run *run, int index, struct lumi_key *k, struct lumi_error *error)
{
    const struct lumi_parameters *p = &run->parameters;

    (void)index;
    for (int i = 0; i < 9; i++)
        lumi_key_double(k, p->color_matrix[i]);
    for (int i = 0; i < 3; i++)
        lumi_key_double(k, p->white_balance[i]);
    lumi_key_double(k, p->exposure);
    lumi_key_int(k, tone_of(run));
    LUMI_TRY(key_file(p->icc, k, error));
    LUMI_TRY(key_file(p->lut, k, error));
    for (int i = 0; i < run->kept_count; i++)
        lumi_key_view(k, run, run->kept[i], LUMI_VIEW_FILTERED);
    return LUMI_OK;
}

/* Whether the capture's files hold linear light. */
static int find_linear(const struct lumi_run *run, bool *linear, struct lumi_error *error)
{
    struct lumi_image_info info;

    *linear = bracketed(run);
    if (*linear || run->dense == 0)
        return LUMI_OK;
    g_autofree char *path = lumi_run_image(run, 0);
    LUMI_TRY(lumi_image_info(path, &info, error));
    *linear = info.sample == LUMI_F32;
    return LUMI_OK;
}

/* Views are counted in any order into a histogram a thread: sums of whole numbers do not depend on it. */
struct counting {
    const struct lumi_run *run;
    const struct lumi_grade *grade;
    struct lumi_light *lights;
    struct lumi_error *errors; /* a view */
};

static int count_view(void *context, int number, int thread)
{
    struct counting *counting = context;
    g_autofree char *path = lumi_run_view(counting->run, counting->run->kept[number], LUMI_VIEW_FILTERED);
    struct lumi_raster view;

    LUMI_TRY(lumi_image_read(path, 3, &view, NULL, &counting->errors[number]));
    lumi_grade_apply(counting->grade, false, &view);
    for (int y = EVERY / 2; y < view.height; y += EVERY)
        for (int x = EVERY / 2; x < view.width; x += EVERY)
            lumi_light_add(&counting->lights[thread], lumi_luminance(lumi_row_f32(&view, y) + 3 * x));
    lumi_raster_finish(&view);
    return LUMI_OK;
}

static int count_light(const struct lumi_run *run, const struct lumi_grade *grade, struct lumi_light *light,
                       struct lumi_error *error)
{
    const int threads = run->threads > 0 ? run->threads : lumi_thread_count();
    struct counting counting = {.run = run,
                                .grade = grade,
                                .lights = g_new0(struct lumi_light, threads),
                                .errors = g_new0(struct lumi_error, run->kept_count)};
    int code = lumi_parallel_for(run->kept_count, threads, count_view, &counting);

    for (int i = 0; code != LUMI_OK && i < run->kept_count; i++)
        if (counting.errors[i].code == code && error) {
            *error = counting.errors[i];
            break;
        }
    for (int t = 0; t < threads; t++) {
        for (int i = 0; i < LUMI_LIGHT_STOPS * LUMI_LIGHT_FINE; i++)
            light->bins[i] += counting.lights[t].bins[i];
        light->count += counting.lights[t].count;
    }
    g_free(counting.lights);
    g_free(counting.errors);
    return code;
}

static int make_grade(struct lumi_run *run, void *state, int index, int thread, const char *path,
                      struct lumi_error *error)
{
    struct lumi_light light = {.count = 0};
    struct lumi_grade grade;
    bool linear;

    (void)state;
    (void)index;
    (void)thread;
    LUMI_TRY(find_linear(run, &linear, error));
    LUMI_TRY(lumi_grade_open(run, linear, &grade, error));
    int code = LUMI_OK;
    if (tone_of(run) != LUMI_TONE_NONE)
        code = count_light(run, &grade, &light, error);
    if (code == LUMI_OK) {
        lumi_tone_choose(&light, tone_of(run), run->parameters.exposure, &grade.map);
        code = lumi_grade_write(path, &grade, error);
    }
    lumi_grade_finish(&grade);
    return code;
}

static int color_key(struct lumi_run *run, int index, struct lumi_key *k, struct lumi_error *error)
{
    (void)error;
    lumi_key_input(k, run, "grade", -1);
    lumi_key_view(k, run, index, LUMI_VIEW_FILTERED);
    return LUMI_OK;
}

static void end(struct lumi_run *run, void *state)
{
    (void)run;
    if (state)
        lumi_grade_finish(state);
    g_free(state);
}

static int begin(struct lumi_run *run, void **state, struct lumi_error *error)
{
    g_autofree char *path = lumi_run_path(run, "grade", -1, ".txt");
    struct lumi_grade told, *grade;
    uint8_t *data;
    size_t size;

    *state = NULL;
    LUMI_TRY(lumi_file_read(path, 4096, &data, &size, error));
    int code = lumi_grade_parse((const char *)data, size, path, &told, error);
    lumi_free(data);
    LUMI_TRY(code);
    grade = g_new0(struct lumi_grade, 1);
    code = lumi_grade_open(run, told.linear, grade, error);
    if (code != LUMI_OK) {
        g_free(grade);
        return code;
    }
    grade->map = told.map;
    *state = grade;
    return LUMI_OK;
}

static int make_color(struct lumi_run *run, void *state, int index, int thread, const char *path,
                      struct lumi_error *error)
{
    g_autofree char *from = lumi_run_view(run, index, LUMI_VIEW_FILTERED);
    struct lumi_image_options options;
    struct lumi_raster view;

    (void)thread;
    LUMI_TRY(lumi_image_read(from, 3, &view, NULL, error));
    lumi_grade_apply(state, true, &view);
    lumi_image_options_init(&options);
    options.format = LUMI_IMAGE_EXR;
    options.half = true;
    int code = lumi_image_write(path, &view, &options, error);
    lumi_raster_finish(&view);
    return code;
}

const struct lumi_stage lumi_stage_grade = {
    .name = "grade",
    .title = "light of all views",
    .version = 1,
    .extension = ".txt",
    .whole = true,
    .set = LUMI_SET_KEPT,
    .wanted = wanted,
    .key = grade_key,
    .make = make_grade,
    .bytes_per_pixel = 30,
};

const struct lumi_stage lumi_stage_color = {
    .name = "color",
    .title = "colours",
    .version = 1,
    .extension = ".exr",
    .set = LUMI_SET_KEPT,
    .wanted = wanted,
    .key = color_key,
    .begin = begin,
    .end = end,
    .make = make_color,
    .bytes_per_pixel = 30,
};
