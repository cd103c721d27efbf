/* Exposure, vignetting, shot noise, read noise, converter: in this order, as in a camera. */
#include "sim/sensor.h"

#include "sim/random.h"

#include <math.h>

void sim_sensor_init(struct sim_sensor *sensor)
{
    *sensor = (struct sim_sensor){.seed = 1};
}

int sim_sensor_check(const struct sim_sensor *s, struct lumi_error *error)
{
    if (!(fabs(s->exposure) <= 20))
        return lumi_fail(error, LUMI_ERR_ARG, "exposure %g: −20 to 20 stops wanted", s->exposure);
    if (!(s->vignetting >= 0 && s->vignetting <= 1))
        return lumi_fail(error, LUMI_ERR_ARG, "vignetting %g: 0 to 1 wanted", s->vignetting);
    if (s->full_well != 0 && !(s->full_well >= 10 && s->full_well <= 1e9))
        return lumi_fail(error, LUMI_ERR_ARG, "full well %g: 10 to 1e9 electrons wanted", s->full_well);
    if (!(s->read_noise >= 0 && s->read_noise <= 1e6) || (s->read_noise > 0 && s->full_well == 0))
        return lumi_fail(error, LUMI_ERR_ARG, "read noise %g: electrons, with a full well, wanted", s->read_noise);
    if (s->bits != 0 && s->bits != 8 && s->bits != 10 && s->bits != 12)
        return lumi_fail(error, LUMI_ERR_ARG, "%d bits: 8, 10 or 12 wanted", s->bits);
    return LUMI_OK;
}

/* A standard normal deviate (Box and Muller, "A note on the generation of random normal deviates", 1958). */
static double normal(uint64_t seed, uint64_t index, unsigned channel)
{
    double a = sim_random_unit(sim_random(seed, index, channel));
    double b = sim_random_unit(sim_random(seed, index, channel + 1));

    return sqrt(-2 * log(a)) * cos(2 * 3.14159265358979323846 * b);
}

/* Photons that arrive when `mean` do on average. Few: by inverting the distribution. Many: it is normal. */
static double photons(double mean, uint64_t seed, uint64_t index, unsigned channel)
{
    if (mean > 60)
        return fmax(0, floor(mean + sqrt(mean) * normal(seed, index, channel) + 0.5));
    double left = sim_random_unit(sim_random(seed, index, channel)), p = exp(-mean);
    int count = 0;
    while (left > p && count < 200) {
        left -= p;
        p *= mean / ++count;
    }
    return count;
}

void sim_sensor_apply(const struct sim_sensor *s, uint64_t frame, struct lumi_raster *picture)
{
    double gain = exp2(s->exposure), steps = s->bits ? ldexp(1, s->bits) - 1 : 0;
    double cx = picture->width / 2.0, cy = picture->height / 2.0, corner = cx * cx + cy * cy;
    uint64_t seed = sim_random(s->seed, frame, 0);

    if (s->exposure == 0 && s->vignetting == 0 && s->full_well == 0 && s->bits == 0)
        return;
    for (int y = 0; y < picture->height; y++) {
        float *row = lumi_row_f32(picture, y);
        for (int x = 0; x < picture->width; x++) {
            double dx = x + 0.5 - cx, dy = y + 0.5 - cy;
            double light = gain * (1 - s->vignetting * (dx * dx + dy * dy) / corner);
            for (int c = 0; c < picture->channels; c++) {
                uint64_t index = (uint64_t)y * (uint64_t)picture->width + (uint64_t)x;
                float *value = &row[x * picture->channels + c];
                double v = fmax(*value, 0) * light;
                if (s->full_well > 0) {
                    double e = photons(v * s->full_well, seed, index, (unsigned)c * 4);
                    if (s->read_noise > 0)
                        e += s->read_noise * normal(seed, index, (unsigned)c * 4 + 2);
                    v = e / s->full_well;
                }
                if (steps > 0)
                    v = floor(fmin(fmax(v, 0), 1) * steps + 0.5) / steps;
                *value = (float)v;
            }
        }
    }
}

int sim_sensor_filter(const struct lumi_raster *picture, int width, int height, struct lumi_raster *raw)
{
    LUMI_TRY(lumi_raster_create(raw, width, height, 1, LUMI_F32));
    for (int y = 0; y < height; y++) {
        const float *from = lumi_row_f32(picture, y);
        float *to = lumi_row_f32(raw, y);

        for (int x = 0; x < width; x++, from += 3)
            to[x] = from[(x & 1) + (y & 1)];
    }
    return LUMI_OK;
}
