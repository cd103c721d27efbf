/* A drive over Modbus RTU or TCP (Modbus Application Protocol 1.1b3; Modbus over Serial Line 1.02), by libmodbus and a
 * register map.
 *
 * 1. Every exchange has an end: the map's timeout, so many tries. A try begins with an empty line, so that a late
 * answer to the last one is not taken for its own.
 * 2. Writing twice does no harm: a target is a place, not a distance, and a command's value is written again without
 *    having been cleared in between, which for a drive that goes by edges is one edge. */
#include "daemon/rig/drive.h"

#include <errno.h>
#include <glib.h>
#include <limits.h>
#include <math.h>
#include <modbus/modbus.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>

struct lumi_rig_drive {
    struct lumi_drive_map map;
    modbus_t *bus;
    char *name;
    bool serial, connected;
};

/* ---- one exchange ---- */

enum direction { READ, WRITE };

static const char *explain(int number, const struct lumi_rig_drive *drive, char *text, size_t size)
{
    if (number == ETIMEDOUT)
        snprintf(text, size, "no answer within %.3g s", drive->map.timeout);
    else if (number == EMBBADCRC)
        snprintf(text, size, "its answer is damaged (CRC)");
    else if (number == EMBBADDATA || number == EMBBADSLAVE || number == EMBBADEXC || number == EMBMDATA)
        snprintf(text, size, "its answer makes no sense (%s)", modbus_strerror(number));
    else if (number >= EMBXILFUN && number <= EMBXGTAR)
        snprintf(text, size, "it refuses: exception %d, %s", number - MODBUS_ENOBASE, modbus_strerror(number));
    else
        snprintf(text, size, "%s", modbus_strerror(number));
    return text;
}

/* What the drive said on purpose is not asked again; busy is. */
static bool worth_another_try(int number)
{
    return !(number >= EMBXILFUN && number <= EMBXGTAR) || number == EMBXACK || number == EMBXSBUSY;
}

static bool connection_broken(int number)
{
    return number == ECONNRESET || number == EPIPE || number == EBADF || number == EIO || number == ECONNREFUSED ||
           number == ENOTCONN;
}

static void disconnect_bus(struct lumi_rig_drive *drive)
{
    if (drive->connected)
        modbus_close(drive->bus);
    drive->connected = false;
}

/* A line that another program has locked (the board's own, say) is not spoken on. */
static bool connect_bus(struct lumi_rig_drive *drive)
{
    if (drive->connected)
        return true;
    drive->connected = modbus_connect(drive->bus) == 0;
    if (drive->connected && drive->serial && flock(modbus_get_socket(drive->bus), LOCK_EX | LOCK_NB)) {
        disconnect_bus(drive);
        errno = EBUSY;
    }
    return drive->connected;
}

static int try_exchange(struct lumi_rig_drive *drive, enum direction direction, const struct lumi_drive_register *reg,
                        uint16_t *words)
{
    int count = reg->width / 16, done;

    if (!connect_bus(drive))
        return -1;
    modbus_flush(drive->bus);
    if (direction == READ && reg->input)
        done = modbus_read_input_registers(drive->bus, reg->address, count, words);
    else if (direction == READ)
        done = modbus_read_registers(drive->bus, reg->address, count, words);
    else if (count == 1)
        done = modbus_write_register(drive->bus, reg->address, words[0]);
    else
        done = modbus_write_registers(drive->bus, reg->address, count, words);
    return done == count ? 0 : -1;
}

static int exchange(struct lumi_rig_drive *drive, enum direction direction, const char *what,
                    const struct lumi_drive_register *reg, uint16_t *words, struct lumi_error *error)
{
    char text[256];
    int number = 0;

    for (int tries = 0; tries <= drive->map.retries; tries++) {
        errno = 0;
        if (!try_exchange(drive, direction, reg, words))
            return LUMI_OK;
        number = errno ? errno : EIO;
        if (connection_broken(number))
            disconnect_bus(drive);
        if (!worth_another_try(number))
            break;
    }
    return lumi_fail(error, LUMI_ERR_IO, "drive %s (%s): %s %s, register %d: %s", drive->map.name, drive->name,
                     direction == READ ? "reading" : "writing", what, reg->address,
                     explain(number, drive, text, sizeof text));
}

static int read_number(struct lumi_rig_drive *drive, const char *what, const struct lumi_drive_register *reg,
                       uint32_t *bits, struct lumi_error *error)
{
    uint16_t words[2] = {0};

    LUMI_TRY(exchange(drive, READ, what, reg, words, error));
    *bits = words[0];
    if (reg->width == 32)
        *bits = drive->map.low_word_first ? words[0] | (uint32_t)words[1] << 16 : words[1] | (uint32_t)words[0] << 16;
    return LUMI_OK;
}

static double as_signed(const struct lumi_drive_register *reg, uint32_t bits)
{
    return (reg->width == 32 ? (double)(int32_t)bits : (double)(int16_t)bits) * reg->multiplier;
}

static int write_number(struct lumi_rig_drive *drive, const char *what, const struct lumi_drive_register *reg,
                        double value, struct lumi_error *error)
{
    double raw = round(value / reg->multiplier), limit = reg->width == 32 ? 2147483647.0 : 32767.0;
    uint16_t words[2];
    uint32_t bits;

    if (!(fabs(raw) <= limit))
        return lumi_fail(error, LUMI_ERR_ARG, "drive %s: %s %.0f does not fit %d bits", drive->map.name, what, raw,
                         reg->width);
    bits = (uint32_t)(int32_t)raw;
    words[0] = (uint16_t)bits;
    if (reg->width == 32) {
        words[drive->map.low_word_first] = (uint16_t)(bits >> 16);
        words[!drive->map.low_word_first] = (uint16_t)bits;
    }
    return exchange(drive, WRITE, what, reg, words, error);
}

static int command(struct lumi_rig_drive *drive, const char *what, const struct lumi_drive_command *told,
                   struct lumi_error *error)
{
    struct lumi_drive_register reg = {.used = true, .address = told->address, .width = 16, .multiplier = 1};
    uint16_t word = (uint16_t)told->value;

    if (!told->used)
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "drive %s: its register map has no [%s]", drive->map.name, what);
    LUMI_TRY(exchange(drive, WRITE, what, &reg, &word, error));
    if (told->clear < 0)
        return LUMI_OK;
    word = (uint16_t)told->clear;
    return exchange(drive, WRITE, what, &reg, &word, error);
}

/* ---- what others call ---- */

static bool bit_of(const struct lumi_drive_bit *bit, uint32_t word, bool otherwise)
{
    return bit->used ? ((word >> bit->bit & 1) != 0) != bit->inverted : otherwise;
}

int lumi_rig_drive_status(struct lumi_rig_drive *drive, struct lumi_rig_drive_status *status, struct lumi_error *error)
{
    const struct lumi_drive_map *map = &drive->map;
    uint32_t word, counts, code = 0;

    memset(status, 0, sizeof *status);
    LUMI_TRY(read_number(drive, "status", &map->status, &word, error));
    status->enabled = bit_of(&map->enabled, word, false);
    status->reached = bit_of(&map->reached, word, false);
    status->fault = bit_of(&map->fault, word, false);
    status->ready = bit_of(&map->ready, word, true);
    status->homed = bit_of(&map->homed, word, true);
    if (map->position.used) {
        LUMI_TRY(read_number(drive, "position", &map->position, &counts, error));
        status->counts = as_signed(&map->position, counts);
        status->turns = (status->counts - map->zero_counts) / map->counts_per_turn;
        status->position_known = true;
    }
    if (status->fault && map->fault_code.used)
        LUMI_TRY(read_number(drive, "fault code", &map->fault_code, &code, error));
    status->fault_code = (int)code;
    return LUMI_OK;
}

int lumi_rig_drive_go(struct lumi_rig_drive *drive, double turns, struct lumi_error *error)
{
    const struct lumi_drive_map *map = &drive->map;

    LUMI_TRY(write_number(drive, "target", &map->target, map->zero_counts + turns * map->counts_per_turn, error));
    if (map->speed.used && map->speed_counts_per_s > 0)
        LUMI_TRY(write_number(drive, "speed", &map->speed, map->speed_counts_per_s, error));
    return command(drive, "start", &map->start, error);
}

int lumi_rig_drive_stop(struct lumi_rig_drive *drive, struct lumi_error *error)
{
    return command(drive, "stop", &drive->map.stop, error);
}

int lumi_rig_drive_reset(struct lumi_rig_drive *drive, struct lumi_error *error)
{
    return command(drive, "reset", &drive->map.reset, error);
}

int lumi_rig_drive_home(struct lumi_rig_drive *drive, struct lumi_error *error)
{
    return command(drive, "home", &drive->map.home, error);
}

const struct lumi_drive_map *lumi_rig_drive_map(const struct lumi_rig_drive *drive)
{
    return &drive->map;
}

/* ---- addresses ---- */

static bool whole_number(const char *text, int low, int high, int *value)
{
    char *end;
    long number = strtol(text, &end, 10);

    *value = (int)number;
    return end != text && !*end && number >= low && number <= high;
}

static int open_rtu(const char *address, modbus_t **bus, struct lumi_error *error)
{
    g_auto(GStrv) fields = g_strsplit(address + 4, ",", -1);
    int baud = 19200, stop = 1; /* the standard's: 19200, even parity */
    char parity = 'E';

    if (!fields[0] || !fields[0][0])
        return lumi_fail(error, LUMI_ERR_ARG, "%s: no path (rtu:/dev/ttyUSB1)", address);
    for (char **field = fields + 1; *field; field++) {
        const char *value = strchr(*field, '=');
        bool good = false;
        if (value && g_str_has_prefix(*field, "baud="))
            good = whole_number(value + 1, 300, 4000000, &baud);
        else if (value && g_str_has_prefix(*field, "stop="))
            good = whole_number(value + 1, 1, 2, &stop);
        else if (value && g_str_has_prefix(*field, "parity=") && strchr("NEO", value[1]) && value[1] && !value[2]) {
            good = true;
            parity = value[1];
        }
        if (!good)
            return lumi_fail(error, LUMI_ERR_ARG, "%s: '%s' (baud=19200, parity=N, E or O, stop=1 or 2)", address,
                             *field);
    }
    *bus = modbus_new_rtu(fields[0], baud, parity, 8, stop);
    return *bus ? LUMI_OK : lumi_fail(error, LUMI_ERR_ARG, "%s: %s", address, modbus_strerror(errno));
}

static int open_tcp(const char *address, modbus_t **bus, struct lumi_error *error)
{
    const char *host = address + 4, *colon = strrchr(host, ':');
    g_autofree char *node = colon ? g_strndup(host, (gsize)(colon - host)) : g_strdup(host);
    const char *service = colon ? colon + 1 : "502";
    int port;

    if (!node[0] || !whole_number(service, 1, 65535, &port))
        return lumi_fail(error, LUMI_ERR_ARG, "%s: tcp:HOST or tcp:HOST:PORT wanted", address);
    *bus = modbus_new_tcp_pi(node, service);
    return *bus ? LUMI_OK : lumi_fail(error, LUMI_ERR_ARG, "%s: %s", address, modbus_strerror(errno));
}

static int set_up(struct lumi_rig_drive *drive, struct lumi_error *error)
{
    uint32_t seconds = (uint32_t)drive->map.timeout;
    uint32_t microseconds = (uint32_t)((drive->map.timeout - seconds) * 1e6);

    modbus_set_error_recovery(drive->bus, MODBUS_ERROR_RECOVERY_NONE);
    if (modbus_set_slave(drive->bus, drive->map.unit) || modbus_set_response_timeout(drive->bus, seconds, microseconds))
        return lumi_fail(error, LUMI_ERR_ARG, "%s: %s", drive->name, modbus_strerror(errno));
    if (!connect_bus(drive) && errno == EBUSY)
        return lumi_fail(error, LUMI_ERR_BUSY, "%s: another program has it locked", drive->name);
    if (!drive->connected)
        return lumi_fail(error, errno == ENOENT ? LUMI_ERR_NOTFOUND : LUMI_ERR_IO, "%s: %s", drive->name,
                         modbus_strerror(errno));
    return LUMI_OK;
}

int lumi_rig_drive_open(const char *address, const struct lumi_drive_map *map, struct lumi_rig_drive **result,
                        struct lumi_error *error)
{
    struct lumi_rig_drive *drive;
    modbus_t *bus = NULL;
    int code;

    *result = NULL;
    if (g_str_has_prefix(address, "rtu:"))
        LUMI_TRY(open_rtu(address, &bus, error));
    else if (g_str_has_prefix(address, "tcp:"))
        LUMI_TRY(open_tcp(address, &bus, error));
    else
        return lumi_fail(error, LUMI_ERR_ARG, "'%s' is no address of a drive: rtu:/dev/ttyUSB1 or tcp:HOST:PORT",
                         address);
    drive = g_new0(struct lumi_rig_drive, 1);
    drive->map = *map;
    drive->bus = bus;
    drive->name = g_strdup(address);
    drive->serial = address[0] == 'r';
    code = set_up(drive, error);
    if (code != LUMI_OK) {
        lumi_rig_drive_close(drive);
        return code;
    }
    *result = drive;
    return LUMI_OK;
}

void lumi_rig_drive_close(struct lumi_rig_drive *drive)
{
    if (!drive)
        return;
    disconnect_bus(drive);
    modbus_free(drive->bus);
    g_free(drive->name);
    g_free(drive);
}
