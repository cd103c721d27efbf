/* From linear light to the bytes a camera sends: exposure and gain, noise, filter, bits, packing; chunk data. */
#ifndef LUMI_SIM_GIGE_GIGE_ENCODE_H
#define LUMI_SIM_GIGE_GIGE_ENCODE_H

#include "proto/base/raster.h"
#include "sim/sensor.h"

#include <stddef.h>
#include <stdint.h>

struct gige_shot {
    uint32_t format;
    int width, height; /* of the picture's upper left part */
    double brightness; /* what exposure and gain make of 1 */
    struct sim_sensor sensor;
    uint64_t number; /* every frame its own noise */
    int jpeg_quality;
    /* Chunk data, where `chunks` has a bit (GIGE_CHUNK_…); 0: none. */
    unsigned chunks;
    double exposure_us, gain_db;
    uint64_t timestamp, frame_id, counter;
};

/* `picture`: linear RGB, F32, at least as large; it is changed. *data is released with lumi_free. */
int gige_encode(const struct gige_shot *shot, struct lumi_raster *picture, uint8_t **data, size_t *size,
                struct lumi_error *error);

#endif
