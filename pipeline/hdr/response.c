/* Camera responses: known ones, their text form, and what they make of a picture. */
#include "pipeline/hdr/response.h"

#include "proto/base/memory.h"

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char magic[] = "lumisphere-response 1";

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

static bool is_magic(const char *line)
{
    return !strncmp(line, magic, sizeof magic - 1) && line[sizeof magic - 1 + strspn(line + sizeof magic - 1, " \r")] == '\0';
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
    return line[strspn(line, " \t\r")] == '\0';
}

int lumi_response_parse(const char *text, size_t size, const char *name, struct lumi_response *response,
                        struct lumi_error *error)
{
    const char *at = text, *stop = text + size;
    char line[128];
    int row = -1;

    for (int number = 1; at < stop; number++) {
        const char *end = memchr(at, '\n', (size_t)(stop - at));
        size_t length = (size_t)((end ? end : stop) - at);
        if (length >= sizeof line || memchr(at, '\0', length))
            return lumi_fail(error, LUMI_ERR_FORMAT, "%s: line %d is none of a response", name, number);
        memcpy(line, at, length);
        line[length] = '\0';
        at = end ? end + 1 : stop;
        if (row >= 0 && (line[0] == '#' || line[strspn(line, " \t\r")] == '\0'))
            continue;
        float numbers[3] = {0, 0, 0};
        bool good = row < 0 ? is_magic(line)
                            : row < 256 && three(line, numbers);
        for (int c = 0; good && row >= 0 && c < 3; c++) {
            good = row == 0 || numbers[c] >= response->light[c][row - 1];
            response->light[c][row] = numbers[c];
        }
        if (!good)
            return lumi_fail(error, LUMI_ERR_FORMAT,
                             row < 0 ? "%s: line %d: '%s' wanted" : "%s: line %d: three numbers from 0 to 1 wanted, none "
                                                                    "below those before, 256 lines of them",
                             name, number, magic);
        row++;
    }
    if (row != 256)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: ends after %d of 256 codes", name, row < 0 ? 0 : row);
    for (int c = 0; c < 3; c++)
        if (!(response->light[c][255] > 0))
            return lumi_fail(error, LUMI_ERR_FORMAT, "%s: a channel that never sees light", name);
    return LUMI_OK;
}

int lumi_response_format(const struct lumi_response *response, char **text, struct lumi_error *error)
{
    size_t room = 256 * 64 + sizeof magic + 2, used;

    *text = lumi_alloc(room, 1);
    if (!*text)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a response");
    used = (size_t)snprintf(*text, room, "%s\n", magic);
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
