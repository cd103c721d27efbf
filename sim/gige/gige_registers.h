/* What a simulated GigE Vision camera is to the network: its registers, and the GenICam file that names them.
 *
 * Bootstrap registers: GigE Vision 2.0, chapter 28. Ours lie behind them; a GenICam program finds them by name. All are
 * big-endian. */
#ifndef LUMI_SIM_GIGE_GIGE_REGISTERS_H
#define LUMI_SIM_GIGE_GIGE_REGISTERS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { GIGE_BOOT_SIZE = 0x1000, GIGE_OWN = 0x10000, GIGE_OWN_SIZE = 0x100, GIGE_XML = 0x20000 };

/* Bootstrap registers that do something. */
enum {
    GIGE_DEVICE_ADDRESS = 0x0024,
    GIGE_HEARTBEAT = 0x0938, /* ms */
    GIGE_TIMESTAMP_CONTROL = 0x0944,
    GIGE_TIMESTAMP = 0x0948,
    GIGE_PRIVILEGE = 0x0a00,
    GIGE_STREAM_PORT = 0x0d00,
    GIGE_PACKET_SIZE = 0x0d04,
    GIGE_PACKET_DELAY = 0x0d08, /* ticks */
    GIGE_STREAM_ADDRESS = 0x0d18
};
/* Ours. */
enum {
    GIGE_WIDTH = GIGE_OWN,
    GIGE_HEIGHT = GIGE_OWN + 0x04,
    GIGE_PIXEL_FORMAT = GIGE_OWN + 0x08,
    GIGE_ACQUISITION_MODE = GIGE_OWN + 0x0c,
    GIGE_ACQUISITION = GIGE_OWN + 0x10,
    GIGE_TRIGGER_SELECTOR = GIGE_OWN + 0x14,
    GIGE_TRIGGER_MODE = GIGE_OWN + 0x18,
    GIGE_TRIGGER_SOURCE = GIGE_OWN + 0x1c,
    GIGE_TRIGGER_ACTIVATION = GIGE_OWN + 0x20,
    GIGE_TRIGGER_SOFTWARE = GIGE_OWN + 0x24,
    GIGE_CHUNK_MODE = GIGE_OWN + 0x2c,
    GIGE_CHUNK_SELECTOR = GIGE_OWN + 0x30,
    GIGE_CHUNK_ENABLE = GIGE_OWN + 0x34,
    GIGE_EXPOSURE_TIME = GIGE_OWN + 0x38, /* µs, 8 bytes */
    GIGE_GAIN = GIGE_OWN + 0x40,          /* dB, 8 bytes */
    GIGE_FRAME_RATE = GIGE_OWN + 0x48,    /* 1/s, 8 bytes */
    GIGE_TEMPERATURE = GIGE_OWN + 0x50,   /* °C, 8 bytes */
    GIGE_PAYLOAD = GIGE_OWN + 0x58,
    GIGE_SENSOR_WIDTH = GIGE_OWN + 0x5c,
    GIGE_SENSOR_HEIGHT = GIGE_OWN + 0x60,
    GIGE_ACTION_DEVICE_KEY = GIGE_OWN + 0x64,
    GIGE_ACTION_SELECTOR = GIGE_OWN + 0x68,
    GIGE_ACTION_GROUP_KEY = GIGE_OWN + 0x6c,
    GIGE_ACTION_GROUP_MASK = GIGE_OWN + 0x70,
    GIGE_COUNTER_SOURCE = GIGE_OWN + 0x74,
    GIGE_COUNTER_VALUE = GIGE_OWN + 0x78,
    GIGE_CHUNK_MASK = GIGE_OWN + 0xf0, /* not in the file: the chunks that are on */
};
enum { GIGE_SOURCE_SOFTWARE = 0, GIGE_SOURCE_LINE1 = 1, GIGE_SOURCE_ACTION1 = 2 };
/* Chunks by their selector's value. */
enum {
    GIGE_CHUNK_IMAGE = 0,
    GIGE_CHUNK_EXPOSURE,
    GIGE_CHUNK_GAIN,
    GIGE_CHUNK_TIMESTAMP,
    GIGE_CHUNK_FRAME_ID,
    GIGE_CHUNK_COUNTER,
    GIGE_CHUNKS
};
#define GIGE_CHUNK_ID(chunk) (0x4c550000u + (chunk)) /* in the stream */
/* Pixel formats (PFNC 2.1); the last one is ours. */
enum {
    GIGE_MONO8 = 0x01080001,
    GIGE_RG8 = 0x01080009,
    GIGE_RG10 = 0x0110000d,
    GIGE_RG12 = 0x01100011,
    GIGE_RG16 = 0x0110002f,
    GIGE_RG10P = 0x010a0058,
    GIGE_RG12P = 0x010c0059,
    GIGE_RG12_PACKED = 0x010c002b,
    GIGE_RGB8 = 0x02180014
};
#define GIGE_JPEG 0x80180001u

struct gige_registers {
    uint8_t boot[GIGE_BOOT_SIZE], own[GIGE_OWN_SIZE];
    char *xml; /* the file as the camera gives it */
    size_t xml_size;
};

struct gige_identity {
    char address[16]; /* "127.0.0.2" */
    char vendor[32], model[32], version[32], serial[16], name[16];
    int width, height;
    uint64_t tick_frequency;
};
/* LUMI_OK or LUMI_ERR_ARG, LUMI_ERR_NOMEM. */
int gige_registers_init(struct gige_registers *registers, const struct gige_identity *identity);
void gige_registers_finish(struct gige_registers *registers);

/* Within the registers, or NULL. */
uint8_t *gige_register(struct gige_registers *registers, uint32_t address, size_t size);
uint32_t gige_get(const struct gige_registers *registers, uint32_t address);
void gige_set(struct gige_registers *registers, uint32_t address, uint32_t value);
double gige_get_real(const struct gige_registers *registers, uint32_t address);
void gige_set_real(struct gige_registers *registers, uint32_t address, double value);

/* (transfer full), released with lumi_free */
char *gige_genicam(const struct gige_identity *identity);
bool gige_format_known(uint32_t format);
/* Bytes of a picture in that format; JPEG: at most. */
size_t gige_format_bytes(uint32_t format, int width, int height);

#endif
