/* What `lumi preview --serve` says (docs/preview.md, "Protocol"), taken apart. Reads what comes from another program.
 */
#ifndef LUMI_DAEMON_PREVIEW_FIELD_ANSWER_H
#define LUMI_DAEMON_PREVIEW_FIELD_ANSWER_H

#include "proto/base/result.h"

#include <stddef.h>
#include <stdint.h>

#define LUMI_FIELD_LINE_MAX 1023
#define LUMI_FIELD_PICTURE_MAX ((size_t)32 << 20) /* bytes of a picture */

enum lumi_field_kind { LUMI_FIELD_NEWS = 1, LUMI_FIELD_PICTURE = 2, LUMI_FIELD_NONE = 3 };
struct lumi_field_answer {
    enum lumi_field_kind kind;
    uint32_t id;             /* PICTURE, NONE: of the question */
    int frames, rows, views; /* NEWS; PICTURE: frames that it was made of */
    const char *text;        /* NONE: why */
    const uint8_t *data;     /* PICTURE */
    size_t size;
};

struct lumi_field_reader {
    char line[LUMI_FIELD_LINE_MAX + 1];
    size_t length;
    struct lumi_field_answer picture; /* that is coming */
    uint8_t *data;                    /* of it; NULL: none is coming */
    size_t have;
};

/* All zero is a new one. Calls `take` for every answer that is whole; what it is given is gone when it returns. On
 * failure (LUMI_ERR_FORMAT, LUMI_ERR_LIMIT, LUMI_ERR_NOMEM) nothing that comes after can be understood. */
int lumi_field_reader_feed(struct lumi_field_reader *reader, const void *bytes, size_t size,
                           void (*take)(void *context, const struct lumi_field_answer *answer), void *context,
                           struct lumi_error *error);
void lumi_field_reader_finish(struct lumi_field_reader *reader);

#endif
