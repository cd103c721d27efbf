/* COLMAP's models: cameras and images, binary and text (https://colmap.github.io/format.html).
 *
 * Binary, little-endian. cameras.bin: u64 count; each u32 camera, i32 model, u64 width, u64 height, f64 parameters.
 * images.bin: u64 count; each u32 image, f64 qw qx qy qz tx ty tz, u32 camera, name ended by a zero byte, u64 points;
 * each point f64 x, f64 y, u64 number.
 * Text: lines; '#' begins a comment. cameras.txt: CAMERA MODEL WIDTH HEIGHT PARAMETERS. images.txt: two lines an image,
 * IMAGE QW QX QY QZ TX TY TZ CAMERA NAME and its points (possibly none, then the line is empty). */
#include "pipeline/exchange/exchange.h"

#include "proto/base/bytes.h"
#include "proto/base/raster.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define POINT_BYTES 24

struct raw_camera {
    uint32_t number;
    const struct lumi_exchange_model *model;
    double width, height;
    double parameters[LUMI_EXCHANGE_PARAMETERS];
};

static int keep_camera(const struct raw_camera *raw, const char *name, GHashTable *table,
                       struct lumi_exchange *exchange, struct lumi_error *error)
{
    struct lumi_exchange_camera camera = {0};
    struct lumi_lens lens;
    char what[400];

    snprintf(what, sizeof what, "%.300s: camera %u", name, raw->number);
    if (!(raw->width >= 1 && raw->width <= LUMI_RASTER_MAX && raw->height >= 1 && raw->height <= LUMI_RASTER_MAX))
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s has %.0fx%.0f pixels", what, raw->width, raw->height);
    if (g_hash_table_contains(table, GUINT_TO_POINTER(raw->number)))
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s is there twice", what);
    g_strlcpy(camera.model, raw->model->name, sizeof camera.model);
    camera.parameter_count = raw->model->parameter_count;
    memcpy(camera.parameters, raw->parameters, sizeof camera.parameters);
    camera.width = (int)raw->width;
    camera.height = (int)raw->height;
    LUMI_TRY(lumi_exchange_lens(&camera, what, &lens, error));
    /* Not lumi_exchange_add_camera: cameras that are alike stay apart, as their model keeps them. */
    g_array_append_val(exchange->cameras, camera);
    g_hash_table_insert(table, GUINT_TO_POINTER(raw->number), GUINT_TO_POINTER(exchange->cameras->len));
    return LUMI_OK;
}

static int keep_image(const double numbers[7], uint32_t camera, const char *file, const char *name, GHashTable *table,
                      struct lumi_exchange *exchange, struct lumi_error *error)
{
    struct lumi_exchange_image image = {.row = -1, .column = -1};
    double back[7];

    if (!*file)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: an image without a name", name);
    if (!g_utf8_validate(file, -1, NULL))
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: the name of an image is not UTF-8", name);
    g_autofree char *what = g_strdup_printf("%s: image '%.200s'", name, file);
    guint index = GPOINTER_TO_UINT(g_hash_table_lookup(table, GUINT_TO_POINTER(camera)));
    if (index == 0)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: there is no camera %u", what, camera);
    LUMI_TRY(lumi_exchange_pose_from(LUMI_EXCHANGE_QUATERNION, numbers, what, &image.pose, error));
    lumi_exchange_pose_to(LUMI_EXCHANGE_QUATERNION, &image.pose, back);
    if (memcmp(back, numbers, sizeof back) != 0)
        image.numbers = LUMI_EXCHANGE_QUATERNION;
    memcpy(image.source, numbers, 7 * sizeof *numbers);
    image.camera = (int)index - 1;
    image.original = g_strdup(file);
    g_array_append_val(exchange->images, image);
    return LUMI_OK;
}

/* Binary */

static int cameras_binary(struct lumi_reader *reader, const char *name, GHashTable *table,
                          struct lumi_exchange *exchange, struct lumi_error *error)
{
    uint64_t count = lumi_read_u64(reader);

    if (count > lumi_reader_left(reader) / 48)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: the file is too short for its %llu cameras", name,
                         (unsigned long long)count);
    for (uint64_t i = 0; i < count; i++) {
        struct raw_camera raw = {.number = lumi_read_u32(reader)};
        int id = (int)(int32_t)lumi_read_u32(reader);
        raw.width = (double)lumi_read_u64(reader);
        raw.height = (double)lumi_read_u64(reader);
        raw.model = lumi_exchange_model_by_id(id);
        if (reader->failed)
            return lumi_fail(error, LUMI_ERR_FORMAT, "%s: the file ends too early", name);
        if (!raw.model || !raw.model->supported)
            return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "%s: camera %u: the lens model '%s' (%d) is not supported",
                             name, raw.number, raw.model ? raw.model->name : "unknown", id);
        for (int p = 0; p < raw.model->parameter_count; p++)
            raw.parameters[p] = lumi_read_f64(reader);
        if (reader->failed)
            return lumi_fail(error, LUMI_ERR_FORMAT, "%s: the file ends too early", name);
        LUMI_TRY(keep_camera(&raw, name, table, exchange, error));
    }
    return LUMI_OK;
}

static int images_binary(struct lumi_reader *reader, const char *name, GHashTable *table,
                         struct lumi_exchange *exchange, struct lumi_error *error)
{
    uint64_t count = lumi_read_u64(reader);

    if (count > lumi_reader_left(reader) / 73 || count > LUMI_EXCHANGE_MAX_IMAGES)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: the file is too short for its %llu images", name,
                         (unsigned long long)count);
    for (uint64_t i = 0; i < count; i++) {
        double numbers[7];
        lumi_read_u32(reader);
        for (int n = 0; n < 7; n++)
            numbers[n] = lumi_read_f64(reader);
        uint32_t camera = lumi_read_u32(reader);
        const char *file = (const char *)reader->data + reader->at;
        const char *end = memchr(file, 0, lumi_reader_left(reader));
        if (reader->failed || !end)
            return lumi_fail(error, LUMI_ERR_FORMAT, "%s: the file ends too early", name);
        lumi_read_bytes(reader, (size_t)(end - file) + 1);
        uint64_t points = lumi_read_u64(reader);
        if (points > lumi_reader_left(reader) / POINT_BYTES)
            return lumi_fail(error, LUMI_ERR_FORMAT, "%s: the file ends too early", name);
        lumi_read_bytes(reader, (size_t)points * POINT_BYTES);
        LUMI_TRY(keep_image(numbers, camera, file, name, table, exchange, error));
    }
    return LUMI_OK;
}

/* Text. Lines and words are taken from a copy that may be cut up. */

static char *next_line(char **at)
{
    char *line = *at;

    if (!*line)
        return NULL;
    char *end = strchr(line, '\n');
    *at = end ? end + 1 : line + strlen(line);
    if (end)
        *end = '\0';
    size_t length = strlen(line);
    if (length > 0 && line[length - 1] == '\r')
        line[length - 1] = '\0';
    return line;
}

static char *next_word(char **at)
{
    char *word = *at + strspn(*at, " \t");

    if (!*word)
        return NULL;
    char *end = word + strcspn(word, " \t");
    *at = *end ? end + 1 : end;
    *end = '\0';
    return word;
}

static bool next_number(char **at, double *value)
{
    char *word = next_word(at), *end;

    if (!word)
        return false;
    *value = g_ascii_strtod(word, &end);
    return !*end;
}

static bool next_id(char **at, uint32_t *value)
{
    double number;

    if (!next_number(at, &number) || !(number >= 0 && number <= UINT32_MAX) || number != floor(number))
        return false;
    *value = (uint32_t)number;
    return true;
}

static bool is_comment(const char *line)
{
    line += strspn(line, " \t");
    return !*line || *line == '#';
}

static int cameras_text(char *text, const char *name, GHashTable *table, struct lumi_exchange *exchange,
                        struct lumi_error *error)
{
    for (char *line; (line = next_line(&text)) != NULL;) {
        struct raw_camera raw = {0};
        double extra;
        if (is_comment(line))
            continue;
        bool good = next_id(&line, &raw.number);
        char *model = good ? next_word(&line) : NULL;
        if (!model || !next_number(&line, &raw.width) || !next_number(&line, &raw.height))
            return lumi_fail(error, LUMI_ERR_FORMAT, "%s: a line that describes no camera", name);
        raw.model = lumi_exchange_model_by_name(model);
        if (!raw.model || !raw.model->supported)
            return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "%s: camera %u: the lens model '%.64s' is not supported",
                             name, raw.number, model);
        for (int i = 0; i < raw.model->parameter_count; i++)
            good = good && next_number(&line, &raw.parameters[i]);
        if (!good || next_number(&line, &extra))
            return lumi_fail(error, LUMI_ERR_FORMAT, "%s: camera %u: %s has %d parameters", name, raw.number, model,
                             raw.model->parameter_count);
        LUMI_TRY(keep_camera(&raw, name, table, exchange, error));
    }
    return LUMI_OK;
}

/* An image's points are three numbers each, or none. Where their lines were left out, every second image would be taken
 * for the points of the one before it. */
static bool is_points(char *line)
{
    int count = 0;

    for (char *word, *end; (word = next_word(&line)) != NULL; count++) {
        g_ascii_strtod(word, &end);
        if (*end)
            return false;
    }
    return count % 3 == 0;
}

static int images_text(char *text, const char *name, GHashTable *table, struct lumi_exchange *exchange,
                       struct lumi_error *error)
{
    for (char *line; (line = next_line(&text)) != NULL;) {
        uint32_t number, camera;
        double numbers[7];
        if (is_comment(line))
            continue;
        bool good = next_id(&line, &number);
        for (int i = 0; i < 7; i++)
            good = good && next_number(&line, &numbers[i]);
        if (!good || !next_id(&line, &camera))
            return lumi_fail(error, LUMI_ERR_FORMAT, "%s: a line that describes no image", name);
        LUMI_TRY(keep_image(numbers, camera, g_strstrip(line), name, table, exchange, error));
        char *points = next_line(&text);
        if (points && !is_points(points))
            return lumi_fail(error, LUMI_ERR_FORMAT, "%s: image %u has no line of points (it may be empty)", name,
                             number);
    }
    return LUMI_OK;
}

static int parse(const void *data, size_t size, bool binary, bool cameras, const char *name, GHashTable *table,
                 struct lumi_exchange *exchange, struct lumi_error *error)
{
    if (binary) {
        struct lumi_reader reader;
        lumi_reader_init(&reader, data, size);
        LUMI_TRY((cameras ? cameras_binary : images_binary)(&reader, name, table, exchange, error));
        if (reader.failed || lumi_reader_left(&reader) > 0)
            return lumi_fail(error, LUMI_ERR_FORMAT, "%s: the file %s", name,
                             reader.failed ? "ends too early" : "goes on behind its end");
    } else {
        if (memchr(data, 0, size))
            return lumi_fail(error, LUMI_ERR_FORMAT, "%s: not a text file", name);
        g_autofree char *text = g_strndup(data, size);
        LUMI_TRY((cameras ? cameras_text : images_text)(text, name, table, exchange, error));
    }
    if ((cameras ? exchange->cameras : exchange->images)->len == 0)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: holds no %s", name, cameras ? "camera" : "image");
    return LUMI_OK;
}

int lumi_exchange_parse_colmap_cameras(const void *data, size_t size, bool binary, const char *name, GHashTable *table,
                                       struct lumi_exchange *exchange, struct lumi_error *error)
{
    return parse(data, size, binary, true, name, table, exchange, error);
}

int lumi_exchange_parse_colmap_images(const void *data, size_t size, bool binary, const char *name, GHashTable *table,
                                      struct lumi_exchange *exchange, struct lumi_error *error)
{
    return parse(data, size, binary, false, name, table, exchange, error);
}
