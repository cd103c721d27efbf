/* Bits of OTG_FS's registers (RM0090 34.16) and what its two files share. */
#ifndef LUMI_SIM_BOARD_CHIP_OTG_H
#define LUMI_SIM_BOARD_CHIP_OTG_H

#include "sim/board/chip_priv.h"

/* GINTSTS */
#define OTGINT (1u << 2)
#define SOF (1u << 3)
#define RXFLVL (1u << 4)
#define ESUSP (1u << 10)
#define USBSUSP (1u << 11)
#define USBRST (1u << 12)
#define ENUMDNE (1u << 13)
#define IEPINT (1u << 18)
#define OEPINT (1u << 19)
#define SRQINT (1u << 30)
#define WKUPINT (1u << 31)
/* DIEPCTLx, DOEPCTLx */
#define USBAEP (1u << 15)
#define NAKSTS (1u << 17)
#define STALL (1u << 21)
#define CNAK (1u << 26)
#define SNAK (1u << 27)
#define EPDIS (1u << 30)
#define EPENA (1u << 31)
/* DIEPINTx, DOEPINTx */
#define XFRC (1u << 0)
#define EPDISD (1u << 1)
#define STUP (1u << 3)
#define ITTXFE (1u << 4)
#define INEPNE (1u << 6)
#define TXFE (1u << 7)

unsigned f405_otg_packet_size(const struct otg_endpoint *endpoint, int number);
unsigned f405_otg_fifo_words(const struct otg *otg, int number);
void f405_otg_interrupts(struct f405 *chip);
/* An entry of the receive FIFO; false: no room. */
bool f405_otg_push(struct f405 *chip, uint32_t status, const uint8_t *data, size_t size);

#endif
