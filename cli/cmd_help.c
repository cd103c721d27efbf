/* lumi help: from the tables of all sub-commands. */
#include "cli/command.h"
#include "cli/manual.h"

#include <stdio.h>
#include <string.h>

static gboolean man;
static char *completion;

static void list(void)
{
    puts(
        "usage: lumi COMMAND [options] [arguments]\n\nPanoramic light fields: from a folder of photographs to any view "
        "of the place.\n\ncommands:");
    for (int i = 0; cli_commands[i]; i++)
        printf("  %-19s %s\n", cli_commands[i]->name, cli_commands[i]->summary);
    puts(
        "\n'lumi help COMMAND' tells more. Exit status: 0 done, 1 the work failed, 2 the command line was wrong, 3 the "
        "input was bad.");
}

static void explain(const struct cli_command *command)
{
    g_autoptr(GOptionContext) context = g_option_context_new(command->arguments);
    g_autofree char *program = g_strdup_printf("lumi %s", command->name);

    g_set_prgname(program);
    g_option_context_set_summary(context, command->summary);
    g_option_context_set_description(context, command->description);
    if (command->options)
        g_option_context_add_main_entries(context, command->options, NULL);
    g_autofree char *text = g_option_context_get_help(context, TRUE, NULL);
    fputs(text, stdout);
}

static int run_help(int argc, char **argv, struct lumi_error *error)
{
    const struct cli_command *command = NULL;
    g_autofree char *name = g_strjoinv(" ", argv);
    g_autofree char *text = NULL;

    for (int i = 0; cli_commands[i]; i++)
        if (!strcmp(cli_commands[i]->name, name))
            command = cli_commands[i];
    if (argc > 0 && !command)
        return cli_no_command(name, error);
    if (completion) {
        if (strcmp(completion, "bash"))
            return lumi_fail(error, LUMI_ERR_ARG, "--completion %s: only bash is known", completion);
        text = cli_manual_completion_bash();
        fputs(text, stdout);
    } else if (man) {
        text = cli_manual_page(command);
        fputs(text, stdout);
    } else if (command) {
        explain(command);
    } else {
        list();
    }
    return LUMI_OK;
}

static const GOptionEntry options[] = {
    {"man", 0, 0, G_OPTION_ARG_NONE, &man, "the manual page of the program, or of a command, as man(7) text", NULL},
    {"completion", 0, 0, G_OPTION_ARG_STRING, &completion, "the completion script for a shell: bash", "SHELL"},
    {0},
};

const struct cli_command cli_help = {
    .name = "help",
    .arguments = "[COMMAND]",
    .summary = "list the commands, or explain one",
    .options = options,
    .max_arguments = 3,
    .run = run_help,
};
