/* Cross-correlation by the Fourier transform of libavutil. */
#include "pipeline/exchange/film_offset.h"

#include <glib.h>
#include <libavutil/mem.h>
#include <libavutil/tx.h>
#include <math.h>
#include <string.h>

#define SLOW 2.0 /* s: what changes more slowly is taken out */
#define AWAY 0.5 /* s: a peak this far from the highest is another */

struct transform {
    AVTXContext *context;
    av_tx_fn run;
};

/* The curve less its mean over two seconds about each place, as the real part, and the sum of its squares. */
static double fill(AVComplexDouble *out, const float *curve, int count, double rate)
{
    int reach = MAX(1, (int)(SLOW * rate / 2));
    g_autofree double *sums = g_new(double, count + 1);
    double energy = 0;

    sums[0] = 0;
    for (int i = 0; i < count; i++)
        sums[i + 1] = sums[i] + (double)curve[i];
    for (int i = 0; i < count; i++) {
        int from = MAX(0, i - reach), to = MIN(count, i + reach + 1);
        out[i].re = (double)curve[i] - (sums[to] - sums[from]) / (to - from);
        energy += out[i].re * out[i].re;
    }
    return energy;
}

static void find_peak(const AVComplexDouble *products, int length, int first_count, int second_count, double scale,
                      double rate, struct lumi_film_offset *offset)
{
    int best = 0, away = (int)(AWAY * rate) + 1;

    offset->correlation = offset->next = -1;
    for (int lag = 1 - first_count; lag < second_count; lag++) {
        double value = products[(lag + length) % length].re * scale;
        if (value > offset->correlation) {
            offset->correlation = value;
            best = lag;
        }
    }
    for (int lag = 1 - first_count; lag < second_count; lag++)
        if (abs(lag - best) > away)
            offset->next = fmax(offset->next, products[(lag + length) % length].re * scale);
    /* Between the values, where a parabola through three of them is highest. */
    double left = products[(best - 1 + length) % length].re, here = products[(best + length) % length].re;
    double right = products[(best + 1 + length) % length].re, bend = left - 2 * here + right;
    double part = bend < 0 ? 0.5 * (left - right) / bend : 0;
    offset->seconds = (best + fmax(-0.5, fmin(0.5, part))) / rate;
}

int lumi_film_find_offset(const float *first, int first_count, const float *second, int second_count, double rate,
                          struct lumi_film_offset *offset, struct lumi_error *error)
{
    struct transform forward = {0}, back = {0};
    int length = 2, code = LUMI_OK;
    double scale = 1;

    *offset = (struct lumi_film_offset){0};
    while (length < first_count + second_count)
        length *= 2;
    AVComplexDouble *a = av_calloc((size_t)length, sizeof *a), *b = av_calloc((size_t)length, sizeof *b);
    AVComplexDouble *p = av_calloc((size_t)length, sizeof *p), *q = av_calloc((size_t)length, sizeof *q);
    if (!a || !b || !p || !q ||
        av_tx_init(&forward.context, &forward.run, AV_TX_DOUBLE_FFT, 0, length, &scale, 0) < 0 ||
        av_tx_init(&back.context, &back.run, AV_TX_DOUBLE_FFT, 1, length, &scale, 0) < 0) {
        code = lumi_fail(error, LUMI_ERR_NOMEM, "no memory to compare curves of %d values", length);
    } else if (first_count > 0 && second_count > 0) {
        double energy = fill(a, first, first_count, rate) * fill(b, second, second_count, rate);
        forward.run(forward.context, p, a, sizeof *a);
        forward.run(forward.context, q, b, sizeof *b);
        for (int i = 0; i < length; i++) { /* conj(P) · Q */
            double re = p[i].re * q[i].re + p[i].im * q[i].im;
            q[i].im = p[i].re * q[i].im - p[i].im * q[i].re;
            q[i].re = re;
        }
        back.run(back.context, p, q, sizeof *q);
        if (energy > 0)
            find_peak(p, length, first_count, second_count, 1 / (sqrt(energy) * length), rate, offset);
    }
    av_tx_uninit(&forward.context);
    av_tx_uninit(&back.context);
    av_free(a);
    av_free(b);
    av_free(p);
    av_free(q);
    return code;
}
