/* Cameras as daemon/camera's threads show them: what the triggers exposed arrives as frames, with a clock and a count
 * of their own, after the time a camera and its cable take; or does not. */
#include "capture_world.h"

#include "firmware/core/core_state.h"

#include <glib.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define STATUS_NS WORLD_SECOND
#define POOL 8

static double unit(struct world *w)
{
    return world_random(w);
}

/* ---- life ---- */

static void plug_in(struct world *w, int camera, double seconds)
{
    struct world_camera *c = &w->cameras[camera];

    c->there = true;
    c->clock_zero_ns = w->now_ns;
    c->clock_offset_ns = (int64_t)(unit(w) * 1e12);
    c->came_ns = w->now_ns + (int64_t)(seconds * 1e9);
    c->sequence = c->gap = 0;
}

bool world_cameras_create(struct world *w)
{
    for (int i = 0; i < w->rig.camera_count; i++) {
        struct world_camera *c = &w->cameras[i];
        c->clock_drift = (unit(w) - 0.5) * 100e-6;
        c->clock_jitter_ns = unit(w) * 30000;
        plug_in(w, i, 0);
    }
    return true;
}

void world_cameras_destroy(struct world *w)
{
    while (w->events) {
        struct world_event *event = w->events;
        w->events = event->next;
        world_event_free(event);
    }
    free(w->exposures);
}

/* The program that had them open is gone: they stop, and are found anew by the next. */
void world_cameras_daemon_gone(struct world *w)
{
    for (int i = 0; i < w->rig.camera_count; i++) {
        struct world_camera *c = &w->cameras[i];
        c->known = c->configured = c->armed = c->want_configured = c->want_armed = false;
        c->generation++;
        c->out = 0;
        c->sequence = c->gap = 0;
        c->frames = c->dropped = c->damaged = 0;
        c->came_ns = c->there ? w->now_ns + (int64_t)((0.2 + unit(w)) * 1e9) : 0;
    }
}

void world_camera_unplug(struct world *w, int camera, bool unplugged)
{
    struct world_camera *c = &w->cameras[camera];

    if (!c->there == unplugged)
        return;
    if (!unplugged) {
        plug_in(w, camera, 1.4);
        return;
    }
    c->there = c->configured = c->armed = false;
    c->generation++;
    c->came_ns = 0;
    if (c->known) {
        struct world_event *e = world_event_add(w, w->now_ns + 50 * WORLD_MS, WORLD_EVENT_NOTICE, camera);
        e->notice.kind = LUMI_CAMERA_GONE;
        e->notice.code = LUMI_ERR_IO;
        snprintf(e->notice.text, sizeof e->notice.text, "camera %s was unplugged", w->rig.cameras[camera].name);
    }
    c->known = false;
}

/* ---- exposures ---- */

/* The plan's number of what the firmware fires just now by this camera's line. */
static int shot_of(const struct world *w, int camera, uint64_t tick)
{
    const struct firing *firing = &host_board_core(sim_machine_board(w->machine))->firing;
    int best = -1;
    uint64_t nearest = BOARD_TICK_HZ;

    for (int i = 0; i < FIRING_SLOTS; i++) {
        const struct firing_slot *slot = &firing->slots[i];
        if (slot->use == SLOT_FREE || slot->number == FIRING_NO_SHOT || !(slot->risen >> camera & 1))
            continue;
        uint64_t rose = slot->middle + (uint64_t)slot->edge[camera];
        uint64_t off = rose > tick ? rose - tick : tick - rose;
        if (off < nearest) {
            nearest = off;
            best = (int)slot->number;
        }
    }
    return nearest <= 84 * 200 ? best : -1;
}

static int64_t device_time(struct world *w, const struct world_camera *c, int64_t at_ns)
{
    double drifted = (double)(at_ns - c->clock_zero_ns) * (1 + c->clock_drift) + (unit(w) - 0.5) * c->clock_jitter_ns;

    return c->clock_offset_ns + (int64_t)drifted;
}

static void add_frame(struct world *w, int camera, int record, unsigned flaws, int64_t begin_ns, int64_t arrives_ns)
{
    struct world_camera *c = &w->cameras[camera];
    struct world_event *e = world_event_add(w, arrives_ns, WORLD_EVENT_FRAME, camera);

    e->generation = c->generation;
    e->record = record;
    e->flaws = flaws;
    e->frame.sequence = c->sequence;
    e->frame.gap = c->gap;
    e->frame.device_ns = device_time(w, c, begin_ns);
    e->frame.exposure_s = record >= 0 ? w->exposures[record].exposure_s : c->exposure_s;
    e->frame.gain = c->gain;
    c->gap = 0;
}

static bool used(int *faults)
{
    if (*faults <= 0)
        return false;
    --*faults;
    return true;
}

static void edge(struct world *w, int camera, int64_t begin_ns)
{
    struct world_event *e;

    if (!w->options.sync_lines || used(&w->cameras[camera].sync_missing))
        return;
    e = world_event_add(w, begin_ns + WORLD_MS / 2, WORLD_EVENT_SYNC, camera);
    e->edge_ns = begin_ns + (int64_t)((unit(w) - 0.5) * 10000);
}

/* An exposure of a camera that was armed: it becomes a frame, unless something happens to it. */
static void take_frame(struct world *w, int record)
{
    struct world_exposure *x = &w->exposures[record];
    struct world_camera *c = &w->cameras[x->camera];
    double wanted = x->shot >= 0 ? w->plan.exposures[x->shot % w->plan.bracket] : c->exposure_s;
    int64_t arrives = x->begin_ns + (int64_t)((c->exposure_s + 0.015 + 0.01 * unit(w)) * 1e9);
    int buffers = c->setting.buffers > 0 ? c->setting.buffers : POOL;

    x->taken = true;
    edge(w, x->camera, x->begin_ns);
    c->sequence++;
    if (x->shot >= 0 && (used(&c->blur) || unit(w) < w->options.blurred))
        x->flaws |= WORLD_BLURRED;
    if (used(&c->damage))
        x->flaws |= WORLD_DAMAGED;
    x->exposure_s = c->exposure_s * (used(&c->wrong_exposure) ? 4 : 1);
    if (fabs(x->exposure_s / wanted - 1) > 0.05)
        x->flaws |= WORLD_WRONG_EXPOSURE;
    if (used(&c->drop) || c->out >= buffers) {
        c->dropped++;
        c->gap++;
        return;
    }
    if (used(&c->late))
        arrives += c->late_by_ns;
    if (used(&c->swap))
        arrives += (int64_t)(1.6e9 * w->plan.turn_time / w->plan.positions);
    if (arrives < c->stalled_until_ns)
        arrives = c->stalled_until_ns;
    add_frame(w, x->camera, record, x->flaws, x->begin_ns, arrives);
    if (used(&c->doubled))
        add_frame(w, x->camera, record, x->flaws, x->begin_ns, arrives + (int64_t)(unit(w) * 0.2e9));
}

/* It fires once more by itself, as soon as it can again. */
static void stray(struct world *w, int camera, int64_t begin_ns)
{
    int64_t again = begin_ns + (int64_t)((0.25 + 0.2 * unit(w)) * 1e9 * w->plan.turn_time / w->plan.positions);

    w->cameras[camera].sequence++;
    add_frame(w, camera, -1, WORLD_SPURIOUS, again, again + 20 * WORLD_MS);
}

static void take(struct world *w, int record)
{
    const struct world_exposure *x = &w->exposures[record];

    take_frame(w, record);
    if (x->shot >= 0 && used(&w->cameras[x->camera].spurious))
        stray(w, x->camera, x->begin_ns);
}

void world_cameras_look(struct world *w)
{
    int count;
    const struct sim_exposure *records = sim_mechanics_exposures(sim_machine_mechanics(w->machine), &count);

    for (; w->exposure_count < count; w->exposure_count++) {
        const struct sim_exposure *r = &records[w->exposure_count];
        if (w->exposure_count == w->exposure_room) {
            w->exposure_room = w->exposure_room ? 2 * w->exposure_room : 256;
            w->exposures = realloc(w->exposures, (size_t)w->exposure_room * sizeof *w->exposures);
        }
        struct world_exposure *x = &w->exposures[w->exposure_count];
        const struct world_camera *c = &w->cameras[r->camera];
        memset(x, 0, sizeof *x);
        x->camera = r->camera;
        x->shot = shot_of(w, r->camera, r->trigger);
        x->begin_ns = world_host_ns(w, r->begin);
        if (x->shot >= w->shots_fired)
            w->shots_fired = x->shot + 1;
        if (!r->lost && c->there && c->armed && !used(&w->cameras[r->camera].vanish))
            take(w, w->exposure_count);
    }
}

void world_spurious_frame(struct world *w, int camera)
{
    struct world_camera *c = &w->cameras[camera];

    if (!c->there || !c->armed)
        return;
    c->spurious++;
}

void world_spurious_edge(struct world *w, int camera)
{
    struct world_event *e = world_event_add(w, w->now_ns, WORLD_EVENT_SYNC, camera);

    e->edge_ns = w->now_ns;
}

/* ---- what the daemon hears ---- */

static void identify(const struct world *w, int camera, struct lumi_camera_identity *identity)
{
    memset(identity, 0, sizeof *identity);
    identity->backend = LUMI_CAMERA_ARAVIS;
    snprintf(identity->serial, sizeof identity->serial, "SIM-%s", w->rig.cameras[camera].name);
    snprintf(identity->vendor, sizeof identity->vendor, "Lumisphere");
    snprintf(identity->model, sizeof identity->model, "Virtual");
    snprintf(identity->firmware, sizeof identity->firmware, "1");
    snprintf(identity->address, sizeof identity->address, "127.0.0.%d", camera + 2);
    identity->hardware_trigger = identity->software_trigger = true;
    identity->exposure_control = identity->gain_control = true;
    identity->device_clock = true;
    identity->clock_step_ns = 1;
}

static void fill_status(const struct world *w, int camera, struct lumi_camera_status *status)
{
    const struct world_camera *c = &w->cameras[camera];

    memset(status, 0, sizeof *status);
    status->armed = c->armed;
    status->format.width = w->options.width;
    status->format.height = w->options.height;
    status->format.layout = w->options.raw ? LUMI_LAYOUT_BAYER : LUMI_LAYOUT_JPEG;
    status->format.bits = 8;
    status->format.stride = w->options.raw ? w->options.width : 0;
    status->exposure_s = c->exposure_s;
    status->gain = c->gain;
    status->temperature = 40;
    status->battery = NAN;
    status->card_free_bytes = -1;
    status->frames = c->frames;
    status->dropped = c->dropped;
    status->damaged = c->damaged;
}

static void tell(struct world *w, int camera, struct lumi_camera_notice *notice)
{
    notice->host_ns = w->now_ns;
    if (w->engine)
        lumi_engine_camera_notice(w->engine, w->now_ns, camera, notice);
    else if (notice->frame)
        lumi_camera_frame_release(notice->frame);
}

static void tell_status(struct world *w, int camera)
{
    struct lumi_camera_notice notice = {.kind = LUMI_CAMERA_STATUS};

    w->cameras[camera].status_ns = w->now_ns;
    fill_status(w, camera, &notice.status);
    tell(w, camera, &notice);
}

static void come(struct world *w, int camera)
{
    struct world_camera *c = &w->cameras[camera];
    struct lumi_camera_notice notice = {.kind = LUMI_CAMERA_CAME};

    c->came_ns = 0;
    c->known = true;
    c->configured = c->want_configured;
    c->armed = c->want_armed;
    identify(w, camera, &notice.identity);
    tell(w, camera, &notice);
    tell_status(w, camera);
}

static void arrive(struct world *w, const struct world_event *e)
{
    struct world_camera *c = &w->cameras[e->camera];
    struct lumi_camera_notice notice = {.kind = LUMI_CAMERA_FRAME};
    struct world_frame *f;

    if (e->generation != c->generation || !c->known)
        return;
    f = world_frame_create(w, e->camera, e->record, e->flaws);
    f->frame.device_ns = e->frame.device_ns;
    f->frame.host_ns = w->now_ns;
    f->frame.sequence = e->frame.sequence;
    f->frame.gap = e->frame.gap;
    f->frame.exposure_s = e->frame.exposure_s;
    f->frame.gain = e->frame.gain;
    c->frames++;
    c->damaged += f->frame.damaged;
    if (e->record >= 0)
        w->exposures[e->record].delivered = true;
    notice.frame = &f->frame;
    tell(w, e->camera, &notice);
}

/* ---- commands ---- */

void world_camera_command(struct world *w, int camera, uint32_t number, const struct lumi_camera_command *command)
{
    struct world_event *e =
        world_event_add(w, w->now_ns + (int64_t)((0.002 + 0.001 * camera) * 1e9), WORLD_EVENT_COMMAND, camera);

    e->number = number;
    e->command = *command;
}

static int obey(struct world *w, int camera, const struct lumi_camera_command *command)
{
    struct world_camera *c = &w->cameras[camera];

    switch (command->kind) {
    case LUMI_CAMERA_CONFIGURE:
        c->setting = command->setting;
        c->exposure_s = command->setting.exposure_s > 0 ? command->setting.exposure_s : 0.01;
        c->gain = command->setting.gain > 0 ? command->setting.gain : 1;
        c->configured = c->want_configured = true;
        return LUMI_OK;
    case LUMI_CAMERA_ARM:
        if (!c->armed)
            c->sequence = c->gap = 0;
        c->armed = c->want_armed = true;
        return LUMI_OK;
    case LUMI_CAMERA_DISARM:
        c->generation += c->armed;
        c->armed = c->want_armed = false;
        return LUMI_OK;
    case LUMI_CAMERA_EXPOSE:
        c->exposure_s = command->exposure_s > 0 ? command->exposure_s : c->exposure_s;
        c->gain = command->gain > 0 ? command->gain : c->gain;
        return LUMI_OK;
    default:
        return c->armed && c->setting.trigger == LUMI_TRIGGER_SOFTWARE ? LUMI_OK : LUMI_ERR_BUSY;
    }
}

static void do_command(struct world *w, const struct world_event *e)
{
    struct world_camera *c = &w->cameras[e->camera];
    struct lumi_camera_notice notice = {.kind = LUMI_CAMERA_DONE, .command = e->number};
    bool kept = e->command.kind == LUMI_CAMERA_CONFIGURE || e->command.kind == LUMI_CAMERA_ARM ||
                e->command.kind == LUMI_CAMERA_DISARM;

    if (!c->known && kept) { /* until it is back */
        struct world_event *again = world_event_add(w, w->now_ns + 100 * WORLD_MS, WORLD_EVENT_COMMAND, e->camera);
        again->number = e->number;
        again->command = e->command;
        return;
    }
    notice.code = c->known ? obey(w, e->camera, &e->command) : LUMI_ERR_IO;
    if (notice.code != LUMI_OK)
        snprintf(notice.text, sizeof notice.text, "camera %s cannot", w->rig.cameras[e->camera].name);
    tell(w, e->camera, &notice);
    if (c->known)
        tell_status(w, e->camera);
}

/* ---- the judge ---- */

static void look_really(const struct lumi_engine_judge_job *job, struct world_event *e)
{
    struct lumi_error error = {0};

    e->code = lumi_judge_picture_create(job->frame, &e->picture, &error);
    if (e->code == LUMI_OK)
        e->code = lumi_judge_measure(e->picture, job->lens, &job->pose, job->exposure_s, job->gain, job->neighbours,
                                     job->neighbour_count, &e->numbers, &error);
}

/* In memory, or in the capture already. */
static bool find_truth(const struct lumi_camera_frame *frame, struct world_truth *truth)
{
    g_autofree char *data = NULL;
    gsize size;

    if (frame->format.layout != LUMI_LAYOUT_FILE)
        return world_truth_find(frame->data, frame->size, truth);
    return g_file_get_contents(frame->path, &data, &size, NULL) && world_truth_find(data, size, truth);
}

void world_judge(struct world *w, const struct lumi_engine_judge_job *job)
{
    struct world_event *e =
        world_event_add(w, w->now_ns + (int64_t)((0.02 + 0.05 * unit(w)) * 1e9), WORLD_EVENT_JUDGED, job->camera);
    struct world_truth truth = {0};

    e->judge = job->id;
    if (w->options.judge_really) {
        look_really(job, e);
        return;
    }
    if (!find_truth(job->frame, &truth))
        world_wrong(w, "the judge was given a frame that is none of ours");
    e->numbers = (struct lumi_judge_numbers){
        .sharpness = 0.5, .blur_pixels = 0.3, .clipped = 0.01, .dark = 0.01, .mean = 0.4, .shift_pixels = NAN};
    e->numbers.exposure_stops = job->neighbour_count > 0 ? 0 : NAN;
    /* It sees blur, nothing else: damage and wrong exposures are the engine's to find, by what the camera says. */
    if (truth.flaws & WORLD_BLURRED) { /* no two of one length and direction */
        e->numbers.blur_pixels = 4 + 8 * fmod((double)job->id * 0.7549, 1);
        e->numbers.blur_angle = LUMI_PI * fmod((double)job->id * 0.5698, 1);
    }
}

static void judged(struct world *w, struct world_event *e)
{
    struct lumi_judge_picture *picture = e->picture;

    if (!w->engine)
        return;
    e->picture = NULL;
    lumi_engine_judged(w->engine, w->now_ns, e->judge, e->code, e->code == LUMI_OK ? "" : "it is no picture",
                       e->code == LUMI_OK ? &e->numbers : NULL, picture);
}

/* ---- service ---- */

void world_camera_event(struct world *w, struct world_event *e)
{
    struct lumi_camera_notice notice = e->notice;

    if (e->kind == WORLD_EVENT_FRAME)
        arrive(w, e);
    else if (e->generation != w->generation)
        return;
    else if (e->kind == WORLD_EVENT_NOTICE)
        tell(w, e->camera, &notice);
    else if (e->kind == WORLD_EVENT_COMMAND)
        do_command(w, e);
    else if (e->kind == WORLD_EVENT_JUDGED)
        judged(w, e);
    else if (w->engine)
        lumi_engine_sync_edge(w->engine, w->now_ns, e->camera, e->edge_ns, 0);
}

void world_cameras_service(struct world *w)
{
    for (int i = 0; i < w->rig.camera_count; i++) {
        struct world_camera *c = &w->cameras[i];
        if (c->there && !c->known && c->came_ns && w->now_ns >= c->came_ns && w->engine)
            come(w, i);
        else if (c->known && w->now_ns - c->status_ns >= STATUS_NS)
            tell_status(w, i);
    }
}

int64_t world_cameras_next(const struct world *w)
{
    int64_t next = INT64_MAX;

    for (int i = 0; i < w->rig.camera_count && w->engine; i++) {
        const struct world_camera *c = &w->cameras[i];
        int64_t at = c->known ? c->status_ns + STATUS_NS : c->there && c->came_ns ? c->came_ns : INT64_MAX;
        next = at < next ? at : next;
    }
    return next;
}
