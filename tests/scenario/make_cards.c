/* make_cards CAPTURE OUT SCRIPT: the capture's rig as OUT.rig, and the frames of a capture as its cameras would have
 * written them to their cards, OUT/CAMERA/DCIM/100LUMIS/IMG_nnnn.JPG, with a time in each (EXIF) by a clock of the
 * camera's own. The script has a line for each thing that is not as it should be:
 *
 *   clock CAMERA SECONDS PPM     its clock is so far ahead, and drifts
 *   number CAMERA N              its first file is IMG_N
 *   skip CAMERA SHOT             it did not fire
 *   stop CAMERA SHOT             it stopped before this shot
 *   test CAMERA SECONDS          a picture that somebody took so long before (or behind, where negative) the sweep
 *   copy CAMERA SHOT             its file is there twice
 *   cut CAMERA SHOT              its file lacks its second half
 *   pace SECONDS                 from shot to shot (0.5)
 *   bracket STOPS STOPS STOPS    every position is taken three times, with these exposures */
#include "proto/base/file.h"
#include "proto/base/memory.h"
#include "proto/image/image.h"
#include "tests/scenario/camera_script.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>

static double pace = 0.5, stops[3];
static bool bracketed;

static bool take_setting(const char *line)
{
    if (sscanf(line, "bracket %lf %lf %lf", &stops[0], &stops[1], &stops[2]) == 3)
        return bracketed = true;
    return sscanf(line, "pace %lf", &pace) == 1;
}

/* An EXIF block, little-endian: DateTimeOriginal, its part of a second, exposure time, ISO 100. */
static size_t make_exif(uint8_t *out, double unix_s, double exposure_s)
{
    uint8_t *at = out;
    char when[20], part[8];
    time_t whole = (time_t)floor(unix_s);
    struct tm fields;
    uint32_t microseconds = (uint32_t)lround(exposure_s * 1e6), million = 1000000;

#define PUT16(value) (*at++ = (uint8_t)(value), *at++ = (uint8_t)((value) >> 8))
#define PUT32(value) (PUT16((uint32_t)(value)&0xffff), PUT16((uint32_t)(value) >> 16))
#define ENTRY(tag, type, count, value) (PUT16(tag), PUT16(type), PUT32(count), PUT32(value))
    gmtime_r(&whole, &fields);
    strftime(when, sizeof when, "%Y:%m:%d %H:%M:%S", &fields);
    snprintf(part, sizeof part, "%03d", (int)((unix_s - floor(unix_s)) * 1000));
    memcpy(at, "II*\0\10\0\0\0", 8);
    at += 8;
    PUT16(1);
    ENTRY(0x8769, 4, 1, 26);
    PUT32(0);
    PUT16(4);
    ENTRY(0x829a, 5, 1, 80);
    ENTRY(0x8827, 3, 1, 100);
    ENTRY(0x9003, 2, 20, 88);
    ENTRY(0x9291, 2, 4, 0);
    memcpy(at - 4, part, 4);
    PUT32(0);
    PUT32(microseconds);
    PUT32(million);
    memcpy(at, when, 20);
    return (size_t)(at + 20 - out);
}

static int make_folder(const char *out, const char *camera, char *path, size_t size)
{
    static const char *const parts[] = {"", "/DCIM", "/DCIM/100LUMIS"};

    mkdir(out, 0777);
    for (int i = 0; i < 3; i++) {
        snprintf(path, size, "%s/%s%s", out, camera, parts[i]);
        mkdir(path, 0777);
    }
    return 0;
}

/* Writes the picture `copies` times under the camera's next numbers. */
static int write_picture(const char *folder, const struct lumi_raster *raster, double unix_s, double exposure_s,
                         int *number, int copies, bool cut, struct lumi_error *error)
{
    struct lumi_image_options options;
    uint8_t exif[256], *data;
    char path[512];
    size_t size;

    lumi_image_options_init(&options);
    options.format = LUMI_IMAGE_JPEG;
    options.exif = exif;
    options.exif_size = make_exif(exif, unix_s, exposure_s);
    LUMI_TRY(lumi_image_encode(raster, &options, &data, &size, error));
    int code = LUMI_OK;
    for (int i = 0; code == LUMI_OK && i < copies; i++) {
        snprintf(path, sizeof path, "%s/IMG_%04d.JPG", folder, *number);
        *number = *number % 9999 + 1;
        code = lumi_file_write(path, data, cut ? size / 2 : size, false, error);
    }
    lumi_free(data);
    return code;
}

static double clock_of(const char *camera, double time)
{
    const struct script_line *clock = script_find("clock", camera, -1);

    return 1790000000 + 100 + time * (1 + (clock ? clock->b * 1e-6 : 0)) + (clock ? clock->a : 0);
}

static int write_tests(const char *folder, const char *camera, bool before, const struct lumi_raster *raster,
                       double end, int *number, struct lumi_error *error)
{
    for (int i = 0; i < script_line_count; i++)
        if (!strcmp(script_lines[i].what, "test") && !strcmp(script_lines[i].camera, camera) &&
            (script_lines[i].a > 0) == before)
            LUMI_TRY(write_picture(folder, raster,
                                   clock_of(camera, before ? -script_lines[i].a : end - script_lines[i].a), 0.004,
                                   number, 1, false, error));
    return LUMI_OK;
}

static int write_shot(const char *folder, const char *camera, int position, const struct lumi_raster *raster,
                      int *number, struct lumi_error *error)
{
    const struct script_line *stop = script_find("stop", camera, -1);

    for (int k = 0; k < (bracketed ? 3 : 1); k++) {
        int shot = bracketed ? 3 * position + k : position;
        double time = bracketed ? 4 * pace * position + pace * k : pace * position;
        if (script_find("skip", camera, shot) || (stop && shot >= stop->a))
            continue;
        LUMI_TRY(write_picture(folder, raster, clock_of(camera, time), 0.01 * exp2(stops[k]), number,
                               script_find("copy", camera, shot) ? 2 : 1, script_find("cut", camera, shot) != NULL,
                               error));
    }
    return LUMI_OK;
}

static int write_camera(struct lumi_capture *capture, const struct lumi_capture_frame *frames, int count,
                        const char *out, const char *camera, struct lumi_error *error)
{
    const struct script_line *first = script_find("number", camera, -1);
    struct lumi_raster bytes = {0};
    int number = first ? (int)first->a : 1, position = 0, code = LUMI_OK;
    char folder[512];

    make_folder(out, camera, folder, sizeof folder);
    for (int i = 0; code == LUMI_OK && i < count; i++) {
        if (strcmp(frames[i].camera_name, camera) != 0)
            continue;
        lumi_raster_finish(&bytes);
        code = camera_script_picture(capture, &frames[i], &bytes, error);
        if (code == LUMI_OK && position == 0)
            code = write_tests(folder, camera, true, &bytes, 0, &number, error);
        if (code == LUMI_OK)
            code = write_shot(folder, camera, position++, &bytes, &number, error);
    }
    if (code == LUMI_OK)
        code = write_tests(folder, camera, false, &bytes, pace * (bracketed ? 4 : 1) * position, &number, error);
    lumi_raster_finish(&bytes);
    return code;
}

int main(int argc, char **argv)
{
    const struct camera_script script = {"make_cards", take_setting, NULL, write_camera};

    return camera_script_run(&script, argc, argv);
}
