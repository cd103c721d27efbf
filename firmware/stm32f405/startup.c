/* From reset to main: the vector table, the way into the chip's loader, RAM, and what faults end in.
 *
 * ARM DDI0403 section B1.5: the processor takes its stack from the table's first word and starts at its second. */
#include "firmware/stm32f405/cortex.h"
#include "firmware/stm32f405/f405_registers.h"
#include "firmware/stm32f405/port.h"

#include <stddef.h>

extern uint32_t stack_top[], data_start[], data_end[], bss_start[], bss_end[];
extern const uint32_t data_load[];

int main(void);

/* Survives a reset. Two words, so that what RAM holds after power-up is not taken for it. */
static volatile uint32_t loader_magic[2] __attribute__((section(".magic")));
static volatile uint32_t starts __attribute__((section(".magic")));
#define LOADER_MAGIC0 0x4c6f6164u
#define LOADER_MAGIC1 0x65724446u

void loader_request(void)
{
    loader_magic[0] = LOADER_MAGIC0;
    loader_magic[1] = LOADER_MAGIC1;
}

uint32_t boot_count(void)
{
    return starts;
}

/* Into system memory, as after a reset with BOOT0 high: no clock has been touched and no interrupt is on. It expects
 * itself at address 0 (RM0090 section 9.2.1; AN2606 on the STM32F40xxx loader). */
static void loader_enter(void)
{
    const uint32_t *const table = (const uint32_t *)SYSTEM_MEMORY;

    RCC_APB2ENR = RCC_APB2ENR_SYSCFGEN;
    SYSCFG_MEMRMP = SYSCFG_MEMRMP_SYSTEM;
    data_barrier();
    instruction_barrier();
    __asm__ volatile("msr msp, %0\n\tbx %1" ::"r"(table[0]), "r"(table[1]) : "memory");
}

void Reset_Handler(void);
void Reset_Handler(void)
{
    if (loader_magic[0] == LOADER_MAGIC0 && loader_magic[1] == LOADER_MAGIC1) {
        loader_magic[0] = 0;
        loader_enter();
    }
    loader_magic[0] = 0;
    /* After a reset the clock is HSI (RM0090 section 7.2.6). Another one is a loader's that has jumped here and may
     * have left more than that behind. */
    if (RCC_CFGR & RCC_CFGR_SWS)
        system_restart();
    starts = starts + 1;
    SCB_VTOR = FLASH_IMAGE_ADDRESS;

    const uint32_t *from = data_load;
    for (uint32_t *to = data_start; to < data_end; to++)
        *to = *from++;
    for (uint32_t *to = bss_start; to < bss_end; to++)
        *to = 0;
    main();
    panic();
}

void panic(void)
{
    irq_disable();
    /* No pulse, no trigger; the holding current and the brake stay as they are: an arm must not fall because of a
     * fault here. The watchdog ends it, and the next start reports it. */
    TIM_CR1(TIM2_BASE) = 0;
    TIM_CCER(TIM2_BASE) = 0;
    GPIO_BSRR(GPIOB_BASE) = 0xffff0000u;
    for (;;)
        ;
}

/* Faults and what nobody has asked for. An NMI is the clock security system: the crystal has stopped. */
static void fault(void)
{
    panic();
}

#define VECTOR(handler) ((uintptr_t)(handler))
#define FAULT VECTOR(fault)
#define FAULT4 FAULT, FAULT, FAULT, FAULT
#define FAULT16 FAULT4, FAULT4, FAULT4, FAULT4

/* RM0090 section 12.2, table 62. */
__attribute__((section(".vectors"), used)) static const uintptr_t vectors[16 + IRQ_COUNT] = {
    VECTOR(stack_top),
    VECTOR(Reset_Handler), /* */
    FAULT4,
    FAULT,
    0,
    0,
    0,
    0,
    FAULT,
    FAULT,
    0,
    VECTOR(PendSV_Handler),
    VECTOR(SysTick_Handler),
    /* 0 … 5 */ FAULT,
    VECTOR(PVD_Handler),
    FAULT4,
    /* EXTI0 … 4 */ VECTOR(EXTI0_Handler),
    VECTOR(EXTI1_Handler),
    VECTOR(EXTI2_Handler),
    VECTOR(EXTI3_Handler),
    VECTOR(EXTI4_Handler),
    /* 11 … 16 */ FAULT4,
    FAULT,
    FAULT,
    /* 17 */ VECTOR(DMA1_Stream6_Handler),
    /* 18 … 27 */ FAULT4,
    FAULT4,
    FAULT,
    FAULT,
    /* 28, 29 */ VECTOR(TIM2_Handler),
    VECTOR(TIM3_Handler),
    /* 30 … 37 */ FAULT4,
    FAULT4,
    /* 38 … 40 */ VECTOR(USART2_Handler),
    FAULT,
    VECTOR(EXTI15_10_Handler),
    /* 41 … 49 */ FAULT4,
    FAULT4,
    FAULT,
    /* 50 */ VECTOR(TIM5_Handler),
    /* 51 … 66 */ FAULT16,
    /* 67 */ VECTOR(OTG_FS_Handler),
    /* 68 … 81 */ FAULT4,
    FAULT4,
    FAULT4,
    FAULT,
    FAULT};
