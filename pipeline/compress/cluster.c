/* Groups of neighbouring views. */
#include "pipeline/compress/cluster.h"

#include "proto/base/memory.h"
#include "proto/base/sort.h"

#include <stdlib.h>
#include <string.h>

struct place {
    double at[3];
    int view;
};

static int by_axis(const struct place *a, const struct place *b, int axis)
{
    if (a->at[axis] != b->at[axis])
        return a->at[axis] < b->at[axis] ? -1 : 1;
    return a->view - b->view;
}
static int by_x(const void *a, const void *b)
{
    return by_axis(a, b, 0);
}
static int by_y(const void *a, const void *b)
{
    return by_axis(a, b, 1);
}
static int by_z(const void *a, const void *b)
{
    return by_axis(a, b, 2);
}
static int by_view(const void *a, const void *b)
{
    return ((const struct place *)a)->view - ((const struct place *)b)->view;
}

static int longest_axis(const struct place *places, int count)
{
    int longest = 0;
    double extent = -1;

    for (int axis = 0; axis < 3; axis++) {
        double low = places[0].at[axis], high = low;
        for (int i = 1; i < count; i++) {
            low = places[i].at[axis] < low ? places[i].at[axis] : low;
            high = places[i].at[axis] > high ? places[i].at[axis] : high;
        }
        if (high - low > extent) {
            extent = high - low;
            longest = axis;
        }
    }
    return longest;
}

/* Cuts places into `leaves` runs of even size; first[] gets where each begins. */
static void split(struct place *places, int begin, int end, int leaves, int *first)
{
    static int (*const orders[3])(const void *, const void *) = {by_x, by_y, by_z};

    if (leaves == 1) {
        *first = begin;
        return;
    }
    int count = end - begin, left = leaves / 2;
    int middle = begin + (int)((long long)count * left / leaves);
    qsort(places + begin, (size_t)count, sizeof *places, orders[longest_axis(places + begin, count)]);
    split(places, begin, middle, left, first);
    split(places, middle, end, leaves - left, first + left);
}

static double square_distance(const struct place *place, const double at[3])
{
    double sum = 0;

    for (int axis = 0; axis < 3; axis++)
        sum += (place->at[axis] - at[axis]) * (place->at[axis] - at[axis]);
    return sum;
}

static void centroid(const struct place *places, int count, double at[3])
{
    for (int axis = 0; axis < 3; axis++) {
        at[axis] = 0;
        for (int i = 0; i < count; i++)
            at[axis] += places[i].at[axis] / count;
    }
}

/* Sorts a cluster's places: the nearest to the centroid, then by view. */
static void arrange(struct place *places, int count)
{
    double middle[3];
    int nearest = 0;

    qsort(places, (size_t)count, sizeof *places, by_view);
    centroid(places, count, middle);
    for (int i = 1; i < count; i++)
        if (square_distance(&places[i], middle) < square_distance(&places[nearest], middle) * (1 - 1e-9))
            nearest = i;
    struct place reference = places[nearest];
    memmove(places + 1, places, (size_t)nearest * sizeof *places);
    places[0] = reference;
}

/* Puts clusters into an order in which each follows the nearest one not yet taken, from the first. */
static void chain(const struct place *places, const int *first, int count, int *order)
{
    for (int i = 0; i < count; i++)
        order[i] = i;
    for (int i = 1; i < count; i++) {
        int nearest = i;
        const double *from = places[first[order[i - 1]]].at;
        for (int k = i + 1; k < count; k++)
            if (square_distance(&places[first[order[k]]], from) < square_distance(&places[first[order[nearest]]], from))
                nearest = k;
        int taken = order[nearest];
        order[nearest] = order[i];
        order[i] = taken;
    }
}

void lumi_clusters_finish(struct lumi_clusters *clusters)
{
    lumi_free(clusters->first);
    lumi_free(clusters->members);
    *clusters = (struct lumi_clusters){0};
}

static void fill(struct place *places, int view_count, int *begins, int *order, struct lumi_clusters *clusters)
{
    int count = clusters->count, at = 0;

    split(places, 0, view_count, count, begins);
    begins[count] = view_count;
    for (int i = 0; i < count; i++)
        arrange(places + begins[i], begins[i + 1] - begins[i]);
    chain(places, begins, count, order);
    for (int i = 0; i < count; i++) {
        clusters->first[i] = at;
        for (int k = begins[order[i]]; k < begins[order[i] + 1]; k++)
            clusters->members[at++] = places[k].view;
    }
    clusters->first[count] = at;
}

int lumi_clusters_make(int view_count, const struct lumi_pose *poses, int size, struct lumi_clusters *clusters,
                       struct lumi_error *error)
{
    *clusters = (struct lumi_clusters){0};
    if (view_count < 1 || size < 1)
        return lumi_fail(error, LUMI_ERR_ARG, "clusters of %d of %d views cannot be made", size, view_count);

    int count = (view_count + size - 1) / size, code = LUMI_OK;
    struct place *places = lumi_alloc((size_t)view_count, sizeof *places);
    int *begins = lumi_alloc(2 * (size_t)count + 1, sizeof *begins);
    clusters->count = count;
    clusters->first = lumi_alloc((size_t)count + 1, sizeof *clusters->first);
    clusters->members = lumi_alloc((size_t)view_count, sizeof *clusters->members);
    if (places && begins && clusters->first && clusters->members) {
        for (int i = 0; i < view_count; i++)
            places[i] = (struct place){{poses[i].t.x, poses[i].t.y, poses[i].t.z}, i};
        fill(places, view_count, begins, begins + count + 1, clusters);
    } else {
        lumi_clusters_finish(clusters);
        code = lumi_fail(error, LUMI_ERR_NOMEM, "no memory for clusters of views");
    }
    lumi_free(places);
    lumi_free(begins);
    return code;
}

int lumi_coarse_views(int view_count, const struct lumi_pose *poses, int **views, int *count, struct lumi_error *error)
{
    struct lumi_clusters clusters;
    int size = view_count < 4 * LUMI_COARSE_SHARE ? 1 : LUMI_COARSE_SHARE;

    LUMI_TRY(lumi_clusters_make(view_count, poses, size, &clusters, error));
    *count = clusters.count;
    *views = lumi_alloc((size_t)clusters.count, sizeof **views);
    for (int i = 0; *views && i < clusters.count; i++)
        (*views)[i] = clusters.members[clusters.first[i]];
    lumi_clusters_finish(&clusters);
    if (!*views)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for the views of the coarse level");
    lumi_sort_ints(*views, *count);
    return LUMI_OK;
}
