/* One thread for what would hold the main loop up. */
#include "daemon/http/api_worker.h"

#include <glib-unix.h>
#include <pthread.h>
#include <unistd.h>

#define WAITING_MAX 16

struct queue {
    struct lumi_api_job *first, **last;
};

struct lumi_api_worker {
    pthread_t thread;
    pthread_mutex_t lock;
    pthread_cond_t wake;
    struct queue waiting, finished; /* under the lock, as `count` and `end` are */
    int count;
    bool end;
    int pipe[2];
    guint source;
};

static void put(struct queue *queue, struct lumi_api_job *job)
{
    job->next = NULL;
    *queue->last = job;
    queue->last = &job->next;
}

static struct lumi_api_job *take(struct queue *queue)
{
    struct lumi_api_job *job = queue->first;

    if (job && !(queue->first = job->next))
        queue->last = &queue->first;
    return job;
}

static void *run(void *context)
{
    struct lumi_api_worker *worker = context;

    pthread_mutex_lock(&worker->lock);
    while (!worker->end) {
        struct lumi_api_job *job = take(&worker->waiting);
        if (!job) {
            pthread_cond_wait(&worker->wake, &worker->lock);
            continue;
        }
        pthread_mutex_unlock(&worker->lock);
        job->work(job);
        pthread_mutex_lock(&worker->lock);
        put(&worker->finished, job);
        if (write(worker->pipe[1], "", 1) < 0) {
            /* full: the main loop is told already */
        }
    }
    pthread_mutex_unlock(&worker->lock);
    return NULL;
}

static void tell(struct lumi_api_worker *worker)
{
    for (;;) {
        pthread_mutex_lock(&worker->lock);
        struct lumi_api_job *job = take(&worker->finished);
        if (job)
            worker->count--;
        pthread_mutex_unlock(&worker->lock);
        if (!job)
            return;
        job->done(job);
    }
}

static gboolean on_pipe(int fd, GIOCondition condition, void *context)
{
    char bytes[64];

    (void)condition;
    if (read(fd, bytes, sizeof bytes) > 0)
        tell(context);
    return G_SOURCE_CONTINUE;
}

int lumi_api_worker_create(struct lumi_api_worker **worker, struct lumi_error *error)
{
    struct lumi_api_worker *made = g_new0(struct lumi_api_worker, 1);
    g_autoptr(GError) failed = NULL;

    if (!g_unix_open_pipe(made->pipe, FD_CLOEXEC, &failed)) {
        g_free(made);
        return lumi_fail(error, LUMI_ERR_IO, "HTTP: %s", failed->message);
    }
    g_unix_set_fd_nonblocking(made->pipe[0], TRUE, NULL);
    g_unix_set_fd_nonblocking(made->pipe[1], TRUE, NULL);
    made->waiting.last = &made->waiting.first;
    made->finished.last = &made->finished.first;
    pthread_mutex_init(&made->lock, NULL);
    pthread_cond_init(&made->wake, NULL);
    if (pthread_create(&made->thread, NULL, run, made)) {
        close(made->pipe[0]);
        close(made->pipe[1]);
        g_free(made);
        return lumi_fail(error, LUMI_ERR_NOMEM, "HTTP: no thread could be started");
    }
    made->source = g_unix_fd_add(made->pipe[0], G_IO_IN, on_pipe, made);
    *worker = made;
    return LUMI_OK;
}

void lumi_api_worker_destroy(struct lumi_api_worker *worker)
{
    struct lumi_api_job *job;

    if (!worker)
        return;
    pthread_mutex_lock(&worker->lock);
    worker->end = true;
    pthread_cond_signal(&worker->wake);
    pthread_mutex_unlock(&worker->lock);
    pthread_join(worker->thread, NULL);
    g_source_remove(worker->source);
    tell(worker);
    while ((job = take(&worker->waiting)))
        job->done(job);
    close(worker->pipe[0]);
    close(worker->pipe[1]);
    pthread_cond_destroy(&worker->wake);
    pthread_mutex_destroy(&worker->lock);
    g_free(worker);
}

bool lumi_api_worker_give(struct lumi_api_worker *worker, struct lumi_api_job *job)
{
    bool taken;

    pthread_mutex_lock(&worker->lock);
    taken = worker->count < WAITING_MAX;
    if (taken) {
        worker->count++;
        put(&worker->waiting, job);
        pthread_cond_signal(&worker->wake);
    }
    pthread_mutex_unlock(&worker->lock);
    return taken;
}
