/* The bench work of a rig. */
#include "daemon/rig/bench.h"
#include "daemon/rig/link_priv.h"
#include "proto/base/bytes.h"
#include "proto/base/memory.h"

#include <glib.h>
#include <stdio.h>
#include <string.h>

#define ANSWER_SECONDS 10.0 /* of the board, a reconnection included */
#define FLASH_SECONDS 20.0  /* it erases a sector */
#define ASK_NS 250000000u   /* between two looks at its state */
#define TELL_NS 3000000000u /* for all the events that it keeps */
#define USB_BOARDS 8

/* ---- opening ---- */

/* "usb:1a2b, usb:3c4d (no permission …)": what there is, for somebody who has named nothing. */
static int explain_usb(struct lumi_error *error)
{
    struct lumi_rig_usb_board boards[USB_BOARDS];
    g_autoptr(GString) text = g_string_new(NULL);
    int count = lumi_rig_usb_list(boards, USB_BOARDS, error);

    if (count < 0)
        return count;
    if (!count)
        return lumi_fail(error, LUMI_ERR_NOTFOUND,
                         "no board on USB; is it plugged in and switched on? One on a serial line wants --link "
                         "serial:/dev/ttyUSB0");
    for (int i = 0; i < count && i < USB_BOARDS; i++)
        g_string_append_printf(text, "%s%s%s", i ? ", " : "",
                               boards[i].text[0] ? "" : "usb:", boards[i].text[0] ? boards[i].text : boards[i].serial);
    if (count == 1)
        return lumi_fail(error, LUMI_ERR_IO, "%s", text->str);
    return lumi_fail(error, LUMI_ERR_ARG, "%d boards on USB, say which with --link: %s", count, text->str);
}

int lumi_rig_bench_open(const char *address, double seconds, struct lumi_rig_link **link, struct lumi_error *error)
{
    struct lumi_rig_link_options options;
    int code;

    lumi_rig_link_options_init(&options);
    options.observer = options.holds = true;
    LUMI_TRY(lumi_rig_link_open(address ? address : "usb:", &options, link, error));
    code = lumi_rig_link_wait(*link, seconds, true, error);
    if (code == LUMI_OK)
        return code;
    lumi_rig_link_close(*link);
    *link = NULL;
    if (!address && (code == LUMI_ERR_NOTFOUND || code == LUMI_ERR_ARG))
        return explain_usb(error);
    return code;
}

/* ---- words ---- */

bool lumi_rig_state_at_rest(lumi_wire_State state)
{
    switch (state) {
    case lumi_wire_State_HOMING:
    case lumi_wire_State_JOGGING:
    case lumi_wire_State_WINDING:
    case lumi_wire_State_SWEEPING:
    case lumi_wire_State_PAUSING:
    case lumi_wire_State_STOPPING:
    case lumi_wire_State_TESTING:
        return false;
    default:
        return true;
    }
}

const char *lumi_rig_fault_text(uint32_t faults, char *text, size_t size)
{
    size_t used = 0;

    snprintf(text, size, "none");
    for (int i = 0; i < 32; i++)
        if (faults >> i & 1 && used < size)
            used += (size_t)snprintf(text + used, size - used, "%s%s", used ? ", " : "",
                                     i < LUMI_RIG_FAULTS ? lumi_rig_fault_names[i] : "unknown");
    return text;
}

/* ---- asking ---- */

int lumi_rig_bench_status(struct lumi_rig_link *link, lumi_wire_Status *status, struct lumi_error *error)
{
    const lumi_wire_Request request = {.which_command = lumi_wire_Request_get_status_tag};
    lumi_wire_Reply reply;

    LUMI_TRY(lumi_rig_link_command(link, &request, ANSWER_SECONDS, &reply, error));
    if (reply.which_payload != lumi_wire_Reply_status_tag)
        return lumi_fail(error, LUMI_ERR_FORMAT, "the board's answer holds no status");
    *status = reply.payload.status;
    return LUMI_OK;
}

static int read_part(struct lumi_rig_link *link, uint32_t offset, lumi_wire_ProfilePart *part, struct lumi_error *error)
{
    lumi_wire_Request request = {.which_command = lumi_wire_Request_read_profile_tag};
    lumi_wire_Reply reply;

    request.command.read_profile.offset = offset;
    LUMI_TRY(lumi_rig_link_request(link, &request, ANSWER_SECONDS, &reply, error));
    if (reply.result == lumi_wire_Result_REFUSED)
        return lumi_fail(error, LUMI_ERR_NOTFOUND, "%s (lumi rig profile set)", reply.text);
    if (reply.result != lumi_wire_Result_DONE || reply.which_payload != lumi_wire_Reply_profile_tag)
        return lumi_fail(error, LUMI_ERR_FORMAT, "the board's profile: %s",
                         reply.text[0] ? reply.text : "its answer makes no sense");
    *part = reply.payload.profile;
    if (part->offset != offset || part->size > LUMI_WIRE_PROFILE_MAX || part->data.size > part->size - offset ||
        (offset < part->size && !part->data.size))
        return lumi_fail(error, LUMI_ERR_FORMAT, "the board's profile: a part that does not fit");
    return LUMI_OK;
}

/* Another host may write it between two parts: then checksums differ. */
static int read_whole(struct lumi_rig_link *link, uint8_t *data, size_t *size, struct lumi_error *error)
{
    lumi_wire_ProfilePart part;
    uint32_t offset = 0, crc = 0;

    do {
        LUMI_TRY(read_part(link, offset, &part, error));
        memcpy(data + offset, part.data.bytes, part.data.size);
        if (offset && part.crc != crc)
            return lumi_fail(error, LUMI_ERR_BUSY, "the board's profile was written while it was read; try again");
        crc = part.crc;
        offset += part.data.size;
    } while (offset < part.size);
    *size = part.size;
    if (lumi_crc32c(0, data, *size) != crc)
        return lumi_fail(error, LUMI_ERR_CHECKSUM, "the board's profile does not match its checksum");
    return LUMI_OK;
}

int lumi_rig_bench_read_profile(struct lumi_rig_link *link, struct lumi_rig *rig, struct lumi_error *error)
{
    uint8_t *data = lumi_alloc(LUMI_WIRE_PROFILE_MAX, 1);
    lumi_wire_Profile *scratch = lumi_alloc(1, sizeof *scratch);
    size_t size;
    int code;

    if (!data || !scratch) {
        code = lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a profile");
        goto done;
    }
    LUMI_GOTO(code, done, read_whole(link, data, &size, error));
    LUMI_GOTO(code, done, lumi_wire_decode_profile(data, size, scratch, rig, error));
    LUMI_GOTO(code, done, lumi_rig_check(rig, error));
done:
    lumi_free(scratch);
    lumi_free(data);
    return code;
}

static int write_whole(struct lumi_rig_link *link, const uint8_t *data, size_t size, bool replace_newer,
                       struct lumi_error *error)
{
    lumi_wire_Request request;
    size_t at = 0;

    while (lumi_wire_profile_request(data, size, &at, &request)) {
        bool commit = request.which_command == lumi_wire_Request_commit_profile_tag;
        if (commit)
            request.command.commit_profile.replace_newer = replace_newer;
        LUMI_TRY(lumi_rig_link_command(link, &request, commit ? FLASH_SECONDS : ANSWER_SECONDS, NULL, error));
    }
    return LUMI_OK;
}

int lumi_rig_bench_write_profile(struct lumi_rig_link *link, const struct lumi_rig *rig, bool replace_newer,
                                 struct lumi_error *error)
{
    uint8_t *data = lumi_alloc(2, LUMI_WIRE_PROFILE_MAX);
    lumi_wire_Profile *scratch = lumi_alloc(1, sizeof *scratch);
    size_t size, back;
    int code;

    if (!data || !scratch) {
        code = lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a profile");
        goto done;
    }
    LUMI_GOTO(code, done, lumi_rig_check(rig, error));
    size = lumi_wire_encode_profile(rig, scratch, data, LUMI_WIRE_PROFILE_MAX);
    if (!size) {
        code = lumi_fail(error, LUMI_ERR_FORMAT, "rig %s does not fit a message", rig->name);
        goto done;
    }
    LUMI_GOTO(code, done, write_whole(link, data, size, replace_newer, error));
    LUMI_GOTO(code, done, read_whole(link, data + LUMI_WIRE_PROFILE_MAX, &back, error));
    if (back != size || memcmp(data, data + LUMI_WIRE_PROFILE_MAX, size))
        code = lumi_fail(error, LUMI_ERR_CHECKSUM, "what the board reads back is another profile");
done:
    lumi_free(scratch);
    lumi_free(data);
    return code;
}

/* ---- acting ---- */

/* What the board told since a command. */
struct heard {
    uint32_t from, next; /* numbers of events: ours begin here; seen up to here */
    bool restarted;
    char text[256]; /* the last reason: of homing, a fault, a note */
};

static void hear(struct lumi_rig_link *link, struct heard *heard, double seconds)
{
    struct lumi_rig_notice notice;

    while (lumi_rig_link_notice(link, seconds, &notice)) {
        const lumi_wire_Event *event = &notice.event;
        seconds = 0;
        heard->restarted |= notice.kind == LUMI_RIG_NOTICE_CONNECTED && notice.restarted;
        if (notice.kind != LUMI_RIG_NOTICE_EVENT)
            continue;
        heard->next = event->number + 1;
        if ((int32_t)(event->number - heard->from) < 0)
            continue;
        if (event->which_kind == lumi_wire_Event_homed_tag && event->kind.homed.text[0])
            g_strlcpy(heard->text, event->kind.homed.text, sizeof heard->text);
        else if (event->which_kind == lumi_wire_Event_note_tag)
            g_strlcpy(heard->text, event->kind.note.text, sizeof heard->text);
        else if (event->which_kind == lumi_wire_Event_fault_tag && event->kind.fault.set)
            snprintf(heard->text, sizeof heard->text, "%s%s%s",
                     event->kind.fault.fault < LUMI_RIG_FAULTS ? lumi_rig_fault_names[event->kind.fault.fault]
                                                               : "unknown fault",
                     event->kind.fault.text[0] ? ": " : "", event->kind.fault.text);
    }
}

static int stop_now(const struct lumi_rig_bench *bench, int interrupts)
{
    lumi_wire_Request request = {.which_command = lumi_wire_Request_stop_tag};
    struct lumi_error ignored;

    request.command.stop.at_once = true;
    if (interrupts > 1 || lumi_rig_link_command(bench->link, &request, 2, NULL, &ignored))
        lumi_rig_link_emergency_stop(bench->link);
    return interrupts;
}

/* Waits until nothing moves. */
static int await_rest(const struct lumi_rig_bench *bench, struct heard *heard, double seconds, lumi_wire_Status *status,
                      struct lumi_error *error)
{
    uint64_t deadline = lumi_rig_link_now() + (uint64_t)(seconds * 1e9), ask = 0;
    int stopped = 0;

    for (;;) {
        int interrupts = bench->interrupts ? bench->interrupts(bench->context) : 0;
        if (interrupts > stopped)
            stopped = stop_now(bench, interrupts);
        if (lumi_rig_link_now() >= ask) {
            if (lumi_rig_bench_status(bench->link, status, error))
                return lumi_fail_prefix(error, "the board has taken the command; what became of it is not known");
            if (bench->progress)
                bench->progress(bench->context, status);
            if (lumi_rig_state_at_rest(status->state))
                break;
            ask = lumi_rig_link_now() + ASK_NS;
        }
        if (lumi_rig_link_now() >= deadline) {
            stop_now(bench, 1);
            return lumi_fail(error, LUMI_ERR_IO, "the board is still %s after %.3g s; it was told to stop",
                             lumi_wire_state_name(status->state), seconds);
        }
        hear(bench->link, heard, 0.05);
    }
    if (heard->restarted)
        return lumi_fail(error, LUMI_ERR_IO, "the board started again in between");
    if (stopped)
        return lumi_fail(error, LUMI_ERR_CANCELLED, "stopped");
    return LUMI_OK;
}

/* Why it ended as it did stands among the board's events. They are only read: they may belong to a sweep's log. */
static void listen_back(struct lumi_rig_link *link, struct heard *heard, const lumi_wire_Status *status)
{
    uint64_t deadline = lumi_rig_link_now() + TELL_NS;

    if ((int32_t)(heard->next - status->events_next) >= 0)
        return;
    lumi_rig_link_take_charge(link, true);
    do
        hear(link, heard, 0.1);
    while ((int32_t)(heard->next - status->events_next) < 0 && lumi_rig_link_now() < deadline);
    lumi_rig_link_take_charge(link, false);
}

static int act(const struct lumi_rig_bench *bench, const lumi_wire_Request *request, double seconds,
               struct heard *heard, lumi_wire_Status *status, struct lumi_error *error)
{
    LUMI_TRY(lumi_rig_bench_status(bench->link, status, error));
    *heard = (struct heard){.from = status->events_next, .next = status->events_next};
    hear(bench->link, heard, 0);
    heard->restarted = false;
    LUMI_TRY(lumi_rig_link_command(bench->link, request, ANSWER_SECONDS, NULL, error));
    LUMI_TRY(await_rest(bench, heard, seconds, status, error));
    if (status->faults || !status->position_known)
        listen_back(bench->link, heard, status);
    return LUMI_OK;
}

static int judge_faults(const struct heard *heard, const lumi_wire_Status *status, const char *what,
                        struct lumi_error *error)
{
    char faults[256];

    if (!status->faults)
        return LUMI_OK;
    return lumi_fail(error, LUMI_ERR_IO, "%s: ended by %s%s%s%s (lumi rig clear, when the cause is gone)", what,
                     lumi_rig_fault_text(status->faults, faults, sizeof faults), heard->text[0] ? " (" : "",
                     heard->text, heard->text[0] ? ")" : "");
}

int lumi_rig_bench_home(const struct lumi_rig_bench *bench, bool wind_up, int turn, double seconds,
                        struct lumi_error *error)
{
    lumi_wire_Request request = {.which_command = lumi_wire_Request_home_tag};
    lumi_wire_Status status;
    struct heard heard;

    request.command.home.wind_up = wind_up;
    request.command.home.turn = turn;
    LUMI_TRY(act(bench, &request, seconds, &heard, &status, error));
    LUMI_TRY(judge_faults(&heard, &status, "home", error));
    if (!status.position_known)
        return lumi_fail(error, LUMI_ERR_IO, "home: not found: %s", heard.text[0] ? heard.text : "no reason given");
    return LUMI_OK;
}

int lumi_rig_bench_jog(const struct lumi_rig_bench *bench, double turns, double speed, double seconds,
                       struct lumi_error *error)
{
    lumi_wire_Request request = {.which_command = lumi_wire_Request_jog_tag};
    lumi_wire_Status status;
    struct heard heard;

    request.command.jog.turns = turns;
    request.command.jog.speed = speed;
    LUMI_TRY(act(bench, &request, seconds, &heard, &status, error));
    return judge_faults(&heard, &status, "jog", error);
}

int lumi_rig_bench_test(const struct lumi_rig_bench *bench, uint32_t cameras, double exposure, double gap,
                        double seconds, struct lumi_error *error)
{
    lumi_wire_Request request = {.which_command = lumi_wire_Request_test_triggers_tag};
    lumi_wire_Status status;
    struct heard heard;

    request.command.test_triggers.cameras = cameras;
    request.command.test_triggers.exposure = exposure;
    request.command.test_triggers.gap = gap;
    LUMI_TRY(act(bench, &request, seconds, &heard, &status, error));
    return judge_faults(&heard, &status, "test", error);
}

int lumi_rig_bench_stop(const struct lumi_rig_bench *bench, bool at_once, double seconds, struct lumi_error *error)
{
    lumi_wire_Request request = {.which_command = lumi_wire_Request_stop_tag};
    lumi_wire_Status status;
    struct heard heard;

    request.command.stop.at_once = at_once;
    return act(bench, &request, seconds, &heard, &status, error);
}

int lumi_rig_bench_emergency_stop(struct lumi_rig_link *link, double seconds, struct lumi_error *error)
{
    uint64_t deadline = lumi_rig_link_now() + (uint64_t)(seconds * 1e9);
    struct lumi_rig_link_snapshot snapshot;
    struct lumi_rig_notice notice;

    lumi_rig_link_emergency_stop(link);
    do {
        lumi_rig_link_notice(link, 0.02, &notice);
        lumi_rig_link_snapshot(link, &snapshot);
        if (!snapshot.stop_pending)
            return LUMI_OK;
    } while (lumi_rig_link_now() < deadline);
    return lumi_fail(error, LUMI_ERR_IO,
                     "the board has not confirmed the emergency stop within %.3g s: use the switch on the rig",
                     seconds);
}

int lumi_rig_bench_clear(struct lumi_rig_link *link, uint32_t *cleared, struct lumi_error *error)
{
    lumi_wire_Request request = {.which_command = lumi_wire_Request_clear_tag};
    lumi_wire_Status status;

    *cleared = 0;
    LUMI_TRY(lumi_rig_bench_status(link, &status, error));
    if (!status.faults)
        return LUMI_OK;
    request.command.clear.faults = status.faults;
    lumi_rig_link_take_charge(link, true); /* a heartbeat is what ends host-lost */
    LUMI_TRY(lumi_rig_link_command(link, &request, ANSWER_SECONDS, NULL, error));
    *cleared = status.faults;
    return LUMI_OK;
}
