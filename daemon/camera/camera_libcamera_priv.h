/* What the files of the libcamera backend share. */
#ifndef LUMI_DAEMON_CAMERA_CAMERA_LIBCAMERA_PRIV_H
#define LUMI_DAEMON_CAMERA_CAMERA_LIBCAMERA_PRIV_H

#include "daemon/camera/camera_libcamera_shim.h"
#include "daemon/camera/camera_priv.h"

#define LIBCAMERA_PACKED ((uint64_t)11 << 56 | 1) /* DRM's modifier of vendor MIPI: CSI-2 packed */
#define LIBCAMERA_FORMATS 128

struct libcamera_pixel {
    uint32_t fourcc; /* DRM's */
    uint64_t modifier;
    enum lumi_frame_layout layout;
    enum lumi_bayer bayer;
    int bits;
};
struct libcamera_formats {
    struct shim_format all[LIBCAMERA_FORMATS];
    int count;
};

/* Adds to a struct libcamera_formats, for shim_formats. */
void libcamera_add_format(void *formats, const struct shim_format *format);
/* The one that a setting wants; NULL: none. */
const struct libcamera_pixel *libcamera_choose(const struct libcamera_formats *formats,
                                               const struct lumi_camera_setting *setting, struct shim_format *chosen);

#endif
