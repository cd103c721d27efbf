/* The capture reader over a database that may be anything: all that a reader reads. The file's own pages are the input,
 * so that nothing touches a disk. */
#include "checks.h"

#include "proto/capture/capture_priv.h"

/* What version 2 added. */
static void read_log(struct lumi_capture *capture)
{
    struct lumi_capture_incident *incidents;
    struct lumi_capture_sweep *sweeps;
    struct lumi_capture_device device;
    struct lumi_capture_clock clock;
    struct lumi_error error = {0};
    char name[LUMI_CAPTURE_NAME];
    int64_t id, frames[4];
    int count;

    if (checked(lumi_capture_incidents(capture, &incidents, &count, &error), &error) == LUMI_OK)
        lumi_free(incidents);
    if (checked(lumi_capture_sweeps(capture, &sweeps, &count, &error), &error) == LUMI_OK)
        lumi_free(sweeps);
    for (int i = 0; i < 3 && lumi_capture_camera(capture, i, &id, name, NULL) == LUMI_OK; i++) {
        checked(lumi_capture_get_device(capture, id, &device, &error), &error);
        checked(lumi_capture_get_clock(capture, 0, id, &clock, &error), &error);
    }
    checked(lumi_capture_shot_frames(capture, 1, frames, 4, &error), &error);
}

static void read_all(struct lumi_capture *capture)
{
    struct lumi_capture_frame *frames;
    struct lumi_capture_lens lens;
    struct lumi_error error = {0};
    struct lumi_capture_info info;
    char text[64], *long_text;
    size_t exif_size;
    void *exif;
    int count;

    lumi_capture_get_meta(capture, "surface", text, sizeof text, NULL);
    if (lumi_capture_get_profile(capture, &long_text, NULL) == LUMI_OK)
        lumi_free(long_text);
    if (lumi_capture_get_plan(capture, &long_text, NULL) == LUMI_OK)
        lumi_free(long_text);
    checked(lumi_capture_info(capture, &info, &error), &error);
    read_log(capture);
    checked(lumi_capture_lens(capture, 1, &lens, &error), &error);
    checked(lumi_capture_lens(capture, 77, &lens, &error), &error);
    if (checked(lumi_capture_frames(capture, LUMI_FRAMES_ALL, &frames, &count, &error), &error) != LUMI_OK)
        return;
    for (int i = 0; i < count; i++) {
        if (!capture_name_ok(frames[i].name, sizeof frames[i].name) || !lumi_lens_valid(&frames[i].lens) ||
            (frames[i].has_pose && !lumi_pose_valid(&frames[i].pose, 1e-3)) ||
            (frames[i].file[0] && !capture_file_ok(frames[i].file)))
            abort();
        if (i == 0 || frames[i].lens_id != frames[i - 1].lens_id)
            checked(lumi_capture_lens(capture, frames[i].lens_id, &lens, &error), &error);
        if (checked(lumi_capture_exif(capture, frames[i].id, &exif, &exif_size, &error), &error) == LUMI_OK)
            lumi_free(exif);
    }
    lumi_free(frames);
}

static void read_capture(const uint8_t *data, size_t size)
{
    struct lumi_error error = {0};
    struct lumi_capture *capture;

    if (checked(lumi_capture_open_memory(data, size, "fuzz", &capture, &error), &error) != LUMI_OK)
        return;
    read_all(capture);
    lumi_capture_close(capture);
}

/* SQLite's memory. A third of an execution went into malloc and free of what one connection needs, so it comes from one
 * piece here, which starts again when nothing of it is in use. What does not fit comes from malloc. */
#if defined(__SANITIZE_ADDRESS__)
#define SEES_ADDRESSES
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define SEES_ADDRESSES /* it is shown every allocation */
#endif
#endif
#ifndef SEES_ADDRESSES
#define ARENA_BYTES ((size_t)8 << 20)

static struct {
    unsigned char *bytes;
    size_t used, kept; /* kept: what SQLite holds for good */
    int live, kept_live;
} arena;

struct block {
    size_t size;
    size_t inside; /* whether it lies in the arena; makes the header 16 bytes */
};

static void *take(int size)
{
    size_t room = ((size_t)size + 15) & ~(size_t)15, whole = sizeof(struct block) + room;
    bool inside = whole <= ARENA_BYTES - arena.used;
    struct block *block = inside ? (struct block *)(void *)(arena.bytes + arena.used) : malloc(whole);

    if (!block)
        return NULL;
    if (inside) {
        arena.used += whole;
        arena.live++;
    }
    *block = (struct block){room, inside};
    return block + 1;
}

static int size_of(void *data)
{
    return data ? (int)((struct block *)data - 1)->size : 0;
}

static void give(void *data)
{
    struct block *block = data;

    if (!data)
        return;
    block--;
    if (!block->inside)
        free(block);
    else if (--arena.live == arena.kept_live)
        arena.used = arena.kept;
    else if ((unsigned char *)data + block->size == arena.bytes + arena.used)
        arena.used -= sizeof *block + block->size;
}

static void *take_again(void *data, int size)
{
    void *more = take(size);

    if (more && data) {
        memcpy(more, data, (size_t)(size_of(data) < size ? size_of(data) : size));
        give(data);
    }
    return more;
}

static int round_up(int size)
{
    return (size + 15) & ~15;
}

static int arena_begin(void *unused)
{
    (void)unused;
    return SQLITE_OK;
}

static void arena_end(void *unused)
{
    (void)unused;
}
#endif

/* SQLite as a single-threaded program needs it. */
int LLVMFuzzerInitialize(int *argc, char ***argv);

int LLVMFuzzerInitialize(int *argc, char ***argv)
{
    (void)argc, (void)argv;
    sqlite3_config(SQLITE_CONFIG_SINGLETHREAD);
    sqlite3_config(SQLITE_CONFIG_MEMSTATUS, 0);
#ifndef SEES_ADDRESSES
    static const sqlite3_mem_methods methods = {take,     give,        take_again, size_of,
                                                round_up, arena_begin, arena_end,  NULL};

    arena.bytes = malloc(ARENA_BYTES);
    if (arena.bytes && sqlite3_config(SQLITE_CONFIG_MALLOC, &methods) == SQLITE_OK &&
        sqlite3_initialize() == SQLITE_OK) {
        arena.kept = arena.used;
        arena.kept_live = arena.live;
    }
#endif
    return 0;
}

/* Databases consist of whole pages, so that neither their size nor their last byte says much: what decides about a
 * reading with memory that ends is all of their content. */
static uint64_t hash(const uint8_t *data, size_t size)
{
    uint64_t sum = size, word;

    for (size_t i = 0; i + sizeof word <= size; i += sizeof word) {
        memcpy(&word, data + i, sizeof word);
        sum += word;
    }
    return sum * 0x9e3779b97f4a7c15u;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    uint8_t *copy;

    if (size == 0 || size > 1 << 20)
        return 0;
    copy = malloc(size); /* SQLite may write into pages it was told not to write to a file */
    if (!copy)
        return 0;
    memcpy(copy, data, size);
    read_capture(copy, size);
    if (hash(copy, size) >> 61 == 0) {
        lumi_alloc_fail_after((int)(hash(copy, size) >> 32) % 16);
        read_capture(copy, size);
        lumi_alloc_fail_after(-1);
    }
    free(copy);
    return 0;
}
