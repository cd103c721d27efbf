/* Which photographs a view is made of. */
#include "pipeline/synthesize/view_synthesis.h"

#include "pipeline/run/nearest.h"

enum { SECTORS = 12, NEAR = 12 };

static int sector_of(const struct lumi_pose *view, struct lumi_vec3 point)
{
    const struct lumi_vec3 offset = lumi_to_camera(view, point);

    return ((int)floor(atan2(offset.y, offset.x) / (2 * LUMI_PI) * SECTORS + 0.5) + SECTORS) % SECTORS;
}

int lumi_synthesis_sources(int count, const struct lumi_pose *poses, const struct lumi_pose *view, int skip, double far,
                           int sources[LUMI_SYNTHESIS_SOURCES])
{
    struct lumi_near near[SECTORS], wide[SECTORS], nearest[NEAR], chosen[LUMI_SYNTHESIS_SOURCES];
    int nearest_count = 0, chosen_count = 0;

    for (int i = 0; i < SECTORS; i++)
        near[i] = wide[i] = (struct lumi_near){INFINITY, -1};
    for (int i = 0; i < count; i++) {
        struct lumi_near item = {lumi_length(lumi_sub(poses[i].t, view->t)), i};
        if (i == skip || lumi_dot(lumi_axis(&poses[i], 2), lumi_axis(view, 2)) < 0.5)
            continue;
        const int sector = sector_of(view, poses[i].t);
        if (lumi_nearer(item, near[sector]))
            near[sector] = item;
        nearest_count = lumi_nearest_insert(nearest, nearest_count, NEAR, item);
        item.distance = fabs(item.distance - far);
        if (lumi_nearer(item, wide[sector]))
            wide[sector] = item;
    }
    for (int i = 0; i < SECTORS; i++)
        if (near[i].index >= 0 && near[i].distance <= 3 * nearest[0].distance)
            chosen_count = lumi_nearest_insert(chosen, chosen_count, NEAR, near[i]);
    for (int i = 0; i < nearest_count && chosen_count < NEAR; i++)
        chosen_count = lumi_nearest_insert(chosen, chosen_count, NEAR, nearest[i]);
    for (int i = 0; far > 0 && i < SECTORS; i++)
        if (wide[i].index >= 0) {
            const struct lumi_vec3 offset = lumi_sub(poses[wide[i].index].t, view->t);
            wide[i].distance = lumi_length(offset);
            chosen_count = lumi_nearest_insert(chosen, chosen_count, LUMI_SYNTHESIS_SOURCES, wide[i]);
        }
    for (int i = 0; i < chosen_count; i++)
        sources[i] = chosen[i].index;
    return chosen_count;
}
