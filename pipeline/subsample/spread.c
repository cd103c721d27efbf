/* Greedy thinning on the sphere, in the measure of the equator's own spacing. */
#include "pipeline/subsample/spread.h"

#include "proto/base/sort.h"

#include <glib.h>
#include <string.h>

/* Of a row that closes up by c, every n-th is kept with n·c ≥ √½: gaps of √½ to √2 of the spacing, even to either side.
 * A little less, for centres that are not quite where they should be. */
#define NEAREST 0.7
/* What counts as the equator: the half of the sphere around it. */
#define BAND 0.5

struct frame {
    struct lumi_vec3 east, north, up;
};

static struct frame frame_at(struct lumi_vec3 point, struct lumi_vec3 centre)
{
    struct lumi_vec3 out = lumi_sub(point, centre);
    const double across = hypot(out.x, out.y), length = lumi_length(out);
    struct frame frame;

    if (!(length > 0))
        return (struct frame){{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    frame.up = lumi_scale(out, 1 / length);
    frame.east = across > 1e-9 * length ? lumi_vec3(-out.y / across, out.x / across, 0) : lumi_vec3(0, 1, 0);
    frame.north = lumi_cross(frame.up, frame.east);
    return frame;
}

struct lumi_spacing lumi_spacing_measure(int count, const struct lumi_vec3 *points, struct lumi_vec3 centre)
{
    g_autofree double *east = g_new(double, (gsize)count + 1), *north = g_new(double, (gsize)count + 1);
    int easts = 0, norths = 0;

    for (int i = 0; i < count; i++) {
        const struct frame frame = frame_at(points[i], centre);
        double nearest_east = INFINITY, nearest_north = INFINITY;

        if (fabs(frame.up.z) > BAND)
            continue;
        for (int j = 0; j < count; j++) {
            const struct lumi_vec3 offset = lumi_sub(points[j], points[i]);
            const double x = fabs(lumi_dot(offset, frame.east)), y = fabs(lumi_dot(offset, frame.north));
            const double distance = hypot(x, y);
            /* The other side of the sphere projects to here as well. */
            if (distance <= 1e-6 || fabs(lumi_dot(offset, frame.up)) > distance)
                continue;
            if (x > 2 * y)
                nearest_east = fmin(nearest_east, distance);
            else if (y > 2 * x)
                nearest_north = fmin(nearest_north, distance);
        }
        if (isfinite(nearest_east))
            east[easts++] = nearest_east;
        if (isfinite(nearest_north))
            north[norths++] = nearest_north;
    }
    struct lumi_spacing spacing = {lumi_sort_median(east, easts), lumi_sort_median(north, norths)};
    if (!(spacing.east > 0))
        spacing.east = spacing.north;
    if (!(spacing.north > 0))
        spacing.north = spacing.east;
    return spacing;
}

/* From the equator outwards, one half after the other, then round the axis. */
struct turn {
    double distance, z, azimuth;
    struct lumi_vec3 point;
    int index;
};

static int compare_turns(const void *a, const void *b)
{
    const struct turn *p = a, *q = b;
    const double first[] = {p->distance, p->z, p->azimuth, p->point.x, p->point.y, p->point.z};
    const double second[] = {q->distance, q->z, q->azimuth, q->point.x, q->point.y, q->point.z};

    for (size_t i = 0; i < G_N_ELEMENTS(first); i++)
        if (first[i] != second[i])
            return first[i] < second[i] ? -1 : 1;
    return p->index - q->index;
}

static bool too_near(const struct frame *frame, struct lumi_vec3 offset, double east, double north)
{
    const double x = lumi_dot(offset, frame->east) / east, y = lumi_dot(offset, frame->north) / north;
    const double z = lumi_dot(offset, frame->up) / fmax(east, north);

    return x * x + y * y + z * z < 1;
}

void lumi_spread_keep(int count, const struct lumi_vec3 *points, struct lumi_vec3 centre, struct lumi_spacing spacing,
                      double density, bool *kept)
{
    const double scale = NEAREST / sqrt(density), east = scale * spacing.east, north = scale * spacing.north;
    g_autofree struct turn *turns = g_new(struct turn, (gsize)count + 1);
    g_autofree struct lumi_vec3 *list = g_new(struct lumi_vec3, (gsize)count + 1);
    int listed = 0;

    for (int i = 0; i < count; i++) {
        const struct lumi_vec3 out = lumi_sub(points[i], centre);
        /* Rows in steps of a quarter of their spacing: centres are not on them to the last digit. */
        const double arc = lumi_length(out) * atan2(out.z, hypot(out.x, out.y));
        const double row = north > 0 ? round(4 * arc / spacing.north) : 0;
        turns[i] = (struct turn){fabs(row), row, atan2(out.y, out.x), points[i], i};
    }
    qsort(turns, (size_t)count, sizeof *turns, compare_turns);
    for (int i = 0; i < count; i++) {
        const struct frame frame = frame_at(turns[i].point, centre);
        bool near = false;
        for (int k = 0; k < listed && !near && east > 0 && north > 0; k++)
            near = too_near(&frame, lumi_sub(list[k], turns[i].point), east, north);
        kept[turns[i].index] = !near;
        if (!near)
            list[listed++] = turns[i].point;
    }
}
