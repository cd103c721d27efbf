/* GVSP, the stream protocol of GigE Vision: a frame cut into packets, any of them again. */
#ifndef LUMI_SIM_GIGE_GIGE_STREAM_H
#define LUMI_SIM_GIGE_GIGE_STREAM_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define GIGE_STREAM_HEADER 8    /* bytes of GVSP */
#define GIGE_STREAM_OVERHEAD 36 /* with IP and UDP: what the packet size register counts beside data */
#define GIGE_STREAM_PACKET 16384

struct gige_block {
    uint16_t id; /* never 0 */
    uint64_t timestamp;
    uint32_t format;
    int width, height;
    bool chunks;
    uint8_t *data; /* the picture, and chunks behind it */
    size_t size;
    size_t packet_size; /* as in the register */
};

uint32_t gige_stream_packets(const struct gige_block *block); /* leader and trailer included */
/* Packet `number` into `packet` (GIGE_STREAM_PACKET bytes); its length. */
size_t gige_stream_packet(const struct gige_block *block, uint32_t number, uint8_t *packet);
/* "I no longer have that one." */
size_t gige_stream_refusal(uint16_t block, uint32_t number, uint8_t *packet);

#endif
