/* Which views a view is matched against. */
#include "pipeline/depth/mvs.h"

#include <math.h>

enum { SECTORS = 8, ENOUGH = 5 };

struct candidate {
    double distance;
    int index;
};

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

static bool nearer(struct candidate a, struct candidate b)
{
    return a.distance != b.distance ? a.distance < b.distance : a.index < b.index;
}

/* Puts `item` in its place among the `count` there are; keeps at most `limit`. */
static int insert(struct candidate *list, int count, int limit, struct candidate item)
{
    int at = count;

    while (at > 0 && nearer(item, list[at - 1]))
        at--;
    if (at >= limit)
        return count;
    count = count < limit ? count + 1 : limit;
    for (int i = count - 1; i > at; i--)
        list[i] = list[i - 1];
    list[at] = item;
    return count;
}

int lumi_mvs_neighbours(int count, const struct lumi_pose *poses, int index, int wanted,
                        int neighbours[LUMI_MVS_NEIGHBOURS])
{
    struct candidate sector[SECTORS], near[2 * LUMI_MVS_NEIGHBOURS], chosen[LUMI_MVS_NEIGHBOURS];
    const int limit = wanted > 0 && wanted < LUMI_MVS_NEIGHBOURS ? wanted : LUMI_MVS_NEIGHBOURS;
    int near_count = 0, chosen_count = 0;

    for (int i = 0; i < SECTORS; i++)
        sector[i] = (struct candidate){INFINITY, -1};
    for (int i = 0; i < count; i++) {
        struct candidate item = {lumi_length(lumi_sub(poses[i].t, poses[index].t)), i};
        if (i == index || !(item.distance > 1e-6) || turned(&poses[i], &poses[index]) < 0.766)
            continue;
        int s = sector_of(&poses[index], &poses[i]);
        if (nearer(item, sector[s]))
            sector[s] = item;
        near_count = insert(near, near_count, 2 * LUMI_MVS_NEIGHBOURS, item);
    }
    /* A sector's nearest view counts only if it is about as near as the others: beyond the capture's border there is
     * nothing, and far views see too little of the same. */
    for (int i = 0; i < SECTORS; i++)
        if (sector[i].index >= 0 && sector[i].distance <= 3 * near[0].distance)
            chosen_count = insert(chosen, chosen_count, limit, sector[i]);
    const int enough = limit < ENOUGH ? limit : ENOUGH;
    for (int i = 0; i < near_count && chosen_count < enough; i++) {
        bool there = false;
        for (int j = 0; j < chosen_count; j++)
            there = there || chosen[j].index == near[i].index;
        if (!there)
            chosen_count = insert(chosen, chosen_count, limit, near[i]);
    }
    for (int i = 0; i < chosen_count; i++)
        neighbours[i] = chosen[i].index;
    return chosen_count;
}
