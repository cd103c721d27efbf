/* object: a still life 0.5 m wide in the origin, to be looked at from outside; walls at 2.5 m around it. The one place
 * that does not leave its middle free. */
#include "sim/place.h"
#include "sim/things.h"

static void backdrop(struct sim_scene *s)
{
    struct sim_material shine;
    const float r = 2.5f, w = 1.1f;
    int paint[2] = {sim_paint(s, v3(0.44f, 0.46f, 0.48f), 0.18f, 1), sim_paint(s, v3(0.50f, 0.46f, 0.40f), 0.18f, 2)};

    sim_material_init(&shine);
    shine.emission = v3_grey(4);
    int lamp = sim_scene_material(s, &shine);
    sim_quad(s, v3(-r, -r, -r), v3(2 * r, 0, 0), v3(0, 2 * r, 0), 0.2f, paint[1]);
    sim_quad(s, v3(-r, r, r), v3(2 * r, 0, 0), v3(0, -2 * r, 0), 0.2f, paint[1]);
    for (int i = 0; i < 4; i++) {
        sim_scene_place(s, v3(0, 0, 0), 90.0f * (float)i, 1);
        sim_quad(s, v3(-r, r, -r), v3(2 * r, 0, 0), v3(0, 0, 2 * r), 0.2f, paint[i & 1]);
    }
    /* A shining panel above. */
    sim_scene_place(s, v3(0, 0, 0), 0, 1);
    sim_quad(s, v3(-w, w, r - 0.02f), v3(2 * w, 0, 0), v3(0, -2 * w, 0), 0.4f, lamp);
    sim_scene_light(s, v3(-w, w, r - 0.02f), v3(2 * w, 0, 0), v3(0, -2 * w, 0), 1);
}

static void build(struct sim_scene *s)
{
    const float board[][2] = {{0.001f, -0.20f}, {0.27f, -0.20f}, {0.28f, -0.185f}, {0.27f, -0.17f}, {0.001f, -0.17f}};
    int wood = sim_wood(s, v3(0.50f, 0.32f, 0.16f), v3(0.26f, 0.14f, 0.06f), 0, 3);
    int glaze = sim_solid(s, v3(0.05f, 0.13f, 0.32f), 0.25f, 0.05f, 0.01f, 4),
        brass = sim_paint(s, v3(0.55f, 0.38f, 0.12f), 0.1f, 5);
    int chrome = sim_metal(s, v3(0.92f, 0.93f, 0.95f), 0), clay = sim_solid(s, v3(0.55f, 0.30f, 0.14f), 0.25f, 0, 0, 6);
    const int fruit[3] = {sim_solid(s, v3(0.60f, 0.10f, 0.05f), 0.28f, 0.03f, 0.05f, 7),
                          sim_solid(s, v3(0.70f, 0.36f, 0.04f), 0.16f, 0, 0, 8),
                          sim_solid(s, v3(0.34f, 0.42f, 0.06f), 0.24f, 0.03f, 0.05f, 9)};
    int book = sim_pattern_material(s, SIM_PRINT, v3(0.42f, 0.06f, 0.05f), v3(0.75f, 0.6f, 0.3f), v3_grey(0), 0.010f,
                                    0.022f, 0.16f, 10);
    struct sim_material leaf;

    s->indoors = true;
    s->sky.ambient = v3_grey(0.4f);
    sim_material_init(&leaf);
    leaf.color = v3(0.09f, 0.24f, 0.05f);
    leaf.amplitude = 0.3f;
    leaf.thin = true;
    int green = sim_scene_material(s, &leaf);
    backdrop(s);
    sim_lathe(s, v3(0, 0, 0), board, 5, 64, wood);
    sim_scene_place(s, v3(-0.09f, 0.08f, -0.17f), 0, 1);
    sim_vase(s, 0.26f, glaze);
    for (int i = 0; i < 14; i++) {
        float a = 2.4f * (float)i, up = 0.2f + 0.13f * sim_hash(i, 1, 5);
        sim_leaf(s, v3(0, 0, 0.24f), v3(cosf(a), sinf(a), 1.4f), v3(0, 0, 1), up, 0.05f, 0.9f, 5, green);
    }
    sim_scene_place(s, v3(0.11f, -0.02f, -0.17f), 0, 1);
    sim_bowl(s, 0.11f, clay, fruit, 3);
    sim_scene_place(s, v3(-0.10f, -0.11f, -0.17f), 25, 1);
    sim_box(s, v3(-0.07f, -0.05f, 0), v3(0.07f, 0.05f, 0.03f), 0.03f, book);
    sim_ball(s, v3(0, 0, 0.07f), 0.04f, 40, chrome);
    sim_scene_place(s, v3(0.10f, 0.14f, -0.16f), 0, 1);
    sim_cage(s, 0.06f, 0.13f, 16, brass);
    sim_scene_place(s, v3(0, 0, 0), 0, 1);
}

const struct sim_place sim_object = {"object", "a still life, for cameras that look inwards", build};
