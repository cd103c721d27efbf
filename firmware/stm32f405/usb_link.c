/* The USB link. */
#include "firmware/stm32f405/port.h"

void usb_init(void)
{
}

size_t usb_read(uint8_t *data, size_t size)
{
    (void)data, (void)size;
    return 0;
}

size_t usb_write(const uint8_t *data, size_t size)
{
    (void)data, (void)size;
    return 0;
}

bool usb_up(void)
{
    return false;
}

void OTG_FS_Handler(void)
{
}
