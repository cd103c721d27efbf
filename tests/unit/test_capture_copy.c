/* Reading an open capture through a copy that takes no lock. */
#include "capture_fixture.h"

#include "proto/base/file.h"
#include "proto/base/memory.h"
#include "proto/capture/capture_priv.h"

struct live {
    char path[PATH_SIZE];
    struct lumi_capture *capture;
    int64_t camera;
    int frames;
};

static void open_live(void **state, struct live *live)
{
    struct lumi_capture_lens lens = {.name = "lens"};
    int64_t lens_id;

    *live = (struct live){0};
    snprintf(live->path, sizeof live->path, "%s/live", (char *)*state);
    lumi_lens_init_pinhole(&lens.lens, 64, 48, 1);
    OK(lumi_capture_create_live(live->path, &live->capture, error));
    OK(lumi_capture_add_lens(live->capture, &lens, &lens_id, error));
    OK(lumi_capture_add_camera(live->capture, "c00", lens_id, &live->camera, error));
}

static void plan_frame(struct live *live)
{
    char name[32];
    struct lumi_capture_new_frame frame = {.name = name, .camera = live->camera, .row = -1, .column = -1};
    int64_t id;

    snprintf(name, sizeof name, "f%04d", live->frames++);
    OK(lumi_capture_add_frame(live->capture, &frame, &id, error));
}

static int frames_in_copy(const char *path)
{
    struct lumi_capture *copy;
    struct lumi_capture_frame *frames;
    int count;

    OK(lumi_capture_open_copy(path, &copy, error));
    OK(lumi_capture_frames(copy, LUMI_FRAMES_ALL, &frames, &count, error));
    lumi_free(frames);
    lumi_capture_close(copy);
    return count;
}

static void a_copy_has_what_was_committed_and_nothing_else(void **state)
{
    struct live live;

    open_live(state, &live);
    assert_int_equal(frames_in_copy(live.path), 0);
    plan_frame(&live);
    assert_int_equal(frames_in_copy(live.path), 1);
    OK(lumi_capture_begin(live.capture, error));
    for (int i = 0; i < 5; i++)
        plan_frame(&live);
    assert_int_equal(frames_in_copy(live.path), 1);
    OK(lumi_capture_commit(live.capture, error));
    assert_int_equal(frames_in_copy(live.path), 6);
    lumi_capture_close(live.capture);
    assert_int_equal(frames_in_copy(live.path), 6);
}

/* SQLite puts the log into the database every thousand pages, and begins it anew. */
static void a_copy_is_whole_however_often_the_log_began_anew(void **state)
{
    struct live live;

    open_live(state, &live);
    for (int i = 0; i < 700; i++) {
        plan_frame(&live);
        if (i % 50 == 0)
            assert_int_equal(frames_in_copy(live.path), i + 1);
    }
    assert_int_equal(frames_in_copy(live.path), 700);
    lumi_capture_close(live.capture);
}

static void who_holds_a_copy_does_not_keep_the_writer_from_sealing(void **state)
{
    struct lumi_capture *reader, *copy;
    struct live live;

    open_live(state, &live);
    plan_frame(&live);
    OK(lumi_capture_open(live.path, LUMI_CAPTURE_READ, &reader, error));
    OK(lumi_capture_open_copy(live.path, &copy, error));
    FAILS(lumi_capture_seal(live.capture, NULL, error), LUMI_ERR_BUSY, "locked");
    lumi_capture_close(reader);
    OK(lumi_capture_seal(live.capture, NULL, error));
    assert_false(lumi_capture_sealed(copy));
    lumi_capture_close(copy);
    lumi_capture_close(live.capture);
    OK(lumi_capture_open_copy(live.path, &copy, error));
    assert_true(lumi_capture_sealed(copy));
    lumi_capture_close(copy);
    assert_int_equal(frames_in_copy(live.path), 1);
}

static void a_change_is_seen_once(void **state)
{
    struct lumi_capture_stamp stamp = {{0}};
    struct live live;
    bool changed;

    open_live(state, &live);
    OK(lumi_capture_changed(live.path, &stamp, &changed, error));
    assert_true(changed);
    OK(lumi_capture_changed(live.path, &stamp, &changed, error));
    assert_false(changed);
    plan_frame(&live);
    OK(lumi_capture_changed(live.path, &stamp, &changed, error));
    assert_true(changed);
    lumi_capture_close(live.capture);
    shell("rm -r '%s'", live.path);
    FAILS(lumi_capture_changed(live.path, &stamp, &changed, error), LUMI_ERR_NOTFOUND, "live");
}

static void read_file(const char *path, const char *name, uint8_t **data, size_t *size)
{
    char whole[2 * PATH_SIZE];

    snprintf(whole, sizeof whole, "%s/data/%s", path, name);
    OK(lumi_file_read(whole, (size_t)1 << 30, data, size, error));
}

/* The rows of a database brought up to date with a log; −1: none. */
static int rows_with(const uint8_t *db, size_t db_size, const uint8_t *log, size_t log_size)
{
    struct lumi_capture *capture;
    struct lumi_capture_frame *frames;
    uint8_t *copy = lumi_alloc(db_size, 1);
    size_t size = db_size;
    int count = -1;

    memcpy(copy, db, db_size);
    assert_int_equal(capture_apply_log(&copy, &size, log, log_size), LUMI_OK);
    copy[18] = copy[19] = 1;
    if (lumi_capture_open_memory(copy, size, "copy", &capture, NULL) == LUMI_OK) {
        if (lumi_capture_frames(capture, LUMI_FRAMES_ALL, &frames, &count, NULL) == LUMI_OK)
            lumi_free(frames);
        lumi_capture_close(capture);
    }
    lumi_free(copy);
    return count;
}

static void of_a_log_that_is_cut_anywhere_whole_commits_count(void **state)
{
    struct live live;
    uint8_t *db, *log;
    size_t db_size, log_size;
    int before = -1;

    open_live(state, &live);
    for (int i = 0; i < 8; i++)
        plan_frame(&live);
    read_file(live.path, "capture.db", &db, &db_size);
    read_file(live.path, "capture.db-wal", &log, &log_size);
    for (size_t size = 0; size < log_size; size += 1021) {
        const int rows = rows_with(db, db_size, log, size);
        assert_true(rows >= before);
        before = rows;
    }
    assert_int_equal(rows_with(db, db_size, log, log_size), 8);
    /* A page that is not what its checksum says ends what counts. */
    log[log_size - 100] ^= 1;
    assert_int_equal(rows_with(db, db_size, log, log_size), 7);
    log[40] ^= 1;
    assert_true(rows_with(db, db_size, log, log_size) <= 0);
    lumi_free(db);
    lumi_free(log);
    lumi_capture_close(live.capture);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(a_copy_has_what_was_committed_and_nothing_else, scratch_setup,
                                        scratch_teardown),
        cmocka_unit_test_setup_teardown(a_copy_is_whole_however_often_the_log_began_anew, scratch_setup,
                                        scratch_teardown),
        cmocka_unit_test_setup_teardown(who_holds_a_copy_does_not_keep_the_writer_from_sealing, scratch_setup,
                                        scratch_teardown),
        cmocka_unit_test_setup_teardown(a_change_is_seen_once, scratch_setup, scratch_teardown),
        cmocka_unit_test_setup_teardown(of_a_log_that_is_cut_anywhere_whole_commits_count, scratch_setup,
                                        scratch_teardown),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
