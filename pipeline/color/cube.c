/* Reading .cube files, and looking up in them. */
#include "pipeline/color/cube.h"

#include "proto/base/file.h"
#include "proto/base/memory.h"

#include <glib.h>
#include <math.h>
#include <string.h>

#define MOST_BYTES ((size_t)192 << 20)
enum { MOST_LINE = 250 };

struct reading {
    const char *name;
    struct lumi_cube *cube;
    int number; /* of the line */
    size_t points, total;
    bool domain; /* given already by DOMAIN_ or by an input range */
};

static int fail_line(const struct reading *r, int code, const char *what, struct lumi_error *error)
{
    return lumi_fail(error, code, "%s: line %d: %s", r->name, r->number, what);
}

/* `count` finite numbers and nothing else; a comma is no decimal point, whatever the language. */
static bool numbers(const char *line, int count, double *values)
{
    for (int i = 0; i < count; i++) {
        char *end;
        values[i] = g_ascii_strtod(line, &end);
        if (end == line || !(fabs(values[i]) <= 1e6))
            return false;
        line = end;
    }
    return line[strspn(line, " \t")] == '\0';
}

static int take_size(struct reading *r, const char *rest, int dimensions, struct lumi_error *error)
{
    const int limit = dimensions == 3 ? LUMI_CUBE_MOST_3D : LUMI_CUBE_MOST_1D;
    double value;

    if (r->cube->size > 0)
        return fail_line(r, LUMI_ERR_UNSUPPORTED, "a second table", error);
    if (!numbers(rest, 1, &value) || value != floor(value) || value < 2)
        return fail_line(r, LUMI_ERR_FORMAT, "a number of points, 2 and more, wanted", error);
    if (value > limit)
        return fail_line(r, LUMI_ERR_LIMIT, "more points than this program accepts", error);
    r->cube->dimensions = dimensions;
    r->cube->size = (int)value;
    r->total = dimensions == 3 ? (size_t)value * (size_t)value * (size_t)value : (size_t)value;
    r->cube->values = lumi_alloc(r->total, 3 * sizeof *r->cube->values);
    if (!r->cube->values)
        return fail_line(r, LUMI_ERR_NOMEM, "no memory for the table", error);
    return LUMI_OK;
}

static int take_domain(struct reading *r, const char *rest, float *bound, struct lumi_error *error)
{
    double values[3];

    if (!numbers(rest, 3, values))
        return fail_line(r, LUMI_ERR_FORMAT, "three numbers wanted", error);
    for (int c = 0; c < 3; c++)
        bound[c] = (float)values[c];
    return LUMI_OK;
}

static int take_range(struct reading *r, const char *rest, struct lumi_error *error)
{
    double values[2];

    if (!numbers(rest, 2, values))
        return fail_line(r, LUMI_ERR_FORMAT, "two numbers wanted", error);
    for (int c = 0; c < 3; c++) {
        r->cube->least[c] = (float)values[0];
        r->cube->most[c] = (float)values[1];
    }
    return LUMI_OK;
}

static int take_point(struct reading *r, const char *line, struct lumi_error *error)
{
    double values[3];

    if (r->total == 0)
        return fail_line(r, LUMI_ERR_FORMAT, "a point before LUT_1D_SIZE or LUT_3D_SIZE", error);
    if (r->points == r->total)
        return fail_line(r, LUMI_ERR_FORMAT, "more points than the table has", error);
    if (!numbers(line, 3, values))
        return fail_line(r, LUMI_ERR_FORMAT, "three numbers wanted", error);
    for (int c = 0; c < 3; c++)
        r->cube->values[3 * r->points + (size_t)c] = (float)values[c];
    r->points++;
    return LUMI_OK;
}

/* What stands after `keyword` and a blank; NULL where the line begins otherwise. */
static const char *after(const char *line, const char *keyword)
{
    size_t length = strlen(keyword);

    return !strncmp(line, keyword, length) && (line[length] == ' ' || line[length] == '\t') ? line + length : NULL;
}

static int take_line(struct reading *r, const char *line, struct lumi_error *error)
{
    const char *rest;

    if (line[0] == '\0' || line[0] == '#' || after(line, "TITLE"))
        return LUMI_OK;
    if (strchr("+-.0123456789", line[0]))
        return take_point(r, line, error);
    if (r->points > 0)
        return fail_line(r, LUMI_ERR_FORMAT, "a keyword among the points", error);
    if ((rest = after(line, "LUT_3D_SIZE")))
        return take_size(r, rest, 3, error);
    if ((rest = after(line, "LUT_1D_SIZE")))
        return take_size(r, rest, 1, error);
    if ((rest = after(line, "DOMAIN_MIN")))
        return take_domain(r, rest, r->cube->least, error);
    if ((rest = after(line, "DOMAIN_MAX")))
        return take_domain(r, rest, r->cube->most, error);
    if ((rest = after(line, "LUT_1D_INPUT_RANGE")) || (rest = after(line, "LUT_3D_INPUT_RANGE")))
        return take_range(r, rest, error);
    return lumi_fail(error, LUMI_ERR_UNSUPPORTED,
                     "%s: line %d: '%.*s' is no keyword of a .cube file that is known here", r->name, r->number,
                     (int)strcspn(line, " \t"), line);
}

static int take_lines(struct reading *r, const char *text, size_t size, struct lumi_error *error)
{
    char line[MOST_LINE + 1];

    for (size_t at = 0; at < size;) {
        const char *end = memchr(text + at, '\n', size - at);
        size_t length = end ? (size_t)(end - text) - at : size - at, first = at, last = at + length;
        r->number++;
        while (first < last && (text[first] == ' ' || text[first] == '\t'))
            first++;
        while (last > first && strchr(" \t\r", text[last - 1]))
            last--;
        if (last - first > MOST_LINE)
            return fail_line(r, LUMI_ERR_FORMAT, "longer than 250 characters", error);
        for (size_t i = first; i < last; i++) {
            line[i - first] = text[i];
            if ((unsigned char)text[i] < ' ' && text[i] != '\t')
                return fail_line(r, LUMI_ERR_FORMAT, "no text", error);
        }
        line[last - first] = '\0';
        LUMI_TRY(take_line(r, line, error));
        at += length + 1;
    }
    if (r->total == 0 || r->points < r->total)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: ends after %zu of %zu points", r->name, r->points, r->total);
    for (int c = 0; c < 3; c++)
        if (!(r->cube->most[c] > r->cube->least[c]))
            return lumi_fail(error, LUMI_ERR_FORMAT, "%s: its domain is empty", r->name);
    return LUMI_OK;
}

int lumi_cube_parse(const char *text, size_t size, const char *name, struct lumi_cube *cube, struct lumi_error *error)
{
    struct reading r = {.name = name, .cube = cube};

    *cube = (struct lumi_cube){.most = {1, 1, 1}};
    /* Some programs begin the file with a byte order mark. */
    size_t mark = size >= 3 && !memcmp(text, "\xef\xbb\xbf", 3) ? 3 : 0;
    int code = take_lines(&r, text + mark, size - mark, error);
    if (code != LUMI_OK)
        lumi_cube_finish(cube);
    return code;
}

int lumi_cube_read(const char *path, struct lumi_cube *cube, struct lumi_error *error)
{
    uint8_t *data;
    size_t size;

    *cube = (struct lumi_cube){0};
    LUMI_TRY(lumi_file_read(path, MOST_BYTES, &data, &size, error));
    int code = lumi_cube_parse((const char *)data, size, path, cube, error);
    lumi_free(data);
    return code;
}

void lumi_cube_finish(struct lumi_cube *cube)
{
    lumi_free(cube->values);
    *cube = (struct lumi_cube){0};
}

/* The cell a channel's value lies in, and how far. */
static int cell(const struct lumi_cube *cube, int channel, float value, float *share)
{
    float t = (value - cube->least[channel]) / (cube->most[channel] - cube->least[channel]);

    t = (t > 0 ? (t < 1 ? t : 1) : 0) * (float)(cube->size - 1); /* NaN becomes 0 */
    int low = (int)t < cube->size - 2 ? (int)t : cube->size - 2;
    *share = t - (float)low;
    return low;
}

void lumi_cube_apply(const struct lumi_cube *cube, const float in[3], float out[3])
{
    const size_t steps[3] = {3, 3 * (size_t)cube->size, 3 * (size_t)cube->size * (size_t)cube->size};
    float share[3];
    int low[3], order[3] = {0, 1, 2};

    for (int c = 0; c < 3; c++)
        low[c] = cell(cube, c, in[c], &share[c]);
    if (cube->dimensions == 1) {
        for (int c = 0; c < 3; c++) {
            const float *p = cube->values + 3 * low[c] + c;
            out[c] = p[0] + share[c] * (p[3] - p[0]);
        }
        return;
    }
    /* From the cell's first corner to its last along the channels by falling share: four corners of a tetrahedron. */
    for (int i = 0; i < 2; i++)
        for (int j = 0; j < 2 - i; j++)
            if (share[order[j]] < share[order[j + 1]]) {
                int other = order[j];
                order[j] = order[j + 1];
                order[j + 1] = other;
            }
    const float *corner =
        cube->values + (size_t)low[0] * steps[0] + (size_t)low[1] * steps[1] + (size_t)low[2] * steps[2];
    float weight = 1 - share[order[0]];
    for (int c = 0; c < 3; c++)
        out[c] = weight * corner[c];
    for (int i = 0; i < 3; i++) {
        corner += steps[order[i]];
        weight = share[order[i]] - (i < 2 ? share[order[i + 1]] : 0);
        for (int c = 0; c < 3; c++)
            out[c] += weight * corner[c];
    }
}
