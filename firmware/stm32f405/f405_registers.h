/* Registers of the STM32F405 and of its Cortex-M4, by the names of their manuals: RM0090 (STM32F405/407 reference
 * manual, rev 19), PM0214 (Cortex-M4 programming manual, rev 10), ARM DDI0403 (ARMv7-M). Only what the port uses. Bits
 * are masks; registers are written whole. The USB core's are in usb_registers.h. */
#ifndef LUMI_FIRMWARE_STM32F405_F405_REGISTERS_H
#define LUMI_FIRMWARE_STM32F405_F405_REGISTERS_H

#include <stdint.h>

#define REG32(address) (*(volatile uint32_t *)(uintptr_t)(address))

/* RM0090 section 2.3, table 1: where the peripherals are. */
#define TIM2_BASE 0x40000000u
#define TIM3_BASE 0x40000400u
#define TIM5_BASE 0x40000c00u
#define IWDG_BASE 0x40003000u
#define USART2_BASE 0x40004400u
#define PWR_BASE 0x40007000u
#define ADC1_BASE 0x40012000u
#define ADC_COMMON_BASE 0x40012300u
#define SYSCFG_BASE 0x40013800u
#define EXTI_BASE 0x40013c00u
#define GPIOA_BASE 0x40020000u
#define GPIOB_BASE 0x40020400u
#define GPIOC_BASE 0x40020800u
#define RCC_BASE 0x40023800u
#define FLASH_BASE 0x40023c00u
#define DMA1_BASE 0x40026000u
#define RNG_BASE 0x50060800u

/* PWR, section 5.4.1 */
#define PWR_CR REG32(PWR_BASE + 0x00)
#define PWR_CR_PVDE (1u << 4)
#define PWR_CR_PLS_2V8 (6u << 5)
#define PWR_CR_VOS (1u << 14) /* scale 1, for 168 MHz */

/* RCC, section 7.3 */
#define RCC_CR REG32(RCC_BASE + 0x00)
#define RCC_CR_HSION (1u << 0)
#define RCC_CR_HSITRIM_DEFAULT (16u << 3)
#define RCC_CR_HSEON (1u << 16)
#define RCC_CR_HSERDY (1u << 17)
#define RCC_CR_CSSON (1u << 19)
#define RCC_CR_PLLON (1u << 24)
#define RCC_CR_PLLRDY (1u << 25)
#define RCC_PLLCFGR REG32(RCC_BASE + 0x04)
#define RCC_PLLCFGR_PLLM(m) ((uint32_t)(m) << 0)
#define RCC_PLLCFGR_PLLN(n) ((uint32_t)(n) << 6)
#define RCC_PLLCFGR_PLLP_2 (0u << 16)
#define RCC_PLLCFGR_PLLSRC_HSE (1u << 22)
#define RCC_PLLCFGR_PLLQ(q) ((uint32_t)(q) << 24)
#define RCC_CFGR REG32(RCC_BASE + 0x08)
#define RCC_CFGR_SW_PLL (2u << 0)
#define RCC_CFGR_SWS (3u << 2)
#define RCC_CFGR_SWS_PLL (2u << 2)
#define RCC_CFGR_HPRE_1 (0u << 4)
#define RCC_CFGR_PPRE1_4 (5u << 10)
#define RCC_CFGR_PPRE2_2 (4u << 13)
#define RCC_CIR REG32(RCC_BASE + 0x0c)
#define RCC_CIR_CSSF (1u << 7)
#define RCC_CIR_CSSC (1u << 23)
#define RCC_AHB1ENR REG32(RCC_BASE + 0x30)
#define RCC_AHB1ENR_GPIOAEN (1u << 0)
#define RCC_AHB1ENR_GPIOBEN (1u << 1)
#define RCC_AHB1ENR_GPIOCEN (1u << 2)
#define RCC_AHB1ENR_CCMDATARAMEN (1u << 20) /* set after reset */
#define RCC_AHB1ENR_DMA1EN (1u << 21)
#define RCC_AHB2ENR REG32(RCC_BASE + 0x34)
#define RCC_AHB2ENR_RNGEN (1u << 6)
#define RCC_AHB2ENR_OTGFSEN (1u << 7)
#define RCC_APB1ENR REG32(RCC_BASE + 0x40)
#define RCC_APB1ENR_TIM2EN (1u << 0)
#define RCC_APB1ENR_TIM3EN (1u << 1)
#define RCC_APB1ENR_TIM5EN (1u << 3)
#define RCC_APB1ENR_USART2EN (1u << 17)
#define RCC_APB1ENR_PWREN (1u << 28)
#define RCC_APB2ENR REG32(RCC_BASE + 0x44)
#define RCC_APB2ENR_ADC1EN (1u << 8)
#define RCC_APB2ENR_SYSCFGEN (1u << 14)
#define RCC_CSR REG32(RCC_BASE + 0x74)
#define RCC_CSR_RMVF (1u << 24)
#define RCC_CSR_BORRSTF (1u << 25)
#define RCC_CSR_PINRSTF (1u << 26)
#define RCC_CSR_PORRSTF (1u << 27)
#define RCC_CSR_SFTRSTF (1u << 28)
#define RCC_CSR_IWDGRSTF (1u << 29)
#define RCC_CSR_WWDGRSTF (1u << 30)

/* Flash interface, section 3.9 */
#define FLASH_ACR REG32(FLASH_BASE + 0x00)
#define FLASH_ACR_LATENCY(states) ((uint32_t)(states) << 0)
#define FLASH_ACR_PRFTEN (1u << 8)
#define FLASH_ACR_ICEN (1u << 9)
#define FLASH_ACR_DCEN (1u << 10)
#define FLASH_ACR_DCRST (1u << 12)
#define FLASH_KEYR REG32(FLASH_BASE + 0x04)
#define FLASH_KEYR_KEY1 0x45670123u
#define FLASH_KEYR_KEY2 0xcdef89abu
#define FLASH_SR REG32(FLASH_BASE + 0x0c)
#define FLASH_SR_EOP (1u << 0)
#define FLASH_SR_OPERR (1u << 1)
#define FLASH_SR_WRPERR (1u << 4)
#define FLASH_SR_PGAERR (1u << 5)
#define FLASH_SR_PGPERR (1u << 6)
#define FLASH_SR_PGSERR (1u << 7)
#define FLASH_SR_BSY (1u << 16)
#define FLASH_CR REG32(FLASH_BASE + 0x10)
#define FLASH_CR_PG (1u << 0)
#define FLASH_CR_SER (1u << 1)
#define FLASH_CR_SNB(sector) ((uint32_t)(sector) << 3)
#define FLASH_CR_PSIZE_32 (2u << 8)
#define FLASH_CR_STRT (1u << 16)
#define FLASH_CR_LOCK (1u << 31)

/* GPIO, section 8.4; two or four bits a pin */
#define GPIO_MODER(base) REG32((base) + 0x00)
#define GPIO_MODER_INPUT 0u
#define GPIO_MODER_OUTPUT 1u
#define GPIO_MODER_ALTERNATE 2u
#define GPIO_MODER_ANALOG 3u
#define GPIO_OTYPER(base) REG32((base) + 0x04)
#define GPIO_OSPEEDR(base) REG32((base) + 0x08)
#define GPIO_OSPEEDR_LOW 0u
#define GPIO_OSPEEDR_MEDIUM 1u
#define GPIO_OSPEEDR_VERY_HIGH 3u
#define GPIO_PUPDR(base) REG32((base) + 0x0c)
#define GPIO_PUPDR_UP 1u
#define GPIO_PUPDR_DOWN 2u
#define GPIO_IDR(base) REG32((base) + 0x10)
#define GPIO_BSRR(base) REG32((base) + 0x18)
#define GPIO_AFRL(base) REG32((base) + 0x20)
#define GPIO_AFRH(base) REG32((base) + 0x24)

/* SYSCFG, section 9.2 */
#define SYSCFG_MEMRMP REG32(SYSCFG_BASE + 0x00)
#define SYSCFG_MEMRMP_SYSTEM 1u
#define SYSCFG_EXTICR(n) REG32(SYSCFG_BASE + 0x08 + 4u * (n)) /* n = 0 … 3: EXTICR1 … 4 */
#define SYSCFG_EXTICR_PC 2u

/* EXTI, section 12.3 */
#define EXTI_IMR REG32(EXTI_BASE + 0x00)
#define EXTI_RTSR REG32(EXTI_BASE + 0x08)
#define EXTI_FTSR REG32(EXTI_BASE + 0x0c)
#define EXTI_PR REG32(EXTI_BASE + 0x14)
#define EXTI_LINE_PVD 16

/* TIM2 … TIM5, section 18.4 */
#define TIM_CR1(base) REG32((base) + 0x00)
#define TIM_CR1_CEN (1u << 0)
#define TIM_CR1_URS (1u << 2)
#define TIM_CR1_OPM (1u << 3)
#define TIM_CR1_ARPE (1u << 7)
#define TIM_DIER(base) REG32((base) + 0x0c)
#define TIM_DIER_UIE (1u << 0)
#define TIM_DIER_CCIE(channel) (1u << (channel)) /* channel 1 … 4 */
#define TIM_SR(base) REG32((base) + 0x10)
#define TIM_SR_UIF (1u << 0)
#define TIM_SR_CCIF(channel) (1u << (channel))
#define TIM_SR_CCOF(channel) (1u << (8 + (channel)))
#define TIM_EGR(base) REG32((base) + 0x14)
#define TIM_EGR_UG (1u << 0)
#define TIM_EGR_CCG(channel) (1u << (channel))
#define TIM_CCMR1(base) REG32((base) + 0x18)
#define TIM_CCMR2(base) REG32((base) + 0x1c)
#define TIM_CCMR1_OC1PE (1u << 3)
#define TIM_CCMR1_OC1M_PWM1 (6u << 4)
#define TIM_CCMR_CAPTURE_BOTH 0x0101u /* CCxS = 01 for both channels of the register: ICx on TIx, no filter */
#define TIM_CCMR_FILTER_BOTH 0x3030u  /* ICxF = 3: 8 samples at the timer's clock, 95 ns */
#define TIM_CCER(base) REG32((base) + 0x20)
#define TIM_CCER_CC1E (1u << 0)
#define TIM_CCER_CAPTURE_ALL 0xbbbbu /* CCxE, CCxP and CCxNP of all four: both edges */
#define TIM_CNT(base) REG32((base) + 0x24)
#define TIM_PSC(base) REG32((base) + 0x28)
#define TIM_ARR(base) REG32((base) + 0x2c)
#define TIM_CCR(base, channel) REG32((base) + 0x30 + 4u * (channel)) /* channel 1 … 4 */

/* IWDG, section 21.4 */
#define IWDG_KR REG32(IWDG_BASE + 0x00)
#define IWDG_KR_RELOAD 0xaaaau
#define IWDG_KR_UNLOCK 0x5555u
#define IWDG_KR_START 0xccccu
#define IWDG_PR REG32(IWDG_BASE + 0x04)
#define IWDG_PR_32 3u
#define IWDG_RLR REG32(IWDG_BASE + 0x08)
#define IWDG_SR REG32(IWDG_BASE + 0x0c)
#define IWDG_SR_PVU (1u << 0)
#define IWDG_SR_RVU (1u << 1)

/* USART, section 30.6 */
#define USART_SR(base) REG32((base) + 0x00)
#define USART_SR_IDLE (1u << 4)
#define USART_SR_RXNE (1u << 5)
#define USART_SR_TC (1u << 6)
#define USART_SR_TXE (1u << 7)
#define USART_DR(base) REG32((base) + 0x04)
#define USART_BRR(base) REG32((base) + 0x08)
#define USART_CR1(base) REG32((base) + 0x0c)
#define USART_CR1_RE (1u << 2)
#define USART_CR1_TE (1u << 3)
#define USART_CR1_IDLEIE (1u << 4)
#define USART_CR1_RXNEIE (1u << 5)
#define USART_CR1_TCIE (1u << 6)
#define USART_CR1_UE (1u << 13)
#define USART_CR3(base) REG32((base) + 0x14)
#define USART_CR3_DMAR (1u << 6)
#define USART_CR3_DMAT (1u << 7)

/* DMA, section 10.5; stream 0 … 7 */
#define DMA_HIFCR(base) REG32((base) + 0x0c)
#define DMA_HISR(base) REG32((base) + 0x04)
#define DMA_HIFCR_STREAM5 (0x3du << 6)
#define DMA_HIFCR_STREAM6 (0x3du << 16)
#define DMA_HISR_TCIF6 (1u << 21)
#define DMA_SCR(base, stream) REG32((base) + 0x10 + 0x18u * (stream))
#define DMA_SNDTR(base, stream) REG32((base) + 0x14 + 0x18u * (stream))
#define DMA_SPAR(base, stream) REG32((base) + 0x18 + 0x18u * (stream))
#define DMA_SM0AR(base, stream) REG32((base) + 0x1c + 0x18u * (stream))
#define DMA_SCR_EN (1u << 0)
#define DMA_SCR_TCIE (1u << 4)
#define DMA_SCR_DIR_TO_PERIPHERAL (1u << 6)
#define DMA_SCR_CIRC (1u << 8)
#define DMA_SCR_MINC (1u << 10)
#define DMA_SCR_CHSEL(channel) ((uint32_t)(channel) << 25)

/* ADC, section 13.13 */
#define ADC_SR(base) REG32((base) + 0x00)
#define ADC_CR1(base) REG32((base) + 0x04)
#define ADC_CR2(base) REG32((base) + 0x08)
#define ADC_CR2_ADON (1u << 0)
#define ADC_CR2_CONT (1u << 1)
#define ADC_CR2_SWSTART (1u << 30)
#define ADC_SMPR2(base) REG32((base) + 0x10)
#define ADC_SMPR2_480(channel) (7u << (3u * (channel)))
#define ADC_SQR1(base) REG32((base) + 0x2c)
#define ADC_SQR3(base) REG32((base) + 0x34)
#define ADC_DR(base) REG32((base) + 0x4c)
#define ADC_CCR REG32(ADC_COMMON_BASE + 0x04)
#define ADC_CCR_ADCPRE_4 (1u << 16)

/* RNG, section 24.4 */
#define RNG_CR REG32(RNG_BASE + 0x00)
#define RNG_CR_RNGEN (1u << 2)
#define RNG_SR REG32(RNG_BASE + 0x04)
#define RNG_SR_DRDY (1u << 0)
#define RNG_SR_CECS (1u << 1)
#define RNG_SR_SECS (1u << 2)
#define RNG_DR REG32(RNG_BASE + 0x08)

/* Section 39.1: 96 bits; section 2.4, table 2: the loader in system memory. */
#define UNIQUE_ID_ADDRESS 0x1fff7a10u
#define SYSTEM_MEMORY 0x1fff0000u

/* Cortex-M4: SysTick, NVIC, system control block; ARM DDI0403 sections B3.3, B3.4, B3.2 */
#define STK_CTRL REG32(0xe000e010u)
#define STK_CTRL_ENABLE (1u << 0)
#define STK_CTRL_TICKINT (1u << 1)
#define STK_CTRL_CLKSOURCE (1u << 2)
#define STK_LOAD REG32(0xe000e014u)
#define STK_VAL REG32(0xe000e018u)
#define NVIC_ISER(n) REG32(0xe000e100u + 4u * (n))
#define NVIC_IPR_BYTE(irq) (*(volatile uint8_t *)(uintptr_t)(0xe000e400u + (irq)))
#define SCB_ICSR REG32(0xe000ed04u)
#define SCB_ICSR_PENDSVSET (1u << 28)
#define SCB_VTOR REG32(0xe000ed08u)
#define SCB_AIRCR REG32(0xe000ed0cu)
#define SCB_AIRCR_RESET 0x05fa0004u /* VECTKEY, SYSRESETREQ */
#define SCB_SHPR_BYTE(exception) (*(volatile uint8_t *)(uintptr_t)(0xe000ed14u + (exception)))
#define EXCEPTION_PENDSV 14
#define EXCEPTION_SYSTICK 15

/* RM0090 section 12.2, table 62: positions of the interrupts */
#define IRQ_PVD 1
#define IRQ_EXTI0 6
#define IRQ_EXTI1 7
#define IRQ_EXTI2 8
#define IRQ_EXTI3 9
#define IRQ_EXTI4 10
#define IRQ_DMA1_STREAM6 17
#define IRQ_TIM2 28
#define IRQ_TIM3 29
#define IRQ_USART2 38
#define IRQ_EXTI15_10 40
#define IRQ_TIM5 50
#define IRQ_OTG_FS 67
#define IRQ_COUNT 82

#endif
