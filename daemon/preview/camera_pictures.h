/* The last picture of each camera, small, with figures to judge its light by: for who looks at the rig from afar.
 *
 * 1. It takes what is left over: a frame is taken if its camera's turn has come (so many a second), if whoever offers
 *    it says that there is room to spare, and if the picture before is not still waiting to be made. Otherwise it is
 *    left alone, and that is counted.
 * 2. lumi_pictures_offer never waits. A thread of the program's own priority makes a small copy of the frame and lets
 * it go at once; what takes long, decoding and coding, is done of that copy by another of the lowest priority (nice 19:
 *    not SCHED_IDLE, for it shares the process's memory, and the locks of who hands that out). A camera has at most two
 * frames out for it, one that waits for its copy and one that is being copied, and the newest replaces the one that
 * waits.
 * 3. The thread of low priority holds no lock of ours: pointers change hands.
 * 4. It reads no clock. With `synchronous` there are no threads: lumi_pictures_work does the work. */
#ifndef LUMI_DAEMON_PREVIEW_CAMERA_PICTURES_H
#define LUMI_DAEMON_PREVIEW_CAMERA_PICTURES_H

#include "proto/base/result.h"

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define LUMI_PICTURES_CAMERAS 32
#define LUMI_PICTURE_NAME 64
#define LUMI_PICTURE_BINS 64

struct lumi_camera_frame;
struct lumi_pictures;

struct lumi_pictures_options {
    int cameras;
    char names[LUMI_PICTURES_CAMERAS][LUMI_PICTURE_NAME]; /* of the cameras */
    double per_second;                                    /* of a camera that nobody watches (1) */
    double watched_per_second;                            /* of one that somebody does (2) */
    int width;                                            /* of a picture, at most (640) */
    int quality;                                          /* of its JPEG (75) */
    bool synchronous;
};
void lumi_pictures_options_init(struct lumi_pictures_options *options);
int lumi_pictures_create(const struct lumi_pictures_options *options, struct lumi_pictures **pictures,
                         struct lumi_error *error);
/* Ends the threads; nobody else may use it any more. Pictures that are held stay. NULL is fine. */
void lumi_pictures_destroy(struct lumi_pictures *pictures);

/* ---- frames, from one thread ---- */

struct lumi_picture_offer {
    int camera;
    struct lumi_camera_frame *frame; /* stays the caller's */
    const char *name;                /* of the frame in the capture; "" or NULL: of none */
    int shot;                        /* −1: of none */
    int64_t unix_us;                 /* when it was taken */
    double white[2];                 /* raw: what red and blue are multiplied with; 0: what the frame says */
    bool spare;                      /* disk, judges and the camera's pool have room */
};
/* True: it will be looked at. */
bool lumi_pictures_offer(struct lumi_pictures *pictures, int64_t now_ns, const struct lumi_picture_offer *offer);
/* What the judge has found, before or after the picture is there. */
void lumi_pictures_sharpness(struct lumi_pictures *pictures, int camera, int shot, double sharpness);
/* synchronous: copies the frames that wait, and makes pictures of the copies, or leaves those as a busy machine does.
 */
void lumi_pictures_work(struct lumi_pictures *pictures, bool make);

/* ---- pictures, from any thread ---- */

int lumi_pictures_camera(const struct lumi_pictures *pictures, const char *name); /* −1: there is none of this name */
const char *lumi_pictures_name(const struct lumi_pictures *pictures, int camera);

struct lumi_picture {
    int camera;
    uint64_t number; /* among this camera's, 1, 2 …; 0: not among them yet */
    char frame[LUMI_PICTURE_NAME];
    int shot;
    int64_t unix_us;
    int width, height; /* of the frame */
    int small_width, small_height;
    uint8_t *jpeg;
    size_t size;
    double sharpness;                 /* the judge's; NaN: not known (yet) */
    double mean;                      /* of the luma below, 0..1 */
    double clipped_low, clipped_high; /* share of the samples */
    uint32_t
        histogram[LUMI_PICTURE_BINS]; /* of the picture's luma as it is shown (sRGB): pixels of the small picture */
    atomic_int others;
};
/* (transfer full) NULL: there is none yet. Its sharpness is asked for by lumi_pictures_sharpness_of. */
struct lumi_picture *lumi_pictures_last(struct lumi_pictures *pictures, int camera);
void lumi_picture_release(struct lumi_picture *picture); /* NULL is fine */
/* NaN: the judge has not said. */
double lumi_pictures_sharpness_of(struct lumi_pictures *pictures, const struct lumi_picture *picture);

/* Somebody watches this camera, or does so no more. */
void lumi_pictures_watch(struct lumi_pictures *pictures, int camera, bool watched);
int lumi_pictures_watchers(struct lumi_pictures *pictures, int camera);

/* `made` is called, in a thread of the library, when a camera has a new picture, or something more is known of the last
 * one; it must not call back. NULL: nobody; when that has returned it is not called any more. */
void lumi_pictures_listen(struct lumi_pictures *pictures, void (*made)(void *context, int camera), void *context);

struct lumi_pictures_figures {
    uint64_t offered, taken, shed; /* shed: there was no room to spare; the rest came too soon after the one before */
    uint64_t made, failed;         /* failed: no picture, as of a damaged frame */
};
void lumi_pictures_figures(struct lumi_pictures *pictures, struct lumi_pictures_figures *figures);

#endif
