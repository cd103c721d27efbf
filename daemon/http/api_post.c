/* Letters between the server's thread and the engine's. */
#include "daemon/http/api_post.h"

#include <fcntl.h>
#include <glib-unix.h>
#include <pthread.h>
#include <unistd.h>

struct lumi_api_post {
    pthread_mutex_t lock;
    struct lumi_api_letter *first, **last; /* under the lock */
    int pipe[2];
    GSource *source;
};

static struct lumi_api_letter *take_all(struct lumi_api_post *post)
{
    pthread_mutex_lock(&post->lock);
    struct lumi_api_letter *first = post->first;
    post->first = NULL;
    post->last = &post->first;
    pthread_mutex_unlock(&post->lock);
    return first;
}

static void read_all(struct lumi_api_letter *letter, bool dropped)
{
    while (letter) {
        struct lumi_api_letter *next = letter->next;
        letter->read(letter, dropped);
        letter = next;
    }
}

static gboolean on_pipe(int fd, GIOCondition condition, void *context)
{
    char bytes[64];

    (void)condition;
    if (read(fd, bytes, sizeof bytes) > 0)
        read_all(take_all(context), false);
    return G_SOURCE_CONTINUE;
}

int lumi_api_post_create(GMainContext *context, struct lumi_api_post **post, struct lumi_error *error)
{
    struct lumi_api_post *made = g_new0(struct lumi_api_post, 1);
    g_autoptr(GError) failed = NULL;

    if (!g_unix_open_pipe(made->pipe, FD_CLOEXEC, &failed)) {
        g_free(made);
        return lumi_fail(error, LUMI_ERR_IO, "HTTP: %s", failed->message);
    }
    g_unix_set_fd_nonblocking(made->pipe[0], TRUE, NULL);
    g_unix_set_fd_nonblocking(made->pipe[1], TRUE, NULL);
    pthread_mutex_init(&made->lock, NULL);
    made->last = &made->first;
    made->source = g_unix_fd_source_new(made->pipe[0], G_IO_IN);
    g_source_set_callback(made->source, G_SOURCE_FUNC(on_pipe), made, NULL);
    g_source_attach(made->source, context);
    *post = made;
    return LUMI_OK;
}

void lumi_api_post_give(struct lumi_api_post *post, struct lumi_api_letter *letter)
{
    letter->next = NULL;
    pthread_mutex_lock(&post->lock);
    *post->last = letter;
    post->last = &letter->next;
    pthread_mutex_unlock(&post->lock);
    if (write(post->pipe[1], "", 1) < 0) {
        /* full: it is awake already */
    }
}

void lumi_api_post_destroy(struct lumi_api_post *post)
{
    if (!post)
        return;
    lumi_api_drop(&post->source);
    read_all(take_all(post), true);
    close(post->pipe[0]);
    close(post->pipe[1]);
    pthread_mutex_destroy(&post->lock);
    g_free(post);
}

GSource *lumi_api_attach(GSource *source, int priority, GSourceFunc function, void *context)
{
    g_source_set_priority(source, priority);
    g_source_set_callback(source, function, context, NULL);
    g_source_attach(source, g_main_context_get_thread_default());
    return source;
}

void lumi_api_drop(GSource **source)
{
    if (!*source)
        return;
    g_source_destroy(*source);
    g_source_unref(*source);
    *source = NULL;
}
