/* Where this computer's lumid keeps its users, and what is asked of a person for them. */
#ifndef LUMI_CLI_ACCESS_FILES_H
#define LUMI_CLI_ACCESS_FILES_H

#include "cli/command.h"
#include "daemon/access/users.h"

#define CLI_SYSTEM_CONFIG "/etc/lumisphere/lumid.conf"

/* (transfer full) A file of the folder [http] access of this computer's lumid. */
char *cli_access_path(const char *file);

extern char *cli_users_file;
#define CLI_USERS_OPTION                                                                                               \
    {                                                                                                                  \
        "users", 0, 0, G_OPTION_ARG_FILENAME, &cli_users_file,                                                         \
            "the file of users (users in the folder [http] access of " CLI_SYSTEM_CONFIG ")", "FILE"                   \
    }
/* The users there are, and (transfer full) their file. */
int cli_users_load(struct lumi_users *users, char **path, struct lumi_error *error);
/* Makes the folder where there is none. */
int cli_users_save(const char *path, const struct lumi_users *users, struct lumi_error *error);
/* From the first line of `file` ("-": standard input), or from the terminal, twice and without echo. Checks it, and
 * makes its hash. */
int cli_ask_password(const char *file, const char *name, char hash[LUMI_PASSWORD_HASH], struct lumi_error *error);

#endif
