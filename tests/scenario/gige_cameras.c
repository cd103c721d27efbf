/* The Aravis backend and simulated GigE Vision cameras, over the real protocol on a loopback network of their own. */
#include "daemon/camera/camera_aravis_priv.h"
#include "daemon/camera/camera_device.h"
#include "proto/base/memory.h"
#include "sim/gige/gige.h"
#include "sim/gige/gige_namespace.h"

#include <math.h>
#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

#define WIDTH 321 /* odd: packed pixels do not end with a byte */
#define HEIGHT 241
#define PATIENCE 20.0 /* s: nothing here takes that long unless it hangs */

/* ---- a place to look at, and cameras in it ---- */

struct world {
    struct sim_gige *gige;
    atomic_int fired;
    _Atomic double exposures[8]; /* s, as they were set */
};

static uint64_t now_ns(void *context)
{
    struct timespec now;

    (void)context;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000000 + (uint64_t)now.tv_nsec;
}

/* Ramps, a colour a direction, shifted by the rig's angle. */
static float light(double angle, int x, int y, int channel)
{
    const float ramps[3] = {(float)x / WIDTH, (float)y / HEIGHT, (float)(x + y) / (WIDTH + HEIGHT)};

    return ramps[channel] * 0.9f + 0.05f * (float)angle;
}

static int picture(void *context, int camera, const struct sim_gige_exposure *exposure, struct lumi_raster *raster,
                   struct lumi_error *error)
{
    (void)context;
    (void)camera;
    (void)error;
    LUMI_TRY(lumi_raster_create(raster, WIDTH, HEIGHT, 3, LUMI_F32));
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < 3 * WIDTH; x++)
            lumi_row_f32(raster, y)[x] = light(exposure->angle, x / 3, y, x % 3);
    return LUMI_OK;
}

static void fire(void *context, int camera)
{
    struct world *world = context;
    const uint64_t now = now_ns(NULL);
    const struct sim_gige_exposure exposure = {.begin_ns = now, .end_ns = now + 4000000};

    atomic_fetch_add(&world->fired, 1);
    sim_gige_expose(world->gige, camera, &exposure);
}

static void exposure_time(void *context, int camera, double seconds)
{
    ((struct world *)context)->exposures[camera] = seconds;
}

/* `serials`: one a camera; they stand at 127.0.0.2 and on. */
static struct world *start(const char *const *serials, int count)
{
    struct world *world = lumi_calloc(1, sizeof *world);
    const struct sim_gige_source source = {world, picture, fire, exposure_time, now_ns};
    struct sim_gige_camera camera;
    struct lumi_error error = {0};

    assert_non_null(world);
    world->gige = sim_gige_create(&source);
    for (int i = 0; i < count; i++) {
        sim_gige_camera_init(&camera);
        snprintf(camera.address, sizeof camera.address, "127.0.0.%d", i + 2);
        snprintf(camera.serial, sizeof camera.serial, "%s", serials[i]);
        camera.width = WIDTH;
        camera.height = HEIGHT;
        camera.clock_offset = 1000;
        camera.clock_ppm = 20;
        if (sim_gige_add(world->gige, &camera, &error) != i)
            fail_msg("%s", error.text);
    }
    if (sim_gige_start(world->gige, 2, &error) != LUMI_OK)
        fail_msg("%s", error.text);
    return world;
}

static void finish(struct world *world)
{
    sim_gige_destroy(world->gige);
    lumi_free(world);
}

static struct lumi_camera *open_camera(const char *address)
{
    struct lumi_camera *camera;
    struct lumi_error error = {0};

    if (lumi_camera_open(address, &camera, &error) != LUMI_OK)
        fail_msg("%s", error.text);
    return camera;
}

static void configure(struct lumi_camera *camera, const struct lumi_camera_setting *setting)
{
    struct lumi_error error = {0};

    if (camera->ops->configure(camera, setting, &error) != LUMI_OK || camera->ops->arm(camera, &error) != LUMI_OK)
        fail_msg("%s", error.text);
}

static struct lumi_camera_setting triggered(void)
{
    struct lumi_camera_setting setting;

    lumi_camera_setting_init(&setting);
    setting.trigger = LUMI_TRIGGER_HARDWARE;
    setting.layout = LUMI_LAYOUT_BAYER;
    setting.bits = 8;
    setting.exposure_s = 0.004;
    setting.gain = 1;
    return setting;
}

static struct sim_gige_exposure edge(double angle)
{
    const uint64_t now = now_ns(NULL);

    return (struct sim_gige_exposure){.line = true, .begin_ns = now, .end_ns = now + 4000000, .angle = angle};
}

/* The next frame, or NULL after so many seconds. */
static struct lumi_camera_frame *wait_frame(struct lumi_camera *camera, double seconds)
{
    const uint64_t end = now_ns(NULL) + (uint64_t)(seconds * 1e9);
    struct lumi_camera_frame *frame = NULL;
    struct lumi_error error = {0};

    while (!frame && now_ns(NULL) < end) {
        struct pollfd fds[LUMI_CAMERA_POLL];
        const int count = camera->ops->poll_fds(camera, fds, LUMI_CAMERA_POLL);
        poll(fds, (nfds_t)count, 50);
        if (camera->ops->frame(camera, &frame, &error) != LUMI_OK)
            return NULL;
    }
    return frame;
}

static struct lumi_camera_frame *need_frame(struct lumi_camera *camera)
{
    struct lumi_camera_frame *frame = wait_frame(camera, PATIENCE);

    assert_non_null(frame);
    return frame;
}

/* ---- tests ---- */

static void a_camera_is_found_by_its_serial_number_and_says_what_it_is(void **state)
{
    struct world *world = start((const char *const[]){"A1", "A2"}, 2);
    struct lumi_camera_identity listed[8];
    struct lumi_error error = {0};
    bool seen = false;

    (void)state;
    int count = lumi_camera_list(listed, 8, &error);
    for (int i = 0; i < count; i++)
        seen |= !strcmp(listed[i].serial, "A2") && !strcmp(listed[i].address, "127.0.0.3");
    assert_true(seen);
    struct lumi_camera *camera = open_camera("aravis:A2");
    assert_string_equal(camera->identity.address, "127.0.0.3");
    assert_string_equal(camera->identity.vendor, "Lumisphere");
    assert_true(camera->identity.hardware_trigger && camera->identity.software_trigger);
    assert_true(camera->identity.action_command && camera->identity.exposure_control);
    assert_true(camera->identity.gain_control && camera->identity.device_clock);
    assert_float_equal(camera->identity.clock_step_ns, 8, 1e-9);
    lumi_camera_close(camera);
    camera = open_camera("aravis:127.0.0.2");
    assert_string_equal(camera->identity.serial, "A1");
    lumi_camera_close(camera);
    assert_int_equal(lumi_camera_open("aravis:A3", &camera, &error), LUMI_ERR_NOTFOUND);
    finish(world);
}

static void two_cameras_with_one_serial_number_are_refused_and_named(void **state)
{
    struct world *world = start((const char *const[]){"TWIN", "TWIN"}, 2);
    struct lumi_camera_identity listed[8];
    struct lumi_camera *camera;
    struct lumi_error error = {0};
    int twins = 0;

    (void)state;
    const int count = lumi_camera_list(listed, 8, &error);
    for (int i = 0; i < count; i++)
        twins += !strcmp(listed[i].serial, "TWIN");
    assert_int_equal(twins, 2);
    assert_int_equal(lumi_camera_open("aravis:TWIN", &camera, &error), LUMI_ERR_EXISTS);
    assert_non_null(strstr(error.text, "127.0.0.2"));
    assert_non_null(strstr(error.text, "127.0.0.3"));
    finish(world);
}

static void a_camera_that_another_program_holds_is_busy(void **state)
{
    struct world *world = start((const char *const[]){"A1"}, 1);
    struct lumi_camera *camera = open_camera("aravis:A1"), *second;
    struct lumi_error error = {0};

    (void)state;
    assert_int_equal(lumi_camera_open("aravis:A1", &second, &error), LUMI_ERR_BUSY);
    lumi_camera_close(camera);
    lumi_camera_close(open_camera("aravis:A1"));
    finish(world);
}

static void a_line_s_edge_gives_a_frame_with_the_time_of_its_exposure(void **state)
{
    struct world *world = start((const char *const[]){"A1"}, 1);
    struct lumi_camera *camera = open_camera("aravis:A1");
    struct lumi_camera_setting setting = triggered();
    double offset = 0;

    (void)state;
    setting.exposure_s = 0.002;
    setting.gain = 2;
    configure(camera, &setting);
    assert_float_equal(world->exposures[0], 0.002, 1e-9);
    for (int i = 1; i <= 5; i++) {
        struct sim_gige_exposure exposure = edge(0);
        exposure.end_ns = exposure.begin_ns + 2000000;
        sim_gige_expose(world->gige, 0, &exposure);
        struct lumi_camera_frame *frame = need_frame(camera);
        assert_int_equal(frame->trigger, i);
        assert_int_equal(frame->sequence, i);
        assert_int_equal(frame->gap, 0);
        assert_false(frame->damaged);
        assert_float_equal(frame->exposure_s, 0.002, 1e-9);
        assert_float_equal(frame->gain, 2, 1e-6);
        /* 8 ns steps; 20 ppm of the seconds this takes. */
        const double apart = (double)frame->device_ns - (double)exposure.begin_ns;
        if (i > 1)
            assert_true(fabs(apart - offset) < 20e-6 * 5e9 + 100);
        offset = apart;
        assert_true(frame->host_ns > (int64_t)exposure.end_ns);
        lumi_camera_frame_release(frame);
    }
    lumi_camera_close(camera);
    finish(world);
}

/* What a format's frame should be at a pixel, 0..1. */
static double expected(enum lumi_frame_layout layout, int x, int y, int channel)
{
    if (layout == LUMI_LAYOUT_BAYER)
        return light(0, x, y, (x & 1) + (y & 1));
    if (layout == LUMI_LAYOUT_GREY)
        return 0.2126 * light(0, x, y, 0) + 0.7152 * light(0, x, y, 1) + 0.0722 * light(0, x, y, 2);
    return lumi_srgb_encode(light(0, x, y, channel));
}

static void check_pixels(const struct lumi_camera_frame *frame)
{
    const struct lumi_frame_format *f = &frame->format;
    const int channels = f->layout == LUMI_LAYOUT_RGB ? 3 : 1;
    const double white = (1 << f->bits) - 1;

    assert_int_equal(frame->size, lumi_frame_bytes(f));
    for (int y = 0; y < f->height; y++)
        for (int i = 0; i < f->width * channels; i++) {
            const uint8_t *row = frame->data + (size_t)y * (size_t)f->stride;
            const double value = f->bits > 8 ? row[2 * i] | row[2 * i + 1] << 8 : row[i];
            const double wanted = expected(f->layout, i / channels, y, i % channels) * white;
            if (fabs(value - wanted) > 0.51)
                fail_msg("pixel %d of row %d: %g, wanted %g", i, y, value, wanted);
        }
}

static void pixels_come_as_they_were_in_every_format(void **state)
{
    static const struct {
        enum lumi_frame_layout layout;
        int bits;
        const char *options;
    } formats[] = {{LUMI_LAYOUT_BAYER, 8, ""},  {LUMI_LAYOUT_BAYER, 10, ""}, {LUMI_LAYOUT_BAYER, 12, ""},
                   {LUMI_LAYOUT_BAYER, 16, ""}, {LUMI_LAYOUT_GREY, 8, ""},   {LUMI_LAYOUT_RGB, 8, ""}};
    struct world *world = start((const char *const[]){"A1"}, 1);
    struct lumi_camera *camera = open_camera("aravis:A1");

    (void)state;
    for (size_t i = 0; i < sizeof formats / sizeof formats[0]; i++) {
        struct lumi_camera_setting setting = triggered();
        const struct sim_gige_exposure exposure = edge(0);
        struct lumi_error error;

        setting.layout = formats[i].layout;
        setting.bits = formats[i].bits;
        configure(camera, &setting);
        sim_gige_expose(world->gige, 0, &exposure);
        struct lumi_camera_frame *frame = need_frame(camera);
        assert_int_equal(frame->format.layout, formats[i].layout);
        assert_int_equal(frame->format.bits, formats[i].bits);
        check_pixels(frame);
        lumi_camera_frame_release(frame);
        assert_int_equal(camera->ops->disarm(camera, &error), LUMI_OK);
    }
    lumi_camera_close(camera);
    finish(world);
}

static void a_jpeg_is_a_whole_file(void **state)
{
    struct world *world = start((const char *const[]){"A1"}, 1);
    struct lumi_camera *camera = open_camera("aravis:A1");
    struct lumi_camera_setting setting = triggered();
    const struct sim_gige_exposure exposure = edge(0);

    (void)state;
    setting.layout = LUMI_LAYOUT_JPEG;
    setting.bits = 0;
    configure(camera, &setting);
    sim_gige_expose(world->gige, 0, &exposure);
    struct lumi_camera_frame *frame = need_frame(camera);
    assert_int_equal(frame->format.layout, LUMI_LAYOUT_JPEG);
    assert_false(frame->damaged);
    assert_true(frame->size > 1000 && frame->data[0] == 0xff && frame->data[1] == 0xd8);
    assert_true(frame->data[frame->size - 2] == 0xff && frame->data[frame->size - 1] == 0xd9);
    assert_float_equal(frame->exposure_s, 0.004, 1e-9);
    lumi_camera_frame_release(frame);
    lumi_camera_close(camera);
    finish(world);
}

static void packets_that_are_lost_are_sent_again_and_counted(void **state)
{
    struct world *world = start((const char *const[]){"A1"}, 1);
    struct lumi_camera *camera = open_camera("aravis:A1");
    struct lumi_camera_setting setting = triggered();
    struct sim_gige_status sent;
    struct lumi_camera_status status;
    struct lumi_error error;
    uint32_t resent = 0;

    (void)state;
    snprintf(setting.options, sizeof setting.options, "PacketSize=1000");
    configure(camera, &setting);
    for (int i = 0; i < 10; i++) {
        struct sim_gige_exposure exposure = edge(0);
        exposure.fault.loss = 0.03;
        sim_gige_expose(world->gige, 0, &exposure);
        struct lumi_camera_frame *frame = need_frame(camera);
        assert_false(frame->damaged);
        check_pixels(frame);
        resent += frame->packets_resent;
        lumi_camera_frame_release(frame);
    }
    sim_gige_status(world->gige, 0, &sent);
    assert_true(sent.lost > 5);
    assert_true(resent >= sent.lost && sent.resent >= sent.lost);
    assert_int_equal(camera->ops->status(camera, &status, &error), LUMI_OK);
    assert_int_equal(status.frames, 10);
    assert_true(status.packets_resent >= sent.lost);
    lumi_camera_close(camera);
    finish(world);
}

static void without_resending_a_frame_with_holes_is_told_as_damaged(void **state)
{
    struct world *world = start((const char *const[]){"A1"}, 1);
    struct lumi_camera *camera = open_camera("aravis:A1");
    struct lumi_camera_setting setting = triggered();
    struct sim_gige_exposure exposure = edge(0);

    (void)state;
    snprintf(setting.options, sizeof setting.options, "PacketSize=1000 PacketResend=Never");
    configure(camera, &setting);
    exposure.fault.loss = 0.2;
    sim_gige_expose(world->gige, 0, &exposure);
    struct lumi_camera_frame *frame = need_frame(camera);
    assert_true(frame->damaged);
    lumi_camera_frame_release(frame);
    exposure = edge(0);
    sim_gige_expose(world->gige, 0, &exposure);
    frame = need_frame(camera);
    assert_false(frame->damaged);
    lumi_camera_frame_release(frame);
    lumi_camera_close(camera);
    finish(world);
}

static void a_dropped_frame_is_a_gap_and_a_doubled_one_comes_twice(void **state)
{
    struct world *world = start((const char *const[]){"A1"}, 1);
    struct lumi_camera *camera = open_camera("aravis:A1");
    const struct lumi_camera_setting setting = triggered();
    uint64_t triggers[4];
    uint32_t gaps[4];

    (void)state;
    configure(camera, &setting);
    for (int i = 0; i < 3; i++) {
        struct sim_gige_exposure exposure = edge(0);
        exposure.begin_ns += (uint64_t)i * 1000;
        exposure.fault.dropped = i == 1;
        exposure.fault.doubled = i == 2;
        sim_gige_expose(world->gige, 0, &exposure);
    }
    for (int i = 0; i < 3; i++) {
        struct lumi_camera_frame *frame = need_frame(camera);
        triggers[i] = frame->trigger;
        gaps[i] = frame->gap;
        lumi_camera_frame_release(frame);
    }
    assert_true(triggers[0] == 1 && triggers[1] == 3 && triggers[2] == 3);
    assert_true(gaps[0] == 0 && gaps[1] == 1 && gaps[2] == 0);
    lumi_camera_close(camera);
    finish(world);
}

static void linger(ArvDevice *device, void *context)
{
    (void)device;
    g_usleep(4000000); /* longer than closing takes */
    atomic_store((atomic_bool *)context, true);
}

static void a_camera_that_is_unplugged_is_gone_and_comes_back(void **state)
{
    struct world *world = start((const char *const[]){"A1"}, 1);
    struct lumi_camera *camera = open_camera("aravis:A1"), *none;
    const struct lumi_camera_setting setting = triggered();
    struct lumi_camera_frame *kept, *frame;
    struct lumi_error error = {0};
    struct sim_gige_exposure exposure = edge(0);
    static atomic_bool told; /* of a thread that is older than this function's frame */

    (void)state;
    configure(camera, &setting);
    sim_gige_expose(world->gige, 0, &exposure);
    kept = need_frame(camera);
    g_signal_connect(arv_camera_get_device(((struct aravis_camera *)camera)->camera), "control-lost",
                     G_CALLBACK(linger), &told);
    sim_gige_unplug(world->gige, 0, true);
    assert_null(wait_frame(camera, PATIENCE));
    assert_int_equal(camera->ops->frame(camera, &frame, &error), LUMI_ERR_IO);
    lumi_camera_close(camera);
    assert_true(atomic_load(&told)); /* nothing of Aravis' is at it any more */
    check_pixels(kept);              /* what was handed out stays */
    lumi_camera_frame_release(kept);
    assert_int_equal(lumi_camera_open("aravis:A1", &none, &error), LUMI_ERR_NOTFOUND);
    sim_gige_unplug(world->gige, 0, false);
    camera = open_camera("aravis:A1");
    configure(camera, &setting);
    exposure = edge(0);
    sim_gige_expose(world->gige, 0, &exposure);
    lumi_camera_frame_release(need_frame(camera));
    lumi_camera_close(camera);
    finish(world);
}

static void software_and_action_commands_fire(void **state)
{
    struct world *world = start((const char *const[]){"A1"}, 1);
    struct lumi_camera *camera = open_camera("aravis:A1");
    struct lumi_camera_setting setting = triggered();
    struct lumi_error error;

    (void)state;
    setting.trigger = LUMI_TRIGGER_SOFTWARE;
    for (int i = 0; i < 2; i++) {
        snprintf(setting.trigger_input, sizeof setting.trigger_input, "%s", i ? "Action1" : "");
        configure(camera, &setting);
        assert_int_equal(camera->ops->trigger(camera, &error), LUMI_OK);
        lumi_camera_frame_release(need_frame(camera));
        assert_int_equal(camera->ops->disarm(camera, &error), LUMI_OK);
    }
    assert_int_equal(atomic_load(&world->fired), 2);
    lumi_camera_close(camera);
    finish(world);
}

static void a_camera_that_runs_free_sends_at_its_rate(void **state)
{
    struct world *world = start((const char *const[]){"A1"}, 1);
    struct lumi_camera *camera = open_camera("aravis:A1");
    struct lumi_camera_setting setting = triggered();
    int64_t first = 0, last = 0;

    (void)state;
    setting.trigger = LUMI_TRIGGER_FREE;
    setting.frame_rate = 20;
    configure(camera, &setting);
    for (int i = 0; i < 5; i++) {
        struct lumi_camera_frame *frame = need_frame(camera);
        first = i == 0 ? frame->device_ns : first;
        last = frame->device_ns;
        lumi_camera_frame_release(frame);
    }
    assert_true(last - first >= 180000000); /* four periods, by the camera's clock; never less */
    lumi_camera_close(camera);
    finish(world);
}

static void exposure_changes_while_it_is_armed(void **state)
{
    struct world *world = start((const char *const[]){"A1"}, 1);
    struct lumi_camera *camera = open_camera("aravis:A1");
    const struct lumi_camera_setting setting = triggered();
    struct lumi_error error;

    (void)state;
    configure(camera, &setting);
    for (int i = 1; i < 4; i++) {
        const double seconds = 0.001 * i;
        struct sim_gige_exposure exposure = edge(0);
        assert_int_equal(camera->ops->expose(camera, seconds, 0, &error), LUMI_OK);
        assert_float_equal(world->exposures[0], seconds, 1e-9);
        exposure.end_ns = exposure.begin_ns + (uint64_t)(world->exposures[0] * 1e9);
        sim_gige_expose(world->gige, 0, &exposure);
        struct lumi_camera_frame *frame = need_frame(camera);
        assert_float_equal(frame->exposure_s, seconds, 1e-8);
        lumi_camera_frame_release(frame);
    }
    lumi_camera_close(camera);
    finish(world);
}

static void what_a_camera_cannot_do_is_refused_with_words(void **state)
{
    static const struct {
        const char *options;
        double exposure;
        int width;
        const char *input;
        int code;
    } wrong[] = {{"NoSuchFeature=1", 0.004, 0, "", LUMI_ERR_ARG},    {"PacketSize=7", 0.004, 0, "", LUMI_ERR_ARG},
                 {"PacketResend=Often", 0.004, 0, "", LUMI_ERR_ARG}, {"", 1000, 0, "", LUMI_ERR_UNSUPPORTED},
                 {"", 0.004, 100000, "", LUMI_ERR_UNSUPPORTED},      {"", 0.004, 0, "Line9", LUMI_ERR_UNSUPPORTED}};
    struct world *world = start((const char *const[]){"A1"}, 1);
    struct lumi_camera *camera = open_camera("aravis:A1");

    (void)state;
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        struct lumi_camera_setting setting = triggered();
        struct lumi_error error = {0};

        snprintf(setting.options, sizeof setting.options, "%s", wrong[i].options);
        snprintf(setting.trigger_input, sizeof setting.trigger_input, "%s", wrong[i].input);
        setting.exposure_s = wrong[i].exposure;
        setting.width = wrong[i].width;
        assert_int_equal(camera->ops->configure(camera, &setting, &error), wrong[i].code);
        assert_true(error.text[0] != '\0');
        assert_true(camera->ops->arm(camera, &error) != LUMI_OK);
    }
    lumi_camera_close(camera);
    finish(world);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_camera_is_found_by_its_serial_number_and_says_what_it_is),
        cmocka_unit_test(two_cameras_with_one_serial_number_are_refused_and_named),
        cmocka_unit_test(a_camera_that_another_program_holds_is_busy),
        cmocka_unit_test(a_line_s_edge_gives_a_frame_with_the_time_of_its_exposure),
        cmocka_unit_test(pixels_come_as_they_were_in_every_format),
        cmocka_unit_test(a_jpeg_is_a_whole_file),
        cmocka_unit_test(packets_that_are_lost_are_sent_again_and_counted),
        cmocka_unit_test(without_resending_a_frame_with_holes_is_told_as_damaged),
        cmocka_unit_test(a_dropped_frame_is_a_gap_and_a_doubled_one_comes_twice),
        cmocka_unit_test(a_camera_that_is_unplugged_is_gone_and_comes_back),
        cmocka_unit_test(software_and_action_commands_fire),
        cmocka_unit_test(a_camera_that_runs_free_sends_at_its_rate),
        cmocka_unit_test(exposure_changes_while_it_is_armed),
        cmocka_unit_test(what_a_camera_cannot_do_is_refused_with_words),
    };
    struct lumi_error error;

    if (sim_gige_own_network(&error) != LUMI_OK) {
        printf("skipped: %s\n", error.text);
        return 77;
    }
    return cmocka_run_group_tests(tests, NULL, NULL);
}
