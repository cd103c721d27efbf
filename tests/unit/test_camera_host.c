/* The thread around a camera, with a camera that the test pulls out and plugs in again. */
#include "tests/unit/fake_camera.h"

#include "daemon/camera/camera_priv.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>
#include <pthread.h>
#include <string.h>

struct world {
    struct fake_camera *fake;
    struct lumi_camera_host *host;
    pthread_mutex_t lock;
    pthread_cond_t woken;
    unsigned wakes;
};

static void on_wake(void *context)
{
    struct world *world = context;

    pthread_mutex_lock(&world->lock);
    world->wakes++;
    pthread_cond_signal(&world->woken);
    pthread_mutex_unlock(&world->lock);
}

static void start_kind(struct world *world, bool there, int frames_max, bool keeps)
{
    struct lumi_camera_host_options options;
    struct lumi_error error;

    memset(world, 0, sizeof *world);
    pthread_mutex_init(&world->lock, NULL);
    pthread_cond_init(&world->woken, NULL);
    world->fake = fake_camera_new("F1");
    fake_camera_plug(world->fake, there);
    if (keeps)
        fake_camera_keeps(world->fake);
    lumi_camera_host_options_init(&options);
    if (frames_max)
        options.frames_max = frames_max;
    options.retry_ms = 2;
    options.wake = on_wake;
    options.context = world;
    assert_int_equal(lumi_camera_host_start_with(fake_camera_open, world->fake, &options, &world->host, &error), 0);
}

static void start(struct world *world, bool there, int frames_max)
{
    start_kind(world, there, frames_max, false);
}

static void stop(struct world *world)
{
    lumi_camera_host_stop(world->host);
    fake_camera_delete(world->fake);
    pthread_cond_destroy(&world->woken);
    pthread_mutex_destroy(&world->lock);
}

/* The next notice of this kind; those of other kinds are dropped on the way. */
static struct lumi_camera_notice next(struct world *world, enum lumi_camera_notice_kind kind)
{
    struct lumi_camera_notice notice;

    for (;;) {
        unsigned wakes;

        pthread_mutex_lock(&world->lock);
        wakes = world->wakes;
        pthread_mutex_unlock(&world->lock);
        while (lumi_camera_host_notice(world->host, &notice)) {
            if (notice.kind == kind)
                return notice;
            lumi_camera_frame_release(notice.kind == LUMI_CAMERA_FRAME ? notice.frame : NULL);
        }
        pthread_mutex_lock(&world->lock);
        while (world->wakes == wakes)
            pthread_cond_wait(&world->woken, &world->lock);
        pthread_mutex_unlock(&world->lock);
    }
}

static void command(struct world *world, uint32_t number, enum lumi_camera_command_kind kind, int width,
                    double exposure_s)
{
    struct lumi_camera_command asked = {.kind = kind, .exposure_s = exposure_s, .gain = 1};

    lumi_camera_setting_init(&asked.setting);
    asked.setting.width = width;
    assert_int_equal(lumi_camera_host_command(world->host, number, &asked), 0);
}

static void done(struct world *world, uint32_t number, int code)
{
    const struct lumi_camera_notice notice = next(world, LUMI_CAMERA_DONE);

    assert_int_equal(notice.command, number);
    assert_int_equal(notice.code, code);
    assert_int_equal(notice.text[0] != '\0', code != LUMI_OK);
}

static void commands_are_done_in_their_order_and_frames_come(void **state)
{
    struct world world;
    char story[64];

    (void)state;
    start(&world, true, 0);
    assert_string_equal(next(&world, LUMI_CAMERA_CAME).identity.serial, "F1");
    command(&world, 7, LUMI_CAMERA_CONFIGURE, 640, 0);
    command(&world, 8, LUMI_CAMERA_ARM, 0, 0);
    command(&world, 9, LUMI_CAMERA_EXPOSE, 0, 0.25);
    command(&world, 10, LUMI_CAMERA_TRIGGER, 0, 0);
    for (uint32_t number = 7; number <= 10; number++)
        done(&world, number, LUMI_OK);
    fake_camera_make_frames(world.fake, 2);
    for (uint64_t i = 0; i < 3; i++) {
        struct lumi_camera_notice notice = next(&world, LUMI_CAMERA_FRAME);

        assert_int_equal(notice.frame->sequence, i);
        assert_int_equal(notice.frame->data[5], i);
        lumi_camera_frame_release(notice.frame);
    }
    fake_camera_story(world.fake, story, sizeof story);
    assert_string_equal(story, "OCAET");
    assert_int_equal(fake_camera_setting(world.fake).width, 640);
    stop(&world);
}

static void a_camera_that_comes_back_is_set_up_as_it_was(void **state)
{
    struct world world;
    struct lumi_camera_notice notice;
    char story[64];

    (void)state;
    start(&world, true, 0);
    command(&world, 1, LUMI_CAMERA_CONFIGURE, 800, 0);
    command(&world, 2, LUMI_CAMERA_ARM, 0, 0);
    command(&world, 3, LUMI_CAMERA_EXPOSE, 0, 0.125);
    for (uint32_t number = 1; number <= 3; number++)
        done(&world, number, LUMI_OK);
    for (int round = 0; round < 3; round++) {
        fake_camera_plug(world.fake, false);
        notice = next(&world, LUMI_CAMERA_GONE);
        assert_int_equal(notice.code, LUMI_ERR_IO);
        assert_non_null(strstr(notice.text, "unplugged"));
        fake_camera_plug(world.fake, true);
        next(&world, LUMI_CAMERA_CAME);
        fake_camera_make_frames(world.fake, 1);
        notice = next(&world, LUMI_CAMERA_FRAME);
        assert_int_equal(notice.frame->sequence, round);
        lumi_camera_frame_release(notice.frame);
    }
    assert_true(fake_camera_exposure(world.fake) == 0.125);
    fake_camera_story(world.fake, story, sizeof story);
    assert_string_equal(story, "OCAEXOCEAXOCEAXOCEA");
    stop(&world);
}

static void commands_to_a_camera_that_is_away_wait_or_fail(void **state)
{
    struct world world;

    (void)state;
    start(&world, false, 0);
    assert_int_equal(next(&world, LUMI_CAMERA_GONE).code, LUMI_ERR_NOTFOUND);
    command(&world, 1, LUMI_CAMERA_CONFIGURE, 320, 0);
    command(&world, 2, LUMI_CAMERA_TRIGGER, 0, 0);
    command(&world, 3, LUMI_CAMERA_ARM, 0, 0);
    command(&world, 4, LUMI_CAMERA_EXPOSE, 0, 1);
    done(&world, 2, LUMI_ERR_NOTFOUND);
    done(&world, 4, LUMI_ERR_NOTFOUND);
    fake_camera_plug(world.fake, true);
    next(&world, LUMI_CAMERA_CAME);
    done(&world, 1, LUMI_OK);
    done(&world, 3, LUMI_OK);
    assert_int_equal(fake_camera_setting(world.fake).width, 320);
    stop(&world);
}

static void what_failed_is_not_set_up_again(void **state)
{
    struct world world;

    (void)state;
    start(&world, true, 0);
    command(&world, 1, LUMI_CAMERA_CONFIGURE, 640, 0);
    command(&world, 2, LUMI_CAMERA_CONFIGURE, 20000, 0);
    done(&world, 1, LUMI_OK);
    done(&world, 2, LUMI_ERR_UNSUPPORTED);
    fake_camera_plug(world.fake, false);
    next(&world, LUMI_CAMERA_GONE); /* found by asking for its status: it is not armed */
    fake_camera_plug(world.fake, true);
    next(&world, LUMI_CAMERA_CAME);
    assert_int_equal(fake_camera_setting(world.fake).width, 640);
    stop(&world);
}

static void frames_that_nobody_takes_are_dropped_and_counted(void **state)
{
    struct world world;
    struct lumi_camera_notice notice;
    int taken = 0;
    uint64_t dropped = 0, expected = 0;

    (void)state;
    start(&world, true, 2);
    command(&world, 1, LUMI_CAMERA_CONFIGURE, 0, 0);
    command(&world, 2, LUMI_CAMERA_ARM, 0, 0);
    done(&world, 1, LUMI_OK);
    done(&world, 2, LUMI_OK);
    fake_camera_make_frames(world.fake, 10);
    for (;;) { /* until all ten are taken in: a status tells */
        command(&world, 3, LUMI_CAMERA_EXPOSE, 0, 0);
        pthread_mutex_lock(&world.lock);
        while (world.wakes < 8)
            pthread_cond_wait(&world.woken, &world.lock);
        world.wakes = 7;
        pthread_mutex_unlock(&world.lock);
        while (lumi_camera_host_notice(world.host, &notice)) {
            if (notice.kind == LUMI_CAMERA_FRAME) {
                taken++;
                assert_int_equal(notice.frame->sequence, expected + notice.frame->gap);
                expected = notice.frame->sequence + 1;
                lumi_camera_frame_release(notice.frame);
            } else if (notice.kind == LUMI_CAMERA_STATUS) {
                dropped = notice.status.dropped;
                if (notice.status.frames == 10 && taken + (int)dropped == 10)
                    goto all;
            }
        }
    }
all:
    assert_true(taken >= 2);
    stop(&world);
}

static void what_a_camera_keeps_waits_until_somebody_takes_it(void **state)
{
    struct lumi_camera_notice notice;
    struct world world;

    (void)state;
    start_kind(&world, true, 2, true);
    command(&world, 1, LUMI_CAMERA_CONFIGURE, 0, 0);
    command(&world, 2, LUMI_CAMERA_ARM, 0, 0);
    done(&world, 1, LUMI_OK);
    done(&world, 2, LUMI_OK);
    fake_camera_make_frames(world.fake, 10);
    for (uint64_t i = 0; i < 10; i++) {
        notice = next(&world, LUMI_CAMERA_FRAME);
        assert_int_equal(notice.frame->sequence, i);
        assert_int_equal(notice.frame->gap, 0);
        lumi_camera_frame_release(notice.frame);
    }
    stop(&world);
}

static void an_error_of_a_frame_is_told_and_the_camera_goes_on(void **state)
{
    struct world world;
    struct lumi_camera_notice notice;

    (void)state;
    start(&world, true, 0);
    command(&world, 1, LUMI_CAMERA_CONFIGURE, 0, 0);
    command(&world, 2, LUMI_CAMERA_ARM, 0, 0);
    done(&world, 1, LUMI_OK);
    done(&world, 2, LUMI_OK);
    fake_camera_fail(world.fake, LUMI_ERR_FORMAT);
    do
        notice = next(&world, LUMI_CAMERA_STATUS);
    while (notice.code == LUMI_OK);
    assert_int_equal(notice.code, LUMI_ERR_FORMAT);
    assert_non_null(strstr(notice.text, "as it was told"));
    fake_camera_make_frames(world.fake, 1);
    lumi_camera_frame_release(next(&world, LUMI_CAMERA_FRAME).frame);
    stop(&world);
}

static void frames_outlive_the_camera_and_its_thread(void **state)
{
    struct world world;
    struct lumi_camera_frame *frame;

    (void)state;
    start(&world, true, 0);
    command(&world, 1, LUMI_CAMERA_CONFIGURE, 0, 0);
    command(&world, 2, LUMI_CAMERA_ARM, 0, 0);
    fake_camera_make_frames(world.fake, 1);
    frame = next(&world, LUMI_CAMERA_FRAME).frame;
    lumi_camera_frame_ref(frame);
    stop(&world);
    assert_int_equal(frame->data[15], 0);
    lumi_camera_frame_release(frame);
    assert_int_equal(frame->data[0], 0);
    lumi_camera_frame_release(frame);
}

static void stopping_does_not_wait_for_a_camera_that_is_away(void **state)
{
    struct world world;

    (void)state;
    start(&world, false, 0);
    command(&world, 1, LUMI_CAMERA_CONFIGURE, 0, 0);
    stop(&world);
    lumi_camera_host_stop(NULL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(commands_are_done_in_their_order_and_frames_come),
        cmocka_unit_test(a_camera_that_comes_back_is_set_up_as_it_was),
        cmocka_unit_test(commands_to_a_camera_that_is_away_wait_or_fail),
        cmocka_unit_test(what_failed_is_not_set_up_again),
        cmocka_unit_test(frames_that_nobody_takes_are_dropped_and_counted),
        cmocka_unit_test(what_a_camera_keeps_waits_until_somebody_takes_it),
        cmocka_unit_test(an_error_of_a_frame_is_told_and_the_camera_goes_on),
        cmocka_unit_test(frames_outlive_the_camera_and_its_thread),
        cmocka_unit_test(stopping_does_not_wait_for_a_camera_that_is_away),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
