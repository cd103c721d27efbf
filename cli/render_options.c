/* The options that `lumi render` and `lumi eval` share. */
#include "cli/render_options.h"

#include "cli/command.h"

#include <string.h>

static int choose(const char *option, const char *text, const char *const *names, int *value, struct lumi_error *error)
{
    return text ? cli_parse_choice(option, text, names, value, error) : LUMI_OK;
}

int cli_render_options_apply(const struct cli_render_options *o, struct lumi_render_options *render,
                             struct lumi_error *error)
{
    static const char *const methods[] = {"disks", "plane", NULL}, *const levels[] = {"coarse", "fine", NULL};
    static const char *const tests[] = {"intra", "none", "inter", NULL};
    static const char *const kernels[] = {"linear", "gaussian", "cubic", NULL};
    static const char *const filters[] = {"bilinear", "cubic", NULL}, *const spaces[] = {"display", "linear", NULL};
    int method = LUMI_METHOD_DISKS, level = LUMI_LEVEL_FINE, test = LUMI_DEPTH_INTRA, linear = 0, filter;
    double stretch;

    lumi_render_options_default(render);
    filter = (int)render->disks.filter;
    LUMI_TRY(cli_check_threads(o->threads, error));
    LUMI_TRY(choose("--method", o->method, methods, &method, error));
    LUMI_TRY(choose("--level", o->level, levels, &level, error));
    LUMI_TRY(choose("--depth-test", o->depth_test, tests, &test, error));
    LUMI_TRY(choose("--kernel", o->kernel, kernels, &render->disks.kernel, error));
    LUMI_TRY(choose("--filter", o->filter, filters, &filter, error));
    LUMI_TRY(choose("--blend", o->blend, spaces, &linear, error));
    if (o->stretch && !strcmp(o->stretch, "off")) {
        render->disks.stretch = 0;
    } else if (o->stretch) {
        LUMI_TRY(cli_parse_doubles("--stretch", o->stretch, ',', 1, &stretch, error));
        render->disks.stretch = (float)stretch;
    }
    if (o->disk_scale != 0)
        render->disks.disk_scale = (float)o->disk_scale;
    if (o->plane_distance < 0)
        return lumi_fail(error, LUMI_ERR_ARG, "--plane-distance %g: metres wanted", o->plane_distance);
    render->method = (enum lumi_method)method;
    render->level = level;
    render->disks.depth_test = (enum lumi_depth_test)test;
    render->disks.filter = (enum lumi_filter)filter;
    render->disks.linear_light = linear;
    render->disks.threads = o->threads;
    render->plane_distance = o->plane_distance;
    return LUMI_OK;
}
