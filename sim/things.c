/* Furniture. */
#include "sim/things.h"

static const float pi = (float)LUMI_PI;

int sim_paint(struct sim_scene *scene, struct sim_v3 color, float noise, unsigned seed)
{
    struct sim_material m;

    sim_material_init(&m);
    m.color = color;
    m.amplitude = noise;
    m.seed = seed;
    return sim_scene_material(scene, &m);
}

int sim_solid(struct sim_scene *scene, struct sim_v3 color, float noise, float reflectance, float roughness,
              unsigned seed)
{
    struct sim_material m;

    sim_material_init(&m);
    m.color = color;
    m.amplitude = noise;
    m.wavelength = 0.25f;
    m.solid = true;
    m.reflectance = reflectance;
    m.roughness = roughness;
    m.seed = seed;
    return sim_scene_material(scene, &m);
}

int sim_metal(struct sim_scene *scene, struct sim_v3 color, float roughness)
{
    struct sim_material m;

    sim_material_init(&m);
    m.color = color;
    m.metal = true;
    m.reflectance = 0.9f;
    m.roughness = roughness;
    return sim_scene_material(scene, &m);
}

int sim_wood(struct sim_scene *scene, struct sim_v3 light, struct sim_v3 dark, float reflectance, unsigned seed)
{
    struct sim_material m;

    sim_material_init(&m);
    m.pattern = SIM_GRAIN;
    m.color = light;
    m.color2 = dark;
    m.amplitude = 0.12f;
    m.reflectance = reflectance;
    m.roughness = 0.04f;
    m.seed = seed;
    return sim_scene_material(scene, &m);
}

int sim_pattern_material(struct sim_scene *scene, enum sim_pattern pattern, struct sim_v3 color, struct sim_v3 color2,
                         struct sim_v3 color3, float cell_x, float cell_y, float noise, unsigned seed)
{
    struct sim_material m;

    sim_material_init(&m);
    m.pattern = pattern;
    m.color = color;
    m.color2 = color2;
    m.color3 = color3;
    m.cell[0] = cell_x;
    m.cell[1] = cell_y;
    m.amplitude = noise;
    m.seed = seed;
    return sim_scene_material(scene, &m);
}

void sim_table(struct sim_scene *s, float w, float d, float h, int top, int legs)
{
    sim_box(s, v3(-w / 2, -d / 2, h - 0.03f), v3(w / 2, d / 2, h), 0.05f, top);
    sim_box(s, v3(-w / 2 + 0.05f, -d / 2 + 0.04f, h - 0.11f), v3(w / 2 - 0.05f, d / 2 - 0.04f, h - 0.03f), 0.06f, legs);
    for (int i = 0; i < 4; i++) {
        float x = (i & 1 ? 1.0f : -1.0f) * (w / 2 - 0.06f), y = (i & 2 ? 1.0f : -1.0f) * (d / 2 - 0.06f);
        sim_box(s, v3(x - 0.025f, y - 0.025f, 0), v3(x + 0.025f, y + 0.025f, h - 0.03f), 0.06f, legs);
    }
}

void sim_chair(struct sim_scene *s, int wood, int seat)
{
    for (int i = 0; i < 4; i++) {
        float x = i & 1 ? 0.19f : -0.19f, y = i & 2 ? 0.19f : -0.19f;
        sim_bar(s, v3(1.12f * x, 1.12f * y, 0), v3(x, y, 0.45f), 0.013f, 10, wood);
    }
    sim_bar(s, v3(-0.2f, -0.2f, 0.2f), v3(-0.2f, 0.2f, 0.2f), 0.008f, 8, wood);
    sim_bar(s, v3(0.2f, -0.2f, 0.2f), v3(0.2f, 0.2f, 0.2f), 0.008f, 8, wood);
    sim_box(s, v3(-0.22f, -0.22f, 0.44f), v3(0.22f, 0.22f, 0.475f), 0.04f, seat);
    for (int i = 0; i < 7; i++) {
        float x = -0.19f + 0.0633f * (float)i;
        sim_bar(s, v3(x, 0.19f, 0.46f), v3(1.1f * x, 0.27f, 0.9f), i % 6 ? 0.006f : 0.012f, 8, wood);
    }
    sim_box(s, v3(-0.23f, 0.255f, 0.88f), v3(0.23f, 0.28f, 0.96f), 0.05f, wood);
}

void sim_books(struct sim_scene *s, float width, float height, const int *covers, int cover_count, unsigned seed)
{
    float x = 0.005f;

    for (int i = 0; x < width - 0.06f && i < 100; i++) {
        float thick = 0.014f + 0.034f * sim_hash(i, 1, seed), tall = height * (0.62f + 0.33f * sim_hash(i, 2, seed));
        float deep = 0.14f + 0.06f * sim_hash(i, 3, seed);
        int cover = covers[(int)(sim_hash(i, 4, seed) * (float)cover_count)];
        if (sim_hash(i, 5, seed) < 0.07f) {
            x += 0.05f; /* a gap */
            continue;
        }
        sim_box(s, v3(x, 0.20f - deep, 0), v3(x + thick, 0.20f, tall), 0.05f, cover);
        x += thick + 0.001f;
    }
}

void sim_bookcase(struct sim_scene *s, float w, float h, int shelves, int wood, const int *covers, int cover_count,
                  unsigned seed)
{
    struct sim_frame frame = s->frame;
    float pitch = (h - 0.1f) / (float)shelves;

    sim_box(s, v3(-w / 2, 0, 0), v3(-w / 2 + 0.025f, 0.27f, h), 0.07f, wood);
    sim_box(s, v3(w / 2 - 0.025f, 0, 0), v3(w / 2, 0.27f, h), 0.07f, wood);
    sim_box(s, v3(-w / 2, 0, h), v3(w / 2, 0.27f, h + 0.025f), 0.07f, wood);
    sim_quad(s, v3(-w / 2, 0.265f, 0), v3(w, 0, 0), v3(0, 0, h), 0.08f, wood);
    for (int i = 0; i < shelves; i++) {
        float z = 0.08f + pitch * (float)i;
        sim_box(s, v3(-w / 2 + 0.02f, 0.005f, z), v3(w / 2 - 0.02f, 0.265f, z + 0.022f), 0.06f, wood);
        struct sim_frame board = frame;
        board.origin = sim_scene_point(s, v3(-w / 2 + 0.03f, 0.05f, z + 0.022f));
        sim_scene_place_frame(s, &board);
        sim_books(s, w - 0.06f, pitch - 0.03f, covers, cover_count, seed + (unsigned)i);
        sim_scene_place_frame(s, &frame);
    }
}

void sim_plant(struct sim_scene *s, int leaves, float size, int pot, int leaf, unsigned seed)
{
    const float side[][2] = {{0.001f, 0},     {0.085f, 0},    {0.10f, 0.08f},  {0.12f, 0.20f},
                             {0.11f, 0.205f}, {0.10f, 0.18f}, {0.001f, 0.175f}};

    sim_lathe(s, v3(0, 0, 0), side, 7, 28, pot);
    for (int i = 0; i < leaves; i++) {
        float angle = 2.4f * (float)i, rise = 0.35f + 1.0f * sim_hash(i, 1, seed);
        float length = size * (0.55f + 0.45f * sim_hash(i, 2, seed));
        struct sim_v3 out = v3(cosf(angle), sinf(angle), 0);
        struct sim_v3 along = v3_unit(v3(out.x, out.y, rise)), stem = v3(0.03f * out.x, 0.03f * out.y, 0.17f);
        struct sim_v3 tip = v3_along(stem, along, 0.45f * length);
        sim_bar(s, stem, tip, 0.0025f, 5, leaf);
        sim_leaf(s, tip, along, v3_sub(v3(0, 0, 1), v3_scale(out, 0.3f)), length, 0.22f * length,
                 0.5f + 0.6f * sim_hash(i, 3, seed), 5, leaf);
    }
}

void sim_framed(struct sim_scene *s, float w, float h, float border, int frame, int picture)
{
    float a = w / 2, b = h / 2, t = border;

    sim_quad(s, v3(-a, -0.01f, -b), v3(w, 0, 0), v3(0, 0, h), 0.08f, picture);
    sim_box(s, v3(-a - t, -0.03f, -b - t), v3(a + t, 0, -b), 0.08f, frame);
    sim_box(s, v3(-a - t, -0.03f, b), v3(a + t, 0, b + t), 0.08f, frame);
    sim_box(s, v3(-a - t, -0.03f, -b), v3(-a, 0, b), 0.08f, frame);
    sim_box(s, v3(a, -0.03f, -b), v3(a + t, 0, b), 0.08f, frame);
}

void sim_wheel(struct sim_scene *s, float radius, int spokes, int rim, int spoke)
{
    struct sim_v3 points[61];

    for (int i = 0; i <= 60; i++)
        points[i] = v3(radius * cosf(2 * pi * (float)i / 60), 0, radius * sinf(2 * pi * (float)i / 60));
    sim_tube(s, points, 61, 0.014f, 10, rim);
    sim_bar(s, v3(0, -0.04f, 0), v3(0, 0.04f, 0), 0.02f, 12, rim);
    for (int i = 0; i < spokes; i++) {
        float angle = 2 * pi * (float)i / (float)spokes, lead = (i % 4 < 2 ? 1.2f : -1.2f);
        struct sim_v3 hub = v3(0.018f * cosf(angle + lead), i & 1 ? 0.03f : -0.03f, 0.018f * sinf(angle + lead));
        sim_bar(s, hub, v3(radius * cosf(angle), 0, radius * sinf(angle)), 0.0011f, 5, spoke);
    }
}

void sim_cage(struct sim_scene *s, float radius, float height, int bars, int wire)
{
    struct sim_v3 points[41];

    for (int ring = 0; ring < 4; ring++) {
        for (int i = 0; i <= 40; i++)
            points[i] = v3(radius * cosf(2 * pi * (float)i / 40), radius * sinf(2 * pi * (float)i / 40),
                           height * (float)ring / 3);
        sim_tube(s, points, 41, 0.002f, 5, wire);
    }
    for (int i = 0; i < bars; i++) {
        float angle = 2 * pi * (float)i / (float)bars, c = cosf(angle), q = sinf(angle);
        int count = 0;
        points[count++] = v3(radius * c, radius * q, 0);
        points[count++] = v3(radius * c, radius * q, height / 2);
        for (int k = 0; k <= 8; k++) {
            float up = pi / 2 * (float)k / 8, r = radius * cosf(up) + 0.002f;
            points[count++] = v3(r * c, r * q, height + 0.7f * radius * sinf(up));
        }
        sim_tube(s, points, count, 0.0011f, 5, wire);
    }
    const float dish[][2] = {{0.001f, -0.01f}, {radius + 0.01f, -0.01f}, {radius + 0.012f, 0.012f}, {0.001f, 0.002f}};
    sim_lathe(s, v3(0, 0, 0), dish, 4, 32, wire);
}

void sim_ladder(struct sim_scene *s, float width, float height, int wood)
{
    for (int i = 0; i < 2; i++) {
        float x = i ? width / 2 : -width / 2;
        sim_box(s, v3(x - 0.012f, -0.03f, 0), v3(x + 0.012f, 0.03f, height), 0.08f, wood);
    }
    for (float z = 0.25f; z < height - 0.1f; z += 0.28f)
        sim_bar(s, v3(-width / 2, 0, z), v3(width / 2, 0, z), 0.014f, 10, wood);
}

void sim_vase(struct sim_scene *s, float height, int material)
{
    float h = height;
    const float side[][2] = {{0.001f, 0},
                             {0.16f * h, 0.005f * h},
                             {0.24f * h, 0.2f * h},
                             {0.27f * h, 0.42f * h},
                             {0.17f * h, 0.7f * h},
                             {0.09f * h, 0.86f * h},
                             {0.13f * h, 1.0f * h},
                             {0.115f * h, 0.99f * h},
                             {0.07f * h, 0.86f * h},
                             {0.001f, 0.7f * h}};

    sim_lathe(s, v3(0, 0, 0), side, 10, 40, material);
}

void sim_mug(struct sim_scene *s, int material)
{
    const float side[][2] = {{0.001f, 0},      {0.036f, 0.001f}, {0.04f, 0.01f},   {0.041f, 0.05f}, {0.041f, 0.094f},
                             {0.037f, 0.094f}, {0.036f, 0.05f},  {0.034f, 0.012f}, {0.001f, 0.01f}};
    struct sim_v3 points[13];

    sim_lathe(s, v3(0, 0, 0), side, 9, 36, material);
    for (int i = 0; i <= 12; i++) {
        float angle = pi * ((float)i / 12 - 0.5f);
        points[i] = v3(0.038f + 0.03f * cosf(angle), 0, 0.05f + 0.028f * sinf(angle));
    }
    sim_tube(s, points, 13, 0.005f, 8, material);
}

void sim_bowl(struct sim_scene *s, float r, int material, const int *fruit, int fruit_count)
{
    const float side[][2] = {{0.001f, 0},        {0.45f * r, 0.002f},    {0.8f * r, 0.25f * r},
                             {r, 0.55f * r},     {0.96f * r, 0.55f * r}, {0.72f * r, 0.25f * r},
                             {0.001f, 0.08f * r}};

    sim_lathe(s, v3(0, 0, 0), side, 7, 40, material);
    for (int i = 0; i < 7; i++) {
        float angle = 1.05f * (float)i, out = i == 6 ? 0 : 0.48f * r;
        sim_lump(s, v3(out * cosf(angle), out * sinf(angle), i == 6 ? 0.75f * r : 0.45f * r),
                 v3(0.27f * r, 0.27f * r, 0.25f * r), 0.05f, 14, fruit[i % fruit_count]);
    }
}

void sim_tree(struct sim_scene *s, float height, float crown, int leaves, int bark, int leaf, unsigned seed)
{
    for (int i = 0; i < 5; i++) {
        float a = (float)i / 5, b = a + 0.2f, r = height * (0.024f - 0.019f * a);
        sim_bar(s, v3(0.03f * height * a, 0.02f * height * a, 0.78f * height * a),
                v3(0.03f * height * b, 0.02f * height * b, 0.78f * height * b), r, 12, bark);
    }
    for (int i = 0; i < 12; i++) {
        float z = height * (0.38f + 0.03f * (float)i), angle = 2.4f * (float)i;
        float r = crown * (0.55f + 0.3f * sim_hash(i, 1, seed));
        struct sim_v3 tip = v3(r * cosf(angle), r * sinf(angle), z + 0.22f * height * (0.5f + sim_hash(i, 2, seed)));
        sim_bar(s, v3(0.02f * height, 0.012f * height, z * 0.92f), tip, 0.006f * height, 6, bark);
        for (int k = 0; k < leaves / 12; k++) {
            int n = i * 4096 + k;
            float a = 2 * pi * sim_hash(n, 3, seed), b = 2 * sim_hash(n, 4, seed) - 1;
            float q = 0.42f * crown * cbrtf(sim_hash(n, 5, seed)), c = sqrtf(1 - b * b);
            struct sim_v3 at = v3_along(tip, v3(c * cosf(a), c * sinf(a), 0.8f * b), q);
            struct sim_v3 along = v3(cosf(7 * a), sinf(7 * a), 0.6f * sim_hash(n, 6, seed) - 0.5f);
            float size = 0.02f * height + 0.07f + 0.08f * sim_hash(n, 7, seed);
            sim_leaf(s, at, along, v3(0.5f * sinf(5 * a), 0.5f * cosf(3 * a), 1), size, 0.5f * size, 0.4f, 2, leaf);
        }
    }
}
