/* A journal: lines that are appended and synced, each with its checksum. What the last words of a program that was
 * killed left half written is cut off; anything else that is wrong is an error, for a journal is what "exactly once"
 * rests on.
 *
 * A line: eight hexadecimal digits of CRC-32C over what follows the blank, a blank, the fields with a tab between them,
 * a line feed. Fields hold no control characters. */
#ifndef LUMI_DAEMON_HANDOVER_HANDOVER_JOURNAL_H
#define LUMI_DAEMON_HANDOVER_HANDOVER_JOURNAL_H

#include "proto/base/result.h"

#include <stdbool.h>
#include <stddef.h>

#define JOURNAL_FIELDS 6
#define JOURNAL_LINE 8192 /* the longest, with its end */

struct journal_line {
    int count;
    const char *fields[JOURNAL_FIELDS];
};
typedef int (*journal_fn)(void *context, const struct journal_line *line, struct lumi_error *error);

/* Tells every line; *whole bytes of `data` are whole lines. LUMI_ERR_FORMAT, naming `source` and the line. */
int journal_parse(const void *data, size_t size, const char *source, journal_fn line, void *context, size_t *whole,
                  struct lumi_error *error);

struct journal;
/* Makes the file where there is none. Held by one program at a time (LUMI_ERR_BUSY). */
int journal_open(const char *path, journal_fn line, void *context, struct journal **journal, struct lumi_error *error);
void journal_close(struct journal *journal); /* accepts NULL */
/* On the disk when it returns 0. LUMI_ERR_ARG: a control character, or too long. */
int journal_write(struct journal *journal, const char *const *fields, int count, struct lumi_error *error);

#endif
