/* The program that draws the light field so far, as lumid keeps it: here shell scripts stand for it. */
#include "daemon/preview/field_answer.h"
#include "daemon/preview/preview_field.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/wait.h>

static const struct lumi_field_gaze ahead = {.fov = 1, .width = 64, .height = 48};

struct answers {
    int count;
    enum lumi_field_outcome outcomes[8];
    int frames;
    char text[256], jpeg[64];
};

static void take(void *context, const struct lumi_field_result *result)
{
    struct answers *answers = context;

    assert_true(answers->count < 8);
    answers->outcomes[answers->count++] = result->outcome;
    answers->frames = result->frames;
    g_strlcpy(answers->text, result->text ? result->text : "", sizeof answers->text);
    if (result->jpeg) {
        gsize size;
        const char *data = g_bytes_get_data(result->jpeg, &size);
        snprintf(answers->jpeg, sizeof answers->jpeg, "%.*s", (int)size, data);
    }
}

static void count_news(void *user)
{
    ++*(int *)user;
}

static struct lumi_field *make(const char *script, int *news)
{
    g_autofree char *quoted = g_shell_quote(script);
    g_autofree char *command = g_strdup_printf("sh -c %s sh %%c", quoted);
    const struct lumi_field_options options = {.command = command, .news = news ? count_news : NULL, .user = news};
    struct lumi_error error;
    struct lumi_field *field;

    if (lumi_field_create(&options, &field, &error) != LUMI_OK)
        fail_msg("%s", error.text);
    return field;
}

/* Until so many answers are there; not for ever. */
static void wait_for(const struct answers *answers, int count)
{
    const gint64 end = g_get_monotonic_time() + 20 * G_USEC_PER_SEC;

    while (answers->count < count && g_get_monotonic_time() < end)
        g_main_context_iteration(NULL, TRUE);
    assert_int_equal(answers->count, count);
}

#define ANSWERS "while read v id x y z yaw pitch fov w h; do echo \"jpeg $id 5 7\"; printf '%s' \"$w $h\"; done"

static void a_question_is_answered_with_the_picture(void **state)
{
    struct answers answers = {0};
    struct lumi_field_status status;
    int news = 0;
    struct lumi_field *field = make("echo news 7 2 6; " ANSWERS, &news);

    (void)state;
    lumi_field_status(field, &status);
    assert_false(status.running);
    lumi_field_ask(field, "/a", "me", &ahead, take, &answers);
    lumi_field_ask(field, "/a", "you", &ahead, take, &answers);
    wait_for(&answers, 2);
    assert_int_equal(answers.outcomes[0], LUMI_FIELD_DRAWN);
    assert_int_equal(answers.outcomes[1], LUMI_FIELD_DRAWN);
    assert_string_equal(answers.jpeg, "64 48");
    assert_int_equal(answers.frames, 7);
    lumi_field_status(field, &status);
    assert_true(status.running);
    assert_int_equal(news, 1);
    assert_int_equal(status.frames, 7);
    assert_int_equal(status.rows, 2);
    assert_int_equal(status.views, 6);
    lumi_field_destroy(field);
}

static void the_newest_question_of_each_wins(void **state)
{
    struct answers first = {0}, mine = {0}, newest = {0}, yours = {0};
    struct lumi_field *field = make("read go; sleep 0.3; echo \"jpeg 1 2 1\"; printf ok; " ANSWERS, NULL);

    (void)state;
    lumi_field_ask(field, "/a", "me", &ahead, take, &first); /* is drawn */
    lumi_field_ask(field, "/a", "me", &ahead, take, &mine);
    lumi_field_ask(field, "/a", "you", &ahead, take, &yours);
    lumi_field_ask(field, "/a", "me", &ahead, take, &newest);
    assert_int_equal(mine.count, 1);
    assert_int_equal(mine.outcomes[0], LUMI_FIELD_SUPERSEDED);
    wait_for(&newest, 1);
    assert_int_equal(first.outcomes[0], LUMI_FIELD_DRAWN);
    assert_int_equal(yours.outcomes[0], LUMI_FIELD_DRAWN);
    assert_int_equal(newest.outcomes[0], LUMI_FIELD_DRAWN);
    lumi_field_destroy(field);
}

static void one_that_is_killed_comes_back(void **state)
{
    struct answers answers = {0};
    struct lumi_field_status status;
    struct lumi_field *field = make(ANSWERS, NULL);

    (void)state;
    lumi_field_ask(field, "/a", "me", &ahead, take, &answers);
    wait_for(&answers, 1);
    lumi_field_status(field, &status);
    const int first = status.pid;
    assert_int_equal(kill(first, SIGKILL), 0);
    const gint64 end = g_get_monotonic_time() + 20 * G_USEC_PER_SEC;
    do
        g_main_context_iteration(NULL, TRUE), lumi_field_status(field, &status);
    while (status.running && g_get_monotonic_time() < end);
    assert_non_null(strstr(status.text, "signal 9"));
    /* Not at once, in case it always dies; but soon. */
    do {
        answers.count = 0;
        lumi_field_ask(field, "/a", "me", &ahead, take, &answers);
        wait_for(&answers, 1);
        g_usleep(20000);
    } while (answers.outcomes[0] == LUMI_FIELD_NOTHING && g_get_monotonic_time() < end);
    assert_int_equal(answers.outcomes[0], LUMI_FIELD_DRAWN);
    lumi_field_status(field, &status);
    assert_int_not_equal(status.pid, first);
    lumi_field_destroy(field);
}

static void one_that_ends_or_talks_nonsense_is_no_harm(void **state)
{
    static const char *const scripts[] = {"exit 3", "echo hello; sleep 100", "echo jpeg 1 99999999999 1; sleep 100",
                                          "exec 0<&- 1>&-; sleep 100"};

    (void)state;
    for (int i = 0; i < 4; i++) {
        struct answers answers = {0};
        struct lumi_field *field = make(scripts[i], NULL);
        lumi_field_ask(field, "/a", "me", &ahead, take, &answers);
        wait_for(&answers, 1);
        assert_int_equal(answers.outcomes[0], LUMI_FIELD_NOTHING);
        /* And again: it is not started anew at once. */
        lumi_field_ask(field, "/a", "me", &ahead, take, &answers);
        assert_int_equal(answers.count, 2);
        lumi_field_destroy(field);
    }
}

static void what_cannot_be_started_and_what_is_switched_off_says_so(void **state)
{
    const struct lumi_field_options none = {.command = " "}, no_program = {.command = "/nowhere/preview %c"},
                                    no_words = {.command = "'"};
    struct answers answers = {0};
    struct lumi_field *field;
    struct lumi_error error;

    (void)state;
    assert_int_equal(lumi_field_create(&no_words, &field, &error), LUMI_ERR_FORMAT);
    assert_int_equal(lumi_field_create(&none, &field, &error), LUMI_OK);
    lumi_field_ask(field, "/a", "me", &ahead, take, &answers);
    assert_int_equal(answers.outcomes[0], LUMI_FIELD_NOTHING);
    assert_non_null(strstr(answers.text, "[preview] command"));
    lumi_field_destroy(field);
    assert_int_equal(lumi_field_create(&no_program, &field, &error), LUMI_OK);
    lumi_field_ask(field, "", "me", &ahead, take, &answers);
    assert_string_equal(answers.text, "there is no capture yet");
    lumi_field_ask(field, "/a", "me", &ahead, take, &answers);
    assert_non_null(strstr(answers.text, "/nowhere/preview"));
    lumi_field_destroy(field);
}

static void another_capture_is_another_program(void **state)
{
    struct answers answers = {0};
    struct lumi_field *field =
        make("while read v id rest; do echo \"jpeg $id ${#1} 1\"; printf '%s' \"$1\"; done", NULL);
    struct lumi_field_status status;

    (void)state;
    lumi_field_ask(field, "/first", "me", &ahead, take, &answers);
    wait_for(&answers, 1);
    assert_string_equal(answers.jpeg, "/first");
    lumi_field_status(field, &status);
    const int first = status.pid;
    lumi_field_ask(field, "/the second", "me", &ahead, take, &answers);
    wait_for(&answers, 2);
    assert_string_equal(answers.jpeg, "/the second");
    lumi_field_status(field, &status);
    assert_int_not_equal(status.pid, first);
    lumi_field_destroy(field);
}

static void who_hangs_up_is_not_answered_and_holds_nobody_up(void **state)
{
    struct answers gone = {0}, waits = {0}, next = {0};
    struct lumi_field *field = make(ANSWERS, NULL);

    (void)state;
    lumi_field_ask(field, "/a", "me", &ahead, take, &gone); /* is drawn */
    lumi_field_ask(field, "/a", "you", &ahead, take, &waits);
    lumi_field_ask(field, "/a", "she", &ahead, take, &next);
    lumi_field_forget(field, &gone);
    lumi_field_forget(field, &waits);
    wait_for(&next, 1);
    assert_int_equal(gone.count, 0);
    assert_int_equal(waits.count, 0);
    lumi_field_destroy(field);
}

static void count_answer(void *context, const struct lumi_field_answer *answer)
{
    GString *said = context;

    g_string_append_printf(said, "%d/%u/%d/%.*s;", (int)answer->kind, answer->id, answer->frames, (int)answer->size,
                           answer->data ? (const char *)answer->data : "");
}

static void answers_may_come_in_pieces(void **state)
{
    static const char text[] = "news 5 1 4\njpeg 3 7 4\nab\ncd\n.none 4 too bad\n";

    (void)state;
    for (size_t piece = 1; piece < sizeof text; piece++) {
        struct lumi_field_reader reader = {0};
        g_autoptr(GString) said = g_string_new(NULL);
        struct lumi_error error;
        for (size_t at = 0; at < sizeof text - 1; at += piece)
            assert_int_equal(lumi_field_reader_feed(&reader, text + at, MIN(piece, sizeof text - 1 - at), count_answer,
                                                    said, &error),
                             LUMI_OK);
        assert_string_equal(said->str, "1/0/5/;2/3/4/ab\ncd\n.;3/4/0/;");
        lumi_field_reader_finish(&reader);
    }
}

static void what_is_no_answer_is_refused(void **state)
{
    static const char *const lines[] = {"news 1 2\n",
                                        "news 1 2 3 4\n",
                                        "news -1 2 3\n",
                                        "jpeg 1 0 3\n",
                                        "jpeg 1 33554433 3\n",
                                        "jpeg 4294967296 1 1\n",
                                        "none\n",
                                        "\n",
                                        "news  1 2 3\n",
                                        "none 1x\n"};

    (void)state;
    for (size_t i = 0; i < G_N_ELEMENTS(lines); i++) {
        struct lumi_field_reader reader = {0};
        g_autoptr(GString) said = g_string_new(NULL);
        struct lumi_error error;
        assert_true(lumi_field_reader_feed(&reader, lines[i], strlen(lines[i]), count_answer, said, &error) < 0);
        assert_string_equal(said->str, "");
        lumi_field_reader_finish(&reader);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_question_is_answered_with_the_picture),
        cmocka_unit_test(the_newest_question_of_each_wins),
        cmocka_unit_test(one_that_is_killed_comes_back),
        cmocka_unit_test(one_that_ends_or_talks_nonsense_is_no_harm),
        cmocka_unit_test(what_cannot_be_started_and_what_is_switched_off_says_so),
        cmocka_unit_test(another_capture_is_another_program),
        cmocka_unit_test(who_hangs_up_is_not_answered_and_holds_nobody_up),
        cmocka_unit_test(answers_may_come_in_pieces),
        cmocka_unit_test(what_is_no_answer_is_refused),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
