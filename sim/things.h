/* Furniture and plants, built in a scene's local coordinates: the floor at z = 0, the front towards −y. */
#ifndef LUMI_SIM_THINGS_H
#define LUMI_SIM_THINGS_H

#include "sim/shapes.h"

/* Materials in one line each. `noise` is the amplitude of the 1/f noise. */
int sim_paint(struct sim_scene *scene, struct sim_v3 color, float noise, unsigned seed);
int sim_solid(struct sim_scene *scene, struct sim_v3 color, float noise, float reflectance, float roughness,
              unsigned seed);
int sim_metal(struct sim_scene *scene, struct sim_v3 color, float roughness);
int sim_wood(struct sim_scene *scene, struct sim_v3 light, struct sim_v3 dark, float reflectance, unsigned seed);
int sim_pattern_material(struct sim_scene *scene, enum sim_pattern pattern, struct sim_v3 color, struct sim_v3 color2,
                         struct sim_v3 color3, float cell_x, float cell_y, float noise, unsigned seed);

void sim_table(struct sim_scene *scene, float width, float depth, float height, int top, int legs);
void sim_chair(struct sim_scene *scene, int wood, int seat);
/* Books stand from x = 0 to `width` on a board at the origin; `covers` materials in turn. */
void sim_books(struct sim_scene *scene, float width, float height, const int *covers, int cover_count, unsigned seed);
void sim_bookcase(struct sim_scene *scene, float width, float height, int shelves, int wood, const int *covers,
                  int cover_count, unsigned seed);
/* A pot with long leaves. */
void sim_plant(struct sim_scene *scene, int leaves, float size, int pot, int leaf, unsigned seed);
/* A picture in a frame, standing in the plane y = 0 with its middle in the origin. */
void sim_framed(struct sim_scene *scene, float width, float height, float border, int frame, int picture);
/* A wheel with spokes in the plane y = 0. */
void sim_wheel(struct sim_scene *scene, float radius, int spokes, int rim, int spoke);
void sim_cage(struct sim_scene *scene, float radius, float height, int bars, int wire);
void sim_ladder(struct sim_scene *scene, float width, float height, int wood);
void sim_vase(struct sim_scene *scene, float height, int material);
void sim_mug(struct sim_scene *scene, int material);
void sim_bowl(struct sim_scene *scene, float radius, int material, const int *fruit, int fruit_count);
/* Trunk, boughs, and leaves in clusters. */
void sim_tree(struct sim_scene *scene, float height, float crown, int leaves, int bark, int leaf, unsigned seed);

#endif
