/* Inbox and pools: a list under a lock each. */
#include "daemon/lumid/tasks.h"

#include <pthread.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/eventfd.h>
#include <unistd.h>

#define THREADS 64

struct list {
    struct lumi_task *first, **end;
    int count;
};

static void list_init(struct list *list)
{
    list->first = NULL;
    list->end = &list->first;
    list->count = 0;
}

static void list_add(struct list *list, struct lumi_task *task)
{
    task->next = NULL;
    *list->end = task;
    list->end = &task->next;
    list->count++;
}

static struct lumi_task *list_take(struct list *list)
{
    struct lumi_task *task = list->first;

    if (!task)
        return NULL;
    list->first = task->next;
    list->count--;
    if (!list->first)
        list->end = &list->first;
    return task;
}

static void list_free(struct list *list)
{
    for (struct lumi_task *task; (task = list_take(list));)
        free(task);
}

/* ---- inbox ---- */

struct lumi_inbox {
    pthread_mutex_t lock;
    struct list list;
    int fd;
};

int lumi_inbox_create(struct lumi_inbox **inbox, struct lumi_error *error)
{
    struct lumi_inbox *made = calloc(1, sizeof *made);

    if (!made)
        return lumi_fail(error, LUMI_ERR_NOMEM, "out of memory");
    made->fd = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    if (made->fd < 0) {
        free(made);
        return lumi_fail_errno(error, "lumid", "making an eventfd");
    }
    pthread_mutex_init(&made->lock, NULL);
    list_init(&made->list);
    *inbox = made;
    return LUMI_OK;
}

void lumi_inbox_destroy(struct lumi_inbox *inbox)
{
    if (!inbox)
        return;
    list_free(&inbox->list);
    pthread_mutex_destroy(&inbox->lock);
    close(inbox->fd);
    free(inbox);
}

int lumi_inbox_fd(const struct lumi_inbox *inbox)
{
    return inbox->fd;
}

void lumi_inbox_wake(void *context)
{
    const struct lumi_inbox *inbox = context;
    uint64_t one = 1;

    if (write(inbox->fd, &one, sizeof one) < 0)
        return; /* the counter is full: it is awake */
}

void lumi_inbox_post(struct lumi_inbox *inbox, struct lumi_task *task)
{
    pthread_mutex_lock(&inbox->lock);
    list_add(&inbox->list, task);
    pthread_mutex_unlock(&inbox->lock);
    lumi_inbox_wake(inbox);
}

void lumi_inbox_run(struct lumi_inbox *inbox)
{
    uint64_t wakes;
    struct list list;

    if (read(inbox->fd, &wakes, sizeof wakes) < 0)
        wakes = 0; /* nobody has woken it: nothing is lost by looking */
    list_init(&list);
    pthread_mutex_lock(&inbox->lock);
    for (struct lumi_task *task; (task = list_take(&inbox->list));)
        list_add(&list, task);
    pthread_mutex_unlock(&inbox->lock);
    for (struct lumi_task *task; (task = list_take(&list));) {
        task->done(task);
        free(task);
    }
}

/* ---- pools ---- */

struct lumi_pool {
    struct lumi_inbox *inbox;
    pthread_mutex_t lock;
    pthread_cond_t come;
    struct list list;
    int limit, count;
    bool ending;
    pthread_t threads[THREADS];
};

static void *labour(void *context)
{
    struct lumi_pool *pool = context;

    pthread_mutex_lock(&pool->lock);
    while (!pool->ending) {
        struct lumi_task *task = list_take(&pool->list);
        if (!task) {
            pthread_cond_wait(&pool->come, &pool->lock);
            continue;
        }
        pthread_mutex_unlock(&pool->lock);
        task->work(task);
        lumi_inbox_post(pool->inbox, task);
        pthread_mutex_lock(&pool->lock);
    }
    pthread_mutex_unlock(&pool->lock);
    return NULL;
}

int lumi_pool_create(struct lumi_inbox *inbox, int threads, int limit, struct lumi_pool **pool,
                     struct lumi_error *error)
{
    struct lumi_pool *made = calloc(1, sizeof *made);

    if (!made)
        return lumi_fail(error, LUMI_ERR_NOMEM, "out of memory");
    made->inbox = inbox;
    made->limit = limit;
    pthread_mutex_init(&made->lock, NULL);
    pthread_cond_init(&made->come, NULL);
    list_init(&made->list);
    for (int i = 0; i < threads && i < THREADS; i++) {
        if (pthread_create(&made->threads[i], NULL, labour, made) != 0) {
            lumi_pool_destroy(made);
            return lumi_fail(error, LUMI_ERR_NOMEM, "no thread can be started");
        }
        made->count++;
    }
    *pool = made;
    return LUMI_OK;
}

bool lumi_pool_give(struct lumi_pool *pool, struct lumi_task *task)
{
    pthread_mutex_lock(&pool->lock);
    bool room = pool->list.count < pool->limit;
    if (room) {
        list_add(&pool->list, task);
        pthread_cond_signal(&pool->come);
    }
    pthread_mutex_unlock(&pool->lock);
    return room;
}

void lumi_pool_destroy(struct lumi_pool *pool)
{
    if (!pool)
        return;
    pthread_mutex_lock(&pool->lock);
    pool->ending = true;
    pthread_cond_broadcast(&pool->come);
    pthread_mutex_unlock(&pool->lock);
    for (int i = 0; i < pool->count; i++)
        pthread_join(pool->threads[i], NULL);
    list_free(&pool->list);
    pthread_cond_destroy(&pool->come);
    pthread_mutex_destroy(&pool->lock);
    free(pool);
}
