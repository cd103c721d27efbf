/* Blending disks and the camera mesh, from a triangulation of the centres of projection (Overbeck et al. 2018, sections
 * 4.3 and 4.4). Triangulated by Qhull: the convex hull of the directions from the sphere's centre, or the Delaunay
 * triangulation in the plane. */
#ifndef LUMI_PIPELINE_GEOMETRY_DISKS_H
#define LUMI_PIPELINE_GEOMETRY_DISKS_H

#include "proto/base/geometry.h"
#include "proto/base/result.h"
#include "proto/lightfield/disk.h"
#include "proto/lightfield/field.h"

/* The surface the centres lie on: a plane if they are on a line, or flat and the cameras look across it, else the
 * sphere fitted to them (least squares). `centre` and `radius` as in struct lumi_field_info. */
void lumi_surface_fit(int count, const struct lumi_pose *poses, enum lumi_surface *surface, struct lumi_vec3 *centre,
                      double *radius);

/* Triangles of the camera mesh: 3 indices each; *triangles is released with lumi_free. None (count 0) where the centres
 * do not span a surface: fewer than three, on a line, or a ring about the sphere's centre. */
int lumi_camera_triangles(int count, const struct lumi_pose *poses, enum lumi_surface surface, struct lumi_vec3 centre,
                          int **triangles, int *triangle_count, struct lumi_error *error);

/* Extents of every disk: to the farthest of the 1-ring neighbours in each of +u, −u, +v, −v, times `scale`. Where there
 * is no neighbour on a side the opposite extent stands in; where there is none on an axis, `radius` for a ring and the
 * other axis's extent otherwise. */
int lumi_disks_make(int count, const struct lumi_pose *poses, enum lumi_surface surface, struct lumi_vec3 centre,
                    double radius, double scale, struct lumi_disk *disks, struct lumi_error *error);

#endif
