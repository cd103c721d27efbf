/* The capture reader over a database that may be anything: all that a reader reads. The file's own pages are the input,
 * so that nothing touches a disk. */
#include "checks.h"

#include "proto/capture/capture_priv.h"

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
    checked(lumi_capture_lens(capture, 1, &lens, &error), &error);
    checked(lumi_capture_lens(capture, 77, &lens, &error), &error);
    if (checked(lumi_capture_frames(capture, LUMI_FRAMES_ALL, &frames, &count, &error), &error) != LUMI_OK)
        return;
    for (int i = 0; i < count; i++) {
        if (!capture_name_ok(frames[i].name, sizeof frames[i].name) || !lumi_lens_valid(&frames[i].lens) ||
            (frames[i].has_pose && !lumi_pose_valid(&frames[i].pose, 1e-3)) ||
            (frames[i].file[0] && !capture_file_ok(frames[i].file)))
            abort();
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

/* SQLite as a single-threaded program needs it. */
int LLVMFuzzerInitialize(int *argc, char ***argv);

int LLVMFuzzerInitialize(int *argc, char ***argv)
{
    (void)argc, (void)argv;
    sqlite3_config(SQLITE_CONFIG_SINGLETHREAD);
    sqlite3_config(SQLITE_CONFIG_MEMSTATUS, 0);
    return 0;
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
    with_and_without_memory(copy, size, read_capture);
    free(copy);
    return 0;
}
