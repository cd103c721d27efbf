/* Textures: their spectrum, and that they do not alias. */
#include "sim/texture.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>

#include <cmocka.h>

#define SIZE 256

static float *sample(const struct sim_material *m, float pitch, float footprint)
{
    float *values = malloc(sizeof *values * SIZE * SIZE);

    for (int y = 0; y < SIZE; y++)
        for (int x = 0; x < SIZE; x++)
            values[y * SIZE + x] =
                sim_texture(m, v3(((float)x + 0.5f) * pitch, ((float)y + 0.5f) * pitch, 0), footprint).y;
    return values;
}

/* Halves a square by averaging, and returns the variance of what that loses: one octave's power. */
static double lose_octave(float *values, int size)
{
    double sum = 0;

    for (int y = 0; y < size; y += 2)
        for (int x = 0; x < size; x += 2) {
            const float *a = &values[y * size + x], *b = a + size;
            float mean = (a[0] + a[1] + b[0] + b[1]) / 4;
            const float v[4] = {a[0], a[1], b[0], b[1]};
            for (int i = 0; i < 4; i++)
                sum += (double)(v[i] - mean) * (v[i] - mean);
        }
    double variance = sum / (size * size);
    for (int y = 0; y < size / 2; y++)
        for (int x = 0; x < size / 2; x++) {
            const float *a = &values[2 * y * size + 2 * x], *b = a + size;
            values[y * (size / 2) + x] = (a[0] + a[1] + b[0] + b[1]) / 4;
        }
    return variance;
}

/* A spectrum whose power falls with the square of the frequency has the same power in every octave. */
static void noise_of_gain_one_has_the_same_power_in_every_octave(void **state)
{
    struct sim_material m;
    double power[4], mean = 0;

    (void)state;
    sim_material_init(&m);
    m.amplitude = 0.1f;
    m.gain = 1;
    m.wavelength = 0.5f;
    float *values = sample(&m, 0.004f, 0.004f);
    int size = SIZE;
    lose_octave(values, size); /* partly filtered out */
    size /= 2;
    for (int i = 0; i < 4; i++, size /= 2) {
        power[i] = lose_octave(values, size);
        mean += power[i] / 4;
    }
    for (int i = 0; i < 4; i++) {
        assert_true(power[i] > mean / 2);
        assert_true(power[i] < mean * 2);
    }
    free(values);
}

static void noise_has_the_amplitude_asked_for(void **state)
{
    struct sim_material m;
    double sum = 0, squares = 0;

    (void)state;
    sim_material_init(&m);
    m.amplitude = 0.1f;
    m.wavelength = 0.1f;
    for (int solid = 0; solid < 2; solid++) {
        m.solid = solid;
        float *values = sample(&m, 0.008f, 0.0001f);
        sum = squares = 0;
        for (int i = 0; i < SIZE * SIZE; i++) {
            double v = values[i] / 0.5 - 1;
            sum += v;
            squares += v * v;
        }
        sum /= SIZE * SIZE;
        assert_true(fabs(sum) < 0.02);
        double deviation = sqrt(squares / (SIZE * SIZE) - sum * sum);
        assert_true(deviation > 0.08 && deviation < 0.12);
        free(values);
    }
}

/* Against the mean of finer samples over the same pixel. */
static double aliasing(const struct sim_material *m, float pitch)
{
    double error = 0;
    const int fine = 12;

    for (int k = 0; k < 400; k++) {
        float x = (float)(k % 20) * 7.3f * pitch, y = (float)(k / 20) * 5.9f * pitch, sum = 0;
        for (int i = 0; i < fine * fine; i++) {
            struct sim_v3 at = v3(x + (((float)(i % fine) + 0.5f) / (float)fine - 0.5f) * pitch,
                                  y + (((float)(i / fine) + 0.5f) / (float)fine - 0.5f) * pitch, 0);
            sum += sim_texture(m, at, pitch / (float)fine).y;
        }
        double d = sim_texture(m, v3(x, y, 0), pitch).y - sum / (float)(fine * fine);
        error += d * d;
    }
    return sqrt(error / 400);
}

static void every_pattern_is_filtered_to_its_footprint(void **state)
{
    (void)state;
    for (int pattern = SIM_PLAIN; pattern <= SIM_GROUND; pattern++) {
        struct sim_material m;
        sim_material_init(&m);
        m.pattern = (enum sim_pattern)pattern;
        m.color = v3_grey(0.6f);
        m.color2 = v3_grey(0.15f);
        m.color3 = v3_grey(0.35f);
        m.cell[0] = 0.2f;
        m.cell[1] = 0.1f;
        m.amplitude = 0.1f;
        /* A pixel of a fiftieth, a tenth of a cell, and far more than one. Unfiltered, the error would be 0.15 to 0.2.
         */
        assert_true(aliasing(&m, 0.002f) < 0.06);
        assert_true(aliasing(&m, 0.02f) < 0.09);
        assert_true(aliasing(&m, 0.5f) < 0.06);
    }
}

static void textures_are_functions_of_place_and_seed(void **state)
{
    struct sim_material m;

    (void)state;
    sim_material_init(&m);
    m.amplitude = 0.2f;
    struct sim_v3 a = sim_texture(&m, v3(0.31f, 0.77f, 0), 0.001f);
    assert_true(a.x == sim_texture(&m, v3(0.31f, 0.77f, 0), 0.001f).x);
    m.seed = 2;
    assert_true(a.x != sim_texture(&m, v3(0.31f, 0.77f, 0), 0.001f).x);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(noise_of_gain_one_has_the_same_power_in_every_octave),
        cmocka_unit_test(noise_has_the_amplitude_asked_for),
        cmocka_unit_test(every_pattern_is_filtered_to_its_footprint),
        cmocka_unit_test(textures_are_functions_of_place_and_seed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
