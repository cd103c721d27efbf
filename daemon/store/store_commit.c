/* Jobs become rows: as many as are ready, in one transaction. */
#include "daemon/store/store_priv.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

/* The capture's camera for one of the rig's: lumi_store_plan adds them in that order. 0: none. */
static int camera_of(struct lumi_store *store, int camera, int64_t *id, struct lumi_error *error)
{
    char name[LUMI_CAPTURE_NAME];

    *id = 0;
    return camera < 0 ? LUMI_OK : lumi_capture_camera(store->capture, camera, id, name, error);
}

static int do_shot(struct lumi_store *store, const struct lumi_store_job *job, struct lumi_error *error)
{
    for (int i = 0; i < LUMI_RIG_CAMERAS; i++) {
        if (!job->frames[i])
            continue;
        LUMI_TRY(lumi_capture_trigger_frame(store->capture, job->frames[i], job->trigger_us[i], error));
        LUMI_TRY(lumi_capture_fire_shot(store->capture, job->frames[i], job->sweep, error));
    }
    return LUMI_OK;
}

static int do_frame(struct lumi_store *store, struct store_entry *entry, struct lumi_error *error)
{
    struct lumi_capture_written written = {entry->temporary, entry->written, entry->sha256, ""};

    LUMI_TRY(lumi_capture_adopt_file(store->capture, entry->job.frame, &written, &entry->job.file, error));
    memcpy(entry->file, written.file, sizeof entry->file);
    return LUMI_OK;
}

static int do_judged(struct lumi_store *store, const struct lumi_store_job *job, struct lumi_error *error)
{
    LUMI_TRY(lumi_capture_judge_frame(store->capture, job->frame, job->accepted, job->sharpness,
                                      job->text[0] ? job->text : NULL, error));
    return lumi_capture_set_judgement(store->capture, job->frame, &job->judgement, error);
}

static int do_incident(struct lumi_store *store, const struct lumi_store_job *job, struct lumi_error *error)
{
    struct lumi_capture_incident incident = {.time_us = job->time_us, .frame = job->frame};

    LUMI_TRY(camera_of(store, job->camera, &incident.camera, error));
    snprintf(incident.kind, sizeof incident.kind, "%s", job->key);
    snprintf(incident.text, sizeof incident.text, "%s", job->text);
    return lumi_capture_add_incident(store->capture, &incident, error);
}

static int do_sweep(struct lumi_store *store, const struct lumi_store_job *job, struct lumi_error *error)
{
    struct lumi_capture_sweep sweep = {.number = job->sweep,
                                       .began_us = job->ended ? LUMI_NO_TIME : job->time_us,
                                       .ended_us = job->ended ? job->time_us : LUMI_NO_TIME};

    snprintf(sweep.outcome, sizeof sweep.outcome, "%s", job->text);
    return lumi_capture_set_sweep(store->capture, &sweep, error);
}

static int do_camera(struct lumi_store *store, const struct lumi_store_job *job, struct lumi_error *error)
{
    int64_t camera;

    LUMI_TRY(camera_of(store, job->camera, &camera, error));
    return job->kind == LUMI_STORE_CLOCK
               ? lumi_capture_set_clock(store->capture, job->sweep, camera, &job->clock, error)
               : lumi_capture_set_device(store->capture, camera, &job->device, error);
}

static int do_job(struct lumi_store *store, struct store_entry *entry, struct lumi_error *error)
{
    const struct lumi_store_job *job = &entry->job;
    struct lumi_capture *capture = store->capture;

    switch (job->kind) {
    case LUMI_STORE_SHOT:
        return do_shot(store, job, error);
    case LUMI_STORE_EXPOSED:
        return lumi_capture_expose_frame(capture, job->frame, job->exposed_us, error);
    case LUMI_STORE_FRAME:
        return do_frame(store, entry, error);
    case LUMI_STORE_LOST:
        return lumi_capture_lose_frame(capture, job->frame, job->text, error);
    case LUMI_STORE_JUDGED:
        return do_judged(store, job, error);
    case LUMI_STORE_RETAKE:
        LUMI_TRY(lumi_capture_retake_frame(capture, job->frame, &entry->done.frame, error));
        return lumi_capture_shot_of(capture, entry->done.frame, &entry->done.shot, error);
    case LUMI_STORE_INCIDENT:
        return do_incident(store, job, error);
    case LUMI_STORE_SWEEP:
        return do_sweep(store, job, error);
    case LUMI_STORE_CLOCK:
    case LUMI_STORE_DEVICE:
        return do_camera(store, job, error);
    case LUMI_STORE_META:
        return lumi_capture_set_meta(capture, job->key, job->text, error);
    case LUMI_STORE_SEAL:
        break;
    }
    return lumi_fail(error, LUMI_ERR_ARG, "no job of kind %d", (int)job->kind);
}

static void fail(struct store_entry *entry, int code, const char *text)
{
    entry->code = code;
    snprintf(entry->text, sizeof entry->text, "%.511s", text);
}

/* Whether the disk failed, and not the job: then all of them are undone. */
static bool disk_failed(const struct lumi_store *store, int code)
{
    return !lumi_capture_in_batch(store->capture) || code == LUMI_ERR_NOSPACE || code == LUMI_ERR_IO;
}

/* A job that fails leaves the others alone. */
static int do_jobs(struct lumi_store *store, struct store_entry **group, int count, struct lumi_error *error)
{
    LUMI_TRY(lumi_capture_begin(store->capture, error));
    for (int i = 0; i < count; i++) {
        struct lumi_error own = {0};
        if (group[i]->code != LUMI_OK)
            continue;
        int code = lumi_capture_guard(store->capture, &own);
        if (code == LUMI_OK)
            code = lumi_capture_guarded(store->capture, do_job(store, group[i], &own), &own);
        if (disk_failed(store, code))
            return lumi_fail(error, code != LUMI_OK ? code : LUMI_ERR_INTERNAL, "%s", own.text);
        if (code != LUMI_OK)
            fail(group[i], code, own.text);
    }
    return lumi_capture_commit(store->capture, error);
}

static void do_group(struct lumi_store *store, struct store_entry **group, int count)
{
    struct lumi_error error = {0};
    int code = do_jobs(store, group, count, &error);

    if (code == LUMI_OK)
        return;
    lumi_capture_rollback(store->capture, true);
    if (code == LUMI_ERR_NOSPACE && store_reserve_spend(store)) {
        code = do_jobs(store, group, count, &error);
        if (code == LUMI_OK)
            return;
        lumi_capture_rollback(store->capture, true);
    }
    for (int i = 0; i < count; i++)
        if (group[i]->code == LUMI_OK)
            fail(group[i], code, error.text);
}

/* ---- The end ---- */

struct findings {
    int problems;
    char first[512];
};

static void found(void *context, const char *file, const char *text)
{
    struct findings *findings = context;

    if (findings->problems++ == 0)
        snprintf(findings->first, sizeof findings->first, "%.200s: %.300s", file, text);
}

static int verify(struct lumi_store *store, struct lumi_error *error)
{
    const char *path = lumi_capture_path(store->capture);
    struct lumi_verify_result result;
    struct findings findings = {0};

    LUMI_TRY(lumi_capture_verify(path, found, NULL, &findings, &result, error));
    if (!findings.problems)
        return LUMI_OK;
    return lumi_fail(error, LUMI_ERR_CHECKSUM, "%s: %d of its files are not as they were stored; the first: %s", path,
                     findings.problems, findings.first);
}

static int seal(struct lumi_store *store, const struct lumi_store_job *job, struct lumi_error *error)
{
    store_reserve_remove(store);
    if (job->verify)
        LUMI_TRY(verify(store, error));
    return lumi_capture_seal(store->capture, job->date[0] ? job->date : NULL, error);
}

void store_commit(struct lumi_store *store, struct store_entry **group, int count)
{
    struct lumi_error error = {0};

    if (count == 1 && group[0]->job.kind == LUMI_STORE_SEAL) {
        int code = store->sealed ? LUMI_OK : seal(store, &group[0]->job, &error);
        if (code != LUMI_OK)
            fail(group[0], code, error.text);
        return;
    }
    do_group(store, group, count);
    for (int i = 0; i < count; i++)
        if (group[i]->temporary[0] && group[i]->code != LUMI_OK)
            unlinkat(store->folder, group[i]->temporary, 0);
}
