/* What stands in every firmware image, so that it can be checked before it is written to a board: 64 bytes at a fixed
 * offset, after the vector table. Read by `lumi rig flash`, filled in by image_seal after linking. Little-endian.
 *
 *   0   8  magic "LUMIRIG\0"
 *   8   4  version of this layout, 1
 *   12  4  size of the image in bytes, header and vectors included; a multiple of 4
 *   16  4  address the image is for (0x08000000)
 *   20  4  CRC-32C (proto/base/bytes.h) of the whole image, with these four bytes taken as zero
 *   24  16 board, zero-padded ("stm32f405")
 *   40  24 firmware version, zero-padded
 */
#ifndef LUMI_FIRMWARE_BOARD_BOARD_IMAGE_H
#define LUMI_FIRMWARE_BOARD_BOARD_IMAGE_H

#include <stdint.h>

#define BOARD_IMAGE_OFFSET 512
#define BOARD_IMAGE_MAGIC "LUMIRIG" /* with its final zero: 8 bytes */
#define BOARD_IMAGE_VERSION 1
#define BOARD_IMAGE_NAME 16
#define BOARD_IMAGE_FIRMWARE 24
#define BOARD_IMAGE_SIZE_AT 12
#define BOARD_IMAGE_ADDRESS_AT 16
#define BOARD_IMAGE_CRC_AT 20
#define BOARD_IMAGE_BOARD_AT 24
#define BOARD_IMAGE_FIRMWARE_AT 40

struct board_image {
    char magic[8];
    uint32_t version, size, address, crc;
    char board[BOARD_IMAGE_NAME];
    char firmware[BOARD_IMAGE_FIRMWARE];
};

#endif
