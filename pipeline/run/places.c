/* Reading and writing places. */
#include "pipeline/run/places.h"

#include "proto/base/file.h"
#include "proto/base/memory.h"

#include <glib.h>
#include <string.h>

static const char first_line[] = "lumi places 1";

int lumi_places_add_lens(struct lumi_places *places, const struct lumi_lens *lens, int *index, struct lumi_error *error)
{
    for (int i = places->lens_count; i-- > 0;)
        if (lumi_lens_equal(&places->lenses[i], lens)) {
            *index = i;
            return LUMI_OK;
        }
    if (places->lens_count >= LUMI_PLACES_MAX)
        return lumi_fail(error, LUMI_ERR_LIMIT, "more than %d lenses", LUMI_PLACES_MAX);
    struct lumi_lens *more = lumi_realloc(places->lenses, (size_t)places->lens_count + 1, sizeof *more);
    if (!more)
        return lumi_fail(error, LUMI_ERR_NOMEM, "out of memory");
    places->lenses = more;
    more[places->lens_count] = *lens;
    *index = places->lens_count++;
    return LUMI_OK;
}

int lumi_places_add(struct lumi_places *places, const struct lumi_place *place, struct lumi_error *error)
{
    const int room = places->count;

    if (room >= LUMI_PLACES_MAX)
        return lumi_fail(error, LUMI_ERR_LIMIT, "more than %d views", LUMI_PLACES_MAX);
    if ((room & (room - 1)) == 0) { /* full at every power of two */
        struct lumi_place *more = lumi_realloc(places->items, room ? 2 * (size_t)room : 1, sizeof *more);
        if (!more)
            return lumi_fail(error, LUMI_ERR_NOMEM, "out of memory");
        places->items = more;
    }
    places->items[places->count++] = *place;
    return LUMI_OK;
}

void lumi_places_finish(struct lumi_places *places)
{
    lumi_free(places->lenses);
    lumi_free(places->items);
    *places = (struct lumi_places){0};
}

int lumi_places_find(const struct lumi_places *places, const char *name)
{
    for (int i = 0; i < places->count; i++)
        if (!strcmp(places->items[i].name, name))
            return i;
    return -1;
}

/* One line, cut at its blanks. */
struct cut {
    char **words;
    int count, next;
    const char *source;
    int line;
};

static int bad(const struct cut *cut, const char *what, struct lumi_error *error)
{
    return lumi_fail(error, LUMI_ERR_FORMAT, "%s:%d: %s", cut->source, cut->line, what);
}

static bool take_number(struct cut *cut, double *value)
{
    char *end;

    if (cut->next >= cut->count)
        return false;
    const char *word = cut->words[cut->next++];
    *value = g_ascii_strtod(word, &end);
    return end != word && !*end && *value > -1e300 && *value < 1e300;
}

static bool take_int(struct cut *cut, int *value)
{
    gint64 number;

    if (cut->next >= cut->count || !g_ascii_string_to_signed(cut->words[cut->next++], 10, 0, G_MAXINT, &number, NULL))
        return false;
    *value = (int)number;
    return true;
}

static int parse_lens(struct cut *cut, struct lumi_places *places, struct lumi_error *error)
{
    struct lumi_lens lens = {0};
    double *const numbers[] = {&lens.fx, &lens.fy, &lens.cx, &lens.cy, &lens.k1,
                               &lens.k2, &lens.k3, &lens.k4, &lens.p1, &lens.p2};
    int model, index;
    bool good = take_int(cut, &model) && take_int(cut, &lens.width) && take_int(cut, &lens.height);

    for (size_t i = 0; i < G_N_ELEMENTS(numbers); i++)
        good = good && take_number(cut, numbers[i]);
    if (!good || cut->next != cut->count)
        return bad(cut, "a lens is its model, its size and ten numbers", error);
    lens.model = (enum lumi_lens_model)model;
    if (!lumi_lens_valid(&lens))
        return bad(cut, "this is no lens", error);
    const int before = places->lens_count;
    LUMI_TRY(lumi_places_add_lens(places, &lens, &index, error));
    return index == before ? LUMI_OK : bad(cut, "the same lens twice", error);
}

static bool take_flags(struct cut *cut, struct lumi_place *place)
{
    if (cut->next >= cut->count)
        return false;
    const char *flags = cut->words[cut->next++];
    if (!strcmp(flags, "-"))
        return true;
    place->used = strchr(flags, 'u') != NULL;
    place->kept = strchr(flags, 'k') != NULL;
    place->synthetic = strchr(flags, 's') != NULL;
    place->masked = strchr(flags, 'm') != NULL;
    return *flags && strspn(flags, "uksm") == strlen(flags);
}

/* Names become names of files. */
static bool good_name(const char *name)
{
    return *name && *name != '.' && strlen(name) < sizeof((struct lumi_place *)0)->name &&
           strspn(name, G_CSET_a_2_z G_CSET_A_2_Z "0123456789._-") == strlen(name);
}

static int parse_view(struct cut *cut, struct lumi_places *places, struct lumi_error *error)
{
    struct lumi_place place = {0};
    double *const at[] = {&place.pose.t.x, &place.pose.t.y, &place.pose.t.z};

    if (cut->next >= cut->count || !good_name(cut->words[cut->next]))
        return bad(cut, "a view's name is wanted", error);
    g_strlcpy(place.name, cut->words[cut->next++], sizeof place.name);
    if (!take_int(cut, &place.lens) || place.lens >= places->lens_count)
        return bad(cut, "there is no such lens", error);
    if (!take_flags(cut, &place))
        return bad(cut, "flags are letters of 'uksm', or '-'", error);
    for (int row = 0; row < 3; row++)
        if (!take_number(cut, &place.pose.r[3 * row]) || !take_number(cut, &place.pose.r[3 * row + 1]) ||
            !take_number(cut, &place.pose.r[3 * row + 2]) || !take_number(cut, at[row]))
            return bad(cut, "a pose is twelve numbers", error);
    if (!lumi_pose_valid(&place.pose, 1e-6))
        return bad(cut, "this is no pose", error);
    for (; cut->next < cut->count; cut->next++)
        if (g_strlcat(place.why, cut->words[cut->next], sizeof place.why) < sizeof place.why &&
            cut->next + 1 < cut->count)
            g_strlcat(place.why, " ", sizeof place.why);
    return lumi_places_add(places, &place, error);
}

static int parse_line(const char *line, const char *source, int number, struct lumi_places *places,
                      struct lumi_error *error)
{
    g_auto(GStrv) words = g_strsplit(line, " ", 0);
    struct cut cut = {words, (int)g_strv_length(words), 1, source, number};

    if (cut.count > 0 && !strcmp(words[0], "lens"))
        return parse_lens(&cut, places, error);
    if (cut.count > 0 && !strcmp(words[0], "view"))
        return parse_view(&cut, places, error);
    return bad(&cut, "'lens' or 'view' wanted", error);
}

static int unique_names(const struct lumi_places *places, const char *source, struct lumi_error *error)
{
    g_autoptr(GHashTable) names = g_hash_table_new(g_str_hash, g_str_equal);

    for (int i = 0; i < places->count; i++)
        if (!g_hash_table_add(names, places->items[i].name))
            return lumi_fail(error, LUMI_ERR_FORMAT, "%s: two views are called %s", source, places->items[i].name);
    return LUMI_OK;
}

int lumi_places_parse(const char *text, size_t size, const char *source, struct lumi_places *places,
                      struct lumi_error *error)
{
    g_autofree char *copy = g_strndup(text, size);
    g_auto(GStrv) lines = NULL;
    int code = LUMI_OK;

    *places = (struct lumi_places){0};
    if (memchr(text, 0, size) || !g_utf8_validate(text, (gssize)size, NULL))
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: is no text", source);
    lines = g_strsplit(copy, "\n", 0);
    if (!lines[0] || strcmp(lines[0], first_line) != 0)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: does not begin with '%s'", source, first_line);
    for (int i = 1; code == LUMI_OK && lines[i]; i++)
        if (*lines[i] || lines[i + 1])
            code = parse_line(lines[i], source, i + 1, places, error);
    if (code == LUMI_OK)
        code = unique_names(places, source, error);
    if (code != LUMI_OK)
        lumi_places_finish(places);
    return code;
}

int lumi_places_read(const char *path, struct lumi_places *places, struct lumi_error *error)
{
    uint8_t *data;
    size_t size;

    *places = (struct lumi_places){0};
    LUMI_TRY(lumi_file_read(path, (size_t)1 << 28, &data, &size, error));
    int code = lumi_places_parse((const char *)data, size, path, places, error);
    lumi_free(data);
    return code;
}

static void print_number(GString *text, double value)
{
    char digits[G_ASCII_DTOSTR_BUF_SIZE];

    g_string_append_c(text, ' ');
    g_string_append(text, g_ascii_formatd(digits, sizeof digits, "%.17g", value));
}

static void print_lens(GString *text, const struct lumi_lens *lens)
{
    const double numbers[] = {lens->fx, lens->fy, lens->cx, lens->cy, lens->k1,
                              lens->k2, lens->k3, lens->k4, lens->p1, lens->p2};

    g_string_append_printf(text, "lens %d %d %d", (int)lens->model, lens->width, lens->height);
    for (size_t i = 0; i < G_N_ELEMENTS(numbers); i++)
        print_number(text, numbers[i]);
    g_string_append_c(text, '\n');
}

static void print_view(GString *text, const struct lumi_place *place)
{
    const double at[] = {place->pose.t.x, place->pose.t.y, place->pose.t.z};
    const bool any = place->used || place->kept || place->synthetic || place->masked;

    g_string_append_printf(text, "view %s %d %s%s%s%s%s", place->name, place->lens, any ? "" : "-",
                           place->used ? "u" : "", place->kept ? "k" : "", place->synthetic ? "s" : "",
                           place->masked ? "m" : "");
    for (int row = 0; row < 3; row++) {
        for (int i = 0; i < 3; i++)
            print_number(text, place->pose.r[3 * row + i]);
        print_number(text, at[row]);
    }
    if (*place->why) {
        g_autofree char *why = g_strdelimit(g_strdup(place->why), "\n\r", ' ');
        g_string_append_printf(text, " %s", why);
    }
    g_string_append_c(text, '\n');
}

int lumi_places_write(const char *path, const struct lumi_places *places, struct lumi_error *error)
{
    g_autoptr(GString) text = g_string_new(first_line);

    g_string_append_c(text, '\n');
    for (int i = 0; i < places->lens_count; i++)
        print_lens(text, &places->lenses[i]);
    for (int i = 0; i < places->count; i++)
        print_view(text, &places->items[i]);
    return lumi_file_write(path, text->str, text->len, false, error);
}
