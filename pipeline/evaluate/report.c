/* An evaluation in words and in JSON. */
#include "pipeline/evaluate/evaluate.h"

#include "pipeline/run/json_put.h"

#include <glib.h>
#include <math.h>

char *lumi_evaluation_text(const struct lumi_evaluation *e)
{
    GString *text = g_string_new(NULL);

    g_string_append_printf(text, "%-24s %9s %9s %7s %10s\n", "view", "RGB dB", "YUV dB", "SSIM", "uncovered");
    for (int i = 0; i < e->count; i++) {
        const struct lumi_evaluated_view *v = &e->views[i];
        g_string_append_printf(text, "%-24s %9.2f %9.2f %7.4f %9.3f%%\n", v->name, v->comparison.psnr_rgb,
                               v->comparison.psnr_yuv, v->comparison.ssim, 100 * v->uncovered);
    }
    g_string_append_printf(text, "%-24s %9.2f %9.2f %7.4f %9.3f%%\n", "mean", e->mean.psnr_rgb, e->mean.psnr_yuv,
                           e->mean.ssim, 100 * e->uncovered);
    const struct lumi_evaluated_view *worst = &e->views[e->worst];
    g_string_append_printf(text, "worst: %s, %.2f dB\n", worst->name, worst->comparison.psnr_rgb);
    if (e->plane_distance > 0)
        g_string_append_printf(text, "plane at %.4g m\n", e->plane_distance);
    if (e->damaged > 0)
        g_string_append_printf(text, "%d damaged tile%s\n", e->damaged, e->damaged == 1 ? "" : "s");
    return g_string_free(text, FALSE);
}

static void add_figures(JsonBuilder *builder, const struct lumi_comparison *c, double uncovered)
{
    lumi_put_double(builder, "psnr_rgb", c->psnr_rgb);
    lumi_put_double(builder, "psnr_yuv", c->psnr_yuv);
    lumi_put_double(builder, "ssim", c->ssim);
    lumi_put_double(builder, "uncovered", uncovered);
}

char *lumi_evaluation_json(const struct lumi_evaluation *e)
{
    g_autoptr(JsonBuilder) builder = json_builder_new();

    json_builder_begin_object(builder);
    lumi_put_array(builder, "views");
    for (int i = 0; i < e->count; i++) {
        json_builder_begin_object(builder);
        lumi_put_string(builder, "name", e->views[i].name);
        add_figures(builder, &e->views[i].comparison, e->views[i].uncovered);
        json_builder_end_object(builder);
    }
    json_builder_end_array(builder);
    lumi_put_object(builder, "mean");
    add_figures(builder, &e->mean, e->uncovered);
    json_builder_end_object(builder);
    lumi_put_object(builder, "worst");
    lumi_put_string(builder, "name", e->views[e->worst].name);
    add_figures(builder, &e->views[e->worst].comparison, e->views[e->worst].uncovered);
    json_builder_end_object(builder);
    if (e->plane_distance > 0 && isfinite(e->plane_distance)) {
        lumi_put_double(builder, "plane_distance", e->plane_distance);
    }
    lumi_put_int(builder, "damaged_tiles", e->damaged);
    return lumi_put_end(builder, TRUE);
}
