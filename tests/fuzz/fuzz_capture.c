/* The capture reader over a database that may be anything: all that a reader reads. The file's own pages are the input,
 * so that nothing touches a disk. */
#include "proto/base/memory.h"
#include "proto/capture/capture_priv.h"

#include <stdint.h>
#include <stdlib.h>

static void read_all(struct lumi_capture *capture)
{
    struct lumi_capture_frame *frames;
    struct lumi_capture_lens lens;
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
    lumi_capture_info(capture, &info, NULL);
    if (lumi_capture_frames(capture, LUMI_FRAMES_ALL, &frames, &count, NULL) != LUMI_OK)
        return;
    for (int i = 0; i < count; i++) {
        if (!capture_name_ok(frames[i].name, sizeof frames[i].name) || !lumi_lens_valid(&frames[i].lens) ||
            (frames[i].has_pose && !lumi_pose_valid(&frames[i].pose, 1e-3)) ||
            (frames[i].file[0] && !capture_file_ok(frames[i].file)))
            abort();
        lumi_capture_lens(capture, frames[i].lens_id, &lens, NULL);
        if (lumi_capture_exif(capture, frames[i].id, &exif, &exif_size, NULL) == LUMI_OK)
            lumi_free(exif);
    }
    lumi_free(frames);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct lumi_capture *capture;
    uint8_t *copy;

    if (size == 0 || size > 1 << 20)
        return 0;
    copy = malloc(size); /* SQLite may write into pages it was told not to write to a file */
    if (!copy)
        return 0;
    for (size_t i = 0; i < size; i++)
        copy[i] = data[i];
    if (lumi_capture_open_memory(copy, size, "fuzz", &capture, NULL) == LUMI_OK) {
        read_all(capture);
        lumi_capture_close(capture);
    }
    free(copy);
    return 0;
}
