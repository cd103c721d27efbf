/* A parallel loop over pthreads: items are handed out by one atomic counter. */
#define _GNU_SOURCE /* sched_getaffinity, CPU_COUNT */
#include "proto/base/parallel.h"

#include "proto/base/result.h"

#include <pthread.h>
#include <sched.h>
#include <stdatomic.h>
#include <unistd.h>

#define MAX_THREADS 256

struct loop {
    lumi_parallel_fn fn;
    void *context;
    int count;
    atomic_int next;
    atomic_int failed_index; /* lowest index that failed, or count */
    pthread_mutex_t lock;    /* guards code */
    int code;
};

struct worker {
    struct loop *loop;
    int thread;
    pthread_t handle;
};

static void note_failure(struct loop *loop, int index, int code)
{
    pthread_mutex_lock(&loop->lock);
    if (index < atomic_load(&loop->failed_index)) {
        atomic_store(&loop->failed_index, index);
        loop->code = code;
    }
    pthread_mutex_unlock(&loop->lock);
}

static void *work(void *argument)
{
    struct worker *worker = argument;
    struct loop *loop = worker->loop;

    for (;;) {
        int index = atomic_fetch_add(&loop->next, 1);
        if (index >= loop->count || index > atomic_load(&loop->failed_index))
            return NULL;
        int code = loop->fn(loop->context, index, worker->thread);
        if (code != LUMI_OK)
            note_failure(loop, index, code);
    }
}

int lumi_thread_count(void)
{
    long count = sysconf(_SC_NPROCESSORS_ONLN);
    cpu_set_t set;

    if (!sched_getaffinity(0, sizeof set, &set))
        count = CPU_COUNT(&set);
    return count < 1 ? 1 : count > MAX_THREADS ? MAX_THREADS : (int)count;
}

int lumi_parallel_for(int count, int threads, lumi_parallel_fn fn, void *context)
{
    struct loop loop = {.fn = fn, .context = context, .count = count, .code = LUMI_OK};
    struct worker workers[MAX_THREADS];
    int started = 1;

    if (count <= 0)
        return LUMI_OK;
    if (threads <= 0)
        threads = lumi_thread_count();
    if (threads > count)
        threads = count;
    if (threads > MAX_THREADS)
        threads = MAX_THREADS;
    atomic_init(&loop.next, 0);
    atomic_init(&loop.failed_index, count);
    pthread_mutex_init(&loop.lock, NULL);
    for (int i = 0; i < threads; i++)
        workers[i] = (struct worker){.loop = &loop, .thread = i};
    while (started < threads && !pthread_create(&workers[started].handle, NULL, work, &workers[started]))
        started++;
    work(&workers[0]);
    for (int i = 1; i < started; i++)
        pthread_join(workers[i].handle, NULL);
    pthread_mutex_destroy(&loop.lock);
    return loop.code;
}
