/* An open field, inside. */
#ifndef LUMI_PROTO_LIGHTFIELD_FIELD_PRIV_H
#define LUMI_PROTO_LIGHTFIELD_FIELD_PRIV_H

#include "proto/lightfield/field.h"
#include "proto/lightfield/field_layout.h"
#include "proto/lightfield/reference_code.h"
#include "proto/lightfield/side_info.h"
#include "proto/lightfield/tile_core.h"

struct field_section_bytes {
    const uint8_t *data;
    size_t size;
};

struct field_cluster {
    int count;                       /* views */
    const int *members;              /* the reference image first */
    struct lumi_tile_entry *entries; /* (count − 1) × tiles; NULL where the side information is damaged */
    const uint8_t *side, *tiles, *reference;
    uint32_t reference_size, reference_crc, side_size, side_crc, tile_size;
};

struct field_level {
    int view_count;
    struct lumi_field_view *views;
    struct lumi_view_mesh *meshes;
    int width, height, cols, rows;
    int dictionary_count;
    struct {
        uint8_t size;
        const uint8_t *bytes;
    } dictionary[LUMI_DICTIONARY_MAX];
    struct lumi_priming priming;
    int run; /* reference images a stream */
    int cluster_count;
    struct field_cluster *clusters;
    int *members;                /* of all clusters */
    int *cluster_of, *member_of; /* a view each */
    struct lumi_tile_entry *entries;
    struct lumi_yuv *references; /* a cluster each; all zero where damaged */
};

struct lumi_field {
    const uint8_t *data;
    size_t size;
    bool mapped;
    char *name;
    struct lumi_field_info info;
    int grid_count;
    struct lumi_grid *grids;
    struct field_level levels[LUMI_LEVELS];
    uint64_t memory, memory_limit; /* taken so far, and what the header says */
};

/* Reads a level from its sections (SECTION_VIEWS and up, by kind). The error does not name the file. */
int lumi_field_level_read(struct lumi_field *field, int level, const struct field_section_bytes *sections, int threads,
                          struct lumi_error *error);
void lumi_field_level_finish(struct field_level *level);

#endif
