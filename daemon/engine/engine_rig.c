/* The board: what is asked of it, and what it tells. An event is acknowledged when all that comes of it is committed,
 * and those before it are. */
#include "daemon/engine/engine_priv.h"
#include "proto/base/memory.h"

#include <stdio.h>
#include <string.h>

#define JOG_BEGINS 2.0 /* s, until a jog that was asked for shows in the board's status */
#define CLOCK_WAIT 5.0 /* s, that an event waits for the clocks to be matched */

/* ---- asking ---- */

void engine_ask(struct lumi_engine *e, const lumi_wire_Request *request)
{
    e->ask = (struct engine_ask){.number = ++e->next_number};
    e->ports.rig_request(e->ports.context, e->ask.number, request);
}

bool engine_asked(const struct lumi_engine *e)
{
    return e->ask.number != 0;
}

void engine_ask_none(struct lumi_engine *e)
{
    e->ask.number = 0;
    e->ask.answered = false;
}

void engine_send(struct lumi_engine *e, const lumi_wire_Request *request)
{
    e->side = ++e->next_number;
    e->ports.rig_request(e->ports.context, e->side, request);
}

static void side_failed(struct lumi_engine *e, int code, const char *text)
{
    if (code == LUMI_OK)
        return;
    engine_incident(e, -1, "board", "the board did not take a request: %s", text ? text : "no answer");
    e->home_wanted = false;
}

void lumi_engine_rig_reply(struct lumi_engine *e, int64_t now_ns, uint32_t number, int code, const char *text,
                           const lumi_wire_Reply *reply)
{
    e->now = now_ns > e->now ? now_ns : e->now;
    if (number && number == e->drive_out)
        e->drive_out = 0;
    if (number && number == e->side) {
        e->side = 0;
        side_failed(e, code, text);
    }
    engine_look_reply(e, number);
    if (number && number == e->ask.number && !e->ask.answered) {
        e->ask.answered = true;
        e->ask.code = code;
        e->ask.has_reply = reply != NULL;
        if (reply)
            e->ask.reply = *reply;
        snprintf(e->ask.text, sizeof e->ask.text, "%s", text ? text : "");
    }
    engine_step(e);
}

static bool same_profile(const struct lumi_engine *e, const struct lumi_rig *rig)
{
    char *texts = lumi_alloc(2, LUMI_RIG_TEXT_MAX);
    bool same;

    if (!texts)
        return false;
    lumi_rig_print(&e->rig, texts, LUMI_RIG_TEXT_MAX);
    lumi_rig_print(rig, texts + LUMI_RIG_TEXT_MAX, LUMI_RIG_TEXT_MAX);
    same = !strcmp(texts, texts + LUMI_RIG_TEXT_MAX);
    lumi_free(texts);
    return same;
}

void lumi_engine_rig_profile(struct lumi_engine *e, int64_t now_ns, uint32_t number, int code, const char *text,
                             const struct lumi_rig *rig)
{
    if (code == LUMI_OK && rig) {
        e->board_rig = *rig;
        e->board_rig_known = true;
    }
    if (number && number == e->ask.number && !e->ask.answered && code == LUMI_OK && rig) {
        if (!e->store)
            e->rig = *rig;
        e->rig_known = !e->store || same_profile(e, rig);
    }
    lumi_engine_rig_reply(e, now_ns, number, code, text, NULL);
}

/* ---- state ---- */

lumi_wire_State engine_board_state(const struct lumi_engine *e)
{
    return e->link.status_known ? e->link.status.state : lumi_wire_State_BOOT;
}

bool engine_board_rests(const struct lumi_engine *e)
{
    switch (engine_board_state(e)) {
    case lumi_wire_State_LOST:
    case lumi_wire_State_IDLE:
    case lumi_wire_State_PAUSED:
    case lumi_wire_State_STOPPED:
    case lumi_wire_State_STOPPED_LOST:
        return true;
    default:
        return false;
    }
}

void engine_faults_text(uint32_t faults, char *text, size_t size)
{
    size_t used = 0;

    text[0] = '\0';
    for (int i = 0; i < LUMI_RIG_FAULTS; i++)
        if (faults & 1u << i && used + 24 < size)
            used += (size_t)snprintf(text + used, size - used, "%s%s", used ? ", " : "", lumi_rig_fault_names[i]);
}

/* That the host was away is the one fault whose cause is the host itself: it is released without anybody asking. All
 * others want somebody who has looked. */
bool engine_clear_host_lost(struct lumi_engine *e)
{
    lumi_wire_Request request = {.which_command = lumi_wire_Request_clear_tag};

    if (e->faults != 1u << LUMI_RIG_FAULT_HOST_LOST || e->estop)
        return false;
    if (engine_since(e, e->cleared_ns) > 2 && engine_board_rests(e)) {
        e->cleared_ns = e->now;
        request.command.clear.faults = e->faults;
        engine_send(e, &request);
    }
    engine_wake(e, 2.1);
    return true;
}

void lumi_engine_rig_status(struct lumi_engine *e, int64_t now_ns, const struct lumi_rig_link_snapshot *snapshot)
{
    const bool open = snapshot->state == LUMI_RIG_LINK_OPEN;

    e->now = now_ns > e->now ? now_ns : e->now;
    e->link = *snapshot;
    e->link_known = true;
    if (open && !e->connected)
        e->connected_ns = e->now;
    if (!open && e->connected)
        e->lost_ns = e->now;
    e->connected = open;
    if (open && snapshot->status_known)
        e->faults = snapshot->status.faults;
    if (e->jogging && engine_since(e, e->jog_ns) > JOG_BEGINS && engine_board_rests(e))
        e->jogging = false;
    engine_step(e);
}

/* ---- events ---- */

static void keep_event(struct lumi_engine *e, const lumi_wire_Event *event)
{
    if (e->event_count == ENGINE_EVENTS_MAX) {
        /* Nobody could do anything with so many: the oldest is the board's map's business (ReadShots). */
        e->events_gone++;
        memmove(e->events, e->events + 1, (size_t)--e->event_count * sizeof *e->events);
    }
    if (e->event_count == e->event_room) {
        int room = e->event_room ? 2 * e->event_room : 64;
        struct engine_event *events = lumi_realloc(e->events, (size_t)room, sizeof *events);
        if (!events) {
            e->events_gone++;
            return;
        }
        e->events = events;
        e->event_room = room;
    }
    e->events[e->event_count++] =
        (struct engine_event){.serial = ++e->event_serial, .noticed_ns = e->now, .event = *event};
}

static void take_fault(struct lumi_engine *e, const lumi_wire_Fault *fault)
{
    if (fault->fault >= LUMI_RIG_FAULTS)
        return;
    if (fault->set)
        e->faults |= 1u << fault->fault;
    else
        e->faults &= ~(1u << fault->fault);
    engine_incident(e, -1, "fault", "fault %s %s%s%s", lumi_rig_fault_names[fault->fault],
                    fault->set ? "came" : "was cleared", fault->text[0] ? ": " : "", fault->text);
}

/* The board told it as the exposure began; its shot is told when it is over. */
static void take_feedback(struct lumi_engine *e, const lumi_wire_Feedback *feedback)
{
    int64_t at = e->ports.rig_to_host(e->ports.context, feedback->edge_ns);

    if (!feedback->rising || !at || !e->frames)
        return;
    for (int c = 0; c < e->config.camera_count; c++) {
        const struct engine_camera *camera = e->cameras + c;
        if (camera->used && camera->match && camera->rig >= 0 &&
            e->rig.control.triggers[camera->rig].feedback == (int)feedback->input)
            lumi_match_edge(camera->match, at);
    }
}

static void take_event(struct lumi_engine *e, struct engine_event *event)
{
    const lumi_wire_Event *told = &event->event;

    event->taken = true;
    switch (told->which_kind) {
    case lumi_wire_Event_shot_tag:
        engine_shot_event(e, event);
        break;
    case lumi_wire_Event_feedback_tag:
        take_feedback(e, &told->kind.feedback);
        break;
    case lumi_wire_Event_fault_tag:
        take_fault(e, &told->kind.fault);
        break;
    case lumi_wire_Event_homed_tag:
        e->homed = true;
        e->home_found = told->kind.homed.found;
        lumi_wire_copy_text(e->home_text, sizeof e->home_text, told->kind.homed.text);
        if (e->home_wanted)
            engine_incident(e, -1, "homed", e->home_found ? "homed, as was asked for" : "no index mark was found: %s",
                            e->home_text);
        e->home_wanted = false;
        break;
    case lumi_wire_Event_sweep_ended_tag:
        engine_ended(e, told);
        break;
    default:
        break;
    }
}

/* Whether its time can be told; one that cannot waits a while for the clocks. */
static bool placed(const struct lumi_engine *e, const struct engine_event *event)
{
    if (event->event.which_kind != lumi_wire_Event_shot_tag)
        return true;
    return e->ports.rig_to_host(e->ports.context, event->event.kind.shot.middle_ns) != 0 ||
           engine_since(e, event->noticed_ns) > CLOCK_WAIT;
}

void engine_events_settle(struct lumi_engine *e)
{
    int done = 0;

    for (int i = 0; i < e->event_count; i++) {
        if (e->events[i].taken)
            continue;
        if (!placed(e, &e->events[i])) {
            engine_wake(e, 0.1);
            break;
        }
        take_event(e, &e->events[i]);
    }
    while (done < e->event_count && e->events[done].taken && e->events[done].pending == 0)
        done++;
    if (done == 0)
        return;
    e->ports.rig_stored(e->ports.context, &e->events[done - 1].event);
    e->event_count -= done;
    memmove(e->events, e->events + done, (size_t)e->event_count * sizeof *e->events);
}

static void connected(struct lumi_engine *e, bool restarted)
{
    e->connected = true;
    e->connected_ns = e->now;
    if (!restarted)
        return;
    /* What it told before is of another start: those numbers cannot be acknowledged any more. */
    for (int i = 0; i < e->event_count; i++)
        if (!e->events[i].taken)
            take_event(e, &e->events[i]);
    e->event_count = 0;
    e->link.status_known = false;
    e->faults = 0;
    e->home_wanted = false;
    engine_restarted(e);
}

void lumi_engine_rig_notice(struct lumi_engine *e, int64_t now_ns, const struct lumi_rig_notice *notice)
{
    e->now = now_ns > e->now ? now_ns : e->now;
    switch (notice->kind) {
    case LUMI_RIG_NOTICE_EVENT:
        keep_event(e, &notice->event);
        break;
    case LUMI_RIG_NOTICE_EVENTS_LOST:
        e->events_gone += notice->count;
        engine_incident(e, -1, "events", "%u events of the board were pushed out before they came", notice->count);
        break;
    case LUMI_RIG_NOTICE_CONNECTED:
        connected(e, notice->restarted);
        break;
    case LUMI_RIG_NOTICE_DISCONNECTED:
        if (e->connected)
            e->lost_ns = e->now;
        e->connected = false;
        if (engine_taking(e))
            engine_incident(e, -1, "link", "the board is away: %s", notice->text);
        break;
    }
    engine_step(e);
}

void lumi_engine_estop(struct lumi_engine *e, int64_t now_ns, bool pressed)
{
    e->now = now_ns > e->now ? now_ns : e->now;
    if (pressed != e->estop)
        engine_incident(e, -1, "estop", pressed ? "the emergency stop was pressed" : "the emergency stop was released");
    e->estop = pressed;
    engine_step(e);
}

void lumi_engine_disk(struct lumi_engine *e, int64_t now_ns, int64_t free_bytes, double bytes_per_second)
{
    e->now = now_ns > e->now ? now_ns : e->now;
    e->disk_free = free_bytes;
    if (bytes_per_second > 0)
        e->disk_speed = bytes_per_second;
    engine_step(e);
}
