/* Gains of pictures and vignetting of lenses: their file, and taking them out of a picture. */
#include "pipeline/equiangular/gains.h"

#include "proto/base/file.h"
#include "proto/base/json_check.h"
#include "proto/base/memory.h"

#include <json-glib/json-glib.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define FORMAT "lumisphere gains"
#define MOST_BYTES ((size_t)64 << 20)
#define MOST_COEFFICIENT 100.0

int lumi_gains_create(struct lumi_gains *gains, int lens_count, int count, struct lumi_error *error)
{
    *gains = (struct lumi_gains){.lens_count = lens_count, .count = count};
    gains->vignetting = lumi_calloc((size_t)lens_count + 1, sizeof *gains->vignetting);
    gains->items = lumi_calloc((size_t)count + 1, sizeof *gains->items);
    if (gains->vignetting && gains->items)
        return LUMI_OK;
    lumi_gains_finish(gains);
    return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for the gains of %d pictures", count);
}

void lumi_gains_finish(struct lumi_gains *gains)
{
    lumi_free(gains->vignetting);
    lumi_free(gains->items);
    *gains = (struct lumi_gains){0};
}

static int by_name(const void *a, const void *b)
{
    return strcmp(((const struct lumi_gain *)a)->name, ((const struct lumi_gain *)b)->name);
}

void lumi_gains_sort(struct lumi_gains *gains)
{
    qsort(gains->items, (size_t)gains->count, sizeof *gains->items, by_name);
}

const struct lumi_gain *lumi_gains_find(const struct lumi_gains *gains, const char *name)
{
    struct lumi_gain key = {.lens = 0};

    if (g_strlcpy(key.name, name, sizeof key.name) >= sizeof key.name)
        return NULL;
    return bsearch(&key, gains->items, (size_t)gains->count, sizeof key, by_name);
}

/* `count` numbers of an array member, each between least and most. */
static bool get_numbers(JsonObject *object, const char *key, double least, double most, double *numbers, guint count)
{
    JsonNode *node = json_object_get_member(object, key);

    if (!node || !JSON_NODE_HOLDS_ARRAY(node) || json_array_get_length(json_node_get_array(node)) != count)
        return false;
    for (guint i = 0; i < count; i++) {
        JsonNode *item = json_array_get_element(json_node_get_array(node), i);
        if (!JSON_NODE_HOLDS_VALUE(item) ||
            (json_node_get_value_type(item) != G_TYPE_INT64 && json_node_get_value_type(item) != G_TYPE_DOUBLE))
            return false;
        numbers[i] = json_node_get_double(item);
        if (!(numbers[i] >= least && numbers[i] <= most))
            return false;
    }
    return true;
}

static JsonArray *get_array(JsonObject *object, const char *key)
{
    JsonNode *node = json_object_get_member(object, key);

    return node && JSON_NODE_HOLDS_ARRAY(node) ? json_node_get_array(node) : NULL;
}

static JsonObject *get_object(JsonArray *array, guint index)
{
    JsonNode *node = json_array_get_element(array, index);

    return JSON_NODE_HOLDS_OBJECT(node) ? json_node_get_object(node) : NULL;
}

static bool take_image(JsonObject *object, int lens_count, struct lumi_gain *gain)
{
    JsonNode *name = json_object_get_member(object, "name"), *lens = json_object_get_member(object, "lens");

    if (!name || !JSON_NODE_HOLDS_VALUE(name) || json_node_get_value_type(name) != G_TYPE_STRING || !lens ||
        !JSON_NODE_HOLDS_VALUE(lens) || json_node_get_value_type(lens) != G_TYPE_INT64)
        return false;
    const char *text = json_node_get_string(name);
    const gint64 number = json_node_get_int(lens);
    if (!text[0] || g_strlcpy(gain->name, text, sizeof gain->name) >= sizeof gain->name || number < 0 ||
        number >= lens_count)
        return false;
    gain->lens = (int)number;
    return get_numbers(object, "gain", 1.0 / LUMI_GAIN_MOST, LUMI_GAIN_MOST, gain->gain, 3);
}

static int take(JsonObject *top, const char *source, struct lumi_gains *gains, struct lumi_error *error)
{
    JsonArray *lenses = get_array(top, "lenses"), *images = get_array(top, "images");

    if (!lenses || !images || json_array_get_length(lenses) > LUMI_GAINS_MAX ||
        json_array_get_length(images) > LUMI_GAINS_MAX)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: 'lenses' and 'images' are wanted", source);
    LUMI_TRY(lumi_gains_create(gains, (int)json_array_get_length(lenses), (int)json_array_get_length(images), error));
    for (int i = 0; i < gains->lens_count; i++) {
        JsonObject *object = get_object(lenses, (guint)i);
        if (!object || !get_numbers(object, "vignetting", -MOST_COEFFICIENT, MOST_COEFFICIENT, gains->vignetting[i], 3))
            return lumi_fail(error, LUMI_ERR_FORMAT, "%s: lens %d: three numbers wanted", source, i);
    }
    for (int i = 0; i < gains->count; i++) {
        JsonObject *object = get_object(images, (guint)i);
        if (!object || !take_image(object, gains->lens_count, &gains->items[i]))
            return lumi_fail(error, LUMI_ERR_FORMAT, "%s: image %d: a name, a lens and three gains wanted", source, i);
    }
    lumi_gains_sort(gains);
    for (int i = 1; i < gains->count; i++)
        if (!strcmp(gains->items[i].name, gains->items[i - 1].name))
            return lumi_fail(error, LUMI_ERR_FORMAT, "%s: an image is named twice", source);
    return LUMI_OK;
}

int lumi_gains_parse(const char *text, size_t size, const char *source, struct lumi_gains *gains,
                     struct lumi_error *error)
{
    g_autoptr(JsonParser) parser = json_parser_new_immutable();
    JsonNode *root;

    *gains = (struct lumi_gains){0};
    if (!lumi_json_check(text, size) || !json_parser_load_from_data(parser, text, (gssize)size, NULL) ||
        !(root = json_parser_get_root(parser)) || !JSON_NODE_HOLDS_OBJECT(root))
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: no JSON object", source);
    JsonObject *top = json_node_get_object(root);
    JsonNode *format = json_object_get_member(top, "format"), *version = json_object_get_member(top, "version");
    if (!format || !JSON_NODE_HOLDS_VALUE(format) || json_node_get_value_type(format) != G_TYPE_STRING ||
        strcmp(json_node_get_string(format), FORMAT) || !version || !JSON_NODE_HOLDS_VALUE(version) ||
        json_node_get_value_type(version) != G_TYPE_INT64 || json_node_get_int(version) != 1)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: not \"%s\", version 1", source, FORMAT);
    int code = take(top, source, gains, error);
    if (code != LUMI_OK)
        lumi_gains_finish(gains);
    return code;
}

int lumi_gains_read(const char *path, struct lumi_gains *gains, struct lumi_error *error)
{
    uint8_t *data;
    size_t size;

    *gains = (struct lumi_gains){0};
    LUMI_TRY(lumi_file_read(path, MOST_BYTES, &data, &size, error));
    int code = lumi_gains_parse((const char *)data, size, path, gains, error);
    lumi_free(data);
    return code;
}

static void add_numbers(GString *text, const double *numbers)
{
    for (int i = 0; i < 3; i++) {
        char buffer[G_ASCII_DTOSTR_BUF_SIZE];
        g_string_append_printf(text, "%s%s", i ? ", " : "",
                               g_ascii_formatd(buffer, sizeof buffer, "%.17g", numbers[i]));
    }
}

int lumi_gains_write(const char *path, const struct lumi_gains *gains, struct lumi_error *error)
{
    g_autoptr(GString) text = g_string_new("{\"format\": \"" FORMAT "\", \"version\": 1,\n\"lenses\": [");

    for (int i = 0; i < gains->lens_count; i++) {
        g_string_append(text, i ? ",\n{\"vignetting\": [" : "\n{\"vignetting\": [");
        add_numbers(text, gains->vignetting[i]);
        g_string_append(text, "]}");
    }
    g_string_append(text, "],\n\"images\": [");
    for (int i = 0; i < gains->count; i++) {
        /* Names of frames are letters, digits, '.', '_' and '-'. */
        g_string_append_printf(text, "%s\n{\"name\": \"%s\", \"lens\": %d, \"gain\": [", i ? "," : "",
                               gains->items[i].name, gains->items[i].lens);
        add_numbers(text, gains->items[i].gain);
        g_string_append(text, "]}");
    }
    g_string_append(text, "]}\n");
    return lumi_file_write(path, text->str, text->len, false, error);
}

double lumi_vignetting_log(const double vignetting[3], double r2)
{
    return r2 * (vignetting[0] + r2 * (vignetting[1] + r2 * vignetting[2]));
}

double lumi_vignetting_radius2(const struct lumi_lens *lens, double x, double y)
{
    const double dx = x - lens->cx, dy = y - lens->cy;

    return 4 * (dx * dx + dy * dy) / ((double)lens->width * lens->width + (double)lens->height * lens->height);
}

#define NEAR_WHITE 0.88f
#define WHITE 0.985f

/* From 0 where a pixel is surely not clipped to 1 where it may be. */
static float nearness_to_white(const float pixel[3])
{
    float most = fmaxf(pixel[0], fmaxf(pixel[1], pixel[2])), t = (most - NEAR_WHITE) / (WHITE - NEAR_WHITE);

    return fminf(fmaxf(t, 0), 1);
}

void lumi_gains_apply(const struct lumi_gains *gains, const struct lumi_gain *gain, const struct lumi_lens *lens,
                      bool clipped, struct lumi_raster *picture)
{
    if (!gain)
        return;
    const double *vignetting = gains->vignetting[gain->lens];
    const double by[3] = {1 / gain->gain[0], 1 / gain->gain[1], 1 / gain->gain[2]};
    const double most = fmax(by[0], fmax(by[1], by[2]));
    for (int y = 0; y < picture->height; y++) {
        float *pixel = lumi_row_f32(picture, y);
        for (int x = 0; x < picture->width; x++, pixel += 3) {
            /* Beyond the corners nothing was measured, and a polynomial may go anywhere. */
            const double r2 = fmin(lumi_vignetting_radius2(lens, x + 0.5, y + 0.5), 1);
            const double light = exp(-lumi_vignetting_log(vignetting, r2)), white = fmax(1, most * light);
            const double share = clipped ? (double)nearness_to_white(pixel) : 0;
            for (int c = 0; c < 3; c++)
                pixel[c] *= (float)((1 - share) * by[c] * light + share * white);
        }
    }
}
