/* Registers of the USB core OTG_FS as a device; RM0090 (rev 19) section 34.16. Bits are masks. */
#ifndef LUMI_FIRMWARE_STM32F405_USB_REGISTERS_H
#define LUMI_FIRMWARE_STM32F405_USB_REGISTERS_H

#include "firmware/stm32f405/f405_registers.h"

#define OTG_FS_BASE 0x50000000u
#define OTG_FS(offset) REG32(OTG_FS_BASE + (offset))

/* 34.16.2: global */
#define OTG_FS_GOTGINT OTG_FS(0x004)
#define OTG_FS_GOTGINT_SEDET (1u << 2)
#define OTG_FS_GAHBCFG OTG_FS(0x008)
#define OTG_FS_GAHBCFG_GINT (1u << 0)
#define OTG_FS_GUSBCFG OTG_FS(0x00c)
#define OTG_FS_GUSBCFG_PHYSEL (1u << 6)
#define OTG_FS_GUSBCFG_TRDT(clocks) ((uint32_t)(clocks) << 10)
#define OTG_FS_GUSBCFG_FDMOD (1u << 30)
#define OTG_FS_GRSTCTL OTG_FS(0x010)
#define OTG_FS_GRSTCTL_CSRST (1u << 0)
#define OTG_FS_GRSTCTL_RXFFLSH (1u << 4)
#define OTG_FS_GRSTCTL_TXFFLSH (1u << 5)
#define OTG_FS_GRSTCTL_TXFNUM(fifo) ((uint32_t)(fifo) << 6)
#define OTG_FS_GRSTCTL_AHBIDL (1u << 31)
#define OTG_FS_GINTSTS OTG_FS(0x014)
#define OTG_FS_GINTMSK OTG_FS(0x018)
#define OTG_FS_GINT_OTGINT (1u << 2)
#define OTG_FS_GINT_RXFLVL (1u << 4)
#define OTG_FS_GINT_USBSUSP (1u << 11)
#define OTG_FS_GINT_USBRST (1u << 12)
#define OTG_FS_GINT_ENUMDNE (1u << 13)
#define OTG_FS_GINT_IEPINT (1u << 18)
#define OTG_FS_GINT_OEPINT (1u << 19)
#define OTG_FS_GINT_SRQINT (1u << 30)
#define OTG_FS_GINT_WKUPINT (1u << 31)
#define OTG_FS_GRXSTSP OTG_FS(0x020)
#define OTG_FS_GRXSTSP_EPNUM(status) ((status)&0xfu)
#define OTG_FS_GRXSTSP_BCNT(status) ((status) >> 4 & 0x7ffu)
#define OTG_FS_GRXSTSP_PKTSTS(status) ((status) >> 17 & 0xfu)
#define PKTSTS_OUT_DATA 2u
#define PKTSTS_SETUP_DATA 6u
#define OTG_FS_GRXFSIZ OTG_FS(0x024)
#define OTG_FS_DIEPTXF0 OTG_FS(0x028)
#define OTG_FS_DIEPTXF1 OTG_FS(0x104)
#define OTG_FS_TXF(start, depth) ((uint32_t)(start) | (uint32_t)(depth) << 16) /* words */
#define OTG_FS_GCCFG OTG_FS(0x038)
#define OTG_FS_GCCFG_PWRDWN (1u << 16)
#define OTG_FS_GCCFG_VBUSBSEN (1u << 19)

/* 34.16.4: device */
#define OTG_FS_DCFG OTG_FS(0x800)
#define OTG_FS_DCFG_DSPD_FULL 3u
#define OTG_FS_DCFG_DAD(address) ((uint32_t)(address) << 4)
#define OTG_FS_DCTL OTG_FS(0x804)
#define OTG_FS_DCTL_SDIS (1u << 1)
#define OTG_FS_DCTL_CGINAK (1u << 8)
#define OTG_FS_DCTL_CGONAK (1u << 10)
#define OTG_FS_DIEPMSK OTG_FS(0x810)
#define OTG_FS_DIEPMSK_XFRCM (1u << 0)
#define OTG_FS_DOEPMSK OTG_FS(0x814)
#define OTG_FS_DOEPMSK_XFRCM (1u << 0)
#define OTG_FS_DOEPMSK_STUPM (1u << 3)
#define OTG_FS_DAINT OTG_FS(0x818)
#define OTG_FS_DAINTMSK OTG_FS(0x81c)
#define OTG_FS_DAINT_IN(ep) (1u << (ep))
#define OTG_FS_DAINT_OUT(ep) (1u << (16 + (ep)))
#define OTG_FS_DIEPCTL(ep) OTG_FS(0x900 + 0x20u * (ep))
#define OTG_FS_DIEPINT(ep) OTG_FS(0x908 + 0x20u * (ep))
#define OTG_FS_DIEPTSIZ(ep) OTG_FS(0x910 + 0x20u * (ep))
#define OTG_FS_DOEPCTL(ep) OTG_FS(0xb00 + 0x20u * (ep))
#define OTG_FS_DOEPINT(ep) OTG_FS(0xb08 + 0x20u * (ep))
#define OTG_FS_DOEPTSIZ(ep) OTG_FS(0xb10 + 0x20u * (ep))
#define EPCTL_USBAEP (1u << 15)
#define EPCTL_EPTYP_BULK (2u << 18)
#define EPCTL_STALL (1u << 21)
#define EPCTL_TXFNUM(fifo) ((uint32_t)(fifo) << 22)
#define EPCTL_CNAK (1u << 26)
#define EPCTL_SNAK (1u << 27)
#define EPCTL_SD0PID (1u << 28)
#define EPCTL_EPDIS (1u << 30)
#define EPCTL_EPENA (1u << 31)
#define EPINT_XFRC (1u << 0)
#define EPINT_EPDISD (1u << 1)
#define EPINT_STUP (1u << 3)
#define EPINT_ALL 0xffu
#define EPTSIZ(packets, bytes) ((uint32_t)(packets) << 19 | (uint32_t)(bytes))
#define DOEPTSIZ0_STUPCNT_3 (3u << 29)
#define OTG_FS_FIFO(n) OTG_FS(0x1000u * (1u + (n)))

/* 34.16.5 */
#define OTG_FS_PCGCCTL OTG_FS(0xe00)

#endif
