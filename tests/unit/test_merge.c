/* pipeline/hdr: brackets as one picture, against the light they were taken of. */
#include "pipeline/hdr/merge.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

enum { WIDTH = 160, HEIGHT = 120 };

static double hash(unsigned a)
{
    a = (a ^ 61) ^ (a >> 16);
    a *= 9;
    a ^= a >> 4;
    a *= 0x27d4eb2d;
    a ^= a >> 15;
    return (double)a / 4294967296.0;
}

/* Light between 0.002 and 12: soft waves, edges, a lamp. */
static void light_at(double x, double y, double light[3])
{
    double wave = 0.5 + 0.25 * sin(x / 7.3 + 0.4 * sin(y / 11)) + 0.25 * sin(y / 5.1 + x / 29);
    double base = 0.012 * exp2(6 * wave) * (1.05 + 0.25 * tanh(4 * sin(x * 0.157)));
    double away = sqrt((x - 120) * (x - 120) + (y - 30) * (y - 30));

    base += (1.5 + wave) / (1 + exp(away - 14));
    light[0] = base;
    light[1] = 0.8 * base + 0.001;
    light[2] = 0.6 * base + 0.002;
}

struct taking {
    double stops, shift_x, shift_y;
    int ball;         /* centre of something black that moves, −1: none */
    double electrons; /* noise; 0: none */
};

/* A shot with 8-bit sRGB codes. */
static struct lumi_shot take(const struct taking *t, unsigned seed)
{
    struct lumi_shot shot = {.exposure = exp2(t->stops), .quantum = 1.0f / 255};

    assert_int_equal(lumi_raster_create(&shot.light, WIDTH, HEIGHT, 3, LUMI_F32), LUMI_OK);
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            double light[3];
            light_at(x + 0.5 - t->shift_x, y + 0.5 - t->shift_y, light);
            for (int c = 0; c < 3; c++) {
                double v = light[c] * exp2(t->stops);
                if (t->ball >= 0 && (x - t->ball) * (x - t->ball) + (y - 80) * (y - 80) < 150)
                    v = 0.02 * exp2(t->stops);
                if (t->electrons > 0) {
                    unsigned at = seed * 1000003u + (unsigned)((y * WIDTH + x) * 3 + c);
                    double n = sqrt(-2 * log(hash(at) + 1e-12)) * cos(6.2831853 * hash(at + 77777777u));
                    v += sqrt(fmin(v, 1) / t->electrons) * n;
                }
                float code = floorf(lumi_srgb_encode((float)fmin(fmax(v, 0), 1)) * 255 + 0.5f);
                lumi_row_f32(&shot.light, y)[3 * x + c] = lumi_srgb_decode(code / 255);
            }
        }
    return shot;
}

/* Median and 99th percentile of |ln(merged / light)| of the green, inside. */
static void compare(const struct lumi_raster *merged, double *middle, double *most)
{
    enum { COUNT = (WIDTH - 16) * (HEIGHT - 16), BINS = 4000 };
    int bins[BINS + 1] = {0}, sum = 0;

    *middle = *most = -1;
    for (int y = 8; y < HEIGHT - 8; y++)
        for (int x = 8; x < WIDTH - 8; x++) {
            double light[3];
            light_at(x + 0.5, y + 0.5, light);
            double away = fabs(log((double)lumi_row_f32(merged, y)[3 * x + 1] / light[1]));
            bins[away < 4 ? (int)(away * 1000) : BINS]++;
        }
    for (int i = 0; i <= BINS; i++) {
        sum += bins[i];
        if (*middle < 0 && 2 * sum >= COUNT)
            *middle = i / 1000.0;
        if (*most < 0 && 100 * sum >= 99 * COUNT)
            *most = i / 1000.0;
    }
}

static struct lumi_raster merge(const struct taking *takings, int count, const struct lumi_merge_options *options,
                                struct lumi_merge_report *report)
{
    struct lumi_shot shots[LUMI_SHOTS_MAX];
    struct lumi_raster merged;
    struct lumi_error error = {0};

    for (int i = 0; i < count; i++)
        shots[i] = take(&takings[i], (unsigned)i + 1);
    assert_int_equal(lumi_merge(shots, count, options, &merged, report, &error), LUMI_OK);
    for (int i = 0; i < count; i++)
        lumi_raster_finish(&shots[i].light);
    return merged;
}

static void three_shots_give_back_the_light_from_shadows_to_a_lamp(void **state)
{
    const struct taking takings[] = {{-4, 0, 0, -1, 8000}, {0, 0, 0, -1, 8000}, {3, 0, 0, -1, 8000}};
    struct lumi_merge_options options;
    struct lumi_merge_report report;
    double middle, most;

    (void)state;
    lumi_merge_options_init(&options);
    options.nominal = 1;
    struct lumi_raster merged = merge(takings, 3, &options, &report);
    compare(&merged, &middle, &most);
    assert_true(middle < 0.02);
    assert_true(most < 0.1);
    assert_true(report.clipped == 0);
    for (int k = 0; k < 3; k++) {
        assert_int_equal(report.shots[k].fate, LUMI_SHOT_USED);
        assert_true(report.shots[k].ghosts < 0.005);
        assert_true(fabs(report.shots[k].shift.x) < 0.05 && fabs(report.shots[k].shift.y) < 0.05);
    }
    lumi_raster_finish(&merged);
    /* One shot alone knows neither. */
    merged = merge(takings + 1, 1, &options, &report);
    compare(&merged, &middle, &most);
    assert_true(most > 0.3 && report.clipped > 0.01);
    lumi_raster_finish(&merged);
}

static void merging_is_less_noisy_than_the_best_shot(void **state)
{
    const struct taking takings[] = {{-1, 0, 0, -1, 400}, {0, 0, 0, -1, 400}, {1, 0, 0, -1, 400}};
    struct lumi_merge_options options;
    struct lumi_merge_report report;
    double one, three, most;

    (void)state;
    lumi_merge_options_init(&options);
    options.full_well = 400;
    options.nominal = 1;
    struct lumi_raster merged = merge(takings, 3, &options, &report);
    compare(&merged, &three, &most);
    lumi_raster_finish(&merged);
    merged = merge(takings + 2, 1, &options, &report);
    compare(&merged, &one, &most);
    assert_true(three < one);
    lumi_raster_finish(&merged);
}

/* What the merged picture shows around a place, by its light. */
static double ratio_at(const struct lumi_raster *merged, int cx, int cy)
{
    double sum = 0, truth = 0;

    for (int y = cy - 4; y <= cy + 4; y++)
        for (int x = cx - 4; x <= cx + 4; x++) {
            double light[3];
            light_at(x + 0.5, y + 0.5, light);
            sum += (double)lumi_row_f32(merged, y)[3 * x + 1];
            truth += light[1];
        }
    return sum / truth;
}

static void what_moved_is_shown_where_the_reference_saw_it_and_nowhere_else(void **state)
{
    const struct taking takings[] = {{-2, 0, 0, 40, 8000}, {0, 0, 0, 75, 8000}, {2, 0, 0, 110, 8000}};
    struct lumi_merge_options options;
    struct lumi_merge_report report;

    (void)state;
    lumi_merge_options_init(&options);
    options.nominal = 1;
    struct lumi_raster merged = merge(takings, 3, &options, &report);
    assert_int_equal(report.reference, 1);
    assert_true(fabs(ratio_at(&merged, 40, 80) - 1) < 0.03);
    assert_true(fabs(ratio_at(&merged, 110, 80) - 1) < 0.03);
    assert_true(fabs((double)lumi_row_f32(&merged, 80)[3 * 75 + 1] - 0.02) < 0.002);
    assert_true(report.shots[0].ghosts > 0.01 && report.shots[0].ghosts < 0.25);
    lumi_raster_finish(&merged);
    /* Without looking for it, there are ghosts. */
    options.ghosts = false;
    merged = merge(takings, 3, &options, &report);
    assert_true(fabs(ratio_at(&merged, 110, 80) - 1) > 0.1);
    lumi_raster_finish(&merged);
}

static void shots_taken_aside_are_put_back(void **state)
{
    const struct taking takings[] = {{-2, 2.3, -1.4, -1, 8000}, {0, 0, 0, -1, 8000}, {2, -4, 3.5, -1, 8000}};
    struct lumi_merge_options options;
    struct lumi_merge_report report;
    double middle, most, middle_before, most_before;

    (void)state;
    lumi_merge_options_init(&options);
    options.nominal = 1;
    struct lumi_raster merged = merge(takings, 3, &options, &report);
    compare(&merged, &middle, &most);
    for (int k = 0; k < 3; k++) {
        assert_true(fabs(report.shots[k].shift.x - takings[k].shift_x) < 0.1);
        assert_true(fabs(report.shots[k].shift.y - takings[k].shift_y) < 0.1);
    }
    lumi_raster_finish(&merged);
    options.align = options.ghosts = false;
    merged = merge(takings, 3, &options, &report);
    compare(&merged, &middle_before, &most_before);
    assert_true(most < 0.12 && most < most_before / 3);
    lumi_raster_finish(&merged);
}

static void a_black_and_a_white_shot_are_left_out_and_named(void **state)
{
    struct lumi_merge_options options;
    struct lumi_merge_report report;
    struct lumi_raster merged;
    struct lumi_error error;
    double middle, most;

    (void)state;
    lumi_merge_options_init(&options);
    options.nominal = 1;
    for (int white = 0; white < 2; white++) {
        struct lumi_shot shots[3];
        for (int k = 0; k < 3; k++) {
            const struct taking taking = {2 * (k - 1), 0, 0, -1, 8000};
            shots[k] = take(&taking, (unsigned)k + 1);
        }
        for (int y = 0; y < HEIGHT; y++)
            for (int i = 0; i < 3 * WIDTH; i++)
                lumi_row_f32(&shots[white ? 0 : 2].light, y)[i] = (float)white;
        assert_int_equal(lumi_merge(shots, 3, &options, &merged, &report, &error), LUMI_OK);
        assert_int_equal(report.shots[white ? 0 : 2].fate, white ? LUMI_SHOT_WHITE : LUMI_SHOT_BLACK);
        assert_int_equal(report.shots[white ? 2 : 0].fate, LUMI_SHOT_USED);
        compare(&merged, &middle, &most);
        assert_true(middle < 0.03);
        lumi_raster_finish(&merged);
        for (int k = 0; k < 3; k++)
            lumi_raster_finish(&shots[k].light);
    }
}

static void exposures_are_taken_as_told_and_measured_where_nothing_is_told(void **state)
{
    struct lumi_merge_options options;
    struct lumi_merge_report report;
    struct lumi_raster merged;
    struct lumi_error error;
    double middle, most;

    (void)state;
    lumi_merge_options_init(&options);
    for (int known = 0; known < 2; known++) {
        struct lumi_shot shots[3];
        for (int k = 0; k < 3; k++) {
            const struct taking taking = {2 * (k - 1), 0, 0, -1, 8000};
            shots[k] = take(&taking, (unsigned)k + 1);
            shots[k].exposure = known ? exp2(2 * (k - 1)) : 0;
        }
        if (known)
            shots[0].exposure *= 2; /* the camera says something else than it did */
        assert_int_equal(lumi_merge(shots, 3, &options, &merged, &report, &error), LUMI_OK);
        assert_int_equal(report.reference, 1);
        assert_true(fabs(log2(report.shots[0].measured) + 2) < 0.03);
        assert_true(fabs(log2(report.shots[2].measured) - 2) < 0.03);
        assert_true(report.shots[0].guessed == !known && report.shots[0].contrary == (bool)known);
        assert_false(report.shots[2].contrary);
        compare(&merged, &middle, &most);
        assert_true(middle < 0.03);
        lumi_raster_finish(&merged);
        for (int k = 0; k < 3; k++)
            lumi_raster_finish(&shots[k].light);
    }
}

static void rounded_exposure_times_leave_no_seams(void **state)
{
    struct lumi_merge_options options;
    struct lumi_merge_report report;
    struct lumi_raster merged;
    struct lumi_error error;
    struct lumi_shot shots[2];
    double middle, most;

    (void)state;
    lumi_merge_options_init(&options);
    options.nominal = 64.0 / 60; /* light 1 is white at 0 stops */
    for (int k = 0; k < 2; k++) {
        const struct taking taking = {3 * k - 2, 0, 0, -1, 8000};
        shots[k] = take(&taking, (unsigned)k + 1);
    }
    shots[1].exposure *= 64.0 / 60; /* a shutter of 1/64 that calls itself 1/60 */
    assert_int_equal(lumi_merge(shots, 2, &options, &merged, &report, &error), LUMI_OK);
    assert_true(fabs(log2(report.shots[1].exposure / report.shots[0].exposure) - 3) < 0.015);
    compare(&merged, &middle, &most);
    assert_true(middle < 0.025 && most < 0.15);
    lumi_raster_finish(&merged);
    for (int k = 0; k < 2; k++)
        lumi_raster_finish(&shots[k].light);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(three_shots_give_back_the_light_from_shadows_to_a_lamp),
        cmocka_unit_test(merging_is_less_noisy_than_the_best_shot),
        cmocka_unit_test(what_moved_is_shown_where_the_reference_saw_it_and_nowhere_else),
        cmocka_unit_test(shots_taken_aside_are_put_back),
        cmocka_unit_test(a_black_and_a_white_shot_are_left_out_and_named),
        cmocka_unit_test(exposures_are_taken_as_told_and_measured_where_nothing_is_told),
        cmocka_unit_test(rounded_exposure_times_leave_no_seams),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
