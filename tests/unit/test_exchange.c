/* Other people's formats, read from memory and written back. */
#include "pipeline/exchange/exchange.h"
#include "proto/base/json_check.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#define FRAME(FIELDS, MATRIX) "{\"file_path\":\"a.png\"," FIELDS "\"transform_matrix\":" MATRIX "}"
#define UNIT "[[1,0,0,1],[0,1,0,2],[0,0,1,3],[0,0,0,1]]"
#define CAMERA "\"w\":100,\"h\":80,\"fl_x\":50,\"fl_y\":51,\"cx\":49.5,\"cy\":40.25,"

static struct lumi_exchange list;
static struct lumi_error error;

static int parse(const char *text)
{
    lumi_exchange_finish(&list);
    lumi_exchange_init(&list);
    error = (struct lumi_error){0};
    return lumi_exchange_parse_transforms(text, strlen(text), "t.json", &list, &error);
}

static int set_up(void **state)
{
    (void)state;
    lumi_exchange_init(&list);
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    lumi_exchange_finish(&list);
    return 0;
}

static void nerfstudio_cameras_look_backwards(void **state)
{
    (void)state;
    assert_int_equal(parse("{" CAMERA "\"frames\":[" FRAME("\"row\":2,\"col\":3,", UNIT) "]}"), LUMI_OK);
    const struct lumi_exchange_image *image = lumi_exchange_image(&list, 0);
    struct lumi_vec3 right = lumi_axis(&image->pose, 0), down = lumi_axis(&image->pose, 1);
    struct lumi_vec3 forward = lumi_axis(&image->pose, 2);
    assert_true(right.x == 1 && down.y == -1 && forward.z == -1);
    assert_true(image->pose.t.x == 1 && image->pose.t.y == 2 && image->pose.t.z == 3);
    assert_int_equal(image->row, 2);
    assert_int_equal(image->column, 3);
    struct lumi_lens lens;
    assert_int_equal(lumi_exchange_lens(lumi_exchange_camera(&list, 0), "x", &lens, &error), LUMI_OK);
    assert_true(lens.fx == 50 && lens.fy == 51 && lens.cx == 49.5 && lens.cy == 40.25 && lens.width == 100);
}

static void lens_models_of_transforms_become_ours(void **state)
{
    struct lumi_lens lens;

    (void)state;
    assert_int_equal(parse("{\"camera_model\":\"OPENCV_FISHEYE\",\"k1\":0.1,\"k2\":0.2,\"k3\":0.3,\"k4\":0.4," CAMERA
                           "\"frames\":[" FRAME("", UNIT) "]}"),
                     LUMI_OK);
    assert_int_equal(lumi_exchange_lens(lumi_exchange_camera(&list, 0), "x", &lens, &error), LUMI_OK);
    assert_true(lens.model == LUMI_LENS_FISHEYE && lens.k1 == 0.1 && lens.k4 == 0.4);
    assert_int_equal(parse("{\"is_fisheye\":true,\"k1\":0.1,\"k4\":0.4," CAMERA "\"frames\":[" FRAME("", UNIT) "]}"),
                     LUMI_OK); /* as instant-ngp says it */
    assert_int_equal(lumi_exchange_lens(lumi_exchange_camera(&list, 0), "x", &lens, &error), LUMI_OK);
    assert_true(lens.model == LUMI_LENS_FISHEYE && lens.k1 == 0.1 && lens.k4 == 0.4);
    assert_int_equal(parse("{\"k1\":0.01,\"k3\":0.03,\"p2\":0.002," CAMERA "\"frames\":[" FRAME("", UNIT) "]}"),
                     LUMI_OK);
    assert_int_equal(lumi_exchange_lens(lumi_exchange_camera(&list, 0), "x", &lens, &error), LUMI_OK);
    assert_true(lens.model == LUMI_LENS_BROWN && lens.k1 == 0.01 && lens.k3 == 0.03 && lens.p2 == 0.002);
}

static void a_frame_may_have_a_camera_of_its_own(void **state)
{
    (void)state;
    assert_int_equal(
        parse("{" CAMERA "\"frames\":[" FRAME("", UNIT) "," FRAME("\"fl_x\":60,", UNIT) "," FRAME("", UNIT) "]}"),
        LUMI_OK);
    assert_int_equal(list.cameras->len, 2);
    assert_true(lumi_exchange_camera(&list, lumi_exchange_image(&list, 1)->camera)->parameters[0] == 60);
    assert_int_equal(lumi_exchange_image(&list, 2)->camera, 0);
}

static void bad_transforms_are_refused_with_one_line(void **state)
{
    static const struct {
        const char *text;
        int code;
        const char *says;
    } bad[] = {
        {"", LUMI_ERR_FORMAT, "JSON"},
        {"[1,2", LUMI_ERR_FORMAT, "JSON"},
        {"{}", LUMI_ERR_FORMAT, "frames"},
        {"{\"frames\":[]}", LUMI_ERR_FORMAT, "0 frames"},
        {"{" CAMERA "\"frames\":[{\"transform_matrix\":" UNIT "}]}", LUMI_ERR_FORMAT, "file_path"},
        {"{" CAMERA "\"frames\":[{\"file_path\":\"a\"}]}", LUMI_ERR_FORMAT, "transform_matrix"},
        {"{\"w\":9,\"h\":9,\"frames\":[" FRAME("", UNIT) "]}", LUMI_ERR_FORMAT, "fl_x"},
        {"{\"camera_model\":\"THIN_PRISM_FISHEYE\"," CAMERA "\"frames\":[" FRAME("", UNIT) "]}", LUMI_ERR_UNSUPPORTED,
         "THIN_PRISM_FISHEYE"},
        {"{" CAMERA "\"frames\":[" FRAME("", "[[1,0,0,1e999],[0,1,0,2],[0,0,1,3],[0,0,0,1]]") "]}", LUMI_ERR_FORMAT,
         "not finite"},
        {"{" CAMERA "\"frames\":[" FRAME("", "[[NaN,0,0,1],[0,1,0,2],[0,0,1,3],[0,0,0,1]]") "]}", LUMI_ERR_FORMAT,
         "JSON"},
        {"{" CAMERA "\"frames\":[" FRAME("", "[[0,0,0,1],[0,1,0,2],[0,0,1,3],[0,0,0,1]]") "]}", LUMI_ERR_FORMAT,
         "singular"},
        {"{" CAMERA "\"frames\":[" FRAME("", "[[-1,0,0,1],[0,1,0,2],[0,0,1,3],[0,0,0,1]]") "]}", LUMI_ERR_FORMAT,
         "mirrors"},
        {"{" CAMERA "\"frames\":[" FRAME("", "[[2,0,0,1],[0,2,0,2],[0,0,2,3],[0,0,0,1]]") "]}", LUMI_ERR_FORMAT,
         "scales"},
        {"{" CAMERA "\"frames\":[" FRAME("", "[[1,0,0],[0,1,0],[0,0,1]]") "]}", LUMI_ERR_FORMAT, "4 numbers"},
        {"{\"w\":100,\"h\":80,\"fl_x\":0,\"frames\":[" FRAME("", UNIT) "]}", LUMI_ERR_FORMAT, "focal length"},
        {"{" CAMERA "\"frames\":[" FRAME("\"row\":-2,", UNIT) "]}", LUMI_ERR_FORMAT, "'row' is not a whole number"},
        {"{\"w\":100.5,\"h\":80,\"fl_x\":50,\"frames\":[" FRAME("", UNIT) "]}", LUMI_ERR_FORMAT, "whole"},
    };

    (void)state;
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        int code = parse(bad[i].text);
        if (code != bad[i].code || !strstr(error.text, bad[i].says) || strncmp(error.text, "t.json", 6) != 0 ||
            strchr(error.text, '\n'))
            fail_msg("case %zu: %d '%s'", i, code, error.text);
    }
}

static void nested_json_is_refused_before_it_is_parsed(void **state)
{
    char deep[4001];

    (void)state;
    memset(deep, '[', 2000);
    memset(deep + 2000, ']', 2000);
    assert_false(lumi_json_check(deep, 4000));
    static const char good[] = "[[1, {\"a\": [true, null, \"\\u00e9\"]}, -1.5e+3], {}, []]\n";
    assert_true(lumi_json_check(good, strlen(good)));
    assert_false(lumi_json_check("[1,]", 4));
    assert_false(lumi_json_check("{\"a\":1,}", 8));
    assert_false(lumi_json_check("[1] x", 5));
    assert_false(lumi_json_check("// c\n1", 6));
    assert_false(lumi_json_check("01", 2));
    assert_false(lumi_json_check("\"a", 2));
}

static void broken_json_is_located(void **state)
{
    static const char *const cases[][2] = {
        {"{\"frames\":\n [1, NaN, 2]}", "t.json: not well-formed JSON: line 2, column 6: 'NaN'"},
        {"{\"frames\":\n [1, 2", "t.json: not well-formed JSON: it ends too early (line 2)"},
        {"", "t.json: not well-formed JSON: it ends too early (line 1)"},
        {"{\"\xff\": 1}", "t.json: not UTF-8"},
    };

    (void)state;
    for (size_t i = 0; i < G_N_ELEMENTS(cases); i++) {
        assert_int_equal(parse(cases[i][0]), LUMI_ERR_FORMAT);
        assert_string_equal(error.text, cases[i][1]);
    }
}

static bool json_is_good(const char *text)
{
    return lumi_json_check(text, strlen(text));
}

static void half_of_a_surrogate_pair_is_no_text(void **state)
{
    (void)state;
    assert_true(json_is_good("\"\\ud83d\\ude00\""));
    assert_false(json_is_good("\"\\ud83d\""));
    assert_false(json_is_good("\"\\ude00\""));
    assert_false(json_is_good("\"\\ud83dx\""));
    assert_false(json_is_good("\"\\ud83d\\n\""));
    assert_false(json_is_good("\"\\ud83d\\ud83d\""));
    assert_false(json_is_good("\"\\ud83d\\u"));
}

static void transforms_are_written_so_that_reading_gives_the_same_numbers(void **state)
{
    static const char *const texts[] = {
        "{\"camera_model\":\"OPENCV\",\"k1\":0.1,\"k2\":1e-17,\"p1\":0.3333333333333333," CAMERA "\"frames\":["
        "{\"file_path\":\"a \\\"b\\\\.png\",\"row\":1,\"col\":2,\"transform_matrix\":"
        "[[0.36,0.48,-0.8,0.1],[-0.8,0.6,0,0.30000000000000004],[0.48,0.64,0.6,-1e-300],[0,0,0,1]]}]}",
        /* Six digits: no rotation to the last bit, so the source's own numbers are kept. */
        "{" CAMERA
        "\"frames\":[" FRAME("", "[[0.866025,-0.5,0,0.1],[0.5,0.866025,0,0.2],[0,0,1,0.3],[0,0,0,1]]") "," FRAME(
            "\"fl_x\":77.7,", UNIT) "]}"};

    (void)state;
    for (int i = 0; i < 2; i++) {
        g_autofree char *first = NULL, *second = NULL;
        assert_int_equal(parse(texts[i]), LUMI_OK);
        struct lumi_exchange_camera camera = *lumi_exchange_camera(&list, 0);
        double source[12];
        memcpy(source, lumi_exchange_image(&list, 0)->source, sizeof source);
        assert_int_equal(lumi_exchange_format_transforms(&list, &first, &error), LUMI_OK);
        assert_int_equal(parse(first), LUMI_OK);
        assert_memory_equal(&camera, lumi_exchange_camera(&list, 0), sizeof camera);
        for (int k = 0; k < 12; k++)
            assert_true(source[k] == lumi_exchange_image(&list, 0)->source[k]);
        assert_int_equal(lumi_exchange_format_transforms(&list, &second, &error), LUMI_OK);
        assert_string_equal(first, second);
    }
    parse(texts[0]);
    assert_string_equal(lumi_exchange_image(&list, 0)->original, "a \"b\\.png");
}

/* COLMAP */

static const char cameras_txt[] = "# comment\n1 SIMPLE_RADIAL 640 480 500.5 320 240 0.01\n"
                                  "7 OPENCV_FISHEYE 100 80 50 51 49.5 40.25 0.1 0.2 0.3 0.4\r\n";
static const char images_txt[] = "# comment\n1 0.5 0.5 0.5 0.5 1 2 3 7 b/a one.jpg\n"
                                 "10.5 20.5 -1 3.25 4.25 8\n"
                                 "2 0.9238795325112867 0 0 0.3826834323650898 -1 0.1 1e-5 1 b.jpg\n\n";

static int parse_colmap(const char *cameras, size_t cameras_size, const char *images, size_t images_size, bool binary)
{
    g_autoptr(GHashTable) table = g_hash_table_new(NULL, NULL);

    lumi_exchange_finish(&list);
    lumi_exchange_init(&list);
    error = (struct lumi_error){0};
    LUMI_TRY(lumi_exchange_parse_colmap_cameras(cameras, cameras_size, binary, "cameras", table, &list, &error));
    return lumi_exchange_parse_colmap_images(images, images_size, binary, "images", table, &list, &error);
}

static void colmap_poses_are_turned_round(void **state)
{
    (void)state;
    assert_int_equal(parse_colmap(cameras_txt, strlen(cameras_txt), images_txt, strlen(images_txt), false), LUMI_OK);
    assert_int_equal(list.images->len, 2);
    const struct lumi_exchange_image *image = lumi_exchange_image(&list, 0);
    assert_string_equal(image->original, "b/a one.jpg");
    /* q = (½,½,½,½) turns x to y, y to z, z to x; camera = R world + t. */
    struct lumi_vec3 seen = lumi_to_camera(&image->pose, lumi_vec3(10, 20, 30));
    assert_true(fabs(seen.x - 31) < 1e-12 && fabs(seen.y - 12) < 1e-12 && fabs(seen.z - 23) < 1e-12);
    struct lumi_lens lens;
    assert_int_equal(lumi_exchange_lens(lumi_exchange_camera(&list, image->camera), "x", &lens, &error), LUMI_OK);
    assert_true(lens.model == LUMI_LENS_FISHEYE && lens.k4 == 0.4 && lens.fy == 51);
    assert_int_equal(
        lumi_exchange_lens(lumi_exchange_camera(&list, lumi_exchange_image(&list, 1)->camera), "x", &lens, &error),
        LUMI_OK);
    assert_true(lens.fx == 500.5 && lens.fy == 500.5 && lens.cx == 320 && lens.k1 == 0.01);
}

static void colmap_models_come_back_bit_for_bit(void **state)
{
    GByteArray *cameras[3] = {g_byte_array_new(), g_byte_array_new(), g_byte_array_new()};
    GByteArray *images[3] = {g_byte_array_new(), g_byte_array_new(), g_byte_array_new()};

    (void)state;
    assert_int_equal(parse_colmap(cameras_txt, strlen(cameras_txt), images_txt, strlen(images_txt), false), LUMI_OK);
    for (int i = 0; i < 3; i++) { /* binary, text, binary */
        bool binary = i != 1;
        lumi_exchange_format_colmap_cameras(&list, binary, cameras[i]);
        lumi_exchange_format_colmap_images(&list, binary, images[i]);
        int code = parse_colmap((const char *)cameras[i]->data, cameras[i]->len, (const char *)images[i]->data,
                                images[i]->len, binary);
        if (code != LUMI_OK)
            fail_msg("%s", error.text);
    }
    assert_int_equal(cameras[0]->len, cameras[2]->len);
    assert_memory_equal(cameras[0]->data, cameras[2]->data, cameras[0]->len);
    assert_int_equal(images[0]->len, images[2]->len);
    assert_memory_equal(images[0]->data, images[2]->data, images[0]->len);
    for (int i = 0; i < 3; i++) {
        g_byte_array_unref(cameras[i]);
        g_byte_array_unref(images[i]);
    }
}

static void bad_colmap_models_are_refused_with_one_line(void **state)
{
    static const struct {
        const char *cameras, *images;
        int code;
        const char *says;
    } bad[] = {
        {"", "", LUMI_ERR_FORMAT, "no camera"},
        {"1 FOV 640 480 1 2 3 4 5\n", "", LUMI_ERR_UNSUPPORTED, "FOV"},
        {"1 PINHOLE 640 480 1 2 3\n", "", LUMI_ERR_FORMAT, "4 parameters"},
        {"1 PINHOLE 640 480 1 2 3 nan\n", "", LUMI_ERR_FORMAT, "make no sense"},
        {"1 PINHOLE 0 480 1 2 3 4\n", "", LUMI_ERR_FORMAT, "0x480"},
        {"1 PINHOLE 9 9 9 9 4 4\n1 PINHOLE 9 9 9 9 4 4\n", "", LUMI_ERR_FORMAT, "twice"},
        {"1 PINHOLE 9 9 9 9 4 4\n", "1 1 0 0 0 0 0 0 2 a.jpg\n\n", LUMI_ERR_FORMAT, "no camera 2"},
        {"1 PINHOLE 9 9 9 9 4 4\n", "1 0 0 0 0 0 0 0 1 a.jpg\n\n", LUMI_ERR_FORMAT, "singular"},
        {"1 PINHOLE 9 9 9 9 4 4\n", "1 1 0 0 0 0 inf 0 1 a.jpg\n\n", LUMI_ERR_FORMAT, "not finite"},
        {"1 PINHOLE 9 9 9 9 4 4\n", "1 1 0 0 0 0 0 1 a.jpg\n\n", LUMI_ERR_FORMAT, "no image"},
        {"1 PINHOLE 9 9 9 9 4 4\n", "1 1 0 0 0 0 0 0 1\n\n", LUMI_ERR_FORMAT, "without a name"},
        {"1 PINHOLE 9 9 9 9 4 4\n", "1 1 0 0 0 0 0 0 1 a.jpg\n2 1 0 0 0 0 0 0 1 b.jpg\n", LUMI_ERR_FORMAT,
         "image 1 has no line of points"},
        {"1 PINHOLE 9 9 9 9 4 4\n", "1 1 0 0 0 0 0 0 1 a.jpg\n3.5 4.5 -1 7\n", LUMI_ERR_FORMAT,
         "image 1 has no line of points"},
    };

    (void)state;
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        int code = parse_colmap(bad[i].cameras, strlen(bad[i].cameras), bad[i].images, strlen(bad[i].images), false);
        if (code != bad[i].code || !strstr(error.text, bad[i].says) || strchr(error.text, '\n'))
            fail_msg("case %zu: %d '%s'", i, code, error.text);
    }
}

static void truncated_binary_models_are_refused(void **state)
{
    g_autoptr(GByteArray) cameras = g_byte_array_new();
    g_autoptr(GByteArray) images = g_byte_array_new();

    (void)state;
    assert_int_equal(parse_colmap(cameras_txt, strlen(cameras_txt), images_txt, strlen(images_txt), false), LUMI_OK);
    lumi_exchange_format_colmap_cameras(&list, true, cameras);
    lumi_exchange_format_colmap_images(&list, true, images);
    for (guint size = 0; size < cameras->len; size++)
        assert_int_equal(parse_colmap((const char *)cameras->data, size, (const char *)images->data, images->len, true),
                         LUMI_ERR_FORMAT);
    for (guint size = 0; size < images->len; size++)
        assert_int_equal(
            parse_colmap((const char *)cameras->data, cameras->len, (const char *)images->data, size, true),
            LUMI_ERR_FORMAT);
}

/* Stanford */

static void stanford_names_tell_row_column_and_place(void **state)
{
    static const char *const bad[] = {"out_00_00_1_2",
                                      "out_00_00_1.png",
                                      "00_00_1_2.png",
                                      "out_a_00_1_2.png",
                                      "out_00_-1_1_2.png",
                                      "out_00_00_nan_1.png",
                                      ".png",
                                      "out_00_00__1.png",
                                      "out_0000001_0_1_1.png",
                                      "out_00_00_1e999_1.png",
                                      "",
                                      "_"};
    struct lumi_exchange_stanford place;

    (void)state;
    assert_true(lumi_exchange_parse_stanford("out_03_16_-381.909271_1103.376221_.png", &place));
    assert_true(place.row == 3 && place.column == 16 && place.y == -381.909271 && place.x == 1103.376221);
    assert_true(lumi_exchange_parse_stanford("my_out_03_16_-3.5_1.25.jpg", &place));
    assert_true(place.row == 3 && place.column == 16 && place.y == -3.5 && place.x == 1.25);
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        if (lumi_exchange_parse_stanford(bad[i], &place))
            fail_msg("'%s' was read", bad[i]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nerfstudio_cameras_look_backwards),
        cmocka_unit_test(lens_models_of_transforms_become_ours),
        cmocka_unit_test(a_frame_may_have_a_camera_of_its_own),
        cmocka_unit_test(bad_transforms_are_refused_with_one_line),
        cmocka_unit_test(nested_json_is_refused_before_it_is_parsed),
        cmocka_unit_test(broken_json_is_located),
        cmocka_unit_test(half_of_a_surrogate_pair_is_no_text),
        cmocka_unit_test(transforms_are_written_so_that_reading_gives_the_same_numbers),
        cmocka_unit_test(colmap_poses_are_turned_round),
        cmocka_unit_test(colmap_models_come_back_bit_for_bit),
        cmocka_unit_test(bad_colmap_models_are_refused_with_one_line),
        cmocka_unit_test(truncated_binary_models_are_refused),
        cmocka_unit_test(stanford_names_tell_row_column_and_place),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
