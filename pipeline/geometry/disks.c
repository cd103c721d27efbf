/* Blending disks and the camera mesh. */
#include "pipeline/geometry/disks.h"

#include "proto/base/memory.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <libqhull_r/qhull_ra.h>

/* Eigenvectors of a symmetric 3×3 matrix by Jacobi rotations; values fall from the first to the last. */
static void symmetric_eigen(double a[3][3], double values[3], double vectors[3][3])
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            vectors[i][j] = i == j;
    for (int sweep = 0; sweep < 50; sweep++)
        for (int p = 0; p < 2; p++)
            for (int q = p + 1; q < 3; q++) {
                if (fabs(a[p][q]) < 1e-300)
                    continue;
                double theta = (a[q][q] - a[p][p]) / (2 * a[p][q]);
                double t = (theta < 0 ? -1 : 1) / (fabs(theta) + sqrt(theta * theta + 1));
                double c = 1 / sqrt(t * t + 1), s = t * c;
                for (int k = 0; k < 3; k++) {
                    double kp = a[k][p], kq = a[k][q];
                    a[k][p] = c * kp - s * kq, a[k][q] = s * kp + c * kq;
                }
                for (int k = 0; k < 3; k++) {
                    double pk = a[p][k], qk = a[q][k];
                    a[p][k] = c * pk - s * qk, a[q][k] = s * pk + c * qk;
                    double vp = vectors[k][p], vq = vectors[k][q];
                    vectors[k][p] = c * vp - s * vq, vectors[k][q] = s * vp + c * vq;
                }
            }
    int order[3] = {0, 1, 2};
    for (int i = 0; i < 2; i++)
        for (int j = i + 1; j < 3; j++)
            if (a[order[j]][order[j]] > a[order[i]][order[i]]) {
                int swap = order[i];
                order[i] = order[j], order[j] = swap;
            }
    double sorted[3][3];
    for (int i = 0; i < 3; i++) {
        values[i] = a[order[i]][order[i]];
        for (int k = 0; k < 3; k++)
            sorted[k][i] = vectors[k][order[i]];
    }
    memcpy(vectors, sorted, sizeof sorted);
}

/* Principal axes of points about `about`; spread[i] is the standard deviation along axes[i], falling. */
static void principal_axes(int count, const struct lumi_vec3 *points, struct lumi_vec3 about, struct lumi_vec3 axes[3],
                           double spread[3])
{
    double a[3][3] = {{0}}, values[3], vectors[3][3];

    for (int n = 0; n < count; n++) {
        struct lumi_vec3 d = lumi_sub(points[n], about);
        double v[3] = {d.x, d.y, d.z};
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++)
                a[i][j] += v[i] * v[j] / count;
    }
    symmetric_eigen(a, values, vectors);
    for (int i = 0; i < 3; i++) {
        axes[i] = lumi_vec3(vectors[0][i], vectors[1][i], vectors[2][i]);
        spread[i] = sqrt(fmax(values[i], 0));
    }
}

static struct lumi_vec3 centroid(int count, const struct lumi_vec3 *points)
{
    struct lumi_vec3 sum = {0, 0, 0};

    for (int i = 0; i < count; i++)
        sum = lumi_add(sum, points[i]);
    return lumi_scale(sum, 1.0 / count);
}

/* Solves the symmetric 4×4 system by Gaussian elimination with pivoting; false if singular. */
static bool solve4(double m[4][5])
{
    for (int c = 0; c < 4; c++) {
        int p = c;
        for (int r = c + 1; r < 4; r++)
            if (fabs(m[r][c]) > fabs(m[p][c]))
                p = r;
        if (fabs(m[p][c]) < 1e-12)
            return false;
        for (int k = 0; k < 5; k++) {
            double swap = m[c][k];
            m[c][k] = m[p][k], m[p][k] = swap;
        }
        for (int r = 0; r < 4; r++)
            for (int k = 4; r != c && k >= c; k--)
                m[r][k] -= m[r][c] / m[c][c] * m[c][k];
    }
    for (int c = 0; c < 4; c++)
        m[c][4] /= m[c][c];
    return true;
}

/* |p|² = 2 c·p + (r² − |c|²), linear in c and the last term, about the centroid. */
static bool fit_sphere(int count, const struct lumi_vec3 *points, struct lumi_vec3 *centre, double *radius)
{
    struct lumi_vec3 mean = centroid(count, points);
    double m[4][5] = {{0}};

    for (int n = 0; n < count; n++) {
        struct lumi_vec3 p = lumi_sub(points[n], mean);
        double row[5] = {2 * p.x, 2 * p.y, 2 * p.z, 1, lumi_dot(p, p)};
        for (int i = 0; i < 4; i++)
            for (int j = 0; j < 5; j++)
                m[i][j] += row[i] * row[j];
    }
    if (!solve4(m))
        return false;
    *centre = lumi_vec3(m[0][4], m[1][4], m[2][4]);
    *radius = sqrt(fmax(0, m[3][4] + lumi_dot(*centre, *centre)));
    *centre = lumi_add(*centre, mean);
    return true;
}

void lumi_surface_fit(int count, const struct lumi_pose *poses, enum lumi_surface *surface, struct lumi_vec3 *centre,
                      double *radius)
{
    struct lumi_vec3 *points = lumi_alloc((size_t)count, sizeof *points), axes[3];
    double spread[3], across = 0;

    *surface = LUMI_SURFACE_PLANE;
    *radius = 0;
    *centre = poses[0].t;
    if (!points)
        return;
    for (int i = 0; i < count; i++)
        points[i] = poses[i].t;
    *centre = centroid(count, points);
    principal_axes(count, points, *centre, axes, spread);
    for (int i = 0; i < count; i++)
        across += fabs(lumi_dot(lumi_axis(&poses[i], 2), axes[2])) / count;
    if (spread[0] <= 1e-9 * lumi_length(*centre)) /* one place, and rounding */
        goto out;
    /* Of a line the least axis is nothing but rounding: `across` says nothing there. */
    bool line = spread[1] <= 0.03 * spread[0];
    bool flat = line || spread[2] < 0.03 * spread[0];
    if (flat && !line && across < 0.5) { /* a ring: its circle's centre is the sphere's */
        *surface = LUMI_SURFACE_SPHERE;
        for (int i = 0; i < count; i++)
            *radius += lumi_length(lumi_sub(points[i], *centre)) / count;
    } else if (!flat && fit_sphere(count, points, centre, radius)) {
        *surface = LUMI_SURFACE_SPHERE;
    } else {
        for (int i = 0; i < count; i++)
            *radius = fmax(*radius, lumi_length(lumi_sub(points[i], *centre)));
    }
out:
    lumi_free(points);
}

struct triangulation {
    int *triangles, count;
};

static int take_facets(qhT *qh, bool delaunay, struct triangulation *result)
{
    facetT *facet;
    vertexT *vertex, **vertexp;

    result->triangles = lumi_alloc((size_t)(qh->num_facets > 0 ? qh->num_facets : 1), 3 * sizeof(int));
    if (!result->triangles)
        return LUMI_ERR_NOMEM;
    FORALLfacets
    {
        int corner[8], n = 0;
        if (delaunay && facet->upperdelaunay)
            continue;
        FOREACHvertex_(facet->vertices)
        {
            if (n < 8)
                corner[n++] = qh_pointid(qh, vertex->point);
        }
        if (n == 3) {
            memcpy(result->triangles + 3 * result->count, corner, 3 * sizeof(int));
            result->count++;
        }
    }
    return LUMI_OK;
}

/* Convex hull of 3-D points, or Delaunay triangulation of 2-D ones. An empty result where Qhull finds them flat. */
static int run_qhull(int dimension, int count, double *coordinates, struct triangulation *result,
                     struct lumi_error *error)
{
    qhT context, *qh = &context;
    char hull[] = "qhull Qt", delaunay[] = "qhull d Qt Qbb Qz";
    int current, total, code = LUMI_OK;
    FILE *sink = fopen("/dev/null", "w");

    *result = (struct triangulation){0};
    if (!sink)
        return lumi_fail_errno(error, "/dev/null", "open");
    qh_zero(qh, sink);
    if (!qh_new_qhull(qh, dimension, count, coordinates, False, dimension == 3 ? hull : delaunay, NULL, sink))
        code = take_facets(qh, dimension == 2, result);
    qh_freeqhull(qh, !qh_ALL);
    qh_memfreeshort(qh, &current, &total);
    fclose(sink);
    if (code != LUMI_OK)
        lumi_fail(error, code, "camera mesh: not enough memory");
    return code;
}

int lumi_camera_triangles(int count, const struct lumi_pose *poses, enum lumi_surface surface, struct lumi_vec3 centre,
                          int **triangles, int *triangle_count, struct lumi_error *error)
{
    struct lumi_vec3 *points = lumi_alloc((size_t)count, sizeof *points), axes[3];
    double *coordinates = lumi_alloc((size_t)count, 3 * sizeof *coordinates), spread[3];
    struct triangulation result = {0};
    int code = LUMI_OK;

    *triangles = NULL;
    *triangle_count = 0;
    if (!points || !coordinates) {
        code = lumi_fail(error, LUMI_ERR_NOMEM, "camera mesh: not enough memory");
        goto out;
    }
    for (int i = 0; i < count; i++) {
        points[i] = lumi_sub(poses[i].t, centre);
        if (surface == LUMI_SURFACE_SPHERE)
            points[i] = lumi_scale(points[i], 1 / fmax(lumi_length(points[i]), 1e-12));
    }
    struct lumi_vec3 mean = centroid(count, points);
    principal_axes(count, points, mean, axes, spread);
    int rank = surface == LUMI_SURFACE_SPHERE ? 3 : 2;
    if (count <= rank || spread[rank - 1] < 1e-4 * spread[0])
        goto out;
    for (int i = 0; i < count; i++) {
        struct lumi_vec3 d = lumi_sub(points[i], mean);
        for (int k = 0; k < rank; k++)
            coordinates[rank * i + k] = rank == 3 ? (k == 0   ? points[i].x
                                                     : k == 1 ? points[i].y
                                                              : points[i].z)
                                                  : lumi_dot(d, axes[k]);
    }
    LUMI_GOTO(code, out, run_qhull(rank, count, coordinates, &result, error));
    *triangles = result.triangles;
    *triangle_count = result.count;
out:
    lumi_free(points);
    lumi_free(coordinates);
    return code;
}

static void grow(struct lumi_disk *disk, const struct lumi_pose *own, struct lumi_vec3 other)
{
    struct lumi_vec3 d = lumi_to_camera(own, other);
    float u = (float)d.x, v = (float)d.y;

    disk->u_pos = fmaxf(disk->u_pos, u);
    disk->u_neg = fmaxf(disk->u_neg, -u);
    disk->v_pos = fmaxf(disk->v_pos, v);
    disk->v_neg = fmaxf(disk->v_neg, -v);
}

struct ordered {
    double key;
    int index;
};

static int by_key(const void *a, const void *b)
{
    const struct ordered *x = a, *y = b;

    return x->key < y->key ? -1 : x->key > y->key ? 1 : x->index - y->index;
}

/* Centres on a line or a ring: the neighbours are the two next along it. */
static int grow_along_curve(int count, const struct lumi_pose *poses, bool ring, struct lumi_vec3 centre,
                            struct lumi_disk *disks)
{
    struct ordered *order = lumi_alloc((size_t)count, sizeof *order);
    struct lumi_vec3 *points = lumi_alloc((size_t)count, sizeof *points), axes[3];
    double spread[3];

    if (!order || !points) {
        lumi_free(order);
        lumi_free(points);
        return LUMI_ERR_NOMEM;
    }
    for (int i = 0; i < count; i++)
        points[i] = poses[i].t;
    principal_axes(count, points, ring ? centre : centroid(count, points), axes, spread);
    for (int i = 0; i < count; i++) {
        struct lumi_vec3 d = lumi_sub(points[i], centre);
        order[i].index = i;
        order[i].key = ring ? atan2(lumi_dot(d, axes[1]), lumi_dot(d, axes[0])) : lumi_dot(d, axes[0]);
    }
    qsort(order, (size_t)count, sizeof *order, by_key);
    for (int i = 0; i + !ring < count; i++) {
        int a = order[i].index, b = order[(i + 1) % count].index;
        grow(&disks[a], &poses[a], poses[b].t);
        grow(&disks[b], &poses[b], poses[a].t);
    }
    lumi_free(order);
    lumi_free(points);
    return LUMI_OK;
}

static void mend_axis(float *negative, float *positive, float least)
{
    /* A side whose farthest neighbour is this near is no side: rows that are not quite straight. */
    float few = 0.2f * fmaxf(*negative, *positive);

    if (*negative <= fmaxf(few, least))
        *negative = *positive;
    if (*positive <= fmaxf(few, least))
        *positive = *negative;
}

static void mend(struct lumi_disk *disk, double missing, double spacing)
{
    float least = (float)(1e-3 * spacing);

    mend_axis(&disk->u_neg, &disk->u_pos, least);
    mend_axis(&disk->v_neg, &disk->v_pos, least);
    if (disk->u_pos <= least && disk->v_pos <= least)
        *disk = (struct lumi_disk){(float)spacing, (float)spacing, (float)spacing, (float)spacing};
    if (disk->v_pos <= 0.05f * disk->u_pos)
        disk->v_neg = disk->v_pos = missing > 0 ? (float)missing : fmaxf(disk->u_pos, disk->u_neg);
    if (disk->u_pos <= 0.05f * disk->v_pos)
        disk->u_neg = disk->u_pos = missing > 0 ? (float)missing : fmaxf(disk->v_pos, disk->v_neg);
}

int lumi_disks_make(int count, const struct lumi_pose *poses, enum lumi_surface surface, struct lumi_vec3 centre,
                    double radius, double scale, struct lumi_disk *disks, struct lumi_error *error)
{
    int *triangles = NULL, triangle_count = 0;
    bool sphere = surface == LUMI_SURFACE_SPHERE, curve = false;

    memset(disks, 0, (size_t)count * sizeof *disks);
    LUMI_TRY(lumi_camera_triangles(count, poses, surface, centre, &triangles, &triangle_count, error));
    for (int t = 0; t < triangle_count; t++)
        for (int k = 0; k < 3; k++) {
            int a = triangles[3 * t + k], b = triangles[3 * t + (k + 1) % 3];
            grow(&disks[a], &poses[a], poses[b].t);
            grow(&disks[b], &poses[b], poses[a].t);
        }
    lumi_free(triangles);
    if (triangle_count == 0 && count > 1) {
        curve = true;
        if (grow_along_curve(count, poses, sphere && count > 2, centre, disks) != LUMI_OK)
            return lumi_fail(error, LUMI_ERR_NOMEM, "disks: not enough memory");
    }
    double spacing = radius > 0 ? radius / sqrt(count) : 0.1;
    for (int i = 0; i < count; i++) {
        mend(&disks[i], sphere && curve ? radius : 0, spacing);
        disks[i].u_neg *= (float)scale, disks[i].u_pos *= (float)scale;
        disks[i].v_neg *= (float)scale, disks[i].v_pos *= (float)scale;
    }
    return LUMI_OK;
}
