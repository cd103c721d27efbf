/* Reading the register map of a drive: sections, keys, numbers. Trusts nothing. */
#include "daemon/rig/drive_map.h"

#include "proto/mechanism/text_line.h"

#include <glib.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

enum kind { NAME, INTEGER, REAL, WORD_ORDER, TABLE, WIDTH, BIT, MULTIPLIER };
enum section { DRIVE, SCALE, STATUS, POSITION, FAULT_CODE, TARGET, SPEED, START, STOP, RESET, HOME, SECTIONS };
static const char *const section_names[SECTIONS] = {"drive", "scale", "status", "position", "fault-code", "target",
                                                    "speed", "start", "stop",   "reset",    "home"};
static const bool wanted[SECTIONS] = {
    [DRIVE] = true, [SCALE] = true, [STATUS] = true, [POSITION] = true, [TARGET] = true, [START] = true};

#define MAP(member) offsetof(struct lumi_drive_map, member)
#define REGISTER(s, m)                                                                                                 \
    {s, "address", INTEGER, MAP(m.address), true, 0, 65535}, {s, "table", TABLE, MAP(m.input), false, 0, 0},           \
        {s, "width", WIDTH, MAP(m.width), false, 0, 0},                                                                \
    {                                                                                                                  \
        s, "multiplier", MULTIPLIER, MAP(m.multiplier), false, 0, 0                                                    \
    }
#define COMMAND(s, m)                                                                                                  \
    {s, "address", INTEGER, MAP(m.address), true, 0, 65535}, {s, "value", INTEGER, MAP(m.value), true, 0, 65535},      \
    {                                                                                                                  \
        s, "clear", INTEGER, MAP(m.clear), false, 0, 65535                                                             \
    }

static const struct key {
    enum section section;
    const char *name;
    enum kind kind;
    size_t offset;
    bool needed; /* where its section is there */
    double low, high;
} keys[] = {
    {DRIVE, "name", NAME, MAP(name), true, 0, 0},
    {DRIVE, "unit", INTEGER, MAP(unit), false, 1, 247},
    {DRIVE, "timeout_s", REAL, MAP(timeout), false, 0.01, 10},
    {DRIVE, "retries", INTEGER, MAP(retries), false, 0, 10},
    {DRIVE, "words", WORD_ORDER, MAP(low_word_first), false, 0, 0},
    {DRIVE, "move_timeout_s", REAL, MAP(move_timeout), false, 0.1, 3600},
    {DRIVE, "home_timeout_s", REAL, MAP(home_timeout), false, 0.1, 3600},
    {SCALE, "counts_per_turn", REAL, MAP(counts_per_turn), true, -2e9, 2e9},
    {SCALE, "zero_counts", REAL, MAP(zero_counts), false, -2e9, 2e9},
    {SCALE, "tolerance_counts", REAL, MAP(tolerance), false, 0, 2e9},
    REGISTER(STATUS, status),
    {STATUS, "enabled", BIT, MAP(enabled), true, 0, 0},
    {STATUS, "reached", BIT, MAP(reached), true, 0, 0},
    {STATUS, "fault", BIT, MAP(fault), true, 0, 0},
    {STATUS, "ready", BIT, MAP(ready), false, 0, 0},
    {STATUS, "homed", BIT, MAP(homed), false, 0, 0},
    REGISTER(POSITION, position),
    REGISTER(FAULT_CODE, fault_code),
    REGISTER(TARGET, target),
    REGISTER(SPEED, speed),
    {SPEED, "counts_per_s", REAL, MAP(speed_counts_per_s), true, 0, 2e9},
    COMMAND(START, start),
    COMMAND(STOP, stop),
    COMMAND(RESET, reset),
    COMMAND(HOME, home),
};
#define KEYS ((int)(sizeof keys / sizeof *keys))

struct parser {
    struct lumi_drive_map *map;
    const char *source;
    struct lumi_error *error;
    int line;
    enum section section; /* SECTIONS: none yet */
    bool seen[SECTIONS], set[KEYS];
};

static int fail(struct parser *p, const char *format, ...) __attribute__((format(printf, 2, 3)));
static int fail(struct parser *p, const char *format, ...)
{
    char text[512];
    va_list arguments;

    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    if (p->line)
        return lumi_fail(p->error, LUMI_ERR_FORMAT, "%s:%d: %s", p->source, p->line, text);
    return lumi_fail(p->error, LUMI_ERR_FORMAT, "%s: %s", p->source, text);
}

/* Decimal, or hexadecimal as drives' manuals write registers. */
static int read_number(struct parser *p, const struct key *key, const char *text, double *value)
{
    char *end;

    if (text[0] == '0' && (text[1] == 'x' || text[1] == 'X')) {
        if (!g_ascii_isxdigit(text[2]) || strlen(text) > 10)
            return fail(p, "%s: '%s' is no number", key->name, text);
        *value = (double)g_ascii_strtoull(text + 2, &end, 16);
    } else {
        if (!g_ascii_isdigit(text[0]) && !strchr("+-.", text[0]))
            return fail(p, "%s: '%s' is no number", key->name, text);
        *value = g_ascii_strtod(text, &end);
    }
    if (end == text || *end || !isfinite(*value))
        return fail(p, "%s: '%s' is no number", key->name, text);
    return LUMI_OK;
}

static int read_ranged(struct parser *p, const struct key *key, const char *text, double *value)
{
    LUMI_TRY(read_number(p, key, text, value));
    if (*value < key->low || *value > key->high)
        return fail(p, "%s = %s: from %g to %g", key->name, text, key->low, key->high);
    if (key->kind == INTEGER && *value != floor(*value))
        return fail(p, "%s = %s: a whole number", key->name, text);
    return LUMI_OK;
}

static int read_choice(struct parser *p, const struct key *key, const char *text, const char *no, const char *yes,
                       bool *value)
{
    *value = !strcmp(text, yes);
    if (!*value && strcmp(text, no))
        return fail(p, "%s = %s: '%s' or '%s'", key->name, text, no, yes);
    return LUMI_OK;
}

static int read_bit(struct parser *p, const struct key *key, const char *text, struct lumi_drive_bit *bit)
{
    double number = -1;

    bit->inverted = text[0] == '!';
    LUMI_TRY(read_number(p, key, text + bit->inverted, &number));
    if (number < 0 || number > 31 || number != floor(number))
        return fail(p, "%s = %s: a bit from 0 to 31, or !BIT where it means the opposite", key->name, text);
    bit->bit = (int)number;
    bit->used = true;
    return LUMI_OK;
}

static int read_name(struct parser *p, const char *text, char *name)
{
    size_t length = strlen(text);

    if (!length || length >= LUMI_DRIVE_MAP_NAME)
        return fail(p, "name: 1 to %d letters", LUMI_DRIVE_MAP_NAME - 1);
    for (size_t i = 0; i < length; i++)
        if (!g_ascii_isgraph(text[i]))
            return fail(p, "name: letters, digits and signs, no spaces");
    memcpy(name, text, length + 1);
    return LUMI_OK;
}

static int read_value(struct parser *p, const struct key *key, const char *text)
{
    void *at = (char *)p->map + key->offset;
    double number = 0;

    switch (key->kind) {
    case NAME:
        return read_name(p, text, at);
    case INTEGER:
        LUMI_TRY(read_ranged(p, key, text, &number));
        *(int *)at = (int)number;
        return LUMI_OK;
    case REAL:
        return read_ranged(p, key, text, at);
    case MULTIPLIER:
        LUMI_TRY(read_number(p, key, text, at));
        return fabs(*(double *)at) < 1e-9 || fabs(*(double *)at) > 1e9 ? fail(p, "multiplier = %s: not 0", text)
                                                                       : LUMI_OK;
    case WORD_ORDER:
        return read_choice(p, key, text, "high-first", "low-first", at);
    case TABLE:
        return read_choice(p, key, text, "holding", "input", at);
    case WIDTH:
        *(int *)at = !strcmp(text, "32") ? 32 : 16;
        return strcmp(text, "32") && strcmp(text, "16") ? fail(p, "width = %s: 16 or 32", text) : LUMI_OK;
    case BIT:
        return read_bit(p, key, text, at);
    }
    return LUMI_ERR_INTERNAL;
}

static void set_defaults(struct lumi_drive_map *map)
{
    struct lumi_drive_register *registers[] = {&map->status, &map->position, &map->fault_code, &map->target,
                                               &map->speed};
    struct lumi_drive_command *commands[] = {&map->start, &map->stop, &map->reset, &map->home};

    memset(map, 0, sizeof *map);
    map->unit = 1;
    map->timeout = 0.2;
    map->retries = 2;
    map->move_timeout = 30;
    map->home_timeout = 120;
    for (int i = 0; i < 5; i++) {
        registers[i]->width = 16;
        registers[i]->multiplier = 1;
    }
    for (int i = 0; i < 4; i++)
        commands[i]->clear = -1;
}

static void mark_used(struct parser *p)
{
    struct lumi_drive_map *map = p->map;

    map->status.used = p->seen[STATUS];
    map->position.used = p->seen[POSITION];
    map->fault_code.used = p->seen[FAULT_CODE];
    map->target.used = p->seen[TARGET];
    map->speed.used = p->seen[SPEED];
    map->start.used = p->seen[START];
    map->stop.used = p->seen[STOP];
    map->reset.used = p->seen[RESET];
    map->home.used = p->seen[HOME];
}

static int check_width(struct parser *p, const struct lumi_drive_register *reg, const char *name)
{
    if (reg->used && reg->width == 32 && reg->address > 65534)
        return fail(p, "[%s]: 32 bits at register %d are past the last", name, reg->address);
    return LUMI_OK;
}

static int check_bit(struct parser *p, const struct lumi_drive_bit *bit, const char *name)
{
    if (bit->used && bit->bit >= p->map->status.width)
        return fail(p, "[status]: bit %d (%s) of %d", bit->bit, name, p->map->status.width);
    return LUMI_OK;
}

static int check(struct parser *p)
{
    struct lumi_drive_map *map = p->map;

    p->line = 0;
    for (int s = 0; s < SECTIONS; s++)
        if (wanted[s] && !p->seen[s])
            return fail(p, "section [%s] is missing", section_names[s]);
    for (int k = 0; k < KEYS; k++)
        if (keys[k].needed && p->seen[keys[k].section] && !p->set[k])
            return fail(p, "[%s]: '%s' is missing", section_names[keys[k].section], keys[k].name);
    mark_used(p);
    if (fabs(map->counts_per_turn) < 1)
        return fail(p, "[scale]: counts_per_turn = %g: at least 1, or at most -1", map->counts_per_turn);
    if (map->target.input || map->speed.input)
        return fail(p, "[target] and [speed] are written: an input register cannot be");
    LUMI_TRY(check_width(p, &map->status, "status"));
    LUMI_TRY(check_width(p, &map->position, "position"));
    LUMI_TRY(check_width(p, &map->fault_code, "fault-code"));
    LUMI_TRY(check_width(p, &map->target, "target"));
    LUMI_TRY(check_width(p, &map->speed, "speed"));
    LUMI_TRY(check_bit(p, &map->enabled, "enabled"));
    LUMI_TRY(check_bit(p, &map->reached, "reached"));
    LUMI_TRY(check_bit(p, &map->fault, "fault"));
    LUMI_TRY(check_bit(p, &map->ready, "ready"));
    return check_bit(p, &map->homed, "homed");
}

static int read_section(struct parser *p, char *line)
{
    char *end = strchr(line, ']');

    if (!end || end[1])
        return fail(p, "'%.40s': a section is [name]", line);
    *end = '\0';
    for (int s = 0; s < SECTIONS; s++)
        if (!strcmp(line + 1, section_names[s])) {
            if (p->seen[s])
                return fail(p, "[%s] comes twice", section_names[s]);
            p->seen[s] = true;
            p->section = (enum section)s;
            return LUMI_OK;
        }
    return fail(p, "[%.40s] is no section of a register map", line + 1);
}

static int read_line(struct parser *p, char *line)
{
    char *equals;

    g_strstrip(line);
    if (!line[0] || line[0] == '#' || line[0] == ';')
        return LUMI_OK;
    if (line[0] == '[')
        return read_section(p, line);
    equals = strchr(line, '=');
    if (!equals)
        return fail(p, "'%.40s': neither [section] nor key = value", line);
    *equals = '\0';
    g_strchomp(line);
    char *value = equals + 1;
    g_strchug(value);
    if (p->section == SECTIONS)
        return fail(p, "'%.40s' stands before the first section", line);
    for (int k = 0; k < KEYS; k++)
        if (keys[k].section == p->section && !strcmp(line, keys[k].name)) {
            if (p->set[k])
                return fail(p, "'%s' comes twice", line);
            p->set[k] = true;
            return read_value(p, &keys[k], value);
        }
    return fail(p, "'%.40s' is no key of [%s]", line, section_names[p->section]);
}

int lumi_drive_map_parse(const char *text, size_t size, const char *source, struct lumi_drive_map *map,
                         struct lumi_error *error)
{
    struct parser p = {.map = map, .source = source, .error = error, .section = SECTIONS};
    char line[256];

    set_defaults(map);
    if (size > LUMI_DRIVE_MAP_TEXT_MAX)
        return lumi_fail(error, LUMI_ERR_LIMIT, "%s: longer than %d bytes", source, LUMI_DRIVE_MAP_TEXT_MAX);
    for (size_t at = 0; at < size;) {
        p.line++;
        if (!lumi_text_line(text, size, &at, line, sizeof line))
            return fail(&p, "the line is too long or no text");
        LUMI_TRY(read_line(&p, line));
    }
    return check(&p);
}
