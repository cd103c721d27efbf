/* pipeline/color: gains and vignetting from points that pictures share. */
#include "pipeline/color/equalize.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

enum { PICTURES = 24, LENSES = 2, SHARED = 60, POINTS = 2 * (PICTURES - 2) * SHARED };

static unsigned seed = 7;
static double uniform(void)
{
    seed = seed * 1664525 + 1013904223;
    return (double)(seed >> 8) / 16777216;
}

struct world {
    double gain[PICTURES][3], vignetting[LENSES][3];
    char names[PICTURES][8];
    const char *pointers[PICTURES];
    int lenses[PICTURES];
    struct lumi_same_point points[POINTS];
    int count;
};

/* Every picture shares points with the next two; the last one with none. A fifth of the points are wrong. */
static void make_world(struct world *w)
{
    memset(w, 0, sizeof *w);
    for (int k = 0; k < LENSES; k++)
        w->vignetting[k][0] = -0.25 + 0.12 * k;
    w->vignetting[1][1] = -0.1;
    for (int i = 0; i < PICTURES; i++) {
        snprintf(w->names[i], sizeof w->names[i], "v%02d", i);
        w->pointers[i] = w->names[i];
        w->lenses[i] = i % LENSES;
        for (int c = 0; c < 3; c++)
            w->gain[i][c] = exp2(0.6 * (uniform() - 0.5));
    }
    for (int i = 0; i + 2 < PICTURES; i++)
        for (int next = 1; next <= 2 && i + next < PICTURES - 1; next++)
            for (int k = 0; k < SHARED; k++) {
                struct lumi_same_point *p = &w->points[w->count++];
                p->a = i;
                p->b = i + next;
                p->r2_a = (float)uniform();
                p->r2_b = (float)uniform();
                p->sigma = 0.01f;
                const bool wrong = uniform() < 0.2;
                for (int c = 0; c < 3; c++)
                    p->difference[c] = (float)(log(w->gain[p->a][c] / w->gain[p->b][c]) +
                                               lumi_vignetting_log(w->vignetting[w->lenses[p->a]], (double)p->r2_a) -
                                               lumi_vignetting_log(w->vignetting[w->lenses[p->b]], (double)p->r2_b) +
                                               0.02 * (uniform() - 0.5) + (wrong ? 2 * (uniform() - 0.2) : 0));
            }
}

static void gains_and_vignetting_are_found_whatever_a_fifth_of_the_points_say(void **state)
{
    static struct world world;
    struct lumi_equalize_report report = {0};
    struct lumi_gains gains;
    struct lumi_error error;
    int seen[PICTURES];

    (void)state;
    make_world(&world);
    report.points = seen;
    assert_int_equal(lumi_equalize(world.points, world.count, world.pointers, world.lenses, PICTURES, LENSES, &gains,
                                   &report, &error),
                     LUMI_OK);
    for (int c = 0; c < 3; c++) {
        double common = log(lumi_gains_find(&gains, "v00")->gain[c] / world.gain[0][c]), product = 0;
        for (int i = 0; i < PICTURES - 1; i++) {
            const struct lumi_gain *gain = lumi_gains_find(&gains, world.names[i]);
            assert_true(fabs(log(gain->gain[c] / world.gain[i][c]) - common) < 0.01);
            product += gain->gain[c] < 1 ? -1 : gain->gain[c] > 1;
        }
        assert_true(fabs(product) <= 1); /* the median is 1 */
        assert_true(lumi_gains_find(&gains, "v23")->gain[c] == 1);
    }
    assert_int_equal(seen[PICTURES - 1], 0);
    for (int k = 0; k < LENSES; k++)
        for (double r2 = 0.1; r2 < 0.95; r2 += 0.1)
            assert_true(fabs(lumi_vignetting_log(gains.vignetting[k], r2) -
                             lumi_vignetting_log(world.vignetting[k], r2)) < 0.01);
    assert_true(report.spread < 0.03 && report.before > 5 * report.spread);
    lumi_gains_finish(&gains);
}

static void nothing_shared_changes_nothing(void **state)
{
    const char *names[] = {"a", "b"};
    const int lenses[] = {0, 0};
    struct lumi_equalize_report report = {0};
    struct lumi_gains gains;
    struct lumi_error error;

    (void)state;
    assert_int_equal(lumi_equalize(NULL, 0, names, lenses, 2, 1, &gains, &report, &error), LUMI_OK);
    for (int c = 0; c < 3; c++) {
        assert_true(gains.items[0].gain[c] == 1 && gains.items[1].gain[c] == 1);
        assert_true(gains.vignetting[0][c] == 0);
    }
    lumi_gains_finish(&gains);
}

static void light_is_looked_at_only_where_it_tells(void **state)
{
    struct lumi_raster picture;
    float light[3], sigma;

    (void)state;
    assert_int_equal(lumi_raster_create(&picture, 40, 40, 3, LUMI_F32), LUMI_OK);
    for (int y = 0; y < 40; y++)
        for (int i = 0; i < 120; i++)
            lumi_row_f32(&picture, y)[i] = 0.2f + 0.1f * (float)(i % 3) + 0.001f * (float)(i / 3);
    assert_true(lumi_light_around(&picture, true, 20.5, 20.5, 2, light, &sigma));
    for (int c = 0; c < 3; c++)
        assert_true(fabsf(light[c] - (0.22f + 0.1f * (float)c)) < 1e-4f);
    assert_false(lumi_light_around(&picture, true, 2, 20, 2, light, &sigma));
    lumi_row_f32(&picture, 18)[3 * 19 + 1] = 0.95f;
    assert_false(lumi_light_around(&picture, true, 20.5, 20.5, 2, light, &sigma));
    assert_true(lumi_light_around(&picture, false, 20.5, 20.5, 2, light, &sigma));
    lumi_raster_finish(&picture);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(gains_and_vignetting_are_found_whatever_a_fifth_of_the_points_say),
        cmocka_unit_test(nothing_shared_changes_nothing),
        cmocka_unit_test(light_is_looked_at_only_where_it_tells),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
