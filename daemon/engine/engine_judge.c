/* Judgement of frames that are stored: as they come while there are workers, from their files otherwise. Pictures of
 * the latest frames of every camera stay for judging those beside them. */
#include "daemon/engine/engine_priv.h"
#include "proto/base/memory.h"
#include "proto/mechanism/kinematics.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define SMEAR_ALIKE 0.1  /* of its length: what two measurements of one smear differ by at most */
#define SMEAR_TURNED 0.1 /* radians */

static void picture_drop(struct engine_picture *picture)
{
    if (!picture || --picture->users > 0)
        return;
    lumi_judge_picture_destroy(picture->picture);
    lumi_free(picture);
}

static struct engine_judging *free_job(struct lumi_engine *e)
{
    for (int i = 0; i < ENGINE_JUDGING; i++)
        if (!e->jobs[i].used)
            return &e->jobs[i];
    return NULL;
}

void engine_shot_pose(const struct lumi_engine *e, int shot, int camera, struct lumi_pose *pose)
{
    double turns = e->account_shots[shot].turns;

    if (!isfinite(turns))
        turns = (double)lumi_plan_position_step(&e->plan, &e->rig, shot / e->plan.bracket) /
                lumi_rig_steps_per_turn(&e->rig);
    lumi_rig_camera_pose(&e->rig, e->cameras[camera].rig, turns, pose);
}

static const struct lumi_lens *lens_of(const struct lumi_engine *e, int camera)
{
    return &e->rig.lenses[e->rig.cameras[e->cameras[camera].rig].lens].lens;
}

static void add_neighbour(struct lumi_engine *e, struct engine_judging *job, struct lumi_engine_judge_job *asked,
                          int camera, int shot)
{
    struct engine_picture *best = NULL;

    for (int i = 0; i < ENGINE_PICTURES; i++) {
        struct engine_picture *picture = e->cameras[camera].pictures[i];
        if (picture && (camera != job->camera || picture->shot != job->shot) &&
            picture->shot % e->plan.bracket == job->shot % e->plan.bracket &&
            (!best || abs(picture->shot - shot) < abs(best->shot - shot)))
            best = picture;
    }
    if (!best || asked->neighbour_count == 4)
        return;
    best->users++;
    job->neighbours[asked->neighbour_count] = best;
    asked->neighbours[asked->neighbour_count++] =
        (struct lumi_judge_neighbour){best->picture, lens_of(e, camera), best->pose, best->exposure_s, best->gain};
}

static void ask(struct lumi_engine *e, struct engine_judging *job, const struct lumi_camera_frame *frame)
{
    struct lumi_engine_judge_job asked = {.id = job->id,
                                          .camera = job->camera,
                                          .shot = job->shot,
                                          .frame = frame,
                                          .lens = lens_of(e, job->camera),
                                          .exposure_s = job->exposure_s,
                                          .gain = job->gain};

    if (job->shot >= 0) {
        const int rig = e->cameras[job->camera].rig;
        engine_shot_pose(e, job->shot, job->camera, &job->pose);
        asked.pose = job->pose;
        add_neighbour(e, job, &asked, job->camera, job->shot - e->plan.bracket);
        for (int side = -1; side <= 1; side += 2) {
            int other = engine_camera_of(e, rig + side);
            if (other >= 0 && e->cameras[other].used)
                add_neighbour(e, job, &asked, other, job->shot);
        }
    } else {
        lumi_rig_camera_pose(&e->rig, e->cameras[job->camera].rig, 0, &asked.pose);
    }
    e->judging++;
    e->ports.judge(e->ports.context, &asked);
}

void engine_judge(struct lumi_engine *e, int shot, int camera, struct engine_held *held)
{
    struct engine_judging *job = e->ports.judge ? free_job(e) : NULL;
    struct engine_frame *frame = engine_frame_at(e, shot, camera);

    if (!e->ports.judge)
        return;
    if (!job) { /* from the file, when there is time */
        frame->judge_due = true;
        e->judge_due++;
        return;
    }
    frame->judging = true;
    held->users++;
    *job = (struct engine_judging){.used = true, .id = ++e->judge_serial, .shot = shot, .camera = camera, .held = held};
    job->exposure_s = held->frame->exposure_s > 0 ? held->frame->exposure_s : e->plan.exposures[shot % e->plan.bracket];
    job->gain = held->frame->gain;
    ask(e, job, held->frame);
}

static void no_release(struct lumi_camera_frame *frame)
{
    (void)frame;
}

/* Where the store has put it: the name with the extension that it finds. */
static bool find_file(const struct lumi_engine *e, int shot, int camera, char *path, size_t size)
{
    static const char *const extensions[] = {".jpg", ".dng", ".tif", ".png", ".jpeg", ".tiff", ".cr2",
                                             ".cr3", ".nef", ".arw", ".raf", ".rw2",  ".gpr",  ".orf"};
    const char *name = e->names[(size_t)shot * (size_t)e->config.camera_count + (size_t)camera];

    for (size_t i = 0; i < sizeof extensions / sizeof *extensions; i++) {
        FILE *file;
        snprintf(path, size, "%s/data/frames/%s%s", e->capture, name, extensions[i]);
        if ((file = fopen(path, "rb"))) {
            fclose(file);
            return true;
        }
    }
    return false;
}

/* Half of the workers' places are for frames in memory. */
void engine_judge_due(struct lumi_engine *e)
{
    const int all = e->frames ? e->shots * e->config.camera_count : 0;

    for (int i = 0; i < all && e->judge_due > 0 && e->judging < ENGINE_JUDGING / 2; i++) {
        struct engine_frame *frame = e->frames + i;
        const int shot = i / e->config.camera_count, camera = i % e->config.camera_count;
        struct engine_judging *job = frame->judge_due ? free_job(e) : NULL;
        if (!job)
            continue;
        frame->judge_due = false;
        e->judge_due--;
        *job = (struct engine_judging){.used = true, .id = ++e->judge_serial, .shot = shot, .camera = camera};
        if (frame->at != AT_STORED || !e->ports.judge || !find_file(e, shot, camera, job->path, sizeof job->path)) {
            job->used = false;
            continue;
        }
        frame->judging = true;
        job->file = (struct lumi_camera_frame){.format = {.layout = LUMI_LAYOUT_FILE},
                                               .path = job->path,
                                               .file_mtime_ns = LUMI_CAMERA_NO_TIME,
                                               .device_ns = LUMI_CAMERA_NO_TIME,
                                               .temperature = NAN,
                                               .release = no_release};
        job->exposure_s = e->plan.exposures[shot % e->plan.bracket];
        ask(e, job, &job->file);
    }
}

static void keep_picture(struct engine_camera *c, const struct engine_judging *job, struct lumi_judge_picture *picture)
{
    struct engine_picture *kept = lumi_calloc(1, sizeof *kept);
    int oldest = 0;

    if (!kept) {
        lumi_judge_picture_destroy(picture);
        return;
    }
    *kept = (struct engine_picture){picture, 1, job->shot, job->exposure_s, job->gain, job->pose};
    for (int i = 0; i < ENGINE_PICTURES; i++) {
        if (!c->pictures[i]) {
            oldest = i;
            break;
        }
        if (c->pictures[i]->shot < c->pictures[oldest]->shot)
            oldest = i;
    }
    picture_drop(c->pictures[oldest]);
    c->pictures[oldest] = kept;
}

static void write_verdict(struct lumi_engine *e, const struct engine_judging *job, enum lumi_judge_fault fault,
                          const struct lumi_judge_numbers *numbers, const char *reason)
{
    struct engine_frame *frame = engine_frame_at(e, job->shot, job->camera);
    struct engine_flight *flight = engine_flight(e, LUMI_STORE_JUDGED);
    const bool accepted = fault == LUMI_JUDGE_GOOD;

    frame->dead_row = !accepted;
    frame->fault = (uint8_t)fault;
    if (!accepted) { /* told with the frame below */
        char text[400];
        snprintf(text, sizeof text, "shot %d of %s: %s", job->shot, e->config.cameras[job->camera].name, reason);
        engine_incident_row(e, job->camera, "rejected", text);
    }
    engine_frame_go(e, job->shot, job->camera, accepted ? AT_ACCEPTED : AT_REJECTED, reason);
    if (!flight)
        return;
    flight->shot = job->shot;
    flight->camera = job->camera;
    flight->job.frame = frame->row;
    flight->job.accepted = accepted;
    flight->job.sharpness = numbers ? numbers->sharpness : 0;
    flight->job.judgement = (struct lumi_capture_judgement){.blur_pixels = numbers ? numbers->blur_pixels : NAN,
                                                            .clipped = numbers ? numbers->clipped : NAN,
                                                            .dark = numbers ? numbers->dark : NAN,
                                                            .mean = numbers ? numbers->mean : NAN,
                                                            .exposure_stops = numbers ? numbers->exposure_stops : NAN,
                                                            .shift_pixels = numbers ? numbers->shift_pixels : NAN,
                                                            .moved = numbers ? numbers->moved : NAN};
    snprintf(flight->job.text, sizeof flight->job.text, "%s", reason);
    engine_flight_give(e, flight);
}

/* A smear that a retake shows again, as long and in the same direction, is no accident of the moment: the place looks
 * so (rails, grass, a striped carpet), or the sweep is too fast, which the preflight told. A third picture would show
 * it, too. */
static bool is_as_smeared(const struct engine_frame *frame, const struct lumi_judge_numbers *numbers)
{
    const double turned = fabs(remainder(numbers->blur_angle - (double)frame->smear_angle, LUMI_PI));

    return frame->smear > 0 && fabs(numbers->blur_pixels / (double)frame->smear - 1) < SMEAR_ALIKE &&
           turned < SMEAR_TURNED;
}

static enum lumi_judge_fault judged(struct lumi_engine *e, const struct engine_judging *job,
                                    const struct lumi_judge_numbers *numbers, char *reason, size_t size)
{
    struct engine_camera *c = e->cameras + job->camera;
    struct engine_frame *frame = engine_frame_at(e, job->shot, job->camera);
    const double usual = lumi_judge_usual_sharpness(&c->usual);
    struct lumi_judge_limits limits = e->config.judge;
    enum lumi_judge_fault fault;
    bool accepted = lumi_judge_verdict(numbers, &limits, usual, &fault, reason, size);

    if (!accepted && numbers->blur_pixels > limits.blur_pixels && is_as_smeared(frame, numbers)) {
        limits.blur_pixels = INFINITY;
        accepted = lumi_judge_verdict(numbers, &limits, usual, &fault, reason, size);
        if (accepted)
            snprintf(reason, size,
                     "as smeared as the time before, over %.1f pixels: the place looks so, or the sweep is too fast",
                     numbers->blur_pixels);
    }
    frame->smear = (float)numbers->blur_pixels;
    frame->smear_angle = (float)numbers->blur_angle;
    return fault;
}

static void take_verdict(struct lumi_engine *e, struct engine_judging *job, int code, const char *text,
                         const struct lumi_judge_numbers *numbers)
{
    struct engine_camera *c = e->cameras + job->camera;
    struct engine_frame *frame = engine_frame_at(e, job->shot, job->camera);
    enum lumi_judge_fault fault;
    char reason[256] = "";

    frame->judging = false;
    if (frame->at != AT_STORED || !e->store)
        return;
    if (code == LUMI_ERR_FORMAT || code == LUMI_ERR_UNSUPPORTED) {
        snprintf(reason, sizeof reason, "it is no picture: %.200s", text ? text : "");
        write_verdict(e, job, LUMI_JUDGE_OTHER, NULL, reason);
        return;
    }
    if (code != LUMI_OK || !numbers) { /* stays stored, and good until somebody says otherwise */
        engine_incident(e, job->camera, "judge", "shot %d of %s was not judged: %s", job->shot,
                        e->config.cameras[job->camera].name, text ? text : "");
        return;
    }
    fault = judged(e, job, numbers, reason, sizeof reason);
    if (fault == LUMI_JUDGE_GOOD)
        lumi_judge_usual_add(&c->usual, numbers->sharpness);
    write_verdict(e, job, fault, numbers, reason);
}

void lumi_engine_judged(struct lumi_engine *e, int64_t now_ns, uint64_t id, int code, const char *text,
                        const struct lumi_judge_numbers *numbers, struct lumi_judge_picture *picture)
{
    struct engine_judging *job = NULL;

    e->now = now_ns > e->now ? now_ns : e->now;
    for (int i = 0; i < ENGINE_JUDGING; i++)
        if (e->jobs[i].used && e->jobs[i].id == id)
            job = &e->jobs[i];
    if (!job) {
        lumi_judge_picture_destroy(picture);
        return;
    }
    e->judging--;
    if (job->shot == -1)
        engine_test_judged(e, job->camera, code, text, numbers);
    else if (e->frames && job->shot >= 0)
        take_verdict(e, job, code, text, numbers);
    if (picture && job->shot >= 0 && e->frames)
        keep_picture(e->cameras + job->camera, job, picture);
    else
        lumi_judge_picture_destroy(picture);
    for (int i = 0; i < 4; i++)
        picture_drop(job->neighbours[i]);
    engine_held_drop(job->held);
    job->used = false;
    engine_step(e);
}

void engine_judge_forget(struct lumi_engine *e)
{
    for (int i = 0; i < ENGINE_JUDGING; i++)
        e->jobs[i].shot = -2;
}

/* Before the engine goes: nobody answers any more. */
void engine_judge_reset(struct lumi_engine *e)
{
    for (int i = 0; i < ENGINE_JUDGING; i++) {
        struct engine_judging *job = &e->jobs[i];
        if (!job->used)
            continue;
        for (int k = 0; k < 4; k++)
            picture_drop(job->neighbours[k]);
        engine_held_drop(job->held);
        job->used = false;
    }
    e->judging = 0;
}
