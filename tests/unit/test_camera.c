/* Addresses, options, formats and pools of cameras. */
#include "daemon/camera/camera_priv.h"
#include "proto/base/memory.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>
#include <math.h>
#include <string.h>

static int parse(const char *address, enum lumi_camera_backend *backend, const char **what)
{
    struct lumi_error error;

    return camera_address_parse(address, backend, what, &error);
}

static void an_address_names_backend_and_serial(void **state)
{
    enum lumi_camera_backend backend;
    const char *what;

    (void)state;
    assert_int_equal(parse("v4l2:/dev/video0", &backend, &what), 0);
    assert_int_equal(backend, LUMI_CAMERA_V4L2);
    assert_string_equal(what, "/dev/video0");
    assert_int_equal(parse("aravis:00:11:22", &backend, &what), 0);
    assert_int_equal(backend, LUMI_CAMERA_ARAVIS);
    assert_string_equal(what, "00:11:22");
    assert_int_equal(parse("files:/media/card", &backend, &what), 0);
    assert_int_equal(backend, LUMI_CAMERA_FILES);
    assert_int_equal(parse("A1:B2", &backend, &what), 0); /* a serial number may have a colon */
    assert_int_equal(backend, LUMI_CAMERA_BACKENDS);
    assert_string_equal(what, "A1:B2");
}

static void a_malformed_address_is_refused(void **state)
{
    static const char *const wrong[] = {"", "v4l2:", "files:card", "files:", "v4l2:a\nb", "\x7f"};
    enum lumi_camera_backend backend;
    char longer[1000];
    const char *what;

    (void)state;
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++)
        assert_int_equal(parse(wrong[i], &backend, &what), LUMI_ERR_ARG);
    memset(longer, 'a', sizeof longer);
    longer[sizeof longer - 1] = '\0';
    assert_int_equal(parse(longer, &backend, &what), LUMI_ERR_ARG);
}

static void two_cameras_with_one_serial_are_not_opened(void **state)
{
    struct lumi_camera_identity cameras[3] = {{.serial = "A", .address = "/dev/video0"},
                                              {.serial = "B", .address = "/dev/video1"},
                                              {.serial = "A", .address = "/dev/video2"}};
    struct lumi_error error;

    (void)state;
    assert_int_equal(camera_pick(cameras, 3, "B", &error), 1);
    assert_int_equal(camera_pick(cameras, 3, "A", &error), LUMI_ERR_EXISTS);
    assert_non_null(strstr(error.text, "/dev/video2"));
    assert_int_equal(camera_pick(cameras, 3, "/dev/video2", &error), 2);
    assert_int_equal(camera_pick(cameras, 3, "C", &error), LUMI_ERR_NOTFOUND);
}

static void a_camera_that_is_not_there_is_not_found(void **state)
{
    struct lumi_camera *camera;
    struct lumi_error error;

    (void)state;
    assert_int_equal(lumi_camera_open("no such camera", &camera, &error), LUMI_ERR_NOTFOUND);
    assert_null(camera);
    lumi_camera_close(NULL);
}

static void a_backend_that_is_missing_says_why(void **state)
{
    struct lumi_error error;

    (void)state;
    for (int i = 0; i < LUMI_CAMERA_BACKENDS; i++) {
        const char *missing = lumi_camera_backend_missing((enum lumi_camera_backend)i);
        char address[64] = "";

        strcat(strcat(address, lumi_camera_backend_name((enum lumi_camera_backend)i)), ":/x");
        assert_int_equal(lumi_camera_address_check(address, &error), missing ? LUMI_ERR_UNSUPPORTED : 0);
        if (missing)
            assert_non_null(strstr(error.text, missing));
    }
    assert_non_null(lumi_camera_backend_missing((enum lumi_camera_backend)LUMI_CAMERA_BACKENDS));
}

static void options_are_read_one_by_one(void **state)
{
    const char *text = "  GainAuto=Off PacketSize=8000 ";
    struct camera_option option;
    struct lumi_error error;

    (void)state;
    assert_int_equal(camera_option_next(&text, &option, &error), 1);
    assert_string_equal(option.name, "GainAuto");
    assert_string_equal(option.value, "Off");
    assert_int_equal(camera_option_next(&text, &option, &error), 1);
    assert_string_equal(option.name, "PacketSize");
    assert_string_equal(option.value, "8000");
    assert_int_equal(camera_option_next(&text, &option, &error), 0);
    for (int i = 0; i < 3; i++) {
        static const char *const wrong[] = {"GainAuto", "=Off", "GainAuto="};

        text = wrong[i];
        assert_int_equal(camera_option_next(&text, &option, &error), LUMI_ERR_ARG);
    }
}

static void a_format_says_how_many_bytes_a_frame_has(void **state)
{
    struct lumi_frame_format format = {.layout = LUMI_LAYOUT_NV12, .width = 5, .height = 3, .stride = 8};

    (void)state;
    assert_int_equal(lumi_frame_bytes(&format), 8 * (3 + 2));
    format.layout = LUMI_LAYOUT_BAYER;
    assert_int_equal(lumi_frame_bytes(&format), 24);
    format.layout = LUMI_LAYOUT_JPEG;
    assert_int_equal(lumi_frame_bytes(&format), 0);
}

static void a_pool_that_is_empty_gives_nothing_until_a_frame_is_back(void **state)
{
    struct camera_pool *pool;
    struct lumi_camera_frame *a, *b;
    struct lumi_error error;

    (void)state;
    assert_int_equal(camera_pool_create(2, &pool, &error), 0);
    a = camera_pool_take(pool, 100);
    b = camera_pool_take(pool, 200);
    assert_null(camera_pool_take(pool, 1));
    assert_true(isnan(a->temperature));
    assert_int_equal(a->device_ns, LUMI_CAMERA_NO_TIME);
    lumi_camera_frame_ref(a);
    lumi_camera_frame_release(a);
    assert_null(camera_pool_take(pool, 1));
    lumi_camera_frame_release(a);
    a = camera_pool_take(pool, 1000);
    assert_non_null(a);
    assert_int_equal(a->size, 1000);
    memset(camera_pool_bytes(a), 7, 1000);
    lumi_alloc_fail_after(0);
    lumi_camera_frame_release(b);
    assert_null(camera_pool_take(pool, 100000)); /* no memory: as if it was empty */
    lumi_alloc_fail_after(-1);
    camera_pool_drop(pool);
    assert_int_equal(a->data[999], 7);
    lumi_camera_frame_release(a);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_address_names_backend_and_serial),
        cmocka_unit_test(a_malformed_address_is_refused),
        cmocka_unit_test(two_cameras_with_one_serial_are_not_opened),
        cmocka_unit_test(a_camera_that_is_not_there_is_not_found),
        cmocka_unit_test(a_backend_that_is_missing_says_why),
        cmocka_unit_test(options_are_read_one_by_one),
        cmocka_unit_test(a_format_says_how_many_bytes_a_frame_has),
        cmocka_unit_test(a_pool_that_is_empty_gives_nothing_until_a_frame_is_back),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
