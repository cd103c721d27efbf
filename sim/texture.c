/* Surfaces: noise and patterns, filtered to the size of a pixel. */
#include "sim/texture.h"

#include <string.h>

#define OCTAVES 11 /* from a metre to a millimetre */

void sim_material_init(struct sim_material *m)
{
    *m = (struct sim_material){.pattern = SIM_PLAIN, .wavelength = 1, .gain = 0.9f, .cell = {0.1f, 0.1f}};
    m->color = m->color2 = m->color3 = v3_grey(0.5f);
}

static inline unsigned mix(unsigned h)
{
    h ^= h >> 15;
    h *= 0x2c1b3c6du;
    h ^= h >> 12;
    h *= 0x297a2d39u;
    return h ^ h >> 15;
}

static inline unsigned hash2(int x, int y, unsigned seed)
{
    return mix((unsigned)x * 0x8da6b343u + (unsigned)y * 0xd8163841u + seed * 0xcb1ab31fu + 0x9e3779b9u);
}

float sim_hash(int x, int y, unsigned seed)
{
    return (float)(hash2(x, y, seed) >> 8) / 16777216.0f;
}

static inline float fade(float t)
{
    return t * t * t * (t * (t * 6 - 15) + 10);
}

/* Eight directions at multiples of 45°, turned by 22.5°. */
static inline float corner2(unsigned h, float x, float y)
{
    const float a = 0.92387953f, b = 0.38268343f;
    float u = h & 1 ? x : y, v = h & 1 ? y : x;

    return (h & 2 ? u : -u) * a + (h & 4 ? v : -v) * b;
}

float sim_noise2(float x, float y, unsigned seed)
{
    float fx = floorf(x), fy = floorf(y);
    int ix = (int)fx, iy = (int)fy;

    x -= fx;
    y -= fy;
    float n00 = corner2(hash2(ix, iy, seed) >> 7, x, y);
    float n10 = corner2(hash2(ix + 1, iy, seed) >> 7, x - 1, y);
    float n01 = corner2(hash2(ix, iy + 1, seed) >> 7, x, y - 1);
    float n11 = corner2(hash2(ix + 1, iy + 1, seed) >> 7, x - 1, y - 1);
    float u = fade(x), v = fade(y);
    float top = n00 + u * (n10 - n00), bottom = n01 + u * (n11 - n01);
    return 1.4142136f * (top + v * (bottom - top));
}

/* Twelve edges of the cube, four of them twice. */
static inline float corner3(unsigned h, float x, float y, float z)
{
    h &= 15;
    float u = h < 8 ? x : y, v = h < 4 ? y : h == 12 || h == 14 ? x : z;
    return (h & 1 ? -u : u) + (h & 2 ? -v : v);
}

float sim_noise3(struct sim_v3 p, unsigned seed)
{
    float fx = floorf(p.x), fy = floorf(p.y), fz = floorf(p.z);
    int ix = (int)fx, iy = (int)fy, iz = (int)fz;
    float x = p.x - fx, y = p.y - fy, z = p.z - fz, plane[2];
    float u = fade(x), v = fade(y);

    for (int k = 0; k < 2; k++) {
        unsigned s = seed + (unsigned)(iz + k) * 0x165667b1u;
        float n00 = corner3(hash2(ix, iy, s) >> 7, x, y, z - (float)k);
        float n10 = corner3(hash2(ix + 1, iy, s) >> 7, x - 1, y, z - (float)k);
        float n01 = corner3(hash2(ix, iy + 1, s) >> 7, x, y - 1, z - (float)k);
        float n11 = corner3(hash2(ix + 1, iy + 1, s) >> 7, x - 1, y - 1, z - (float)k);
        float top = n00 + u * (n10 - n00), bottom = n01 + u * (n11 - n01);
        plane[k] = top + v * (bottom - top);
    }
    return plane[0] + fade(z) * (plane[1] - plane[0]);
}

float sim_fractal(const struct sim_octaves *o, struct sim_v3 at, float *low)
{
    const float turn_c = 0.7986355f, turn_s = 0.6018150f; /* 37°, so that the lattices of the octaves do not align */
    float sum = 0, gain = 1, power = 0, f = 1 / o->wavelength, low_sum = 0;
    float x = at.x * f, y = at.y * f, z = at.z * f;

    for (int i = 0; i < OCTAVES; i++) {
        float wavelength = ldexpf(o->wavelength, -i);
        float keep = sim_clamp(wavelength / o->footprint - 1, 0, 1);
        power += gain * gain;
        if (keep > 0) {
            unsigned seed = o->seed * 31u + (unsigned)i;
            float n = o->solid ? sim_noise3(v3(x, y, z), seed) : sim_noise2(x + z, y, seed);
            sum += keep * gain * n;
        }
        if (i == 2)
            low_sum = sum / sqrtf(power);
        float nx = 2 * (turn_c * x - turn_s * y), ny = 2 * (turn_s * x + turn_c * y);
        x = nx;
        y = ny;
        z *= 2;
        gain *= o->gain;
    }
    /* One octave of either noise has a standard deviation of about 0.32 and 0.27. */
    float unit = o->solid ? 3.7f : 3.1f;
    if (low)
        *low = unit * low_sum;
    return unit * sum / sqrtf(power);
}

/* How much of the interval [a, b] of a coordinate that repeats every 1 the footprint around x covers. */
static float covered(float x, float a, float b, float footprint)
{
    float w = footprint > 1e-4f ? footprint : 1e-4f;

    if (w > 1)
        return b - a;
    x -= floorf(x);
    float sum = 0;
    for (int k = -1; k <= 1; k++) {
        float low = fmaxf(x - w / 2, a + (float)k), high = fminf(x + w / 2, b + (float)k);
        sum += high > low ? high - low : 0;
    }
    return sum / w;
}

/* 1 while the footprint is finer than a cell, 0 when it is coarser. */
static float resolved(float cell, float footprint)
{
    return sim_clamp(2 - 2 * footprint / cell, 0, 1);
}

static float fractal(const struct sim_material *m, struct sim_v3 at, float footprint, float *low)
{
    struct sim_octaves octaves = {m->wavelength, m->gain, footprint, m->solid, m->seed};

    return sim_fractal(&octaves, at, low);
}

static struct sim_v3 brick(const struct sim_material *m, struct sim_v3 at, float footprint)
{
    float y = at.y / m->cell[1];
    int row = (int)floorf(y);
    float x = at.x / m->cell[0] + (row & 1 ? 0.5f : 0) + 0.06f * sim_hash(row, 7, m->seed);
    int column = (int)floorf(x);
    float gap_x = 0.010f / m->cell[0], gap_y = 0.010f / m->cell[1];
    float inside = covered(x, gap_x, 1, footprint / m->cell[0]) * covered(y, gap_y, 1, footprint / m->cell[1]);
    float tone = resolved(m->cell[1], footprint) * (sim_hash(column, row, m->seed) - 0.5f);
    float hue = 0.5f + resolved(m->cell[1], footprint) * (sim_hash(column, row, m->seed + 1) - 0.5f);
    struct sim_v3 stone = v3_scale(v3_mix(m->color, m->color3, 0.7f * hue), 1 + 0.5f * tone);
    return v3_mix(m->color2, stone, inside);
}

static struct sim_v3 tile(const struct sim_material *m, struct sim_v3 at, float footprint)
{
    float x = at.x / m->cell[0], y = at.y / m->cell[1];
    int column = (int)floorf(x), row = (int)floorf(y);
    float gap = 0.004f / m->cell[0], w = footprint / m->cell[0], r = resolved(m->cell[0], footprint);
    float inside = covered(x, gap, 1, w) * covered(y, gap, 1, w);
    float other = 0.5f + r * ((column + row) & 1 ? 0.5f : -0.5f);
    float tone = 1 + 0.12f * r * (sim_hash(column, row, m->seed) - 0.5f);
    return v3_mix(m->color2, v3_scale(v3_mix(m->color, m->color3, other), tone), inside);
}

/* Grain: noise drawn out along x, and rings where a board was cut across them. */
static float grain(const struct sim_material *m, struct sim_v3 at, float footprint, float offset)
{
    struct sim_octaves octaves = {0.06f, 0.92f, footprint, false, m->seed + 5};
    struct sim_v3 drawn = v3(at.x * 0.09f + offset * 17, at.y + offset * 5, 0);
    float low, n = sim_fractal(&octaves, drawn, &low);
    float rings = sinf(2 * (float)LUMI_PI * (at.y / 0.03f + 1.2f * low)) * sim_clamp(1.5f - footprint / 0.01f, 0, 1);
    return 0.5f + 0.16f * n + 0.12f * rings;
}

static struct sim_v3 plank(const struct sim_material *m, struct sim_v3 at, float footprint)
{
    float y = at.y / m->cell[1];
    int row = (int)floorf(y);
    float x = at.x / m->cell[0] + sim_hash(row, 3, m->seed);
    int column = (int)floorf(x);
    float r = resolved(m->cell[1], footprint), h = sim_hash(column, row, m->seed);
    float inside = covered(x, 0.0025f / m->cell[0], 1, footprint / m->cell[0]) *
                   covered(y, 0.0035f / m->cell[1], 1, footprint / m->cell[1]);
    float g = grain(m, at, footprint, h);
    struct sim_v3 board = v3_scale(v3_mix(m->color, m->color3, g), 1 + 0.45f * r * (h - 0.5f));
    return v3_mix(m->color2, board, inside);
}

static struct sim_v3 weave(const struct sim_material *m, struct sim_v3 at, float footprint)
{
    float band = at.y / m->cell[1], thread = m->cell[0];
    float a = covered(band, 0.10f, 0.30f, footprint / m->cell[1]);
    float b = covered(band, 0.55f, 0.90f, footprint / m->cell[1]);
    /* Diamonds in the broad band. */
    float diamond = fabsf(covered(at.x / (2 * m->cell[1]), 0.25f, 0.75f, footprint / m->cell[1]) - 0.5f * b);
    struct sim_v3 base = v3_mix(v3_mix(m->color, m->color2, a), m->color3, b * sim_clamp(2 * diamond, 0, 1));
    float k = resolved(thread, 0.5f * footprint), pi2 = 2 * (float)LUMI_PI;
    float relief = 0.12f * k * sinf(pi2 * at.x / thread) * sinf(pi2 * at.y / thread);
    return v3_scale(base, 1 + relief);
}

static struct sim_v3 wallpaper(const struct sim_material *m, struct sim_v3 at, float footprint)
{
    float y = at.y / m->cell[1];
    int row = (int)floorf(y);
    float x = at.x / m->cell[0] + (row & 1 ? 0.5f : 0);
    float u = 2 * (x - floorf(x)) - 1, v = 2 * (y - floorf(y)) - 1;
    float r = sqrtf(u * u + v * v), angle = atan2f(v, u);
    float rim = 0.55f + 0.16f * cosf(5 * angle) + 0.06f * cosf(15 * angle);
    float w = fmaxf(2.5f * footprint / m->cell[0], 0.01f);
    float flower = sim_clamp(0.5f - (r - rim) / w, 0, 1) * sim_clamp(0.5f + (r - 0.45f * rim) / w, 0, 1);
    float heart = sim_clamp(0.5f - (r - 0.2f) / w, 0, 1);
    float stripe = covered(at.x / m->cell[0] * 2, 0, 0.06f, 2 * footprint / m->cell[0]);
    float k = sim_clamp(3 - 3 * footprint / m->cell[0], 0, 1);
    float ink = k * sim_clamp(flower + heart + 0.5f * stripe, 0, 1) + (1 - k) * 0.35f;
    return v3_mix(m->color, m->color2, ink);
}

static struct sim_v3 print(const struct sim_material *m, struct sim_v3 at, float footprint)
{
    float x = at.x / m->cell[0], y = at.y / m->cell[1];
    int row = (int)floorf(y), column = (int)floorf(x);
    float word = sim_hash(column / 2, row, m->seed) < 0.8f && sim_hash(row, 11, m->seed) < 0.85f ? 1.0f : 0.0f;
    float line = covered(y, 0.2f, 0.75f, footprint / m->cell[1]);
    float shape = sim_noise2(at.x * 2.6f / m->cell[0], at.y * 2.6f / m->cell[1], m->seed + 9);
    float w = fmaxf(1.3f * footprint / m->cell[0], 0.03f);
    float letter = sim_clamp(0.5f + (shape + 0.05f) / (2 * w), 0, 1);
    float k = resolved(m->cell[1], 0.6f * footprint);
    float ink = k * word * line * letter + (1 - k) * 0.2f;
    return v3_mix(m->color, m->color2, ink);
}

static struct sim_v3 picture(const struct sim_material *m, struct sim_v3 at, float footprint)
{
    float x = at.x / m->cell[0], y = at.y / m->cell[1], w = fmaxf(footprint / m->cell[1], 0.004f);
    struct sim_octaves clouds = {0.5f * m->cell[0], 0.75f, footprint, false, m->seed + 3};
    float cloud = sim_fractal(&clouds, v3(at.x, 2.5f * at.y, 0), NULL);
    struct sim_v3 c = v3_mix(m->color, v3_grey(0.8f), sim_clamp(0.3f + 0.35f * cloud + 0.3f * (1 - y), 0, 1));

    for (int layer = 0; layer < 4; layer++) {
        float t = (float)layer / 3, ridge = 0.62f - 0.16f * (float)layer, f = 1.5f + (float)layer, h = 0.13f;
        for (int i = 0; i < 5; i++, f *= 2, h *= 0.5f)
            ridge += h * sim_noise2(x * f + 3.7f * (float)layer, 0.5f, m->seed + (unsigned)(layer * 8 + i));
        struct sim_v3 hill = v3_mix(m->color2, m->color3, t);
        hill = v3_scale(hill, 1 + (0.12f + 0.13f * t) * cloud);
        c = v3_mix(c, hill, sim_clamp(0.5f + (ridge - y) / w, 0, 1));
    }
    return c;
}

struct sim_v3 sim_texture(const struct sim_material *m, struct sim_v3 at, float footprint)
{
    float low = 0, n = m->amplitude > 0 ? fractal(m, at, footprint, &low) : 0;
    struct sim_v3 c = m->color;

    switch (m->pattern) {
    case SIM_PLAIN:
        break;
    case SIM_BRICK:
        c = brick(m, at, footprint);
        break;
    case SIM_TILE:
        c = tile(m, at, footprint);
        break;
    case SIM_PLANK:
        c = plank(m, at, footprint);
        break;
    case SIM_GRAIN:
        c = v3_mix(m->color, m->color2, grain(m, at, footprint, sim_hash((int)m->seed, 0, 1)));
        break;
    case SIM_WEAVE:
        c = weave(m, at, footprint);
        break;
    case SIM_WALLPAPER:
        c = wallpaper(m, at, footprint);
        break;
    case SIM_PRINT:
        c = print(m, at, footprint);
        break;
    case SIM_PICTURE:
        c = picture(m, at, footprint);
        break;
    case SIM_GROUND:
        c = v3_mix(v3_mix(m->color, m->color2, sim_clamp(0.5f + 0.5f * low, 0, 1)), m->color3,
                   sim_clamp(0.3f + 0.4f * n, 0, 1));
        break;
    }
    return v3_scale(c, sim_clamp(1 + m->amplitude * n, 0.15f, 2.2f));
}

struct sim_v3 sim_texture_mean(const struct sim_material *m)
{
    switch (m->pattern) {
    case SIM_BRICK:
        return v3_mix(m->color2, v3_mix(m->color, m->color3, 0.35f), 0.8f);
    case SIM_TILE:
    case SIM_PLANK:
        return v3_mix(m->color, m->color3, 0.5f);
    case SIM_GRAIN:
        return v3_mix(m->color, m->color2, 0.5f);
    case SIM_WEAVE:
        return v3_mix(v3_mix(m->color, m->color2, 0.2f), m->color3, 0.2f);
    case SIM_WALLPAPER:
        return v3_mix(m->color, m->color2, 0.35f);
    case SIM_PRINT:
        return v3_mix(m->color, m->color2, 0.2f);
    case SIM_PICTURE:
        return v3_mix(m->color2, m->color3, 0.5f);
    case SIM_GROUND:
        return v3_mix(v3_mix(m->color, m->color2, 0.5f), m->color3, 0.3f);
    case SIM_PLAIN:
        break;
    }
    return m->color;
}
