/* lumi user password: another password. */
#include "cli/access_files.h"

#include <stdio.h>
#include <string.h>

static char *password_file;

static const GOptionEntry options[] = {
    {"password-file", 0, 0, G_OPTION_ARG_FILENAME, &password_file,
     "take the password from the first line of FILE; -: from standard input", "FILE"},
    CLI_USERS_OPTION,
    {0},
};

static int run(int argc, char **argv, struct lumi_error *error)
{
    g_autofree struct lumi_users *users = g_new0(struct lumi_users, 1);
    g_autofree char *path = NULL;

    (void)argc;
    LUMI_TRY(cli_users_load(users, &path, error));
    struct lumi_user *user = (struct lumi_user *)lumi_users_find(users, argv[0]);
    if (!user)
        return lumi_fail(error, LUMI_ERR_ARG, "%s: there is no such user (lumi user list)", argv[0]);
    LUMI_TRY(cli_ask_password(password_file, user->name, user->hash, error));
    LUMI_TRY(cli_users_save(path, users, error));
    printf("%s has another password; whoever was logged in with the last one is logged out\n", user->name);
    return LUMI_OK;
}

const struct cli_command cli_user_password = {
    .name = "user password",
    .arguments = "NAME",
    .summary = "give a user another password",
    .description = "Sessions of that user end, and those of phones that the user has let in.",
    .options = options,
    .min_arguments = 1,
    .max_arguments = 1,
    .run = run,
};
