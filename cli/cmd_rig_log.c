/* lumi rig log: what the board has told and tells. */
#include "cli/rig_link.h"
#include "daemon/rig/event_text.h"
#include "proto/base/file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

static char *address, *out;
static gboolean follow, json;

static const GOptionEntry options[] = {
    CLI_RIG_LINK_OPTION(address),
    {"follow", 'f', 0, G_OPTION_ARG_NONE, &follow, "goes on with what comes, until Ctrl-C", NULL},
    {"output", 'o', 0, G_OPTION_ARG_FILENAME, &out, "appends JSON lines to a file", "FILE"},
    {"json", 0, 0, G_OPTION_ARG_NONE, &json, "JSON lines on standard output", NULL},
    {0},
};

static uint64_t to_host(void *context, uint64_t board_ns)
{
    return lumi_rig_link_to_host(context, board_ns);
}

static int put(struct lumi_rig_link *link, const struct lumi_rig_notice *notice, uint32_t boot, int file,
               struct lumi_error *error)
{
    struct lumi_rig_json_clock clock = {boot, cli_rig_utc_offset_ns(), to_host, link};
    char text[LUMI_RIG_EVENT_TEXT_MAX + 1];

    if (file >= 0 || json) {
        lumi_rig_notice_json(notice, &clock, text, LUMI_RIG_EVENT_TEXT_MAX);
        strcat(text, "\n");
        if (file >= 0 && (lumi_write_all(file, text, strlen(text)) || (fdatasync(file) && errno != EINVAL)))
            return lumi_fail_errno(error, out, "write");
        if (json)
            fputs(text, stdout);
    }
    if (file < 0 && !json) {
        lumi_rig_notice_text(notice, text, sizeof text);
        puts(text);
    }
    if (fflush(stdout))
        return lumi_fail(error, LUMI_ERR_IO, "standard output: closed");
    return LUMI_OK;
}

static int watch(struct lumi_rig_link *link, int file, struct lumi_error *error)
{
    struct lumi_rig_link_snapshot snapshot;
    struct lumi_rig_notice notice;
    lumi_wire_Status status;
    uint32_t next = 0;
    int quiet = 0;

    LUMI_TRY(lumi_rig_bench_status(link, &status, error));
    lumi_rig_link_take_charge(link, true);
    while (!cli_rig_interrupts(NULL) && (follow || ((int32_t)(next - status.events_next) < 0 && quiet < 20))) {
        bool any = lumi_rig_link_notice(link, 0.1, &notice);
        quiet = any ? 0 : quiet + 1;
        if (!any)
            continue;
        lumi_rig_link_snapshot(link, &snapshot);
        if (notice.kind == LUMI_RIG_NOTICE_EVENT)
            next = notice.event.number + 1;
        LUMI_TRY(put(link, &notice, snapshot.welcome.boot, file, error));
        if (notice.kind == LUMI_RIG_NOTICE_EVENT)
            lumi_rig_link_stored(link, &notice.event);
    }
    return LUMI_OK;
}

static int run(int argc, char **argv, struct lumi_error *error)
{
    struct lumi_rig_link *link;
    int code, file = -1;

    (void)argc;
    (void)argv;
    LUMI_TRY(cli_rig_open(address, &link, error));
    cli_rig_catch_interrupts();
    if (out) {
        file = open(out, O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC, 0666);
        if (file < 0) {
            code = lumi_fail_errno(error, out, "open");
            goto done;
        }
    }
    code = watch(link, file, error);
done:
    if (file >= 0 && close(file) && code == LUMI_OK)
        code = lumi_fail_errno(error, out, "close");
    lumi_rig_link_close(link);
    return code;
}

const struct cli_command cli_rig_log = {
    .name = "rig log",
    .arguments = "",
    .summary = "print what the board has told and tells",
    .description = "The board keeps its last events until a host has taken them; this takes them. After a sweep whose "
                   "host went away, run --resume comes first: it writes them into the sweep's log.",
    .options = options,
    .run = run,
};
