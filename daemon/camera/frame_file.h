/* From a frame to the file that a capture keeps of it, without loss and where that is possible without copying: JPEG
 * and the camera's own files as they are; raw data as DNG; RGB, YUYV and NV12 as uncompressed TIFF (the numbers are the
 * camera's, the order of YUYV and NV12 is TIFF's). */
#ifndef LUMI_DAEMON_CAMERA_FRAME_FILE_H
#define LUMI_DAEMON_CAMERA_FRAME_FILE_H

#include "daemon/camera/camera_device.h"

#include <sys/uio.h>

#define LUMI_FRAME_PIECES 2

/* What the file says besides the frame's own; init: nothing. */
struct lumi_frame_about {
    const char *make, *model, *serial; /* NULL: unknown */
    double black, white[2];            /* raw, instead of what the frame says; 0: what it says */
    int64_t unix_us;                   /* when it was exposed; INT64_MIN: unknown */
};
void lumi_frame_about_init(struct lumi_frame_about *about, const struct lumi_camera_identity *identity);

struct lumi_frame_file {
    struct iovec pieces[LUMI_FRAME_PIECES]; /* the file, one after another; they point into the frame */
    int count;                              /* 0: it is the file at `path` */
    const char *path;                       /* the frame's own */
    size_t bytes;                           /* of all pieces; 0 where there is a path */
    char extension[16];                     /* with its dot, small letters */
    int width, height;                      /* as in the frame's format; 0: the frame does not say */
    double exposure_s, iso;                 /* 0: unknown; gain 1 is written as ISO 100 */
    uint8_t *owned[2];
};

/* The frame must stay until lumi_frame_file_finish. LUMI_ERR_FORMAT: it has fewer bytes than its format says;
 * LUMI_ERR_UNSUPPORTED: no file for this format. */
int lumi_frame_file_make(const struct lumi_camera_frame *frame, const struct lumi_frame_about *about,
                         struct lumi_frame_file *file, struct lumi_error *error);
/* An all-zero one is fine. */
void lumi_frame_file_finish(struct lumi_frame_file *file);

/* About how many bytes it will be, before it is made; 0: not known (FILE). */
size_t lumi_frame_file_bytes(const struct lumi_camera_frame *frame);

#endif
