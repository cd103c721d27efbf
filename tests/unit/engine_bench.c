#include "engine_bench.h"
#include "proto/base/memory.h"
#include "proto/mechanism/kinematics.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define BOARD_OFFSET (-5 * BENCH_NS) /* of the board's clock against the host's */

static void due(struct bench *b, const struct bench_due *thing)
{
    if (b->due_count == b->due_room) {
        b->due_room = b->due_room ? 2 * b->due_room : 64;
        b->due = lumi_realloc(b->due, (size_t)b->due_room, sizeof *b->due);
    }
    b->due[b->due_count++] = *thing;
}

/* ---- the board ---- */

static void tell(struct bench *b, int64_t at, lumi_wire_Event event)
{
    event.number = b->event_number++;
    event.time_ns = (uint64_t)(at + BOARD_OFFSET);
    due(b, &(struct bench_due){.at = at, .kind = 4, .event = event});
}

static void frame(struct bench *b, int64_t begin, int camera, int shot)
{
    unsigned flaws = shot >= 0 ? b->flaws[shot][camera] : 0;
    struct bench_due thing = {.at = begin + BENCH_NS / 20, .kind = 5, .camera = camera, .shot = shot, .begin = begin};

    thing.exposure_s = 1;
    if (shot >= 0)
        b->flaws[shot][camera] = 0;
    if (flaws & BENCH_NO_FRAME || (shot < 0 && b->tests_lost-- > 0))
        return;
    if (flaws & BENCH_LATE)
        thing.at += 3 * BENCH_NS / 2;
    if (flaws & BENCH_EXPOSURE)
        thing.exposure_s *= 2;
    thing.damaged = (flaws & BENCH_DAMAGED) != 0;
    due(b, &thing);
    if (shot < 0 && b->tests_twice) { /* while the next camera is tested */
        thing.at += 2 * BENCH_NS / 5;
        due(b, &thing);
    }
    if (flaws & BENCH_TWICE) {
        thing.at += BENCH_NS / 100;
        due(b, &thing);
    }
}

static void sweep(struct bench *b, const lumi_wire_StartSweep *start)
{
    const double spacing = b->plan.mode == LUMI_PLAN_START_STOP ? lumi_plan_position_seconds(&b->plan)
                                                                : b->plan.turn_time / b->plan.positions;
    int64_t at = b->now + BENCH_NS;
    lumi_wire_Event event = {.which_kind = lumi_wire_Event_shot_tag};

    b->starts++;
    b->state = lumi_wire_State_SWEEPING;
    for (uint32_t shot = start->first_shot; shot < (uint32_t)lumi_plan_shots(&b->plan); shot++) {
        if (start->only_missing && b->shots[shot] == 1)
            continue;
        b->shots[shot] = 1;
        event.kind.shot = (lumi_wire_Shot){
            .number = shot, .channels = 3, .edge_ns_count = 2, .middle_ns = (uint64_t)(at + BOARD_OFFSET)};
        event.kind.shot.step = (double)lumi_plan_position_step(&b->plan, &b->rig, (int)shot / b->plan.bracket);
        for (int c = 0; c < BENCH_CAMERAS; c++) {
            event.kind.shot.edge_ns[c] = -1000000;
            frame(b, at - 1000000, c, (int)shot);
        }
        tell(b, at + BENCH_NS * 2 / 25, event); /* after its frames */
        at += (int64_t)(spacing / b->plan.bracket * 1e9);
    }
    event = (lumi_wire_Event){.which_kind = lumi_wire_Event_sweep_ended_tag};
    tell(b, at + BENCH_NS / 2, event);
    b->sweep_until = at + BENCH_NS / 2;
}

static void request(void *context, uint32_t number, const lumi_wire_Request *asked)
{
    struct bench *b = context;
    struct bench_due answer = {.at = b->now + BENCH_NS / 1000, .kind = 1, .number = number};
    lumi_wire_Event event = {.which_kind = lumi_wire_Event_homed_tag};
    struct lumi_error error;

    answer.reply.result = b->connected ? lumi_wire_Result_DONE : lumi_wire_Result_FAILED;
    if (!b->connected) {
        due(b, &answer);
        return;
    }
    switch (asked->which_command) {
    case lumi_wire_Request_home_tag:
        b->homes++;
        b->home_turn = asked->command.home.turn;
        event.kind.homed.found = true;
        tell(b, b->now + 2 * BENCH_NS, event);
        break;
    case lumi_wire_Request_jog_tag:
        b->jogged = asked->command.jog.turns;
        b->step += (int64_t)(b->jogged * lumi_rig_steps_per_turn(&b->rig));
        break;
    case lumi_wire_Request_test_triggers_tag:
        b->tests_fired++;
        for (int c = 0; c < BENCH_CAMERAS; c++)
            if (asked->command.test_triggers.cameras & 1u << c)
                frame(b, b->now + 3000000, b->exchanged ? 1 - c : c, -1);
        break;
    case lumi_wire_Request_load_plan_tag:
        if (lumi_wire_to_plan(&asked->command.load_plan.plan, &b->plan, &error))
            answer.reply.result = lumi_wire_Result_BAD;
        break;
    case lumi_wire_Request_read_shots_tag:
        answer.reply.which_payload = lumi_wire_Reply_shots_tag;
        answer.reply.payload.shots.count = (uint32_t)lumi_plan_shots(&b->plan);
        answer.reply.payload.shots.states.size = 16;
        for (int i = 0; i < 64; i++)
            answer.reply.payload.shots.states.bytes[i / 4] |= (uint8_t)(b->shots[i] << i % 4 * 2);
        break;
    case lumi_wire_Request_mark_shots_tag:
        for (uint32_t i = 0; i < asked->command.mark_shots.count; i++)
            b->shots[asked->command.mark_shots.first + i] = asked->command.mark_shots.fired;
        break;
    case lumi_wire_Request_start_sweep_tag:
        sweep(b, &asked->command.start_sweep);
        break;
    case lumi_wire_Request_clear_tag:
        b->faults = 0;
        break;
    default:
        break;
    }
    due(b, &answer);
}

static void read_profile(void *context, uint32_t number)
{
    struct bench *b = context;

    due(b, &(struct bench_due){.at = b->now + BENCH_NS / 100, .kind = 2, .number = number});
}

static void stored(void *context, const lumi_wire_Event *event)
{
    ((struct bench *)context)->stored = event->number + 1;
}

static void emergency_stop(void *context)
{
    ((struct bench *)context)->faults |= 1u << LUMI_RIG_FAULT_ESTOP;
}

static int64_t to_host(void *context, uint64_t board_ns)
{
    (void)context;
    return (int64_t)board_ns - BOARD_OFFSET;
}

static void drive_check(void *context, uint32_t number)
{
    struct bench *b = context;

    due(b, &(struct bench_due){.at = b->now + BENCH_NS / 10, .kind = 6, .number = number});
}

static void drive_sweep(void *context, uint32_t number, const struct lumi_rig *rig, const struct lumi_plan *plan,
                        uint32_t first_shot, const uint8_t *states, bool reset)
{
    (void)context, (void)number, (void)rig, (void)plan, (void)first_shot, (void)states, (void)reset;
    abort(); /* nothing here goes so far */
}

/* ---- the cameras ---- */

static void command(void *context, int camera, uint32_t number, const struct lumi_camera_command *asked)
{
    struct bench *b = context;

    if (asked->kind == LUMI_CAMERA_CONFIGURE) {
        b->exposure[camera] = asked->setting.exposure_s;
        b->trigger[camera] = asked->setting.trigger;
    }
    if (asked->kind == LUMI_CAMERA_TRIGGER) {
        if (b->trigger[camera] != LUMI_TRIGGER_SOFTWARE || !b->armed[camera])
            abort();
        b->fired[camera]++;
        frame(b, b->now + 3000000, camera, -1);
    }
    b->armed[camera] = asked->kind == LUMI_CAMERA_ARM ||
                       (b->armed[camera] && asked->kind != LUMI_CAMERA_CONFIGURE && asked->kind != LUMI_CAMERA_DISARM);
    if (asked->kind == LUMI_CAMERA_EXPOSE)
        b->exposure[camera] = asked->exposure_s;
    b->told_exposures += asked->kind == LUMI_CAMERA_EXPOSE;
    due(b, &(struct bench_due){.at = b->now + BENCH_NS / 200, .kind = 3, .camera = camera, .number = number});
}

struct bench_frame {
    struct lumi_camera_frame frame;
    struct bench *bench;
    uint8_t bytes[64 * 48];
};

static void release(struct lumi_camera_frame *frame)
{
    struct bench_frame *whole = frame->owner;

    whole->bench->frames_out--;
    free(whole);
}

static void give_frame(struct bench *b, const struct bench_due *thing)
{
    struct bench_frame *whole = calloc(1, sizeof *whole);
    struct lumi_camera_notice notice = {.kind = LUMI_CAMERA_FRAME, .host_ns = b->now};
    const struct lumi_lens *lens = &b->rig.lenses[0].lens;

    whole->bench = b;
    b->frames_out++;
    memset(whole->bytes, thing->shot + 1, sizeof whole->bytes);
    whole->frame =
        (struct lumi_camera_frame){.format = {.layout = LUMI_LAYOUT_GREY,
                                              .width = lens->width,
                                              .height = lens->height,
                                              .bits = 8,
                                              .stride = lens->width},
                                   .data = whole->bytes,
                                   .size = sizeof whole->bytes,
                                   .device_ns = thing->begin + b->clock_offset[thing->camera],
                                   .host_ns = b->now,
                                   .sequence = ++b->sequence[thing->camera],
                                   .damaged = thing->damaged,
                                   .exposure_s = b->silent ? 0 : thing->exposure_s * b->exposure[thing->camera],
                                   .temperature = NAN,
                                   .file_mtime_ns = LUMI_CAMERA_NO_TIME,
                                   .release = release,
                                   .owner = whole};
    notice.frame = &whole->frame;
    lumi_engine_camera_notice(b->engine, b->now, thing->camera, &notice);
}

/* ---- the rest ---- */

static void judge(void *context, const struct lumi_engine_judge_job *job)
{
    struct bench *b = context;

    due(b, &(struct bench_due){.at = b->now + BENCH_NS / 50, .kind = 7, .id = job->id});
}

static void give_verdict(struct bench *b, const struct bench_due *thing)
{
    struct lumi_judge_numbers numbers = {.sharpness = 0.5,
                                         .mean = 0.3,
                                         .exposure_stops = NAN,
                                         .shift_pixels = NAN,
                                         .moved = NAN,
                                         .blur_pixels = b->smears[0],
                                         .blur_angle = 0.4,
                                         .clipped = b->verdict_rejects > 0 ? 0.9 : 0.01};

    b->verdict_rejects -= b->verdict_rejects > 0;
    memmove(b->smears, b->smears + 1, sizeof b->smears - sizeof b->smears[0]);
    lumi_engine_judged(b->engine, b->now, thing->id, LUMI_OK, "", &numbers, NULL);
}

static void picture(void *context, const struct lumi_engine_picture *shown)
{
    struct bench *b = context;

    if (!shown->spare || !shown->frame->release)
        return;
    b->shown += shown->shot >= 0 && shown->name[0];
    b->looked += shown->shot < 0 && !shown->name[0];
}

static void hand_over(void *context, const char *capture)
{
    struct bench *b = context;

    snprintf(b->handed, sizeof b->handed, "%s", capture);
}

static void told(void *context, const struct lumi_engine_told *tale)
{
    struct bench *b = context;

    if (getenv("BENCH_TELL"))
        fprintf(stderr, "%8.3f kind %d shot %d camera %d: %s\n", (double)b->now * 1e-9, (int)tale->kind, tale->shot,
                tale->camera, tale->text);
    if (tale->kind == LUMI_TALE_STATE)
        b->states_told |= 1u << tale->state;
    if (tale->kind == LUMI_TALE_FRAME && tale->frame < (int)sizeof b->letters)
        b->letters[tale->frame] = tale->letter;
    if (tale->kind != LUMI_TALE_INCIDENT)
        return;
    b->incidents++;
    snprintf(b->last_incident, sizeof b->last_incident, "%s", tale->text);
}

static int disk(void *context, size_t bytes, struct lumi_error *error)
{
    struct bench *b = context;

    (void)bytes;
    return b->disk_full ? lumi_fail(error, LUMI_ERR_NOSPACE, "the disk is full") : LUMI_OK;
}

static void give_status(struct bench *b)
{
    struct lumi_rig_link_snapshot snapshot = {
        .state = b->connected ? LUMI_RIG_LINK_OPEN : LUMI_RIG_LINK_CLOSED, .status_known = true, .clock_matched = true};

    if (b->state == lumi_wire_State_SWEEPING && b->now >= b->sweep_until)
        b->state = lumi_wire_State_IDLE;
    snapshot.status.state = b->faults ? lumi_wire_State_STOPPED : b->state;
    snapshot.status.position_known = snapshot.status.turn_known = b->known;
    snapshot.status.faults = b->faults;
    snapshot.status.step = b->step;
    snapshot.status_ns = (uint64_t)b->now;
    lumi_engine_rig_status(b->engine, b->now, &snapshot);
}

static void happen(struct bench *b, const struct bench_due *thing)
{
    struct lumi_camera_notice notice = {.kind = LUMI_CAMERA_DONE, .command = thing->number};
    struct lumi_rig_notice heard = {.kind = LUMI_RIG_NOTICE_EVENT, .event = thing->event};

    switch (thing->kind) {
    case 1:
        lumi_engine_rig_reply(b->engine, b->now, thing->number,
                              thing->reply.result == lumi_wire_Result_DONE ? LUMI_OK : LUMI_ERR_IO,
                              thing->reply.result == lumi_wire_Result_DONE ? "" : "no answer", &thing->reply);
        break;
    case 6:
        lumi_engine_rig_reply(b->engine, b->now, thing->number, b->drive_code, b->drive_says, NULL);
        break;
    case 2:
        lumi_engine_rig_profile(b->engine, b->now, thing->number, LUMI_OK, "", &b->rig);
        break;
    case 3:
        lumi_engine_camera_notice(b->engine, b->now, thing->camera, &notice);
        break;
    case 4:
        if (thing->event.which_kind == lumi_wire_Event_homed_tag) {
            b->known = true;
            b->state = lumi_wire_State_IDLE;
        }
        if (b->connected)
            lumi_engine_rig_notice(b->engine, b->now, &heard);
        break;
    case 5:
        give_frame(b, thing);
        break;
    default:
        give_verdict(b, thing);
        break;
    }
}

static void step(struct bench *b)
{
    int64_t next = b->now + BENCH_NS / 4, wanted = lumi_engine_next(b->engine);
    struct bench_due thing;
    int first = -1;

    for (int i = 0; i < b->due_count; i++)
        if (b->due[i].at <= next && (first < 0 || b->due[i].at < b->due[first].at))
            first = i;
    if (first >= 0)
        next = b->due[first].at > b->now ? b->due[first].at : b->now;
    if (wanted < next && wanted > b->now) {
        next = wanted;
        first = -1;
    }
    b->now = next;
    if (first >= 0) {
        thing = b->due[first];
        b->due_count--;
        memmove(b->due + first, b->due + first + 1, (size_t)(b->due_count - first) * sizeof *b->due);
        happen(b, &thing);
    } else {
        give_status(b);
    }
    if (lumi_engine_store(b->engine))
        lumi_store_work(lumi_engine_store(b->engine), 0);
    lumi_engine_run(b->engine, b->now);
}

const struct lumi_engine_status *bench_status(struct bench *b)
{
    lumi_engine_status(b->engine, &b->status);
    return &b->status;
}

bool bench_until(struct bench *b, enum lumi_engine_state state, double seconds)
{
    const int64_t end = b->now + (int64_t)(seconds * 1e9);

    while (b->now < end && bench_status(b)->state != state)
        step(b);
    return bench_status(b)->state == state;
}

void bench_run(struct bench *b, double seconds)
{
    const int64_t end = b->now + (int64_t)(seconds * 1e9);

    while (b->now < end)
        step(b);
}

const struct lumi_engine_check *bench_check(struct bench *b, const char *name)
{
    bench_status(b);
    for (int i = 0; i < b->status.check_count; i++)
        if (!strcmp(b->status.checks[i].name, name))
            return &b->status.checks[i];
    return NULL;
}

void bench_event(struct bench *b, const lumi_wire_Event *event)
{
    tell(b, b->now, *event);
}

void bench_stand_still(struct bench *b)
{
    int kept = 0;

    for (int i = 0; i < b->due_count; i++) {
        const struct bench_due *thing = &b->due[i];
        const bool shot = thing->kind == 4 && thing->event.which_kind == lumi_wire_Event_shot_tag;
        if (shot && thing->at > b->now + BENCH_NS / 10)
            b->shots[thing->event.kind.shot.number] = 0;
        if ((thing->kind == 4 && thing->at > b->now + BENCH_NS / 10) || (thing->kind == 5 && thing->begin > b->now))
            continue;
        b->due[kept++] = *thing;
    }
    b->due_count = kept;
}

void bench_restart_board(struct bench *b)
{
    struct lumi_rig_notice heard = {.kind = LUMI_RIG_NOTICE_CONNECTED, .restarted = true};

    bench_stand_still(b);
    memset(b->shots, 0, sizeof b->shots);
    b->known = false;
    b->state = lumi_wire_State_LOST;
    b->event_number = 0;
    lumi_engine_rig_notice(b->engine, b->now, &heard);
}

static void lamp(void *context, bool on)
{
    ((struct bench *)context)->lit = on;
}

void bench_engine(struct bench *b)
{
    const struct lumi_engine_ports ports = {.context = b,
                                            .rig_request = request,
                                            .rig_read_profile = read_profile,
                                            .rig_stored = stored,
                                            .rig_emergency_stop = emergency_stop,
                                            .rig_to_host = to_host,
                                            .camera_command = command,
                                            .lamp = lamp,
                                            .judge = judge,
                                            .picture = picture,
                                            .hand_over = hand_over,
                                            .drive_check = b->drive_says ? drive_check : NULL,
                                            .drive_sweep = b->drive_says ? drive_sweep : NULL,
                                            .told = told};
    struct lumi_error error = {0};

    if (lumi_engine_create(&b->config, &ports, b->now, &b->engine, &error)) {
        fprintf(stderr, "%s\n", error.text);
        abort();
    }
    for (int c = 0; c < BENCH_CAMERAS; c++) {
        struct lumi_camera_notice notice = {.kind = LUMI_CAMERA_CAME};
        snprintf(notice.identity.serial, sizeof notice.identity.serial, "%d", 100 + c);
        notice.identity.device_clock = notice.identity.exposure_control = true;
        notice.identity.software_trigger = b->by_software;
        lumi_engine_camera_notice(b->engine, b->now, c, &notice);
        notice = (struct lumi_camera_notice){.kind = LUMI_CAMERA_STATUS};
        notice.status.battery = b->battery > 0 ? b->battery : NAN;
        notice.status.temperature = NAN;
        notice.status.card_free_bytes = b->card > 0 ? b->card : -1;
        lumi_engine_camera_notice(b->engine, b->now, c, &notice);
    }
    give_status(b);
}

void bench_begin(struct bench *b, enum lumi_plan_mode mode, int bracket)
{
    struct lumi_error error = {0};

    memset(b, 0, sizeof *b);
    snprintf(b->folder, sizeof b->folder, "/tmp/lumi-engine-XXXXXX");
    if (!mkdtemp(b->folder) || lumi_rig_arc(&b->rig, BENCH_CAMERAS, 4, 1, 0.7, 64, 48, 1.5, 1.2, &error))
        abort();
    b->now = 100 * BENCH_NS;
    b->connected = true;
    b->state = lumi_wire_State_LOST;
    memset(b->letters, '.', sizeof b->letters);
    b->clock_offset[0] = 7 * BENCH_NS;
    b->clock_offset[1] = -1234567890123LL;
    lumi_engine_config_init(&b->config);
    snprintf(b->config.folder, sizeof b->config.folder, "%s", b->folder);
    b->config.camera_count = BENCH_CAMERAS;
    b->config.utc_offset_ns = 1700000000LL * BENCH_NS;
    b->config.store.synchronous = true;
    b->config.store.disk = disk;
    b->config.store.context = b;
    for (int c = 0; c < BENCH_CAMERAS; c++) {
        snprintf(b->config.cameras[c].name, sizeof b->config.cameras[c].name, "%s", b->rig.cameras[c].name);
        lumi_camera_setting_init(&b->config.cameras[c].setting);
        b->config.cameras[c].setting.trigger = LUMI_TRIGGER_HARDWARE;
    }
    lumi_plan_init(&b->plan, &b->rig);
    b->plan.mode = mode;
    b->plan.positions = 4;
    b->plan.turn_time = mode == LUMI_PLAN_START_STOP ? 40 : 8;
    b->plan.bracket = bracket;
    for (int k = 0; k < bracket; k++)
        b->plan.exposures[k] = 0.001 * (1 << k);
    bench_engine(b);
}

int bench_start(struct bench *b, bool preflight_only, struct lumi_error *error)
{
    const struct lumi_engine_start start = {.name = "test.capture", .preflight_only = preflight_only};
    char text[LUMI_PLAN_TEXT_MAX];
    size_t size = lumi_plan_print(&b->plan, &b->rig, text, sizeof text);

    return lumi_engine_start(b->engine, b->now, text, size, &start, error);
}

void bench_kill(struct bench *b)
{
    lumi_engine_destroy(b->engine);
    b->engine = NULL;
    b->due_count = 0;
}

void bench_end(struct bench *b)
{
    char text[128];

    lumi_engine_destroy(b->engine);
    lumi_free(b->due);
    snprintf(text, sizeof text, "rm -rf %s", b->folder);
    if (system(text))
        abort();
}
