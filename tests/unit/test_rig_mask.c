/* The rig in its own pictures: found where it is, and not where the world only happens to look alike. */
#include "pipeline/calibrate/mask_find.h"
#include "proto/base/file.h"
#include "proto/base/memory.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

enum { WIDTH = 80, HEIGHT = 64, FRAMES = 16 };

/* A world that goes by: blotches that move to the left, and above row 20 a plain ceiling. */
static float world(int frame, int x, int y)
{
    const double at = x + 11.0 * frame;

    if (y < 20 + 6 * sin(at / 9))
        return 180;
    return (float)(110 + 50 * sin(at / 5) * cos(y / 4.0) + 30 * sin(at / 2.3 + y));
}

/* An arm, brighter and darker as it turns in the light, from the bottom up to the middle. */
static bool arm(int x, int y)
{
    return y > 30 && x > 30 && x < 40;
}

static void pictures(bool with_arm, float *frames[FRAMES])
{
    for (int i = 0; i < FRAMES; i++) {
        frames[i] = lumi_alloc(WIDTH * HEIGHT, sizeof(float));
        for (int p = 0; p < WIDTH * HEIGHT; p++)
            frames[i][p] =
                with_arm && arm(p % WIDTH, p / WIDTH) ? 45 + 4 * (float)sin(i) : world(i, p % WIDTH, p / WIDTH);
    }
}

static int find(bool with_arm, uint8_t *rig)
{
    float *frames[FRAMES];

    pictures(with_arm, frames);
    const int count = lumi_mask_find((const float *const *)frames, FRAMES, WIDTH, HEIGHT, rig);
    for (int i = 0; i < FRAMES; i++)
        lumi_free(frames[i]);
    return count;
}

static void an_arm_that_turns_with_the_camera_is_found_and_the_plain_ceiling_is_not(void **unused)
{
    uint8_t rig[WIDTH * HEIGHT];
    int inside = 0, whole = 0, outside = 0;

    (void)unused;
    assert_true(find(true, rig) > 0);
    for (int p = 0; p < WIDTH * HEIGHT; p++) {
        const int x = p % WIDTH, y = p / WIDTH;
        whole += arm(x, y);
        inside += arm(x, y) && rig[p];
        outside += rig[p] && !(y > 26 && x > 26 && x < 44);
    }
    assert_int_equal(inside, whole);
    assert_int_equal(outside, 0);
}

static void without_an_arm_nothing_is_found(void **unused)
{
    uint8_t rig[WIDTH * HEIGHT];

    (void)unused;
    assert_int_equal(find(false, rig), 0);
}

static void a_file_gives_back_what_was_written_and_is_refused_when_it_is_damaged(void **unused)
{
    uint8_t rig[3 * 2] = {1, 0, 0, 1, 1, 0}, *data;
    struct lumi_mask mask = {5, 11, 8, 4, rig};
    const struct lumi_masks masks = {1, &mask};
    struct lumi_masks back;
    struct lumi_error error = {0};
    char path[] = "/tmp/test_masksXXXXXX";
    size_t size;

    (void)unused;
    close(mkstemp(path));
    assert_int_equal(lumi_masks_write(path, &masks, &error), LUMI_OK);
    assert_int_equal(lumi_masks_read(path, &back, &error), LUMI_OK);
    assert_true(back.count == 1 && back.items[0].camera == 5 && back.items[0].width == 11);
    assert_memory_equal(back.items[0].rig, rig, sizeof rig);
    lumi_masks_finish(&back);
    assert_int_equal(lumi_file_read(path, 1 << 20, &data, &size, &error), LUMI_OK);
    for (size_t i = 0; i < size; i++) {
        data[i] ^= 32;
        assert_true(lumi_masks_decode(data, size, "damaged", &back, &error) < 0);
        data[i] ^= 32;
        assert_true(lumi_masks_decode(data, i, "cut", &back, &error) < 0);
    }
    lumi_free(data);
    unlink(path);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_arm_that_turns_with_the_camera_is_found_and_the_plain_ceiling_is_not),
        cmocka_unit_test(without_an_arm_nothing_is_found),
        cmocka_unit_test(a_file_gives_back_what_was_written_and_is_refused_when_it_is_damaged),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
