/* Exposures into frames, and frames into packets. */
#include "sim/gige/gige_priv.h"

#include "proto/base/memory.h"
#include "sim/gige/gige_encode.h"
#include "sim/random.h"

#include <math.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>

#define BURST 65536     /* bytes that go out without a pause: a receiver's buffer is not endless */
#define PAUSE_NS 800000 /* between bursts */
enum { CHANNEL_LOSS = 41 };

/* A frame under way. */
struct job {
    struct gige_camera *camera;
    int index;
    struct sim_gige_exposure exposure;
    struct gige_shot shot;
    struct gige_block block;
    struct sockaddr_in to;
    uint32_t delay_ticks;
};

void gige_forget(struct gige_camera *camera)
{
    for (int i = 0; i < GIGE_HISTORY; i++) {
        lumi_free(camera->history[i].data);
        camera->history[i] = (struct gige_block){0};
    }
    camera->count = 0;
}

bool gige_destination(struct gige_camera *camera, struct sockaddr_in *to)
{
    const struct gige_registers *r = &camera->control.registers;
    const uint32_t port = gige_get(r, GIGE_STREAM_PORT) & 0xffff;

    *to = (struct sockaddr_in){.sin_family = AF_INET,
                               .sin_port = htons((uint16_t)port),
                               .sin_addr.s_addr = htonl(gige_get(r, GIGE_STREAM_ADDRESS))};
    return port != 0 && !camera->unplugged;
}

/* When the frame may leave, by the shared clock. */
static uint64_t due(const struct sim_gige_exposure *exposure)
{
    return exposure->end_ns + (uint64_t)(fmax(exposure->fault.late, 0) * 1e9);
}

/* The camera whose oldest exposure is the oldest of all that are free. With the lock. */
static struct gige_camera *pick(struct sim_gige *gige, int *index, uint64_t now, uint64_t *next)
{
    struct gige_camera *best = NULL;

    *next = UINT64_MAX;
    for (int i = 0; i < gige->count; i++) {
        struct gige_camera *camera = gige->cameras[i];
        const struct sim_gige_exposure *oldest = &camera->waiting[camera->first];

        if (camera->busy || camera->count == 0)
            continue;
        if (due(oldest) > now) {
            *next = due(oldest) < *next ? due(oldest) : *next;
            continue;
        }
        if (!best || oldest->begin_ns < best->waiting[best->first].begin_ns) {
            best = camera;
            *index = i;
        }
    }
    return best;
}

static void take(struct gige_camera *camera, struct job *job)
{
    const struct gige_registers *r = &camera->control.registers;
    const double gain = gige_get_real(r, GIGE_GAIN);
    struct gige_shot *shot = &job->shot;

    job->exposure = camera->waiting[camera->first];
    camera->first = (camera->first + 1) % GIGE_WAITING;
    camera->count--;
    camera->busy = true;
    job->camera = camera;
    const double seconds = (double)(job->exposure.end_ns - job->exposure.begin_ns) * 1e-9;
    *shot = (struct gige_shot){.format = gige_get(r, GIGE_PIXEL_FORMAT),
                               .width = (int)gige_get(r, GIGE_WIDTH),
                               .height = (int)gige_get(r, GIGE_HEIGHT),
                               .brightness = seconds / camera->options.reference * pow(10, gain / 20),
                               .sensor = camera->options.sensor,
                               .number = ++camera->number,
                               .jpeg_quality = camera->options.jpeg_quality,
                               .chunks = gige_get(r, GIGE_CHUNK_MODE) ? gige_get(r, GIGE_CHUNK_MASK) : 0,
                               .exposure_us = seconds * 1e6,
                               .gain_db = gain,
                               .timestamp = gige_ticks(camera, job->exposure.begin_ns),
                               .counter = gige_get(r, GIGE_COUNTER_VALUE)};
    shot->sensor.seed = camera->options.seed;
    shot->counter -= (uint64_t)(job->exposure.line ? camera->count : 0); /* those that wait were counted already */
    camera->block = camera->block == UINT16_MAX ? 1 : (uint16_t)(camera->block + 1);
    shot->frame_id = camera->block;
    const uint32_t size = gige_get(r, GIGE_PACKET_SIZE) & 0xffff;
    job->block = (struct gige_block){.id = camera->block,
                                     .timestamp = shot->timestamp,
                                     .format = shot->format,
                                     .width = shot->width,
                                     .height = shot->height,
                                     .chunks = shot->chunks != 0,
                                     .packet_size = size < 220                  ? 220
                                                    : size > GIGE_STREAM_PACKET ? GIGE_STREAM_PACKET
                                                                                : size};
    job->delay_ticks = gige_get(r, GIGE_PACKET_DELAY);
}

/* Whether its frame is still wanted, and where; keeps a copy of it for who asks again. With the lock. */
static bool keep(struct job *job)
{
    struct gige_camera *camera = job->camera;
    struct gige_block *slot;

    if (!gige_get(&camera->control.registers, GIGE_ACQUISITION) || !gige_destination(camera, &job->to))
        return false;
    camera->newest = (camera->newest + 1) % GIGE_HISTORY;
    slot = &camera->history[camera->newest];
    lumi_free(slot->data);
    *slot = job->block;
    slot->data = lumi_alloc(job->block.size, 1);
    if (slot->data)
        memcpy(slot->data, job->block.data, job->block.size);
    else
        *slot = (struct gige_block){0};
    return true;
}

static void sleep_ns(uint64_t ns)
{
    struct timespec time = {(time_t)(ns / 1000000000), (long)(ns % 1000000000)};

    nanosleep(&time, NULL);
}

/* Without the lock: packets take their time. */
static void send_block(const struct job *job, struct sim_gige_status *sum)
{
    const struct sim_gige_camera *options = &job->camera->options;
    const uint64_t seed = sim_random(options->seed, job->shot.number, CHANNEL_LOSS);
    uint8_t packet[GIGE_STREAM_PACKET];
    size_t burst = 0;

    for (uint32_t i = 0; i < gige_stream_packets(&job->block); i++) {
        const size_t size = gige_stream_packet(&job->block, i, packet);

        sum->packets++;
        if (job->exposure.fault.loss > 0 && sim_random_unit(sim_random(seed, i, 0)) < job->exposure.fault.loss) {
            sum->lost++;
            continue;
        }
        (void)!sendto(job->camera->gvsp, packet, size, 0, (const struct sockaddr *)&job->to, sizeof job->to);
        burst += size;
        if (job->delay_ticks > 0)
            sleep_ns((uint64_t)job->delay_ticks * 8);
        else if (burst > BURST)
            sleep_ns(PAUSE_NS);
        burst = burst > BURST ? 0 : burst;
    }
}

/* One frame, from light to packets. */
static void make(struct sim_gige *gige, struct job *job)
{
    struct sim_gige_status sum = {0};
    struct lumi_raster picture = {0};
    struct lumi_error error;
    bool wanted = false;

    int code = gige->source.picture(gige->source.context, job->index, &job->exposure, &picture, &error);
    if (code == LUMI_OK)
        code = gige_encode(&job->shot, &picture, &job->block.data, &job->block.size, &error);
    lumi_raster_finish(&picture);
    if (code == LUMI_OK && !job->exposure.fault.dropped) {
        pthread_mutex_lock(&gige->lock);
        wanted = keep(job);
        pthread_mutex_unlock(&gige->lock);
    }
    for (int i = 0; wanted && i < 1 + job->exposure.fault.doubled; i++) {
        if (i > 0) {
            pthread_mutex_lock(&gige->lock);
            job->block.id = job->camera->block =
                job->camera->block == UINT16_MAX ? 1 : (uint16_t)(job->camera->block + 1);
            wanted = keep(job);
            pthread_mutex_unlock(&gige->lock);
        }
        if (wanted)
            send_block(job, &sum);
        sum.frames += wanted;
    }
    lumi_free(job->block.data);
    pthread_mutex_lock(&gige->lock);
    job->camera->busy = false;
    job->camera->status.frames += sum.frames;
    job->camera->status.packets += sum.packets;
    job->camera->status.lost += sum.lost;
    pthread_cond_broadcast(&gige->work);
    pthread_mutex_unlock(&gige->lock);
}

/* With the lock: until there is work, at most so long. The shared clock may run at another speed than ours: look again
 * soon. */
static void rest(struct sim_gige *gige, uint64_t now, uint64_t next)
{
    uint64_t wait = next == UINT64_MAX ? 1000000000 : next - now;
    struct timespec end;

    wait = wait > 20000000 && next != UINT64_MAX ? 20000000 : wait;
    const uint64_t until = gige_clock_ns() + wait;
    end = (struct timespec){(time_t)(until / 1000000000), (long)(until % 1000000000)};
    pthread_cond_timedwait(&gige->work, &gige->lock, &end);
}

void *gige_worker(void *context)
{
    struct sim_gige *gige = context;

    pthread_mutex_lock(&gige->lock);
    while (!gige->stop) {
        struct job job = {0};
        uint64_t next, now = gige->source.now_ns(gige->source.context);
        struct gige_camera *camera = pick(gige, &job.index, now, &next);

        if (!camera) {
            rest(gige, now, next);
            continue;
        }
        take(camera, &job);
        pthread_mutex_unlock(&gige->lock);
        make(gige, &job);
        pthread_mutex_lock(&gige->lock);
    }
    pthread_mutex_unlock(&gige->lock);
    return NULL;
}
