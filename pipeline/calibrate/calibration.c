/* A capture's calibration: the bundle made, solved, judged. */
#include "pipeline/calibrate/calibration.h"

#include "pipeline/calibrate/rotation.h"
#include "proto/mechanism/kinematics.h"

#include <stdarg.h>
#include <string.h>

#define FEWEST_SEEN 12 /* observations that a pose of six numbers is taken from */

void lumi_calibration_find(struct lumi_calibration *c, int frames_lost, const char *what, const char *format, ...)
{
    struct lumi_finding finding = {.frames_lost = frames_lost};
    va_list arguments;

    g_strlcpy(finding.what, what, sizeof finding.what);
    va_start(arguments, format);
    g_vsnprintf(finding.text, sizeof finding.text, format, arguments);
    va_end(arguments);
    g_array_append_val(c->findings, finding);
}

void lumi_calibration_drop(struct lumi_calibration *c, int frame, const char *format, ...)
{
    struct lumi_frame_outcome *outcome = &c->frames[frame];
    va_list arguments;

    if (!outcome->used)
        return;
    outcome->used = false;
    va_start(arguments, format);
    g_vsnprintf(outcome->why, sizeof outcome->why, format, arguments);
    va_end(arguments);
}

int lumi_calibration_rig_camera(const struct lumi_run *run, int frame)
{
    for (int i = 0; run->rig && i < run->rig->camera_count; i++)
        if (!strcmp(run->rig->cameras[i].name, run->sources[frame].camera_name))
            return i;
    return -1;
}

/* One lens of the bundle for each of the capture, whose numbers frames share. */
static void take_lenses(const struct lumi_run *run, struct lumi_calibration *c)
{
    g_autofree int *slot = g_new(int, (gsize)run->count);

    c->lenses = g_new0(struct lumi_lens_outcome, (gsize)run->count);
    for (int i = 0; i < run->count; i++) {
        const struct lumi_source *source = &run->sources[i];
        int lens = 0;
        while (lens < c->lens_count &&
               (slot[lens] != source->lens_slot || !lumi_lens_equal(&c->lenses[lens].before, &source->lens)))
            lens++;
        if (lens == c->lens_count) {
            slot[c->lens_count++] = source->lens_slot;
            c->lenses[lens].before = c->lenses[lens].after = source->lens;
            g_strlcpy(c->lenses[lens].name, source->camera_name, sizeof c->lenses[lens].name);
        }
        c->lens_of[i] = lens;
        c->lenses[lens].frames++;
    }
}

/* How well a lens is known that came with a calibration; where the whole does not agree, it is known less. */
static void set_lens_sigmas(struct lumi_bundle_lens *l, double looser)
{
    const double focal = 0.001 * l->lens.fx, centre = 0.001 * l->lens.width;
    const double sigmas[LUMI_LENS_NUMBERS] = {focal, focal, centre, centre, 0.002,
                                              0.002, 0.001, 0.0005, 0.0005, 0.0005};

    for (int i = 0; i < LUMI_LENS_NUMBERS; i++)
        l->sigma[i] = lumi_lens_has(&l->lens, (enum lumi_lens_number)i) ? looser * sigmas[i] : 0;
}

static int make_bundle(const struct lumi_run *run, const struct lumi_tracks *tracks, const struct lumi_calibration *c,
                       struct lumi_bundle *b, struct lumi_error *error)
{
    LUMI_TRY(lumi_bundle_init(b, c->lens_count, run->count, tracks->track_count, tracks->observation_count, error));
    for (int i = 0; i < c->lens_count; i++) {
        b->lenses[i].lens = c->lenses[i].before;
        set_lens_sigmas(&b->lenses[i], 1);
    }
    for (int i = 0; i < run->count; i++) {
        struct lumi_bundle_camera *camera = &b->cameras[i];
        camera->lens = c->lens_of[i];
        camera->pose = camera->prior = run->sources[i].prior;
        camera->used = c->frames[i].used;
    }
    int count = 0;
    for (int i = 0; i < tracks->track_count; i++) {
        b->first[i] = count;
        for (int k = 0; k < tracks->tracks[i].count; k++) {
            const struct lumi_observation *o = &tracks->observations[tracks->tracks[i].first + k];
            b->observations[count++] = (struct lumi_bundle_observation){
                .camera = o->image, .point = i, .x = o->x, .y = o->y, .sigma = o->sigma};
        }
    }
    b->first[tracks->track_count] = b->observation_count = count;
    return LUMI_OK;
}

/* Whether the capture's poses are those of its rig, as far as that is unsure; otherwise there is no mechanism to it. */
static int make_mechanism(const struct lumi_run *run, struct lumi_calibration *c, struct lumi_error *error)
{
    int shots = 0, near = 0, known = 0;

    if (!run->rig)
        return LUMI_OK;
    for (int i = 0; i < run->count; i++)
        shots = MAX(shots, run->sources[i].position + 1);
    LUMI_TRY(lumi_mechanism_init(&c->mechanism, run->rig, run->count, shots, error));
    for (int i = 0; i < run->count; i++) {
        const struct lumi_source *source = &run->sources[i];
        const struct lumi_rig *rig = run->rig;
        struct lumi_pose nominal;
        double turns = rig->direction * (source->turn_angle - rig->index) / (2 * LUMI_PI);
        c->mechanism.frames[i] = (struct lumi_mechanism_frame){lumi_calibration_rig_camera(run, i), source->position,
                                                               source->turn_angle, source->drop, turns};
        if (source->position < 0)
            c->mechanism.frames[i].camera = -1;
        if (c->mechanism.frames[i].camera < 0)
            continue;
        known++;
        lumi_mechanism_pose(&c->mechanism, i, &nominal);
        near += lumi_length(lumi_sub(nominal.t, source->prior.t)) < 5 * fmax(rig->uncertainty.position_m, 1e-3) &&
                lumi_rotation_angle(nominal.r, source->prior.r) < 5 * fmax(rig->uncertainty.rotation, 1e-3);
    }
    c->has_mechanism = known > 0 && near > 0.9 * known;
    if (!c->has_mechanism)
        lumi_calibration_find(c, 0, "rig",
                              "the capture's poses are not those of its rig profile (%d of %d are): every camera is "
                              "found by itself",
                              near, known);
    return LUMI_OK;
}

/* Frames with too little to stand on, until none is left. */
static bool drop_blind(struct lumi_bundle *b, struct lumi_calibration *c)
{
    g_autofree int *seen = g_new0(int, (gsize)b->camera_count);
    bool any = false;

    for (int i = 0; i < b->observation_count; i++)
        seen[b->observations[i].camera] += lumi_bundle_counts(b, i);
    for (int i = 0; i < b->camera_count; i++)
        if (b->cameras[i].used && seen[i] < FEWEST_SEEN) {
            lumi_calibration_drop(c, i, "only %d points in common with its neighbours that agree", seen[i]);
            b->cameras[i].used = false;
            any = true;
        }
    return any;
}

static int used_frames(const struct lumi_calibration *c)
{
    int used = 0;

    for (int i = 0; i < c->frame_count; i++)
        used += c->frames[i].used;
    return used;
}

/* A lens that left what was known of it by more than this many sigmas is not known; none is where a good part of all
 * that was seen does not agree. */
#define LENS_BEYOND 4
#define LENS_OUTLIERS 0.35
#define SHUTTER_SIGMA 0.02 /* radians the rig turns while a picture is read: 1/30 s of a turn of 12 s */
#define LENS_LOOSER 40

/* Which lenses do not fit as they were given. */
static int find_unfit_lenses(const struct lumi_bundle *b, bool *unfit)
{
    int count = 0, all = 0, out = 0;

    for (int k = 0; k < b->observation_count; k++)
        if (b->cameras[b->observations[k].camera].used) {
            all++;
            out += b->observations[k].outlier;
        }
    for (int i = 0; i < b->lens_count; i++) {
        unfit[i] = out > LENS_OUTLIERS * all;
        for (int k = LUMI_LENS_FX; k <= LUMI_LENS_CY; k++)
            unfit[i] |= fabs(b->lenses[i].block[k]) > LENS_BEYOND;
        count += unfit[i];
    }
    return count;
}

/* Everything once more from its prior, with the lenses that did not fit known badly. */
static int solve_lenses_too(const struct lumi_run *run, struct lumi_bundle *b, struct lumi_calibration *c,
                            const bool *unfit, const struct lumi_solve_settings *settings, struct lumi_error *error)
{
    struct lumi_solve_settings loose = *settings;

    loose.lenses_first = true;
    for (int i = 0; i < b->lens_count; i++) {
        memset(b->lenses[i].block, 0, sizeof b->lenses[i].block);
        c->lenses[i].self_calibrated = unfit[i];
        if (unfit[i])
            set_lens_sigmas(&b->lenses[i], LENS_LOOSER);
    }
    for (int i = 0; i < b->camera_count; i++)
        b->cameras[i].pose = b->cameras[i].prior = run->sources[i].prior;
    for (int i = 0; i < b->observation_count; i++)
        b->observations[i].outlier = false;
    if (c->has_mechanism)
        lumi_mechanism_reset(&c->mechanism);
    LUMI_TRY(lumi_solve(b, c->has_mechanism ? &c->mechanism : NULL, &loose, &c->solved, error));
    for (int i = 0; i < c->lens_count; i++) {
        g_autofree char *what = g_strdup_printf("lens of camera %s", c->lenses[i].name);
        double focal = c->lenses[i].before.fx + b->lenses[i].sigma[LUMI_LENS_FX] * b->lenses[i].block[LUMI_LENS_FX];
        if (unfit[i])
            lumi_calibration_find(c, 0, what,
                                  "did not fit as it was given and was found from this capture itself (focal length "
                                  "%.2f, now %.2f pixels): its distortion is only as good as the picture is covered; "
                                  "a board tells it better (lumi calibrate lens)",
                                  c->lenses[i].before.fx, focal);
    }
    return LUMI_OK;
}

/* What lumi_solve hands back to us. */
struct refine_context {
    const struct lumi_run *run;
    struct lumi_calibration *c;
};

static int refine(void *context, struct lumi_bundle *b, struct lumi_error *error)
{
    const struct refine_context *r = context;

    return lumi_refine(r->run, b, &r->c->refined, error);
}

static int solve(const struct lumi_run *run, bool pictures, struct lumi_bundle *b, struct lumi_calibration *c,
                 struct lumi_error *error)
{
    struct refine_context context = {run, c};
    struct lumi_mechanism *mechanism = c->has_mechanism ? &c->mechanism : NULL;
    const struct lumi_rig_uncertainty *u = run->rig ? &run->rig->uncertainty : NULL;
    const struct lumi_solve_settings settings = {.lenses = true,
                                                 .shutter = run->parameters.rolling_shutter,
                                                 .refine = pictures ? refine : NULL,
                                                 .context = &context,
                                                 .position_sigma = u ? fmax(u->position_m, 1e-4) : 0.005,
                                                 .rotation_sigma = u ? fmax(u->rotation, 1e-4) : LUMI_PI / 360};

    b->shutter_sigma = settings.shutter ? SHUTTER_SIGMA : 0;
    lumi_bundle_triangulate(b, 2);
    drop_blind(b, c);
    if (used_frames(c) < 3)
        return lumi_fail(error, LUMI_ERR_FORMAT,
                         "%s: calibration: %d of its %d pictures share points with their neighbours: nothing to "
                         "calibrate from; are the poses (rig profile) and lenses right, and the pictures sharp? "
                         "--calibrate no takes the poses as they are",
                         run->capture, used_frames(c), run->count);
    LUMI_TRY(lumi_solve(b, mechanism, &settings, &c->solved, error));
    g_autofree bool *unfit = g_new0(bool, (gsize)b->lens_count);
    if (find_unfit_lenses(b, unfit) > 0)
        return solve_lenses_too(run, b, c, unfit, &settings, error);
    return LUMI_OK;
}

static void judge_frames(const struct lumi_run *run, struct lumi_bundle *b, struct lumi_calibration *c)
{
    double sum = 0;
    int count = 0;

    c->shutter = b->shutter;
    for (int i = 0; i < b->observation_count; i++) {
        const struct lumi_bundle_observation *o = &b->observations[i];
        struct lumi_frame_outcome *f = &c->frames[o->camera];
        double squared = o->residual[0] * o->residual[0] + o->residual[1] * o->residual[1];
        if (!lumi_bundle_counts(b, i) || !isfinite(squared))
            continue;
        f->seen++;
        f->rms += squared;
        f->worst = fmax(f->worst, sqrt(squared));
        sum += squared;
        count++;
    }
    c->rms = count ? sqrt(sum / count) : 0;
    for (int i = 0; i < c->frame_count; i++) {
        struct lumi_frame_outcome *f = &c->frames[i];
        const struct lumi_pose *prior = &run->sources[i].prior;
        struct lumi_pose mechanism;
        f->rms = f->seen ? sqrt(f->rms / f->seen) : 0;
        c->poses[i] = f->used ? b->cameras[i].pose : *prior;
        f->moved_m = lumi_length(lumi_sub(c->poses[i].t, prior->t));
        f->moved_rotation = lumi_rotation_angle(c->poses[i].r, prior->r);
        if (!f->used || !c->has_mechanism || c->mechanism.frames[i].camera < 0)
            continue;
        lumi_mechanism_pose(&c->mechanism, i, &mechanism);
        f->beside_m = lumi_length(lumi_sub(c->poses[i].t, mechanism.t));
        f->beside_rotation = lumi_rotation_angle(c->poses[i].r, mechanism.r);
        f->weak = f->seen < 3 * FEWEST_SEEN || f->beside_m > 6 * c->mechanism.position_spread ||
                  f->beside_rotation > 6 * c->mechanism.rotation_spread;
    }
}

static void judge_lenses(const struct lumi_bundle *b, struct lumi_calibration *c)
{
    for (int i = 0; i < c->lens_count; i++) {
        bool cells[LUMI_COVERAGE_ROWS][LUMI_COVERAGE_COLUMNS] = {0};
        struct lumi_lens_outcome *lens = &c->lenses[i];
        double numbers[LUMI_LENS_NUMBERS];
        int covered = 0;
        for (int k = 0; k < b->observation_count; k++) {
            const struct lumi_bundle_observation *o = &b->observations[k];
            if (c->lens_of[o->camera] != i || !lumi_bundle_counts(b, k))
                continue;
            int column = (int)(o->x / lens->before.width * LUMI_COVERAGE_COLUMNS);
            int row = (int)(o->y / lens->before.height * LUMI_COVERAGE_ROWS);
            lens->observations++;
            cells[CLAMP(row, 0, LUMI_COVERAGE_ROWS - 1)][CLAMP(column, 0, LUMI_COVERAGE_COLUMNS - 1)] = true;
        }
        for (int row = 0; row < LUMI_COVERAGE_ROWS; row++)
            for (int column = 0; column < LUMI_COVERAGE_COLUMNS; column++)
                covered += cells[row][column];
        lens->covered = (double)covered / (LUMI_COVERAGE_ROWS * LUMI_COVERAGE_COLUMNS);
        lumi_lens_numbers(&b->lenses[i].lens, numbers);
        for (int k = 0; k < LUMI_LENS_NUMBERS; k++)
            numbers[k] += b->lenses[i].sigma[k] * b->lenses[i].block[k];
        lumi_lens_from_numbers(numbers, &lens->after);
    }
}

/* A frame that ended where no rig would have it, or on nothing, is not used. */
static void drop_lost(struct lumi_bundle *b, struct lumi_calibration *c)
{
    g_autofree int *seen = g_new0(int, (gsize)b->camera_count);

    for (int i = 0; i < b->observation_count; i++)
        seen[b->observations[i].camera] += lumi_bundle_counts(b, i);
    for (int i = 0; i < c->frame_count; i++)
        if (c->frames[i].used && seen[i] < FEWEST_SEEN) {
            lumi_calibration_drop(c, i, "only %d points in common with its neighbours that agree", seen[i]);
            b->cameras[i].used = false;
        }
}

static void name_cameras_lost(const struct lumi_run *run, struct lumi_calibration *c)
{
    for (int i = 0; i < run->count; i++) {
        int frames = 0, lost = 0, first = -1;
        for (int k = 0; k < run->count; k++)
            if (run->sources[k].camera == run->sources[i].camera) {
                first = first < 0 ? k : first;
                frames++;
                lost += !c->frames[k].used && g_str_has_prefix(c->frames[k].why, "only ");
            }
        if (first != i || lost == 0)
            continue;
        g_autofree char *what = g_strdup_printf("camera %s", run->sources[i].camera_name);
        lumi_calibration_find(c, lost, what,
                              "%d of its %d pictures have too little in common with their neighbours and are not used: "
                              "more overlap, more light or a sharper picture is wanted there",
                              lost, frames);
    }
}

int lumi_calibrate(const struct lumi_run *run, const struct lumi_evidence *evidence, const struct lumi_tracks *tracks,
                   struct lumi_calibration *c, struct lumi_error *error)
{
    struct lumi_bundle b = {0};
    int code;

    *c = (struct lumi_calibration){.frame_count = run->count};
    c->frames = g_new0(struct lumi_frame_outcome, (gsize)run->count);
    c->poses = g_new0(struct lumi_pose, (gsize)run->count);
    c->lens_of = g_new0(int, (gsize)run->count);
    c->findings = g_array_new(FALSE, FALSE, sizeof(struct lumi_finding));
    for (int i = 0; i < run->count; i++)
        c->frames[i].used = true;
    take_lenses(run, c);
    LUMI_GOTO(code, out, lumi_calibration_suspects(run, evidence, c, error));
    LUMI_GOTO(code, out, make_mechanism(run, c, error));
    LUMI_GOTO(code, out, make_bundle(run, tracks, c, &b, error));
    LUMI_GOTO(code, out, solve(run, evidence->pictures, &b, c, error));
    drop_lost(&b, c);
    judge_frames(run, &b, c);
    judge_lenses(&b, c);
    name_cameras_lost(run, c);
    c->used = used_frames(c);
out:
    lumi_bundle_finish(&b);
    if (code != LUMI_OK && code != LUMI_ERR_FORMAT)
        lumi_calibration_finish(c);
    return code;
}

void lumi_calibration_finish(struct lumi_calibration *c)
{
    g_free(c->frames);
    g_free(c->poses);
    g_free(c->lens_of);
    g_free(c->lenses);
    lumi_mechanism_finish(&c->mechanism);
    if (c->findings)
        g_array_free(c->findings, TRUE);
    *c = (struct lumi_calibration){0};
}
