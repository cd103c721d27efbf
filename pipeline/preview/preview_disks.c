/* Blending disks while half of the views are not there yet.
 *
 * In the finished field a disk reaches to the neighbours in the triangulation of the centres (Overbeck et al. 2018,
 * section 4.4). A triangulation of a few arcs of a sphere closes it behind them by long triangles, whose ends are no
 * neighbours; those are left out. On a side where a view then has none it is the last one, and shows what it can of
 * what lies beyond. */
#include "pipeline/geometry/disks.h"
#include "pipeline/preview/preview_priv.h"
#include "proto/base/memory.h"

#include <math.h>
#include <string.h>

#define CAP_COSINE 0.77 /* of 40°: a triangle's corners lie no farther from its middle */
#define FEW 0.2f        /* of the other sides' extent: no neighbour lies that way */
#define BEYOND 2.0f     /* radii that the last view reaches */
#define NEAREST 2

static void grow(struct lumi_disk *disk, const struct lumi_pose *own, struct lumi_vec3 other)
{
    const struct lumi_vec3 d = lumi_to_camera(own, other);
    const float u = (float)d.x, v = (float)d.y;

    disk->u_pos = fmaxf(disk->u_pos, u);
    disk->u_neg = fmaxf(disk->u_neg, -u);
    disk->v_pos = fmaxf(disk->v_pos, v);
    disk->v_neg = fmaxf(disk->v_neg, -v);
}

/* Whether a triangle of the convex hull is a piece of the sphere: not one that closes it behind a few arcs. */
static bool is_of_sphere(const struct lumi_pose *poses, const int corners[3], struct lumi_vec3 centre)
{
    struct lumi_vec3 p[3];

    for (int i = 0; i < 3; i++)
        p[i] = lumi_normalize(lumi_sub(poses[corners[i]].t, centre));
    const struct lumi_vec3 normal = lumi_cross(lumi_sub(p[1], p[0]), lumi_sub(p[2], p[0]));
    const double length = lumi_length(normal);
    return length > 1e-9 && fabs(lumi_dot(normal, p[0])) > CAP_COSINE * length && lumi_dot(p[0], p[1]) > 0 &&
           lumi_dot(p[1], p[2]) > 0;
}

/* The two nearest, which are neighbours whatever the triangles say. */
static void grow_to_nearest(int count, const struct lumi_pose *poses, int index, struct lumi_disk *disk)
{
    double distances[NEAREST] = {INFINITY, INFINITY};
    int found[NEAREST] = {-1, -1};

    for (int i = 0; i < count; i++) {
        const double distance = lumi_length(lumi_sub(poses[i].t, poses[index].t));
        if (i == index || !(distance > 1e-6) || lumi_dot(lumi_axis(&poses[i], 2), lumi_axis(&poses[index], 2)) < 0)
            continue;
        if (distance < distances[0]) {
            distances[1] = distances[0], found[1] = found[0];
            distances[0] = distance, found[0] = i;
        } else if (distance < distances[1]) {
            distances[1] = distance, found[1] = i;
        }
    }
    for (int i = 0; i < NEAREST; i++)
        if (found[i] >= 0)
            grow(disk, &poses[index], poses[found[i]].t);
}

static void mend(struct lumi_disk *disk, float beyond, float spacing)
{
    float *sides[] = {&disk->u_neg, &disk->u_pos, &disk->v_neg, &disk->v_pos};
    float most = 0;

    for (int i = 0; i < 4; i++)
        most = fmaxf(most, *sides[i]);
    const float least = fmaxf(FEW * most, 1e-3f * spacing);
    for (int i = 0; i < 4; i++) {
        const float opposite = *sides[i ^ 1];
        if (*sides[i] <= least)
            *sides[i] = beyond > 0 ? fmaxf(beyond, most) : opposite > least ? opposite : fmaxf(most, spacing);
    }
}

int preview_disks(int count, const struct lumi_pose *poses, enum lumi_surface surface, struct lumi_vec3 centre,
                  double radius, struct lumi_disk *disks, struct lumi_error *error)
{
    const bool sphere = surface == LUMI_SURFACE_SPHERE;
    const float spacing = radius > 0 ? (float)(radius / sqrt(count)) : 0.1f;
    int *triangles = NULL, triangle_count = 0;

    memset(disks, 0, (size_t)count * sizeof *disks);
    if (count > 3)
        LUMI_TRY(lumi_camera_triangles(count, poses, surface, centre, &triangles, &triangle_count, error));
    for (int t = 0; t < triangle_count; t++) {
        if (sphere && !is_of_sphere(poses, triangles + 3 * t, centre))
            continue;
        for (int k = 0; k < 3; k++) {
            const int a = triangles[3 * t + k], b = triangles[3 * t + (k + 1) % 3];
            grow(&disks[a], &poses[a], poses[b].t);
            grow(&disks[b], &poses[b], poses[a].t);
        }
    }
    lumi_free(triangles);
    for (int i = 0; i < count; i++) {
        grow_to_nearest(count, poses, i, &disks[i]);
        mend(&disks[i], sphere ? BEYOND * (float)radius : 0, spacing);
    }
    return LUMI_OK;
}
