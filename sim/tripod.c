/* The tripod, and the arm's end. */
#include "sim/tripod.h"

#include "sim/things.h"

#define FLOOR (-1.2f)
#define SIDE 3 /* rays a side of a pixel */

void sim_stand_add(struct sim_scene *scene, double radius)
{
    const float r = (float)radius, head = fmaxf(-r - 0.04f, FLOOR + 0.2f), hub = fmaxf(head - 0.16f, FLOOR + 0.1f);
    const float spread = fmaxf(0.25f, 0.7f * (hub - FLOOR));
    int paint = sim_solid(scene, v3(0.05f, 0.05f, 0.055f), 0.2f, 0.05f, 0.3f, 901);
    int metal = sim_metal(scene, v3(0.55f, 0.56f, 0.58f), 0.3f);

    sim_scene_place(scene, v3(0, 0, 0), 0, 1);
    sim_bar(scene, v3(0, 0, head - 0.03f), v3(0, 0, head), 0.07f, 24, paint);
    sim_bar(scene, v3(0, 0, hub - 0.12f), v3(0, 0, head - 0.03f), 0.03f, 20, metal);
    sim_ball(scene, v3(0, 0, hub), 0.055f, 12, paint);
    for (int i = 0; i < 3; i++) {
        float angle = (float)LUMI_PI * (2 * (float)i / 3 + 0.2f);
        sim_bar(scene, v3(0.03f * cosf(angle), 0.03f * sinf(angle), hub),
                v3(spread * cosf(angle), spread * sinf(angle), FLOOR), 0.018f, 14, paint);
    }
}

/* How much of the rod a ray from the camera's centre meets: its brightness, below 0 for none. The rod: from `top` along
 * `along`. */
static double rod_light(struct lumi_vec3 d)
{
    const struct lumi_vec3 top = {0.006, 0.05, 0.085}, along = lumi_normalize(lumi_vec3(0.05, 0.9, -0.25));
    const double radius = 0.007;
    struct lumi_vec3 across = lumi_cross(d, along);
    double sine = lumi_length(across), apart = lumi_dot(top, across) / sine;

    if (!(sine > 1e-9) || fabs(apart) >= radius)
        return -1;
    /* The point of the rod's axis nearest to the ray: along it from its top, in front of the camera. */
    double b = lumi_dot(d, along), k = (b * lumi_dot(top, d) - lumi_dot(top, along)) / (1 - b * b);
    double t = lumi_dot(lumi_add(top, lumi_scale(along, k)), d);
    if (k < 0 || t <= 0)
        return -1;
    return 0.02 + 0.05 * sqrt(1 - apart * apart / (radius * radius)) + 0.015 * apart / radius;
}

void sim_arm_draw(const struct lumi_lens *lens, struct lumi_raster *picture)
{
    const double share = 1.0 / (SIDE * SIDE);

    for (int y = 0; y < picture->height; y++)
        for (int x = 0; x < picture->width; x++) {
            double covered = 0, light = 0;
            for (int k = 0; k < SIDE * SIDE; k++) {
                struct lumi_vec3 d;
                if (!lumi_lens_unproject(lens, x + (k % SIDE + 0.5) / SIDE, y + (k / SIDE + 0.5) / SIDE, &d))
                    continue;
                double value = rod_light(lumi_normalize(d));
                covered += value >= 0 ? share : 0;
                light += value >= 0 ? share * value : 0;
            }
            float *to = lumi_row_f32(picture, y) + (size_t)x * (size_t)picture->channels;
            for (int c = 0; covered > 0 && c < picture->channels; c++)
                to[c] = to[c] * (float)(1 - covered) + (float)light;
        }
}
