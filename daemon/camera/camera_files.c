/* Cameras that record by themselves: their files become frames.
 *
 * Options: Take=new (what is there when the camera is armed stays; the default) or Take=all (a card put in after the
 * sweep), Settle=SECONDS (a file that has not changed for so long is whole; 1), Depth=FOLDERS (below the one that is
 * watched; 3).
 *
 * 1. What was taken is remembered by folder as long as the program runs, so that a card that was pulled out and comes
 *    back goes on where it was. A frame whose file is not there any more when it is released was probably not stored:
 *    it is taken again when it is back.
 * 2. Nothing is dropped: while nobody takes the frames the host does not ask for more, and the files wait where they
 *    are. */
#include "daemon/camera/camera_files_priv.h"
#include "proto/base/memory.h"
#include "proto/image/image.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <sys/timerfd.h>
#include <unistd.h>

#define LOOK_NS 200000000 /* the folder is looked at this often */
#define OUT_MOST 16384    /* frames out at once: only their names, all of a sweep are kept until it is over */

/* Who may still hold frames when the camera is closed. */
struct desk {
    pthread_mutex_t lock;
    int out;
    bool closed;
};

struct files_frame {
    struct lumi_camera_frame frame; /* first */
    struct desk *desk;
    struct files_memory *memory;
    uint64_t key;
    char path[1280];
};

struct files_camera {
    struct lumi_camera camera; /* first */
    struct files_watch watch;
    struct desk *desk;
    int timer;
    bool armed, all;
    int64_t looked_ns;
    uint64_t frames, damaged, last_number;
    char last_folder[256]; /* of the file before: numbers count within a folder */
};

static struct files_camera *own(struct lumi_camera *camera)
{
    return (struct files_camera *)camera;
}

static void leave_desk(struct desk *desk, bool closing)
{
    pthread_mutex_lock(&desk->lock);
    if (closing)
        desk->closed = true;
    else
        desk->out--;
    bool last = desk->closed && desk->out == 0;
    pthread_mutex_unlock(&desk->lock);
    if (last) {
        pthread_mutex_destroy(&desk->lock);
        lumi_free(desk);
    }
}

static void release(struct lumi_camera_frame *frame)
{
    struct files_frame *made = (struct files_frame *)frame;
    struct stat status;

    if (stat(made->path, &status) != 0)
        files_memory_remove(made->memory, made->key);
    leave_desk(made->desk, false);
    lumi_free(made);
}

static int parse_options(struct files_camera *files, const char *options, struct lumi_error *error)
{
    struct camera_option option;
    int code;

    while ((code = camera_option_next(&options, &option, error)) > 0) {
        char *end;
        double value = strtod(option.value, &end);
        bool number = end != option.value && *end == '\0';
        if (!strcmp(option.name, "Take") && (!strcmp(option.value, "all") || !strcmp(option.value, "new")))
            files->all = option.value[0] == 'a';
        else if (!strcmp(option.name, "Settle") && number && value >= 0 && value <= 3600)
            files->watch.settle_ns = (int64_t)(value * 1e9);
        else if (!strcmp(option.name, "Depth") && number && value >= 0 && value <= 8)
            files->watch.depth = (int)value;
        else
            return lumi_fail(error, LUMI_ERR_ARG,
                             "camera option \"%s=%s\": Take=new or all, Settle=SECONDS, Depth=0..8", option.name,
                             option.value);
    }
    return code;
}

static int configure(struct lumi_camera *camera, const struct lumi_camera_setting *setting, struct lumi_error *error)
{
    struct files_camera *files = own(camera);

    if (setting->trigger == LUMI_TRIGGER_SOFTWARE)
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED,
                         "%s: a camera that records by itself cannot be triggered from here", files->watch.folder);
    if (files->armed) {
        files->armed = false;
        files_memory_set_armed(files->watch.memory, false);
    }
    files->all = false;
    files->watch.settle_ns = 1000000000;
    files->watch.depth = 3;
    return parse_options(files, setting->options, error);
}

static int arm(struct lumi_camera *camera, struct lumi_error *error)
{
    struct files_camera *files = own(camera);
    struct files_memory *memory = files->watch.memory;

    LUMI_TRY(files_watch_scan(&files->watch, camera_now_ns(), error));
    if (!files_memory_armed(memory)) {
        files_memory_clear(memory);
        if (!files->all)
            LUMI_TRY(files_watch_skip(&files->watch, error));
        files_memory_set_armed(memory, true);
    }
    files->armed = true;
    files->frames = files->damaged = files->last_number = 0;
    files->last_folder[0] = '\0';
    return LUMI_OK;
}

static int disarm(struct lumi_camera *camera, struct lumi_error *error)
{
    struct files_camera *files = own(camera);

    (void)error;
    files->armed = false;
    files_memory_set_armed(files->watch.memory, false);
    return LUMI_OK;
}

static int trigger(struct lumi_camera *camera, struct lumi_error *error)
{
    return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "%s: a camera that records by itself cannot be triggered from here",
                     own(camera)->watch.folder);
}

static int tell_status(struct lumi_camera *camera, struct lumi_camera_status *status, struct lumi_error *error)
{
    struct files_camera *files = own(camera);
    struct statvfs disk;
    struct stat there;

    if (stat(files->watch.folder, &there) != 0 || (uint64_t)there.st_dev != files->watch.device)
        return lumi_fail(error, LUMI_ERR_IO, "%s: the camera's folder is gone", files->watch.folder);
    *status = (struct lumi_camera_status){.armed = files->armed,
                                          .format = {.layout = LUMI_LAYOUT_FILE},
                                          .temperature = NAN,
                                          .battery = NAN,
                                          .card_free_bytes = -1,
                                          .frames = files->frames,
                                          .damaged = files->damaged};
    if (statvfs(files->watch.folder, &disk) == 0)
        status->card_free_bytes = (int64_t)(disk.f_bavail * disk.f_frsize);
    return LUMI_OK;
}

static int poll_fds(struct lumi_camera *camera, struct pollfd *fds, int max)
{
    if (max < 1)
        return 0;
    fds[0] = (struct pollfd){.fd = own(camera)->timer, .events = POLLIN};
    return 1;
}

/* The camera's own count, and what it says is missing before this file. Without a number in the name: nothing. */
static void count_file(struct files_camera *files, const struct files_item *item, struct lumi_camera_frame *frame)
{
    const char *slash = strrchr(item->path, '/');
    size_t length = slash ? (size_t)(slash - item->path) : 0;
    uint64_t number = files_number(item->path);
    bool same = strlen(files->last_folder) == length && !strncmp(files->last_folder, item->path, length);

    frame->sequence = number;
    if (number > 0 && files->last_number > 0 && same && number > files->last_number + 1 &&
        number - files->last_number < 10000)
        frame->gap = (uint32_t)(number - files->last_number - 1);
    files->last_number = number;
    snprintf(files->last_folder, sizeof files->last_folder, "%.*s", (int)length, item->path);
}

static void describe(struct lumi_camera_frame *frame, const struct lumi_image_meta *meta)
{
    frame->format.width = meta->info.width;
    frame->format.height = meta->info.height;
    frame->exposure_s = meta->exposure_s;
    frame->gain = meta->iso > 0 ? meta->iso / 100 : 0;
    if (meta->taken_us != 0 && meta->taken_us < INT64_MAX / 1000)
        frame->device_ns = meta->taken_us * 1000;
}

/* A file that is no picture that can be read is a frame all the same, damaged; one of another camera is none. */
static int make_frame(struct files_camera *files, const struct files_item *item, struct lumi_camera_frame **result,
                      struct lumi_error *error)
{
    struct files_frame *made = lumi_calloc(1, sizeof *made);
    struct lumi_image_meta meta = {0};

    if (!made) {
        files_memory_remove(files->watch.memory, item->key);
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: no memory for a frame", files->watch.folder);
    }
    camera_frame_init(&made->frame);
    snprintf(made->path, sizeof made->path, "%s/%s", files->watch.folder, item->path);
    made->desk = files->desk;
    made->memory = files->watch.memory;
    made->key = item->key;
    struct lumi_camera_frame *frame = &made->frame;
    frame->release = release;
    frame->path = made->path;
    frame->format.layout = LUMI_LAYOUT_FILE;
    frame->size = (size_t)item->size;
    frame->file_mtime_ns = item->mtime_ns;
    frame->host_ns = camera_now_ns();
    bool picture = lumi_image_format_of_name(made->path) != LUMI_IMAGE_AUTO;
    frame->damaged = !item->whole || (picture && lumi_image_read_meta(made->path, &meta, NULL) != LUMI_OK);
    describe(frame, &meta);
    bool ours = files_memory_is_of(made->memory, meta.serial);
    int code = ours ? LUMI_OK
                    : lumi_fail(error, LUMI_ERR_FORMAT, "%s: taken by the camera %s %s, not by the one of this folder",
                                made->path, meta.model, meta.serial);
    lumi_image_meta_finish(&meta);
    if (code != LUMI_OK) {
        lumi_free(made);
        return code;
    }
    count_file(files, item, frame);
    files->frames++;
    files->damaged += frame->damaged;
    pthread_mutex_lock(&files->desk->lock);
    files->desk->out++;
    pthread_mutex_unlock(&files->desk->lock);
    *result = frame;
    return LUMI_OK;
}

static int next_frame(struct lumi_camera *camera, struct lumi_camera_frame **frame, struct lumi_error *error)
{
    struct files_camera *files = own(camera);
    int64_t now = camera_now_ns();
    struct files_item *item;
    uint64_t expired;

    *frame = NULL;
    while (read(files->timer, &expired, sizeof expired) < 0 && errno == EINTR)
        ;
    if (!files->armed)
        return LUMI_OK;
    pthread_mutex_lock(&files->desk->lock);
    bool full = files->desk->out >= OUT_MOST;
    pthread_mutex_unlock(&files->desk->lock);
    if (full)
        return LUMI_OK;
    if (now - files->looked_ns >= LOOK_NS * 9 / 10) {
        files->looked_ns = now;
        LUMI_TRY(files_watch_scan(&files->watch, now, error));
    }
    if (!files_watch_next(&files->watch, now, &item))
        return LUMI_OK;
    return make_frame(files, item, frame, error);
}

static void close_files(struct lumi_camera *camera)
{
    struct files_camera *files = own(camera);

    if (files->timer >= 0)
        close(files->timer);
    leave_desk(files->desk, true);
    files_watch_finish(&files->watch);
    lumi_free(files);
}

static const struct lumi_camera_ops ops = {.configure = configure,
                                           .arm = arm,
                                           .disarm = disarm,
                                           .trigger = trigger,
                                           .status = tell_status,
                                           .poll_fds = poll_fds,
                                           .frame = next_frame,
                                           .close = close_files};

static void identify(struct files_camera *files)
{
    struct lumi_camera_identity *identity = &files->camera.identity;

    identity->backend = LUMI_CAMERA_FILES;
    snprintf(identity->serial, sizeof identity->serial, "%.*s", (int)sizeof identity->serial - 1, files->watch.folder);
    snprintf(identity->address, sizeof identity->address, "%s", files->watch.folder);
    snprintf(identity->model, sizeof identity->model, "files");
    identity->hardware_trigger = true; /* what fires it is not our business */
    identity->device_clock = true;
    identity->clock_step_ns = 1e9; /* EXIF's, but for fractions that some cameras write */
    identity->records_itself = true;
}

int camera_files_open(const char *folder, struct lumi_camera **camera, struct lumi_error *error)
{
    const struct itimerspec often = {{0, LOOK_NS}, {0, LOOK_NS}};
    struct files_camera *files = lumi_calloc(1, sizeof *files);

    *camera = NULL;
    if (!files)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: no memory for a camera", folder);
    files->timer = -1;
    int code = files_watch_init(&files->watch, folder, error);
    if (code != LUMI_OK)
        goto failed;
    files->desk = lumi_calloc(1, sizeof *files->desk);
    if (!files->desk) {
        code = lumi_fail(error, LUMI_ERR_NOMEM, "%s: no memory for a camera", folder);
        goto failed;
    }
    pthread_mutex_init(&files->desk->lock, NULL);
    files->camera.ops = &ops;
    files->timer = timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC | TFD_NONBLOCK);
    if (files->timer < 0 || timerfd_settime(files->timer, 0, &often, NULL) != 0) {
        code = lumi_fail_errno(error, folder, "making a timer");
        goto failed;
    }
    identify(files);
    *camera = &files->camera;
    return LUMI_OK;
failed:
    if (files->timer >= 0)
        close(files->timer);
    if (files->desk)
        leave_desk(files->desk, true);
    files_watch_finish(&files->watch);
    lumi_free(files);
    return code;
}
