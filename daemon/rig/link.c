/* What other threads call. */
#include "daemon/rig/link.h"
#include "daemon/rig/link_priv.h"

#include <errno.h>
#include <fcntl.h>
#include <glib.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/random.h>
#include <time.h>
#include <unistd.h>

void lumi_rig_link_options_init(struct lumi_rig_link_options *options)
{
    *options = (struct lumi_rig_link_options){.patience = 2};
}

uint64_t lumi_rig_link_now(void)
{
    struct timespec now;

    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000000u + (uint64_t)now.tv_nsec;
}

static struct timespec deadline_in(double seconds)
{
    uint64_t at = lumi_rig_link_now() + (uint64_t)(seconds > 0 ? seconds * 1e9 : 0);

    return (struct timespec){.tv_sec = (time_t)(at / 1000000000u), .tv_nsec = (long)(at % 1000000000u)};
}

void lumi_rig_link_wake(struct lumi_rig_link *link)
{
    while (write(link->wake[1], "", 1) < 0 && errno == EINTR)
        ;
}

static int make_pipe(struct lumi_rig_link *link, struct lumi_error *error)
{
    if (pipe(link->wake))
        return lumi_fail_errno(error, "link", "pipe");
    for (int i = 0; i < 2; i++) {
        fcntl(link->wake[i], F_SETFD, FD_CLOEXEC);
        fcntl(link->wake[i], F_SETFL, O_NONBLOCK);
    }
    return LUMI_OK;
}

static uint64_t random_host(void)
{
    uint64_t host = 0;

    if (getrandom(&host, sizeof host, 0) != (ssize_t)sizeof host || !host)
        host = lumi_rig_link_now() ^ (uint64_t)getpid() << 40;
    return host ? host : 1;
}

/* Signals are for the program's own threads. */
static int start_thread(struct lumi_rig_link *link)
{
    sigset_t all, before;
    int failed;

    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    failed = pthread_create(&link->thread, NULL, lumi_rig_link_thread, link);
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    return failed;
}

int lumi_rig_link_open_stream(struct lumi_rig_stream *stream, const struct lumi_rig_link_options *options,
                              struct lumi_rig_link **result, struct lumi_error *error)
{
    struct lumi_rig_link *link = g_new0(struct lumi_rig_link, 1);
    pthread_condattr_t attributes;
    int code;

    *result = NULL;
    if (options)
        link->options = *options;
    else
        lumi_rig_link_options_init(&link->options);
    link->stream = stream;
    link->wake[0] = link->wake[1] = -1;
    pthread_mutex_init(&link->mutex, NULL);
    pthread_condattr_init(&attributes);
    pthread_condattr_setclock(&attributes, CLOCK_MONOTONIC);
    pthread_cond_init(&link->changed, &attributes);
    pthread_condattr_destroy(&attributes);
    lumi_clock_match_init(&link->clock);
    snprintf(link->snapshot.name, sizeof link->snapshot.name, "%s", stream->name);
    snprintf(link->snapshot.text, sizeof link->snapshot.text, "%s: not opened yet", stream->name);
    link->snapshot.code = LUMI_ERR_NOTFOUND;
    lumi_wire_client_init(&link->client, &lumi_rig_link_client_ops, link,
                          link->options.host ? link->options.host : random_host());
    link->client.observer = link->options.observer;
    link->client.holds = link->options.holds;
    LUMI_GOTO(code, fail, make_pipe(link, error));
    if (start_thread(link)) {
        code = lumi_fail(error, LUMI_ERR_IO, "%s: no thread could be started", stream->name);
        goto fail;
    }
    *result = link;
    return LUMI_OK;
fail:
    for (int i = 0; i < 2; i++)
        if (link->wake[i] >= 0)
            close(link->wake[i]);
    pthread_cond_destroy(&link->changed);
    pthread_mutex_destroy(&link->mutex);
    lumi_rig_stream_destroy(stream);
    g_free(link);
    return code;
}

int lumi_rig_link_open(const char *address, const struct lumi_rig_link_options *options, struct lumi_rig_link **link,
                       struct lumi_error *error)
{
    struct lumi_rig_stream *stream;

    *link = NULL;
    LUMI_TRY(lumi_rig_stream_create(address, &stream, error));
    return lumi_rig_link_open_stream(stream, options, link, error);
}

void lumi_rig_link_close(struct lumi_rig_link *link)
{
    if (!link)
        return;
    pthread_mutex_lock(&link->mutex);
    link->closing = true;
    lumi_rig_link_wake(link);
    pthread_mutex_unlock(&link->mutex);
    pthread_join(link->thread, NULL);
    while (link->first_notice) {
        struct lumi_rig_kept_notice *kept = link->first_notice;
        link->first_notice = kept->next;
        g_free(kept);
    }
    lumi_rig_stream_destroy(link->stream);
    close(link->wake[0]);
    close(link->wake[1]);
    pthread_cond_destroy(&link->changed);
    pthread_mutex_destroy(&link->mutex);
    g_free(link);
}

static bool hopeless(const struct lumi_rig_link *link)
{
    const struct lumi_rig_link_snapshot *snapshot = &link->snapshot;

    return snapshot->state == LUMI_RIG_LINK_VERSION || snapshot->state == LUMI_RIG_LINK_FOREIGN ||
           (snapshot->state == LUMI_RIG_LINK_CLOSED && link->attempts);
}

int lumi_rig_link_wait(struct lumi_rig_link *link, double seconds, bool eager, struct lumi_error *error)
{
    struct timespec deadline = deadline_in(seconds);
    int code = LUMI_OK;

    pthread_mutex_lock(&link->mutex);
    while (link->snapshot.state != LUMI_RIG_LINK_OPEN && !(eager && hopeless(link)))
        if (pthread_cond_timedwait(&link->changed, &link->mutex, &deadline))
            break;
    if (link->snapshot.state != LUMI_RIG_LINK_OPEN)
        code = lumi_fail(error, link->snapshot.code ? link->snapshot.code : LUMI_ERR_IO, "%s", link->snapshot.text);
    pthread_mutex_unlock(&link->mutex);
    return code;
}

/* A waiter gives up. Returns whether the request had gone out. */
static bool forget(struct lumi_rig_link *link, struct lumi_rig_pending *pending)
{
    if (link->in_flight == pending) {
        link->in_flight = NULL;
        return true;
    }
    for (struct lumi_rig_pending **at = &link->queue; *at; at = &(*at)->next)
        if (*at == pending) {
            *at = pending->next;
            break;
        }
    return false;
}

int lumi_rig_link_request(struct lumi_rig_link *link, const lumi_wire_Request *request, double seconds,
                          lumi_wire_Reply *reply, struct lumi_error *error)
{
    struct lumi_rig_pending pending = {.request = *request, .reply = reply, .error = error};
    struct timespec deadline = deadline_in(seconds);
    struct lumi_rig_pending **end;
    int code;

    pthread_mutex_lock(&link->mutex);
    for (end = &link->queue; *end; end = &(*end)->next)
        ;
    *end = &pending;
    lumi_rig_link_wake(link);
    while (!pending.done)
        if (pthread_cond_timedwait(&link->changed, &link->mutex, &deadline) && !pending.done)
            break;
    code = pending.code;
    if (!pending.done) {
        if (forget(link, &pending))
            code = lumi_fail(error, LUMI_ERR_IO,
                             "%s: no answer within %.3g s; whether the board has executed it is not known",
                             link->snapshot.name, seconds);
        else
            code = lumi_fail(error, LUMI_ERR_IO, "%s (waited %.3g s; this request was not sent)",
                             link->snapshot.state == LUMI_RIG_LINK_OPEN ? "the link is busy with other requests"
                                                                        : link->snapshot.text,
                             seconds);
    }
    pthread_mutex_unlock(&link->mutex);
    return code;
}

int lumi_rig_link_command(struct lumi_rig_link *link, const lumi_wire_Request *request, double seconds,
                          lumi_wire_Reply *reply, struct lumi_error *error)
{
    lumi_wire_Reply own;

    if (!reply)
        reply = &own;
    LUMI_TRY(lumi_rig_link_request(link, request, seconds, reply, error));
    return lumi_wire_reply_result(reply, error);
}

bool lumi_rig_link_emergency_stop(struct lumi_rig_link *link)
{
    bool sent;

    pthread_mutex_lock(&link->mutex);
    sent = link->snapshot.state != LUMI_RIG_LINK_CLOSED;
    link->stop_wanted = link->snapshot.stop_pending = true;
    lumi_rig_link_wake(link);
    pthread_mutex_unlock(&link->mutex);
    return sent;
}

void lumi_rig_link_take_charge(struct lumi_rig_link *link, bool charge)
{
    pthread_mutex_lock(&link->mutex);
    if (link->options.observer && link->client.observer == charge)
        lumi_wire_client_take_charge(&link->client, charge, lumi_rig_link_now());
    lumi_rig_link_wake(link);
    pthread_mutex_unlock(&link->mutex);
}

void lumi_rig_link_stored(struct lumi_rig_link *link, const lumi_wire_Event *event)
{
    pthread_mutex_lock(&link->mutex);
    if (link->client.holds) {
        lumi_wire_client_stored(&link->client, event->boot, event->number, lumi_rig_link_now());
        lumi_rig_link_wake(link);
    }
    pthread_mutex_unlock(&link->mutex);
}

bool lumi_rig_link_notice(struct lumi_rig_link *link, double seconds, struct lumi_rig_notice *notice)
{
    struct timespec deadline = deadline_in(seconds);
    struct lumi_rig_kept_notice *kept;

    pthread_mutex_lock(&link->mutex);
    while (!link->first_notice && seconds > 0)
        if (pthread_cond_timedwait(&link->changed, &link->mutex, &deadline))
            break;
    kept = link->first_notice;
    if (kept) {
        link->first_notice = kept->next;
        if (!kept->next)
            link->last_notice = NULL;
        link->notices--;
        *notice = kept->notice;
        /* It came before the clocks were matched: they may be by now. */
        if (notice->kind == LUMI_RIG_NOTICE_EVENT && !notice->host_ns && kept->boot == link->boot)
            notice->host_ns = lumi_clock_to_host(&link->clock, notice->event.time_ns);
    }
    pthread_mutex_unlock(&link->mutex);
    g_free(kept);
    return kept != NULL;
}

void lumi_rig_link_snapshot(struct lumi_rig_link *link, struct lumi_rig_link_snapshot *snapshot)
{
    uint64_t now = lumi_rig_link_now();

    pthread_mutex_lock(&link->mutex);
    *snapshot = link->snapshot;
    snapshot->retries = link->client.retries;
    snapshot->duplicates = link->client.duplicates;
    snapshot->damaged = link->client.deframer.errors;
    snapshot->clock_matched = lumi_clock_matched(&link->clock);
    if (snapshot->clock_matched) {
        snapshot->clock_offset_ns = (int64_t)(lumi_clock_to_board(&link->clock, now) - now);
        snapshot->clock_drift_known = link->clock.drift_known;
        snapshot->clock_drift_ppm = link->clock.drift * 1e6;
        snapshot->clock_residual_ns = link->clock.residual_ns;
        snapshot->round_trip_ns = link->clock.round_trip_ns;
    }
    pthread_mutex_unlock(&link->mutex);
}

uint64_t lumi_rig_link_to_host(struct lumi_rig_link *link, uint64_t board_ns)
{
    uint64_t host;

    pthread_mutex_lock(&link->mutex);
    host = lumi_clock_to_host(&link->clock, board_ns);
    pthread_mutex_unlock(&link->mutex);
    return host;
}
