/* A camera, whatever it is behind: V4L2, libcamera, Aravis (GigE Vision, USB3 Vision), or files that it leaves
 * somewhere. One thread uses a camera: the one that opened it (camera_host.h is that thread).
 *
 * 1. A camera is known by its serial number. What was unplugged and comes back is found again by it.
 * 2. A frame that was handed out stays valid until it is released, whatever happens to the camera; the pool it comes
 * from is bounded, and a pool that is empty drops frames and counts them, never waits.
 * 3. Sequence numbers and device times are what the device says; nothing is made up. What it does not say is 0 or
 *    LUMI_CAMERA_NO_TIME. */
#ifndef LUMI_DAEMON_CAMERA_CAMERA_DEVICE_H
#define LUMI_DAEMON_CAMERA_CAMERA_DEVICE_H

#include "proto/base/result.h"

#include <poll.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define LUMI_CAMERA_TEXT 96
#define LUMI_CAMERA_POLL 8 /* descriptors of one camera, at most */
#define LUMI_CAMERA_NO_TIME INT64_MIN

/* ---- frames ---- */

enum lumi_frame_layout {
    LUMI_LAYOUT_NONE = 0,
    LUMI_LAYOUT_JPEG,  /* `data` is a whole JPEG file */
    LUMI_LAYOUT_BAYER, /* raw, one sample a pixel; `bits` 8, or 10, 12, 16 in little-endian 16-bit words, low bits used
                        */
    LUMI_LAYOUT_GREY,  /* as BAYER, without a filter */
    LUMI_LAYOUT_RGB,   /* 8 bits, R G B */
    LUMI_LAYOUT_YUYV,  /* 4:2:2, Y0 U Y1 V */
    LUMI_LAYOUT_NV12,  /* 4:2:0: Y plane, then interleaved U V; rows of `stride` bytes each */
    LUMI_LAYOUT_FILE   /* `path` names a file the camera wrote by itself: its JPEG, its maker's raw file, its video */
};
enum lumi_bayer { LUMI_BAYER_RGGB = 0, LUMI_BAYER_GRBG, LUMI_BAYER_GBRG, LUMI_BAYER_BGGR };

struct lumi_frame_format {
    enum lumi_frame_layout layout;
    enum lumi_bayer bayer;
    int width, height;
    int bits;   /* a sample */
    int stride; /* bytes a row */
    /* YUYV, NV12; JPEG says it itself: ITU-R BT.709's matrix instead of BT.601's, 0..255 instead of 16..235 */
    bool bt709, full_range;
};
/* Bytes of a whole frame of this format; 0 for JPEG and FILE, whose size differs. */
size_t lumi_frame_bytes(const struct lumi_frame_format *format);

struct lumi_camera_frame {
    struct lumi_frame_format format;
    const uint8_t *data;
    size_t size;
    const char *path;        /* FILE only; the file stays where it is until the frame is released */
    int64_t file_mtime_ns;   /* FILE only: Unix time of its last change, LUMI_CAMERA_NO_TIME otherwise */
    int64_t device_ns;       /* the camera's clock, at the beginning of the exposure where it can, see identity */
    bool at_end;             /* device_ns is of the frame's end instead */
    int64_t host_ns;         /* CLOCK_MONOTONIC when its last byte was here */
    uint64_t sequence;       /* the device's own count */
    uint32_t gap;            /* frames that were lost just before this one: the sequence says so, or the pool or the
                                queue was full */
    bool damaged;            /* packets are missing, the driver says error: `data` is what there is */
    double exposure_s, gain; /* as the camera reports them for this frame; 0: it does not (gain: linear, 1 = base) */
    double black, white[2];  /* raw, as it reports them: sample value of no light, what red and blue are multiplied with
                                to match green; 0: it does not */
    double temperature;      /* °C; NaN: unknown */
    uint64_t trigger;        /* the device's own trigger count, where it has one (chunk data) */
    uint32_t packets_resent, packets_missing;         /* of this frame, GigE Vision */
    void (*release)(struct lumi_camera_frame *frame); /* the backend's: gives it back to its pool; from any thread */
    void *owner;
    atomic_uint others; /* holders beside the first: 0 as it comes */
};
/* One more holder; each of them releases it once, from any thread. */
static inline struct lumi_camera_frame *lumi_camera_frame_ref(struct lumi_camera_frame *frame)
{
    atomic_fetch_add_explicit(&frame->others, 1, memory_order_relaxed);
    return frame;
}
static inline void lumi_camera_frame_release(struct lumi_camera_frame *frame)
{
    if (frame && atomic_fetch_sub_explicit(&frame->others, 1, memory_order_acq_rel) == 0) {
        atomic_store_explicit(&frame->others, 0, memory_order_relaxed);
        frame->release(frame);
    }
}

/* ---- the camera ---- */

enum lumi_camera_backend { LUMI_CAMERA_V4L2 = 0, LUMI_CAMERA_LIBCAMERA, LUMI_CAMERA_ARAVIS, LUMI_CAMERA_FILES };
#define LUMI_CAMERA_BACKENDS 4
const char *lumi_camera_backend_name(enum lumi_camera_backend backend);
/* NULL where it is built in; otherwise why it is not ("libcamera 0.0.3 is older than 0.4"). */
const char *lumi_camera_backend_missing(enum lumi_camera_backend backend);

struct lumi_camera_identity {
    enum lumi_camera_backend backend;
    char serial[LUMI_CAMERA_TEXT]; /* what it is known by */
    char vendor[LUMI_CAMERA_TEXT], model[LUMI_CAMERA_TEXT], firmware[LUMI_CAMERA_TEXT];
    char address[256]; /* where it is now: "/dev/video0", "192.168.1.7", a folder */
    bool hardware_trigger, software_trigger, exposure_control, gain_control, white_balance_control, action_command;
    bool device_clock;    /* frames carry device_ns */
    double clock_step_ns; /* of the device's clock */
    bool monotonic_clock; /* device_ns is this host's CLOCK_MONOTONIC (V4L2) */
    bool records_itself;  /* FILES: nothing can be configured, frames may come much later */
};

enum lumi_camera_trigger { LUMI_TRIGGER_FREE = 0, LUMI_TRIGGER_HARDWARE, LUMI_TRIGGER_SOFTWARE };
struct lumi_camera_setting {
    int width, height;             /* 0: as large as it goes */
    enum lumi_frame_layout layout; /* NONE: raw where it can, else JPEG, else what there is */
    int bits;                      /* 0: the most it has */
    double exposure_s;             /* 0: the camera's own choice */
    double gain;                   /* linear; 0: the camera's own choice */
    double white_balance;          /* K; 0: the camera's own choice */
    double frame_rate;             /* free-running only; 0: the camera's default */
    enum lumi_camera_trigger trigger;
    char trigger_input[32]; /* "Line1"; "": the backend's default */
    bool trigger_falling;
    bool chunk_data;   /* ask for exposure, gain, trigger count with every frame */
    int buffers;       /* of the pool; 0: 8 */
    bool dmabuf;       /* V4L2: exports buffers as dmabuf instead of copying; where it cannot, LUMI_ERR_UNSUPPORTED */
    char options[256]; /* the backend's own: "GainAuto=Off PacketSize=8000"; every unknown one is refused */
};
void lumi_camera_setting_init(struct lumi_camera_setting *setting);

struct lumi_camera_status {
    bool armed;
    struct lumi_frame_format format;   /* of the frames that come */
    double exposure_s, gain;           /* as it is set now; 0: unknown */
    double temperature;                /* °C, NaN unknown */
    double battery;                    /* 0..1, NaN unknown */
    int64_t card_free_bytes;           /* −1 unknown */
    uint64_t frames, dropped, damaged; /* since armed: handed out, lost (sequence gaps, empty pool), incomplete */
    uint64_t packets_resent, packets_missing;
};

struct lumi_camera;
struct lumi_camera_ops {
    /* Sets it up for frames, not yet armed. LUMI_ERR_UNSUPPORTED: it cannot, with what it could. May be called again;
     * it disarms. */
    int (*configure)(struct lumi_camera *camera, const struct lumi_camera_setting *setting, struct lumi_error *error);
    int (*arm)(struct lumi_camera *camera, struct lumi_error *error); /* from now on frames come */
    int (*disarm)(struct lumi_camera *camera, struct lumi_error *error);
    /* Fires a camera that is set to LUMI_TRIGGER_SOFTWARE. */
    int (*trigger)(struct lumi_camera *camera, struct lumi_error *error);
    /* A new exposure time and gain, armed or not, from the next frame on that says so (brackets); 0 leaves it as it
     * is. May be NULL. */
    int (*expose)(struct lumi_camera *camera, double exposure_s, double gain, struct lumi_error *error);
    /* LUMI_ERR_IO: the camera is gone. */
    int (*status)(struct lumi_camera *camera, struct lumi_camera_status *status, struct lumi_error *error);
    /* What to wait for: at most `max` descriptors; returns their number. 0: ask `frame` every few milliseconds. */
    int (*poll_fds)(struct lumi_camera *camera, struct pollfd *fds, int max);
    /* The next frame, the caller's to release; NULL: none now. LUMI_ERR_IO: the camera is gone (close it); another
     * code: it goes on, the error is told. */
    int (*frame)(struct lumi_camera *camera, struct lumi_camera_frame **frame, struct lumi_error *error);
    void (*close)(struct lumi_camera *camera); /* disarms; frames that are out stay valid */
};
struct lumi_camera {
    const struct lumi_camera_ops *ops;
    struct lumi_camera_identity identity;
};

/* The cameras that are there now, of all backends but FILES, or of one. Returns how many (at most `max` filled in) or a
 * negative code. Two with one serial number are both listed; lumi_camera_open refuses them. */
int lumi_camera_list(struct lumi_camera_identity *cameras, int max, struct lumi_error *error);
/* Address: "v4l2:SERIAL", "libcamera:SERIAL", "aravis:SERIAL", or the serial alone (the first backend that has it, in
 * this order: a USB camera is seen by two), or "files:/folder" (what follows is the serial's stand-in: the folder). A
 * place instead of a serial ("v4l2:/dev/video0", "aravis:192.168.1.7") is for benches. LUMI_ERR_ARG: malformed, or of a
 * backend that is not built in (LUMI_ERR_UNSUPPORTED); LUMI_ERR_NOTFOUND: not there (now); LUMI_ERR_BUSY: another
 * program has it; LUMI_ERR_EXISTS: two have this serial. */
int lumi_camera_address_check(const char *address, struct lumi_error *error); /* without looking for the camera */
int lumi_camera_open(const char *address, struct lumi_camera **camera, struct lumi_error *error);
void lumi_camera_close(struct lumi_camera *camera); /* NULL is fine */
/* Files of cameras that record by themselves, in order of their names, numbers in them by value; as strcmp. */
int lumi_camera_file_order(const char *a, const char *b);

#endif
