/* The clock and the trigger edges: TIM5, 32 bits at 84 MHz, never stopped (RM0090 section 18.3).
 *
 * 1. `high` counts the wraps. It lags the hardware while the wrap's interrupt is pending; readers add what is missing.
 * 2. An edge is put out by spinning: the compare interrupt comes EDGE_LEAD ticks early, waits for the tick, and writes
 *    BSRR once. It has PRIORITY_EDGE, above everything the core locks, so only the e-stop's few instructions can be in
 *    its way. The loop reads the counter about every 12 cycles (an access to APB1 among them), so the edge comes 0 to 6
 *    ticks after its own and a constant 2 or 3 for the write: within 0.11 µs.
 * 3. The core learns of the edge from PendSV. */
#include "firmware/stm32f405/cortex.h"
#include "firmware/stm32f405/f405_registers.h"
#include "firmware/stm32f405/port.h"

#define TIM TIM5_BASE
/* Entry into the interrupt is 12 cycles, and the e-stop's may be before it: 2.4 µs are ample. */
#define EDGE_LEAD 200u
#define QUIET TIM_DIER_UIE
#define ARMED (TIM_DIER_UIE | TIM_DIER_CCIE(1))

static volatile uint32_t high;
static struct {
    volatile uint64_t at;
    volatile uint32_t lines; /* as BSRR takes them */
    volatile bool armed, fired;
    volatile uint64_t fired_at;
} edge;

void time_init(void)
{
    TIM_PSC(TIM) = ON_QEMU ? 11 : 0; /* there: 1 GHz / 12 = 83.3 MHz */
    TIM_ARR(TIM) = 0xffffffffu;
    TIM_CR1(TIM) = TIM_CR1_URS;
    TIM_EGR(TIM) = TIM_EGR_UG;
    TIM_CCMR1(TIM) = 0; /* channel 1: compare without an output */
    TIM_SR(TIM) = 0;
    TIM_DIER(TIM) = QUIET;
    TIM_CR1(TIM) = TIM_CR1_URS | TIM_CR1_CEN;
    interrupt_enable(IRQ_TIM5, PRIORITY_EDGE);
}

uint64_t time_now(void)
{
    uint32_t wraps, low, pending;

    do {
        wraps = high;
        low = TIM_CNT(TIM);
        pending = TIM_SR(TIM) & TIM_SR_UIF;
    } while (wraps != high);
    /* Pending and low: it wrapped before `low` was read. Pending and high: after. */
    if (pending && low < 0x80000000u)
        wraps++;
    return (uint64_t)wraps << 32 | low;
}

uint64_t time_of_count(uint32_t timer, uint32_t *count)
{
    const uint32_t before = TIM_CNT(TIM);
    *count = TIM_CNT(timer);
    const uint32_t after = TIM_CNT(TIM);
    const uint64_t now = time_now();

    return now - ((uint32_t)now - before) + (after - before) / 2;
}

/* Status bits are cleared by writing 0, and 1 leaves them: section 18.4.5. */
static void count_wrap(void)
{
    const uint32_t primask = irq_disable(); /* nobody may read between the two */
    TIM_SR(TIM) = ~TIM_SR_UIF;
    high = high + 1;
    irq_restore(primask);
}

static void put_out(void)
{
    const uint32_t at = (uint32_t)edge.at, lines = edge.lines;
    uint32_t now;

    /* Signed, so that a tick that has passed is no wait at all. */
    do
        now = TIM_CNT(TIM);
    while ((int32_t)(now - at) < 0);
    GPIO_BSRR(GPIOB_BASE) = lines;
    const uint64_t then = time_now();
    edge.fired_at = then - ((uint32_t)then - now);
    TIM_DIER(TIM) = QUIET;
    edge.armed = false;
    edge.fired = true;
    SCB_ICSR = SCB_ICSR_PENDSVSET;
}

void TIM5_Handler(void)
{
    const uint32_t status = TIM_SR(TIM);

    if (status & TIM_SR_UIF)
        count_wrap();
    if (status & TIM_SR_CCIF(1)) {
        TIM_SR(TIM) = ~TIM_SR_CCIF(1);
        /* A match a whole turn of the counter (51 s) before its time: the next one may be it. */
        if (edge.armed && (int64_t)(edge.at - time_now()) <= (int64_t)(2 * EDGE_LEAD))
            put_out();
    }
}

static uint32_t port_lines(uint16_t lines)
{
    return (uint32_t)lines | (uint32_t)(uint16_t)~lines << 16;
}

void trigger_at(uint64_t at, uint16_t lines)
{
    TIM_DIER(TIM) = QUIET;
    edge.armed = false;
    edge.at = at;
    edge.lines = port_lines(lines);
    TIM_CCR(TIM, 1) = (uint32_t)at - EDGE_LEAD;
    TIM_SR(TIM) = ~TIM_SR_CCIF(1);
    edge.armed = true;
    TIM_DIER(TIM) = ARMED;
    /* Too near for the compare to match any more: ask for the interrupt (section 18.4.6). */
    if ((int64_t)(at - time_now()) <= (int64_t)EDGE_LEAD)
        TIM_EGR(TIM) = TIM_EGR_CCG(1);
}

void trigger_cancel(void)
{
    TIM_DIER(TIM) = QUIET;
    edge.armed = false;
}

void trigger_lines(uint16_t lines)
{
    GPIO_BSRR(GPIOB_BASE) = port_lines(lines);
}

bool trigger_fired(uint64_t *at)
{
    if (!edge.fired)
        return false;
    edge.fired = false;
    *at = edge.fired_at;
    return true;
}
