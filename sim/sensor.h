/* From the light on a sensor to the numbers it gives. With the settings sim_sensor_init fills in, nothing happens. */
#ifndef LUMI_SIM_SENSOR_H
#define LUMI_SIM_SENSOR_H

#include "proto/base/raster.h"

#include <stdint.h>

struct sim_sensor {
    double exposure; /* stops */
    double vignetting; /* what is lost in the picture's corners, 0..1; falls as 1 − v r² (2 − r²)/…, see sensor.c */
    double full_well;  /* electrons at white; 0: no shot noise */
    double read_noise; /* electrons, one standard deviation; needs full_well */
    int bits;          /* of the converter, linear: 8, 10 or 12; 0: none */
    uint64_t seed;     /* every frame its own: sim_sensor_apply mixes in `frame` */
};

void sim_sensor_init(struct sim_sensor *sensor);
int sim_sensor_check(const struct sim_sensor *sensor, struct lumi_error *error);

/* Changes linear light (F32, 1 is white) in place. */
void sim_sensor_apply(const struct sim_sensor *sensor, uint64_t frame, struct lumi_raster *picture);

/* One number a pixel: what a colour filter R G / G B lets through. `raw` is created, of the picture's upper left part.
 */
int sim_sensor_filter(const struct lumi_raster *picture, int width, int height, struct lumi_raster *raw);

#endif
