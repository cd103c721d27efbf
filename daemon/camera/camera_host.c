/* The thread around one camera. Everything about the camera itself is that thread's alone; it shares with the others
 * the commands and the notices, under one lock, and a descriptor that wakes it. */
#include "daemon/camera/camera_host.h"
#include "daemon/camera/camera_priv.h"
#include "proto/base/memory.h"

#include <errno.h>
#include <pthread.h>
#include <stdio.h>
#include <string.h>
#include <sys/eventfd.h>
#include <unistd.h>

#define STATUS_NS 1000000000
#define ASK_MS 4         /* a camera without descriptors is asked this often */
#define FRAMES_AT_ONCE 8 /* then commands have their turn */

struct entry { /* of either queue; a command's becomes the notice that it is done */
    struct entry *next;
    struct lumi_camera_notice notice;
    struct lumi_camera_command command;
};
struct queue {
    struct entry *first, *last;
};
struct lumi_camera_host {
    lumi_camera_open_fn open;
    void *open_context;
    char *address;
    struct lumi_camera_host_options options;
    pthread_t thread;
    int wake_fd;

    pthread_mutex_t lock; /* of these: */
    struct queue commands, notices;
    int frames_waiting;
    struct entry *status_waiting; /* is in `notices`: a newer one replaces it */
    bool stopping;

    /* the thread's own: */
    struct lumi_camera *camera;
    struct entry *gone;      /* for when it goes: memory is had while it is there */
    bool told_away;          /* that it is not there */
    int away_code;           /* as which */
    struct lumi_error fault; /* of frames, since the last status */
    int64_t next_status_ns, next_open_ns;
    uint64_t frames_dropped; /* because nobody took them, since armed */
    uint32_t not_taken;      /* of these, since the last that was kept, and gaps before them */
    /* what it is set to, or is to be when it is back: */
    bool configured, armed, exposed;
    struct lumi_camera_setting setting;
    double exposure_s, gain;
};

void lumi_camera_host_options_init(struct lumi_camera_host_options *options)
{
    *options = (struct lumi_camera_host_options){.frames_max = 16, .retry_ms = 500};
}

/* ---- queues ---- */

static void push(struct queue *queue, struct entry *entry)
{
    entry->next = NULL;
    if (queue->last)
        queue->last->next = entry;
    else
        queue->first = entry;
    queue->last = entry;
}

static struct entry *pop(struct queue *queue)
{
    struct entry *entry = queue->first;

    if (entry) {
        queue->first = entry->next;
        if (!queue->first)
            queue->last = NULL;
    }
    return entry;
}

static struct entry *entry_new(enum lumi_camera_notice_kind kind)
{
    struct entry *entry = lumi_calloc(1, sizeof *entry);

    if (entry)
        entry->notice.kind = kind;
    return entry;
}

static void tell(struct lumi_camera_host *host, struct entry *entry)
{
    entry->notice.host_ns = camera_now_ns();
    pthread_mutex_lock(&host->lock);
    push(&host->notices, entry);
    pthread_mutex_unlock(&host->lock);
    if (host->options.wake)
        host->options.wake(host->options.context);
}

static void entry_result(struct entry *entry, int code, const struct lumi_error *error)
{
    entry->notice.code = code;
    if (code != LUMI_OK)
        snprintf(entry->notice.text, sizeof entry->notice.text, "%.*s", (int)sizeof entry->notice.text - 1,
                 error->text);
}

static void nudge(struct lumi_camera_host *host)
{
    const uint64_t one = 1;

    while (write(host->wake_fd, &one, sizeof one) < 0 && errno == EINTR)
        ;
}

/* ---- there and away ---- */

static void went(struct lumi_camera_host *host, int code, const struct lumi_error *error)
{
    struct entry *entry = host->gone;

    host->gone = NULL;
    if (host->camera)
        lumi_camera_close(host->camera);
    host->camera = NULL;
    host->next_open_ns = camera_now_ns() + (int64_t)host->options.retry_ms * 1000000;
    if (host->told_away && host->away_code == code) {
        lumi_free(entry);
        return;
    }
    if (!entry)
        entry = entry_new(LUMI_CAMERA_GONE);
    if (!entry)
        return; /* told at the next attempt */
    host->told_away = true;
    host->away_code = code;
    entry_result(entry, code, error);
    tell(host, entry);
}

/* As it was before it went. */
static int restore(struct lumi_camera_host *host, struct lumi_error *error)
{
    struct lumi_camera *camera = host->camera;

    if (host->configured)
        LUMI_TRY(camera->ops->configure(camera, &host->setting, error));
    if (host->exposed && camera->ops->expose) /* before it is armed: its first frame is to have it */
        LUMI_TRY(camera->ops->expose(camera, host->exposure_s, host->gain, error));
    if (host->armed)
        LUMI_TRY(camera->ops->arm(camera, error));
    return LUMI_OK;
}

static void try_open(struct lumi_camera_host *host)
{
    struct lumi_error error = {0};
    struct entry *came;
    int code = host->open(host->open_context, &host->camera, &error);

    if (code != LUMI_OK) {
        host->camera = NULL;
        went(host, code, &error);
        return;
    }
    code = restore(host, &error);
    if (code != LUMI_OK) {
        lumi_fail_prefix(&error, "camera %s is back, but", host->camera->identity.serial);
        went(host, code, &error);
        return;
    }
    came = entry_new(LUMI_CAMERA_CAME);
    host->gone = entry_new(LUMI_CAMERA_GONE);
    if (!came || !host->gone) {
        lumi_free(came);
        went(host, lumi_fail(&error, LUMI_ERR_NOMEM, "camera %s: no memory", host->camera->identity.serial), &error);
        return;
    }
    host->told_away = false;
    host->frames_dropped = 0;
    host->not_taken = 0;
    host->next_status_ns = 0;
    came->notice.identity = host->camera->identity;
    tell(host, came);
}

/* ---- status ---- */

static void tell_status(struct lumi_camera_host *host)
{
    struct lumi_camera_status status;
    struct lumi_error error = {0};
    struct entry *entry, *fresh;
    int code;

    memset(&status, 0, sizeof status);
    code = host->camera->ops->status(host->camera, &status, &error);
    host->next_status_ns = camera_now_ns() + STATUS_NS;
    if (code == LUMI_ERR_IO) {
        went(host, code, &error);
        return;
    }
    if (code != LUMI_OK) {
        host->fault = error;
        host->fault.code = code;
    }
    status.dropped += host->frames_dropped;
    fresh = entry_new(LUMI_CAMERA_STATUS);
    pthread_mutex_lock(&host->lock);
    entry = host->status_waiting;
    if (!entry && fresh) {
        entry = host->status_waiting = fresh;
        push(&host->notices, fresh);
        fresh = NULL;
    }
    if (entry) { /* without memory the next one tells it */
        entry->notice.host_ns = camera_now_ns();
        entry->notice.status = status;
        if (host->fault.code != LUMI_OK)
            entry_result(entry, host->fault.code, &host->fault);
        host->fault = (struct lumi_error){0};
    }
    pthread_mutex_unlock(&host->lock);
    lumi_free(fresh);
    if (host->options.wake)
        host->options.wake(host->options.context);
}

/* ---- commands ---- */

static int execute(struct lumi_camera_host *host, const struct lumi_camera_command *command, struct lumi_error *error)
{
    struct lumi_camera *camera = host->camera;

    switch (command->kind) {
    case LUMI_CAMERA_CONFIGURE:
        LUMI_TRY(camera->ops->configure(camera, &command->setting, error));
        host->configured = true;
        host->armed = host->exposed = false;
        host->setting = command->setting;
        return LUMI_OK;
    case LUMI_CAMERA_ARM:
        LUMI_TRY(camera->ops->arm(camera, error));
        host->armed = true;
        host->frames_dropped = 0;
        host->not_taken = 0;
        return LUMI_OK;
    case LUMI_CAMERA_DISARM:
        host->armed = false; /* even where it fails: it is not to come back armed */
        return camera->ops->disarm(camera, error);
    case LUMI_CAMERA_TRIGGER:
        return camera->ops->trigger(camera, error);
    case LUMI_CAMERA_EXPOSE:
        if (!camera->ops->expose)
            return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "camera %s: exposure cannot be set", camera->identity.serial);
        LUMI_TRY(camera->ops->expose(camera, command->exposure_s, command->gain, error));
        host->exposed = true;
        host->exposure_s = command->exposure_s;
        host->gain = command->gain;
        return LUMI_OK;
    }
    return lumi_fail(error, LUMI_ERR_ARG, "camera command %d: there is no such command", (int)command->kind);
}

static bool waits_for_camera(const struct lumi_camera_command *command)
{
    return command->kind == LUMI_CAMERA_CONFIGURE || command->kind == LUMI_CAMERA_ARM ||
           command->kind == LUMI_CAMERA_DISARM;
}

/* The next that can be done now, out of the queue: with the camera the first one, without it the first that fails. */
static struct entry *next_command(struct lumi_camera_host *host)
{
    struct entry *before = NULL, *entry;

    pthread_mutex_lock(&host->lock);
    entry = host->commands.first;
    while (!host->camera && entry && waits_for_camera(&entry->command)) {
        before = entry;
        entry = entry->next;
    }
    if (entry && before) {
        before->next = entry->next;
        if (host->commands.last == entry)
            host->commands.last = before;
    } else if (entry) {
        pop(&host->commands);
    }
    pthread_mutex_unlock(&host->lock);
    return entry;
}

static void do_commands(struct lumi_camera_host *host)
{
    struct entry *entry;
    bool done = false;

    while ((entry = next_command(host)) != NULL) {
        struct lumi_error error = {0};
        int code;

        if (host->camera) {
            code = execute(host, &entry->command, &error);
            done = true;
        } else {
            code = lumi_fail(&error, LUMI_ERR_NOTFOUND, "camera %s is away", host->address ? host->address : "");
        }
        entry_result(entry, code, &error);
        tell(host, entry);
    }
    if (done && host->camera)
        tell_status(host);
}

/* ---- frames ---- */

static void keep_frame(struct lumi_camera_host *host, struct lumi_camera_frame *frame)
{
    struct entry *entry = entry_new(LUMI_CAMERA_FRAME);
    bool kept = false;

    frame->gap += host->not_taken;
    pthread_mutex_lock(&host->lock);
    if (entry && host->frames_waiting < host->options.frames_max) {
        entry->notice.host_ns = camera_now_ns();
        entry->notice.frame = frame;
        push(&host->notices, entry);
        host->frames_waiting++;
        kept = true;
    }
    pthread_mutex_unlock(&host->lock);
    host->not_taken = kept ? 0 : frame->gap + 1;
    if (kept) {
        if (host->options.wake)
            host->options.wake(host->options.context);
        return;
    }
    host->frames_dropped++;
    lumi_free(entry);
    lumi_camera_frame_release(frame);
}

/* What such a camera has recorded can wait. */
static bool can_wait(struct lumi_camera_host *host)
{
    bool full;

    pthread_mutex_lock(&host->lock);
    full = host->frames_waiting >= host->options.frames_max;
    pthread_mutex_unlock(&host->lock);
    return full && host->camera->identity.records_itself;
}

static void take_frames(struct lumi_camera_host *host)
{
    for (int i = 0; i < FRAMES_AT_ONCE && !can_wait(host); i++) {
        struct lumi_camera_frame *frame = NULL;
        struct lumi_error error = {0};
        int code = host->camera->ops->frame(host->camera, &frame, &error);

        if (code == LUMI_ERR_IO) {
            went(host, code, &error);
            return;
        }
        if (code != LUMI_OK) {
            host->fault = error;
            host->fault.code = code;
        }
        if (!frame)
            return;
        keep_frame(host, frame);
    }
}

/* ---- the thread ---- */

static int wait_ms(int64_t until_ns)
{
    const int64_t left = until_ns - camera_now_ns();

    return left <= 0 ? 0 : left > 10000000000 ? 10000 : (int)((left + 999999) / 1000000);
}

static void wait(struct lumi_camera_host *host)
{
    struct pollfd fds[1 + LUMI_CAMERA_POLL] = {{.fd = host->wake_fd, .events = POLLIN}};
    int count = 0, timeout;
    uint64_t ignored;

    if (!host->camera) {
        timeout = wait_ms(host->next_open_ns);
    } else {
        if (host->armed && !can_wait(host))
            count = host->camera->ops->poll_fds(host->camera, fds + 1, LUMI_CAMERA_POLL);
        timeout = wait_ms(host->next_status_ns);
        if (host->armed && count == 0 && timeout > ASK_MS)
            timeout = ASK_MS;
    }
    if (poll(fds, 1 + (nfds_t)count, timeout) > 0 && (fds[0].revents & POLLIN))
        while (read(host->wake_fd, &ignored, sizeof ignored) < 0 && errno == EINTR)
            ;
}

static bool stopping(struct lumi_camera_host *host)
{
    bool yes;

    pthread_mutex_lock(&host->lock);
    yes = host->stopping;
    pthread_mutex_unlock(&host->lock);
    return yes;
}

static void *run(void *argument)
{
    struct lumi_camera_host *host = argument;

    while (!stopping(host)) {
        if (!host->camera && camera_now_ns() >= host->next_open_ns)
            try_open(host);
        do_commands(host);
        if (host->camera && host->armed)
            take_frames(host);
        if (host->camera && camera_now_ns() >= host->next_status_ns)
            tell_status(host);
        wait(host);
    }
    lumi_camera_close(host->camera);
    host->camera = NULL;
    return NULL;
}

/* ---- what others call ---- */

static int open_address(void *context, struct lumi_camera **camera, struct lumi_error *error)
{
    struct lumi_camera_host *host = context;

    return lumi_camera_open(host->address, camera, error);
}

static int start(const char *address, lumi_camera_open_fn open, void *open_context,
                 const struct lumi_camera_host_options *options, struct lumi_camera_host **made,
                 struct lumi_error *error)
{
    struct lumi_camera_host *host = lumi_calloc(1, sizeof *host);
    int code = LUMI_ERR_NOMEM;

    *made = NULL;
    if (!host)
        return lumi_fail(error, code, "camera: no memory for its thread");
    host->open = open ? open : open_address;
    host->open_context = open ? open_context : host;
    host->options = *options;
    if (address) {
        host->address = lumi_calloc(1, strlen(address) + 1);
        if (!host->address) {
            lumi_fail(error, code, "camera %s: no memory", address);
            goto no_address;
        }
        memcpy(host->address, address, strlen(address));
    }
    host->wake_fd = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    if (host->wake_fd < 0) {
        code = lumi_fail_errno(error, address ? address : "camera", "making an eventfd");
        goto no_eventfd;
    }
    pthread_mutex_init(&host->lock, NULL);
    errno = pthread_create(&host->thread, NULL, run, host);
    if (errno) {
        code = lumi_fail_errno(error, address ? address : "camera", "starting its thread");
        goto no_thread;
    }
    *made = host;
    return LUMI_OK;
no_thread:
    pthread_mutex_destroy(&host->lock);
    close(host->wake_fd);
no_eventfd:
    lumi_free(host->address);
no_address:
    lumi_free(host);
    return code;
}

int lumi_camera_host_start(const char *address, const struct lumi_camera_host_options *options,
                           struct lumi_camera_host **host, struct lumi_error *error)
{
    *host = NULL;
    LUMI_TRY(lumi_camera_address_check(address, error));
    return start(address, NULL, NULL, options, host, error);
}

int lumi_camera_host_start_with(lumi_camera_open_fn open, void *open_context,
                                const struct lumi_camera_host_options *options, struct lumi_camera_host **host,
                                struct lumi_error *error)
{
    return start(NULL, open, open_context, options, host, error);
}

static void empty(struct queue *queue)
{
    struct entry *entry;

    while ((entry = pop(queue)) != NULL) {
        lumi_camera_frame_release(entry->notice.frame);
        lumi_free(entry);
    }
}

void lumi_camera_host_stop(struct lumi_camera_host *host)
{
    if (!host)
        return;
    pthread_mutex_lock(&host->lock);
    host->stopping = true;
    pthread_mutex_unlock(&host->lock);
    nudge(host);
    pthread_join(host->thread, NULL);
    empty(&host->commands);
    empty(&host->notices);
    lumi_free(host->gone);
    pthread_mutex_destroy(&host->lock);
    close(host->wake_fd);
    lumi_free(host->address);
    lumi_free(host);
}

int lumi_camera_host_command(struct lumi_camera_host *host, uint32_t number, const struct lumi_camera_command *command)
{
    struct entry *entry = entry_new(LUMI_CAMERA_DONE);

    if (!entry)
        return LUMI_ERR_NOMEM;
    entry->notice.command = number;
    entry->command = *command;
    pthread_mutex_lock(&host->lock);
    push(&host->commands, entry);
    pthread_mutex_unlock(&host->lock);
    nudge(host);
    return LUMI_OK;
}

bool lumi_camera_host_notice(struct lumi_camera_host *host, struct lumi_camera_notice *notice)
{
    struct entry *entry;

    pthread_mutex_lock(&host->lock);
    entry = pop(&host->notices);
    if (entry && entry == host->status_waiting)
        host->status_waiting = NULL;
    if (entry && entry->notice.kind == LUMI_CAMERA_FRAME)
        host->frames_waiting--;
    pthread_mutex_unlock(&host->lock);
    if (!entry)
        return false;
    *notice = entry->notice;
    lumi_free(entry);
    return true;
}
