/* proto/capture under bad luck: killed at any call that changes the disk, a disk that fills up, memory that runs out.
 */
#include "tests/unit/capture_fixture.h"
#include "tests/unit/disk_model.h"

#include "proto/base/memory.h"
#include "proto/capture/capture_priv.h"

#include <errno.h>
#include <fcntl.h>
#include <nettle/sha2.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>

/* ---- A story of a capture, acknowledged step by step ---- */

enum { BEGUN = 1000, SEALED = 1001, UNSEALED = 1002 };

/* Tells the parent, past the counting functions. */
static void acknowledge(int pipe, int what)
{
    if (pipe >= 0)
        syscall(SYS_write, pipe, &what, sizeof what);
}

#define STEP(call)                                                                                                     \
    do {                                                                                                               \
        code = (call);                                                                                                 \
        if (code != LUMI_OK)                                                                                           \
            goto done;                                                                                                 \
    } while (0)

static int store(struct lumi_capture *capture, int64_t camera, int number, struct lumi_error *error)
{
    struct lumi_capture_file file = small_file();
    unsigned char bytes[3000];
    size_t count = picture((unsigned)number, bytes, sizeof bytes);
    char name[16];
    int64_t id;

    snprintf(name, sizeof name, "f%03d", number);
    const struct lumi_capture_new_frame frame = {.name = name, .camera = camera, .row = 0, .column = number};
    file.exif = "exif";
    file.exif_size = 4;
    LUMI_TRY(lumi_capture_add_frame(capture, &frame, &id, error));
    LUMI_TRY(lumi_capture_trigger_frame(capture, id, number, error));
    return lumi_capture_store_bytes(capture, id, bytes, count, &file, error);
}

/* A live capture: frames one by one, a batch, sealed, opened again, one more, sealed. Or one made aside and published.
 */
static int story(const char *path, bool live, int pipe, struct lumi_error *error)
{
    struct lumi_capture_lens lens = small_lens();
    struct lumi_capture *capture = NULL;
    int64_t lens_id, camera;
    int code;

    STEP(live ? lumi_capture_create_live(path, &capture, error) : lumi_capture_create(path, &capture, error));
    acknowledge(pipe, BEGUN);
    STEP(lumi_capture_add_lens(capture, &lens, &lens_id, error));
    STEP(lumi_capture_add_camera(capture, "c", lens_id, &camera, error));
    for (int i = 0; i < 3; i++) {
        STEP(store(capture, camera, i, error));
        acknowledge(pipe, i);
    }
    STEP(lumi_capture_begin(capture, error));
    for (int i = 3; i < 6; i++)
        STEP(store(capture, camera, i, error));
    STEP(lumi_capture_commit(capture, error));
    for (int i = 3; i < 6; i++)
        acknowledge(pipe, i);
    if (!live) {
        STEP(lumi_capture_publish(capture, NULL, error));
        acknowledge(pipe, SEALED);
        goto done;
    }
    STEP(lumi_capture_seal(capture, NULL, error));
    acknowledge(pipe, SEALED);
    lumi_capture_close(capture);
    capture = NULL;
    acknowledge(pipe, UNSEALED);
    STEP(lumi_capture_open(path, LUMI_CAPTURE_WRITE, &capture, error));
    STEP(store(capture, camera, 6, error));
    acknowledge(pipe, 6);
    STEP(lumi_capture_seal(capture, NULL, error));
    acknowledge(pipe, SEALED);
done:
    lumi_capture_close(capture);
    return code;
}

struct heard {
    bool begun, sealed, frame[8];
};

/* Runs the story in a child that dies at counted call `at`; false if it lived to the end. */
static bool die_at(const char *path, bool live, long at, struct heard *heard)
{
    int ends[2], what, status;

    memset(heard, 0, sizeof *heard);
    assert_int_equal(pipe(ends), 0);
    fflush(NULL);
    pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        close(ends[0]);
        calls = 0;
        kill_at = at;
        struct lumi_error error = {0};
        int code = story(path, live, ends[1], &error);
        if (code != LUMI_OK)
            fprintf(stderr, "%s\n", error.text);
        _exit(code == LUMI_OK ? 0 : 1);
    }
    close(ends[1]);
    while (read(ends[0], &what, sizeof what) == sizeof what) {
        if (what == BEGUN)
            heard->begun = true;
        else if (what == SEALED || what == UNSEALED)
            heard->sealed = what == SEALED;
        else
            heard->frame[what] = true;
    }
    close(ends[0]);
    assert_int_equal(waitpid(child, &status, 0), child);
    if (WIFEXITED(status))
        assert_int_equal(WEXITSTATUS(status), 0);
    else
        assert_int_equal(WTERMSIG(status), SIGKILL);
    return !WIFEXITED(status);
}

static void frame_is_whole(const struct lumi_capture *capture, const struct lumi_capture_frame *frame)
{
    unsigned char wanted[3000], have[3001];
    size_t count = picture((unsigned)frame->column, wanted, sizeof wanted);
    char *path = lumi_capture_join(capture, frame->file);
    FILE *file = fopen(path, "rb");

    assert_non_null(file);
    assert_int_equal(fread(have, 1, sizeof have, file), count);
    assert_memory_equal(have, wanted, count);
    fclose(file);
    lumi_free(path);
}

/* Opens what was left, finds all that was acknowledged whole, and can go on from there. */
static void recover(const char *path, const struct heard *heard)
{
    struct lumi_capture_frame *frames;
    struct lumi_capture *capture;
    bool there[8] = {false};
    int count;

    OK(lumi_capture_open(path, LUMI_CAPTURE_WRITE, &capture, error));
    OK(lumi_capture_frames(capture, LUMI_FRAMES_USABLE, &frames, &count, error));
    for (int i = 0; i < count; i++) {
        there[frames[i].column] = true;
        frame_is_whole(capture, &frames[i]);
    }
    for (int i = 0; i < 7; i++)
        assert_true(there[i] || !heard->frame[i]);
    assert_true(there[3] == there[4] && there[4] == there[5]); /* a batch is all or nothing */
    lumi_free(frames);
    assert_int_equal(problems_of(path), 0);
    OK(lumi_capture_seal(capture, NULL, error));
    lumi_capture_close(capture);
    assert_int_equal(problems_of(path), 0);
}

static void remove_path(const char *path)
{
    char partial[PATH_SIZE + 16];

    snprintf(partial, sizeof partial, "%.500s.partial", path);
    capture_remove_tree(path, NULL);
    capture_remove_tree(partial, NULL);
}

static void what_was_acknowledged_survives_a_kill_at_any_moment(void **state)
{
    const char *path = in_scratch(state, "live");
    struct heard heard;
    long at = 1;

    while (die_at(path, true, at, &heard)) {
        if (heard.sealed)
            assert_int_equal(access(in_scratch(state, "live/tagmanifest-sha256.txt"), F_OK), 0);
        if (heard.begun)
            recover(path, &heard);
        remove_path(path);
        at++;
    }
    assert_true(at > 100);
    assert_true(heard.sealed && heard.frame[6]);
    assert_int_equal(problems_of(path), 0);
}

static void a_killed_import_leaves_a_whole_capture_or_none(void **state)
{
    const char *path = in_scratch(state, "import");
    struct heard heard;
    long at = 1;

    while (die_at(path, false, at, &heard)) {
        if (access(path, F_OK) == 0)
            assert_int_equal(problems_of(path), 0);
        else
            OK(story(path, false, -1, error)); /* over what the killed one left */
        assert_int_not_equal(access(in_scratch(state, "import.partial"), F_OK), 0);
        assert_int_equal(problems_of(path), 0);
        remove_path(path);
        at++;
    }
    assert_true(at > 30);
}

static void nothing_is_acknowledged_before_it_is_synced(void **state)
{
    struct lumi_capture *capture;

    OK(lumi_capture_create_live(in_scratch(state, "live"), &capture, error));
    int64_t camera = add_camera(capture, "c");
    watching = true;
    for (int i = 0; i < 5; i++) {
        OK(store(capture, camera, i, error));
        assert_int_equal(dirty_count, 0);
    }
    OK(lumi_capture_begin(capture, error));
    for (int i = 5; i < 8; i++)
        OK(store(capture, camera, i, error));
    assert_true(dirty_count >= 3);
    OK(lumi_capture_commit(capture, error));
    assert_int_equal(dirty_count, 0);
    OK(lumi_capture_seal(capture, NULL, error));
    assert_int_equal(dirty_count, 0);
    watching = false;
    lumi_capture_close(capture);
}

static void a_full_disk_is_said_and_leaves_nothing_half_written(void **state)
{
    const char *import = in_scratch(state, "import"), *live = in_scratch(state, "live");
    struct lumi_error error;
    int refusals = 0, code;

    for (long long room = 0; room < 400000; room += room < 60000 ? 1777 : 9973) {
        space = room;
        code = story(import, false, -1, &error);
        space = -1;
        if (code != LUMI_OK) {
            refusals++;
            if (code != LUMI_ERR_NOSPACE)
                fail_msg("room %lld: code %d, %s", room, code, error.text);
            assert_int_equal(lumi_exit_status(code), 1);
            assert_int_not_equal(access(import, F_OK), 0);
            assert_int_not_equal(access(in_scratch(state, "import.partial"), F_OK), 0);
        }
        remove_path(import);

        space = room;
        code = story(live, true, -1, &error);
        space = -1;
        if (code != LUMI_OK && code != LUMI_ERR_NOSPACE)
            fail_msg("room %lld: code %d, %s", room, code, error.text);
        if (access(live, F_OK) == 0)
            recover(live, &(struct heard){0});
        remove_path(live);
    }
    assert_true(refusals > 20);
}

static void running_out_of_memory_is_an_error_like_any_other(void **state)
{
    const char *path = in_scratch(state, "a");
    struct lumi_verify_result result;
    struct lumi_capture_frame *frames;
    struct lumi_capture *capture;
    struct lumi_error error;
    int failures = 0, count;

    for (int n = 0; n < 100; n++) {
        lumi_alloc_fail_after(n);
        int code = story(path, false, -1, &error);
        if (code == LUMI_OK)
            code = lumi_capture_verify(path, NULL, NULL, NULL, &result, &error);
        if (code == LUMI_OK)
            code = lumi_capture_open(path, LUMI_CAPTURE_READ, &capture, &error);
        if (code == LUMI_OK) {
            code = lumi_capture_frames(capture, LUMI_FRAMES_ALL, &frames, &count, &error);
            lumi_free(frames);
            lumi_capture_close(capture);
        }
        lumi_alloc_fail_after(-1);
        if (code != LUMI_OK) {
            failures++;
            if (code != LUMI_ERR_NOMEM)
                fail_msg("allocation %d: code %d, %s", n, code, error.text);
        }
        assert_int_not_equal(access(in_scratch(state, "a.partial"), F_OK), 0);
        remove_path(path);
    }
    assert_in_range(failures, 20, 99);
}

static void strays_are_set_aside_and_lost_files_are_noticed(void **state)
{
    struct lumi_capture_frame *frames;
    struct lumi_capture *capture;
    int count;

    OK(lumi_capture_create_live(in_scratch(state, "live"), &capture, error));
    int64_t camera = add_camera(capture, "c");
    for (int i = 0; i < 3; i++)
        OK(store(capture, camera, i, error));
    lumi_capture_close(capture);
    shell("cd '%s/data/frames' && echo x > stray.jpg && echo x > .f9.jpg.tmp && rm f001.jpg",
          in_scratch(state, "live"));
    OK(lumi_capture_open(in_scratch(state, "live"), LUMI_CAPTURE_WRITE, &capture, error));
    assert_int_equal(access(in_scratch(state, "live/unclaimed/stray.jpg"), F_OK), 0);
    assert_int_not_equal(access(in_scratch(state, "live/data/frames/.f9.jpg.tmp"), F_OK), 0);
    OK(lumi_capture_frames(capture, LUMI_FRAMES_ALL, &frames, &count, error));
    assert_int_equal(frames[1].state, LUMI_FRAME_REJECTED);
    lumi_free(frames);
    OK(lumi_capture_seal(capture, NULL, error));
    lumi_capture_close(capture);
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, scratch_setup, scratch_teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(what_was_acknowledged_survives_a_kill_at_any_moment),
        TEST(a_killed_import_leaves_a_whole_capture_or_none),
        TEST(nothing_is_acknowledged_before_it_is_synced),
        TEST(a_full_disk_is_said_and_leaves_nothing_half_written),
        TEST(running_out_of_memory_is_an_error_like_any_other),
        TEST(strays_are_set_aside_and_lost_files_are_noticed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
