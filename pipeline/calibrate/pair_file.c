/* Reading and writing ".pairs" files. */
#include "pipeline/calibrate/features.h"
#include "pipeline/calibrate/pairs.h"
#include "pipeline/calibrate/sealed.h"
#include "proto/base/file.h"
#include "proto/base/memory.h"

#include <math.h>
#include <string.h>

static const struct lumi_sealed kind = {"LUMIPAIR", 1, "pairs"};
enum { NAME = 64, PAIRS_MAX = 4096, PAIR = NAME + 12 + 12 * 8, MATCH = 12 };

void lumi_pairs_finish(struct lumi_pair_list *list)
{
    for (int i = 0; list->items && i < list->count; i++)
        lumi_free(list->items[i].matches);
    lumi_free(list->items);
    *list = (struct lumi_pair_list){0};
}

static bool name_valid(const char *name)
{
    return name[0] && name[0] != '.' && memchr(name, 0, NAME) && !strchr(name, '/');
}

static int decode_matches(struct lumi_reader *reader, const char *name, struct lumi_pair *pair,
                          struct lumi_error *error)
{
    if ((size_t)pair->match_count > lumi_reader_left(reader) / MATCH)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: is cut short", name);
    pair->matches = lumi_calloc((size_t)(pair->match_count ? pair->match_count : 1), sizeof *pair->matches);
    if (!pair->matches)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: not enough memory", name);
    for (int i = 0; i < pair->match_count; i++) {
        struct lumi_match *match = &pair->matches[i];
        match->a = lumi_read_u32(reader);
        match->b = lumi_read_u32(reader);
        match->distance = lumi_read_f32(reader);
        if (match->a >= LUMI_FEATURES_MAX || match->b >= LUMI_FEATURES_MAX || !isfinite(match->distance))
            return lumi_fail(error, LUMI_ERR_FORMAT, "%s: match %d with %s is none", name, i, pair->name);
    }
    return LUMI_OK;
}

static int decode_pair(struct lumi_reader *reader, const char *name, struct lumi_pair *pair, struct lumi_error *error)
{
    const uint8_t *partner = lumi_read_bytes(reader, NAME);
    const uint32_t matches = lumi_read_u32(reader), found = lumi_read_u32(reader), outside = lumi_read_u32(reader);
    bool finite = true;

    for (int i = 0; i < 9; i++) {
        pair->rotation[i] = lumi_read_f64(reader);
        finite = finite && fabs(pair->rotation[i]) <= 1.001;
    }
    pair->direction.x = lumi_read_f64(reader);
    pair->direction.y = lumi_read_f64(reader);
    pair->direction.z = lumi_read_f64(reader);
    finite = finite && lumi_length(pair->direction) <= 1.001;
    if (!partner || reader->failed || !finite || !name_valid((const char *)partner) || matches > LUMI_FEATURES_MAX ||
        found > LUMI_FEATURES_MAX || outside > found)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: holds a pair that is none", name);
    memcpy(pair->name, partner, NAME);
    pair->match_count = (int)matches;
    pair->free_count = (int)found;
    pair->free_outside = (int)outside;
    return decode_matches(reader, name, pair, error);
}

static int decode(struct lumi_reader *reader, const char *name, struct lumi_pair_list *list, struct lumi_error *error)
{
    const uint32_t count = lumi_read_u32(reader);

    if (reader->failed || count > PAIRS_MAX || count > reader->size / PAIR)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: its head is no head of pairs", name);
    list->items = lumi_calloc(count ? count : 1, sizeof *list->items);
    if (!list->items)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: not enough memory", name);
    for (list->count = 0; list->count < (int)count;) {
        struct lumi_pair *pair = &list->items[list->count++];
        LUMI_TRY(decode_pair(reader, name, pair, error));
    }
    return lumi_sealed_end(&kind, reader, name, error);
}

int lumi_pairs_decode(const void *data, size_t size, const char *name, struct lumi_pair_list *list,
                      struct lumi_error *error)
{
    struct lumi_reader reader;

    *list = (struct lumi_pair_list){0};
    int code = lumi_sealed_open(&kind, data, size, name, &reader, error);
    if (code == LUMI_OK)
        code = decode(&reader, name, list, error);
    if (code != LUMI_OK)
        lumi_pairs_finish(list);
    return code;
}

int lumi_pairs_read(const char *path, struct lumi_pair_list *list, struct lumi_error *error)
{
    uint8_t *data;
    size_t size;

    *list = (struct lumi_pair_list){0};
    LUMI_TRY(lumi_file_read(path, (size_t)1 << 30, &data, &size, error));
    int code = lumi_pairs_decode(data, size, path, list, error);
    lumi_free(data);
    return code;
}

static void write_pair(struct lumi_writer *writer, const struct lumi_pair *pair)
{
    char name[NAME] = "";

    memcpy(name, pair->name, strnlen(pair->name, NAME - 1));
    lumi_write_bytes(writer, name, NAME);
    lumi_write_u32(writer, (uint32_t)pair->match_count);
    lumi_write_u32(writer, (uint32_t)pair->free_count);
    lumi_write_u32(writer, (uint32_t)pair->free_outside);
    for (int i = 0; i < 9; i++)
        lumi_write_f64(writer, pair->rotation[i]);
    lumi_write_f64(writer, pair->direction.x);
    lumi_write_f64(writer, pair->direction.y);
    lumi_write_f64(writer, pair->direction.z);
    for (int i = 0; i < pair->match_count; i++) {
        lumi_write_u32(writer, pair->matches[i].a);
        lumi_write_u32(writer, pair->matches[i].b);
        lumi_write_f32(writer, pair->matches[i].distance);
    }
}

int lumi_pairs_write(const char *path, const struct lumi_pair_list *list, struct lumi_error *error)
{
    struct lumi_writer writer;

    lumi_sealed_begin(&kind, &writer);
    lumi_write_u32(&writer, (uint32_t)list->count);
    for (int i = 0; i < list->count; i++)
        write_pair(&writer, &list->items[i]);
    return lumi_sealed_save(&writer, path, error);
}
