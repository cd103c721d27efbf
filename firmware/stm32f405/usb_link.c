/* The stream of bytes on the bulk endpoints.
 *
 * 1. To the host: a ring; up to USB_BULK_BURST bytes that lie in one piece are a transfer of the core's. When the ring
 *    runs dry after a full packet, an empty one says so, or the host would wait for more.
 * 2. From the host: a packet is let in only if the ring has room for a full one; until then the core answers NAK.
 * 3. A reset, a cable pulled out, a new configuration: both rings are emptied. Half a frame is the framing's business.
 * 4. A halted endpoint keeps its bytes; a transfer that was cut is sent again from its begin. */
#include "firmware/stm32f405/cortex.h"
#include "firmware/stm32f405/port.h"
#include "firmware/stm32f405/usb_device.h"

#include <string.h>

#define IN_SIZE 1024u  /* from the host */
#define OUT_SIZE 2048u /* to it; powers of 2 */

static uint8_t in[IN_SIZE], out[OUT_SIZE];
static struct {
    uint32_t in_head, in_tail, out_head, out_tail;
    uint32_t sending; /* bytes of the transfer under way */
    bool busy;        /* one is */
    bool owe_empty;   /* the last packet was full */
    bool receiving;   /* a packet is let in */
    bool open, suspended, halted[2];
} stream;

/* Sends what there is to send. */
static void send_more(void)
{
    const uint32_t from = stream.out_tail % OUT_SIZE, used = stream.out_head - stream.out_tail;
    uint32_t size = used < OUT_SIZE - from ? used : OUT_SIZE - from;

    if (!stream.open || stream.busy || stream.halted[1] || (size == 0 && !stream.owe_empty))
        return;
    if (size > USB_BULK_BURST)
        size = USB_BULK_BURST;
    stream.sending = size;
    stream.busy = true;
    usb_bulk_send(out + from, size);
}

static void receive_more(void)
{
    if (!stream.open || stream.receiving || stream.halted[0] ||
        IN_SIZE - (stream.in_head - stream.in_tail) < LUMI_WIRE_USB_PACKET)
        return;
    stream.receiving = true;
    usb_bulk_receive();
}

void usb_link_open(void)
{
    memset(&stream, 0, sizeof stream);
    stream.open = true;
    receive_more();
}

void usb_link_close(void)
{
    memset(&stream, 0, sizeof stream);
}

void usb_link_halted(bool to_host, bool halted)
{
    stream.halted[to_host] = halted;
    if (to_host) {
        stream.busy = false;
        send_more();
    } else {
        stream.receiving = false;
        receive_more();
    }
}

void usb_link_received(const uint8_t *data, size_t size)
{
    for (size_t i = 0; i < size; i++)
        in[(stream.in_head + i) % IN_SIZE] = data[i];
    stream.in_head += (uint32_t)size;
}

void usb_link_receive_done(void)
{
    stream.receiving = false;
    receive_more();
}

void usb_link_sent(void)
{
    stream.owe_empty = stream.sending > 0 && stream.sending % LUMI_WIRE_USB_PACKET == 0;
    stream.out_tail += stream.sending;
    stream.sending = 0;
    stream.busy = false;
    send_more();
}

void usb_link_suspended(bool suspended)
{
    stream.suspended = suspended;
}

size_t usb_read(uint8_t *data, size_t size)
{
    const uint32_t lock = basepri_raise(PRIORITY_LINK);
    size_t count = 0;

    for (; count < size && stream.in_tail != stream.in_head; stream.in_tail++)
        data[count++] = in[stream.in_tail % IN_SIZE];
    receive_more();
    basepri_restore(lock);
    return count;
}

size_t usb_write(const uint8_t *data, size_t size)
{
    const uint32_t lock = basepri_raise(PRIORITY_LINK);

    if (!stream.open || size > OUT_SIZE - (stream.out_head - stream.out_tail)) {
        size = 0;
    } else {
        for (size_t i = 0; i < size; i++)
            out[(stream.out_head + i) % OUT_SIZE] = data[i];
        stream.out_head += (uint32_t)size;
        send_more();
    }
    basepri_restore(lock);
    return size;
}

bool usb_up(void)
{
    return stream.open && !stream.suspended;
}
