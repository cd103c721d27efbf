/* Lines of the preview's protocol. */
#include "pipeline/preview/preview_line.h"

#include <glib.h>
#include <stdlib.h>
#include <string.h>

/* A number and the spaces before it; false where there is none. */
static bool take_double(const char **at, double *value)
{
    char *end;

    if (**at != ' ')
        return false;
    while (**at == ' ')
        ++*at;
    *value = g_ascii_strtod(*at, &end);
    if (end == *at)
        return false;
    *at = end;
    return true;
}

static bool take_int(const char **at, int64_t most, int64_t *value)
{
    char *end;

    if (**at != ' ')
        return false;
    while (**at == ' ')
        ++*at;
    if (!g_ascii_isdigit(**at))
        return false;
    const guint64 number = g_ascii_strtoull(*at, &end, 10);
    if (number > (guint64)most)
        return false;
    *at = end;
    *value = (int64_t)number;
    return true;
}

int lumi_preview_line_parse(const char *line, uint32_t *id, struct lumi_preview_gaze *gaze, struct lumi_error *error)
{
    double *const numbers[] = {&gaze->x, &gaze->y, &gaze->z, &gaze->yaw, &gaze->pitch, &gaze->fov};
    int64_t whole, width = 0, height = 0;
    const char *at = line + 4;
    bool good = strncmp(line, "view ", 5) == 0 && take_int(&at, UINT32_MAX, &whole);

    *gaze = (struct lumi_preview_gaze){0};
    *id = good ? (uint32_t)whole : 0;
    for (size_t i = 0; i < G_N_ELEMENTS(numbers); i++)
        good = good && take_double(&at, numbers[i]);
    good = good && take_int(&at, 1 << 20, &width) && take_int(&at, 1 << 20, &height) && !*at;
    if (!good)
        return lumi_fail(error, LUMI_ERR_FORMAT, "'view ID x y z yaw pitch fov width height' is wanted");
    gaze->width = (int)width;
    gaze->height = (int)height;
    return lumi_preview_gaze_check(gaze, error);
}
