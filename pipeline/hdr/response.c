/* Camera responses: known ones, their text form, and what they make of a picture. */
#include "pipeline/hdr/response.h"

#include "proto/base/memory.h"

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void lumi_response_srgb(struct lumi_response *response)
{
    for (int c = 0; c < 3; c++)
        for (int z = 0; z < 256; z++)
            response->light[c][z] = lumi_srgb_decode((float)z / 255);
}

void lumi_response_linear(struct lumi_response *response)
{
    for (int c = 0; c < 3; c++)
        for (int z = 0; z < 256; z++)
            response->light[c][z] = (float)z / 255;
}

/* Three numbers of a line; false where there are fewer, or more than they. */
static bool three(const char *line, float numbers[3])
{
    for (int c = 0; c < 3; c++) {
        char *end;
        numbers[c] = strtof(line, &end);
        if (end == line || !(numbers[c] >= 0 && numbers[c] <= 1))
            return false;
        line = end;
    }
    return *line == '\0';
}

struct reading {
    const char *name, *camera;
    struct lumi_response table, *result;
    int number, row;  /* of the line; of the table, 256 between tables, −1 before the first line */
    bool mine, found; /* the table is the wanted camera's */
};

static int fail_line(const struct reading *r, const char *what, struct lumi_error *error)
{
    return lumi_fail(error, LUMI_ERR_FORMAT, "%s: line %d: %s", r->name, r->number, what);
}

static int take_row(struct reading *r, const char *line, struct lumi_error *error)
{
    float numbers[3];

    if (r->row == 256)
        return fail_line(r, "more than 256 codes", error);
    if (!three(line, numbers))
        return fail_line(r, "three numbers from 0 to 1 wanted", error);
    for (int c = 0; c < 3; c++) {
        if (r->row > 0 && !(numbers[c] >= r->table.light[c][r->row - 1]))
            return fail_line(r, "less light than for the code before", error);
        if (r->row == 255 && !(numbers[c] > 0))
            return fail_line(r, "a channel that never sees light", error);
        r->table.light[c][r->row] = numbers[c];
    }
    if (++r->row == 256 && r->mine && !r->found) {
        *r->result = r->table;
        r->found = true;
    }
    return LUMI_OK;
}

static int take_line(struct reading *r, const char *line, struct lumi_error *error)
{
    if (r->row < 0) {
        if (strcmp(line, "lumisphere-response 1"))
            return fail_line(r, "'lumisphere-response 1' wanted", error);
        r->row = 0;
        r->mine = true;
        return LUMI_OK;
    }
    if (line[0] == '#' || line[0] == '\0')
        return LUMI_OK;
    if (strncmp(line, "camera ", 7))
        return take_row(r, line, error);
    if (r->row != 0 && r->row != 256)
        return fail_line(r, "a camera before the 256 codes of the one before", error);
    r->row = 0;
    r->mine = !strcmp(line + 7, r->camera);
    return LUMI_OK;
}

int lumi_response_parse(const char *text, size_t size, const char *name, const char *camera,
                        struct lumi_response *response, struct lumi_error *error)
{
    struct reading r = {.name = name, .camera = camera, .result = response, .row = -1};
    char line[160];

    for (size_t at = 0; at < size;) {
        const char *end = memchr(text + at, '\n', size - at);
        size_t length = end ? (size_t)(end - text) - at : size - at, trimmed = length;
        r.number++;
        if (length >= sizeof line || memchr(text + at, '\0', length))
            return fail_line(&r, "too long, or no text", error);
        while (trimmed > 0 && strchr(" \t\r", text[at + trimmed - 1]))
            trimmed--;
        memcpy(line, text + at, trimmed);
        line[trimmed] = '\0';
        at += length + 1;
        LUMI_TRY(take_line(&r, line, error));
    }
    if (r.row != 256)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: ends after %d of 256 codes", name, r.row < 0 ? 0 : r.row);
    if (!r.found)
        return lumi_fail(error, LUMI_ERR_NOTFOUND, "%s: has no response of camera %s", name, camera);
    return LUMI_OK;
}

int lumi_response_format(const struct lumi_response *response, const char *camera, char **text,
                         struct lumi_error *error)
{
    size_t room = 256 * 64 + 256, used;

    *text = lumi_alloc(room, 1);
    if (!*text)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a response");
    used = (size_t)snprintf(*text, room, "camera %.100s\n", camera);
    for (int z = 0; z < 256; z++)
        used += (size_t)snprintf(*text + used, room - used, "%.9g %.9g %.9g\n", (double)response->light[0][z],
                                 (double)response->light[1][z], (double)response->light[2][z]);
    return LUMI_OK;
}

static float at_code(const float light[256], float code)
{
    int low = code < 255 ? (int)code : 254;

    return light[low] + (code - (float)low) * (light[low + 1] - light[low]);
}

int lumi_response_apply(const struct lumi_response *response, const struct lumi_raster *picture,
                        struct lumi_raster *linear, struct lumi_error *error)
{
    *linear = (struct lumi_raster){0};
    if (picture->channels != 3)
        return lumi_fail(error, LUMI_ERR_ARG, "a picture of %d channels, not three", picture->channels);
    if (lumi_raster_create(linear, picture->width, picture->height, 3, LUMI_F32) != LUMI_OK)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a picture");
    for (int y = 0; y < picture->height; y++) {
        float *out = lumi_row_f32(linear, y);
        if (picture->sample == LUMI_F32)
            memcpy(out, lumi_row_f32(picture, y), (size_t)picture->width * 3 * sizeof *out);
        else if (picture->sample == LUMI_U8)
            for (int i = 0; i < 3 * picture->width; i++)
                out[i] = response->light[i % 3][lumi_row_u8(picture, y)[i]];
        else
            for (int i = 0; i < 3 * picture->width; i++)
                out[i] = at_code(response->light[i % 3], (float)lumi_row_u16(picture, y)[i] / 257);
    }
    return LUMI_OK;
}
