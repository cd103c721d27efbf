/* bench_store FOLDER MEGABYTES [SECOND]: the store at full speed against the disk. 16 cameras' frames of 5.5 Mpixel
 * raw8 (a head of 4 KB and the pixels, in pages of their own), given as fast as it takes them from a pool of buffers as
 * cameras have; the same bytes by `dd oflag=direct` in the same run, now before and now after it. Prints
 * MB/s stored (checksum and commit included) and the share of dd's, of all rounds together and of the best of each, the
 * most memory held, what the sweep of 30 s needs, and frames lost. Exit status 1: a frame was lost, or memory over its
 * bound. */
#define _GNU_SOURCE
#include "daemon/store/store.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

#define PIXELS ((size_t)2560 * 2160)
#define HEAD ((size_t)4096)
#define POOL 48 /* three frames of each of 16 cameras */
#define ROUNDS 8

static double seconds(void)
{
    struct timespec now;

    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + (double)now.tv_nsec * 1e-9;
}

static long held_kb(void)
{
    struct rusage usage;

    getrusage(RUSAGE_SELF, &usage);
    return usage.ru_maxrss;
}

static void check(int code, const struct lumi_error *error)
{
    if (code == LUMI_OK)
        return;
    fprintf(stderr, "bench_store: %s\n", error->text);
    exit(1);
}

static struct lumi_capture *planned(const char *path, int frames)
{
    struct lumi_capture_lens lens = {.name = "l"};
    struct lumi_error error = {0};
    struct lumi_capture *capture;
    int64_t id, cameras[16], frame;
    char name[32];

    check(lumi_capture_create_live(path, &capture, &error), &error);
    check(lumi_capture_begin(capture, &error), &error);
    lumi_lens_init_pinhole(&lens.lens, 2560, 2160, 1);
    check(lumi_capture_add_lens(capture, &lens, &id, &error), &error);
    for (int i = 0; i < 16; i++) {
        snprintf(name, sizeof name, "c%02d", i);
        check(lumi_capture_add_camera(capture, name, id, &cameras[i], &error), &error);
    }
    for (int i = 0; i < frames; i++) {
        snprintf(name, sizeof name, "f%05d", i);
        const struct lumi_capture_new_frame new_frame = {
            .name = name, .camera = cameras[i % 16], .row = -1, .column = -1};
        check(lumi_capture_add_frame(capture, &new_frame, &frame, &error), &error);
    }
    check(lumi_capture_commit(capture, &error), &error);
    return capture;
}

struct run {
    struct lumi_store *store;
    uint8_t *pool[POOL];
    bool busy[POOL];
    int lost, done;
};

static void collect(struct run *run)
{
    struct lumi_store_done done;

    while (lumi_store_done(run->store, &done)) {
        run->done++;
        run->lost += done.code != LUMI_OK;
        run->busy[done.id % POOL] = false;
        if (done.code != LUMI_OK)
            fprintf(stderr, "bench_store: %s\n", done.text);
    }
}

static void give_all(struct run *run, int frames)
{
    static uint8_t head[HEAD];
    struct lumi_error error = {0};

    for (int i = 0; i < frames; i++) {
        const int place = i % POOL;
        struct lumi_store_job job = {.kind = LUMI_STORE_FRAME, .id = (uint64_t)i, .frame = i + 1};
        while (run->busy[place]) {
            collect(run);
            if (run->busy[place])
                nanosleep(&(struct timespec){0, 200000}, NULL);
        }
        job.file = (struct lumi_capture_file){
            .extension = ".dng", .width = 2560, .height = 2160, .camera_time_us = LUMI_NO_TIME};
        job.pieces[0] = (struct iovec){head, HEAD};
        job.pieces[1] = (struct iovec){run->pool[place], PIXELS};
        job.piece_count = 2;
        run->busy[place] = true;
        check(lumi_store_give(run->store, &job, &error), &error);
    }
    while (run->done < frames) {
        collect(run);
        nanosleep(&(struct timespec){0, 200000}, NULL);
    }
}

/* MB/s */
static double store(const char *folder, const char *second, struct run *run, int frames)
{
    struct lumi_store_options options;
    struct lumi_error error = {0};
    char path[1024], command[2200];

    snprintf(path, sizeof path, "%s/bench.capture", folder);
    struct lumi_capture *capture = planned(path, frames);
    lumi_store_options_init(&options);
    options.second_copy = second;
    run->done = 0;
    const double begun = seconds();
    check(lumi_store_open(capture, &options, &run->store, &error), &error);
    give_all(run, frames);
    const double speed = (double)frames * (double)(PIXELS + HEAD) / (seconds() - begun) * 1e-6;
    check(lumi_store_close(run->store, &error), &error);
    snprintf(command, sizeof command, "rm -rf '%s' '%s/bench.capture.partial'", path, second ? second : folder);
    return system(command) == 0 ? speed : 0;
}

static double dd(const char *folder, int frames)
{
    char command[2200];
    const int blocks = (int)((double)frames * (double)(PIXELS + HEAD) / (4 << 20));

    snprintf(command, sizeof command,
             "dd if=/dev/zero of='%s/bench.dd' bs=4M count=%d oflag=direct conv=fsync 2>/dev/null", folder, blocks);
    const double begun = seconds();
    if (system(command) != 0)
        return 0;
    const double speed = (double)blocks * (4 << 20) / (seconds() - begun) * 1e-6;
    snprintf(command, sizeof command, "rm '%s/bench.dd'", folder);
    return system(command) == 0 ? speed : 0;
}

int main(int argc, char **argv)
{
    struct run *run = calloc(1, sizeof *run);
    double best = 0, best_dd = 0, time = 0, time_dd = 0;

    if (argc < 3 || !run) {
        fprintf(stderr, "bench_store FOLDER MEGABYTES [SECOND]\n");
        return 2;
    }
    const int frames = (int)(atof(argv[2]) * 1e6 / (double)(PIXELS + HEAD)) + 1;
    for (int i = 0; i < POOL; i++) {
        if (posix_memalign((void **)&run->pool[i], 4096, PIXELS) != 0)
            return 1;
        for (size_t k = 0; k < PIXELS; k++)
            run->pool[i][k] = (uint8_t)(k * 7 ^ k >> 11 ^ (size_t)i);
    }
    const long before = held_kb();
    for (int i = 0; i < ROUNDS; i++) {
        double a = 0, b = 0;
        for (int k = 0; k < 2; k++)
            if ((i + k) % 2 == 0)
                a = dd(argv[1], frames);
            else
                b = store(argv[1], argc > 3 ? argv[3] : NULL, run, frames);
        printf("round %d: %d frames of %.2f MB: stored %.0f MB/s, dd oflag=direct %.0f MB/s: %.0f %%\n", i + 1, frames,
               (double)(PIXELS + HEAD) * 1e-6, b, a, 100 * b / a);
        best = b > best ? b : best;
        best_dd = a > best_dd ? a : best_dd;
        time += 1 / b;
        time_dd += 1 / a;
    }
    printf("all rounds: stored %.0f MB/s, dd %.0f MB/s: %.0f %%; best of each: %.0f and %.0f MB/s: %.0f %%\n",
           ROUNDS / time, ROUNDS / time_dd, 100 * time_dd / time, best, best_dd, 100 * best / best_dd);
    printf("a turn in 30 s needs 211 MB/s\n");
    printf("memory: %ld MB before, %ld MB at most; frames lost: %d\n", before / 1024, held_kb() / 1024, run->lost);
    return run->lost > 0 || held_kb() - before > 64 * 1024;
}
