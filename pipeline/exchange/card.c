/* Memory cards: which files, in which order. */
#include "pipeline/exchange/card.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define DEPTH_MAX 4 /* folders below the one that is named */
#define NUMBER_MAX 9999
#define ROLL_NEAR 1000 /* a camera that began again has files near both ends of its numbers */
#define COMPARE_BLOCK 65536

int lumi_card_compare(const char *a, const char *b)
{
    while (*a && *b) {
        if (g_ascii_isdigit(*a) && g_ascii_isdigit(*b)) {
            size_t p, q;
            a += strspn(a, "0");
            b += strspn(b, "0");
            p = strspn(a, "0123456789");
            q = strspn(b, "0123456789");
            int order = p != q ? (p < q ? -1 : 1) : strncmp(a, b, p);
            if (order != 0)
                return order;
            a += p;
            b += q;
        } else {
            int order = g_ascii_tolower(*a) - g_ascii_tolower(*b);
            if (order != 0)
                return order;
            a++;
            b++;
        }
    }
    return (unsigned char)*a - (unsigned char)*b;
}

/* The number at the end of a DCF name's eight characters, −1 for other names. */
static int dcf_number(const char *name)
{
    const char *dot = strrchr(name, '.');
    size_t length = dot ? (size_t)(dot - name) : strlen(name);

    if (length != 8 || strspn(name + 4, "0123456789") < 4)
        return -1;
    return atoi(name + 4);
}

int lumi_card_first(char *const *names, int count)
{
    int largest = 1, first = 0;

    for (int i = 0; i < count; i++)
        if (dcf_number(names[i]) < 0 || g_ascii_strncasecmp(names[i], names[0], 4) != 0)
            return 0;
    if (count < 2 || dcf_number(names[0]) > ROLL_NEAR || dcf_number(names[count - 1]) < NUMBER_MAX - ROLL_NEAR)
        return 0;
    int around = dcf_number(names[0]) + NUMBER_MAX - dcf_number(names[count - 1]);
    for (int i = 1; i < count; i++) {
        int gap = dcf_number(names[i]) - dcf_number(names[i - 1]);
        if (gap > largest) {
            largest = gap;
            first = i;
        }
    }
    return largest > around ? first : 0;
}

static void clear_file(void *pointer)
{
    struct lumi_card_file *file = pointer;

    g_free(file->name);
    g_free(file->path);
    g_free(file->damage);
    lumi_image_meta_finish(&file->meta);
}

static void clear_name(void *pointer)
{
    g_free(*(char **)pointer);
}

static int by_name(const void *a, const void *b)
{
    int order = lumi_card_compare(*(char *const *)a, *(char *const *)b);

    return order != 0 ? order : strcmp(*(char *const *)a, *(char *const *)b);
}

static bool is_video(const char *name)
{
    static const char *const extensions[] = {".mp4",  ".mov", ".m4v", ".mkv", ".webm", ".avi", ".mts",
                                             ".m2ts", ".mpg", ".mxf", ".3gp", ".ts",   NULL};
    const char *dot = strrchr(name, '.');

    for (int i = 0; dot && extensions[i]; i++)
        if (!g_ascii_strcasecmp(dot, extensions[i]))
            return true;
    return false;
}

/* Without its extension. */
static size_t stem_length(const char *name)
{
    const char *dot = strrchr(name, '.');

    return dot ? (size_t)(dot - name) : strlen(name);
}

static bool same_stem(const char *a, const char *b)
{
    return stem_length(a) == stem_length(b) && !g_ascii_strncasecmp(a, b, stem_length(a));
}

/* A JPEG beside a raw file of the same name is the camera's own rendition of it. */
static bool has_raw(char *const *names, int count, int index)
{
    if (lumi_image_format_of_name(names[index]) != LUMI_IMAGE_JPEG)
        return false;
    for (int i = MAX(0, index - 2); i < MIN(count, index + 3); i++)
        if (lumi_image_format_of_name(names[i]) == LUMI_IMAGE_RAW && same_stem(names[i], names[index]))
            return true;
    return false;
}

/* What lies in a folder, sorted by name; folders apart. */
static int list_folder(const char *path, GArray *names, GArray *folders, struct lumi_error *error)
{
    g_autoptr(GDir) directory = g_dir_open(path, 0, NULL);
    const char *name;

    if (!directory)
        return lumi_fail_errno(error, path, "reading the folder");
    while ((name = g_dir_read_name(directory)) != NULL) {
        g_autofree char *whole = g_build_filename(path, name, NULL);
        char *copy = g_strdup(name);
        GArray *list = g_file_test(whole, G_FILE_TEST_IS_DIR) ? folders : names;
        if (name[0] == '.')
            g_free(copy);
        else
            g_array_append_val(list, copy);
    }
    g_array_sort(names, by_name);
    g_array_sort(folders, by_name);
    return LUMI_OK;
}

static void add_files(const char *folder, const char *below, const GArray *names, struct lumi_card *card)
{
    g_autoptr(GPtrArray) pictures = g_ptr_array_new();

    for (guint i = 0; i < names->len; i++) {
        char *name = g_array_index(names, char *, i);
        if (lumi_image_format_of_name(name) != LUMI_IMAGE_AUTO)
            g_ptr_array_add(pictures, name);
        else if (is_video(name)) {
            char *video = g_build_filename(below, name, NULL);
            g_array_append_val(card->videos, video);
        }
    }
    char *const *list = (char *const *)pictures->pdata;
    int count = (int)pictures->len, first = lumi_card_first(list, count);
    for (int i = 0; i < count; i++) {
        int at = (first + i) % count;
        if (has_raw(list, count, at)) {
            card->paired++;
            continue;
        }
        struct lumi_card_file file = {.name = g_build_filename(below, list[at], NULL), .same_as = -1};
        file.path = g_build_filename(folder, file.name, NULL);
        g_array_append_val(card->files, file);
    }
}

static int walk(const char *folder, const char *below, int depth, struct lumi_card *card, struct lumi_error *error)
{
    g_autoptr(GArray) names = g_array_new(FALSE, FALSE, sizeof(char *));
    g_autoptr(GArray) folders = g_array_new(FALSE, FALSE, sizeof(char *));
    g_autofree char *path = g_build_filename(folder, below, NULL);

    g_array_set_clear_func(names, clear_name);
    g_array_set_clear_func(folders, clear_name);
    LUMI_TRY(list_folder(path, names, folders, error));
    add_files(folder, below, names, card);
    for (guint i = 0; depth < DEPTH_MAX && i < folders->len; i++) {
        g_autofree char *inner = g_build_filename(below, g_array_index(folders, char *, i), NULL);
        LUMI_TRY(walk(folder, inner, depth + 1, card, error));
    }
    return LUMI_OK;
}

int lumi_card_list(const char *folder, struct lumi_card *card, struct lumi_error *error)
{
    card->files = g_array_new(FALSE, TRUE, sizeof(struct lumi_card_file));
    card->videos = g_array_new(FALSE, FALSE, sizeof(char *));
    card->paired = 0;
    g_array_set_clear_func(card->files, clear_file);
    g_array_set_clear_func(card->videos, clear_name);
    return walk(folder, "", 0, card, error);
}

void lumi_card_finish(struct lumi_card *card)
{
    if (card->files)
        g_array_unref(card->files);
    if (card->videos)
        g_array_unref(card->videos);
    *card = (struct lumi_card){0};
}

void lumi_card_read(struct lumi_card_file *file, bool trust)
{
    struct lumi_error error = {0};
    struct lumi_raster raster = {0};
    FILE *stream = fopen(file->path, "rb");
    int code;

    if (stream && fseek(stream, 0, SEEK_END) == 0)
        file->bytes = ftell(stream);
    if (stream)
        fclose(stream);
    code = lumi_image_read_meta(file->path, &file->meta, &error);
    if (code == LUMI_OK && !trust)
        code = lumi_image_read(file->path, 0, &raster, NULL, &error);
    if (code != LUMI_OK)
        file->damage = g_strdup(error.text);
    lumi_raster_finish(&raster);
}

static bool same_bytes(const char *a, const char *b)
{
    FILE *p = fopen(a, "rb"), *q = fopen(b, "rb");
    g_autofree char *one = g_malloc(COMPARE_BLOCK), *other = g_malloc(COMPARE_BLOCK);
    size_t size = 1;
    bool same = p && q;

    while (same && size > 0) {
        size = fread(one, 1, COMPARE_BLOCK, p);
        same = fread(other, 1, COMPARE_BLOCK, q) == size && !memcmp(one, other, size);
    }
    if (p)
        fclose(p);
    if (q)
        fclose(q);
    return same;
}

/* Copies have the time of what they are copies of; so only files of one size and time are compared, each with the ones
 * before it. */
void lumi_card_find_copies(struct lumi_card *card)
{
    g_autoptr(GHashTable) seen = g_hash_table_new_full(g_str_hash, g_str_equal, g_free, NULL);

    for (int i = 0; i < (int)card->files->len; i++) {
        struct lumi_card_file *file = lumi_card_file(card, i);
        char *key = g_strdup_printf("%" G_GINT64_FORMAT " %" G_GINT64_FORMAT, file->bytes, file->meta.taken_us);
        int before = GPOINTER_TO_INT(g_hash_table_lookup(seen, key)) - 1;
        if (file->bytes > 0 && before >= 0 && same_bytes(lumi_card_file(card, before)->path, file->path))
            file->same_as = before;
        g_hash_table_replace(seen, key, GINT_TO_POINTER(i + 1));
    }
}
