/* What firmware/board/board_image.h says of this image; image_seal fills in size and checksum. */
#include "firmware/board/board_image.h"
#include "firmware/stm32f405/port.h"

#include <stddef.h>

_Static_assert(sizeof(struct board_image) == 64, "as board_image.h has it");
_Static_assert(offsetof(struct board_image, firmware) == BOARD_IMAGE_FIRMWARE_AT, "as board_image.h has it");

__attribute__((section(".image_header"), used)) static const struct board_image header = {
    .magic = BOARD_IMAGE_MAGIC,
    .version = BOARD_IMAGE_VERSION,
    .address = FLASH_IMAGE_ADDRESS,
    .board = BOARD_NAME,
    .firmware = LUMI_VERSION,
};
