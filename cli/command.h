/* A sub-command of lumi: one file cmd_NAME.c each, which defines `const struct cli_command cli_NAME`. The build
 * collects them (cmd_sim_shoot.c is `lumi sim shoot`). Help, man page and shell completion are made from these tables.
 */
#ifndef LUMI_CLI_COMMAND_H
#define LUMI_CLI_COMMAND_H

#include "proto/base/result.h"

#include <glib.h>
#include <stdbool.h>

struct cli_command {
    const char *name;                 /* "import", "sim shoot" */
    const char *arguments;            /* "SOURCE... -o CAPTURE": what stands after the name, without options */
    const char *summary;              /* one line, no full stop */
    const char *description;          /* paragraphs for help and man page */
    const GOptionEntry *options;      /* ends with an all-zero entry; values go to file-scope variables; may be NULL */
    int min_arguments, max_arguments; /* positional ones; max −1: any number */
    /* Options are parsed, argv[0 .. argc) are the positional arguments. Returns LUMI_OK or a code with `error` filled,
     * which main prints as one line and turns into the exit status. */
    int (*run)(int argc, char **argv, struct lumi_error *error);
};

extern const struct cli_command *const cli_commands[]; /* NULL-terminated, by name; made by the build */

/* LUMI_ERR_ARG: there is no such command. "sim" alone is none, but the beginning of some: those are named. */
int cli_no_command(const char *word, struct lumi_error *error);

/* Progress on a terminal, silent in a pipe: redraws one line on standard error. total ≤ 0: no percentage.
 * cli_progress_end clears the line. */
void cli_progress(const char *what, long done, long total);
void cli_progress_line(const char *line); /* the same with words of one's own */
void cli_progress_end(void);

/* "WxH", "A:B" and the like: reads `count` numbers separated by `separator`; LUMI_ERR_ARG names the option. */
int cli_parse_ints(const char *option, const char *text, char separator, int count, int *values,
                   struct lumi_error *error);
int cli_parse_doubles(const char *option, const char *text, char separator, int count, double *values,
                      struct lumi_error *error);
/* --threads: 0 (all) or a number. */
int cli_check_threads(int threads, struct lumi_error *error);
/* Index of `text` among `names` (NULL-terminated); LUMI_ERR_ARG lists them. */
int cli_parse_choice(const char *option, const char *text, const char *const *names, int *choice,
                     struct lumi_error *error);

#endif
