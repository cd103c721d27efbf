/* kill_resume SEED KILLS DELIVERIES WORK LUMI process CAPTURE -w WORK...: runs the command once to the end, noting
 * stage by stage what happens on the disk and how much processor time it takes; throws all away but the field (its
 * name, and .whole); then runs it again and again, killing it (SIGKILL) KILLS times inside every stage; then lets it
 * end. A moment is drawn from SEED: after a number of happenings (inputs opened, outputs made, written, renamed), or
 * after a share of the stage's processor time, in turns; none is chosen by a clock. A kill counts where the stage had
 * begun to work in that very run, had not said that it is done, and has not all its keys. Prints, for each, how many
 * outputs the stage had by then. After the stages comes the copying of the field to its place, which is killed
 * DELIVERIES times likewise, before it is there. */
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
#include <time.h>
#include <unistd.h>

#define DELIVERY "(to its place)"

enum { STAGES = 32, FOLDERS = 64, TRIES = 100, NAME = 64 };

/* What a stage did in the run that was left alone. */
struct stage {
    char name[NAME];
    long events;
    double cpu; /* seconds */
    int keys;
};

struct watched {
    pid_t pid;
    clockid_t cpu;
    int notify, top, out;        /* top: the work folder's own watch */
    char folders[FOLDERS][NAME]; /* of watches; "": the capture's */
    char line[256];
    size_t filled;
    int stages; /* that have reported their end */
    struct stage done[STAGES];
    long events;  /* of the stage after these */
    double began; /* processor time when that stage began */
    double rest;  /* and what there was after the last one */
};

/* Where in a stage: after so many happenings and so much processor time. */
struct moment {
    int stage;
    const char *name;
    long events;
    double cpu;
};

static const char *work, *capture, *output;
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

static double cpu_time(const struct watched *run)
{
    struct timespec used;

    return clock_gettime(run->cpu, &used) ? 0 : (double)used.tv_sec + 1e-9 * (double)used.tv_nsec;
}

static void watch_folder(struct watched *run, const char *path, const char *name)
{
    const int watch = inotify_add_watch(run->notify, path, IN_OPEN | IN_CREATE | IN_MODIFY | IN_MOVED_TO | IN_ONLYDIR);

    if (watch >= FOLDERS)
        die("too many folders");
    if (watch >= 0)
        snprintf(run->folders[watch], NAME, "%.63s", name);
}

static void watch_stage(struct watched *run, const char *name)
{
    char path[4096];

    snprintf(path, sizeof path, "%s/%s", work, name);
    watch_folder(run, path, name);
}

static void watch_all(struct watched *run)
{
    char frames[4096];

    mkdir(work, 0777);
    run->notify = inotify_init1(IN_CLOEXEC | IN_NONBLOCK);
    run->top = inotify_add_watch(run->notify, work, IN_CREATE);
    DIR *dir = opendir(work);
    const struct dirent *entry;
    while (dir && (entry = readdir(dir)))
        if (entry->d_name[0] != '.')
            watch_stage(run, entry->d_name);
    if (!dir || run->notify < 0 || run->top < 0)
        die("cannot watch the work folder");
    closedir(dir);
    snprintf(frames, sizeof frames, "%s/data/frames", capture);
    watch_folder(run, frames, "");
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
    if (run->pid < 0 || clock_getcpuclockid(run->pid, &run->cpu))
        die("cannot start it");
}

static bool ends_with(const char *name, const char *end)
{
    const size_t length = strlen(name), tail = strlen(end);

    return length >= tail && !strcmp(name + length - tail, end);
}

/* Whether a stage at work did that, rather than somebody who looks whether there is anything to do: that opens keys and
 * places only. Without `stage` (it is not known yet) folders are told from one another by what happens in them. */
static bool is_work(const struct watched *run, const struct inotify_event *event, const char *stage)
{
    const char *folder = run->folders[event->wd], *name = event->len ? event->name : "";

    if (event->mask & IN_OPEN)
        return event->len && !(event->mask & IN_ISDIR) && !ends_with(name, ".key") && !ends_with(name, ".places");
    return folder[0] && (!stage || !strcmp(folder, stage));
}

static void read_events(struct watched *run, const char *stage)
{
    char buffer[8192] __attribute__((aligned(8)));
    ssize_t got;

    while ((got = read(run->notify, buffer, sizeof buffer)) > 0)
        for (ssize_t at = 0; at < got;) {
            const struct inotify_event *event = (const struct inotify_event *)(const void *)(buffer + at);
            at += (ssize_t)(sizeof *event + event->len);
            if (event->wd == run->top && (event->mask & IN_ISDIR))
                watch_stage(run, event->name);
            else if (event->wd > 0 && event->wd < FOLDERS && event->wd != run->top)
                run->events += is_work(run, event, stage);
        }
}

/* "STAGE  N made ...". What that stage did is in the queue by now, and is no work of the next one. */
static void take_line(struct watched *run)
{
    struct stage *stage = &run->done[run->stages];

    if (!strstr(run->line, " made ") || run->stages + 1 == STAGES)
        return;
    read_events(run, NULL);
    sscanf(run->line, "%63s", stage->name);
    stage->events = run->events;
    stage->cpu = cpu_time(run) - run->began;
    run->began += stage->cpu;
    run->events = 0;
    run->stages++;
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

static bool is_now(const struct watched *run, const struct moment *moment)
{
    if (run->stages != moment->stage)
        return run->stages > moment->stage; /* too late */
    return run->events >= moment->events && cpu_time(run) - run->began >= moment->cpu;
}

/* Until it ends, or the moment has come. True: it was killed in that stage, as far as it told. */
static bool follow(struct watched *run, const struct moment *moment)
{
    bool alive = true, killed = false;

    while (alive && !killed) {
        struct pollfd both[] = {{.fd = run->out, .events = POLLIN}, {.fd = run->notify, .events = POLLIN}};
        const bool near = moment && run->stages == moment->stage && run->events >= moment->events;
        poll(both, 2, near ? 1 : -1); /* processor time wakes nobody */
        alive = read_lines(run);
        read_events(run, moment ? moment->name : NULL);
        if (alive && moment && is_now(run, moment)) {
            kill(run->pid, SIGKILL);
            killed = true;
        }
    }
    int status;
    siginfo_t ended;
    waitid(P_PID, (id_t)run->pid, &ended, WEXITED | WNOWAIT);
    run->rest = cpu_time(run) - run->began;
    waitpid(run->pid, &status, 0);
    read_lines(run); /* what it had said before */
    close(run->out);
    close(run->notify);
    if (!WIFSIGNALED(status) && (!WIFEXITED(status) || WEXITSTATUS(status) != 0))
        die("the run failed");
    return killed && WIFSIGNALED(status) && run->stages == moment->stage;
}

/* −1: the stage has not begun. */
static int count_keys(const char *stage)
{
    char path[4096];
    const struct dirent *entry;
    int count = 0;

    snprintf(path, sizeof path, "%s/%s", work, stage);
    DIR *dir = opendir(path);
    if (!dir)
        return -1;
    while ((entry = readdir(dir)))
        count += ends_with(entry->d_name, ".key") && !strstr(entry->d_name, ".tmp-");
    closedir(dir);
    return count;
}

static void clear(char **command, const char *stage)
{
    const pid_t pid = fork();
    int status;

    if (pid == 0) {
        freopen("/dev/null", "w", stdout);
        execlp(command[0], command[0], "clear", capture, "--yes", "-w", work, stage, (char *)NULL);
        _exit(127);
    }
    if (waitpid(pid, &status, 0) != pid || status)
        die("lumi clear failed");
}

/* What is killed is not done yet. `keys`: how many it has. */
static bool is_inside(const struct stage *stage, int *keys)
{
    *keys = 0;
    if (!strcmp(stage->name, DELIVERY))
        return access(output, F_OK) != 0;
    *keys = count_keys(stage->name);
    return *keys >= 0 && *keys < stage->keys;
}

static void begin_again(char **command, const struct stage *stage)
{
    if (strcmp(stage->name, DELIVERY) != 0)
        clear(command, stage->name);
    else if (unlink(output))
        die("the field is not where it should be");
}

/* The `number`th kill inside a stage; the share is of what a run that was left alone did. */
static void kill_inside(char **command, int index, const struct stage *stage, int number)
{
    struct moment moment = {.stage = index, .name = stage->name, .events = 1};
    const double share = (double)(draw() >> 11) / 9007199254740992.0 / (number / 2 + 1);
    struct watched run;

    if (number % 2)
        moment.cpu = share * stage->cpu;
    else
        moment.events += (long)(share * (double)stage->events);
    for (int attempt = 0; attempt < TRIES; attempt++) {
        start(&run, command);
        const bool killed = follow(&run, &moment);
        int keys;
        if (is_inside(stage, &keys) && killed) {
            printf(" %d/%d", keys, stage->keys);
            fflush(stdout);
            return;
        }
        begin_again(command, stage); /* it was over too early; an earlier moment */
        moment.events = 1 + (moment.events - 1) / 2;
        moment.cpu /= 2;
    }
    fprintf(stderr, "kill_resume: never killed inside '%s'\n", stage->name);
    exit(1);
}

/* Of the command: the field. */
static const char *find_output(char **command)
{
    for (; *command; command++)
        if (!strcmp(*command, "-o") && command[1])
            return command[1];
    die("no -o");
    return NULL;
}

/* A run that is left alone; what its stages did, and the delivery after them. */
static void run_whole(char **command, struct watched *run)
{
    start(run, command);
    follow(run, NULL);
    for (int stage = 0; stage < run->stages; stage++)
        run->done[stage].keys = count_keys(run->done[stage].name);
    run->done[run->stages] = (struct stage){.name = DELIVERY, .events = run->events, .cpu = run->rest};
}

int main(int argc, char **argv)
{
    struct watched first, last;
    char whole[4096];

    if (argc < 8)
        die("usage: kill_resume SEED KILLS DELIVERIES WORK LUMI process CAPTURE -w WORK...");
    state = strtoull(argv[1], NULL, 10);
    const int kills = atoi(argv[2]), deliveries = atoi(argv[3]);
    work = argv[4];
    capture = argv[7];
    output = find_output(argv + 5);
    run_whole(argv + 5, &first);
    clear(argv + 5, NULL);
    snprintf(whole, sizeof whole, "%s.whole", output);
    if (rename(output, whole))
        die("no field");
    for (int stage = 0; stage < first.stages + (deliveries > 0); stage++) {
        printf("%-16s killed with outputs done:", first.done[stage].name);
        fflush(stdout);
        for (int k = 0; k < (stage < first.stages ? kills : deliveries); k++)
            kill_inside(argv + 5, stage, &first.done[stage], k);
        printf("\n");
    }
    start(&last, argv + 5);
    follow(&last, NULL);
    printf("killed %d times inside each of %d stages\n", kills, first.stages);
    return first.stages == 0;
}
