/* PLY, the polygon format (Turk 1994): triangles, binary little-endian. */
#ifndef LUMI_PIPELINE_EXCHANGE_PLY_H
#define LUMI_PIPELINE_EXCHANGE_PLY_H

#include "proto/base/result.h"

#include <stddef.h>
#include <stdint.h>

struct lumi_ply {
    size_t vertex_count, triangle_count;
    const float *positions;  /* 3 a vertex, metres */
    const float *texture;    /* 2 a vertex, 0..1 from the image's top left; NULL: none */
    const uint8_t *colours;  /* 3 a vertex, sRGB; NULL: none */
    const uint32_t *indices; /* 3 a triangle */
    const char *comment;     /* one line, may be NULL */
};

int lumi_ply_write(const char *path, const struct lumi_ply *ply, struct lumi_error *error);

#endif
