/* Fills size and checksum into the header of a firmware image (firmware/board/board_image.h).
 * usage: image_seal IN OUT */
#include "firmware/board/board_image.h"
#include "proto/base/bytes.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define LARGEST 0x100000

static void put_u32(uint8_t *at, uint32_t value)
{
    for (int i = 0; i < 4; i++)
        at[i] = (uint8_t)(value >> (8 * i));
}

static int seal(uint8_t *image, size_t *size)
{
    uint8_t *const header = image + BOARD_IMAGE_OFFSET;

    while (*size % 4)
        image[(*size)++] = 0xff;
    if (*size < BOARD_IMAGE_OFFSET + sizeof(struct board_image) ||
        memcmp(header, BOARD_IMAGE_MAGIC, sizeof BOARD_IMAGE_MAGIC) != 0)
        return -1;
    put_u32(header + BOARD_IMAGE_SIZE_AT, (uint32_t)*size);
    put_u32(header + BOARD_IMAGE_CRC_AT, 0);
    put_u32(header + BOARD_IMAGE_CRC_AT, lumi_crc32c(0, image, *size));
    return 0;
}

int main(int argc, char **argv)
{
    uint8_t *const image = malloc(LARGEST + 4);
    size_t size = 0;
    int status = 1;

    if (argc != 3) {
        fprintf(stderr, "usage: image_seal IN OUT\n");
        free(image);
        return 2;
    }
    FILE *in = fopen(argv[1], "rb");
    if (in && image)
        size = fread(image, 1, LARGEST, in);
    if (in)
        fclose(in);
    if (size == 0 || seal(image, &size) != 0) {
        fprintf(stderr, "image_seal: %s: not a firmware image\n", argv[1]);
    } else {
        FILE *out = fopen(argv[2], "wb");
        const int written = out && fwrite(image, 1, size, out) == size;
        if (out && fclose(out) == 0 && written)
            status = 0;
        else
            fprintf(stderr, "image_seal: %s: cannot be written\n", argv[2]);
    }
    free(image);
    return status;
}
