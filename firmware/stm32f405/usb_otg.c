/* The OTG_FS core as a full-speed device (RM0090 section 34.17). No DMA: the processor moves words between FIFOs and
 * buffers. */
#include "firmware/stm32f405/port.h"
#include "firmware/stm32f405/usb_device.h"
#include "firmware/stm32f405/usb_registers.h"

#include <string.h>

/* FIFO RAM: 320 words (section 34.11). Receiving: 128 words: two packets of 16, SETUPs and statuses (at least 13 + 2
 * × 17, section 34.13.1). */
#define RX_WORDS 128u
#define TX0_WORDS 32u
#define TX1_WORDS 128u

/* Registers of the endpoints without what starts or stops them. Endpoint 0: MPSIZ 0 is 64 bytes. */
#define IN0 EPCTL_USBAEP
#define OUT0 EPCTL_USBAEP
#define IN1 (EPCTL_USBAEP | EPCTL_EPTYP_BULK | EPCTL_TXFNUM(1) | LUMI_WIRE_USB_PACKET)
#define OUT1 (EPCTL_USBAEP | EPCTL_EPTYP_BULK | LUMI_WIRE_USB_PACKET)

#define SOURCES                                                                                                        \
    (OTG_FS_GINT_OTGINT | OTG_FS_GINT_RXFLVL | OTG_FS_GINT_USBSUSP | OTG_FS_GINT_USBRST | OTG_FS_GINT_ENUMDNE |        \
     OTG_FS_GINT_IEPINT | OTG_FS_GINT_OEPINT | OTG_FS_GINT_SRQINT | OTG_FS_GINT_WKUPINT)
/* Turnaround at an AHB of 32 MHz and more: section 34.17.7. */
#define USBCFG (OTG_FS_GUSBCFG_PHYSEL | OTG_FS_GUSBCFG_TRDT(6) | OTG_FS_GUSBCFG_FDMOD)

/* Reads of a register while the core finishes what takes it a few PHY clocks; it does not hang, but nobody here waits
 * for ever. */
#define PATIENCE 20000

static uint8_t setup[8];
static uint8_t packet[LUMI_WIRE_USB_PACKET];

static void wait_clear(volatile uint32_t *reg, uint32_t bits)
{
    for (int i = 0; (*reg & bits) && i < PATIENCE; i++)
        ;
}

static void wait_set(volatile uint32_t *reg, uint32_t bits)
{
    for (int i = 0; !(*reg & bits) && i < PATIENCE; i++)
        ;
}

static void flush_tx(unsigned fifo)
{
    OTG_FS_GRSTCTL = OTG_FS_GRSTCTL_TXFFLSH | OTG_FS_GRSTCTL_TXFNUM(fifo);
    wait_clear(&OTG_FS_GRSTCTL, OTG_FS_GRSTCTL_TXFFLSH);
}

void usb_init(void)
{
    OTG_FS_GAHBCFG = 0;
    wait_set(&OTG_FS_GRSTCTL, OTG_FS_GRSTCTL_AHBIDL);
    OTG_FS_GRSTCTL = OTG_FS_GRSTCTL_CSRST;
    wait_clear(&OTG_FS_GRSTCTL, OTG_FS_GRSTCTL_CSRST);
    wait_set(&OTG_FS_GRSTCTL, OTG_FS_GRSTCTL_AHBIDL);

    OTG_FS_PCGCCTL = 0;
    OTG_FS_GUSBCFG = USBCFG;
    /* Section 34.16.2, FDMOD: 25 ms until it is a device. */
    const uint64_t begun = time_now();
    while (time_now() - begun < BOARD_TICK_HZ / 40)
        ;
    OTG_FS_DCTL = OTG_FS_DCTL_SDIS;
    OTG_FS_GCCFG = OTG_FS_GCCFG_PWRDWN | OTG_FS_GCCFG_VBUSBSEN;
    OTG_FS_DCFG = OTG_FS_DCFG_DSPD_FULL;
    OTG_FS_GRXFSIZ = RX_WORDS;
    OTG_FS_DIEPTXF0 = OTG_FS_TXF(RX_WORDS, TX0_WORDS);
    OTG_FS_DIEPTXF1 = OTG_FS_TXF(RX_WORDS + TX0_WORDS, TX1_WORDS);
    flush_tx(0x10); /* all */
    OTG_FS_GRSTCTL = OTG_FS_GRSTCTL_RXFFLSH;
    wait_clear(&OTG_FS_GRSTCTL, OTG_FS_GRSTCTL_RXFFLSH);

    OTG_FS_DIEPMSK = OTG_FS_DIEPMSK_XFRCM;
    OTG_FS_DOEPMSK = OTG_FS_DOEPMSK_XFRCM | OTG_FS_DOEPMSK_STUPM;
    OTG_FS_GINTSTS = 0xffffffffu;
    OTG_FS_GINTMSK = SOURCES;
    OTG_FS_GAHBCFG = OTG_FS_GAHBCFG_GINT;
    interrupt_enable(IRQ_OTG_FS, PRIORITY_LINK);
    OTG_FS_DCTL = 0; /* pulls D+ up as soon as there is a host's 5 V */
}

/* `bytes` may lie anywhere; the last word is filled up. */
static void fill_fifo(unsigned fifo, const uint8_t *data, size_t size)
{
    for (size_t i = 0; i < size; i += 4) {
        uint32_t word = 0;
        memcpy(&word, data + i, size - i < 4 ? size - i : 4);
        OTG_FS_FIFO(fifo) = word;
    }
}

static void read_fifo(uint8_t *data, size_t size, size_t room)
{
    for (size_t i = 0; i < size; i += 4) {
        const uint32_t word = OTG_FS_FIFO(0);
        if (i < room)
            memcpy(data + i, &word, room - i < 4 ? room - i : 4);
    }
}

/* Section 34.17.6, "IN endpoint disable": withdraws what is to be sent. */
static void cancel_in(unsigned ep, uint32_t base)
{
    if (OTG_FS_DIEPCTL(ep) & EPCTL_EPENA) {
        OTG_FS_DIEPCTL(ep) = base | EPCTL_SNAK;
        OTG_FS_DIEPCTL(ep) = base | EPCTL_SNAK | EPCTL_EPDIS;
        wait_set(&OTG_FS_DIEPINT(ep), EPINT_EPDISD);
    }
    flush_tx(ep);
    OTG_FS_DIEPINT(ep) = EPINT_ALL;
}

static void expect_setup(void)
{
    OTG_FS_DOEPTSIZ(0) = DOEPTSIZ0_STUPCNT_3;
}

void usb_ep0_send(const uint8_t *data, size_t size)
{
    OTG_FS_DIEPTSIZ(0) = EPTSIZ(1, size);
    OTG_FS_DIEPCTL(0) = IN0 | EPCTL_EPENA | EPCTL_CNAK;
    fill_fifo(0, data, size);
}

void usb_ep0_stall(void)
{
    /* The core takes both away when the next SETUP comes (section 34.16.4). */
    OTG_FS_DIEPCTL(0) = IN0 | EPCTL_STALL;
    OTG_FS_DOEPCTL(0) = OUT0 | EPCTL_STALL;
    expect_setup();
}

void usb_ep0_receive_status(void)
{
    OTG_FS_DOEPTSIZ(0) = DOEPTSIZ0_STUPCNT_3 | EPTSIZ(1, USB_EP0_SIZE);
    OTG_FS_DOEPCTL(0) = OUT0 | EPCTL_EPENA | EPCTL_CNAK;
}

void usb_ep0_abort(void)
{
    cancel_in(0, IN0);
    expect_setup();
}

void usb_set_address(unsigned address)
{
    OTG_FS_DCFG = OTG_FS_DCFG_DSPD_FULL | OTG_FS_DCFG_DAD(address); /* the core waits for the status stage */
}

void usb_bulk_open(void)
{
    OTG_FS_DIEPCTL(1) = IN1 | EPCTL_SD0PID | EPCTL_SNAK;
    OTG_FS_DOEPCTL(1) = OUT1 | EPCTL_SD0PID | EPCTL_SNAK;
    OTG_FS_DAINTMSK = OTG_FS_DAINT_IN(0) | OTG_FS_DAINT_OUT(0) | OTG_FS_DAINT_IN(1) | OTG_FS_DAINT_OUT(1);
}

void usb_bulk_close(void)
{
    cancel_in(1, IN1);
    OTG_FS_DOEPCTL(1) = OUT1 | EPCTL_SNAK;
    OTG_FS_DIEPCTL(1) = EPCTL_SNAK;
    OTG_FS_DOEPCTL(1) = EPCTL_SNAK;
    OTG_FS_DAINTMSK = OTG_FS_DAINT_IN(0) | OTG_FS_DAINT_OUT(0);
}

void usb_bulk_halt(bool to_host, bool halted)
{
    if (to_host) {
        cancel_in(1, IN1);
        OTG_FS_DIEPCTL(1) = IN1 | EPCTL_SNAK | (halted ? EPCTL_STALL : EPCTL_SD0PID);
    } else {
        OTG_FS_DOEPCTL(1) = OUT1 | EPCTL_SNAK | (halted ? EPCTL_STALL : EPCTL_SD0PID);
    }
}

void usb_bulk_send(const uint8_t *data, size_t size)
{
    const uint32_t packets = size ? (uint32_t)((size + LUMI_WIRE_USB_PACKET - 1) / LUMI_WIRE_USB_PACKET) : 1;

    OTG_FS_DIEPTSIZ(1) = EPTSIZ(packets, size);
    OTG_FS_DIEPCTL(1) = IN1 | EPCTL_EPENA | EPCTL_CNAK;
    fill_fifo(1, data, size);
}

void usb_bulk_receive(void)
{
    if (OTG_FS_DOEPCTL(1) & EPCTL_EPENA) { /* after a halt, which only held it off */
        OTG_FS_DOEPCTL(1) = OUT1 | EPCTL_CNAK;
        return;
    }
    OTG_FS_DOEPTSIZ(1) = EPTSIZ(1, LUMI_WIRE_USB_PACKET);
    OTG_FS_DOEPCTL(1) = OUT1 | EPCTL_EPENA | EPCTL_CNAK;
}

/* Section 34.17.5, "Packet read". */
static void take_received(void)
{
    const uint32_t status = OTG_FS_GRXSTSP;
    const size_t size = OTG_FS_GRXSTSP_BCNT(status);

    switch (OTG_FS_GRXSTSP_PKTSTS(status)) {
    case PKTSTS_SETUP_DATA:
        read_fifo(setup, size, sizeof setup);
        break;
    case PKTSTS_OUT_DATA:
        read_fifo(packet, size, sizeof packet);
        if (OTG_FS_GRXSTSP_EPNUM(status) == 1 && size <= sizeof packet)
            usb_link_received(packet, size);
        break;
    default:
        break;
    }
}

/* Section 34.17.5, "Endpoint initialization on USB reset". */
static void bus_reset(void)
{
    OTG_FS_DCTL = 0; /* no remote wake-up */
    usb_control_reset();
    flush_tx(0x10);
    OTG_FS_DIEPINT(0) = OTG_FS_DIEPINT(1) = EPINT_ALL;
    OTG_FS_DOEPINT(0) = OTG_FS_DOEPINT(1) = EPINT_ALL;
    OTG_FS_DOEPCTL(0) = OUT0 | EPCTL_SNAK;
    OTG_FS_DAINTMSK = OTG_FS_DAINT_IN(0) | OTG_FS_DAINT_OUT(0);
    usb_set_address(0);
    expect_setup();
}

static void out_events(void)
{
    const uint32_t which = OTG_FS_DAINT;

    if (which & OTG_FS_DAINT_OUT(0)) {
        const uint32_t events = OTG_FS_DOEPINT(0);
        OTG_FS_DOEPINT(0) = events;
        if (events & EPINT_XFRC)
            expect_setup();
        if (events & EPINT_STUP)
            usb_control_setup(setup);
    }
    if (which & OTG_FS_DAINT_OUT(1)) {
        const uint32_t events = OTG_FS_DOEPINT(1);
        OTG_FS_DOEPINT(1) = events;
        if (events & EPINT_XFRC) /* the packet itself came with RXFLVL */
            usb_link_receive_done();
    }
}

static void in_events(void)
{
    const uint32_t which = OTG_FS_DAINT;

    if (which & OTG_FS_DAINT_IN(0)) {
        const uint32_t events = OTG_FS_DIEPINT(0);
        OTG_FS_DIEPINT(0) = events;
        if (events & EPINT_XFRC)
            usb_control_sent();
    }
    if (which & OTG_FS_DAINT_IN(1)) {
        const uint32_t events = OTG_FS_DIEPINT(1);
        OTG_FS_DIEPINT(1) = events;
        if (events & EPINT_XFRC)
            usb_link_sent();
    }
}

/* The host's 5 V have come or gone; a session that ends is a cable pulled out. */
static void session(void)
{
    const uint32_t events = OTG_FS_GOTGINT;

    OTG_FS_GOTGINT = events;
    if (events & OTG_FS_GOTGINT_SEDET)
        bus_reset();
}

void OTG_FS_Handler(void)
{
    const uint32_t events = OTG_FS_GINTSTS & SOURCES;

    OTG_FS_GINTSTS = events & (OTG_FS_GINT_USBSUSP | OTG_FS_GINT_USBRST | OTG_FS_GINT_ENUMDNE | OTG_FS_GINT_SRQINT |
                               OTG_FS_GINT_WKUPINT);
    if (events & OTG_FS_GINT_OTGINT)
        session();
    if (events & (OTG_FS_GINT_USBRST | OTG_FS_GINT_WKUPINT))
        usb_link_suspended(false);
    if (events & OTG_FS_GINT_USBRST)
        bus_reset();
    if (events & OTG_FS_GINT_ENUMDNE) {
        OTG_FS_DIEPCTL(0) = IN0;
        OTG_FS_DCTL = OTG_FS_DCTL_CGINAK;
    }
    if (events & OTG_FS_GINT_USBSUSP)
        usb_link_suspended(true);
    if (events & OTG_FS_GINT_RXFLVL)
        take_received();
    if (events & OTG_FS_GINT_IEPINT)
        in_events();
    if (events & OTG_FS_GINT_OEPINT)
        out_events();
}
