/* The profile's two copies in the chip's flash (RM0090 sections 3.6 and 3.9). There is one bank: while it erases or
 * programs, whatever is fetched from it waits. So the waiting is done from RAM with interrupts off, and feeds the
 * watchdog: an erase takes 1 s, at most 2 (DS8626 table 42, 128 KiB, 32 bits at a time). Nothing moves meanwhile. */
#include "firmware/stm32f405/cortex.h"
#include "firmware/stm32f405/f405_registers.h"
#include "firmware/stm32f405/port.h"

#include <string.h>

#define ERRORS (FLASH_SR_OPERR | FLASH_SR_WRPERR | FLASH_SR_PGAERR | FLASH_SR_PGPERR | FLASH_SR_PGSERR)
#define ERASE_TICKS (4u * BOARD_TICK_HZ)
#define WRITE_TICKS (BOARD_TICK_HZ / 1000u) /* a word takes 100 µs at most */

/* Starts what `control` says, by storing `word` at `address` or by its STRT bit, and waits until it is done. Returns
 * the status then; still busy after `ticks`: BSY is in it. */
__attribute__((section(".ram_code"), noinline)) static uint32_t operate(uint32_t control, volatile uint32_t *address,
                                                                        uint32_t word, uint32_t ticks)
{
    uint32_t primask, status;

    __asm__ volatile("mrs %0, primask\n\tcpsid i" : "=r"(primask)::"memory");
    FLASH_CR = control;
    if (address)
        *address = word;
    else
        FLASH_CR = control | FLASH_CR_STRT;
    __asm__ volatile("dsb" ::: "memory");
    const uint32_t begun = TIM_CNT(TIM5_BASE);
    do {
        IWDG_KR = IWDG_KR_RELOAD;
        status = FLASH_SR;
    } while ((status & FLASH_SR_BSY) && TIM_CNT(TIM5_BASE) - begun < ticks);
    __asm__ volatile("msr primask, %0" ::"r"(primask) : "memory");
    return status;
}

static void unlock(void)
{
    if (FLASH_CR & FLASH_CR_LOCK) {
        FLASH_KEYR = FLASH_KEYR_KEY1;
        FLASH_KEYR = FLASH_KEYR_KEY2;
    }
    FLASH_SR = ERRORS | FLASH_SR_EOP; /* section 3.9.4: cleared by writing 1 */
}

/* Section 3.5.3: the data cache may hold what was there before; it is reset while it is off. */
static void forget_cached(void)
{
    const uint32_t setting = FLASH_ACR_LATENCY(5) | FLASH_ACR_PRFTEN | FLASH_ACR_ICEN;

    FLASH_CR = FLASH_CR_LOCK;
    FLASH_ACR = setting;
    FLASH_ACR = setting | FLASH_ACR_DCRST;
    FLASH_ACR = setting;
    FLASH_ACR = setting | FLASH_ACR_DCEN;
}

static uint32_t slot_address(int slot)
{
    return FLASH_PROFILE_ADDRESS0 + (uint32_t)slot * FLASH_PROFILE_STRIDE;
}

bool flash_erase_slot(int slot)
{
    if (slot < 0 || slot >= BOARD_PROFILE_SLOTS)
        return false;
    unlock();
    const uint32_t status =
        operate(FLASH_CR_PSIZE_32 | FLASH_CR_SER | FLASH_CR_SNB((uint32_t)(FLASH_PROFILE_SECTOR0 + slot)), NULL, 0,
                ERASE_TICKS);
    forget_cached();
    return !(status & (ERRORS | FLASH_SR_BSY));
}

bool flash_write_slot(int slot, uint32_t offset, const void *data, size_t size)
{
    const uint8_t *bytes = data;
    uint32_t status = 0;

    if (slot < 0 || slot >= BOARD_PROFILE_SLOTS || offset % 4 || size % 4 || offset > BOARD_PROFILE_SLOT_SIZE ||
        size > BOARD_PROFILE_SLOT_SIZE - offset)
        return false;
    unlock();
    for (size_t i = 0; i < size && !(status & (ERRORS | FLASH_SR_BSY)); i += 4) {
        uint32_t word;
        memcpy(&word, bytes + i, 4);
        status = operate(FLASH_CR_PSIZE_32 | FLASH_CR_PG,
                         (volatile uint32_t *)(uintptr_t)(slot_address(slot) + offset + i), word, WRITE_TICKS);
    }
    forget_cached();
    /* Bits only fall: what was not erased shows here. */
    return !(status & (ERRORS | FLASH_SR_BSY)) && memcmp(flash_slot(slot) + offset, data, size) == 0;
}

const uint8_t *flash_slot(int slot)
{
    return (const uint8_t *)(uintptr_t)slot_address(slot);
}
