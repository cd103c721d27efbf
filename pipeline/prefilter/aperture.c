/* The samples of a prefilter. */
#include "pipeline/prefilter/aperture.h"

#include "pipeline/prefilter/sequence.h"
#include "proto/base/memory.h"

#include <math.h>

#define RADII 1024 /* steps of the table of radii */

/* Shares of the kernel's volume within radii of i / RADII: over an oval (where a ring's area grows with its radius), or
 * along an axis of a rectangle. */
static void fill_shares(const struct lumi_prefilter_view *view, double shares[RADII + 1])
{
    const struct lumi_disk unit = {1, 1, 1, 1};

    shares[0] = 0;
    for (int i = 0; i < RADII; i++) {
        const double r = (i + 0.5) / RADII;
        const double value = lumi_disk_weight(&unit, view->shape, view->kernel, 1, (float)r, 0);
        shares[i + 1] = shares[i] + value * (view->shape == LUMI_DISK_OVAL ? r : 1);
    }
    for (int i = 1; i <= RADII; i++)
        shares[i] /= shares[RADII];
}

static double radius_of(const double shares[RADII + 1], double share)
{
    int low = 0, high = RADII;

    while (high - low > 1) {
        int middle = (low + high) / 2;
        if (shares[middle] <= share)
            low = middle;
        else
            high = middle;
    }
    const double width = shares[high] - shares[low];
    return (low + (width > 0 ? (share - shares[low]) / width : 0)) / RADII;
}

/* Places are drawn as often as ρ is high, so that ρ itself needs no weight; but each quarter of the disk as often as
 * the others, so that its area does. */
static void place_eye(const struct lumi_prefilter_view *view, const double shares[RADII + 1], const double point[4],
                      struct prefilter_sample *sample)
{
    const struct lumi_disk *disk = &view->disk;
    double u, v;

    if (view->shape == LUMI_DISK_OVAL) {
        const double r = radius_of(shares, point[1]);
        u = r * cos(2 * LUMI_PI * point[0]);
        v = r * sin(2 * LUMI_PI * point[0]);
    } else {
        u = radius_of(shares, fabs(2 * point[0] - 1)) * (point[0] < 0.5 ? -1 : 1);
        v = radius_of(shares, fabs(2 * point[1] - 1)) * (point[1] < 0.5 ? -1 : 1);
    }
    const double across = u < 0 ? disk->u_neg : disk->u_pos, down = v < 0 ? disk->v_neg : disk->v_pos;
    const double area = ((double)disk->u_neg + disk->u_pos) * ((double)disk->v_neg + disk->v_pos) / 4;
    sample->u = (float)(u * across);
    sample->v = (float)(v * down);
    sample->weight = area > 0 ? (float)(across * down / area) : 1;
}

static double lanczos2(double x)
{
    const double a = LUMI_PI * x, b = a / 2;

    if (fabs(x) >= 2)
        return 0;
    return fabs(x) < 1e-9 ? 1 : sin(a) / a * (sin(b) / b);
}

static void place_axis(double coordinate, struct prefilter_axis *axis)
{
    axis->offset = coordinate - 0.5;
    axis->start = axis->offset > 0 ? -2 : -1;
    for (int i = 0; i < PREFILTER_TAPS; i++)
        axis->taps[i] = (float)lanczos2(axis->start + i + axis->offset);
}

int prefilter_samples(const struct lumi_prefilter_view *view, uint32_t seed, int count,
                      struct prefilter_sample *samples)
{
    double *shares = lumi_alloc(RADII + 1, sizeof *shares), point[4];

    if (!shares)
        return LUMI_ERR_NOMEM;
    fill_shares(view, shares);
    for (int i = 0; i < count; i++) {
        prefilter_point(seed, (uint32_t)i, point);
        place_eye(view, shares, point, &samples[i]);
        place_axis(point[2], &samples[i].x);
        place_axis(point[3], &samples[i].y);
    }
    lumi_free(shares);
    return LUMI_OK;
}
