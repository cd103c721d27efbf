/* Frames whose bytes say whose they are. */
#include "capture_world.h"

#include "proto/base/memory.h"
#include "proto/image/image.h"
#include "proto/mechanism/kinematics.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define TRUTH "LUMI-TRUTH "
#define TRUTH_SIZE 64

bool world_truth_find(const void *data, size_t size, struct world_truth *truth)
{
    const char *at = data, *end = at + size;
    char text[TRUTH_SIZE];

    while (at && end - at >= TRUTH_SIZE && memcmp(at, TRUTH, strlen(TRUTH)) != 0)
        at = memchr(at + 1, TRUTH[0], (size_t)(end - at - 1));
    if (!at || end - at < TRUTH_SIZE)
        return false;
    memcpy(text, at, TRUTH_SIZE);
    text[TRUTH_SIZE - 1] = 0;
    return sscanf(text + strlen(TRUTH), "camera %d record %d shot %d flaws %u.", &truth->camera, &truth->record,
                  &truth->shot, &truth->flaws) == 4;
}

static void truth_print(char text[TRUTH_SIZE], const struct world *w, int camera, int record, unsigned flaws)
{
    int shot = record >= 0 ? w->exposures[record].shot : -1;

    memset(text, ' ', TRUTH_SIZE);
    int length = snprintf(text, TRUTH_SIZE, TRUTH "camera %d record %d shot %d flaws %u.", camera, record, shot, flaws);
    text[length] = ' ';
}

/* A wall far away, painted so that every direction is told from its neighbours. 0 … 1. */
static double wall(struct lumi_vec3 d)
{
    double broad = sin(7 * d.x + 1) + sin(9 * d.y + 2) + sin(8 * d.z);
    double fine = sin(61 * d.x + 23 * d.z) * sin(53 * d.y - 31 * d.x) + sin(83 * d.z + 17 * d.y);

    double finest = sin(331 * d.x + 210 * d.y) * sin(297 * d.z + 170 * d.x) + sin(263 * d.y - 190 * d.z + 140 * d.x);

    return 0.45 + 0.06 * broad + 0.06 * fine + 0.07 * finest;
}

/* What a camera sees of it in a shot; blurred: while it turns by some pixels. */
static int paint(const struct world *w, int camera, int shot, bool blurred, uint8_t **data, size_t *size,
                 struct lumi_error *error)
{
    const struct lumi_lens *lens = &w->rig.lenses[w->rig.cameras[camera].lens].lens;
    double turns = shot < 0 ? 0 : w->plan.first_turn + (double)(shot / w->plan.bracket) / w->plan.positions;
    int smear = blurred ? 12 : 1;
    struct lumi_image_options options;
    struct lumi_raster raster;
    struct lumi_pose pose;

    lumi_rig_camera_pose(&w->rig, camera, turns, &pose);
    LUMI_TRY(lumi_raster_create(&raster, lens->width, lens->height, 1, LUMI_U8));
    for (int y = 0; y < lens->height; y++)
        for (int x = 0; x < lens->width; x++) {
            double sum = 0;
            for (int k = 0; k < smear; k++) {
                struct lumi_vec3 d = {0, 0, 1};
                lumi_lens_unproject(lens, x + 0.5 + k - smear / 2, y + 0.5, &d);
                sum += wall(lumi_rotate(pose.r, d));
            }
            lumi_row_u8(&raster, y)[x] = (uint8_t)(255 * fmin(fmax(sum / smear, 0), 1));
        }
    lumi_image_options_init(&options);
    options.format = LUMI_IMAGE_JPEG;
    int code = lumi_image_encode(&raster, &options, data, size, error);
    lumi_raster_finish(&raster);
    return code;
}

bool world_pictures_create(struct world *w)
{
    struct lumi_raster raster = {0};
    struct lumi_image_options options;
    struct lumi_error error = {0};
    int width = w->options.width, height = w->options.height;

    if (lumi_raster_create(&raster, width, height, 1, LUMI_U8) != LUMI_OK)
        return world_wrong(w, "no memory for a picture");
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++)
            ((uint8_t *)raster.data)[(size_t)y * raster.stride + (size_t)x] = (uint8_t)(64 + (x * 5 + y * 3) % 128);
    lumi_image_options_init(&options);
    options.format = LUMI_IMAGE_JPEG;
    int code = lumi_image_encode(&raster, &options, &w->picture, &w->picture_size, &error);
    lumi_raster_finish(&raster);
    return code == LUMI_OK || world_wrong(w, "%s", error.text);
}

static void release(struct lumi_camera_frame *frame)
{
    struct world_frame *f = (struct world_frame *)frame;
    struct world *w = f->world;

    w->frames_out--;
    w->bytes_out -= f->frame.size;
    if (f->generation == w->generation)
        w->cameras[f->camera].out--;
    free(f->bytes);
    free(f);
}

/* A JPEG file with a comment (marker COM, ITU-T T.81 B.2.4.5) right after its start. */
static void fill_jpeg(struct world_frame *f, const uint8_t *picture, size_t size, const char *truth)
{
    uint8_t head[] = {0xff, 0xd8, 0xff, 0xfe, (TRUTH_SIZE + 2) >> 8, (TRUTH_SIZE + 2) & 0xff};

    f->frame.size = sizeof head + TRUTH_SIZE + size - 2;
    f->bytes = malloc(f->frame.size);
    memcpy(f->bytes, head, sizeof head);
    memcpy(f->bytes + sizeof head, truth, TRUTH_SIZE);
    memcpy(f->bytes + sizeof head + TRUTH_SIZE, picture + 2, size - 2);
    f->frame.format.layout = LUMI_LAYOUT_JPEG;
}

static void fill_raw(struct world_frame *f, const struct world *w, const char *truth)
{
    size_t size = (size_t)w->options.width * (size_t)w->options.height;

    f->frame.size = size;
    f->bytes = malloc(size);
    for (size_t i = 0; i < size; i++)
        f->bytes[i] = (uint8_t)(64 + i * 7 % 128);
    memcpy(f->bytes, truth, TRUTH_SIZE);
    f->frame.format.layout = LUMI_LAYOUT_BAYER;
    f->frame.format.bits = 8;
    f->frame.format.stride = w->options.width;
}

struct world_frame *world_frame_create(struct world *w, int camera, int record, unsigned flaws)
{
    struct world_frame *f = calloc(1, sizeof *f);
    struct lumi_error error = {0};
    char truth[TRUTH_SIZE];

    truth_print(truth, w, camera, record, flaws);
    f->world = w;
    f->camera = camera;
    f->record = record;
    f->generation = w->generation;
    f->frame.format.width = w->options.width;
    f->frame.format.height = w->options.height;
    if (w->options.raw) {
        fill_raw(f, w, truth);
    } else if (w->options.judge_really) {
        int shot = record >= 0 ? w->exposures[record].shot : -1;
        uint8_t *picture = NULL;
        size_t size = 0;
        if (paint(w, camera, shot, flaws & WORLD_BLURRED, &picture, &size, &error) != LUMI_OK)
            world_wrong(w, "%s", error.text);
        else
            fill_jpeg(f, picture, size, truth);
        lumi_free(picture);
    } else {
        fill_jpeg(f, w->picture, w->picture_size, truth);
    }
    f->frame.data = f->bytes;
    f->frame.release = release;
    f->frame.owner = f;
    f->frame.temperature = NAN;
    f->frame.file_mtime_ns = LUMI_CAMERA_NO_TIME;
    if (flaws & WORLD_DAMAGED) {
        f->frame.damaged = true;
        f->frame.size -= f->frame.size / 3;
        f->frame.packets_missing = 3;
    }
    w->frames_out++;
    w->bytes_out += f->frame.size;
    w->cameras[camera].out++;
    if (w->frames_out > w->frames_out_most)
        w->frames_out_most = w->frames_out;
    if (w->bytes_out > w->bytes_out_most)
        w->bytes_out_most = w->bytes_out;
    return f;
}
