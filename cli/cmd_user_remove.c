/* lumi user remove: somebody no longer uses the rig. */
#include "cli/access_files.h"

#include <stdio.h>

static const GOptionEntry options[] = {CLI_USERS_OPTION, {0}};

static int run(int argc, char **argv, struct lumi_error *error)
{
    g_autofree struct lumi_users *users = g_new0(struct lumi_users, 1);
    g_autofree char *path = NULL;

    (void)argc;
    LUMI_TRY(cli_users_load(users, &path, error));
    if (lumi_users_remove(users, argv[0], error) != LUMI_OK)
        return lumi_fail(error, LUMI_ERR_ARG, "%s: there is no such user (lumi user list)", argv[0]);
    LUMI_TRY(cli_users_save(path, users, error));
    if (users->count)
        printf("%s is no user any more\n", argv[0]);
    else
        printf("%s was the last user: lumid answers this computer alone now, without login\n", argv[0]);
    return LUMI_OK;
}

const struct cli_command cli_user_remove = {
    .name = "user remove",
    .arguments = "NAME",
    .summary = "take somebody's access to the rig away",
    .description = "Sessions of that user end at once, and those of phones that the user has let in. Without any user "
                   "lumid answers its own computer alone.",
    .options = options,
    .min_arguments = 1,
    .max_arguments = 1,
    .run = run,
};
