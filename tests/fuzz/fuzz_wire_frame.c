/* Bytes off a line: frames and what is in them, in both directions. What is decoded must encode to what decodes to the
 * same; every payload must come through a frame. */
#include "proto/wire/frame.h"
#include "proto/wire/message.h"

#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* Enums of unknown value may take more bytes than those that the schema has. */
#define ROOM 2048

static void host_message(const uint8_t *payload, size_t size)
{
    static lumi_wire_HostFrame message, again;
    uint8_t once[ROOM], twice[ROOM];

    if (!lumi_wire_decode_host(payload, size, &message)) {
        uint32_t token, number;

        lumi_wire_decode_request_head(payload, size, &token, &number);
        return;
    }
    size_t length = lumi_wire_encode_host(&message, once, sizeof once);
    if (length == 0)
        return; /* an empty one */
    if (!lumi_wire_decode_host(once, length, &again) || lumi_wire_encode_host(&again, twice, sizeof twice) != length ||
        memcmp(once, twice, length) != 0)
        abort();
}

static void printable(const char *text, size_t size)
{
    if (!memchr(text, 0, size))
        abort();
    for (; *text; text++)
        if ((unsigned char)*text < 0x20 || *text == 0x7f)
            abort();
}

static void board_message(const uint8_t *payload, size_t size)
{
    static lumi_wire_BoardFrame message, again;
    uint8_t once[ROOM], twice[ROOM];

    if (!lumi_wire_decode_board(payload, size, &message))
        return;
    if (message.which_body == lumi_wire_BoardFrame_reply_tag)
        printable(message.body.reply.text, sizeof message.body.reply.text);
    if (message.which_body == lumi_wire_BoardFrame_welcome_tag)
        printable(message.body.welcome.firmware, sizeof message.body.welcome.firmware);
    size_t length = lumi_wire_encode_board(&message, once, sizeof once);
    if (length == 0)
        return;
    if (!lumi_wire_decode_board(once, length, &again) ||
        lumi_wire_encode_board(&again, twice, sizeof twice) != length || memcmp(once, twice, length) != 0)
        abort();
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct lumi_wire_deframer deframer;
    uint8_t frame[LUMI_WIRE_FRAME_MAX];
    bool whole = false;

    lumi_wire_deframer_init(&deframer);
    for (size_t i = 0; i < size; i++)
        if (lumi_wire_deframe(&deframer, data[i])) {
            host_message(deframer.data, deframer.size);
            board_message(deframer.data, deframer.size);
        }
    if (size > LUMI_WIRE_PAYLOAD_MAX)
        return 0;
    host_message(data, size);
    board_message(data, size);
    size_t length = lumi_wire_frame(data, size, frame);
    for (size_t i = 0; i < length; i++)
        whole = lumi_wire_deframe(&deframer, frame[i]);
    if (!whole || deframer.size != size || memcmp(deframer.data, data, size) != 0)
        abort();
    return 0;
}
