/* lumi: everything a person types. Finds the sub-command, parses its options, prints what went wrong. */
#include "cli/command.h"

#include <locale.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>

/* How many of argv[1..] spell the command's name; 0 if they do not. */
static int name_words(const struct cli_command *command, int argc, char **argv)
{
    g_auto(GStrv) words = g_strsplit(command->name, " ", -1);
    int count = (int)g_strv_length(words);

    if (argc - 1 < count)
        return 0;
    for (int i = 0; i < count; i++)
        if (strcmp(words[i], argv[1 + i]))
            return 0;
    return count;
}

static const struct cli_command *find(int argc, char **argv, int *words)
{
    const struct cli_command *best = NULL;

    *words = 0;
    for (int i = 0; cli_commands[i]; i++) {
        int count = name_words(cli_commands[i], argc, argv);
        if (count > *words) {
            best = cli_commands[i];
            *words = count;
        }
    }
    return best;
}

static int usage_error(const char *word)
{
    struct lumi_error error;

    cli_no_command(word, &error);
    fprintf(stderr, "lumi: %s\n", error.text);
    return 2;
}

static int run(const struct cli_command *command, int argc, char **argv)
{
    g_autoptr(GOptionContext) context = g_option_context_new(command->arguments);
    g_autoptr(GError) parse_error = NULL;
    g_auto(GStrv) copy = g_new0(char *, (gsize)argc + 2);
    struct lumi_error error = {0};

    copy[0] = g_strdup_printf("lumi %s", command->name);
    for (int i = 0; i < argc; i++)
        copy[i + 1] = g_strdup(argv[i]);
    g_set_prgname(copy[0]);
    g_option_context_set_summary(context, command->summary);
    g_option_context_set_description(context, command->description);
    if (command->options)
        g_option_context_add_main_entries(context, command->options, NULL);
    if (!g_option_context_parse_strv(context, &copy, &parse_error)) {
        fprintf(stderr, "lumi %s: %s (see 'lumi help %s')\n", command->name, parse_error->message, command->name);
        return 2;
    }
    char **left = copy + 1;
    if (*left && !strcmp(*left, "--"))
        left++;
    int count = (int)g_strv_length(left);
    if (count < command->min_arguments || (command->max_arguments >= 0 && count > command->max_arguments)) {
        fprintf(stderr, "usage: lumi %s [options] %s\n", command->name, command->arguments);
        return 2;
    }
    int code = command->run(count, left, &error);
    cli_progress_end();
    if (code != LUMI_OK)
        fprintf(stderr, "lumi %s: %s\n", command->name, error.text[0] ? error.text : "failed");
    return lumi_exit_status(code);
}

int main(int argc, char **argv)
{
    int words;

    setlocale(LC_CTYPE, "");
    signal(SIGXFSZ, SIG_IGN); /* a file over the limit (ulimit -f) is a write that fails, to be cleaned up after */
    if (argc == 2 && !strcmp(argv[1], "--version")) {
        puts("lumi " LUMI_VERSION);
        return 0;
    }
    if (argc == 1 || !strcmp(argv[1], "--help") || !strcmp(argv[1], "-h")) {
        char *help[] = {argv[0], (char *)"help", NULL};
        const struct cli_command *command = find(2, help, &words);
        return command ? run(command, 0, NULL) : 2;
    }
    const struct cli_command *command = find(argc, argv, &words);
    if (!command)
        return usage_error(argv[1]);
    return run(command, argc - 1 - words, argv + 1 + words);
}
