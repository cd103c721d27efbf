/* court: an exterior under the sun. Things at 0.6 m, houses at 14 to 45 m, hills at the horizon. */
#include "sim/place.h"
#include "sim/things.h"

#define Z0 (-1.2f)

struct shared {
    int wood, dark, steel, white, leaf, bark, glass, terracotta, stone;
};

static void make_shared(struct sim_scene *s, struct shared *m)
{
    struct sim_material leaf, glass;

    m->wood = sim_wood(s, v3(0.42f, 0.28f, 0.16f), v3(0.22f, 0.13f, 0.07f), 0, 1);
    m->dark = sim_paint(s, v3(0.035f, 0.045f, 0.04f), 0.12f, 2);
    m->steel = sim_solid(s, v3(0.34f, 0.35f, 0.37f), 0.1f, 0, 0, 3);
    m->white = sim_paint(s, v3(0.70f, 0.69f, 0.65f), 0.06f, 4);
    m->bark = sim_solid(s, v3(0.15f, 0.11f, 0.08f), 0.4f, 0, 0, 5);
    m->terracotta = sim_solid(s, v3(0.46f, 0.20f, 0.11f), 0.25f, 0, 0, 6);
    m->stone = sim_solid(s, v3(0.42f, 0.40f, 0.36f), 0.22f, 0, 0, 7);
    sim_material_init(&leaf);
    leaf.color = v3(0.10f, 0.22f, 0.045f);
    leaf.amplitude = 0.3f;
    leaf.thin = true;
    leaf.solid = true;
    leaf.seed = 8;
    m->leaf = sim_scene_material(s, &leaf);
    sim_material_init(&glass);
    glass.color = v3(0.03f, 0.035f, 0.04f);
    glass.amplitude = 0.3f;
    glass.reflectance = 0.08f;
    m->glass = sim_scene_material(s, &glass);
}

struct facade {
    float width, floor_height, bay, window_width, window_height;
    int floors, wall;
};

/* One bay of one floor: wall around a window, its reveal, glass and bars. x to the right, z up, outwards is −y. */
static void bay(struct sim_scene *s, const struct facade *f, float x, float z, float width, const struct shared *m)
{
    const float g = 0.7f, d = 0.18f, h = f->floor_height, ww = f->window_width, wh = f->window_height;
    float x0 = x + (width - ww) / 2, x1 = x0 + ww, z0 = z + 0.85f, z1 = z0 + wh;
    const float part[4][4] = {{x, z, x0, z + h}, {x1, z, x + width, z + h}, {x0, z, x1, z0}, {x0, z1, x1, z + h}};

    for (int i = 0; i < 4; i++) {
        const float *p = part[i];
        sim_quad_at(s, v3(p[0], 0, p[1]), v3(p[2] - p[0], 0, 0), v3(0, 0, p[3] - p[1]), g, f->wall, p[0], p[1]);
    }
    sim_quad(s, v3(x0, d, z0), v3(0, -d, 0), v3(0, 0, wh), g, m->white);
    sim_quad(s, v3(x1, 0, z0), v3(0, d, 0), v3(0, 0, wh), g, m->white);
    sim_quad(s, v3(x0, 0, z0), v3(ww, 0, 0), v3(0, d, 0), g, m->white);
    sim_quad(s, v3(x0, d, z1), v3(ww, 0, 0), v3(0, -d, 0), g, m->white);
    sim_quad_at(s, v3(x0, d, z0), v3(ww, 0, 0), v3(0, 0, wh), g, m->glass, x0, z0);
    sim_box(s, v3(x0, d - 0.03f, z0), v3(x0 + 0.06f, d, z1), g, m->white);
    sim_box(s, v3(x1 - 0.06f, d - 0.03f, z0), v3(x1, d, z1), g, m->white);
    sim_box(s, v3((x0 + x1) / 2 - 0.03f, d - 0.03f, z0), v3((x0 + x1) / 2 + 0.03f, d, z1), g, m->white);
    sim_box(s, v3(x0, d - 0.03f, z0 + 0.6f * wh), v3(x1, d, z0 + 0.6f * wh + 0.05f), g, m->white);
    sim_box(s, v3(x0 - 0.1f, -0.12f, z0 - 0.08f), v3(x1 + 0.1f, 0.02f, z0), g, m->stone);
}

/* A house whose front's lower left corner is the local origin. */
static void house(struct sim_scene *s, const struct facade *f, float depth, int roof, const struct shared *m)
{
    int bays = (int)(f->width / f->bay);
    float width = f->width / (float)bays, h = f->floor_height * (float)f->floors, w = f->width;

    for (int j = 0; j < f->floors; j++)
        for (int i = 0; i < bays; i++)
            bay(s, f, width * (float)i, f->floor_height * (float)j, width, m);
    sim_quad(s, v3(w, 0, 0), v3(0, depth, 0), v3(0, 0, h), 1.2f, f->wall);
    sim_quad(s, v3(0, depth, 0), v3(0, -depth, 0), v3(0, 0, h), 1.2f, f->wall);
    sim_quad(s, v3(w, depth, 0), v3(-w, 0, 0), v3(0, 0, h), 1.2f, f->wall);
    float rise = 0.35f * depth, out = 0.35f;
    sim_quad(s, v3(-out, -out, h - 0.1f), v3(w + 2 * out, 0, 0), v3(0, depth / 2 + out, rise), 1.2f, roof);
    sim_quad(s, v3(w + out, depth + out, h - 0.1f), v3(-w - 2 * out, 0, 0), v3(0, -depth / 2 - out, rise), 1.2f, roof);
    sim_box(s, v3(-out, -out - 0.1f, h - 0.22f), v3(w + out, -out, h - 0.1f), 1, m->stone);
    for (int i = 0; i < 3; i++) {
        float x = w * (0.2f + 0.3f * (float)i);
        sim_box(s, v3(x, depth * 0.4f, h), v3(x + 0.7f, depth * 0.4f + 0.5f, h + rise + 1.1f), 1, f->wall);
    }
}

static void ground(struct sim_scene *s, const struct shared *m)
{
    int cobbles = sim_pattern_material(s, SIM_BRICK, v3(0.34f, 0.32f, 0.29f), v3(0.14f, 0.13f, 0.11f),
                                       v3(0.27f, 0.27f, 0.28f), 0.19f, 0.13f, 0.25f, 20);
    int lawn = sim_pattern_material(s, SIM_GROUND, v3(0.10f, 0.20f, 0.05f), v3(0.17f, 0.24f, 0.07f),
                                    v3(0.24f, 0.20f, 0.10f), 1, 1, 0.28f, 21);
    int hills = sim_paint(s, v3(0.22f, 0.30f, 0.30f), 0.2f, 22);

    sim_quad(s, v3(-9, -8, Z0), v3(20, 0, 0), v3(0, 20, 0), 0.2f, cobbles);
    sim_quad(s, v3(-300, -300, Z0 - 0.03f), v3(600, 0, 0), v3(0, 600, 0), 4, lawn);
    for (int i = 0; i < 26; i++) {
        float angle = 6.2831853f * (float)i / 26, far = 240 + 40 * sim_hash(i, 1, 23);
        sim_lump(s, v3(far * cosf(angle), far * sinf(angle), Z0 - 6), v3(48, 48, 14 + 22 * sim_hash(i, 2, 23)), 0.25f,
                 14, hills);
    }
    (void)m;
}

static void houses(struct sim_scene *s, const struct shared *m)
{
    int brick = sim_pattern_material(s, SIM_BRICK, v3(0.50f, 0.22f, 0.14f), v3(0.50f, 0.47f, 0.42f),
                                     v3(0.38f, 0.18f, 0.12f), 0.25f, 0.08f, 0.2f, 30);
    int plaster = sim_paint(s, v3(0.62f, 0.52f, 0.36f), 0.13f, 31);
    int pale = sim_paint(s, v3(0.58f, 0.58f, 0.55f), 0.13f, 32);
    int roof = sim_pattern_material(s, SIM_BRICK, v3(0.34f, 0.14f, 0.09f), v3(0.12f, 0.06f, 0.04f),
                                    v3(0.26f, 0.12f, 0.09f), 0.3f, 0.22f, 0.2f, 33);
    const struct facade a = {24, 3.1f, 2.6f, 1.15f, 1.6f, 3, brick}, b = {18, 3.0f, 2.8f, 1.1f, 1.5f, 2, plaster};
    const struct facade c = {28, 3.2f, 3.0f, 1.3f, 1.7f, 4, pale};

    sim_scene_place(s, v3(-13, 19, Z0), 0, 1);
    house(s, &a, 9, roof, m);
    sim_scene_place(s, v3(-14, -7, Z0), 90, 1); /* faces +x, to the west */
    house(s, &b, 8, roof, m);
    sim_scene_place(s, v3(34, 26, Z0), -90, 1); /* faces −x, to the east */
    house(s, &c, 11, roof, m);
    sim_scene_place(s, v3(12, 44, Z0), 0, 1);
    house(s, &c, 10, roof, m);
    sim_scene_place(s, v3(20, -38, Z0), 180, 1);
    house(s, &b, 9, roof, m);
    sim_scene_place(s, v3(0, 0, 0), 0, 1);
}

static void greenery(struct sim_scene *s, const struct shared *m)
{
    static const float trees[][3] = {{7, 9, 6},      {3.5f, 13, 7}, {-6, 12, 6.5f}, {10.5f, -4, 7}, {-3, -9, 6},
                                     {5, -13, 7.5f}, {17, 4, 8},    {-9, -16, 7},   {22, -18, 9},   {-1, -26, 8}};

    for (int i = 0; i < 10; i++) {
        sim_scene_place(s, v3(trees[i][0], trees[i][1], Z0), 70.0f * (float)i, 1);
        sim_tree(s, trees[i][2], 0.3f * trees[i][2], 1800, m->bark, m->leaf, 40u + (unsigned)i);
    }
    /* Planters close by. */
    static const float pots[][3] = {
        {-0.85f, 0.55f, 0.95f}, {1.6f, 1.1f, 1.3f}, {-1.4f, -1.3f, 1.4f}, {2.4f, -1.8f, 1.5f}};
    for (int i = 0; i < 4; i++) {
        float z = i ? 0 : 0.72f;
        sim_scene_place(s, v3(pots[i][0], pots[i][1], Z0 + z), 30.0f * (float)i, pots[i][2]);
        sim_plant(s, 18, 0.34f, m->terracotta, m->leaf, 60u + (unsigned)i);
    }
    sim_scene_place(s, v3(0, 0, 0), 0, 1);
    sim_box(s, v3(-1.1f, 0.40f, Z0), v3(-0.62f, 0.76f, Z0 + 0.72f), 0.08f, m->stone);
}

static void bench(struct sim_scene *s, const struct shared *m)
{
    for (int i = 0; i < 4; i++)
        sim_box(s, v3(-0.8f, -0.2f + 0.1f * (float)i, 0.44f), v3(0.8f, -0.12f + 0.1f * (float)i, 0.47f), 0.08f,
                m->wood);
    for (int i = 0; i < 3; i++)
        sim_box(s, v3(-0.8f, 0.2f, 0.55f + 0.12f * (float)i), v3(0.8f, 0.23f, 0.64f + 0.12f * (float)i), 0.08f,
                m->wood);
    for (int i = 0; i < 2; i++) {
        float x = i ? 0.68f : -0.68f;
        sim_bar(s, v3(x, -0.2f, 0), v3(x, -0.2f, 0.44f), 0.015f, 8, m->dark);
        sim_bar(s, v3(x, 0.2f, 0), v3(x, 0.24f, 0.9f), 0.015f, 8, m->dark);
        sim_bar(s, v3(x, -0.2f, 0.43f), v3(x, 0.2f, 0.43f), 0.012f, 8, m->dark);
    }
}

static void bicycle(struct sim_scene *s, const struct shared *m)
{
    int red = sim_solid(s, v3(0.45f, 0.05f, 0.04f), 0.1f, 0.05f, 0.02f, 70);
    struct sim_frame frame = s->frame, wheel = frame;

    for (int i = 0; i < 2; i++) {
        wheel.origin = sim_scene_point(s, v3(i ? 0.52f : -0.52f, 0, 0.34f));
        struct sim_frame keep = s->frame;
        sim_scene_place_frame(s, &wheel);
        sim_wheel(s, 0.33f, 32, m->dark, m->steel);
        sim_scene_place_frame(s, &keep);
    }
    const float tubes[][6] = {{-0.52f, 0, 0.34f, -0.05f, 0, 0.30f},     {-0.52f, 0, 0.34f, -0.18f, 0, 0.80f},
                              {-0.05f, 0, 0.30f, -0.20f, 0, 0.92f},     {-0.05f, 0, 0.30f, 0.36f, 0, 0.78f},
                              {-0.18f, 0, 0.80f, 0.34f, 0, 0.84f},      {0.52f, 0, 0.34f, 0.32f, 0, 0.98f},
                              {0.31f, -0.22f, 1.0f, 0.31f, 0.22f, 1.0f}};
    for (int i = 0; i < 7; i++)
        sim_bar(s, v3(tubes[i][0], tubes[i][1], tubes[i][2]), v3(tubes[i][3], tubes[i][4], tubes[i][5]), 0.015f, 10,
                red);
    sim_box(s, v3(-0.32f, -0.06f, 0.92f), v3(-0.1f, 0.06f, 0.96f), 0.04f, m->dark);
}

static void near_things(struct sim_scene *s, const struct shared *m)
{
    int glaze = sim_solid(s, v3(0.60f, 0.40f, 0.12f), 0.25f, 0.06f, 0.004f, 80);
    int chrome = sim_metal(s, v3(0.92f, 0.93f, 0.95f), 0);
    int top = sim_pattern_material(s, SIM_TILE, v3(0.62f, 0.60f, 0.54f), v3(0.3f, 0.28f, 0.25f),
                                   v3(0.10f, 0.20f, 0.32f), 0.055f, 0.055f, 0.1f, 81);
    int paper = sim_pattern_material(s, SIM_PRINT, v3(0.75f, 0.73f, 0.66f), v3(0.05f, 0.05f, 0.07f), v3_grey(0), 0.005f,
                                     0.012f, 0.03f, 82);

    sim_scene_place(s, v3(0.15f, 0.88f, Z0), 0, 1);
    sim_table(s, 0.75f, 0.55f, 0.75f, top, m->dark);
    sim_scene_place(s, v3(0.36f, 0.98f, Z0 + 0.75f), 0, 1);
    sim_vase(s, 0.28f, glaze);
    sim_scene_place(s, v3(0.05f, 0.95f, Z0 + 0.75f), 60, 1);
    sim_mug(s, m->white);
    sim_ball(s, v3(-0.16f, 0.05f, 0.05f), 0.05f, 36, chrome);
    sim_scene_place(s, v3(0.08f, 0.66f, Z0 + 0.752f), 12, 1);
    sim_quad(s, v3(0, 0, 0), v3(0.2f, 0, 0), v3(0, 0.14f, 0), 0.04f, paper);
    sim_scene_place(s, v3(0.9f, -0.35f, Z0), -100, 1);
    sim_chair(s, m->wood, m->wood);
    sim_scene_place(s, v3(-0.4f, -2.4f, Z0), 170, 1);
    bench(s, m);
    sim_scene_place(s, v3(-2.6f, 1.2f, Z0), 75, 1);
    bicycle(s, m);
    sim_scene_place(s, v3(0, 0, 0), 0, 1);
}

/* Lamp posts, the wires between them, a railing, a fountain. */
static void far_things(struct sim_scene *s, const struct shared *m)
{
    static const float posts[][2] = {{4.5f, 5.5f}, {-5.5f, 6}, {-6, -6}, {8, -6.5f}};
    const float basin[][2] = {{0.001f, 0}, {1.5f, 0}, {1.55f, 0.5f}, {1.4f, 0.52f}, {1.35f, 0.3f}, {0.001f, 0.3f}};
    const float column[][2] = {{0.001f, 0.3f}, {0.2f, 0.3f}, {0.12f, 0.8f}, {0.16f, 1.3f}, {0.6f, 1.5f},
                               {0.62f, 1.56f}, {0.1f, 1.5f}, {0.08f, 1.9f}, {0.001f, 2.0f}};

    for (int i = 0; i < 4; i++) {
        const float *a = posts[i], *b = posts[(i + 1) % 4];
        sim_bar(s, v3(a[0], a[1], Z0), v3(a[0], a[1], Z0 + 4.2f), 0.045f, 12, m->dark);
        sim_ball(s, v3(a[0], a[1], Z0 + 4.35f), 0.17f, 20, m->white);
        sim_wire(s, v3(a[0], a[1], Z0 + 4.0f), v3(b[0], b[1], Z0 + 4.0f), 0.35f, 0.006f, m->dark);
        sim_wire(s, v3(a[0], a[1], Z0 + 3.8f), v3(b[0], b[1], Z0 + 3.8f), 0.5f, 0.003f, m->dark);
    }
    for (int i = 0; i <= 44; i++) {
        float x = 1.2f + 0.12f * (float)i;
        sim_bar(s, v3(x, -3.4f, Z0), v3(x, -3.4f, Z0 + 1.0f), i % 11 ? 0.006f : 0.02f, 8, m->dark);
    }
    sim_bar(s, v3(1.2f, -3.4f, Z0 + 1.0f), v3(6.48f, -3.4f, Z0 + 1.0f), 0.016f, 8, m->dark);
    sim_bar(s, v3(1.2f, -3.4f, Z0 + 0.12f), v3(6.48f, -3.4f, Z0 + 0.12f), 0.012f, 8, m->dark);
    sim_lathe(s, v3(-2.4f, 6.8f, Z0), basin, 6, 48, m->stone);
    sim_lathe(s, v3(-2.4f, 6.8f, Z0), column, 9, 32, m->stone);
}

static void build(struct sim_scene *s)
{
    struct shared m;

    s->sky = (struct sim_sky){.zenith = {0.17f, 0.32f, 0.68f},
                              .horizon = {0.62f, 0.72f, 0.82f},
                              .ground = {0.2f, 0.2f, 0.16f},
                              .clouds = 0.45f,
                              .cloud = 1.15f,
                              .sun_direction = v3_unit(v3(0.55f, -0.45f, 0.70f)),
                              .sun = {1.35f, 1.25f, 1.08f},
                              .sun_radius = 0.006f,
                              .ambient = {0.28f, 0.30f, 0.33f},
                              .seed = 11};
    make_shared(s, &m);
    ground(s, &m);
    houses(s, &m);
    greenery(s, &m);
    near_things(s, &m);
    far_things(s, &m);
}

const struct sim_place sim_court = {"court", "an exterior with far depth", build};
