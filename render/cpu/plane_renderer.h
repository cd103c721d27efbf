/* The method the disks are compared with: camera-mesh blending over one plane (the paper's CMBF+P; Buehler et al. 2001,
 * Davis et al. 2012; Overbeck et al. 2018, section 4.3, figure 5 b). The ray's line meets a triangle of camera centres;
 * the three views, weighted by the barycentric coordinates there, are looked up where the ray meets the plane. */
#ifndef LUMI_RENDER_CPU_PLANE_RENDERER_H
#define LUMI_RENDER_CPU_PLANE_RENDERER_H

#include "render/cpu/picture.h"
#include "render/viewset/viewset.h"

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Triangles between the centres of projection: 3 indices of views each. */
struct lumi_camera_mesh {
    const int *triangles;
    int triangle_count;
};

struct lumi_plane_settings {
    /* The plane is normal to `axis` (unit length), at points p with (p − origin)·axis = 1 / inverse_depth; with
     * `sphere`, the sphere of that radius about origin, which suits views that look all ways. 0: at infinity. */
    struct lumi_vec3 origin, axis;
    double inverse_depth;
    bool sphere;
    enum lumi_filter filter;
    bool linear_light;
    enum lumi_sample sample;
    int threads;
};

int lumi_render_plane(struct lumi_viewset *set, const struct lumi_camera_mesh *mesh, const struct lumi_lens *lens,
                      const struct lumi_pose *pose, const struct lumi_plane_settings *settings,
                      struct lumi_picture *picture, struct lumi_error *error);

#ifdef __cplusplus
}
#endif
#endif
