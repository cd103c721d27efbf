/* Rig profiles and plans from the command line. */
#include "cli/rig_files.h"

#include "proto/base/file.h"
#include "proto/base/memory.h"

#include <glib.h>
#include <string.h>

int cli_read_rig(const char *name, struct lumi_rig *rig, struct lumi_error *error)
{
    uint8_t *text = NULL;
    size_t size = 0;
    int code = lumi_file_read(name, LUMI_RIG_TEXT_MAX, &text, &size, error);

    if (code == LUMI_OK)
        code = lumi_rig_parse((const char *)text, size, name, rig, error);
    else if (code == LUMI_ERR_NOTFOUND)
        for (int i = 0; lumi_rig_builtin_names[i]; i++)
            if (!strcmp(name, lumi_rig_builtin_names[i]))
                code = lumi_rig_builtin(name, rig, error);
    lumi_free(text);
    return code;
}

int cli_read_plan(const char *path, const struct lumi_rig *rig, struct lumi_plan *plan, struct lumi_error *error)
{
    uint8_t *text = NULL;
    size_t size = 0;
    int code = lumi_file_read(path, LUMI_PLAN_TEXT_MAX, &text, &size, error);

    if (code == LUMI_OK)
        code = lumi_plan_parse((const char *)text, size, path, rig, plan, error);
    lumi_free(text);
    return code;
}

/* The NAME of a line "[lens NAME]"; NULL: it is another line. Free with g_free. */
static char *lens_named(const char *line)
{
    g_autofree char *text = g_strstrip(g_strdup(line));
    const size_t length = strlen(text);

    if (!g_str_has_prefix(text, "[lens ") || text[length - 1] != ']')
        return NULL;
    return g_strstrip(g_strndup(text + strlen("[lens "), length - strlen("[lens ]")));
}

static bool has_lens(const struct lumi_rig *rig, const char *name)
{
    for (int i = 0; i < rig->lens_count; i++)
        if (!strcmp(rig->lenses[i].name, name))
            return true;
    return false;
}

/* The file's sections, its only one called as the rig's only one; their names go to `names`. */
static int take_sections(const char *path, const char *text, const struct lumi_rig *rig, GString *sections,
                         GHashTable *names, struct lumi_error *error)
{
    g_auto(GStrv) lines = g_strsplit(text, "\n", -1);
    int found = 0;

    for (int i = 0; lines[i]; i++) {
        g_autofree char *name = lens_named(lines[i]);
        found += name != NULL;
    }
    for (int i = 0; lines[i]; i++) {
        g_autofree char *name = lens_named(lines[i]);
        if (name && found == 1 && rig->lens_count == 1) {
            g_free(name);
            name = g_strdup(rig->lenses[0].name);
        }
        if (name && !has_lens(rig, name))
            return lumi_fail(error, LUMI_ERR_FORMAT, "%s: the rig has no lens '%s' (its first is '%s')", path, name,
                             rig->lenses[0].name);
        if (name)
            g_string_append_printf(sections, "[lens %s]\n", name);
        else
            g_string_append_printf(sections, "%s\n", lines[i]);
        if (name)
            g_hash_table_add(names, g_steal_pointer(&name));
    }
    return found ? LUMI_OK : lumi_fail(error, LUMI_ERR_FORMAT, "%s: there is no section [lens NAME] in it", path);
}

/* The profile without the lenses of these names. */
static void add_others(const char *profile, GHashTable *names, GString *sections)
{
    g_auto(GStrv) lines = g_strsplit(profile, "\n", -1);
    bool kept = true;

    for (int i = 0; lines[i]; i++) {
        g_autofree char *name = lens_named(lines[i]);
        if (lines[i][0] == '[')
            kept = !name || !g_hash_table_contains(names, name);
        if (kept)
            g_string_append_printf(sections, "%s\n", lines[i]);
    }
}

int cli_change_lenses(const char *path, struct lumi_rig *rig, struct lumi_error *error)
{
    g_autoptr(GHashTable) names = g_hash_table_new_full(g_str_hash, g_str_equal, g_free, NULL);
    g_autoptr(GString) sections = g_string_new(NULL);
    g_autofree char *profile = g_malloc(LUMI_RIG_TEXT_MAX);
    uint8_t *data = NULL;
    size_t size;

    LUMI_TRY(lumi_file_read(path, LUMI_RIG_TEXT_MAX, &data, &size, error));
    g_autofree char *text = g_strndup((const char *)data, size);
    lumi_free(data);
    /* The file's lines come first: what the parser says of line 5 is of its line 5. */
    LUMI_TRY(take_sections(path, text, rig, sections, names, error));
    lumi_rig_print(rig, profile, LUMI_RIG_TEXT_MAX);
    add_others(profile, names, sections);
    return lumi_rig_parse(sections->str, sections->len, path, rig, error);
}
