/* What every renderer draws from: images, geometry, disks, poses. Filled from a field or from memory. */
#ifndef LUMI_RENDER_VIEWSET_VIEWSET_H
#define LUMI_RENDER_VIEWSET_VIEWSET_H

#include "proto/base/raster.h"
#include "proto/lightfield/field.h"

#ifdef __cplusplus
extern "C" {
#endif

struct lumi_view {
    const struct lumi_grid *grid;
    struct lumi_pose pose;
    struct lumi_disk disk;
    const struct lumi_view_mesh *mesh;       /* NULL where there is only dense depth */
    const struct lumi_raster *inverse_depth; /* 1 channel F32, 1/m, grid-sized; NULL where there are only meshes */
};

struct lumi_viewset; /* any number of threads may acquire and release */

/* From memory: views and their images (3 channels U8 or F32, grid-sized), copied shallowly: pixels, grids, meshes and
 * depths stay the caller's and must outlive the set. */
int lumi_viewset_create(int count, const struct lumi_view *views, const struct lumi_raster *images,
                        enum lumi_disk_shape shape, enum lumi_disk_kernel kernel, struct lumi_viewset **set,
                        struct lumi_error *error);
/* From one level of an open field (which must outlive the set); decoded images are kept in `cache_bytes` of memory
 * (least recently used go first). A damaged tile shows as the coarse level's picture of it, or grey with no coverage
 * where that is damaged too; lumi_viewset_damaged counts them. */
int lumi_viewset_from_field(const struct lumi_field *field, int level, size_t cache_bytes, struct lumi_viewset **set,
                            struct lumi_error *error);
/* The fine level of the file at `path`, which the set keeps open, with 256 MiB for decoded images. */
int lumi_viewset_open(const char *path, struct lumi_viewset **set, struct lumi_error *error);
void lumi_viewset_destroy(struct lumi_viewset *set);

int lumi_viewset_count(const struct lumi_viewset *set);
const struct lumi_view *lumi_viewset_view(const struct lumi_viewset *set, int view);
/* A place to look from: the centre of the views (a field's: as its file says; else their mean), turned as the first. */
struct lumi_pose lumi_viewset_middle(const struct lumi_viewset *set);
enum lumi_disk_shape lumi_viewset_shape(const struct lumi_viewset *set);
enum lumi_disk_kernel lumi_viewset_kernel(const struct lumi_viewset *set);
int lumi_viewset_damaged(struct lumi_viewset *set);

/* The pixels of a view, RGB (U8 sRGB or F32 linear); valid until released. Decodes on first use. `missing` (may be
 * NULL) gets a byte a tile, row by row, not 0 where nothing is known of the tile, or NULL where all is there. */
int lumi_viewset_acquire(struct lumi_viewset *set, int view, struct lumi_raster *pixels, const uint8_t **missing,
                         struct lumi_error *error);
void lumi_viewset_release(struct lumi_viewset *set, int view);

#ifdef __cplusplus
}
#endif
#endif
