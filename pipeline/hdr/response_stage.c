/* The stage `response`: every camera's response, from a few of its own brackets. */
#include "pipeline/hdr/brackets.h"
#include "pipeline/hdr/merge_stage.h"
#include "pipeline/run/key.h"
#include "proto/base/file.h"
#include "proto/base/memory.h"
#include "proto/image/image.h"

#include <glib.h>
#include <math.h>
#include <string.h>

enum { BRACKETS = 8, COLUMNS = 32, ROWS = 24, FLAT = 10 };

static bool wanted(const struct lumi_run *run, int index)
{
    bool brackets = false;

    (void)index;
    for (int i = 0; i < run->count; i++)
        brackets = brackets || run->sources[i].part_count > 1;
    return brackets && run->parameters.response && !strcmp(run->parameters.response, "estimate");
}

static int camera_count(const struct lumi_run *run)
{
    int count = 0;

    for (int i = 0; i < run->count; i++)
        count = MAX(count, run->sources[i].camera + 1);
    return count;
}

/* Up to BRACKETS of a camera's brackets, evenly from all. Returns how many. */
static int choose(const struct lumi_run *run, int camera, int chosen[BRACKETS])
{
    int all = 0, at = 0, count = 0;

    for (int i = 0; i < run->count; i++)
        all += run->sources[i].camera == camera && run->sources[i].part_count > 1;
    for (int i = 0; i < run->count && count < BRACKETS; i++)
        if (run->sources[i].camera == camera && run->sources[i].part_count > 1) {
            /* Number `at` of `all` is the first of its share. */
            if (all <= BRACKETS || at * BRACKETS / all != (at - 1) * BRACKETS / all || at == 0)
                chosen[count++] = i;
            at++;
        }
    return count;
}

static int key(struct lumi_run *run, int index, struct lumi_key *k, struct lumi_error *error)
{
    int chosen[BRACKETS];

    (void)index;
    (void)error;
    for (int camera = 0; camera < camera_count(run); camera++) {
        int count = choose(run, camera, chosen);
        for (int i = 0; i < count; i++) {
            const struct lumi_source *source = &run->sources[chosen[i]];
            lumi_key_bytes(k, source->camera_name, strlen(source->camera_name) + 1);
            for (int part = 0; part < source->part_count; part++) {
                lumi_key_bytes(k, source->parts[part].sha256, strlen(source->parts[part].sha256));
                lumi_key_double(k, source->parts[part].exposure_s);
                lumi_key_double(k, source->parts[part].iso);
                lumi_key_double(k, source->parts[part].exposure_offset);
            }
        }
    }
    return LUMI_OK;
}

/* The codes of 3 × 3 pixels: their mean; false where they are not flat. */
static bool sample(const struct lumi_raster *picture, int x, int y, uint8_t code[3])
{
    for (int c = 0; c < 3; c++) {
        int least = 255, most = 0, sum = 0;
        for (int i = 0; i < 9; i++) {
            int z = lumi_row_u8(picture, y - 1 + i / 3)[3 * (x - 1 + i % 3) + c];
            least = MIN(least, z);
            most = MAX(most, z);
            sum += z;
        }
        if (most - least > FLAT)
            return false;
        code[c] = (uint8_t)((sum + 4) / 9);
    }
    return true;
}

/* Whether more light gave no lower codes: otherwise something moved, or a shot is not what it says. */
static bool rises(const struct lumi_response_sample *samples, int count)
{
    for (int i = 0; i < count; i++)
        for (int j = 0; j < count; j++)
            for (int c = 0; c < 3; c++)
                if (samples[i].log_exposure > samples[j].log_exposure && samples[i].code[c] + 3 < samples[j].code[c])
                    return false;
    return true;
}

static void add_samples(const struct lumi_raster *pictures, const double *exposures, int count, int *places,
                        GArray *samples)
{
    const int width = pictures[0].width, height = pictures[0].height;

    for (int place = 0; place < COLUMNS * ROWS; place++) {
        int x = (place % COLUMNS * 2 + 1) * width / (2 * COLUMNS), y = (place / COLUMNS * 2 + 1) * height / (2 * ROWS);
        struct lumi_response_sample rows[LUMI_SHOTS_MAX];
        bool good = x > 0 && y > 0 && x < width - 1 && y < height - 1;
        for (int k = 0; good && k < count; k++) {
            rows[k].place = *places;
            rows[k].log_exposure = (float)log(exposures[k]);
            good = sample(&pictures[k], x, y, rows[k].code);
        }
        if (!good || !rises(rows, count))
            continue;
        g_array_append_vals(samples, rows, (guint)count);
        (*places)++;
    }
}

/* One bracket; shots that cannot be read, are not of 8 bits or not of the others' size are passed over. */
static int look_at(const struct lumi_source *source, const struct lumi_brackets *brackets, int *places, GArray *samples,
                   struct lumi_error *error)
{
    struct lumi_raster pictures[LUMI_SHOTS_MAX] = {{0}};
    double exposures[LUMI_SHOTS_MAX];
    int count = 0, code = LUMI_OK;
    bool reported;

    g_autofree double *all = g_new0(double, source->part_count);
    lumi_bracket_exposures(source, brackets, all, &reported);
    for (int i = 0; code != LUMI_ERR_NOMEM && i < source->part_count && count < LUMI_SHOTS_MAX; i++) {
        struct lumi_raster *picture = &pictures[count];
        code = lumi_image_read(source->parts[i].path, 3, picture, NULL, error);
        if (code != LUMI_OK)
            continue;
        if (!(all[i] > 0) || picture->sample != LUMI_U8 || picture->width != source->lens.width ||
            picture->height != source->lens.height)
            lumi_raster_finish(picture);
        else
            exposures[count++] = all[i];
    }
    if (code != LUMI_ERR_NOMEM && count > 1)
        add_samples(pictures, exposures, count, places, samples);
    for (int i = 0; i < LUMI_SHOTS_MAX; i++)
        lumi_raster_finish(&pictures[i]);
    return code == LUMI_ERR_NOMEM ? code : LUMI_OK;
}

static int add_camera(const struct lumi_run *run, int camera, const struct lumi_brackets *brackets, GString *text,
                      struct lumi_error *error)
{
    g_autoptr(GArray) samples = g_array_new(FALSE, FALSE, sizeof(struct lumi_response_sample));
    struct lumi_response response;
    struct lumi_error why = {0};
    int chosen[BRACKETS], places = 0, count = choose(run, camera, chosen);
    char *table;

    if (count == 0)
        return LUMI_OK;
    for (int i = 0; i < count; i++)
        LUMI_TRY(look_at(&run->sources[chosen[i]], brackets, &places, samples, error));
    int code = lumi_response_estimate((struct lumi_response_sample *)(void *)samples->data, (int)samples->len,
                                      &response, &why);
    const char *name = run->sources[chosen[0]].camera_name;
    if (code == LUMI_ERR_NOMEM)
        return lumi_fail(error, code, "%s", why.text);
    if (code != LUMI_OK) {
        g_string_append_printf(text, "# %s: %s; sRGB is taken\n", name, why.text);
        lumi_response_srgb(&response);
    } else {
        g_string_append_printf(text, "# %s: from %d places in %d brackets\n", name, places, count);
    }
    LUMI_TRY(lumi_response_format(&response, name, &table, error));
    g_string_append(text, table);
    lumi_free(table);
    return LUMI_OK;
}

static int make(struct lumi_run *run, void *state, int index, int thread, const char *path, struct lumi_error *error)
{
    g_autoptr(GString) text = g_string_new(LUMI_RESPONSE_HEAD);
    struct lumi_brackets brackets;

    (void)state;
    (void)index;
    (void)thread;
    lumi_brackets_find(run, &brackets);
    for (int camera = 0; camera < camera_count(run); camera++)
        LUMI_TRY(add_camera(run, camera, &brackets, text, error));
    return lumi_file_write(path, text->str, text->len, false, error);
}

const struct lumi_stage lumi_stage_response = {
    .name = "response",
    .title = "camera responses",
    .version = 1,
    .extension = ".txt",
    .whole = true,
    .set = LUMI_SET_FRAMES,
    .wanted = wanted,
    .key = key,
    .make = make,
};
