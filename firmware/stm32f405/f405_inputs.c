/* Switches, stamped and told to the core by EXTI; feedback edges, stamped by TIM3's captures. RM0090 sections 12.2.5,
 * 9.2.3 and 18.3.5. */
#include "firmware/core/core.h"
#include "firmware/stm32f405/cortex.h"
#include "firmware/stm32f405/f405_registers.h"
#include "firmware/stm32f405/port.h"

#define LINES_OWN (1u << PIN_C_INDEX | 1u << PIN_C_SLACK | 1u << PIN_C_STRING_END | 1u << PIN_C_WOUND)
#define LINES_SHARED (1u << PIN_C_DRIVER_FAULT | 1u << PIN_C_REACHED)
#define LINES (1u << PIN_C_ESTOP | LINES_OWN | LINES_SHARED)

static struct {
    volatile bool estop_edge, estop_pressed; /* since PendSV last took them */
    volatile uint64_t estop_at;
    uint32_t feedback; /* bit a feedback: what the core was last told */
} inputs;

void inputs_init(void)
{
    SYSCFG_EXTICR(0) = SYSCFG_EXTICR_PC * 0x1111u;                     /* EXTI0 … 3 */
    SYSCFG_EXTICR(1) = SYSCFG_EXTICR_PC;                               /* EXTI4 */
    SYSCFG_EXTICR(2) = SYSCFG_EXTICR_PC << 8 | SYSCFG_EXTICR_PC << 12; /* EXTI10, 11 */
    EXTI_RTSR = LINES | 1u << EXTI_LINE_PVD;
    EXTI_FTSR = LINES;
    EXTI_PR = LINES | 1u << EXTI_LINE_PVD;
    EXTI_IMR = LINES | 1u << EXTI_LINE_PVD;
    SCB_SHPR_BYTE(EXCEPTION_PENDSV - 4) = PRIORITY_CORE << 4;
    interrupt_enable(IRQ_EXTI0, PRIORITY_ESTOP);
    interrupt_enable(IRQ_PVD, PRIORITY_ESTOP);
    for (unsigned irq = IRQ_EXTI1; irq <= IRQ_EXTI4; irq++)
        interrupt_enable(irq, PRIORITY_CORE);
    interrupt_enable(IRQ_EXTI15_10, PRIORITY_CORE);

    TIM_PSC(TIM3_BASE) = 0;
    TIM_ARR(TIM3_BASE) = 0xffff;
    TIM_CR1(TIM3_BASE) = TIM_CR1_URS;
    TIM_EGR(TIM3_BASE) = TIM_EGR_UG;
    TIM_CCMR1(TIM3_BASE) = TIM_CCMR_CAPTURE_BOTH | TIM_CCMR_FILTER_BOTH;
    TIM_CCMR2(TIM3_BASE) = TIM_CCMR_CAPTURE_BOTH | TIM_CCMR_FILTER_BOTH;
    TIM_CCER(TIM3_BASE) = TIM_CCER_CAPTURE_ALL;
    TIM_SR(TIM3_BASE) = 0;
    TIM_DIER(TIM3_BASE) = TIM_DIER_CCIE(1) | TIM_DIER_CCIE(2) | TIM_DIER_CCIE(3) | TIM_DIER_CCIE(4);
    TIM_CR1(TIM3_BASE) = TIM_CR1_URS | TIM_CR1_CEN;
    for (int i = 0; i < 4; i++)
        inputs.feedback |= (uint32_t)pin_feedback(i) << i;
    interrupt_enable(IRQ_TIM3, PRIORITY_CORE);
}

/* The chip's own supply sinks: below 2.7 V five wait states are too few (RM0090 section 3.5.1, table 10), and what is
 * fetched may be anything. */
void PVD_Handler(void)
{
    panic();
}

/* Above all others and above every lock. A press stops the steps here and now; the core hears of it, and of a release,
 * from PendSV. */
void EXTI0_Handler(void)
{
    EXTI_PR = 1u << PIN_C_ESTOP;
    if (pin_input(BOARD_IN_ESTOP)) {
        steps_emergency_stop();
        inputs.estop_pressed = true;
    }
    if (!inputs.estop_edge) {
        inputs.estop_at = time_now();
        inputs.estop_edge = true;
    }
    SCB_ICSR = SCB_ICSR_PENDSVSET;
}

/* A press is told even if the pin is back already: the steps have stopped. They may start again when the core knows of
 * every press there was. */
static void tell_estop(void)
{
    uint32_t primask = irq_disable();
    const bool pressed = inputs.estop_pressed;
    const uint64_t at = inputs.estop_at;
    inputs.estop_edge = inputs.estop_pressed = false;
    irq_restore(primask);

    if (pressed)
        core_on_input(the_core, BOARD_IN_ESTOP, true, at);
    if (!pin_input(BOARD_IN_ESTOP))
        core_on_input(the_core, BOARD_IN_ESTOP, false, time_now());

    primask = irq_disable();
    if (!inputs.estop_edge)
        steps_allow();
    irq_restore(primask);
}

/* What the handlers above PRIORITY_CORE leave for the core. */
void PendSV_Handler(void)
{
    uint64_t at;

    if (inputs.estop_edge)
        tell_estop();
    if (trigger_fired(&at))
        core_on_trigger(the_core, at);
}

static void tell_input(enum board_input input, unsigned pin)
{
    EXTI_PR = 1u << pin;
    core_on_input(the_core, input, pin_input(input), time_now());
}

void EXTI1_Handler(void)
{
    tell_input(BOARD_IN_INDEX, PIN_C_INDEX);
}

void EXTI2_Handler(void)
{
    tell_input(BOARD_IN_SLACK, PIN_C_SLACK);
}

void EXTI3_Handler(void)
{
    tell_input(BOARD_IN_STRING_END, PIN_C_STRING_END);
}

void EXTI4_Handler(void)
{
    tell_input(BOARD_IN_WOUND, PIN_C_WOUND);
}

void EXTI15_10_Handler(void)
{
    const uint32_t pending = EXTI_PR;

    if (pending & 1u << PIN_C_DRIVER_FAULT)
        tell_input(BOARD_IN_DRIVER_FAULT, PIN_C_DRIVER_FAULT);
    if (pending & 1u << PIN_C_REACHED)
        tell_input(BOARD_IN_REACHED, PIN_C_REACHED);
}

/* TIM3 has 16 bits (780 µs) and the clock's rate: how long ago the edge was is the difference of its counter and the
 * capture, as long as this handler is not held off for longer. */
static void tell_feedback(int input)
{
    uint32_t count;
    const uint32_t primask = irq_disable();
    const uint64_t now = time_of_count(TIM3_BASE, &count);
    irq_restore(primask);
    const uint64_t at = now - (uint16_t)(count - TIM_CCR(TIM3_BASE, 1 + input)); /* reading clears CCxIF */
    const bool active = pin_feedback(input);

    /* Level as before: there were two edges in between, of which the capture has the later (over-capture) or, if the
     * second came only just now, the first; a pulse so short has one time. */
    if (active == (inputs.feedback >> input & 1))
        core_on_feedback(the_core, input, !active, at);
    core_on_feedback(the_core, input, active, at);
    inputs.feedback = (inputs.feedback & ~(1u << input)) | (uint32_t)active << input;
}

void TIM3_Handler(void)
{
    const uint32_t status = TIM_SR(TIM3_BASE);

    TIM_SR(TIM3_BASE) = ~(status & (TIM_SR_CCOF(1) | TIM_SR_CCOF(2) | TIM_SR_CCOF(3) | TIM_SR_CCOF(4)));
    for (int i = 0; i < 4; i++)
        if (status & TIM_SR_CCIF(1 + i))
            tell_feedback(i);
}
