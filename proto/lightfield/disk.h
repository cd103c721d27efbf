/* The blending disks (Overbeck et al. 2018, sections 4.1 and 4.4, figure 6). */
#ifndef LUMI_PROTO_LIGHTFIELD_DISK_H
#define LUMI_PROTO_LIGHTFIELD_DISK_H

#ifdef __cplusplus
extern "C" {
#endif

enum lumi_disk_shape { LUMI_DISK_OVAL = 0, LUMI_DISK_RECTANGLE = 1 };
enum lumi_disk_kernel { LUMI_KERNEL_LINEAR = 0, LUMI_KERNEL_GAUSSIAN = 1, LUMI_KERNEL_CUBIC = 2 };

/* A view's disk lies in the plane through its centre of projection normal to its optical axis; u and v run along the
 * image's x (right) and y (down). Extents from the origin to the edge in each direction, metres, all positive: the
 * union of four quarter ellipses (or the rectangle). */
struct lumi_disk {
    float u_neg, u_pos, v_neg, v_pos;
};

/* ρ(u, v): 1 at the origin, 0 at and beyond the edge. With r the distance from the origin as a share of the extents
 * (oval: elliptic norm; rectangle: separable, product of both axes): linear 1−r; Gaussian exp(−r²/(2·0.4²)) lowered and
 * scaled so that it is 0 at r = 1; cubic 1−3r²+2r³. `scale` widens the disk. */
float lumi_disk_weight(const struct lumi_disk *disk, enum lumi_disk_shape shape, enum lumi_disk_kernel kernel,
                       float scale, float u, float v);

#ifdef __cplusplus
}
#endif
#endif
