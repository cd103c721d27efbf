/* lumi help: from the tables of all sub-commands. */
#include "cli/command.h"

#include <stdio.h>
#include <string.h>

static int list(void)
{
    puts(
        "usage: lumi COMMAND [options] [arguments]\n\nPanoramic light fields: from a folder of photographs to any view "
        "of the place.\n\ncommands:");
    for (int i = 0; cli_commands[i]; i++)
        printf("  %-14s %s\n", cli_commands[i]->name, cli_commands[i]->summary);
    puts(
        "\n'lumi help COMMAND' tells more. Exit status: 0 done, 1 the work failed, 2 the command line was wrong, 3 the "
        "input was bad.");
    return LUMI_OK;
}

static int run_help(int argc, char **argv, struct lumi_error *error)
{
    if (argc == 0)
        return list();
    g_autofree char *name = g_strjoinv(" ", argv);
    for (int i = 0; cli_commands[i]; i++) {
        if (strcmp(cli_commands[i]->name, name))
            continue;
        g_autoptr(GOptionContext) context = g_option_context_new(cli_commands[i]->arguments);
        g_autofree char *program = g_strdup_printf("lumi %s", name);
        g_set_prgname(program);
        g_option_context_set_summary(context, cli_commands[i]->summary);
        g_option_context_set_description(context, cli_commands[i]->description);
        if (cli_commands[i]->options)
            g_option_context_add_main_entries(context, cli_commands[i]->options, NULL);
        g_autofree char *text = g_option_context_get_help(context, TRUE, NULL);
        fputs(text, stdout);
        return LUMI_OK;
    }
    return lumi_fail(error, LUMI_ERR_ARG, "no command '%s'", name);
}

const struct cli_command cli_help = {
    .name = "help",
    .arguments = "[COMMAND]",
    .summary = "list the commands, or explain one",
    .max_arguments = 2,
    .run = run_help,
};
