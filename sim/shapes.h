/* Shapes in a scene's local coordinates, metres. `grid` is the largest distance between vertices on a flat face: fine
 * enough for the light that falls on it. */
#ifndef LUMI_SIM_SHAPES_H
#define LUMI_SIM_SHAPES_H

#include "sim/scene.h"

/* origin + a u + b v; faces u × v. Surface coordinates are metres along u and v, from (offset_u, offset_v). */
void sim_quad(struct sim_scene *scene, struct sim_v3 origin, struct sim_v3 u, struct sim_v3 v, float grid,
              int material);
void sim_quad_at(struct sim_scene *scene, struct sim_v3 origin, struct sim_v3 u, struct sim_v3 v, float grid,
                 int material, float offset_u, float offset_v);
/* All six faces; surface x along the longer horizontal side. */
void sim_box(struct sim_scene *scene, struct sim_v3 low, struct sim_v3 high, float grid, int material);
/* A straight round bar from a to b, its ends closed. */
void sim_bar(struct sim_scene *scene, struct sim_v3 a, struct sim_v3 b, float radius, int sides, int material);
/* A round bar along a line of points, and one that hangs between two points, `sag` metres below their middle. */
void sim_tube(struct sim_scene *scene, const struct sim_v3 *points, int count, float radius, int sides, int material);
void sim_wire(struct sim_scene *scene, struct sim_v3 a, struct sim_v3 b, float sag, float radius, int material);
void sim_ball(struct sim_scene *scene, struct sim_v3 center, float radius, int rows, int material);
/* An ellipsoid whose surface is pushed out and in by noise. */
void sim_lump(struct sim_scene *scene, struct sim_v3 center, struct sim_v3 radii, float bumps, int rows, int material);
/* Turned on a lathe about the vertical through `center`: radius and height above it, from below, smooth. */
void sim_lathe(struct sim_scene *scene, struct sim_v3 center, const float (*profile)[2], int count, int sides,
               int material);
/* A leaf of this length and width, from its stem along `along`, its face towards `up`, bent down by `droop` (0..1),
 * in `steps` pieces. */
void sim_leaf(struct sim_scene *scene, struct sim_v3 stem, struct sim_v3 along, struct sim_v3 up, float length,
              float width, float droop, int steps, int material);
/* A curtain: from a to b (horizontal), hanging `height` down, in `folds` waves of depth `depth`. */
void sim_curtain(struct sim_scene *scene, struct sim_v3 a, struct sim_v3 b, float height, int folds, float depth,
                 int material);

#endif
