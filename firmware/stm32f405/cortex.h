/* The few instructions of the Cortex-M4 that C has no words for (ARM DDI0403, section B5.2). */
#ifndef LUMI_FIRMWARE_STM32F405_CORTEX_H
#define LUMI_FIRMWARE_STM32F405_CORTEX_H

#include <stdint.h>

/* Holds everything off but faults; for a few instructions. Returns what to give to `irq_restore`. */
static inline uint32_t irq_disable(void)
{
    uint32_t primask;
    __asm__ volatile("mrs %0, primask\n\tcpsid i" : "=r"(primask)::"memory");
    return primask;
}

static inline void irq_restore(uint32_t primask)
{
    __asm__ volatile("msr primask, %0" ::"r"(primask) : "memory");
}

/* Raises BASEPRI to `priority` (never lowers it) and returns what it was. */
static inline uint32_t basepri_raise(uint32_t priority)
{
    uint32_t before;
    __asm__ volatile("mrs %0, basepri\n\tmsr basepri_max, %1\n\tisb" : "=&r"(before) : "r"(priority << 4) : "memory");
    return before;
}

static inline void basepri_restore(uint32_t before)
{
    __asm__ volatile("msr basepri, %0" ::"r"(before) : "memory");
}

static inline void wait_for_interrupt(void)
{
    __asm__ volatile("dsb\n\twfi" ::: "memory");
}

static inline void data_barrier(void)
{
    __asm__ volatile("dsb" ::: "memory");
}

static inline void instruction_barrier(void)
{
    __asm__ volatile("isb" ::: "memory");
}

#endif
