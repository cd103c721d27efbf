/* The table of keys, and how one value is read. */
#include "daemon/lumid/config_keys.h"

#include <ctype.h>
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

const char *const lumi_config_triggers[] = {"free", "hardware", "software", NULL};
const char *const lumi_config_layouts[] = {"any", "jpeg", "raw", "grey", "rgb", "yuyv", "nv12", NULL};

const struct lumi_config_group lumi_config_groups[] = {
    {"rig", "The board that moves the rig and fires the cameras."},
    {"capture", "Captures: where they go, and when they are good."},
    {"judge", "What a frame must be like; what is not is taken again."},
    {"camera",
     "One group for each camera, [camera NAME], NAME as in the rig's profile. A capture can be taken without any only "
     "where the profile has none."},
    {"gpio", "Lines of this computer, CHIP:LINE with the chip's name or label and the line's number or name, then "
             ",active-low and ,debounce_us=N if need be."},
    {"http", "The API, docs/api.md."},
    {"preview", "The light field so far, as the page shows it."},
    {"process", "What is started with a capture that is sealed."},
    {"ingest", "Captures that arrive in a folder are copied, verified and processed, each once."},
    {NULL, NULL}};

#define AT(field) offsetof(struct lumi_config, field), sizeof(((struct lumi_config *)0)->field)
#define CAMERA_AT(field) offsetof(struct lumi_engine_camera, field), sizeof(((struct lumi_engine_camera *)0)->field)
#define TEXT(group, name, kind, place, standard, example, meaning)                                                     \
    {                                                                                                                  \
        group, name, LUMI_CONFIG_##kind, place, 0, 0, NULL, LUMI_GPIO_ESTOP, standard, example, meaning                \
    }
#define REAL(group, name, place, least, most, standard, meaning)                                                       \
    {                                                                                                                  \
        group, name, LUMI_CONFIG_REAL, place, least, most, NULL, LUMI_GPIO_ESTOP, standard, NULL, meaning              \
    }
#define NUMBER(group, name, place, least, most, standard, meaning)                                                     \
    {                                                                                                                  \
        group, name, LUMI_CONFIG_NUMBER, place, least, most, NULL, LUMI_GPIO_ESTOP, standard, NULL, meaning            \
    }
#define FLAG(group, name, place, standard, meaning)                                                                    \
    {                                                                                                                  \
        group, name, LUMI_CONFIG_FLAG, place, 0, 0, NULL, LUMI_GPIO_ESTOP, standard, NULL, meaning                     \
    }
#define CHOICE(group, name, place, names, standard, meaning)                                                           \
    {                                                                                                                  \
        group, name, LUMI_CONFIG_CHOICE, place, 0, 0, names, LUMI_GPIO_ESTOP, standard, NULL, meaning                  \
    }
#define BYTES(group, name, place, least, most, standard, meaning)                                                      \
    {                                                                                                                  \
        group, name, LUMI_CONFIG_BYTES, place, least, most, NULL, LUMI_GPIO_ESTOP, standard, NULL, meaning             \
    }
#define LINE(group, name, role, example, meaning)                                                                      \
    {                                                                                                                  \
        group, name, LUMI_CONFIG_LINE, 0, 0, 0, 0, NULL, role, "", example, meaning                                    \
    }

const struct lumi_config_key lumi_config_keys[] = {
    TEXT("rig", "link", LINK, AT(link), "usb:", NULL,
         "The board's address: usb: (the only one), usb:SERIAL, serial:/dev/ttyUSB0[,baud=115200][,rs485], "
         "unix:/path."),
    TEXT("rig", "drive", TEXT, AT(drive), "", "tcp:192.168.1.20:502",
         "An industrial drive that turns the platform in place of the board: rtu:/dev/ttyUSB1[,baud=19200][,parity=E]"
         "[,stop=1] or tcp:HOST[:PORT]."),
    TEXT("rig", "drive_map", PLACE, AT(drive_map), "", "/etc/lumisphere/drive.map",
         "The drive's registers, docs/rig-drive.md; needed with drive."),
    REAL("rig", "patience_s", AT(engine.rig_patience), 1, 86400, "60",
         "How long the board may be away in a sweep before the capture counts as interrupted."),
    FLAG("rig", "wind_up", AT(engine.wind_up), "no",
         "Homing winds the string all the way up first, so that the turn is found."),
    NUMBER("rig", "home_turn", AT(engine.home_turn), 0, LUMI_RIG_TURNS_MAX - 1, "0",
           "Without wind_up: the turn the rig is in when it homes."),
    TEXT("capture", "folder", PLACE, AT(engine.folder), "/var/lib/lumisphere/captures", NULL,
         "Where captures are made."),
    TEXT("capture", "second_copy", PLACE, AT(second_copy), "", "/media/second/captures",
         "A folder on another disk, to which every capture is copied as it is taken."),
    NUMBER("capture", "retakes", AT(engine.retakes), 0, 100, "3",
           "Rounds in which missing and rejected shots are taken again by themselves."),
    REAL("capture", "frame_patience_s", AT(engine.frame_patience), 0.1, 3600, "5",
         "How long after its shot a frame may come."),
    REAL("capture", "match_window_s", AT(engine.match_window), 0, 60, "0",
         "How far from where it is expected a frame may lie in time, both sides together; 0: by the plan's spacing."),
    REAL("capture", "disk_reserve", AT(engine.disk_reserve), 0, 0.9, "0.05",
         "Share of the free space that a sweep leaves."),
    BYTES("capture", "memory", AT(engine.store.memory), 1 << 20, 1ULL << 40, "512M",
          "Frames that wait for the disk, in bytes; K, M, G may follow."),
    NUMBER("capture", "writers", AT(engine.store.writers), 0, 64, "0",
           "Threads that write; 0: by the number of processors."),
    FLAG("capture", "verify", AT(engine.verify), "yes", "All frames are read again before a capture is sealed."),
    REAL("capture", "battery_least", AT(engine.battery_least), 0, 1, "0.2",
         "Charge below which a camera's battery is red in the preflight, where the camera tells it."),
    REAL("capture", "temperature_most_c", AT(engine.temperature_most), 0, 150, "70",
         "Degrees above which a camera is red."),
    FLAG("judge", "judging", AT(engine.judging), "yes", "Frames are judged as they come."),
    NUMBER("judge", "workers", AT(judge_workers), 0, 64, "0", "Threads that judge; 0: by the number of processors."),
    REAL("judge", "sharpness_share", AT(engine.judge.sharpness_share), 0, 1, "0.5",
         "Of the usual sharpness of the camera's frames, below which one is rejected."),
    REAL("judge", "blur_pixels", AT(engine.judge.blur_pixels), 0, 1000, "2", "Longest smear."),
    REAL("judge", "clipped", AT(engine.judge.clipped), 0, 1, "0.25", "Largest share of pixels at white."),
    REAL("judge", "exposure_stops", AT(engine.judge.exposure_stops), 0, 20, "0.5",
         "Largest difference in exposure to the frames beside it."),
    REAL("judge", "shift_pixels", AT(engine.judge.shift_pixels), 0, 10000, "8",
         "Largest displacement from where its pose says it looks."),
    REAL("judge", "moved", AT(engine.judge.moved), 0, 1, "0.05",
         "Share of the overlap with its neighbours that may differ: things that moved."),
    FLAG("judge", "reject_moved", AT(engine.judge.reject_moved), "no", "More than that is rejected, not only told."),
    TEXT("camera", "address", CAMERA, CAMERA_AT(address), "", "aravis:SERIAL",
         "v4l2:SERIAL, libcamera:SERIAL, aravis:SERIAL, the serial number alone, or files:/folder. Must be given."),
    CHOICE("camera", "trigger", CAMERA_AT(setting.trigger), lumi_config_triggers, "hardware",
           "What fires it: the board's line, lumid itself, or nothing (free)."),
    TEXT("camera", "trigger_input", TEXT, CAMERA_AT(setting.trigger_input), "", "Line1",
         "The camera's input; empty: its usual one."),
    FLAG("camera", "trigger_falling", CAMERA_AT(setting.trigger_falling), "no", "It fires on the falling edge."),
    REAL("camera", "exposure_s", CAMERA_AT(setting.exposure_s), 0, 3600, "0", "0: the plan's."),
    REAL("camera", "gain", CAMERA_AT(setting.gain), 0, 1000, "0", "Linear, 1 the base; 0: the camera's own choice."),
    REAL("camera", "white_balance_k", CAMERA_AT(setting.white_balance), 0, 20000, "0", "0: the camera's own choice."),
    REAL("camera", "black_level", CAMERA_AT(black), 0, 65535, "0",
         "Raw frames: the sample value of no light; 0: what the camera says, else 0."),
    REAL("camera", "white_red", CAMERA_AT(white_red), 0, 64, "0",
         "Raw frames: what red is multiplied with to match green; 0: what the camera says, else 1."),
    REAL("camera", "white_blue", CAMERA_AT(white_blue), 0, 64, "0", "The same of blue."),
    REAL("camera", "frame_rate", CAMERA_AT(setting.frame_rate), 0, 10000, "0", "With trigger = free; 0: its default."),
    NUMBER("camera", "width", CAMERA_AT(setting.width), 0, 65535, "0", "0: as large as it goes."),
    NUMBER("camera", "height", CAMERA_AT(setting.height), 0, 65535, "0", "0: as large as it goes."),
    CHOICE("camera", "layout", CAMERA_AT(setting.layout), lumi_config_layouts, "any",
           "Of its frames; any: raw where it can, else JPEG, else what there is."),
    NUMBER("camera", "bits", CAMERA_AT(setting.bits), 0, 16, "0", "A sample; 0: the most it has."),
    FLAG("camera", "chunk_data", CAMERA_AT(setting.chunk_data), "yes",
         "Exposure, gain and trigger count come with every frame, where it offers that (GigE and USB3 Vision)."),
    NUMBER("camera", "buffers", CAMERA_AT(setting.buffers), 0, 256, "0", "Frames in its pool; 0: 8."),
    FLAG("camera", "dmabuf", CAMERA_AT(setting.dmabuf), "no", "V4L2: buffers are exported, not copied."),
    TEXT("camera", "options", TEXT, CAMERA_AT(setting.options), "", "PacketSize=8000",
         "Of its kind: NAME=VALUE, several with blanks between; an unknown one is refused."),
    FLAG("camera", "optional", CAMERA_AT(optional), "no", "A sweep may begin without it."),
    LINE("camera", "sync", LUMI_GPIO_SYNC, "gpiochip0:5", "The line on which its exposures are seen."),
    LINE("camera", "power", LUMI_GPIO_POWER, "gpiochip0:6",
         "The line that switches its power, which is on while lumid runs."),
    LINE("gpio", "estop", LUMI_GPIO_ESTOP, "gpiochip0:17,active-low,debounce_us=1000",
         "An emergency stop; active: pressed."),
    LINE("gpio", "lamp", LUMI_GPIO_LAMP, "gpiochip0:22", "On while the rig may move."),
    LINE("gpio", "power", LUMI_GPIO_POWER, "gpiochip0:23", "Power of all cameras that have no line of their own."),
    TEXT("http", "listen", TEXT, AT(listen), "localhost:8470", NULL,
         "localhost:PORT, or ADDRESS:PORT, which needs a token_file; port 0: any."),
    TEXT("http", "token_file", PLACE, AT(token_file), "", "/etc/lumisphere/token",
         "A file whose first line is the token that everybody but this computer must show; readable by lumid only."),
    TEXT("http", "certificate", PLACE, AT(certificate), "", "/etc/lumisphere/certificate.pem",
         "PEM; with it and key: TLS."),
    TEXT("http", "key", PLACE, AT(key), "", "/etc/lumisphere/key.pem", "PEM."),
    TEXT("http", "access", PLACE, AT(access), "/var/lib/lumisphere/access", NULL,
         "A folder for users (lumi user), their sessions and the rig's certificate, docs/access.md; empty: no users."),
    TEXT("http", "secure", TEXT, AT(secure), "*:8471", NULL,
         "Where others are answered, with TLS, as soon as there is a user: *:PORT, ADDRESS:PORT; empty: nowhere."),
    REAL("http", "session_idle_s", AT(session_idle), 1, 31536000, "86400",
         "How long somebody stays logged in without using it."),
    REAL("http", "session_s", AT(session_most), 1, 31536000, "1209600", "How long somebody stays logged in at all."),
    BYTES("http", "body_max", AT(body_max), 1024, 1 << 30, "1M", "Largest request."),
    TEXT("preview", "command", TEXT, AT(preview), "lumi preview %c --serve", NULL,
         "What draws views of the light field so far, when somebody looks at them: words and quotes as in a shell, "
         "without "
         "one; %c is the capture. Empty: nothing does."),
    TEXT("process", "command", TEXT, AT(command), "", "lumi process %c -o %o",
         "Words and quotes as in a shell, without one: %c the capture, %n its name, %w its work folder, %o the field "
         "beside it. Empty: nothing is started."),
    NUMBER("process", "parallel", AT(process_parallel), 1, 64, "1", "How many at once."),
    NUMBER("process", "retries", AT(process_retries), 0, 100, "0", "How often after a failure."),
    TEXT("ingest", "folder", PLACE, AT(ingest_folder), "", "/srv/incoming",
         "It is watched; empty: none. lumid --ingest FOLDER does that alone, without a rig."),
    REAL("ingest", "settle_s", AT(ingest_settle), 0.1, 3600, "5",
         "How long nothing may change in what has appeared before it counts as whole."),
};
const int lumi_config_key_count = sizeof lumi_config_keys / sizeof *lumi_config_keys;

static const char *read_text(const struct lumi_config_key *key, const char *value, char *to, char *why, size_t size)
{
    static const char *const boards[] = {"usb:", "serial:/", "unix:/", "fd:", "/", NULL};
    bool found = false;

    if (strlen(value) >= key->bytes) {
        snprintf(why, size, "longer than %zu bytes", key->bytes - 1);
        return why;
    }
    if (key->kind == LUMI_CONFIG_PLACE && *value && *value != '/')
        return "is no path from the root (/...)";
    for (int i = 0; key->kind == LUMI_CONFIG_LINK && boards[i]; i++)
        found = found || strncmp(value, boards[i], strlen(boards[i])) == 0;
    if (key->kind == LUMI_CONFIG_LINK && !found)
        return "is no board's address: usb:, usb:SERIAL, serial:/dev/..., unix:/...";
    if (key->kind == LUMI_CONFIG_CAMERA && strncmp(value, "files:", 6) == 0 && value[6] != '/')
        return "files: wants a path from the root";
    const char *colon = strchr(value, ':');
    if (key->kind == LUMI_CONFIG_CAMERA && *value && colon && !colon[1])
        return "names no camera: a serial number must follow";
    strcpy(to, value);
    return NULL;
}

static const char *read_flag(const char *value, bool *to)
{
    static const char *const yes[] = {"yes", "true", "on", "1"}, *const no[] = {"no", "false", "off", "0"};

    for (int i = 0; i < 4; i++)
        if (strcmp(value, yes[i]) == 0 || strcmp(value, no[i]) == 0) {
            *to = strcmp(value, yes[i]) == 0;
            return NULL;
        }
    return "must be yes or no";
}

/* A number in decimal, without what strtod takes besides (hexadecimal, nan, inf). */
static bool read_decimal(const char *value, double *number, const char **end)
{
    char *stop;

    if (!*value || !strchr("0123456789+-.", *value) || strpbrk(value, "xXnNiI"))
        return false;
    errno = 0;
    *number = strtod(value, &stop);
    *end = stop;
    return stop != value && isfinite(*number);
}

static const char *read_number(const struct lumi_config_key *key, const char *value, void *to, char *why, size_t size)
{
    const char *end;
    double number;

    if (!read_decimal(value, &number, &end))
        return "is no number";
    if (key->kind == LUMI_CONFIG_BYTES && *end && strchr("KMGT", *end) && !end[1]) {
        number *= pow(1024, 1 + (double)(strchr("KMGT", *end) - "KMGT"));
        end++;
    }
    if (*end)
        return key->kind == LUMI_CONFIG_BYTES ? "is no number of bytes: 512M, 1G" : "is no number";
    if (key->kind != LUMI_CONFIG_REAL && number != floor(number))
        return "must be a whole number";
    if (number < key->least || number > key->most) {
        snprintf(why, size, "must be between %.15g and %.15g", key->least, key->most);
        return why;
    }
    if (key->kind == LUMI_CONFIG_NUMBER)
        *(int *)to = (int)number;
    else if (key->kind == LUMI_CONFIG_BYTES)
        *(size_t *)to = (size_t)number;
    else
        *(double *)to = number + 0.0; /* no negative zero */
    return NULL;
}

static const char *read_choice(const struct lumi_config_key *key, const char *value, int *to, char *why, size_t size)
{
    char bounds[256];

    for (int i = 0; key->names[i]; i++)
        if (strcmp(key->names[i], value) == 0) {
            *to = i;
            return NULL;
        }
    lumi_config_bounds(key, bounds, sizeof bounds);
    snprintf(why, size, "must be one of %s", bounds);
    return why;
}

/* What follows the place: ",active-low", ",debounce_us=N". */
static const char *read_line_words(char *words, const struct lumi_config_key *key, struct lumi_gpio_line *line)
{
    char *rest = NULL;

    for (char *word = strtok_r(words, ",", &rest); word; word = strtok_r(NULL, ",", &rest)) {
        char *end = NULL;
        if (strcmp(word, "active-low") == 0)
            line->active_low = true;
        else if (strncmp(word, "debounce_us=", 12) == 0 && isdigit((unsigned char)word[12])) {
            long number = strtol(word + 12, &end, 10);
            if (*end || number > 1000000)
                return "debounce_us must be a whole number up to 1000000";
            if (key->role != LUMI_GPIO_ESTOP)
                return "only an emergency stop is debounced";
            line->debounce_us = (int)number;
        } else
            return "what follows the line must be active-low or debounce_us=N";
    }
    return NULL;
}

static const char *read_line(const struct lumi_config_key *key, const char *value, struct lumi_gpio_line *line)
{
    char text[256], *words;

    memset(line, 0, sizeof *line);
    line->role = key->role;
    line->offset = -1;
    if (!*value)
        return NULL;
    if (strlen(value) >= sizeof text)
        return "is too long";
    strcpy(text, value);
    words = strchr(text, ',');
    if (words)
        *words++ = 0;
    char *colon = strrchr(text, ':');
    if (!colon || colon == text || !colon[1])
        return "must be CHIP:LINE";
    *colon++ = 0;
    if (strlen(text) >= sizeof line->chip || strlen(colon) >= sizeof line->line_name)
        return "is too long";
    strcpy(line->chip, text);
    if (strspn(colon, "0123456789") == strlen(colon)) {
        if (strlen(colon) > 6)
            return "has no such line";
        line->offset = atoi(colon);
    } else
        strcpy(line->line_name, colon);
    return words ? read_line_words(words, key, line) : NULL;
}

const char *lumi_config_read(const struct lumi_config_key *key, const char *value, void *base,
                             struct lumi_gpio_line *line, char *why, size_t size)
{
    char *to = (char *)base + key->offset;

    switch (key->kind) {
    case LUMI_CONFIG_FLAG:
        return read_flag(value, (bool *)to);
    case LUMI_CONFIG_NUMBER:
    case LUMI_CONFIG_REAL:
    case LUMI_CONFIG_BYTES:
        return read_number(key, value, to, why, size);
    case LUMI_CONFIG_CHOICE:
        return read_choice(key, value, (int *)to, why, size);
    case LUMI_CONFIG_LINE:
        return read_line(key, value, line);
    default:
        return read_text(key, value, to, why, size);
    }
}

void lumi_config_bounds(const struct lumi_config_key *key, char *text, size_t size)
{
    size_t used = 0;

    *text = 0;
    if (key->kind == LUMI_CONFIG_FLAG)
        snprintf(text, size, "yes or no");
    else if (key->kind == LUMI_CONFIG_NUMBER || key->kind == LUMI_CONFIG_REAL)
        snprintf(text, size, "%.15g to %.15g", key->least, key->most);
    for (int i = 0; key->kind == LUMI_CONFIG_CHOICE && key->names[i] && used < size; i++)
        used += (size_t)snprintf(text + used, size - used, "%s%s", i ? ", " : "", key->names[i]);
}
