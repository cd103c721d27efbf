/* Messages to bytes and back, by nanopb; the texts in them. */
#include "proto/wire/message.h"

#include <assert.h>
#include <pb_decode.h>
#include <pb_encode.h>
#include <string.h>

static size_t encode(const pb_msgdesc_t *type, const void *message, uint8_t *data, size_t size)
{
    pb_ostream_t stream = pb_ostream_from_buffer(data, size);

    return pb_encode(&stream, type, message) ? stream.bytes_written : 0;
}

size_t lumi_wire_encode_host(const lumi_wire_HostFrame *frame, uint8_t *data, size_t size)
{
    return encode(lumi_wire_HostFrame_fields, frame, data, size);
}

size_t lumi_wire_encode_board(const lumi_wire_BoardFrame *frame, uint8_t *data, size_t size)
{
    return encode(lumi_wire_BoardFrame_fields, frame, data, size);
}

size_t lumi_wire_encode_event(const lumi_wire_Event *event, uint8_t *data, size_t size)
{
    return encode(lumi_wire_Event_fields, event, data, size);
}

/* Bytes of the well-formed character (RFC 3629) at `text`, 0 if there is none or it is a control character. */
static size_t character(const uint8_t *text)
{
    uint32_t code;
    size_t size;

    if (text[0] < 0x80)
        return text[0] >= 0x20 && text[0] != 0x7f;
    if (text[0] >= 0xc2 && text[0] <= 0xdf)
        size = 2, code = text[0] & 0x1f;
    else if ((text[0] & 0xf0) == 0xe0)
        size = 3, code = text[0] & 0x0f;
    else if (text[0] >= 0xf0 && text[0] <= 0xf4)
        size = 4, code = text[0] & 0x07;
    else
        return 0;
    for (size_t i = 1; i < size; i++) {
        if ((text[i] & 0xc0) != 0x80) /* the 0 at the end is none either */
            return 0;
        code = code << 6 | (text[i] & 0x3f);
    }
    bool shortest = code >= (size == 2 ? 0xa0u : size == 3 ? 0x800u : 0x10000u); /* 0x80 … 0x9f: control characters */
    bool surrogate = code >= 0xd800 && code <= 0xdfff;
    return shortest && !surrogate && code <= 0x10ffff ? size : 0;
}

void lumi_wire_clean_text(char *text, size_t size)
{
    uint8_t *bytes = (uint8_t *)text;
    size_t at = 0;

    bytes[size - 1] = 0;
    while (bytes[at] != 0) {
        size_t step = character(bytes + at);

        if (step == 0) {
            bytes[at] = '?';
            step = 1;
        }
        at += step;
    }
}

void lumi_wire_copy_text(char *field, size_t size, const char *text)
{
    size_t length = strlen(text);

    if (length >= size) {
        length = size - 1;
        while (length > 0 && ((uint8_t)text[length] & 0xc0) == 0x80) /* not in the middle of a character */
            length--;
    }
    memmove(field, text, length);
    memset(field + length, 0, size - length);
    lumi_wire_clean_text(field, size);
}

static void clean_plan(lumi_wire_Plan *plan)
{
    lumi_wire_clean_text(plan->name, sizeof plan->name);
}

void lumi_wire_clean_event(lumi_wire_Event *event)
{
    if (event->which_kind == lumi_wire_Event_fault_tag)
        lumi_wire_clean_text(event->kind.fault.text, sizeof event->kind.fault.text);
    else if (event->which_kind == lumi_wire_Event_homed_tag)
        lumi_wire_clean_text(event->kind.homed.text, sizeof event->kind.homed.text);
    else if (event->which_kind == lumi_wire_Event_note_tag)
        lumi_wire_clean_text(event->kind.note.text, sizeof event->kind.note.text);
}

static void clean_board(lumi_wire_BoardFrame *frame)
{
    if (frame->which_body == lumi_wire_BoardFrame_welcome_tag) {
        lumi_wire_Welcome *welcome = &frame->body.welcome;

        lumi_wire_clean_text(welcome->board, sizeof welcome->board);
        lumi_wire_clean_text(welcome->firmware, sizeof welcome->firmware);
    } else if (frame->which_body == lumi_wire_BoardFrame_reply_tag) {
        lumi_wire_Reply *reply = &frame->body.reply;

        lumi_wire_clean_text(reply->text, sizeof reply->text);
        if (reply->which_payload == lumi_wire_Reply_plan_tag)
            clean_plan(&reply->payload.plan);
    } else if (frame->which_body == lumi_wire_BoardFrame_event_tag) {
        lumi_wire_clean_event(&frame->body.event);
    }
}

bool lumi_wire_decode_host(const uint8_t *data, size_t size, lumi_wire_HostFrame *frame)
{
    pb_istream_t stream = pb_istream_from_buffer(data, size);

    memset(frame, 0, sizeof *frame);
    if (!pb_decode(&stream, lumi_wire_HostFrame_fields, frame))
        return false;
    if (frame->which_body == lumi_wire_HostFrame_request_tag &&
        frame->body.request.which_command == lumi_wire_Request_load_plan_tag)
        clean_plan(&frame->body.request.command.load_plan.plan);
    return true;
}

bool lumi_wire_decode_board(const uint8_t *data, size_t size, lumi_wire_BoardFrame *frame)
{
    pb_istream_t stream = pb_istream_from_buffer(data, size);

    memset(frame, 0, sizeof *frame);
    if (!pb_decode(&stream, lumi_wire_BoardFrame_fields, frame))
        return false;
    clean_board(frame);
    return true;
}

/* The stream stands in a Request. Goes on until both are found: what makes it malformed may come after. */
static bool request_head(pb_istream_t *stream, uint32_t *token, uint32_t *number)
{
    bool has_token = false, has_number = false, end = false;
    pb_wire_type_t type;
    uint32_t tag;

    while (!(has_token && has_number) && pb_decode_tag(stream, &type, &tag, &end)) {
        if (tag == lumi_wire_Request_token_tag && type == PB_WT_32BIT)
            has_token = pb_decode_fixed32(stream, token);
        else if (tag == lumi_wire_Request_number_tag && type == PB_WT_VARINT)
            has_number = pb_decode_varint32(stream, number);
        else if (!pb_skip_field(stream, type))
            break;
    }
    return has_token && has_number;
}

bool lumi_wire_decode_request_head(const uint8_t *data, size_t size, uint32_t *token, uint32_t *number)
{
    pb_istream_t stream = pb_istream_from_buffer(data, size), request;
    pb_wire_type_t type;
    uint32_t tag;
    bool end = false;

    return pb_decode_tag(&stream, &type, &tag, &end) && tag == lumi_wire_HostFrame_request_tag &&
           type == PB_WT_STRING && pb_make_string_substream(&stream, &request) && request_head(&request, token, number);
}

const char *lumi_wire_result_name(lumi_wire_Result result)
{
    static const char *const names[] = {"done",   "refused",    "bad",         "unsupported",
                                        "failed", "no session", "out of order"};
    static_assert(sizeof names / sizeof names[0] == _lumi_wire_Result_ARRAYSIZE, "a name for each");

    return (unsigned)result < sizeof names / sizeof names[0] ? names[result] : NULL;
}

const char *lumi_wire_state_name(lumi_wire_State state)
{
    static const char *const names[] = {"boot",     "no profile", "lost",         "idle",    "homing",
                                        "jogging",  "winding",    "sweeping",     "pausing", "paused",
                                        "stopping", "stopped",    "stopped lost", "testing"};
    static_assert(sizeof names / sizeof names[0] == _lumi_wire_State_ARRAYSIZE, "a name for each");

    return (unsigned)state < sizeof names / sizeof names[0] ? names[state] : NULL;
}

int lumi_wire_reply_result(const lumi_wire_Reply *reply, struct lumi_error *error)
{
    const char *text = reply->text[0] ? reply->text : "no reason given";

    switch (reply->result) {
    case lumi_wire_Result_DONE:
        return LUMI_OK;
    case lumi_wire_Result_REFUSED:
        return lumi_fail(error, LUMI_ERR_BUSY, "the board refuses: %s", text);
    case lumi_wire_Result_BAD:
        return lumi_fail(error, LUMI_ERR_FORMAT, "the board: %s", text);
    case lumi_wire_Result_UNSUPPORTED:
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "the board cannot do this: %s", text);
    default:
        return lumi_fail(error, LUMI_ERR_IO, "the board failed: %s", text);
    }
}
