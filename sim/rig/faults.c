/* The fault script's text: one fault a line, "at WHEN WHAT [for SECONDS]"; and random scripts. */
#include "sim/rig/faults.h"

#include "firmware/board/board.h"
#include "proto/mechanism/text_line.h"
#include "sim/random.h"
#include "sim/rig/mechanics.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <glib.h>

#define WORDS 12
#define LINE 256

/* How a fault is written: its words, with $n for an index by name, %n for a camera, and @u for a value with unit u. */
static const struct form {
    const char *text;
    enum sim_fault_kind kind;
    double value; /* where the text has none */
} forms[] = {
    {"estop press", SIM_FAULT_ESTOP, 1},
    {"estop release", SIM_FAULT_ESTOP, 0},
    {"link cut", SIM_FAULT_LINK_CUT, 1},
    {"link restore", SIM_FAULT_LINK_CUT, 0},
    {"link noise @", SIM_FAULT_LINK_NOISE, 0},
    {"usb unplug", SIM_FAULT_UNPLUG, 1},
    {"usb plug", SIM_FAULT_UNPLUG, 0},
    {"host gone", SIM_FAULT_HOST_GONE, 1},
    {"host back", SIM_FAULT_HOST_GONE, 0},
    {"input $input stuck-on", SIM_FAULT_INPUT, SIM_FORCE_ACTIVE},
    {"input $input stuck-off", SIM_FAULT_INPUT, SIM_FORCE_INACTIVE},
    {"input $input free", SIM_FAULT_INPUT, SIM_FORCE_NONE},
    {"input $input pulse @s", SIM_FAULT_PULSE, 0},
    {"bounce @s", SIM_FAULT_BOUNCE, 0},
    {"string snag", SIM_FAULT_SNAG, 1},
    {"string free", SIM_FAULT_SNAG, 0},
    {"driver fault", SIM_FAULT_DRIVER, 1},
    {"driver sound", SIM_FAULT_DRIVER, 0},
    {"supply @V", SIM_FAULT_SUPPLY, 0},
    {"camera %camera dead", SIM_FAULT_CAMERA_DEAD, 1},
    {"camera %camera alive", SIM_FAULT_CAMERA_DEAD, 0},
    {"camera %camera mute", SIM_FAULT_CAMERA_MUTE, 1},
    {"camera %camera heard", SIM_FAULT_CAMERA_MUTE, 0},
    {"camera %camera lag @s", SIM_FAULT_CAMERA_LAG, 0},
    {"camera %camera busy @s", SIM_FAULT_CAMERA_BUSY, 0},
    {"slip @", SIM_FAULT_SLIP, 0},
    {"hang @s", SIM_FAULT_HANG, 0},
    {"reset $cause", SIM_FAULT_RESET, 0},
    {"power off", SIM_FAULT_POWER, 1},
    {"power on", SIM_FAULT_POWER, 0},
    {"power cut-in-flash @", SIM_FAULT_CUT_IN_FLASH, 0},
    {"camera %camera unplugged", SIM_FAULT_CAMERA_UNPLUG, 1},
    {"camera %camera plugged", SIM_FAULT_CAMERA_UNPLUG, 0},
    {"camera %camera exposure @", SIM_FAULT_EXPOSURE, 0},
    {"camera %camera frames dropped", SIM_FAULT_FRAMES_DROPPED, 1},
    {"camera %camera frames sent", SIM_FAULT_FRAMES_DROPPED, 0},
    {"camera %camera frames doubled", SIM_FAULT_FRAMES_DOUBLED, 1},
    {"camera %camera frames single", SIM_FAULT_FRAMES_DOUBLED, 0},
    {"camera %camera frames late @s", SIM_FAULT_FRAMES_LATE, 0},
    {"camera %camera packets lost @", SIM_FAULT_PACKETS_LOST, 0},
    {"camera %camera askew @", SIM_FAULT_ASKEW, 0},
    {"drive alarm", SIM_FAULT_DRIVE_ALARM, 1},
    {"drive sound", SIM_FAULT_DRIVE_ALARM, 0},
    {"drive silent", SIM_FAULT_DRIVE_SILENT, 1},
    {"drive answers", SIM_FAULT_DRIVE_SILENT, 0},
};

static const char *const input_names[BOARD_INPUTS] = {"estop", "index",        "slack",  "string-end",
                                                      "wound", "driver-fault", "reached"};
static const char *const cause_names[] = {"power", "pin", "software", "watchdog"};

static int split(char *line, char *words[WORDS])
{
    int count = 0;

    for (char *word = strtok(line, " \t\r"); word; word = strtok(NULL, " \t\r")) {
        if (count == WORDS)
            return -1;
        words[count++] = word;
    }
    return count;
}

/* A number with its unit; "ms" where the unit is s. False: it is none, or out of `most`. */
static bool number(const char *word, const char *unit, double most, double *value)
{
    char *end;

    *value = g_ascii_strtod(word, &end);
    if (end == word || !isfinite(*value))
        return false;
    if (!strcmp(unit, "s") && !strcmp(end, "ms"))
        *value /= 1000;
    else if (strcmp(end, unit))
        return false;
    return *value >= 0 && *value <= most;
}

static int name_index(const char *const *names, int count, const char *word)
{
    for (int i = 0; i < count; i++)
        if (!strcmp(names[i], word))
            return i;
    return -1;
}

/* Most a value of each kind can be. */
static double most_of(enum sim_fault_kind kind)
{
    switch (kind) {
    case SIM_FAULT_LINK_NOISE:
    case SIM_FAULT_PACKETS_LOST:
        return 1;
    case SIM_FAULT_BOUNCE:
        return 1;
    case SIM_FAULT_SUPPLY:
        return 100;
    case SIM_FAULT_ASKEW:
        return 90;
    case SIM_FAULT_SLIP:
        return 10000;
    case SIM_FAULT_CUT_IN_FLASH:
        return 1e6;
    default:
        return 1e5;
    }
}

/* Whether one word fits one of the form's; takes index and value from it. */
static bool word_fits(const char *pattern, const char *word, struct sim_fault *fault)
{
    if (!strcmp(pattern, "$input"))
        return (fault->index = name_index(input_names, BOARD_INPUTS, word)) >= 0;
    if (!strcmp(pattern, "$cause"))
        return (fault->index = name_index(cause_names, (int)G_N_ELEMENTS(cause_names), word)) >= 0;
    if (!strcmp(pattern, "%camera")) {
        double value;
        if (!number(word, "", LUMI_RIG_CAMERAS - 1, &value) || value != floor(value))
            return false;
        fault->index = (int)value;
        return true;
    }
    if (pattern[0] == '@') {
        double value;
        if (!number(word, pattern + 1, most_of(fault->kind), &value) || value <= 0)
            return false;
        fault->value = value;
        return true;
    }
    return !strcmp(pattern, word);
}

static bool form_fits(const struct form *form, char *words[], int count, struct sim_fault *fault)
{
    char text[64], *patterns[WORDS];
    int wanted;

    g_strlcpy(text, form->text, sizeof text);
    wanted = split(text, patterns);
    if (wanted != count)
        return false;
    fault->kind = form->kind;
    fault->value = form->value;
    fault->index = 0;
    for (int i = 0; i < count; i++)
        if (!word_fits(patterns[i], words[i], fault))
            return false;
    return true;
}

static int fail_at(struct lumi_error *error, const char *source, int line, const char *text)
{
    return lumi_fail(error, LUMI_ERR_FORMAT, "%s: line %d: %s", source, line, text);
}

static int parse_words(char *words[], int count, const char *source, int line, struct sim_fault *fault,
                       struct lumi_error *error)
{
    int first = 2;

    memset(fault, 0, sizeof *fault);
    if (count < 3 || strcmp(words[0], "at"))
        return fail_at(error, source, line, "'at TIME FAULT' or 'at shot NUMBER FAULT' wanted");
    if (!strcmp(words[1], "shot")) {
        fault->by_shot = true;
        if (!number(words[2], "", 1e6, &fault->at) || fault->at != floor(fault->at))
            return fail_at(error, source, line, "not the number of a shot");
        first = 3;
    } else if (!number(words[1], "s", 1e6, &fault->at)) {
        return fail_at(error, source, line, "not a time: such as 12.5s wanted");
    }
    if (count - first > 2 && !strcmp(words[count - 2], "for")) {
        if (!number(words[count - 1], "s", 1e6, &fault->duration) || fault->duration <= 0)
            return fail_at(error, source, line, "not a duration: such as 'for 3s' wanted");
        count -= 2;
    }
    struct sim_fault found = *fault;
    for (size_t i = 0; i < G_N_ELEMENTS(forms); i++)
        if (form_fits(&forms[i], words + first, count - first, &found)) {
            *fault = found;
            return LUMI_OK;
        }
    return fail_at(error, source, line, "no such fault");
}

int sim_fault_script_parse(const char *text, size_t size, const char *source, struct sim_fault_script *script,
                           struct lumi_error *error)
{
    int line = 0;

    script->count = 0;
    for (size_t at = 0; at < size;) {
        char copy[LINE], *words[WORDS], *comment;
        line++;
        if (!lumi_text_line(text, size, &at, copy, sizeof copy))
            return fail_at(error, source, line, "too long, or not text");
        if ((comment = strchr(copy, '#')))
            *comment = 0;
        int count = split(copy, words);
        if (count == 0)
            continue;
        if (count < 0)
            return fail_at(error, source, line, "too many words");
        if (script->count == SIM_FAULTS_MAX)
            return fail_at(error, source, line, "too many faults");
        LUMI_TRY(parse_words(words, count, source, line, &script->faults[script->count], error));
        script->count++;
    }
    return LUMI_OK;
}

/* ---- printing ---- */

static void put(char *text, size_t size, size_t *length, const char *format, ...) G_GNUC_PRINTF(4, 5);
static void put(char *text, size_t size, size_t *length, const char *format, ...)
{
    va_list arguments;

    va_start(arguments, format);
    int n = vsnprintf(*length < size ? text + *length : NULL, *length < size ? size - *length : 0, format, arguments);
    va_end(arguments);
    *length += (size_t)n;
}

static const struct form *form_of(const struct sim_fault *fault)
{
    const struct form *with_value = NULL;

    for (size_t i = 0; i < G_N_ELEMENTS(forms); i++) {
        if (forms[i].kind != fault->kind)
            continue;
        if (strchr(forms[i].text, '@'))
            with_value = &forms[i];
        else if (forms[i].value == fault->value)
            return &forms[i];
    }
    return with_value;
}

static void put_value(char *text, size_t size, size_t *length, double value, const char *unit)
{
    char digits[G_ASCII_DTOSTR_BUF_SIZE];

    g_ascii_formatd(digits, sizeof digits, "%.15g", value);
    if (g_ascii_strtod(digits, NULL) != value)
        g_ascii_dtostr(digits, sizeof digits, value);
    put(text, size, length, " %s%s", digits, unit);
}

size_t sim_fault_script_print(const struct sim_fault_script *script, char *text, size_t size)
{
    size_t length = 0;

    if (size > 0)
        text[0] = 0;
    for (int i = 0; i < script->count; i++) {
        const struct sim_fault *fault = &script->faults[i];
        const struct form *form = form_of(fault);
        char copy[64], *patterns[WORDS];
        if (!form)
            continue;
        g_strlcpy(copy, form->text, sizeof copy);
        int count = split(copy, patterns);
        put(text, size, &length, fault->by_shot ? "at shot" : "at");
        put_value(text, size, &length, fault->at, fault->by_shot ? "" : "s");
        for (int w = 0; w < count; w++) {
            if (!strcmp(patterns[w], "$input"))
                put(text, size, &length, " %s", input_names[fault->index]);
            else if (!strcmp(patterns[w], "$cause"))
                put(text, size, &length, " %s", cause_names[fault->index]);
            else if (patterns[w][0] == '%')
                put(text, size, &length, " %d", fault->index);
            else if (patterns[w][0] == '@')
                put_value(text, size, &length, fault->value, patterns[w] + 1);
            else
                put(text, size, &length, " %s", patterns[w]);
        }
        if (fault->duration > 0) {
            put(text, size, &length, " for");
            put_value(text, size, &length, fault->duration, "s");
        }
        put(text, size, &length, "\n");
    }
    return length;
}

/* ---- random scripts ---- */

struct dice {
    uint64_t seed, n;
};

static double unit(struct dice *dice)
{
    return sim_random_unit(sim_random(dice->seed, dice->n++, 77));
}

static double between(struct dice *dice, double low, double high)
{
    /* In milliseconds, so that a printed script is short. */
    return round((low + (high - low) * unit(dice)) * 1000) / 1000;
}

static int pick(struct dice *dice, int count)
{
    return (int)(unit(dice) * count);
}

static const struct chance {
    enum sim_fault_kind kind;
    double low, high;         /* of the value; the same: not random */
    double shortest, longest; /* of the duration */
} chances[] = {
    {SIM_FAULT_ESTOP, 1, 1, 0.01, 4},         {SIM_FAULT_LINK_CUT, 1, 1, 0.1, 12},
    {SIM_FAULT_LINK_NOISE, 0.02, 0.4, 1, 20}, {SIM_FAULT_UNPLUG, 1, 1, 0.1, 12},
    {SIM_FAULT_HOST_GONE, 1, 1, 0.5, 12},     {SIM_FAULT_INPUT, 1, 2, 0.05, 20},
    {SIM_FAULT_PULSE, 0.001, 0.02, 0, 0},     {SIM_FAULT_BOUNCE, 0.001, 0.01, 1, 30},
    {SIM_FAULT_SNAG, 1, 1, 0.2, 5},           {SIM_FAULT_DRIVER, 1, 1, 0.01, 3},
    {SIM_FAULT_SUPPLY, 5, 14, 0.01, 3},       {SIM_FAULT_CAMERA_DEAD, 1, 1, 1, 20},
    {SIM_FAULT_CAMERA_MUTE, 1, 1, 1, 20},     {SIM_FAULT_CAMERA_LAG, 0.001, 0.3, 1, 20},
    {SIM_FAULT_CAMERA_BUSY, 0.05, 3, 1, 20},  {SIM_FAULT_SLIP, 1, 40, 0, 0},
    {SIM_FAULT_HANG, 0.01, 4, 0, 0},          {SIM_FAULT_RESET, 0, 0, 0, 0},
    {SIM_FAULT_POWER, 1, 1, 0.05, 3},
};

void sim_fault_script_random(struct sim_fault_script *script, uint64_t seed, const struct lumi_rig *rig, int most,
                             double seconds)
{
    struct dice dice = {sim_random_mix(seed), 0};

    script->count = 1 + pick(&dice, most < SIM_FAULTS_MAX ? most : SIM_FAULTS_MAX);
    for (int i = 0; i < script->count; i++) {
        const struct chance *chance = &chances[pick(&dice, (int)G_N_ELEMENTS(chances))];
        struct sim_fault *fault = &script->faults[i];
        memset(fault, 0, sizeof *fault);
        fault->kind = chance->kind;
        fault->at = between(&dice, 0, seconds);
        fault->value = chance->low < chance->high ? between(&dice, chance->low, chance->high) : chance->low;
        fault->duration = chance->longest > 0 ? between(&dice, chance->shortest, chance->longest) : 0;
        switch (fault->kind) {
        case SIM_FAULT_INPUT:
            fault->value = 1 + pick(&dice, 2);
            fault->index = BOARD_IN_INDEX + pick(&dice, BOARD_IN_DRIVER_FAULT - BOARD_IN_INDEX + 1);
            break;
        case SIM_FAULT_PULSE:
            fault->index = pick(&dice, BOARD_IN_DRIVER_FAULT + 1);
            break;
        case SIM_FAULT_RESET:
            fault->index = 1 + pick(&dice, 3);
            break;
        case SIM_FAULT_SLIP:
            fault->value = floor(fault->value);
            break;
        case SIM_FAULT_CAMERA_DEAD:
        case SIM_FAULT_CAMERA_MUTE:
        case SIM_FAULT_CAMERA_LAG:
        case SIM_FAULT_CAMERA_BUSY:
            fault->index = pick(&dice, rig->camera_count);
            break;
        default:
            break;
        }
    }
}
