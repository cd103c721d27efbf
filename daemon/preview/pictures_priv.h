/* What the files of the pictures share: frame → small copy → picture. */
#ifndef LUMI_DAEMON_PREVIEW_PICTURES_PRIV_H
#define LUMI_DAEMON_PREVIEW_PICTURES_PRIV_H

#include "daemon/camera/camera_device.h"
#include "daemon/preview/camera_pictures.h"
#include "proto/base/raster.h"

enum pictures_kind {
    PICTURES_CODED = 0, /* `bytes` are a file of a picture */
    PICTURES_FILE,      /* `fd` is one: it may be taken away under its name */
    PICTURES_SENSOR,    /* `means`, linear, the sensor's black and white not yet taken into account */
    PICTURES_SRGB,
    PICTURES_YUV
};

/* All that is needed of a frame. */
struct pictures_small {
    enum pictures_kind kind;
    int width, height; /* of the frame */
    uint8_t *bytes;
    size_t size;
    int fd;
    struct lumi_raster means; /* U16: full scale is the frame's, × 257 where that has 8 bits, shifted otherwise */
    double black, white[2];   /* black: share of full scale */
    bool bt709, full_range;
    bool counted;
    double clipped_low, clipped_high;
    char name[LUMI_PICTURE_NAME];
    int shot;
    int64_t unix_us;
};

/* Quick: a few milliseconds for a large frame. `most`: pixels in a row. */
int pictures_take(const struct lumi_camera_frame *frame, int most, struct pictures_small *small,
                  struct lumi_error *error);
void pictures_small_clear(struct pictures_small *small);
/* (transfer full) Slow. */
int pictures_make(const struct pictures_small *small, int most, int quality, struct lumi_picture **picture,
                  struct lumi_error *error);

#endif
