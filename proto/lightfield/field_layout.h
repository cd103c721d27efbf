/* The bytes of a field's header and section table; docs/lumi-format.md describes them and the sections. */
#ifndef LUMI_PROTO_LIGHTFIELD_FIELD_LAYOUT_H
#define LUMI_PROTO_LIGHTFIELD_FIELD_LAYOUT_H

#include <stdint.h>

enum {
    FIELD_VERSION = 1,
    FIELD_HEADER_SIZE = 64,
    FIELD_ENTRY_SIZE = 32, /* of the section table, which follows the header */
    FIELD_SECTIONS_MAX = 64,
    FIELD_VIEWS_MAX = 1 << 16, /* a level */
    FIELD_GRIDS_MAX = 64,
    FIELD_ALIGNMENT = 64 /* of sections in the file */
};

static const uint8_t field_magic[8] = {0x89, 'L', 'U', 'M', 'I', '\r', '\n', 0x1a};

/* What the header's memory figure counts: 24 bytes for each coded tile, and the reference images. */
#define FIELD_TILE_BYTES ((uint64_t)24)
#define FIELD_IMAGE_BYTES(width, height)                                                                               \
    ((uint64_t)(width) * (uint64_t)(height) + 2 * (uint64_t)(((width) + 1) / 2) * (uint64_t)(((height) + 1) / 2))
#define FIELD_MEMORY_PER_BYTE 65536          /* plausible: so many bytes decoded from one of the file, */
#define FIELD_MEMORY_MAX ((uint64_t)1 << 36) /* and no more than this */

enum field_section {
    SECTION_FIELD = 1,      /* surface, disks, quality */
    SECTION_GRIDS = 2,      /* lenses of the views */
    SECTION_VIEWS = 3,      /* of a level: names, poses, disks */
    SECTION_MESHES = 4,     /* of a level: geometry */
    SECTION_CODING = 5,     /* of a level: dictionary, priming, clusters */
    SECTION_REFERENCES = 6, /* of a level: reference images */
    SECTION_SIDE = 7,       /* of a level: side information of tiles */
    SECTION_TILES = 8,      /* of a level: bytes of tiles */
    SECTION_KINDS
};

#endif
