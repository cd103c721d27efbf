/* The program that draws views of the light field so far: its life, and who waits for it. */
#include "daemon/preview/preview_field.h"

#include "daemon/preview/field_answer.h"

#include <errno.h>
#include <fcntl.h>
#include <glib-unix.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#define UNASKED_S 60
#define LATE_S 20     /* a picture that takes longer is not waited for */
#define SILENT_S 300  /* who was asked and says nothing for so long hangs */
#define BACK_OFF_S 60 /* the longest wait before it is started again */
#define WAITING_MOST 16

struct question {
    uint32_t id;
    char *who;
    struct lumi_field_gaze gaze;
    lumi_field_answered answered;
    void *context;
    gint64 asked_us;
};

struct lumi_field {
    struct lumi_field_options options;
    char **words;
    char capture[sizeof((struct lumi_field_status *)0)->capture];
    GPid pid;
    int socket;
    GSource *input, *child, *tick;
    struct lumi_field_reader reader;
    GPtrArray *waiting; /* struct question; the first is being drawn where `drawing` */
    bool drawing;
    uint32_t last_id;
    gint64 asked_us;    /* when somebody last asked */
    gint64 silent_us;   /* since when it has not answered; 0: nothing is left to answer */
    gint64 start_us;    /* not before */
    int failures;       /* in a row */
    bool said_anything; /* since it was started */
    int frames, rows, views;
    char text[256];
};

static void say(const struct lumi_field *field, const char *text)
{
    if (field->options.log)
        field->options.log(field->options.user, text);
}

/* ---- questions ---- */

static void free_question(void *data)
{
    struct question *question = data;

    g_free(question->who);
    g_free(question);
}

/* Takes it out and answers it. */
static void answer(struct lumi_field *field, guint index, const struct lumi_field_result *result)
{
    struct question *question = g_ptr_array_steal_index(field->waiting, index);

    if (index == 0)
        field->drawing = false;
    if (question->answered)
        question->answered(question->context, result);
    free_question(question);
}

static void answer_all(struct lumi_field *field, enum lumi_field_outcome outcome, const char *text)
{
    const struct lumi_field_result result = {.outcome = outcome, .text = text};

    while (field->waiting->len)
        answer(field, 0, &result);
}

static void send_next(struct lumi_field *field)
{
    char line[512], numbers[6][G_ASCII_DTOSTR_BUF_SIZE];

    if (field->drawing || !field->waiting->len || !field->pid)
        return;
    const struct question *question = g_ptr_array_index(field->waiting, 0);
    const struct lumi_field_gaze *gaze = &question->gaze;
    const double values[6] = {gaze->x, gaze->y, gaze->z, gaze->yaw, gaze->pitch, gaze->fov};
    for (int i = 0; i < 6; i++)
        g_ascii_dtostr(numbers[i], sizeof numbers[i], values[i]);
    const int size = snprintf(line, sizeof line, "view %u %s %s %s %s %s %s %d %d\n", question->id, numbers[0],
                              numbers[1], numbers[2], numbers[3], numbers[4], numbers[5], gaze->width, gaze->height);
    /* It has answered all before this one: a line always has room. Where it has not, it is dead, and found so. */
    if (send(field->socket, line, (size_t)size, MSG_NOSIGNAL | MSG_DONTWAIT) != size)
        return;
    field->drawing = true;
    if (!field->silent_us)
        field->silent_us = g_get_monotonic_time();
}

/* ---- what it says ---- */

static void take_answer(void *context, const struct lumi_field_answer *said)
{
    struct lumi_field *field = context;
    struct lumi_field_result result = {.text = said->text};

    field->said_anything = true;
    field->silent_us = 0;
    field->failures = 0;
    if (said->kind == LUMI_FIELD_NEWS) {
        field->frames = said->frames;
        field->rows = said->rows;
        field->views = said->views;
        g_strlcpy(field->text, "", sizeof field->text);
        if (field->options.news)
            field->options.news(field->options.user);
        return;
    }
    const struct question *question = field->waiting->len ? g_ptr_array_index(field->waiting, 0) : NULL;
    if (!field->drawing || question->id != said->id)
        return; /* nobody waits for it any more */
    if (said->kind == LUMI_FIELD_NONE) {
        result.outcome = LUMI_FIELD_NOTHING;
        answer(field, 0, &result);
        return;
    }
    result.outcome = LUMI_FIELD_DRAWN;
    result.frames = said->frames;
    result.jpeg = g_bytes_new(said->data, said->size);
    answer(field, 0, &result);
    g_bytes_unref(result.jpeg);
}

static void drop_source(GSource **source)
{
    if (*source) {
        g_source_destroy(*source);
        g_source_unref(*source);
        *source = NULL;
    }
}

static void stop(struct lumi_field *field);

static gboolean on_input(int fd, GIOCondition condition, void *context)
{
    struct lumi_field *field = context;
    struct lumi_error error = {0};
    char bytes[65536];
    const ssize_t got = recv(fd, bytes, sizeof bytes, MSG_DONTWAIT);

    (void)condition;
    if (got < 0 && (errno == EAGAIN || errno == EINTR))
        return G_SOURCE_CONTINUE;
    if (got <= 0) {
        kill(field->pid, SIGKILL); /* it has nothing to say any more; on_end goes on */
        drop_source(&field->input);
        return G_SOURCE_REMOVE;
    }
    if (lumi_field_reader_feed(&field->reader, bytes, (size_t)got, take_answer, field, &error) != LUMI_OK) {
        say(field, error.text);
        kill(field->pid, SIGKILL);
        drop_source(&field->input);
        return G_SOURCE_REMOVE;
    }
    send_next(field);
    return G_SOURCE_CONTINUE;
}

/* ---- life ---- */

static void close_all(struct lumi_field *field)
{
    drop_source(&field->input);
    drop_source(&field->child);
    if (field->socket >= 0)
        close(field->socket);
    field->socket = -1;
    field->pid = 0;
    field->drawing = false;
    field->silent_us = 0;
    lumi_field_reader_finish(&field->reader);
}

static void wait_longer(struct lumi_field *field)
{
    const int seconds = MIN(1 << MIN(field->failures, 6), BACK_OFF_S);

    field->failures++;
    field->start_us = g_get_monotonic_time() + (gint64)seconds * G_USEC_PER_SEC;
}

static void on_end(GPid pid, int status, void *context)
{
    struct lumi_field *field = context;
    char line[320];

    g_spawn_close_pid(pid);
    close_all(field);
    if (WIFSIGNALED(status))
        g_snprintf(field->text, sizeof field->text, "the preview was ended by signal %d; it is started again",
                   WTERMSIG(status));
    else
        g_snprintf(field->text, sizeof field->text, "the preview ended with status %d; it is started again",
                   WEXITSTATUS(status));
    g_snprintf(line, sizeof line, "%s: %s", field->capture, field->text);
    say(field, line);
    wait_longer(field);
    answer_all(field, LUMI_FIELD_NOTHING, field->text);
}

/* Who has been killed is waited for by nobody: its number is given back when it is gone. */
static void on_gone(GPid pid, int status, void *context)
{
    (void)status;
    (void)context;
    g_spawn_close_pid(pid);
}

static void stop(struct lumi_field *field)
{
    if (!field->pid)
        return;
    GSource *gone = g_child_watch_source_new(field->pid);
    kill(field->pid, SIGKILL);
    g_source_set_callback(gone, G_SOURCE_FUNC(on_gone), NULL, NULL);
    g_source_attach(gone, field->options.context);
    g_source_unref(gone);
    close_all(field);
}

/* After fork: no life without us. The server's thread, which starts it, hears no signals; it does. That thread waits
 * until the program has begun, and an emergency stop with it: so it takes what nobody else wants of processor and disk
 * (lumi_preview_humble) not before it has been read from the disk. */
static void be_ready(void *context)
{
    sigset_t none;

    (void)context;
    sigemptyset(&none);
    sigprocmask(SIG_SETMASK, &none, NULL);
    prctl(PR_SET_PDEATHSIG, SIGKILL);
}

static char **words_for(const struct lumi_field *field)
{
    GPtrArray *words = g_ptr_array_new();

    for (int i = 0; field->words[i]; i++) {
        GString *word = g_string_new(NULL);
        for (const char *at = field->words[i]; *at; at++)
            if (at[0] == '%' && (at[1] == 'c' || at[1] == '%')) {
                at++;
                g_string_append(word, *at == 'c' ? field->capture : "%");
            } else {
                g_string_append_c(word, *at);
            }
        g_ptr_array_add(words, g_string_free(word, FALSE));
    }
    g_ptr_array_add(words, NULL);
    return (char **)g_ptr_array_free(words, FALSE);
}

static bool spawn(struct lumi_field *field, int ends[2])
{
    g_auto(GStrv) words = words_for(field);
    g_autoptr(GError) problem = NULL;

    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) < 0) {
        g_snprintf(field->text, sizeof field->text, "the preview: %s", g_strerror(errno));
        return false;
    }
    if (g_spawn_async_with_fds(NULL, words, NULL, (GSpawnFlags)(G_SPAWN_DO_NOT_REAP_CHILD | G_SPAWN_SEARCH_PATH),
                               be_ready, NULL, &field->pid, ends[1], ends[1], -1, &problem)) {
        close(ends[1]);
        return true;
    }
    g_snprintf(field->text, sizeof field->text, "the preview cannot be started: %s", problem->message);
    close(ends[0]);
    close(ends[1]);
    field->pid = 0;
    return false;
}

static void start(struct lumi_field *field)
{
    int ends[2];

    if (field->pid || g_get_monotonic_time() < field->start_us)
        return;
    field->said_anything = false;
    if (!spawn(field, ends)) {
        say(field, field->text);
        wait_longer(field);
        return;
    }
    g_strlcpy(field->text, "the preview reads the first frames", sizeof field->text);
    field->socket = ends[0];
    field->input = g_unix_fd_source_new(field->socket, (GIOCondition)(G_IO_IN | G_IO_HUP | G_IO_ERR));
    g_source_set_callback(field->input, G_SOURCE_FUNC(on_input), field, NULL);
    g_source_attach(field->input, field->options.context);
    field->child = g_child_watch_source_new(field->pid);
    g_source_set_callback(field->child, G_SOURCE_FUNC(on_end), field, NULL);
    g_source_attach(field->child, field->options.context);
}

/* Once a second while somebody asks, or has asked. */
static gboolean on_tick(void *context)
{
    struct lumi_field *field = context;
    const gint64 now = g_get_monotonic_time();
    const struct lumi_field_result late = {.outcome = LUMI_FIELD_LATE,
                                           .text = "the computer has no time for previews now"};

    for (guint i = field->waiting->len; i-- > 0;) {
        const struct question *question = g_ptr_array_index(field->waiting, i);
        if (now - question->asked_us < (gint64)LATE_S * G_USEC_PER_SEC)
            continue;
        /* What is being drawn is not asked for again before its answer is here: `id` tells them apart. */
        answer(field, i, &late);
    }
    if (field->pid && field->silent_us && now - field->silent_us > (gint64)SILENT_S * G_USEC_PER_SEC)
        kill(field->pid, SIGKILL); /* on_end goes on */
    if (now - field->asked_us < (gint64)UNASKED_S * G_USEC_PER_SEC)
        return G_SOURCE_CONTINUE;
    stop(field);
    field->text[0] = '\0';
    drop_source(&field->tick);
    return G_SOURCE_REMOVE;
}

int lumi_field_create(const struct lumi_field_options *options, struct lumi_field **field, struct lumi_error *error)
{
    g_autoptr(GError) problem = NULL;
    g_autofree char *command = g_strstrip(g_strdup(options->command ? options->command : ""));
    g_auto(GStrv) words = NULL;

    *field = NULL;
    if (*command && !g_shell_parse_argv(command, NULL, &words, &problem))
        return lumi_fail(error, LUMI_ERR_FORMAT, "preview command: %s", problem->message);
    struct lumi_field *made = g_new0(struct lumi_field, 1);
    made->options = *options;
    made->options.command = NULL;
    made->words = g_steal_pointer(&words);
    made->socket = -1;
    made->waiting = g_ptr_array_new_with_free_func(free_question);
    *field = made;
    return LUMI_OK;
}

void lumi_field_destroy(struct lumi_field *field)
{
    if (!field)
        return;
    answer_all(field, LUMI_FIELD_NOTHING, "lumid is ending");
    stop(field);
    drop_source(&field->tick);
    g_ptr_array_unref(field->waiting);
    g_strfreev(field->words);
    g_free(field);
}

/* ---- asking ---- */

static void change_capture(struct lumi_field *field, const char *capture)
{
    if (!strcmp(field->capture, capture))
        return;
    stop(field);
    answer_all(field, LUMI_FIELD_NOTHING, "another capture has begun");
    g_strlcpy(field->capture, capture, sizeof field->capture);
    field->frames = field->rows = field->views = 0;
    field->failures = 0;
    field->start_us = 0;
    field->text[0] = '\0';
}

static void push_out(struct lumi_field *field, const char *who)
{
    const struct lumi_field_result result = {.outcome = LUMI_FIELD_SUPERSEDED, .text = "a newer view was asked for"};

    for (guint i = field->drawing ? 1 : 0; i < field->waiting->len; i++) {
        const struct question *question = g_ptr_array_index(field->waiting, i);
        if (!strcmp(question->who, who) || field->waiting->len >= WAITING_MOST) {
            answer(field, i, &result);
            return;
        }
    }
}

void lumi_field_ask(struct lumi_field *field, const char *capture, const char *who, const struct lumi_field_gaze *gaze,
                    lumi_field_answered answered, void *context)
{
    struct lumi_field_result nothing = {.outcome = LUMI_FIELD_NOTHING};

    if (!field->words || !*capture || strlen(capture) >= sizeof field->capture) {
        nothing.text = field->words ? "there is no capture yet" : "[preview] command is empty: there are no previews";
        answered(context, &nothing);
        return;
    }
    change_capture(field, capture);
    field->asked_us = g_get_monotonic_time();
    if (!field->tick) {
        field->tick = g_timeout_source_new_seconds(1);
        g_source_set_callback(field->tick, on_tick, field, NULL);
        g_source_attach(field->tick, field->options.context);
    }
    start(field);
    if (!field->pid) {
        nothing.text = field->text;
        answered(context, &nothing);
        return;
    }
    push_out(field, who);
    struct question *question = g_new0(struct question, 1);
    *question = (struct question){++field->last_id, g_strdup(who), *gaze, answered, context, field->asked_us};
    g_ptr_array_add(field->waiting, question);
    send_next(field);
}

void lumi_field_forget(struct lumi_field *field, const void *context)
{
    for (guint i = 0; i < field->waiting->len; i++) {
        struct question *question = g_ptr_array_index(field->waiting, i);
        if (question->context != context)
            continue;
        if (i == 0 && field->drawing)
            question->answered = NULL; /* its answer comes, and the next one waits for that */
        else
            g_ptr_array_remove_index(field->waiting, i);
        return;
    }
}

void lumi_field_status(const struct lumi_field *field, struct lumi_field_status *status)
{
    *status = (struct lumi_field_status){
        .running = field->pid != 0, .frames = field->frames, .rows = field->rows, .views = field->views};
    g_strlcpy(status->capture, field->capture, sizeof status->capture);
    g_strlcpy(status->text, field->text, sizeof status->text);
    status->pid = (int)field->pid;
}
