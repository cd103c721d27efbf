/* The order of all that happens around a capture engine. */
#include "capture_world.h"

#include "proto/base/memory.h"
#include "sim/random.h"

#include <glib.h>
#include <glib/gstdio.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define HOST_BEGAN (1000 * WORLD_SECOND) /* CLOCK_MONOTONIC when the world begins */
#define UTC_BEGAN (INT64_C(1790000000) * WORLD_SECOND)

bool world_wrong(struct world *w, const char *format, ...)
{
    va_list arguments;

    va_start(arguments, format);
    if (!w->why[0])
        vsnprintf(w->why, sizeof w->why, format, arguments);
    va_end(arguments);
    return false;
}

double world_random(struct world *w)
{
    return sim_random_unit(sim_random(w->options.seed, w->drawn++, 977));
}

int64_t world_host_ns(const struct world *w, uint64_t ticks)
{
    int64_t ns = (int64_t)(ticks / 84 * 1000 + ticks % 84 * 1000 / 84);

    return HOST_BEGAN + ns + (int64_t)((double)ns * w->host_drift);
}

/* The first tick that is not before this time of the host. */
static uint64_t ticks_of(const struct world *w, int64_t host_ns)
{
    double ns = (double)(host_ns - HOST_BEGAN) / (1 + w->host_drift);
    uint64_t ticks = ns > 0 ? (uint64_t)(ns * 0.084) : 0;

    while (world_host_ns(w, ticks) < host_ns)
        ticks++;
    return ticks;
}

double world_seconds(const struct world *w)
{
    return (double)(w->now_ns - HOST_BEGAN) * 1e-9;
}

/* ---- events ---- */

struct world_event *world_event_add(struct world *w, int64_t at_ns, enum world_event_kind kind, int camera)
{
    struct world_event *event = calloc(1, sizeof *event), **at = &w->events;

    event->at_ns = at_ns;
    event->kind = kind;
    event->camera = camera;
    event->generation = w->generation;
    while (*at && (*at)->at_ns <= at_ns)
        at = &(*at)->next;
    event->next = *at;
    *at = event;
    return event;
}

void world_event_free(struct world_event *event)
{
    lumi_judge_picture_destroy(event->picture);
    free(event);
}

/* ---- what the engine asks ---- */

static void port_request(void *context, uint32_t number, const lumi_wire_Request *request)
{
    world_board_request(context, number, false, request);
}

static void port_profile(void *context, uint32_t number)
{
    world_board_request(context, number, true, NULL);
}

static void port_stored(void *context, const lumi_wire_Event *event)
{
    struct world *w = context;

    world_ack_check(w, event);
    lumi_wire_client_stored(&w->client, event->boot, event->number, (uint64_t)w->now_ns);
}

static void port_emergency_stop(void *context)
{
    struct world *w = context;

    lumi_wire_client_emergency_stop(&w->client, (uint64_t)w->now_ns);
}

static int64_t port_to_host(void *context, uint64_t board_ns)
{
    struct world *w = context;

    return lumi_clock_matched(&w->clock) ? (int64_t)lumi_clock_to_host(&w->clock, board_ns) : 0;
}

static void port_camera(void *context, int camera, uint32_t number, const struct lumi_camera_command *command)
{
    world_camera_command(context, camera, number, command);
}

static void port_judge(void *context, const struct lumi_engine_judge_job *job)
{
    world_judge(context, job);
}

static void port_hand_over(void *context, const char *capture)
{
    struct world *w = context;

    snprintf(w->sealed, sizeof w->sealed, "%s", capture);
    w->sealed_count++;
}

static void port_told(void *context, const struct lumi_engine_told *told)
{
    static const char *const kinds[] = {"state", "check", "shot", "frame", "incident", "sealed"};
    struct world *w = context;

    w->incidents += told->kind == LUMI_TALE_INCIDENT;
    w->shots_told += told->kind == LUMI_TALE_SHOT;
    if (w->trace)
        fprintf(stderr, "%9.3f %s shot %d camera %d %s%s%s\n", world_seconds(w), kinds[told->kind], told->shot,
                told->camera, told->lost ? "lost " : "",
                told->kind == LUMI_TALE_FRAME ? lumi_frame_state_name(told->frame_state) : "", told->text);
}

/* ---- the daemon ---- */

static void configure(struct world *w)
{
    struct lumi_engine_config *c = &w->config;

    lumi_engine_config_init(c);
    snprintf(c->folder, sizeof c->folder, "%s", w->folder);
    c->camera_count = w->rig.camera_count;
    for (int i = 0; i < c->camera_count; i++) {
        struct lumi_engine_camera *camera = &c->cameras[i];
        snprintf(camera->name, sizeof camera->name, "%s", w->rig.cameras[i].name);
        snprintf(camera->address, sizeof camera->address, "aravis:SIM-%s", w->rig.cameras[i].name);
        lumi_camera_setting_init(&camera->setting);
        camera->setting.trigger = LUMI_TRIGGER_HARDWARE;
        camera->sync_line = w->options.sync_lines;
    }
    c->store.synchronous = true;
    c->store.memory = w->options.store_memory;
    c->store.disk = world_disk_answer;
    c->store.context = w;
    c->wind_up = !w->rig.string.held;
}

static bool died(const struct world *w)
{
    return w->options.dead && w->engine && w->options.dead(w->engine);
}

bool world_daemon_start(struct world *w)
{
    const struct lumi_engine_ports ports = {.context = w,
                                            .rig_request = port_request,
                                            .rig_read_profile = port_profile,
                                            .rig_stored = port_stored,
                                            .rig_emergency_stop = port_emergency_stop,
                                            .rig_to_host = port_to_host,
                                            .camera_command = port_camera,
                                            .judge = port_judge,
                                            .hand_over = port_hand_over,
                                            .told = port_told};
    struct lumi_error error = {0};
    bool found = false;

    w->config.utc_offset_ns = w->utc_offset_ns;
    world_board_restart_host(w);
    world_cameras_daemon_gone(w);
    if (lumi_engine_create(&w->config, &ports, w->now_ns, &w->engine, &error) != LUMI_OK)
        return world_wrong(w, "no engine: %s", error.text);
    lumi_engine_disk(w->engine, w->now_ns, w->disk.free_bytes, w->disk.rate);
    w->disk.told_ns = w->now_ns;
    if (lumi_engine_recover(w->engine, w->now_ns, &found, &error) != LUMI_OK && !died(w))
        return world_wrong(w, "not recovered: %s", error.text);
    if (w->trace)
        fprintf(stderr, "%9.3f daemon started, %s\n", world_seconds(w),
                found ? "a capture was found" : "nothing found");
    return true;
}

void world_daemon_stop(struct world *w)
{
    struct lumi_engine *engine = w->engine;

    w->engine = NULL;
    lumi_engine_destroy(engine);
    w->generation++;
    w->disk.due_ns = 0;
    world_ack_close(w);
}

/* What the directory holds now is what is left: whatever the engine does to it while it is taken down goes nowhere. */
void world_daemon_kill(struct world *w)
{
    g_autofree char *corpse = g_strconcat(w->folder, ".corpse", NULL);

    if (!w->engine)
        return;
    if (w->trace)
        fprintf(stderr, "%9.3f killed%s\n", world_seconds(w), w->killed_inside ? " inside the store" : "");
    if (w->options.dead) { /* really */
        world_daemon_stop(w);
        w->hanging = false;
        return;
    }
    if (!w->killed_inside && !world_copy_folder(w->folder, corpse))
        world_wrong(w, "%s cannot be copied", w->folder);
    w->killed_inside = true;
    world_daemon_stop(w);
    w->killed_inside = false;
    w->hanging = false;
    world_remove_folder(w->folder);
    if (g_rename(corpse, w->folder) != 0)
        world_wrong(w, "%s cannot be put in its place", corpse);
}

const struct lumi_engine_status *world_status(struct world *w)
{
    if (w->engine)
        lumi_engine_status(w->engine, w->status);
    return w->status;
}

void world_clock_step(struct world *w, double seconds)
{
    w->utc_offset_ns += (int64_t)(seconds * 1e9);
    if (w->engine)
        lumi_engine_clock(w->engine, w->utc_offset_ns);
}

void world_set_script(struct world *w, struct world_script *script)
{
    w->script = script;
    w->script_began_ns = w->now_ns;
}

void world_hang(struct world *w, bool hanging)
{
    w->hanging = hanging && w->engine;
}

/* ---- life ---- */

void world_options_init(struct world_options *options)
{
    *options = (struct world_options){.seed = 1,
                                      .link = BOARD_LINK_USB,
                                      .link_delay = 0.5e-3,
                                      .link_rate = 500e3,
                                      .width = 64,
                                      .height = 48,
                                      .store_memory = 4 << 20};
}

static bool make_folder(struct world *w)
{
    const char *base = g_access("/dev/shm", W_OK) == 0 ? "/dev/shm" : g_get_tmp_dir();

    if (w->options.folder) {
        snprintf(w->folder, sizeof w->folder, "%s", w->options.folder);
        return true;
    }
    w->own_folder = true;
    snprintf(w->folder, sizeof w->folder, "%s/lumi-world-XXXXXX", base);
    return mkdtemp(w->folder) || world_wrong(w, "%s: no folder can be made", base);
}

bool world_create(struct world *w, const struct world_options *options)
{
    w->options = *options;
    w->utc_offset_ns = UTC_BEGAN - HOST_BEGAN;
    w->trace = g_getenv("LUMI_WORLD_TRACE") != NULL;
    w->status = calloc(1, sizeof *w->status);
    w->disk = (struct world_disk){.free_bytes = INT64_C(1) << 34, .rate = 200e6, .latency = 0.5e-3};
    w->now_ns = HOST_BEGAN;
    if (!make_folder(w) || !world_pictures_create(w) || !world_cameras_create(w))
        return false;
    w->host_drift = (world_random(w) - 0.5) * 60e-6;
    if (!world_board_create(w))
        return false;
    configure(w);
    return true;
}

void world_destroy(struct world *w)
{
    if (w->engine)
        world_daemon_stop(w);
    if (w->frames_out)
        world_wrong(w, "%d frames were never released", w->frames_out);
    if (w->waiting_most > w->options.store_memory)
        world_wrong(w, "%zu bytes waited to be written, and %zu are allowed", w->waiting_most, w->options.store_memory);
    world_board_destroy(w);
    world_cameras_destroy(w);
    if (w->own_folder)
        world_remove_folder(w->folder);
    lumi_free(w->picture);
    free(w->status);
}

/* ---- time ---- */

static void dispatch(struct world *w)
{
    while (w->events && w->events->at_ns <= w->now_ns && !w->killed_inside) {
        struct world_event *event = w->events;
        w->events = event->next;
        world_camera_event(w, event);
        world_event_free(event);
    }
}

static int64_t next_of_all(const struct world *w)
{
    int64_t next = world_board_next(w);
    const int64_t others[] = {world_cameras_next(w), world_disk_next(w), w->events ? w->events->at_ns : INT64_MAX,
                              w->engine ? lumi_engine_next(w->engine) : INT64_MAX};

    for (size_t i = 0; i < sizeof others / sizeof others[0]; i++)
        next = others[i] < next ? others[i] : next;
    return next;
}

/* Bytes from the board, or a trigger. */
static bool something(struct sim_machine *machine, void *context)
{
    struct world *w = context;
    int count;

    if (!w->hanging && w->engine && w->read_size < sizeof w->read_ahead)
        w->read_size += sim_machine_get(machine, w->read_ahead + w->read_size, sizeof w->read_ahead - w->read_size);
    sim_mechanics_exposures(sim_machine_mechanics(machine), &count);
    return w->read_size > 0 || count > w->exposure_count;
}

static void serve(struct world *w)
{
    if (!w->engine || w->hanging)
        return;
    world_board_service(w);
    dispatch(w); /* before a camera comes, so that after a hang its going is told first */
    if (!w->killed_inside)
        world_cameras_service(w);
    world_disk_service(w);
    if (!w->killed_inside && lumi_engine_next(w->engine) <= w->now_ns)
        lumi_engine_run(w->engine, w->now_ns);
    if (w->killed_inside || died(w))
        world_daemon_kill(w);
}

bool world_run_until(struct world *w, world_condition done, void *context, double seconds)
{
    int64_t limit = w->now_ns + (int64_t)(seconds * 1e9), before = 0;
    int standing = 0; /* rounds without a tick */

    for (;;) {
        standing = w->now_ns == before ? standing + 1 : 0;
        before = w->now_ns;
        if (standing > 100000)
            world_wrong(w, "the engine wants to be called again and again at one time");
        if (w->why[0] || (done && done(w, context)))
            return !w->why[0];
        if (w->now_ns >= limit)
            return false;
        int64_t next = !w->engine || w->hanging ? limit : next_of_all(w), script = world_script_next(w);
        next = script < next ? script : next;
        uint64_t now = sim_machine_now(w->machine), until = ticks_of(w, next < limit ? next : limit);
        if (until > now)
            sim_machine_run_until(w->machine, something, w, ((double)(until - now) + 0.5) / BOARD_TICK_HZ);
        w->now_ns = world_host_ns(w, sim_machine_now(w->machine));
        world_cameras_look(w);
        world_script_service(w);
        serve(w);
    }
}

void world_run(struct world *w, double seconds)
{
    world_run_until(w, NULL, NULL, seconds);
}
