/* What is wrong with a frame is found and measured, and nothing is found where nothing is wrong. */
#include "judge_world.h"
#include "sim/rigs.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#define WIDTH 480
#define HEIGHT 360
#define NEIGHBOURS 3

static struct lumi_lens lens;
static struct lumi_raster lights[1 + NEIGHBOURS], knocked; /* the frame, its neighbours, the frame after a knock */
static const double places[1 + NEIGHBOURS][2] = {{0, 0}, {0.12, 0}, {-0.12, 0}, {0, 0.12}};
static const double knock = 6; /* pixels */

static int render(void **state)
{
    struct sim_scene *scene;

    (void)state;
    lumi_lens_init_pinhole(&lens, WIDTH, HEIGHT, 70 * LUMI_PI / 180);
    assert_int_equal(sim_place_open("room", &scene, NULL), LUMI_OK);
    for (int i = 0; i <= NEIGHBOURS; i++) {
        struct lumi_pose pose = world_pose(places[i][0], places[i][1]);
        assert_int_equal(sim_camera_render(scene, &lens, &pose, 0, &lights[i], NULL, NULL), LUMI_OK);
    }
    struct lumi_pose pose = world_pose(knock / lens.fx * 0.8, knock / lens.fx * 0.6);
    pose.t = world_pose(0, 0).t;
    assert_int_equal(sim_camera_render(scene, &lens, &pose, 0, &knocked, NULL, NULL), LUMI_OK);
    sim_scene_destroy(scene);
    return 0;
}

static int forget(void **state)
{
    (void)state;
    for (int i = 0; i <= NEIGHBOURS; i++)
        lumi_raster_finish(&lights[i]);
    lumi_raster_finish(&knocked);
    return 0;
}

static struct lumi_judge_numbers alone(const struct fault *fault)
{
    struct lumi_judge_numbers numbers;
    struct lumi_judge_picture *picture = world_picture(&lights[0], fault);

    assert_non_null(picture);
    assert_int_equal(lumi_judge_measure(picture, NULL, NULL, 0, 0, NULL, 0, &numbers, NULL), LUMI_OK);
    lumi_judge_picture_destroy(picture);
    return numbers;
}

/* With neighbours that have no fault; `exposure_s` is what the frame's camera says. */
static struct lumi_judge_numbers beside(const struct lumi_raster *light, const struct fault *fault, double exposure_s)
{
    const struct fault none = {.full_well = 10000, .seed = 9};
    struct lumi_judge_neighbour neighbours[NEIGHBOURS];
    struct lumi_judge_numbers numbers;
    struct lumi_judge_picture *pictures[1 + NEIGHBOURS];
    struct lumi_pose pose = world_pose(0, 0);

    pictures[0] = world_picture(light, fault);
    for (int i = 0; i < NEIGHBOURS; i++) {
        pictures[1 + i] = world_picture(&lights[1 + i], &none);
        neighbours[i] = (struct lumi_judge_neighbour){pictures[1 + i], &lens,
                                                      world_pose(places[1 + i][0], places[1 + i][1]), 0.01, 1};
    }
    assert_int_equal(
        lumi_judge_measure(pictures[0], &lens, &pose, exposure_s, 1, neighbours, NEIGHBOURS, &numbers, NULL), LUMI_OK);
    for (int i = 0; i <= NEIGHBOURS; i++)
        lumi_judge_picture_destroy(pictures[i]);
    return numbers;
}

static void nothing_is_found_in_a_good_frame(void **state)
{
    const struct fault none = {.full_well = 10000, .seed = 1};
    struct lumi_judge_numbers n = beside(&lights[0], &none, 0.01);
    struct lumi_judge_limits limits;
    char reason[200];

    (void)state;
    lumi_judge_limits_init(&limits);
    assert_true(n.blur_pixels == 0);
    assert_true(n.clipped < 0.1);
    assert_true(fabs(n.exposure_stops) < 0.03);
    assert_true(n.shift_pixels < 0.5);
    assert_true(n.moved < 0.02);
    assert_true(lumi_judge_verdict(&n, &limits, n.sharpness, NULL, reason, sizeof reason));
    assert_string_equal(reason, "");
}

/* Few parts that lie beside each other, wide angles, a floor whose boards all run one way: what stripes are taken for.
 */
static void small_pictures_of_a_wide_rig_are_good_and_their_smears_are_found(void **state)
{
    struct sim_rig_options options;
    struct sim_scene *scene;
    struct sim_rig rig;
    int found = 0;

    (void)state;
    sim_rig_options_init(&options);
    options.width = 160;
    options.height = 128;
    assert_int_equal(sim_rig_init(&rig, "arc:3x6:0.35", &options, NULL), LUMI_OK);
    assert_int_equal(sim_place_open("room", &scene, NULL), LUMI_OK);
    for (int i = 0; i < rig.count; i++) {
        const struct fault none = {.full_well = 10000, .seed = (unsigned)i + 1},
                           smeared = {.smear = 6, .angle = i * 0.7, .full_well = 10000, .seed = (unsigned)i + 1};
        struct lumi_raster light;
        assert_int_equal(sim_camera_render(scene, &rig.views[i].lens, &rig.views[i].pose, 0, &light, NULL, NULL),
                         LUMI_OK);
        struct lumi_judge_picture *good = world_picture(&light, &none), *bad = world_picture(&light, &smeared);
        struct lumi_judge_numbers a, b;
        lumi_judge_measure(good, NULL, NULL, 0, 0, NULL, 0, &a, NULL);
        lumi_judge_measure(bad, NULL, NULL, 0, 0, NULL, 0, &b, NULL);
        if (a.blur_pixels > 0)
            fail_msg("view %d is taken for smeared over %.1f pixels", i, a.blur_pixels);
        found += fabs(b.blur_pixels / 6 - 1) < 0.25;
        lumi_judge_picture_destroy(good);
        lumi_judge_picture_destroy(bad);
        lumi_raster_finish(&light);
    }
    assert_true(found >= rig.count * 3 / 4);
    sim_scene_destroy(scene);
    sim_rig_finish(&rig);
}

static void a_smear_is_measured_in_length_and_direction(void **state)
{
    (void)state;
    for (int i = 0; i < 4; i++) {
        const struct fault fault = {
            .smear = 6 + 3 * i, .angle = (i * 50 + 10) * LUMI_PI / 180, .full_well = 10000, .seed = 4};
        struct lumi_judge_numbers n = alone(&fault);
        double turn = remainder(n.blur_angle - fault.angle, LUMI_PI);
        if (fabs(n.blur_pixels / fault.smear - 1) > 0.15 || fabs(turn) > 8 * LUMI_PI / 180)
            fail_msg("smear %g at %g: found %g at %g", fault.smear, fault.angle, n.blur_pixels, n.blur_angle);
    }
}

static void defocus_takes_sharpness_and_is_no_smear(void **state)
{
    const struct fault sharp = {.full_well = 10000, .seed = 1}, soft = {.defocus = 4, .full_well = 10000, .seed = 2};
    struct lumi_judge_numbers a = alone(&sharp), b = alone(&soft);
    struct lumi_judge_limits limits;
    char reason[200];

    (void)state;
    assert_true(a.sharpness > 0.4 && b.sharpness < 0.5 * a.sharpness);
    lumi_judge_limits_init(&limits);
    assert_false(lumi_judge_verdict(&b, &limits, a.sharpness, NULL, reason, sizeof reason));
    assert_non_null(strstr(reason, "not sharp"));
    assert_true(lumi_judge_verdict(&b, &limits, 0, NULL, reason, sizeof reason)); /* the first frame has no measure */
    b.sharpness = 0; /* a plain wall: nothing to tell it by */
    assert_true(lumi_judge_verdict(&b, &limits, a.sharpness, NULL, reason, sizeof reason));
}

static void clipped_highlights_are_counted(void **state)
{
    const struct fault bright = {.stops = 2.5};
    struct lumi_judge_numbers n = alone(&bright);
    int white = 0;

    (void)state;
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            const float *p = lumi_row_f32(&lights[0], y) + 3 * x;
            white += fmaxf(p[0], fmaxf(p[1], p[2])) * exp2f(2.5f) >= 0.9866f;
        }
    assert_true(fabs(n.clipped - white / (double)(WIDTH * HEIGHT)) < 0.005);
}

static void exposure_is_compared_with_neighbours_and_with_what_the_camera_says(void **state)
{
    (void)state;
    for (double stops = -1; stops <= 1; stops += 2) {
        const struct fault fault = {.stops = stops, .full_well = 10000, .seed = 5};
        assert_true(fabs(beside(&lights[0], &fault, 0.01).exposure_stops - stops) < 0.06);
        assert_true(fabs(beside(&lights[0], &fault, 0.01 * exp2(stops)).exposure_stops) < 0.06);
        assert_true(fabs(beside(&lights[0], &fault, 0).exposure_stops - stops) < 0.06);
    }
}

static void a_knocked_camera_is_seen_as_a_shift(void **state)
{
    const struct fault none = {.full_well = 10000, .seed = 6};
    struct lumi_judge_numbers n = beside(&knocked, &none, 0.01);

    (void)state;
    assert_true(fabs(n.shift_pixels - knock) < 0.12 * knock);
}

static void a_thing_that_moved_is_seen_by_its_size(void **state)
{
    const struct fault fault = {.thing = 0.2, .full_well = 10000, .seed = 7};
    struct lumi_judge_numbers n = beside(&lights[0], &fault, 0.01);
    double truth = 0.2 * 0.2 * WIDTH / HEIGHT;
    struct lumi_judge_limits limits;
    char reason[200];

    (void)state;
    assert_true(n.moved > 0.5 * truth && n.moved < 2.5 * truth);
    assert_true(n.shift_pixels < 1);
    lumi_judge_limits_init(&limits);
    assert_true(lumi_judge_verdict(&n, &limits, 0, NULL, reason, sizeof reason)); /* a warning */
    assert_non_null(strstr(reason, "moved"));
    limits.reject_moved = true;
    assert_false(lumi_judge_verdict(&n, &limits, 0, NULL, reason, sizeof reason));
}

static void a_frame_that_shows_something_else_altogether_is_rejected(void **state)
{
    const struct fault fault = {.thing = 0.9, .full_well = 10000, .seed = 7};
    struct lumi_raster upside;
    struct lumi_judge_limits limits;
    char reason[200];

    (void)state;
    lumi_raster_create(&upside, WIDTH, HEIGHT, 3, LUMI_F32);
    for (int y = 0; y < HEIGHT; y++)
        memcpy(lumi_row_f32(&upside, y), lumi_row_f32(&lights[0], HEIGHT - 1 - y), 3 * WIDTH * sizeof(float));
    struct lumi_judge_numbers n = beside(&upside, &fault, 0.01);
    lumi_raster_finish(&upside);
    lumi_judge_limits_init(&limits);
    assert_false(lumi_judge_verdict(&n, &limits, 0, NULL, reason, sizeof reason));
    assert_non_null(strstr(reason, "not where its neighbours see it"));
}

/* The light as a sensor behind a filter gives it. */
static void raw_and_developed_frames_are_judged_alike(void **state)
{
    const struct fault none = {0};
    struct lumi_judge_numbers rgb = alone(&none), raw;
    uint16_t *data = lumi_alloc(WIDTH * HEIGHT, sizeof *data);
    static const int colours[4] = {0, 1, 1, 2};
    struct lumi_judge_picture *picture;
    struct lumi_error error;

    (void)state;
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++)
            data[y * WIDTH + x] =
                (uint16_t)(4095 * fminf(lumi_row_f32(&lights[0], y)[3 * x + colours[y % 2 * 2 + x % 2]], 1));
    struct lumi_camera_frame frame = {.format = {LUMI_LAYOUT_BAYER, LUMI_BAYER_RGGB, WIDTH, HEIGHT, 12, 2 * WIDTH},
                                      .data = (const uint8_t *)data,
                                      .size = 2 * WIDTH * HEIGHT};
    assert_int_equal(lumi_judge_picture_create(&frame, &picture, &error), LUMI_OK);
    assert_int_equal(lumi_judge_measure(picture, NULL, NULL, 0, 0, NULL, 0, &raw, NULL), LUMI_OK);
    lumi_judge_picture_destroy(picture);
    assert_true(fabs(raw.mean / rgb.mean - 1) < 0.1);
    assert_true(fabs(raw.clipped - rgb.clipped) < 0.03);
    assert_true(raw.sharpness > 0.2 && raw.blur_pixels == 0);
    for (int i = 0; i < WIDTH * HEIGHT; i++) /* the same on a black level */
        data[i] = (uint16_t)(400 + data[i] * 3695 / 4095);
    frame.black = 400;
    struct lumi_judge_numbers lifted;
    assert_int_equal(lumi_judge_picture_create(&frame, &picture, &error), LUMI_OK);
    assert_int_equal(lumi_judge_measure(picture, NULL, NULL, 0, 0, NULL, 0, &lifted, NULL), LUMI_OK);
    lumi_judge_picture_destroy(picture);
    assert_true(fabs(lifted.mean - raw.mean) < 0.001 && fabs(lifted.dark - raw.dark) < 0.01);
    frame.size -= 1;
    assert_int_equal(lumi_judge_picture_create(&frame, &picture, &error), LUMI_ERR_FORMAT);
    lumi_free(data);
}

static void a_verdict_names_everything_that_is_wrong_in_one_line(void **state)
{
    const struct lumi_judge_numbers n = {
        .sharpness = 0.1, .blur_pixels = 5, .clipped = 0.4, .exposure_stops = -1.5, .shift_pixels = 20, .moved = 0.3};
    struct lumi_judge_limits limits;
    char reason[400], brief[20];

    (void)state;
    lumi_judge_limits_init(&limits);
    assert_false(lumi_judge_verdict(&n, &limits, 0.5, NULL, reason, sizeof reason));
    assert_string_equal(reason, "not sharp: 20 % of what this camera's frames usually have; smeared over 5.0 pixels; "
                                "40 % of it is white; 1.5 stops darker than its neighbours; shifted by 20.0 pixels "
                                "against its neighbours: the camera has moved; things moved in 30 % of it");
    assert_false(lumi_judge_verdict(&n, &limits, 0.5, NULL, brief, sizeof brief));
    assert_int_equal(strlen(brief), sizeof brief - 1);
}

static void every_lack_of_memory_is_told(void **state)
{
    static const uint8_t data[160 * 140];
    const struct lumi_camera_frame frame = {
        .format = {LUMI_LAYOUT_GREY, LUMI_BAYER_RGGB, 160, 140, 8, 160}, .data = data, .size = sizeof data};
    struct lumi_judge_picture *picture;
    struct lumi_error error;
    int code = LUMI_ERR_NOMEM;

    (void)state;
    for (int i = 0; i < 20 && code == LUMI_ERR_NOMEM; i++) {
        lumi_alloc_fail_after(i);
        code = lumi_judge_picture_create(&frame, &picture, &error);
        lumi_alloc_fail_after(-1);
    }
    assert_int_equal(code, LUMI_OK);
    lumi_judge_picture_destroy(picture);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nothing_is_found_in_a_good_frame),
        cmocka_unit_test(small_pictures_of_a_wide_rig_are_good_and_their_smears_are_found),
        cmocka_unit_test(a_smear_is_measured_in_length_and_direction),
        cmocka_unit_test(defocus_takes_sharpness_and_is_no_smear),
        cmocka_unit_test(clipped_highlights_are_counted),
        cmocka_unit_test(exposure_is_compared_with_neighbours_and_with_what_the_camera_says),
        cmocka_unit_test(a_knocked_camera_is_seen_as_a_shift),
        cmocka_unit_test(a_thing_that_moved_is_seen_by_its_size),
        cmocka_unit_test(a_frame_that_shows_something_else_altogether_is_rejected),
        cmocka_unit_test(raw_and_developed_frames_are_judged_alike),
        cmocka_unit_test(a_verdict_names_everything_that_is_wrong_in_one_line),
        cmocka_unit_test(every_lack_of_memory_is_told),
    };
    return cmocka_run_group_tests(tests, render, forget);
}
