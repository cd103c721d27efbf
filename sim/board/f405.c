/* The emulated chip as a whole: memory, buses, the order of events, running. */
#include "sim/board/chip_priv.h"

#include "proto/base/memory.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#define SYSTEM_MEMORY 0x1FFF0000u
#define SYSTEM_SIZE 0x8000u
#define UNIQUE_ID 0x7A10u       /* RM0090 39.1 */
#define FLASH_KILOBYTES 0x7A22u /* RM0090 39.2 */
#define RAM 0x20000000u
#define PERIPHERALS 0x40000000u
#define PERIPHERALS_SIZE 0x100000u
#define AHB2 0x50000000u
#define AHB2_SIZE 0x61000u
#define PPB 0xE0000000u
#define PPB_SIZE 0x100000u

/* RM0090 table 1 (boundary addresses) and 7.3.10 to 7.3.14 (clock enable bits). */
static const struct peripheral {
    uint32_t base, size;
    f405_peripheral_access *access;
    int index;
    uint8_t enable, bit; /* RCC offset (0: always clocked) and bit */
} peripherals[] = {
    {0x40000000, 0x400, f405_timer_access, 2, 0x40, 0},   {0x40000400, 0x400, f405_timer_access, 3, 0x40, 1},
    {0x40000800, 0x400, f405_timer_access, 4, 0x40, 2},   {0x40000C00, 0x400, f405_timer_access, 5, 0x40, 3},
    {0x40001000, 0x400, f405_timer_access, 6, 0x40, 4},   {0x40001400, 0x400, f405_timer_access, 7, 0x40, 5},
    {0x40001800, 0x400, f405_timer_access, 12, 0x40, 6},  {0x40001C00, 0x400, f405_timer_access, 13, 0x40, 7},
    {0x40002000, 0x400, f405_timer_access, 14, 0x40, 8},  {0x40003000, 0x400, f405_iwdg_access, 0, 0, 0},
    {0x40004400, 0x400, f405_usart_access, 2, 0x40, 17},  {0x40004800, 0x400, f405_usart_access, 3, 0x40, 18},
    {0x40004C00, 0x400, f405_usart_access, 4, 0x40, 19},  {0x40005000, 0x400, f405_usart_access, 5, 0x40, 20},
    {0x40007000, 0x400, f405_pwr_access, 0, 0x40, 28},    {0x40010000, 0x400, f405_timer_access, 1, 0x44, 0},
    {0x40010400, 0x400, f405_timer_access, 8, 0x44, 1},   {0x40011000, 0x400, f405_usart_access, 1, 0x44, 4},
    {0x40011400, 0x400, f405_usart_access, 6, 0x44, 5},   {0x40012000, 0x400, f405_adc_access, 0, 0x44, 8},
    {0x40013800, 0x400, f405_syscfg_access, 0, 0x44, 14}, {0x40013C00, 0x400, f405_exti_access, 0, 0, 0},
    {0x40014000, 0x400, f405_timer_access, 9, 0x44, 16},  {0x40014400, 0x400, f405_timer_access, 10, 0x44, 17},
    {0x40014800, 0x400, f405_timer_access, 11, 0x44, 18}, {0x40020000, 0x400, f405_gpio_access, 0, 0x30, 0},
    {0x40020400, 0x400, f405_gpio_access, 1, 0x30, 1},    {0x40020800, 0x400, f405_gpio_access, 2, 0x30, 2},
    {0x40020C00, 0x400, f405_gpio_access, 3, 0x30, 3},    {0x40021000, 0x400, f405_gpio_access, 4, 0x30, 4},
    {0x40021400, 0x400, f405_gpio_access, 5, 0x30, 5},    {0x40021800, 0x400, f405_gpio_access, 6, 0x30, 6},
    {0x40021C00, 0x400, f405_gpio_access, 7, 0x30, 7},    {0x40022000, 0x400, f405_gpio_access, 8, 0x30, 8},
    {0x40023000, 0x400, f405_crc_access, 0, 0x30, 12},    {0x40023800, 0x400, f405_rcc_access, 0, 0, 0},
    {0x40023C00, 0x400, f405_flash_access, 0, 0, 0},      {0x40026000, 0x400, f405_dma_access, 0, 0x30, 21},
    {0x40026400, 0x400, f405_dma_access, 1, 0x30, 22},    {0x50000000, 0x40000, f405_otg_access, 0, 0x34, 7},
    {0x50060800, 0x400, f405_rng_access, 0, 0x34, 6},
};

void f405_complain(struct f405 *chip, const char *format, ...)
{
    if (chip->fault[0])
        return;
    va_list list;
    va_start(list, format);
    int n = vsnprintf(chip->fault, sizeof chip->fault, format, list);
    va_end(list);
    if (n > 0 && (size_t)n < sizeof chip->fault)
        snprintf(chip->fault + n, sizeof chip->fault - (size_t)n, " (block at 0x%08x after 0x%08x, cycle %llu)",
                 chip->block_address, chip->previous_block, (unsigned long long)chip->now);
    chip->reason = F405_STOP_FAULT;
    chip->attention = true;
}

uint32_t f405_random(struct f405 *chip)
{
    chip->random ^= chip->random << 13;
    chip->random ^= chip->random >> 7;
    chip->random ^= chip->random << 17;
    return (uint32_t)(chip->random >> 32);
}

/* ---- buses ---- */

bool f405_mmio(struct f405 *chip, uint32_t address, unsigned size, bool write, uint32_t *value)
{
    for (size_t i = 0; i < sizeof peripherals / sizeof *peripherals; i++) {
        const struct peripheral *p = &peripherals[i];
        if (address - p->base >= p->size)
            continue;
        if (p->enable && !f405_rcc_enabled(chip, p->enable, p->bit)) {
            f405_complain(chip, "%s of 0x%08x: the peripheral has no clock", write ? "write" : "read", address);
            return false;
        }
        /* Narrow accesses reach their part of the register; what they leave out is written as 0, which is right where
         * they make sense (data registers, GPIO's BSRR). */
        uint32_t offset = (address - p->base) & ~3u;
        unsigned shift = (address & 3) * 8;
        uint32_t word = write ? *value << shift : 0;
        if (!p->access(chip, p->index, offset, write, &word)) {
            f405_complain(chip, "%s of 0x%08x (value 0x%x): no such register is modelled", write ? "write" : "read",
                          address, write ? *value : 0);
            return false;
        }
        if (!write)
            *value = size == 4 ? word : word >> shift & ((1u << size * 8) - 1);
        return true;
    }
    f405_complain(chip, "%s of 0x%08x: nothing is modelled there", write ? "write" : "read", address);
    return false;
}

static uint8_t *memory_at(struct f405 *chip, uint32_t address, unsigned size, bool write)
{
    if (address - RAM <= RAM_SIZE - size)
        return chip->ram + (address - RAM);
    if (!write && address - F405_FLASH <= F405_FLASH_SIZE - size)
        return chip->flash_bytes + (address - F405_FLASH);
    return NULL;
}

uint32_t f405_bus_read(struct f405 *chip, uint32_t address, unsigned size)
{
    uint32_t value = 0;
    const uint8_t *memory = memory_at(chip, address, size, false);
    if (memory)
        memcpy(&value, memory, size);
    else
        f405_mmio(chip, address, size, false, &value);
    return value;
}

void f405_bus_write(struct f405 *chip, uint32_t address, unsigned size, uint32_t value)
{
    uint8_t *memory = memory_at(chip, address, size, true);
    if (memory)
        memcpy(memory, &value, size);
    else
        f405_mmio(chip, address, size, true, &value);
}

static uint64_t access_memory(struct f405 *chip, uint32_t address, unsigned size, bool write, uint32_t value)
{
    f405_flash_fix(chip);
    /* The block's time has been added already: what was due by then has happened. */
    if (chip->now >= chip->next)
        f405_run_events(chip);
    bool ok = address >= PPB ? f405_ppb_access(chip, address, size, write, &value)
                             : f405_mmio(chip, address, size, write, &value);
    if (write)
        f405_schedule(chip);
    return ok ? value : 0;
}

#define BUS(name, base)                                                                                                \
    static uint64_t name##_read(uc_engine *uc, uint64_t offset, unsigned size, void *chip)                             \
    {                                                                                                                  \
        (void)uc;                                                                                                      \
        return access_memory(chip, (base) + (uint32_t)offset, size, false, 0);                                         \
    }                                                                                                                  \
    static void name##_write(uc_engine *uc, uint64_t offset, unsigned size, uint64_t value, void *chip)                \
    {                                                                                                                  \
        (void)uc;                                                                                                      \
        access_memory(chip, (base) + (uint32_t)offset, size, true, (uint32_t)value);                                   \
    }
BUS(peripheral, PERIPHERALS)
BUS(ahb2, AHB2)
BUS(ppb, PPB)

/* ---- events ---- */

static uint64_t earlier(uint64_t a, uint64_t b)
{
    return a < b ? a : b;
}

void f405_schedule(struct f405 *chip)
{
    uint64_t next = earlier(f405_cpu_next(chip), f405_iwdg_next(chip));
    next = earlier(next, earlier(chip->flash.done, chip->flash.cut_at));
    next = earlier(next, chip->adc.done);
    next = earlier(next, chip->otg.reset_end);
    for (int i = 1; i < TIMERS; i++)
        if (chip->timer[i].cr1 & 1)
            next = earlier(next, f405_timer_next(chip, i));
    for (int i = 1; i < F405_USARTS; i++)
        next = earlier(next, f405_usart_next(chip, i));
    if (chip->ops->next)
        next = earlier(next, chip->ops->next(chip->context));
    chip->next = earlier(next, chip->until);
}

/* Everything up to now, each thing at its own time. */
void f405_run_events(struct f405 *chip)
{
    uint64_t end = chip->now;
    f405_schedule(chip);
    while (chip->next <= end && !chip->fault[0]) {
        uint64_t at = chip->next;
        chip->now = at;
        for (int i = 1; i < TIMERS; i++)
            if (chip->timer[i].cr1 & 1)
                f405_timer_sync(chip, i, at);
        for (int i = 1; i < F405_USARTS; i++)
            if (f405_usart_next(chip, i) <= at)
                f405_usart_event(chip, i);
        if (chip->flash.done <= at || chip->flash.cut_at <= at)
            f405_flash_event(chip);
        if (chip->adc.done <= at)
            f405_adc_event(chip);
        if (chip->otg.reset_end <= at)
            f405_otg_event(chip);
        if (f405_cpu_next(chip) <= at)
            f405_cpu_event(chip);
        if (f405_iwdg_next(chip) <= at)
            f405_iwdg_event(chip);
        if (chip->ops->next && chip->ops->next(chip->context) <= at)
            chip->ops->event(chip->context, at);
        if (at == chip->until) /* the caller's own limit stays */
            break;
        f405_schedule(chip);
    }
    chip->now = end;
    chip->attention = true;
}

/* ---- the core's hooks ---- */

static uint32_t count_instructions(struct f405 *chip, uint32_t address, uint32_t size)
{
    struct block *block = &chip->blocks[(address >> 1) % BLOCKS];
    if (block->address == address && block->size == size)
        return block->instructions;
    uint8_t code[4096];
    if (size > sizeof code)
        size = sizeof code;
    uc_mem_read(chip->uc, address, code, size);
    uint32_t n = 0;
    /* DDI0403E A5.1: a halfword of 0b11101, 0b11110 or 0b11111 begins a 32-bit instruction. */
    for (uint32_t i = 0; i + 1 < size; n++)
        i += code[i + 1] >> 3 >= 0x1d ? 4 : 2;
    *block = (struct block){address, size, n};
    return n;
}

static bool wants_to_stop(const struct f405 *chip)
{
    return chip->fault[0] || chip->reset_wanted || chip->off_wanted || chip->stop || chip->now >= chip->until;
}

static void on_block(uc_engine *uc, uint64_t address64, uint32_t size, void *user)
{
    struct f405 *chip = user;
    uint32_t address = (uint32_t)address64;
    chip->previous_block = chip->block_address;
    chip->block_address = address;
    if (chip->flash.fix_size)
        f405_flash_fix(chip);
    /* RM0090 3.5.2: a read of flash (so also the next instruction from it) waits for the end of the operation. */
    if (chip->flash.done != F405_NEVER && address - F405_FLASH < F405_FLASH_SIZE && chip->now < chip->flash.done)
        chip->now = earlier(chip->flash.done, chip->flash.cut_at);
    if (chip->now >= chip->next)
        f405_run_events(chip);
    if (address - SYSTEM_MEMORY < SYSTEM_SIZE) {
        chip->reason = F405_STOP_LOADER;
        chip->stop = true;
        chip->attention = true;
    }
    if (chip->attention) {
        chip->attention = false;
        if (wants_to_stop(chip)) {
            chip->attention = true;
            chip->hook_stopped = true;
            uc_emu_stop(uc);
            return;
        }
        /* Writing the program counter makes Unicorn leave this block before its first instruction and go on there. */
        if (f405_cpu_deliverable(chip)) {
            chip->attention = true;
            chip->hook_stopped = true;
            uc_emu_stop(uc);
            return;
        }
        if (chip->cpu.candidate) /* masked: look again at the next block */
            chip->attention = true;
    }
    uint32_t n = count_instructions(chip, address, size);
    chip->instructions += n;
    chip->now += (uint64_t)n * chip->rcc.cost;
    if (chip->cpu.depth)
        chip->cpu.spent[chip->cpu.depth - 1] += n;
}

static bool on_invalid(uc_engine *uc, uc_mem_type type, uint64_t address, int size, int64_t value, void *user)
{
    (void)uc;
    struct f405 *chip = user;
    if (type == UC_MEM_WRITE_PROT)
        return f405_flash_write_hook(chip, (uint32_t)address, (unsigned)size, (uint64_t)value);
    const char *doing = type == UC_MEM_WRITE_UNMAPPED                                ? "write"
                        : type == UC_MEM_FETCH_UNMAPPED || type == UC_MEM_FETCH_PROT ? "fetch"
                                                                                     : "read";
    f405_complain(chip, "%s of 0x%08llx: no memory there", doing, (unsigned long long)address);
    return false;
}

static void on_interrupt(uc_engine *uc, uint32_t number, void *user)
{
    struct f405 *chip = user;
    uint32_t pc = 0;
    uc_reg_read(uc, UC_ARM_REG_PC, &pc);
    if (number == 8) { /* QEMU's EXCP_EXCEPTION_EXIT */
        chip->cpu.exception_return = pc | 1;
        f405_cpu_return(chip);
        chip->attention = true;
    } else {
        f405_complain(chip, "the core raised exception %u at 0x%08x", number, pc);
    }
    if (chip->fault[0]) {
        chip->hook_stopped = true;
        uc_emu_stop(uc);
    }
}

/* ---- making ---- */

static bool map_memory(struct f405 *chip)
{
    uc_engine *uc = chip->uc;
    uc_err e = uc_mem_map_ptr(uc, F405_FLASH, F405_FLASH_SIZE, UC_PROT_READ | UC_PROT_EXEC, chip->flash_bytes);
    e = e ? e : uc_mem_map_ptr(uc, 0, F405_FLASH_SIZE, UC_PROT_READ | UC_PROT_EXEC, chip->flash_bytes);
    e = e ? e : uc_mem_map_ptr(uc, RAM, RAM_SIZE, UC_PROT_ALL, chip->ram);
    e = e ? e : uc_mem_map_ptr(uc, 0x10000000, CCM_SIZE, UC_PROT_READ | UC_PROT_WRITE, chip->ccm);
    e = e ? e : uc_mem_map_ptr(uc, SYSTEM_MEMORY, SYSTEM_SIZE, UC_PROT_READ | UC_PROT_EXEC, chip->system);
    e = e ? e : uc_mmio_map(uc, PERIPHERALS, PERIPHERALS_SIZE, peripheral_read, chip, peripheral_write, chip);
    e = e ? e : uc_mmio_map(uc, AHB2, AHB2_SIZE, ahb2_read, chip, ahb2_write, chip);
    e = e ? e : uc_mmio_map(uc, PPB, PPB_SIZE, ppb_read, chip, ppb_write, chip);
    return e == UC_ERR_OK;
}

static bool add_hooks(struct f405 *chip)
{
    /* Unicorn takes callbacks of several types as void *, which ISO C lets no function be. */
    union {
        void (*block)(uc_engine *, uint64_t, uint32_t, void *);
        bool (*invalid)(uc_engine *, uc_mem_type, uint64_t, int, int64_t, void *);
        void (*interrupt)(uc_engine *, uint32_t, void *);
        void *pointer;
    } block = {.block = on_block}, invalid = {.invalid = on_invalid}, interrupt = {.interrupt = on_interrupt};
    uc_engine *uc = chip->uc;
    uc_err e = uc_hook_add(uc, &chip->hooks[0], UC_HOOK_BLOCK, block.pointer, chip, (uint64_t)1, (uint64_t)0);
    e = e ? e : uc_hook_add(uc, &chip->hooks[1], UC_HOOK_MEM_INVALID, invalid.pointer, chip, (uint64_t)1, (uint64_t)0);
    e = e ? e : uc_hook_add(uc, &chip->hooks[2], UC_HOOK_INTR, interrupt.pointer, chip, (uint64_t)1, (uint64_t)0);
    return e == UC_ERR_OK;
}

struct f405 *f405_create(const struct f405_ops *ops, void *context)
{
    struct f405 *chip = lumi_calloc(1, sizeof *chip);
    if (!chip)
        return NULL;
    chip->ops = ops;
    chip->context = context;
    chip->random = 88172645463325252u;
    chip->next = chip->until = F405_NEVER;
    chip->flash.cut_at = chip->flash.done = chip->adc.done = chip->otg.reset_end = F405_NEVER;
    for (int i = 0; i < F405_PINS; i++)
        chip->pin[i] = (struct pin){.output = F405_FLOATING, .driven = F405_FLOATING};
    chip->blocks = lumi_calloc(BLOCKS, sizeof *chip->blocks);
    /* Unicorn wants whole pages that nobody else has a part of. */
    chip->flash_bytes = lumi_alloc(F405_FLASH_SIZE, 1);
    chip->ram = lumi_calloc(RAM_SIZE, 1);
    chip->ccm = lumi_calloc(CCM_SIZE, 1);
    chip->system = lumi_calloc(SYSTEM_SIZE, 1);
    if (!chip->blocks || !chip->flash_bytes || !chip->ram || !chip->ccm || !chip->system)
        goto fail;
    memset(chip->flash_bytes, 0xff, F405_FLASH_SIZE);
    static const uint32_t vectors[2] = {0x20002d40u, SYSTEM_MEMORY + 0x101u};
    memcpy(chip->system, vectors, sizeof vectors);
    memcpy(chip->system + FLASH_KILOBYTES, &(uint16_t){F405_FLASH_SIZE / 1024}, 2);
    for (int i = 0x100; i < 0x200; i += 2) /* "b ." */
        memcpy(chip->system + i, &(uint16_t){0xe7fe}, 2);
    f405_set_unique_id(chip,
                       (const uint8_t[12]){0x1f, 0x00, 0x2c, 0x00, 0x0c, 0x51, 0x34, 0x35, 0x39, 0x34, 0x37, 0x33});
    if (uc_open(UC_ARCH_ARM, UC_MODE_THUMB | UC_MODE_MCLASS, &chip->uc) != UC_ERR_OK ||
        uc_ctl_set_cpu_model(chip->uc, UC_CPU_ARM_CORTEX_M4) != UC_ERR_OK || !map_memory(chip) || !add_hooks(chip))
        goto fail;
    return chip;
fail:
    f405_destroy(chip);
    return NULL;
}

void f405_destroy(struct f405 *chip)
{
    if (!chip)
        return;
    if (chip->uc)
        uc_close(chip->uc);
    lumi_free(chip->blocks);
    lumi_free(chip->flash_bytes);
    lumi_free(chip->ram);
    lumi_free(chip->ccm);
    lumi_free(chip->system);
    lumi_free(chip);
}

void f405_set_unique_id(struct f405 *chip, const uint8_t id[12])
{
    memcpy(chip->system + UNIQUE_ID, id, 12);
}

bool f405_flash_load(struct f405 *chip, uint32_t address, const void *data, size_t size)
{
    if (address < F405_FLASH || address - F405_FLASH > F405_FLASH_SIZE ||
        size > F405_FLASH_SIZE - (address - F405_FLASH))
        return false;
    memcpy(chip->flash_bytes + (address - F405_FLASH), data, size);
    /* Unicorn 2.1 renamed the macro; what it stands for stayed. */
    uc_ctl(chip->uc, UC_CTL_WRITE(UC_CTL_TB_FLUSH, 0));
    memset(chip->blocks, 0, BLOCKS * sizeof *chip->blocks);
    return true;
}

/* ---- power, reset, running ---- */

static void reset(struct f405 *chip, uint32_t flags)
{
    chip->reset_wanted = false;
    chip->resets++;
    f405_rcc_reset(chip, flags);
    memset(chip->timer, 0, sizeof chip->timer);
    f405_timer_reset(chip);
    memset(chip->dma, 0, sizeof chip->dma);
    f405_usart_reset(chip);
    chip->adc = (struct adc){.done = F405_NEVER};
    chip->watchdog = (struct watchdog){.rlr = 0xfff};
    chip->exti = (struct exti){0};
    f405_flash_reset(chip);
    f405_otg_reset(chip);
    f405_gpio_reset(chip);
    chip->rng_cr = 0;
    chip->crc = 0xffffffffu;
    chip->pwr_cr = 1u << 14; /* RM0090 5.4.1: VOS = scale 1 */
    f405_cpu_reset(chip);
    chip->attention = true;
}

void f405_want_reset(struct f405 *chip, uint32_t flags)
{
    chip->reset_wanted = true;
    chip->reset_flags = flags;
    chip->attention = true;
}

void f405_power(struct f405 *chip, bool on)
{
    if (on == chip->on)
        return;
    chip->on = on;
    chip->off_wanted = false;
    if (!on) {
        chip->reset_wanted = false;
        f405_flash_power_cut(chip);
        memset(chip->timer, 0, sizeof chip->timer);
        f405_gpio_reset(chip);
        f405_otg_reset(chip);
        return;
    }
    for (uint32_t i = 0; i < RAM_SIZE; i += 4)
        memcpy(chip->ram + i, &(uint32_t){f405_random(chip)}, 4);
    reset(chip, 0x0E000000u); /* PORRSTF, PINRSTF, BORRSTF */
}

void f405_reset_pin(struct f405 *chip)
{
    f405_want_reset(chip, 0x04000000u);
}

static void sleep_ahead(struct f405 *chip)
{
    if (f405_cpu_wakes(chip) || chip->cpu.event) {
        chip->cpu.asleep = chip->cpu.event = false;
        return;
    }
    f405_schedule(chip);
    if (chip->next > chip->now)
        chip->now = chip->next;
    f405_run_events(chip);
    if (f405_cpu_wakes(chip))
        chip->cpu.asleep = false;
}

static void run_core(struct f405 *chip)
{
    uint32_t pc = 0;
    uc_reg_read(chip->uc, UC_ARM_REG_PC, &pc);
    chip->hook_stopped = false;
    chip->attention = true;
    uc_err e = uc_emu_start(chip->uc, pc | 1, 0xfffffffeu, 0, 0);
    f405_flash_fix(chip);
    uc_reg_read(chip->uc, UC_ARM_REG_PC, &pc);
    if (e != UC_ERR_OK)
        f405_complain(chip, "the core stopped: %s", uc_strerror(e));
    if (chip->hook_stopped || chip->fault[0])
        return;
    uint16_t instruction = 0;
    uc_mem_read(chip->uc, (pc & ~1u) - 2, &instruction, 2);
    if (instruction == 0xbf30 || instruction == 0xbf20) { /* WFI, WFE */
        chip->cpu.asleep = instruction == 0xbf30 || !chip->cpu.event;
        chip->cpu.event = false;
        if (f405_cpu_wakes(chip))
            chip->cpu.asleep = false;
    }
}

enum f405_stop f405_run(struct f405 *chip, uint64_t until)
{
    if (chip->fault[0])
        return F405_STOP_FAULT;
    chip->until = until;
    chip->stop = false;
    chip->reason = F405_STOP_TIME;
    f405_schedule(chip);
    while (!chip->fault[0] && !chip->stop) {
        if (chip->now >= chip->next)
            f405_run_events(chip);
        if (chip->off_wanted)
            f405_power(chip, false);
        if (chip->reset_wanted)
            reset(chip, chip->reset_flags);
        if (chip->now >= until || chip->fault[0] || chip->stop)
            break;
        if (!chip->on || chip->cpu.asleep) {
            if (chip->on)
                sleep_ahead(chip);
            else
                chip->now = chip->next;
            continue;
        }
        if (f405_cpu_deliverable(chip))
            f405_cpu_enter(chip);
        run_core(chip);
    }
    return chip->reason;
}

uint64_t f405_now(const struct f405 *chip)
{
    return chip->now;
}

const char *f405_fault(const struct f405 *chip)
{
    return chip->fault[0] ? chip->fault : NULL;
}

uint64_t f405_instructions(const struct f405 *chip)
{
    return chip->instructions;
}

uint32_t f405_resets(const struct f405 *chip)
{
    return chip->resets;
}

const struct f405_exception_stats *f405_stats(const struct f405 *chip, int exception)
{
    return &chip->cpu.stats[exception];
}

void f405_clear_stats(struct f405 *chip)
{
    memset(chip->cpu.stats, 0, sizeof chip->cpu.stats);
}
