/* Inside the port: what its files know of each other. */
#ifndef LUMI_FIRMWARE_STM32F405_PORT_H
#define LUMI_FIRMWARE_STM32F405_PORT_H

#include "firmware/board/board.h"
#include "firmware/stm32f405/pins.h"
#include "proto/wire/transport.h"

/* QEMU's netduinoplus2 lacks what its variant of the image leaves out: a PLL that gets ready, DMA, a watchdog,
 * the USB core, a noise source, a unique ID; and its timers run at 1 GHz. Nothing else differs. */
#ifdef LUMI_BOARD_QEMU
#define ON_QEMU 1
#define BOARD_NAME "netduinoplus2"
#else
#define ON_QEMU 0
#define BOARD_NAME "stm32f405"
#endif

struct core;

/* startup.c */
/* Steps and triggers stop, nothing else goes on; the watchdog starts the chip again. Does not return. */
void panic(void) __attribute__((noreturn));
uint32_t boot_count(void); /* starts since power came, as far as RAM remembers; otherwise anything */
void loader_request(void); /* the next reset goes to the chip's loader */

/* f405_clock.c */
void clock_init(void);

/* f405_pins.c */
void pins_init(void);
void pin_output(enum board_output output, bool active);
bool pin_input(enum board_input input);
bool pin_feedback(int input);
void interrupt_enable(unsigned irq, unsigned priority);

/* f405_time.c: TIM5 as the clock, trigger edges on its channel 1 */
void time_init(void);
uint64_t time_now(void);
/* What another timer's counter was, and when: TIM5's readings before and after it are a few ticks apart, and their
 * middle is right to a tick. With interrupts off. */
uint64_t time_of_count(uint32_t timer, uint32_t *count);
void trigger_at(uint64_t at, uint16_t lines);
void trigger_cancel(void);
void trigger_lines(uint16_t lines);
bool trigger_fired(uint64_t *at); /* once for every edge; at PRIORITY_CORE */

/* f405_steps.c: TIM2 */
void steps_init(void);
void steps_start(uint64_t at, bool forward, uint32_t first);
void steps_stop(void);
void steps_pulse_width(uint32_t ticks);
void steps_emergency_stop(void); /* hardware only, from any priority; until steps_allow none is started */
void steps_allow(void);

/* f405_inputs.c: switches by EXTI, feedbacks by TIM3 */
void inputs_init(void);

/* f405_serial.c: USART2 */
void serial_init(void);
size_t serial_read(uint8_t *data, size_t size);
size_t serial_write(const uint8_t *data, size_t size);

/* usb_link.c */
void usb_init(void);
size_t usb_read(uint8_t *data, size_t size);
size_t usb_write(const uint8_t *data, size_t size);
bool usb_up(void);

/* f405_flash.c */
bool flash_erase_slot(int slot);
bool flash_write_slot(int slot, uint32_t offset, const void *data, size_t size);
const uint8_t *flash_slot(int slot);

/* f405_system.c */
void system_init(void);
void watchdog_kick(void);
enum board_reset system_reset_cause(void);
int system_supply_mv(void);
uint32_t system_boot_number(void);
void system_unique_id(uint8_t id[BOARD_UNIQUE_ID]);
void system_restart(void) __attribute__((noreturn));
void system_enter_loader(void) __attribute__((noreturn));

/* port.c */
extern struct core *const the_core;

/* Interrupts; what each is for stands with its priority in pins.h. */
void PendSV_Handler(void);
void SysTick_Handler(void);
void PVD_Handler(void);
void EXTI0_Handler(void);
void EXTI1_Handler(void);
void EXTI2_Handler(void);
void EXTI3_Handler(void);
void EXTI4_Handler(void);
void EXTI15_10_Handler(void);
void DMA1_Stream6_Handler(void);
void TIM2_Handler(void);
void TIM3_Handler(void);
void TIM5_Handler(void);
void USART2_Handler(void);
void OTG_FS_Handler(void);

#endif
