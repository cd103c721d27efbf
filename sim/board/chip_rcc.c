/* RCC (RM0090 7), PWR (5), IWDG (21), DBGMCU (38.16), RNG (24), CRC (4). */
#include "sim/board/chip_priv.h"

#include <string.h>

enum { CR = 0, PLLCFGR = 1, CFGR = 2, CIR = 3, AHB1RSTR = 4, AHB1ENR = 12, APB1ENR = 16, BDCR = 28, CSR = 29 };
#define HSE_HZ 8000000u
#define HSI_HZ 16000000u
#define LSI_HZ 32000u
#define HSE_STARTS (2 * (F405_HZ / 1000u))  /* DS8626 table 33: 2 ms, typical */
#define PLL_LOCKS (3 * (F405_HZ / 10000u))  /* table 37: 300 us at most */
#define IWDG_TAKES (5 * (F405_HZ / LSI_HZ)) /* RM0090 21.4.4: five clocks of the LSI */

static unsigned prescale(uint32_t field, unsigned one, const uint16_t *table)
{
    return field & one ? table[field & (one - 1)] : 1;
}

/* 7.3.2: M 2–63 (VCO input 1–2 MHz), N 50–432 (VCO 100–432 MHz), P 2, 4, 6, 8. */
static uint32_t pll_hz(struct f405 *chip)
{
    uint32_t cfg = chip->rcc.reg[PLLCFGR], m = bits(cfg, 0, 6), n = bits(cfg, 6, 9), p = 2 * (bits(cfg, 16, 2) + 1);
    uint32_t in = cfg & 1u << 22 ? HSE_HZ : HSI_HZ, q = bits(cfg, 24, 4);
    if (m < 2 || n < 50 || n > 432 || q < 2 || in / m < 950000 || in / m > 2100000) {
        f405_complain(chip, "RCC_PLLCFGR 0x%08x is out of the PLL's range", cfg);
        return HSI_HZ;
    }
    uint32_t vco = in / m * n;
    if (vco < 100000000 || vco > 432000000)
        f405_complain(chip, "RCC_PLLCFGR 0x%08x: a VCO of %u Hz", cfg, vco);
    return vco / p;
}

uint32_t f405_rcc_usb_hz(struct f405 *chip)
{
    const uint32_t cfg = chip->rcc.reg[PLLCFGR];
    if (chip->now < chip->rcc.pll_ready)
        return 0;
    return pll_hz(chip) * 2 * (bits(cfg, 16, 2) + 1) / bits(cfg, 24, 4);
}

/* The oscillators' and the PLL's ready bits are what time says. */
static uint32_t control(const struct f405 *chip)
{
    const struct rcc *r = &chip->rcc;
    return (r->reg[CR] & ~(1u << 17 | 1u << 25)) | (uint32_t)(chip->now >= r->hse_ready) << 17 |
           (uint32_t)(chip->now >= r->pll_ready) << 25;
}

static void clocks(struct f405 *chip)
{
    static const uint16_t ahb[8] = {2, 4, 8, 16, 64, 128, 256, 512}, apb[4] = {2, 4, 8, 16};
    uint32_t cfgr = chip->rcc.reg[CFGR];
    uint32_t hz = (cfgr & 3) == 0 ? HSI_HZ : (cfgr & 3) == 1 ? HSE_HZ : pll_hz(chip);
    hz /= prescale(bits(cfgr, 4, 4), 8, ahb);
    unsigned p1 = prescale(bits(cfgr, 10, 3), 4, apb), p2 = prescale(bits(cfgr, 13, 3), 4, apb);
    /* DS8626 table 14. */
    if (hz > 168000000 || hz / p1 > 42000000 || hz / p2 > 84000000)
        f405_complain(chip, "clocks of %u Hz, APB1 /%u, APB2 /%u are too fast", hz, p1, p2);
    /* RM0090 table 11, 2.7 to 3.6 V: a wait state for each 30 MHz. */
    if (hz && (chip->flash.acr & 7) < (hz - 1) / 30000000)
        f405_complain(chip, "flash with %u wait states at %u Hz", chip->flash.acr & 7, hz);
    if (hz > 144000000 && !(chip->pwr_cr & 1u << 14)) /* RM0090 5.1.3 */
        f405_complain(chip, "%u Hz with the regulator at scale 2", hz);
    chip->rcc.cost = hz ? (F405_HZ + hz / 2) / hz : 1;
    chip->rcc.apb1 = chip->rcc.cost * p1;
    chip->rcc.apb2 = chip->rcc.cost * p2;
    /* 7.2: the timers run at twice the bus's clock where that is divided. */
    chip->rcc.tim2_clock = p1 == 1 ? chip->rcc.cost : chip->rcc.cost * p1 / 2;
    chip->rcc.tim1_clock = p2 == 1 ? chip->rcc.cost : chip->rcc.cost * p2 / 2;
}

void f405_rcc_reset(struct f405 *chip, uint32_t flags)
{
    uint32_t csr = chip->rcc.reg[CSR], bdcr = chip->rcc.reg[BDCR];
    memset(chip->rcc.reg, 0, sizeof chip->rcc.reg);
    chip->rcc.reg[CR] = 0x83;
    chip->rcc.hse_ready = chip->rcc.pll_ready = F405_NEVER;
    chip->rcc.reg[PLLCFGR] = 0x24003010;
    chip->rcc.reg[AHB1ENR] = 0x00100000;
    chip->rcc.reg[20] = 0x7E6791FF; /* the low-power enables: 7.3.15 to 7.3.19 */
    chip->rcc.reg[21] = 0x000000F1;
    chip->rcc.reg[22] = 0x00000001;
    chip->rcc.reg[24] = 0x36FEC9FF;
    chip->rcc.reg[25] = 0x00075F33;
    chip->rcc.reg[BDCR] = bdcr;
    /* 7.3.21: the flags of earlier resets stay until RMVF; power-on clears the rest. */
    chip->rcc.reg[CSR] = flags & 0x08000000u ? flags : (csr & 0xff000000u) | flags;
    chip->flash.acr = 0;
    clocks(chip);
}

bool f405_rcc_enabled(const struct f405 *chip, uint32_t offset, int bit)
{
    return chip->rcc.reg[offset / 4] >> bit & 1;
}

static void switch_oscillators(struct f405 *chip, uint32_t value)
{
    struct rcc *r = &chip->rcc;
    const uint32_t on = value & ~r->reg[CR], off = ~value & r->reg[CR];
    if (off & 1u << 16)
        r->hse_ready = F405_NEVER;
    if (off & 1u << 24)
        r->pll_ready = F405_NEVER;
    if (on & 1u << 16 && !r->no_crystal)
        r->hse_ready = chip->now + HSE_STARTS;
    if (on & 1u << 24) {
        if (r->reg[PLLCFGR] & 1u << 22 && chip->now < r->hse_ready)
            f405_complain(chip, "the PLL is started before the crystal swings");
        r->pll_ready = chip->now + PLL_LOCKS;
    }
}

/* 7.2.7: the clock security system goes to the HSI, switches the crystal and the PLL off and raises an NMI. */
void f405_set_crystal(struct f405 *chip, bool works)
{
    struct rcc *r = &chip->rcc;
    r->no_crystal = !works;
    if (works || !chip->on || !(r->reg[CR] & 1u << 16))
        return;
    if (!(r->reg[CR] & 1u << 19)) {
        f405_complain(chip, "the crystal stops and nobody is told");
        return;
    }
    r->hse_ready = r->pll_ready = F405_NEVER;
    r->reg[CR] &= ~(1u << 16 | 1u << 24);
    r->reg[CFGR] &= ~0xfu;
    r->reg[CIR] |= 1u << 7;
    for (int t = 1; t < TIMERS; t++)
        f405_timer_sync(chip, t, chip->now);
    clocks(chip);
    f405_cpu_pend(chip, EX_NMI);
    f405_schedule(chip);
}

static void write_register(struct f405 *chip, int i, uint32_t value)
{
    uint32_t *reg = chip->rcc.reg;
    switch (i) {
    case CR:
        value &= 0x01050081u | 0x000000f8u | 1u << 19 | 1u << 26;
        if ((reg[CFGR] & 3) == 2 && !(value & 1u << 24)) {
            f405_complain(chip, "the PLL is switched off while it drives the system");
            return;
        }
        switch_oscillators(chip, value);
        reg[CR] = (reg[CR] & 0xff00) | (value & ~(1u << 1 | 1u << 17 | 1u << 25 | 1u << 27)) | (value & 1) << 1 |
                  (value >> 26 & 1) << 27;
        break;
    case PLLCFGR:
        if (reg[CR] & 1u << 24)
            f405_complain(chip, "RCC_PLLCFGR written while the PLL is on");
        reg[PLLCFGR] = value;
        break;
    case CFGR: {
        static const int ready[4] = {1, 17, 25, 31};
        if (!(control(chip) >> ready[value & 3] & 1))
            f405_complain(chip, "RCC_CFGR 0x%08x: the clock is not ready", value);
        reg[CFGR] = (value & ~0xcu) | (value & 3) << 2;
        for (int t = 1; t < TIMERS; t++)
            f405_timer_sync(chip, t, chip->now);
        clocks(chip);
        break;
    }
    case CSR:
        reg[CSR] = (value & 1u << 24 ? 0 : reg[CSR] & 0xff000000u) | (value & 1) | (value & 1) << 1;
        break;
    default:
        reg[i] = value;
    }
}

bool f405_rcc_access(struct f405 *chip, int index, uint32_t offset, bool write, uint32_t *value)
{
    (void)index;
    if (offset > 0x84 || offset == 0x1c || offset == 0x28 || offset == 0x2c || offset == 0x3c || offset == 0x48 ||
        offset == 0x4c)
        return false;
    if (write)
        write_register(chip, (int)(offset / 4), *value);
    else
        *value = offset == 0 ? control(chip) : chip->rcc.reg[offset / 4];
    return true;
}

/* 5.4.1: what PLS says, in mV; the detector's output is high below. */
static bool sunk(const struct f405 *chip)
{
    static const uint16_t threshold[8] = {2000, 2100, 2300, 2500, 2600, 2700, 2800, 2900};
    return chip->pwr_cr & 1u << 4 && 3300 - chip->sunk < threshold[bits(chip->pwr_cr, 5, 3)];
}

void f405_set_supply(struct f405 *chip, unsigned millivolts)
{
    const bool before = sunk(chip);
    chip->sunk = 3300 - millivolts;
    if (sunk(chip) != before)
        f405_exti_edge(chip, 16, !before); /* 12.2.5 */
    f405_schedule(chip);
}

bool f405_pwr_access(struct f405 *chip, int index, uint32_t offset, bool write, uint32_t *value)
{
    (void)index;
    if (offset == 4) { /* CSR: VOSRDY, PVDO */
        *value = 1u << 14 | (uint32_t)sunk(chip) << 2;
        return true;
    }
    if (offset)
        return false;
    if (write)
        chip->pwr_cr = *value;
    else
        *value = chip->pwr_cr;
    return true;
}

bool f405_dbgmcu_access(struct f405 *chip, int index, uint32_t offset, bool write, uint32_t *value)
{
    (void)index;
    if (offset == 0) {
        *value = 0x10076413; /* 38.6.1: STM32F405, revision 1 and 2 */
        return !write;
    }
    if (write)
        chip->dbgmcu[offset / 4] = *value;
    else
        *value = chip->dbgmcu[offset / 4];
    return true;
}

/* ---- the independent watchdog ---- */

static void iwdg_restart(struct f405 *chip)
{
    struct watchdog *w = &chip->watchdog;
    uint64_t divider = 4u << (w->pr > 6 ? 6 : w->pr);
    const uint32_t reload = chip->now < w->rlr_taken ? w->rlr_before : w->rlr;
    w->expires = chip->now + (reload + 1) * divider * (F405_HZ / LSI_HZ);
}

bool f405_iwdg_access(struct f405 *chip, int index, uint32_t offset, bool write, uint32_t *value)
{
    (void)index;
    struct watchdog *w = &chip->watchdog;
    switch (offset) {
    case 0:
        if (!write) {
            *value = 0;
            return true;
        }
        w->writable = *value == 0x5555;
        if (*value == 0xcccc)
            w->started = true;
        if (w->started && (*value == 0xaaaa || *value == 0xcccc))
            iwdg_restart(chip);
        return *value == 0x5555 || *value == 0xcccc || *value == 0xaaaa;
    case 4:
    case 8: {
        uint32_t *reg = offset == 4 ? &w->pr : &w->rlr;
        if (write && !w->writable)
            f405_complain(chip, "IWDG register 0x%x written without its key", offset);
        if (write && chip->now < (offset == 4 ? w->pr_taken : w->rlr_taken))
            f405_complain(chip, "IWDG register 0x%x written before the last value was taken", offset);
        if (write && offset == 8 && chip->now >= w->rlr_taken)
            w->rlr_before = w->rlr;
        if (write)
            *(offset == 4 ? &w->pr_taken : &w->rlr_taken) = chip->now + IWDG_TAKES;
        if (write)
            *reg = *value & (offset == 4 ? 7u : 0xfffu);
        else
            *value = *reg;
        return true;
    }
    case 12:
        *value = (uint32_t)(chip->now < w->pr_taken) | (uint32_t)(chip->now < w->rlr_taken) << 1;
        return !write;
    default:
        return false;
    }
}

uint64_t f405_iwdg_next(const struct f405 *chip)
{
    return chip->watchdog.started ? chip->watchdog.expires : F405_NEVER;
}

void f405_iwdg_event(struct f405 *chip)
{
    chip->watchdog.started = false;
    f405_want_reset(chip, 0x24000000u); /* IWDGRSTF, PINRSTF */
}

/* ---- small ones ---- */

bool f405_rng_access(struct f405 *chip, int index, uint32_t offset, bool write, uint32_t *value)
{
    (void)index;
    if (offset == 0) {
        if (write)
            chip->rng_cr = *value;
        else
            *value = chip->rng_cr;
        return true;
    }
    if (write || offset > 8)
        return offset == 4;
    *value = offset == 4 ? chip->rng_cr >> 2 & 1 : f405_random(chip);
    return true;
}

bool f405_crc_access(struct f405 *chip, int index, uint32_t offset, bool write, uint32_t *value)
{
    (void)index;
    if (offset == 8 && write) {
        chip->crc = 0xffffffffu;
        return true;
    }
    if (offset)
        return false;
    if (!write) {
        *value = chip->crc;
        return true;
    }
    chip->crc ^= *value;
    for (int i = 0; i < 32; i++)
        chip->crc = chip->crc << 1 ^ (chip->crc >> 31 ? 0x04C11DB7u : 0);
    return true;
}
