/* The stage `merge`: files in and out, and what is said about each bracket. */
#include "pipeline/hdr/merge_stage.h"

#include "pipeline/hdr/brackets.h"
#include "pipeline/run/key.h"
#include "proto/base/file.h"
#include "proto/base/memory.h"
#include "proto/image/image.h"

#include <glib.h>
#include <math.h>
#include <string.h>

#define REMARK "remark: "

static bool wanted(const struct lumi_run *run, int index)
{
    if (index >= 0)
        return run->sources[index].part_count > 0;
    for (int i = 0; i < run->count; i++)
        if (run->sources[i].part_count > 0)
            return true;
    return false;
}

static bool estimated(const struct lumi_run *run)
{
    return run->parameters.response && !strcmp(run->parameters.response, "estimate");
}

/* The file that the responses are in; NULL: they are known by name. */
static char *response_file(const struct lumi_run *run)
{
    const char *response = run->parameters.response;

    if (estimated(run))
        return lumi_run_path(run, "response", -1, ".txt");
    return response && strcmp(response, "srgb") && strcmp(response, "linear") ? g_strdup(response) : NULL;
}

static int key(struct lumi_run *run, int index, struct lumi_key *k, struct lumi_error *error)
{
    const struct lumi_source *source = &run->sources[index];
    const char *response = run->parameters.response;
    g_autofree char *file = response_file(run);
    struct lumi_brackets brackets;
    uint8_t *data;
    size_t size;

    lumi_brackets_find(run, &brackets);
    lumi_key_double(k, brackets.nominal);
    lumi_key_bytes(k, brackets.offsets, sizeof *brackets.offsets * (size_t)brackets.offset_count);
    lumi_key_int(k, source->part_count);
    lumi_key_white(k, source);
    for (int i = 0; i < source->part_count; i++) {
        const struct lumi_source_part *part = &source->parts[i];
        lumi_key_bytes(k, part->sha256, strlen(part->sha256));
        lumi_key_double(k, part->exposure_s);
        lumi_key_double(k, part->iso);
        lumi_key_double(k, part->exposure_offset);
    }
    if (estimated(run)) {
        lumi_key_input(k, run, "response", -1);
    } else if (file) {
        LUMI_TRY(lumi_file_read(file, 1 << 22, &data, &size, error));
        lumi_key_bytes(k, data, size);
        lumi_free(data);
    } else {
        lumi_key_int(k, response && !strcmp(response, "linear"));
    }
    return LUMI_OK;
}

struct state {
    struct lumi_brackets brackets;
    uint8_t *text; /* of the responses; NULL: `known` is everybody's */
    size_t size;
    char *file;
    struct lumi_response known;
};

static void end(struct lumi_run *run, void *pointer)
{
    struct state *state = pointer;
    g_autofree char *remarks = lumi_merge_remarks(run);
    g_autofree char *path = g_build_filename(run->work, "merge", "report.txt", NULL);

    /* A report that cannot be written is told by the next step that cannot either. */
    lumi_file_write(path, remarks, strlen(remarks), false, NULL);
    if (state) {
        lumi_free(state->text);
        g_free(state->file);
        g_free(state);
    }
}

static int begin(struct lumi_run *run, void **pointer, struct lumi_error *error)
{
    struct state *state = g_new0(struct state, 1);
    int code = LUMI_OK;

    lumi_brackets_find(run, &state->brackets);
    state->file = response_file(run);
    if (run->parameters.response && !strcmp(run->parameters.response, "linear"))
        lumi_response_linear(&state->known);
    else
        lumi_response_srgb(&state->known);
    if (state->file)
        code = lumi_file_read(state->file, 1 << 22, &state->text, &state->size, error);
    *pointer = state;
    if (code != LUMI_OK) {
        g_free(state->file);
        g_free(state);
        *pointer = NULL;
    }
    return code;
}

static float quantum_of(enum lumi_sample sample)
{
    return sample == LUMI_U8 ? 1.0f / 255 : sample == LUMI_U16 ? 1.0f / 65535 : 0;
}

/* Which of a source's parts became which shot. */
struct bracket {
    struct lumi_shot shots[LUMI_SHOTS_MAX];
    int part_of[LUMI_SHOTS_MAX];
    int count;
    bool reported;
    GString *text, *remarks;
};

static int read_part(const struct lumi_source *source, int part, const struct lumi_response *response,
                     struct lumi_shot *shot, struct lumi_error *error)
{
    const char *path = source->parts[part].path;
    struct lumi_raster picture;

    LUMI_TRY(lumi_source_read(source, path, &picture, error));
    int code = LUMI_OK;
    if (picture.width != source->lens.width || picture.height != source->lens.height)
        code = lumi_fail(error, LUMI_ERR_FORMAT, "%s: the image is %d × %d, its camera %d × %d", path, picture.width,
                         picture.height, source->lens.width, source->lens.height);
    if (code == LUMI_OK)
        code = lumi_response_apply(response, &picture, &shot->light, error);
    shot->quantum = quantum_of(picture.sample);
    lumi_raster_finish(&picture);
    return code;
}

/* A shot whose file is damaged or of another size is left out; without memory nothing goes on. */
static int read_parts(const struct lumi_source *source, const struct state *state, struct bracket *bracket,
                      struct lumi_error *error)
{
    g_autofree double *exposures = g_new0(double, source->part_count);
    struct lumi_response response = state->known;
    struct lumi_error why = {0};

    if (state->text)
        LUMI_TRY(lumi_response_parse((const char *)state->text, state->size, state->file, source->camera_name,
                                     &response, error));
    lumi_bracket_exposures(source, &state->brackets, exposures, &bracket->reported);
    for (int i = 0; i < source->part_count && bracket->count < LUMI_SHOTS_MAX; i++) {
        struct lumi_shot *shot = &bracket->shots[bracket->count];
        int code = read_part(source, i, &response, shot, &why);
        if (code == LUMI_ERR_NOMEM) {
            if (error)
                *error = why;
            return code;
        }
        if (code != LUMI_OK) {
            g_string_append_printf(bracket->remarks, REMARK "%s: a shot is left out: %s\n", source->name, why.text);
            continue;
        }
        shot->exposure = exposures[i];
        bracket->part_of[bracket->count++] = i;
    }
    if (bracket->count == 0)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: none of its %d shots can be used: %s", source->name,
                         source->part_count, why.text);
    return LUMI_OK;
}

static void say_shot(const struct lumi_source *source, const struct bracket *bracket, int k,
                     const struct lumi_merge_report *report)
{
    const struct lumi_shot_report *shot = &report->shots[k];
    const double reference = report->shots[report->reference].exposure;
    g_autofree char *file = g_path_get_basename(source->parts[bracket->part_of[k]].path);
    GString *remarks = bracket->remarks;

    g_string_append_printf(bracket->text,
                           "%s: %+.2f stops (asked for %+.2f)%s, moved by %.2f %.2f pixels, %.2f %% shows something "
                           "else\n",
                           file, log2(shot->exposure / reference), source->parts[bracket->part_of[k]].exposure_offset,
                           k == report->reference ? ", the reference" : "", shot->shift.x, shot->shift.y,
                           100 * shot->ghosts);
    if (shot->fate == LUMI_SHOT_BLACK)
        g_string_append_printf(remarks, REMARK "%s: %s is black, and left out\n", source->name, file);
    if (shot->fate == LUMI_SHOT_WHITE)
        g_string_append_printf(remarks, REMARK "%s: %s is white, and left out\n", source->name, file);
    if (shot->guessed && k != report->reference)
        g_string_append_printf(remarks,
                               REMARK "%s: the exposure of %s is not known; by the pictures it is %+.2f stops\n",
                               source->name, file, log2(shot->exposure / reference));
    if (shot->contrary)
        g_string_append_printf(
            remarks, REMARK "%s: %s: exposed by %+.2f stops %s, by the pictures by %+.2f: is its time right?\n",
            source->name, file, log2(shot->exposure / reference), bracket->reported ? "as reported" : "as asked for",
            log2(shot->measured));
    if (fabs(shot->shift.x) > 0.5 || fabs(shot->shift.y) > 0.5)
        g_string_append_printf(remarks,
                               REMARK "%s: %s was taken %.1f, %.1f pixels aside, which is compensated: does "
                                      "the rig stand still?\n",
                               source->name, file, shot->shift.x, shot->shift.y);
    if (shot->ghosts > 0.25)
        g_string_append_printf(remarks, REMARK "%s: %.0f %% of %s show something else than the middle shot\n",
                               source->name, 100 * shot->ghosts, file);
}

/* Exposures that most brackets have and this one has not. */
static void say_missing(const struct lumi_source *source, const struct lumi_brackets *brackets, GString *remarks)
{
    g_autoptr(GString) missing = g_string_new(NULL);

    for (int i = 0; i < brackets->offset_count; i++) {
        bool there = false;
        for (int k = 0; k < source->part_count; k++)
            there = there || source->parts[k].exposure_offset == brackets->offsets[i];
        if (!there)
            g_string_append_printf(missing, "%s%+g", missing->len ? ", " : "", brackets->offsets[i]);
    }
    if (missing->len)
        g_string_append_printf(remarks, REMARK "%s: the shot of %s stops is missing; merged without it\n", source->name,
                               missing->str);
}

static int write_report(struct lumi_run *run, int index, struct bracket *bracket,
                        const struct lumi_merge_report *report, const struct lumi_brackets *brackets,
                        struct lumi_error *error)
{
    const struct lumi_source *source = &run->sources[index];
    g_autofree char *path = lumi_run_path(run, "merge", index, ".txt");

    for (int k = 0; k < bracket->count; k++)
        say_shot(source, bracket, k, report);
    say_missing(source, brackets, bracket->remarks);
    g_string_append_printf(bracket->text, "%s; %.2f %% clipped in every shot\n",
                           bracket->reported ? "exposures as the camera reported them"
                                             : "exposures as asked for: the camera did not report them",
                           100 * report->clipped);
    g_string_append(bracket->text, bracket->remarks->str);
    return lumi_file_write(path, bracket->text->str, bracket->text->len, false, error);
}

static int make(struct lumi_run *run, void *pointer, int index, int thread, const char *path, struct lumi_error *error)
{
    const struct state *state = pointer;
    struct bracket bracket = {.text = g_string_new(NULL), .remarks = g_string_new(NULL)};
    struct lumi_merge_options options;
    struct lumi_image_options image;
    struct lumi_merge_report report;
    struct lumi_raster merged = {0};
    int code;

    (void)thread;
    lumi_merge_options_init(&options);
    options.nominal = state->brackets.nominal;
    LUMI_GOTO(code, done, read_parts(&run->sources[index], state, &bracket, error));
    LUMI_GOTO(code, done, lumi_merge(bracket.shots, bracket.count, &options, &merged, &report, error));
    LUMI_GOTO(code, done, write_report(run, index, &bracket, &report, &state->brackets, error));
    lumi_image_options_init(&image);
    image.format = LUMI_IMAGE_EXR;
    image.half = true;
    code = lumi_image_write(path, &merged, &image, error);
done:
    for (int i = 0; i < LUMI_SHOTS_MAX; i++)
        lumi_raster_finish(&bracket.shots[i].light);
    lumi_raster_finish(&merged);
    g_string_free(bracket.text, TRUE);
    g_string_free(bracket.remarks, TRUE);
    return code;
}

char *lumi_merge_remarks(const struct lumi_run *run)
{
    GString *remarks = g_string_new(NULL);

    for (int i = 0; i < run->count; i++) {
        g_autofree char *path = lumi_run_path(run, "merge", i, ".txt");
        g_autofree char *text = NULL;
        if (run->sources[i].part_count == 0 || !g_file_get_contents(path, &text, NULL, NULL))
            continue;
        g_auto(GStrv) lines = g_strsplit(text, "\n", -1);
        for (int line = 0; lines[line]; line++)
            if (g_str_has_prefix(lines[line], REMARK))
                g_string_append_printf(remarks, "%s\n", lines[line] + strlen(REMARK));
    }
    return g_string_free(remarks, FALSE);
}

const struct lumi_stage lumi_stage_merge = {
    .name = "merge",
    .title = "merging brackets",
    .version = 1,
    .extension = ".exr",
    .set = LUMI_SET_FRAMES,
    .wanted = wanted,
    .key = key,
    .begin = begin,
    .end = end,
    .make = make,
    .bytes_per_pixel = 110,
};
