/* The tests' end of an engine in another process. */
#include "remote_engine.h"

#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#define FRAMES 4096 /* given out and not yet released */
#define BUSY_NS 2000000

const char *remote_engine_program = "capture_engine_process";
struct remote_kill remote_kill;

struct lumi_engine {
    struct lumi_engine_ports ports;
    struct lumi_engine_status status; /* of the last answer */
    struct lumi_camera_frame *frames[FRAMES];
    int fd, jobs, round;
    pid_t pid;
    bool dead, calling, woken; /* woken: the store has done something since it was last run */
    int64_t now_ns, next_ns;
    struct remote_message message;
};

bool remote_engine_dead(const struct lumi_engine *engine)
{
    return engine->dead;
}

int remote_engine_jobs(const struct lumi_engine *engine)
{
    return engine->jobs;
}

/* ---- what it asks ---- */

static void judge(struct lumi_engine *e, const struct remote_message *m)
{
    struct lumi_engine_judge_job job = {.id = m->words.id, .camera = m->words.camera, .neighbour_count = m->words.jobs};
    struct lumi_camera_frame file = {.format.layout = LUMI_LAYOUT_FILE, .path = m->words.text};

    job.frame = m->words.flag ? &file : e->frames[m->words.number];
    e->ports.judge(e->ports.context, &job);
}

static void asked(struct lumi_engine *e, enum remote_op op, const struct remote_message *m)
{
    const struct lumi_engine_ports *p = &e->ports;
    struct remote_words words = {0};

    switch (op) {
    case REMOTE_REQUEST:
        p->rig_request(p->context, m->words.number, &m->u.request);
        break;
    case REMOTE_PROFILE:
        p->rig_read_profile(p->context, m->words.number);
        break;
    case REMOTE_STORED:
        p->rig_stored(p->context, &m->u.event);
        break;
    case REMOTE_STOP:
        p->rig_emergency_stop(p->context);
        break;
    case REMOTE_TO_HOST:
        words.at_ns = p->rig_to_host(p->context, m->words.id);
        remote_write(e->fd, REMOTE_TO_HOST, &words, sizeof words, NULL, 0);
        break;
    case REMOTE_CAMERA:
        p->camera_command(p->context, m->words.camera, m->words.number, &m->u.command);
        break;
    case REMOTE_JUDGE:
        judge(e, m);
        break;
    case REMOTE_HAND_OVER:
        p->hand_over(p->context, m->words.text);
        break;
    case REMOTE_TOLD:
        p->told(p->context, &m->u.told);
        break;
    case REMOTE_RELEASED:
        lumi_camera_frame_release(e->frames[m->words.number]);
        e->frames[m->words.number] = NULL;
        break;
    default:
        break;
    }
}

/* One message; false: it is dead. */
static bool take(struct lumi_engine *e, enum remote_op *op)
{
    struct remote_head head;

    *op = 0;
    if (!remote_read(e->fd, &head, sizeof head))
        return false;
    *op = (enum remote_op)head.op;
    if (head.op == REMOTE_STATUS_IS)
        return remote_read(e->fd, &e->status, sizeof e->status);
    if (head.size > sizeof e->message || !remote_read(e->fd, &e->message, head.size))
        return false;
    if (head.op == REMOTE_END) {
        e->next_ns = e->message.words.at_ns;
        e->jobs = e->message.words.jobs;
        e->round = e->message.words.camera;
    } else if (head.op == REMOTE_WAKE) {
        e->woken = true;
    } else {
        asked(e, *op, &e->message);
    }
    return true;
}

/* ---- life ---- */

static void die(struct lumi_engine *e)
{
    if (e->pid > 0) {
        kill(e->pid, SIGKILL);
        waitpid(e->pid, NULL, 0);
    }
    e->pid = 0;
    if (!e->dead)
        remote_kill.jobs = e->jobs;
    e->dead = true;
    e->next_ns = INT64_MAX;
    e->jobs = 0;
    for (int i = 0; i < FRAMES; i++) {
        lumi_camera_frame_release(e->frames[i]);
        e->frames[i] = NULL;
    }
}

/* Whether this is the call in which it is to die. */
static bool doomed(const struct lumi_engine *e, enum remote_op op)
{
    if (!remote_kill.count || (remote_kill.op && remote_kill.op != op) || (remote_kill.busy && !e->jobs) ||
        (remote_kill.round && !e->round))
        return false;
    return --remote_kill.count == 0;
}

static int call(struct lumi_engine *e, enum remote_op op, const struct remote_message *m, size_t size, const void *more,
                size_t more_size, struct lumi_error *error)
{
    enum remote_op answer = 0;
    bool last = op < REMOTE_STATUS && doomed(e, op);

    if (e->dead)
        return lumi_fail(error, LUMI_ERR_IO, "the engine's process is dead");
    if (last && remote_kill.delay_us < 0) {
        die(e);
        return lumi_fail(error, LUMI_ERR_IO, "the engine's process is dead");
    }
    bool good = remote_write(e->fd, op, m, size, more, more_size);
    if (last) {
        nanosleep(&(struct timespec){.tv_nsec = remote_kill.delay_us * 1000L}, NULL);
        kill(e->pid, SIGKILL);
    }
    e->calling = true;
    while (good && answer != REMOTE_END)
        good = take(e, &answer);
    e->calling = false;
    if (!good || last) {
        remote_kill.crashed |= !last;
        die(e);
        return lumi_fail(error, LUMI_ERR_IO, "the engine's process is dead");
    }
    if (e->message.words.code)
        return lumi_fail(error, e->message.words.code, "%s", e->message.words.text);
    return LUMI_OK;
}

static struct remote_message *begin(struct lumi_engine *e, int64_t now_ns)
{
    static struct remote_message m;

    memset(&m.words, 0, sizeof m.words);
    m.words.now_ns = e->now_ns = now_ns;
    return &m;
}

static int simple(struct lumi_engine *e, enum remote_op op, const struct remote_message *m, struct lumi_error *error)
{
    return call(e, op, m, sizeof *m, NULL, 0, error);
}

int lumi_engine_create(const struct lumi_engine_config *config, const struct lumi_engine_ports *ports, int64_t now_ns,
                       struct lumi_engine **engine, struct lumi_error *error)
{
    struct lumi_engine *e = calloc(1, sizeof *e);
    int pair[2];
    char text[16];

    e->ports = *ports;
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair) != 0)
        return lumi_fail_errno(error, "engine", "socketpair");
    e->pid = fork();
    if (e->pid == 0) {
        int fd = dup(pair[1]); /* without close-on-exec */
        snprintf(text, sizeof text, "%d", fd);
        execl(remote_engine_program, remote_engine_program, text, (char *)NULL);
        _exit(127);
    }
    close(pair[1]);
    e->fd = pair[0];
    struct remote_message *m = begin(e, now_ns);
    m->u.config = *config;
    *engine = e;
    return simple(e, REMOTE_CREATE, m, error);
}

/* Never in order: it is always killed. */
void lumi_engine_destroy(struct lumi_engine *e)
{
    if (!e)
        return;
    die(e);
    close(e->fd);
    free(e);
}

int64_t lumi_engine_next(const struct lumi_engine *engine)
{
    struct lumi_engine *e = (struct lumi_engine *)(uintptr_t)engine;
    struct pollfd fd = {.fd = e->fd, .events = POLLIN};
    enum remote_op op;

    /* While its disk works, the world's time goes on slowly. */
    while (!e->dead && !e->calling && poll(&fd, 1, e->jobs && !e->woken && e->next_ns > e->now_ns ? 1 : 0) > 0)
        if (!take(e, &op)) {
            remote_kill.crashed = true;
            die(e);
        }
    if (e->dead)
        return INT64_MAX;
    if (e->woken)
        return e->now_ns;
    if (e->jobs && e->next_ns > e->now_ns + BUSY_NS)
        return e->now_ns + BUSY_NS;
    return e->next_ns;
}

const char *lumi_engine_state_name(enum lumi_engine_state state)
{
    return state == LUMI_ENGINE_DONE ? "done" : "under way";
}

struct lumi_store *lumi_engine_store(struct lumi_engine *engine)
{
    (void)engine;
    return NULL;
}

/* ---- calls ---- */

void lumi_engine_run(struct lumi_engine *e, int64_t now_ns)
{
    e->woken = false;
    simple(e, REMOTE_RUN, begin(e, now_ns), NULL);
}

void lumi_engine_clock(struct lumi_engine *e, int64_t utc_offset_ns)
{
    struct remote_message *m = begin(e, e->now_ns);

    m->words.at_ns = utc_offset_ns;
    simple(e, REMOTE_CLOCK, m, NULL);
}

void lumi_engine_rig_notice(struct lumi_engine *e, int64_t now_ns, const struct lumi_rig_notice *notice)
{
    struct remote_message *m = begin(e, now_ns);

    m->u.notice = *notice;
    simple(e, REMOTE_RIG_NOTICE, m, NULL);
}

void lumi_engine_rig_reply(struct lumi_engine *e, int64_t now_ns, uint32_t number, int code, const char *text,
                           const lumi_wire_Reply *reply)
{
    struct remote_message *m = begin(e, now_ns);

    m->words.number = number;
    m->words.code = code;
    snprintf(m->words.text, sizeof m->words.text, "%s", text);
    m->words.flag = reply != NULL;
    if (reply)
        m->u.reply = *reply;
    simple(e, REMOTE_RIG_REPLY, m, NULL);
}

void lumi_engine_rig_profile(struct lumi_engine *e, int64_t now_ns, uint32_t number, int code, const char *text,
                             const struct lumi_rig *rig)
{
    struct remote_message *m = begin(e, now_ns);

    m->words.number = number;
    m->words.code = code;
    snprintf(m->words.text, sizeof m->words.text, "%s", text);
    m->words.flag = rig != NULL;
    if (rig)
        m->u.rig = *rig;
    simple(e, REMOTE_RIG_PROFILE, m, NULL);
}

void lumi_engine_rig_status(struct lumi_engine *e, int64_t now_ns, const struct lumi_rig_link_snapshot *snapshot)
{
    struct remote_message *m = begin(e, now_ns);

    m->u.snapshot = *snapshot;
    simple(e, REMOTE_RIG_STATUS, m, NULL);
}

void lumi_engine_camera_notice(struct lumi_engine *e, int64_t now_ns, int camera,
                               const struct lumi_camera_notice *notice)
{
    struct remote_message *m = begin(e, now_ns);
    int place = 0;

    m->words.camera = camera;
    m->u.camera = *notice;
    if (!notice->frame) {
        simple(e, REMOTE_CAMERA_NOTICE, m, NULL);
        return;
    }
    while (place < FRAMES - 1 && e->frames[place])
        place++;
    e->frames[place] = notice->frame;
    m->words.number = (uint32_t)place;
    m->frame = *notice->frame;
    call(e, REMOTE_CAMERA_NOTICE, m, sizeof *m, notice->frame->data, notice->frame->size, NULL);
    if (e->dead && e->frames[place]) {
        lumi_camera_frame_release(e->frames[place]);
        e->frames[place] = NULL;
    }
}

void lumi_engine_sync_edge(struct lumi_engine *e, int64_t now_ns, int camera, int64_t at_ns, uint32_t lost)
{
    struct remote_message *m = begin(e, now_ns);

    m->words.camera = camera;
    m->words.at_ns = at_ns;
    m->words.number = lost;
    simple(e, REMOTE_SYNC_EDGE, m, NULL);
}

void lumi_engine_judged(struct lumi_engine *e, int64_t now_ns, uint64_t id, int code, const char *text,
                        const struct lumi_judge_numbers *numbers, struct lumi_judge_picture *picture)
{
    struct remote_message *m = begin(e, now_ns);

    (void)picture;
    m->words.id = id;
    m->words.code = code;
    snprintf(m->words.text, sizeof m->words.text, "%s", text);
    m->words.flag = numbers != NULL;
    if (numbers)
        m->u.numbers = *numbers;
    simple(e, REMOTE_JUDGED, m, NULL);
}

void lumi_engine_disk(struct lumi_engine *e, int64_t now_ns, int64_t free_bytes, double bytes_per_second)
{
    struct remote_message *m = begin(e, now_ns);

    m->words.at_ns = free_bytes;
    m->words.rate = bytes_per_second;
    simple(e, REMOTE_DISK, m, NULL);
}

int lumi_engine_start(struct lumi_engine *e, int64_t now_ns, const char *plan_text, size_t plan_size,
                      const struct lumi_engine_start *start, struct lumi_error *error)
{
    struct remote_message *m = begin(e, now_ns);

    memcpy(m->u.plan, plan_text, plan_size);
    m->words.number = (uint32_t)plan_size;
    snprintf(m->words.name, sizeof m->words.name, "%s", start->name);
    return simple(e, REMOTE_START, m, error);
}

int lumi_engine_pause(struct lumi_engine *e, int64_t now_ns, struct lumi_error *error)
{
    return simple(e, REMOTE_PAUSE, begin(e, now_ns), error);
}

int lumi_engine_resume(struct lumi_engine *e, int64_t now_ns, struct lumi_error *error)
{
    return simple(e, REMOTE_RESUME, begin(e, now_ns), error);
}

int lumi_engine_clear(struct lumi_engine *e, int64_t now_ns, struct lumi_error *error)
{
    return simple(e, REMOTE_CLEAR, begin(e, now_ns), error);
}

int lumi_engine_retake(struct lumi_engine *e, int64_t now_ns, const char *capture, const char *const *frames,
                       struct lumi_error *error)
{
    struct remote_message *m = begin(e, now_ns);

    (void)frames;
    snprintf(m->words.name, sizeof m->words.name, "%s", capture);
    return simple(e, REMOTE_RETAKE, m, error);
}

int lumi_engine_recover(struct lumi_engine *e, int64_t now_ns, bool *found, struct lumi_error *error)
{
    int code = simple(e, REMOTE_RECOVER, begin(e, now_ns), error);

    *found = e->message.words.flag;
    return code;
}

void lumi_engine_status(const struct lumi_engine *engine, struct lumi_engine_status *status)
{
    struct lumi_engine *e = (struct lumi_engine *)(uintptr_t)engine;

    if (!e->calling && !e->dead)
        simple(e, REMOTE_STATUS, begin(e, e->now_ns), NULL);
    *status = e->status;
}
