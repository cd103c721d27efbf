/* A capture's grade: read from the parameters and its file, applied to views. */
#include "pipeline/color/grade.h"

#include "proto/base/file.h"
#include "proto/base/memory.h"

#include <glib.h>
#include <math.h>
#include <string.h>

static const char *const tones[] = {"auto", "none", "reinhard", "hable", NULL};

static int open_icc(const char *path, bool linear, struct lumi_icc **icc, struct lumi_error *error)
{
    uint8_t *data;
    size_t size;

    LUMI_TRY(lumi_file_read(path, 64 << 20, &data, &size, error));
    int code = lumi_icc_create(data, size, path, linear, icc, error);
    lumi_free(data);
    return code;
}

static int open_grade(const struct lumi_parameters *p, bool linear, struct lumi_grade *grade, struct lumi_error *error)
{
    int code = LUMI_OK;

    *grade = (struct lumi_grade){
        .linear = linear, .map = {.tone = LUMI_TONE_NONE, .scale = 1, .white = 1}, .has_cube = p->lut != NULL};
    for (int i = 0; i < 3; i++)
        grade->balance[i] = p->white_balance[i] > 0 ? p->white_balance[i] : 1;
    for (int i = 0; i < 9; i++) {
        grade->matrix[i] = p->color_matrix[i];
        grade->has_matrix = grade->has_matrix || p->color_matrix[i] != 0;
    }
    if (p->icc)
        code = open_icc(p->icc, linear, &grade->icc, error);
    if (code == LUMI_OK && p->lut)
        code = lumi_cube_read(p->lut, &grade->cube, error);
    if (code != LUMI_OK)
        lumi_grade_finish(grade);
    return code;
}

int lumi_grade_open(const struct lumi_run *run, bool linear, struct lumi_grade *grade, struct lumi_error *error)
{
    return open_grade(&run->parameters, linear, grade, error);
}

int lumi_grade_check(const struct lumi_parameters *parameters, struct lumi_error *error)
{
    struct lumi_grade grade;

    LUMI_TRY(open_grade(parameters, false, &grade, error));
    lumi_grade_finish(&grade);
    return LUMI_OK;
}

void lumi_grade_finish(struct lumi_grade *grade)
{
    lumi_icc_destroy(grade->icc);
    lumi_cube_finish(&grade->cube);
    *grade = (struct lumi_grade){0};
}

static void to_display(const struct lumi_grade *grade, float *pixel)
{
    const double in[3] = {(double)pixel[0], (double)pixel[1], (double)pixel[2]};

    for (int row = 0; row < 3; row++)
        pixel[row] = (float)(grade->matrix[3 * row] * in[0] + grade->matrix[3 * row + 1] * in[1] +
                             grade->matrix[3 * row + 2] * in[2]);
}

static void look_up(const struct lumi_cube *cube, float *pixel)
{
    float encoded[3], out[3];

    for (int c = 0; c < 3; c++)
        encoded[c] = lumi_srgb_encode(pixel[c]);
    lumi_cube_apply(cube, encoded, out);
    for (int c = 0; c < 3; c++)
        pixel[c] = lumi_srgb_decode(out[c]);
}

void lumi_grade_apply(const struct lumi_grade *grade, bool whole, struct lumi_raster *picture)
{
    const float *balance =
        (const float[3]){(float)grade->balance[0], (float)grade->balance[1], (float)grade->balance[2]};

    for (int y = 0; y < picture->height; y++) {
        float *row = lumi_row_f32(picture, y), *stop = row + 3 * picture->width;
        for (float *pixel = row; pixel < stop; pixel += 3) {
            for (int c = 0; c < 3; c++)
                pixel[c] = isfinite(pixel[c]) ? pixel[c] * balance[c] : 0;
            if (grade->has_matrix)
                to_display(grade, pixel);
        }
        if (grade->icc)
            lumi_icc_apply(grade->icc, row, (size_t)picture->width);
        for (float *pixel = row; whole && pixel < stop; pixel += 3) {
            lumi_tone_apply(&grade->map, pixel);
            if (grade->has_cube)
                look_up(&grade->cube, pixel);
        }
    }
}

/* The value after "KEY " of a line; NULL where the text has no such line. */
static char *value_of(char **lines, const char *key)
{
    size_t length = strlen(key);

    for (int i = 0; lines[i]; i++)
        if (!strncmp(lines[i], key, length) && lines[i][length] == ' ')
            return lines[i] + length + 1;
    return NULL;
}

static bool number_of(char **lines, const char *key, double most, double *value)
{
    char *text = value_of(lines, key), *end = NULL;

    if (!text)
        return false;
    *value = g_ascii_strtod(text, &end);
    return end != text && *end == '\0' && *value > 0 && *value <= most;
}

int lumi_grade_parse(const char *text, size_t size, const char *name, struct lumi_grade *grade,
                     struct lumi_error *error)
{
    if (size > 4096 || memchr(text, '\0', size))
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: no grade", name);
    g_autofree char *copy = g_strndup(text, size);
    g_auto(GStrv) lines = g_strsplit(copy, "\n", -1);
    const char *tone = value_of(lines, "tone"), *linear = value_of(lines, "linear");
    int choice = 0;

    if (!lines[0] || strcmp(lines[0], "lumisphere-grade 1"))
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: not \"lumisphere-grade 1\"", name);
    while (tone && tones[choice] && strcmp(tones[choice], tone))
        choice++;
    if (!tone || !tones[choice] || choice == LUMI_TONE_AUTO || !linear ||
        (strcmp(linear, "0") && strcmp(linear, "1")) || !number_of(lines, "scale", 1e12, &grade->map.scale) ||
        !number_of(lines, "white", 1e12, &grade->map.white))
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: linear, tone, scale and white are wanted", name);
    grade->map.tone = (enum lumi_tone)choice;
    grade->linear = linear[0] == '1';
    return LUMI_OK;
}

int lumi_grade_write(const char *path, const struct lumi_grade *grade, struct lumi_error *error)
{
    char scale[G_ASCII_DTOSTR_BUF_SIZE], white[G_ASCII_DTOSTR_BUF_SIZE];

    g_autofree char *text =
        g_strdup_printf("lumisphere-grade 1\nlinear %d\ntone %s\nscale %s\nwhite %s\n", grade->linear,
                        tones[grade->map.tone], g_ascii_formatd(scale, sizeof scale, "%.17g", grade->map.scale),
                        g_ascii_formatd(white, sizeof white, "%.17g", grade->map.white));
    return lumi_file_write(path, text, strlen(text), false, error);
}
