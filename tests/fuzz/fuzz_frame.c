/* Frames of every layout, from bytes: what is kept of them as a file, what judgement makes of them, and the
 * small picture that is shown of them. */
#include "checks.h"

#include "daemon/camera/frame_file.h"
#include "daemon/judge/judge.h"
#include "daemon/preview/pictures_priv.h"
#include "proto/base/memory.h"

#include <string.h>

static int number(const uint8_t *data)
{
    return data[0] | data[1] << 8;
}

static void show_frame(const struct lumi_camera_frame *frame)
{
    struct pictures_small small;
    struct lumi_picture *picture = NULL;
    struct lumi_error error = {0};
    uint64_t all = 0;

    int code = checked(pictures_take(frame, 64, &small, &error), &error);
    if (code == LUMI_OK)
        code = checked(pictures_make(&small, 64, 75, &picture, &error), &error);
    pictures_small_clear(&small);
    if ((code == LUMI_OK) != (picture != NULL))
        abort();
    if (!picture)
        return;
    for (int i = 0; i < LUMI_PICTURE_BINS; i++)
        all += picture->histogram[i];
    if (picture->small_width < 1 || picture->small_width > 64 || picture->small_height < 1 || !picture->size ||
        all != (uint64_t)picture->small_width * (uint64_t)picture->small_height || !(picture->mean >= 0) ||
        !(picture->mean <= 1) || !(picture->clipped_low + picture->clipped_high <= 2))
        abort();
    lumi_free(picture->jpeg);
    lumi_free(picture);
}

static void take_frame(const uint8_t *data, size_t size)
{
    struct lumi_camera_frame frame = {.format = {.layout = (enum lumi_frame_layout)(data[0] % 8),
                                                 .bayer = (enum lumi_bayer)(data[1] % 4),
                                                 .width = number(data + 2) % 512,
                                                 .height = number(data + 4) % 512,
                                                 .bits = data[6] % 20,
                                                 .stride = number(data + 7) % 2048},
                                      .data = data + 9,
                                      .size = size - 9};
    struct lumi_judge_picture *picture = NULL;
    struct lumi_frame_file file;
    struct lumi_error error = {0};
    size_t sum = 0;

    if (frame.format.layout == LUMI_LAYOUT_FILE || frame.format.layout == LUMI_LAYOUT_NONE)
        return;
    if (checked(lumi_frame_file_make(&frame, NULL, &file, &error), &error) == LUMI_OK)
        for (int i = 0; i < file.count; i++)
            for (size_t k = 0; k < file.pieces[i].iov_len; k += 61)
                sum += ((const uint8_t *)file.pieces[i].iov_base)[k];
    lumi_frame_file_finish(&file);
    int code = checked(lumi_judge_picture_create(&frame, &picture, &error), &error);
    if ((code == LUMI_OK) != (picture != NULL) || sum == SIZE_MAX)
        abort();
    lumi_judge_picture_destroy(picture);
    show_frame(&frame);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size < 10)
        return 0;
    with_and_without_memory(data, size, take_frame);
    return 0;
}
