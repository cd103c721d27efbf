/* The plan of a sweep as text: one section, keys and values (docs/rig-plan.md). */
#include "proto/mechanism/rig_priv.h"
#include "proto/mechanism/sweep_plan.h"
#include "proto/mechanism/text_line.h"
#include "proto/mechanism/text_priv.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const char *const mode_names[] = {"continuous", "start-stop", "video", NULL};
static const char *const wind_names[] = {"plan", "full", "none", NULL};

enum kind { WORD, INTEGER, REAL, SETTLE, MODE, WIND, EXPOSURES, EXPOSURE, STOPS, CAMERAS };

static const struct key {
    const char *name;
    enum kind kind;
    size_t offset;
} keys[] = {
    {"name", WORD, offsetof(struct lumi_plan, name)},
    {"mode", MODE, offsetof(struct lumi_plan, mode)},
    {"wind", WIND, offsetof(struct lumi_plan, wind)},
    {"positions", INTEGER, offsetof(struct lumi_plan, positions)},
    {"first_turn", INTEGER, offsetof(struct lumi_plan, first_turn)},
    {"turns", INTEGER, offsetof(struct lumi_plan, turns)},
    {"turn_time_s", REAL, offsetof(struct lumi_plan, turn_time)},
    {"position_time_s", REAL, offsetof(struct lumi_plan, position_time)},
    {"settle_s", SETTLE, offsetof(struct lumi_plan, settle)},
    {"exposures_s", EXPOSURES, 0},
    {"exposure_s", EXPOSURE, 0}, /* read only, from here on */
    {"stops", STOPS, 0},
    {"bracket_gap_s", REAL, offsetof(struct lumi_plan, bracket_gap)},
    {"cameras", CAMERAS, 0},
    {"blur_max_px", REAL, offsetof(struct lumi_plan, blur_max)},
};
#define KEYS ((int)(sizeof keys / sizeof *keys))

/* ---- Reading ---- */

struct parser {
    const struct lumi_rig *rig;
    struct lumi_plan *plan;
    const char *source;
    struct lumi_error *error;
    int line;
    bool section, set[KEYS];
    double exposure; /* that `stops` go by */
    double stops[LUMI_PLAN_BRACKET];
    int stop_count;
};

#define FAIL(code, ...) (lumi_fail(p->error, code, __VA_ARGS__), place(p))

static int place(const struct parser *p)
{
    if (!p->error)
        return LUMI_ERR_FORMAT;
    if (!p->source) /* the line is told beside */
        return p->error->code;
    return lumi_fail_prefix(p->error, "%s:%d", p->source, p->line);
}

/* "1/250" or "0.004". */
static bool read_time(const char *text, double *value)
{
    char upper[TEXT_NUMBER];
    const char *slash = strchr(text, '/');
    double below;

    if (!slash)
        return text_read_real(text, value);
    if ((size_t)(slash - text) >= sizeof upper)
        return false;
    memcpy(upper, text, (size_t)(slash - text));
    upper[slash - text] = '\0';
    if (!text_read_real(text_trim(upper), value) || !text_read_real(slash + 1 + strspn(slash + 1, " \t"), &below))
        return false;
    *value /= below;
    return isfinite(*value);
}

/* Cuts the first of the words that commas or blanks separate off `rest`; NULL: there is none. */
static char *next_word(char **rest, const char *separators)
{
    char *word = *rest + strspn(*rest, separators), *end = word + strcspn(word, separators);

    if (*word == '\0')
        return NULL;
    *rest = *end ? end + 1 : end;
    *end = '\0';
    return word;
}

static int set_list(struct parser *p, const struct key *key, char *value)
{
    double *list = key->kind == STOPS ? p->stops : p->plan->exposures;
    int count = 0;

    for (char *word; (word = next_word(&value, key->kind == STOPS ? ", \t" : ",")) != NULL;) {
        if (count == LUMI_PLAN_BRACKET)
            return FAIL(LUMI_ERR_FORMAT, "%s: more than %d exposures", key->name, LUMI_PLAN_BRACKET);
        word = text_trim(word);
        if (!(key->kind == STOPS ? text_read_real(word, &list[count]) : read_time(word, &list[count])))
            return FAIL(LUMI_ERR_FORMAT, "%s: '%s' is no number", key->name, word);
        if (key->kind == STOPS && !rig_within(list[count], -20, 20))
            return FAIL(LUMI_ERR_FORMAT, "%s: %g stops: -20 to 20 wanted", key->name, list[count]);
        count++;
    }
    if (count == 0)
        return FAIL(LUMI_ERR_FORMAT, "%s: nothing is listed", key->name);
    if (key->kind == STOPS)
        p->stop_count = count;
    else
        p->plan->bracket = count;
    return LUMI_OK;
}

static int set_cameras(struct parser *p, char *value)
{
    uint32_t cameras = 0;

    if (!strcmp(value, "all") || !p->rig) {
        p->plan->cameras = 0;
        return LUMI_OK;
    }
    for (char *word; (word = next_word(&value, ", \t")) != NULL;) {
        int i = 0;
        while (i < p->rig->camera_count && strcmp(p->rig->cameras[i].name, word))
            i++;
        if (i == p->rig->camera_count)
            return FAIL(LUMI_ERR_FORMAT, "cameras: the rig has no camera '%s'", word);
        cameras |= UINT32_C(1) << i;
    }
    if (!cameras)
        return FAIL(LUMI_ERR_FORMAT, "cameras: nothing is listed");
    p->plan->cameras = cameras;
    return LUMI_OK;
}

static int set_choice(struct parser *p, const char *key, const char *value, const char *const *names, int *choice)
{
    for (int i = 0; names[i]; i++)
        if (!strcmp(value, names[i])) {
            *choice = i;
            return LUMI_OK;
        }
    return FAIL(LUMI_ERR_FORMAT, "%s: '%s' is none of %s, %s, %s", key, value, names[0], names[1], names[2]);
}

static int set_value(struct parser *p, const struct key *key, char *value)
{
    void *at = (char *)p->plan + key->offset;
    int choice = 0;

    switch (key->kind) {
    case WORD:
        if (strlen(value) >= LUMI_RIG_NAME)
            return FAIL(LUMI_ERR_FORMAT, "%s: the name is too long", key->name);
        memset(at, 0, LUMI_RIG_NAME);
        memcpy(at, value, strlen(value));
        return LUMI_OK;
    case INTEGER:
        if (!text_read_integer(value, at))
            return FAIL(LUMI_ERR_FORMAT, "%s: '%s' is no whole number", key->name, value);
        return LUMI_OK;
    case SETTLE:
        p->plan->settle = -1;
        if (!strcmp(value, "profile"))
            return LUMI_OK;
        if (!text_read_real(value, at) || p->plan->settle < 0)
            return FAIL(LUMI_ERR_FORMAT, "%s: '%s' is neither a time nor profile", key->name, value);
        return LUMI_OK;
    case REAL:
        if (!text_read_real(value, at))
            return FAIL(LUMI_ERR_FORMAT, "%s: '%s' is no number", key->name, value);
        return LUMI_OK;
    case EXPOSURE:
        if (!read_time(value, &p->exposure))
            return FAIL(LUMI_ERR_FORMAT, "%s: '%s' is no number", key->name, value);
        return LUMI_OK;
    case MODE:
        LUMI_TRY(set_choice(p, key->name, value, mode_names, &choice));
        p->plan->mode = (enum lumi_plan_mode)choice;
        return LUMI_OK;
    case WIND:
        LUMI_TRY(set_choice(p, key->name, value, wind_names, &choice));
        p->plan->wind = (enum lumi_plan_wind)choice;
        return LUMI_OK;
    case EXPOSURES:
    case STOPS:
        return set_list(p, key, value);
    case CAMERAS:
        return set_cameras(p, value);
    }
    return LUMI_ERR_INTERNAL;
}

static int parse_line(struct parser *p, char *line)
{
    char *text = text_trim(line), *value;

    if (*text == '\0' || *text == '#' || *text == ';')
        return LUMI_OK;
    if (*text == '[') {
        if (strcmp(text, "[sweep]"))
            return FAIL(LUMI_ERR_FORMAT, "a plan has the section [sweep] and no other");
        if (p->section)
            return FAIL(LUMI_ERR_FORMAT, "section 'sweep' comes twice");
        p->section = true;
        return LUMI_OK;
    }
    if (!text_split(text, &value))
        return FAIL(LUMI_ERR_FORMAT, "neither a section nor 'key = value'");
    if (!p->section)
        return FAIL(LUMI_ERR_FORMAT, "a key before the section [sweep]");
    for (int i = 0; i < KEYS; i++)
        if (!strcmp(text, keys[i].name)) {
            if (p->set[i])
                return FAIL(LUMI_ERR_FORMAT, "'%s' comes twice", text);
            p->set[i] = true;
            return set_value(p, &keys[i], value);
        }
    return FAIL(LUMI_ERR_FORMAT, "a plan has no key '%s'", text);
}

static bool was_set(const struct parser *p, const char *name)
{
    for (int i = 0; i < KEYS; i++)
        if (!strcmp(keys[i].name, name))
            return p->set[i];
    return false;
}

/* Of no line. */
static int whole(const struct parser *p, const char *what)
{
    return lumi_fail(p->error, LUMI_ERR_FORMAT, "%s%s%s", p->source ? p->source : "", p->source ? ": " : "", what);
}

/* Exposures given as one and stops about it. */
static int resolve_exposures(struct parser *p)
{
    bool one = was_set(p, "exposure_s"), stops = was_set(p, "stops");

    if (was_set(p, "exposures_s") && (one || stops))
        return whole(p, "either exposures_s, or exposure_s and stops");
    if (stops && !one)
        return whole(p, "stops about what? exposure_s is missing");
    if (!one)
        return LUMI_OK;
    p->plan->bracket = stops ? p->stop_count : 1;
    for (int k = 0; k < p->plan->bracket; k++)
        p->plan->exposures[k] = p->exposure * exp2(p->stops[k]);
    return LUMI_OK;
}

static int parse_text(struct parser *p, const char *text, size_t size)
{
    char line[TEXT_LINE];

    if (size > LUMI_PLAN_TEXT_MAX)
        return lumi_fail(p->error, LUMI_ERR_LIMIT, "%s: a plan of %zu bytes, at most %d are read", p->source, size,
                         LUMI_PLAN_TEXT_MAX);
    for (size_t at = 0; at < size;) {
        p->line++;
        if (!lumi_text_line(text, size, &at, line, sizeof line))
            return FAIL(LUMI_ERR_FORMAT, "the line is too long or no text");
        LUMI_TRY(parse_line(p, line));
    }
    if (!p->section)
        return lumi_fail(p->error, LUMI_ERR_FORMAT, "%s: section 'sweep' is missing", p->source);
    return resolve_exposures(p);
}

int lumi_plan_check_text(const char *text, size_t size, const char *source, struct lumi_error *error)
{
    struct lumi_plan plan = {0};
    struct parser parser = {.plan = &plan, .source = source, .error = error};

    return parse_text(&parser, text, size);
}

int lumi_plan_parse(const char *text, size_t size, const char *source, const struct lumi_rig *rig,
                    struct lumi_plan *plan, struct lumi_error *error)
{
    struct parser parser = {.rig = rig, .plan = plan, .source = source, .error = error};

    lumi_plan_init(plan, rig);
    LUMI_TRY(parse_text(&parser, text, size));
    if (lumi_plan_check(plan, rig, error) != LUMI_OK)
        return error ? lumi_fail_prefix(error, "%s", source) : LUMI_ERR_FORMAT;
    return LUMI_OK;
}

/* ---- Everything that is wrong ---- */

struct complaint {
    struct lumi_plan_problem *problems;
    int count, max;
};

static void complain(struct complaint *c, int line, const char *text)
{
    if (c->count < c->max) {
        c->problems[c->count].line = line;
        snprintf(c->problems[c->count].text, sizeof c->problems->text, "%.255s", text);
    }
    c->count++;
}

static void undo(struct lumi_plan *plan, const struct lumi_plan *initial, const struct key *key)
{
    static const size_t sizes[] = {[WORD] = LUMI_RIG_NAME,    [INTEGER] = sizeof(int),    [REAL] = sizeof(double),
                                   [SETTLE] = sizeof(double), [MODE] = sizeof plan->mode, [WIND] = sizeof plan->wind};

    if (key->kind == CAMERAS) {
        plan->cameras = initial->cameras;
    } else if (key->kind >= EXPOSURES) {
        plan->bracket = initial->bracket;
        memcpy(plan->exposures, initial->exposures, sizeof plan->exposures);
    } else
        memcpy((char *)plan + key->offset, (const char *)initial + key->offset, sizes[key->kind]);
}

/* The line without which the rig could do it; the last of them, as that is what was thought of last. */
static int culprit(const struct parser *p, const int *lines)
{
    struct lumi_plan initial, without;
    int found = 0;

    lumi_plan_init(&initial, p->rig);
    for (int i = 0; i < KEYS; i++) {
        if (!p->set[i] || lines[i] < found)
            continue;
        without = *p->plan;
        undo(&without, &initial, &keys[i]);
        if (lumi_plan_check(&without, p->rig, NULL) == LUMI_OK)
            found = lines[i];
    }
    return found;
}

static void read_lines(struct parser *p, const char *text, size_t size, struct complaint *c, int *lines)
{
    char line[TEXT_LINE];
    bool before[KEYS];

    for (size_t at = 0; at < size;) {
        p->line++;
        memcpy(before, p->set, sizeof before);
        if (!lumi_text_line(text, size, &at, line, sizeof line)) {
            complain(c, p->line, "the line is too long or no text");
            return; /* where the next begins is not known */
        }
        if (parse_line(p, line) != LUMI_OK)
            complain(c, p->line, p->error->text);
        for (int i = 0; i < KEYS; i++)
            if (p->set[i] && !before[i])
                lines[i] = p->line;
    }
}

int lumi_plan_problems(const char *text, size_t size, const struct lumi_rig *rig, struct lumi_plan *plan,
                       struct lumi_plan_problem *problems, int max)
{
    struct lumi_error error = {0};
    struct parser parser = {.rig = rig, .plan = plan, .error = &error};
    struct complaint c = {problems, 0, max};
    int lines[KEYS] = {0};

    lumi_plan_init(plan, rig);
    if (size > LUMI_PLAN_TEXT_MAX) {
        lumi_fail(&error, LUMI_ERR_LIMIT, "a plan of %zu bytes, at most %d are read", size, LUMI_PLAN_TEXT_MAX);
        complain(&c, 0, error.text);
        return c.count;
    }
    read_lines(&parser, text, size, &c, lines);
    if (!parser.section && !c.count)
        complain(&c, 0, "section 'sweep' is missing");
    if (!c.count && resolve_exposures(&parser) != LUMI_OK)
        complain(&c, 0, error.text);
    if (!c.count && lumi_plan_check(plan, rig, &error) != LUMI_OK)
        complain(&c, culprit(&parser, lines), error.text);
    return c.count;
}

/* ---- Writing ---- */

/* As a fraction of a second where that is the very number, as cameras have it. */
static void put_time(struct text_printer *printer, double value)
{
    char text[TEXT_NUMBER];
    double below = round(1 / value);

    if (below > 1 && below < 1e6 && 1 / below == value)
        snprintf(text, sizeof text, "1/%d", (int)below);
    else
        text_print_real(value, 1, text);
    text_put(printer, text);
}

static void put_cameras(struct text_printer *printer, const struct lumi_plan *plan, const struct lumi_rig *rig)
{
    bool first = true;

    if (!plan->cameras)
        text_put(printer, "all");
    for (int i = 0; i < rig->camera_count; i++)
        if (plan->cameras >> i & 1) {
            text_put(printer, first ? "" : ", ");
            text_put(printer, rig->cameras[i].name);
            first = false;
        }
}

static void put_value(struct text_printer *printer, const struct key *key, const struct lumi_plan *plan,
                      const struct lumi_rig *rig)
{
    const void *at = (const char *)plan + key->offset;
    char text[TEXT_NUMBER] = "";

    switch (key->kind) {
    case WORD:
        text_put(printer, at);
        break;
    case INTEGER:
        snprintf(text, sizeof text, "%d", *(const int *)at);
        break;
    case SETTLE:
        if (plan->settle < 0)
            text_put(printer, "profile");
        else
            text_print_real(plan->settle, 1, text);
        break;
    case REAL:
        text_print_real(*(const double *)at, 1, text);
        break;
    case MODE:
        text_put(printer, mode_names[plan->mode]);
        break;
    case WIND:
        text_put(printer, wind_names[plan->wind]);
        break;
    case EXPOSURES:
        for (int k = 0; k < plan->bracket; k++) {
            text_put(printer, k ? ", " : "");
            put_time(printer, plan->exposures[k]);
        }
        break;
    case CAMERAS:
        put_cameras(printer, plan, rig);
        break;
    case EXPOSURE:
    case STOPS:
        break;
    }
    text_put(printer, text);
}

size_t lumi_plan_print(const struct lumi_plan *plan, const struct lumi_rig *rig, char *text, size_t size)
{
    struct text_printer printer = {text, size, 0};

    text_put(&printer, "[sweep]\n");
    for (int i = 0; i < KEYS; i++) {
        if (keys[i].kind == EXPOSURE || keys[i].kind == STOPS)
            continue;
        text_put(&printer, keys[i].name);
        text_put(&printer, " = ");
        put_value(&printer, &keys[i], plan, rig);
        text_put(&printer, "\n");
    }
    return printer.length;
}
