/* The serial link: USART2 with DMA both ways (RM0090 sections 30.3.13 and 10.3; table 42: USART2_RX is DMA1 stream 5
 * channel 4, USART2_TX stream 6 channel 4).
 *
 * 1. Receiving goes round in `in` for ever; how far it has come is read from the stream's counter. A host that sends
 *    more than a ring before the main loop reads loses bytes, which the frames' checksum finds.
 * 2. Sending takes what lies in one piece in the ring `out`; its end starts the next piece. The main loop moves `head`,
 *    the interrupt `tail`.
 * 3. RS-485: the driver is enabled from the first byte until the last stop bit is out (TC). */
#include "firmware/stm32f405/cortex.h"
#include "firmware/stm32f405/f405_registers.h"
#include "firmware/stm32f405/port.h"

#include <string.h>

#define UART USART2_BASE
#define RX 5
#define TX 6
#define CHANNEL DMA_SCR_CHSEL(4)
#define IN_SIZE 1024u
#define OUT_SIZE 2048u /* powers of 2 */

static uint8_t in[IN_SIZE], out[OUT_SIZE];
static struct {
    uint32_t in_tail;
    volatile uint32_t in_head; /* QEMU only: elsewhere the DMA's counter is it */
    volatile uint32_t head, tail, sending;
} serial;

/* QEMU has no DMA: there each byte's interrupt does what stream 5 does, and sending takes no time. */
#define CR1_BASE (USART_CR1_UE | USART_CR1_TE | USART_CR1_RE | (ON_QEMU ? USART_CR1_RXNEIE : USART_CR1_IDLEIE))

void serial_init(void)
{
    /* Section 30.3.4: with 16 samples a bit, BRR is the clock divided by the rate. 42 MHz / 365 = 115,068: −0.11 %. */
    USART_BRR(UART) = (CLOCK_APB1 + LUMI_WIRE_SERIAL_BAUD / 2) / LUMI_WIRE_SERIAL_BAUD;
    USART_CR3(UART) = ON_QEMU ? 0 : USART_CR3_DMAR | USART_CR3_DMAT;
    USART_CR1(UART) = CR1_BASE;

    if (!ON_QEMU) {
        DMA_HIFCR(DMA1_BASE) = DMA_HIFCR_STREAM5 | DMA_HIFCR_STREAM6;
        DMA_SPAR(DMA1_BASE, RX) = UART + 0x04;
        DMA_SM0AR(DMA1_BASE, RX) = (uint32_t)(uintptr_t)in;
        DMA_SNDTR(DMA1_BASE, RX) = IN_SIZE;
        DMA_SCR(DMA1_BASE, RX) = CHANNEL | DMA_SCR_MINC | DMA_SCR_CIRC;
        DMA_SCR(DMA1_BASE, RX) = CHANNEL | DMA_SCR_MINC | DMA_SCR_CIRC | DMA_SCR_EN;
        DMA_SPAR(DMA1_BASE, TX) = UART + 0x04;
        interrupt_enable(IRQ_DMA1_STREAM6, PRIORITY_LINK);
    }
    interrupt_enable(IRQ_USART2, PRIORITY_LINK);
}

size_t serial_read(uint8_t *data, size_t size)
{
    const uint32_t head = ON_QEMU ? serial.in_head : IN_SIZE - DMA_SNDTR(DMA1_BASE, RX);
    size_t count = 0;

    while (count < size && serial.in_tail != head % IN_SIZE) {
        data[count++] = in[serial.in_tail];
        serial.in_tail = (serial.in_tail + 1) % IN_SIZE;
    }
    return count;
}

/* With the link's interrupts held off, or from them. */
static void send_next(void)
{
    const uint32_t from = serial.tail % OUT_SIZE, used = serial.head - serial.tail;

    serial.sending = used < OUT_SIZE - from ? used : OUT_SIZE - from;
    if (serial.sending == 0)
        return;
    GPIO_BSRR(GPIOA_BASE) = 1u << PIN_A_RS485;
    USART_CR1(UART) = CR1_BASE;
    USART_SR(UART) = ~USART_SR_TC;
    DMA_HIFCR(DMA1_BASE) = DMA_HIFCR_STREAM6;
    DMA_SM0AR(DMA1_BASE, TX) = (uint32_t)(uintptr_t)(out + from);
    DMA_SNDTR(DMA1_BASE, TX) = serial.sending;
    DMA_SCR(DMA1_BASE, TX) = CHANNEL | DMA_SCR_MINC | DMA_SCR_DIR_TO_PERIPHERAL | DMA_SCR_TCIE;
    DMA_SCR(DMA1_BASE, TX) = CHANNEL | DMA_SCR_MINC | DMA_SCR_DIR_TO_PERIPHERAL | DMA_SCR_TCIE | DMA_SCR_EN;
}

size_t serial_write(const uint8_t *data, size_t size)
{
    const uint32_t from = serial.head % OUT_SIZE;
    const size_t piece = size < OUT_SIZE - from ? size : OUT_SIZE - from;

    if (ON_QEMU) {
        for (size_t i = 0; i < size; i++)
            USART_DR(UART) = data[i];
        return size;
    }
    if (size > OUT_SIZE - (serial.head - serial.tail))
        return 0;
    memcpy(out + from, data, piece);
    memcpy(out, data + piece, size - piece);
    data_barrier();
    const uint32_t lock = basepri_raise(PRIORITY_LINK);
    serial.head += size;
    if (serial.sending == 0)
        send_next();
    basepri_restore(lock);
    return size;
}

void DMA1_Stream6_Handler(void)
{
    DMA_HIFCR(DMA1_BASE) = DMA_HIFCR_STREAM6;
    serial.tail += serial.sending;
    send_next();
    if (serial.sending == 0)
        USART_CR1(UART) = CR1_BASE | USART_CR1_TCIE;
}

void USART2_Handler(void)
{
    const uint32_t status = USART_SR(UART);

    if (ON_QEMU && (status & USART_SR_RXNE)) {
        in[serial.in_head] = (uint8_t)USART_DR(UART);
        serial.in_head = (serial.in_head + 1) % IN_SIZE;
    }
    /* Section 30.6.1: IDLE is cleared by reading SR and then DR. It only ends the main loop's sleep. */
    if (!ON_QEMU && (status & USART_SR_IDLE))
        (void)USART_DR(UART);
    if ((status & USART_SR_TC) && (USART_CR1(UART) & USART_CR1_TCIE)) {
        USART_CR1(UART) = CR1_BASE;
        GPIO_BSRR(GPIOA_BASE) = 1u << (PIN_A_RS485 + 16);
    }
}
