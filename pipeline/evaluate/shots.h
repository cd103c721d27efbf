/* Where pictures are taken from: a pose typed by a person, a path through a field, a pair of eyes. */
#ifndef LUMI_PIPELINE_EVALUATE_SHOTS_H
#define LUMI_PIPELINE_EVALUATE_SHOTS_H

#include "proto/base/geometry.h"
#include "proto/base/lens.h"
#include "proto/base/raster.h"
#include "proto/base/result.h"
#include "proto/lightfield/field.h"

/* "x,y,z,yaw,pitch" or with ",roll": metres in the field's frame, degrees. Yaw 0 looks along +X, 90 along +Y; pitch 90
 * looks along +Z (up); roll turns the camera clockwise about where it looks. LUMI_ERR_ARG names the text. */
int lumi_pose_parse(const char *text, struct lumi_pose *pose, struct lumi_error *error);

/* The inverse: six numbers, degrees. */
void lumi_pose_describe(const struct lumi_pose *pose, double numbers[6]);

enum lumi_path { LUMI_PATH_ORBIT = 0, LUMI_PATH_DOLLY = 1 };

/* Pose number `frame` of `count` on a path that suits the field. Orbit: the eye goes round on half the cameras' radius;
 * before a plane it keeps looking at one point, inside a sphere it looks outwards all round, outside it circles the
 * centre on the cameras' own sphere. Dolly: straight through the middle, there and back, along the gaze. Both are
 * closed: frame `count` would be frame 0. */
void lumi_path_pose(const struct lumi_field *field, enum lumi_path path, int frame, int count, struct lumi_pose *pose);

/* One eye of a pair about `pose`: side −1 left, +1 right, `distance` metres apart, looking in parallel. */
void lumi_eye_pose(const struct lumi_pose *pose, int side, double distance, struct lumi_pose *eye);

enum lumi_output_projection { LUMI_OUTPUT_PERSPECTIVE = 0, LUMI_OUTPUT_FISHEYE = 1, LUMI_OUTPUT_EQUIRECTANGULAR = 2 };

/* A lens of the given size whose width spans `fov` radians (perspective: under π; 0: 60°, 180° and 360°). */
int lumi_output_lens(enum lumi_output_projection projection, int width, int height, double fov, struct lumi_lens *lens,
                     struct lumi_error *error);

#endif
