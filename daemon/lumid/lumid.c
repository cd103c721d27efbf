/* lumid: the rig's daemon. */
#include "daemon/access/users.h"
#include "daemon/lumid/config.h"
#include "daemon/lumid/service.h"
#include "proto/base/memory.h"

#include <glib.h>
#include <stdio.h>

#define DEFAULT_CONFIG "/etc/lumisphere/lumid.conf"

static void problem(void *context, const char *text)
{
    (void)context;
    fprintf(stderr, "lumid: %s\n", text);
}

/* A file of users that cannot be read keeps lumid from starting: nobody is let in by mistake. */
static int check_users(const struct lumi_config *config)
{
    g_autofree struct lumi_users *users = g_new0(struct lumi_users, 1);
    g_autofree char *path = g_build_filename(config->access, "users", NULL);
    struct lumi_error error;
    int code = config->access[0] ? lumi_users_load(path, users, &error) : LUMI_OK;

    if (code != LUMI_OK)
        problem(NULL, error.text);
    return code;
}

static int check(const char *path)
{
    struct lumi_config *config = g_new(struct lumi_config, 1);
    struct lumi_error error = {0};
    int problems = 0;
    int code = lumi_config_load(path, config, problem, &problems, &error);

    if (code == LUMI_OK)
        code = lumi_config_check_host(config, path, problem, NULL, &error);
    else if (code != LUMI_ERR_FORMAT)
        fprintf(stderr, "lumid: %s\n", error.text);
    if (code == LUMI_OK)
        code = check_users(config);
    if (code == LUMI_OK)
        printf("%s: good: %d cameras, captures in %s\n", path, config->engine.camera_count, config->engine.folder);
    g_free(config);
    return code == LUMI_OK ? 0 : 3;
}

static int print(char *text)
{
    if (text)
        fputs(text, stdout);
    lumi_free(text);
    return text ? 0 : 1;
}

static int run(const char *path, const char *ingest)
{
    struct lumi_config *config = g_new(struct lumi_config, 1);
    struct lumi_service_options options = {.config = config, .ingest = ingest};
    struct lumi_error error = {0};
    int code = lumi_config_load(path, config, problem, NULL, &error);

    if (code != LUMI_OK && code != LUMI_ERR_FORMAT)
        fprintf(stderr, "lumid: %s\n", error.text);
    if (code == LUMI_OK) {
        code = lumi_service_run(&options, &error);
        if (code != LUMI_OK)
            lumi_service_log(3, "%s", error.text);
    }
    g_free(config);
    /* Nothing on the command line is to blame for what the configuration says. */
    return code == LUMI_ERR_ARG ? 3 : lumi_exit_status(code);
}

int main(int argc, char **argv)
{
    char *path = NULL, *ingest = NULL;
    gboolean checking = FALSE, printing = FALSE, manual = FALSE, version = FALSE;
    const GOptionEntry options[] = {
        {"config", 'c', 0, G_OPTION_ARG_FILENAME, &path, "the configuration (" DEFAULT_CONFIG ")", "FILE"},
        {"ingest", 0, 0, G_OPTION_ARG_FILENAME, &ingest, "take in what arrives in FOLDER, without a rig", "FOLDER"},
        {"check", 0, 0, G_OPTION_ARG_NONE, &checking, "check the configuration and what it names, and end", NULL},
        {"print-config", 0, 0, G_OPTION_ARG_NONE, &printing, "print a configuration with every key, commented", NULL},
        {"print-manual", 0, 0, G_OPTION_ARG_NONE, &manual, "print the manual page lumid.conf(5)", NULL},
        {"version", 0, 0, G_OPTION_ARG_NONE, &version, "print the version", NULL},
        {NULL, 0, 0, 0, NULL, NULL, NULL}};
    GOptionContext *context = g_option_context_new("- the rig's daemon");
    GError *error = NULL;
    int status = 2;

    g_option_context_add_main_entries(context, options, NULL);
    if (!g_option_context_parse(context, &argc, &argv, &error)) {
        fprintf(stderr, "lumid: %s\n", error->message);
        g_error_free(error);
    } else if (argc > 1)
        fprintf(stderr, "lumid: %s: no such argument\n", argv[1]);
    else if (version)
        status = printf("lumid %s\n", LUMI_VERSION) > 0 ? 0 : 1;
    else if (printing || manual)
        status = print(printing ? lumi_config_print() : lumi_config_manual());
    else if (checking)
        status = check(path ? path : DEFAULT_CONFIG);
    else if (ingest && *ingest != '/')
        fprintf(stderr, "lumid: --ingest %s: is no path from the root\n", ingest);
    else
        status = run(path ? path : DEFAULT_CONFIG, ingest);
    g_option_context_free(context);
    g_free(path);
    g_free(ingest);
    return status;
}
