/* Sources on the disk become captures, and captures the sources they came from. */
#include "image_samples.h"
#include "pipeline/exchange/exchange.h"
#include "pipeline/exchange/ply.h"
#include "proto/base/file.h"
#include "proto/base/memory.h"
#include "proto/capture/capture.h"
#include "proto/image/image.h"

#include <glib/gstdio.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

static char *folder;
static struct lumi_error error;
static struct lumi_import_options options;

static char *in_folder(const char *name)
{
    return g_build_filename(folder, name, NULL);
}

static void write_picture(const char *name, int width, int height)
{
    g_autofree char *path = in_folder(name);
    g_autofree char *parent = g_path_get_dirname(path);
    struct lumi_raster raster;

    g_mkdir_with_parents(parent, 0777);
    make_picture(&raster, width, height, 3, LUMI_U8);
    assert_int_equal(lumi_image_write(path, &raster, NULL, &error), LUMI_OK);
    lumi_raster_finish(&raster);
}

static void write_text(const char *name, const char *text)
{
    g_autofree char *path = in_folder(name);

    assert_int_equal(lumi_file_write(path, text, strlen(text), false, &error), LUMI_OK);
}

static void remove_tree(const char *path)
{
    g_autoptr(GDir) directory = g_dir_open(path, 0, NULL);
    const char *name;

    while (directory && (name = g_dir_read_name(directory)) != NULL) {
        g_autofree char *inner = g_build_filename(path, name, NULL);
        remove_tree(inner);
    }
    g_remove(path);
}

static int set_up(void **state)
{
    (void)state;
    folder = g_dir_make_tmp("lumi-test-XXXXXX", NULL);
    error = (struct lumi_error){0};
    lumi_import_options_init(&options);
    options.threads = 2;
    return folder ? 0 : -1;
}

static int tear_down(void **state)
{
    (void)state;
    remove_tree(folder);
    g_clear_pointer(&folder, g_free);
    return 0;
}

/* A 3x3 grid of pictures, rows and columns from 1. */
static void write_grid(void)
{
    GString *text = g_string_new("{\"w\":32,\"h\":24,\"fl_x\":30,\"frames\":[");

    for (int i = 0; i < 9; i++) {
        g_autofree char *name = g_strdup_printf("images/p%d.png", i);
        write_picture(name, 32, 24);
        g_string_append_printf(text,
                               "%s{\"file_path\":\"images/p%d\",\"row\":%d,\"col\":%d,\"transform_matrix\":"
                               "[[1,0,0,0.1],[0,1,0,%d.3],[0,0,1,3],[0,0,0,1]]}",
                               i ? "," : "", i, i / 3 + 1, i % 3 + 1, i);
    }
    g_string_append(text, "]}");
    write_text("transforms.json", text->str);
    g_string_free(text, TRUE);
}

static int import(const char *source)
{
    g_autofree char *from = in_folder(source);
    g_autofree char *to = in_folder("out.capture");

    return lumi_import(from, to, &options, &error);
}

static struct lumi_capture_frame *frames_of_capture(int *count)
{
    g_autofree char *path = in_folder("out.capture");
    struct lumi_capture *capture;
    struct lumi_capture_frame *frames;

    if (lumi_capture_open(path, LUMI_CAPTURE_READ, &capture, &error) != LUMI_OK)
        fail_msg("%s", error.text);
    assert_int_equal(lumi_capture_frames(capture, LUMI_FRAMES_USABLE, &frames, count, &error), LUMI_OK);
    lumi_capture_close(capture);
    return frames;
}

static void assert_nothing_left(void)
{
    g_autofree char *capture = in_folder("out.capture"), *partial = in_folder("out.capture.partial");

    assert_false(g_file_test(capture, G_FILE_TEST_EXISTS));
    assert_false(g_file_test(partial, G_FILE_TEST_EXISTS));
}

static void every_chooses_rows_and_columns_and_files_are_copied_byte_for_byte(void **state)
{
    g_autofree char *source = in_folder("images/p8.png");
    g_autofree char *copy = in_folder("out.capture/data/frames/p8.png");
    uint8_t *a, *b;
    size_t size_a, size_b;
    int count;

    (void)state;
    write_grid();
    options.every_row = 2;
    options.every_column = 2;
    if (import("transforms.json") != LUMI_OK)
        fail_msg("%s", error.text);
    struct lumi_capture_frame *frames = frames_of_capture(&count);
    assert_int_equal(count, 4);
    assert_string_equal(frames[0].name, "p0");
    assert_string_equal(frames[3].name, "p8");
    assert_int_equal(frames[3].row, 3);
    assert_int_equal(frames[3].column, 3);
    assert_true(frames[3].has_pose && frames[3].pose.t.y == 8.3 && frames[3].lens.fx == 30);
    assert_true(frames[3].pose_source == LUMI_POSE_IMPORTED);
    lumi_free(frames);
    assert_int_equal(lumi_file_read(source, 1 << 20, &a, &size_a, &error), LUMI_OK);
    assert_int_equal(lumi_file_read(copy, 1 << 20, &b, &size_b, &error), LUMI_OK);
    assert_int_equal(size_a, size_b);
    assert_memory_equal(a, b, size_a);
    lumi_free(a);
    lumi_free(b);
}

static void every_kth_and_a_limit_count_frames(void **state)
{
    int count;

    (void)state;
    write_grid();
    options.every_row = 4;
    options.limit = 2;
    assert_int_equal(import("transforms.json"), LUMI_OK);
    struct lumi_capture_frame *frames = frames_of_capture(&count);
    assert_int_equal(count, 2);
    assert_string_equal(frames[1].name, "p4");
    lumi_free(frames);
}

static void transforms_survive_a_round_trip_through_a_capture(void **state)
{
    g_autofree char *capture = in_folder("out.capture"), *first = in_folder("1.json"), *second = in_folder("2.json");
    g_autofree char *third = in_folder("3.json"), *again = in_folder("again.capture");
    uint8_t *a, *b;
    size_t size_a, size_b;

    (void)state;
    write_grid();
    /* Poses of six digits, which are no rotations to the last bit. */
    write_text("t.json",
               "{\"camera_model\":\"OPENCV\",\"k1\":0.1,\"w\":32,\"h\":24,\"fl_x\":30.1,\"fl_y\":30.2,\"frames\":["
               "{\"file_path\":\"images/p0.png\",\"transform_matrix\":[[0.866025,-0.5,0,0.1],"
               "[0.5,0.866025,0,0.2],[0,0,1,1e-17],[0,0,0,1]]},"
               "{\"file_path\":\"images/p1.png\",\"fl_x\":31,\"transform_matrix\":[[1,0,0,0.1],"
               "[0,1,0,0.2],[0,0,1,0.30000000000000004],[0,0,0,1]]}]}");
    assert_int_equal(import("t.json"), LUMI_OK);
    assert_int_equal(lumi_export_transforms(capture, first, true, &error), LUMI_OK);
    assert_int_equal(lumi_import(first, again, &options, &error), LUMI_OK);
    assert_int_equal(lumi_export_transforms(again, second, true, &error), LUMI_OK);
    assert_int_equal(lumi_file_read(first, 1 << 20, &a, &size_a, &error), LUMI_OK);
    assert_int_equal(lumi_file_read(second, 1 << 20, &b, &size_b, &error), LUMI_OK);
    assert_string_equal((const char *)a, (const char *)b);
    assert_non_null(strstr((const char *)a, "0.86602500000000004"));
    assert_non_null(strstr((const char *)a, "0.30000000000000004"));
    assert_non_null(strstr((const char *)a, "\"images/p1.png\""));
    lumi_free(a);
    lumi_free(b);
    /* By default the names are the capture's own files: they can be read from where the file lies. */
    assert_int_equal(lumi_export_transforms(capture, third, false, &error), LUMI_OK);
    remove_tree(again);
    if (lumi_import(third, again, &options, &error) != LUMI_OK)
        fail_msg("%s", error.text);
}

static void colmap_models_survive_a_round_trip_bit_for_bit(void **state)
{
    g_autofree char *capture = in_folder("out.capture"), *model = in_folder("model");
    static const char *const files[] = {"cameras.bin", "images.bin"};

    (void)state;
    write_picture("images/a.png", 32, 24);
    write_picture("images/b.png", 32, 24);
    write_text("cameras.txt", "1 RADIAL 32 24 30.123456789 16 12 0.01 -0.002\n2 PINHOLE 32 24 30 31 16 12\n");
    write_text("images.txt", "1 0.9 0.1 0.2 0.37416573867739417 0.1 0.2 0.3 2 a.png\n\n"
                             "2 -0.9 0.1 0.2 0.3741657 0.123456789012345 0.2 0.3 1 b.png\n\n");
    if (import(".") != LUMI_OK)
        fail_msg("%s", error.text);
    assert_int_equal(lumi_export_colmap(capture, model, false, true, &error), LUMI_OK);
    uint8_t *before[2], *after[2];
    size_t size[2], size_after;
    for (int i = 0; i < 2; i++) {
        g_autofree char *path = g_build_filename(model, files[i], NULL);
        assert_int_equal(lumi_file_read(path, 1 << 20, &before[i], &size[i], &error), LUMI_OK);
    }
    remove_tree(capture);
    g_autofree char *pictures = in_folder("images");
    options.images = pictures;
    if (import("model") != LUMI_OK)
        fail_msg("%s", error.text);
    assert_int_equal(lumi_export_colmap(capture, model, false, true, &error), LUMI_OK);
    for (int i = 0; i < 2; i++) {
        g_autofree char *path = g_build_filename(model, files[i], NULL);
        assert_int_equal(lumi_file_read(path, 1 << 20, &after[i], &size_after, &error), LUMI_OK);
        assert_int_equal(size[i], size_after);
        assert_memory_equal(before[i], after[i], size_after);
        lumi_free(before[i]);
        lumi_free(after[i]);
    }
}

static void stanford_folders_are_planar_arrays(void **state)
{
    int count;

    (void)state;
    write_picture("out_00_00_-1000_-500_.png", 32, 24);
    write_picture("out_00_01_-1000_500_.png", 32, 24);
    write_picture("out_01_00_1000_-500_.png", 32, 24);
    write_picture("out_01_01_1000_500_.png", 32, 24);
    assert_int_equal(import("."), LUMI_ERR_ARG);
    assert_nothing_left();
    options.focal = 40;
    options.plane = 2;
    if (import(".") != LUMI_OK)
        fail_msg("%s", error.text);
    struct lumi_capture_frame *frames = frames_of_capture(&count);
    assert_int_equal(count, 4);
    for (int i = 0; i < 4; i++) {
        double x, y;
        /* A point on the plane, straight ahead of the array's middle, is in the middle of every picture. */
        struct lumi_vec3 seen = lumi_to_camera(&frames[i].pose, lumi_vec3(0, 2, 0));
        assert_true(lumi_lens_project(&frames[i].lens, seen, &x, &y));
        assert_true(fabs(x - 16) < 1e-9 && fabs(y - 12) < 1e-9);
        assert_int_equal(frames[i].row, i / 2);
        assert_int_equal(frames[i].column, i % 2);
    }
    assert_true(frames[1].pose.t.x > frames[0].pose.t.x && frames[2].pose.t.z < frames[0].pose.t.z);
    assert_true(fabs(frames[1].pose.t.x - 0.5) < 1e-12 && fabs(frames[0].pose.t.z - 1) < 1e-12);
    lumi_free(frames);
}

/* A pose whose matrix has a diagonal of zeros is a pose like any other. */
static void a_unit_scales_the_places_of_all_images(void **state)
{
    g_autofree char *capture = in_folder("out.capture"), *back = in_folder("back.json");
    uint8_t *text;
    size_t size;
    int count;

    (void)state;
    write_picture("a.png", 32, 24);
    write_picture("b.png", 32, 24);
    write_text("t.json", "{\"w\":32,\"h\":24,\"fl_x\":30,\"frames\":["
                         "{\"file_path\":\"a.png\",\"transform_matrix\":[[1,0,0,100],[0,1,0,0],[0,0,1,300],[0,0,0,1]]},"
                         "{\"file_path\":\"b.png\",\"transform_matrix\":[[0,0,1,100],[1,0,0,0],[0,1,0,300],[0,0,0,1]]}"
                         "]}");
    options.unit = 0.01;
    assert_int_equal(import("t.json"), LUMI_OK);
    struct lumi_capture_frame *frames = frames_of_capture(&count);
    assert_int_equal(count, 2);
    for (int i = 0; i < count; i++)
        assert_true(frames[i].pose.t.x == 1 && frames[i].pose.t.z == 3);
    lumi_free(frames);
    assert_int_equal(lumi_export_transforms(capture, back, true, &error), LUMI_OK);
    assert_int_equal(lumi_file_read(back, 1 << 20, &text, &size, &error), LUMI_OK);
    assert_null(strstr((const char *)text, "100"));
    lumi_free(text);
}

/* ---- Bad input ---- */

static void expect(const char *source, int code, const char *file, const char *cause)
{
    error.text[0] = '\0';
    int got = import(source);

    if (got != code || !strstr(error.text, file) || !strstr(error.text, cause) || strchr(error.text, '\n'))
        fail_msg("%d '%s'", got, error.text);
    assert_int_equal(lumi_exit_status(got), 3);
    assert_nothing_left();
}

static void a_missing_image_is_named(void **state)
{
    g_autofree char *path = in_folder("images/p4.png");

    (void)state;
    write_grid();
    g_remove(path);
    expect("transforms.json", LUMI_ERR_NOTFOUND, "images/p4", "missing");
}

static void an_image_of_another_size_is_named(void **state)
{
    (void)state;
    write_grid();
    write_picture("images/p5.png", 31, 24);
    expect("transforms.json", LUMI_ERR_FORMAT, "images/p5.png", "31x24 pixels, its camera 32x24");
}

static void a_damaged_image_is_named(void **state)
{
    g_autofree char *path = in_folder("images/p3.png");
    uint8_t *data;
    size_t size;

    (void)state;
    write_grid();
    assert_int_equal(lumi_file_read(path, 1 << 20, &data, &size, &error), LUMI_OK);
    assert_int_equal(lumi_file_write(path, data, size / 2, false, &error), LUMI_OK);
    lumi_free(data);
    expect("transforms.json", LUMI_ERR_FORMAT, "images/p3.png", "too early");
}

static void two_images_of_one_name_are_named(void **state)
{
    static const char frame[] = "{\"file_path\":\"images/p0.png\",\"transform_matrix\":"
                                "[[1,0,0,0],[0,1,0,0],[0,0,1,3],[0,0,0,1]]}";
    g_autofree char *text = g_strdup_printf("{\"w\":32,\"h\":24,\"fl_x\":30,\"frames\":[%s,%s]}", frame, frame);

    (void)state;
    write_grid();
    write_text("two.json", text);
    expect("two.json", LUMI_ERR_FORMAT, "two.json", "two images of one name: 'images/p0.png'");
    /* The same file under another spelling is the same image. */
    char *second = strstr(strstr(text, "images/p0.png") + 1, "images/p0.png");
    memcpy(second, "images//p0   ", 13);
    memmove(second + 10, second + 13, strlen(second + 13) + 1);
    write_text("two.json", text);
    expect("two.json", LUMI_ERR_FORMAT, "two.json", "two images of one name: 'images//p0'");
}

static void names_that_differ_only_in_other_letters_are_told_apart(void **state)
{
    GString *text = g_string_new("{\"w\":32,\"h\":24,\"fl_x\":30,\"frames\":[");
    int count;

    (void)state;
    static const char *const files[] = {"a b/\xc3\xa4.png", "a b/\xc3\xb6.png", "a b/\xc3\xbc.png"};
    for (int i = 0; i < 3; i++) {
        write_picture(files[i], 32, 24);
        g_string_append_printf(
            text, "%s{\"file_path\":\"%s\",\"transform_matrix\":[[1,0,0,%d],[0,1,0,0],[0,0,1,3],[0,0,0,1]]}",
            i ? "," : "", files[i], i);
    }
    g_string_append(text, "]}");
    write_text("t.json", text->str);
    g_string_free(text, TRUE);
    if (import("t.json") != LUMI_OK)
        fail_msg("%s", error.text);
    struct lumi_capture_frame *frames = frames_of_capture(&count);
    assert_int_equal(count, 3);
    for (int i = 0; i < 3; i++)
        assert_string_equal(frames[i].original, files[i]);
    assert_string_equal(frames[1].name, "a_b___-2");
    assert_string_equal(frames[2].name, "a_b___-3");
    lumi_free(frames);
}

static void files_of_one_name_in_two_folders_are_told_apart(void **state)
{
    int count;

    (void)state;
    write_picture("left/0.png", 32, 24);
    write_picture("right/0.png", 32, 24);
    write_text("t.json",
               "{\"w\":32,\"h\":24,\"fl_x\":30,\"frames\":["
               "{\"file_path\":\"left/0.png\",\"transform_matrix\":[[1,0,0,0],[0,1,0,0],[0,0,1,3],[0,0,0,1]]},"
               "{\"file_path\":\"right/0.png\",\"transform_matrix\":[[1,0,0,1],[0,1,0,0],[0,0,1,3],[0,0,0,1]]}"
               "]}");
    assert_int_equal(import("t.json"), LUMI_OK);
    struct lumi_capture_frame *frames = frames_of_capture(&count);
    assert_int_equal(count, 2);
    assert_string_equal(frames[1].name, "right_0");
    assert_string_equal(frames[1].original, "right/0.png");
    lumi_free(frames);
}

static void what_is_no_source_is_said_to_be_none(void **state)
{
    (void)state;
    expect("nowhere.json", LUMI_ERR_NOTFOUND, "nowhere.json", "cannot open");
    expect(".", LUMI_ERR_FORMAT, folder, "neither");
}

static void places_beyond_all_measure_are_named(void **state)
{
    static const char form[] = "{\"w\":32,\"h\":24,\"fl_x\":30,\"frames\":[{\"file_path\":\"images/p0.png\","
                               "\"transform_matrix\":[[1,0,0,%s],[0,1,0,0],[0,0,1,3],[0,0,0,1]]}]}";
    g_autofree char *huge = g_strdup_printf(form, "1e300"), *large = g_strdup_printf(form, "-1e11");

    (void)state;
    write_grid();
    write_text("t.json", huge);
    expect("t.json", LUMI_ERR_FORMAT, "images/p0.png", "farther than");
    write_text("t.json", large);
    options.unit = 100;
    expect("t.json", LUMI_ERR_FORMAT, "images/p0.png", "farther than");
    options.unit = 1;
    assert_int_equal(import("t.json"), LUMI_OK);
}

static void what_is_no_text_is_not_shown_as_text(void **state)
{
    (void)state;
    write_text("t.json", "{\"frames\":\x95\x01}");
    expect("t.json", LUMI_ERR_FORMAT, "t.json", "line 1, column 11: byte 0x95");
    write_text("t.json", "{\"frames\":[NaN]}");
    expect("t.json", LUMI_ERR_FORMAT, "t.json", "line 1, column 12: 'NaN'");
}

/* Export would otherwise replace what it reads. */
static void nothing_is_written_into_the_capture_that_is_read(void **state)
{
    g_autofree char *capture = in_folder("out.capture"), *within = in_folder("out.capture/data/capture.db");
    g_autofree char *new_file = in_folder("out.capture/data/../new/x.json"), *link = in_folder("link");
    g_autofree char *by_link = in_folder("link/x.json"), *beside = in_folder("out.capture.json");

    (void)state;
    write_grid();
    assert_int_equal(import("transforms.json"), LUMI_OK);
    assert_int_equal(symlink(capture, link), 0);
    assert_int_equal(lumi_export_transforms(capture, within, false, &error), LUMI_ERR_ARG);
    assert_int_equal(lumi_export_transforms(capture, new_file, false, &error), LUMI_ERR_ARG);
    assert_int_equal(lumi_export_transforms(capture, by_link, false, &error), LUMI_ERR_ARG);
    assert_int_equal(lumi_export_transforms(link, within, false, &error), LUMI_ERR_ARG);
    assert_int_equal(lumi_export_colmap(capture, capture, false, false, &error), LUMI_ERR_ARG);
    assert_int_equal(lumi_export_transforms(capture, beside, false, &error), LUMI_OK);
    assert_int_equal(g_remove(link), 0);
    assert_false(g_file_test(new_file, G_FILE_TEST_EXISTS));
}

static void an_existing_capture_is_not_overwritten(void **state)
{
    g_autofree char *path = in_folder("out.capture");

    (void)state;
    write_grid();
    g_mkdir(path, 0777);
    assert_int_equal(import("transforms.json"), LUMI_ERR_EXISTS);
    assert_true(g_file_test(path, G_FILE_TEST_IS_DIR));
}

int main(void)
{
#define TEST(NAME) cmocka_unit_test_setup_teardown(NAME, set_up, tear_down)
    const struct CMUnitTest tests[] = {
        TEST(every_chooses_rows_and_columns_and_files_are_copied_byte_for_byte),
        TEST(every_kth_and_a_limit_count_frames),
        TEST(transforms_survive_a_round_trip_through_a_capture),
        TEST(colmap_models_survive_a_round_trip_bit_for_bit),
        TEST(stanford_folders_are_planar_arrays),
        TEST(a_unit_scales_the_places_of_all_images),
        TEST(a_missing_image_is_named),
        TEST(an_image_of_another_size_is_named),
        TEST(a_damaged_image_is_named),
        TEST(two_images_of_one_name_are_named),
        TEST(names_that_differ_only_in_other_letters_are_told_apart),
        TEST(files_of_one_name_in_two_folders_are_told_apart),
        TEST(what_is_no_source_is_said_to_be_none),
        TEST(an_existing_capture_is_not_overwritten),
        TEST(places_beyond_all_measure_are_named),
        TEST(what_is_no_text_is_not_shown_as_text),
        TEST(nothing_is_written_into_the_capture_that_is_read),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
