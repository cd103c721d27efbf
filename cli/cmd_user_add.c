/* lumi user add: somebody who may use the rig. */
#include "cli/access_files.h"

#include <stdio.h>
#include <string.h>

static char *role, *password_file;

static const GOptionEntry options[] = {
    {"role", 0, 0, G_OPTION_ARG_STRING, &role, "watch or operate (operate)", "ROLE"},
    {"password-file", 0, 0, G_OPTION_ARG_FILENAME, &password_file,
     "take the password from the first line of FILE; -: from standard input", "FILE"},
    CLI_USERS_OPTION,
    {0},
};

static int run(int argc, char **argv, struct lumi_error *error)
{
    g_autofree struct lumi_users *users = g_new0(struct lumi_users, 1);
    g_autofree char *path = NULL;
    struct lumi_user user = {.role = lumi_role_by_name(role ? role : "operate")};

    (void)argc;
    LUMI_TRY(lumi_user_check_name(argv[0], error));
    g_strlcpy(user.name, argv[0], sizeof user.name);
    if (user.role == LUMI_ROLE_NONE)
        return lumi_fail(error, LUMI_ERR_ARG, "--role %s: watch or operate wanted", role);
    LUMI_TRY(cli_users_load(users, &path, error));
    if (lumi_users_find(users, user.name))
        return lumi_fail(error, LUMI_ERR_ARG, "%s: there is a user of that name (lumi user password)", user.name);
    LUMI_TRY(cli_ask_password(password_file, user.name, user.hash, error));
    LUMI_TRY(lumi_users_add(users, &user, error));
    LUMI_TRY(cli_users_save(path, users, error));
    if (users->count == 1)
        printf("%s is the first user: from now on everybody logs in, and lumid answers other computers over TLS\n",
               user.name);
    else
        printf("%s may %s\n", user.name, lumi_role_name(user.role));
    return LUMI_OK;
}

const struct cli_command cli_user_add = {
    .name = "user add",
    .arguments = "NAME",
    .summary = "let somebody use the rig from a browser",
    .description =
        "Asks for a password, twice and without showing it. With the first user lumid begins to answer other computers "
        "and phones, over TLS, and everybody has to log in; it need not be started again. Who has the role watch sees "
        "everything, can stop the rig in an emergency, and nothing else. Be root, or lumid's user.",
    .options = options,
    .min_arguments = 1,
    .max_arguments = 1,
    .run = run,
};
