/* The registers of a simulated camera, as they are when it is switched on. */
#include "sim/gige/gige_registers.h"

#include "proto/base/memory.h"
#include "proto/base/result.h"

#include <arpa/inet.h>
#include <stdio.h>
#include <string.h>

#define CAPABILITIES                                                                                                   \
    0xc0000067u /* user name, serial number; action, pending ack, resend, write memory, concatenation */

uint8_t *gige_register(struct gige_registers *r, uint32_t address, size_t size)
{
    if (address < GIGE_BOOT_SIZE && size <= GIGE_BOOT_SIZE - address)
        return r->boot + address;
    if (address >= GIGE_OWN && address - GIGE_OWN < GIGE_OWN_SIZE && size <= GIGE_OWN_SIZE - (address - GIGE_OWN))
        return r->own + (address - GIGE_OWN);
    return NULL;
}

static const uint8_t *look(const struct gige_registers *r, uint32_t address)
{
    return address < GIGE_BOOT_SIZE ? r->boot + address : r->own + (address - GIGE_OWN);
}

uint32_t gige_get(const struct gige_registers *r, uint32_t address)
{
    const uint8_t *at = look(r, address);

    return (uint32_t)at[0] << 24 | (uint32_t)at[1] << 16 | (uint32_t)at[2] << 8 | at[3];
}

void gige_set(struct gige_registers *r, uint32_t address, uint32_t value)
{
    uint8_t *at = gige_register(r, address, 4);

    for (int i = 0; i < 4; i++)
        at[i] = (uint8_t)(value >> (24 - 8 * i));
}

double gige_get_real(const struct gige_registers *r, uint32_t address)
{
    uint64_t bits = (uint64_t)gige_get(r, address) << 32 | gige_get(r, address + 4);
    double value;

    memcpy(&value, &bits, sizeof value);
    return value;
}

void gige_set_real(struct gige_registers *r, uint32_t address, double value)
{
    uint64_t bits;

    memcpy(&bits, &value, sizeof bits);
    gige_set(r, address, (uint32_t)(bits >> 32));
    gige_set(r, address + 4, (uint32_t)bits);
}

static void text(struct gige_registers *r, uint32_t address, size_t room, const char *value)
{
    snprintf((char *)r->boot + address, room, "%s", value);
}

static void bootstrap(struct gige_registers *r, const struct gige_identity *identity, uint32_t address)
{
    gige_set(r, 0x0000, 0x00020000); /* version 2.0 */
    gige_set(r, 0x0004, 0x80000001); /* big-endian; UTF-8 */
    gige_set(r, 0x0008, 0x00000200); /* MAC address: locally administered, then the IP address */
    gige_set(r, 0x000c, address);
    gige_set(r, 0x0010, 0x00000005); /* addresses: persistent, link-local */
    gige_set(r, 0x0014, 0x00000005);
    gige_set(r, GIGE_DEVICE_ADDRESS, address);
    gige_set(r, 0x0034, 0xff000000);
    text(r, 0x0048, 32, identity->vendor);
    text(r, 0x0068, 32, identity->model);
    text(r, 0x0088, 32, identity->version);
    text(r, 0x00a8, 48, "simulated");
    text(r, 0x00d8, 16, identity->serial);
    text(r, 0x00e8, 16, identity->name);
    snprintf((char *)r->boot + 0x0200, 512, "Local:camera.xml;%x;%zx", GIGE_XML, r->xml_size);
    gige_set(r, 0x0600, 1); /* network interfaces */
    gige_set(r, 0x0904, 1); /* stream channels */
    gige_set(r, 0x0908, 1); /* action signals */
    gige_set(r, 0x0934, CAPABILITIES);
    gige_set(r, GIGE_HEARTBEAT, 3000);
    gige_set(r, 0x093c, (uint32_t)(identity->tick_frequency >> 32));
    gige_set(r, 0x0940, (uint32_t)identity->tick_frequency);
    gige_set(r, GIGE_PACKET_SIZE, 1500);
}

int gige_registers_init(struct gige_registers *r, const struct gige_identity *identity)
{
    struct in_addr address;

    memset(r, 0, sizeof *r);
    if (inet_pton(AF_INET, identity->address, &address) != 1)
        return LUMI_ERR_ARG;
    r->xml = gige_genicam(identity);
    if (!r->xml)
        return LUMI_ERR_NOMEM;
    r->xml_size = strlen(r->xml);
    bootstrap(r, identity, ntohl(address.s_addr));
    gige_set(r, GIGE_WIDTH, (uint32_t)identity->width);
    gige_set(r, GIGE_HEIGHT, (uint32_t)identity->height);
    gige_set(r, GIGE_SENSOR_WIDTH, (uint32_t)identity->width);
    gige_set(r, GIGE_SENSOR_HEIGHT, (uint32_t)identity->height);
    gige_set(r, GIGE_PIXEL_FORMAT, GIGE_RG8);
    gige_set(r, GIGE_TRIGGER_SOURCE, GIGE_SOURCE_LINE1);
    gige_set_real(r, GIGE_EXPOSURE_TIME, 4000);
    gige_set_real(r, GIGE_FRAME_RATE, 10);
    gige_set_real(r, GIGE_TEMPERATURE, 41.5);
    gige_set(r, GIGE_CHUNK_MASK, 1u << GIGE_CHUNK_IMAGE);
    return LUMI_OK;
}

void gige_registers_finish(struct gige_registers *r)
{
    lumi_free(r->xml);
    r->xml = NULL;
}

bool gige_format_known(uint32_t format)
{
    return gige_format_bytes(format, 1, 1) > 0;
}

size_t gige_format_bytes(uint32_t format, int width, int height)
{
    const size_t pixels = (size_t)width * (size_t)height;

    switch (format) {
    case GIGE_MONO8:
    case GIGE_RG8:
        return pixels;
    case GIGE_RG10:
    case GIGE_RG12:
    case GIGE_RG16:
        return 2 * pixels;
    case GIGE_RG10P:
        return (10 * pixels + 7) / 8;
    case GIGE_RG12P:
    case GIGE_RG12_PACKED:
        return (12 * pixels + 7) / 8;
    case GIGE_RGB8:
        return 3 * pixels;
    case GIGE_JPEG:
        return 3 * pixels + 4096;
    default:
        return 0;
    }
}
