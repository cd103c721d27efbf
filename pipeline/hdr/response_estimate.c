/* A camera's response from places photographed at several exposures (Debevec and Malik 1997).
 *
 * With g(z) the logarithm of the exposure that gives code z, E the light of a place and t the exposure of a shot,
 * g(z) = ln E + ln t. Least squares over all samples, weighted by a hat w(z) that trusts the middle codes, with
 * λ w(z) g''(z) = 0 for smoothness and g(128) = 0. The paper solves for g and all E at once; here each E, which stands
 * in its own samples only, is eliminated first, so that the system has 256 unknowns however many the places are. */
#include "pipeline/hdr/response.h"

#include "proto/base/memory.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

#define CODES 256
#define SMOOTHNESS 1.0 /* a place */
#define LEAST_PLACES 50
#define LEAST_SPREAD 0.3 /* of the logarithms of the exposures */

static double hat(int z)
{
    return z <= 127 ? z + 1 : 256 - z;
}

/* Codes at the ends may be of any light beyond them. */
static bool tells(int z)
{
    return z > 2 && z < 252;
}

struct equations {
    double a[CODES][CODES]; /* symmetric */
    double b[CODES];
};

/* A place's samples, its light eliminated: each row g(z_i) − mean(g) = t_i − mean(t), weighted means. */
static void add_place(struct equations *e, const struct lumi_response_sample *samples, int count, int channel)
{
    double sum = 0, mean_t = 0;

    for (int i = 0; i < count; i++) {
        double w = tells(samples[i].code[channel]) ? hat(samples[i].code[channel]) / 128 : 0;
        sum += w * w;
        mean_t += w * w * (double)samples[i].log_exposure;
    }
    if (!(sum > 0))
        return;
    mean_t /= sum;
    for (int i = 0; i < count; i++) {
        int zi = samples[i].code[channel];
        if (!tells(zi))
            continue;
        double wi = hat(zi) * hat(zi) / (128.0 * 128);
        e->a[zi][zi] += wi;
        e->b[zi] += wi * ((double)samples[i].log_exposure - mean_t);
        for (int j = 0; j < count; j++) {
            int zj = samples[j].code[channel];
            if (!tells(zj))
                continue;
            e->a[zi][zj] -= wi * hat(zj) * hat(zj) / (128.0 * 128) / sum;
        }
    }
}

static void add_smoothness(struct equations *e, double amount)
{
    for (int z = 1; z < CODES - 1; z++) {
        const double row[3] = {1, -2, 1};
        double w = amount * hat(z) * hat(z) / (128.0 * 128);
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++)
                e->a[z - 1 + i][z - 1 + j] += w * row[i] * row[j];
    }
    e->a[128][128] += amount;
}

/* Cholesky, in place; b becomes the solution. False where the system has none. */
static bool solve(struct equations *e)
{
    for (int i = 0; i < CODES; i++) {
        for (int j = 0; j <= i; j++) {
            double sum = e->a[i][j];
            for (int k = 0; k < j; k++)
                sum -= e->a[i][k] * e->a[j][k];
            if (i == j && !(sum > 1e-14))
                return false;
            e->a[i][j] = i == j ? sqrt(sum) : sum / e->a[j][j];
        }
    }
    for (int i = 0; i < CODES; i++) {
        for (int k = 0; k < i; k++)
            e->b[i] -= e->a[i][k] * e->b[k];
        e->b[i] /= e->a[i][i];
    }
    for (int i = CODES - 1; i >= 0; i--) {
        for (int k = i + 1; k < CODES; k++)
            e->b[i] -= e->a[k][i] * e->b[k];
        e->b[i] /= e->a[i][i];
    }
    return true;
}

/* The nearest sequence that never falls (pool adjacent violators; Ayer et al. 1955). */
static void make_monotone(double values[CODES])
{
    double mean[CODES];
    int length[CODES], blocks = 0;

    for (int z = 0; z < CODES; z++) {
        mean[blocks] = values[z];
        length[blocks++] = 1;
        while (blocks > 1 && mean[blocks - 2] > mean[blocks - 1]) {
            int all = length[blocks - 2] + length[blocks - 1];
            mean[blocks - 2] = (mean[blocks - 2] * length[blocks - 2] + mean[blocks - 1] * length[blocks - 1]) / all;
            length[--blocks - 1] = all;
        }
    }
    for (int block = 0, z = 0; block < blocks; block++)
        for (int i = 0; i < length[block]; i++)
            values[z++] = mean[block];
}

/* The codes no sample has are left to smoothness, which runs straight on in the logarithm; below the lowest code seen
 * light goes to 0 in proportion instead. */
static void to_light(const double g[CODES], int lowest, float light[CODES])
{
    for (int z = 0; z < CODES; z++)
        light[z] = (float)exp(g[z] - g[CODES - 1]);
    for (int z = 0; z < lowest; z++)
        light[z] = light[lowest] * (float)z / (float)lowest;
    light[0] = 0;
}

static int estimate_channel(struct equations *e, const struct lumi_response_sample *samples, int count, int places,
                            int channel, float light[CODES])
{
    int seen[CODES] = {0}, lowest = 3;

    memset(e, 0, sizeof *e);
    for (int first = 0, last; first < count; first = last) {
        for (last = first; last < count && samples[last].place == samples[first].place; last++)
            seen[samples[last].code[channel]]++;
        add_place(e, samples + first, last - first, channel);
    }
    add_smoothness(e, SMOOTHNESS * places);
    if (!solve(e))
        return LUMI_ERR_FORMAT;
    make_monotone(e->b);
    while (lowest < 128 && seen[lowest] == 0)
        lowest++;
    to_light(e->b, lowest, light);
    return LUMI_OK;
}

int lumi_response_estimate(const struct lumi_response_sample *samples, int count, struct lumi_response *response,
                           struct lumi_error *error)
{
    double least = INFINITY, most = -INFINITY;
    int places = 0;

    for (int i = 0; i < count; i++) {
        places += i == 0 || samples[i].place != samples[i - 1].place;
        least = fmin(least, (double)samples[i].log_exposure);
        most = fmax(most, (double)samples[i].log_exposure);
    }
    if (places < LEAST_PLACES)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%d places tell no response, %d are wanted", places, LEAST_PLACES);
    if (!(most - least > LEAST_SPREAD))
        return lumi_fail(error, LUMI_ERR_FORMAT, "shots that are exposed alike tell no response");
    struct equations *e = lumi_alloc(1, sizeof *e);
    if (!e)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a response");
    int code = LUMI_OK;
    for (int c = 0; c < 3 && code == LUMI_OK; c++)
        code = estimate_channel(e, samples, count, places, c, response->light[c]);
    lumi_free(e);
    return code == LUMI_OK ? LUMI_OK : lumi_fail(error, code, "the pictures do not tell the camera's response");
}
