/* Stands in for the capture engine and the hand-over where only the API is tested. */
#include "tests/unit/engine_double.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

struct engine_double engine_double;

void engine_double_reset(void)
{
    struct lumi_engine_status *status = &engine_double.status;

    memset(&engine_double, 0, sizeof engine_double);
    status->seconds_left = NAN;
    snprintf(status->text, sizeof status->text, "ready");
    status->camera_count = 1;
    snprintf(status->cameras[0].name, sizeof status->cameras[0].name, "c00");
    snprintf(status->cameras[0].identity.serial, sizeof status->cameras[0].identity.serial, "S\"1\xff");
    status->cameras[0].there = true;
    status->cameras[0].status.temperature = 41.5;
    status->cameras[0].status.battery = NAN;
    status->cameras[0].status.card_free_bytes = -1;
    status->check_count = 1;
    snprintf(status->checks[0].name, sizeof status->checks[0].name, "link");
    snprintf(status->checks[0].reason, sizeof status->checks[0].reason, "usb:42");
    status->disk_free_bytes = (int64_t)1 << 40;
}

struct lumi_engine *engine_double_engine(void)
{
    return (struct lumi_engine *)&engine_double;
}

struct lumi_handover *engine_double_handover(void)
{
    return (struct lumi_handover *)&engine_double;
}

struct lumi_ingest *engine_double_ingest(void)
{
    return (struct lumi_ingest *)&engine_double;
}

static int answer(const char *call, struct lumi_error *error)
{
    snprintf(engine_double.call, sizeof engine_double.call, "%s", call);
    engine_double.calls++;
    return engine_double.code ? lumi_fail(error, engine_double.code, "%s", engine_double.text) : LUMI_OK;
}

static void copy(char *to, size_t size, const char *from)
{
    snprintf(to, size, "%s", from ? from : "");
}

static void copy_list(const char *const *list)
{
    engine_double.count = 0;
    copy(engine_double.first, sizeof engine_double.first, list ? list[0] : NULL);
    while (list && list[engine_double.count])
        engine_double.count++;
}

int lumi_engine_start(struct lumi_engine *engine, int64_t now_ns, const char *plan_text, size_t plan_size,
                      const struct lumi_engine_start *start, struct lumi_error *error)
{
    (void)engine;
    (void)now_ns;
    snprintf(engine_double.plan, sizeof engine_double.plan, "%.*s", (int)plan_size, plan_text);
    copy(engine_double.name, sizeof engine_double.name, start->name);
    copy(engine_double.title, sizeof engine_double.title, start->title);
    copy_list(start->override);
    engine_double.has_override = start->override != NULL;
    engine_double.preflight_only = start->preflight_only;
    if (engine_double.one_start && engine_double.status.state == LUMI_ENGINE_PREFLIGHT)
        return lumi_fail(error, LUMI_ERR_BUSY, "another capture is under way: hall, preflight");
    if (!engine_double.code)
        engine_double.status.state = LUMI_ENGINE_PREFLIGHT;
    return answer("start", error);
}

int lumi_engine_pause(struct lumi_engine *engine, int64_t now_ns, struct lumi_error *error)
{
    (void)engine;
    (void)now_ns;
    return answer("pause", error);
}

int lumi_engine_resume(struct lumi_engine *engine, int64_t now_ns, struct lumi_error *error)
{
    (void)engine;
    (void)now_ns;
    return answer("resume", error);
}

int lumi_engine_stop(struct lumi_engine *engine, int64_t now_ns, bool at_once, bool seal, struct lumi_error *error)
{
    (void)engine;
    (void)now_ns;
    engine_double.at_once = at_once;
    engine_double.seal = seal;
    return answer("stop", error);
}

void lumi_engine_emergency_stop(struct lumi_engine *engine, int64_t now_ns)
{
    (void)engine;
    (void)now_ns;
    answer("emergency stop", NULL);
}

int lumi_engine_retake(struct lumi_engine *engine, int64_t now_ns, const char *capture, const char *const *frames,
                       struct lumi_error *error)
{
    (void)engine;
    (void)now_ns;
    copy(engine_double.capture, sizeof engine_double.capture, capture);
    copy_list(frames);
    return answer("retake", error);
}

int lumi_engine_clear(struct lumi_engine *engine, int64_t now_ns, struct lumi_error *error)
{
    (void)engine;
    (void)now_ns;
    return answer("clear", error);
}

int lumi_engine_home(struct lumi_engine *engine, int64_t now_ns, int turn, bool wind_up, struct lumi_error *error)
{
    (void)engine;
    (void)now_ns;
    engine_double.count = turn;
    engine_double.seal = wind_up;
    return answer("home", error);
}

int lumi_engine_jog(struct lumi_engine *engine, int64_t now_ns, double radians, struct lumi_error *error)
{
    (void)engine;
    (void)now_ns;
    engine_double.radians = radians;
    return answer("jog", error);
}

int lumi_engine_look_check(const struct lumi_engine *engine, int camera, struct lumi_error *error)
{
    (void)engine;
    if (engine_double.status.cameras[camera].identity.records_itself)
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "it records by itself");
    return LUMI_OK;
}

const char *lumi_engine_state_name(enum lumi_engine_state state)
{
    static const char *const names[] = {"idle",   "preflight",   "red",      "homing",  "arming", "sweeping", "pausing",
                                        "paused", "interrupted", "draining", "sealing", "done",   "failed"};

    return names[state];
}

const char *lumi_verdict_name(enum lumi_verdict verdict)
{
    static const char *const names[] = {"green", "yellow", "red", "undecided"};

    return names[verdict];
}

void lumi_engine_status(const struct lumi_engine *engine, struct lumi_engine_status *status)
{
    (void)engine;
    *status = engine_double.status;
}

int lumi_engine_missing(const struct lumi_engine *engine, struct lumi_engine_missing *list, int max)
{
    (void)engine;
    for (int i = 0; i < engine_double.missing_count && i < max; i++)
        list[i] = engine_double.missing[i];
    return engine_double.missing_count;
}

int lumi_handover_give(struct lumi_handover *handover, const char *capture, bool again, struct lumi_error *error)
{
    (void)handover;
    copy(engine_double.capture, sizeof engine_double.capture, capture);
    engine_double.again = again;
    return answer("give", error);
}

int lumi_handover_list(struct lumi_handover *handover, struct lumi_process_status *list, int max)
{
    (void)handover;
    for (int i = 0; i < engine_double.processing_count && i < max; i++)
        list[i] = engine_double.processing[i];
    return engine_double.processing_count;
}

int lumi_ingest_list(struct lumi_ingest *ingest, struct lumi_ingest_status *list, int max)
{
    (void)ingest;
    for (int i = 0; i < engine_double.ingest_count && i < max; i++)
        list[i] = engine_double.ingest[i];
    return engine_double.ingest_count;
}

bool lumi_engine_frames(const struct lumi_engine *engine, struct lumi_engine_frames *frames)
{
    (void)engine;
    *frames = engine_double.frames;
    return frames->shots > 0;
}

void lumi_engine_frame(const struct lumi_engine *engine, const struct lumi_engine_frames *frames, int number,
                       struct lumi_engine_frame *frame)
{
    static const struct lumi_engine_frame seen[] = {{"c00-t00-p000", 'a', {1, 0, 0}},
                                                    {"c01-t00-p000", 'p', {-0.6, -0.00001, 0.8}},
                                                    {"c00-t00-p001.2", 'n', {0.123449, -0.123451, 1}}};

    (void)engine;
    (void)frames;
    *frame = seen[number % 3];
}

bool lumi_engine_profile(const struct lumi_engine *engine, struct lumi_rig *rig, const char **source)
{
    (void)engine;
    *rig = engine_double.rig;
    *source = engine_double.rig_source;
    return engine_double.rig_source != NULL;
}
