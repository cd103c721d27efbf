/* room: an interior of about 7 m by 6.4 m around the rig. */
#include "sim/place.h"
#include "sim/things.h"

/* The room: floor, ceiling and walls, metres. */
#define X0 (-2.9f)
#define X1 4.2f
#define Y0 (-3.0f)
#define Y1 3.4f
#define Z0 (-1.2f)
#define Z1 1.5f
#define GRID 0.09f

enum { COVERS = 9 };

struct shared {
    int wood, dark_wood, white, black, chrome, steel, brass, leaf, paper;
    int covers[COVERS];
};

static void make_covers(struct sim_scene *s, struct shared *m)
{
    const struct sim_v3 colors[COVERS] = {{0.42f, 0.06f, 0.05f}, {0.05f, 0.11f, 0.28f}, {0.07f, 0.20f, 0.10f},
                                          {0.55f, 0.42f, 0.22f}, {0.70f, 0.66f, 0.56f}, {0.10f, 0.10f, 0.11f},
                                          {0.50f, 0.22f, 0.06f}, {0.22f, 0.10f, 0.24f}, {0.14f, 0.32f, 0.36f}};

    for (int i = 0; i < COVERS; i++) {
        bool light = colors[i].y > 0.3f;
        struct sim_v3 ink = light ? v3(0.12f, 0.06f, 0.04f) : v3(0.75f, 0.6f, 0.3f);
        m->covers[i] =
            sim_pattern_material(s, SIM_PRINT, colors[i], ink, ink, 0.010f, 0.022f, 0.16f, 100u + (unsigned)i);
    }
}

static void make_shared(struct sim_scene *s, struct shared *m)
{
    m->wood = sim_wood(s, v3(0.50f, 0.32f, 0.16f), v3(0.26f, 0.14f, 0.06f), 0, 1);
    m->dark_wood = sim_wood(s, v3(0.20f, 0.11f, 0.06f), v3(0.08f, 0.04f, 0.02f), 0, 2);
    m->white = sim_paint(s, v3(0.78f, 0.76f, 0.72f), 0.04f, 3);
    m->black = sim_paint(s, v3(0.03f, 0.03f, 0.035f), 0.10f, 4);
    m->chrome = sim_metal(s, v3(0.92f, 0.93f, 0.95f), 0);
    m->steel = sim_solid(s, v3(0.32f, 0.33f, 0.35f), 0.08f, 0, 0, 6);
    m->brass = sim_solid(s, v3(0.55f, 0.38f, 0.12f), 0.10f, 0, 0, 7);
    struct sim_material leaf;
    sim_material_init(&leaf);
    leaf.color = v3(0.09f, 0.24f, 0.05f);
    leaf.amplitude = 0.3f;
    leaf.wavelength = 0.15f;
    leaf.thin = true;
    m->leaf = sim_scene_material(s, &leaf);
    m->paper = sim_pattern_material(s, SIM_PRINT, v3(0.8f, 0.78f, 0.7f), v3(0.06f, 0.06f, 0.08f), v3_grey(0), 0.004f,
                                    0.009f, 0.03f, 8);
    make_covers(s, m);
}

/* A wall from a along u (horizontal) and v (up) with an opening from (x0, z0) to (x1, z1) in metres along them. */
static void wall_with_window(struct sim_scene *s, struct sim_v3 a, struct sim_v3 u, float length, const float hole[4],
                             int material)
{
    float h = Z1 - Z0;
    const float part[4][4] = {
        {0, 0, hole[0], h}, {hole[2], 0, length, h}, {hole[0], 0, hole[2], hole[1]}, {hole[0], hole[3], hole[2], h}};

    for (int i = 0; i < 4; i++) {
        const float *p = part[i];
        struct sim_v3 origin = v3_along(v3_along(a, u, p[0]), v3(0, 0, 1), p[1]);
        sim_quad_at(s, origin, v3_scale(u, p[2] - p[0]), v3(0, 0, p[3] - p[1]), GRID, material, p[0], p[1]);
    }
}

/* Reveal, frame and bars of a window whose wall's inner face is the plane y = 0, looking out along +y; the opening is
 * width × height from the origin. */
static void window(struct sim_scene *s, float w, float h, const struct shared *m)
{
    const float d = 0.22f, t = 0.035f;

    sim_quad(s, v3(0, 0, 0), v3(w, 0, 0), v3(0, d, 0), GRID, m->white);
    sim_quad(s, v3(0, d, h), v3(w, 0, 0), v3(0, -d, 0), GRID, m->white);
    sim_quad(s, v3(0, d, 0), v3(0, -d, 0), v3(0, 0, h), GRID, m->white);
    sim_quad(s, v3(w, 0, 0), v3(0, d, 0), v3(0, 0, h), GRID, m->white);
    sim_box(s, v3(0, d - 0.06f, 0), v3(w, d - 0.01f, t), 0.1f, m->white);
    sim_box(s, v3(0, d - 0.06f, h - t), v3(w, d - 0.01f, h), 0.1f, m->white);
    for (int i = 0; i <= 2; i++) {
        float x = (w - t) * (float)i / 2;
        sim_box(s, v3(x, d - 0.06f, t), v3(x + t, d - 0.01f, h - t), 0.1f, m->white);
    }
    sim_box(s, v3(t, d - 0.05f, 0.62f * h), v3(w - t, d - 0.02f, 0.62f * h + 0.022f), 0.1f, m->white);
    sim_box(s, v3(-0.06f, -0.10f, -0.03f), v3(w + 0.06f, 0.02f, 0), 0.06f, m->white);
    sim_scene_light(s, v3(t, d, t), v3(w - 2 * t, 0, 0), v3(0, 0, h - 2 * t), 1.6f);
}

static void shell(struct sim_scene *s, const struct shared *m)
{
    int floor_boards = sim_pattern_material(s, SIM_PLANK, v3(0.40f, 0.25f, 0.13f), v3(0.06f, 0.035f, 0.02f),
                                            v3(0.24f, 0.13f, 0.06f), 1.7f, 0.135f, 0.10f, 20);
    int plaster = sim_paint(s, v3(0.66f, 0.60f, 0.50f), 0.06f, 21);
    int ceiling = sim_paint(s, v3(0.80f, 0.79f, 0.76f), 0.025f, 22);
    int wallpaper = sim_pattern_material(s, SIM_WALLPAPER, v3(0.30f, 0.40f, 0.40f), v3(0.52f, 0.56f, 0.48f), v3_grey(0),
                                         0.21f, 0.17f, 0.10f, 23);
    int brick = sim_pattern_material(s, SIM_BRICK, v3(0.46f, 0.17f, 0.10f), v3(0.52f, 0.49f, 0.44f),
                                     v3(0.32f, 0.14f, 0.10f), 0.24f, 0.075f, 0.22f, 24);
    int blue = sim_paint(s, v3(0.28f, 0.34f, 0.42f), 0.09f, 25);
    float lx = X1 - X0, ly = Y1 - Y0;

    sim_quad(s, v3(X0, Y0, Z0), v3(lx, 0, 0), v3(0, ly, 0), GRID, floor_boards);
    sim_quad(s, v3(X0, Y1, Z1), v3(lx, 0, 0), v3(0, -ly, 0), GRID, ceiling);
    for (int i = 0; i < 5; i++)
        sim_box(s, v3(X0 + 0.7f + 1.4f * (float)i, Y0, Z1 - 0.14f), v3(X0 + 0.82f + 1.4f * (float)i, Y1, Z1), 0.1f,
                m->dark_wood);
    /* Roof lights of frosted glass between the beams. */
    struct sim_material frosted;
    sim_material_init(&frosted);
    frosted.emission = v3(0.93f, 0.96f, 0.98f);
    int glass = sim_scene_material(s, &frosted);
    const float roof[2][4] = {{-0.62f, 0.3f, 0.52f, 1.9f}, {0.82f, -2.3f, 1.9f, -0.7f}};
    for (int i = 0; i < 2; i++) {
        const float *r = roof[i], t = 0.04f;
        sim_quad(s, v3(r[0], r[3], Z1 - 0.01f), v3(r[2] - r[0], 0, 0), v3(0, r[1] - r[3], 0), GRID, glass);
        sim_scene_light(s, v3(r[0], r[3], Z1 - 0.01f), v3(r[2] - r[0], 0, 0), v3(0, r[1] - r[3], 0), 3.4f);
        sim_box(s, v3(r[0] - t, r[1] - t, Z1 - 0.04f), v3(r[2] + t, r[1], Z1), 0.1f, m->white);
        sim_box(s, v3(r[0] - t, r[3], Z1 - 0.04f), v3(r[2] + t, r[3] + t, Z1), 0.1f, m->white);
        sim_box(s, v3(r[0] - t, r[1], Z1 - 0.04f), v3(r[0], r[3], Z1), 0.1f, m->white);
        sim_box(s, v3(r[2], r[1], Z1 - 0.04f), v3(r[2] + t, r[3], Z1), 0.1f, m->white);
        for (int k = 1; k < 4; k++) {
            float y = r[1] + (r[3] - r[1]) * 0.25f * (float)k;
            sim_box(s, v3(r[0], y - 0.012f, Z1 - 0.035f), v3(r[2], y + 0.012f, Z1 - 0.015f), 0.1f, m->white);
        }
    }
    const float hole_y[4] = {4.0f, 0.85f, 5.7f, 2.25f}; /* along +x from X0: 1.1 … 2.8 */
    const float hole_x[4] = {1.6f, 0.75f, 3.5f, 2.3f};  /* along −y from Y1: 1.8 … −0.1 */
    wall_with_window(s, v3(X0, Y1, Z0), v3(1, 0, 0), lx, hole_y, wallpaper);
    wall_with_window(s, v3(X1, Y1, Z0), v3(0, -1, 0), ly, hole_x, plaster);
    sim_quad(s, v3(X1, Y0, Z0), v3(-lx, 0, 0), v3(0, 0, Z1 - Z0), GRID, blue);
    sim_quad(s, v3(X0, Y0, Z0), v3(0, ly, 0), v3(0, 0, Z1 - Z0), GRID, brick);
    /* Skirting. */
    sim_box(s, v3(X0, Y1 - 0.02f, Z0), v3(X1, Y1, Z0 + 0.1f), GRID, m->white);
    sim_box(s, v3(X0, Y0, Z0), v3(X1, Y0 + 0.02f, Z0 + 0.1f), GRID, m->white);
    sim_box(s, v3(X1 - 0.02f, Y0, Z0), v3(X1, Y1, Z0 + 0.1f), GRID, m->white);
    sim_scene_place(s, v3(X0 + hole_y[0], Y1, Z0 + hole_y[1]), 0, 1);
    window(s, hole_y[2] - hole_y[0], hole_y[3] - hole_y[1], m);
    sim_scene_place(s, v3(X1, Y1 - hole_x[0], Z0 + hole_x[1]), -90, 1);
    window(s, hole_x[2] - hole_x[0], hole_x[3] - hole_x[1], m);
    sim_scene_place(s, v3(0, 0, 0), 0, 1);
}

/* What is seen through the windows. */
static void outside(struct sim_scene *s, const struct shared *m)
{
    int lawn = sim_pattern_material(s, SIM_GROUND, v3(0.10f, 0.20f, 0.05f), v3(0.16f, 0.24f, 0.07f),
                                    v3(0.22f, 0.20f, 0.10f), 1, 1, 0.25f, 30);
    int bark = sim_solid(s, v3(0.16f, 0.11f, 0.07f), 0.4f, 0, 0, 31);
    int hedge = sim_solid(s, v3(0.07f, 0.15f, 0.05f), 0.35f, 0, 0, 33);
    int wall = sim_pattern_material(s, SIM_BRICK, v3(0.50f, 0.30f, 0.20f), v3(0.5f, 0.48f, 0.42f),
                                    v3(0.36f, 0.2f, 0.14f), 0.5f, 0.18f, 0.2f, 32);

    sim_quad(s, v3(-60, Y1 + 0.3f, Z0 - 0.6f), v3(120, 0, 0), v3(0, 80, 0), 2.5f, lawn);
    sim_quad(s, v3(X1 + 0.3f, -60, Z0 - 0.6f), v3(60, 0, 0), v3(0, 63, 0), 2.5f, lawn);
    sim_box(s, v3(-12, 17, Z0 - 0.6f), v3(30, 17.4f, Z0 + 0.9f), 0.5f, wall);
    sim_box(s, v3(22, -22, Z0 - 0.6f), v3(22.4f, 17, Z0 + 0.9f), 0.5f, wall);
    sim_box(s, v3(-30, 20, Z0 - 0.6f), v3(40, 22, Z0 + 3.4f), 1, hedge);
    sim_box(s, v3(25, -40, Z0 - 0.6f), v3(27, 22, Z0 + 3.8f), 1, hedge);
    const float trees[][3] = {{3.5f, 10, 4.4f}, {8, 14, 5.5f}, {-1, 15, 5},
                              {13, 3, 5},       {17, -4, 6},   {10.5f, -2.5f, 3.6f}};
    for (int i = 0; i < 6; i++) {
        sim_scene_place(s, v3(trees[i][0], trees[i][1], Z0 - 0.6f), 50.0f * (float)i, 1);
        sim_tree(s, trees[i][2], 0.3f * trees[i][2], 4200, bark, m->leaf, 40u + (unsigned)i);
    }
    sim_scene_place(s, v3(0, 0, 0), 0, 1);
}

/* The table and what stands on it: nearest at 0.55 m. */
static void near_table(struct sim_scene *s, const struct shared *m)
{
    int glaze = sim_solid(s, v3(0.05f, 0.13f, 0.32f), 0.25f, 0.06f, 0.004f, 50);
    int mug = sim_solid(s, v3(0.72f, 0.66f, 0.56f), 0.12f, 0.04f, 0.02f, 51);
    int bowl = sim_solid(s, v3(0.55f, 0.30f, 0.14f), 0.22f, 0.03f, 0.05f, 52);
    const int fruit[3] = {sim_solid(s, v3(0.60f, 0.10f, 0.05f), 0.28f, 0.03f, 0.05f, 53),
                          sim_solid(s, v3(0.70f, 0.36f, 0.04f), 0.16f, 0, 0, 54),
                          sim_solid(s, v3(0.34f, 0.42f, 0.06f), 0.24f, 0.03f, 0.05f, 55)};
    const float top = Z0 + 0.74f, y = 0.98f;

    sim_scene_place(s, v3(-0.1f, y, Z0), 0, 1);
    sim_table(s, 1.7f, 0.72f, 0.74f, m->wood, m->dark_wood);
    sim_scene_place(s, v3(-0.62f, y - 0.1f, top), 0, 1);
    sim_vase(s, 0.34f, glaze);
    for (int i = 0; i < 11; i++) {
        float a = 2.4f * (float)i, lean = 0.05f + 0.10f * sim_hash(i, 1, 60);
        struct sim_v3 tip = v3(lean * cosf(a), lean * sinf(a), 0.52f + 0.12f * sim_hash(i, 2, 60));
        sim_bar(s, v3(0, 0, 0.28f), tip, 0.0014f, 5, m->leaf);
        for (int k = 0; k < 5; k++)
            sim_leaf(s, v3_mix(v3(0, 0, 0.28f), tip, 0.5f + 0.12f * (float)k),
                     v3(cosf(a + 2.1f * (float)k), sinf(a + 2.1f * (float)k), 0.5f), v3(0, 0, 1), 0.055f, 0.02f, 0.5f,
                     5, m->leaf);
    }
    sim_scene_place(s, v3(-0.22f, y - 0.22f, top), 130, 1);
    sim_mug(s, mug);
    sim_scene_place(s, v3(0.16f, y - 0.05f, top), 0, 1);
    sim_bowl(s, 0.14f, bowl, fruit, 3);
    sim_scene_place(s, v3(-0.28f, y + 0.12f, top), 12, 1);
    for (int i = 0; i < 4; i++) {
        float w = 0.12f - 0.012f * (float)i;
        sim_scene_place(s, v3(-0.28f, y + 0.12f, top + 0.032f * (float)i), 12.0f + 9.0f * (float)(i % 3), 1);
        sim_box(s, v3(-w, -0.085f, 0), v3(w, 0.085f, 0.031f), 0.03f, m->covers[i * 2]);
    }
    sim_scene_place(s, v3(-0.28f, y + 0.12f, top + 0.128f), 0, 1);
    sim_ball(s, v3(0, 0, 0.06f), 0.06f, 40, m->chrome);
    /* A sheet with small print, a pencil, and a desk lamp. */
    sim_scene_place(s, v3(-0.02f, y - 0.30f, top + 0.002f), -14, 1);
    sim_quad(s, v3(0, 0, 0), v3(0.148f, 0, 0), v3(0, 0.21f, 0), 0.04f, m->paper);
    sim_bar(s, v3(0.02f, 0.03f, 0.006f), v3(0.13f, 0.16f, 0.006f), 0.0035f, 6, m->brass);
    sim_scene_place(s, v3(0.5f, y + 0.1f, top), 0, 1);
    const float foot[][2] = {{0.001f, 0}, {0.085f, 0}, {0.085f, 0.014f}, {0.012f, 0.02f}, {0.001f, 0.02f}};
    sim_lathe(s, v3(0, 0, 0), foot, 5, 32, m->black);
    sim_bar(s, v3(0, 0, 0.015f), v3(0.12f, 0.05f, 0.33f), 0.006f, 8, m->steel);
    sim_bar(s, v3(0.12f, 0.05f, 0.33f), v3(-0.10f, -0.05f, 0.56f), 0.005f, 8, m->steel);
    sim_bar(s, v3(0.125f, 0.06f, 0.33f), v3(-0.09f, -0.03f, 0.565f), 0.0015f, 5, m->black);
    const float shade[][2] = {{0.085f, 0.0f}, {0.055f, 0.09f}, {0.02f, 0.12f}, {0.001f, 0.12f}};
    sim_lathe(s, v3(-0.11f, -0.055f, 0.47f), shade, 4, 32, m->brass);
    sim_scene_place(s, v3(0, 0, 0), 0, 1);
}

static void around(struct sim_scene *s, const struct shared *m)
{
    int terracotta = sim_solid(s, v3(0.46f, 0.20f, 0.11f), 0.25f, 0, 0, 70);
    int cushion = sim_pattern_material(s, SIM_WEAVE, v3(0.52f, 0.44f, 0.30f), v3(0.36f, 0.08f, 0.06f),
                                       v3(0.10f, 0.20f, 0.28f), 0.006f, 0.09f, 0.15f, 71);
    int rug = sim_pattern_material(s, SIM_WEAVE, v3(0.42f, 0.10f, 0.08f), v3(0.62f, 0.52f, 0.36f),
                                   v3(0.08f, 0.13f, 0.24f), 0.009f, 0.3f, 0.22f, 72);
    int cloth = sim_pattern_material(s, SIM_WEAVE, v3(0.62f, 0.58f, 0.48f), v3(0.52f, 0.34f, 0.22f),
                                     v3(0.55f, 0.50f, 0.40f), 0.004f, 0.25f, 0.10f, 73);

    sim_box(s, v3(-1.2f, -1.5f, Z0), v3(1.5f, 0.5f, Z0 + 0.012f), GRID, rug);
    /* A plant on a stool, close by; another, larger, in a corner. */
    sim_scene_place(s, v3(-0.92f, -0.28f, Z0), 0, 1);
    sim_table(s, 0.34f, 0.34f, 0.62f, m->wood, m->dark_wood);
    sim_scene_place(s, v3(-0.92f, -0.28f, Z0 + 0.62f), 0, 1);
    sim_plant(s, 21, 0.30f, terracotta, m->leaf, 74);
    sim_scene_place(s, v3(3.6f, 2.75f, Z0), 0, 1.9f);
    sim_plant(s, 32, 0.42f, terracotta, m->leaf, 75);
    /* Chairs. */
    sim_scene_place(s, v3(0.55f, -0.80f, Z0), 160, 1);
    sim_chair(s, m->wood, cushion);
    sim_scene_place(s, v3(-1.25f, 0.95f, Z0), 80, 1);
    sim_chair(s, m->dark_wood, cushion);
    sim_scene_place(s, v3(2.55f, 1.35f, Z0), -60, 1);
    sim_chair(s, m->wood, cushion);
    /* A cage hung from the ceiling, a wheel against the wall, a ladder. */
    sim_scene_place(s, v3(0.78f, 0.30f, 0.18f), 0, 1);
    sim_cage(s, 0.13f, 0.26f, 24, m->brass);
    sim_bar(s, v3(0, 0, 0.35f), v3(0, 0, Z1 - 0.18f), 0.0016f, 6, m->brass);
    sim_bar(s, v3(-0.12f, 0, 0.1f), v3(0.12f, 0, 0.1f), 0.004f, 6, m->wood);
    sim_scene_place(s, v3(-2.60f, -1.4f, Z0 + 0.36f), 80, 1);
    sim_wheel(s, 0.33f, 32, m->black, m->steel);
    sim_scene_place(s, v3(-2.55f, 1.9f, Z0), -90, 1);
    sim_ladder(s, 0.42f, 2.3f, m->wood);
    /* Curtains. */
    sim_scene_place(s, v3(0, 0, 0), 0, 1);
    sim_curtain(s, v3(0.75f, Y1 - 0.09f, 1.25f), v3(1.2f, Y1 - 0.09f, 1.25f), 2.3f, 6, 0.035f, cloth);
    sim_curtain(s, v3(2.7f, Y1 - 0.09f, 1.25f), v3(3.15f, Y1 - 0.09f, 1.25f), 2.3f, 6, 0.035f, cloth);
    sim_bar(s, v3(0.65f, Y1 - 0.09f, 1.27f), v3(3.25f, Y1 - 0.09f, 1.27f), 0.012f, 10, m->brass);
}

static void walls(struct sim_scene *s, const struct shared *m)
{
    static const float sizes[5][4] = {/* x, z, width, height on the wall y = Y1 */
                                      {-2.2f, 0.45f, 0.5f, 0.65f},
                                      {-1.45f, 0.62f, 0.6f, 0.42f},
                                      {-1.4f, 0.08f, 0.42f, 0.42f},
                                      {-0.55f, 0.40f, 0.75f, 0.55f},
                                      {0.3f, 0.55f, 0.34f, 0.46f}};
    int mirror = sim_metal(s, v3(0.90f, 0.92f, 0.91f), 0);

    for (int i = 0; i < 5; i++) {
        float w = sizes[i][2], h = sizes[i][3];
        int picture = sim_pattern_material(s, SIM_PICTURE, v3(0.30f, 0.42f, 0.58f), v3(0.30f, 0.34f, 0.36f),
                                           i & 1 ? v3(0.30f, 0.20f, 0.06f) : v3(0.10f, 0.17f, 0.06f), w, h, 0.12f,
                                           80u + (unsigned)i);
        sim_scene_place(s, v3(sizes[i][0], Y1, sizes[i][1]), 0, 1);
        sim_framed(s, w, h, 0.03f, i % 2 ? m->brass : m->dark_wood, picture);
    }
    /* Bookcases on the wall y = Y0, a mirror between them, a clock and a shelf. */
    sim_scene_place(s, v3(-1.6f, Y0 + 0.28f, Z0), 180, 1);
    sim_bookcase(s, 1.7f, 2.1f, 6, m->wood, m->covers, COVERS, 90);
    sim_scene_place(s, v3(2.6f, Y0 + 0.28f, Z0), 180, 1);
    sim_bookcase(s, 1.5f, 1.5f, 4, m->dark_wood, m->covers, COVERS, 97);
    sim_scene_place(s, v3(0.55f, Y0, 0.1f), 180, 1);
    sim_framed(s, 0.8f, 1.2f, 0.05f, m->brass, mirror);
    /* A poster on the bricks, with print. */
    int poster = sim_pattern_material(s, SIM_PRINT, v3(0.76f, 0.70f, 0.54f), v3(0.10f, 0.12f, 0.22f), v3_grey(0),
                                      0.035f, 0.075f, 0.08f, 105);
    sim_scene_place(s, v3(X0, 0.3f, 0.2f), 90, 1);
    sim_framed(s, 0.7f, 1.0f, 0.02f, m->black, poster);
    sim_scene_place(s, v3(0, 0, 0), 0, 1);
    /* A cabinet under the window, with a steel kettle. */
    sim_box(s, v3(3.75f, -2.1f, Z0), v3(X1, -0.5f, Z0 + 0.8f), GRID, m->wood);
    sim_scene_place(s, v3(3.95f, -1.0f, Z0 + 0.8f), 0, 1);
    sim_vase(s, 0.42f, m->chrome);
    sim_scene_place(s, v3(3.95f, -1.6f, Z0 + 0.8f), 90, 1);
    sim_books(s, 0.5f, 0.3f, m->covers, COVERS, 107);
    sim_scene_place(s, v3(0, 0, 0), 0, 1);
}

/* Wires under the ceiling, a pendant lamp, a cable down a wall. */
static void wires(struct sim_scene *s, const struct shared *m)
{
    struct sim_material glow;

    sim_material_init(&glow);
    glow.emission = v3(1.0f, 0.78f, 0.5f);
    int lamp = sim_scene_material(s, &glow);
    for (int i = 0; i < 5; i++) {
        float y = -2.2f + 1.05f * (float)i;
        sim_wire(s, v3(X0, y, 1.28f), v3(X1, y + 0.3f, 1.3f), 0.18f, i & 1 ? 0.0015f : 0.0025f, m->black);
    }
    for (int i = 0; i < 12; i++) {
        float t = ((float)i + 0.5f) / 12;
        struct sim_v3 at = v3(X0 + t * (X1 - X0), -1.15f + 0.3f * t, 1.28f + 0.02f * t - 0.72f * t * (1 - t));
        sim_ball(s, v3(at.x, at.y, at.z - 0.035f), 0.02f, 8, i % 3 ? m->brass : lamp);
    }
    sim_bar(s, v3(0.1f, -0.25f, 0.98f), v3(0.1f, -0.25f, Z1), 0.002f, 6, m->black);
    const float shade[][2] = {{0.17f, 0}, {0.15f, 0.07f}, {0.07f, 0.14f}, {0.02f, 0.16f}, {0.001f, 0.16f}};
    sim_lathe(s, v3(0.1f, -0.25f, 0.84f), shade, 5, 48, m->steel);
    sim_ball(s, v3(0.1f, -0.25f, 0.90f), 0.05f, 16, lamp);
    sim_scene_light(s, v3(0.05f, -0.30f, 0.843f), v3(0.1f, 0, 0), v3(0, 0.1f, 0), 2.2f);
    sim_wire(s, v3(-2.89f, -0.4f, 1.3f), v3(-2.89f, -0.35f, Z0 + 0.3f), 0, 0.003f, m->black);
}

static void build(struct sim_scene *s)
{
    struct shared m;

    s->indoors = true;
    s->sky = (struct sim_sky){.zenith = {0.34f, 0.53f, 0.93f},
                              .horizon = {0.78f, 0.87f, 0.96f},
                              .ground = {0.16f, 0.16f, 0.13f},
                              .clouds = 0.4f,
                              .cloud = 0.95f,
                              .sun_direction = v3_unit(v3(0.80f, 0.12f, 0.52f)),
                              .sun = {2.6f, 2.35f, 1.95f},
                              .sun_radius = 0.006f,
                              .ambient = {0.44f, 0.425f, 0.40f},
                              .seed = 9};
    make_shared(s, &m);
    shell(s, &m);
    outside(s, &m);
    near_table(s, &m);
    around(s, &m);
    walls(s, &m);
    wires(s, &m);
}

const struct sim_place sim_room = {"room", "an interior that surrounds the rig", build};
