/* A test shot on every trigger: does the right camera see it? It also says where each camera's clock stands and how
 * long its frames take, and gives a frame to look at. */
#include "daemon/engine/engine_priv.h"
#include "proto/base/memory.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define TEST_SECONDS 3.0   /* until a frame of a test shot is not seen, at least */
#define OTHERS_SECONDS 0.3 /* that others may answer too */
#define TEST_AHEAD 0.002   /* s, from the board's answer to the first edge (firing.h, FIRING_MARGIN_TICKS) */
#define DOUBT 2            /* misses until a camera is tested again */
#define BUSY_TRIES 20
#define BUSY_SECONDS 0.2
#define ROUNDS 5              /* shots of one test, at most */
#define CONFIRM_NS 50000000LL /* by which two frames and their shots may differ */
#define TESTED 1000           /* stage_at when all are */

static void check(struct lumi_engine *e, int camera, enum lumi_verdict verdict, const char *what, const char *text)
{
    char name[48];

    snprintf(name, sizeof name, "%s %.30s", what, e->config.cameras[camera].name);
    engine_check(e, false, verdict, name, "%s", text);
}

/* Of one shot alone nobody knows whether the frame that came is its own: it may have been under way for long. Two
 * frames that lie as far from one another as their shots do are. */
static bool confirms(const struct engine_camera *c, const struct engine_test_answer *before,
                     const struct engine_test_answer *answer)
{
    const int64_t fired = answer->fired_ns - before->fired_ns;

    if (fired == 0)
        return false;
    if (c->identity.device_clock)
        return llabs((answer->frame.device_ns - before->frame.device_ns) - fired) < CONFIRM_NS;
    return llabs((answer->frame.host_ns - before->frame.host_ns) - fired) < 2 * CONFIRM_NS;
}

static void note_answer(struct lumi_engine *e, int camera, const struct lumi_camera_frame *frame)
{
    struct engine_camera *c = e->cameras + camera;
    const struct lumi_rig_trigger *trigger = &e->rig.control.triggers[c->rig];
    const int64_t exposed = e->test_ns + (int64_t)((TEST_AHEAD + trigger->focus_lead + trigger->shutter_lag) * 1e9);
    const struct engine_test_answer answer = {
        .fired_ns = e->test_ns,
        .frame = {.device_ns = c->identity.device_clock ? frame->device_ns : LUMI_MATCH_NO_TIME,
                  .host_ns = frame->host_ns,
                  .sequence = frame->sequence}};

    for (int i = 0; i < c->answer_count && !c->trusted; i++)
        if (confirms(c, &c->answers[i], &answer)) {
            c->trusted = true;
            c->doubtful = false;
            c->misses = 0;
            lumi_match_prior(c->match, &answer.frame, exposed);
        }
    if (c->answer_count == ENGINE_ANSWERS)
        memmove(c->answers, c->answers + 1, sizeof answer * (size_t)--c->answer_count);
    c->answers[c->answer_count++] = answer;
}

/* A frame of a camera that is not being tested: was it taken before the camera was fired that is? As from a test of its
 * own that came late, or came twice. What its own answers tell of its clock says so. */
static bool of_before(const struct lumi_engine *e, int camera, const struct lumi_camera_frame *frame)
{
    const struct engine_camera *c = e->cameras + camera;

    for (int i = 0; i < c->answer_count; i++) {
        const struct engine_test_answer *answer = &c->answers[i];
        if (frame->sequence != 0 && frame->sequence <= answer->frame.sequence)
            return true;
        if (c->identity.device_clock && frame->device_ns != LUMI_CAMERA_NO_TIME &&
            answer->frame.device_ns != LUMI_MATCH_NO_TIME &&
            answer->fired_ns + (frame->device_ns - answer->frame.device_ns) < e->test_first_ns - CONFIRM_NS)
            return true;
    }
    return false;
}

void engine_test_frame(struct lumi_engine *e, int camera, struct lumi_camera_frame *frame)
{
    struct engine_camera *c = e->cameras + camera;
    struct engine_held *held;

    if (e->test_camera < 0 || e->test_ns == 0 /* nothing was fired */ ||
        (camera != e->test_camera && of_before(e, camera, frame))) {
        lumi_camera_frame_release(frame);
        return;
    }
    e->cameras[e->test_camera].seen |= 1u << camera;
    e->cameras[e->test_camera].round_seen |= camera == e->test_camera;
    if (camera == e->test_camera && c->match && !c->identity.records_itself)
        note_answer(e, camera, frame);
    if (camera == e->test_camera)
        engine_picture(e, -1, camera, frame);
    if (camera != e->test_camera || c->test || !(held = lumi_calloc(1, sizeof *held))) {
        lumi_camera_frame_release(frame);
        return;
    }
    *held = (struct engine_held){.frame = frame, .users = 1, .bytes = frame->size, .of = &c->held};
    c->held++;
    c->test = held;
    c->frame_bytes = frame->size;
}

void engine_test_judged(struct lumi_engine *e, int camera, int code, const char *text,
                        const struct lumi_judge_numbers *numbers)
{
    char reason[256];

    if (code != LUMI_OK || !numbers) {
        snprintf(reason, sizeof reason, "the test frame cannot be judged: %.180s", text ? text : "");
        check(e, camera, code == LUMI_ERR_FORMAT ? LUMI_RED : LUMI_YELLOW, "focus", reason);
        return;
    }
    if (numbers->sharpness > 0)
        snprintf(reason, sizeof reason, "sharpness %.3f", numbers->sharpness);
    else
        snprintf(reason, sizeof reason, "not known: it sees nothing with detail");
    check(e, camera, numbers->sharpness > 0 && numbers->sharpness < 0.05 ? LUMI_YELLOW : LUMI_GREEN, "focus", reason);
    snprintf(reason, sizeof reason, "%.1f %% at white, %.1f %% at black, mean %.3f", numbers->clipped * 100,
             numbers->dark * 100, numbers->mean);
    check(e, camera, numbers->clipped > e->config.judge.clipped || numbers->mean < 0.005 ? LUMI_YELLOW : LUMI_GREEN,
          "light", reason);
}

static void tell_seen(struct lumi_engine *e, int camera)
{
    const struct engine_camera *c = e->cameras + camera;
    const uint32_t others = c->seen & ~(1u << camera);
    char text[200], names[128] = "";
    size_t used = 0;

    for (int k = 0; k < e->config.camera_count; k++)
        if (others & 1u << k && used + LUMI_RIG_NAME + 3 < sizeof names)
            used += (size_t)snprintf(names + used, sizeof names - used, "%s%s", used ? ", " : "",
                                     e->config.cameras[k].name);
    if (c->seen & 1u << camera && !others) {
        snprintf(text, sizeof text, "seen%s, %zu bytes", e->test_again ? " at the second test only" : "",
                 c->frame_bytes);
        check(e, camera, e->test_again ? LUMI_YELLOW : LUMI_GREEN, "trigger", text);
        if (e->plan.bracket > 1 && c->test && c->test->frame->exposure_s <= 0)
            check(e, camera, LUMI_YELLOW, "bracket",
                  "its frames do not tell their exposure time: the bracket is not verified");
    } else if (c->seen & 1u << camera) {
        snprintf(text, sizeof text, "%s fired as well", names);
        check(e, camera, LUMI_RED, "trigger", text);
    } else if (others) {
        snprintf(text, sizeof text, "its trigger fires %s: miswired, or two cameras are exchanged", names);
        check(e, camera, LUMI_RED, "trigger", text);
    } else {
        check(e, camera, LUMI_RED, "trigger", "no frame came of its trigger");
    }
    if (e->config.cameras[camera].sync_line)
        check(e, camera, c->edge_seen ? LUMI_GREEN : LUMI_YELLOW, "sync",
              c->edge_seen ? "its edge was seen" : "no edge of its exposure was seen");
}

static bool fired_by_board(const struct lumi_engine *e, int camera)
{
    return !e->cameras[camera].identity.records_itself &&
           e->config.cameras[camera].setting.trigger == LUMI_TRIGGER_HARDWARE;
}

static bool testable(struct lumi_engine *e, int camera)
{
    const struct engine_camera *c = e->cameras + camera;

    if (!c->used || !engine_camera_ready(e, camera) || (e->stage == STAGE_TEST && !fired_by_board(e, camera)))
        return false;
    if (c->identity.records_itself) {
        check(e, camera, LUMI_YELLOW, "trigger", "it records by itself: what it took is seen after the sweep");
        return false;
    }
    if (e->config.cameras[camera].setting.trigger != LUMI_TRIGGER_HARDWARE) {
        const bool free_running = e->config.cameras[camera].setting.trigger == LUMI_TRIGGER_FREE;
        if (e->plan.mode != LUMI_PLAN_START_STOP)
            check(e, camera, LUMI_RED, "trigger",
                  free_running ? "it is free-running: the platform must stand at every position"
                               : "it is fired by software: the platform must stand at every position");
        else
            check(e, camera, LUMI_GREEN, "trigger",
                  free_running ? "free-running: of each shot the frame about its time is kept"
                               : "fired by software when the board has fired");
        return false;
    }
    return true;
}

static void fire(struct lumi_engine *e)
{
    lumi_wire_Request request = {.which_command = lumi_wire_Request_test_triggers_tag};

    request.command.test_triggers.cameras = 1u << e->cameras[e->test_camera].rig;
    request.command.test_triggers.exposure = e->plan.exposures[0];
    e->test_ns = e->now;
    if (e->test_rounds == 0)
        e->test_first_ns = e->now;
    e->test_told = false;
    e->cameras[e->test_camera].round_seen = false;
    engine_ask(e, &request);
}

/* The next camera's turn; false: all have had theirs. Before a sweep that goes on only those whose clock is in doubt.
 */
static bool next_camera(struct lumi_engine *e)
{
    while (++e->test_camera < e->config.camera_count) {
        const struct engine_camera *c = e->cameras + e->test_camera;
        if (e->stage == STAGE_TEST && c->trusted && c->misses < DOUBT)
            continue;
        if (!testable(e, e->test_camera))
            continue;
        e->test_rounds = e->test_again = 0;
        e->cameras[e->test_camera].trusted = false;
        e->cameras[e->test_camera].answer_count = 0;
        return true;
    }
    return false;
}

static void judge_tests(struct lumi_engine *e)
{
    for (int c = 0; c < e->config.camera_count; c++) {
        struct engine_held *held = e->cameras[c].test;
        struct engine_judging *job = NULL;
        e->cameras[c].test = NULL;
        for (int i = 0; held && e->ports.judge && i < ENGINE_JUDGING && !job; i++)
            job = e->jobs[i].used ? NULL : &e->jobs[i];
        if (!job || !e->config.judging) {
            engine_held_drop(held);
            continue;
        }
        *job = (struct engine_judging){.used = true, .id = ++e->judge_serial, .shot = -1, .camera = c, .held = held};
        struct lumi_engine_judge_job asked = {.id = job->id,
                                              .camera = c,
                                              .shot = -1,
                                              .frame = held->frame,
                                              .lens = &e->rig.lenses[e->rig.cameras[e->cameras[c].rig].lens].lens,
                                              .exposure_s = e->plan.exposures[0],
                                              .gain = held->frame->gain};
        asked.pose = (struct lumi_pose){.r = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
        e->judging++;
        e->ports.judge(e->ports.context, &asked);
    }
}

static bool answered(struct lumi_engine *e)
{
    if (e->ask.code == LUMI_ERR_BUSY && e->stage_at++ < BUSY_TRIES) { /* the one before is still going on */
        engine_ask_none(e);
        engine_wake(e, BUSY_SECONDS);
        e->test_ns = 0;
        e->stage_ns = e->now;
        return false;
    }
    if (e->ask.code != LUMI_OK) {
        check(e, e->test_camera, LUMI_RED, "trigger", e->ask.text);
        return true;
    }
    if (!e->test_told) { /* now it is fired; a frame that was quicker has the time of the question */
        e->test_ns = e->now;
        e->test_told = true;
        e->test_rounds++;
    }
    const struct engine_camera *c = e->cameras + e->test_camera;
    const double waited = engine_since(e, e->test_ns), exposure = e->plan.exposures[0];
    if (waited < fmax(TEST_SECONDS, e->config.frame_patience) + exposure &&
        !(c->round_seen && (e->test_rounds > 1 || waited > OTHERS_SECONDS))) {
        engine_wake(e, 0.05);
        return false;
    }
    if (c->round_seen && !c->trusted && e->test_rounds < ROUNDS) { /* and once more */
        engine_ask_none(e);
        fire(e);
        return false;
    }
    /* One frame may be lost on its way, above all where the computer is busy: a trigger that is not wired fails twice.
     */
    if (e->stage == STAGE_TRIGGERS && c->seen == 0 && e->test_again == 0) {
        e->test_again++;
        e->test_rounds = 0;
        engine_ask_none(e);
        fire(e);
        return false;
    }
    if (e->stage == STAGE_TRIGGERS)
        tell_seen(e, e->test_camera);
    else if (!c->trusted) {
        e->cameras[e->test_camera].doubtful = true;
        engine_incident(e, e->test_camera, "test", "%s does not answer its test trigger as it should",
                        e->config.cameras[e->test_camera].name);
    }
    return true;
}

/* True: all have had their turn. */
static bool test_all(struct lumi_engine *e)
{
    if (e->stage_at == 0) {
        e->stage_at = 1;
        e->test_camera = -1;
        e->test_ns = 0;
        if (e->faults || e->estop || !next_camera(e))
            return true;
    }
    while (e->test_camera < e->config.camera_count) {
        if (!engine_asked(e)) {
            if (e->stage_at > 1 && engine_since(e, e->stage_ns) < BUSY_SECONDS) {
                engine_wake(e, BUSY_SECONDS);
                return false;
            }
            fire(e);
            return false;
        }
        if (!e->ask.answered || !answered(e))
            return false;
        engine_ask_none(e);
        e->stage_at = 1;
        next_camera(e);
    }
    return true;
}

bool engine_stage_triggers(struct lumi_engine *e)
{
    if (e->stage_at < TESTED) {
        for (int c = 0; c < e->config.camera_count && e->stage_at == 0; c++)
            e->cameras[c].seen = 0;
        if (!test_all(e))
            return false;
        e->stage_at = TESTED;
        e->test_camera = -1;
        judge_tests(e);
    }
    if (e->judging > 0)
        return false;
    engine_go(e, STAGE_VERDICT);
    return true;
}

/* What the cameras are still to send of what was before must not pass for an answer to a test. */
bool engine_stage_test(struct lumi_engine *e)
{
    if (e->stage_at == 0) {
        for (int c = 0; c < e->config.camera_count; c++)
            if (e->cameras[c].used && e->cameras[c].match && lumi_match_open(e->cameras[c].match) > 0) {
                engine_wake(e, 0.2);
                return false;
            }
        for (int c = 0; c < e->config.camera_count; c++)
            e->cameras[c].seen = 0;
    }
    if (!test_all(e))
        return false;
    e->test_camera = -1;
    for (int c = 0; c < e->config.camera_count; c++) {
        engine_held_drop(e->cameras[c].test);
        e->cameras[c].test = NULL;
    }
    engine_go(e, STAGE_LOAD);
    return true;
}
