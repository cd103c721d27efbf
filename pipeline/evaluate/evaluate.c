/* A field against the truth. */
#include "pipeline/evaluate/evaluate.h"

#include "pipeline/evaluate/sheet.h"
#include "proto/base/file.h"
#include "proto/base/memory.h"
#include "proto/image/image.h"

#include <glib.h>
#include <math.h>
#include <string.h>

#define PLANE_STEPS 20 /* planes tried between farthest and nearest, before the best one is narrowed down */
#define PLANE_VIEWS 3  /* views of the truth they are judged by */

/* Mean PSNR of a few views over one plane. */
static int judge_plane(struct lumi_renderer *renderer, const struct lumi_truth_set *truth,
                       const struct lumi_raster *pictures, const int *chosen, int count, double w, double *psnr,
                       struct lumi_error *error)
{
    *psnr = 0;
    lumi_renderer_set_plane(renderer, w);
    for (int i = 0; i < count; i++) {
        const struct lumi_truth *t = &truth->items[chosen[i]];
        struct lumi_comparison comparison;
        struct lumi_picture picture;
        LUMI_TRY(lumi_renderer_draw(renderer, &t->lens, &t->pose, &picture, error));
        int code = lumi_compare_pictures(&picture.color, &pictures[i], 0, &comparison, error);
        lumi_picture_finish(&picture);
        LUMI_TRY(code);
        *psnr += comparison.psnr_rgb / count;
    }
    return LUMI_OK;
}

struct plane_search {
    struct lumi_renderer *renderer;
    const struct lumi_truth_set *truth;
    const struct lumi_evaluate_options *options;
    int chosen[PLANE_VIEWS], count, tried;
    struct lumi_raster pictures[PLANE_VIEWS];
    double best_w, best_psnr;
};

static int try_plane(struct plane_search *search, double w, double *psnr, struct lumi_error *error)
{
    if (search->options->progress)
        search->options->progress(search->options->context, "plane", search->tried++, PLANE_STEPS + 10);
    LUMI_TRY(
        judge_plane(search->renderer, search->truth, search->pictures, search->chosen, search->count, w, psnr, error));
    if (*psnr > search->best_psnr) {
        search->best_psnr = *psnr;
        search->best_w = w;
    }
    return LUMI_OK;
}

/* Evenly spaced inverse distances, then the best one's neighbourhood in golden sections. */
static int search_plane(struct plane_search *search, struct lumi_error *error)
{
    const double golden = (sqrt(5) - 1) / 2;
    double low, high, psnr;

    lumi_renderer_range(search->renderer, &low, &high);
    double step = (high - low) / (PLANE_STEPS - 1);
    for (int i = 0; i < PLANE_STEPS; i++)
        LUMI_TRY(try_plane(search, low + i * step, &psnr, error));
    double a = fmax(search->best_w - step, 0), b = search->best_w + step, c = b - golden * (b - a),
           d = a + golden * (b - a), at_c, at_d;
    LUMI_TRY(try_plane(search, c, &at_c, error));
    LUMI_TRY(try_plane(search, d, &at_d, error));
    for (int i = 0; i < 8; i++) {
        if (at_c > at_d) {
            b = d, d = c, at_d = at_c, c = b - golden * (b - a);
            LUMI_TRY(try_plane(search, c, &at_c, error));
        } else {
            a = c, c = d, at_c = at_d, d = a + golden * (b - a);
            LUMI_TRY(try_plane(search, d, &at_d, error));
        }
    }
    return LUMI_OK;
}

static int find_plane(struct lumi_renderer *renderer, const struct lumi_truth_set *truth,
                      const struct lumi_evaluate_options *options, double *inverse_distance, struct lumi_error *error)
{
    struct plane_search search = {.renderer = renderer, .truth = truth, .options = options, .best_psnr = -1};
    int code = LUMI_OK;

    search.count = truth->count < PLANE_VIEWS ? truth->count : PLANE_VIEWS;
    for (int i = 0; i < search.count && code == LUMI_OK; i++) {
        search.chosen[i] = (int)((2 * i + 1) * (long)truth->count / (2 * search.count));
        code = lumi_truth_picture(&truth->items[search.chosen[i]], &search.pictures[i], error);
    }
    if (code == LUMI_OK)
        code = search_plane(&search, error);
    for (int i = 0; i < search.count; i++)
        lumi_raster_finish(&search.pictures[i]);
    *inverse_distance = search.best_w;
    return code;
}

static int write_difference(const char *folder, const char *name, const struct lumi_raster *difference,
                            struct lumi_error *error)
{
    g_autofree char *file = g_strdup_printf("%s.png", name);
    g_autofree char *path = g_build_filename(folder, file, NULL);

    return lumi_image_write(path, difference, NULL, error);
}

/* Spread over all views, the first always among them. */
static bool on_sheet(const struct lumi_evaluate_options *options, int index, int count)
{
    int most = options->sheet_views > 0 && options->sheet_views < count ? options->sheet_views : count;

    return options->sheet && (index == 0 || (long)index * most / count != (long)(index - 1) * most / count);
}

static int evaluate_view(struct lumi_renderer *renderer, const struct lumi_truth *truth,
                         const struct lumi_evaluate_options *options, bool on_the_sheet, struct lumi_sheet *sheet,
                         struct lumi_evaluated_view *view, struct lumi_error *error)
{
    struct lumi_raster picture = {0}, difference = {0};
    struct lumi_picture rendered = {0};
    int code;

    LUMI_GOTO(code, out, lumi_truth_picture(truth, &picture, error));
    LUMI_GOTO(code, out, lumi_renderer_draw(renderer, &truth->lens, &truth->pose, &rendered, error));
    LUMI_GOTO(
        code, out,
        lumi_compare_pictures(&rendered.color, &picture, options->render.disks.threads, &view->comparison, error));
    view->name = truth->name;
    view->uncovered = rendered.imaged > 0 ? 1 - (double)rendered.covered / (double)rendered.imaged : 0;
    if (!options->difference && !on_the_sheet)
        goto out;
    LUMI_GOTO(code, out, lumi_difference_picture(&picture, &rendered.color, &difference, error));
    if (options->difference)
        LUMI_GOTO(code, out, write_difference(options->difference, truth->name, &difference, error));
    if (on_the_sheet)
        code = lumi_sheet_add(sheet, &picture, &rendered.color, &difference, error);
out:
    lumi_picture_finish(&rendered);
    lumi_raster_finish(&picture);
    lumi_raster_finish(&difference);
    return code;
}

static void summarize(struct lumi_evaluation *e)
{
    for (int i = 0; i < e->count; i++) {
        const struct lumi_comparison *c = &e->views[i].comparison;
        e->mean.psnr_rgb += c->psnr_rgb / e->count;
        e->mean.psnr_yuv += c->psnr_yuv / e->count;
        e->mean.ssim += c->ssim / e->count;
        e->uncovered += e->views[i].uncovered / e->count;
        if (c->psnr_rgb < e->views[e->worst].comparison.psnr_rgb)
            e->worst = i;
    }
}

static int evaluate_all(struct lumi_renderer *renderer, const struct lumi_truth_set *truth,
                        const struct lumi_evaluate_options *options, struct lumi_evaluation *evaluation,
                        struct lumi_error *error)
{
    struct lumi_sheet sheet = {0};
    int code = LUMI_OK;

    for (int i = 0; i < truth->count && code == LUMI_OK; i++) {
        if (options->progress)
            options->progress(options->context, "views", i, truth->count);
        code = evaluate_view(renderer, &truth->items[i], options, on_sheet(options, i, truth->count), &sheet,
                             &evaluation->views[i], error);
    }
    if (code == LUMI_OK && options->sheet)
        code = lumi_sheet_write(&sheet, options->sheet, error);
    lumi_sheet_finish(&sheet);
    return code;
}

int lumi_evaluate(const char *field, const struct lumi_truth_set *truth, const struct lumi_evaluate_options *options,
                  struct lumi_evaluation *evaluation, struct lumi_error *error)
{
    struct lumi_renderer *renderer = NULL;
    struct lumi_render_options render = options->render;
    double w = 0;
    int code;

    memset(evaluation, 0, sizeof *evaluation);
    render.disks.sample = LUMI_U8;
    if (options->sheet)
        LUMI_TRY(lumi_file_check_place(options->sheet, error));
    if (options->difference && g_mkdir_with_parents(options->difference, 0777))
        return lumi_fail_errno(error, options->difference, "making the folder");
    evaluation->views = lumi_calloc((size_t)truth->count, sizeof *evaluation->views);
    if (!evaluation->views)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: no memory", field);
    evaluation->count = truth->count;
    LUMI_GOTO(code, out, lumi_renderer_open(field, &render, &renderer, error));
    if (render.method == LUMI_METHOD_PLANE) {
        w = render.plane_distance > 0 ? 1 / render.plane_distance : 0;
        if (!(render.plane_distance > 0))
            LUMI_GOTO(code, out, find_plane(renderer, truth, options, &w, error));
        lumi_renderer_set_plane(renderer, w);
        evaluation->plane_distance = 1 / w;
    }
    LUMI_GOTO(code, out, evaluate_all(renderer, truth, options, evaluation, error));
    summarize(evaluation);
    evaluation->damaged = lumi_renderer_damaged(renderer);
out:
    lumi_renderer_close(renderer);
    if (code != LUMI_OK)
        lumi_evaluation_finish(evaluation);
    return code;
}

void lumi_evaluation_finish(struct lumi_evaluation *evaluation)
{
    lumi_free(evaluation->views);
    memset(evaluation, 0, sizeof *evaluation);
}

void lumi_truth_finish(struct lumi_truth_set *truth)
{
    for (int i = 0; i < truth->count; i++) {
        g_free(truth->items[i].name);
        g_free(truth->items[i].path);
    }
    g_free(truth->items);
    memset(truth, 0, sizeof *truth);
}
