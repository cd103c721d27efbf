/* Which views a view is matched against. */
#include "pipeline/depth/mvs.h"

#include "pipeline/run/nearest.h"

#include <math.h>

enum { SECTORS = 8, ENOUGH = 5 };

static double turned(const struct lumi_pose *a, const struct lumi_pose *b)
{
    return lumi_dot(lumi_axis(a, 2), lumi_axis(b, 2));
}

/* The eighth of the circle, in the view's image plane, in which another view lies; the first is centred on +x. */
static int sector_of(const struct lumi_pose *view, const struct lumi_pose *other)
{
    struct lumi_vec3 offset = lumi_to_camera(view, other->t);
    double eighth = atan2(offset.y, offset.x) / (LUMI_PI / 4) + 0.5;

    return ((int)floor(eighth) + SECTORS) % SECTORS;
}

int lumi_mvs_neighbours(int count, const struct lumi_pose *poses, int index, int wanted,
                        int neighbours[LUMI_MVS_NEIGHBOURS])
{
    struct lumi_near sector[SECTORS], near[2 * LUMI_MVS_NEIGHBOURS], chosen[LUMI_MVS_NEIGHBOURS];
    const int limit = wanted > 0 && wanted < LUMI_MVS_NEIGHBOURS ? wanted : LUMI_MVS_NEIGHBOURS;
    int near_count = 0, chosen_count = 0;

    for (int i = 0; i < SECTORS; i++)
        sector[i] = (struct lumi_near){INFINITY, -1};
    for (int i = 0; i < count; i++) {
        struct lumi_near item = {lumi_length(lumi_sub(poses[i].t, poses[index].t)), i};
        if (i == index || !(item.distance > 1e-6) || turned(&poses[i], &poses[index]) < 0.766)
            continue;
        int s = sector_of(&poses[index], &poses[i]);
        if (lumi_nearer(item, sector[s]))
            sector[s] = item;
        near_count = lumi_nearest_insert(near, near_count, 2 * LUMI_MVS_NEIGHBOURS, item);
    }
    /* A sector's nearest view counts only if it is about as near as the others: beyond the capture's border there is
     * nothing, and far views see too little of the same. */
    for (int i = 0; i < SECTORS; i++)
        if (sector[i].index >= 0 && sector[i].distance <= 3 * near[0].distance)
            chosen_count = lumi_nearest_insert(chosen, chosen_count, limit, sector[i]);
    const int enough = limit < ENOUGH ? limit : ENOUGH;
    for (int i = 0; i < near_count && chosen_count < enough; i++)
        chosen_count = lumi_nearest_insert(chosen, chosen_count, limit, near[i]);
    for (int i = 0; i < chosen_count; i++)
        neighbours[i] = chosen[i].index;
    return chosen_count;
}
