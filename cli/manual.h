/* The manual and the shell's completion, made from the tables of all sub-commands. */
#ifndef LUMI_CLI_MANUAL_H
#define LUMI_CLI_MANUAL_H

#include "cli/command.h"

/* man(7) text: of one command (lumi-NAME.1), or with NULL of the whole program (lumi.1). (transfer full) */
char *cli_manual_page(const struct cli_command *command);

/* A script for bash: completes commands and their options, files elsewhere. (transfer full) */
char *cli_manual_completion_bash(void);

#endif
