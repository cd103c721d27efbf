/* Starts the processes of a simulated rig, and ends them together. */
#include "sim/gige/rig_processes.h"

#include "sim/gige/rig_parts.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#define CHILDREN (3 + RIG_EYES_MAX) /* the board, a drive, cameras, the caller's command */
#define BOARD (-1)                  /* in place of a number of cameras */
#define DRIVE (-2)
#define PATIENCE_S 10      /* until those that were asked to end are killed */
#define POSITION_LEAST 2.0 /* s */
#define POSITION_SHARE 0.6 /* of a position's time that drawing may take: others want the processors as well */
#define FIRST_LINES_S 600  /* until all are ready: places take their time to be built */

struct child {
    pid_t pid; /* 0: none, or it has ended */
    int report;
    bool command; /* the caller's: not to be told by the board's end */
    char name[32];
};
struct processes {
    const struct sim_rig_processes *rig;
    struct child children[CHILDREN];
    int count;
    int life[2];               /* its writing end is ours alone: the board reads its end */
    int eyes[RIG_EYES_MAX][2]; /* [0] the board's, [1] the cameras' */
    int eye_count;
    int drive[2];                /* [0] the board's, [1] the drive's; −1 where there is none */
    double drawing;              /* s, that a position takes the slowest of the cameras */
    int first[RIG_EYES_MAX + 1]; /* cameras of process i: first[i] .. first[i + 1] − 1 */
};

void sim_rig_processes_init(struct sim_rig_processes *rig)
{
    memset(rig, 0, sizeof *rig);
    rig->place = "room";
    rig->seed = 1;
    rig->speed = 1;
    rig->first_host = 2;
    sim_sensor_init(&rig->sensor);
    rig->reference = rig->exposure = 0.004;
    snprintf(rig->layout, sizeof rig->layout, "raw");
    rig->patience = 120;
    rig->port = 8470;
}

void sim_rig_processes_address(const struct sim_rig_processes *rig, int camera, char address[16])
{
    snprintf(address, 16, "127.0.0.%d", (rig->first_host + camera) & 255);
}

void sim_rig_processes_serial(const struct sim_rig_processes *rig, int camera, char serial[16])
{
    snprintf(serial, 16, "LS%04u%02d", (unsigned)(rig->seed % 10000), camera);
}

void rig_report(int fd, int code, const struct lumi_error *error)
{
    struct rig_report report = {.code = code};

    if (error && code != LUMI_OK)
        snprintf(report.text, sizeof report.text, "%s", error->text);
    (void)!write(fd, &report, sizeof report);
    close(fd);
}

void rig_report_drawing(int fd, double seconds)
{
    const struct rig_report report = {.code = LUMI_OK, .drawing = seconds};

    (void)!write(fd, &report, sizeof report);
    close(fd);
}

/* ---- starting ---- */

static void close_all(struct processes *p, int keep_a, int keep_b)
{
    const int count = 2 * p->eye_count;

    for (int i = 0; i < count; i++) {
        int *fd = &p->eyes[i / 2][i % 2];
        if (*fd >= 0 && *fd != keep_a && *fd != keep_b)
            close(*fd);
    }
    for (int i = 0; i < 2; i++) {
        if (p->life[i] >= 0 && p->life[i] != keep_a && p->life[i] != keep_b)
            close(p->life[i]);
        if (p->drive[i] >= 0 && p->drive[i] != keep_a && p->drive[i] != keep_b)
            close(p->drive[i]);
    }
}

static int run_eyes(struct processes *p, int index, int report, struct lumi_error *error)
{
    const struct rig_eyes eyes = {p->rig, report, p->eyes[index][1], p->first[index],
                                  p->first[index + 1] - p->first[index]};

    close_all(p, eyes.board, -1);
    return rig_eyes_run(&eyes, error);
}

static int run_drive(struct processes *p, int report, struct lumi_error *error)
{
    const struct rig_drive drive = {p->rig, report, p->drive[1]};

    close_all(p, drive.board, -1);
    return rig_drive_run(&drive, error);
}

static int run_board(struct processes *p, int report, struct lumi_error *error)
{
    struct rig_board board = {.rig = p->rig, .report = report, .life = p->life[0], .eye_count = p->eye_count};

    for (int i = 0; i < p->eye_count; i++) {
        close(p->eyes[i][1]);
        board.eyes[i] = p->eyes[i][0];
        for (int c = p->first[i]; c < p->first[i + 1]; c++)
            board.owner[c] = i;
    }
    close(p->life[1]);
    board.drive = p->drive[0];
    if (p->drive[1] >= 0)
        close(p->drive[1]);
    return rig_board_run(&board, error);
}

/* What a child's process is, from beginning to end. `which`: BOARD, DRIVE, else that of cameras. */
static void be_child(struct processes *p, int which, int report)
{
    struct lumi_error error = {0};
    int code;

    signal(SIGINT, SIG_IGN); /* a terminal's Ctrl-C reaches all: the parent ends us */
    signal(SIGTERM, SIG_DFL);
    for (int i = 0; i < p->count; i++)
        if (p->children[i].report >= 0)
            close(p->children[i].report);
    code = which == BOARD   ? run_board(p, report, &error)
           : which == DRIVE ? run_drive(p, report, &error)
                            : run_eyes(p, which, report, &error);
    if (code != LUMI_OK)
        rig_report(report, code, &error);
    _exit(code == LUMI_OK ? 0 : 1);
}

static int start_child(struct processes *p, int which, struct lumi_error *error)
{
    struct child *child = &p->children[p->count];
    int fds[2];

    if (pipe(fds) != 0)
        return lumi_fail_errno(error, "the simulated rig", "a pipe");
    child->report = fds[0];
    if (which < 0)
        snprintf(child->name, sizeof child->name, which == BOARD ? "the board" : "the drive");
    else
        snprintf(child->name, sizeof child->name, "cameras %d to %d", p->first[which], p->first[which + 1] - 1);
    child->pid = fork();
    if (child->pid == 0) {
        close(fds[0]);
        be_child(p, which, fds[1]);
    }
    close(fds[1]);
    p->count++;
    if (child->pid < 0) {
        child->pid = 0;
        return lumi_fail_errno(error, "the simulated rig", "a process");
    }
    return LUMI_OK;
}

static int make_links(struct processes *p, struct lumi_error *error)
{
    const int cameras = p->rig->rig.camera_count;
    long wanted = p->rig->processes > 0 ? p->rig->processes : sysconf(_SC_NPROCESSORS_ONLN);

    wanted = wanted < 1 ? 1 : wanted > cameras ? cameras : wanted;
    for (int i = 0; i <= (int)wanted; i++)
        p->first[i] = (int)(i * (long)cameras / wanted);
    for (; p->eye_count < (int)wanted; p->eye_count++)
        if (socketpair(AF_UNIX, SOCK_SEQPACKET, 0, p->eyes[p->eye_count]) != 0)
            return lumi_fail_errno(error, "the simulated rig", "a socket");
    if (p->rig->drive && socketpair(AF_UNIX, SOCK_SEQPACKET, 0, p->drive) != 0)
        return lumi_fail_errno(error, "the simulated rig", "a socket");
    if (pipe(p->life) != 0)
        return lumi_fail_errno(error, "the simulated rig", "a pipe");
    fcntl(p->life[1], F_SETFD, FD_CLOEXEC); /* what `ready` starts must not keep the board alive */
    return LUMI_OK;
}

/* Waits for a child's first word. */
static int hear(struct processes *p, struct child *child, struct lumi_error *error)
{
    struct pollfd wait = {.fd = child->report, .events = POLLIN};
    struct rig_report report;

    for (int i = 0; i < FIRST_LINES_S * 5; i++) {
        if (p->rig->stop && *p->rig->stop)
            return lumi_fail(error, LUMI_ERR_CANCELLED, "stopped");
        if (poll(&wait, 1, 200) > 0)
            break;
    }
    const ssize_t size = wait.revents ? read(child->report, &report, sizeof report) : 0;
    if (size != (ssize_t)sizeof report)
        return lumi_fail(error, LUMI_ERR_IO, "the simulated rig: %s did not start", child->name);
    if (report.code != LUMI_OK)
        return lumi_fail(error, report.code, "the simulated rig: %s: %s", child->name, report.text);
    p->drawing = report.drawing > p->drawing ? report.drawing : p->drawing;
    return LUMI_OK;
}

static int start_all(struct processes *p, struct lumi_error *error)
{
    LUMI_TRY(make_links(p, error));
    LUMI_TRY(start_child(p, BOARD, error));
    if (p->rig->drive)
        LUMI_TRY(start_child(p, DRIVE, error));
    for (int i = 0; i < p->eye_count; i++)
        LUMI_TRY(start_child(p, i, error));
    for (int i = 0; i < p->eye_count; i++) { /* theirs now: one that goes is noticed by the other end */
        close(p->eyes[i][0]);
        close(p->eyes[i][1]);
        p->eyes[i][0] = p->eyes[i][1] = -1;
    }
    for (int i = 0; i < 2 && p->rig->drive; i++) {
        close(p->drive[i]);
        p->drive[i] = -1;
    }
    close(p->life[0]);
    p->life[0] = -1;
    for (int i = 0; i < p->count; i++)
        LUMI_TRY(hear(p, &p->children[i], error));
    return LUMI_OK;
}

static int start_command(struct processes *p, struct lumi_error *error)
{
    struct child *child = &p->children[p->count];

    child->report = -1;
    child->command = true;
    snprintf(child->name, sizeof child->name, "%.31s", p->rig->command[0]);
    child->pid = fork();
    if (child->pid == 0) {
        signal(SIGINT, SIG_DFL);
        signal(SIGTERM, SIG_DFL);
        setenv("LUMI_SIM_RIG", p->rig->folder, 1);
        execvp(p->rig->command[0], p->rig->command);
        fprintf(stderr, "lumi sim rig: %s: %s\n", p->rig->command[0], strerror(errno));
        _exit(127);
    }
    p->count++;
    if (child->pid < 0) {
        child->pid = 0;
        return lumi_fail_errno(error, p->rig->command[0], "a process");
    }
    return LUMI_OK;
}

/* ---- ending ---- */

static struct child *ended(struct processes *p, int *status)
{
    for (int i = 0; i < p->count; i++)
        if (p->children[i].pid > 0 && waitpid(p->children[i].pid, status, WNOHANG) == p->children[i].pid) {
            p->children[i].pid = 0;
            return &p->children[i];
        }
    return NULL;
}

static int command_ended(const struct child *child, int status, struct lumi_error *error)
{
    if (WIFEXITED(status) && WEXITSTATUS(status) == 0)
        return LUMI_OK;
    return lumi_fail(error, LUMI_ERR_IO, "%s ended with %s %d", child->name, WIFEXITED(status) ? "status" : "signal",
                     WIFEXITED(status) ? WEXITSTATUS(status) : WTERMSIG(status));
}

static int watch(struct processes *p, struct lumi_error *error)
{
    const struct timespec pause = {0, 100000000};
    struct child *child;
    int status;

    while (!(p->rig->stop && *p->rig->stop)) {
        child = ended(p, &status);
        if (child && child->command)
            return command_ended(child, status, error);
        if (child && WIFSIGNALED(status))
            return lumi_fail(error, LUMI_ERR_IO, "the simulated rig: %s ended by signal %d", child->name,
                             WTERMSIG(status));
        if (child) {
            struct rig_report report = {0};
            const bool said = read(child->report, &report, sizeof report) == (ssize_t)sizeof report;
            return lumi_fail(error, LUMI_ERR_IO, "the simulated rig: %s ended%s%s", child->name, said ? ": " : "",
                             said ? report.text : "");
        }
        nanosleep(&pause, NULL);
    }
    return LUMI_OK;
}

static void end_all(struct processes *p)
{
    const struct timespec pause = {0, 20000000};
    bool any = true;
    int status;

    for (int i = 0; i < p->count; i++)
        if (p->children[i].command && p->children[i].pid > 0) {
            kill(p->children[i].pid, SIGTERM);
            for (int turn = 0; p->children[i].pid > 0 && turn < PATIENCE_S * 50; turn++) {
                ended(p, &status); /* the rig is there until it has gone */
                nanosleep(&pause, NULL);
            }
        }
    if (p->life[1] >= 0)
        close(p->life[1]); /* the board goes, and with it all who listen to it */
    p->life[1] = -1;
    for (int turn = 0; any && turn < PATIENCE_S * 50; turn++) {
        while (ended(p, &status))
            ;
        any = false;
        for (int i = 0; i < p->count; i++)
            any = any || p->children[i].pid > 0;
        if (any)
            nanosleep(&pause, NULL);
    }
    for (int i = 0; i < p->count; i++) {
        if (p->children[i].pid > 0) {
            kill(p->children[i].pid, SIGKILL);
            waitpid(p->children[i].pid, &status, 0);
        }
        if (p->children[i].report >= 0)
            close(p->children[i].report);
    }
    close_all(p, -1, -1);
}

/* A board that was killed had no time to take its terminal's link away. */
static void remove_link(const struct sim_rig_processes *rig)
{
    char link[600];
    struct stat there;

    snprintf(link, sizeof link, "%s/board", rig->folder);
    if (lstat(link, &there) == 0 && S_ISLNK(there.st_mode) && stat(link, &there) != 0)
        unlink(link);
}

int sim_rig_processes_run(const struct sim_rig_processes *rig, struct lumi_error *error)
{
    struct sim_rig_processes own = *rig;
    struct processes p = {.rig = &own, .life = {-1, -1}, .drive = {-1, -1}};
    int code;

    if (rig->first_host < 1 || rig->first_host + rig->rig.camera_count + rig->drive > 254)
        return lumi_fail(error, LUMI_ERR_ARG, "addresses from 127.0.0.%d on: too high for %d cameras", rig->first_host,
                         rig->rig.camera_count);
    LUMI_TRY(rig_files_write(rig, error));
    code = start_all(&p, error);
    if (own.position_time <= 0)
        own.position_time = ceil(10 * fmax(p.drawing / POSITION_SHARE, POSITION_LEAST)) / 10;
    if (code == LUMI_OK)
        code = rig_plan_write(&own, error);
    if (code == LUMI_OK && rig->ready)
        rig->ready(&own);
    if (code == LUMI_OK && rig->command)
        code = start_command(&p, error);
    if (code == LUMI_OK)
        code = watch(&p, error);
    end_all(&p);
    remove_link(rig);
    return code == LUMI_ERR_CANCELLED ? LUMI_OK : code;
}
