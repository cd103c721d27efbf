/* A log of JSON lines. */
#include "daemon/rig/sweep_log.h"
#include "proto/base/file.h"
#include "proto/base/memory.h"

#include <errno.h>
#include <fcntl.h>
#include <glib.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define LOG_MAX (256u << 20)
#define FIRST_LINE 256

/* ---- reading ---- */

/* The number behind "name": in a line that this program wrote. Names stand once in a line, and texts of the board
 * cannot hold one: their quotes are escaped. */
static bool number_of(const char *text, size_t size, const char *name, uint32_t *value)
{
    char key[40], digits[16];
    size_t length = (size_t)snprintf(key, sizeof key, "\"%s\":", name), used = 0;

    for (size_t at = 0; at + length <= size; at++) {
        if (memcmp(text + at, key, length) != 0 || (at && text[at - 1] == '\\'))
            continue;
        for (at += length; at < size && g_ascii_isdigit(text[at]) && used + 1 < sizeof digits; at++)
            digits[used++] = text[at];
        digits[used] = '\0';
        unsigned long long number = g_ascii_strtoull(digits, NULL, 10);
        *value = (uint32_t)number;
        return used && number <= UINT32_MAX;
    }
    return false;
}

static bool holds(const char *text, size_t size, const char *word)
{
    size_t length = strlen(word);

    for (size_t at = 0; at + length <= size; at++)
        if (memcmp(text + at, word, length) == 0)
            return true;
    return false;
}

void lumi_rig_log_line_parse(const char *text, size_t size, struct lumi_rig_log_line *line)
{
    memset(line, 0, sizeof *line);
    line->has_boot = number_of(text, size, "boot", &line->boot);
    line->has_event = number_of(text, size, "event", &line->event);
    line->has_shot = number_of(text, size, "shot", &line->shot) && line->shot < LUMI_PLAN_SHOTS_MAX;
    line->lost = holds(text, size, "\"lost\":true");
    line->has_plan = number_of(text, size, "plan_crc", &line->plan_crc);
}

static void take_line(struct lumi_rig_sweep_log *log, const struct lumi_rig_log_line *line)
{
    if (line->has_boot && line->has_event) {
        log->boot = line->boot;
        log->event = line->event;
        log->any = true;
    }
    if (line->has_shot && !line->lost)
        log->fired[line->shot / 8] |= (uint8_t)(1u << line->shot % 8);
}

/* With its end, and a zero. */
static size_t first_line(const struct lumi_plan *plan, const struct lumi_rig *rig, char line[FIRST_LINE])
{
    return (size_t)snprintf(
        line, FIRST_LINE,
        "{\"log\":\"lumi rig run\",\"version\":1,\"plan\":\"%s\",\"plan_crc\":%u,\"rig\":\"%s\",\"shots\":%d}\n",
        plan->name, (unsigned)lumi_wire_plan_crc(plan), rig->name, lumi_plan_shots(plan));
}

/* A first line that was torn: nothing of it, its beginning, or zeros where a file system had only made room. */
static bool torn_first_line(const uint8_t *text, size_t size, const struct lumi_plan *plan, const struct lumi_rig *rig)
{
    char line[FIRST_LINE];
    size_t length = first_line(plan, rig, line), same = 0;

    while (same < size && same < length && text[same] == (uint8_t)line[same])
        same++;
    while (same < size && text[same] == 0)
        same++;
    return same == size;
}

static int read_old(struct lumi_rig_sweep_log *log, const struct lumi_plan *plan, const struct lumi_rig *rig,
                    struct lumi_error *error)
{
    uint8_t *text;
    size_t size, whole, at = 0;
    struct lumi_rig_log_line line;
    int code;

    LUMI_TRY(lumi_file_read(log->path, LOG_MAX, &text, &size, error));
    whole = size;
    while (size && text[size - 1] != '\n')
        size--; /* torn */
    log->anew = !size && torn_first_line(text, whole, plan, rig);
    for (int count = 0; at < size; count++) {
        size_t length = (size_t)((const uint8_t *)memchr(text + at, '\n', size - at) - (text + at));
        lumi_rig_log_line_parse((const char *)text + at, length, &line);
        if (count == 0 && (!line.has_plan || line.plan_crc != lumi_wire_plan_crc(plan))) {
            code = lumi_fail(error, LUMI_ERR_FORMAT, "%s: %s", log->path,
                             line.has_plan ? "the log of another plan" : "no log of a sweep");
            goto done;
        }
        take_line(log, &line);
        at += length + 1;
    }
    code = size || log->anew ? LUMI_OK : lumi_fail(error, LUMI_ERR_FORMAT, "%s: no log of this sweep", log->path);
    if (code == LUMI_OK && truncate(log->path, (off_t)size))
        code = lumi_fail_errno(error, log->path, "truncate");
done:
    lumi_free(text);
    return code;
}

bool lumi_rig_sweep_log_has(const struct lumi_rig_sweep_log *log, uint32_t shot)
{
    return shot < LUMI_PLAN_SHOTS_MAX && (log->fired[shot / 8] >> shot % 8 & 1);
}

/* ---- writing ---- */

static int append(struct lumi_rig_sweep_log *log, char *line, size_t size, struct lumi_error *error)
{
    if (log->fd < 0)
        return LUMI_OK;
    line[size++] = '\n';
    log->fresh = false;
    if (lumi_write_all(log->fd, line, size) || fdatasync(log->fd))
        return lumi_fail_errno(error, log->path, "write");
    return LUMI_OK;
}

static int begin(struct lumi_rig_sweep_log *log, const struct lumi_plan *plan, const struct lumi_rig *rig,
                 struct lumi_error *error)
{
    char line[FIRST_LINE];

    return append(log, line, first_line(plan, rig, line) - 1, error);
}

int lumi_rig_sweep_log_open(struct lumi_rig_sweep_log *log, const char *path, bool resume, const struct lumi_plan *plan,
                            const struct lumi_rig *rig, struct lumi_error *error)
{
    bool old = path && resume && access(path, F_OK) == 0;
    int code;

    memset(log, 0, sizeof *log);
    log->fd = -1;
    if (!path)
        return LUMI_OK;
    if (strlen(path) >= sizeof log->path)
        return lumi_fail(error, LUMI_ERR_ARG, "%s: the name is too long", path);
    g_strlcpy(log->path, path, sizeof log->path);
    if (old)
        LUMI_TRY(read_old(log, plan, rig, error));
    log->fd = open(path, O_WRONLY | O_APPEND | O_CLOEXEC | (old ? 0 : O_CREAT | O_EXCL), 0666);
    if (log->fd < 0 && errno == EEXIST)
        return lumi_fail(error, LUMI_ERR_EXISTS, "%s: is there already (--resume goes on with it)", path);
    if (log->fd < 0)
        return lumi_fail_errno(error, path, "open");
    if (old && !log->anew)
        return LUMI_OK;
    code = begin(log, plan, rig, error);
    log->fresh = !old;
    if (code != LUMI_OK)
        lumi_rig_sweep_log_close(log, NULL);
    return code;
}

int lumi_rig_sweep_log_close(struct lumi_rig_sweep_log *log, struct lumi_error *error)
{
    int fd = log->fd;

    log->fd = -1;
    if (fd >= 0 && log->fresh)
        unlink(log->path);
    return fd >= 0 && close(fd) ? lumi_fail_errno(error, log->path, "close") : LUMI_OK;
}

int lumi_rig_sweep_log_notice(struct lumi_rig_sweep_log *log, const struct lumi_rig_notice *notice,
                              const struct lumi_rig_json_clock *clock, struct lumi_error *error)
{
    char line[LUMI_RIG_EVENT_TEXT_MAX + 1];
    const lumi_wire_Shot *shot = &notice->event.kind.shot;
    bool event = notice->kind == LUMI_RIG_NOTICE_EVENT;

    if (event && log->any && clock->boot == log->boot && (int32_t)(notice->event.number - log->event) <= 0)
        return LUMI_OK;
    if (event) {
        log->any = true;
        log->boot = clock->boot;
        log->event = notice->event.number;
    }
    if (event && notice->event.which_kind == lumi_wire_Event_shot_tag && !shot->lost &&
        shot->number < LUMI_PLAN_SHOTS_MAX)
        log->fired[shot->number / 8] |= (uint8_t)(1u << shot->number % 8);
    lumi_rig_notice_json(notice, clock, line, LUMI_RIG_EVENT_TEXT_MAX);
    return append(log, line, strlen(line), error);
}

int lumi_rig_sweep_log_shot(struct lumi_rig_sweep_log *log, uint32_t shot, uint32_t boot, struct lumi_error *error)
{
    char line[128];
    int size = snprintf(line, sizeof line - 1, "{\"boot\":%u,\"shot\":%u,\"lost\":false,\"event_lost\":true}",
                        (unsigned)boot, (unsigned)shot);

    if (shot < LUMI_PLAN_SHOTS_MAX)
        log->fired[shot / 8] |= (uint8_t)(1u << shot % 8);
    return append(log, line, (size_t)size, error);
}

int lumi_rig_sweep_log_clock(struct lumi_rig_sweep_log *log, const struct lumi_rig_link_snapshot *link,
                             struct lumi_error *error)
{
    char line[256];
    int size = snprintf(line, sizeof line - 1,
                        "{\"boot\":%u,\"clock_offset_ns\":%" PRId64 ",\"clock_drift_ppb\":%lld,"
                        "\"clock_residual_ns\":%lld,\"round_trip_ns\":%lld}",
                        (unsigned)link->welcome.boot, link->clock_offset_ns, llround(link->clock_drift_ppm * 1e3),
                        llround(link->clock_residual_ns), llround(link->round_trip_ns));

    if (!link->clock_matched || !link->clock_drift_known)
        return LUMI_OK;
    return append(log, line, (size_t)size, error);
}
