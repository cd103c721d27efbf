/* 168 MHz from an 8 MHz crystal. */
#include "firmware/stm32f405/f405_registers.h"
#include "firmware/stm32f405/port.h"

/* RM0090 section 7.3.2: 8 MHz / M 8 = 1 MHz, × N 336 = 336 MHz, / P 2 = 168 MHz, / Q 7 = 48 MHz for USB. */
#define PLL_SETTING                                                                                                    \
    (RCC_PLLCFGR_PLLM(CLOCK_HSE / 1000000u) | RCC_PLLCFGR_PLLN(336) | RCC_PLLCFGR_PLLP_2 | RCC_PLLCFGR_PLLSRC_HSE |    \
     RCC_PLLCFGR_PLLQ(7))

/* AHB 168 MHz; APB1 42 MHz, its timers twice that (section 7.2); APB2 84 MHz. */
#define CFGR_SETTING (RCC_CFGR_HPRE_1 | RCC_CFGR_PPRE1_4 | RCC_CFGR_PPRE2_2)

/* Reads of RCC_CR at 16 MHz: well over the 2 ms that DS8626 table 33 gives the crystal. */
#define HSE_PATIENCE 500000

/* Without the crystal times would be a percent off and nobody told: nothing moves, and the status light (which the
 * pins' defaults leave off) blinks fast. The watchdog does not run yet. */
static void no_crystal(void)
{
    RCC_AHB1ENR = RCC_AHB1ENR_CCMDATARAMEN | RCC_AHB1ENR_GPIOCEN;
    GPIO_MODER(GPIOC_BASE) = GPIO_MODER_OUTPUT << (2 * PIN_C_STATUS);
    for (uint32_t phase = 0;; phase ^= 1) {
        GPIO_BSRR(GPIOC_BASE) = 1u << (PIN_C_STATUS + (phase ? 16 : 0));
        for (volatile uint32_t wait = 0; wait < 100000; wait++)
            ;
    }
}

static void start_pll(void)
{
    RCC_CR = RCC_CR_HSION | RCC_CR_HSITRIM_DEFAULT | RCC_CR_HSEON;
    for (uint32_t wait = 0; !(RCC_CR & RCC_CR_HSERDY); wait++)
        if (wait == HSE_PATIENCE)
            no_crystal();

    RCC_APB1ENR = RCC_APB1ENR_PWREN;
    (void)RCC_APB1ENR;
    PWR_CR = PWR_CR_VOS; /* section 5.1.3: scale 1 above 144 MHz */

    RCC_PLLCFGR = PLL_SETTING;
    RCC_CR = RCC_CR_HSION | RCC_CR_HSITRIM_DEFAULT | RCC_CR_HSEON | RCC_CR_CSSON | RCC_CR_PLLON;
    while (!(RCC_CR & RCC_CR_PLLRDY))
        ;
    RCC_CFGR = CFGR_SETTING | RCC_CFGR_SW_PLL;
    while ((RCC_CFGR & RCC_CFGR_SWS) != RCC_CFGR_SWS_PLL)
        ;
}

void clock_init(void)
{
    /* Section 3.5.1, table 10: 5 wait states for 150 to 168 MHz at 2.7 to 3.6 V; caches on. Before the clock rises. */
    FLASH_ACR = FLASH_ACR_LATENCY(5) | FLASH_ACR_PRFTEN | FLASH_ACR_ICEN | FLASH_ACR_DCEN;
    while ((FLASH_ACR & 7u) != 5 && !ON_QEMU)
        ;
    if (!ON_QEMU)
        start_pll();

    RCC_AHB1ENR =
        RCC_AHB1ENR_CCMDATARAMEN | RCC_AHB1ENR_GPIOAEN | RCC_AHB1ENR_GPIOBEN | RCC_AHB1ENR_GPIOCEN | RCC_AHB1ENR_DMA1EN;
    RCC_AHB2ENR = RCC_AHB2ENR_OTGFSEN | RCC_AHB2ENR_RNGEN;
    RCC_APB1ENR =
        RCC_APB1ENR_PWREN | RCC_APB1ENR_TIM2EN | RCC_APB1ENR_TIM3EN | RCC_APB1ENR_TIM5EN | RCC_APB1ENR_USART2EN;
    RCC_APB2ENR = RCC_APB2ENR_ADC1EN | RCC_APB2ENR_SYSCFGEN;
    (void)RCC_APB2ENR; /* section 7.3.10 and errata ES0182, 2.1.13: a clock is there two cycles after its bit */

    STK_LOAD = CLOCK_SYSCLK / 1000u - 1;
    STK_VAL = 0;
    SCB_SHPR_BYTE(EXCEPTION_SYSTICK - 4) = PRIORITY_TICK << 4;
    STK_CTRL = STK_CTRL_ENABLE | STK_CTRL_TICKINT | STK_CTRL_CLKSOURCE;
}

/* Its coming is all there is to it: it ends wait_for_interrupt. */
void SysTick_Handler(void)
{
}
