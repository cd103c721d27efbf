/* Views and poses for other programs. */
#include "pipeline/color/exr_set.h"

#include "proto/base/file.h"
#include "proto/base/memory.h"

#include <glib.h>
#include <glib/gstdio.h>
#include <math.h>

#define MOST_BYTES ((size_t)4 << 30)

static int copy_view(const struct lumi_run *run, int index, const char *folder, struct lumi_error *error)
{
    g_autofree char *from = lumi_run_view(run, index, LUMI_VIEW_FILTERED);
    g_autofree char *to = g_strdup_printf("%s/%s.exr", folder, run->sources[index].name);
    uint8_t *data;
    size_t size;

    LUMI_TRY(lumi_file_read(from, MOST_BYTES, &data, &size, error));
    int code = lumi_file_write(to, data, size, false, error);
    lumi_free(data);
    return code;
}

static void add_number(GString *text, const char *before, double value)
{
    char buffer[G_ASCII_DTOSTR_BUF_SIZE];

    g_string_append_printf(text, "%s%s", before, g_ascii_formatd(buffer, sizeof buffer, "%.17g", value));
}

/* Whether the tangents are evenly spaced: pixels a unit, and the pixel where the tangent is 0. */
static bool is_even(const double *tangents, int tiles, double *focal, double *centre)
{
    *focal = LUMI_TILE * tiles / (tangents[tiles] - tangents[0]);
    *centre = -tangents[0] * *focal;
    for (int i = 0; i <= tiles; i++)
        if (fabs(*centre + *focal * tangents[i] - LUMI_TILE * i) > 1e-6)
            return false;
    return true;
}

static void add_tangents(GString *text, const char *key, const double *tangents, int tiles)
{
    g_string_append_printf(text, ",\n\"%s\": [", key);
    for (int i = 0; i <= tiles; i++)
        add_number(text, i ? ", " : "", tangents[i]);
    g_string_append(text, "]");
}

static void add_lens(GString *text, const struct lumi_grid *grid)
{
    double fx, fy, cx, cy;
    const bool even_x = is_even(grid->tan_x, grid->cols, &fx, &cx), even_y = is_even(grid->tan_y, grid->rows, &fy, &cy);

    g_string_append_printf(text, "\"w\": %d, \"h\": %d", grid->width, grid->height);
    if (even_x && even_y) {
        g_string_append(text, ", \"camera_model\": \"PINHOLE\"");
        add_number(text, ", \"fl_x\": ", fx);
        add_number(text, ", \"fl_y\": ", fy);
        add_number(text, ", \"cx\": ", cx);
        add_number(text, ", \"cy\": ", cy);
        return;
    }
    g_string_append_printf(text, ", \"camera_model\": \"LUMISPHERE_TILES\", \"tile\": %d", LUMI_TILE);
    add_tangents(text, "tan_x", grid->tan_x, grid->cols);
    add_tangents(text, "tan_y", grid->tan_y, grid->rows);
}

/* nerfstudio's camera looks along −z, its y up: the second and third columns change sign. */
static void add_frame(GString *text, const struct lumi_source *source)
{
    const double *r = source->pose.r, t[3] = {source->pose.t.x, source->pose.t.y, source->pose.t.z};

    g_string_append_printf(text, "{\"file_path\": \"%s.exr\", \"transform_matrix\": [", source->name);
    for (int row = 0; row < 3; row++) {
        add_number(text, row ? ", [" : "[", r[3 * row]);
        add_number(text, ", ", -r[3 * row + 1]);
        add_number(text, ", ", -r[3 * row + 2]);
        add_number(text, ", ", t[row]);
        g_string_append(text, "]");
    }
    g_string_append(text, ", [0, 0, 0, 1]]}");
}

int lumi_exr_set(const struct lumi_run *run, const char *folder, struct lumi_error *error)
{
    g_autofree char *path = g_build_filename(folder, "transforms.json", NULL);
    g_autoptr(GString) text = g_string_new("{");

    LUMI_TRY(lumi_file_check_output(folder, run->capture, error));
    if (g_mkdir_with_parents(folder, 0777))
        return lumi_fail_errno(error, folder, "create");
    add_lens(text, &run->grid);
    g_string_append(text, ",\n\"frames\": [");
    for (int i = 0; i < run->kept_count; i++) {
        LUMI_TRY(copy_view(run, run->kept[i], folder, error));
        g_string_append(text, i ? ",\n" : "\n");
        add_frame(text, &run->sources[run->kept[i]]);
    }
    g_string_append(text, "]}\n");
    return lumi_file_write(path, text->str, text->len, false, error);
}
