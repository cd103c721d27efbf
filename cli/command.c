/* What sub-commands share: progress, numbers and choices from the command line. */
#include "cli/command.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

int cli_no_command(const char *word, struct lumi_error *error)
{
    g_autoptr(GString) longer = g_string_new(NULL);
    g_autofree char *start = g_strconcat(word, " ", NULL);

    for (int i = 0; cli_commands[i]; i++)
        if (g_str_has_prefix(cli_commands[i]->name, start))
            g_string_append_printf(longer, "%s '%s'", longer->len ? "," : "", cli_commands[i]->name);
    return longer->len ? lumi_fail(error, LUMI_ERR_ARG, "'%s' what? There are%s", word, longer->str)
                       : lumi_fail(error, LUMI_ERR_ARG, "no command '%s' (see 'lumi help')", word);
}

static bool shown;

void cli_progress(const char *what, long done, long total)
{
    if (!isatty(STDERR_FILENO)) {
        if (total > 0 && getenv("LUMI_PROGRESS")) /* somebody reads along: lumid, docs/handover.md */
            fprintf(stderr, "progress: %ld/%ld %s\n", done, total, what);
        return;
    }
    if (total > 0)
        fprintf(stderr, "\r\033[K%s %ld/%ld (%ld %%)", what, done, total, done * 100 / total);
    else
        fprintf(stderr, "\r\033[K%s %ld", what, done);
    fflush(stderr);
    shown = true;
}

void cli_progress_line(const char *line)
{
    if (!isatty(STDERR_FILENO))
        return;
    fprintf(stderr, "\r\033[K%s", line);
    fflush(stderr);
    shown = true;
}

void cli_progress_end(void)
{
    if (shown)
        fputs("\r\033[K", stderr);
    shown = false;
}

int cli_parse_doubles(const char *option, const char *text, char separator, int count, double *values,
                      struct lumi_error *error)
{
    const char *at = text;

    for (int i = 0; i < count; i++) {
        char *end;
        values[i] = g_ascii_strtod(at, &end);
        if (end == at || *end != (i + 1 < count ? separator : '\0') || !(values[i] - values[i] == 0))
            return count == 1 ? lumi_fail(error, LUMI_ERR_ARG, "%s %s: a number wanted", option, text)
                              : lumi_fail(error, LUMI_ERR_ARG, "%s %s: %d numbers separated by '%c' wanted", option,
                                          text, count, separator);
        at = end + 1;
    }
    return LUMI_OK;
}

int cli_parse_ints(const char *option, const char *text, char separator, int count, int *values,
                   struct lumi_error *error)
{
    double numbers[16];

    if (count > 16)
        return LUMI_ERR_ARG;
    LUMI_TRY(cli_parse_doubles(option, text, separator, count, numbers, error));
    for (int i = 0; i < count; i++) {
        if (!(fabs(numbers[i]) <= INT32_MAX) || numbers[i] != floor(numbers[i]))
            return lumi_fail(error, LUMI_ERR_ARG, "%s %s: whole numbers wanted", option, text);
        values[i] = (int)numbers[i];
    }
    return LUMI_OK;
}

int cli_check_threads(int threads, struct lumi_error *error)
{
    if (threads < 0)
        return lumi_fail(error, LUMI_ERR_ARG, "--threads %d: a number from 1 wanted, or 0 for all", threads);
    return LUMI_OK;
}

int cli_parse_choice(const char *option, const char *text, const char *const *names, int *choice,
                     struct lumi_error *error)
{
    for (int i = 0; names[i]; i++)
        if (!strcmp(names[i], text)) {
            *choice = i;
            return LUMI_OK;
        }
    g_autofree char *all = g_strjoinv(", ", (char **)(void *)names);
    return lumi_fail(error, LUMI_ERR_ARG, "%s %s: one of %s wanted", option, text, all);
}
