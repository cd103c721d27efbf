/* The manual and the shell's completion, made from the tables of all sub-commands. */
#include "cli/manual.h"

#include <string.h>

static const char about[] = "panoramic light fields: from a folder of photographs to any view of the place";

/* Text inside a roff line: a backslash and a hyphen are themselves. */
static void put_escaped(GString *page, const char *text)
{
    for (; *text; text++) {
        if (*text == '\\')
            g_string_append(page, "\\e");
        else if (*text == '-')
            g_string_append(page, "\\-");
        else
            g_string_append_c(page, *text);
    }
}

/* A line of its own: one that begins with a dot or an apostrophe would be a request. */
static void put_line(GString *page, const char *text)
{
    if (*text == '.' || *text == '\'')
        g_string_append(page, "\\&");
    put_escaped(page, text);
    g_string_append_c(page, '\n');
}

/* Paragraphs are separated by empty lines; lines that begin with a space are shown as they stand. */
static void put_paragraphs(GString *page, const char *text)
{
    g_auto(GStrv) lines = g_strsplit(text, "\n", -1);
    bool plain = false;

    for (int i = 0; lines[i]; i++) {
        bool verbatim = lines[i][0] == ' ';
        if (verbatim != plain)
            g_string_append(page, verbatim ? ".nf\n" : ".fi\n");
        plain = verbatim;
        if (lines[i][0])
            put_line(page, lines[i]);
        else if (lines[i + 1])
            g_string_append(page, ".PP\n");
    }
    if (plain)
        g_string_append(page, ".fi\n");
}

static bool shown(const GOptionEntry *option)
{
    return option->long_name[0] && !(option->flags & G_OPTION_FLAG_HIDDEN);
}

static bool takes_value(const GOptionEntry *option)
{
    return option->arg != G_OPTION_ARG_NONE &&
           !(option->arg == G_OPTION_ARG_CALLBACK && (option->flags & G_OPTION_FLAG_NO_ARG));
}

static void put_options(GString *page, const GOptionEntry *options)
{
    for (; options && options->long_name; options++) {
        if (!shown(options))
            continue;
        g_string_append(page, ".TP\n");
        if (options->short_name)
            g_string_append_printf(page, "\\fB\\-%c\\fR, ", options->short_name);
        g_string_append(page, "\\fB\\-\\-");
        put_escaped(page, options->long_name);
        g_string_append(page, "\\fR");
        if (takes_value(options)) {
            g_string_append(page, "=\\fI");
            put_escaped(page, options->arg_description ? options->arg_description : "VALUE");
            g_string_append(page, "\\fR");
        }
        g_string_append_c(page, '\n');
        put_line(page, options->description ? options->description : "");
    }
}

static void put_synopsis(GString *page, const struct cli_command *command)
{
    g_string_append_printf(page, ".B lumi %s\n", command->name);
    if (command->options)
        g_string_append(page, "[options]\n");
    if (command->arguments)
        put_line(page, command->arguments);
}

static void put_exit_status(GString *page)
{
    g_string_append(page,
                    ".SH EXIT STATUS\n0 done, 1 the work failed, 2 the command line was wrong, 3 the input was bad.\n");
}

static void put_command(GString *page, const struct cli_command *command)
{
    g_autofree char *dashed = g_strdelimit(g_strdup(command->name), " ", '-');
    g_autofree char *upper = g_ascii_strup(dashed, -1);

    g_string_append_printf(page, ".TH LUMI\\-%s 1 \"\" \"lumi " LUMI_VERSION "\" \"Lumisphere\"\n", upper);
    g_string_append_printf(page, ".SH NAME\nlumi\\-%s \\- ", dashed);
    put_escaped(page, command->summary);
    g_string_append(page, "\n.SH SYNOPSIS\n");
    put_synopsis(page, command);
    if (command->description) {
        g_string_append(page, ".SH DESCRIPTION\n");
        put_paragraphs(page, command->description);
    }
    if (command->options) {
        g_string_append(page, ".SH OPTIONS\n");
        put_options(page, command->options);
    }
    put_exit_status(page);
    g_string_append(page, ".SH SEE ALSO\n.BR lumi (1)\n");
}

static void put_program(GString *page)
{
    g_string_append(page, ".TH LUMI 1 \"\" \"lumi " LUMI_VERSION "\" \"Lumisphere\"\n.SH NAME\nlumi \\- ");
    put_escaped(page, about);
    g_string_append(page, "\n.SH SYNOPSIS\n.B lumi\n.I COMMAND\n[options] [arguments]\n.SH COMMANDS\n");
    for (int i = 0; cli_commands[i]; i++) {
        g_string_append_printf(page, ".SS %s\n", cli_commands[i]->name);
        put_synopsis(page, cli_commands[i]);
        g_string_append(page, ".PP\n");
        put_line(page, cli_commands[i]->summary);
        if (cli_commands[i]->description) {
            g_string_append(page, ".PP\n");
            put_paragraphs(page, cli_commands[i]->description);
        }
        put_options(page, cli_commands[i]->options);
    }
    put_exit_status(page);
}

char *cli_manual_page(const struct cli_command *command)
{
    GString *page = g_string_new(NULL);

    if (command)
        put_command(page, command);
    else
        put_program(page);
    return g_string_free(page, FALSE);
}

/* The options of one command, as bash's case branch. */
static void put_case(GString *script, const struct cli_command *command)
{
    g_string_append_printf(script, "    '%s '*) options='--help", command->name);
    for (const GOptionEntry *option = command->options; option && option->long_name; option++) {
        if (!shown(option))
            continue;
        if (option->short_name)
            g_string_append_printf(script, " -%c", option->short_name);
        g_string_append_printf(script, " --%s", option->long_name);
    }
    g_string_append(script, "' ;;\n");
}

/* The distinct words that may follow `before` ("" or words that each end with a blank) in the commands' names. */
static char *words_after(const char *before)
{
    GString *words = g_string_new(NULL);
    g_autofree char *last = NULL;

    for (int i = 0; cli_commands[i]; i++) {
        const char *name = cli_commands[i]->name;
        if (!g_str_has_prefix(name, before))
            continue;
        g_autofree char *word = g_strndup(name + strlen(before), strcspn(name + strlen(before), " "));
        if (last && !strcmp(last, word))
            continue;
        g_string_append_printf(words, "%s%s", words->len ? " " : "", word);
        g_free(last);
        last = g_steal_pointer(&word);
    }
    return g_string_free(words, FALSE);
}

/* What follows each beginning of `words` words of a command's name, as branches of a case. */
static void put_following(GString *script, int words)
{
    g_autofree char *last = NULL;

    for (int i = 0; cli_commands[i]; i++) {
        const char *end = cli_commands[i]->name;
        for (int w = 0; w < words && end; w++) {
            end = strchr(end, ' ');
            end = end ? end + 1 : NULL;
        }
        if (!end)
            continue;
        g_autofree char *before = g_strndup(cli_commands[i]->name, (gsize)(end - cli_commands[i]->name));
        if (last && !strcmp(last, before))
            continue;
        g_autofree char *following = words_after(before);
        g_string_append_printf(script, "        '%s') COMPREPLY=($(compgen -W '%s' -- \"$word\")); return ;;\n", before,
                               following);
        g_free(last);
        last = g_steal_pointer(&before);
    }
}

char *cli_manual_completion_bash(void)
{
    GString *script = g_string_new("# bash completion for lumi, made by 'lumi help --completion bash'\n"
                                   "_lumi()\n{\n"
                                   "    local word=${COMP_WORDS[COMP_CWORD]} at=1 options=\n"
                                   "    COMPREPLY=()\n"
                                   "    [ \"${COMP_WORDS[1]}\" = help ] && [ \"$COMP_CWORD\" -gt 1 ] && at=2\n"
                                   "    if [ \"$COMP_CWORD\" -eq \"$at\" ] && [[ $word != -* ]]; then\n");
    g_autofree char *names = words_after("");

    g_string_append_printf(script, "        COMPREPLY=($(compgen -W '%s' -- \"$word\"))\n        return\n    fi\n",
                           names);
    for (int words = 1; words <= 2; words++) {
        g_string_append_printf(script,
                               "    if [ \"$COMP_CWORD\" -eq $((at + %d)) ]; then\n"
                               "        case \"${COMP_WORDS[*]:at:%d} \" in\n",
                               words, words);
        put_following(script, words);
        g_string_append(script, "        esac\n    fi\n");
    }
    g_string_append(script, "    [[ $word == -* ]] || return\n"
                            "    case \"${COMP_WORDS[*]:1} \" in\n");
    for (int i = 0; cli_commands[i]; i++)
        put_case(script, cli_commands[i]);
    g_string_append(script, "    esac\n"
                            "    COMPREPLY=($(compgen -W \"$options\" -- \"$word\"))\n"
                            "}\n"
                            "complete -o default -F _lumi lumi\n");
    return g_string_free(script, FALSE);
}
