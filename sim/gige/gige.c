/* Simulated GigE Vision cameras: the group of them. */
#include "sim/gige/gige_priv.h"

#include "proto/base/memory.h"

#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#define TICK_FREQUENCY UINT64_C(125000000) /* of the cameras' clocks: 8 ns */

void sim_gige_camera_init(struct sim_gige_camera *camera)
{
    memset(camera, 0, sizeof *camera);
    snprintf(camera->model, sizeof camera->model, "LS-1");
    camera->reference = 0.004;
    camera->jpeg_quality = 92;
    sim_sensor_init(&camera->sensor);
    camera->seed = 1;
}

uint64_t gige_clock_ns(void)
{
    struct timespec now;

    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000000 + (uint64_t)now.tv_nsec;
}

uint64_t gige_ticks(const struct gige_camera *camera, uint64_t ns)
{
    const double seconds = (double)ns * 1e-9;
    /* The drift apart, so that the whole keeps its last bits. */
    const double apart = camera->options.clock_offset + seconds * camera->options.clock_ppm * 1e-6;

    return ns / 8 + (uint64_t)(int64_t)(apart * (double)TICK_FREQUENCY);
}

struct sim_gige *sim_gige_create(const struct sim_gige_source *source)
{
    struct sim_gige *gige = lumi_calloc(1, sizeof *gige);
    pthread_condattr_t monotonic;

    if (!gige)
        return NULL;
    gige->source = *source;
    gige->wake[0] = gige->wake[1] = -1;
    pthread_mutex_init(&gige->lock, NULL);
    pthread_condattr_init(&monotonic);
    pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
    pthread_cond_init(&gige->work, &monotonic);
    pthread_condattr_destroy(&monotonic);
    return gige;
}

static void set_identity(struct gige_camera *made)
{
    struct gige_identity *identity = &made->identity;

    snprintf(identity->address, sizeof identity->address, "%s", made->options.address);
    snprintf(identity->vendor, sizeof identity->vendor, "Lumisphere");
    snprintf(identity->model, sizeof identity->model, "%s", made->options.model);
    snprintf(identity->version, sizeof identity->version, "%s", LUMI_VERSION);
    snprintf(identity->serial, sizeof identity->serial, "%s", made->options.serial);
    snprintf(identity->name, sizeof identity->name, "%s", made->options.name);
    identity->width = made->options.width;
    identity->height = made->options.height;
    identity->tick_frequency = TICK_FREQUENCY;
}

static void free_camera(struct gige_camera *camera)
{
    gige_sockets_close(camera);
    gige_forget(camera);
    gige_registers_finish(&camera->control.registers);
    lumi_free(camera);
}

int sim_gige_add(struct sim_gige *gige, const struct sim_gige_camera *camera, struct lumi_error *error)
{
    struct gige_camera *made;
    int code;

    if (gige->count == GIGE_CAMERAS)
        return lumi_fail(error, LUMI_ERR_LIMIT, "%d simulated cameras at most", GIGE_CAMERAS);
    made = lumi_calloc(1, sizeof *made);
    if (!made)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a simulated camera");
    made->options = *camera;
    made->gvcp = made->broadcast = made->gvsp = -1;
    set_identity(made);
    code = gige_registers_init(&made->control.registers, &made->identity);
    if (code != LUMI_OK)
        lumi_fail(error, code, "camera %s: \"%s\" is no address", camera->serial, camera->address);
    if (code == LUMI_OK)
        code = gige_sockets_open(made, error);
    if (code != LUMI_OK) {
        free_camera(made);
        return code;
    }
    gige->cameras[gige->count] = made;
    return gige->count++;
}

int sim_gige_start(struct sim_gige *gige, int workers, struct lumi_error *error)
{
    if (pipe(gige->wake) != 0 || fcntl(gige->wake[0], F_SETFL, O_NONBLOCK) != 0 ||
        fcntl(gige->wake[1], F_SETFL, O_NONBLOCK) != 0)
        return lumi_fail_errno(error, "simulated cameras", "a pipe");
    if (pthread_create(&gige->network, NULL, gige_network, gige) != 0)
        return lumi_fail(error, LUMI_ERR_NOMEM, "simulated cameras: no thread");
    gige->network_runs = true;
    for (int i = 0; i < workers && i < GIGE_WORKERS; i++) {
        if (pthread_create(&gige->workers[i], NULL, gige_worker, gige) != 0)
            return lumi_fail(error, LUMI_ERR_NOMEM, "simulated cameras: no thread");
        gige->worker_count++;
    }
    return LUMI_OK;
}

void sim_gige_destroy(struct sim_gige *gige)
{
    if (!gige)
        return;
    pthread_mutex_lock(&gige->lock);
    gige->stop = true;
    pthread_cond_broadcast(&gige->work);
    pthread_mutex_unlock(&gige->lock);
    if (gige->wake[1] >= 0)
        (void)!write(gige->wake[1], "", 1);
    if (gige->network_runs)
        pthread_join(gige->network, NULL);
    for (int i = 0; i < gige->worker_count; i++)
        pthread_join(gige->workers[i], NULL);
    for (int i = 0; i < gige->count; i++)
        free_camera(gige->cameras[i]);
    for (int i = 0; i < 2; i++)
        if (gige->wake[i] >= 0)
            close(gige->wake[i]);
    pthread_cond_destroy(&gige->work);
    pthread_mutex_destroy(&gige->lock);
    lumi_free(gige);
}

static bool takes(const struct gige_camera *camera, const struct sim_gige_exposure *exposure)
{
    const struct gige_registers *r = &camera->control.registers;
    const bool line = gige_get(r, GIGE_TRIGGER_MODE) && gige_get(r, GIGE_TRIGGER_SOURCE) == GIGE_SOURCE_LINE1;

    return !camera->unplugged && gige_get(r, GIGE_ACQUISITION) && (line || !exposure->line) &&
           camera->count < GIGE_WAITING;
}

void sim_gige_expose(struct sim_gige *gige, int index, const struct sim_gige_exposure *exposure)
{
    struct gige_camera *camera = gige->cameras[index];
    struct gige_registers *r = &camera->control.registers;

    pthread_mutex_lock(&gige->lock);
    if (exposure->line && !camera->unplugged) {
        camera->status.triggers++;
        if (gige_get(r, GIGE_COUNTER_SOURCE))
            gige_set(r, GIGE_COUNTER_VALUE, gige_get(r, GIGE_COUNTER_VALUE) + 1);
    }
    if (takes(camera, exposure)) {
        camera->waiting[(camera->first + camera->count) % GIGE_WAITING] = *exposure;
        camera->count++;
        pthread_cond_signal(&gige->work);
    }
    pthread_mutex_unlock(&gige->lock);
}

void sim_gige_unplug(struct sim_gige *gige, int index, bool unplugged)
{
    struct gige_camera *camera = gige->cameras[index];

    pthread_mutex_lock(&gige->lock);
    if (unplugged && !camera->unplugged) {
        struct gige_registers fresh;

        if (gige_registers_init(&fresh, &camera->identity) == LUMI_OK) {
            gige_registers_finish(&camera->control.registers);
            camera->control.registers = fresh;
        }
        camera->control.controller = (struct gige_peer){0};
        gige_forget(camera);
        camera->block = 0;
    }
    camera->unplugged = unplugged;
    pthread_mutex_unlock(&gige->lock);
}

void sim_gige_status(struct sim_gige *gige, int index, struct sim_gige_status *status)
{
    struct gige_camera *camera = gige->cameras[index];

    pthread_mutex_lock(&gige->lock);
    *status = camera->status;
    status->acquiring = gige_get(&camera->control.registers, GIGE_ACQUISITION) != 0;
    status->controlled = camera->control.controller.port != 0;
    status->waiting = camera->count + camera->busy;
    status->exposure = gige_get_real(&camera->control.registers, GIGE_EXPOSURE_TIME) * 1e-6;
    pthread_mutex_unlock(&gige->lock);
}
