#include "tests/unit/fake_camera.h"

#include "daemon/camera/camera_priv.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <unistd.h>

struct fake_camera {
    pthread_mutex_t lock;
    char serial[LUMI_CAMERA_TEXT], story[256];
    bool keeps;
    bool there, armed;
    int frames, fail;
    uint64_t made;
    struct lumi_camera_setting setting;
    double exposure_s, gain;
    int event;
};
struct opened {
    struct lumi_camera camera;
    struct fake_camera *fake;
    struct camera_pool *pool;
};

static struct fake_camera *begin(struct lumi_camera *camera, char letter)
{
    struct fake_camera *fake = ((struct opened *)camera)->fake;
    const size_t length = strlen(fake->story);

    pthread_mutex_lock(&fake->lock);
    if (letter && length + 1 < sizeof fake->story)
        fake->story[length] = letter;
    return fake;
}

static int end(struct fake_camera *fake, struct lumi_error *error)
{
    const bool there = fake->there;

    pthread_mutex_unlock(&fake->lock);
    return there ? LUMI_OK : lumi_fail(error, LUMI_ERR_IO, "camera %s: unplugged", fake->serial);
}

static int configure(struct lumi_camera *camera, const struct lumi_camera_setting *setting, struct lumi_error *error)
{
    struct fake_camera *fake = begin(camera, 'C');

    if (setting->width > 10000) {
        end(fake, error);
        return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "camera %s: not so wide", fake->serial);
    }
    fake->setting = *setting;
    fake->armed = false;
    return end(fake, error);
}

static int arm(struct lumi_camera *camera, struct lumi_error *error)
{
    struct fake_camera *fake = begin(camera, 'A');

    fake->armed = true;
    return end(fake, error);
}

static int disarm(struct lumi_camera *camera, struct lumi_error *error)
{
    struct fake_camera *fake = begin(camera, 'D');

    fake->armed = false;
    return end(fake, error);
}

static int trigger(struct lumi_camera *camera, struct lumi_error *error)
{
    struct fake_camera *fake = begin(camera, 'T');

    fake->frames++;
    return end(fake, error);
}

static int expose(struct lumi_camera *camera, double exposure_s, double gain, struct lumi_error *error)
{
    struct fake_camera *fake = begin(camera, 'E');

    fake->exposure_s = exposure_s;
    fake->gain = gain;
    return end(fake, error);
}

static int status(struct lumi_camera *camera, struct lumi_camera_status *filled, struct lumi_error *error)
{
    struct fake_camera *fake = begin(camera, 0);

    filled->armed = fake->armed;
    filled->frames = fake->made;
    filled->exposure_s = fake->exposure_s;
    return end(fake, error);
}

static int poll_fds(struct lumi_camera *camera, struct pollfd *fds, int max)
{
    if (max < 1)
        return 0;
    fds[0] = (struct pollfd){.fd = ((struct opened *)camera)->fake->event, .events = POLLIN};
    return 1;
}

static int frame(struct lumi_camera *camera, struct lumi_camera_frame **frame, struct lumi_error *error)
{
    struct opened *opened = (struct opened *)camera;
    struct fake_camera *fake = begin(camera, 0);
    int code = fake->fail;
    uint64_t ignored;

    *frame = NULL;
    if (read(fake->event, &ignored, sizeof ignored) < 0)
        ignored = 0;
    fake->fail = LUMI_OK;
    if (code == LUMI_OK && fake->there && fake->armed && fake->frames > 0) {
        fake->frames--;
        *frame = camera_pool_take(opened->pool, 16);
        if (*frame) {
            (*frame)->sequence = fake->made;
            memset(camera_pool_bytes(*frame), (int)(fake->made & 255), 16);
        }
        fake->made++;
    }
    if (code != LUMI_OK) {
        end(fake, error);
        return lumi_fail(error, code, "camera %s: failed as it was told", fake->serial);
    }
    return end(fake, error);
}

static void close_it(struct lumi_camera *camera)
{
    struct opened *opened = (struct opened *)camera;
    struct fake_camera *fake = begin(camera, 'X');

    fake->armed = false;
    end(fake, NULL);
    camera_pool_drop(opened->pool);
    free(opened);
}

static const struct lumi_camera_ops ops = {configure, arm, disarm, trigger, expose, status, poll_fds, frame, close_it};

int fake_camera_open(void *context, struct lumi_camera **camera, struct lumi_error *error)
{
    struct fake_camera *fake = context;
    struct opened *opened;
    bool there;

    pthread_mutex_lock(&fake->lock);
    there = fake->there;
    pthread_mutex_unlock(&fake->lock);
    if (!there)
        return lumi_fail(error, LUMI_ERR_NOTFOUND, "camera %s: not there", fake->serial);
    opened = calloc(1, sizeof *opened);
    opened->camera.ops = &ops;
    opened->fake = fake;
    memcpy(opened->camera.identity.serial, fake->serial, sizeof fake->serial);
    opened->camera.identity.records_itself = fake->keeps;
    if (camera_pool_create(4, &opened->pool, error) != LUMI_OK)
        abort();
    *camera = &opened->camera;
    return end(begin(*camera, 'O'), error);
}

void fake_camera_keeps(struct fake_camera *fake)
{
    fake->keeps = true;
}

struct fake_camera *fake_camera_new(const char *serial)
{
    struct fake_camera *fake = calloc(1, sizeof *fake);

    pthread_mutex_init(&fake->lock, NULL);
    strncpy(fake->serial, serial, sizeof fake->serial - 1);
    fake->event = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
    return fake;
}

void fake_camera_delete(struct fake_camera *fake)
{
    close(fake->event);
    pthread_mutex_destroy(&fake->lock);
    free(fake);
}

static void wake(struct fake_camera *fake)
{
    const uint64_t one = 1;

    if (write(fake->event, &one, sizeof one) < 0)
        abort();
}

void fake_camera_plug(struct fake_camera *fake, bool there)
{
    pthread_mutex_lock(&fake->lock);
    fake->there = there;
    wake(fake);
    pthread_mutex_unlock(&fake->lock);
}

void fake_camera_make_frames(struct fake_camera *fake, int count)
{
    pthread_mutex_lock(&fake->lock);
    fake->frames += count;
    wake(fake);
    pthread_mutex_unlock(&fake->lock);
}

void fake_camera_fail(struct fake_camera *fake, int code)
{
    pthread_mutex_lock(&fake->lock);
    fake->fail = code;
    wake(fake);
    pthread_mutex_unlock(&fake->lock);
}

void fake_camera_story(struct fake_camera *fake, char *story, size_t size)
{
    pthread_mutex_lock(&fake->lock);
    strncpy(story, fake->story, size - 1);
    story[size - 1] = '\0';
    pthread_mutex_unlock(&fake->lock);
}

struct lumi_camera_setting fake_camera_setting(struct fake_camera *fake)
{
    struct lumi_camera_setting setting;

    pthread_mutex_lock(&fake->lock);
    setting = fake->setting;
    pthread_mutex_unlock(&fake->lock);
    return setting;
}

double fake_camera_exposure(struct fake_camera *fake)
{
    double exposure_s;

    pthread_mutex_lock(&fake->lock);
    exposure_s = fake->exposure_s;
    pthread_mutex_unlock(&fake->lock);
    return exposure_s;
}
