/* The rig profile as text: sections, keys, values (docs/rig-profile.md). Reader and writer go by the same table. */
#include "proto/mechanism/rig_priv.h"
#include "proto/mechanism/text_line.h"
#include "proto/mechanism/text_priv.h"

#include <stdio.h>
#include <string.h>

/* TRIGGER: keys of a [camera NAME] that say how it is fired. */
enum section { RIG, DRIVE, SWEEP, STRING, UNCERTAINTY, MOTION, VIDEO, SAFETY, LENS, CAMERA, SECTIONS, TRIGGER };
static const char *const section_names[SECTIONS] = {"rig",    "drive", "sweep",  "string", "uncertainty",
                                                    "motion", "video", "safety", "lens",   "camera"};
/* May be missing: nothing is uncertain, or what lumi_rig_control_init says holds. */
static const bool optional[SECTIONS] = {[UNCERTAINTY] = true, [MOTION] = true, [VIDEO] = true, [SAFETY] = true};

enum kind { WORD, INTEGER, REAL, ANGLE, RATE, RATE2, RATE3, YES_NO, RUN, MODEL, DRIVE_KIND, LINE, REACTION, LENS_NAME };

/* An ANGLE is written as "<name>_deg", or as "<name>_rad" where no decimal number of degrees gives the very same
 * radians; a RATE as "<name>_deg_s" (or _rad_s), its changes as "_deg_s2" and "_deg_s3". */
static const char *const per_time[] = {[ANGLE] = "", [RATE] = "_s", [RATE2] = "_s2", [RATE3] = "_s3"};
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
    {MOTION, "drive", DRIVE_KIND, offsetof(struct lumi_rig, control.motion.drive)},
    {MOTION, "speed_max", RATE, offsetof(struct lumi_rig, control.motion.speed_max)},
    {MOTION, "acceleration_max", RATE2, offsetof(struct lumi_rig, control.motion.acceleration_max)},
    {MOTION, "jerk_max", RATE3, offsetof(struct lumi_rig, control.motion.jerk_max)},
    {MOTION, "home_speed", RATE, offsetof(struct lumi_rig, control.motion.home_speed)},
    {MOTION, "wind_speed", RATE, offsetof(struct lumi_rig, control.motion.wind_speed)},
    {MOTION, "backlash", ANGLE, offsetof(struct lumi_rig, control.motion.backlash)},
    {MOTION, "index_window", ANGLE, offsetof(struct lumi_rig, control.motion.index_window)},
    {MOTION, "settle_s", REAL, offsetof(struct lumi_rig, control.motion.settle)},
    {MOTION, "step_pulse_s", REAL, offsetof(struct lumi_rig, control.motion.step_pulse)},
    {MOTION, "direction_setup_s", REAL, offsetof(struct lumi_rig, control.motion.direction_setup)},
    {VIDEO, "record_pulse_s", REAL, offsetof(struct lumi_rig, control.video.record_pulse)},
    {VIDEO, "record_lead_s", REAL, offsetof(struct lumi_rig, control.video.record_lead)},
    {VIDEO, "lamp_bit_s", REAL, offsetof(struct lumi_rig, control.video.lamp_bit)},
    {SAFETY, "host_timeout_s", REAL, offsetof(struct lumi_rig, control.safety.host_timeout)},
    {SAFETY, "supply_minimum_v", REAL, offsetof(struct lumi_rig, control.safety.supply_minimum)},
    {SAFETY, "overspeed", RATE, offsetof(struct lumi_rig, control.safety.overspeed)},
    {SAFETY, "brake_fitted", YES_NO, offsetof(struct lumi_rig, control.safety.brake_fitted)},
    {SAFETY, "slack_fitted", YES_NO, offsetof(struct lumi_rig, control.safety.slack_fitted)},
    {SAFETY, "string_end_fitted", YES_NO, offsetof(struct lumi_rig, control.safety.string_end_fitted)},
    {SAFETY, "wound_fitted", YES_NO, offsetof(struct lumi_rig, control.safety.wound_fitted)},
    {SAFETY, "driver_fault_fitted", YES_NO, offsetof(struct lumi_rig, control.safety.driver_fault_fitted)},
    {SAFETY, "estop", REACTION, offsetof(struct lumi_rig, control.safety.reactions[LUMI_RIG_FAULT_ESTOP])},
    {SAFETY, "host-lost", REACTION, offsetof(struct lumi_rig, control.safety.reactions[LUMI_RIG_FAULT_HOST_LOST])},
    {SAFETY, "index-missed", REACTION,
     offsetof(struct lumi_rig, control.safety.reactions[LUMI_RIG_FAULT_INDEX_MISSED])},
    {SAFETY, "index-early", REACTION, offsetof(struct lumi_rig, control.safety.reactions[LUMI_RIG_FAULT_INDEX_EARLY])},
    {SAFETY, "string-end", REACTION, offsetof(struct lumi_rig, control.safety.reactions[LUMI_RIG_FAULT_STRING_END])},
    {SAFETY, "slack", REACTION, offsetof(struct lumi_rig, control.safety.reactions[LUMI_RIG_FAULT_SLACK])},
    {SAFETY, "overspeed", REACTION, offsetof(struct lumi_rig, control.safety.reactions[LUMI_RIG_FAULT_OVERSPEED])},
    {SAFETY, "driver", REACTION, offsetof(struct lumi_rig, control.safety.reactions[LUMI_RIG_FAULT_DRIVER])},
    {SAFETY, "supply", REACTION, offsetof(struct lumi_rig, control.safety.reactions[LUMI_RIG_FAULT_SUPPLY])},
    {SAFETY, "internal", REACTION, offsetof(struct lumi_rig, control.safety.reactions[LUMI_RIG_FAULT_INTERNAL])},
    {SAFETY, "watchdog", REACTION, offsetof(struct lumi_rig, control.safety.reactions[LUMI_RIG_FAULT_WATCHDOG])},
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
    {TRIGGER, "channel", LINE, offsetof(struct lumi_rig_trigger, channel)},
    {TRIGGER, "shutter_lag_s", REAL, offsetof(struct lumi_rig_trigger, shutter_lag)},
    {TRIGGER, "pulse_s", REAL, offsetof(struct lumi_rig_trigger, pulse)},
    {TRIGGER, "focus_lead_s", REAL, offsetof(struct lumi_rig_trigger, focus_lead)},
    {TRIGGER, "focus_channel", LINE, offsetof(struct lumi_rig_trigger, focus_channel)},
    {TRIGGER, "busy_s", REAL, offsetof(struct lumi_rig_trigger, busy)},
    {TRIGGER, "feedback", LINE, offsetof(struct lumi_rig_trigger, feedback)},
};
#define KEYS ((int)(sizeof keys / sizeof *keys))

static const char *const model_names[] = {"pinhole", "fisheye"}; /* LUMI_LENS_BROWN, LUMI_LENS_FISHEYE */
static const char *const drive_names[] = {"stepper", "external"};
static const char *const motor_words[] = {"row-end", "ramp", "halt", "off"};
static const char *const trigger_words[] = {"triggers-finish", "triggers-off"};

static bool in_section(const struct key *key, enum section section)
{
    return key->section == section || (key->section == TRIGGER && section == CAMERA);
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

static int open_section(struct parser *p, char *text)
{
    char *name = strpbrk(text, " \t");
    int s;

    if (name) {
        *name++ = '\0';
        name = text_trim(name);
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
    else if (key->section == TRIGGER)
        base = (char *)&rig->control.triggers[index];
    return base + key->offset;
}

/* "halt, brake, triggers-off": what the motor does, whether the brake closes, what the triggers do; in any order. */
static int set_reaction(struct parser *p, const char *name, char *value, struct lumi_rig_reaction *reaction)
{
    int motors = 0, brakes = 0, triggers = 0;

    reaction->brake = false;
    for (char *word = value, *next; word; word = next) {
        int known = motors + brakes + triggers;
        next = strchr(word, ',');
        if (next)
            *next++ = '\0';
        word = text_trim(word);
        for (int i = LUMI_RIG_MOTOR_ROW_END; i <= LUMI_RIG_MOTOR_OFF; i++)
            if (!strcmp(word, motor_words[i])) {
                reaction->motor = (enum lumi_rig_motor_reaction)i;
                motors++;
            }
        for (int i = LUMI_RIG_TRIGGERS_FINISH; i <= LUMI_RIG_TRIGGERS_OFF; i++)
            if (!strcmp(word, trigger_words[i])) {
                reaction->triggers = (enum lumi_rig_trigger_reaction)i;
                triggers++;
            }
        if (!strcmp(word, "brake")) {
            reaction->brake = true;
            brakes++;
        }
        if (motors + brakes + triggers == known)
            return FAIL(LUMI_ERR_FORMAT,
                        "%s: '%s' is none of row-end, ramp, halt, off, brake, triggers-finish, "
                        "triggers-off",
                        name, word);
    }
    if (motors != 1 || brakes > 1 || triggers != 1)
        return FAIL(LUMI_ERR_FORMAT,
                    "%s: one of row-end, ramp, halt, off and one of triggers-finish, triggers-off "
                    "wanted",
                    name);
    return LUMI_OK;
}

static int set_value(struct parser *p, const struct key *key, double unit, char *value)
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
        if (!text_read_integer(value, at))
            return FAIL(LUMI_ERR_FORMAT, "%s: '%s' is no whole number", key->name, value);
        return LUMI_OK;
    case LINE:
        *(int *)at = -1;
        if (strcmp(value, "none") && !text_read_integer(value, at))
            return FAIL(LUMI_ERR_FORMAT, "%s: '%s' is neither a whole number nor none", key->name, value);
        return LUMI_OK;
    case REAL:
    case ANGLE:
    case RATE:
    case RATE2:
    case RATE3:
        if (!text_read_real(value, &number))
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
    case DRIVE_KIND:
        if (strcmp(value, drive_names[0]) && strcmp(value, drive_names[1]))
            return FAIL(LUMI_ERR_FORMAT, "%s: '%s' is neither stepper nor external", key->name, value);
        *(enum lumi_rig_drive_kind *)at =
            strcmp(value, drive_names[0]) ? LUMI_RIG_DRIVE_EXTERNAL : LUMI_RIG_DRIVE_STEPPER;
        return LUMI_OK;
    case REACTION:
        return set_reaction(p, key->name, value, at);
    }
    return LUMI_ERR_INTERNAL;
}

static bool is_angle(const struct key *key)
{
    return key->kind == ANGLE || key->kind == RATE || key->kind == RATE2 || key->kind == RATE3;
}

/* Whether `name` is the key's name, with the unit an angle carries. */
static bool key_matches(const struct key *key, const char *name, double *unit)
{
    size_t length = strlen(key->name);

    *unit = 1;
    if (strncmp(name, key->name, length))
        return false;
    if (!is_angle(key))
        return name[length] == '\0';
    name += length;
    if (!strncmp(name, "_deg", 4))
        *unit = RIG_DEGREE;
    else if (strncmp(name, "_rad", 4))
        return false;
    return !strcmp(name + 4, per_time[key->kind]);
}

static int parse_line(struct parser *p, char *line)
{
    char *text = text_trim(line), *value;
    double unit;

    if (*text == '\0' || *text == '#' || *text == ';')
        return LUMI_OK;
    if (*text == '[') {
        size_t length = strlen(text);
        if (text[length - 1] != ']')
            return FAIL(LUMI_ERR_FORMAT, "a section's ']' is missing");
        text[length - 1] = '\0';
        return open_section(p, text_trim(text + 1));
    }
    if (!text_split(text, &value))
        return FAIL(LUMI_ERR_FORMAT, "neither a section nor 'key = value'");
    if (p->section == SECTIONS)
        return FAIL(LUMI_ERR_FORMAT, "a key before the first section");
    for (int i = 0; i < KEYS; i++)
        if (in_section(&keys[i], p->section) && key_matches(&keys[i], text, &unit)) {
            if (p->set[i])
                return FAIL(LUMI_ERR_FORMAT, "'%s' comes twice", text);
            p->set[i] = true;
            return set_value(p, &keys[i], unit, value);
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
    char line[TEXT_LINE];

    memset(rig, 0, sizeof *rig);
    lumi_rig_control_init(&rig->control);
    if (size > LUMI_RIG_TEXT_MAX)
        return lumi_fail(error, LUMI_ERR_LIMIT, "%s: a profile of %zu bytes, at most %d are read", source, size,
                         LUMI_RIG_TEXT_MAX);
    for (size_t at = 0; at < size;) {
        struct parser *p = &parser;
        p->line++;
        if (!lumi_text_line(text, size, &at, line, sizeof line))
            return FAIL(LUMI_ERR_FORMAT, "the line is too long or no text");
        LUMI_TRY(parse_line(p, line));
    }
    for (int s = 0; s < SECTIONS; s++)
        if (!parser.seen[s] && !optional[s])
            return lumi_fail(error, LUMI_ERR_FORMAT, "%s: section '%s' is missing", source, section_names[s]);
    LUMI_TRY(resolve_lenses(&parser));
    if (lumi_rig_check(rig, error) != LUMI_OK)
        return error ? lumi_fail_prefix(error, "%s", source) : LUMI_ERR_FORMAT;
    return LUMI_OK;
}

/* ---- Writing ---- */

static void put_key(struct text_printer *printer, const struct lumi_rig *rig, const struct key *key, int index)
{
    const void *at = target((struct lumi_rig *)rig, key, index);
    char text[TEXT_NUMBER];

    switch (key->kind) {
    case WORD:
        text_put_pair(printer, key->name, "", at);
        return;
    case LENS_NAME:
        text_put_pair(printer, key->name, "", rig->lenses[rig->cameras[index].lens].name);
        return;
    case INTEGER:
        snprintf(text, sizeof text, "%d", *(const int *)at);
        break;
    case REAL:
        text_print_real(*(const double *)at, 1, text);
        break;
    case ANGLE:
    case RATE:
    case RATE2:
    case RATE3: {
        bool degrees = text_print_real(*(const double *)at, RIG_DEGREE, text);
        if (!degrees)
            text_print_real(*(const double *)at, 1, text);
        text_put(printer, key->name);
        text_put_pair(printer, degrees ? "_deg" : "_rad", per_time[key->kind], text);
        return;
    }
    case LINE:
        snprintf(text, sizeof text, *(const int *)at < 0 ? "none" : "%d", *(const int *)at);
        break;
    case DRIVE_KIND:
        snprintf(text, sizeof text, "%s", drive_names[*(const enum lumi_rig_drive_kind *)at]);
        break;
    case REACTION: {
        const struct lumi_rig_reaction *reaction = at;
        snprintf(text, sizeof text, "%s, %s%s", motor_words[reaction->motor], reaction->brake ? "brake, " : "",
                 trigger_words[reaction->triggers]);
        break;
    }
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
    text_put_pair(printer, key->name, "", text);
}

static void put_section(struct text_printer *printer, const struct lumi_rig *rig, enum section section,
                        const char *name, int index)
{
    text_put(printer, printer->length ? "\n[" : "[");
    text_put(printer, section_names[section]);
    if (name) {
        text_put(printer, " ");
        text_put(printer, name);
    }
    text_put(printer, "]\n");
    for (int i = 0; i < KEYS; i++)
        if (in_section(&keys[i], section))
            put_key(printer, rig, &keys[i], index);
}

size_t lumi_rig_print(const struct lumi_rig *rig, char *text, size_t size)
{
    struct text_printer printer = {text, size, 0};

    for (int s = RIG; s < LENS; s++)
        put_section(&printer, rig, (enum section)s, NULL, 0);
    for (int i = 0; i < rig->lens_count; i++)
        put_section(&printer, rig, LENS, rig->lenses[i].name, i);
    for (int i = 0; i < rig->camera_count; i++)
        put_section(&printer, rig, CAMERA, rig->cameras[i].name, i);
    return printer.length;
}
