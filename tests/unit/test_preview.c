/* The light field so far: a room whose every ray is known, photographed row by row. */
#include "analytic_scene.h"
#include "capture_fixture.h"

#include "pipeline/preview/preview_line.h"
#include "pipeline/preview/preview_serve.h"
#include "proto/image/image.h"

#include <pthread.h>
#include <signal.h>
#include <sys/socket.h>

enum { ROWS = 5, COLUMNS = 12, SIDE = 96 };

struct place {
    char path[PATH_SIZE];
    struct lumi_capture *capture;
    struct lumi_lens lens;
    int64_t ids[ROWS * COLUMNS];
    char skipped[4][512];
    int skips;
};

static struct lumi_pose pose_of(int frame)
{
    const double latitude = (frame / COLUMNS - (ROWS - 1) / 2.0) * LUMI_PI / 7;
    const double longitude = frame % COLUMNS * 2 * LUMI_PI / COLUMNS;
    const struct lumi_vec3 out = {cos(latitude) * cos(longitude), cos(latitude) * sin(longitude), sin(latitude)};
    struct lumi_pose pose;

    lumi_pose_look(lumi_scale(out, 0.3), out, lumi_vec3(0, 0, 1), &pose);
    return pose;
}

static void shoot(const struct lumi_lens *lens, const struct lumi_pose *pose, struct lumi_raster *image)
{
    struct lumi_vec3 d;

    assert_int_equal(lumi_raster_create(image, lens->width, lens->height, 3, LUMI_U8), LUMI_OK);
    for (int y = 0; y < lens->height; y++)
        for (int x = 0; x < lens->width; x++)
            if (lumi_lens_unproject(lens, x + 0.5, y + 0.5, &d))
                scene_pixel(SCENE_ROOM, pose->t, lumi_rotate(pose->r, d), lumi_row_u8(image, y) + 3 * x);
}

/* Everything is planned, nothing is there. */
static void open_place(void **state, struct place *place)
{
    struct lumi_capture_lens lens = {.name = "lens"};
    int64_t lens_id, camera;

    memset(place, 0, sizeof *place);
    snprintf(place->path, sizeof place->path, "%s/live", (char *)*state);
    lumi_lens_init_pinhole(&lens.lens, SIDE, SIDE, 95 * LUMI_PI / 180);
    place->lens = lens.lens;
    OK(lumi_capture_create_live(place->path, &place->capture, error));
    OK(lumi_capture_begin(place->capture, error));
    OK(lumi_capture_add_lens(place->capture, &lens, &lens_id, error));
    OK(lumi_capture_add_camera(place->capture, "c00", lens_id, &camera, error));
    for (int i = 0; i < ROWS * COLUMNS; i++) {
        char name[32];
        const struct lumi_capture_new_frame frame = {
            .name = name, .camera = camera, .row = i / COLUMNS, .column = i % COLUMNS};
        const struct lumi_pose pose = pose_of(i);
        snprintf(name, sizeof name, "f%04d", i);
        OK(lumi_capture_add_frame(place->capture, &frame, &place->ids[i], error));
        OK(lumi_capture_set_pose(place->capture, place->ids[i], &pose, LUMI_POSE_PRIOR, "test", error));
    }
    OK(lumi_capture_commit(place->capture, error));
}

static void store(struct place *place, int first, int count)
{
    struct lumi_image_options options;

    lumi_image_options_init(&options);
    options.format = LUMI_IMAGE_PNG;
    for (int i = first; i < first + count; i++) {
        const struct lumi_capture_file file = {
            .extension = ".png", .width = SIDE, .height = SIDE, .camera_time_us = LUMI_NO_TIME};
        const struct lumi_pose pose = pose_of(i);
        struct lumi_raster image;
        uint8_t *data;
        size_t size;
        shoot(&place->lens, &pose, &image);
        OK(lumi_image_encode(&image, &options, &data, &size, error));
        OK(lumi_capture_trigger_frame(place->capture, place->ids[i], i, error));
        OK(lumi_capture_store_bytes(place->capture, place->ids[i], data, size, &file, error));
        lumi_raster_finish(&image);
        lumi_free(data);
    }
}

static void note_skipped(void *context, const char *text)
{
    struct place *place = context;

    assert_true(place->skips < 4);
    snprintf(place->skipped[place->skips++], sizeof place->skipped[0], "%s", text);
}

static struct lumi_preview *look_into(struct place *place, struct lumi_preview_options *options)
{
    struct lumi_preview *preview;

    options->skipped = note_skipped;
    options->context = place;
    OK(lumi_preview_open(place->path, options, &preview, error));
    return preview;
}

static struct lumi_preview_status work(struct lumi_preview *preview)
{
    struct lumi_preview_status status;

    OK(lumi_preview_look(preview, NULL, error));
    while (lumi_preview_work(preview))
        continue;
    lumi_preview_status(preview, &status);
    return status;
}

/* Of views from inside the sphere, all around. */
static double psnr(struct lumi_preview *preview)
{
    double sum = 0, samples = 0;

    for (int v = 0; v < 6; v++) {
        const struct lumi_preview_gaze gaze = {
            0.1 * cos(v), 0.1 * sin(2 * v), 0.05, v * LUMI_PI / 3, 0.3 * sin(3 * v), 1.2, 80, 60};
        const double c = cos(gaze.pitch);
        struct lumi_picture picture;
        struct lumi_raster truth;
        struct lumi_pose pose;
        struct lumi_lens lens;
        OK(lumi_preview_draw(preview, &gaze, &picture, error));
        lumi_pose_look(lumi_vec3(gaze.x, gaze.y, gaze.z),
                       lumi_vec3(c * cos(gaze.yaw), c * sin(gaze.yaw), sin(gaze.pitch)), lumi_vec3(0, 0, 1), &pose);
        lumi_lens_init_pinhole(&lens, gaze.width, gaze.height, gaze.fov);
        shoot(&lens, &pose, &truth);
        for (int y = 0; y < gaze.height; y++)
            for (int x = 0; x < 3 * gaze.width; x++) {
                const double d = lumi_row_u8(&truth, y)[x] - lumi_row_u8(&picture.color, y)[x];
                sum += d * d;
                samples++;
            }
        lumi_picture_finish(&picture);
        lumi_raster_finish(&truth);
    }
    return 10 * log10(255 * 255 * samples / sum);
}

static void pictures_come_nearer_to_the_truth_with_every_row(void **state)
{
    static const int rows[] = {1, 2, 5};
    static const double wanted[2][3] = {{7, 12, 44}, {7, 12, 47}};

    for (int shapes = 0; shapes < 2; shapes++) {
        struct lumi_preview_options options;
        struct lumi_preview_status status;
        struct place place;
        double before = 0;
        int stored = 0;
        open_place(state, &place);
        lumi_preview_options_init(&options);
        options.shapes = shapes;
        struct lumi_preview *preview = look_into(&place, &options);
        for (int i = 0; i < 3; i++) {
            store(&place, stored, rows[i] * COLUMNS - stored);
            stored = rows[i] * COLUMNS;
            status = work(preview);
            assert_int_equal(status.frames, stored);
            assert_int_equal(status.views, stored);
            assert_int_equal(status.rows, rows[i]);
            assert_int_equal(status.shapes, shapes ? stored : 0);
            const double now = psnr(preview);
            if (!(now > before + 1) || !(now > wanted[shapes][i]))
                fail_msg("%d rows, shapes %d: %.2f dB after %.2f dB", rows[i], shapes, now, before);
            before = now;
        }
        lumi_preview_close(preview);
        lumi_capture_close(place.capture);
        shell("rm -r '%s'", place.path);
    }
}

static void nothing_is_there_before_the_first_frame(void **state)
{
    const struct lumi_preview_gaze gaze = {.fov = 1, .width = 64, .height = 48};
    struct lumi_preview_options options;
    struct lumi_picture picture;
    struct place place;

    open_place(state, &place);
    lumi_preview_options_init(&options);
    struct lumi_preview *preview = look_into(&place, &options);
    assert_false(lumi_preview_work(preview));
    FAILS(lumi_preview_draw(preview, &gaze, &picture, error), LUMI_ERR_BUSY, "no frame that could be shown");
    store(&place, 0, 1);
    assert_int_equal(work(preview).views, 1);
    OK(lumi_preview_draw(preview, &gaze, &picture, error));
    assert_true(picture.covered > 0);
    lumi_picture_finish(&picture);
    lumi_preview_close(preview);
    lumi_capture_close(place.capture);
}

static void frames_that_are_damaged_or_gone_are_told_once_and_left_out(void **state)
{
    struct lumi_preview_options options;
    struct lumi_preview_status status;
    struct place place;

    open_place(state, &place);
    store(&place, 0, COLUMNS);
    shell("rm '%s/data/frames/f0003.png'; echo damaged >'%s/data/frames/f0005.png'", place.path, place.path);
    lumi_preview_options_init(&options);
    struct lumi_preview *preview = look_into(&place, &options);
    status = work(preview);
    assert_int_equal(status.frames, COLUMNS);
    assert_int_equal(status.views, COLUMNS - 2);
    assert_int_equal(place.skips, 2);
    for (int i = 0; i < 2; i++)
        assert_true(strstr(place.skipped[i], "f0003.png") || strstr(place.skipped[i], "f0005.png"));
    /* One that is rejected goes, what comes in its place is taken. */
    OK(lumi_capture_judge_frame(place.capture, place.ids[0], false, 1, "soft", error));
    store(&place, COLUMNS, 1);
    status = work(preview);
    assert_int_equal(status.frames, COLUMNS);
    assert_int_equal(status.views, COLUMNS - 2);
    assert_int_equal(place.skips, 2);
    psnr(preview);
    lumi_preview_close(preview);
    lumi_capture_close(place.capture);
}

static void what_memory_does_not_hold_is_left_out_and_views_stay_spread(void **state)
{
    struct lumi_preview_options options;
    struct place place;

    open_place(state, &place);
    store(&place, 0, ROWS * COLUMNS);
    lumi_preview_options_init(&options);
    options.memory_bytes = 400000; /* a view has 64 × 64 pixels, at 5 bytes */
    options.shapes = false;
    struct lumi_preview *preview = look_into(&place, &options);
    const struct lumi_preview_status status = work(preview);
    assert_int_equal(status.frames, ROWS * COLUMNS);
    assert_in_range(status.views, 15, 25);
    assert_true(psnr(preview) > 18);
    lumi_preview_close(preview);
    lumi_capture_close(place.capture);
}

static void threads_make_no_difference(void **state)
{
    const struct lumi_preview_gaze gaze = {.x = 0.1, .yaw = 0.7, .fov = 1.3, .width = 96, .height = 64};
    struct lumi_picture pictures[2];
    struct place place;

    open_place(state, &place);
    store(&place, 0, 2 * COLUMNS);
    for (int i = 0; i < 2; i++) {
        struct lumi_preview_options options;
        lumi_preview_options_init(&options);
        options.threads = i ? 4 : 1;
        struct lumi_preview *preview = look_into(&place, &options);
        work(preview);
        OK(lumi_preview_draw(preview, &gaze, &pictures[i], error));
        lumi_preview_close(preview);
    }
    for (int y = 0; y < gaze.height; y++)
        assert_memory_equal(lumi_row_u8(&pictures[0].color, y), lumi_row_u8(&pictures[1].color, y),
                            3 * (size_t)gaze.width);
    lumi_picture_finish(&pictures[0]);
    lumi_picture_finish(&pictures[1]);
    lumi_capture_close(place.capture);
}

static void lines_are_taken_apart(void **state)
{
    static const char *const bad[] = {"",
                                      "view",
                                      "view 1 0 0 0 0 0 1 64",
                                      "view 1 0 0 0 0 0 1 64 48 3",
                                      "view -1 0 0 0 0 0 1 64 48",
                                      "view 4294967296 0 0 0 0 0 1 64 48",
                                      "view 1 0 0 zero 0 0 1 64 48",
                                      "views 1 0 0 0 0 0 1 64 48"};
    static const char *const wrong[] = {"view 9 0 0 0 0 0 0 64 48", "view 9 0 0 0 0 0 1 8 48",
                                        "view 9 nan 0 0 0 0 1 64 48", "view 9 0 0 0 0 2 1 64 48",
                                        "view 9 0 0 0 0 0 1 64 99999"};
    struct lumi_preview_gaze gaze;
    uint32_t id;

    (void)state;
    OK(lumi_preview_line_parse("view 7 0.5 -1e-1 +2 3 -0.25 1.5 640 400", &id, &gaze, error));
    assert_int_equal(id, 7);
    assert_true(gaze.x == 0.5 && gaze.y == -0.1 && gaze.z == 2 && gaze.yaw == 3 && gaze.pitch == -0.25 &&
                gaze.fov == 1.5);
    assert_true(gaze.width == 640 && gaze.height == 400);
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        FAILS(lumi_preview_line_parse(bad[i], &id, &gaze, error), LUMI_ERR_FORMAT, "view ID");
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        FAILS(lumi_preview_line_parse(wrong[i], &id, &gaze, error), LUMI_ERR_ARG, "wanted");
        assert_int_equal(id, 9);
    }
}

struct served {
    struct lumi_preview *preview;
    struct lumi_preview_options options;
    int fd, code;
    struct lumi_error error;
};

static void *serve(void *context)
{
    struct served *served = context;

    served->code = lumi_preview_serve(served->preview, &served->options, served->fd, served->fd, &served->error);
    return NULL;
}

/* A line of what is said, without its end. */
static void read_said(int fd, char *line, size_t size)
{
    size_t length = 0;

    while (length + 1 < size && read(fd, line + length, 1) == 1 && line[length] != '\n')
        length++;
    line[length] = '\0';
}

static void a_growing_capture_is_served_until_it_is_gone(void **state)
{
    struct served served = {0};
    struct place place;
    pthread_t thread;
    char line[256];
    int ends[2], frames = 0;

    open_place(state, &place);
    lumi_preview_options_init(&served.options);
    served.preview = look_into(&place, &served.options);
    assert_int_equal(socketpair(AF_UNIX, SOCK_STREAM, 0, ends), 0);
    served.fd = ends[1];
    assert_int_equal(pthread_create(&thread, NULL, serve, &served), 0);
    read_said(ends[0], line, sizeof line);
    assert_string_equal(line, "news 0 0 0");
    dprintf(ends[0], "view 1 0 0 0 0 0 1.2 64 48\n");
    read_said(ends[0], line, sizeof line);
    assert_ptr_equal(strstr(line, "none 1 "), line);
    store(&place, 0, COLUMNS);
    while (frames < COLUMNS) {
        read_said(ends[0], line, sizeof line);
        assert_int_equal(sscanf(line, "news %d", &frames), 1);
    }
    dprintf(ends[0], "view 2 0 0 0 0 0 1.2 64 48\n");
    do
        read_said(ends[0], line, sizeof line);
    while (!strncmp(line, "news", 4));
    assert_ptr_equal(strstr(line, "jpeg 2 "), line);
    lumi_capture_close(place.capture);
    shell("rm -r '%s'", place.path);
    shutdown(ends[0], SHUT_RD); /* what is said now is not read */
    pthread_join(thread, NULL);
    assert_int_not_equal(served.code, LUMI_OK);
    lumi_preview_close(served.preview);
    close(ends[0]);
    close(ends[1]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(pictures_come_nearer_to_the_truth_with_every_row, scratch_setup,
                                        scratch_teardown),
        cmocka_unit_test_setup_teardown(nothing_is_there_before_the_first_frame, scratch_setup, scratch_teardown),
        cmocka_unit_test_setup_teardown(frames_that_are_damaged_or_gone_are_told_once_and_left_out, scratch_setup,
                                        scratch_teardown),
        cmocka_unit_test_setup_teardown(what_memory_does_not_hold_is_left_out_and_views_stay_spread, scratch_setup,
                                        scratch_teardown),
        cmocka_unit_test_setup_teardown(threads_make_no_difference, scratch_setup, scratch_teardown),
        cmocka_unit_test(lines_are_taken_apart),
        cmocka_unit_test_setup_teardown(a_growing_capture_is_served_until_it_is_gone, scratch_setup, scratch_teardown),
    };

    signal(SIGPIPE, SIG_IGN);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
