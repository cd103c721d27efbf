/* transforms.json: nerfstudio's data format, also as instant-ngp and Blender scripts write it.
 *
 * Fields used, at the top or in a frame (a frame's own wins): camera_model, w, h, fl_x, fl_y, cx, cy, k1..k4, p1, p2,
 * camera_angle_x; is_fisheye, instant-ngp's word for OPENCV_FISHEYE. In a frame: file_path, transform_matrix, and our
 * row and col. All others are ignored, among them applied_transform and applied_scale, which tell how the poses were
 * brought to where they are. */
#include "pipeline/exchange/exchange.h"

#include "proto/base/json_check.h"

#include <json-glib/json-glib.h>
#include <stdio.h>
#include <string.h>

struct fields {
    JsonObject *frame, *top;
};

/* The member of the frame, or else of the top; NULL for none and for null. */
static JsonNode *find(const struct fields *fields, const char *key)
{
    JsonNode *node = fields->frame ? json_object_get_member(fields->frame, key) : NULL;

    if (!node)
        node = json_object_get_member(fields->top, key);
    return node && !JSON_NODE_HOLDS_NULL(node) ? node : NULL;
}

static bool is_number(JsonNode *node)
{
    return node && JSON_NODE_HOLDS_VALUE(node) &&
           (json_node_get_value_type(node) == G_TYPE_INT64 || json_node_get_value_type(node) == G_TYPE_DOUBLE);
}

static bool is_true(JsonNode *node)
{
    return node && JSON_NODE_HOLDS_VALUE(node) && json_node_get_value_type(node) == G_TYPE_BOOLEAN &&
           json_node_get_boolean(node);
}

static int get_number(const struct fields *fields, const char *key, const char *what, bool *there, double *value,
                      struct lumi_error *error)
{
    JsonNode *node = find(fields, key);

    *there = node != NULL;
    *value = 0;
    if (!node)
        return LUMI_OK;
    if (!is_number(node))
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: '%s' is not a number", what, key);
    *value = json_node_get_double(node);
    if (!isfinite(*value))
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: '%s' is not finite", what, key);
    return LUMI_OK;
}

static int get_whole(const struct fields *fields, const char *key, const char *what, bool *there, int *value,
                     struct lumi_error *error)
{
    double number;

    LUMI_TRY(get_number(fields, key, what, there, &number, error));
    if (*there && (number != floor(number) || number < 0 || number > 1e9))
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: '%s' is not a whole number from 0", what, key);
    *value = (int)number;
    return LUMI_OK;
}

enum { W, H, FL_X, FL_Y, CX, CY, K1, K2, K3, K4, P1, P2, ANGLE_X, ANGLE_Y, NUMBERS };
static const char *const keys[NUMBERS] = {
    "w", "h", "fl_x", "fl_y", "cx", "cy", "k1", "k2", "k3", "k4", "p1", "p2", "camera_angle_x", "camera_angle_y"};

/* The model's name. nerfstudio reads the distortion whatever the model is called, so one that has no place for it gives
 * way to one that has. */
static const char *model_name(const char *given, const double *v)
{
    bool tangential = v[P1] != 0 || v[P2] != 0;
    bool second = tangential || v[K2] != 0;
    bool any = second || v[K1] != 0;

    if (!strcmp(given, "OPENCV_FISHEYE"))
        return given;
    if (v[K3] != 0)
        return "FULL_OPENCV";
    if (!strcmp(given, "FULL_OPENCV"))
        return "OPENCV";
    if (!given[0])
        return any ? "OPENCV" : "PINHOLE";
    if ((strstr(given, "PINHOLE") && any) || (!strcmp(given, "SIMPLE_RADIAL") && second) ||
        (!strcmp(given, "RADIAL") && tangential))
        return "OPENCV";
    return given;
}

static void fill_parameters(struct lumi_exchange_camera *camera, const double *v, const bool *there)
{
    const struct lumi_exchange_model *model = lumi_exchange_model_by_name(camera->model);
    double fx = v[FL_X], fy = there[FL_Y] ? v[FL_Y] : fx;
    double cx = there[CX] ? v[CX] : v[W] / 2, cy = there[CY] ? v[CY] : v[H] / 2;
    double full[12] = {fx, fy, cx, cy, v[K1], v[K2], v[P1], v[P2], v[K3], 0, 0, 0};
    double single[5] = {fx, cx, cy, v[K1], v[K2]};

    if (model->id == 5) {
        full[6] = v[K3];
        full[7] = v[K4];
    }
    camera->parameter_count = model->parameter_count;
    memcpy(camera->parameters, model->id == 0 || model->id == 2 || model->id == 3 ? single : full,
           sizeof(double) * (size_t)model->parameter_count);
}

static int check_numbers(const struct lumi_exchange_camera *camera, const double *v, const bool *there,
                         const char *what, struct lumi_error *error)
{
    if (strcmp(camera->model, "OPENCV_FISHEYE") != 0 && v[K4] != 0)
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "%s: the lens model '%s' with k4 is not supported", what,
                         camera->model);
    bool simple = !strcmp(camera->model, "SIMPLE_PINHOLE") || !strcmp(camera->model, "SIMPLE_RADIAL") ||
                  !strcmp(camera->model, "RADIAL");
    if (simple && there[FL_Y] && there[FL_X] && v[FL_Y] != v[FL_X])
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: '%s' has one focal length, but fl_x and fl_y differ", what,
                         camera->model);
    if (!there[FL_X] && !(v[ANGLE_X] > 0 && v[ANGLE_X] < LUMI_PI))
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: there is neither 'fl_x' nor 'camera_angle_x'", what);
    if ((there[CX] || there[FL_X]) && (!(v[W] >= 1) || !(v[H] >= 1)))
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: the image size 'w', 'h' is missing", what);
    return LUMI_OK;
}

static int read_camera(const struct fields *fields, const char *what, struct lumi_exchange_camera *camera,
                       struct lumi_error *error)
{
    JsonNode *node = find(fields, "camera_model");
    const char *given = "";
    double v[NUMBERS];
    bool there[NUMBERS];

    *camera = (struct lumi_exchange_camera){0};
    if (node && (!JSON_NODE_HOLDS_VALUE(node) || json_node_get_value_type(node) != G_TYPE_STRING))
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: 'camera_model' is not a text", what);
    if (node)
        given = json_node_get_string(node);
    else if (is_true(find(fields, "is_fisheye")))
        given = "OPENCV_FISHEYE";
    for (int i = 0; i < NUMBERS; i++)
        LUMI_TRY(get_number(fields, keys[i], what, &there[i], &v[i], error));
    const struct lumi_exchange_model *model = lumi_exchange_model_by_name(given[0] ? given : "PINHOLE");
    if (!model || !model->supported)
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "%s: the lens model '%.64s' is not supported", what, given);
    if (v[W] != floor(v[W]) || v[H] != floor(v[H]) || fabs(v[W]) > 1e9 || fabs(v[H]) > 1e9)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: 'w' or 'h' is not a whole number", what);
    camera->width = (int)v[W];
    camera->height = (int)v[H];
    g_strlcpy(camera->model, model_name(given, v), sizeof camera->model);
    LUMI_TRY(check_numbers(camera, v, there, what, error));
    if (there[FL_X]) {
        fill_parameters(camera, v, there);
        struct lumi_lens lens;
        return lumi_exchange_lens(camera, what, &lens, error);
    }
    if (strcmp(camera->model, "PINHOLE") != 0 && strcmp(camera->model, "SIMPLE_PINHOLE") != 0)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: there is no 'fl_x'", what);
    camera->angle_x = v[ANGLE_X];
    return LUMI_OK;
}

static int read_matrix(JsonObject *frame, const char *what, double matrix[16], struct lumi_error *error)
{
    JsonNode *node = json_object_get_member(frame, "transform_matrix");

    if (!node)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: it has no 'transform_matrix'", what);
    JsonArray *rows = JSON_NODE_HOLDS_ARRAY(node) ? json_node_get_array(node) : NULL;
    guint count = rows ? json_array_get_length(rows) : 0;
    matrix[12] = matrix[13] = matrix[14] = 0;
    matrix[15] = 1;
    for (guint i = 0; i < count && count <= 4; i++) {
        JsonNode *row = json_array_get_element(rows, i);
        JsonArray *cells = JSON_NODE_HOLDS_ARRAY(row) ? json_node_get_array(row) : NULL;
        for (guint j = 0; j < 4; j++) {
            JsonNode *cell = cells && json_array_get_length(cells) == 4 ? json_array_get_element(cells, j) : NULL;
            if (!is_number(cell))
                return lumi_fail(error, LUMI_ERR_FORMAT, "%s: 'transform_matrix' has not 4 numbers a row", what);
            matrix[4 * i + j] = json_node_get_double(cell);
        }
    }
    if (count != 3 && count != 4)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: 'transform_matrix' has not 4 rows", what);
    if (matrix[12] != 0 || matrix[13] != 0 || matrix[14] != 0 || matrix[15] != 1)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: the last row of 'transform_matrix' is not 0 0 0 1", what);
    return LUMI_OK;
}

static int read_frame(const struct fields *fields, const char *name, guint index, struct lumi_exchange *exchange,
                      struct lumi_error *error)
{
    struct lumi_exchange_image image = {.row = -1, .column = -1};
    struct fields own = {NULL, fields->frame};
    struct lumi_exchange_camera camera;
    double matrix[16], back[12];
    bool there;

    JsonNode *node = json_object_get_member(fields->frame, "file_path");
    if (!node || !JSON_NODE_HOLDS_VALUE(node) || json_node_get_value_type(node) != G_TYPE_STRING ||
        !*json_node_get_string(node))
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: frame %u has no 'file_path'", name, index);
    const char *file = json_node_get_string(node);
    g_autofree char *what = g_strdup_printf("%s: frame '%.200s'", name, file);
    LUMI_TRY(read_camera(fields, what, &camera, error));
    LUMI_TRY(read_matrix(fields->frame, what, matrix, error));
    LUMI_TRY(lumi_exchange_pose_from(LUMI_EXCHANGE_MATRIX, matrix, what, &image.pose, error));
    LUMI_TRY(get_whole(&own, "row", what, &there, &image.row, error));
    image.row = there ? image.row : -1;
    LUMI_TRY(get_whole(&own, "col", what, &there, &image.column, error));
    image.column = there ? image.column : -1;
    lumi_exchange_pose_to(LUMI_EXCHANGE_MATRIX, &image.pose, back);
    for (int i = 0; i < 12; i++)
        if (back[i] != matrix[i])
            image.numbers = LUMI_EXCHANGE_MATRIX;
    memcpy(image.source, matrix, sizeof image.source);
    image.original = g_strdup(file);
    image.camera = lumi_exchange_add_camera(exchange, &camera);
    g_array_append_val(exchange->images, image);
    return LUMI_OK;
}

static int read_root(JsonNode *root, const char *name, struct lumi_exchange *exchange, struct lumi_error *error)
{
    if (!root || !JSON_NODE_HOLDS_OBJECT(root))
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: not a transforms.json", name);
    struct fields fields = {NULL, json_node_get_object(root)};
    JsonNode *node = json_object_get_member(fields.top, "frames");
    if (!node || !JSON_NODE_HOLDS_ARRAY(node))
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: has no 'frames'", name);
    JsonArray *frames = json_node_get_array(node);
    guint count = json_array_get_length(frames);
    if (count == 0 || count > LUMI_EXCHANGE_MAX_IMAGES)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: has %u frames", name, count);
    for (guint i = 0; i < count; i++) {
        node = json_array_get_element(frames, i);
        if (!JSON_NODE_HOLDS_OBJECT(node))
            return lumi_fail(error, LUMI_ERR_FORMAT, "%s: frame %u is not an object", name, i);
        fields.frame = json_node_get_object(node);
        LUMI_TRY(read_frame(&fields, name, i, exchange, error));
    }
    return LUMI_OK;
}

/* Where the JSON is broken: numbers like NaN, which some programs write, are a common cause. */
static int fail_json(const char *text, const char *fault, const char *end, const char *name, struct lumi_error *error)
{
    int line = 1, shown = 0;
    const char *start = text;

    for (const char *c = text; c < fault; c++)
        if (*c == '\n') {
            line++;
            start = c + 1;
        }
    while (shown < 20 && fault + shown < end && g_ascii_isgraph(fault[shown]) && !strchr(",]}", fault[shown]))
        shown++;
    if (fault == end)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: not well-formed JSON: it ends too early (line %d)", name, line);
    if (shown == 0 && !g_ascii_ispunct(*fault)) /* bytes of a file that is no text are not for a terminal */
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: not well-formed JSON: line %d, column %d: byte 0x%02x", name,
                         line, (int)(fault - start) + 1, (unsigned char)*fault);
    return lumi_fail(error, LUMI_ERR_FORMAT, "%s: not well-formed JSON: line %d, column %d: '%.*s'", name, line,
                     (int)(fault - start) + 1, MAX(shown, 1), fault);
}

int lumi_exchange_parse_transforms(const char *text, size_t size, const char *name, struct lumi_exchange *exchange,
                                   struct lumi_error *error)
{
    g_autoptr(JsonParser) parser = json_parser_new_immutable();
    g_autoptr(GError) parse_error = NULL;

    if (size >= 3 && !memcmp(text, "\xef\xbb\xbf", 3)) { /* the mark that some editors leave */
        text += 3;
        size -= 3;
    }
    if (size > G_MAXINT)
        return lumi_fail(error, LUMI_ERR_LIMIT, "%s: has more than %d bytes", name, G_MAXINT);
    const char *fault = lumi_json_fault(text, size);
    if (fault)
        return fail_json(text, fault, text + size, name, error);
    if (!g_utf8_validate(text, (gssize)size, NULL))
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: not UTF-8", name);
    if (!json_parser_load_from_data(parser, text, (gssize)size, &parse_error))
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: %s", name, parse_error->message);
    return read_root(json_parser_get_root(parser), name, exchange, error);
}

/* Writing */

static void append_number(GString *text, double value)
{
    char digits[G_ASCII_DTOSTR_BUF_SIZE];

    g_string_append(text, g_ascii_formatd(digits, sizeof digits, "%.17g", value));
}

static void append_field(GString *text, const char *key, double value)
{
    g_string_append_printf(text, "\"%s\": ", key);
    append_number(text, value);
    g_string_append(text, ", ");
}

static void append_text(GString *text, const char *value)
{
    g_string_append_c(text, '"');
    for (const char *c = value; *c; c++) {
        if (*c == '"' || *c == '\\')
            g_string_append_c(text, '\\');
        if ((unsigned char)*c < 0x20)
            g_string_append_printf(text, "\\u%04x", (unsigned)*c);
        else
            g_string_append_c(text, *c);
    }
    g_string_append_c(text, '"');
}

static void append_camera(GString *text, const struct lumi_exchange_camera *camera)
{
    const struct lumi_exchange_model *model = lumi_exchange_model_by_name(camera->model);
    bool single = model->id == 0 || model->id == 2 || model->id == 3;
    bool brown = model->id == 6;
    const double *p = camera->parameters, *rest = p + (single ? 3 : 4);
    static const char *const perspective[] = {"k1", "k2", "p1", "p2", "k3"};
    static const char *const fisheye[] = {"k1", "k2", "k3", "k4"};

    /* nerfstudio knows no FULL_OPENCV: its OPENCV has k3. */
    g_string_append_printf(text, "\"camera_model\": \"%s\", \"w\": %d, \"h\": %d, ", brown ? "OPENCV" : camera->model,
                           camera->width, camera->height);
    append_field(text, "fl_x", p[0]);
    append_field(text, "fl_y", single ? p[0] : p[1]);
    append_field(text, "cx", p[single ? 1 : 2]);
    append_field(text, "cy", p[single ? 2 : 3]);
    int count = brown ? 5 : model->parameter_count - (single ? 3 : 4);
    for (int i = 0; i < count; i++)
        append_field(text, model->id == 5 ? fisheye[i] : perspective[i], rest[i]);
}

static void append_frame(GString *text, const struct lumi_exchange *exchange, const struct lumi_exchange_image *image,
                         bool own_camera)
{
    double m[12];

    g_string_append(text, "    {\"file_path\": ");
    append_text(text, image->original);
    g_string_append(text, ", ");
    if (own_camera)
        append_camera(text, lumi_exchange_camera(exchange, image->camera));
    if (image->row >= 0 && image->column >= 0)
        g_string_append_printf(text, "\"row\": %d, \"col\": %d, ", image->row, image->column);
    if (image->numbers == LUMI_EXCHANGE_MATRIX)
        memcpy(m, image->source, sizeof m);
    else
        lumi_exchange_pose_to(LUMI_EXCHANGE_MATRIX, &image->pose, m);
    g_string_append(text, "\"transform_matrix\": [");
    for (int i = 0; i < 12; i++) {
        g_string_append(text, i % 4 == 0 ? "[" : ", ");
        append_number(text, m[i]);
        g_string_append(text, i % 4 == 3 ? "], " : "");
    }
    g_string_append(text, "[0, 0, 0, 1]]}");
}

int lumi_exchange_format_transforms(const struct lumi_exchange *exchange, char **text, struct lumi_error *error)
{
    GString *out = g_string_new("{\n  ");
    bool shared = exchange->cameras->len == 1;

    (void)error;
    if (shared)
        append_camera(out, lumi_exchange_camera(exchange, 0));
    g_string_append(out, "\n  \"frames\": [\n");
    for (guint i = 0; i < exchange->images->len; i++) {
        append_frame(out, exchange, lumi_exchange_image(exchange, (int)i), !shared);
        g_string_append(out, i + 1 < exchange->images->len ? ",\n" : "\n");
    }
    g_string_append(out, "  ]\n}\n");
    *text = g_string_free(out, FALSE);
    return LUMI_OK;
}
