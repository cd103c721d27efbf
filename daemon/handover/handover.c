/* Captures that are handed over, one after another: given, running, ended, all of it in the journal first. */
#define _DEFAULT_SOURCE /* syscall */
#include "daemon/handover/handover.h"

#include "daemon/handover/handover_command.h"
#include "daemon/handover/handover_journal.h"

#include <errno.h>
#include <fcntl.h>
#include <glib.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#define LINE_MAX_BYTES 4096
#define FIRST_WORDS 2 /* of a journal's line: what, the capture */

struct process {
    struct lumi_handover *handover;
    struct lumi_process_status status;
    int attempts;
    GPid pid;
    int output;
    GIOChannel *channel;
    guint output_watch, child_watch;
    GString *line;
    long orphan; /* from the journal: the program that was running when the last one of us ended */
    unsigned long long orphan_start;
};

struct lumi_handover {
    struct lumi_handover_options options;
    char *command;
    struct journal *journal;
    GPtrArray *processes; /* as they were given */
    guint soon;           /* source that starts what waits */
};

void lumi_handover_options_init(struct lumi_handover_options *options)
{
    memset(options, 0, sizeof *options);
    options->parallel = 1;
}

static struct process *find(const struct lumi_handover *handover, const char *capture)
{
    for (guint i = 0; i < handover->processes->len; i++) {
        struct process *process = g_ptr_array_index(handover->processes, i);
        if (!strcmp(process->status.capture, capture))
            return process;
    }
    return NULL;
}

static struct process *add(struct lumi_handover *handover, const char *capture)
{
    struct process *process = g_new0(struct process, 1);

    process->handover = handover;
    process->output = -1;
    process->status.progress = -1;
    g_strlcpy(process->status.capture, capture, sizeof process->status.capture);
    g_ptr_array_add(handover->processes, process);
    return process;
}

/* Newest last. */
static void wait_again(struct lumi_handover *handover, struct process *process)
{
    g_ptr_array_remove(handover->processes, process);
    g_ptr_array_add(handover->processes, process);
    process->status.state = LUMI_PROCESS_WAITING;
    process->status.progress = -1;
    process->status.exit_status = 0;
    process->status.text[0] = process->status.stage[0] = '\0';
    process->attempts = 0;
}

static void tell(const struct process *process)
{
    const struct lumi_handover_options *options = &process->handover->options;

    if (options->changed)
        options->changed(options->context, &process->status);
}

/* ---- The journal ---- */

/* When a process began, in clock ticks since the machine did: with its number it is like no other. 0: there is none.
 * proc(5), /proc/pid/stat, field 22. */
static unsigned long long start_of(long pid)
{
    unsigned long long start = 0;
    char path[64], text[1024];

    snprintf(path, sizeof path, "/proc/%ld/stat", pid);
    const int fd = open(path, O_RDONLY | O_CLOEXEC);
    if (fd < 0)
        return 0;
    const ssize_t size = read(fd, text, sizeof text - 1);
    close(fd);
    if (size <= 0)
        return 0;
    text[size] = '\0';
    char *at = strrchr(text, ')'); /* field 2 may hold anything */
    for (int field = 2; at && field < 22; field++)
        at = strchr(at + 1, ' ');
    if (at)
        start = strtoull(at + 1, NULL, 10);
    return start;
}

/* A program that outlived us would work on the capture beside the one that is started now. */
static void end_orphan(long pid, unsigned long long start)
{
    if (pid <= 1 || !start || start_of(pid) != start)
        return;
    kill((pid_t)-pid, SIGKILL);
    for (int i = 0; i < 200 && start_of(pid) == start; i++)
        nanosleep(&(struct timespec){0, 10000000}, NULL);
}

static int remember(struct journal *journal, const char *what, const struct process *process, const char *a,
                    const char *b, struct lumi_error *error)
{
    const char *const fields[] = {what, process->status.capture, a, b};

    return journal_write(journal, fields, b ? 4 : a ? 3 : FIRST_WORDS, error);
}

static int read_line(void *context, const struct journal_line *line, struct lumi_error *error)
{
    struct lumi_handover *handover = context;

    if (line->count < FIRST_WORDS || strlen(line->fields[1]) >= sizeof((struct process *)0)->status.capture)
        return lumi_fail(error, LUMI_ERR_FORMAT, "hand-over journal: '%s' without a capture", line->fields[0]);
    const char *what = line->fields[0];
    struct process *process = find(handover, line->fields[1]);
    if (!process)
        process = add(handover, line->fields[1]);
    if (!strcmp(what, "given")) {
        wait_again(handover, process);
    } else if (!strcmp(what, "run") && line->count == 4) {
        process->status.state = LUMI_PROCESS_WAITING;
        process->orphan = strtol(line->fields[2], NULL, 10);
        process->orphan_start = strtoull(line->fields[3], NULL, 10);
    } else if (!strcmp(what, "done") || !strcmp(what, "failed")) {
        process->status.state = *what == 'd' ? LUMI_PROCESS_DONE : LUMI_PROCESS_FAILED;
        process->status.exit_status = line->count > 2 ? atoi(line->fields[2]) : 0;
        process->orphan = 0;
        g_strlcpy(process->status.text, line->count > 3 ? line->fields[3] : "", sizeof process->status.text);
    } else {
        return lumi_fail(error, LUMI_ERR_FORMAT, "hand-over journal: '%s' is unknown", what);
    }
    return LUMI_OK;
}

/* ---- Running ---- */

static void start_soon(struct lumi_handover *handover);

/* After fork: lowest priority for processor and disk, a group of its own, and no life without us. */
static void be_humble(gpointer context)
{
    (void)context;
    setpgid(0, 0);
    setpriority(PRIO_PROCESS, 0, 10);
    syscall(SYS_ioprio_set, 1, 0, 3 << 13); /* ioprio_set(2): this process, class idle */
    prctl(PR_SET_PDEATHSIG, SIGTERM);
}

static void stop_watching(struct process *process)
{
    if (process->output_watch)
        g_source_remove(process->output_watch);
    if (process->channel)
        g_io_channel_unref(process->channel);
    if (process->output >= 0)
        close(process->output);
    process->output_watch = 0;
    process->channel = NULL;
    process->output = -1;
}

static void take_line(struct process *process)
{
    const bool changed = handover_read_line(process->line->str, &process->status);

    g_string_truncate(process->line, 0);
    if (changed)
        tell(process);
}

/* How many bytes were there; 0: nothing more will come; −1: not now. */
static ssize_t take_output(struct process *process)
{
    char bytes[4096];
    const ssize_t got = read(process->output, bytes, sizeof bytes);

    if (got < 0)
        return errno == EAGAIN || errno == EINTR ? -1 : 0;
    for (ssize_t i = 0; i < got; i++) {
        if (bytes[i] == '\n' || bytes[i] == '\r')
            take_line(process);
        else if (process->line->len < LINE_MAX_BYTES && bytes[i])
            g_string_append_c(process->line, bytes[i]);
    }
    return got;
}

static gboolean on_output(GIOChannel *channel, GIOCondition condition, gpointer context)
{
    struct process *process = context;

    (void)channel;
    (void)condition;
    if (take_output(process) != 0)
        return G_SOURCE_CONTINUE;
    process->output_watch = 0;
    return G_SOURCE_REMOVE;
}

static void end(struct process *process, int exit_status)
{
    struct lumi_handover *handover = process->handover;
    struct lumi_error error = {0};
    char number[16];

    process->status.exit_status = exit_status;
    if (exit_status != 0 && process->attempts <= handover->options.retries) {
        process->status.state = LUMI_PROCESS_WAITING;
    } else {
        process->status.state = exit_status == 0 ? LUMI_PROCESS_DONE : LUMI_PROCESS_FAILED;
        if (exit_status == 0)
            process->status.progress = 1;
        snprintf(number, sizeof number, "%d", exit_status);
        char *text = g_strdelimit(g_strdup(process->status.text), "\t\r\n", ' ');
        for (char *c = text; *c; c++)
            if ((unsigned char)*c < 0x20 || *c == 0x7f)
                *c = ' ';
        if (remember(handover->journal, exit_status == 0 ? "done" : "failed", process, number, text, &error) != LUMI_OK)
            g_strlcpy(process->status.text, error.text, sizeof process->status.text);
        g_free(text);
    }
    tell(process);
    start_soon(handover);
}

static void on_end(GPid pid, gint status, gpointer context)
{
    struct process *process = context;

    process->child_watch = 0;
    process->pid = 0;
    g_spawn_close_pid(pid);
    for (int i = 0; i < 256 && take_output(process) > 0; i++)
        ; /* what is left; its own children may keep the pipe open */
    if (process->line->len)
        take_line(process);
    stop_watching(process);
    end(process, WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status));
}

static int spawn(struct process *process, char **words, struct lumi_error *error)
{
    g_autofree char *folder = g_path_get_dirname(process->status.capture);
    g_auto(GStrv) environment = g_environ_setenv(g_get_environ(), "LUMI_PROGRESS", "1", TRUE);
    g_autoptr(GError) problem = NULL;
    int ends[2];

    if (pipe(ends) < 0)
        return lumi_fail_errno(error, words[0], "pipe");
    fcntl(ends[0], F_SETFD, FD_CLOEXEC);
    fcntl(ends[1], F_SETFD, FD_CLOEXEC);
    fcntl(ends[0], F_SETFL, O_NONBLOCK);
    const gboolean began = g_spawn_async_with_fds(folder, words, environment,
                                                  (GSpawnFlags)(G_SPAWN_DO_NOT_REAP_CHILD | G_SPAWN_SEARCH_PATH),
                                                  be_humble, NULL, &process->pid, -1, ends[1], ends[1], &problem);
    close(ends[1]);
    if (!began) {
        close(ends[0]);
        return lumi_fail(error, LUMI_ERR_IO, "%s", problem->message);
    }
    process->output = ends[0];
    return LUMI_OK;
}

static void start(struct process *process)
{
    struct lumi_handover *handover = process->handover;
    g_auto(GStrv) words = NULL;
    struct lumi_error error = {0};
    char pid[24], began[32];

    process->attempts++;
    int code = handover_words(handover->command, process->status.capture, &words, &error);
    if (code == LUMI_OK)
        code = spawn(process, words, &error);
    if (code != LUMI_OK) {
        g_strlcpy(process->status.text, error.text, sizeof process->status.text);
        process->attempts = handover->options.retries + 1;
        end(process, 127);
        return;
    }
    snprintf(pid, sizeof pid, "%ld", (long)process->pid);
    snprintf(began, sizeof began, "%llu", start_of((long)process->pid));
    remember(handover->journal, "run", process, pid, began, NULL); /* if not: it would not be found as an orphan */
    process->status.state = LUMI_PROCESS_RUNNING;
    process->status.progress = -1;
    process->status.stage[0] = process->status.text[0] = '\0';
    if (!process->line)
        process->line = g_string_new(NULL);
    process->channel = g_io_channel_unix_new(process->output);
    process->output_watch = g_io_add_watch(process->channel, (GIOCondition)(G_IO_IN | G_IO_HUP), on_output, process);
    process->child_watch = g_child_watch_add(process->pid, on_end, process);
    tell(process);
}

static gboolean start_waiting(gpointer context)
{
    struct lumi_handover *handover = context;
    int running = 0;

    handover->soon = 0;
    for (guint i = 0; i < handover->processes->len; i++)
        running += ((struct process *)g_ptr_array_index(handover->processes, i))->status.state == LUMI_PROCESS_RUNNING;
    for (guint i = 0; i < handover->processes->len && running < MAX(handover->options.parallel, 1); i++) {
        struct process *process = g_ptr_array_index(handover->processes, i);
        if (process->status.state != LUMI_PROCESS_WAITING)
            continue;
        start(process);
        running += process->status.state == LUMI_PROCESS_RUNNING;
    }
    return G_SOURCE_REMOVE;
}

static void start_soon(struct lumi_handover *handover)
{
    if (!handover->soon && handover->command[0])
        handover->soon = g_idle_add(start_waiting, handover);
}

/* ---- Life ---- */

int lumi_handover_create(const struct lumi_handover_options *options, struct lumi_handover **handover,
                         struct lumi_error *error)
{
    struct lumi_handover *made = g_new0(struct lumi_handover, 1);
    g_auto(GStrv) words = NULL;
    int code = LUMI_OK;

    *handover = NULL;
    made->options = *options;
    made->command = g_strstrip(g_strdup(options->command ? options->command : ""));
    made->processes = g_ptr_array_new();
    if (made->command[0]) {
        LUMI_GOTO(code, fail, handover_words(made->command, "/", &words, error));
        LUMI_GOTO(code, fail, journal_open(options->journal, read_line, made, &made->journal, error));
    }
    for (guint i = 0; i < made->processes->len; i++) {
        struct process *process = g_ptr_array_index(made->processes, i);
        end_orphan(process->orphan, process->orphan_start);
        process->status.progress = process->status.state == LUMI_PROCESS_DONE ? 1 : -1;
    }
    start_soon(made);
    *handover = made;
    return LUMI_OK;
fail:
    lumi_handover_destroy(made);
    return code;
}

void lumi_handover_destroy(struct lumi_handover *handover)
{
    if (!handover)
        return;
    if (handover->soon)
        g_source_remove(handover->soon);
    for (guint i = 0; i < handover->processes->len; i++) {
        struct process *process = g_ptr_array_index(handover->processes, i);
        if (process->child_watch) {
            g_source_remove(process->child_watch);
            kill(-process->pid, SIGTERM);
            g_spawn_close_pid(process->pid);
        }
        stop_watching(process);
        if (process->line)
            g_string_free(process->line, TRUE);
        g_free(process);
    }
    g_ptr_array_free(handover->processes, TRUE);
    journal_close(handover->journal);
    g_free(handover->command);
    g_free(handover);
}

/* ---- Giving and looking ---- */

static int check_sealed(const char *path, struct lumi_error *error)
{
    g_autofree char *seal = g_build_filename(path, "tagmanifest-sha256.txt", NULL);

    if (access(path, F_OK) < 0)
        return lumi_fail_errno(error, path, "hand over");
    if (access(seal, F_OK) < 0)
        return lumi_fail(error, LUMI_ERR_ARG, "%s: is no sealed capture", path);
    return strlen(path) < sizeof((struct process *)0)->status.capture
               ? LUMI_OK
               : lumi_fail(error, LUMI_ERR_LIMIT, "%s: its path is too long", path);
}

int lumi_handover_give(struct lumi_handover *handover, const char *capture, bool again, struct lumi_error *error)
{
    g_autofree char *path = g_canonicalize_filename(capture, NULL);

    LUMI_TRY(check_sealed(path, error));
    if (!handover->command[0])
        return LUMI_OK;
    struct process *process = find(handover, path);
    if (process && process->status.state == LUMI_PROCESS_RUNNING && again)
        return lumi_fail(error, LUMI_ERR_BUSY, "%s: is being processed", path);
    if (process && (!again || process->status.state == LUMI_PROCESS_WAITING))
        return LUMI_OK;
    struct process named = {0};
    g_strlcpy(named.status.capture, path, sizeof named.status.capture);
    LUMI_TRY(remember(handover->journal, "given", &named, NULL, NULL, error));
    if (!process)
        process = add(handover, path);
    wait_again(handover, process);
    tell(process);
    start_soon(handover);
    return LUMI_OK;
}

int lumi_handover_list(struct lumi_handover *handover, struct lumi_process_status *list, int max)
{
    const int count = (int)handover->processes->len;

    for (int i = 0; i < count && i < max; i++)
        list[i] = ((struct process *)g_ptr_array_index(handover->processes, (guint)(count - 1 - i)))->status;
    return count < max ? count : max;
}
