/* What is wired where on the STM32F405RG (LQFP64): the one list that the port, the emulator of the board and
 * docs/rig-board.md go by. Pin functions: DS8626 (STM32F405xx datasheet, rev 9), tables 7 and 9.
 *
 * 1. The 16 trigger outputs are the whole of port B, so that one write changes them all.
 * 2. Every input has a pull-up and is active when its line is HIGH: a switch is normally closed to ground, so that a
 *    broken wire reads as active. Exceptions: REACHED and the feedbacks are active LOW.
 * 3. What the pins do while the chip is in reset (inputs, floating) is what keeps the arm: ENABLE is active LOW (a
 *    driver whose enable input is left alone holds), BRAKE needs a HIGH to open. */
#ifndef LUMI_FIRMWARE_STM32F405_PINS_H
#define LUMI_FIRMWARE_STM32F405_PINS_H

/* Hz. The crystal, and what RCC makes of it (f405_clock.c). */
#define CLOCK_HSE 8000000u
#define CLOCK_SYSCLK 168000000u
#define CLOCK_APB1 42000000u
#define CLOCK_APB2 84000000u

/* Port B, 0 … 15: TRIGGER0 … TRIGGER15, active high. */

/* Port A */
#define PIN_A_STEP 0   /* TIM2_CH1, AF1; a pulse is high */
#define PIN_A_RS485 1  /* driver enable of an RS-485 transceiver, high while sending */
#define PIN_A_TX 2     /* USART2_TX, AF7 */
#define PIN_A_RX 3     /* USART2_RX, AF7 */
#define PIN_A_SUPPLY 4 /* ADC1_IN4: the rig's supply through SUPPLY_DIVIDER */
#define PIN_A_DIR 5    /* high: forward, rising steps */
#define PIN_A_ENABLE 6 /* LOW: the motor is energised */
#define PIN_A_BRAKE 7  /* high: the brake is open */
#define PIN_A_LAMP 8   /* high: lit */
#define PIN_A_VBUS 9   /* OTG_FS_VBUS: 5 V of the host */
#define PIN_A_DM 11    /* OTG_FS_DM, AF10 */
#define PIN_A_DP 12    /* OTG_FS_DP, AF10 */
/* 13 and 14 stay SWDIO and SWCLK. */

/* Port C: switches by EXTI lines of the same number */
#define PIN_C_ESTOP 0         /* EXTI0, a vector of its own */
#define PIN_C_INDEX 1         /* EXTI1 */
#define PIN_C_SLACK 2         /* EXTI2 */
#define PIN_C_STRING_END 3    /* EXTI3 */
#define PIN_C_WOUND 4         /* EXTI4 */
#define PIN_C_STATUS 5        /* output: high: lit */
#define PIN_C_FEEDBACK0 6     /* … 9: TIM3_CH1 … CH4, AF2; LOW: active (flash sync closed) */
#define PIN_C_DRIVER_FAULT 10 /* EXTI10 */
#define PIN_C_REACHED 11      /* EXTI11; LOW: active */

/* Supply: 100 kΩ to the rig's supply, 10 kΩ to ground, 100 nF across these; 4095 is 3.3 V at the pin. */
#define SUPPLY_DIVIDER 11
#define SUPPLY_REFERENCE_MV 3300

/* Interrupt priorities, 0 is the most urgent (NVIC, 4 bits: RM0090 rev 19, section 12.1; PM0214 section 4.4). lock()
 * holds off PRIORITY_CORE and everything below it: what stops the steps and what puts trigger edges out is never held
 * off, and neither calls the core. All of the core's interrupt entries have one priority and so never nest. */
#define PRIORITY_ESTOP 0 /* EXTI0: stops TIM2 in hardware, then asks PendSV to tell the core; PVD */
#define PRIORITY_EDGE 1  /* TIM5: trigger edges to the tick, wrap of the clock; PendSV tells the core */
#define PRIORITY_CORE 2  /* TIM2, TIM3, EXTI1–4, EXTI15_10, PendSV: everything that calls core_on_… */
#define PRIORITY_LINK 3  /* USART2, DMA1 stream 6, OTG_FS */
#define PRIORITY_TICK 15 /* SysTick, 1 kHz: ends sleep */

/* Flash: the image in sectors 0 … 4 (16, 16, 16, 16, 64 KiB), a profile copy each in the first 16 KiB of sectors 5 and
 * 6 (128 KiB): an update never touches them, and they lie in the 512 KiB parts too (RM0090, section 3.3, table 5). */
#define FLASH_IMAGE_ADDRESS 0x08000000u
#define FLASH_IMAGE_SIZE 0x00020000u
#define FLASH_PROFILE_SECTOR0 5
#define FLASH_PROFILE_ADDRESS0 0x08020000u
#define FLASH_PROFILE_STRIDE 0x00020000u

#endif
