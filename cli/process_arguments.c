/* The options of `lumi process` as words again, for whoever goes on with a run. */
#include "cli/process_options.h"

#include <string.h>

static const GOptionEntry entries[] = {PROCESS_OPTIONS, {0}};

/* Where an option's value lies in the defaults. */
static const void *default_of(const GOptionEntry *entry)
{
    return (const char *)&process_defaults + ((char *)entry->arg_data - (char *)&process_options);
}

static char *number_text(double number)
{
    char text[G_ASCII_DTOSTR_BUF_SIZE];

    return g_strdup(g_ascii_dtostr(text, sizeof text, number));
}

/* NULL: it was not given. */
static char *value_text(const GOptionEntry *entry)
{
    const void *value = entry->arg_data, *untouched = default_of(entry);

    switch (entry->arg) {
    case G_OPTION_ARG_NONE:
        return *(const gboolean *)value ? g_strdup("") : NULL;
    case G_OPTION_ARG_INT:
        return *(const int *)value == *(const int *)untouched ? NULL : g_strdup_printf("%d", *(const int *)value);
    case G_OPTION_ARG_INT64:
        return *(const gint64 *)value == *(const gint64 *)untouched
                   ? NULL
                   : g_strdup_printf("%" G_GINT64_FORMAT, *(const gint64 *)value);
    case G_OPTION_ARG_DOUBLE:
        return *(const double *)value == *(const double *)untouched ? NULL : number_text(*(const double *)value);
    case G_OPTION_ARG_STRING:
    case G_OPTION_ARG_FILENAME:
        return g_strdup(*(char *const *)value);
    default:
        g_assert_not_reached(); /* a kind of option that has to be added here */
    }
}

void process_options_list(GPtrArray *arguments)
{
    for (const GOptionEntry *entry = entries; entry->long_name; entry++) {
        g_autofree char *value = NULL;
        if (!strcmp(entry->long_name, "work") || !strcmp(entry->long_name, "threads"))
            continue;
        value = value_text(entry);
        if (value && entry->arg == G_OPTION_ARG_NONE)
            g_ptr_array_add(arguments, g_strdup_printf("--%s", entry->long_name));
        else if (value)
            g_ptr_array_add(arguments, g_strdup_printf("--%s=%s", entry->long_name, value));
    }
}

int process_options_take(const GPtrArray *arguments, struct lumi_error *error)
{
    g_autoptr(GOptionContext) context = g_option_context_new(NULL);
    g_auto(GStrv) words = g_new0(char *, (gsize)arguments->len + 2);
    g_autoptr(GError) reason = NULL;

    words[0] = g_strdup("lumi");
    for (guint i = 0; i < arguments->len; i++)
        words[i + 1] = g_strdup(g_ptr_array_index(arguments, i));
    g_option_context_add_main_entries(context, entries, NULL);
    g_option_context_set_help_enabled(context, FALSE);
    if (!g_option_context_parse_strv(context, &words, &reason))
        return lumi_fail(error, LUMI_ERR_FORMAT, "the options of the run: %s", reason->message);
    if (words[1])
        return lumi_fail(error, LUMI_ERR_FORMAT, "the options of the run: '%s' is none", words[1]);
    return LUMI_OK;
}
