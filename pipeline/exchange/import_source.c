/* What lies on the disk: which kind of source it is, and where its pictures are. */
#include "pipeline/exchange/import_source.h"

#include "proto/base/file.h"
#include "proto/base/memory.h"
#include "proto/image/image.h"

#include <string.h>

#define MAX_TEXT ((size_t)1 << 30)

static bool is_file(const char *path)
{
    return g_file_test(path, G_FILE_TEST_IS_REGULAR);
}

static bool is_folder(const char *path)
{
    return g_file_test(path, G_FILE_TEST_IS_DIR);
}

/* "images/0001" without its extension is how instant-ngp and Blender scripts name files. */
static char *find_picture(const char *folder, const char *name)
{
    static const char *const extensions[] = {"", ".png", ".jpg", ".jpeg", ".JPG", ".tif", ".exr"};
    g_autofree char *whole = g_path_is_absolute(name) ? g_strdup(name) : g_build_filename(folder, name, NULL);

    for (size_t i = 0; i < G_N_ELEMENTS(extensions); i++) {
        g_autofree char *path = g_strconcat(whole, extensions[i], NULL);
        if (is_file(path))
            return g_steal_pointer(&path);
    }
    return g_steal_pointer(&whole);
}

static void find_pictures(struct lumi_exchange *exchange, const char *folder)
{
    for (guint i = 0; i < exchange->images->len; i++) {
        struct lumi_exchange_image *image = lumi_exchange_image(exchange, (int)i);
        image->path = find_picture(folder, image->original);
    }
}

static int read_transforms(const char *path, const struct lumi_import_options *options, struct lumi_exchange *exchange,
                           struct lumi_error *error)
{
    uint8_t *data;
    size_t size;

    LUMI_TRY(lumi_file_read(path, MAX_TEXT, &data, &size, error));
    int code = lumi_exchange_parse_transforms((const char *)data, size, path, exchange, error);
    lumi_free(data);
    LUMI_TRY(code);
    g_autofree char *folder = options->images ? g_strdup(options->images) : g_path_get_dirname(path);
    find_pictures(exchange, folder);
    return LUMI_OK;
}

/* COLMAP */

static char *colmap_file(const char *folder, const char *stem, bool binary)
{
    g_autofree char *name = g_strconcat(stem, binary ? ".bin" : ".txt", NULL);

    return g_build_filename(folder, name, NULL);
}

static bool has_colmap(const char *folder, bool binary)
{
    g_autofree char *cameras = colmap_file(folder, "cameras", binary);
    g_autofree char *images = colmap_file(folder, "images", binary);

    return is_file(cameras) && is_file(images);
}

static int read_colmap_file(const char *folder, bool cameras, bool binary, GHashTable *table,
                            struct lumi_exchange *exchange, struct lumi_error *error)
{
    g_autofree char *path = colmap_file(folder, cameras ? "cameras" : "images", binary);
    uint8_t *data;
    size_t size;

    LUMI_TRY(lumi_file_read(path, (size_t)16 << 30, &data, &size, error));
    int code = cameras ? lumi_exchange_parse_colmap_cameras(data, size, binary, path, table, exchange, error)
                       : lumi_exchange_parse_colmap_images(data, size, binary, path, table, exchange, error);
    lumi_free(data);
    return code;
}

/* Where a model's pictures are by custom: beside the model, beside sparse/, or beside sparse/0. */
static char *colmap_pictures(const char *folder)
{
    static const char *const places[] = {"images", "../images", "../../images"};

    for (size_t i = 0; i < G_N_ELEMENTS(places); i++) {
        g_autofree char *path = g_build_filename(folder, places[i], NULL);
        if (is_folder(path))
            return g_steal_pointer(&path);
    }
    return g_strdup(folder);
}

static int read_colmap(const char *folder, const struct lumi_import_options *options, struct lumi_exchange *exchange,
                       struct lumi_error *error)
{
    g_autoptr(GHashTable) table = g_hash_table_new(NULL, NULL);
    bool binary = has_colmap(folder, true);

    LUMI_TRY(read_colmap_file(folder, true, binary, table, exchange, error));
    LUMI_TRY(read_colmap_file(folder, false, binary, table, exchange, error));
    g_autofree char *pictures = options->images ? g_strdup(options->images) : colmap_pictures(folder);
    find_pictures(exchange, pictures);
    return LUMI_OK;
}

/* Stanford names */

struct stanford_file {
    char *name;
    struct lumi_exchange_stanford place;
};

static void clear_file(void *file)
{
    g_free(((struct stanford_file *)file)->name);
}

static int by_place(const void *a, const void *b)
{
    const struct stanford_file *p = a, *q = b;

    return p->place.row != q->place.row ? p->place.row - q->place.row : p->place.column - q->place.column;
}

static GArray *list_stanford(const char *folder)
{
    GArray *files = g_array_new(FALSE, TRUE, sizeof(struct stanford_file));
    g_autoptr(GDir) directory = g_dir_open(folder, 0, NULL);
    const char *name;

    g_array_set_clear_func(files, clear_file);
    while (directory && (name = g_dir_read_name(directory)) != NULL) {
        struct stanford_file file;
        if (lumi_image_format_of_name(name) != LUMI_IMAGE_AUTO && lumi_exchange_parse_stanford(name, &file.place)) {
            file.name = g_strdup(name);
            g_array_append_val(files, file);
        }
    }
    g_array_sort(files, by_place);
    return files;
}

/* A camera whose picture is aligned on the plane: its principal point moves with its place. */
static struct lumi_exchange_camera stanford_camera(const struct lumi_image_info *info,
                                                   const struct lumi_import_options *options, double x, double y)
{
    double focal = options->focal > 0 ? options->focal : info->width / 2.0 / tan(options->fov / 2);
    double shift = options->plane > 0 ? focal / options->plane : 0;
    struct lumi_exchange_camera camera = {
        .model = "PINHOLE",
        .parameter_count = 4,
        .parameters = {focal, focal, info->width / 2.0 + x * shift, info->height / 2.0 + y * shift},
        .width = info->width,
        .height = info->height};
    return camera;
}

static int add_stanford(GArray *files, const char *folder, const struct lumi_import_options *options,
                        struct lumi_exchange *exchange, struct lumi_error *error)
{
    double unit = options->unit > 0 ? options->unit : 0.001, mean_x = 0, mean_y = 0;
    struct lumi_image_info info;

    for (guint i = 0; i < files->len; i++) {
        mean_x += g_array_index(files, struct stanford_file, i).place.x / files->len;
        mean_y += g_array_index(files, struct stanford_file, i).place.y / files->len;
    }
    for (guint i = 0; i < files->len; i++) {
        const struct stanford_file *file = &g_array_index(files, struct stanford_file, i);
        double x = (file->place.x - mean_x) * unit * (options->flip_x ? -1 : 1);
        double y = (file->place.y - mean_y) * unit * (options->flip_y ? -1 : 1);
        g_autofree char *path = g_build_filename(folder, file->name, NULL);
        if (i > 0 && by_place(file, file - 1) == 0)
            return lumi_fail(error, LUMI_ERR_FORMAT, "%s: two images of row %d, column %d: '%s' and '%s'", folder,
                             file->place.row, file->place.column, (file - 1)->name, file->name);
        if (i == 0)
            LUMI_TRY(lumi_image_info(path, &info, error));
        struct lumi_exchange_camera camera = stanford_camera(&info, options, x, y);
        /* Right is +X of the world, down -Z, forward +Y; positions count to the right and downwards. */
        struct lumi_exchange_image image = {.row = file->place.row,
                                            .column = file->place.column,
                                            .in_metres = true,
                                            .pose = {{1, 0, 0, 0, 0, 1, 0, -1, 0}, {x, 0, 0 - y}}};
        image.camera = lumi_exchange_add_camera(exchange, &camera);
        image.original = g_strdup(file->name);
        image.path = g_steal_pointer(&path);
        g_array_append_val(exchange->images, image);
    }
    return LUMI_OK;
}

static int read_stanford(const char *folder, const struct lumi_import_options *options, struct lumi_exchange *exchange,
                         struct lumi_error *error)
{
    g_autoptr(GArray) files = list_stanford(folder);

    if (files->len == 0)
        return lumi_fail(error, LUMI_ERR_FORMAT,
                         "%s: neither a transforms.json, nor a COLMAP model, nor pictures named out_ROW_COLUMN_Y_X.png",
                         folder);
    if (!(options->focal > 0) && !(options->fov > 0 && options->fov < LUMI_PI))
        return lumi_fail(error, LUMI_ERR_ARG,
                         "%s: names like '%s' do not tell the lens: --focal PIXELS or --fov DEGREES is needed", folder,
                         g_array_index(files, struct stanford_file, 0).name);
    return add_stanford(files, folder, options, exchange, error);
}

int exchange_read_source(const char *source, const struct lumi_import_options *options, struct lumi_exchange *exchange,
                         struct lumi_error *error)
{
    static const char *const models[] = {".", "sparse/0", "sparse"};

    if (!is_folder(source))
        return read_transforms(source, options, exchange, error);
    g_autofree char *transforms = g_build_filename(source, "transforms.json", NULL);
    if (is_file(transforms))
        return read_transforms(transforms, options, exchange, error);
    for (size_t i = 0; i < G_N_ELEMENTS(models); i++) {
        g_autofree char *folder = i == 0 ? g_strdup(source) : g_build_filename(source, models[i], NULL);
        if (has_colmap(folder, true) || has_colmap(folder, false))
            return read_colmap(folder, options, exchange, error);
    }
    return read_stanford(source, options, exchange, error);
}

/* Names */

#define NAME_MAX_LENGTH 60

/* Letters, digits, '.', '_' and '-'; not a dot first; of a long one the end, which tells pictures apart. */
static char *safe_name(const char *original, bool whole_path)
{
    g_autofree char *base = whole_path ? g_strdup(original) : g_path_get_basename(original);
    char *dot = strrchr(base, '.');

    if (dot && dot != base && lumi_image_format_of_name(base) != LUMI_IMAGE_AUTO)
        *dot = '\0';
    for (char *c = base; *c; c++)
        if (!g_ascii_isalnum(*c) && *c != '.' && *c != '_' && *c != '-')
            *c = '_';
    size_t length = strlen(base);
    char *name = g_strdup(length > NAME_MAX_LENGTH ? base + length - NAME_MAX_LENGTH : base);
    if (name[0] == '.' || name[0] == '-')
        name[0] = '_';
    return name;
}

/* Index of the first image whose file another has already, however each spells it, or −1. */
static int same_file(const struct lumi_exchange *exchange)
{
    g_autoptr(GHashTable) taken = g_hash_table_new_full(g_str_hash, g_str_equal, g_free, NULL);

    for (guint i = 0; i < exchange->images->len; i++) {
        const char *path = lumi_exchange_image(exchange, (int)i)->path;
        if (!g_hash_table_add(taken, g_canonicalize_filename(path, NULL)))
            return (int)i;
    }
    return -1;
}

#define NUMBERED_LENGTH (NAME_MAX_LENGTH - 5) /* leaves room for the number of any image */

/* Whether all got different names. With `number`, later ones of a name get -2, -3 and so on behind it. */
static bool name_all(struct lumi_exchange *exchange, bool whole_path, bool number)
{
    g_autoptr(GHashTable) taken = g_hash_table_new(g_str_hash, g_str_equal);
    g_autoptr(GHashTable) counts = g_hash_table_new_full(g_str_hash, g_str_equal, g_free, NULL);

    for (guint i = 0; i < exchange->images->len; i++) {
        struct lumi_exchange_image *image = lumi_exchange_image(exchange, (int)i);
        g_free(image->name);
        image->name = safe_name(image->original, whole_path);
        if (!number && !g_hash_table_add(taken, image->name))
            return false; /* they are named anew */
        if (!number)
            continue;
        char *plain = g_strdup(image->name);
        int count = MAX(1, GPOINTER_TO_INT(g_hash_table_lookup(counts, plain)));
        while (g_hash_table_contains(taken, image->name)) {
            g_free(image->name);
            image->name = g_strdup_printf("%.*s-%d", NUMBERED_LENGTH, plain, ++count);
        }
        g_hash_table_add(taken, image->name);
        g_hash_table_insert(counts, plain, GINT_TO_POINTER(count));
    }
    return true;
}

int exchange_name_images(struct lumi_exchange *exchange, const char *source, struct lumi_error *error)
{
    int twice = same_file(exchange);

    if (twice >= 0)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: two images of one name: '%s'", source,
                         lumi_exchange_image(exchange, twice)->original);
    /* Names that differ only in what a safe name cannot hold ("ä", "ö") are told apart by numbers. */
    if (!name_all(exchange, false, false) && !name_all(exchange, true, false))
        name_all(exchange, true, true);
    return LUMI_OK;
}
