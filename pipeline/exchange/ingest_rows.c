/* The capture of an import: lenses, cameras, positions, shots, a row for every frame, poses from the mechanism. */
#include "pipeline/exchange/ingest_film.h"

#include "proto/base/memory.h"
#include "proto/mechanism/kinematics.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#define SHAPE 0.002 /* pictures and lens are of one shape where their aspect differs by less */

void ingest_find(struct ingest *ingest, const char *kind, int camera, int64_t time_us, const char *format, ...)
{
    struct ingest_finding finding = {.camera = camera, .time_us = time_us == 0 ? LUMI_NO_TIME : time_us};
    va_list arguments;

    va_start(arguments, format);
    finding.text = g_strdup_vprintf(format, arguments);
    va_end(arguments);
    g_strlcpy(finding.kind, kind, sizeof finding.kind);
    g_array_append_val(ingest->findings, finding);
    if (ingest->options->found)
        ingest->options->found(finding.text);
}

char *ingest_shot_name(const struct ingest *ingest, int shot)
{
    int bracket = ingest->shots.bracket, position = shot / bracket;
    int turn = ingest->plan.first_turn + position / ingest->plan.positions;

    if (bracket == 1)
        return g_strdup_printf("turn %d, position %d", turn, position % ingest->plan.positions);
    return g_strdup_printf("turn %d, position %d, exposure %d of %d", turn, position % ingest->plan.positions,
                           shot % bracket + 1, bracket);
}

/* Missing shots */

static bool has_picture(const struct ingest *ingest, int camera, int shot)
{
    return ingest->cameras[camera].frames[shot].file >= 0;
}

static bool nobody_has(const struct ingest *ingest, int shot)
{
    for (int c = 0; c < ingest->camera_count; c++)
        if (ingest->cameras[c].path && has_picture(ingest, c, shot))
            return false;
    return true;
}

static void find_run(struct ingest *ingest, int camera, int first, int last, int present)
{
    const char *name = camera < 0 ? "no camera" : ingest->rig.cameras[camera].name;
    g_autofree char *from = ingest_shot_name(ingest, first), *to = ingest_shot_name(ingest, last);
    int count = last - first + 1;

    if (camera >= 0 && last == ingest->shots.shots - 1 && count > ingest->shots.bracket && present > 0)
        ingest_find(ingest, "stopped", camera, LUMI_NO_TIME,
                    "%s: stopped early: no picture of the last %d shots, from %s on (battery, card?)", name, count,
                    from);
    else if (camera >= 0 && first == 0 && count > ingest->shots.bracket && present > 0)
        ingest_find(ingest, "late", camera, LUMI_NO_TIME, "%s: began late: no picture of the first %d shots, to %s",
                    name, count, to);
    else if (count == 1)
        ingest_find(ingest, "missing", camera, LUMI_NO_TIME, "%s%s no picture of %s", name, camera < 0 ? " has" : ":",
                    from);
    else
        ingest_find(ingest, "missing", camera, LUMI_NO_TIME, "%s%s no picture of %d shots, from %s to %s", name,
                    camera < 0 ? " has" : ":", count, from, to);
}

/* Frames that are missing for a reason of their own (damaged, no folder) have been told of. */
static bool is_missing(const struct ingest *ingest, int camera, int shot)
{
    if (camera < 0)
        return nobody_has(ingest, shot);
    return !has_picture(ingest, camera, shot) && !ingest->cameras[camera].frames[shot].reason &&
           !nobody_has(ingest, shot);
}

void ingest_find_missing(struct ingest *ingest)
{
    for (int c = -1; c < ingest->camera_count; c++) {
        int present = 0;
        if (c >= 0 && !ingest->cameras[c].path)
            continue;
        for (int s = 0; s < ingest->shots.shots; s++) {
            int last = s;
            if (!is_missing(ingest, c, s)) {
                present++;
                continue;
            }
            while (last + 1 < ingest->shots.shots && is_missing(ingest, c, last + 1))
                last++;
            find_run(ingest, c, s, last, c < 0 ? 0 : MAX(present, ingest->shots.shots - 1 - last));
            s = last;
        }
    }
}

/* Lenses */

int ingest_fit_lens(struct ingest *ingest, int c, int width, int height, const char *file, struct lumi_error *error)
{
    const struct lumi_lens *lens = &ingest->rig.lenses[ingest->rig.cameras[c].lens].lens;
    double x = (double)width / lens->width, y = (double)height / lens->height;

    if (fabs(x / y - 1) > SHAPE)
        return lumi_fail(error, LUMI_ERR_FORMAT,
                         "%s: %dx%d pixels are of another shape than %s's lens in the profile, %dx%d", file, width,
                         height, ingest->rig.cameras[c].name, lens->width, lens->height);
    ingest->cameras[c].lens = *lens;
    ingest->cameras[c].lens.width = width;
    ingest->cameras[c].lens.height = height;
    ingest->cameras[c].lens.fx *= x;
    ingest->cameras[c].lens.cx *= x;
    ingest->cameras[c].lens.fy *= y;
    ingest->cameras[c].lens.cy *= y;
    return LUMI_OK;
}

static int add_cameras(struct ingest *ingest, struct lumi_capture *capture, struct lumi_error *error)
{
    int64_t ids[LUMI_RIG_CAMERAS];

    for (int c = 0; c < ingest->camera_count; c++) {
        struct ingest_camera *camera = &ingest->cameras[c];
        const struct lumi_rig_lens *profile = &ingest->rig.lenses[ingest->rig.cameras[c].lens];
        int same = 0;
        if (!camera->taking_part)
            continue;
        if (camera->lens.width == 0)
            camera->lens = profile->lens;
        while (same < c &&
               (!ingest->cameras[same].taking_part || !lumi_lens_equal(&camera->lens, &ingest->cameras[same].lens) ||
                ingest->rig.cameras[same].lens != ingest->rig.cameras[c].lens))
            same++;
        ids[c] = same < c ? ids[same] : 0;
        struct lumi_capture_lens lens = {.lens = camera->lens};
        g_strlcpy(lens.name, profile->name, sizeof lens.name);
        if (ids[c] == 0)
            LUMI_TRY(lumi_capture_add_lens(capture, &lens, &ids[c], error));
        LUMI_TRY(lumi_capture_add_camera(capture, ingest->rig.cameras[c].name, ids[c], &camera->id, error));
    }
    return LUMI_OK;
}

/* What the files say of the devices that took them. */
static int add_devices(struct ingest *ingest, struct lumi_capture *capture, struct lumi_error *error)
{
    for (int c = 0; c < ingest->camera_count; c++) {
        const struct lumi_card *card = &ingest->cameras[c].card;
        struct lumi_capture_device device = {0};
        for (int i = 0; card->files && i < (int)card->files->len && !device.model[0]; i++) {
            const struct lumi_image_meta *meta = &lumi_card_file(card, i)->meta;
            g_strlcpy(device.model, meta->model, sizeof device.model);
            g_strlcpy(device.serial, meta->serial, sizeof device.serial);
        }
        if (device.model[0])
            LUMI_TRY(lumi_capture_set_device(capture, ingest->cameras[c].id, &device, error));
    }
    return LUMI_OK;
}

/* Clocks */

static int add_clocks(struct ingest *ingest, struct lumi_capture *capture, struct lumi_error *error)
{
    const struct lumi_capture_sweep sweep = {
        .number = 0, .began_us = ingest->begin_us, .ended_us = LUMI_NO_TIME, .outcome = "imported"};

    LUMI_TRY(lumi_capture_set_sweep(capture, &sweep, error));
    for (int c = 0; c < ingest->camera_count; c++) {
        const struct lumi_shot_camera *match = &ingest->cameras[c].match;
        const struct lumi_capture_clock clock = {match->matched, match->offset, match->drift * 1e6, match->residual,
                                                 match->worst};
        if (match->matched > 0 && !match->by_order)
            LUMI_TRY(lumi_capture_set_clock(capture, 0, ingest->cameras[c].id, &clock, error));
    }
    return LUMI_OK;
}

/* Frames */

/* "DCIM/100CANON/IMG_0001.JPG", "left.mp4@12.345678"; g_free. */
static char *source_name(const struct ingest_camera *camera, const struct ingest_frame *source)
{
    if (source->file < 0)
        return NULL;
    if (!camera->video)
        return g_strdup(lumi_card_file(&camera->card, source->file)->name);
    g_autofree char *base = g_path_get_basename(camera->path);
    return g_strdup_printf("%s@%.6f", base,
                           g_array_index(camera->film->pictures, struct ingest_picture, source->file).time);
}

static int add_pose(struct ingest *ingest, struct lumi_capture *capture, int c, const struct ingest_frame *source,
                    const struct lumi_capture_position *place, int64_t frame, struct lumi_error *error)
{
    g_autofree char *origin = NULL;
    struct lumi_pose pose;

    if (isfinite(source->turns)) {
        lumi_rig_camera_pose(&ingest->rig, c, source->turns, &pose);
        origin = g_strdup_printf("the rig's profile at %.6f turns, from video", source->turns);
    } else {
        lumi_rig_camera_pose_at(&ingest->rig, c, place->turn_angle, place->drop, &pose);
    }
    return lumi_capture_set_pose(capture, frame, &pose, LUMI_POSE_PRIOR, origin ? origin : "the rig's profile", error);
}

static int add_frame(struct ingest *ingest, struct lumi_capture *capture, int c, int shot, int64_t shot_id,
                     const struct lumi_capture_position *place, struct lumi_error *error)
{
    const struct ingest_camera *camera = &ingest->cameras[c];
    const struct ingest_frame *source = &camera->frames[shot];
    int in_turn = place->number % ingest->plan.positions, bracket = ingest->shots.bracket;
    g_autofree char *original = source_name(camera, source);
    char name[LUMI_CAPTURE_NAME], suffix[16] = "";
    int64_t id;

    if (bracket > 1)
        snprintf(suffix, sizeof suffix, "-b%d", shot % bracket);
    snprintf(name, sizeof name, "c%02d-t%02d-p%03d%s", c, place->turn, in_turn, suffix);
    const struct lumi_capture_new_frame frame = {
        .name = name,
        .original = original,
        .camera = camera->id,
        .shot = shot_id,
        .row = place->turn < ingest->rig.turns ? lumi_rig_row(&ingest->rig, c, place->turn) : -1,
        .column = lumi_rig_column(&ingest->rig, c, in_turn)};
    LUMI_TRY(lumi_capture_add_frame(capture, &frame, &id, error));
    if (source->file >= 0)
        LUMI_TRY(ingest->store(ingest, capture, c, shot, id, error));
    else
        LUMI_TRY(lumi_capture_lose_frame(capture, id,
                                         source->reason ? source->reason : "the camera has no picture of it", error));
    return add_pose(ingest, capture, c, source, place, id, error);
}

static int add_position(struct ingest *ingest, struct lumi_capture *capture, int position, struct lumi_error *error)
{
    const int64_t step = lumi_plan_position_step(&ingest->plan, &ingest->rig, position);
    const double turns = lumi_rig_step_turns(&ingest->rig, step);
    const struct lumi_capture_position place = {
        .number = position,
        .turn = ingest->plan.first_turn + position / ingest->plan.positions,
        .step = step,
        .turn_angle = lumi_rig_turn_angle(&ingest->rig, turns),
        .drop = lumi_rig_drop(&ingest->rig, turns),
    };
    int64_t id, shot;

    LUMI_TRY(lumi_capture_add_position(capture, &place, &id, error));
    for (int k = 0; k < ingest->shots.bracket; k++) {
        int number = position * ingest->shots.bracket + k;
        LUMI_TRY(lumi_capture_add_shot(capture, id, k, ingest->shots.offsets[k], &shot, error));
        LUMI_TRY(lumi_capture_set_shot(capture, shot, number, 0, error));
        for (int c = 0; c < ingest->camera_count; c++)
            if (ingest->cameras[c].taking_part)
                LUMI_TRY(add_frame(ingest, capture, c, number, shot, &place, error));
        if (ingest->options->progress)
            ingest->options->progress("importing", number + 1, ingest->shots.shots);
    }
    return LUMI_OK;
}

static int add_white(const struct ingest *ingest, struct lumi_capture *capture, struct lumi_error *error)
{
    char numbers[3][G_ASCII_DTOSTR_BUF_SIZE];

    if (!(ingest->white[1] > 0))
        return LUMI_OK;
    for (int c = 0; c < 3; c++)
        g_ascii_dtostr(numbers[c], sizeof numbers[c], ingest->white[c]);
    g_autofree char *white = g_strdup_printf("%s,%s,%s", numbers[0], numbers[1], numbers[2]);
    return lumi_capture_set_meta(capture, "white balance", white, error);
}

static int add_texts(struct ingest *ingest, struct lumi_capture *capture, struct lumi_error *error)
{
    char *text = lumi_alloc(LUMI_RIG_TEXT_MAX + 1, 1);
    g_autofree char *source = g_strdup_printf("import %s", ingest->what);

    if (!text)
        return lumi_fail(error, LUMI_ERR_NOMEM, "the rig's profile: out of memory");
    lumi_rig_print(ingest->options->rig, text, LUMI_RIG_TEXT_MAX + 1);
    int code = lumi_capture_set_profile(capture, text, error);
    lumi_free(text);
    LUMI_TRY(code);
    LUMI_TRY(lumi_capture_set_meta(capture, "source", source, error));
    LUMI_TRY(lumi_capture_set_meta(capture, "software", "lumi " LUMI_VERSION, error));
    LUMI_TRY(lumi_capture_set_meta(capture, "surface", "sphere", error));
    return ingest->options->date ? lumi_capture_set_meta(capture, "created", ingest->options->date, error) : LUMI_OK;
}

int ingest_write(struct ingest *ingest, struct lumi_capture *capture, struct lumi_error *error)
{
    LUMI_TRY(lumi_capture_begin(capture, error));
    LUMI_TRY(add_texts(ingest, capture, error));
    LUMI_TRY(add_white(ingest, capture, error));
    LUMI_TRY(add_cameras(ingest, capture, error));
    LUMI_TRY(add_devices(ingest, capture, error));
    LUMI_TRY(add_clocks(ingest, capture, error));
    for (int p = 0; p < ingest->plan.positions * ingest->plan.turns; p++)
        LUMI_TRY(add_position(ingest, capture, p, error));
    for (guint i = 0; i < ingest->findings->len; i++) {
        const struct ingest_finding *finding = &g_array_index(ingest->findings, struct ingest_finding, i);
        struct lumi_capture_incident incident = {
            .time_us = finding->time_us, .camera = finding->camera < 0 ? 0 : ingest->cameras[finding->camera].id};
        g_strlcpy(incident.kind, finding->kind, sizeof incident.kind);
        g_strlcpy(incident.text, finding->text, sizeof incident.text);
        LUMI_TRY(lumi_capture_add_incident(capture, &incident, error));
    }
    return lumi_capture_commit(capture, error);
}
