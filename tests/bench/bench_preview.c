/* bench_preview FOLDER MEGABYTES ROUNDS: what previews cost a capture. Frames of 16 cameras, 5.5 Mpixel raw8 each, come
 * from pools of buffers as cameras have (6 a camera) and go into the store; each is offered to the pictures by the
 * engine's rule. In turns: nobody watches, and four clients watch four cameras over HTTP.
 *
 *   full speed   as fast as the store takes them: MB/s stored, with and without
 *   a sweep      a shot of all cameras every 0.42 s, 211 MB/s as a turn in 30 s: frames for which no buffer was free
 *                are lost, and the longest that a frame waited for the disk is told
 *
 * Exit status 1: a frame was lost, fewer than 98 % of the speed were kept, or who watched got nothing. */
#define _GNU_SOURCE
#include "daemon/camera/camera_device.h"
#include "daemon/http/api_server.h"
#include "daemon/preview/pictures_priv.h"
#include "daemon/store/store.h"
#include "proto/base/memory.h"

#include <arpa/inet.h>
#include <math.h>
#include <netinet/in.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#define WIDTH 2560
#define HEIGHT 2160
#define PIXELS ((size_t)WIDTH * HEIGHT)
#define HEAD ((size_t)4096)
#define CAMERAS 16
#define BUFFERS 6 /* of a camera: together just what the store takes */
#define WATCHED 4
#define SWEEP_SHOTS 24
#define SHOT_SECONDS 0.42

struct buffer {
    struct lumi_camera_frame frame;
    atomic_bool busy; /* somebody holds it */
    uint8_t *bytes;
    double given;
};

struct bench {
    struct lumi_store *store;
    size_t memory;
    struct buffer buffers[CAMERAS][BUFFERS];
    int held[CAMERAS];         /* by the store */
    int done, failed, lost[2]; /* lost: with nobody watching, with four */
    double slowest;
    struct lumi_pictures *pictures;
    struct lumi_http *http;
    atomic_bool watching;
    atomic_int parts;
    pthread_t clients[WATCHED];
};

struct client {
    struct bench *bench;
    int camera;
};

static double seconds(void)
{
    struct timespec now;

    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + (double)now.tv_nsec * 1e-9;
}

/* Processor's, of all threads. */
static double core_seconds(void)
{
    struct rusage usage;

    getrusage(RUSAGE_SELF, &usage);
    return (double)(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
           (double)(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec) * 1e-6;
}

static int64_t now_ns(void *context)
{
    (void)context;
    return (int64_t)(seconds() * 1e9);
}

static void rest(void)
{
    nanosleep(&(struct timespec){0, 200000}, NULL);
}

static void check(int code, const struct lumi_error *error)
{
    if (code == LUMI_OK)
        return;
    fprintf(stderr, "bench_preview: %s\n", error->text);
    exit(1);
}

/* ---- who watches ---- */

static int count_parts(const char *block, ssize_t size)
{
    static const char mark[] = "--lumid-picture";
    int found = 0;

    for (const char *at = block; (at = memmem(at, (size_t)(block + size - at), mark, sizeof mark - 1)); at++)
        found++;
    return found;
}

static void *watch(void *context)
{
    struct client *client = context;
    struct sockaddr_in address = {.sin_family = AF_INET,
                                  .sin_port = htons((uint16_t)lumi_http_port(client->bench->http))};
    int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    char request[128];
    static _Thread_local char block[65536];
    ssize_t size;

    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &(struct timeval){.tv_usec = 50000}, sizeof(struct timeval));
    snprintf(request, sizeof request, "GET /api/v1/cameras/c%02d/live HTTP/1.1\r\nHost: localhost\r\n\r\n",
             client->camera);
    if (connect(fd, (struct sockaddr *)&address, sizeof address) != 0 ||
        send(fd, request, strlen(request), MSG_NOSIGNAL) < 0)
        exit(1);
    while (atomic_load(&client->bench->watching))
        if ((size = recv(fd, block, sizeof block, 0)) > 0)
            atomic_fetch_add(&client->bench->parts, count_parts(block, size));
    close(fd);
    free(client);
    return NULL;
}

static void begin_watching(struct bench *bench)
{
    atomic_store(&bench->watching, true);
    for (int i = 0; i < WATCHED; i++) {
        struct client *client = malloc(sizeof *client);
        *client = (struct client){bench, i * CAMERAS / WATCHED};
        if (pthread_create(&bench->clients[i], NULL, watch, client) != 0)
            exit(1);
        while (lumi_pictures_watchers(bench->pictures, client->camera) == 0)
            rest();
    }
}

static void end_watching(struct bench *bench)
{
    atomic_store(&bench->watching, false);
    for (int i = 0; i < WATCHED; i++) {
        pthread_join(bench->clients[i], NULL);
        while (lumi_pictures_watchers(bench->pictures, i * CAMERAS / WATCHED) > 0)
            rest();
    }
}

/* ---- frames ---- */

static void give_back(struct lumi_camera_frame *frame)
{
    atomic_store(&((struct buffer *)frame->owner)->busy, false);
}

static struct buffer *free_buffer(struct bench *bench, int camera)
{
    for (int i = 0; i < BUFFERS; i++)
        if (!atomic_load(&bench->buffers[camera][i].busy))
            return &bench->buffers[camera][i];
    return NULL;
}

static void collect(struct bench *bench)
{
    struct lumi_store_done done;

    while (lumi_store_done(bench->store, &done)) {
        const int camera = (int)(done.id / BUFFERS % CAMERAS);
        struct buffer *buffer = &bench->buffers[camera][done.id % BUFFERS];
        bench->done++;
        bench->failed += done.code != LUMI_OK;
        bench->slowest = fmax(bench->slowest, seconds() - buffer->given);
        bench->held[camera]--;
        lumi_camera_frame_release(&buffer->frame);
    }
}

/* As daemon/engine/engine_look.c has it, where no judge is. */
static void show(struct bench *bench, int camera, int shot, struct buffer *buffer)
{
    const struct lumi_picture_offer offer = {.camera = camera,
                                             .frame = &buffer->frame,
                                             .name = "f",
                                             .shot = shot,
                                             .spare = 2 * bench->held[camera] <= BUFFERS &&
                                                      lumi_store_room(bench->store) >= bench->memory / 2};

    lumi_pictures_offer(bench->pictures, now_ns(NULL), &offer);
}

static void give(struct bench *bench, int number, struct buffer *buffer)
{
    static uint8_t head[HEAD];
    const int camera = number % CAMERAS, place = (int)(buffer - bench->buffers[camera]);
    struct lumi_store_job job = {.kind = LUMI_STORE_FRAME,
                                 .id = (uint64_t)(camera * BUFFERS + place),
                                 .frame = number + 1,
                                 .pieces = {{head, HEAD}, {buffer->bytes, PIXELS}},
                                 .piece_count = 2};
    struct lumi_error error = {0};

    job.file = (struct lumi_capture_file){
        .extension = ".dng", .width = WIDTH, .height = HEIGHT, .camera_time_us = LUMI_NO_TIME};
    atomic_store(&buffer->busy, true);
    buffer->given = seconds();
    bench->held[camera]++;
    show(bench, camera, number / CAMERAS, buffer);
    check(lumi_store_give(bench->store, &job, &error), &error);
}

static struct lumi_capture *planned(const char *path, int frames)
{
    struct lumi_capture_lens lens = {.name = "l"};
    struct lumi_error error = {0};
    struct lumi_capture *capture;
    int64_t id, cameras[CAMERAS], frame;
    char name[32];

    check(lumi_capture_create_live(path, &capture, &error), &error);
    check(lumi_capture_begin(capture, &error), &error);
    lumi_lens_init_pinhole(&lens.lens, WIDTH, HEIGHT, 1);
    check(lumi_capture_add_lens(capture, &lens, &id, &error), &error);
    for (int i = 0; i < CAMERAS; i++) {
        snprintf(name, sizeof name, "c%02d", i);
        check(lumi_capture_add_camera(capture, name, id, &cameras[i], &error), &error);
    }
    for (int i = 0; i < frames; i++) {
        snprintf(name, sizeof name, "f%05d", i);
        const struct lumi_capture_new_frame new_frame = {
            .name = name, .camera = cameras[i % CAMERAS], .row = -1, .column = -1};
        check(lumi_capture_add_frame(capture, &new_frame, &frame, &error), &error);
    }
    check(lumi_capture_commit(capture, &error), &error);
    return capture;
}

static void give_all(struct bench *bench, int frames, double pace)
{
    const double begun = seconds();
    int given = 0;

    for (int i = 0; i < frames; i++) {
        struct buffer *buffer;
        while (pace > 0 && seconds() < begun + i / CAMERAS * pace) {
            collect(bench);
            rest();
        }
        while (!(buffer = free_buffer(bench, i % CAMERAS)) && pace <= 0) {
            collect(bench);
            rest();
        }
        if (buffer)
            give(bench, i, buffer);
        given += buffer != NULL;
        bench->lost[atomic_load(&bench->watching)] += buffer == NULL; /* as a camera that has nowhere to put it */
        collect(bench);
    }
    while (bench->done < given) {
        collect(bench);
        rest();
    }
}

/* Seconds. */
static double round_of(struct bench *bench, const char *folder, int frames, double pace)
{
    struct lumi_store_options options;
    struct lumi_error error = {0};
    char path[1024], command[1100];

    snprintf(path, sizeof path, "%s/bench.capture", folder);
    struct lumi_capture *capture = planned(path, frames);
    lumi_store_options_init(&options);
    bench->memory = options.memory;
    bench->done = 0;
    bench->slowest = 0;
    const double begun = seconds();
    check(lumi_store_open(capture, &options, &bench->store, &error), &error);
    give_all(bench, frames, pace);
    const double took = seconds() - begun;
    check(lumi_store_close(bench->store, &error), &error);
    snprintf(command, sizeof command, "rm -rf '%s'", path);
    return system(command) == 0 ? took : 0;
}

static bool stop(void *context)
{
    (void)context;
    return true;
}

static void set_up(struct bench *bench)
{
    struct lumi_pictures_options options;
    struct lumi_http_options http;
    struct lumi_error error = {0};

    lumi_pictures_options_init(&options);
    options.cameras = CAMERAS;
    for (int c = 0; c < CAMERAS; c++) {
        snprintf(options.names[c], sizeof options.names[c], "c%02d", c);
        for (int i = 0; i < BUFFERS; i++) {
            struct buffer *buffer = &bench->buffers[c][i];
            if (posix_memalign((void **)&buffer->bytes, 4096, PIXELS) != 0)
                exit(1);
            for (size_t k = 0; k < PIXELS; k++)
                buffer->bytes[k] = (uint8_t)(k * 7 ^ k >> 11 ^ (size_t)i);
            buffer->frame = (struct lumi_camera_frame){
                .format = {.layout = LUMI_LAYOUT_BAYER, .width = WIDTH, .height = HEIGHT, .bits = 8, .stride = WIDTH},
                .data = buffer->bytes,
                .size = PIXELS,
                .file_mtime_ns = LUMI_CAMERA_NO_TIME,
                .device_ns = LUMI_CAMERA_NO_TIME,
                .temperature = NAN,
                .release = give_back,
                .owner = buffer};
        }
    }
    check(lumi_pictures_create(&options, &bench->pictures, &error), &error);
    lumi_http_options_init(&http);
    http.listen = "127.0.0.1:0";
    http.now_ns = now_ns;
    http.emergency_stop = stop;
    http.pictures = bench->pictures;
    check(lumi_http_start(&http, &bench->http, &error), &error);
}

/* Both kinds of round, so many times: which is first changes. */
static void measure(struct bench *bench, const char *folder, int frames, int rounds, double pace, double took[2],
                    double cores[2], double slowest[2], int parts[2])
{
    for (int i = 0; i < 2 * rounds; i++) {
        const int watched = (i + 1) / 2 % 2; /* 0 1 1 0 */
        if (watched)
            begin_watching(bench);
        const int before = atomic_load(&bench->parts);
        const double used = core_seconds();
        took[watched] += round_of(bench, folder, frames, pace);
        cores[watched] += core_seconds() - used;
        parts[watched] += atomic_load(&bench->parts) - before;
        slowest[watched] = fmax(slowest[watched], bench->slowest);
        if (watched)
            end_watching(bench);
    }
}

/* One frame's copy and picture, on a processor's own time. */
static void measure_one(const struct bench *bench)
{
    double copying = INFINITY, making = INFINITY;

    for (int i = 0; i < 20; i++) {
        struct pictures_small small;
        struct lumi_picture *picture;
        struct lumi_error error = {0};
        const double begun = core_seconds();
        check(pictures_take(&bench->buffers[0][0].frame, 640, &small, &error), &error);
        const double copied = core_seconds();
        check(pictures_make(&small, 640, 75, &picture, &error), &error);
        copying = fmin(copying, copied - begun);
        making = fmin(making, core_seconds() - copied);
        pictures_small_clear(&small);
        lumi_free(picture->jpeg);
        lumi_free(picture);
    }
    printf("a frame of %d x %d: %.1f ms to copy, %.1f ms to make a picture of\n", WIDTH, HEIGHT, copying * 1e3,
           making * 1e3);
}

int main(int argc, char **argv)
{
    struct bench *bench = calloc(1, sizeof *bench);
    struct lumi_pictures_figures figures;
    double took[2] = {0}, cores[2] = {0}, paced[2] = {0}, paced_cores[2] = {0}, slowest[2] = {0};
    int parts[2] = {0}, paced_parts[2] = {0};

    if (argc < 4 || !bench) {
        fprintf(stderr, "bench_preview FOLDER MEGABYTES ROUNDS\n");
        return 2;
    }
    const int rounds = atoi(argv[3]);
    const int frames = (int)(atof(argv[2]) * 1e6 / (double)(PIXELS + HEAD)) / CAMERAS * CAMERAS + CAMERAS;
    const double megabytes = (double)frames * (double)(PIXELS + HEAD) * 1e-6 * rounds;
    set_up(bench);
    measure_one(bench);
    round_of(bench, argv[1], frames, 0); /* what is slow only once */
    measure(bench, argv[1], frames, rounds, 0, took, cores, (double[2]){0}, parts);
    const double share = took[0] / took[1];
    lumi_pictures_figures(bench->pictures, &figures);
    printf("full speed: %.0f MB/s with nobody watching, %.0f MB/s with four previews open: %.1f %%; %d pictures came "
           "(%.2f a second each), of %llu frames with their turn %llu were shed\n",
           megabytes / took[0], megabytes / took[1], 100 * share, parts[1], parts[1] / took[1] / WATCHED,
           (unsigned long long)(figures.taken + figures.shed), (unsigned long long)figures.shed);
    measure(bench, argv[1], CAMERAS * SWEEP_SHOTS, (rounds + 7) / 8, SHOT_SECONDS, paced, paced_cores, slowest,
            paced_parts);
    printf("core-seconds a gigabyte: %.3f with nobody watching, %.3f with four previews open\n",
           cores[0] / megabytes * 1e3, cores[1] / megabytes * 1e3);
    printf("a sweep at 211 MB/s: %d pictures came (%.2f a second each); a frame was on the disk after %.2f s at most, "
           "with nobody watching after %.2f s\n",
           paced_parts[1], paced_parts[1] / paced[1] / WATCHED, slowest[1], slowest[0]);
    printf("core-seconds a second: %.3f with nobody watching, %.3f with four previews open\n",
           paced_cores[0] / paced[0], paced_cores[1] / paced[1]);
    printf("frames lost: %d with nobody watching, %d with four previews open; failed: %d\n", bench->lost[0],
           bench->lost[1], bench->failed);
    lumi_http_stop(bench->http);
    lumi_pictures_destroy(bench->pictures);
    return bench->lost[0] + bench->lost[1] > 0 || bench->failed > 0 || share < 0.98 || paced_parts[1] == 0;
}
