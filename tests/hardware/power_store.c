/* In the virtual machine: stores the frames of a sweep until the power goes, and when it is back, compares what the
 * store had acknowledged with what is there, and goes on; in the end seals the capture and verifies it.
 *
 * usage: power_store DIRECTORY ACKNOWLEDGED
 * ACKNOWLEDGED is a file on a disk that the power cut does not reach: a line for each thing that was said to be safe.
 */
#include "daemon/store/store.h"
#include "proto/base/file.h"
#include "proto/base/memory.h"

#include <fcntl.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define POSITIONS 72
#define CAMERAS 4
#define FRAMES (POSITIONS * CAMERAS)
#define WINDOW 6 /* frames under way */
#define SIZE_MAX_BYTES 262144
#define SIDE 16

static struct lumi_error error;
static int acknowledged;
static struct lumi_capture_frame *frames;
static int count;
static struct lumi_capture *capture;
static struct lumi_store *store;

#define MUST(expression)                                                                                               \
    do {                                                                                                               \
        if ((expression) != LUMI_OK) {                                                                                 \
            printf("power_store: %s\n", error.text);                                                                   \
            exit(1);                                                                                                   \
        }                                                                                                              \
    } while (0)

/* What frame `number` looks like. */
static size_t content(int number, uint8_t *bytes)
{
    size_t size = 20000 + (size_t)number * 7919 % (SIZE_MAX_BYTES - 20000);
    uint32_t state = (uint32_t)number * 2654435761u + 1;

    for (size_t i = 0; i < size; i++) {
        state = state * 1664525u + 1013904223u;
        bytes[i] = (uint8_t)(state >> 24);
    }
    return size;
}

static bool said(const char *list, const char *what, const char *name)
{
    char line[128];

    snprintf(line, sizeof line, "%s %s\n", what, name);
    return list && strstr(list, line);
}

static void acknowledge(const char *what, const char *name)
{
    char line[128];
    int length = snprintf(line, sizeof line, "%s %s\n", what, name);

    if (write(acknowledged, line, (size_t)length) != length) {
        perror("power_store: the list of what is safe");
        exit(1);
    }
}

static void open_capture(const char *path)
{
    struct lumi_rig rig;
    struct lumi_plan plan;

    if (lumi_capture_open(path, LUMI_CAPTURE_WRITE, &capture, &error) == LUMI_ERR_NOTFOUND)
        MUST(lumi_capture_create_live(path, &capture, &error));
    else if (!capture)
        MUST(error.code);
    MUST(lumi_capture_frames(capture, LUMI_FRAMES_ALL, &frames, &count, &error));
    if (count == 0) {
        lumi_free(frames);
        MUST(lumi_rig_arc(&rig, CAMERAS, POSITIONS, 1, 0.35, SIDE, SIDE, 1.9, 1.5, &error));
        lumi_plan_init(&plan, &rig);
        MUST(lumi_store_plan(capture, &rig, &plan, &error));
        MUST(lumi_capture_frames(capture, LUMI_FRAMES_ALL, &frames, &count, &error));
    }
    if (count != FRAMES) {
        printf("power_store: %d frames are planned, not %d\n", count, FRAMES);
        exit(1);
    }
}

/* Every frame against the list and against what it must look like; returns how many are not stored yet. */
static int compare(const char *list)
{
    uint8_t *bytes = malloc(SIZE_MAX_BYTES), *found;
    int missing = 0, wrong = 0;
    size_t size;

    for (int i = 0; i < count; i++) {
        const struct lumi_capture_frame *frame = &frames[i];
        bool stored = frame->state == LUMI_FRAME_RECEIVED || frame->state == LUMI_FRAME_ACCEPTED;
        missing += !stored;
        if (said(list, "stored", frame->name) && !stored) {
            printf("power_store: %s was stored, and is %s\n", frame->name, lumi_frame_state_name(frame->state));
            wrong++;
        }
        if (said(list, "judged", frame->name) && frame->state != LUMI_FRAME_ACCEPTED) {
            printf("power_store: %s was accepted, and is %s\n", frame->name, lumi_frame_state_name(frame->state));
            wrong++;
        }
        if (!stored)
            continue;
        char *path = lumi_capture_join(capture, frame->file);
        size_t wanted = content(i, bytes);
        MUST(lumi_file_read(path, SIZE_MAX_BYTES, &found, &size, &error));
        if (size != wanted || memcmp(found, bytes, size) != 0) {
            printf("power_store: %s is not what was given\n", frame->name);
            wrong++;
        }
        lumi_free(found);
        lumi_free(path);
    }
    free(bytes);
    if (wrong)
        exit(1);
    return missing;
}

static void problem(void *context, const char *file, const char *text)
{
    (void)context;
    printf("power_store: %s: %s\n", file, text);
}

static void verify(const char *path, bool sealed)
{
    struct lumi_verify_result result;

    MUST(lumi_capture_verify(path, problem, NULL, NULL, &result, &error));
    if (result.problems || result.sealed != sealed) {
        printf("power_store: %d problems, sealed %d\n", result.problems, result.sealed);
        exit(1);
    }
}

static int number_of(int64_t id)
{
    for (int i = 0; i < count; i++)
        if (frames[i].id == id)
            return i;
    abort();
}

/* Takes what is done: a stored frame is judged next. Returns how many frames are finished. */
static int take(void)
{
    struct lumi_store_done done;
    int finished = 0;

    while (lumi_store_done(store, &done)) {
        if (done.code != LUMI_OK) {
            printf("power_store: %s\n", done.text);
            exit(1);
        }
        const char *name = frames[number_of(done.frame)].name;
        acknowledge(done.kind == LUMI_STORE_FRAME ? "stored" : "judged", name);
        if (done.kind == LUMI_STORE_FRAME) {
            struct lumi_store_job job = {.kind = LUMI_STORE_JUDGED, .frame = done.frame, .accepted = true};
            MUST(lumi_store_give(store, &job, &error));
            free((void *)(uintptr_t)done.id);
        } else {
            finished++;
        }
    }
    sched_yield();
    return finished;
}

static void store_all(void)
{
    struct lumi_store_options options;
    int given = 0, finished = 0;

    lumi_store_options_init(&options);
    options.memory = 4u << 20;
    MUST(lumi_store_open(capture, &options, &store, &error));
    for (int i = 0; i < count; i++) {
        struct lumi_store_job job = {.kind = LUMI_STORE_FRAME, .frame = frames[i].id};
        if (frames[i].state != LUMI_FRAME_PLANNED && frames[i].state != LUMI_FRAME_TRIGGERED)
            continue;
        uint8_t *bytes = malloc(SIZE_MAX_BYTES);
        job.id = (uintptr_t)bytes;
        job.pieces[0] = (struct iovec){bytes, content(i, bytes)};
        job.piece_count = 1;
        job.file = (struct lumi_capture_file){
            .extension = ".raw", .width = SIDE, .height = SIDE, .camera_time_us = LUMI_NO_TIME};
        MUST(lumi_store_give(store, &job, &error));
        given++;
        while (given - finished >= WINDOW)
            finished += take();
    }
    while (finished < given)
        finished += take();
    struct lumi_store_job seal = {.kind = LUMI_STORE_SEAL, .verify = true, .date = "2026-01-01"};
    struct lumi_store_done done;
    MUST(lumi_store_give(store, &seal, &error));
    while (!lumi_store_done(store, &done))
        sched_yield();
    if (done.code != LUMI_OK) {
        printf("power_store: %s\n", done.text);
        exit(1);
    }
    MUST(lumi_store_close(store, &error));
}

int main(int argc, char **argv)
{
    char path[1024];
    uint8_t *list = NULL;
    size_t size = 0;
    int missing;

    if (argc != 3)
        return 2;
    setvbuf(stdout, NULL, _IOLBF, 0);
    acknowledged = open(argv[2], O_RDWR | O_CREAT | O_APPEND, 0644);
    if (lumi_file_read(argv[2], 1 << 20, &list, &size, &error) == LUMI_OK)
        list = lumi_realloc(list, size + 1, 1);
    if (!list || acknowledged < 0)
        return 1;
    list[size] = 0;
    snprintf(path, sizeof path, "%s/place.capture", argv[1]);
    open_capture(path);
    missing = compare((const char *)list);
    printf("power_store: %d of %d frames are stored, every one that was said to be among them\n", count - missing,
           count);
    printf("host: storing %d\n", missing);
    store_all();
    verify(path, true);
    printf("power_store: complete\n");
    return 0;
}
