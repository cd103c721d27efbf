/* A field: the .lumi file, read. docs/lumi-format.md has the bytes. */
#ifndef LUMI_PROTO_LIGHTFIELD_FIELD_H
#define LUMI_PROTO_LIGHTFIELD_FIELD_H

#include "proto/base/geometry.h"
#include "proto/base/result.h"
#include "proto/lightfield/disk.h"
#include "proto/lightfield/grid.h"
#include "proto/lightfield/mesh.h"
#include "proto/lightfield/tile_window.h"

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum lumi_surface { LUMI_SURFACE_SPHERE = 0, LUMI_SURFACE_PLANE = 1 }; /* what the centres of projection lie on */
enum lumi_field_level { LUMI_LEVEL_COARSE = 0, LUMI_LEVEL_FINE = 1, LUMI_LEVELS = 2 };

struct lumi_field_view {
    char name[64]; /* of the source frame, for people */
    int grid;      /* index of its lens, lumi_field_grid */
    struct lumi_pose pose;
    struct lumi_disk disk;
    int reference; /* index of the view (same level) it is predicted from; its own index for a reference image */
};

struct lumi_field_info {
    unsigned version;
    enum lumi_surface surface;
    struct lumi_vec3 centre; /* of the sphere fitted to the centres of projection; their centroid for a plane */
    double radius;           /* of that sphere; for a plane that of the smallest circle about `centre` holding all */
    enum lumi_disk_shape disk_shape;
    enum lumi_disk_kernel kernel;
    int view_count[LUMI_LEVELS];
    int quality; /* what --quality was */
    uint64_t file_bytes;
    uint64_t image_bytes[LUMI_LEVELS];     /* tiles, references, priming and image headers: everything coded */
    uint64_t reference_bytes[LUMI_LEVELS]; /* of these, the reference images */
    uint64_t side_bytes[LUMI_LEVELS];      /* of these, image headers and tile checksums */
    uint64_t geometry_bytes[LUMI_LEVELS];
    uint64_t index_bytes;         /* header, tables, poses, disks, lenses */
    uint64_t pixels[LUMI_LEVELS]; /* coded image pixels */
    uint64_t coded_tiles[LUMI_LEVELS];
    int cluster_count[LUMI_LEVELS]; /* reference images */
    int quantizer[LUMI_LEVELS];     /* of tiles: VP9's base_q_idx, 0..255 */
};

struct lumi_field; /* immutable once open: any number of threads may read it */

/* Maps and checks a file; decodes the reference images of both levels into memory (threads: as lumi_parallel_for).
 * Damage to a reference image or to the images of a cluster shows when its tiles are decoded; any other damage is
 * LUMI_ERR_CHECKSUM here. Every error names `path`. LUMI_ERR_VERSION for a newer file. */
int lumi_field_open(const char *path, int threads, struct lumi_field **field, struct lumi_error *error);
/* The same from memory, which stays the caller's and must outlive the field; `name` stands for the path. */
int lumi_field_open_memory(const void *data, size_t size, const char *name, int threads, struct lumi_field **field,
                           struct lumi_error *error);
void lumi_field_close(struct lumi_field *field);

const struct lumi_field_info *lumi_field_info(const struct lumi_field *field);
const struct lumi_field_view *lumi_field_view(const struct lumi_field *field, int level, int view);
const struct lumi_grid *lumi_field_grid(const struct lumi_field *field, int grid);
/* The meshes of a view, decoded when the file was opened; owned by the field. */
const struct lumi_view_mesh *lumi_field_mesh(const struct lumi_field *field, int level, int view);

/* One decoder a thread: about 200 KB each (libvpx contexts and windows). */
struct lumi_tile_decoder;
int lumi_tile_decoder_create(const struct lumi_field *field, struct lumi_tile_decoder **decoder,
                             struct lumi_error *error);
void lumi_tile_decoder_destroy(struct lumi_tile_decoder *decoder);

/* Decodes tile (column, row) of a view on its own, in any order. LUMI_ERR_CHECKSUM for a damaged one; the decoder stays
 * usable. Tiles of reference images are copied from memory. */
int lumi_field_decode_tile(struct lumi_tile_decoder *decoder, int level, int view, int column, int row,
                           struct lumi_tile_pixels *pixels, struct lumi_error *error);

#ifdef __cplusplus
}
#endif
#endif
