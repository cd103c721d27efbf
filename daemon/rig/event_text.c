/* Lines about events. */
#include "daemon/rig/event_text.h"
#include "daemon/rig/bench.h"

#include <glib.h>
#include <inttypes.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

struct line {
    char *text;
    size_t size, used;
};

static void add(struct line *line, const char *format, ...) __attribute__((format(printf, 2, 3)));
static void add(struct line *line, const char *format, ...)
{
    va_list arguments;
    int count;

    if (line->used >= line->size)
        return;
    va_start(arguments, format);
    count = vsnprintf(line->text + line->used, line->size - line->used, format, arguments);
    va_end(arguments);
    line->used = MIN(line->used + (size_t)MAX(count, 0), line->size);
}

/* JSON (RFC 8259) has no numbers that are not finite, and a point for every locale. */
static void add_number(struct line *line, const char *name, double value)
{
    char digits[G_ASCII_DTOSTR_BUF_SIZE];

    if (isfinite(value))
        add(line, ",\"%s\":%s", name, g_ascii_dtostr(digits, sizeof digits, value));
    else
        add(line, ",\"%s\":null", name);
}

/* The wire's texts are printable UTF-8 (proto/wire/message.h). */
static void add_string(struct line *line, const char *name, const char *value)
{
    add(line, ",\"%s\":\"", name);
    for (; *value; value++)
        if (*value == '"' || *value == '\\')
            add(line, "\\%c", *value);
        else if ((unsigned char)*value < 0x20)
            add(line, "\\u%04x", *value);
        else
            add(line, "%c", *value);
    add(line, "\"");
}

static void add_time(struct line *line, const char *name, uint64_t board_ns, const struct lumi_rig_json_clock *clock)
{
    uint64_t host = clock->to_host ? clock->to_host(clock->context, board_ns) : 0;

    add(line, ",\"%s_board_ns\":%" PRIu64, name, board_ns);
    if (host)
        add(line, ",\"%s_host_ns\":%" PRIu64 ",\"%s_utc_ns\":%" PRId64, name, host, name,
            (int64_t)host + clock->utc_offset_ns);
}

const char *lumi_rig_ended_name(lumi_wire_SweepEnded_How how)
{
    static const char *const names[] = {"complete", "paused", "stopped", "host-lost", "faulted"};

    return (unsigned)how < sizeof names / sizeof names[0] ? names[how] : "unknown";
}

static const char *state_name(lumi_wire_State state)
{
    const char *name = lumi_wire_state_name(state);

    return name ? name : "unknown";
}

static const char *fault_name(uint32_t fault)
{
    return fault < LUMI_RIG_FAULTS ? lumi_rig_fault_names[fault] : "unknown";
}

static const char *cause_name(lumi_wire_Started_Cause cause)
{
    static const char *const names[] = {"power", "pin", "software", "watchdog"};

    return (unsigned)cause < sizeof names / sizeof names[0] ? names[cause] : "unknown";
}

/* ---- for people ---- */

static void shot_text(struct line *line, const lumi_wire_Shot *shot)
{
    add(line, "shot %u %s, turn %u, step %.2f, pitch %.3f deg, %d cameras", (unsigned)shot->number,
        shot->lost ? "LOST" : "fired", (unsigned)shot->turn, shot->step, shot->pitch * (180 / 3.14159265358979),
        (int)shot->edge_ns_count);
}

static void event_text(struct line *line, const lumi_wire_Event *event)
{
    switch (event->which_kind) {
    case lumi_wire_Event_started_tag:
        add(line, "the board started (%s)", cause_name(event->kind.started.cause));
        break;
    case lumi_wire_Event_state_changed_tag:
        add(line, "%s -> %s", state_name(event->kind.state_changed.from), state_name(event->kind.state_changed.to));
        break;
    case lumi_wire_Event_shot_tag:
        shot_text(line, &event->kind.shot);
        break;
    case lumi_wire_Event_feedback_tag:
        add(line, "feedback %u %s, shot %u", (unsigned)event->kind.feedback.input,
            event->kind.feedback.rising ? "up" : "down", (unsigned)event->kind.feedback.shot);
        break;
    case lumi_wire_Event_turn_mark_tag:
        add(line, "turn %u begins at step %" PRId64, (unsigned)event->kind.turn_mark.turn,
            (int64_t)event->kind.turn_mark.step);
        break;
    case lumi_wire_Event_fault_tag:
        add(line, "fault %s %s%s%s", fault_name(event->kind.fault.fault), event->kind.fault.set ? "SET" : "cleared",
            event->kind.fault.text[0] ? ": " : "", event->kind.fault.text);
        break;
    case lumi_wire_Event_homed_tag:
        add(line, "home %s%s%s", event->kind.homed.found ? "found" : "NOT found", event->kind.homed.text[0] ? ": " : "",
            event->kind.homed.text);
        break;
    case lumi_wire_Event_sweep_ended_tag:
        add(line, "sweep %s: %u fired, %u lost, next shot %u", lumi_rig_ended_name(event->kind.sweep_ended.how),
            (unsigned)event->kind.sweep_ended.fired, (unsigned)event->kind.sweep_ended.lost,
            (unsigned)event->kind.sweep_ended.next_shot);
        break;
    case lumi_wire_Event_note_tag:
        add(line, "%s", event->kind.note.text);
        break;
    default:
        add(line, "an event of a later version");
    }
}

void lumi_rig_notice_text(const struct lumi_rig_notice *notice, char *text, size_t size)
{
    struct line line = {text, size, 0};

    text[0] = '\0';
    switch (notice->kind) {
    case LUMI_RIG_NOTICE_EVENT:
        add(&line, "%10.3f s  ", (double)notice->event.time_ns * 1e-9);
        event_text(&line, &notice->event);
        break;
    case LUMI_RIG_NOTICE_EVENTS_LOST:
        add(&line, "%10s    %u events were lost", "", (unsigned)notice->count);
        break;
    case LUMI_RIG_NOTICE_CONNECTED:
        add(&line, "%10s    connected%s", "", notice->restarted ? "; the board has started anew" : "");
        break;
    case LUMI_RIG_NOTICE_DISCONNECTED:
        add(&line, "%10s    disconnected: %s", "", notice->text);
        break;
    }
}

/* ---- for programs ---- */

static void shot_json(struct line *line, const lumi_wire_Shot *shot, const struct lumi_rig_json_clock *clock)
{
    int edge = 0;

    add(line, ",\"shot\":%u,\"lost\":%s,\"bracket\":%u,\"turn\":%u", (unsigned)shot->number,
        shot->lost ? "true" : "false", (unsigned)shot->bracket, (unsigned)shot->turn);
    add_number(line, "step", shot->step);
    add_number(line, "pitch", shot->pitch);
    add_time(line, "middle", shot->middle_ns, clock);
    add(line, ",\"edges\":[");
    for (int channel = 0; channel < LUMI_RIG_CHANNELS && edge < shot->edge_ns_count; channel++)
        if (shot->channels >> channel & 1) {
            add(line, "%s{\"channel\":%d,\"after_middle_ns\":%" PRId32 "}", edge ? "," : "", channel,
                (int32_t)shot->edge_ns[edge]);
            edge++;
        }
    add(line, "]");
}

static void fault_json(struct line *line, const lumi_wire_Fault *fault)
{
    add(line, ",\"fault\":\"%s\",\"set\":%s,\"step\":%" PRId64 ",\"position_known\":%s", fault_name(fault->fault),
        fault->set ? "true" : "false", (int64_t)fault->step, fault->position_known ? "true" : "false");
    add_string(line, "text", fault->text);
}

static void moments_json(struct line *line, const lumi_wire_Event *event, const struct lumi_rig_json_clock *clock)
{
    switch (event->which_kind) {
    case lumi_wire_Event_started_tag:
        add_string(line, "started", cause_name(event->kind.started.cause));
        break;
    case lumi_wire_Event_state_changed_tag:
        add_string(line, "from", state_name(event->kind.state_changed.from));
        add_string(line, "state", state_name(event->kind.state_changed.to));
        break;
    case lumi_wire_Event_feedback_tag:
        add(line, ",\"feedback\":%u,\"rising\":%s,\"shot_of_feedback\":%u", (unsigned)event->kind.feedback.input,
            event->kind.feedback.rising ? "true" : "false", (unsigned)event->kind.feedback.shot);
        add_time(line, "edge", event->kind.feedback.edge_ns, clock);
        break;
    case lumi_wire_Event_turn_mark_tag:
        add(line, ",\"turn_mark\":%u,\"step\":%" PRId64, (unsigned)event->kind.turn_mark.turn,
            (int64_t)event->kind.turn_mark.step);
        add_number(line, "pitch", event->kind.turn_mark.pitch);
        break;
    case lumi_wire_Event_homed_tag:
        add(line, ",\"homed\":%s,\"step\":%" PRId64, event->kind.homed.found ? "true" : "false",
            (int64_t)event->kind.homed.step);
        add_string(line, "text", event->kind.homed.text);
        break;
    case lumi_wire_Event_sweep_ended_tag:
        add_string(line, "sweep_ended", lumi_rig_ended_name(event->kind.sweep_ended.how));
        add(line, ",\"next_shot\":%u,\"fired\":%u,\"lost_shots\":%u", (unsigned)event->kind.sweep_ended.next_shot,
            (unsigned)event->kind.sweep_ended.fired, (unsigned)event->kind.sweep_ended.lost);
        break;
    case lumi_wire_Event_note_tag:
        add_string(line, "note", event->kind.note.text);
        break;
    default:
        break;
    }
}

void lumi_rig_notice_json(const struct lumi_rig_notice *notice, const struct lumi_rig_json_clock *clock, char *text,
                          size_t size)
{
    struct line line = {text, size, 0};
    const lumi_wire_Event *event = &notice->event;

    text[0] = '\0';
    add(&line, "{\"boot\":%u", (unsigned)clock->boot);
    switch (notice->kind) {
    case LUMI_RIG_NOTICE_EVENT:
        add(&line, ",\"event\":%u", (unsigned)event->number);
        add_time(&line, "at", event->time_ns, clock);
        if (event->which_kind == lumi_wire_Event_shot_tag)
            shot_json(&line, &event->kind.shot, clock);
        else if (event->which_kind == lumi_wire_Event_fault_tag)
            fault_json(&line, &event->kind.fault);
        else
            moments_json(&line, event, clock);
        break;
    case LUMI_RIG_NOTICE_EVENTS_LOST:
        add(&line, ",\"events_lost\":%u", (unsigned)notice->count);
        break;
    case LUMI_RIG_NOTICE_CONNECTED:
        add(&line, ",\"connected\":true,\"restarted\":%s", notice->restarted ? "true" : "false");
        break;
    case LUMI_RIG_NOTICE_DISCONNECTED:
        add_string(&line, "disconnected", notice->text);
        break;
    }
    add(&line, "}");
}
