/* The USARTs (RM0090 30), asynchronous, 8 bits, no parity: bytes take their time on the line, DMA or interrupts move
 * them, a byte that nobody takes overruns. And ADC1 (13): single conversions and sequences, one after another. */
#include "sim/board/chip_priv.h"

#include <string.h>

enum { FE = 2, ORE = 8, IDLE = 0x10, RXNE = 0x20, TC = 0x40, TXE = 0x80 };
enum { RE = 4, TE = 8, IDLEIE = 0x10, RXNEIE = 0x20, TCIE = 0x40, TXEIE = 0x80, UE = 0x2000, OVER8 = 0x8000 };
enum { EIE = 1, DMAR = 0x40, DMAT = 0x80 };

/* DS8626 table 9: the pins a USART's line can be at. */
#define NO_PIN 255
static bool wired(const struct f405 *chip, int index, bool transmit)
{
    static const struct {
        uint8_t function, pins[2][3]; /* receiving, sending */
    } map[F405_USARTS] = {
        [1] = {7, {{F405_PIN('A', 10), F405_PIN('B', 7), NO_PIN}, {F405_PIN('A', 9), F405_PIN('B', 6), NO_PIN}}},
        [2] = {7, {{F405_PIN('A', 3), F405_PIN('D', 6), NO_PIN}, {F405_PIN('A', 2), F405_PIN('D', 5), NO_PIN}}},
        [3] = {7,
               {{F405_PIN('B', 11), F405_PIN('C', 11), F405_PIN('D', 9)},
                {F405_PIN('B', 10), F405_PIN('C', 10), F405_PIN('D', 8)}}},
        [4] = {8, {{F405_PIN('A', 1), F405_PIN('C', 11), NO_PIN}, {F405_PIN('A', 0), F405_PIN('C', 10), NO_PIN}}},
        [5] = {8, {{F405_PIN('D', 2), NO_PIN, NO_PIN}, {F405_PIN('C', 12), NO_PIN, NO_PIN}}},
        [6] = {8, {{F405_PIN('C', 7), F405_PIN('G', 9), NO_PIN}, {F405_PIN('C', 6), F405_PIN('G', 14), NO_PIN}}},
    };
    for (int i = 0; i < 3; i++) {
        const int pin = map[index].pins[transmit][i];
        if (pin != NO_PIN && f405_gpio_is(chip, pin, map[index].function))
            return true;
    }
    return false;
}

void f405_usart_reset(struct f405 *chip)
{
    for (int i = 1; i < F405_USARTS; i++)
        chip->usart[i] = (struct usart){.sr = 0xc0, .sent = F405_NEVER, .arrives = F405_NEVER, .idle = F405_NEVER};
}

/* 30.3.4: bits of a time; ten of them a byte. */
static uint64_t byte_time(const struct f405 *chip, int index)
{
    const struct usart *u = &chip->usart[index];
    unsigned bus = index == 1 || index == 6 ? chip->rcc.apb2 : chip->rcc.apb1;
    uint32_t divider = u->cr1 & OVER8 ? (u->brr >> 4 << 3 | (u->brr & 7)) : u->brr;
    unsigned stop = bits(u->cr2, 12, 2) == 2 ? 11 : 10;
    return (uint64_t)(divider ? divider : 1) * bus * stop;
}

static void interrupts(struct f405 *chip, int index)
{
    static const uint8_t irq[F405_USARTS] = {0, 37, 38, 39, 52, 53, 71};
    const struct usart *u = &chip->usart[index];
    bool active = (u->cr1 & IDLEIE && u->sr & IDLE) || (u->cr1 & RXNEIE && u->sr & (RXNE | ORE)) ||
                  (u->cr1 & TCIE && u->sr & TC) || (u->cr1 & TXEIE && u->sr & TXE) ||
                  (u->cr3 & EIE && u->cr3 & DMAR && u->sr & (FE | ORE));
    f405_cpu_irq(chip, irq[index], active);
}

/* Tables 42 and 43: where requests go; −1 ends. */
static bool ask_dma(struct f405 *chip, int index, bool transmit)
{
    static const int8_t map[F405_USARTS][2][2][3] = {
        [1] = {{{1, 2, 4}, {1, 5, 4}}, {{1, 7, 4}, {-1, 0, 0}}},
        [2] = {{{0, 5, 4}, {-1, 0, 0}}, {{0, 6, 4}, {-1, 0, 0}}},
        [3] = {{{0, 1, 4}, {-1, 0, 0}}, {{0, 3, 4}, {0, 4, 7}}},
        [4] = {{{0, 2, 4}, {-1, 0, 0}}, {{0, 4, 4}, {-1, 0, 0}}},
        [5] = {{{0, 0, 4}, {-1, 0, 0}}, {{0, 7, 4}, {-1, 0, 0}}},
        [6] = {{{1, 1, 5}, {1, 2, 5}}, {{1, 6, 5}, {1, 7, 5}}},
    };
    for (int i = 0; i < 2; i++) {
        const int8_t *m = map[index][transmit][i];
        if (m[0] >= 0 && f405_dma_request(chip, m[0], m[1], m[2]))
            return true;
    }
    return false;
}

void f405_usart_pump(struct f405 *chip, int index)
{
    struct usart *u = &chip->usart[index];
    if (!(u->cr1 & UE))
        return;
    while (u->cr3 & DMAT && u->cr1 & TE && u->sr & TXE)
        if (!ask_dma(chip, index, true))
            break;
    if (u->cr3 & DMAR && u->sr & RXNE)
        ask_dma(chip, index, false);
}

static void transmit(struct f405 *chip, int index, uint8_t byte)
{
    struct usart *u = &chip->usart[index];
    u->sr &= ~(uint32_t)TC;
    if (u->sending) {
        if (u->holding)
            f405_complain(chip, "USART%d_DR written while TXE is 0", index);
        u->hold = byte;
        u->holding = true;
        u->sr &= ~(uint32_t)TXE;
    } else {
        u->shift = byte;
        u->sending = true;
        u->sent = chip->now + byte_time(chip, index);
        u->sr |= TXE;
    }
}

static void sent(struct f405 *chip, int index)
{
    struct usart *u = &chip->usart[index];
    if (chip->ops->uart_out && wired(chip, index, true))
        chip->ops->uart_out(chip->context, index, u->shift, u->sent);
    if (u->holding) {
        u->shift = u->hold;
        u->holding = false;
        u->sent += byte_time(chip, index);
        u->sr |= TXE;
    } else {
        u->sending = false;
        u->sent = F405_NEVER;
        u->sr |= TC;
    }
}

static void arrived(struct f405 *chip, int index)
{
    struct usart *u = &chip->usart[index];
    uint8_t byte = u->queue[u->head++ % sizeof u->queue];
    uint64_t at = u->arrives;
    bool more = u->head != u->tail;
    u->arrives = more ? at + byte_time(chip, index) : F405_NEVER;
    u->idle = more ? F405_NEVER : at + byte_time(chip, index); /* a frame's length of silence */
    if ((u->cr1 & (UE | RE)) != (UE | RE) || !wired(chip, index, false))
        return;
    if (u->sr & RXNE) {
        u->sr |= ORE;
        return;
    }
    u->dr = byte;
    u->sr |= RXNE | (u->framing_error ? FE : 0);
    u->framing_error = false;
}

uint64_t f405_usart_next(const struct f405 *chip, int index)
{
    const struct usart *u = &chip->usart[index];
    uint64_t next = u->sent < u->arrives ? u->sent : u->arrives;
    return u->idle < next ? u->idle : next;
}

void f405_usart_event(struct f405 *chip, int index)
{
    struct usart *u = &chip->usart[index];
    uint64_t at = f405_usart_next(chip, index);
    if (u->sent == at)
        sent(chip, index);
    if (u->arrives == at) {
        arrived(chip, index);
    } else if (u->idle == at) {
        u->idle = F405_NEVER;
        if (u->cr1 & RE)
            u->sr |= IDLE;
    }
    f405_usart_pump(chip, index);
    interrupts(chip, index);
}

size_t f405_uart_in(struct f405 *chip, int index, const uint8_t *data, size_t size)
{
    struct usart *u = &chip->usart[index];
    size_t taken = 0;
    for (; taken < size && u->tail - u->head < sizeof u->queue; taken++)
        u->queue[u->tail++ % sizeof u->queue] = data[taken];
    if (taken && u->arrives == F405_NEVER)
        u->arrives = chip->now + byte_time(chip, index);
    f405_schedule(chip);
    return taken;
}

void f405_uart_break(struct f405 *chip, int index)
{
    chip->usart[index].framing_error = true;
}

static uint32_t read_data(struct f405 *chip, int index)
{
    struct usart *u = &chip->usart[index];
    u->sr &= ~(uint32_t)(RXNE | (u->sr_read ? FE | ORE | IDLE : 0)); /* 30.6.1: SR, then DR */
    u->sr_read = false;
    interrupts(chip, index);
    return u->dr;
}

bool f405_usart_access(struct f405 *chip, int index, uint32_t offset, bool write, uint32_t *value)
{
    struct usart *u = &chip->usart[index];
    uint32_t *const reg[] = {&u->sr, &u->dr, &u->brr, &u->cr1, &u->cr2, &u->cr3, &u->gtpr};
    if (offset > 0x18)
        return false;
    if (!write) {
        *value = offset == 4 ? read_data(chip, index) : *reg[offset / 4];
        u->sr_read |= offset == 0;
        return true;
    }
    if (offset == 0)
        u->sr &= *value | ~(uint32_t)(TC | RXNE | 0x300);
    else if (offset == 4)
        transmit(chip, index, (uint8_t)*value);
    else
        *reg[offset / 4] = *value;
    if (u->cr1 & 0x1600 || u->cr2 & 0x4800 || u->cr3 & 0x32a)
        f405_complain(chip, "USART%d: CR1 0x%x, CR2 0x%x, CR3 0x%x have a mode that is not modelled", index, u->cr1,
                      u->cr2, u->cr3);
    f405_usart_pump(chip, index);
    interrupts(chip, index);
    return true;
}

/* ---- ADC1 ---- */

enum { EOC = 2, STRT = 0x10, OVR = 0x20 };

/* 13.5: sampling, and 12 cycles of ADCCLK = PCLK2 / 2, 4, 6, 8. */
static uint64_t conversion_time(const struct f405 *chip, int channel)
{
    static const uint16_t sampling[8] = {3, 15, 28, 56, 84, 112, 144, 480};
    const struct adc *a = &chip->adc;
    unsigned field = channel < 10 ? bits(a->smpr[1], channel * 3, 3) : bits(a->smpr[0], (channel - 10) * 3, 3);
    return (uint64_t)(sampling[field] + 12) * chip->rcc.apb2 * 2 * (bits(chip->adc_ccr, 16, 2) + 1);
}

static int ranked_channel(const struct adc *a)
{
    return (int)(a->rank < 6    ? bits(a->sqr[2], a->rank * 5, 5)
                 : a->rank < 12 ? bits(a->sqr[1], (a->rank - 6) * 5, 5)
                                : bits(a->sqr[0], (a->rank - 12) * 5, 5));
}

static void convert(struct f405 *chip)
{
    struct adc *a = &chip->adc;
    a->sr |= STRT;
    a->done = chip->now + conversion_time(chip, ranked_channel(a));
    f405_schedule(chip);
}

static void adc_interrupts(struct f405 *chip)
{
    f405_cpu_irq(chip, 18,
                 (chip->adc.sr & EOC && chip->adc.cr1 & 0x20) || (chip->adc.sr & OVR && chip->adc.cr1 & 1u << 26));
}

void f405_adc_event(struct f405 *chip)
{
    struct adc *a = &chip->adc;
    int channel = ranked_channel(a);
    bool last = a->rank >= (int)bits(a->sqr[0], 20, 4);
    /* Table 7: where the channels' pins are. */
    if (channel < 16 && !f405_gpio_is_analog(chip, channel < 8    ? F405_PIN('A', channel)
                                                   : channel < 10 ? F405_PIN('B', channel - 8)
                                                                  : F405_PIN('C', channel - 10)))
        f405_complain(chip, "ADC1 channel %d: its pin is not analog", channel);
    a->done = F405_NEVER;
    a->dr = chip->ops->adc ? (uint32_t)chip->ops->adc(chip->context, channel) & 0xfff : 0;
    if (last || a->cr2 & 1u << 10)
        a->sr |= EOC;
    a->rank = last ? 0 : a->rank + 1;
    if (a->cr2 & 1u << 8 && (f405_dma_request(chip, 1, 0, 0) || f405_dma_request(chip, 1, 4, 0)))
        a->sr &= ~(uint32_t)EOC;
    /* Over and over, and nothing but the data register to tell: that is computed when it is read. */
    a->at_reading = last && a->cr2 & 2 && !(a->cr2 & 1u << 8) && !(a->cr1 & 0x20) && !bits(a->sqr[0], 20, 4);
    if (!a->at_reading && (!last || a->cr2 & 2))
        convert(chip);
    adc_interrupts(chip);
}

bool f405_adc_access(struct f405 *chip, int index, uint32_t offset, bool write, uint32_t *value)
{
    (void)index;
    struct adc *a = &chip->adc;
    if (offset == 0x304) { /* the common control register */
        if (write)
            chip->adc_ccr = *value;
        else
            *value = chip->adc_ccr;
        return true;
    }
    uint32_t *const reg[] = {&a->sr,  &a->cr1,    &a->cr2,    &a->smpr[0], &a->smpr[1], NULL, NULL, NULL, NULL, &a->htr,
                             &a->ltr, &a->sqr[0], &a->sqr[1], &a->sqr[2],  NULL,        NULL, NULL, NULL, NULL, &a->dr};
    if (offset > 0x4c || !reg[offset / 4])
        return false;
    if (!write) {
        if (offset == 0x4c && a->at_reading && chip->ops->adc)
            a->dr = (uint32_t)chip->ops->adc(chip->context, ranked_channel(a)) & 0xfff;
        *value = *reg[offset / 4];
        if (offset == 0x4c)
            a->sr &= ~(uint32_t)EOC;
    } else if (offset == 0) {
        a->sr &= *value;
    } else if (offset == 8) {
        a->cr2 = *value & ~(1u << 30);
        if (*value & 1u << 30 && *value & 1 && a->done == F405_NEVER) {
            a->rank = 0;
            convert(chip);
        }
    } else {
        *reg[offset / 4] = *value;
    }
    adc_interrupts(chip);
    return true;
}
