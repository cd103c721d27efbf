/* One thread for what would hold the server up. */
#include "daemon/http/api_worker.h"

#include <pthread.h>

#define WAITING_MAX 16

struct lumi_api_worker {
    struct lumi_api_post *back;
    pthread_t thread;
    pthread_mutex_t lock;
    pthread_cond_t wake;
    struct lumi_api_job *first, **last; /* under the lock, as `count` and `end` are */
    int count;                          /* that wait, or are being done */
    bool end;
};

static struct lumi_api_job *take(struct lumi_api_worker *worker)
{
    struct lumi_api_job *job = worker->first;

    if (job && !(worker->first = job->next))
        worker->last = &worker->first;
    return job;
}

static void *run(void *context)
{
    struct lumi_api_worker *worker = context;

    pthread_mutex_lock(&worker->lock);
    while (!worker->end) {
        struct lumi_api_job *job = take(worker);
        if (!job) {
            pthread_cond_wait(&worker->wake, &worker->lock);
            continue;
        }
        pthread_mutex_unlock(&worker->lock);
        job->work(job);
        lumi_api_post_give(worker->back, &job->letter);
        pthread_mutex_lock(&worker->lock);
        worker->count--;
    }
    pthread_mutex_unlock(&worker->lock);
    return NULL;
}

int lumi_api_worker_create(struct lumi_api_post *back, struct lumi_api_worker **worker, struct lumi_error *error)
{
    struct lumi_api_worker *made = g_new0(struct lumi_api_worker, 1);

    made->back = back;
    made->last = &made->first;
    pthread_mutex_init(&made->lock, NULL);
    pthread_cond_init(&made->wake, NULL);
    if (pthread_create(&made->thread, NULL, run, made)) {
        g_free(made);
        return lumi_fail(error, LUMI_ERR_NOMEM, "HTTP: no thread could be started");
    }
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
    while ((job = take(worker)))
        job->letter.read(&job->letter, true);
    pthread_cond_destroy(&worker->wake);
    pthread_mutex_destroy(&worker->lock);
    g_free(worker);
}

bool lumi_api_worker_give(struct lumi_api_worker *worker, struct lumi_api_job *job)
{
    bool taken;

    job->next = NULL;
    pthread_mutex_lock(&worker->lock);
    taken = worker->count < WAITING_MAX;
    if (taken) {
        worker->count++;
        *worker->last = job;
        worker->last = &job->next;
        pthread_cond_signal(&worker->wake);
    }
    pthread_mutex_unlock(&worker->lock);
    return taken;
}
