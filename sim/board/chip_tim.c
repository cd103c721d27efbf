/* The timers (RM0090 17 to 20), counting up: update events with preloads and repetition, compare and PWM outputs with
 * exact edges, capture, one-pulse mode, DMA requests. No slave modes, no break, no dead time. A compare match happens
 * when the counter arrives at CCRx; a value that is written when the counter has passed it matches a round later. */
#include "sim/board/chip_priv.h"

enum { CEN = 1, UDIS = 2, URS = 4, OPM = 8, ARPE = 0x80 };

static bool wide(int index)
{
    return index == 2 || index == 5;
}

static bool advanced(int index)
{
    return index == 1 || index == 8;
}

static unsigned kernel_clock(const struct f405 *chip, int index)
{
    bool apb2 = advanced(index) || (index >= 9 && index <= 11);
    return apb2 ? chip->rcc.tim1_clock : chip->rcc.tim2_clock;
}

static uint64_t tick(const struct f405 *chip, int index)
{
    return (uint64_t)kernel_clock(chip, index) * (chip->timer[index].psc_now + 1);
}

static unsigned channel_mode(const struct timer *t, int channel, int low, int count)
{
    return bits(t->ccmr[channel / 2], channel % 2 * 8 + low, count);
}

void f405_timer_reset(struct f405 *chip)
{
    for (int i = 1; i < TIMERS; i++)
        chip->timer[i].arr = chip->timer[i].arr_now = wide(i) ? 0xffffffffu : 0xffff;
}

/* ---- interrupts and DMA ---- */

static void interrupts(struct f405 *chip, int index)
{
    const struct timer *t = &chip->timer[index];
    static const uint8_t irq[TIMERS] = {0, 25, 28, 29, 30, 50, 54, 55, 44, 24, 25, 26, 43, 44, 45};
    uint32_t active = t->sr & t->dier & 0x5f;
    if (advanced(index)) { /* update and compare have vectors of their own */
        f405_cpu_irq(chip, irq[index], active & 1);
        f405_cpu_irq(chip, irq[index] + 2, active & 0x1e);
    } else {
        f405_cpu_irq(chip, irq[index], active);
    }
}

/* RM0090 tables 42 and 43. `source`: 0 update, 1 to 4 the channels. */
static void request_dma(struct f405 *chip, int index, int source)
{
    static const struct {
        uint8_t timer, source, dma, stream, channel;
    } map[] = {
        {1, 0, 1, 5, 6}, {1, 1, 1, 1, 6}, {1, 1, 1, 3, 6}, {1, 1, 1, 6, 0}, {1, 2, 1, 2, 6}, {1, 2, 1, 6, 0},
        {1, 3, 1, 6, 6}, {1, 3, 1, 6, 0}, {1, 4, 1, 4, 6}, {2, 0, 0, 1, 3}, {2, 0, 0, 7, 3}, {2, 1, 0, 5, 3},
        {2, 2, 0, 6, 3}, {2, 3, 0, 1, 3}, {2, 4, 0, 6, 3}, {2, 4, 0, 7, 3}, {3, 0, 0, 2, 5}, {3, 1, 0, 4, 5},
        {3, 2, 0, 5, 5}, {3, 3, 0, 7, 5}, {3, 4, 0, 2, 5}, {4, 0, 0, 6, 2}, {4, 1, 0, 0, 2}, {4, 2, 0, 3, 2},
        {4, 3, 0, 7, 2}, {5, 0, 0, 0, 6}, {5, 0, 0, 6, 6}, {5, 1, 0, 2, 6}, {5, 2, 0, 4, 6}, {5, 3, 0, 0, 6},
        {5, 4, 0, 1, 6}, {5, 4, 0, 3, 6}, {6, 0, 0, 1, 7}, {7, 0, 0, 2, 1}, {7, 0, 0, 4, 1}, {8, 0, 1, 1, 7},
        {8, 1, 1, 2, 7}, {8, 1, 1, 2, 0}, {8, 2, 1, 3, 7}, {8, 2, 1, 2, 0}, {8, 3, 1, 4, 7}, {8, 3, 1, 2, 0},
        {8, 4, 1, 7, 7},
    };
    if (!(chip->timer[index].dier >> (8 + source) & 1))
        return;
    for (size_t i = 0; i < sizeof map / sizeof *map; i++)
        if (map[i].timer == index && map[i].source == source)
            f405_dma_request(chip, map[i].dma, map[i].stream, map[i].channel);
}

/* ---- outputs ---- */

bool f405_timer_level(const struct f405 *chip, int index, int channel)
{
    const struct timer *t = &chip->timer[index];
    if (!(t->ccer >> (channel * 4) & 1) || (advanced(index) && !(t->bdtr >> 15 & 1)))
        return false;
    return t->ref[channel] != (t->ccer >> (channel * 4 + 1) & 1);
}

static void forced(struct timer *t, uint32_t cnt)
{
    for (int c = 0; c < 4; c++) {
        if (channel_mode(t, c, 0, 2))
            continue;
        switch (channel_mode(t, c, 4, 3)) {
        case 4:
            t->ref[c] = false;
            break;
        case 5:
            t->ref[c] = true;
            break;
        case 6:
            t->ref[c] = cnt < t->ccr_now[c];
            break;
        case 7:
            t->ref[c] = cnt >= t->ccr_now[c];
            break;
        default:
            break;
        }
    }
}

static void outputs(struct f405 *chip, int index, uint64_t at)
{
    struct timer *t = &chip->timer[index];
    for (int c = 0; c < 4; c++) {
        bool level = f405_timer_level(chip, index, c);
        if (level != t->shown[c]) {
            t->shown[c] = level;
            f405_gpio_timer_output(chip, index, c, at);
        }
    }
}

/* ---- counting ---- */

uint32_t f405_timer_count(const struct f405 *chip, int index, uint64_t at)
{
    const struct timer *t = &chip->timer[index];
    if (!(t->cr1 & CEN) || at < t->base)
        return t->cnt;
    return t->cnt + (uint32_t)((at - t->base) / tick(chip, index));
}

static uint64_t top(int index, const struct timer *t)
{
    return t->cnt <= t->arr_now ? t->arr_now : wide(index) ? 0xffffffffu : 0xffff;
}

/* When something happens to it next: the counter reaches a compare value, or wraps. */
uint64_t f405_timer_next(const struct f405 *chip, int index)
{
    const struct timer *t = &chip->timer[index];
    if (!(t->cr1 & CEN))
        return F405_NEVER;
    uint64_t limit = top(index, t), ticks = limit + 1 - t->cnt;
    for (int c = 0; c < 4; c++)
        if (t->ccr_now[c] > t->cnt && t->ccr_now[c] <= limit && !channel_mode(t, c, 0, 2) &&
            t->ccr_now[c] - t->cnt < ticks)
            ticks = t->ccr_now[c] - t->cnt;
    return t->base + ticks * tick(chip, index);
}

static void update(struct f405 *chip, int index, bool software)
{
    struct timer *t = &chip->timer[index];
    if (t->cr1 & UDIS)
        return;
    if (!software && t->repeat) {
        t->repeat--;
        return;
    }
    t->repeat = advanced(index) ? t->rcr & 0xff : 0;
    t->psc_now = t->psc;
    t->arr_now = t->arr;
    for (int c = 0; c < 4; c++)
        if (!channel_mode(t, c, 0, 2))
            t->ccr_now[c] = t->ccr[c];
    if (!software && t->cr1 & OPM)
        t->cr1 &= ~(uint32_t)CEN;
    if (software && t->cr1 & URS)
        return;
    t->sr |= 1;
    request_dma(chip, index, 0);
}

static void match(struct f405 *chip, int index, int channel)
{
    struct timer *t = &chip->timer[index];
    switch (channel_mode(t, channel, 4, 3)) {
    case 1:
        t->ref[channel] = true;
        break;
    case 2:
        t->ref[channel] = false;
        break;
    case 3:
        t->ref[channel] = !t->ref[channel];
        break;
    default:
        break;
    }
    t->sr |= 2u << channel;
}

static void step(struct f405 *chip, int index, uint64_t at)
{
    struct timer *t = &chip->timer[index];
    uint64_t limit = top(index, t), cnt = t->cnt + (at - t->base) / tick(chip, index);
    bool wraps = cnt > limit, matched[4] = {false};
    bool updates = wraps && t->cnt <= t->arr_now;
    t->cnt = wraps ? 0 : (uint32_t)cnt;
    t->base = at;
    if (updates)
        update(chip, index, false);
    for (int c = 0; c < 4; c++)
        if (t->ccr_now[c] == t->cnt && !channel_mode(t, c, 0, 2) && (t->cr1 & CEN || t->cnt))
            match(chip, index, c), matched[c] = true;
    forced(t, t->cnt);
    outputs(chip, index, at);
    interrupts(chip, index);
    for (int c = 0; c < 4; c++)
        if (matched[c])
            request_dma(chip, index, c + 1);
}

void f405_timer_sync(struct f405 *chip, int index, uint64_t to)
{
    for (uint64_t at = f405_timer_next(chip, index); at <= to; at = f405_timer_next(chip, index))
        step(chip, index, at);
}

/* ---- inputs ---- */

static void capture(struct f405 *chip, int index, int channel, uint64_t at)
{
    struct timer *t = &chip->timer[index];
    if (t->sr & 2u << channel)
        t->sr |= 0x200u << channel; /* over-capture */
    t->ccr[channel] = t->ccr_now[channel] = f405_timer_count(chip, index, at);
    t->sr |= 2u << channel;
    interrupts(chip, index);
    request_dma(chip, index, channel + 1);
}

void f405_timer_pin_edge(struct f405 *chip, int index, int channel, bool level, uint64_t at)
{
    struct timer *t = &chip->timer[index];
    f405_timer_sync(chip, index, at);
    for (int c = channel & ~1; c < (channel | 1) + 1; c++) {
        unsigned select = channel_mode(t, c, 0, 2), edge = t->ccer >> (c * 4 + 1) & 5;
        if (select != (c == channel ? 1u : 2u) || !(t->ccer >> (c * 4) & 1))
            continue;
        if (channel_mode(t, c, 2, 2))
            f405_complain(chip, "TIM%d: a prescaler of captures is not modelled", index);
        if (edge == 5 || level == (edge == 0))
            capture(chip, index, c, at);
    }
}

/* ---- registers ---- */

static void hold_count(struct f405 *chip, int index)
{
    struct timer *t = &chip->timer[index];
    if (!(t->cr1 & CEN) || chip->now < t->base)
        return;
    uint64_t ticks = (chip->now - t->base) / tick(chip, index);
    t->cnt += (uint32_t)ticks;
    t->base += ticks * tick(chip, index);
}

static void write_cr1(struct f405 *chip, int index, uint32_t value)
{
    struct timer *t = &chip->timer[index];
    if (value & 0x370)
        f405_complain(chip, "TIM%d_CR1 0x%x: counting down and clock division are not modelled", index, value);
    if (value & CEN && !(t->cr1 & CEN)) {
        unsigned clock = kernel_clock(chip, index);
        t->base = (chip->now + clock - 1) / clock * clock;
    }
    t->cr1 = value;
}

static void generate(struct f405 *chip, int index, uint32_t value)
{
    struct timer *t = &chip->timer[index];
    if (value & 1) {
        t->cnt = 0;
        t->base = chip->now;
        update(chip, index, true);
    }
    for (int c = 0; c < 4; c++) {
        if (!(value & 2u << c))
            continue;
        if (channel_mode(t, c, 0, 2)) {
            capture(chip, index, c, chip->now);
        } else {
            t->sr |= 2u << c;
            request_dma(chip, index, c + 1);
        }
    }
    if (value & ~0x1fu)
        f405_complain(chip, "TIM%d_EGR 0x%x is not modelled", index, value);
}

static uint32_t *plain_register(struct timer *t, uint32_t offset)
{
    uint32_t *const reg[] = {&t->cr1,     &t->cr2,    &t->smcr,   &t->dier, &t->sr,  NULL,    &t->ccmr[0],
                             &t->ccmr[1], &t->ccer,   &t->cnt,    &t->psc,  &t->arr, &t->rcr, &t->ccr[0],
                             &t->ccr[1],  &t->ccr[2], &t->ccr[3], &t->bdtr, &t->dcr};
    return offset / 4 < sizeof reg / sizeof *reg ? reg[offset / 4] : NULL;
}

static void write_register(struct f405 *chip, int index, uint32_t offset, uint32_t value)
{
    struct timer *t = &chip->timer[index];
    uint32_t mask = wide(index) ? 0xffffffffu : 0xffff;
    switch (offset) {
    case 0x00:
        write_cr1(chip, index, value);
        break;
    case 0x08:
        t->smcr = value;
        if (value)
            f405_complain(chip, "TIM%d_SMCR 0x%x: slave modes are not modelled", index, value);
        break;
    case 0x10: /* rc_w0 */
        t->sr &= value;
        break;
    case 0x14:
        generate(chip, index, value);
        break;
    case 0x24:
        t->cnt = value & mask;
        t->base = t->base > chip->now ? t->base : chip->now;
        break;
    case 0x2c:
        t->arr = value & mask;
        if (!(t->cr1 & ARPE))
            t->arr_now = t->arr;
        break;
    case 0x34:
    case 0x38:
    case 0x3c:
    case 0x40: {
        int c = (int)(offset - 0x34) / 4;
        if (channel_mode(t, c, 0, 2)) /* an input's is read-only */
            break;
        t->ccr[c] = value & mask;
        if (!channel_mode(t, c, 3, 1))
            t->ccr_now[c] = t->ccr[c];
        break;
    }
    default:
        *plain_register(t, offset) = value;
    }
}

bool f405_timer_access(struct f405 *chip, int index, uint32_t offset, bool write, uint32_t *value)
{
    struct timer *t = &chip->timer[index];
    if (offset == 0x50) { /* OR: no remapping */
        if (!write)
            *value = 0;
        return *value == 0;
    }
    if (offset > 0x48)
        return false;
    f405_timer_sync(chip, index, chip->now);
    if (!write) {
        uint32_t *reg = plain_register(t, offset);
        *value = offset == 0x24 ? f405_timer_count(chip, index, chip->now) : reg ? *reg : 0;
        if (offset >= 0x34 && offset <= 0x40 && channel_mode(t, (int)(offset - 0x34) / 4, 0, 2))
            t->sr &= ~(2u << (offset - 0x34) / 4); /* reading a capture clears its flag: 18.4.5 */
        interrupts(chip, index);
        return true;
    }
    hold_count(chip, index);
    write_register(chip, index, offset, *value);
    forced(t, t->cnt);
    outputs(chip, index, chip->now);
    interrupts(chip, index);
    return true;
}
