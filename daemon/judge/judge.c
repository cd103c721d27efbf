/* One frame: what is measured of it alone, and the verdict. */
#include "daemon/judge/judge.h"

#include "daemon/camera/camera_device.h"
#include "daemon/judge/judge_priv.h"
#include "proto/base/memory.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define NOISE_BLOCK 8
#define NOT_FOUND 0.6 /* of what neighbours should see: more is no thing that moved, and no shift can be told */

/* Means of step × step pixels, so that the longer side has at most JUDGE_SMALL of them. */
static int make_small(const struct judge_plane *plane, struct lumi_judge_picture *picture)
{
    int longer = plane->width > plane->height ? plane->width : plane->height;
    int step = (longer + JUDGE_SMALL - 1) / JUDGE_SMALL;
    int width = plane->width / step, height = plane->height / step;

    if (width < 1 || height < 1)
        return LUMI_ERR_FORMAT;
    picture->step = step;
    picture->small = (struct judge_plane){width, height, lumi_alloc((size_t)width * (size_t)height, sizeof(float))};
    if (!picture->small.data)
        return LUMI_ERR_NOMEM;
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            double sum = 0;
            for (int j = 0; j < step; j++) {
                const float *row = plane->data + (size_t)(y * step + j) * (size_t)plane->width + (size_t)(x * step);
                for (int i = 0; i < step; i++)
                    sum += (double)row[i];
            }
            picture->small.data[(size_t)y * (size_t)width + (size_t)x] = (float)(sum / (step * step));
        }
    return LUMI_OK;
}

static int by_value(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;

    return (x > y) - (x < y);
}

/* Noise where the picture is smoothest: Immerkær, "Fast noise variance estimation", 1996 (his mask has the sum of
 * squares 36), block by block; the tenth of the blocks with the least of it decides. */
static int measure_noise(const struct judge_plane *plane, double *noise)
{
    int across = (plane->width - 2) / NOISE_BLOCK, down = (plane->height - 2) / NOISE_BLOCK, count = 0;
    int skip = (int)(1 + (int64_t)across * down / 20000);

    *noise = 0;
    if (across < 1 || down < 1)
        return LUMI_OK;
    float *found = lumi_alloc((size_t)across * (size_t)down / (size_t)skip + 1, sizeof *found);
    if (!found)
        return LUMI_ERR_NOMEM;
    for (int64_t block = 0; block < (int64_t)across * down; block += skip) {
        int x0 = (int)(block % across) * NOISE_BLOCK + 1, y0 = (int)(block / across) * NOISE_BLOCK + 1;
        double sum = 0;
        for (int y = y0; y < y0 + NOISE_BLOCK; y++)
            for (int x = x0; x < x0 + NOISE_BLOCK; x++) {
                const float *p = plane->data + (size_t)y * (size_t)plane->width + (size_t)x, *a = p - plane->width,
                            *b = p + plane->width;
                float d = a[-1] - 2 * a[0] + a[1] - 2 * p[-1] + 4 * p[0] - 2 * p[1] + b[-1] - 2 * b[0] + b[1];
                sum += (double)(d * d);
            }
        found[count++] = (float)(sum / (36 * NOISE_BLOCK * NOISE_BLOCK));
    }
    qsort(found, (size_t)count, sizeof *found, by_value);
    *noise = sqrt((double)found[count / 10]);
    lumi_free(found);
    return LUMI_OK;
}

int lumi_judge_picture_create(const struct lumi_camera_frame *frame, struct lumi_judge_picture **picture,
                              struct lumi_error *error)
{
    struct judge_plane plane;
    double sum = 0;

    *picture = NULL;
    struct lumi_judge_picture *made = lumi_calloc(1, sizeof *made);
    if (!made)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory to judge a frame");
    int code = judge_decode(frame, &plane, &made->clipped, &made->dark, error);
    if (code != LUMI_OK) {
        lumi_free(made);
        return code;
    }
    made->width = plane.width;
    made->height = plane.height;
    code = make_small(&plane, made);
    if (code == LUMI_OK)
        code = measure_noise(&plane, &made->noise);
    if (code == LUMI_OK)
        code = judge_spectrum(&plane, made->noise, made);
    for (int i = 0; code == LUMI_OK && i < made->small.width * made->small.height; i++)
        sum += (double)made->small.data[i];
    lumi_free(plane.data);
    if (code != LUMI_OK) {
        lumi_judge_picture_destroy(made);
        return lumi_fail(error, code, "%s",
                         code == LUMI_ERR_NOMEM ? "no memory to judge a frame" : "a picture too narrow to judge");
    }
    made->mean = sum / ((double)made->small.width * made->small.height);
    *picture = made;
    return LUMI_OK;
}

void lumi_judge_picture_destroy(struct lumi_judge_picture *picture)
{
    if (!picture)
        return;
    lumi_free(picture->small.data);
    lumi_free(picture);
}

void lumi_judge_limits_init(struct lumi_judge_limits *limits)
{
    *limits = (struct lumi_judge_limits){.sharpness_share = 0.5,
                                         .blur_pixels = 2,
                                         .clipped = 0.25,
                                         .exposure_stops = 0.5,
                                         .shift_pixels = 8,
                                         .moved = 0.05};
}

int lumi_judge_measure(const struct lumi_judge_picture *picture, const struct lumi_lens *lens,
                       const struct lumi_pose *pose, double exposure_s, double gain,
                       const struct lumi_judge_neighbour *neighbours, int count, struct lumi_judge_numbers *numbers,
                       struct lumi_error *error)
{
    *numbers = (struct lumi_judge_numbers){.sharpness = picture->sharpness,
                                           .blur_pixels = picture->blur_pixels,
                                           .blur_angle = picture->blur_angle,
                                           .clipped = picture->clipped,
                                           .dark = picture->dark,
                                           .mean = picture->mean,
                                           .exposure_stops = (double)NAN,
                                           .shift_pixels = (double)NAN,
                                           .moved = (double)NAN};
    if (!lens || !pose || count < 1)
        return LUMI_OK;
    int code = judge_compare(picture, lens, pose, exposure_s, gain, neighbours, count, numbers);
    return code == LUMI_OK ? LUMI_OK : lumi_fail(error, code, "no memory to compare a frame with its neighbours");
}

struct line {
    char *text;
    size_t size, at;
};

static void say(struct line *line, const char *format, ...) __attribute__((format(printf, 2, 3)));
static void say(struct line *line, const char *format, ...)
{
    va_list args;

    if (line->size == 0 || line->at + 1 >= line->size)
        return;
    if (line->at > 0)
        line->at += (size_t)snprintf(line->text + line->at, line->size - line->at, "; ");
    if (line->at + 1 >= line->size)
        return;
    va_start(args, format);
    int length = vsnprintf(line->text + line->at, line->size - line->at, format, args);
    va_end(args);
    line->at += length > 0 ? (size_t)length : 0;
}

#define USUAL ((int)(sizeof((struct lumi_judge_usual *)0)->sharpness / sizeof(float)))

void lumi_judge_usual_add(struct lumi_judge_usual *usual, double sharpness)
{
    if (sharpness > 0)
        usual->sharpness[usual->count++ % USUAL] = (float)sharpness;
}

double lumi_judge_usual_sharpness(const struct lumi_judge_usual *usual)
{
    float sorted[USUAL];
    const int count = usual->count < USUAL ? usual->count : USUAL;

    if (count < 3)
        return 0;
    memcpy(sorted, usual->sharpness, (size_t)count * sizeof *sorted);
    qsort(sorted, (size_t)count, sizeof *sorted, by_value);
    return (double)sorted[count / 2];
}

const char *lumi_judge_fault_name(enum lumi_judge_fault fault)
{
    static const char *const names[] = {"", "soft", "clipped", "moved", "other"};

    return (unsigned)fault <= LUMI_JUDGE_OTHER ? names[fault] : "other";
}

static void blame(enum lumi_judge_fault *first, enum lumi_judge_fault fault)
{
    if (*first == LUMI_JUDGE_GOOD)
        *first = fault;
}

static enum lumi_judge_fault judge(const struct lumi_judge_numbers *n, const struct lumi_judge_limits *limits,
                                   double usual_sharpness, struct line *line)
{
    enum lumi_judge_fault fault = LUMI_JUDGE_GOOD;

    if (usual_sharpness > 0 && n->sharpness > 0 && n->sharpness < limits->sharpness_share * usual_sharpness) {
        blame(&fault, LUMI_JUDGE_SOFT);
        say(line, "not sharp: %.0f %% of what this camera's frames usually have", 100 * n->sharpness / usual_sharpness);
    }
    if (n->blur_pixels > limits->blur_pixels) {
        blame(&fault, LUMI_JUDGE_SOFT);
        say(line, "smeared over %.1f pixels", n->blur_pixels);
    }
    if (n->clipped > limits->clipped) {
        blame(&fault, LUMI_JUDGE_CLIPPED);
        say(line, "%.0f %% of it is white", 100 * n->clipped);
    }
    if (fabs(n->exposure_stops) > limits->exposure_stops) {
        blame(&fault, LUMI_JUDGE_OTHER);
        say(line, "%.1f stops %s than its neighbours", fabs(n->exposure_stops),
            n->exposure_stops > 0 ? "brighter" : "darker");
    }
    if (n->moved > NOT_FOUND) {
        blame(&fault, LUMI_JUDGE_MOVED);
        say(line, "%.0f %% of it is not where its neighbours see it: the camera has moved far, or is blocked",
            100 * n->moved);
        return fault;
    }
    if (n->shift_pixels > limits->shift_pixels) {
        blame(&fault, LUMI_JUDGE_MOVED);
        say(line, "shifted by %.1f pixels against its neighbours: the camera has moved", n->shift_pixels);
    }
    if (n->moved > limits->moved) {
        if (limits->reject_moved)
            blame(&fault, LUMI_JUDGE_MOVED);
        say(line, "things moved in %.0f %% of it", 100 * n->moved);
    }
    return fault;
}

bool lumi_judge_verdict(const struct lumi_judge_numbers *numbers, const struct lumi_judge_limits *limits,
                        double usual_sharpness, enum lumi_judge_fault *fault, char *reason, size_t size)
{
    struct line line = {reason, size, 0};
    enum lumi_judge_fault found;

    if (size > 0)
        reason[0] = '\0';
    found = judge(numbers, limits, usual_sharpness, &line);
    if (fault)
        *fault = found;
    return found == LUMI_JUDGE_GOOD;
}
