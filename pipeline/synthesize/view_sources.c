/* Which photographs a view is made of. */
#include "pipeline/synthesize/view_synthesis.h"

enum { SECTORS = 12, NEAR = 12 };

struct choice {
    double distance;
    int index;
};

static bool nearer(struct choice a, struct choice b)
{
    return a.distance != b.distance ? a.distance < b.distance : a.index < b.index;
}

/* Puts `item` where it belongs among the `count` there are, of which `limit` are kept; one that is there stays once. */
static int insert(struct choice *list, int count, int limit, struct choice item)
{
    int at = count;

    for (int i = 0; i < count; i++)
        if (list[i].index == item.index)
            return count;
    while (at > 0 && nearer(item, list[at - 1]))
        at--;
    if (item.index < 0 || at >= limit)
        return count;
    count = count < limit ? count + 1 : limit;
    for (int i = count - 1; i > at; i--)
        list[i] = list[i - 1];
    list[at] = item;
    return count;
}

static int sector_of(const struct lumi_pose *view, struct lumi_vec3 point)
{
    const struct lumi_vec3 offset = lumi_to_camera(view, point);

    return ((int)floor(atan2(offset.y, offset.x) / (2 * LUMI_PI) * SECTORS + 0.5) + SECTORS) % SECTORS;
}

int lumi_synthesis_sources(int count, const struct lumi_pose *poses, const struct lumi_pose *view, int skip, double far,
                           int sources[LUMI_SYNTHESIS_SOURCES])
{
    struct choice near[SECTORS], wide[SECTORS], nearest[NEAR], chosen[LUMI_SYNTHESIS_SOURCES];
    int nearest_count = 0, chosen_count = 0;

    for (int i = 0; i < SECTORS; i++)
        near[i] = wide[i] = (struct choice){INFINITY, -1};
    for (int i = 0; i < count; i++) {
        struct choice item = {lumi_length(lumi_sub(poses[i].t, view->t)), i};
        if (i == skip || lumi_dot(lumi_axis(&poses[i], 2), lumi_axis(view, 2)) < 0.5)
            continue;
        const int sector = sector_of(view, poses[i].t);
        if (nearer(item, near[sector]))
            near[sector] = item;
        nearest_count = insert(nearest, nearest_count, NEAR, item);
        item.distance = fabs(item.distance - far);
        if (nearer(item, wide[sector]))
            wide[sector] = item;
    }
    for (int i = 0; i < SECTORS; i++)
        if (near[i].index >= 0 && near[i].distance <= 3 * nearest[0].distance)
            chosen_count = insert(chosen, chosen_count, NEAR, near[i]);
    for (int i = 0; i < nearest_count && chosen_count < NEAR; i++)
        chosen_count = insert(chosen, chosen_count, NEAR, nearest[i]);
    for (int i = 0; far > 0 && i < SECTORS; i++)
        if (wide[i].index >= 0) {
            const struct lumi_vec3 offset = lumi_sub(poses[wide[i].index].t, view->t);
            wide[i].distance = lumi_length(offset);
            chosen_count = insert(chosen, chosen_count, LUMI_SYNTHESIS_SOURCES, wide[i]);
        }
    for (int i = 0; i < chosen_count; i++)
        sources[i] = chosen[i].index;
    return chosen_count;
}
