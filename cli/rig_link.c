/* What the commands that talk to a rig's board share. */
#include "cli/rig_link.h"

#include <signal.h>
#include <stdio.h>
#include <time.h>
#include <unistd.h>

#define OPEN_SECONDS 5.0

int cli_rig_open(const char *address, struct lumi_rig_link **link, struct lumi_error *error)
{
    return lumi_rig_bench_open(address, OPEN_SECONDS, link, error);
}

static volatile sig_atomic_t interrupts;

static void on_interrupt(int number)
{
    (void)number;
    interrupts++;
}

void cli_rig_catch_interrupts(void)
{
    struct sigaction action = {.sa_handler = on_interrupt};

    sigemptyset(&action.sa_mask);
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGTERM, &action, NULL);
    signal(SIGPIPE, SIG_IGN); /* who reads our output may go; the rig goes on */
}

int cli_rig_interrupts(void *context)
{
    (void)context;
    return (int)interrupts;
}

void cli_rig_progress(void *context, const lumi_wire_Status *status)
{
    const char *name = lumi_wire_state_name(status->state);

    (void)context;
    if (!isatty(STDERR_FILENO))
        return;
    cli_progress(name ? name : "?", (long)status->step, 0);
}

int64_t cli_rig_utc_offset_ns(void)
{
    struct timespec utc, monotonic;

    clock_gettime(CLOCK_MONOTONIC, &monotonic);
    clock_gettime(CLOCK_REALTIME, &utc);
    return (int64_t)(utc.tv_sec - monotonic.tv_sec) * 1000000000 + (utc.tv_nsec - monotonic.tv_nsec);
}
