/* pipeline/run: places are written and read again, a run takes them up; brackets are one image. */
#include "pipeline/run/places.h"
#include "pipeline/run/run.h"
#include "tests/unit/run_fixture.h"

#include <glib/gstdio.h>

static char *folder;

static int make_capture(void **state)
{
    static const struct run_fixture fixture = {8, 6, 6, 3, 6, wall_pose};

    (void)state;
    folder = make_run_fixture(&fixture);
    return 0;
}

static int remove_capture(void **state)
{
    (void)state;
    return remove_run_fixture(folder);
}

static struct lumi_run *open_run(enum lumi_choice calibrate)
{
    g_autofree char *path = g_build_filename(folder, "capture", NULL);
    struct lumi_parameters parameters;
    struct lumi_error error = {0};
    struct lumi_run *run;

    lumi_run_defaults(&parameters);
    parameters.calibrate = calibrate;
    parameters.equalize = parameters.synthesize = parameters.subsample = LUMI_CHOICE_NO;
    parameters.prefilter = 0;
    if (lumi_run_open(path, NULL, &parameters, 1, false, &run, &error) != LUMI_OK)
        fail_msg("%s", error.text);
    return run;
}

static void what_is_written_is_read_again_bit_for_bit(void **state)
{
    g_autofree char *path = g_build_filename(folder, "some.places", NULL);
    struct lumi_places places = {0}, back;
    struct lumi_lens lens;
    int index;

    (void)state;
    lumi_lens_init_pinhole(&lens, 640, 480, 1.234567890123456789);
    assert_int_equal(lumi_places_add_lens(&places, &lens, &index, NULL), LUMI_OK);
    lens.k1 = -0.1 / 3;
    lens.model = LUMI_LENS_FISHEYE;
    assert_int_equal(lumi_places_add_lens(&places, &lens, &index, NULL), LUMI_OK);
    assert_int_equal(index, 1);
    assert_int_equal(lumi_places_add_lens(&places, &lens, &index, NULL), LUMI_OK);
    assert_int_equal(index, 1);
    for (int i = 0; i < 16; i++) {
        struct lumi_place place = {.lens = i % 2,
                                   .pose = wall_pose(i, i + 1),
                                   .used = i & 1,
                                   .kept = i & 2,
                                   .synthetic = i & 4,
                                   .masked = i & 8};
        g_snprintf(place.name, sizeof place.name, "v%02d", i);
        g_strlcpy(place.why, i == 5 ? "2 features, 20 wanted: is something before the lens?" : "", sizeof place.why);
        assert_int_equal(lumi_places_add(&places, &place, NULL), LUMI_OK);
    }
    assert_int_equal(lumi_places_write(path, &places, NULL), LUMI_OK);
    assert_int_equal(lumi_places_read(path, &back, NULL), LUMI_OK);
    assert_int_equal(back.count, 16);
    assert_int_equal(back.lens_count, 2);
    assert_true(lumi_lens_equal(&back.lenses[0], &places.lenses[0]));
    assert_true(lumi_lens_equal(&back.lenses[1], &places.lenses[1]));
    for (int i = 0; i < 16; i++) {
        const struct lumi_place *a = &places.items[i], *b = &back.items[i];
        assert_string_equal(a->name, b->name);
        assert_string_equal(a->why, b->why);
        assert_memory_equal(&a->pose, &b->pose, sizeof a->pose);
        assert_int_equal(a->lens, b->lens);
        assert_int_equal(a->used, b->used);
        assert_int_equal(a->kept, b->kept);
        assert_int_equal(a->synthetic, b->synthetic);
        assert_int_equal(a->masked, b->masked);
    }
    assert_int_equal(lumi_places_find(&back, "v15"), 15);
    assert_int_equal(lumi_places_find(&back, "v16"), -1);
    lumi_places_finish(&places);
    lumi_places_finish(&back);
}

static void bad_places_are_refused_with_their_line(void **state)
{
    static const struct {
        const char *text, *said;
    } cases[] = {
        {"", "t: does not begin with 'lumi places 1'"},
        {"lumi places 2\n", "t: does not begin with 'lumi places 1'"},
        {"lumi places 1\nlens 1 640 480 500 500 320\n", "t:2: a lens is its model, its size and ten numbers"},
        {"lumi places 1\nlens 1 640 480 0 500 320 240 0 0 0 0 0 0\n", "t:2: this is no lens"},
        {"lumi places 1\nview a 0 uk 1 0 0 0 0 1 0 0 0 0 1 0\n", "t:2: there is no such lens"},
        {"lumi places 1\nlens 1 64 48 50 50 32 24 0 0 0 0 0 0\nview ../a 0 uk 1 0 0 0 0 1 0 0 0 0 1 0\n",
         "t:3: a view's name is wanted"},
        {"lumi places 1\nlens 1 64 48 50 50 32 24 0 0 0 0 0 0\nview a 0 ux 1 0 0 0 0 1 0 0 0 0 1 0\n",
         "t:3: flags are letters of 'uksm', or '-'"},
        {"lumi places 1\nlens 1 64 48 50 50 32 24 0 0 0 0 0 0\nview a 0 u 1 0 0 0 0 2 0 0 0 0 1 0\n",
         "t:3: this is no pose"},
        {"lumi places 1\nlens 1 64 48 50 50 32 24 0 0 0 0 0 0\nview a 0 u 1 0 0 0 0 1 0 0 0 0 nan 0\n",
         "t:3: a pose is twelve numbers"},
        {"lumi places 1\nlens 1 64 48 50 50 32 24 0 0 0 0 0 0\nview a 0 u 1 0 0 0 0 1 0 0 0 0 1 0\n"
         "view a 0 u 1 0 0 0 0 1 0 0 0 0 1 0\n",
         "t: two views are called a"},
    };

    (void)state;
    for (size_t i = 0; i < G_N_ELEMENTS(cases); i++) {
        struct lumi_error error = {0};
        struct lumi_places places;
        assert_int_equal(lumi_places_parse(cases[i].text, strlen(cases[i].text), "t", &places, &error),
                         LUMI_ERR_FORMAT);
        assert_string_equal(error.text, cases[i].said);
        assert_null(places.items);
    }
}

/* Leaves what calibration would: places of the run's own frames, changed by `change`. */
static void calibrated_as(struct lumi_run *run, void (*change)(struct lumi_places *places))
{
    g_autofree char *path = lumi_run_path(run, "calibrate", -1, ".places"), *at = g_path_get_dirname(path);
    struct lumi_places places;

    assert_int_equal(lumi_run_frames_places(run, &places, NULL), LUMI_OK);
    change(&places);
    g_mkdir_with_parents(at, 0777);
    assert_int_equal(lumi_places_write(path, &places, NULL), LUMI_OK);
    lumi_places_finish(&places);
}

static void drop_one_keep_some_add_a_pole(struct lumi_places *places)
{
    struct lumi_place pole = {.name = "pole00", .pose = wall_pose(9, 9), .used = true, .kept = true, .synthetic = true};

    places->items[1].used = false;
    places->items[2].kept = false;
    places->items[3].masked = true;
    places->items[4].pose.t.x += 0.25;
    /* In the middle of the list: still it comes after all photographs. */
    assert_int_equal(lumi_places_add(places, &places->items[5], NULL), LUMI_OK);
    places->items[5] = pole;
}

static bool only_masked(const struct lumi_run *run, int index)
{
    return index < 0 || run->sources[index].masked;
}

static void a_placed_run_has_photographs_first_and_leaves_out_what_is_not_used(void **state)
{
    const struct lumi_stage dense = {.name = "d", .set = LUMI_SET_DENSE}, kept = {.name = "k", .set = LUMI_SET_KEPT};
    const struct lumi_stage filled = {.name = "f", .set = LUMI_SET_FILLED};
    const struct lumi_stage some = {.name = "s", .set = LUMI_SET_DENSE, .wanted = only_masked};
    const struct lumi_stage whole = {.name = "w", .set = LUMI_SET_KEPT, .whole = true};
    struct lumi_run *run = open_run(LUMI_CHOICE_YES);

    (void)state;
    assert_int_equal(run->count, 6);
    calibrated_as(run, drop_one_keep_some_add_a_pole);
    assert_int_equal(lumi_run_place(run, NULL), LUMI_OK);
    assert_int_equal(run->count, 6);
    assert_int_equal(run->dense, 5);
    assert_string_equal(run->sources[1].name, "view02");
    assert_string_equal(run->sources[5].name, "pole00");
    assert_null(run->sources[5].path);
    assert_true(run->sources[3].pose.t.x == run->sources[3].prior.t.x + 0.25);
    assert_int_equal(run->kept_count, 5);
    assert_int_equal(run->kept[1], 2);
    assert_int_equal(lumi_stage_count(run, &dense), 5);
    assert_int_equal(lumi_stage_count(run, &kept), 5);
    assert_int_equal(lumi_stage_count(run, &filled), 2);
    assert_int_equal(lumi_stage_count(run, &some), 1);
    assert_int_equal(lumi_stage_count(run, &whole), 1);
    g_autofree char *taken = lumi_run_view(run, 0, LUMI_VIEW_DEPTH), *made = lumi_run_view(run, 5, LUMI_VIEW_DEPTH);
    assert_non_null(strstr(taken, "/depth/view00.exr"));
    assert_non_null(strstr(made, "/synthesize/pole00.exr"));
    lumi_run_close(run);
}

static void drop_all(struct lumi_places *places)
{
    for (int i = 0; i < places->count; i++)
        places->items[i].used = false;
}

static void without_a_single_good_picture_there_is_no_run(void **state)
{
    struct lumi_run *run = open_run(LUMI_CHOICE_YES);
    struct lumi_error error = {0};

    (void)state;
    calibrated_as(run, drop_all);
    assert_int_equal(lumi_run_place(run, &error), LUMI_ERR_FORMAT);
    assert_non_null(strstr(error.text, "none of its pictures can be used: calibrate/report.txt"));
    lumi_run_close(run);
}

static void without_calibration_a_run_is_placed_where_the_capture_says(void **state)
{
    struct lumi_run *run = open_run(LUMI_CHOICE_AUTO); /* the poses are true */

    (void)state;
    assert_false(run->wants.calibrate);
    assert_int_equal(lumi_run_place(run, NULL), LUMI_OK);
    assert_int_equal(run->kept_count, 6);
    assert_memory_equal(&run->sources[4].pose, &run->sources[4].prior, sizeof run->sources[4].pose);
    lumi_run_close(run);
}

/* A camera that fires a bracket at each of two positions, and once more at the second with an exposure it had. */
static char *make_brackets(void)
{
    static const struct {
        int position;
        double offset, exposure_s;
    } shots[] = {{0, 0, 0.01}, {0, -2, 0.0025}, {0, 2, 0.04}, {1, 2, 0.04}, {1, 0, 0.01}, {1, 0, 0.01}};
    char *path = g_build_filename(folder, "brackets", NULL);
    struct lumi_capture_lens lens = {.name = "lens"};
    struct lumi_pose pose = wall_pose(1, 2);
    struct lumi_capture *capture;
    int64_t lens_id, camera, position = 0, shot, frame;

    lumi_lens_init_pinhole(&lens.lens, 8, 6, 1);
    assert_int_equal(lumi_capture_create(path, &capture, NULL), LUMI_OK);
    assert_int_equal(lumi_capture_add_lens(capture, &lens, &lens_id, NULL), LUMI_OK);
    assert_int_equal(lumi_capture_add_camera(capture, "camera", lens_id, &camera, NULL), LUMI_OK);
    for (int i = 0; i < (int)G_N_ELEMENTS(shots); i++) {
        g_autofree char *name = g_strdup_printf("f%d", i);
        const struct lumi_capture_position at = {.number = shots[i].position};
        const struct lumi_capture_file file = {.extension = ".png",
                                               .width = 8,
                                               .height = 6,
                                               .exposure_s = shots[i].exposure_s,
                                               .camera_time_us = LUMI_NO_TIME};
        if (i == 0 || shots[i].position != shots[i - 1].position)
            assert_int_equal(lumi_capture_add_position(capture, &at, &position, NULL), LUMI_OK);
        assert_int_equal(lumi_capture_add_shot(capture, position, i, shots[i].offset, &shot, NULL), LUMI_OK);
        const struct lumi_capture_new_frame new_frame = {
            .name = name, .camera = camera, .shot = shot, .row = -1, .column = -1};
        assert_int_equal(lumi_capture_add_frame(capture, &new_frame, &frame, NULL), LUMI_OK);
        assert_int_equal(lumi_capture_store_bytes(capture, frame, name, 2, &file, NULL), LUMI_OK);
        assert_int_equal(lumi_capture_set_pose(capture, frame, &pose, LUMI_POSE_PRIOR, "test", NULL), LUMI_OK);
    }
    assert_int_equal(lumi_capture_publish(capture, NULL, NULL), LUMI_OK);
    lumi_capture_close(capture);
    return path;
}

static void the_shots_of_a_bracket_are_one_image_darkest_first(void **state)
{
    g_autofree char *path = make_brackets();
    struct lumi_parameters parameters;
    struct lumi_run *run;

    (void)state;
    lumi_run_defaults(&parameters);
    assert_int_equal(lumi_run_open(path, NULL, &parameters, 1, false, &run, NULL), LUMI_OK);
    assert_int_equal(run->count, 3);
    assert_string_equal(run->sources[0].name, "f0");
    assert_int_equal(run->sources[0].part_count, 3);
    assert_true(run->sources[0].parts[0].exposure_offset == -2 && run->sources[0].parts[0].exposure_s == 0.0025);
    assert_true(run->sources[0].parts[2].exposure_offset == 2);
    assert_non_null(strstr(run->sources[0].parts[1].path, "f0.png"));
    /* The exposure asked for nearest to 0 stands for all, whenever it was taken. */
    assert_string_equal(run->sources[1].name, "f4");
    assert_int_equal(run->sources[1].part_count, 2);
    assert_int_equal(run->sources[2].part_count, 1); /* among brackets, on its own */
    g_autofree char *merged = lumi_run_image(run, 1), *alone = lumi_run_image(run, 2);
    assert_non_null(strstr(merged, "/merge/f4.exr"));
    assert_non_null(strstr(alone, "/merge/f5.exr"));
    lumi_run_close(run);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_written_is_read_again_bit_for_bit),
        cmocka_unit_test(bad_places_are_refused_with_their_line),
        cmocka_unit_test(a_placed_run_has_photographs_first_and_leaves_out_what_is_not_used),
        cmocka_unit_test(without_a_single_good_picture_there_is_no_run),
        cmocka_unit_test(without_calibration_a_run_is_placed_where_the_capture_says),
        cmocka_unit_test(the_shots_of_a_bracket_are_one_image_darkest_first),
    };
    return cmocka_run_group_tests(tests, make_capture, remove_capture);
}
