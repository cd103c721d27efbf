/* GVCP (GigE Vision 2.0, chapters 14 to 20). */
#include "sim/gige/gige_control.h"

#include <string.h>

#define HEADER 8
#define KEY 0x42

enum {
    DISCOVERY = 0x0002,
    RESEND = 0x0040,
    READ_REGISTER = 0x0080,
    WRITE_REGISTER = 0x0082,
    READ_MEMORY = 0x0084,
    WRITE_MEMORY = 0x0086,
    ACTION = 0x0100
};
enum {
    STATUS_OK = 0,
    STATUS_NOT_IMPLEMENTED = 0x8001,
    STATUS_PARAMETER = 0x8002,
    STATUS_ADDRESS = 0x8003,
    STATUS_WRITE_PROTECT = 0x8004,
    STATUS_ALIGNMENT = 0x8005,
    STATUS_DENIED = 0x8006
};
#define DISCOVERY_BYTES 0xf8
#define MEMORY_MAX 536 /* bytes of one READMEM or WRITEMEM */

static uint32_t get32(const uint8_t *at)
{
    return (uint32_t)at[0] << 24 | (uint32_t)at[1] << 16 | (uint32_t)at[2] << 8 | at[3];
}

static uint16_t get16(const uint8_t *at)
{
    return (uint16_t)(at[0] << 8 | at[1]);
}

static void put16(uint8_t *at, unsigned value)
{
    at[0] = (uint8_t)(value >> 8);
    at[1] = (uint8_t)value;
}

static void put32(uint8_t *at, uint32_t value)
{
    put16(at, value >> 16);
    put16(at + 2, value & 0xffff);
}

static bool in_control(const struct gige_control *c, const struct gige_peer *peer)
{
    return c->controller.port == 0 || (c->controller.port == peer->port && c->controller.address == peer->address);
}

/* ---- registers that are more than memory ---- */

static void compute_payload(struct gige_registers *r)
{
    static const unsigned sizes[GIGE_CHUNKS] = {0, 8, 8, 8, 8, 8};
    const unsigned mask = gige_get(r, GIGE_CHUNK_MASK);
    size_t bytes =
        gige_format_bytes(gige_get(r, GIGE_PIXEL_FORMAT), (int)gige_get(r, GIGE_WIDTH), (int)gige_get(r, GIGE_HEIGHT));

    if (gige_get(r, GIGE_CHUNK_MODE)) {
        bytes = (bytes + 3) / 4 * 4 + 8;
        for (int i = 1; i < GIGE_CHUNKS; i++)
            bytes += mask >> i & 1 ? sizes[i] + 8 : 0;
    }
    gige_set(r, GIGE_PAYLOAD, (uint32_t)bytes);
}

static void before_read(struct gige_registers *r, uint32_t address, size_t size)
{
    const unsigned chunk = gige_get(r, GIGE_CHUNK_SELECTOR) % GIGE_CHUNKS;

    if (address + size > GIGE_OWN && address >= GIGE_OWN) {
        compute_payload(r);
        gige_set(r, GIGE_CHUNK_ENABLE, gige_get(r, GIGE_CHUNK_MASK) >> chunk & 1);
    }
}

static unsigned check_write(const struct gige_registers *r, uint32_t address, uint32_t value)
{
    switch (address) {
    case GIGE_WIDTH:
        return value >= 1 && value <= gige_get(r, GIGE_SENSOR_WIDTH) ? STATUS_OK : STATUS_PARAMETER;
    case GIGE_HEIGHT:
        return value >= 1 && value <= gige_get(r, GIGE_SENSOR_HEIGHT) ? STATUS_OK : STATUS_PARAMETER;
    case GIGE_PIXEL_FORMAT:
        return gige_format_known(value) ? STATUS_OK : STATUS_PARAMETER;
    case GIGE_TRIGGER_SOURCE:
        return value <= GIGE_SOURCE_ACTION1 ? STATUS_OK : STATUS_PARAMETER;
    case GIGE_CHUNK_SELECTOR:
        return value < GIGE_CHUNKS ? STATUS_OK : STATUS_PARAMETER;
    case GIGE_SENSOR_WIDTH:
    case GIGE_SENSOR_HEIGHT:
    case GIGE_PAYLOAD:
    case GIGE_COUNTER_VALUE:
    case GIGE_CHUNK_MASK:
        return STATUS_WRITE_PROTECT;
    default:
        return address >= GIGE_HEARTBEAT || address == 0x0014 ? STATUS_OK : STATUS_WRITE_PROTECT;
    }
}

static void after_write(struct gige_control *c, const struct gige_peer *peer, uint32_t address, uint32_t value)
{
    struct gige_registers *r = &c->registers;
    const unsigned chunk = gige_get(r, GIGE_CHUNK_SELECTOR) % GIGE_CHUNKS;

    switch (address) {
    case GIGE_PRIVILEGE:
        c->controller = value & 3 ? *peer : (struct gige_peer){0};
        if (!(value & 3) && gige_get(r, GIGE_ACQUISITION)) {
            gige_set(r, GIGE_ACQUISITION, 0);
            c->actions |= GIGE_DO_STOP;
        }
        break;
    case GIGE_ACQUISITION:
        c->actions |= value ? GIGE_DO_START : GIGE_DO_STOP;
        break;
    case GIGE_TRIGGER_SOFTWARE:
        c->actions |= GIGE_DO_TRIGGER;
        break;
    case GIGE_CHUNK_ENABLE:
        gige_set(r, GIGE_CHUNK_MASK,
                 (gige_get(r, GIGE_CHUNK_MASK) & ~(1u << chunk)) | (value ? 1u << chunk : 0) | 1u << GIGE_CHUNK_IMAGE);
        break;
    case GIGE_COUNTER_SOURCE:
        gige_set(r, GIGE_COUNTER_VALUE, 0);
        break;
    case GIGE_EXPOSURE_TIME + 4:
        c->actions |= GIGE_DO_EXPOSURE;
        break;
    case GIGE_PACKET_SIZE:
        if (value >> 31)
            c->actions |= GIGE_DO_TEST_PACKET;
        gige_set(r, GIGE_PACKET_SIZE, value & 0x7fffffff);
        break;
    case GIGE_TIMESTAMP_CONTROL:
        if (value & 2)
            c->actions |= GIGE_DO_LATCH;
        break;
    default:
        break;
    }
}

static unsigned write_word(struct gige_control *c, const struct gige_peer *peer, uint32_t address, uint32_t value)
{
    unsigned status;

    if (address % 4)
        return STATUS_ALIGNMENT;
    if (!gige_register(&c->registers, address, 4))
        return STATUS_ADDRESS;
    if (!in_control(c, peer))
        return STATUS_DENIED;
    if (address != GIGE_PRIVILEGE && c->controller.port == 0)
        return STATUS_DENIED;
    status = check_write(&c->registers, address, value);
    if (status == STATUS_OK) {
        gige_set(&c->registers, address, value);
        after_write(c, peer, address, value);
    }
    return status;
}

/* ---- the commands; each writes its answer's body and length ---- */

static unsigned read_registers(struct gige_control *c, const uint8_t *body, size_t size, uint8_t *answer,
                               size_t *length)
{
    if (size == 0 || size % 4 || size > MEMORY_MAX)
        return STATUS_PARAMETER;
    for (size_t i = 0; i < size; i += 4) {
        const uint32_t address = get32(body + i);
        if (address % 4)
            return STATUS_ALIGNMENT;
        if (!gige_register(&c->registers, address, 4))
            return STATUS_ADDRESS;
        before_read(&c->registers, address, 4);
        put32(answer + i, gige_get(&c->registers, address));
    }
    *length = size;
    return STATUS_OK;
}

static unsigned write_registers(struct gige_control *c, const struct gige_peer *peer, const uint8_t *body, size_t size,
                                uint8_t *answer, size_t *length)
{
    unsigned status = STATUS_OK;
    size_t done = 0;

    if (size == 0 || size % 8 || size > MEMORY_MAX)
        return STATUS_PARAMETER;
    for (; done < size / 8 && status == STATUS_OK; done++)
        status = write_word(c, peer, get32(body + 8 * done), get32(body + 8 * done + 4));
    put32(answer, status == STATUS_OK ? (uint32_t)done : (uint32_t)done - 1);
    *length = 4;
    return status;
}

static unsigned read_memory(struct gige_control *c, const uint8_t *body, size_t size, uint8_t *answer, size_t *length)
{
    struct gige_registers *r = &c->registers;
    const uint32_t address = size == 8 ? get32(body) : 0;
    const size_t count = size == 8 ? get16(body + 6) : 0;
    const uint8_t *from;

    if (count == 0 || count > MEMORY_MAX)
        return STATUS_PARAMETER;
    put32(answer, address);
    memset(answer + 4, 0, count);
    *length = 4 + count;
    if (address >= GIGE_XML && address - GIGE_XML < r->xml_size) {
        const size_t left = r->xml_size - (address - GIGE_XML);
        memcpy(answer + 4, r->xml + (address - GIGE_XML), count < left ? count : left);
        return STATUS_OK;
    }
    from = gige_register(r, address, count);
    if (!from)
        return STATUS_ADDRESS;
    before_read(r, address, count);
    memcpy(answer + 4, from, count);
    return STATUS_OK;
}

static unsigned write_memory(struct gige_control *c, const struct gige_peer *peer, const uint8_t *body, size_t size,
                             uint8_t *answer, size_t *length)
{
    const uint32_t address = size >= 4 ? get32(body) : 0;
    unsigned status = STATUS_OK;

    if (size < 8 || size % 4 || size - 4 > MEMORY_MAX)
        return STATUS_PARAMETER;
    for (size_t i = 4; i < size && status == STATUS_OK; i += 4)
        status = write_word(c, peer, address + (uint32_t)i - 4, get32(body + i));
    put32(answer, status == STATUS_OK ? (uint32_t)size - 4 : 0);
    *length = 4;
    return status;
}

static unsigned act(struct gige_control *c, const uint8_t *body, size_t size)
{
    const struct gige_registers *r = &c->registers;

    if (size != 12)
        return STATUS_PARAMETER;
    if (get32(body) == gige_get(r, GIGE_ACTION_DEVICE_KEY) && get32(body + 4) == gige_get(r, GIGE_ACTION_GROUP_KEY) &&
        (get32(body + 8) & gige_get(r, GIGE_ACTION_GROUP_MASK)))
        c->actions |= GIGE_DO_ACTION;
    return STATUS_OK;
}

static unsigned resend(struct gige_control *c, const uint8_t *body, size_t size)
{
    if (size != 12)
        return STATUS_PARAMETER;
    c->resend_block = get16(body + 2);
    c->resend_first = get32(body + 4) & 0xffffff;
    c->resend_last = get32(body + 8) & 0xffffff;
    if (c->resend_first <= c->resend_last)
        c->actions |= GIGE_DO_RESEND;
    return STATUS_OK;
}

static unsigned execute(struct gige_control *c, const struct gige_peer *peer, unsigned command, const uint8_t *body,
                        size_t size, uint8_t *answer, size_t *length)
{
    switch (command) {
    case DISCOVERY:
        memcpy(answer, c->registers.boot, DISCOVERY_BYTES);
        *length = DISCOVERY_BYTES;
        return STATUS_OK;
    case READ_REGISTER:
        return read_registers(c, body, size, answer, length);
    case WRITE_REGISTER:
        return write_registers(c, peer, body, size, answer, length);
    case READ_MEMORY:
        return read_memory(c, body, size, answer, length);
    case WRITE_MEMORY:
        return write_memory(c, peer, body, size, answer, length);
    case ACTION:
        return act(c, body, size);
    default:
        return STATUS_NOT_IMPLEMENTED;
    }
}

size_t gige_control_answer(struct gige_control *c, const struct gige_peer *peer, uint64_t now_ns,
                           const uint8_t *request, size_t size, uint8_t *answer)
{
    unsigned command, status;
    size_t length = 0;

    c->actions = 0;
    if (size < HEADER || request[0] != KEY || get16(request + 4) != size - HEADER || size > GIGE_PACKET_MAX)
        return 0;
    command = get16(request + 2);
    if (c->controller.port != 0 && in_control(c, peer))
        c->heard_ns = now_ns;
    if (command == RESEND) { /* answered by packets of the stream alone */
        resend(c, request + HEADER, size - HEADER);
        return 0;
    }
    status = execute(c, peer, command, request + HEADER, size - HEADER, answer + HEADER, &length);
    if (c->controller.port != 0 && in_control(c, peer))
        c->heard_ns = now_ns;
    if (!(request[1] & 1)) /* no answer is wanted */
        return 0;
    if (status != STATUS_OK && command != WRITE_REGISTER && command != WRITE_MEMORY)
        length = 0;
    put16(answer, status);
    put16(answer + 2, command + 1);
    put16(answer + 4, (unsigned)length);
    memcpy(answer + 6, request + 6, 2);
    return HEADER + length;
}

bool gige_control_expire(struct gige_control *c, uint64_t now_ns)
{
    const uint64_t patience = (uint64_t)gige_get(&c->registers, GIGE_HEARTBEAT) * 1000000;

    if (c->controller.port == 0 || now_ns < c->heard_ns || now_ns - c->heard_ns < patience)
        return false;
    c->controller = (struct gige_peer){0};
    gige_set(&c->registers, GIGE_PRIVILEGE, 0);
    gige_set(&c->registers, GIGE_ACQUISITION, 0);
    return true;
}
