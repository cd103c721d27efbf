/* The search for a quality. */
#include "pipeline/compress/size_search.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

enum { QUALITIES = 101, FIRST = 70, ESTIMATES = 5, GUIDED = 5 };

#define GROWTH 0.035 /* of a size's logarithm a step of quality, before two sizes are known */
#define GROWTH_MIN 0.005
#define GROWTH_MAX 0.2
#define MARGIN_ESTIMATED 0.01 /* what an estimate has to stay under the target by, in the logarithm */
#define MARGIN_MEASURED 0.002 /* the same once it has been held to a measured size */
#define NEAR                                                                                                           \
    0.03 /* a field that is smaller by less than this is taken: about a step of quality, and a coding saved            \
          */

struct curve {
    int count;
    int quality[QUALITIES]; /* ascending */
    double size[QUALITIES]; /* logarithms */
};

static void add(struct curve *curve, int quality, long long size)
{
    int at = curve->count++;

    for (; at > 0 && curve->quality[at - 1] > quality; at--) {
        curve->quality[at] = curve->quality[at - 1];
        curve->size[at] = curve->size[at - 1];
    }
    curve->quality[at] = quality;
    curve->size[at] = log((double)(size > 1 ? size : 1));
}

/* Between two points on their line; beyond them, and with one point only, with a growth that is likely. */
static double at(const struct curve *curve, int quality)
{
    const int *q = curve->quality;
    const double *s = curve->size;
    double growth = GROWTH;
    int i = 0;

    while (i + 2 < curve->count && quality > q[i + 1])
        i++;
    if (curve->count > 1)
        growth = fmin(fmax((s[i + 1] - s[i]) / (q[i + 1] - q[i]), GROWTH_MIN), GROWTH_MAX);
    if (curve->count > 1 && quality > q[i + 1])
        i++;
    return s[i] + growth * (quality - q[i]);
}

/* The highest quality in (low, high) that the curve, shifted, has under `goal`; `low` if there is none. */
static int best(const struct curve *curve, double shift, double goal, int low, int high)
{
    int quality = high - 1;

    while (quality > low && at(curve, quality) + shift > goal)
        quality--;
    return quality;
}

static int learn(struct curve *curve, double goal, compress_size_fn estimate, void *context, struct lumi_error *error)
{
    int quality = FIRST;

    for (int i = 0; i < ESTIMATES; i++) {
        long long size;
        bool near = false;
        LUMI_TRY(estimate(context, quality, &size, error));
        add(curve, quality, size);
        quality = best(curve, 0, goal, 0, QUALITIES);
        for (int k = 0; k < curve->count; k++)
            near = near || abs(curve->quality[k] - quality) <= 1;
        if (near)
            break;
    }
    return LUMI_OK;
}

int compress_size_search(long long target, compress_size_fn estimate, compress_size_fn measure, void *context,
                         int *result, struct lumi_error *error)
{
    double goal = log((double)target), shift = 0;
    int low = -1, high = QUALITIES, quality = FIRST;
    struct curve curve = {0};

    if (estimate) {
        LUMI_TRY(learn(&curve, goal - MARGIN_ESTIMATED, estimate, context, error));
        quality = best(&curve, 0, goal - MARGIN_ESTIMATED, 0, QUALITIES);
    }
    for (int i = 0; high - low > 1; i++) {
        long long size;
        LUMI_TRY(measure(context, quality, &size, error));
        if (size <= target)
            low = quality;
        else
            high = quality;
        if (size <= target && log((double)size) > goal - NEAR)
            break;
        if (estimate)
            shift = log((double)(size > 1 ? size : 1)) - at(&curve, quality);
        else
            add(&curve, quality, size);
        if (i + 1 < GUIDED)
            quality = best(&curve, shift, goal - MARGIN_MEASURED, low, high);
        else
            quality = (low + high) / 2; /* the sizes are on no curve */
        if (quality == low && low >= 0)
            break;
        quality = quality > low ? quality : 0;
    }
    *result = low;
    return LUMI_OK;
}
