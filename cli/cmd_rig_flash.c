/* lumi rig flash: writes a firmware to the board. */
#include "cli/rig_link.h"
#include "daemon/rig/flash.h"

#include <stdio.h>

static char *address, *program;
static gboolean in_loader, older;

static const GOptionEntry options[] = {
    CLI_RIG_LINK_OPTION(address),
    {"in-loader", 0, 0, G_OPTION_ARG_NONE, &in_loader, "the board is in its loader already (BOOT0 jumper)", NULL},
    {"older", 0, 0, G_OPTION_ARG_NONE, &older, "though its version is older than the board's", NULL},
    {"dfu-util", 0, 0, G_OPTION_ARG_FILENAME, &program, "the program that writes (dfu-util)", "PROGRAM"},
    {0},
};

static void progress(void *context, const char *what)
{
    (void)context;
    cli_progress(what, 0, 0);
}

static bool cancelled(void *context)
{
    return cli_rig_interrupts(context) > 0;
}

static int run(int argc, char **argv, struct lumi_error *error)
{
    struct lumi_rig_flash flash;
    int code;

    (void)argc;
    lumi_rig_flash_init(&flash);
    flash.path = argv[0];
    flash.progress = progress;
    flash.cancelled = cancelled;
    flash.older = older;
    if (program)
        flash.program = program;
    if (!in_loader)
        LUMI_TRY(cli_rig_open(address, &flash.link, error));
    cli_rig_catch_interrupts();
    code = lumi_rig_flash(&flash, error);
    lumi_rig_link_close(flash.link);
    LUMI_TRY(code);
    cli_progress_end();
    printf("%s: firmware %s for %s is on the board\n", argv[0], flash.image.firmware, flash.image.board);
    return LUMI_OK;
}

const struct cli_command cli_rig_flash = {
    .name = "rig flash",
    .arguments = "FILE",
    .summary = "write a firmware to the board",
    .description =
        "The image (lumirig.bin) is checked: that it is whole, a rig's firmware, and for this board. Then the board "
        "goes to the loader in its chip, dfu-util writes the image over USB, and the board comes back and must say the "
        "version that was written. Refused while anything moves, and where the board's is newer (--older). The profile "
        "stays.\n\nA board whose firmware does not "
        "answer is put in its loader by its BOOT0 jumper, and then --in-loader is said.",
    .options = options,
    .min_arguments = 1,
    .max_arguments = 1,
    .run = run,
};
