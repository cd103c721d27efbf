/* OTG_FS seen from the cable: what it answers to each token (RM0090 34.17, USB 2.0 8.4 to 8.6). */
#include "sim/board/chip_otg.h"

#include <string.h>

enum { KIND_OUT = 2, KIND_OUT_DONE = 3, KIND_SETUP_DONE = 4, KIND_SETUP = 6 };

bool f405_otg_push(struct f405 *chip, uint32_t status, const uint8_t *data, size_t size)
{
    struct otg *o = &chip->otg;
    unsigned words = 1 + ((unsigned)size + 3) / 4;
    if (o->tail - o->head >= 128 || o->words + words > o->grxfsiz || size > 64)
        return false;
    struct otg_entry *e = &o->receive[o->tail++ % 128];
    memset(e, 0, sizeof *e);
    e->status = status | (uint32_t)size << 4;
    if (size)
        memcpy(e->data, data, size);
    o->words += words;
    return true;
}

static bool listens(const struct f405 *chip, int address)
{
    const struct otg *o = &chip->otg;
    if (!f405_usb_attached(chip) || o->reset_end != F405_NEVER)
        return false;
    return address == o->address || (o->address_waits && address == (int)(o->dcfg >> 4 & 0x7f));
}

void f405_usb_vbus(struct f405 *chip, bool on)
{
    struct otg *o = &chip->otg;
    if (on == o->vbus)
        return;
    o->vbus = on;
    if (on) {
        o->gotgctl |= 1u << 19;
        o->gintsts |= SRQINT;
    } else {
        o->gotgctl &= ~(1u << 19);
        o->gotgint |= 4; /* SEDET */
        /* The bus falls silent: 34.5.3. */
        o->gintsts |= ESUSP | USBSUSP;
        o->dsts |= 1;
    }
    f405_otg_interrupts(chip);
}

void f405_usb_reset(struct f405 *chip, bool begin)
{
    struct otg *o = &chip->otg;
    if (!f405_usb_attached(chip))
        return;
    if (!begin) {
        o->reset_end = chip->now + F405_HZ / 100000;
        f405_schedule(chip);
        return;
    }
    o->gintsts |= USBRST;
    o->dsts &= ~1u;
    o->reset_end = F405_NEVER - 1;
    for (int i = 1; i < 4; i++) {
        o->in[i].ctl &= ~USBAEP;
        o->out[i].ctl &= ~USBAEP;
    }
    f405_otg_interrupts(chip);
}

void f405_otg_event(struct f405 *chip)
{
    struct otg *o = &chip->otg;
    o->reset_end = F405_NEVER;
    /* 34.17.7: at 32 MHz and more the turn-around is 6 clocks. */
    if (bits(o->gusbcfg, 10, 4) < 6)
        f405_complain(chip, "OTG_FS: a turn-around time of %u", bits(o->gusbcfg, 10, 4));
    o->gintsts |= ENUMDNE;
    o->dsts = (o->dsts & ~6u) | 3u << 1; /* full speed */
    f405_otg_interrupts(chip);
}

void f405_usb_suspend(struct f405 *chip, bool begin)
{
    struct otg *o = &chip->otg;
    if (!f405_usb_attached(chip))
        return;
    if (begin) {
        o->gintsts |= ESUSP | USBSUSP;
        o->dsts |= 1;
    } else {
        o->gintsts |= WKUPINT;
        o->dsts &= ~1u;
        f405_exti_edge(chip, 18, true); /* 12.2.5 */
    }
    f405_otg_interrupts(chip);
}

void f405_usb_sof(struct f405 *chip, unsigned frame)
{
    struct otg *o = &chip->otg;
    if (!f405_usb_attached(chip))
        return;
    o->dsts = (o->dsts & ~(0x3fffu << 8)) | (frame & 0x7ff) << 8;
    o->gintsts |= SOF;
    f405_otg_interrupts(chip);
}

enum f405_usb_answer f405_usb_setup(struct f405 *chip, int address, int endpoint, const uint8_t setup[8])
{
    struct otg *o = &chip->otg;
    if (!listens(chip, address) || endpoint != 0)
        return F405_USB_NONE;
    struct otg_endpoint *out = &o->out[0], *in = &o->in[0];
    /* 34.17.4: three SETUPs and their end always have room; if the firmware left none, the token goes unanswered. */
    if (o->words + 4 > o->grxfsiz || !f405_otg_push(chip, (uint32_t)KIND_SETUP << 17, setup, 8))
        return F405_USB_NONE;
    f405_otg_push(chip, (uint32_t)KIND_SETUP_DONE << 17, NULL, 0);
    unsigned count = out->tsiz >> 29 & 3;
    if (count)
        out->tsiz = (out->tsiz & ~(3u << 29)) | (count - 1) << 29;
    out->ctl = (out->ctl | NAKSTS) & ~STALL;
    in->ctl = (in->ctl | NAKSTS) & ~STALL;
    out->data1 = in->data1 = true;
    f405_otg_interrupts(chip);
    return F405_USB_ACK;
}

enum f405_usb_answer f405_usb_out(struct f405 *chip, int address, int endpoint, bool data1, const uint8_t *data,
                                  size_t size)
{
    struct otg *o = &chip->otg;
    if (!listens(chip, address) || endpoint > 3 || !(o->out[endpoint].ctl & USBAEP))
        return F405_USB_NONE;
    struct otg_endpoint *e = &o->out[endpoint];
    if (e->ctl & STALL)
        return F405_USB_STALL;
    unsigned most = f405_otg_packet_size(e, endpoint), left = e->tsiz & 0x7ffff, packets = e->tsiz >> 19 & 0x3ff;
    if (size > most) /* babble: no handshake, USB 2.0 8.7.4 */
        return F405_USB_NONE;
    if (!(e->ctl & EPENA) || e->ctl & NAKSTS || o->dctl & 8 || !packets)
        return F405_USB_NAK;
    if (data1 != e->data1) /* it has been taken before: 8.6.4 */
        return F405_USB_ACK;
    bool last = packets == 1 || size < most;
    unsigned words = 1 + ((unsigned)size + 3) / 4 + (last ? 1 : 0);
    if (o->words + words > o->grxfsiz)
        return F405_USB_NAK;
    uint32_t status = (uint32_t)endpoint | (data1 ? 2u << 15 : 0);
    f405_otg_push(chip, status | (uint32_t)KIND_OUT << 17, data, size);
    e->data1 = !e->data1;
    e->tsiz = (e->tsiz & 0x60000000u) | (packets - 1) << 19 | (size < left ? left - (unsigned)size : 0);
    if (last) {
        f405_otg_push(chip, status | (uint32_t)KIND_OUT_DONE << 17, NULL, 0);
        e->ctl |= NAKSTS;
    }
    f405_otg_interrupts(chip);
    return F405_USB_ACK;
}

enum f405_usb_answer f405_usb_in(struct f405 *chip, int address, int endpoint, uint8_t *data, size_t *size, bool *data1)
{
    struct otg *o = &chip->otg;
    *size = 0;
    if (!listens(chip, address) || endpoint > 3 || !(o->in[endpoint].ctl & USBAEP))
        return F405_USB_NONE;
    struct otg_endpoint *e = &o->in[endpoint];
    if (e->ctl & STALL)
        return F405_USB_STALL;
    if (!(e->ctl & EPENA) || e->ctl & NAKSTS || o->dctl & 4)
        return F405_USB_NAK;
    unsigned most = f405_otg_packet_size(e, endpoint), left = e->tsiz & 0x7ffff, packets = e->tsiz >> 19 & 0x3ff;
    unsigned length = left < most ? left : most, taken = (length + 3) & ~3u;
    if (e->fifo_bytes < taken) {
        e->interrupt |= ITTXFE;
        f405_otg_interrupts(chip);
        return F405_USB_NAK;
    }
    memcpy(data, e->fifo, length);
    memmove(e->fifo, e->fifo + taken, e->fifo_bytes - taken);
    e->fifo_bytes -= taken;
    *size = length;
    *data1 = e->data1;
    e->data1 = !e->data1;
    e->tsiz = (e->tsiz & 0x60000000u) | (packets - 1) << 19 | (left - length);
    if (packets == 1) {
        e->ctl &= ~EPENA;
        e->ctl |= NAKSTS;
        e->interrupt |= XFRC;
    }
    if (endpoint == 0 && o->address_waits && length == 0) {
        o->address = (int)(o->dcfg >> 4 & 0x7f);
        o->address_waits = false;
    }
    f405_otg_interrupts(chip);
    return F405_USB_ACK;
}
