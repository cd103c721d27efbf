/* An evaluation in words and in JSON. */
#include "pipeline/evaluate/evaluate.h"

#include <glib.h>
#include <json-glib/json-glib.h>
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
    json_builder_set_member_name(builder, "psnr_rgb");
    json_builder_add_double_value(builder, c->psnr_rgb);
    json_builder_set_member_name(builder, "psnr_yuv");
    json_builder_add_double_value(builder, c->psnr_yuv);
    json_builder_set_member_name(builder, "ssim");
    json_builder_add_double_value(builder, c->ssim);
    json_builder_set_member_name(builder, "uncovered");
    json_builder_add_double_value(builder, uncovered);
}

char *lumi_evaluation_json(const struct lumi_evaluation *e)
{
    g_autoptr(JsonBuilder) builder = json_builder_new();

    json_builder_begin_object(builder);
    json_builder_set_member_name(builder, "views");
    json_builder_begin_array(builder);
    for (int i = 0; i < e->count; i++) {
        json_builder_begin_object(builder);
        json_builder_set_member_name(builder, "name");
        json_builder_add_string_value(builder, e->views[i].name);
        add_figures(builder, &e->views[i].comparison, e->views[i].uncovered);
        json_builder_end_object(builder);
    }
    json_builder_end_array(builder);
    json_builder_set_member_name(builder, "mean");
    json_builder_begin_object(builder);
    add_figures(builder, &e->mean, e->uncovered);
    json_builder_end_object(builder);
    json_builder_set_member_name(builder, "worst");
    json_builder_begin_object(builder);
    json_builder_set_member_name(builder, "name");
    json_builder_add_string_value(builder, e->views[e->worst].name);
    add_figures(builder, &e->views[e->worst].comparison, e->views[e->worst].uncovered);
    json_builder_end_object(builder);
    if (e->plane_distance > 0 && isfinite(e->plane_distance)) {
        json_builder_set_member_name(builder, "plane_distance");
        json_builder_add_double_value(builder, e->plane_distance);
    }
    json_builder_set_member_name(builder, "damaged_tiles");
    json_builder_add_int_value(builder, e->damaged);
    json_builder_end_object(builder);
    g_autoptr(JsonNode) root = json_builder_get_root(builder);
    return json_to_string(root, TRUE);
}
