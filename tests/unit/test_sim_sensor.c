/* The sensor: what it does to a picture, in numbers that follow from statistics. */
#include "sim/sensor.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <string.h>

#include <cmocka.h>

#define SIDE 200
#define COUNT (SIDE * SIDE * 3.0)

static void flat(struct lumi_raster *picture, float value)
{
    assert_int_equal(lumi_raster_create(picture, SIDE, SIDE, 3, LUMI_F32), LUMI_OK);
    for (int y = 0; y < SIDE; y++)
        for (int x = 0; x < 3 * SIDE; x++)
            lumi_row_f32(picture, y)[x] = value;
}

static void statistics(const struct lumi_raster *picture, double *mean, double *variance)
{
    double sum = 0, squares = 0;

    for (int y = 0; y < SIDE; y++)
        for (int x = 0; x < 3 * SIDE; x++) {
            double v = lumi_row_f32(picture, y)[x];
            sum += v;
            squares += v * v;
        }
    *mean = sum / COUNT;
    *variance = squares / COUNT - *mean * *mean;
}

/* Mean within 5 standard errors; variance too, the standard error of which is √(2 + 1/e) of it for a Poisson
 * distribution of mean e. */
static void check_noise(double electrons, double read_noise)
{
    struct lumi_raster picture;
    struct sim_sensor sensor;
    double mean, variance, expected = electrons + read_noise * read_noise, well = 1000;

    sim_sensor_init(&sensor);
    sensor.full_well = well;
    sensor.read_noise = read_noise;
    flat(&picture, (float)(electrons / well));
    sim_sensor_apply(&sensor, 3, &picture);
    statistics(&picture, &mean, &variance);
    assert_true(fabs(mean * well - electrons) < 5 * sqrt(expected / COUNT));
    assert_true(fabs(variance * well * well - expected) < 5 * expected * sqrt((2 + 1 / electrons) / COUNT) + 0.1);
    lumi_raster_finish(&picture);
}

static void noise_has_the_mean_and_variance_of_photons_and_reading(void **state)
{
    (void)state;
    check_noise(250, 5);
    check_noise(250, 0);
    check_noise(4, 0);
    check_noise(40, 2);
}

static void noise_is_the_same_for_one_seed_and_frame_and_differs_otherwise(void **state)
{
    struct lumi_raster a, b, c;
    struct sim_sensor sensor;

    (void)state;
    sim_sensor_init(&sensor);
    sensor.full_well = 5000;
    flat(&a, 0.5f);
    flat(&b, 0.5f);
    flat(&c, 0.5f);
    sim_sensor_apply(&sensor, 1, &a);
    sim_sensor_apply(&sensor, 1, &b);
    sim_sensor_apply(&sensor, 2, &c);
    assert_memory_equal(a.data, b.data, a.stride * SIDE);
    assert_true(memcmp(a.data, c.data, a.stride * SIDE) != 0);
    lumi_raster_finish(&a);
    lumi_raster_finish(&b);
    lumi_raster_finish(&c);
}

static void by_default_nothing_happens(void **state)
{
    struct lumi_raster a, b;
    struct sim_sensor sensor;

    (void)state;
    sim_sensor_init(&sensor);
    flat(&a, 0.123456f);
    flat(&b, 0.123456f);
    sim_sensor_apply(&sensor, 1, &a);
    assert_memory_equal(a.data, b.data, a.stride * SIDE);
    lumi_raster_finish(&a);
    lumi_raster_finish(&b);
}

static void exposure_vignetting_and_the_converter_do_what_they_say(void **state)
{
    struct lumi_raster picture;
    struct sim_sensor sensor;

    (void)state;
    sim_sensor_init(&sensor);
    sensor.exposure = -1;
    sensor.vignetting = 0.4;
    flat(&picture, 0.8f);
    sim_sensor_apply(&sensor, 0, &picture);
    assert_true(fabsf(lumi_row_f32(&picture, SIDE / 2)[3 * (SIDE / 2)] - 0.4f) < 1e-4f);
    assert_true(fabsf(lumi_row_f32(&picture, 0)[0] - 0.4f * 0.6f) < 3e-3f);
    lumi_raster_finish(&picture);
    for (int bits = 8; bits <= 12; bits += 2) {
        double steps = ldexp(1, bits) - 1;
        sim_sensor_init(&sensor);
        sensor.bits = bits;
        flat(&picture, 0.3217f);
        lumi_row_f32(&picture, 0)[0] = 7;
        sim_sensor_apply(&sensor, 0, &picture);
        double value = lumi_row_f32(&picture, 5)[5] * steps;
        assert_true(fabs(value - round(value)) < 1e-3);
        assert_true(fabs(value - 0.3217 * steps) <= 0.501);
        assert_true(lumi_row_f32(&picture, 0)[0] == 1.0f);
        lumi_raster_finish(&picture);
    }
}

static void settings_that_make_no_sense_are_refused(void **state)
{
    struct sim_sensor sensor;

    (void)state;
    sim_sensor_init(&sensor);
    assert_int_equal(sim_sensor_check(&sensor, NULL), LUMI_OK);
    sensor.bits = 9;
    assert_int_equal(sim_sensor_check(&sensor, NULL), LUMI_ERR_ARG);
    sim_sensor_init(&sensor);
    sensor.read_noise = 3;
    assert_int_equal(sim_sensor_check(&sensor, NULL), LUMI_ERR_ARG);
    sim_sensor_init(&sensor);
    sensor.vignetting = NAN;
    assert_int_equal(sim_sensor_check(&sensor, NULL), LUMI_ERR_ARG);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(noise_has_the_mean_and_variance_of_photons_and_reading),
        cmocka_unit_test(noise_is_the_same_for_one_seed_and_frame_and_differs_otherwise),
        cmocka_unit_test(by_default_nothing_happens),
        cmocka_unit_test(exposure_vignetting_and_the_converter_do_what_they_say),
        cmocka_unit_test(settings_that_make_no_sense_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
