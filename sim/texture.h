/* Surfaces: procedural, with a natural spectrum, and filtered to the size a pixel has on them.
 *
 * 1. Fractal noise: octaves of gradient noise of (almost) equal strength, so that the amplitude of a picture of it
 * falls with one over the spatial frequency, as in photographs (Field, "Relations between the statistics of natural
 * images and the response properties of cortical cells", 1987).
 * 2. An octave fades out while its wavelength falls from two footprints to one; edges of patterns are as wide as the
 *    footprint; a pattern finer than the footprint is replaced by its mean.
 * 3. A texture is a function of the surface's own coordinates (metres) and of the footprint, of nothing else. */
#ifndef LUMI_SIM_TEXTURE_H
#define LUMI_SIM_TEXTURE_H

#include "sim/vec.h"

#include <stdbool.h>

enum sim_pattern {
    SIM_PLAIN,     /* color with noise */
    SIM_BRICK,     /* courses of cell.x × cell.y, every other one shifted by half; color2 is the mortar */
    SIM_TILE,      /* a square grid; color2 is the grout; every other tile is color3 */
    SIM_PLANK,     /* boards along x, cell.x long and cell.y wide, with grain; color2 is the gap */
    SIM_GRAIN,     /* wood: grain along x, between color and color2 */
    SIM_WEAVE,     /* rug or cloth: bands of color, color2 and color3 along y, woven with threads of cell.x */
    SIM_WALLPAPER, /* a motif of color2 on color, repeated every cell.x × cell.y */
    SIM_PRINT,     /* lines of print: color2 on color, letters of cell.x × cell.y, a margin */
    SIM_PICTURE,   /* a painted landscape, cell.x × cell.y in size, from color (sky) over color2 to color3 */
    SIM_GROUND     /* patches of color, color2 and color3 */
};

struct sim_material {
    enum sim_pattern pattern;
    struct sim_v3 color, color2, color3; /* reflectances, linear */
    float cell[2];                       /* metres */
    float amplitude;                     /* standard deviation of the noise, relative to the colour */
    float wavelength;                    /* of the largest octave, metres */
    float gain;                          /* strength of an octave over that of the next larger: 1 is 1/f */
    bool solid;                          /* noise in three dimensions: for round things */
    float reflectance;                   /* of the coat, at normal incidence; 0: matt */
    bool metal;                          /* what is reflected takes on `color`, nothing is scattered */
    float roughness;                     /* half-angle of the cone that a reflection gathers, radians */
    bool thin;                           /* leaves, paper: light passes through, both sides alike */
    struct sim_v3 emission;              /* radiance of its own */
    unsigned seed;
};

/* Grey matt paint without noise. */
void sim_material_init(struct sim_material *material);

/* Reflectance at the surface coordinates `at` (metres), averaged over about `footprint` metres. */
struct sim_v3 sim_texture(const struct sim_material *material, struct sim_v3 at, float footprint);

/* The mean reflectance: what indirect light sees. */
struct sim_v3 sim_texture_mean(const struct sim_material *material);

/* Gradient noise in about −1..1, mean 0 (Perlin, "Improving noise", 2002, with hashed gradients). */
float sim_noise2(float x, float y, unsigned seed);
float sim_noise3(struct sim_v3 p, unsigned seed);

/* Octaves from `wavelength` down to the footprint; standard deviation about 1 when none is filtered out. `low` gets the
 * sum of the three largest alone (may be NULL). */
struct sim_octaves {
    float wavelength, gain, footprint;
    bool solid;
    unsigned seed;
};
float sim_fractal(const struct sim_octaves *octaves, struct sim_v3 at, float *low);

/* A number in 0..1 from integers: one a brick, a board, a letter. */
float sim_hash(int x, int y, unsigned seed);

#endif
