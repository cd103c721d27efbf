/* kill_resume SEED KILLS WORK LUMI process CAPTURE -w WORK...: runs the command once to the end, counting what happens
 * in the work folder stage by stage; throws all away; then runs it again and again, killing it (SIGKILL) KILLS times
 * inside every stage, after a number of happenings (files opened, made, written, renamed) drawn from SEED; then lets it
 * end. No moment is chosen by a clock. Prints how many kills there were. */
#define _GNU_SOURCE
#include <dirent.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/inotify.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

enum { STAGES = 32, TRIES = 40 };

struct watched {
    pid_t pid;
    int notify, top, out; /* top: the work folder's own watch */
    char line[256];
    size_t filled;
    int stages; /* that have reported their end */
    char names[STAGES][32];
    long events; /* since the last of these */
};

static const char *work;
static uint64_t state;

static void die(const char *text)
{
    fprintf(stderr, "kill_resume: %s\n", text);
    exit(1);
}

/* SplitMix64 (Steele, Lea and Flood 2014). */
static uint64_t draw(void)
{
    uint64_t z = state += 0x9e3779b97f4a7c15U;

    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9U;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebU;
    return z ^ (z >> 31);
}

static void watch_folder(const struct watched *run, const char *name)
{
    char path[4096];

    snprintf(path, sizeof path, "%s/%s", work, name);
    inotify_add_watch(run->notify, path, IN_OPEN | IN_CREATE | IN_MODIFY | IN_MOVED_TO | IN_ONLYDIR);
}

static void watch_all(struct watched *run)
{
    mkdir(work, 0777);
    run->notify = inotify_init1(IN_CLOEXEC | IN_NONBLOCK);
    run->top = inotify_add_watch(run->notify, work, IN_CREATE);
    DIR *dir = opendir(work);
    const struct dirent *entry;
    while (dir && (entry = readdir(dir)))
        if (entry->d_name[0] != '.')
            watch_folder(run, entry->d_name);
    if (!dir || run->notify < 0 || run->top < 0)
        die("cannot watch the work folder");
    closedir(dir);
}

static void start(struct watched *run, char **command)
{
    int ends[2];

    *run = (struct watched){0};
    watch_all(run);
    if (pipe2(ends, O_CLOEXEC | O_NONBLOCK))
        die("no pipe");
    run->pid = fork();
    if (run->pid == 0) {
        dup2(ends[1], STDOUT_FILENO);
        fcntl(STDOUT_FILENO, F_SETFL, 0);
        execvp(command[0], command);
        _exit(127);
    }
    close(ends[1]);
    run->out = ends[0];
}

/* "STAGE  N made ..." */
static void take_line(struct watched *run)
{
    if (!strstr(run->line, " made ") || run->stages == STAGES)
        return;
    sscanf(run->line, "%31s", run->names[run->stages++]);
    run->events = 0;
}

/* False: it has ended. */
static bool read_lines(struct watched *run)
{
    char byte;
    ssize_t got;

    while ((got = read(run->out, &byte, 1)) == 1)
        if (byte == '\n') {
            run->line[run->filled] = '\0';
            take_line(run);
            run->filled = 0;
        } else if (run->filled + 1 < sizeof run->line) {
            run->line[run->filled++] = byte;
        }
    return got != 0;
}

static void read_events(struct watched *run)
{
    char buffer[8192] __attribute__((aligned(8)));
    ssize_t got;

    while ((got = read(run->notify, buffer, sizeof buffer)) > 0)
        for (ssize_t at = 0; at < got;) {
            const struct inotify_event *event = (const struct inotify_event *)(const void *)(buffer + at);
            at += (ssize_t)(sizeof *event + event->len);
            if (event->wd == run->top && !(event->mask & IN_ISDIR))
                continue;
            if (event->wd == run->top)
                watch_folder(run, event->name);
            run->events++;
        }
}

/* Until it ends, or `events` have happened in the stage after `stages` others. True: it was killed there. */
static bool follow(struct watched *run, int stages, long events, long *counts)
{
    bool alive = true, killed = false;

    while (alive && !killed) {
        struct pollfd both[] = {{.fd = run->out, .events = POLLIN}, {.fd = run->notify, .events = POLLIN}};
        poll(both, 2, -1);
        const int before = run->stages;
        const long so_far = run->events;
        alive = read_lines(run);
        if (counts && run->stages > before)
            counts[before] = so_far;
        read_events(run);
        if (stages >= 0 && (run->stages > stages || (run->stages == stages && run->events >= events))) {
            kill(run->pid, SIGKILL);
            killed = true;
        }
    }
    int status;
    waitpid(run->pid, &status, 0);
    read_lines(run); /* what it had said before */
    close(run->out);
    close(run->notify);
    if (!killed && (!WIFEXITED(status) || WEXITSTATUS(status) != 0))
        die("the run failed");
    return killed && WIFSIGNALED(status) && run->stages == stages;
}

static void clear(char **command, const char *stage)
{
    const pid_t pid = fork();
    int status;

    if (pid == 0) {
        freopen("/dev/null", "w", stdout);
        execlp(command[0], command[0], "clear", command[2], "--yes", "-w", work, stage, (char *)NULL);
        _exit(127);
    }
    if (waitpid(pid, &status, 0) != pid || status)
        die("lumi clear failed");
}

/* One kill inside stage `stages`, which has about `events` happenings. */
static void kill_inside(char **command, int stages, const char *name, long events)
{
    struct watched run;

    for (int attempt = 0; attempt < TRIES; attempt++) {
        start(&run, command);
        if (follow(&run, stages, 1 + (long)(draw() % (uint64_t)(events > 0 ? events : 1)), NULL))
            return;
        clear(command, name); /* it was over too early; an earlier moment, from its beginning */
        events /= 2;
    }
    fprintf(stderr, "kill_resume: never killed inside '%s'\n", name);
    exit(1);
}

int main(int argc, char **argv)
{
    struct watched first, last;
    long counts[STAGES + 1] = {0};

    if (argc < 7)
        die("usage: kill_resume SEED KILLS WORK LUMI process CAPTURE -w WORK...");
    state = strtoull(argv[1], NULL, 10);
    const int kills = atoi(argv[2]);
    work = argv[3];
    start(&first, argv + 4);
    follow(&first, -1, 0, counts);
    clear(argv + 4, NULL);
    for (int stage = 0; stage < first.stages; stage++)
        for (int k = 0; k < kills; k++)
            kill_inside(argv + 4, stage, first.names[stage], counts[stage] / (k + 1));
    start(&last, argv + 4);
    follow(&last, -1, 0, NULL);
    printf("killed %d times inside each of %d stages:", kills, first.stages);
    for (int stage = 0; stage < first.stages; stage++)
        printf(" %s", first.names[stage]);
    printf("\n");
    return first.stages == 0;
}
