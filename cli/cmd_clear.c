/* lumi clear: throw away what stages have made. */
#include "cli/command.h"
#include "cli/process_options.h"
#include "cli/process_run.h"
#include "pipeline/engine/clear_work.h"
#include "pipeline/graph/graph.h"

#include <stdio.h>
#include <unistd.h>

static gboolean yes;
static const GOptionEntry options[] = {
    {"work", 'w', 0, G_OPTION_ARG_FILENAME, &process_options.work, "where the stages keep their files (CAPTURE.work)",
     "DIR"},
    {"yes", 'y', 0, G_OPTION_ARG_NONE, &yes, "do not ask", NULL},
    {0},
};

static bool ask(const char *work, int folders, gint64 bytes)
{
    g_autofree char *size = g_format_size((guint64)bytes);
    char answer[16];

    printf("%s: outputs of %d stages, %s, are thrown away. Go on? [y/N] ", work, folders, size);
    fflush(stdout);
    return fgets(answer, sizeof answer, stdin) && (answer[0] == 'y' || answer[0] == 'Y');
}

static int run_clear(int argc, char **argv, struct lumi_error *error)
{
    g_autofree char *work = process_work(argv[0]);
    int count = 0, folders;
    int64_t bytes;

    (void)argc;
    while (lumi_stages[count])
        count++;
    g_autofree bool *chosen = g_new0(bool, (gsize)count + 1);
    LUMI_TRY(lumi_clear_choose((const char *const *)argv + 1, chosen, error));
    lumi_clear_measure(work, chosen, &folders, &bytes);
    if (!yes && !isatty(STDIN_FILENO))
        return lumi_fail(error, LUMI_ERR_ARG, "%s: nobody to ask; --yes throws it away", work);
    if (!yes && !ask(work, folders, bytes))
        return LUMI_OK;
    LUMI_TRY(lumi_clear_work(work, chosen, error));
    g_autofree char *size = g_format_size((guint64)bytes);
    printf("%s: outputs of %d stages, %s, thrown away\n", work, folders, size);
    return LUMI_OK;
}

const struct cli_command cli_clear = {
    .name = "clear",
    .arguments = "CAPTURE [STAGE...]",
    .summary = "throw away what stages have made of a capture",
    .description =
        "Of the stages named and of all that rest on them; without names, the whole work folder. The capture "
        "itself and the finished field stay. Asks first.",
    .options = options,
    .min_arguments = 1,
    .max_arguments = -1,
    .run = run_clear,
};
