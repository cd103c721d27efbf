/* GPIO (RM0090 8), EXTI (12) and SYSCFG (9): pins, who drives them, and whom their edges wake. */
#include "sim/board/chip_priv.h"

#include <string.h>

/* DS8626 table 9, the alternate functions of the timers: which channel of which timer a pin can be. */
static const struct route {
    uint8_t pin, function, timer, channel;
} routes[] = {
#define R(port, bit, function, timer, channel)                                                                         \
    {                                                                                                                  \
        F405_PIN(port, bit), function, timer, channel - 1                                                              \
    }
    R('A', 8, 1, 1, 1),  R('A', 9, 1, 1, 2),   R('A', 10, 1, 1, 3), R('A', 11, 1, 1, 4), R('E', 9, 1, 1, 1),
    R('E', 11, 1, 1, 2), R('E', 13, 1, 1, 3),  R('E', 14, 1, 1, 4), R('A', 0, 1, 2, 1),  R('A', 5, 1, 2, 1),
    R('A', 15, 1, 2, 1), R('A', 1, 1, 2, 2),   R('B', 3, 1, 2, 2),  R('A', 2, 1, 2, 3),  R('B', 10, 1, 2, 3),
    R('A', 3, 1, 2, 4),  R('B', 11, 1, 2, 4),  R('A', 6, 2, 3, 1),  R('B', 4, 2, 3, 1),  R('C', 6, 2, 3, 1),
    R('A', 7, 2, 3, 2),  R('B', 5, 2, 3, 2),   R('C', 7, 2, 3, 2),  R('B', 0, 2, 3, 3),  R('C', 8, 2, 3, 3),
    R('B', 1, 2, 3, 4),  R('C', 9, 2, 3, 4),   R('B', 6, 2, 4, 1),  R('D', 12, 2, 4, 1), R('B', 7, 2, 4, 2),
    R('D', 13, 2, 4, 2), R('B', 8, 2, 4, 3),   R('D', 14, 2, 4, 3), R('B', 9, 2, 4, 4),  R('D', 15, 2, 4, 4),
    R('A', 0, 2, 5, 1),  R('H', 10, 2, 5, 1),  R('A', 1, 2, 5, 2),  R('H', 11, 2, 5, 2), R('A', 2, 2, 5, 3),
    R('H', 12, 2, 5, 3), R('A', 3, 2, 5, 4),   R('I', 0, 2, 5, 4),  R('C', 6, 3, 8, 1),  R('I', 5, 3, 8, 1),
    R('C', 7, 3, 8, 2),  R('I', 6, 3, 8, 2),   R('C', 8, 3, 8, 3),  R('I', 7, 3, 8, 3),  R('C', 9, 3, 8, 4),
    R('I', 2, 3, 8, 4),  R('A', 2, 3, 9, 1),   R('E', 5, 3, 9, 1),  R('A', 3, 3, 9, 2),  R('E', 6, 3, 9, 2),
    R('B', 8, 3, 10, 1), R('F', 6, 3, 10, 1),  R('B', 9, 3, 11, 1), R('F', 7, 3, 11, 1), R('B', 14, 9, 12, 1),
    R('H', 6, 9, 12, 1), R('B', 15, 9, 12, 2), R('H', 9, 9, 12, 2), R('A', 6, 9, 13, 1), R('F', 8, 9, 13, 1),
    R('A', 7, 9, 14, 1), R('F', 9, 9, 14, 1),
#undef R
};
#define ROUTES (sizeof routes / sizeof *routes)

static unsigned mode(const struct f405 *chip, int pin)
{
    return bits(chip->gpio[pin / 16].moder, pin % 16 * 2, 2);
}

static unsigned function(const struct f405 *chip, int pin)
{
    return bits(chip->gpio[pin / 16].afr[pin % 16 / 8], pin % 8 * 4, 4);
}

static const struct route *route_of(const struct f405 *chip, int pin)
{
    if (mode(chip, pin) != 2)
        return NULL;
    unsigned f = function(chip, pin);
    for (size_t i = 0; i < ROUTES; i++)
        if (routes[i].pin == pin && routes[i].function == f)
            return &routes[i];
    return NULL;
}

bool f405_gpio_is(const struct f405 *chip, int pin, unsigned alternate)
{
    return mode(chip, pin) == 2 && function(chip, pin) == alternate;
}

bool f405_gpio_is_analog(const struct f405 *chip, int pin)
{
    return mode(chip, pin) == 3;
}

static enum f405_level chip_drives(struct f405 *chip, int pin)
{
    const struct gpio *g = &chip->gpio[pin / 16];
    bool level = false;
    switch (mode(chip, pin)) {
    case 1:
        level = g->odr >> (pin % 16) & 1;
        break;
    case 2: {
        const struct route *r = route_of(chip, pin);
        if (!r) /* a USART's or USB's line: its bytes are handed over as bytes */
            return F405_FLOATING;
        /* A channel that is an input does not drive. */
        const struct timer *t = &chip->timer[r->timer];
        if (bits(t->ccmr[r->channel / 2], r->channel % 2 * 8, 2))
            return F405_FLOATING;
        level = f405_timer_level(chip, r->timer, r->channel);
        break;
    }
    default:
        return F405_FLOATING;
    }
    if (g->otyper >> (pin % 16) & 1 && level) /* open drain */
        return F405_FLOATING;
    return level ? F405_HIGH : F405_LOW;
}

void f405_gpio_update(struct f405 *chip, int pin, uint64_t at)
{
    struct pin *p = &chip->pin[pin];
    enum f405_level output = chip_drives(chip, pin);
    if (output != p->output) {
        p->output = output;
        if (chip->ops->pin)
            chip->ops->pin(chip->context, pin, output, at);
    }
    unsigned pull = bits(chip->gpio[pin / 16].pupdr, pin % 16 * 2, 2);
    bool level = output != F405_FLOATING      ? output == F405_HIGH
                 : p->driven != F405_FLOATING ? p->driven == F405_HIGH
                 : pull                       ? pull == 1
                                              : p->level;
    if (level == p->level)
        return;
    p->level = level;
    /* 12.2.5: which port's pin a line is. */
    if (bits(chip->exti.cr[pin % 16 / 4], pin % 4 * 4, 4) == (uint32_t)(pin / 16))
        f405_exti_edge(chip, pin % 16, level);
    const struct route *r = route_of(chip, pin);
    if (r)
        f405_timer_pin_edge(chip, r->timer, r->channel, level, at);
}

void f405_gpio_timer_output(struct f405 *chip, int timer, int channel, uint64_t at)
{
    for (size_t i = 0; i < ROUTES; i++)
        if (routes[i].timer == timer && routes[i].channel == channel && route_of(chip, routes[i].pin) == &routes[i])
            f405_gpio_update(chip, routes[i].pin, at);
}

static void update_port(struct f405 *chip, int port, uint32_t changed)
{
    for (int i = 0; i < 16; i++)
        if (changed >> i & 1)
            f405_gpio_update(chip, port * 16 + i, chip->now);
}

static uint32_t inputs(const struct f405 *chip, int port)
{
    uint32_t idr = 0;
    for (int i = 0; i < 16; i++)
        if (mode(chip, port * 16 + i) != 3)
            idr |= (uint32_t)chip->pin[port * 16 + i].level << i;
    return idr;
}

bool f405_gpio_access(struct f405 *chip, int port, uint32_t offset, bool write, uint32_t *value)
{
    struct gpio *g = &chip->gpio[port];
    uint32_t *const plain[] = {&g->moder, &g->otyper, &g->ospeedr, &g->pupdr,  NULL,
                               &g->odr,   NULL,       &g->lckr,    &g->afr[0], &g->afr[1]};
    if (offset > 0x24)
        return false;
    if (!write) {
        uint32_t *reg = plain[offset / 4];
        *value = reg ? *reg : offset == 0x10 ? inputs(chip, port) : 0;
        return true;
    }
    uint32_t old = g->odr;
    switch (offset) {
    case 0x10:
        return false;
    case 0x14:
        g->odr = *value & 0xffff;
        update_port(chip, port, old ^ g->odr);
        return true;
    case 0x18: /* BSRR: setting wins, 8.4.7 */
        g->odr = ((g->odr & ~(*value >> 16)) | *value) & 0xffff;
        update_port(chip, port, old ^ g->odr);
        return true;
    default:
        *plain[offset / 4] = *value;
        update_port(chip, port, 0xffff);
        return true;
    }
}

void f405_gpio_reset(struct f405 *chip)
{
    memset(chip->gpio, 0, sizeof chip->gpio);
    /* 8.4.1, 8.4.4: the debug port's pins. */
    chip->gpio[0].moder = 0xA8000000;
    chip->gpio[0].pupdr = 0x64000000;
    chip->gpio[1].moder = 0x00000280;
    chip->gpio[1].pupdr = 0x00000100;
    for (int i = 0; i < F405_PINS; i++)
        f405_gpio_update(chip, i, chip->now);
}

void f405_drive(struct f405 *chip, int pin, enum f405_level level)
{
    chip->pin[pin].driven = level;
    f405_gpio_update(chip, pin, chip->now);
    f405_schedule(chip);
}

enum f405_level f405_output(const struct f405 *chip, int pin)
{
    return chip->pin[pin].output;
}

/* ---- EXTI and SYSCFG ---- */

static void exti_lines(struct f405 *chip)
{
    const struct exti *e = &chip->exti;
    uint32_t active = e->pr & e->imr;
    f405_cpu_irq(chip, 1, active & 1u << 16); /* PVD */
    for (int i = 0; i < 5; i++)
        f405_cpu_irq(chip, 6 + i, active >> i & 1);
    f405_cpu_irq(chip, 23, active & 0x03e0);
    f405_cpu_irq(chip, 40, active & 0xfc00);
    f405_cpu_irq(chip, 42, active & 1u << 18); /* OTG_FS wake-up */
}

void f405_exti_edge(struct f405 *chip, int line, bool rising)
{
    struct exti *e = &chip->exti;
    if ((rising ? e->rtsr : e->ftsr) >> line & 1) {
        e->pr |= 1u << line;
        if (e->emr >> line & 1)
            chip->cpu.event = true;
        exti_lines(chip);
    }
}

bool f405_exti_access(struct f405 *chip, int index, uint32_t offset, bool write, uint32_t *value)
{
    (void)index;
    struct exti *e = &chip->exti;
    uint32_t *const reg[] = {&e->imr, &e->emr, &e->rtsr, &e->ftsr, NULL, &e->pr};
    if (offset > 0x14)
        return false;
    if (!write) {
        *value = reg[offset / 4] ? *reg[offset / 4] : 0;
        return true;
    }
    if (offset == 0x10)
        e->pr |= *value & e->imr;
    else if (offset == 0x14)
        e->pr &= ~*value;
    else
        *reg[offset / 4] = *value & 0x7fffff;
    exti_lines(chip);
    return true;
}

bool f405_syscfg_access(struct f405 *chip, int index, uint32_t offset, bool write, uint32_t *value)
{
    (void)index;
    struct exti *e = &chip->exti;
    uint32_t *const reg[] = {&e->memrmp, &e->pmc, &e->cr[0], &e->cr[1], &e->cr[2], &e->cr[3]};
    if (offset > 0x14)
        return false;
    if (write)
        *reg[offset / 4] = *value;
    else
        *value = *reg[offset / 4];
    return true;
}
