/* A process with cameras: what they see is drawn for where they truly are, as their shutters move through it. */
#include "sim/gige/rig_parts.h"

#include "proto/base/memory.h"
#include "proto/mechanism/kinematics.h"
#include "sim/camera.h"
#include "sim/exposure.h"
#include "sim/place.h"

#include <errno.h>
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#define LOOKS 12   /* small pictures of each camera before it begins */
#define MEASURED 4 /* pictures that are drawn to see how long it takes */
#define THREADS 1  /* a picture: there is a process for every processor */

struct eyes {
    const struct rig_eyes *setup;
    struct sim_scene *scene;
    struct sim_gige *gige;
    pthread_mutex_t lock; /* of the clock */
    uint64_t board_ns, heard_ns;
};

static uint64_t host_ns(void)
{
    struct timespec now;

    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000000 + (uint64_t)now.tv_nsec;
}

/* The board's clock, carried on from when it was last told. */
static uint64_t now_ns(void *context)
{
    struct eyes *e = context;

    pthread_mutex_lock(&e->lock);
    const double since = (double)(host_ns() - e->heard_ns) * e->setup->rig->speed;
    const uint64_t now = e->board_ns + (e->heard_ns ? (uint64_t)since : 0);
    pthread_mutex_unlock(&e->lock);
    return now;
}

static void set_clock(struct eyes *e, uint64_t board_ns)
{
    pthread_mutex_lock(&e->lock);
    e->board_ns = board_ns;
    e->heard_ns = host_ns();
    pthread_mutex_unlock(&e->lock);
}

static int picture(void *context, int index, const struct sim_gige_exposure *exposure, struct lumi_raster *raster,
                   struct lumi_error *error)
{
    const struct eyes *e = context;
    const struct sim_moment moment = {exposure->angle, exposure->drop, exposure->moved, exposure->askew, NULL};

    return sim_exposure_render(e->scene, &e->setup->rig->rig, e->setup->first + index, &moment, THREADS, raster, error);
}

/* The place's indirect light is computed where somebody first looks: small pictures all around, before anybody waits
 * for a large one. */
static int look_around(const struct eyes *e, struct lumi_error *error)
{
    const struct lumi_rig *rig = &e->setup->rig->rig;

    for (int i = 0; i < e->setup->count * LOOKS; i++) {
        const int camera = e->setup->first + i / LOOKS;
        struct lumi_lens lens = rig->lenses[rig->cameras[camera].lens].lens;
        struct lumi_raster small = {0};
        struct lumi_pose pose;

        lens.width = (lens.width + 3) / 4;
        lens.height = (lens.height + 3) / 4;
        lens.fx /= 4;
        lens.fy /= 4;
        lens.cx /= 4;
        lens.cy /= 4;
        lumi_rig_camera_pose_at(rig, camera, 2 * LUMI_PI * (i % LOOKS) / LOOKS, 0, &pose);
        LUMI_TRY(sim_camera_render(e->scene, &lens, &pose, THREADS, &small, NULL, error));
        lumi_raster_finish(&small);
    }
    return LUMI_OK;
}

/* How long the frames of a position take to be drawn, as busy as the computer is now; −1: not at all. */
static double measure(struct eyes *e, struct lumi_error *error)
{
    const uint64_t begin = host_ns();

    for (int i = 0; i < MEASURED; i++) {
        const struct sim_gige_exposure exposure = {.angle = 2 * LUMI_PI * (i + 0.5) / MEASURED};
        struct lumi_raster raster = {0};

        if (picture(e, i * e->setup->count / MEASURED, &exposure, &raster, error) != LUMI_OK)
            return -1;
        lumi_raster_finish(&raster);
    }
    return (double)(host_ns() - begin) * 1e-9 / MEASURED * e->setup->count;
}

static void tell(struct eyes *e, const struct rig_message *message)
{
    (void)!send(e->setup->board, message, sizeof *message, MSG_NOSIGNAL);
}

static void fire(void *context, int index)
{
    struct eyes *e = context;

    tell(e, &(struct rig_message){.kind = RIG_MESSAGE_FIRE, .camera = e->setup->first + index});
}

static void exposure_time(void *context, int index, double seconds)
{
    struct eyes *e = context;

    tell(e, &(struct rig_message){.kind = RIG_MESSAGE_EXPOSURE, .camera = e->setup->first + index, .seconds = seconds});
}

static int add_cameras(struct eyes *e, struct lumi_error *error)
{
    const struct sim_rig_processes *rig = e->setup->rig;

    for (int i = 0; i < e->setup->count; i++) {
        const int number = e->setup->first + i;
        const struct lumi_rig_camera *c = &rig->rig.cameras[number];
        const struct lumi_lens *lens = &rig->rig.lenses[c->lens].lens;
        struct sim_gige_camera camera;

        sim_gige_camera_init(&camera);
        sim_rig_processes_address(rig, number, camera.address);
        sim_rig_processes_serial(rig, number, camera.serial);
        snprintf(camera.name, sizeof camera.name, "%.15s", c->name);
        camera.width = lens->width;
        camera.height = lens->height;
        camera.clock_offset = 50 + 7 * number;
        camera.clock_ppm = 5 + (number * 7) % 30 - 15; /* every crystal its own */
        camera.reference = rig->reference;
        camera.sensor = rig->sensor;
        camera.seed = rig->seed * 100 + (uint64_t)number;
        const int added = sim_gige_add(e->gige, &camera, error);
        if (added < 0)
            return added;
    }
    return LUMI_OK;
}

/* The board's words, until it goes. */
static void listen_to_board(struct eyes *e)
{
    struct rig_message message;
    ssize_t size;

    while ((size = recv(e->setup->board, &message, sizeof message, 0)) > 0 || (size < 0 && errno == EINTR)) {
        const int index = message.camera - e->setup->first;

        if (size != (ssize_t)sizeof message)
            continue;
        if (message.kind == RIG_MESSAGE_CLOCK)
            set_clock(e, message.now_ns);
        else if (index < 0 || index >= e->setup->count)
            continue;
        else if (message.kind == RIG_MESSAGE_EXPOSED)
            sim_gige_expose(e->gige, index, &message.exposure);
        else if (message.kind == RIG_MESSAGE_PLUG)
            sim_gige_unplug(e->gige, index, !message.on);
    }
}

int rig_eyes_run(const struct rig_eyes *setup, struct lumi_error *error)
{
    struct eyes eyes = {.setup = setup};
    const struct sim_gige_source source = {&eyes, picture, fire, exposure_time, now_ns};
    int code;

    pthread_mutex_init(&eyes.lock, NULL);
    (void)!nice(3); /* drawing is what is left of the computer: the board has its times to keep */
    LUMI_GOTO(code, done, sim_place_open(setup->rig->place, &eyes.scene, error));
    eyes.gige = sim_gige_create(&source);
    if (!eyes.gige) {
        code = lumi_fail(error, LUMI_ERR_NOMEM, "no memory for simulated cameras");
        goto done;
    }
    LUMI_GOTO(code, done, add_cameras(&eyes, error));
    LUMI_GOTO(code, done, look_around(&eyes, error));
    LUMI_GOTO(code, done, sim_gige_start(eyes.gige, 1, error));
    const double drawing = measure(&eyes, error);
    if (drawing < 0) {
        code = LUMI_ERR_NOMEM;
        goto done;
    }
    rig_report_drawing(setup->report, drawing);
    listen_to_board(&eyes);
done:
    sim_gige_destroy(eyes.gige);
    sim_scene_destroy(eyes.scene);
    pthread_mutex_destroy(&eyes.lock);
    return code;
}
