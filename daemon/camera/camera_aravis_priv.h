/* What the files of the Aravis backend share. One thread uses a camera; what Aravis' own threads touch is atomic. */
#ifndef LUMI_DAEMON_CAMERA_CAMERA_ARAVIS_PRIV_H
#define LUMI_DAEMON_CAMERA_CAMERA_ARAVIS_PRIV_H

#include "daemon/camera/camera_priv.h"

#include <arv.h>
#include <stdatomic.h>

/* ---- pixel formats (PFNC 2.1) ---- */

enum aravis_packing {
    ARAVIS_PLAIN = 0, /* as lumi_frame_format has it */
    ARAVIS_LSB,       /* PFNC "p": a stream of bits, lowest first */
    ARAVIS_GVSP,      /* GigE Vision "Packed": 2 pixels in 3 bytes, their low bits in the middle one */
    ARAVIS_BGR
};
struct aravis_pixels {
    enum lumi_frame_layout layout;
    enum lumi_bayer bayer;
    int bits;
    enum aravis_packing packing;
};
/* Of a GenICam name ("BayerRG12p"); false: none we can use. */
bool aravis_pixels_of_name(const char *name, struct aravis_pixels *pixels);
/* The frame's format; width and height filled in already. */
void aravis_format(const struct aravis_pixels *pixels, struct lumi_frame_format *format);
/* Bytes of `count` pixels as they come over the wire. */
size_t aravis_packed_bytes(const struct aravis_pixels *pixels, size_t count);
/* From the wire to lumi_frame_format's form; `from` has aravis_packed_bytes(count), `to` the frame's bytes. */
void aravis_unpack(const struct aravis_pixels *pixels, const uint8_t *from, size_t count, uint8_t *to);

/* ---- finding cameras ---- */

#define ARAVIS_DISCOVERY_SIZE 0xf8 /* GigE Vision 2.0, 16.2: DISCOVERY_ACK */
/* What a camera answered to a discovery: a whole GVCP packet. False: it is none. */
bool aravis_discovery_parse(const uint8_t *packet, size_t size, struct lumi_camera_identity *identity);
/* The one that `what` names: a serial number, an address. */
int aravis_find(const char *what, struct lumi_camera_identity *camera, struct lumi_error *error);
ArvDevice *aravis_device_open(const struct lumi_camera_identity *found, GError **error);
ArvChunkParser *aravis_chunk_parser(ArvCamera *camera); /* its description is read again: one at a time */

/* ---- the camera ---- */

struct aravis_camera {
    struct lumi_camera base;
    ArvCamera *camera;
    ArvStream *stream;      /* while armed */
    ArvChunkParser *chunks; /* where chunk data are on */
    struct camera_pool *pool;
    int event; /* eventfd: a frame has come, or the camera has gone */
    atomic_bool gone;
    atomic_int telling; /* calls of Aravis' that have not ended */
    bool configured, gain_in_db;
    struct lumi_camera_setting setting;
    struct aravis_pixels pixels;
    struct lumi_frame_format format;
    const char *chunk_exposure, *chunk_gain, *chunk_trigger; /* names of the features that the camera has, or NULL */
    int packet_size, packet_delay;                           /* options; 0: found out, none */
    bool packet_resend;
    int packet_timeout_us, frame_retention_us; /* 0: Aravis' own */
    uint32_t action_device, action_group, action_mask;
    uint64_t last_id; /* of the last frame, when `seen` */
    bool seen;
    uint64_t frames, dropped, damaged, resent, missing; /* since armed */
    double set_exposure, set_gain;                      /* what the camera said after the last setting */
};

/* Takes and frees `problem`. LUMI_ERR_IO where the camera did not answer, else LUMI_ERR_UNSUPPORTED. */
int aravis_fail(struct aravis_camera *camera, GError *problem, const char *doing, struct lumi_error *error);
bool aravis_has(struct aravis_camera *camera, const char *feature);
double aravis_gain_from(const struct aravis_camera *camera, double value);
double aravis_gain_to(const struct aravis_camera *camera, double gain);

int aravis_configure(struct lumi_camera *camera, const struct lumi_camera_setting *setting, struct lumi_error *error);
int aravis_expose(struct lumi_camera *camera, double exposure_s, double gain, struct lumi_error *error);
/* Fills in what the camera can do. */
void aravis_identify(struct aravis_camera *camera);
/* Sends a GigE Vision action command to the camera. */
int aravis_action(struct aravis_camera *camera, struct lumi_error *error);

#endif
