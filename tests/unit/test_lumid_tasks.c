/* daemon/lumid's pools and inbox: everything is done once, in order, and comes back to one thread. */
#include "daemon/lumid/tasks.h"

#include <poll.h>
#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

struct counted {
    struct lumi_task task;
    int number;
    bool worked;
};

static struct lumi_inbox *inbox;
static atomic_int worked, order_broken;
static int done, next_done, in_loop_thread;
static pthread_t loop_thread;
static pthread_mutex_t gate = PTHREAD_MUTEX_INITIALIZER;

static void work(struct lumi_task *task)
{
    struct counted *counted = (struct counted *)task;

    pthread_mutex_lock(&gate);
    pthread_mutex_unlock(&gate);
    counted->worked = true;
    if (atomic_fetch_add(&worked, 1) != counted->number)
        atomic_store(&order_broken, 1);
}

static void finished(struct lumi_task *task)
{
    struct counted *counted = (struct counted *)task;

    if (counted->number != next_done++)
        atomic_store(&order_broken, 1);
    done += counted->worked;
    in_loop_thread += pthread_equal(pthread_self(), loop_thread) != 0;
}

static struct lumi_task *task_of(int number)
{
    struct counted *made = calloc(1, sizeof *made);

    assert_non_null(made);
    made->number = number;
    made->task.work = work;
    made->task.done = finished;
    return &made->task;
}

static void run_until(const int *count, int wanted)
{
    while (*count < wanted) {
        struct pollfd fd = {.fd = lumi_inbox_fd(inbox), .events = POLLIN};
        assert_int_equal(poll(&fd, 1, 60000), 1);
        lumi_inbox_run(inbox);
    }
}

static int set_up(void **state)
{
    struct lumi_error error = {0};

    (void)state;
    atomic_store(&worked, 0);
    atomic_store(&order_broken, 0);
    done = next_done = in_loop_thread = 0;
    loop_thread = pthread_self();
    return lumi_inbox_create(&inbox, &error);
}

static int tear_down(void **state)
{
    (void)state;
    lumi_inbox_destroy(inbox);
    return 0;
}

static void one_thread_does_all_in_order(void **state)
{
    struct lumi_pool *pool = NULL;

    (void)state;
    assert_int_equal(lumi_pool_create(inbox, 1, 1000, &pool, NULL), LUMI_OK);
    for (int i = 0; i < 1000; i++)
        assert_true(lumi_pool_give(pool, task_of(i)));
    run_until(&done, 1000);
    assert_int_equal(atomic_load(&order_broken), 0);
    assert_int_equal(in_loop_thread, 1000);
    lumi_pool_destroy(pool);
}

static void several_threads_do_each_once(void **state)
{
    struct lumi_pool *pool = NULL;

    (void)state;
    assert_int_equal(lumi_pool_create(inbox, 4, 1000, &pool, NULL), LUMI_OK);
    for (int i = 0; i < 1000; i++)
        assert_true(lumi_pool_give(pool, task_of(i)));
    run_until(&done, 1000);
    assert_int_equal(atomic_load(&worked), 1000);
    assert_int_equal(in_loop_thread, 1000);
    lumi_pool_destroy(pool);
}

static void what_is_over_the_limit_is_refused(void **state)
{
    struct lumi_pool *pool = NULL;
    int taken = 0;

    (void)state;
    assert_int_equal(lumi_pool_create(inbox, 1, 3, &pool, NULL), LUMI_OK);
    pthread_mutex_lock(&gate);
    struct lumi_task *over = task_of(0);
    while (taken < 10 && lumi_pool_give(pool, over))
        over = task_of(++taken);
    pthread_mutex_unlock(&gate);
    assert_true(taken == 3 || taken == 4); /* the thread may hold one of them */
    free(over);
    run_until(&done, taken);
    lumi_pool_destroy(pool);
}

/* What nobody has begun is not done, and neither lost memory nor called back. */
static void a_pool_that_ends_drops_what_waits(void **state)
{
    struct lumi_pool *pool = NULL;

    (void)state;
    assert_int_equal(lumi_pool_create(inbox, 1, 100, &pool, NULL), LUMI_OK);
    for (int i = 0; i < 100; i++)
        assert_true(lumi_pool_give(pool, task_of(i)));
    lumi_pool_destroy(pool);
    lumi_inbox_run(inbox);
    assert_int_equal(done, atomic_load(&worked));
}

static void a_wake_is_seen_and_taken(void **state)
{
    struct pollfd fd = {.fd = lumi_inbox_fd(inbox), .events = POLLIN};

    (void)state;
    assert_int_equal(poll(&fd, 1, 0), 0);
    lumi_inbox_wake(inbox);
    lumi_inbox_wake(inbox);
    assert_int_equal(poll(&fd, 1, 0), 1);
    lumi_inbox_run(inbox);
    assert_int_equal(poll(&fd, 1, 0), 0);
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, set_up, tear_down)
int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(one_thread_does_all_in_order),      TEST(several_threads_do_each_once),
        TEST(what_is_over_the_limit_is_refused), TEST(a_pool_that_ends_drops_what_waits),
        TEST(a_wake_is_seen_and_taken),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
