/* The rig profile as text: sections, keys, values (docs/rig-profile.md). Reader and writer go by the same table. */
#include "proto/mechanism/rig.h"

#include <errno.h>
#include <limits.h>
#include <locale.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define DEGREE (LUMI_PI / 180)

enum section { RIG, DRIVE, SWEEP, STRING, UNCERTAINTY, LENS, CAMERA, SECTIONS };
static const char *const section_names[SECTIONS] = {"rig", "drive", "sweep", "string", "uncertainty", "lens", "camera"};

enum kind { WORD, INTEGER, REAL, ANGLE, YES_NO, RUN, MODEL, LENS_NAME };

/* An ANGLE is written as "<name>_deg", or as "<name>_rad" where no decimal number of degrees gives the very same
 * radians. */
static const struct key {
    enum section section;
    const char *name;
    enum kind kind;
    size_t offset; /* into struct lumi_rig, or into the lens or camera */
} keys[] = {
    {RIG, "name", WORD, offsetof(struct lumi_rig, name)},
    {DRIVE, "motor_steps", INTEGER, offsetof(struct lumi_rig, motor_steps)},
    {DRIVE, "microsteps", INTEGER, offsetof(struct lumi_rig, microsteps)},
    {DRIVE, "gear_motor", INTEGER, offsetof(struct lumi_rig, gear_motor)},
    {DRIVE, "gear_platform", INTEGER, offsetof(struct lumi_rig, gear_platform)},
    {DRIVE, "direction", INTEGER, offsetof(struct lumi_rig, direction)},
    {DRIVE, "index", ANGLE, offsetof(struct lumi_rig, index)},
    {SWEEP, "positions", INTEGER, offsetof(struct lumi_rig, positions)},
    {SWEEP, "turns", INTEGER, offsetof(struct lumi_rig, turns)},
    {STRING, "held", YES_NO, offsetof(struct lumi_rig, string.held)},
    {STRING, "run", RUN, offsetof(struct lumi_rig, string.run)},
    {STRING, "length_m", REAL, offsetof(struct lumi_rig, string.length)},
    {STRING, "per_turn_m", REAL, offsetof(struct lumi_rig, string.per_turn)},
    {STRING, "hold_m", REAL, offsetof(struct lumi_rig, string.hold)},
    {STRING, "anchor_m", REAL, offsetof(struct lumi_rig, string.anchor)},
    {STRING, "hold_angle", ANGLE, offsetof(struct lumi_rig, string.hold_angle)},
    {UNCERTAINTY, "position_m", REAL, offsetof(struct lumi_rig, uncertainty.position_m)},
    {UNCERTAINTY, "rotation", ANGLE, offsetof(struct lumi_rig, uncertainty.rotation)},
    {UNCERTAINTY, "turn", ANGLE, offsetof(struct lumi_rig, uncertainty.turn)},
    {UNCERTAINTY, "drop", ANGLE, offsetof(struct lumi_rig, uncertainty.drop)},
    {LENS, "model", MODEL, offsetof(struct lumi_rig_lens, lens.model)},
    {LENS, "width", INTEGER, offsetof(struct lumi_rig_lens, lens.width)},
    {LENS, "height", INTEGER, offsetof(struct lumi_rig_lens, lens.height)},
    {LENS, "fx", REAL, offsetof(struct lumi_rig_lens, lens.fx)},
    {LENS, "fy", REAL, offsetof(struct lumi_rig_lens, lens.fy)},
    {LENS, "cx", REAL, offsetof(struct lumi_rig_lens, lens.cx)},
    {LENS, "cy", REAL, offsetof(struct lumi_rig_lens, lens.cy)},
    {LENS, "k1", REAL, offsetof(struct lumi_rig_lens, lens.k1)},
    {LENS, "k2", REAL, offsetof(struct lumi_rig_lens, lens.k2)},
    {LENS, "k3", REAL, offsetof(struct lumi_rig_lens, lens.k3)},
    {LENS, "k4", REAL, offsetof(struct lumi_rig_lens, lens.k4)},
    {LENS, "p1", REAL, offsetof(struct lumi_rig_lens, lens.p1)},
    {LENS, "p2", REAL, offsetof(struct lumi_rig_lens, lens.p2)},
    {CAMERA, "lens", LENS_NAME, 0},
    {CAMERA, "angle", ANGLE, offsetof(struct lumi_rig_camera, angle)},
    {CAMERA, "azimuth", ANGLE, offsetof(struct lumi_rig_camera, azimuth)},
    {CAMERA, "radius_m", REAL, offsetof(struct lumi_rig_camera, radius)},
    {CAMERA, "roll", ANGLE, offsetof(struct lumi_rig_camera, roll)},
    {CAMERA, "pan", ANGLE, offsetof(struct lumi_rig_camera, pan)},
    {CAMERA, "tilt", ANGLE, offsetof(struct lumi_rig_camera, tilt)},
    {CAMERA, "offset_m", REAL, offsetof(struct lumi_rig_camera, offset_m)},
};
#define KEYS ((int)(sizeof keys / sizeof *keys))

static const char *const model_names[] = {"pinhole", "fisheye"}; /* LUMI_LENS_BROWN, LUMI_LENS_FISHEYE */

/* ---- Numbers ---- */

/* strtod and printf take the decimal point from the program's locale; profiles always have '.'. */
static char locale_point(void)
{
    const struct lconv *conventions = localeconv();

    return conventions && conventions->decimal_point[0] ? conventions->decimal_point[0] : '.';
}

static bool read_real(const char *text, double *value)
{
    char copy[64], *end;
    size_t length = strlen(text);

    if (length == 0 || length >= sizeof copy || strspn(text, "+-.0123456789eE") != length)
        return false;
    memcpy(copy, text, length + 1);
    for (char *c = copy; *c; c++)
        if (*c == '.')
            *c = locale_point();
    *value = strtod(copy, &end);
    return *end == '\0' && isfinite(*value);
}

/* The shortest decimal number that reads as `value` after scaling by `unit`; false if there is none. */
static bool print_real(double value, double unit, char text[40])
{
    for (int digits = 1; digits <= 17; digits++) {
        double back;
        snprintf(text, 40, "%.*g", digits, value / unit);
        for (char *c = text; *c; c++)
            if (*c == locale_point())
                *c = '.';
        if (read_real(text, &back) && back * unit == value)
            return true;
    }
    return false;
}

/* ---- Reading ---- */

struct parser {
    struct lumi_rig *rig;
    const char *source;
    struct lumi_error *error;
    int line;
    enum section section; /* SECTIONS: none yet */
    int index;            /* of the lens or camera */
    bool seen[SECTIONS];
    bool set[KEYS]; /* in this section */
    char lens_of[LUMI_RIG_CAMERAS][LUMI_RIG_NAME];
};

#define FAIL(code, ...) (lumi_fail(p->error, code, __VA_ARGS__), place(p))

static int place(const struct parser *p)
{
    if (!p->error)
        return LUMI_ERR_FORMAT;
    return lumi_fail_prefix(p->error, "%s:%d", p->source, p->line);
}

static char *trim(char *text)
{
    char *end;

    text += strspn(text, " \t\r");
    end = text + strlen(text);
    while (end > text && strchr(" \t\r", end[-1]))
        *--end = '\0';
    return text;
}

static int open_section(struct parser *p, char *text)
{
    char *name = strpbrk(text, " \t");
    int s;

    if (name) {
        *name++ = '\0';
        name = trim(name);
    }
    for (s = 0; s < SECTIONS && strcmp(text, section_names[s]); s++)
        ;
    if (s == SECTIONS)
        return FAIL(LUMI_ERR_FORMAT, "no section '%s' is known", text);
    bool named = s == LENS || s == CAMERA;
    if (named != (name && *name))
        return FAIL(LUMI_ERR_FORMAT, named ? "section '%s' wants a name" : "section '%s' has no name", text);
    if (p->seen[s] && !named)
        return FAIL(LUMI_ERR_FORMAT, "section '%s' comes twice", text);
    if (named && strlen(name) >= LUMI_RIG_NAME)
        return FAIL(LUMI_ERR_FORMAT, "the name of a %s is too long", text);
    if (s == LENS) {
        if (p->rig->lens_count == LUMI_RIG_LENSES)
            return FAIL(LUMI_ERR_FORMAT, "more than %d lenses", LUMI_RIG_LENSES);
        p->index = p->rig->lens_count++;
        memcpy(p->rig->lenses[p->index].name, name, strlen(name) + 1);
    } else if (s == CAMERA) {
        if (p->rig->camera_count == LUMI_RIG_CAMERAS)
            return FAIL(LUMI_ERR_FORMAT, "more than %d cameras", LUMI_RIG_CAMERAS);
        p->index = p->rig->camera_count++;
        memcpy(p->rig->cameras[p->index].name, name, strlen(name) + 1);
    }
    p->section = (enum section)s;
    p->seen[s] = true;
    memset(p->set, 0, sizeof p->set);
    return LUMI_OK;
}

static void *target(struct lumi_rig *rig, const struct key *key, int index)
{
    char *base = (char *)rig;

    if (key->section == LENS)
        base = (char *)&rig->lenses[index];
    else if (key->section == CAMERA)
        base = (char *)&rig->cameras[index];
    return base + key->offset;
}

static int set_value(struct parser *p, const struct key *key, double unit, const char *value)
{
    void *at = target(p->rig, key, p->index);
    double number;

    switch (key->kind) {
    case WORD:
    case LENS_NAME:
        if (strlen(value) >= LUMI_RIG_NAME)
            return FAIL(LUMI_ERR_FORMAT, "%s: the name is too long", key->name);
        memcpy(key->kind == WORD ? (char *)at : p->lens_of[p->index], value, strlen(value) + 1);
        return LUMI_OK;
    case INTEGER:
        if (!read_real(value, &number) || number != floor(number) || fabs(number) > 1e9)
            return FAIL(LUMI_ERR_FORMAT, "%s: '%s' is no whole number", key->name, value);
        *(int *)at = (int)number;
        return LUMI_OK;
    case REAL:
    case ANGLE:
        if (!read_real(value, &number))
            return FAIL(LUMI_ERR_FORMAT, "%s: '%s' is no number", key->name, value);
        *(double *)at = number * unit;
        return LUMI_OK;
    case YES_NO:
        if (strcmp(value, "yes") && strcmp(value, "no"))
            return FAIL(LUMI_ERR_FORMAT, "%s: '%s' is neither yes nor no", key->name, value);
        *(bool *)at = !strcmp(value, "yes");
        return LUMI_OK;
    case RUN:
        if (strcmp(value, "arc") && strcmp(value, "straight"))
            return FAIL(LUMI_ERR_FORMAT, "%s: '%s' is neither arc nor straight", key->name, value);
        *(enum lumi_rig_run *)at = strcmp(value, "arc") ? LUMI_RIG_RUN_STRAIGHT : LUMI_RIG_RUN_ARC;
        return LUMI_OK;
    case MODEL:
        if (strcmp(value, model_names[0]) && strcmp(value, model_names[1]))
            return FAIL(LUMI_ERR_FORMAT, "%s: '%s' is neither pinhole nor fisheye", key->name, value);
        *(enum lumi_lens_model *)at = strcmp(value, model_names[0]) ? LUMI_LENS_FISHEYE : LUMI_LENS_BROWN;
        return LUMI_OK;
    }
    return LUMI_ERR_INTERNAL;
}

/* Whether `name` is the key's name, with the unit an angle carries. */
static bool key_matches(const struct key *key, const char *name, double *unit)
{
    size_t length = strlen(key->name);

    *unit = 1;
    if (strncmp(name, key->name, length))
        return false;
    if (key->kind != ANGLE)
        return name[length] == '\0';
    if (!strcmp(name + length, "_deg"))
        *unit = DEGREE;
    else if (strcmp(name + length, "_rad"))
        return false;
    return true;
}

static int parse_line(struct parser *p, char *line)
{
    char *text = trim(line), *equals;
    double unit;

    if (*text == '\0' || *text == '#' || *text == ';')
        return LUMI_OK;
    if (*text == '[') {
        size_t length = strlen(text);
        if (text[length - 1] != ']')
            return FAIL(LUMI_ERR_FORMAT, "a section's ']' is missing");
        text[length - 1] = '\0';
        return open_section(p, trim(text + 1));
    }
    equals = strchr(text, '=');
    if (!equals)
        return FAIL(LUMI_ERR_FORMAT, "neither a section nor 'key = value'");
    if (p->section == SECTIONS)
        return FAIL(LUMI_ERR_FORMAT, "a key before the first section");
    *equals = '\0';
    text = trim(text);
    for (int i = 0; i < KEYS; i++)
        if (keys[i].section == p->section && key_matches(&keys[i], text, &unit)) {
            if (p->set[i])
                return FAIL(LUMI_ERR_FORMAT, "'%s' comes twice", text);
            p->set[i] = true;
            return set_value(p, &keys[i], unit, trim(equals + 1));
        }
    return FAIL(LUMI_ERR_FORMAT, "section '%s' has no key '%s'", section_names[p->section], text);
}

static int resolve_lenses(struct parser *p)
{
    for (int i = 0; i < p->rig->camera_count; i++) {
        struct lumi_rig_camera *camera = &p->rig->cameras[i];
        camera->lens = -1;
        for (int j = 0; j < p->rig->lens_count; j++)
            if (!strcmp(p->lens_of[i], p->rig->lenses[j].name))
                camera->lens = j;
        if (camera->lens < 0)
            return lumi_fail(p->error, LUMI_ERR_FORMAT, "%s: camera '%s': no lens '%s'", p->source, camera->name,
                             p->lens_of[i]);
    }
    return LUMI_OK;
}

int lumi_rig_parse(const char *text, size_t size, const char *source, struct lumi_rig *rig, struct lumi_error *error)
{
    struct parser parser = {.rig = rig, .source = source, .error = error, .section = SECTIONS};
    char line[256];

    memset(rig, 0, sizeof *rig);
    if (size > LUMI_RIG_TEXT_MAX)
        return lumi_fail(error, LUMI_ERR_LIMIT, "%s: a profile of %zu bytes, at most %d are read", source, size,
                         LUMI_RIG_TEXT_MAX);
    for (size_t at = 0; at < size;) {
        const char *end = memchr(text + at, '\n', size - at);
        size_t length = end ? (size_t)(end - text) - at : size - at;
        struct parser *p = &parser;
        p->line++;
        if (length >= sizeof line || memchr(text + at, '\0', length))
            return FAIL(LUMI_ERR_FORMAT, "the line is too long or no text");
        memcpy(line, text + at, length);
        line[length] = '\0';
        LUMI_TRY(parse_line(p, line));
        at += length + 1;
    }
    for (int s = 0; s < SECTIONS; s++)
        if (!parser.seen[s] && s != UNCERTAINTY)
            return lumi_fail(error, LUMI_ERR_FORMAT, "%s: section '%s' is missing", source, section_names[s]);
    LUMI_TRY(resolve_lenses(&parser));
    if (lumi_rig_check(rig, error) != LUMI_OK)
        return error ? lumi_fail_prefix(error, "%s", source) : LUMI_ERR_FORMAT;
    return LUMI_OK;
}

/* ---- Writing ---- */

struct printer {
    char *text;
    size_t size, length;
};

static void put(struct printer *printer, const char *string)
{
    size_t length = strlen(string);

    if (printer->length < printer->size) {
        size_t room = printer->size - printer->length - 1, count = length < room ? length : room;
        memcpy(printer->text + printer->length, string, count);
        printer->text[printer->length + count] = '\0';
    }
    printer->length += length;
}

static void put_pair(struct printer *printer, const char *key, const char *unit, const char *value)
{
    put(printer, key);
    put(printer, unit);
    put(printer, " = ");
    put(printer, value);
    put(printer, "\n");
}

static void put_key(struct printer *printer, const struct lumi_rig *rig, const struct key *key, int index)
{
    const void *at = target((struct lumi_rig *)rig, key, index);
    const char *unit = "";
    char text[40];

    switch (key->kind) {
    case WORD:
        put_pair(printer, key->name, unit, at);
        return;
    case LENS_NAME:
        put_pair(printer, key->name, unit, rig->lenses[rig->cameras[index].lens].name);
        return;
    case INTEGER:
        snprintf(text, sizeof text, "%d", *(const int *)at);
        break;
    case REAL:
        print_real(*(const double *)at, 1, text);
        break;
    case ANGLE:
        unit = "_deg";
        if (!print_real(*(const double *)at, DEGREE, text)) {
            unit = "_rad";
            print_real(*(const double *)at, 1, text);
        }
        break;
    case YES_NO:
        snprintf(text, sizeof text, "%s", *(const bool *)at ? "yes" : "no");
        break;
    case RUN:
        snprintf(text, sizeof text, "%s", *(const enum lumi_rig_run *)at == LUMI_RIG_RUN_ARC ? "arc" : "straight");
        break;
    case MODEL:
        snprintf(text, sizeof text, "%s", model_names[*(const enum lumi_lens_model *)at == LUMI_LENS_FISHEYE]);
        break;
    }
    put_pair(printer, key->name, unit, text);
}

static void put_section(struct printer *printer, const struct lumi_rig *rig, enum section section, const char *name,
                        int index)
{
    put(printer, printer->length ? "\n[" : "[");
    put(printer, section_names[section]);
    if (name) {
        put(printer, " ");
        put(printer, name);
    }
    put(printer, "]\n");
    for (int i = 0; i < KEYS; i++)
        if (keys[i].section == section)
            put_key(printer, rig, &keys[i], index);
}

size_t lumi_rig_print(const struct lumi_rig *rig, char *text, size_t size)
{
    struct printer printer = {text, size, 0};

    for (int s = RIG; s <= UNCERTAINTY; s++)
        put_section(&printer, rig, (enum section)s, NULL, 0);
    for (int i = 0; i < rig->lens_count; i++)
        put_section(&printer, rig, LENS, rig->lenses[i].name, i);
    for (int i = 0; i < rig->camera_count; i++)
        put_section(&printer, rig, CAMERA, rig->cameras[i].name, i);
    return printer.length;
}
