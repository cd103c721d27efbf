/* daemon/store and daemon/handover under bad luck: killed at any call that changes the disk, and a disk that fills up.
 * Then the store goes on where it was, and the studio takes every capture in exactly once. */
#include "tests/unit/capture_fixture.h"
#include "tests/unit/disk_model.h"

#include "daemon/handover/handover.h"
#include "daemon/store/store.h"
#include "proto/base/memory.h"

#include <glib.h>
#include <sched.h>
#include <sys/wait.h>

#define FRAMES 6

static size_t frame_bytes(int frame, unsigned char *bytes, size_t size)
{
    return picture((unsigned)frame * 77, bytes, size);
}

static int plan_all(const char *path, struct lumi_error *error)
{
    struct lumi_capture_lens lens = small_lens();
    struct lumi_capture *capture;
    int64_t id, camera;
    int code;

    LUMI_TRY(lumi_capture_create_live(path, &capture, error));
    LUMI_GOTO(code, done, lumi_capture_begin(capture, error));
    LUMI_GOTO(code, done, lumi_capture_add_lens(capture, &lens, &id, error));
    LUMI_GOTO(code, done, lumi_capture_add_camera(capture, "c", id, &camera, error));
    for (int i = 1; i <= FRAMES; i++) {
        char name[16];
        snprintf(name, sizeof name, "f%d", i);
        const struct lumi_capture_new_frame frame = {.name = name, .camera = camera, .row = 0, .column = i};
        LUMI_GOTO(code, done, lumi_capture_add_frame(capture, &frame, &id, error));
    }
    code = lumi_capture_commit(capture, error);
done:
    lumi_capture_close(capture);
    return code;
}

static void acknowledge(int pipe, uint64_t what)
{
    if (pipe >= 0)
        syscall(SYS_write, pipe, &what, sizeof what);
}

/* Gives the frames that are not there yet, judges every second, seals; acknowledges what is done as it is. */
static int story(const char *path, const char *second, bool synchronous, int pipe, struct lumi_error *error)
{
    static unsigned char bytes[FRAMES + 1][3000];
    struct lumi_capture_frame *frames;
    struct lumi_store_options options;
    struct lumi_capture *capture;
    struct lumi_store *store;
    struct lumi_store_done done;
    int count, given = 0, code;

    LUMI_TRY(lumi_capture_open(path, LUMI_CAPTURE_WRITE, &capture, error));
    LUMI_TRY(lumi_capture_frames(capture, LUMI_FRAMES_ALL, &frames, &count, error));
    lumi_store_options_init(&options);
    options.synchronous = synchronous;
    options.second_copy = second;
    options.writers = 2;
    LUMI_TRY(lumi_store_open(capture, &options, &store, error));
    for (int i = 0; i < count; i++) {
        struct lumi_store_job job = {.kind = LUMI_STORE_FRAME, .id = (uint64_t)frames[i].id, .frame = frames[i].id};
        const int frame = (int)frames[i].id;
        if (frames[i].file[0])
            continue;
        job.file = small_file();
        job.pieces[0] = (struct iovec){bytes[frame], frame_bytes(frame, bytes[frame], sizeof bytes[frame])};
        job.piece_count = 1;
        LUMI_TRY(lumi_store_give(store, &job, error));
        given++;
        if (i % 2) {
            job = (struct lumi_store_job){.kind = LUMI_STORE_JUDGED, .id = 100, .frame = frame, .accepted = true};
            LUMI_TRY(lumi_store_give(store, &job, error));
            given++;
        }
        if (i % 3 == 2)
            lumi_store_work(store, 0);
    }
    lumi_free(frames);
    const struct lumi_store_job seal = {.kind = LUMI_STORE_SEAL, .id = 101, .verify = true};
    LUMI_TRY(lumi_store_give(store, &seal, error));
    lumi_store_work(store, 0);
    code = LUMI_OK;
    for (given++; given > 0;) {
        if (!lumi_store_done(store, &done)) {
            sched_yield();
            continue;
        }
        given--;
        if (done.code == LUMI_OK)
            acknowledge(pipe, done.id);
        else
            code = lumi_fail(error, done.code, "%s", done.text);
    }
    lumi_store_close(store, NULL);
    return code;
}

/* Runs something in a child that dies at counted call `at`. False: it lived to its end. `heard`: what it acknowledged.
 */
static bool die_at(long at, int (*what)(void *context, int pipe, struct lumi_error *error), void *context,
                   bool heard[128])
{
    uint64_t id;
    int ends[2], status;

    memset(heard, 0, 128 * sizeof *heard);
    assert_int_equal(pipe(ends), 0);
    fflush(NULL);
    const pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        struct lumi_error error = {0};
        close(ends[0]);
        calls = 0;
        kill_at = at;
        const int code = what(context, ends[1], &error);
        if (code != LUMI_OK)
            fprintf(stderr, "%s\n", error.text);
        _exit(code == LUMI_OK ? 0 : 1);
    }
    close(ends[1]);
    while (read(ends[0], &id, sizeof id) == sizeof id)
        heard[id] = true;
    close(ends[0]);
    assert_int_equal(waitpid(child, &status, 0), child);
    if (WIFEXITED(status))
        assert_int_equal(WEXITSTATUS(status), 0);
    else
        assert_int_equal(WTERMSIG(status), SIGKILL);
    return !WIFEXITED(status);
}

/* ---- The store ---- */

struct place {
    const char *path, *second;
    bool synchronous;
};

static int tell_story(void *context, int pipe, struct lumi_error *error)
{
    const struct place *place = context;

    return story(place->path, place->second, place->synchronous, pipe, error);
}

/* What was acknowledged is there, whole, whatever else is. */
static void check_acknowledged(const char *path, const bool *heard)
{
    struct lumi_capture_frame *frames;
    struct lumi_capture *capture;
    unsigned char wanted[3000];
    int count;

    OK(lumi_capture_open(path, LUMI_CAPTURE_WRITE, &capture, error));
    OK(lumi_capture_frames(capture, LUMI_FRAMES_ALL, &frames, &count, error));
    assert_int_equal(count, FRAMES);
    for (int i = 0; i < count; i++) {
        const bool there = frames[i].state == LUMI_FRAME_RECEIVED || frames[i].state == LUMI_FRAME_ACCEPTED;
        assert_true(there || !heard[frames[i].id]);
        assert_true(there || frames[i].state == LUMI_FRAME_PLANNED);
        if (there)
            assert_int_equal(frames[i].bytes, frame_bytes((int)frames[i].id, wanted, sizeof wanted));
    }
    lumi_free(frames);
    lumi_capture_close(capture);
    assert_int_equal(problems_of(path), 0); /* checksums as well */
}

static void killed_at(void **state, const struct place *place, long first, long stride)
{
    bool heard[128], died = true;
    long at;

    shell("mkdir -p '%s'", place->second);
    for (at = first; died; at += stride) {
        OK(plan_all(place->path, error));
        died = die_at(at, tell_story, (void *)place, heard);
        check_acknowledged(place->path, heard);
        if (heard[101]) /* sealed: with its second copy */
            assert_int_equal(problems_of(in_scratch(state, "second/live")), 0);
        OK(story(place->path, place->second, true, -1, error));
        assert_int_equal(problems_of(place->path), 0);
        shell("diff -r --exclude=unclaimed '%s' '%s/live' && rm -r '%s' '%s/live'", place->path, place->second,
              place->path, place->second);
    }
    assert_true(at > 60);
}

static void a_store_that_is_killed_anywhere_goes_on(void **state)
{
    const struct place place = {in_scratch(state, "live"), in_scratch(state, "second"), true};

    killed_at(state, &place, 1, 2);
}

static void a_store_with_threads_that_is_killed_anywhere_goes_on(void **state)
{
    const struct place place = {in_scratch(state, "live"), in_scratch(state, "second"), false};

    killed_at(state, &place, 2, 7);
}

static void nothing_is_done_before_it_is_synced(void **state)
{
    static unsigned char bytes[3000];
    struct lumi_store_options options;
    struct lumi_capture *capture;
    struct lumi_store_done done;
    struct lumi_store *store;

    OK(plan_all(in_scratch(state, "live"), error));
    OK(lumi_capture_open(in_scratch(state, "live"), LUMI_CAPTURE_WRITE, &capture, error));
    lumi_store_options_init(&options);
    options.synchronous = true;
    OK(lumi_store_open(capture, &options, &store, error));
    watching = true;
    for (int i = 1; i <= FRAMES; i++) {
        struct lumi_store_job job = {.kind = LUMI_STORE_FRAME, .id = 1, .frame = i};
        job.file = small_file();
        job.pieces[0] = (struct iovec){bytes, sizeof bytes};
        job.piece_count = 1;
        OK(lumi_store_give(store, &job, error));
        if (i % 2)
            continue; /* two in one commit */
        lumi_store_work(store, 0);
        assert_true(lumi_store_done(store, &done) && done.code == LUMI_OK);
        assert_true(lumi_store_done(store, &done) && done.code == LUMI_OK);
        assert_int_equal(dirty_count, 0);
    }
    watching = false;
    OK(lumi_store_close(store, error));
}

static void a_disk_that_fills_up_loses_nothing_that_was_done(void **state)
{
    const char *path = in_scratch(state, "live");
    struct lumi_error refused = {0};
    int refusals = 0;

    for (long long room = 20000; room < 260000; room += 4999) {
        const bool nothing[128] = {false};
        OK(plan_all(path, error));
        space = room;
        const int code = story(path, NULL, true, -1, &refused);
        space = -1;
        refusals += code != LUMI_OK;
        if (code != LUMI_OK && code != LUMI_ERR_NOSPACE)
            fail_msg("room %lld: code %d, %s", room, code, refused.text);
        check_acknowledged(path, nothing);
        OK(story(path, NULL, true, -1, error));
        assert_int_equal(problems_of(path), 0);
        shell("rm -r '%s'", path);
    }
    assert_true(refusals > 5);
}

/* ---- Taking in ---- */

static void **scratch;

/* Takes in and processes what lies in the folder, until nothing is left to do. */
static int take_in(void *context, int pipe, struct lumi_error *error)
{
    struct lumi_handover_options process;
    struct lumi_ingest_options options;
    struct lumi_process_status list[8];
    struct lumi_handover *handover;
    struct lumi_ingest *ingest;
    char command[2 * PATH_SIZE];
    bool busy = true;

    (void)context;
    (void)pipe;
    lumi_handover_options_init(&process);
    snprintf(command, sizeof command, "sh -c 'echo \"%%n\" >> \"$0\"' '%.400s'", in_scratch(scratch, "log"));
    process.command = command;
    process.journal = in_scratch(scratch, "handover.journal");
    LUMI_TRY(lumi_handover_create(&process, &handover, error));
    lumi_ingest_options_init(&options);
    options.folder = in_scratch(scratch, "in");
    options.into = in_scratch(scratch, "kept");
    options.journal = in_scratch(scratch, "ingest.journal");
    options.handover = handover;
    options.look = 0.001;
    LUMI_TRY(lumi_ingest_create(&options, &ingest, error));
    while (busy) {
        g_main_context_iteration(NULL, TRUE);
        busy = !lumi_ingest_idle(ingest);
        const int count = lumi_handover_list(handover, list, 8);
        for (int i = 0; i < count; i++)
            busy = busy || list[i].state < LUMI_PROCESS_DONE;
    }
    lumi_ingest_destroy(ingest);
    lumi_handover_destroy(handover);
    return LUMI_OK;
}

static void seal_capture(const char *path, unsigned seed)
{
    struct lumi_capture *capture;

    OK(lumi_capture_create(path, &capture, error));
    const int64_t camera = add_camera(capture, "c");
    store_frame(capture, camera, "f1", seed);
    store_frame(capture, camera, "f2", seed + 1);
    OK(lumi_capture_publish(capture, NULL, error));
    lumi_capture_close(capture);
}

static void a_studio_that_is_killed_anywhere_takes_every_capture_in_once(void **state)
{
    bool heard[128], died = true;
    long at;

    scratch = state;
    shell("mkdir '%s' '%s'", in_scratch(state, "in"), in_scratch(state, "kept"));
    seal_capture(in_scratch(state, "in/a.capture"), 1);
    seal_capture(in_scratch(state, "in/b"), 9);
    for (at = 1; died; at += 5) {
        died = die_at(at, take_in, NULL, heard);
        if (died)
            die_at(at / 2 + 1, take_in, NULL, heard); /* and once more while it mends */
        OK(take_in(NULL, -1, error));
        shell("cd '%s' && diff -r in/a.capture kept/a.capture && diff -r in/b kept/b && "
              "test \"$(ls -A kept | tr '\\n' ' ')\" = 'a.capture b ' && "
              "test \"$(sort -u log | tr '\\n' ' ')\" = 'a b ' && test $(grep -c taken ingest.journal) = 2 && "
              "test $(grep -c done handover.journal) = 2 && rm -r kept/* *.journal log",
              (char *)*state);
    }
    assert_true(at > 40);
}

#define IN_SCRATCH(test) cmocka_unit_test_setup_teardown(test, scratch_setup, scratch_teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        IN_SCRATCH(a_store_that_is_killed_anywhere_goes_on),
        IN_SCRATCH(a_store_with_threads_that_is_killed_anywhere_goes_on),
        IN_SCRATCH(nothing_is_done_before_it_is_synced),
        IN_SCRATCH(a_disk_that_fills_up_loses_nothing_that_was_done),
        IN_SCRATCH(a_studio_that_is_killed_anywhere_takes_every_capture_in_once),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
