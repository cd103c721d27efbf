/* Where the rig has no camera: the poles of its sphere. */
#include "pipeline/subsample/poles.h"

#include <glib.h>
#include <string.h>

enum { SECTORS = 8 };
#define FARTHEST (LUMI_PI / 3) /* a row that far from the pole is not the last before it: the capture ends there */

static int compare_angles(const void *a, const void *b)
{
    const double p = *(const double *)a, q = *(const double *)b;

    return p < q ? -1 : p > q;
}

double lumi_pole_gap(int count, const struct lumi_vec3 *points, struct lumi_vec3 centre, bool bottom)
{
    double nearest[SECTORS];

    for (int i = 0; i < SECTORS; i++)
        nearest[i] = INFINITY;
    for (int i = 0; i < count; i++) {
        const struct lumi_vec3 out = lumi_sub(points[i], centre);
        const double angle = atan2(hypot(out.x, out.y), bottom ? -out.z : out.z);
        const int sector = (int)floor((atan2(out.y, out.x) / (2 * LUMI_PI) + 1) * SECTORS) % SECTORS;
        nearest[sector] = fmin(nearest[sector], angle);
    }
    qsort(nearest, SECTORS, sizeof *nearest, compare_angles);
    const double gap = nearest[SECTORS / 2];
    return nearest[SECTORS - 2] <= FARTHEST ? gap : 0;
}

static void look(struct lumi_vec3 centre, double radius, double angle, double azimuth, bool bottom, bool inward,
                 struct lumi_pose *pose)
{
    const struct lumi_vec3 out =
        lumi_vec3(sin(angle) * cos(azimuth), sin(angle) * sin(azimuth), bottom ? -cos(angle) : cos(angle));

    lumi_pose_look(lumi_add(centre, lumi_scale(out, radius)), inward ? lumi_scale(out, -1) : out, lumi_vec3(0, 0, 1),
                   pose);
}

int lumi_pole_poses(struct lumi_vec3 centre, double radius, double gap, bool bottom, bool inward,
                    struct lumi_spacing spacing, double density, struct lumi_pose **poses)
{
    const double east = spacing.east / sqrt(density), north = spacing.north / sqrt(density), side = sqrt(east * north);
    const double reach = radius * gap;
    GArray *list = g_array_new(FALSE, FALSE, sizeof(struct lumi_pose));

    /* Among even rows nothing is farther from a centre than half the diagonal of a cell. */
    if (gap > 0 && east > 0 && reach > 1.1 * hypot(east, north) / 2) {
        const int rings = MAX(1, (int)lround(reach / side));
        for (int ring = 0; ring < rings; ring++) {
            const double angle = gap * ring / rings;
            const int around = ring ? MAX(3, (int)lround(2 * LUMI_PI * radius * sin(angle) / side)) : 1;
            for (int k = 0; k < around; k++) {
                struct lumi_pose pose;
                look(centre, radius, angle, 2 * LUMI_PI * (k + 0.5 * (ring & 1)) / around, bottom, inward, &pose);
                g_array_append_val(list, pose);
            }
        }
    }
    const int count = (int)list->len;
    *poses = (struct lumi_pose *)(void *)g_array_free(list, FALSE);
    return count;
}
