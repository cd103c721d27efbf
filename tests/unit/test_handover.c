/* daemon/handover: the processing command, its journal, captures that arrive in a folder. */
#include "tests/unit/capture_fixture.h"

#include "daemon/handover/handover.h"
#include "daemon/handover/handover_command.h"
#include "daemon/handover/handover_journal.h"

#include <glib.h>
#include <signal.h>

/* ---- Words and lines ---- */

static void words_are_split_and_filled_in(void **state)
{
    char **words;

    (void)state;
    OK(handover_words("run 'a b' --in=%c \"%n\" %w %o 5%%", "/x/my place.capture", &words, error));
    const char *const wanted[] = {
        "run", "a b", "--in=/x/my place.capture", "my place", "/x/my place.capture.work", "/x/my place.lumi", "5%"};
    for (int i = 0; i < 7; i++)
        assert_string_equal(words[i], wanted[i]);
    assert_null(words[7]);
    g_strfreev(words);
    FAILS(handover_words("run 'a", "/x", &words, error), LUMI_ERR_FORMAT, "processing command");
    FAILS(handover_words("run %q", "/x", &words, error), LUMI_ERR_FORMAT, "%q");
}

static void progress_is_read_from_lines(void **state)
{
    struct lumi_process_status status = {.progress = -1};

    (void)state;
    assert_true(handover_read_line("progress: 3/4 depth maps", &status));
    assert_true(status.progress == 0.75);
    assert_string_equal(status.stage, "depth maps");
    assert_true(handover_read_line("copied  12.5 %", &status));
    assert_true(status.progress == 0.125);
    assert_true(handover_read_line("  something broke \t", &status));
    assert_string_equal(status.text, "something broke");
    assert_false(handover_read_line("   ", &status));
    assert_true(handover_read_line("progress: 1/0 x", &status)); /* no number: only a text */
    assert_true(status.progress == 0.125);
    assert_string_equal(status.text, "progress: 1/0 x");
}

/* ---- The journal ---- */

static int join_line(void *context, const struct journal_line *line, struct lumi_error *error)
{
    GString *text = context;

    (void)error;
    for (int i = 0; i < line->count; i++)
        g_string_append_printf(text, "%s|", line->fields[i]);
    return LUMI_OK;
}

static void a_journal_keeps_whole_lines_and_finds_damage(void **state)
{
    const char *const fields[] = {"given", "/a b"}, *const bad[] = {"a\nb"};
    const char *path = in_scratch(state, "journal");
    GString *text = g_string_new(NULL);
    struct journal *journal, *second;

    OK(journal_open(path, join_line, text, &journal, error));
    OK(journal_write(journal, fields, 2, error));
    FAILS(journal_write(journal, bad, 1, error), LUMI_ERR_ARG, "cannot be written");
    FAILS(journal_open(path, join_line, text, &second, error), LUMI_ERR_BUSY, "another program");
    OK(journal_write(journal, fields, 1, error));
    journal_close(journal);
    shell("printf 'deadbeef half a li' >> '%s'", path); /* killed while it wrote */
    OK(journal_open(path, join_line, text, &journal, error));
    OK(journal_write(journal, fields, 2, error));
    journal_close(journal);
    assert_string_equal(text->str, "given|/a b|given|");
    g_string_truncate(text, 0);
    OK(journal_open(path, join_line, text, &journal, error));
    journal_close(journal);
    assert_string_equal(text->str, "given|/a b|given|given|/a b|");
    shell("sed -i '2s/given/taken/' '%s'", path);
    FAILS(journal_open(path, join_line, text, &journal, error), LUMI_ERR_FORMAT, "line 2: it does not match");
    g_string_free(text, TRUE);
}

/* ---- Processing ---- */

static void seal_capture(void **state, const char *name, unsigned seed)
{
    struct lumi_capture *capture;

    OK(lumi_capture_create(in_scratch(state, name), &capture, error));
    const int64_t camera = add_camera(capture, "c");
    for (unsigned i = 0; i < 4; i++) {
        char frame[8];
        snprintf(frame, sizeof frame, "f%u", i);
        store_frame(capture, camera, frame, seed + i);
    }
    OK(lumi_capture_publish(capture, NULL, error));
    lumi_capture_close(capture);
}

static struct lumi_process_status last;
static int changes;
static void on_change(void *context, const struct lumi_process_status *status)
{
    (void)context;
    last = *status;
    changes++;
}

static struct lumi_handover *handed(void **state, const char *command)
{
    struct lumi_handover_options options;
    struct lumi_handover *handover;

    lumi_handover_options_init(&options);
    options.command = command;
    options.journal = in_scratch(state, "handover.journal");
    options.changed = on_change;
    OK(lumi_handover_create(&options, &handover, error));
    return handover;
}

/* The main loop, until the capture handed over last is in this state. */
static void until(struct lumi_handover *handover, enum lumi_process_state wanted)
{
    struct lumi_process_status status = {0};

    do {
        g_main_context_iteration(NULL, TRUE);
        lumi_handover_list(handover, &status, 1);
    } while (status.state != wanted);
}

static void a_capture_is_processed_once_with_its_progress(void **state)
{
    const char *log = in_scratch(state, "log");
    char command[2 * PATH_SIZE];

    seal_capture(state, "a.capture", 1);
    snprintf(command, sizeof command,
             "sh -c 'echo progress: 1/2 $LUMI_PROGRESS; test $(nice) -ge 10 || exit 9; echo \"%%n\" >> \"$0\"; echo "
             "good >&2' '%.400s'",
             log);
    struct lumi_handover *handover = handed(state, command);
    FAILS(lumi_handover_give(handover, in_scratch(state, "none"), false, error), LUMI_ERR_NOTFOUND, "none");
    FAILS(lumi_handover_give(handover, (char *)*state, false, error), LUMI_ERR_ARG, "no sealed capture");
    OK(lumi_handover_give(handover, in_scratch(state, "a.capture"), false, error));
    OK(lumi_handover_give(handover, in_scratch(state, "a.capture"), false, error));
    until(handover, LUMI_PROCESS_DONE);
    assert_string_equal(last.text, "good");
    assert_string_equal(last.stage, "1");
    assert_true(last.progress == 1 && last.exit_status == 0 && changes >= 4 /* given, begun, twice a line, ended */);
    OK(lumi_handover_give(handover, in_scratch(state, "a.capture"), false, error));
    lumi_handover_destroy(handover);
    handover = handed(state, command); /* and not after a restart */
    for (int i = 0; i < 20; i++)
        g_main_context_iteration(NULL, FALSE);
    shell("test \"$(cat '%s')\" = a", log);
    OK(lumi_handover_give(handover, in_scratch(state, "a.capture"), true, error)); /* unless asked for */
    until(handover, LUMI_PROCESS_DONE);
    shell("test \"$(wc -l < '%s')\" = 2", log);
    lumi_handover_destroy(handover);
}

static void a_failure_is_reported_and_what_was_interrupted_begins_again(void **state)
{
    const char *log = in_scratch(state, "log");
    char command[2 * PATH_SIZE];

    seal_capture(state, "a.capture", 1);
    struct lumi_handover *handover = handed(state, "sh -c 'echo no room; exit 3'");
    OK(lumi_handover_give(handover, in_scratch(state, "a.capture"), false, error));
    until(handover, LUMI_PROCESS_FAILED);
    assert_int_equal(last.exit_status, 3);
    assert_string_equal(last.text, "no room");
    lumi_handover_destroy(handover);
    handover = handed(state, "/no/such/program %c");
    OK(lumi_handover_give(handover, in_scratch(state, "a.capture"), true, error));
    until(handover, LUMI_PROCESS_FAILED);
    assert_int_equal(last.exit_status, 127);
    lumi_handover_destroy(handover);
    snprintf(command, sizeof command, "sh -c 'echo begun >> \"$0\"; exec sleep 1000' '%.400s'", log);
    handover = handed(state, command);
    OK(lumi_handover_give(handover, in_scratch(state, "a.capture"), true, error));
    until(handover, LUMI_PROCESS_RUNNING);
    FAILS(lumi_handover_give(handover, in_scratch(state, "a.capture"), true, error), LUMI_ERR_BUSY, "processed");
    lumi_handover_destroy(handover); /* the program ends here, and its command with it */
    snprintf(command, sizeof command, "sh -c 'echo again >> \"$0\"' '%.400s'", log);
    handover = handed(state, command);
    until(handover, LUMI_PROCESS_DONE);
    shell("test \"$(tail -n 1 '%s')\" = again", log);
    lumi_handover_destroy(handover);
}

/* ---- Taking in ---- */

struct studio {
    struct lumi_handover *handover;
    struct lumi_ingest *ingest;
};

static struct studio opened(void **state)
{
    struct lumi_ingest_options options;
    char command[2 * PATH_SIZE];
    struct studio studio;

    shell("mkdir -p '%s' '%s'", in_scratch(state, "in"), in_scratch(state, "kept"));
    snprintf(command, sizeof command, "sh -c 'echo \"%%n\" >> \"$0\"' '%.400s'", in_scratch(state, "log"));
    studio.handover = handed(state, command);
    lumi_ingest_options_init(&options);
    options.folder = in_scratch(state, "in");
    options.into = in_scratch(state, "kept");
    options.journal = in_scratch(state, "ingest.journal");
    options.handover = studio.handover;
    options.settle = 0.05;
    options.look = 0.005;
    OK(lumi_ingest_create(&options, &studio.ingest, error));
    return studio;
}

static void closed(struct studio *studio)
{
    lumi_ingest_destroy(studio->ingest);
    lumi_handover_destroy(studio->handover);
}

/* The main loop, until everything in the folder is taken in or refused, and processed. */
static void until_idle(struct studio *studio)
{
    struct lumi_process_status list[16];
    bool busy = true;

    while (busy) {
        g_main_context_iteration(NULL, TRUE);
        busy = !lumi_ingest_idle(studio->ingest);
        const int count = lumi_handover_list(studio->handover, list, 16);
        for (int i = 0; i < count; i++)
            busy = busy || list[i].state < LUMI_PROCESS_DONE;
    }
}

static void captures_that_arrive_are_taken_in_exactly_once(void **state)
{
    struct studio studio = opened(state);

    seal_capture(state, "in/a.capture", 1);
    seal_capture(state, "in/b.capture", 7);
    until_idle(&studio);
    shell("cd '%s' && cp -r in/a.capture in/the-same.capture", (char *)*state);
    until_idle(&studio);
    closed(&studio);
    studio = opened(state); /* nothing is taken in again */
    until_idle(&studio);
    shell("cd '%s' && diff -r in/a.capture kept/a.capture && diff -r in/b.capture kept/b.capture && "
          "test \"$(ls kept | tr '\\n' ' ')\" = 'a.capture b.capture ' && test \"$(sort log | tr '\\n' ' ')\" = 'a b '",
          (char *)*state);
    shell("rm -r '%s'", in_scratch(state, "in/a.capture"));
    seal_capture(state, "in/a.capture", 30); /* another one of that name */
    until_idle(&studio);
    shell("cd '%s' && diff -r in/a.capture kept/a-2.capture && test \"$(tail -n 1 log)\" = a-2", (char *)*state);
    closed(&studio);
    assert_int_equal(problems_of(in_scratch(state, "kept/a-2.capture")), 0);
}

static void what_is_no_capture_or_damaged_is_refused_until_it_changes(void **state)
{
    struct studio studio = opened(state);
    struct lumi_ingest_status list[4];

    seal_capture(state, "a.capture", 1);
    shell("cd '%s' && mkdir in/holiday && echo hello > in/holiday/me.jpg && cp -r a.capture in/ && "
          "printf x | dd of=in/a.capture/data/frames/f2.jpg conv=notrunc bs=1 2>/dev/null",
          (char *)*state);
    until_idle(&studio);
    assert_int_equal(lumi_ingest_list(studio.ingest, list, 4), 2);
    for (int i = 0; i < 2; i++) {
        const bool holiday = strstr(list[i].source, "holiday") != NULL;
        assert_int_equal(list[i].state, LUMI_INGEST_REFUSED);
        assert_non_null(strstr(list[i].text, holiday ? "is no capture" : "data/frames/f2.jpg"));
    }
    shell("cd '%s' && test -z \"$(ls -A kept)\" && cp a.capture/data/frames/f2.jpg in/a.capture/data/frames/",
          (char *)*state);
    for (int i = 0; i < 3 || !lumi_ingest_idle(studio.ingest); i++)
        g_main_context_iteration(NULL, TRUE);
    until_idle(&studio);
    closed(&studio);
    shell("cd '%s' && diff -r a.capture kept/a.capture && test \"$(cat log)\" = a", (char *)*state);
}

static void one_that_nobody_writes_any_more_is_sealed_on_the_way(void **state)
{
    struct studio studio = opened(state);
    struct lumi_ingest_status status;
    struct lumi_capture *capture;

    OK(lumi_capture_create_live(in_scratch(state, "in/a"), &capture, error));
    const int64_t camera = add_camera(capture, "c");
    store_frame(capture, camera, "f", 5);
    for (int i = 0; i < 30; i++) /* it is held: nothing happens, however long it stays as it is */
        g_main_context_iteration(NULL, TRUE);
    lumi_ingest_list(studio.ingest, &status, 1);
    assert_int_equal(status.state, LUMI_INGEST_SEEN);
    lumi_capture_close(capture);
    until_idle(&studio);
    closed(&studio);
    OK(lumi_capture_open(in_scratch(state, "kept/a"), LUMI_CAPTURE_READ, &capture, error));
    assert_true(lumi_capture_sealed(capture));
    lumi_capture_close(capture);
    assert_int_equal(problems_of(in_scratch(state, "kept/a")), 0);
    shell("test \"$(cat '%s')\" = a", in_scratch(state, "log"));
}

static void folders_in_one_another_are_refused(void **state)
{
    struct lumi_ingest_options options;
    struct lumi_ingest *ingest;

    shell("mkdir -p '%s'", in_scratch(state, "in/kept"));
    lumi_ingest_options_init(&options);
    options.folder = in_scratch(state, "in");
    options.into = in_scratch(state, "in/kept");
    options.journal = in_scratch(state, "journal");
    FAILS(lumi_ingest_create(&options, &ingest, error), LUMI_ERR_ARG, "lie in one another");
    options.into = in_scratch(state, "nowhere");
    FAILS(lumi_ingest_create(&options, &ingest, error), LUMI_ERR_NOTFOUND, "nowhere");
}

#define IN_SCRATCH(test) cmocka_unit_test_setup_teardown(test, scratch_setup, scratch_teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(words_are_split_and_filled_in),
        cmocka_unit_test(progress_is_read_from_lines),
        IN_SCRATCH(a_journal_keeps_whole_lines_and_finds_damage),
        IN_SCRATCH(a_capture_is_processed_once_with_its_progress),
        IN_SCRATCH(a_failure_is_reported_and_what_was_interrupted_begins_again),
        IN_SCRATCH(captures_that_arrive_are_taken_in_exactly_once),
        IN_SCRATCH(what_is_no_capture_or_damaged_is_refused_until_it_changes),
        IN_SCRATCH(one_that_nobody_writes_any_more_is_sealed_on_the_way),
        IN_SCRATCH(folders_in_one_another_are_refused),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
