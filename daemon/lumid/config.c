/* The file: lines, groups, keys; then what only makes sense together. */
#include "daemon/lumid/config.h"

#include "daemon/lumid/config_keys.h"
#include "proto/base/file.h"
#include "proto/base/memory.h"

#include <assert.h>
#include <ctype.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define SEEN 128 /* keys of the table, at most */
#define GROUPS 16
static_assert(LUMI_GPIO_NAME == LUMI_RIG_NAME, "a line's camera is called as in the profile");

struct reader {
    struct lumi_config *config;
    const char *source;
    int line;
    lumi_config_problem_fn problem;
    void *context;
    int problems;
    char first[768];
    char group[32]; /* "": none yet; of the line that is read */
    bool unknown;   /* the group is none of ours: its keys are passed by */
    bool seen[SEEN];
    bool group_seen[GROUPS];
    int camera; /* index, in group "camera" */
    int camera_line[LUMI_RIG_CAMERAS], gpio_line[LUMI_GPIO_LINES], link_line, drive_line, http_line, copy_line;
};

static void wrong(struct reader *reader, int line, const char *format, ...) __attribute__((format(printf, 3, 4)));
static void wrong(struct reader *reader, int line, const char *format, ...)
{
    char text[768], what[512];
    va_list list;

    va_start(list, format);
    vsnprintf(what, sizeof what, format, list);
    va_end(list);
    if (line > 0)
        snprintf(text, sizeof text, "%.200s:%d: %s", reader->source, line, what);
    else
        snprintf(text, sizeof text, "%.200s: %s", reader->source, what);
    for (char *c = text; *c; c++) /* what a file says may go to a terminal */
        if ((unsigned char)*c < ' ' || *c == 127)
            *c = '?';
    if (reader->problems++ == 0)
        strcpy(reader->first, text);
    if (reader->problem)
        reader->problem(reader->context, text);
}

static void camera_init(struct lumi_engine_camera *camera)
{
    char why[256];

    memset(camera, 0, sizeof *camera);
    for (int i = 0; i < lumi_config_key_count; i++)
        if (strcmp(lumi_config_keys[i].group, "camera") == 0 && lumi_config_keys[i].kind != LUMI_CONFIG_LINE)
            lumi_config_read(&lumi_config_keys[i], lumi_config_keys[i].standard, camera, NULL, why, sizeof why);
}

void lumi_config_init(struct lumi_config *config)
{
    char why[256];

    memset(config, 0, sizeof *config);
    for (int i = 0; i < lumi_config_key_count; i++)
        if (strcmp(lumi_config_keys[i].group, "camera") != 0 && lumi_config_keys[i].kind != LUMI_CONFIG_LINE)
            lumi_config_read(&lumi_config_keys[i], lumi_config_keys[i].standard, config, NULL, why, sizeof why);
}

/* ---- lines ---- */

static char *trimmed(char *text)
{
    char *end = text + strlen(text);

    while (isspace((unsigned char)*text))
        text++;
    while (end > text && isspace((unsigned char)end[-1]))
        end--;
    *end = 0;
    return text;
}

static bool good_name(const char *name)
{
    return *name && *name != '.' && strlen(name) < LUMI_RIG_NAME &&
           strspn(name, "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._-") == strlen(name);
}

static void begin_camera(struct reader *reader, char *name)
{
    struct lumi_config *config = reader->config;

    reader->unknown = true;
    if (!good_name(name)) {
        wrong(reader, reader->line, "[camera %.40s]: a camera's name is 1 to %d letters, digits, '.', '_', '-'", name,
              LUMI_RIG_NAME - 1);
        return;
    }
    for (int i = 0; i < config->engine.camera_count; i++)
        if (strcmp(config->engine.cameras[i].name, name) == 0) {
            wrong(reader, reader->line, "[camera %s]: it is there already, in line %d", name, reader->camera_line[i]);
            return;
        }
    if (config->engine.camera_count == LUMI_RIG_CAMERAS) {
        wrong(reader, reader->line, "[camera %s]: more than %d cameras", name, LUMI_RIG_CAMERAS);
        return;
    }
    reader->unknown = false;
    reader->camera = config->engine.camera_count++;
    reader->camera_line[reader->camera] = reader->line;
    camera_init(&config->engine.cameras[reader->camera]);
    strcpy(config->engine.cameras[reader->camera].name, name);
    for (int i = 0; i < lumi_config_key_count; i++)
        if (strcmp(lumi_config_keys[i].group, "camera") == 0)
            reader->seen[i] = false;
}

static void begin_group(struct reader *reader, char *text)
{
    char *end = strchr(text, ']');

    reader->unknown = true;
    strcpy(reader->group, "?");
    if (!end || end[1]) {
        wrong(reader, reader->line, "a group is written [NAME]");
        return;
    }
    *end = 0;
    text = trimmed(text + 1);
    if (strcmp(text, "camera") == 0 || (strncmp(text, "camera", 6) == 0 && isspace((unsigned char)text[6]))) {
        strcpy(reader->group, "camera");
        begin_camera(reader, trimmed(text + 6));
        return;
    }
    for (int i = 0; lumi_config_groups[i].name; i++)
        if (strcmp(lumi_config_groups[i].name, text) == 0) {
            strcpy(reader->group, text);
            reader->unknown = false;
            if (reader->group_seen[i])
                wrong(reader, reader->line, "[%s]: this group is there already", text);
            reader->group_seen[i] = true;
            return;
        }
    wrong(reader, reader->line, "[%.40s]: there is no such group", text);
}

static void add_line(struct reader *reader, const struct lumi_gpio_line *line)
{
    struct lumi_config *config = reader->config;

    if (!line->chip[0])
        return;
    if (config->gpio_count == LUMI_GPIO_LINES) {
        wrong(reader, reader->line, "[%s]: more than %d lines", reader->group, LUMI_GPIO_LINES);
        return;
    }
    struct lumi_gpio_line *added = &config->gpio[config->gpio_count];
    *added = *line;
    reader->gpio_line[config->gpio_count++] = reader->line;
    if (strcmp(reader->group, "camera") != 0)
        return;
    memcpy(added->camera, config->engine.cameras[reader->camera].name, sizeof added->camera);
    if (line->role == LUMI_GPIO_SYNC)
        config->engine.cameras[reader->camera].sync_line = true;
}

static void note_line(struct reader *reader, const struct lumi_config_key *key)
{
    if (strcmp(key->group, "rig") == 0)
        *(key->kind == LUMI_CONFIG_LINK ? &reader->link_line : &reader->drive_line) = reader->line;
    else if (strcmp(key->group, "http") == 0)
        reader->http_line = reader->line;
    else if (strcmp(key->name, "second_copy") == 0)
        reader->copy_line = reader->line;
}

static void read_key(struct reader *reader, char *text)
{
    struct lumi_config *config = reader->config;
    char *equals = strchr(text, '='), why[256];

    if (!equals) {
        wrong(reader, reader->line, "no KEY = VALUE, no [GROUP] and no comment: \"%.40s\"", text);
        return;
    }
    *equals = 0;
    char *name = trimmed(text), *value = trimmed(equals + 1);
    if (!reader->group[0]) {
        wrong(reader, reader->line, "%.40s: a key before the first [GROUP]", name);
        return;
    }
    if (reader->unknown)
        return;
    bool camera = strcmp(reader->group, "camera") == 0;
    char at[80];
    snprintf(at, sizeof at, camera ? "[camera %s]" : "[%s]",
             camera ? config->engine.cameras[reader->camera].name : reader->group);
    for (int i = 0; i < lumi_config_key_count; i++) {
        const struct lumi_config_key *key = &lumi_config_keys[i];
        struct lumi_gpio_line line;
        if (strcmp(key->group, reader->group) != 0 || strcmp(key->name, name) != 0)
            continue;
        if (reader->seen[i]) {
            wrong(reader, reader->line, "%s %s: it is there already", at, name);
            return;
        }
        reader->seen[i] = true;
        note_line(reader, key);
        const char *said = lumi_config_read(
            key, value, camera ? (void *)&config->engine.cameras[reader->camera] : config, &line, why, sizeof why);
        if (said)
            wrong(reader, reader->line, "%s %s: \"%.60s\" %s", at, name, value, said);
        else if (key->kind == LUMI_CONFIG_LINE)
            add_line(reader, &line);
        return;
    }
    wrong(reader, reader->line, "%s %.40s: there is no such key", at, name);
}

/* ---- what only makes sense together ---- */

/* "aravis:42" and "42" may be one camera. */
static const char *camera_serial(const char *address)
{
    static const char *const backends[] = {"v4l2:", "libcamera:", "aravis:"};

    for (int i = 0; i < 3; i++)
        if (strncmp(address, backends[i], strlen(backends[i])) == 0)
            return address + strlen(backends[i]);
    return address;
}

static void check_cameras(struct reader *reader)
{
    const struct lumi_engine_config *engine = &reader->config->engine;

    for (int i = 0; i < engine->camera_count; i++) {
        const struct lumi_engine_camera *camera = &engine->cameras[i];
        if (!camera->address[0]) {
            wrong(reader, reader->camera_line[i], "[camera %s] address: it must be given", camera->name);
            continue;
        }
        for (int k = 0; k < i; k++)
            if (strcmp(camera_serial(camera->address), camera_serial(engine->cameras[k].address)) == 0)
                wrong(reader, reader->camera_line[i], "[camera %s] address: \"%.60s\" is camera %s already",
                      camera->name, camera->address, engine->cameras[k].name);
        if (camera->setting.frame_rate > 0 && camera->setting.trigger != LUMI_TRIGGER_FREE)
            wrong(reader, reader->camera_line[i], "[camera %s] frame_rate: only with trigger = free", camera->name);
    }
}

static void check_lines(struct reader *reader)
{
    const struct lumi_config *config = reader->config;

    for (int i = 0; i < config->gpio_count; i++)
        for (int k = 0; k < i; k++) {
            const struct lumi_gpio_line *a = &config->gpio[i], *b = &config->gpio[k];
            if (strcmp(a->chip, b->chip) == 0 && a->offset == b->offset && strcmp(a->line_name, b->line_name) == 0)
                wrong(reader, reader->gpio_line[i], "[gpio]: this line is used in line %d already",
                      reader->gpio_line[k]);
        }
}

/* "[::1]:80" and "localhost:80": the port's number behind the last colon. */
static void check_listen(struct reader *reader)
{
    const struct lumi_config *config = reader->config;
    const char *colon = strrchr(config->listen, ':');
    const char *second = strrchr(config->secure, ':');
    char host[256] = "";

    if (config->secure[0] && (!second || second == config->secure || !second[1] || strlen(second + 1) > 5 ||
                              strspn(second + 1, "0123456789") != strlen(second + 1) || atoi(second + 1) > 65535))
        wrong(reader, reader->http_line, "[http] secure: \"%.60s\" is no ADDRESS:PORT", config->secure);
    if (!colon || colon == config->listen || !colon[1] || strlen(colon + 1) > 5 ||
        strspn(colon + 1, "0123456789") != strlen(colon + 1) || atoi(colon + 1) > 65535) {
        wrong(reader, reader->http_line, "[http] listen: \"%.60s\" is no ADDRESS:PORT", config->listen);
        return;
    }
    memcpy(host, config->listen, (size_t)(colon - config->listen));
    bool loopback = strcmp(host, "localhost") == 0 || strncmp(host, "127.", 4) == 0 || strcmp(host, "[::1]") == 0;
    if (!loopback && !config->token_file[0])
        wrong(reader, reader->http_line, "[http] listen: %.60s is not this computer alone: token_file must be given",
              config->listen);
    if (!config->certificate[0] != !config->key[0])
        wrong(reader, reader->http_line, "[http] %s: it must be given, too", config->key[0] ? "certificate" : "key");
}

static void check_whole(struct reader *reader)
{
    struct lumi_config *config = reader->config;

    check_cameras(reader);
    check_lines(reader);
    check_listen(reader);
    if (!config->engine.folder[0])
        wrong(reader, 0, "[capture] folder: it must be given");
    if (config->drive[0] && strncmp(config->drive, "tcp:", 4) != 0 && strncmp(config->drive, "rtu:", 4) != 0)
        wrong(reader, reader->drive_line, "[rig] drive: \"%.60s\" is no drive's address: tcp:HOST[:PORT], rtu:/dev/...",
              config->drive);
    if (!config->drive[0] != !config->drive_map[0])
        wrong(reader, reader->drive_line, "[rig] %s: it must be given, too", config->drive[0] ? "drive_map" : "drive");
    if (config->second_copy[0] && strcmp(config->second_copy, config->engine.folder) == 0)
        wrong(reader, reader->copy_line, "[capture] second_copy: it is the folder itself");
    if (config->ingest_folder[0] && strcmp(config->ingest_folder, config->engine.folder) == 0)
        wrong(reader, 0, "[ingest] folder: it is the captures' folder itself");
}

int lumi_config_parse(const char *text, size_t size, const char *source, struct lumi_config *config,
                      lumi_config_problem_fn problem, void *context, struct lumi_error *error)
{
    struct reader reader = {.config = config, .source = source, .problem = problem, .context = context};
    char line[2048];

    lumi_config_init(config);
    for (size_t at = 0; at < size;) {
        const char *end = memchr(text + at, '\n', size - at);
        size_t length = (end ? (size_t)(end - text) : size) - at;
        reader.line++;
        if (length >= sizeof line || memchr(text + at, 0, length))
            wrong(&reader, reader.line, length >= sizeof line ? "a line of %zu bytes" : "a zero among %zu bytes",
                  length);
        else {
            memcpy(line, text + at, length);
            line[length] = 0;
            char *used = trimmed(line);
            if (*used == '[')
                begin_group(&reader, used);
            else if (*used && *used != '#' && *used != ';')
                read_key(&reader, used);
        }
        at += length + 1;
    }
    check_whole(&reader);
    if (reader.problems > 1)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s (and %d more)", reader.first, reader.problems - 1);
    return reader.problems ? lumi_fail(error, LUMI_ERR_FORMAT, "%s", reader.first) : LUMI_OK;
}

int lumi_config_load(const char *path, struct lumi_config *config, lumi_config_problem_fn problem, void *context,
                     struct lumi_error *error)
{
    uint8_t *data = NULL;
    size_t size = 0;

    LUMI_TRY(lumi_file_read(path, LUMI_CONFIG_SIZE, &data, &size, error));
    int code = lumi_config_parse((const char *)data, size, path, config, problem, context, error);
    lumi_free(data);
    return code;
}

/* ---- the machine ---- */

int lumi_config_check_host(const struct lumi_config *config, const char *source, lumi_config_problem_fn problem,
                           void *context, struct lumi_error *error)
{
    const struct {
        const char *key, *path;
        int mode;
    } places[] = {{"[capture] folder", config->engine.folder, W_OK | X_OK},
                  {"[capture] second_copy", config->second_copy, W_OK},
                  {"[rig] drive_map", config->drive_map, R_OK},
                  {"[http] token_file", config->token_file, R_OK},
                  {"[http] certificate", config->certificate, R_OK},
                  {"[http] key", config->key, R_OK},
                  {"[ingest] folder", config->ingest_folder, W_OK | X_OK}};
    struct reader reader = {.source = source, .problem = problem, .context = context};
    struct lumi_error first = {0};

    for (size_t i = 0; i < sizeof places / sizeof *places; i++) {
        struct lumi_error found = {0};
        if (!places[i].path[0] || access(places[i].path, places[i].mode) == 0)
            continue;
        lumi_fail_errno(&found, places[i].path, places[i].mode & W_OK ? "is to be written to" : "is to be read");
        wrong(&reader, 0, "%s: %.300s", places[i].key, found.text);
        if (first.code == LUMI_OK)
            first = found;
    }
    return reader.problems ? lumi_fail(error, first.code, "%s", reader.first) : LUMI_OK;
}
