/* DMA1 and DMA2 (RM0090 10): streams of single items between a peripheral and memory, circular or not, both ways.
 * Every request is served at once. No FIFO mode, no bursts, no double buffer. */
#include "sim/board/chip_priv.h"

enum { EN = 1, DMEIE = 2, TEIE = 4, HTIE = 8, TCIE = 0x10, PFCTRL = 0x20, CIRC = 0x100, PINC = 0x200, MINC = 0x400 };

static const uint8_t irqs[2][8] = {{11, 12, 13, 14, 15, 16, 17, 47}, {56, 57, 58, 59, 60, 68, 69, 70}};

/* 10.5.1: where a stream's flags are in LISR and HISR. */
static int shift_of(int stream)
{
    static const uint8_t shift[4] = {0, 6, 16, 22};
    return shift[stream & 3];
}

static void interrupts(struct f405 *chip, int dma, int stream)
{
    const struct dma_stream *s = &chip->dma[dma].stream[stream];
    uint32_t flags = chip->dma[dma].isr[stream / 4] >> shift_of(stream);
    bool active = (s->cr & TCIE && flags & 0x20) || (s->cr & HTIE && flags & 0x10) || (s->cr & TEIE && flags & 8);
    f405_cpu_irq(chip, irqs[dma][stream], active);
}

static void flag(struct f405 *chip, int dma, int stream, uint32_t bit)
{
    chip->dma[dma].isr[stream / 4] |= bit << shift_of(stream);
}

/* 10.3.3 and the bus matrix (2.1): only DMA2 reaches the AHB's peripherals, neither the core-coupled memory. */
static bool reachable(struct f405 *chip, int dma, uint32_t address)
{
    bool ahb = address >= 0x40020000u && address < 0x60000000u;
    if ((ahb && dma == 0) || address - 0x10000000u < CCM_SIZE) {
        f405_complain(chip, "DMA%d cannot reach 0x%08x", dma + 1, address);
        return false;
    }
    return true;
}

bool f405_dma_request(struct f405 *chip, int dma, int stream, int channel)
{
    struct dma_stream *s = &chip->dma[dma].stream[stream];
    if (!(s->cr & EN) || bits(s->cr, 25, 3) != (unsigned)channel || !s->ndtr)
        return false;
    unsigned psize = 1u << bits(s->cr, 11, 2), msize = 1u << bits(s->cr, 13, 2);
    if (psize != msize || psize > 4) {
        f405_complain(chip, "DMA%d stream %d: items of different sizes are not modelled", dma + 1, stream);
        return false;
    }
    uint32_t peripheral = s->par + (s->cr & PINC ? s->at * psize : 0);
    uint32_t memory = s->m0ar + (s->cr & MINC ? s->at * msize : 0);
    if (!reachable(chip, dma, peripheral) || !reachable(chip, dma, memory))
        return false;
    /* Counted before it is moved: the write may bring the next request. */
    s->at++;
    uint32_t left = --s->ndtr;
    if (left == s->reload / 2)
        flag(chip, dma, stream, 0x10);
    if (left == 0) {
        flag(chip, dma, stream, 0x20);
        s->at = 0;
        s->ndtr = s->cr & CIRC ? s->reload : 0;
        if (!(s->cr & CIRC))
            s->cr &= ~(uint32_t)EN;
    }
    if (bits(s->cr, 6, 2) == 1)
        f405_bus_write(chip, peripheral, psize, f405_bus_read(chip, memory, msize));
    else
        f405_bus_write(chip, memory, msize, f405_bus_read(chip, peripheral, psize));
    interrupts(chip, dma, stream);
    return true;
}

static void write_control(struct f405 *chip, int dma, int stream, uint32_t value)
{
    struct dma_stream *s = &chip->dma[dma].stream[stream];
    uint32_t old = s->cr;
    if (value & (1u << 18 | PFCTRL | 3u << 21 | 3u << 23) || bits(value, 6, 2) > 1)
        f405_complain(chip, "DMA%d stream %d: CR 0x%08x has a mode that is not modelled", dma + 1, stream, value);
    if (old & EN && value & EN && (old ^ value) & ~(uint32_t)(DMEIE | TEIE | HTIE | TCIE))
        f405_complain(chip, "DMA%d stream %d: CR changed while it runs", dma + 1, stream);
    s->cr = value;
    if (value & EN && !(old & EN)) {
        /* 10.3.17: its flags must have been cleared. */
        if (chip->dma[dma].isr[stream / 4] >> shift_of(stream) & 0x3d)
            f405_complain(chip, "DMA%d stream %d is started with flags standing", dma + 1, stream);
        s->reload = s->ndtr;
        s->at = 0;
        for (int i = 1; i < F405_USARTS; i++)
            f405_usart_pump(chip, i);
    } else if (old & EN && !(value & EN) && s->ndtr) {
        flag(chip, dma, stream, 0x20); /* 10.3.14: stopped, TCIF tells when */
    }
    interrupts(chip, dma, stream);
}

bool f405_dma_access(struct f405 *chip, int dma, uint32_t offset, bool write, uint32_t *value)
{
    struct dma *d = &chip->dma[dma];
    if (offset < 8) {
        *value = d->isr[offset / 4];
        return !write;
    }
    if (offset < 0x10) {
        if (!write)
            *value = 0;
        else
            d->isr[offset / 4 - 2] &= ~*value;
        for (int i = 0; i < 8; i++)
            interrupts(chip, dma, i);
        return true;
    }
    int stream = (int)(offset - 0x10) / 0x18;
    if (stream > 7)
        return false;
    struct dma_stream *s = &d->stream[stream];
    uint32_t *const reg[] = {&s->cr, &s->ndtr, &s->par, &s->m0ar, &s->m1ar, &s->fcr};
    unsigned i = (offset - 0x10) % 0x18 / 4;
    if (!write)
        *value = *reg[i];
    else if (i == 0)
        write_control(chip, dma, stream, *value);
    else if (s->cr & EN)
        f405_complain(chip, "DMA%d stream %d: register %u written while it runs", dma + 1, stream, i);
    else
        *reg[i] = *value;
    return true;
}
