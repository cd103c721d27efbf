/* Cameras of all backends: listing, addresses, opening. */
#include "daemon/camera/camera_priv.h"
#include "proto/base/memory.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#define LISTED_MAX 128

struct backend {
    const char *name;
    camera_list_fn list;
    camera_open_fn open;
    const char *missing;
};
static const struct backend backends[LUMI_CAMERA_BACKENDS] = {
    [LUMI_CAMERA_V4L2] = {"v4l2", camera_v4l2_list, camera_v4l2_open, NULL},
#ifdef LUMI_CAMERA_NO_LIBCAMERA
    [LUMI_CAMERA_LIBCAMERA] = {"libcamera", NULL, NULL, LUMI_CAMERA_NO_LIBCAMERA},
#else
    [LUMI_CAMERA_LIBCAMERA] = {"libcamera", camera_libcamera_list, camera_libcamera_open, NULL},
#endif
#ifdef LUMI_CAMERA_NO_ARAVIS
    [LUMI_CAMERA_ARAVIS] = {"aravis", NULL, NULL, LUMI_CAMERA_NO_ARAVIS},
#else
    [LUMI_CAMERA_ARAVIS] = {"aravis", camera_aravis_list, camera_aravis_open, NULL},
#endif
    [LUMI_CAMERA_FILES] = {"files", NULL, camera_files_open, NULL},
};

const char *lumi_camera_backend_name(enum lumi_camera_backend backend)
{
    return (unsigned)backend < LUMI_CAMERA_BACKENDS ? backends[backend].name : "?";
}

const char *lumi_camera_backend_missing(enum lumi_camera_backend backend)
{
    return (unsigned)backend < LUMI_CAMERA_BACKENDS ? backends[backend].missing : "there is no such backend";
}

void lumi_camera_setting_init(struct lumi_camera_setting *setting)
{
    memset(setting, 0, sizeof *setting);
    setting->chunk_data = true;
}

size_t lumi_frame_bytes(const struct lumi_frame_format *format)
{
    const size_t rows = format->height > 0 && format->stride > 0 ? (size_t)format->height : 0;

    switch (format->layout) {
    case LUMI_LAYOUT_BAYER:
    case LUMI_LAYOUT_GREY:
    case LUMI_LAYOUT_RGB:
    case LUMI_LAYOUT_YUYV:
        return rows * (size_t)format->stride;
    case LUMI_LAYOUT_NV12:
        return (rows + (rows + 1) / 2) * (size_t)format->stride;
    case LUMI_LAYOUT_NONE:
    case LUMI_LAYOUT_JPEG:
    case LUMI_LAYOUT_FILE:
        break;
    }
    return 0;
}

int64_t camera_now_ns(void)
{
    struct timespec now;

    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

/* ---- which one ---- */

int camera_address_parse(const char *address, enum lumi_camera_backend *backend, const char **what,
                         struct lumi_error *error)
{
    const char *colon = strchr(address, ':');

    *backend = (enum lumi_camera_backend)LUMI_CAMERA_BACKENDS;
    *what = address;
    for (int i = 0; colon && i < LUMI_CAMERA_BACKENDS; i++) {
        const size_t length = strlen(backends[i].name);

        if ((size_t)(colon - address) == length && memcmp(address, backends[i].name, length) == 0) {
            *backend = (enum lumi_camera_backend)i;
            *what = colon + 1;
        }
    }
    if (**what == '\0')
        return lumi_fail(error, LUMI_ERR_ARG, "camera address \"%s\": no serial number in it", address);
    if (strlen(*what) >= sizeof((struct lumi_camera_identity *)0)->address)
        return lumi_fail(error, LUMI_ERR_ARG, "camera address of %zu characters", strlen(address));
    if (*backend == LUMI_CAMERA_FILES && **what != '/')
        return lumi_fail(error, LUMI_ERR_ARG, "camera address \"%s\": a folder's whole path is needed", address);
    for (const char *c = address; *c; c++)
        if ((unsigned char)*c < ' ' || *c == 127)
            return lumi_fail(error, LUMI_ERR_ARG, "camera address with control characters in it");
    return LUMI_OK;
}

int lumi_camera_address_check(const char *address, struct lumi_error *error)
{
    enum lumi_camera_backend backend;
    const char *what;

    LUMI_TRY(camera_address_parse(address, &backend, &what, error));
    if ((int)backend < LUMI_CAMERA_BACKENDS && backends[backend].missing)
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "camera %s: %s", address, backends[backend].missing);
    return LUMI_OK;
}

int camera_pick(const struct lumi_camera_identity *cameras, int count, const char *what, struct lumi_error *error)
{
    int found = -1;

    for (int i = 0; i < count; i++)
        if (strcmp(cameras[i].address, what) == 0)
            return i;
    for (int i = 0; i < count; i++) {
        if (strcmp(cameras[i].serial, what) != 0)
            continue;
        if (found >= 0)
            return lumi_fail(error, LUMI_ERR_EXISTS, "camera %s: two have this serial number, at %s and %s", what,
                             cameras[found].address, cameras[i].address);
        found = i;
    }
    if (found < 0)
        return lumi_fail(error, LUMI_ERR_NOTFOUND, "camera %s: not there", what);
    return found;
}

/* ---- listing and opening ---- */

int lumi_camera_list(struct lumi_camera_identity *cameras, int max, struct lumi_error *error)
{
    int count = 0;

    for (int i = 0; i < LUMI_CAMERA_BACKENDS; i++) {
        int here;

        if (!backends[i].list)
            continue;
        here = backends[i].list(count < max ? cameras + count : NULL, count < max ? max - count : 0, error);
        if (here < 0)
            return here;
        count += here;
    }
    return count;
}

/* A serial number alone: the backends are asked in their order. */
static int find_serial(const char *serial, enum lumi_camera_backend *backend, struct lumi_error *error)
{
    struct lumi_camera_identity *listed = lumi_calloc(LISTED_MAX, sizeof *listed);
    int code = LUMI_ERR_NOTFOUND;

    if (!listed)
        return lumi_fail(error, LUMI_ERR_NOMEM, "camera %s: no memory", serial);
    for (int i = 0; i < LUMI_CAMERA_BACKENDS && code == LUMI_ERR_NOTFOUND; i++) {
        int count = backends[i].list ? backends[i].list(listed, LISTED_MAX, error) : 0;

        if (count < 0) {
            code = count;
            break;
        }
        code = camera_pick(listed, count < LISTED_MAX ? count : LISTED_MAX, serial, error);
        if (code >= 0) {
            *backend = (enum lumi_camera_backend)i;
            code = LUMI_OK;
        }
    }
    lumi_free(listed);
    return code;
}

int lumi_camera_open(const char *address, struct lumi_camera **camera, struct lumi_error *error)
{
    enum lumi_camera_backend backend;
    const char *what;

    *camera = NULL;
    LUMI_TRY(lumi_camera_address_check(address, error));
    LUMI_TRY(camera_address_parse(address, &backend, &what, error));
    if ((int)backend == LUMI_CAMERA_BACKENDS)
        LUMI_TRY(find_serial(what, &backend, error));
    return backends[backend].open(what, camera, error);
}

void lumi_camera_close(struct lumi_camera *camera)
{
    if (camera)
        camera->ops->close(camera);
}

/* ---- options ---- */

int camera_option_next(const char **text, struct camera_option *option, struct lumi_error *error)
{
    const char *at = *text + strspn(*text, " ");
    const size_t length = strcspn(at, " ");
    const char *equals = memchr(at, '=', length);

    if (length == 0)
        return 0;
    if (!equals || equals == at || equals == at + length - 1)
        return lumi_fail(error, LUMI_ERR_ARG, "camera option \"%.*s\": it is Name=value", (int)length, at);
    if ((size_t)(equals - at) >= sizeof option->name || length - (size_t)(equals - at) - 1 >= sizeof option->value)
        return lumi_fail(error, LUMI_ERR_ARG, "camera option \"%.*s\": too long", (int)length, at);
    snprintf(option->name, sizeof option->name, "%.*s", (int)(equals - at), at);
    snprintf(option->value, sizeof option->value, "%.*s", (int)(at + length - equals - 1), equals + 1);
    *text = at + length;
    return 1;
}
