/* libcamera's C++ as C: calls handed through, nothing decided. camera_libcamera.c says how it is used. */
#ifndef LUMI_DAEMON_CAMERA_CAMERA_LIBCAMERA_SHIM_H
#define LUMI_DAEMON_CAMERA_CAMERA_LIBCAMERA_SHIM_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define SHIM_PLANES 3

struct shim_identity {
    const char *id, *model; /* valid during the call */
    const int64_t *devices; /* dev_t of the nodes that it is made of */
    int device_count;
};
struct shim_format {
    bool raw; /* of the raw stream, before the image processor */
    uint32_t fourcc;
    uint64_t modifier;
    int width, height; /* of formats: the largest */
    int stride, buffers;
    bool bt709, full_range;
};
struct shim_controls { /* 0: the camera's own choice */
    double exposure_s, gain, white_balance, frame_s;
};
struct shim_plane {
    int fd; /* remains the shim's */
    uint32_t offset, length;
};
enum shim_status { SHIM_GOOD = 0, SHIM_DAMAGED, SHIM_CANCELLED };
struct shim_result { /* of a request: what the camera says of the frame; 0: nothing */
    enum shim_status status;
    int buffer;
    uint32_t sequence, used[SHIM_PLANES];
    int64_t buffer_ns, sensor_ns;
    double exposure_s, gain, temperature;
    double black, white[2]; /* black: of 65536; gains of red and blue */
    bool has_temperature;
};
enum shim_can { SHIM_CAN_EXPOSE = 1, SHIM_CAN_GAIN = 2, SHIM_CAN_WHITE_BALANCE = 4, SHIM_CAN_FRAME_TIME = 8 };

struct shim_camera;
/* Both in threads of libcamera's. */
typedef void (*shim_done_fn)(void *context, const struct shim_result *result);
typedef void (*shim_gone_fn)(void *context);

const char *shim_version(void);
/* All return 0 or −errno. */
int shim_list(void (*each)(void *context, const struct shim_identity *identity), void *context);
int shim_open(const char *id, shim_done_fn done, shim_gone_fn gone, void *context, struct shim_camera **camera);
void shim_close(struct shim_camera *camera);
unsigned shim_can(const struct shim_camera *camera); /* enum shim_can, or'ed */
int shim_formats(struct shim_camera *camera, bool raw, void (*each)(void *context, const struct shim_format *format),
                 void *context);
/* `format` becomes what it takes. */
int shim_configure(struct shim_camera *camera, struct shim_format *format);
int shim_allocate(struct shim_camera *camera); /* the number of buffers */
int shim_buffer(struct shim_camera *camera, int buffer, struct shim_plane planes[SHIM_PLANES]); /* of planes */
int shim_start(struct shim_camera *camera, const struct shim_controls *controls);
int shim_queue(struct shim_camera *camera, int buffer, const struct shim_controls *controls);
int shim_stop(struct shim_camera *camera); /* all requests have come back when it returns; buffers are given up */

#ifdef __cplusplus
}
#endif
#endif
