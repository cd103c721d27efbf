/* proto/capture: what goes in comes out, in order and whole; frames move through their states and no other way. */
#include "tests/unit/capture_fixture.h"

#include "proto/base/memory.h"
#include "proto/capture/capture_priv.h"
#include "proto/mechanism/rig.h"

#include <math.h>
#include <sys/stat.h>

static void a_published_capture_gives_back_what_was_stored(void **state)
{
    const char *path = in_scratch(state, "a.capture");
    struct lumi_capture_lens lens = small_lens(), back;
    struct lumi_capture_file file = small_file();
    struct lumi_capture *capture;
    struct lumi_capture_frame *frames;
    struct lumi_pose pose;
    int64_t lens_id, camera, id;
    char text[64];
    int count;

    lens.lens.fx = 0.1 + 0.2;
    lens.parameters[0] = 1.0 / 3;
    lumi_pose_look(lumi_vec3(1.0 / 3, 0.1, -2), lumi_vec3(1, 2, 3), lumi_vec3(0, 0, 1), &pose);
    file.exif = "MM\0*";
    file.exif_size = 4;
    file.exposure_s = 1.0 / 250;
    file.iso = 400;
    file.camera_time_us = 12345678901;
    OK(lumi_capture_create(path, &capture, error));
    assert_int_not_equal(access(path, F_OK), 0);
    OK(lumi_capture_set_meta(capture, "surface", "sphere", error));
    OK(lumi_capture_add_lens(capture, &lens, &lens_id, error));
    OK(lumi_capture_add_camera(capture, "c00", lens_id, &camera, error));
    const struct lumi_capture_new_frame frame = {"one", "images/one.jpg", camera, 0, 0, 3, 4};
    OK(lumi_capture_add_frame(capture, &frame, &id, error));
    OK(lumi_capture_trigger_frame(capture, id, 77, error));
    OK(lumi_capture_store_bytes(capture, id, "abc", 3, &file, error));
    OK(lumi_capture_set_pose(capture, id, &pose, LUMI_POSE_TRUE, "a test", error));
    add_frame(capture, camera, "two");
    OK(lumi_capture_publish(capture, "2026-11-23", error));
    lumi_capture_close(capture);
    assert_int_not_equal(access(in_scratch(state, "a.capture.partial"), F_OK), 0);

    OK(lumi_capture_open(path, LUMI_CAPTURE_READ, &capture, error));
    assert_true(lumi_capture_sealed(capture));
    OK(lumi_capture_get_meta(capture, "surface", text, sizeof text, error));
    assert_string_equal(text, "sphere");
    OK(lumi_capture_frames(capture, LUMI_FRAMES_ALL, &frames, &count, error));
    assert_int_equal(count, 2);
    assert_string_equal(frames[0].name, "one");
    assert_string_equal(frames[0].original, "images/one.jpg");
    assert_string_equal(frames[0].file, "data/frames/one.jpg");
    assert_string_equal(frames[0].sha256, "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    assert_int_equal(frames[0].bytes, 3);
    assert_int_equal(frames[0].state, LUMI_FRAME_RECEIVED);
    assert_int_equal(frames[0].row, 3);
    assert_int_equal(frames[0].column, 4);
    assert_true(frames[0].lens.fx == 0.1 + 0.2 && frames[0].lens.k1 == -0.1);
    assert_string_equal(frames[0].lens_model, "SIMPLE_RADIAL");
    assert_true(frames[0].has_pose && frames[0].pose_source == LUMI_POSE_TRUE);
    assert_memory_equal(&frames[0].pose, &pose, sizeof pose);
    assert_true(frames[0].exposure_s == 1.0 / 250 && frames[0].iso == 400);
    assert_true(frames[0].trigger_time_us == 77 && frames[0].camera_time_us == 12345678901);
    assert_int_equal(frames[1].state, LUMI_FRAME_PLANNED);
    assert_false(frames[1].has_pose);
    assert_true(frames[1].trigger_time_us == LUMI_NO_TIME);
    OK(lumi_capture_lens(capture, frames[0].lens_id, &back, error));
    assert_memory_equal(back.parameters, lens.parameters, sizeof back.parameters);
    void *exif;
    size_t exif_size;
    OK(lumi_capture_exif(capture, frames[0].id, &exif, &exif_size, error));
    assert_int_equal(exif_size, 4);
    assert_memory_equal(exif, "MM\0*", 4);
    lumi_free(exif);
    lumi_free(frames);
    OK(lumi_capture_frames(capture, LUMI_FRAMES_USABLE, &frames, &count, error));
    assert_int_equal(count, 1);
    lumi_free(frames);
    lumi_capture_close(capture);
    assert_int_equal(problems_of(path), 0);
}

static void frames_come_in_the_order_of_their_positions_and_shots(void **state)
{
    struct lumi_capture *capture;
    struct lumi_capture_frame *frames;
    char name[16];
    int count;

    OK(lumi_capture_create(in_scratch(state, "a"), &capture, error));
    int64_t left = add_camera(capture, "left"), right = add_camera(capture, "right");
    OK(lumi_capture_begin(capture, error));
    for (int number = 9; number >= 0; number--) {
        const struct lumi_capture_position position = {number, number / 5, number * 400, number * 0.1, 0.5};
        int64_t id, shot[2], frame;
        OK(lumi_capture_add_position(capture, &position, &id, error));
        for (int bracket = 1; bracket >= 0; bracket--) {
            OK(lumi_capture_add_shot(capture, id, bracket, bracket * 2.0, &shot[bracket], error));
            for (int camera = 1; camera >= 0; camera--) {
                snprintf(name, sizeof name, "f%d%d%d", number, bracket, camera);
                const struct lumi_capture_new_frame add = {name,   NULL,  camera ? right : left, 0, shot[bracket],
                                                           camera, number};
                OK(lumi_capture_add_frame(capture, &add, &frame, error));
            }
        }
    }
    OK(lumi_capture_commit(capture, error));
    OK(lumi_capture_frames(capture, LUMI_FRAMES_ALL, &frames, &count, error));
    assert_int_equal(count, 40);
    for (int i = 0; i < 40; i++) {
        snprintf(name, sizeof name, "f%d%d%d", i / 4, i / 2 % 2, i % 2);
        assert_string_equal(frames[i].name, name);
        assert_int_equal(frames[i].turn, i / 20);
        assert_int_equal(frames[i].step, i / 4 * 400);
        assert_true(frames[i].exposure_offset == i / 2 % 2 * 2.0 && frames[i].drop == 0.5);
        assert_string_equal(frames[i].camera_name, i % 2 ? "right" : "left");
    }
    lumi_free(frames);
    lumi_capture_close(capture);
}

static void a_frame_moves_through_its_states_and_no_other_way(void **state)
{
    struct lumi_capture_file file = small_file();
    struct lumi_capture *capture;
    struct lumi_capture_frame *frames;
    int64_t again;
    int count;

    OK(lumi_capture_create_live(in_scratch(state, "a"), &capture, error));
    int64_t camera = add_camera(capture, "c"), id = add_frame(capture, camera, "f");
    const struct lumi_pose pose = {.t = {1, 2, 3}, .r = {1, 0, 0, 0, 1, 0, 0, 0, 1}};
    OK(lumi_capture_set_pose(capture, id, &pose, LUMI_POSE_PRIOR, "plan", error));
    FAILS(lumi_capture_judge_frame(capture, id, true, 1, NULL, error), LUMI_ERR_ARG, "'f' is planned");
    FAILS(lumi_capture_retake_frame(capture, id, &again, error), LUMI_ERR_ARG, "cannot become retaken");
    OK(lumi_capture_trigger_frame(capture, id, 5, error));
    OK(lumi_capture_trigger_frame(capture, id, 6, error)); /* told again: the first time is kept */
    OK(lumi_capture_store_bytes(capture, id, "x", 1, &file, error));
    FAILS(lumi_capture_store_bytes(capture, id, "y", 1, &file, error), LUMI_ERR_ARG, "received already");
    OK(lumi_capture_judge_frame(capture, id, true, 0.5, NULL, error));
    OK(lumi_capture_judge_frame(capture, id, false, 0.1, "blur", error));
    OK(lumi_capture_judge_frame(capture, id, true, 0.5, NULL, error));
    OK(lumi_capture_judge_frame(capture, id, false, 0.1, "blur", error));
    OK(lumi_capture_retake_frame(capture, id, &again, error));
    FAILS(lumi_capture_retake_frame(capture, id, &again, error), LUMI_ERR_ARG, "is retaken");
    OK(lumi_capture_trigger_frame(capture, again, 9, error));
    OK(lumi_capture_judge_frame(capture, again, false, 0, "lost", error));
    FAILS(lumi_capture_judge_frame(capture, again, true, 0, NULL, error), LUMI_ERR_ARG, "has no file");
    int64_t third;
    OK(lumi_capture_retake_frame(capture, again, &third, error));
    OK(lumi_capture_store_bytes(capture, third, "z", 1, &file, error));
    OK(lumi_capture_frames(capture, LUMI_FRAMES_ALL, &frames, &count, error));
    assert_int_equal(count, 3);
    assert_string_equal(frames[1].name, "f.2");
    assert_string_equal(frames[2].name, "f.3");
    assert_int_equal(frames[2].shot, 2);
    assert_int_equal(frames[0].state, LUMI_FRAME_RETAKEN);
    assert_int_equal(frames[0].trigger_time_us, 5);
    assert_int_equal(frames[2].retake_of, again);
    assert_true(frames[2].has_pose && frames[2].pose_source == LUMI_POSE_PRIOR); /* it is taken from the same place */
    assert_true(frames[2].pose.t.y == 2);
    lumi_free(frames);
    lumi_capture_close(capture);
}

static int sql(void **state, const char *capture, const char *text)
{
    char path[2 * PATH_SIZE] = "";
    sqlite3 *db;

    strcat(path, in_scratch(state, capture));
    strcat(path, "/data/capture.db");
    assert_int_equal(sqlite3_open(path, &db), SQLITE_OK);
    int code = sqlite3_exec(db, text, NULL, NULL, NULL);
    sqlite3_close(db);
    return code;
}

static void the_database_itself_refuses_impossible_rows(void **state)
{
    struct lumi_capture *capture;

    OK(lumi_capture_create(in_scratch(state, "a"), &capture, error));
    add_frame(capture, add_camera(capture, "c"), "f");
    OK(lumi_capture_publish(capture, NULL, error));
    lumi_capture_close(capture);
    assert_int_equal(sql(state, "a", "UPDATE frames SET state = 'accepted'"), SQLITE_CONSTRAINT);
    assert_int_equal(sql(state, "a", "UPDATE frames SET state = 'received'"), SQLITE_CONSTRAINT);
    assert_int_equal(sql(state, "a", "UPDATE frames SET state = 'lost'"), SQLITE_CONSTRAINT);
    assert_int_equal(sql(state, "a", "DELETE FROM frames"), SQLITE_CONSTRAINT);
    assert_int_equal(sql(state, "a", "UPDATE frames SET state = 'triggered'"), SQLITE_OK);
}

static void what_the_caller_gets_wrong_is_named(void **state)
{
    struct lumi_capture_file file = small_file();
    struct lumi_capture *capture;
    struct lumi_capture_lens lens = small_lens();
    struct lumi_pose pose = {{1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}};
    const char *path = in_scratch(state, "a");
    int64_t id;

    OK(lumi_capture_create(path, &capture, error));
    int64_t camera = add_camera(capture, "c"), frame = add_frame(capture, camera, "f");
    const struct lumi_capture_new_frame twice = {.name = "f", .camera = camera};
    const struct lumi_capture_new_frame escape = {.name = "../f", .camera = camera};
    const struct lumi_capture_new_frame stray = {.name = "g", .camera = 99};
    FAILS(lumi_capture_add_frame(capture, &twice, &id, error), LUMI_ERR_EXISTS, "two frames of one name: 'f'");
    FAILS(lumi_capture_add_frame(capture, &escape, &id, error), LUMI_ERR_ARG, "no name for a frame");
    FAILS(lumi_capture_add_frame(capture, &stray, &id, error), LUMI_ERR_ARG, "FOREIGN KEY");
    FAILS(lumi_capture_add_camera(capture, "c", 1, &id, error), LUMI_ERR_EXISTS, "two cameras of one name: 'c'");
    file.width = 17;
    file.label = "photos/f.jpg";
    FAILS(lumi_capture_store_bytes(capture, frame, "x", 1, &file, error), LUMI_ERR_FORMAT,
          "photos/f.jpg: the image is 17x12, its camera 16x12");
    file.width = 16;
    FAILS(lumi_capture_store_file(capture, frame, in_scratch(state, "none.jpg"), &file, error), LUMI_ERR_NOTFOUND,
          "none.jpg");
    file.extension = "/../x";
    FAILS(lumi_capture_store_bytes(capture, frame, "x", 1, &file, error), LUMI_ERR_ARG, "extension");
    pose.r[0] = NAN;
    FAILS(lumi_capture_set_pose(capture, frame, &pose, LUMI_POSE_TRUE, "", error), LUMI_ERR_FORMAT, "frame 'f'");
    pose.r[0] = 0; /* singular */
    FAILS(lumi_capture_set_pose(capture, frame, &pose, LUMI_POSE_TRUE, "", error), LUMI_ERR_FORMAT, "no rotation");
    lens.lens.fx = 0;
    FAILS(lumi_capture_add_lens(capture, &lens, &id, error), LUMI_ERR_FORMAT, "out of range");
    FAILS(lumi_capture_set_profile(capture, "[rig]\nname = x\n", error), LUMI_ERR_FORMAT, "is missing");
    FAILS(lumi_capture_seal(capture, "yesterday", error), LUMI_ERR_ARG, "no date");
    lumi_capture_close(capture);
    assert_int_not_equal(access(path, F_OK), 0);
    assert_int_not_equal(access(in_scratch(state, "a.partial"), F_OK), 0);
    FAILS(lumi_capture_open(path, LUMI_CAPTURE_READ, &capture, error), LUMI_ERR_NOTFOUND, "/a: open capture");
    FAILS(lumi_capture_open(*state, LUMI_CAPTURE_READ, &capture, error), LUMI_ERR_NOTFOUND, "no capture");
}

static void a_profile_and_a_plan_come_back_as_they_went_in(void **state)
{
    static char text[LUMI_RIG_TEXT_MAX];
    struct lumi_capture *capture;
    struct lumi_rig rig;
    char *back;

    OK(lumi_rig_builtin("bar2", &rig, error));
    lumi_rig_print(&rig, text, sizeof text);
    OK(lumi_capture_create(in_scratch(state, "a"), &capture, error));
    FAILS(lumi_capture_get_profile(capture, &back, error), LUMI_ERR_NOTFOUND, "no rig profile");
    OK(lumi_capture_set_profile(capture, text, error));
    OK(lumi_capture_set_plan(capture, "rows = 3", error));
    OK(lumi_capture_get_profile(capture, &back, error));
    assert_string_equal(back, text);
    lumi_free(back);
    OK(lumi_capture_get_plan(capture, &back, error));
    assert_string_equal(back, "rows = 3");
    lumi_free(back);
    lumi_capture_close(capture);
}

static void make_sealed(void **state, const char *name, int frames)
{
    struct lumi_capture *capture;
    char frame[16];

    OK(lumi_capture_create(in_scratch(state, name), &capture, error));
    int64_t camera = add_camera(capture, "c");
    for (int i = 0; i < frames; i++) {
        snprintf(frame, sizeof frame, "f%03d", i);
        store_frame(capture, camera, frame, (unsigned)i);
    }
    OK(lumi_capture_publish(capture, "2026-11-23", error));
    lumi_capture_close(capture);
}

static void a_sealed_capture_is_opened_for_a_retake_and_sealed_again(void **state)
{
    struct lumi_capture_file file = small_file();
    struct lumi_capture *capture;
    struct lumi_capture_info info;
    struct lumi_capture_frame *frames;
    int64_t again;
    int count;

    make_sealed(state, "a", 3);
    const char *path = in_scratch(state, "a");
    OK(lumi_capture_open(path, LUMI_CAPTURE_READ, &capture, error));
    FAILS(lumi_capture_set_meta(capture, "k", "v", error), LUMI_ERR_ARG, "is sealed");
    OK(lumi_capture_frames(capture, LUMI_FRAMES_ALL, &frames, &count, error));
    lumi_capture_close(capture);
    OK(lumi_capture_open(path, LUMI_CAPTURE_WRITE, &capture, error));
    assert_false(lumi_capture_sealed(capture));
    assert_int_not_equal(access(in_scratch(state, "a/tagmanifest-sha256.txt"), F_OK), 0);
    OK(lumi_capture_judge_frame(capture, frames[1].id, false, 0, "soft", error));
    OK(lumi_capture_retake_frame(capture, frames[1].id, &again, error));
    OK(lumi_capture_store_bytes(capture, again, "better", 6, &file, error));
    assert_int_equal(problems_of(path), 0); /* while it is open, too */
    OK(lumi_capture_seal(capture, "2026-11-24", error));
    lumi_capture_close(capture);
    lumi_free(frames);
    assert_int_equal(problems_of(path), 0);
    OK(lumi_capture_open(path, LUMI_CAPTURE_READ, &capture, error));
    OK(lumi_capture_info(capture, &info, error));
    assert_true(info.sealed);
    assert_int_equal(info.frames, 4);
    assert_int_equal(info.in_state[LUMI_FRAME_RETAKEN], 1);
    assert_int_equal(info.in_state[LUMI_FRAME_RECEIVED], 3);
    lumi_capture_close(capture);
}

static void a_copied_capture_is_whole(void **state)
{
    make_sealed(state, "a", 5);
    shell("cp -r '%s' '%s' && chmod -R a-w '%s'", in_scratch(state, "a"), in_scratch(state, "b"),
          in_scratch(state, "b"));
    assert_int_equal(problems_of(in_scratch(state, "b")), 0);
}

/* Runs a shell command in a sealed capture and expects verify to name the file and the fault. */
static char found[4096];

static void collect(void *context, const char *file, const char *text)
{
    size_t used = strlen(found);

    (void)context;
    snprintf(found + used, sizeof found - used, "%s: %s\n", file, text);
}

static void damage(void **state, const char *command, const char *wanted)
{
    static int number;
    char name[16];
    struct lumi_verify_result result;

    snprintf(name, sizeof name, "d%d", number++);
    make_sealed(state, name, 4);
    shell("cd '%s' && %s", in_scratch(state, name), command);
    found[0] = '\0';
    OK(lumi_capture_verify(in_scratch(state, name), collect, NULL, NULL, &result, error));
    if (result.problems == 0 || !strstr(found, wanted))
        fail_msg("%s: %d problems: %s", command, result.problems, found);
}

static void verify_finds_and_names_every_kind_of_damage(void **state)
{
    damage(state, "printf x | dd of=data/frames/f001.jpg conv=notrunc bs=1 2>/dev/null",
           "data/frames/f001.jpg: does not match its checksum");
    damage(state, "printf x >> data/frames/f002.jpg", "data/frames/f002.jpg: has ");
    damage(state, "rm data/frames/f003.jpg", "data/frames/f003.jpg: is missing");
    damage(state, "rm data/frames/f003.jpg", "data/frames/f003.jpg: is in the manifest and missing");
    damage(state, "cp data/frames/f003.jpg data/frames/extra.jpg", "data/frames/extra.jpg: belongs to no frame");
    damage(state, "cp data/frames/f003.jpg data/frames/extra.jpg", "data/frames/extra.jpg: is not in the manifest");
    damage(state, "printf x >> bag-info.txt", "bag-info.txt: does not match the manifest");
    damage(state, "rm manifest-sha256.txt", "manifest-sha256.txt: is missing");
    damage(state, "echo hello >> manifest-sha256.txt", "manifest-sha256.txt: has a line that is no checksum");
    damage(state, "echo hello > bagit.txt", "bagit.txt: does not declare a bag");
    damage(state, "head -1 manifest-sha256.txt >> manifest-sha256.txt", "is in the manifest twice");
    damage(state, "sed -i 1d manifest-sha256.txt", "is not in the manifest");
    damage(state, "sed -i 's,data/,data/../,' manifest-sha256.txt", "has no place in this manifest");
    damage(state, "printf x | dd of=data/capture.db conv=notrunc bs=1 seek=9000 2>/dev/null",
           "data/capture.db: does not match the manifest");
    damage(state, "printf x | dd of=data/capture.db conv=notrunc bs=1 2>/dev/null", "data/capture.db: ");
    damage(state, "ln -s /etc/passwd data/frames/link.jpg", "data/frames/link.jpg: is no plain file");
}

/* As after a power cut, before the next lumid has opened it for writing; what has a row is looked at as ever. */
static void what_a_crash_left_in_an_open_capture_is_no_damage(void **state)
{
    struct lumi_capture *capture;
    struct lumi_verify_result result;

    OK(lumi_capture_create_live(in_scratch(state, "a"), &capture, error));
    store_frame(capture, add_camera(capture, "c"), "f000", 0);
    lumi_capture_close(capture);
    shell("cd '%s' && printf x >.s7.tmp && printf x >s6.jpg", in_scratch(state, "a/data/frames"));
    OK(lumi_capture_verify(in_scratch(state, "a"), collect, NULL, NULL, &result, error));
    assert_int_equal(result.problems, 0);
    assert_int_equal(result.files, 1);
    shell("printf x >>'%s'", in_scratch(state, "a/data/frames/f000.jpg"));
    OK(lumi_capture_verify(in_scratch(state, "a"), collect, NULL, NULL, &result, error));
    assert_int_equal(result.problems, 1);
}

static void a_newer_capture_and_a_stranger_are_refused(void **state)
{
    struct lumi_capture *capture;
    const char *path = in_scratch(state, "a");

    make_sealed(state, "a", 1);
    assert_int_equal(sql(state, "a", "PRAGMA user_version = 3"), SQLITE_OK);
    FAILS(lumi_capture_open(path, LUMI_CAPTURE_READ, &capture, error), LUMI_ERR_VERSION, "version 3");
    FAILS(lumi_capture_open(path, LUMI_CAPTURE_WRITE, &capture, error), LUMI_ERR_VERSION, "version 3");
    assert_int_equal(access(in_scratch(state, "a/tagmanifest-sha256.txt"), F_OK), 0); /* still sealed */
    struct lumi_verify_result result;
    FAILS(lumi_capture_verify(path, NULL, NULL, NULL, &result, error), LUMI_ERR_VERSION, "version 3");
    assert_int_equal(sql(state, "a", "PRAGMA user_version = 0"), SQLITE_OK);
    FAILS(lumi_capture_open(path, LUMI_CAPTURE_READ, &capture, error), LUMI_ERR_FORMAT, "never was");
    assert_int_equal(sql(state, "a", "PRAGMA user_version = 2; CREATE VIEW v AS SELECT 1"), SQLITE_OK);
    FAILS(lumi_capture_open(path, LUMI_CAPTURE_READ, &capture, error), LUMI_ERR_FORMAT, "view 'v'");
    assert_int_equal(sql(state, "a", "DROP VIEW v; DROP TABLE plan"), SQLITE_OK);
    FAILS(lumi_capture_open(path, LUMI_CAPTURE_READ, &capture, error), LUMI_ERR_FORMAT, "no table 'plan'");
    assert_int_equal(sql(state, "a", "PRAGMA application_id = 7"), SQLITE_OK);
    FAILS(lumi_capture_open(path, LUMI_CAPTURE_READ, &capture, error), LUMI_ERR_FORMAT, "not the database");
}

static void a_database_that_leads_outside_the_capture_is_refused(void **state)
{
    struct lumi_capture_frame *frames;
    struct lumi_capture *capture;
    int count;

    make_sealed(state, "a", 1);
    assert_int_equal(sql(state, "a", "UPDATE frames SET file = 'data/frames/../../../etc/passwd'"), SQLITE_OK);
    OK(lumi_capture_open(in_scratch(state, "a"), LUMI_CAPTURE_READ, &capture, error));
    FAILS(lumi_capture_frames(capture, LUMI_FRAMES_ALL, &frames, &count, error), LUMI_ERR_FORMAT, "outside");
    assert_null(frames);
    lumi_capture_close(capture);
}

static void versions_are_upgraded_one_at_a_time_or_not_at_all(void **state)
{
    const struct capture_upgrade good[] = {{"CREATE TABLE b(x); INSERT INTO b SELECT x + 1 FROM a"},
                                           {"CREATE TABLE c(x); INSERT INTO c SELECT x + 1 FROM b"}};
    const struct capture_upgrade bad[] = {good[0], {"CREATE TABLE c(x); INSERT INTO nothing VALUES(1)"}};
    sqlite3_stmt *statement;
    sqlite3 *db;

    (void)state;
    assert_int_equal(sqlite3_open(":memory:", &db), SQLITE_OK);
    FAILS(capture_schema_upgrade(db, good, 2, "x", error), LUMI_ERR_FORMAT, "no version");
    sqlite3_exec(db, "CREATE TABLE a(x); INSERT INTO a VALUES(1); PRAGMA user_version = 1", NULL, NULL, NULL);
    FAILS(capture_schema_upgrade(db, bad, 2, "x", error), LUMI_ERR_FORMAT, "upgrade to version 3");
    assert_int_not_equal(sqlite3_exec(db, "SELECT * FROM c", NULL, NULL, NULL), SQLITE_OK); /* rolled back */
    OK(capture_schema_upgrade(db, good, 2, "x", error));                                    /* goes on from version 2 */
    OK(capture_schema_upgrade(db, good, 2, "x", error));                                    /* nothing left to do */
    assert_int_equal(sqlite3_prepare_v2(db, "SELECT x FROM c", -1, &statement, NULL), SQLITE_OK);
    assert_int_equal(sqlite3_step(statement), SQLITE_ROW);
    assert_int_equal(sqlite3_column_int(statement, 0), 3);
    sqlite3_finalize(statement);
    FAILS(capture_schema_upgrade(db, good, 1, "x", error), LUMI_ERR_VERSION, "version 3");
    sqlite3_close(db);
}

static void only_one_program_writes_at_a_time(void **state)
{
    struct lumi_capture *first, *second, *reader;

    OK(lumi_capture_create_live(in_scratch(state, "a"), &first, error));
    FAILS(lumi_capture_open(in_scratch(state, "a"), LUMI_CAPTURE_WRITE, &second, error), LUMI_ERR_BUSY, "another");
    FAILS(lumi_capture_create_live(in_scratch(state, "a"), &second, error), LUMI_ERR_EXISTS, "is there already");
    OK(lumi_capture_open(in_scratch(state, "a"), LUMI_CAPTURE_READ, &reader, error));
    lumi_capture_close(reader);
    lumi_capture_close(first);
    OK(lumi_capture_create(in_scratch(state, "b"), &first, error));
    FAILS(lumi_capture_create(in_scratch(state, "b"), &second, error), LUMI_ERR_BUSY, "another");
    lumi_capture_close(first);
    make_sealed(state, "c", 0);
    FAILS(lumi_capture_create(in_scratch(state, "c"), &second, error), LUMI_ERR_EXISTS, "is there already");
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, scratch_setup, scratch_teardown)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(a_published_capture_gives_back_what_was_stored),
        TEST(frames_come_in_the_order_of_their_positions_and_shots),
        TEST(a_frame_moves_through_its_states_and_no_other_way),
        TEST(the_database_itself_refuses_impossible_rows),
        TEST(what_the_caller_gets_wrong_is_named),
        TEST(a_profile_and_a_plan_come_back_as_they_went_in),
        TEST(a_sealed_capture_is_opened_for_a_retake_and_sealed_again),
        TEST(a_copied_capture_is_whole),
        TEST(verify_finds_and_names_every_kind_of_damage),
        TEST(what_a_crash_left_in_an_open_capture_is_no_damage),
        TEST(a_newer_capture_and_a_stranger_are_refused),
        TEST(a_database_that_leads_outside_the_capture_is_refused),
        TEST(versions_are_upgraded_one_at_a_time_or_not_at_all),
        TEST(only_one_program_writes_at_a_time),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
