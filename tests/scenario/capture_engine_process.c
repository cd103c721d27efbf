/* The engine's own process, for tests that kill it: usage capture_engine_process DESCRIPTOR */
#include "remote_engine.h"

#include <poll.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

static int fd;
static struct lumi_engine *engine;
static struct remote_message message;
static pthread_mutex_t writing = PTHREAD_MUTEX_INITIALIZER; /* frames are released and wakes come from other threads */

static void out(enum remote_op op, const void *data, size_t size)
{
    pthread_mutex_lock(&writing);
    bool good = remote_write(fd, op, data, size, NULL, 0);
    pthread_mutex_unlock(&writing);
    if (!good)
        _Exit(0); /* nobody is there any more */
}

/* ---- ports ---- */

static void port_request(void *context, uint32_t number, const lumi_wire_Request *request)
{
    static struct remote_message m;

    (void)context;
    m.words.number = number;
    m.u.request = *request;
    out(REMOTE_REQUEST, &m, sizeof m);
}

static void port_profile(void *context, uint32_t number)
{
    struct remote_words words = {.number = number};

    (void)context;
    out(REMOTE_PROFILE, &words, sizeof words);
}

static void port_stored(void *context, const lumi_wire_Event *event)
{
    static struct remote_message m;

    (void)context;
    m.u.event = *event;
    out(REMOTE_STORED, &m, sizeof m);
}

static void port_stop(void *context)
{
    struct remote_words words = {0};

    (void)context;
    out(REMOTE_STOP, &words, sizeof words);
}

static int64_t port_to_host(void *context, uint64_t board_ns)
{
    struct remote_words words = {.id = board_ns};
    struct remote_head head;

    (void)context;
    out(REMOTE_TO_HOST, &words, sizeof words);
    if (!remote_read(fd, &head, sizeof head) || !remote_read(fd, &words, sizeof words))
        _Exit(0);
    return words.at_ns;
}

static void port_camera(void *context, int camera, uint32_t number, const struct lumi_camera_command *command)
{
    static struct remote_message m;

    (void)context;
    m.words.camera = camera;
    m.words.number = number;
    m.u.command = *command;
    out(REMOTE_CAMERA, &m, sizeof m);
}

static void port_judge(void *context, const struct lumi_engine_judge_job *job)
{
    struct remote_words words = {.id = job->id, .camera = job->camera, .jobs = job->neighbour_count};

    (void)context;
    words.flag = job->frame->format.layout == LUMI_LAYOUT_FILE;
    if (words.flag) /* from the disk, after a recovery */
        strncpy(words.text, job->frame->path, sizeof words.text - 1);
    else
        words.number = (uint32_t)(uintptr_t)job->frame->owner;
    out(REMOTE_JUDGE, &words, sizeof words);
}

static void port_hand_over(void *context, const char *capture)
{
    struct remote_words words = {0};

    (void)context;
    strncpy(words.text, capture, sizeof words.text - 1);
    out(REMOTE_HAND_OVER, &words, sizeof words);
}

static void port_told(void *context, const struct lumi_engine_told *told)
{
    static struct remote_message m;

    (void)context;
    m.u.told = *told;
    out(REMOTE_TOLD, &m, sizeof m);
}

static void wake(void *context)
{
    struct remote_words words = {0};

    (void)context;
    out(REMOTE_WAKE, &words, sizeof words);
}

/* ---- calls ---- */

static void release(struct lumi_camera_frame *frame)
{
    struct remote_words words = {.number = (uint32_t)(uintptr_t)frame->owner};

    out(REMOTE_RELEASED, &words, sizeof words);
    free((void *)(uintptr_t)frame->data);
    free(frame);
}

static void camera_notice(const struct remote_message *m)
{
    struct lumi_camera_notice notice = m->u.camera;

    if (notice.frame) {
        struct lumi_camera_frame *frame = malloc(sizeof *frame);
        uint8_t *data = malloc(m->frame.size);
        *frame = m->frame;
        if (!remote_read(fd, data, frame->size))
            _Exit(0);
        frame->data = data;
        frame->path = NULL;
        frame->release = release;
        frame->owner = (void *)(uintptr_t)m->words.number;
        notice.frame = frame;
    }
    lumi_engine_camera_notice(engine, m->words.now_ns, m->words.camera, &notice);
}

static int create(struct remote_message *m, struct lumi_error *error)
{
    const struct lumi_engine_ports ports = {.rig_request = port_request,
                                            .rig_read_profile = port_profile,
                                            .rig_stored = port_stored,
                                            .rig_emergency_stop = port_stop,
                                            .rig_to_host = port_to_host,
                                            .camera_command = port_camera,
                                            .judge = port_judge,
                                            .hand_over = port_hand_over,
                                            .told = port_told};

    m->u.config.store.synchronous = false;
    m->u.config.store.disk = NULL;
    m->u.config.store.second_copy = NULL;
    m->u.config.store.wake = wake;
    m->u.config.store.context = NULL;
    return lumi_engine_create(&m->u.config, &ports, m->words.now_ns, &engine, error);
}

static void status(void)
{
    static struct lumi_engine_status s;

    lumi_engine_status(engine, &s);
    out(REMOTE_STATUS_IS, &s, sizeof s);
}

static int start(const struct remote_message *m, struct lumi_error *error)
{
    const struct lumi_engine_start how = {.name = m->words.name, .title = "killed"};

    return lumi_engine_start(engine, m->words.now_ns, m->u.plan, m->words.number, &how, error);
}

/* What happens. */
static void hear(enum remote_op op, const struct remote_message *m)
{
    const struct remote_words *w = &m->words;

    if (op == REMOTE_RUN)
        lumi_engine_run(engine, w->now_ns);
    else if (op == REMOTE_CLOCK)
        lumi_engine_clock(engine, w->at_ns);
    else if (op == REMOTE_RIG_NOTICE)
        lumi_engine_rig_notice(engine, w->now_ns, &m->u.notice);
    else if (op == REMOTE_RIG_REPLY)
        lumi_engine_rig_reply(engine, w->now_ns, w->number, w->code, w->text, w->flag ? &m->u.reply : NULL);
    else if (op == REMOTE_RIG_PROFILE)
        lumi_engine_rig_profile(engine, w->now_ns, w->number, w->code, w->text, w->flag ? &m->u.rig : NULL);
    else if (op == REMOTE_RIG_STATUS)
        lumi_engine_rig_status(engine, w->now_ns, &m->u.snapshot);
    else if (op == REMOTE_CAMERA_NOTICE)
        camera_notice(m);
    else if (op == REMOTE_SYNC_EDGE)
        lumi_engine_sync_edge(engine, w->now_ns, w->camera, w->at_ns, w->number);
    else if (op == REMOTE_JUDGED)
        lumi_engine_judged(engine, w->now_ns, w->id, w->code, w->text, w->flag ? &m->u.numbers : NULL, NULL);
    else if (op == REMOTE_DISK)
        lumi_engine_disk(engine, w->now_ns, w->at_ns, w->rate);
    else
        status();
}

static int obey(enum remote_op op, struct remote_message *m, bool *found, struct lumi_error *error)
{
    switch (op) {
    case REMOTE_CREATE:
        return create(m, error);
    case REMOTE_RECOVER:
        return lumi_engine_recover(engine, m->words.now_ns, found, error);
    case REMOTE_START:
        return start(m, error);
    case REMOTE_PAUSE:
        return lumi_engine_pause(engine, m->words.now_ns, error);
    case REMOTE_RESUME:
        return lumi_engine_resume(engine, m->words.now_ns, error);
    case REMOTE_CLEAR:
        return lumi_engine_clear(engine, m->words.now_ns, error);
    case REMOTE_RETAKE:
        return lumi_engine_retake(engine, m->words.now_ns, m->words.name, NULL, error);
    default:
        hear(op, m);
        return LUMI_OK;
    }
}

static void finish(int code, bool found, const struct lumi_error *error)
{
    static struct lumi_engine_status s;
    struct remote_words words = {.code = code, .flag = found};
    struct lumi_store *store = engine ? lumi_engine_store(engine) : NULL;
    struct lumi_store_figures figures = {0};

    if (store)
        lumi_store_figures(store, &figures);
    if (engine)
        lumi_engine_status(engine, &s);
    words.jobs = figures.jobs;
    words.camera = s.round;
    words.at_ns = engine ? lumi_engine_next(engine) : INT64_MAX;
    if (code)
        memcpy(words.text, error->text, sizeof words.text);
    out(REMOTE_END, &words, sizeof words);
}

int main(int argc, char **argv)
{
    struct remote_head head;

    if (argc != 2)
        return 2;
    fd = atoi(argv[1]);
    while (remote_read(fd, &head, sizeof head) && remote_read(fd, &message, sizeof message)) {
        struct lumi_error error = {0};
        bool found = false;
        int code = obey((enum remote_op)head.op, &message, &found, &error);
        finish(code, found, &error);
    }
    return 0;
}
