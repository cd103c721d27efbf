/* The flash interface (RM0090 3): keys, sector erase, programming, errors, and power that goes in between. */
#include "sim/board/chip_priv.h"

#include <string.h>

enum { PG = 1u << 0, SER = 1u << 1, MER = 1u << 2, STRT = 1u << 16, LOCK = 1u << 31 };
enum { EOP = 1u << 0, PGAERR = 1u << 5, PGPERR = 1u << 6, PGSERR = 1u << 7, BSY = 1u << 16 };
#define FLASH_IRQ 4
#define MICROSECOND (F405_HZ / 1000000u)

/* RM0090 table 5. */
static uint32_t sector_start(int sector)
{
    return sector < 4 ? (uint32_t)sector * 0x4000 : sector == 4 ? 0x10000 : (uint32_t)(sector - 4) * 0x20000;
}

static uint32_t sector_size(int sector)
{
    return sector < 4 ? 0x4000 : sector == 4 ? 0x10000 : 0x20000;
}

void f405_flash_reset(struct f405 *chip)
{
    struct flash *f = &chip->flash;
    *f = (struct flash){.cr = LOCK,
                        .optcr = 0x0FFFAAED,
                        .done = F405_NEVER,
                        .cut_at = F405_NEVER,
                        .sector = -1,
                        .acr = f->acr,
                        .cut_operation = f->cut_operation};
}

static void error(struct f405 *chip, uint32_t flag)
{
    chip->flash.sr |= flag;
    f405_cpu_irq(chip, FLASH_IRQ, chip->flash.cr >> 25 & 1);
}

/* DS8626 table 40, typical: 400, 300, 250 ms for 16 KiB with a parallelism of 8, 16, 32 bits, and so on. */
static uint64_t erase_time(const struct f405 *chip, int sector)
{
    static const uint16_t ms[3][3] = {{400, 300, 250}, {1200, 700, 550}, {2000, 1300, 1000}};
    unsigned parallel = bits(chip->flash.cr, 8, 2);
    return (uint64_t)ms[sector < 4 ? 0 : sector == 4 ? 1 : 2][parallel > 2 ? 2 : parallel] * 1000 * MICROSECOND;
}

/* The flash is busy so long from now. */
static void begin(struct f405 *chip, uint64_t cycles)
{
    struct flash *f = &chip->flash;
    if (f->stale)
        f405_complain(chip, "the data cache was not reset after an erase");
    f->done = chip->now + cycles;
    if (f->cut_operation && --f->cut_operation == 0)
        f->cut_at = chip->now + cycles / 2;
}

void f405_cut_in_flash(struct f405 *chip, unsigned operation)
{
    chip->flash.cut_operation = operation;
}

static void start(struct f405 *chip)
{
    struct flash *f = &chip->flash;
    int sector = (int)bits(f->cr, 3, 4);
    if (f->done != F405_NEVER || f->cr & MER || !(f->cr & SER) || sector >= SECTORS) {
        f405_complain(chip, "FLASH_CR 0x%08x: not an erase that is modelled", f->cr);
        return;
    }
    f->sector = sector;
    begin(chip, erase_time(chip, sector));
}

static void write_cr(struct f405 *chip, uint32_t value)
{
    struct flash *f = &chip->flash;
    if (f->cr & LOCK) {
        f405_complain(chip, "FLASH_CR written while locked");
        return;
    }
    f->cr = value & (PG | SER | MER | 0x78u | 0x300u | 3u << 24 | LOCK);
    if (value & LOCK)
        f->unlock = 0;
    if (value & STRT)
        start(chip);
}

static void write_key(struct f405 *chip, uint32_t value)
{
    struct flash *f = &chip->flash;
    static const uint32_t keys[2] = {0x45670123, 0xCDEF89AB}; /* 3.6.1 */
    if (f->locked_out || f->unlock > 1 || value != keys[f->unlock]) {
        f->locked_out = true;
        f405_complain(chip, "FLASH_KEYR: a wrong key 0x%08x", value);
        return;
    }
    if (++f->unlock == 2)
        f->cr &= ~LOCK;
}

/* A program that asks while the flash is busy will ask again and again: as much as 5 µs of that, but not beyond what
 * else happens, is passed over at once. */
static void poll_status(struct f405 *chip, uint32_t *value)
{
    struct flash *f = &chip->flash;
    if (f->done != F405_NEVER) {
        uint64_t to = chip->now + 5 * MICROSECOND;
        to = to < f->done ? to : f->done;
        to = to < chip->next ? to : chip->next;
        if (to > chip->now)
            chip->now = to;
        if (chip->now >= chip->next)
            f405_run_events(chip);
    }
    *value = f->sr | (f->done != F405_NEVER ? BSY : 0);
}

bool f405_flash_access(struct f405 *chip, int index, uint32_t offset, bool write, uint32_t *value)
{
    (void)index;
    struct flash *f = &chip->flash;
    switch (offset) {
    case 0x00:
        if (write) {
            if (*value & 1u << 12 && (*value | f->acr) & 1u << 10)
                f405_complain(chip, "FLASH_ACR 0x%x: the data cache is reset while it is on", *value);
            else if (*value & 1u << 12)
                f->stale = false;
            f->acr = *value;
        } else {
            *value = f->acr;
        }
        return true;
    case 0x04:
        if (write && (f->cr & LOCK))
            write_key(chip, *value);
        return write;
    case 0x0c:
        if (write)
            f->sr &= ~(*value & 0xf3);
        else
            poll_status(chip, value);
        return true;
    case 0x10:
        if (write)
            write_cr(chip, *value);
        else
            *value = f->cr | (f->done != F405_NEVER && f->sector >= 0 ? STRT : 0);
        return true;
    case 0x14:
        *value = f->optcr;
        return !write;
    default:
        return false;
    }
}

/* An instruction writes to flash: that programs it, or is an error. True: the access is allowed. */
bool f405_flash_write_hook(struct f405 *chip, uint32_t address, unsigned size, uint64_t value)
{
    struct flash *f = &chip->flash;
    f405_flash_fix(chip);
    if (address - F405_FLASH >= F405_FLASH_SIZE || size > 8) {
        f405_complain(chip, "write of 0x%08x: that is not to be written", address);
        return false;
    }
    uint8_t *at = chip->flash_bytes + (address - F405_FLASH);
    f->fix_address = address;
    f->fix_size = size;
    memcpy(f->fix, at, size);
    if (f->done != F405_NEVER) { /* 3.5: the bus waits */
        chip->now = f->done;
        f405_run_events(chip);
        if (chip->off_wanted)
            return true;
    }
    if (f->cr & LOCK || !(f->cr & PG)) {
        error(chip, PGSERR);
        f405_complain(chip, "write of 0x%08x: flash is not being programmed", address);
        return true;
    }
    if (size != 1u << bits(f->cr, 8, 2)) {
        error(chip, PGPERR);
        return true;
    }
    if (address % size) {
        error(chip, PGAERR);
        return true;
    }
    memcpy(f->before, at, size);
    for (unsigned i = 0; i < size; i++)
        f->fix[i] &= (uint8_t)(value >> 8 * i);
    f->address = address;
    f->size = size;
    f->sector = -1;
    begin(chip, 16 * MICROSECOND); /* DS8626 table 40 */
    f405_schedule(chip);
    return true;
}

void f405_flash_fix(struct f405 *chip)
{
    struct flash *f = &chip->flash;
    if (!f->fix_size)
        return;
    memcpy(chip->flash_bytes + (f->fix_address - F405_FLASH), f->fix, f->fix_size);
    f->fix_size = 0;
#if UC_API_MAJOR > 2 || UC_API_MINOR >= 1
    /* From 2.1 on a page whose protection was waived once is written to without asking until this is forgotten. */
    uc_ctl_flush_tlb(chip->uc);
#endif
}

void f405_flash_event(struct f405 *chip)
{
    struct flash *f = &chip->flash;
    if (f->cut_at <= chip->now) {
        f->cut_at = F405_NEVER;
        chip->off_wanted = chip->attention = true;
        return;
    }
    f->done = F405_NEVER;
    if (f->sector >= 0) {
        memset(chip->flash_bytes + sector_start(f->sector), 0xff, sector_size(f->sector));
        f->stale = f->acr >> 10 & 1; /* RM0090 3.5.3 */
    }
    f->sector = -1;
    f->size = 0;
    if (f->cr >> 24 & 1) { /* EOP is set only with EOPIE: 3.9.4 */
        f->sr |= EOP;
        f405_cpu_irq(chip, FLASH_IRQ, true);
        chip->cpu.line[EX_IRQ + FLASH_IRQ] = false;
    }
}

/* What an operation leaves when the power goes: bits that were on their way are either, others as they were. */
void f405_flash_power_cut(struct f405 *chip)
{
    struct flash *f = &chip->flash;
    f405_flash_fix(chip);
    if (f->done == F405_NEVER)
        return;
    f->done = F405_NEVER;
    if (f->sector >= 0) {
        uint8_t *bytes = chip->flash_bytes + sector_start(f->sector);
        for (uint32_t i = 0; i < sector_size(f->sector); i++)
            bytes[i] |= (uint8_t)(f405_random(chip) & f405_random(chip)); /* towards 0xff */
    } else if (f->size) {
        uint8_t *bytes = chip->flash_bytes + (f->address - F405_FLASH);
        for (unsigned i = 0; i < f->size; i++)
            bytes[i] |= f->before[i] & (uint8_t)f405_random(chip);
    }
}
