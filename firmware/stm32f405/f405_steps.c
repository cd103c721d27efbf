/* Step pulses: TIM2, 32 bits at 84 MHz, channel 1 in PWM mode 1 (RM0090 section 18.3.9): the output is high while
 * CNT < CCR1, so a pulse rises at the update event, when CNT becomes 0.
 *
 * 1. ARR and CCR1 are preloaded: what is written during one period holds from the next update on. The interrupt at the
 *    rise of pulse k writes the period from k + 1 to k + 2, and so has the whole period from k to k + 1 to do it.
 * 2. A waiting timer has CCR1 = 0 in force: no output. The update that raises pulse 0 brings the width.
 * 3. The last pulse's interrupt preloads CCR1 = 0 and sets one-pulse mode: the pulse falls by itself, and the update
 *    after it stops the timer without raising anything.
 * 4. The emergency stop has a priority of its own and may come between any two instructions here. It freezes the
 *    timer, notes whether a rise is still to be told to the core, and lets a pulse that is up fall by 3. Whatever
 *    it interrupts sets CEN only with interrupts off and only while `stopped` is false.
 * 5. An interrupt that comes a whole period late has missed a pulse, and the position would be wrong from there on
 *    without anybody knowing: that ends in panic. */
#include "firmware/core/core.h"
#include "firmware/stm32f405/cortex.h"
#include "firmware/stm32f405/f405_registers.h"
#include "firmware/stm32f405/port.h"

#define TIM TIM2_BASE
#define HALTED (TIM_CR1_URS) /* URS: UG by software raises no flag */
#define RUN_FREE (TIM_CR1_URS | TIM_CR1_CEN)
#define RUN (RUN_FREE | TIM_CR1_ARPE)
#define RUN_OUT (RUN | TIM_CR1_OPM)

#define LAP 0x40000000u     /* ticks (12.8 s): a start that is farther off waits in laps */
#define PERIOD_LAST 840000u /* after the last pulse, until the timer stops: 10 ms */
#define START_MIN 600u      /* ticks from steps_start to the earliest pulse: 7 µs */

static struct {
    uint64_t at;             /* of the next update */
    uint64_t wait;           /* ticks from the next update to pulse 0; 0: it is pulse 0 or a later one */
    uint32_t period;         /* from the next update to the one after; 0: the next pulse is the last */
    uint32_t first, width;   /* ticks */
    volatile bool stopped;   /* no update raises a pulse any more */
    volatile bool untold;    /* stopped, but the core does not know of the last rise yet */
    volatile bool pulsing;   /* pulse 0 has risen and been told */
    volatile bool emergency; /* nothing starts */
} steps;

void steps_init(void)
{
    steps.width = 420; /* 5 µs */
    steps.stopped = true;
    TIM_CR1(TIM) = HALTED;
    TIM_PSC(TIM) = ON_QEMU ? 11 : 0;
    TIM_ARR(TIM) = LAP - 1;
    TIM_CCMR1(TIM) = TIM_CCMR1_OC1M_PWM1 | TIM_CCMR1_OC1PE;
    TIM_EGR(TIM) = TIM_EGR_UG; /* CCR1 = 0 is in force */
    TIM_SR(TIM) = 0;
    TIM_CCER(TIM) = TIM_CCER_CC1E;
    TIM_DIER(TIM) = TIM_DIER_UIE;
    interrupt_enable(IRQ_TIM2, PRIORITY_CORE);
}

void steps_pulse_width(uint32_t ticks)
{
    steps.width = ticks;
}

void steps_allow(void)
{
    steps.emergency = false;
}

/* Preloads what begins with the next update. */
static void preload(void)
{
    if (steps.wait > 0) {
        const uint32_t lap = steps.wait > 2 * (uint64_t)LAP ? LAP : (uint32_t)steps.wait;
        TIM_CCR(TIM, 1) = 0;
        TIM_ARR(TIM) = lap - 1;
        steps.period = lap;
    } else {
        TIM_CCR(TIM, 1) = steps.width;
        TIM_ARR(TIM) = (steps.first ? steps.first : PERIOD_LAST) - 1;
        steps.period = steps.first;
    }
}

/* With interrupts off. The timer starts with nothing in force; when it passed 0 is read from both counters; then its
 * first period is set, which without ARPE holds at once. */
static void launch(uint64_t at)
{
    uint32_t count, first_lap;

    TIM_CR1(TIM) = RUN_FREE;
    const uint64_t zero = time_of_count(TIM, &count) - count;
    const uint64_t delay = at - zero;

    first_lap = delay > 2 * (uint64_t)LAP ? LAP : (uint32_t)delay;
    TIM_ARR(TIM) = first_lap - 1;
    TIM_CR1(TIM) = RUN;
    steps.at = zero + first_lap;
    steps.wait = at - steps.at;
    preload();
    steps.stopped = false;
}

void steps_start(uint64_t at, bool forward, uint32_t first)
{
    const uint32_t lock = basepri_raise(PRIORITY_CORE);

    /* The pulse before may not have fallen yet. */
    while ((TIM_CR1(TIM) & TIM_CR1_CEN) && steps.pulsing && TIM_CNT(TIM) < steps.width)
        ;
    const uint64_t earliest = time_now() + START_MIN;
    GPIO_BSRR(GPIOA_BASE) = forward ? 1u << PIN_A_DIR : 1u << (PIN_A_DIR + 16);
    TIM_CR1(TIM) = HALTED;
    TIM_CCR(TIM, 1) = 0;
    TIM_ARR(TIM) = LAP - 1;
    TIM_EGR(TIM) = TIM_EGR_UG; /* CNT = 0; both in force */
    TIM_SR(TIM) = 0;
    steps.first = first;
    steps.pulsing = false;
    steps.untold = false;

    const uint32_t primask = irq_disable();
    if (!steps.emergency && !pin_input(BOARD_IN_ESTOP))
        launch(at < earliest ? earliest : at);
    irq_restore(primask);
    basepri_restore(lock);
}

void steps_stop(void)
{
    const uint32_t primask = irq_disable();

    if (!steps.stopped) {
        TIM_CR1(TIM) = HALTED | TIM_CR1_ARPE;
        const bool updated = TIM_SR(TIM) & TIM_SR_UIF;
        const bool risen = updated && steps.wait == 0;
        steps.stopped = true;
        steps.untold = risen;
        TIM_CCR(TIM, 1) = 0;
        if ((steps.pulsing || risen) && TIM_CNT(TIM) < steps.width)
            TIM_CR1(TIM) = RUN_OUT;
    }
    irq_restore(primask);
}

void steps_emergency_stop(void)
{
    steps.emergency = true;
    steps_stop();
}

/* The pulse that has risen is the last. */
static void finish(void)
{
    const uint32_t primask = irq_disable();

    if (!steps.stopped) {
        TIM_CCR(TIM, 1) = 0;
        TIM_CR1(TIM) = RUN_OUT;
        steps.stopped = true;
    }
    irq_restore(primask);
}

void TIM2_Handler(void)
{
    const uint32_t primask = irq_disable();
    const bool updated = TIM_SR(TIM) & TIM_SR_UIF;
    const bool stopped = steps.stopped, told = stopped && !steps.untold;
    const uint32_t now = TIM_CNT(TIM5_BASE);
    TIM_SR(TIM) = ~TIM_SR_UIF;
    steps.untold = false;
    irq_restore(primask);

    if (!updated || told)
        return;
    const uint64_t at = steps.at;
    const uint32_t period = steps.period;
    if (!stopped && (int32_t)(now - (uint32_t)at) >= (int32_t)(period ? period : PERIOD_LAST))
        panic();
    if (steps.wait > 0) {
        steps.at = at + period;
        steps.wait -= period;
        preload();
        return;
    }
    steps.pulsing = true;
    if (period == 0)
        finish();
    const uint32_t next = core_on_step(the_core, at);
    if (period == 0)
        return;
    steps.at = at + period;
    steps.period = next;
    TIM_ARR(TIM) = (next ? next : PERIOD_LAST) - 1;
}
