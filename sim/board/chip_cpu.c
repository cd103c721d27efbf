/* The Cortex-M4's exceptions, which Unicorn has none of: NVIC, SysTick, system control block, entry and return.
 * ARM DDI0403E B1.5 (exception model), B3.2 (SCB), B3.3 (SysTick), B3.4 (NVIC); PM0214 4.3 (4 bits of priority). */
#include "sim/board/chip_priv.h"

#include <string.h>

#define ENTRY_CYCLES 12 /* DDI0439D (Cortex-M4 TRM) 3.9: with memory that does not wait */
#define RETURN_CYCLES 10
#define FRAME 32u
#define FP_FRAME 72u

static uint32_t get(struct f405 *chip, int reg)
{
    uint32_t value = 0;
    uc_reg_read(chip->uc, reg, &value);
    return value;
}

static void set(struct f405 *chip, int reg, uint32_t value)
{
    uc_reg_write(chip->uc, reg, &value);
}

void f405_cpu_reset(struct f405 *chip)
{
    struct f405_exception_stats stats[F405_EXCEPTIONS];
    memcpy(stats, chip->cpu.stats, sizeof stats);
    chip->cpu = (struct cpu){.ccr = 0x200, .systick_next = F405_NEVER};
    memcpy(chip->cpu.stats, stats, sizeof stats);
    for (int i = 1; i < EX_IRQ; i++)
        chip->cpu.enabled[i] = true;
    static const int general[] = {UC_ARM_REG_R0,  UC_ARM_REG_R1,  UC_ARM_REG_R2,  UC_ARM_REG_R3, UC_ARM_REG_R4,
                                  UC_ARM_REG_R5,  UC_ARM_REG_R6,  UC_ARM_REG_R7,  UC_ARM_REG_R8, UC_ARM_REG_R9,
                                  UC_ARM_REG_R10, UC_ARM_REG_R11, UC_ARM_REG_R12, UC_ARM_REG_LR};
    set(chip, UC_ARM_REG_IPSR, 0);
    set(chip, UC_ARM_REG_CONTROL, 0);
    set(chip, UC_ARM_REG_PRIMASK, 0);
    set(chip, UC_ARM_REG_BASEPRI, 0);
    set(chip, UC_ARM_REG_FAULTMASK, 0);
    for (size_t i = 0; i < sizeof general / sizeof *general; i++)
        set(chip, general[i], 0xffffffffu);
    uint32_t vector[2];
    memcpy(vector, chip->flash_bytes, sizeof vector);
    set(chip, UC_ARM_REG_SP, vector[0] & ~3u);
    set(chip, UC_ARM_REG_PC, vector[1]);
    if (!(vector[1] & 1))
        f405_complain(chip, "the reset vector 0x%08x is not Thumb code", vector[1]);
}

/* ---- who is next ---- */

static unsigned group_priority(const struct f405 *chip, int exception)
{
    return chip->cpu.priority[exception] & (0xffu << (chip->cpu.aircr_group + 1)) & 0xff;
}

void f405_cpu_update(struct f405 *chip)
{
    struct cpu *cpu = &chip->cpu;
    int best = 0;
    for (int i = EX_NMI; i < F405_EXCEPTIONS; i++)
        if (cpu->pending[i] && cpu->enabled[i] && (!best || cpu->priority[i] < cpu->priority[best]))
            best = i;
    cpu->candidate = best;
    if (best)
        chip->attention = true;
}

void f405_cpu_pend(struct f405 *chip, int exception)
{
    if (!chip->cpu.pending[exception]) {
        chip->cpu.pending[exception] = true;
        chip->cpu.pended[exception] = chip->now;
    }
    f405_cpu_update(chip);
}

void f405_cpu_irq(struct f405 *chip, int irq, bool level)
{
    bool *line = &chip->cpu.line[EX_IRQ + irq];
    bool rises = level && !*line;
    *line = level;
    if (rises)
        f405_cpu_pend(chip, EX_IRQ + irq);
}

static unsigned running_priority(const struct f405 *chip)
{
    unsigned lowest = 256;
    for (int i = 0; i < chip->cpu.depth; i++) {
        unsigned p = group_priority(chip, chip->cpu.stack[i]);
        lowest = p < lowest ? p : lowest;
    }
    return lowest;
}

bool f405_cpu_deliverable(struct f405 *chip)
{
    int candidate = chip->cpu.candidate;
    if (!candidate || chip->cpu.exception_return)
        return false;
    if (candidate == EX_NMI) /* DDI0403E B1.5.4: nothing holds it off but itself */
        return !chip->cpu.active[EX_NMI] && !chip->cpu.active[EX_HARDFAULT];
    unsigned priority = group_priority(chip, candidate);
    if (priority >= running_priority(chip) || get(chip, UC_ARM_REG_PRIMASK) & 1 || get(chip, UC_ARM_REG_FAULTMASK) & 1)
        return false;
    unsigned base = get(chip, UC_ARM_REG_BASEPRI) & 0xf0;
    if (base && priority >= (base & (0xffu << (chip->cpu.aircr_group + 1))))
        return false;
    /* Not within an IT block: Unicorn cannot be given its state back. It has four instructions at most. */
    return !(get(chip, UC_ARM_REG_XPSR) & 0x0600fc00);
}

/* DDI0403E B1.5.19: WFI ends for what would be taken if PRIMASK were clear. */
bool f405_cpu_wakes(const struct f405 *chip)
{
    const struct cpu *cpu = &chip->cpu;
    if (!cpu->candidate || group_priority(chip, cpu->candidate) >= running_priority(chip))
        return false;
    uint32_t base = 0;
    uc_reg_read(chip->uc, UC_ARM_REG_BASEPRI, &base);
    return !(base & 0xf0) || group_priority(chip, cpu->candidate) < (base & 0xf0);
}

/* ---- entry and return ---- */

static const int stacked[] = {UC_ARM_REG_R0,  UC_ARM_REG_R1, UC_ARM_REG_R2, UC_ARM_REG_R3,
                              UC_ARM_REG_R12, UC_ARM_REG_LR, UC_ARM_REG_PC};

void f405_cpu_enter(struct f405 *chip)
{
    struct cpu *cpu = &chip->cpu;
    int exception = cpu->candidate;
    if (cpu->depth == 32) {
        f405_complain(chip, "32 exceptions within one another");
        return;
    }
    bool fp = get(chip, UC_ARM_REG_CONTROL) & 4;
    uint32_t sp = get(chip, UC_ARM_REG_SP), odd = sp >> 2 & 1, frame[8], fp_frame[18] = {0};
    sp -= FRAME + (fp ? FP_FRAME : 0) + 4 * odd;
    for (int i = 0; i < 7; i++)
        frame[i] = get(chip, stacked[i]);
    frame[6] &= ~1u;
    frame[7] = (get(chip, UC_ARM_REG_XPSR) & 0xf80f01ffu) | 1u << 24 | odd << 9;
    for (int i = 0; fp && i < 16; i++)
        fp_frame[i] = get(chip, UC_ARM_REG_S0 + i);
    if (fp)
        fp_frame[16] = get(chip, UC_ARM_REG_FPSCR);
    if (uc_mem_write(chip->uc, sp, frame, sizeof frame) ||
        (fp && uc_mem_write(chip->uc, sp + FRAME, fp_frame, sizeof fp_frame))) {
        f405_complain(chip, "no stack at 0x%08x for exception %d", sp, exception);
        return;
    }
    uint32_t vector = 0;
    uc_mem_read(chip->uc, cpu->vtor + 4u * (unsigned)exception, &vector, 4);
    set(chip, UC_ARM_REG_SP, sp);
    set(chip, UC_ARM_REG_LR, (cpu->depth ? 0xfffffff1u : 0xfffffff9u) & (fp ? ~0x10u : ~0u));
    if (fp)
        set(chip, UC_ARM_REG_CONTROL, get(chip, UC_ARM_REG_CONTROL) & ~4u);
    set(chip, UC_ARM_REG_IPSR, (uint32_t)exception);
    set(chip, UC_ARM_REG_PC, vector | 1);
    if (!(vector & 1))
        f405_complain(chip, "the vector 0x%08x of exception %d is not Thumb code", vector, exception);
    cpu->pending[exception] = false;
    cpu->active[exception] = true;
    cpu->spent[cpu->depth] = 0;
    cpu->stack[cpu->depth++] = exception;
    cpu->event = true;
    chip->now += ENTRY_CYCLES * chip->rcc.cost;
    struct f405_exception_stats *stats = &cpu->stats[exception];
    stats->count++;
    if (chip->now - cpu->pended[exception] > stats->latency_max)
        stats->latency_max = chip->now - cpu->pended[exception];
    f405_cpu_update(chip);
    if (exception == EX_HARDFAULT)
        f405_complain(chip, "a hard fault");
}

static void leave(struct f405 *chip)
{
    struct cpu *cpu = &chip->cpu;
    int exception = cpu->stack[--cpu->depth];
    struct f405_exception_stats *stats = &cpu->stats[exception];
    stats->instructions += cpu->spent[cpu->depth];
    if (cpu->spent[cpu->depth] > stats->instructions_max)
        stats->instructions_max = cpu->spent[cpu->depth];
    cpu->active[exception] = false;
    /* DDI0403E B3.4.1: a level that still stands pends again. */
    if (exception >= EX_IRQ && cpu->line[exception])
        f405_cpu_pend(chip, exception);
    f405_cpu_update(chip);
}

void f405_cpu_return(struct f405 *chip)
{
    struct cpu *cpu = &chip->cpu;
    uint32_t kind = cpu->exception_return, frame[8], fp_frame[18];
    cpu->exception_return = 0;
    bool fp = !(kind & 0x10);
    bool to_handler = (kind & 0xf) == 1;
    if ((kind & 0xffffffe0u) != 0xffffffe0u || ((kind & 0xf) != 1 && (kind & 0xf) != 9) || !cpu->depth ||
        to_handler != (cpu->depth > 1)) {
        f405_complain(chip, "exception return 0x%08x with %d exceptions active", kind, cpu->depth);
        return;
    }
    leave(chip);
    uint32_t sp = get(chip, UC_ARM_REG_SP);
    if (uc_mem_read(chip->uc, sp, frame, sizeof frame) ||
        (fp && uc_mem_read(chip->uc, sp + FRAME, fp_frame, sizeof fp_frame))) {
        f405_complain(chip, "no stack at 0x%08x to return from", sp);
        return;
    }
    if ((frame[7] & 0x1ff) != (cpu->depth ? (uint32_t)cpu->stack[cpu->depth - 1] : 0)) {
        f405_complain(chip, "the stacked IPSR 0x%x is not what was interrupted", frame[7] & 0x1ff);
        return;
    }
    set(chip, UC_ARM_REG_IPSR, frame[7] & 0x1ff);
    set(chip, UC_ARM_REG_SP, sp + FRAME + (fp ? FP_FRAME : 0) + (frame[7] >> 9 & 1) * 4);
    for (int i = 0; i < 6; i++)
        set(chip, stacked[i], frame[i]);
    set(chip, UC_ARM_REG_APSR, frame[7] & 0xf80f0000u);
    for (int i = 0; fp && i < 16; i++)
        set(chip, UC_ARM_REG_S0 + i, fp_frame[i]);
    if (fp)
        set(chip, UC_ARM_REG_FPSCR, fp_frame[16]);
    uint32_t control = get(chip, UC_ARM_REG_CONTROL);
    if (((control & 4) != 0) != fp)
        set(chip, UC_ARM_REG_CONTROL, (control & ~4u) | (fp ? 4 : 0));
    set(chip, UC_ARM_REG_PC, frame[6] | 1);
    chip->now += RETURN_CYCLES * chip->rcc.cost;
    cpu->event = true;
    if (!cpu->depth && cpu->scr & 2) /* SLEEPONEXIT */
        cpu->asleep = true;
}

/* ---- SysTick ---- */

static uint64_t systick_period(const struct f405 *chip)
{
    return (uint64_t)chip->rcc.cost * (chip->cpu.systick_ctrl & 4 ? 1 : 8);
}

uint64_t f405_cpu_next(const struct f405 *chip)
{
    return chip->cpu.systick_next;
}

void f405_cpu_event(struct f405 *chip)
{
    struct cpu *cpu = &chip->cpu;
    cpu->systick_flag = true;
    cpu->systick_next =
        cpu->systick_load ? cpu->systick_next + (cpu->systick_load + 1) * systick_period(chip) : F405_NEVER;
    if (cpu->systick_ctrl & 2)
        f405_cpu_pend(chip, EX_SYSTICK);
}

static bool systick_access(struct f405 *chip, uint32_t address, bool write, uint32_t *value)
{
    struct cpu *cpu = &chip->cpu;
    bool restart = false;
    switch (address) {
    case 0xE000E010:
        if (!write) {
            *value = cpu->systick_ctrl | (uint32_t)cpu->systick_flag << 16;
            cpu->systick_flag = false;
            return true;
        }
        restart = (*value ^ cpu->systick_ctrl) & 5;
        cpu->systick_ctrl = *value & 7;
        break;
    case 0xE000E014:
        if (write)
            cpu->systick_load = *value & 0xffffff;
        else
            *value = cpu->systick_load;
        break;
    case 0xE000E018:
        restart = write;
        if (!write)
            *value = cpu->systick_next == F405_NEVER
                         ? 0
                         : (uint32_t)((cpu->systick_next - chip->now) / systick_period(chip)) & 0xffffff;
        break;
    case 0xE000E01C: /* CALIB: 1 ms at HCLK/8, PM0214 4.5.4 */
        *value = 18750;
        return !write;
    default:
        return false;
    }
    if (restart)
        cpu->systick_next = cpu->systick_ctrl & 1 && cpu->systick_load
                                ? chip->now + (cpu->systick_load + 1) * systick_period(chip)
                                : F405_NEVER;
    return true;
}

/* ---- NVIC and SCB ---- */

static void nvic_bits(struct f405 *chip, bool *array, int word, bool write, bool to, uint32_t *value)
{
    uint32_t result = 0;
    for (int i = 0; i < 32; i++) {
        int exception = EX_IRQ + word * 32 + i;
        if (exception >= F405_EXCEPTIONS)
            break;
        if (write && *value >> i & 1) {
            if (to && array == chip->cpu.pending)
                f405_cpu_pend(chip, exception);
            array[exception] = to;
            /* A level stands as soon as nothing holds it off. */
            if (array == chip->cpu.pending && !to && chip->cpu.line[exception] && !chip->cpu.active[exception])
                f405_cpu_pend(chip, exception);
        }
        result |= (uint32_t)array[exception] << i;
    }
    if (!write)
        *value = result;
    f405_cpu_update(chip);
}

static bool priorities(struct f405 *chip, int first, unsigned size, bool write, uint32_t *value)
{
    uint32_t result = 0;
    for (unsigned i = 0; i < size; i++) {
        int exception = first + (int)i;
        if (exception >= F405_EXCEPTIONS)
            break;
        if (write)
            chip->cpu.priority[exception] = *value >> (8 * i) & 0xf0;
        result |= (uint32_t)chip->cpu.priority[exception] << (8 * i);
    }
    if (!write)
        *value = result;
    f405_cpu_update(chip);
    return true;
}

static bool icsr(struct f405 *chip, bool write, uint32_t *value)
{
    struct cpu *cpu = &chip->cpu;
    if (!write) {
        int pending = cpu->candidate;
        *value = (cpu->depth ? (uint32_t)cpu->stack[cpu->depth - 1] : 0) | (cpu->depth <= 1 ? 1u << 11 : 0) |
                 (uint32_t)pending << 12 | (pending >= EX_IRQ ? 1u << 22 : 0) |
                 (uint32_t)cpu->pending[EX_SYSTICK] << 26 | (uint32_t)cpu->pending[EX_PENDSV] << 28;
        return true;
    }
    if (*value & 1u << 28)
        f405_cpu_pend(chip, EX_PENDSV);
    if (*value & 1u << 27)
        cpu->pending[EX_PENDSV] = false;
    if (*value & 1u << 26)
        f405_cpu_pend(chip, EX_SYSTICK);
    if (*value & 1u << 25)
        cpu->pending[EX_SYSTICK] = false;
    f405_cpu_update(chip);
    return true;
}

static bool aircr(struct f405 *chip, bool write, uint32_t *value)
{
    if (!write) {
        *value = 0xfa050000u | chip->cpu.aircr_group << 8;
        return true;
    }
    if (*value >> 16 != 0x05fa) { /* ignored by the hardware; a mistake all the same */
        f405_complain(chip, "AIRCR written without its key: 0x%08x", *value);
        return true;
    }
    chip->cpu.aircr_group = *value >> 8 & 7;
    if (*value & 4)
        f405_want_reset(chip, 0x14000000u); /* SFTRSTF, PINRSTF */
    return true;
}

static bool plain(uint32_t *reg, bool write, uint32_t *value)
{
    if (write)
        *reg = *value;
    else
        *value = *reg;
    return true;
}

static bool scb_access(struct f405 *chip, uint32_t address, bool write, uint32_t *value)
{
    struct cpu *cpu = &chip->cpu;
    static uint32_t nothing;
    switch (address) {
    case 0xE000ED00: /* CPUID: Cortex-M4 r0p1 */
        *value = 0x410FC241;
        return !write;
    case 0xE000ED04:
        return icsr(chip, write, value);
    case 0xE000ED08:
        return plain(&cpu->vtor, write, value);
    case 0xE000ED0C:
        return aircr(chip, write, value);
    case 0xE000ED10:
        return plain(&cpu->scr, write, value);
    case 0xE000ED14:
        return plain(&cpu->ccr, write, value);
    case 0xE000ED24:
        return plain(&cpu->shcsr, write, value);
    case 0xE000ED28: /* CFSR, HFSR, MMFAR, BFAR: no fault is ever raised in here, the run ends instead */
    case 0xE000ED2C:
    case 0xE000ED34:
    case 0xE000ED38:
        *value = 0;
        return true;
    case 0xE000ED88:
        return plain(&cpu->cpacr, write, value);
    case 0xE000ED94: /* MPU_CTRL: may only stay off */
        *value = write ? *value : 0;
        return *value == 0;
    case 0xE000EDFC:
        return plain(&cpu->demcr, write, value);
    case 0xE000EF34: /* FPCCR: automatic state preservation is always on here, lazy or not makes no difference */
        nothing = 0xC0000000u;
        return write ? *value >> 30 != 0 : plain(&nothing, false, value);
    default:
        return false;
    }
}

static bool nvic_access(struct f405 *chip, uint32_t address, unsigned size, bool write, uint32_t *value)
{
    struct cpu *cpu = &chip->cpu;
    uint32_t offset = address - 0xE000E000u;
    if (offset >= 0x400 && offset < 0x400 + 82)
        return priorities(chip, EX_IRQ + (int)(offset - 0x400), size, write, value);
    if (offset >= 0xD18 && offset < 0xD24)
        return priorities(chip, 4 + (int)(offset - 0xD18), size, write, value);
    if (size != 4)
        return false;
    int word = (int)(offset >> 2 & 0x1f);
    if (word > 2)
        return false;
    switch (offset & ~0x7fu) {
    case 0x100:
        nvic_bits(chip, cpu->enabled, word, write, true, value);
        return true;
    case 0x180:
        nvic_bits(chip, cpu->enabled, word, write, false, value);
        return true;
    case 0x200:
        nvic_bits(chip, cpu->pending, word, write, true, value);
        return true;
    case 0x280:
        nvic_bits(chip, cpu->pending, word, write, false, value);
        return true;
    case 0x300:
        nvic_bits(chip, cpu->active, word, false, false, value);
        return !write;
    default:
        return false;
    }
}

bool f405_ppb_access(struct f405 *chip, uint32_t address, unsigned size, bool write, uint32_t *value)
{
    struct cpu *cpu = &chip->cpu;
    bool ok = false;
    if (address >= 0xE0042000 && address < 0xE0042010)
        ok = f405_dbgmcu_access(chip, 0, address - 0xE0042000, write, value);
    else if (address == 0xE0001000)
        ok = plain(&cpu->dwt_ctrl, write, value);
    else if (address == 0xE0001004) {
        if (write)
            cpu->dwt_base = chip->now - *value;
        else
            *value = cpu->dwt_ctrl & 1 ? (uint32_t)(chip->now - cpu->dwt_base) : 0;
        ok = true;
    } else if (address == 0xE000E004) {
        *value = 2;
        ok = !write;
    } else if (address >= 0xE000E010 && address < 0xE000E020)
        ok = systick_access(chip, address, write, value);
    else
        ok = nvic_access(chip, address, size, write, value) || scb_access(chip, address, write, value);
    if (!ok)
        f405_complain(chip, "%s of 0x%08x (value 0x%x): no such register of the core is modelled",
                      write ? "write" : "read", address, write ? *value : 0);
    return ok;
}
