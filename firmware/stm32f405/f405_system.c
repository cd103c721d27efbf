/* Watchdog, cause of the reset, supply, identity, and the ways out. */
#include "firmware/stm32f405/cortex.h"
#include "firmware/stm32f405/f405_registers.h"
#include "firmware/stm32f405/port.h"

#include <string.h>

static uint32_t cause;

/* RM0090 section 21.3: LSI is 17 to 47 kHz (DS8626 table 35), 32 typically; / 32, 500 counts: 340 to 940 ms, 500
 * typically. */
static void watchdog_init(void)
{
    IWDG_KR = IWDG_KR_START;
    IWDG_KR = IWDG_KR_UNLOCK;
    while (IWDG_SR & IWDG_SR_PVU)
        ;
    IWDG_PR = IWDG_PR_32;
    while (IWDG_SR & IWDG_SR_RVU)
        ;
    IWDG_RLR = 500;
    IWDG_KR = IWDG_KR_RELOAD;
}

/* Section 13.3: one channel, over and over, 480 cycles of sampling at 21 MHz: 23 µs each. */
static void supply_init(void)
{
    ADC_CCR = ADC_CCR_ADCPRE_4;
    ADC_CR1(ADC1_BASE) = 0;
    ADC_SMPR2(ADC1_BASE) = ADC_SMPR2_480(PIN_A_SUPPLY);
    ADC_SQR1(ADC1_BASE) = 0;
    ADC_SQR3(ADC1_BASE) = PIN_A_SUPPLY;
    ADC_CR2(ADC1_BASE) = ADC_CR2_ADON | ADC_CR2_CONT;
    const uint64_t begun = time_now();
    while (time_now() - begun < 3 * (BOARD_TICK_HZ / 1000000u)) /* tSTAB: 3 µs, DS8626 table 67 */
        ;
    ADC_CR2(ADC1_BASE) = ADC_CR2_ADON | ADC_CR2_CONT | ADC_CR2_SWSTART;
    const uint64_t started = time_now(); /* the first conversion */
    while (time_now() - started < 50 * (BOARD_TICK_HZ / 1000000u))
        ;
}

void system_init(void)
{
    cause = RCC_CSR;
    RCC_CSR = RCC_CSR_RMVF;
    PWR_CR = PWR_CR_VOS | PWR_CR_PLS_2V8 | PWR_CR_PVDE; /* section 5.2.3; it interrupts from inputs_init on */
    supply_init();
    if (!ON_QEMU)
        watchdog_init();
}

void watchdog_kick(void)
{
    IWDG_KR = IWDG_KR_RELOAD;
}

/* Section 7.3.21; a reset from within pulls the pin as well, so the pin comes last. */
enum board_reset system_reset_cause(void)
{
    if (cause & (RCC_CSR_IWDGRSTF | RCC_CSR_WWDGRSTF))
        return BOARD_RESET_WATCHDOG;
    if (cause & (RCC_CSR_PORRSTF | RCC_CSR_BORRSTF))
        return BOARD_RESET_POWER;
    if (cause & RCC_CSR_SFTRSTF)
        return BOARD_RESET_SOFTWARE;
    return cause & RCC_CSR_PINRSTF ? BOARD_RESET_PIN : BOARD_RESET_POWER;
}

int system_supply_mv(void)
{
    return (int)(ADC_DR(ADC1_BASE) * (SUPPLY_REFERENCE_MV * SUPPLY_DIVIDER) / 4095u);
}

void system_unique_id(uint8_t id[BOARD_UNIQUE_ID])
{
    if (ON_QEMU)
        memcpy(id, "netduinoplus", BOARD_UNIQUE_ID); /* there is none */
    else
        memcpy(id, (const void *)UNIQUE_ID_ADDRESS, BOARD_UNIQUE_ID);
}

/* Section 24.3: a number takes 40 cycles of the 48 MHz clock; the first after power-up is not used. Should the
 * generator fail, the noise of the supply's measurement, the time and the number of starts must do. */
uint32_t system_boot_number(void)
{
    uint32_t number = boot_count() * 2654435761u ^ (uint32_t)time_now() * 40503u ^ ADC_DR(ADC1_BASE) << 20;

    if (ON_QEMU)
        return number; /* its generator is a hole */
    RNG_CR = RNG_CR_RNGEN;
    for (int i = 0; i < 3; i++) {
        for (int wait = 0; !(RNG_SR & RNG_SR_DRDY) && wait < 1000; wait++)
            ;
        if (!(RNG_SR & (RNG_SR_CECS | RNG_SR_SECS)))
            number ^= RNG_DR;
    }
    RNG_CR = 0;
    return number;
}

void system_restart(void)
{
    irq_disable();
    data_barrier();
    SCB_AIRCR = SCB_AIRCR_RESET;
    data_barrier();
    for (;;)
        ;
}

void system_enter_loader(void)
{
    loader_request();
    system_restart();
}
