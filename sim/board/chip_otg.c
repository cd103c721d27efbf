/* OTG_FS as a device (RM0090 34): registers, FIFOs, interrupts. The bus side is in chip_otg_bus.c. */
#include "sim/board/chip_otg.h"

#include <string.h>

#define OTG_IRQ 67
#define OTG_WAKE_LINE 18
#define FIFO_WORDS 320 /* 34.11: 1.25 KiB for all FIFOs */

unsigned f405_otg_packet_size(const struct otg_endpoint *endpoint, int number)
{
    static const uint8_t ep0[4] = {64, 32, 16, 8};
    return number == 0 ? ep0[endpoint->ctl & 3] : endpoint->ctl & 0x7ff;
}

unsigned f405_otg_fifo_words(const struct otg *otg, int number)
{
    return otg->dieptxf[number] >> 16;
}

static unsigned free_words(const struct otg *otg, int number)
{
    return f405_otg_fifo_words(otg, number) - otg->in[number].fifo_bytes / 4;
}

/* What of an IN endpoint's interrupt register is so by its FIFO. */
static uint32_t in_interrupts(const struct otg *otg, int number)
{
    const struct otg_endpoint *e = &otg->in[number];
    unsigned size = f405_otg_fifo_words(otg, number), left = e->fifo_bytes / 4;
    bool empty = otg->gahbcfg & 1u << 7 ? left == 0 : left <= size / 2;
    uint32_t value = e->interrupt | (empty ? TXFE : 0);
    return e->ctl & NAKSTS ? value | INEPNE : value & ~(uint32_t)INEPNE;
}

static uint32_t daint(const struct otg *otg)
{
    uint32_t value = 0;
    for (int i = 0; i < 4; i++) {
        uint32_t mask = (otg->diepmsk & ~(uint32_t)TXFE) | (otg->diepempmsk >> i & 1 ? TXFE : 0);
        if (in_interrupts(otg, i) & mask)
            value |= 1u << i;
        if (otg->out[i].interrupt & otg->doepmsk)
            value |= 0x10000u << i;
    }
    return value;
}

static uint32_t gintsts(const struct otg *otg)
{
    uint32_t value = otg->gintsts, endpoints = daint(otg) & otg->daintmsk;
    value |= otg->head != otg->tail ? RXFLVL : 0;
    value |= endpoints & 0xffff ? IEPINT : 0;
    value |= endpoints >> 16 ? OEPINT : 0;
    value |= otg->gotgint ? OTGINT : 0;
    return value;
}

void f405_otg_interrupts(struct f405 *chip)
{
    const struct otg *o = &chip->otg;
    f405_cpu_irq(chip, OTG_IRQ, o->gahbcfg & 1 && gintsts(o) & o->gintmsk);
}

void f405_otg_reset(struct f405 *chip)
{
    bool vbus = chip->otg.vbus;
    struct otg *o = &chip->otg;
    memset(o, 0, sizeof *o);
    o->vbus = vbus;
    o->gotgctl = vbus ? 1u << 19 : 0; /* BSVLD */
    o->gusbcfg = 0x00001440;
    o->grxfsiz = 0x200;
    o->dieptxf[0] = 0x02000200;
    for (int i = 1; i < 4; i++)
        o->dieptxf[i] = 0x02000400u + (unsigned)(i - 1) * 0x200u;
    o->cid = 0x00001200;
    o->dctl = 0;
    o->dsts = 0x10;
    o->in[0].ctl = o->out[0].ctl = USBAEP;
    o->reset_end = F405_NEVER;
    f405_otg_interrupts(chip);
}

bool f405_usb_attached(const struct f405 *chip)
{
    const struct otg *o = &chip->otg;
    bool session = o->gccfg & 1u << 21 || (o->vbus && o->gccfg & 1u << 19);
    /* DS8626 table 9 */
    const bool wired = f405_gpio_is(chip, F405_PIN('A', 11), 10) && f405_gpio_is(chip, F405_PIN('A', 12), 10);
    return chip->on && wired && o->vbus && session && o->gccfg & 1u << 16 && !(o->dctl & 2) && o->gusbcfg & 1u << 30;
}

/* ---- registers ---- */

static void check_fifos(struct f405 *chip)
{
    const struct otg *o = &chip->otg;
    if (!(o->daintmsk >> 1 & 7)) /* endpoint 0 alone: they may not all be set yet */
        return;
    uint32_t end = o->grxfsiz;
    for (int i = 0; i < 4; i++) {
        uint32_t start = o->dieptxf[i] & 0xffff, depth = o->dieptxf[i] >> 16;
        if (!(o->in[i].ctl & USBAEP))
            continue;
        if (start < end || start + depth > FIFO_WORDS || depth < 16)
            f405_complain(chip, "OTG_FS: FIFO of endpoint %d at %u, %u words, does not fit", i, start, depth);
        end = start + depth;
    }
}

static void write_endpoint(struct f405 *chip, struct otg_endpoint *e, bool in, int number, uint32_t value)
{
    uint32_t keep = e->ctl & (NAKSTS | EPENA | (number == 0 ? (uint32_t)USBAEP : 0));
    uint32_t stall = number == 0 ? (e->ctl | value) & STALL : value & STALL; /* 0's is cleared by a SETUP only */
    e->ctl = keep | stall | (value & (number == 0 ? 3u : 0x7ffu)) | (value & (3u << 18 | 15u << 22));
    if (number)
        e->ctl |= value & USBAEP;
    if (value & CNAK)
        e->ctl &= ~(uint32_t)NAKSTS;
    if (value & SNAK)
        e->ctl |= NAKSTS;
    if (value & 1u << 28 && number)
        e->data1 = false;
    if (value & 1u << 29 && number)
        e->data1 = true;
    if (value & EPDIS && e->ctl & EPENA) {
        e->ctl &= ~EPENA;
        e->interrupt |= EPDISD;
    } else if (value & EPENA) {
        if (in && (e->tsiz >> 19 & 0x3ff) == 0)
            f405_complain(chip, "OTG_FS: IN endpoint %d enabled without a packet", number);
        e->ctl |= EPENA;
    }
    if (number && e->ctl & USBAEP)
        check_fifos(chip);
}

static bool endpoint_access(struct f405 *chip, bool in, uint32_t offset, bool write, uint32_t *value)
{
    int number = (int)(offset / 0x20);
    struct otg_endpoint *e = in ? &chip->otg.in[number] : &chip->otg.out[number];
    switch (offset % 0x20) {
    case 0x00:
        if (write)
            write_endpoint(chip, e, in, number, *value);
        else
            *value = e->ctl | (e->data1 && number ? 1u << 16 : 0);
        return true;
    case 0x08:
        if (write)
            e->interrupt &= ~*value;
        else
            *value = in ? in_interrupts(&chip->otg, number) : e->interrupt;
        return true;
    case 0x10:
        if (write)
            e->tsiz = *value;
        else
            *value = e->tsiz;
        return true;
    case 0x18:
        *value = free_words(&chip->otg, number);
        return in && !write;
    default:
        return false;
    }
}

static void write_grstctl(struct f405 *chip, uint32_t value)
{
    struct otg *o = &chip->otg;
    if (value & 1)
        f405_otg_reset(chip);
    if (value & 0x10)
        o->head = o->tail = o->words = o->read_at = o->read_end = 0;
    if (value & 0x20) {
        unsigned which = value >> 6 & 0x1f;
        for (unsigned i = 0; i < 4; i++)
            if (which == 0x10 || which == i)
                o->in[i].fifo_bytes = 0;
    }
}

static void write_dctl(struct f405 *chip, uint32_t value)
{
    struct otg *o = &chip->otg;
    uint32_t states = o->dctl & 0xc;
    states =
        (states | (value >> 7 & 1) << 2 | (value >> 9 & 1) << 3) & ~((value >> 8 & 1) << 2 | (value >> 10 & 1) << 3);
    if (value >> 9 & 1 && !(o->dctl & 8))
        f405_otg_push(chip, 1u << 17, NULL, 0);
    if (value >> 7 & 1)
        o->gintsts |= 1u << 6;
    if (value >> 8 & 1)
        o->gintsts &= ~(1u << 6);
    if (value >> 10 & 1)
        o->gintsts &= ~(1u << 7);
    o->dctl = (value & 0x873) | states;
}

static void write_dcfg(struct f405 *chip, uint32_t value)
{
    struct otg *o = &chip->otg;
    o->dcfg = value;
    int address = (int)(value >> 4 & 0x7f);
    /* 34.17.5: written before the status stage, it holds after it. */
    o->address_waits = address && address != o->address;
    if (!address)
        o->address = 0;
    if ((value & 3) != 3)
        f405_complain(chip, "OTG_FS: DCFG 0x%x is not full speed", value);
}

/* Takes the oldest entry: 34.16.2, GRXSTSP. */
static uint32_t pop(struct f405 *chip)
{
    struct otg *o = &chip->otg;
    if (o->read_at < o->read_end)
        f405_complain(chip, "OTG_FS: GRXSTSP popped with %u bytes unread", o->read_end - o->read_at);
    if (o->head == o->tail)
        return 0;
    const struct otg_entry *e = &o->receive[o->head++ % 128];
    uint32_t status = e->status, number = status & 3, size = status >> 4 & 0x7ff, kind = status >> 17 & 15;
    memcpy(o->popped, e->data, sizeof o->popped);
    o->read_at = 0;
    o->read_end = size;
    o->words -= 1 + (size + 3) / 4;
    if (kind == 1)
        o->gintsts |= 1u << 7; /* GONAKEFF */
    if (kind == 3) {
        o->out[number].interrupt |= XFRC;
        o->out[number].ctl &= ~EPENA;
    }
    if (kind == 4) {
        o->out[number].interrupt |= STUP;
        o->out[number].ctl &= ~EPENA;
    }
    return status;
}

static void fifo_access(struct f405 *chip, int number, bool write, uint32_t *value)
{
    struct otg *o = &chip->otg;
    if (!write) {
        *value = 0;
        if (o->read_at >= o->read_end) {
            f405_complain(chip, "OTG_FS: the receive FIFO is read beyond its packet");
            return;
        }
        memcpy(value, o->popped + o->read_at, 4);
        o->read_at += 4;
        return;
    }
    struct otg_endpoint *e = &o->in[number];
    if (!free_words(o, number) || e->fifo_bytes + 4 > sizeof e->fifo) {
        f405_complain(chip, "OTG_FS: the FIFO of endpoint %d is written while full", number);
        return;
    }
    memcpy(e->fifo + e->fifo_bytes, value, 4);
    e->fifo_bytes += 4;
}

static bool core_access(struct f405 *chip, uint32_t offset, bool write, uint32_t *value)
{
    struct otg *o = &chip->otg;
    switch (offset) {
    case 0x004:
        if (write)
            o->gotgint &= ~*value;
        else
            *value = o->gotgint;
        return true;
    case 0x010:
        if (write)
            write_grstctl(chip, *value);
        else
            *value = 0x80000000u;
        return true;
    case 0x014: /* written as 1 to clear; the rest follow their causes */
        if (write)
            o->gintsts &= ~(*value & 0xF030FC0Au);
        else
            *value = gintsts(o);
        return true;
    case 0x01c:
        *value = o->head == o->tail ? 0 : o->receive[o->head % 128].status;
        return !write;
    case 0x020:
        *value = pop(chip);
        return !write;
    case 0x800:
        if (write)
            write_dcfg(chip, *value);
        else
            *value = o->dcfg;
        return true;
    case 0x804:
        if (write)
            write_dctl(chip, *value);
        else
            *value = o->dctl;
        return true;
    case 0x818:
        *value = daint(o);
        return !write;
    default:
        return false;
    }
}

/* RM0090 34.3 and 7.2.3: 48 MHz, ±0.25 %. */
static void power_up(struct f405 *chip)
{
    const uint32_t hz = f405_rcc_usb_hz(chip);
    if (hz < 47880000 || hz > 48120000)
        f405_complain(chip, "OTG_FS: its clock is %u Hz", hz);
}

bool f405_otg_access(struct f405 *chip, int index, uint32_t offset, bool write, uint32_t *value)
{
    (void)index;
    struct otg *o = &chip->otg;
    const struct {
        uint32_t offset;
        uint32_t *reg;
    } plain[] = {{0x000, &o->gotgctl},    {0x008, &o->gahbcfg},    {0x00c, &o->gusbcfg},    {0x018, &o->gintmsk},
                 {0x024, &o->grxfsiz},    {0x028, &o->dieptxf[0]}, {0x038, &o->gccfg},      {0x03c, &o->cid},
                 {0x104, &o->dieptxf[1]}, {0x108, &o->dieptxf[2]}, {0x10c, &o->dieptxf[3]}, {0x808, &o->dsts},
                 {0x810, &o->diepmsk},    {0x814, &o->doepmsk},    {0x81c, &o->daintmsk},   {0x828, &o->dvbusdis},
                 {0x82c, &o->dvbuspulse}, {0x834, &o->diepempmsk}, {0xe00, &o->pcgcctl}};
    bool known = true;
    if (offset >= 0x1000 && offset < 0x5000)
        fifo_access(chip, (int)(offset / 0x1000) - 1, write, value);
    else if (offset >= 0x900 && offset < 0x980)
        known = endpoint_access(chip, true, offset - 0x900, write, value);
    else if (offset >= 0xb00 && offset < 0xb80)
        known = endpoint_access(chip, false, offset - 0xb00, write, value);
    else if (!core_access(chip, offset, write, value)) {
        known = false;
        for (size_t i = 0; i < sizeof plain / sizeof *plain; i++) {
            if (plain[i].offset != offset)
                continue;
            known = true;
            if (!write)
                *value = *plain[i].reg;
            else if (plain[i].reg != &o->dsts)
                *plain[i].reg = *value;
        }
    }
    if (write && offset == 0x038 && *value & 1u << 16)
        power_up(chip);
    f405_otg_interrupts(chip);
    return known;
}
