/* Words of the processing command, lines of its output. */
#include "daemon/handover/handover_command.h"

#include <glib.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- Words ---- */

/* The capture's path without ".capture". */
static char *stem_of(const char *capture)
{
    return g_str_has_suffix(capture, ".capture") ? g_strndup(capture, strlen(capture) - 8) : g_strdup(capture);
}

static int replace(const char *word, const char *capture, GString *into, struct lumi_error *error)
{
    g_autofree char *stem = stem_of(capture);
    g_autofree char *name = g_path_get_basename(stem);

    for (const char *at = word; *at; at++) {
        if (*at != '%') {
            g_string_append_c(into, *at);
            continue;
        }
        switch (*++at) {
        case 'c':
            g_string_append(into, capture);
            break;
        case 'n':
            g_string_append(into, name);
            break;
        case 'w':
            g_string_append_printf(into, "%s.work", capture);
            break;
        case 'o':
            g_string_append_printf(into, "%s.lumi", stem);
            break;
        case '%':
            g_string_append_c(into, '%');
            break;
        default:
            return lumi_fail(error, LUMI_ERR_FORMAT,
                             "processing command: '%s': a %% stands before c, n, w, o or another %%", word);
        }
    }
    return LUMI_OK;
}

int handover_words(const char *command, const char *capture, char ***words, struct lumi_error *error)
{
    g_autoptr(GError) problem = NULL;
    g_auto(GStrv) split = NULL;
    int count;

    *words = NULL;
    if (!g_shell_parse_argv(command, &count, &split, &problem))
        return lumi_fail(error, LUMI_ERR_FORMAT, "processing command: %s", problem->message);
    for (int i = 0; i < count; i++) {
        GString *word = g_string_new(NULL);
        const int code = replace(split[i], capture, word, error);
        g_free(split[i]);
        split[i] = g_string_free(word, FALSE);
        LUMI_TRY(code);
    }
    *words = g_steal_pointer(&split);
    return LUMI_OK;
}

/* ---- Lines ---- */

/* "progress: DONE/TOTAL STAGE" */
static bool read_parts(const char *line, struct lumi_process_status *status)
{
    char *end;

    if (!g_str_has_prefix(line, "progress: "))
        return false;
    const double done = g_ascii_strtod(line + 10, &end);
    if (end == line + 10 || *end != '/')
        return false;
    const char *second = end + 1;
    const double total = g_ascii_strtod(second, &end);
    if (end == second || !(total > 0) || !(done >= 0) || !isfinite(done / total))
        return false;
    status->progress = done < total ? done / total : 1;
    while (*end == ' ')
        end++;
    if (*end)
        g_strlcpy(status->stage, end, sizeof status->stage);
    return true;
}

/* "… NN%" or "… NN %", as tools print it; the text before it is the stage. */
static bool read_percent(const char *line, struct lumi_process_status *status)
{
    const char *sign = strrchr(line, '%');

    if (!sign || sign == line)
        return false;
    const char *last = sign - 1;
    while (last > line && *last == ' ')
        last--;
    const char *first = last + 1;
    while (first > line && (g_ascii_isdigit(first[-1]) || first[-1] == '.'))
        first--;
    if (first > last)
        return false;
    const double percent = g_ascii_strtod(first, NULL);
    if (!(percent >= 0 && percent <= 100))
        return false;
    status->progress = percent / 100;
    return true;
}

bool handover_read_line(const char *line, struct lumi_process_status *status)
{
    g_autofree char *text = g_utf8_make_valid(line, -1);

    g_strdelimit(text, "\t\b\033", ' ');
    g_strstrip(text);
    if (!*text)
        return false;
    if (!read_parts(text, status) && !read_percent(text, status))
        g_strlcpy(status->text, text, sizeof status->text);
    return true;
}
