/* Lines with checksums, appended and synced. */
#include "daemon/handover/handover_journal.h"

#include "proto/base/bytes.h"
#include "proto/base/file.h"
#include "proto/base/memory.h"

#include <errno.h>
#include <fcntl.h>
#include <libgen.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <time.h>
#include <unistd.h>

#define JOURNAL_MAX ((size_t)64 << 20)

struct journal {
    char *path;
    int fd;
};

/* ---- Reading ---- */

static int split(char *text, struct journal_line *line)
{
    line->count = 0;
    for (char *at = text; at; line->count++) {
        if (line->count == JOURNAL_FIELDS)
            return LUMI_ERR_FORMAT;
        line->fields[line->count] = at;
        at = strchr(at, '\t');
        if (at)
            *at++ = '\0';
    }
    return LUMI_OK;
}

static bool plain(const char *text, size_t length)
{
    for (size_t i = 0; i < length; i++)
        if (((unsigned char)text[i] < 0x20 && text[i] != '\t') || text[i] == 0x7f)
            return false;
    return true;
}

/* NULL, or what is wrong with it; `text` is without the line feed and ends with 0. */
static const char *check(char *text, size_t length, struct journal_line *line)
{
    char *end, digits[9] = "";

    if (length < 10 || text[8] != ' ')
        return "it is no line of a journal";
    memcpy(digits, text, 8);
    if (strspn(digits, "0123456789abcdef") != 8)
        return "it has no checksum";
    const unsigned long crc = strtoul(digits, &end, 16);
    if (lumi_crc32c(0, text + 9, length - 9) != crc)
        return "it does not match its checksum";
    if (strlen(text) != length || !plain(text + 9, length - 9))
        return "it has a control character";
    return split(text + 9, line) == LUMI_OK ? NULL : "it has too many fields";
}

int journal_parse(const void *data, size_t size, const char *source, journal_fn line, void *context, size_t *whole,
                  struct lumi_error *error)
{
    const char *bytes = data;
    char text[JOURNAL_LINE];
    int number = 0;

    *whole = 0;
    for (size_t at = 0; at < size;) {
        const char *end = memchr(bytes + at, '\n', size - at);
        const size_t length = end ? (size_t)(end - bytes) - at : size - at;
        struct journal_line parts;
        number++;
        if (!end) /* half a line: the program was killed while it wrote it */
            return LUMI_OK;
        if (length >= sizeof text)
            return lumi_fail(error, LUMI_ERR_FORMAT, "%s: line %d is too long", source, number);
        memcpy(text, bytes + at, length);
        text[length] = '\0';
        const char *fault = check(text, length, &parts);
        if (fault)
            return lumi_fail(error, LUMI_ERR_FORMAT, "%s: line %d: %s", source, number, fault);
        LUMI_TRY(line(context, &parts, error));
        at += length + 1;
        *whole = at;
    }
    return LUMI_OK;
}

/* ---- The file ---- */

static int sync_folder(const char *path, struct lumi_error *error)
{
    const size_t size = strlen(path) + 1;
    char *copy = lumi_alloc(size, 1);
    int code = LUMI_OK;

    if (!copy)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: out of memory", path);
    memcpy(copy, path, size);
    const int fd = open(dirname(copy), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd < 0 || fsync(fd) < 0)
        code = lumi_fail_errno(error, path, "sync its folder");
    if (fd >= 0)
        close(fd);
    lumi_free(copy);
    return code;
}

static int read_all(struct journal *journal, journal_fn line, void *context, struct lumi_error *error)
{
    uint8_t *data = NULL;
    size_t size = 0, whole = 0;

    LUMI_TRY(lumi_file_read(journal->path, JOURNAL_MAX, &data, &size, error));
    int code = journal_parse(data, size, journal->path, line, context, &whole, error);
    lumi_free(data);
    if (code == LUMI_OK && whole < size && ftruncate(journal->fd, (off_t)whole) < 0)
        code = lumi_fail_errno(error, journal->path, "cut off half a line");
    return code;
}

/* A program that was just started by one of us that was killed holds the lock until its exec: a moment is waited. */
static bool lock(int fd)
{
    for (int i = 0; i < 50; i++) {
        if (flock(fd, LOCK_EX | LOCK_NB) == 0)
            return true;
        nanosleep(&(struct timespec){0, 20000000}, NULL);
    }
    return false;
}

int journal_open(const char *path, journal_fn line, void *context, struct journal **journal, struct lumi_error *error)
{
    const size_t size = strlen(path) + 1;
    struct journal *made = lumi_calloc(1, sizeof *made);
    int code;

    *journal = NULL;
    if (made)
        made->path = lumi_alloc(size, 1);
    if (!made || !made->path) {
        lumi_free(made);
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: out of memory", path);
    }
    memcpy(made->path, path, size);
    made->fd = open(path, O_RDWR | O_APPEND | O_CREAT | O_CLOEXEC, 0666);
    if (made->fd < 0) {
        code = lumi_fail_errno(error, path, "open");
        goto fail;
    }
    if (!lock(made->fd)) {
        code = lumi_fail(error, LUMI_ERR_BUSY, "%s: another program has it", path);
        goto fail;
    }
    LUMI_GOTO(code, fail, read_all(made, line, context, error));
    LUMI_GOTO(code, fail, sync_folder(path, error));
    *journal = made;
    return LUMI_OK;
fail:
    journal_close(made);
    return code;
}

void journal_close(struct journal *journal)
{
    if (!journal)
        return;
    if (journal->fd >= 0)
        close(journal->fd);
    lumi_free(journal->path);
    lumi_free(journal);
}

int journal_write(struct journal *journal, const char *const *fields, int count, struct lumi_error *error)
{
    char text[JOURNAL_LINE];
    size_t used = 9;

    for (int i = 0; i < count; i++) {
        const size_t length = strlen(fields[i]);
        if (count > JOURNAL_FIELDS || used + length + 2 > sizeof text || !plain(fields[i], length) ||
            strchr(fields[i], '\t'))
            return lumi_fail(error, LUMI_ERR_ARG, "%s: '%.200s' cannot be written in a journal", journal->path,
                             fields[i]);
        memcpy(text + used, fields[i], length);
        used += length;
        text[used++] = i + 1 < count ? '\t' : '\n';
    }
    char digits[10];
    snprintf(digits, sizeof digits, "%08x ", lumi_crc32c(0, text + 9, used - 10));
    memcpy(text, digits, 9);
    const off_t before = lseek(journal->fd, 0, SEEK_END);
    if (lumi_write_all(journal->fd, text, used) == 0 && fdatasync(journal->fd) == 0)
        return LUMI_OK;
    const int code = lumi_fail_errno(error, journal->path, "write");
    if (before >= 0 && ftruncate(journal->fd, before) < 0)
        return code; /* half a line is cut off when it is next opened */
    return code;
}
