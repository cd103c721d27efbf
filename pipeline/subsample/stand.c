/* The room of the stand as a cylinder that ends in a cone. */
#include "pipeline/subsample/stand.h"

bool lumi_stand_place(struct lumi_vec3 centre, double sphere, double gap, double radius, double floor,
                      struct lumi_stand *stand)
{
    const double hole = sphere * sin(gap);

    *stand = (struct lumi_stand){
        .centre = centre, .top = centre.z - sphere, .bottom = floor, .wide = radius > 0 ? radius : LUMI_STAND_RADIUS};
    /* Cameras go round it: what stands in the hole is narrower than that. */
    stand->narrow = fmin(0.9 * hole, stand->wide);
    stand->head = fmin(fmax(stand->narrow, LUMI_STAND_HEAD), stand->wide);
    return hole > 0 && stand->bottom < stand->top;
}

static double radius_at(const struct lumi_stand *stand, double z)
{
    const double part = (stand->top - z) / (stand->top - stand->bottom);

    return part <= 0 ? stand->narrow : stand->narrow + (stand->wide - stand->narrow) * part;
}

bool lumi_stand_holds(const struct lumi_stand *stand, struct lumi_vec3 point, double margin)
{
    if (point.z > stand->centre.z || point.z < stand->bottom + margin)
        return false;
    return hypot(point.x - stand->centre.x, point.y - stand->centre.y) < radius_at(stand, point.z);
}

bool lumi_stand_seen(const struct lumi_stand *stand, const struct lumi_lens *lens, const struct lumi_pose *pose)
{
    enum { HEIGHTS = 24, AROUND = 16 };

    for (int i = 0; i <= HEIGHTS; i++) {
        const double z = stand->centre.z + (stand->bottom - stand->centre.z) * i / HEIGHTS, r = radius_at(stand, z);
        for (int k = 0; k <= AROUND; k++) {
            const double turn = 2 * LUMI_PI * k / AROUND, out = k == AROUND ? 0 : r;
            const struct lumi_vec3 point =
                lumi_vec3(stand->centre.x + out * cos(turn), stand->centre.y + out * sin(turn), z);
            double x, y;
            if (lumi_lens_project(lens, lumi_to_camera(pose, point), &x, &y) && x >= 0 && y >= 0 && x < lens->width &&
                y < lens->height)
                return true;
        }
    }
    return false;
}
