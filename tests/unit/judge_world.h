/* Frames of simulated places with faults whose size is known: smear, defocus, noise, exposure, a camera that was
 * knocked, a thing that moved. */
#ifndef LUMI_TESTS_UNIT_JUDGE_WORLD_H
#define LUMI_TESTS_UNIT_JUDGE_WORLD_H

#include "daemon/camera/camera_device.h"
#include "daemon/judge/judge.h"
#include "proto/base/memory.h"
#include "sim/camera.h"
#include "sim/place.h"
#include "sim/sensor.h"

#include <stdlib.h>
#include <string.h>

struct fault {
    double smear, angle; /* pixels, radians */
    double defocus;      /* pixels, diameter of the disk */
    double stops;        /* of exposure */
    double full_well;    /* electrons; 0: no noise */
    double thing;        /* share of the picture's width that a thing covers which was not there before */
    unsigned seed;
};

/* Looks at this azimuth and elevation (radians), from a sphere of 0.2 m about the origin. */
static inline struct lumi_pose world_pose(double azimuth, double elevation)
{
    double ca = cos(azimuth), sa = sin(azimuth), ce = cos(elevation), se = sin(elevation);
    struct lumi_vec3 z = lumi_vec3(ca * ce, sa * ce, se), x = lumi_vec3(sa, -ca, 0), y = lumi_cross(z, x);
    struct lumi_pose pose = {{x.x, y.x, z.x, x.y, y.y, z.y, x.z, y.z, z.z}, lumi_scale(z, 0.2)};

    return pose;
}

static inline void world_light(const float *at, size_t stride, double x, double y, int width, int height, float out[3])
{
    double left = floor(x), top = floor(y);
    float a = (float)(x - left), b = (float)(y - top);
    int x0 = left < 0 ? 0 : left > width - 1 ? width - 1 : (int)left, x1 = x0 + 1 < width ? x0 + 1 : x0;
    int y0 = top < 0 ? 0 : top > height - 1 ? height - 1 : (int)top, y1 = y0 + 1 < height ? y0 + 1 : y0;

    for (int c = 0; c < 3; c++) {
        float p = at[(size_t)y0 * stride + (size_t)(3 * x0 + c)], q = at[(size_t)y0 * stride + (size_t)(3 * x1 + c)];
        float r = at[(size_t)y1 * stride + (size_t)(3 * x0 + c)], s = at[(size_t)y1 * stride + (size_t)(3 * x1 + c)];
        out[c] = (1 - b) * ((1 - a) * p + a * q) + b * ((1 - a) * r + a * s);
    }
}

/* The mean over a set of places: a line (smear), then a disk (defocus). */
static inline void world_spread(struct lumi_raster *light, const double (*places)[2], int count)
{
    struct lumi_raster from;
    size_t stride = light->stride / sizeof(float);

    lumi_raster_create(&from, light->width, light->height, 3, LUMI_F32);
    memcpy(from.data, light->data, light->stride * (size_t)light->height);
    for (int y = 0; y < light->height; y++)
        for (int x = 0; x < light->width; x++) {
            float sum[3] = {0}, one[3];
            for (int i = 0; i < count; i++) {
                world_light(from.data, stride, x + places[i][0], y + places[i][1], light->width, light->height, one);
                for (int c = 0; c < 3; c++)
                    sum[c] += one[c] / (float)count;
            }
            memcpy(lumi_row_f32(light, y) + 3 * x, sum, sizeof sum);
        }
    lumi_raster_finish(&from);
}

static inline void world_smear(struct lumi_raster *light, double length, double angle)
{
    double places[256][2];
    int count = (int)(2 * length) + 2;

    count = count > 256 ? 256 : count;
    for (int i = 0; i < count; i++) {
        double at = length * ((i + 0.5) / count - 0.5);
        places[i][0] = at * cos(angle);
        places[i][1] = at * sin(angle);
    }
    world_spread(light, places, count);
}

static inline void world_defocus(struct lumi_raster *light, double diameter)
{
    double places[256][2];
    int count = 0;

    for (int j = -6; j <= 6; j++)
        for (int i = -6; i <= 6; i++)
            if (i * i + j * j <= 38) {
                places[count][0] = diameter * i / 13;
                places[count++][1] = diameter * j / 13;
            }
    world_spread(light, places, count);
}

/* A chequered thing somewhat left of the middle. */
static inline void world_thing(struct lumi_raster *light, double share)
{
    int size = (int)(share * light->width), x0 = light->width / 3, y0 = light->height / 3;

    for (int y = y0; y < y0 + size && y < light->height; y++)
        for (int x = x0; x < x0 + size && x < light->width; x++)
            for (int c = 0; c < 3; c++)
                lumi_row_f32(light, y)[3 * x + c] = ((x / 11 + y / 13) % 2 ? 0.6f : 0.1f) * (c == 1 ? 0.7f : 1);
}

/* A frame of 8-bit RGB; release data with lumi_free. `light` is left as it is. */
static inline void world_frame(const struct lumi_raster *light, const struct fault *fault,
                               struct lumi_camera_frame *frame)
{
    struct lumi_raster own, coded;
    struct sim_sensor sensor;

    lumi_raster_create(&own, light->width, light->height, 3, LUMI_F32);
    memcpy(own.data, light->data, light->stride * (size_t)light->height);
    if (fault->thing > 0)
        world_thing(&own, fault->thing);
    if (fault->smear > 0)
        world_smear(&own, fault->smear, fault->angle);
    if (fault->defocus > 0)
        world_defocus(&own, fault->defocus);
    sim_sensor_init(&sensor);
    sensor.exposure = fault->stops;
    sensor.full_well = fault->full_well;
    sensor.read_noise = fault->full_well > 0 ? 5 : 0;
    sim_sensor_apply(&sensor, fault->seed, &own);
    lumi_raster_convert(&own, LUMI_U8, &coded);
    size_t row = 3 * (size_t)light->width;
    uint8_t *data = lumi_alloc(row * (size_t)light->height, 1);
    for (int y = 0; y < light->height; y++)
        memcpy(data + (size_t)y * row, lumi_row_u8(&coded, y), row);
    *frame = (struct lumi_camera_frame){
        .format = {LUMI_LAYOUT_RGB, LUMI_BAYER_RGGB, light->width, light->height, 8, (int)row},
        .data = data,
        .size = row * (size_t)light->height};
    lumi_raster_finish(&own);
    lumi_raster_finish(&coded);
}

static inline struct lumi_judge_picture *world_picture(const struct lumi_raster *light, const struct fault *fault)
{
    struct lumi_judge_picture *picture = NULL;
    struct lumi_camera_frame frame;

    world_frame(light, fault, &frame);
    lumi_judge_picture_create(&frame, &picture, NULL);
    lumi_free((void *)(uintptr_t)frame.data);
    return picture;
}

#endif
