/* Lines and pictures of the preview's program. */
#include "daemon/preview/field_answer.h"

#include "proto/base/memory.h"

#include <stdbool.h>
#include <string.h>

/* " NUMBER", digits only. */
static bool take_number(const char **at, uint64_t most, uint64_t *value)
{
    const char *digits = *at + 1;

    if (**at != ' ' || *digits < '0' || *digits > '9')
        return false;
    for (*value = 0; *digits >= '0' && *digits <= '9'; digits++) {
        *value = *value * 10 + (uint64_t)(*digits - '0');
        if (*value > most)
            return false;
    }
    *at = digits;
    return true;
}

static bool begins(const char **at, const char *word)
{
    const size_t length = strlen(word);

    if (strncmp(*at, word, length) || (*at)[length] != ' ')
        return false;
    *at += length;
    return true;
}

static bool read_line(const char *line, struct lumi_field_answer *answer)
{
    uint64_t numbers[3] = {0, 0, 0};
    const char *at = line;

    *answer = (struct lumi_field_answer){.text = ""};
    if (begins(&at, "news")) {
        answer->kind = LUMI_FIELD_NEWS;
        for (int i = 0; i < 3; i++)
            if (!take_number(&at, INT32_MAX, &numbers[i]))
                return false;
        answer->frames = (int)numbers[0], answer->rows = (int)numbers[1], answer->views = (int)numbers[2];
        return *at == '\0';
    }
    answer->kind = begins(&at, "jpeg") ? LUMI_FIELD_PICTURE : begins(&at, "none") ? LUMI_FIELD_NONE : 0;
    if (answer->kind == 0 || !take_number(&at, UINT32_MAX, &numbers[0]))
        return false;
    answer->id = (uint32_t)numbers[0];
    if (answer->kind == LUMI_FIELD_NONE) {
        answer->text = *at == ' ' ? at + 1 : at;
        return *at == ' ' || *at == '\0';
    }
    if (!take_number(&at, UINT32_MAX, &numbers[1]) || !take_number(&at, INT32_MAX, &numbers[2]) || *at)
        return false;
    answer->size = (size_t)numbers[1];
    answer->frames = (int)numbers[2];
    return answer->size > 0;
}

typedef void (*take_answer)(void *context, const struct lumi_field_answer *answer);

static int end_line(struct lumi_field_reader *reader, take_answer take, void *context, struct lumi_error *error)
{
    struct lumi_field_answer answer;

    reader->line[reader->length] = '\0';
    reader->length = 0;
    if (!read_line(reader->line, &answer))
        return lumi_fail(error, LUMI_ERR_FORMAT, "preview: it said what cannot be understood");
    if (answer.kind != LUMI_FIELD_PICTURE) {
        take(context, &answer);
        return LUMI_OK;
    }
    if (answer.size > LUMI_FIELD_PICTURE_MAX)
        return lumi_fail(error, LUMI_ERR_LIMIT, "preview: a picture of %zu bytes", answer.size);
    reader->data = lumi_alloc(answer.size, 1);
    if (!reader->data)
        return lumi_fail(error, LUMI_ERR_NOMEM, "preview: no memory for a picture of %zu bytes", answer.size);
    reader->picture = answer;
    reader->have = 0;
    return LUMI_OK;
}

static size_t take_data(struct lumi_field_reader *reader, const uint8_t *bytes, size_t size, take_answer take,
                        void *context)
{
    const size_t wanted = reader->picture.size - reader->have, got = size < wanted ? size : wanted;

    memcpy(reader->data + reader->have, bytes, got);
    reader->have += got;
    if (reader->have == reader->picture.size) {
        reader->picture.data = reader->data;
        take(context, &reader->picture);
        lumi_free(reader->data);
        reader->data = NULL;
    }
    return got;
}

int lumi_field_reader_feed(struct lumi_field_reader *reader, const void *bytes, size_t size, take_answer take,
                           void *context, struct lumi_error *error)
{
    const uint8_t *at = bytes, *end = at + size;

    while (at < end) {
        if (reader->data) {
            at += take_data(reader, at, (size_t)(end - at), take, context);
            continue;
        }
        const char c = (char)*at++;
        if (c == '\n') {
            LUMI_TRY(end_line(reader, take, context, error));
        } else {
            if (reader->length >= LUMI_FIELD_LINE_MAX)
                return lumi_fail(error, LUMI_ERR_LIMIT, "preview: a line of more than %d bytes", LUMI_FIELD_LINE_MAX);
            reader->line[reader->length++] = c ? c : ' ';
        }
    }
    return LUMI_OK;
}

void lumi_field_reader_finish(struct lumi_field_reader *reader)
{
    lumi_free(reader->data);
    *reader = (struct lumi_field_reader){0};
}
