/* Writing a field. What is large is asked for piece by piece, in the order of the file, so that little is in memory at
 * once; some pieces are asked for more than once. */
#ifndef LUMI_PROTO_LIGHTFIELD_FIELD_WRITE_H
#define LUMI_PROTO_LIGHTFIELD_FIELD_WRITE_H

#include "proto/lightfield/field.h"
#include "proto/lightfield/reference_code.h"
#include "proto/lightfield/tile_core.h"

#ifdef __cplusplus
extern "C" {
#endif

struct lumi_field_level_content {
    int view_count;
    const struct lumi_field_view *views; /* `reference` is not read */
    int cluster_count;
    /* members[first[i] .. first[i + 1]): the views of cluster i, its reference image first. Every view once. */
    const int *first, *members;
    const struct lumi_priming *priming;
};

/* All memory stays the caller's. Views of one level have grids of one size. */
struct lumi_field_content {
    enum lumi_surface surface;
    struct lumi_vec3 centre;
    double radius;
    enum lumi_disk_shape disk_shape;
    enum lumi_disk_kernel kernel;
    int quality;
    int grid_count;
    const struct lumi_grid *grids;
    struct lumi_field_level_content levels[LUMI_LEVELS];
    void *context;
    /* Appends lumi_view_mesh_encode's bytes of a view; nothing for a view without geometry. */
    int (*mesh)(void *context, int level, int view, struct lumi_writer *bytes, struct lumi_error *error);
    /* Appends the frames of run `run`: of the reference images of clusters run · LUMI_REFERENCE_RUN and up, as
     * lumi_references_encode makes them, and fills sizes[] with theirs. */
    int (*references)(void *context, int level, int run, uint32_t *sizes, struct lumi_writer *bytes,
                      struct lumi_error *error);
    /* Appends the tiles of a cluster, image by image without the reference image, as lumi_cluster_encode_image makes
     * them. */
    int (*cluster)(void *context, int level, int cluster, struct lumi_writer *bytes, struct lumi_error *error);
};

/* Writes the file at `path`, under a temporary name in the same folder until it is whole and on the disk. */
int lumi_field_write(const char *path, const struct lumi_field_content *content, struct lumi_error *error);
/* Appends the same bytes to `writer`. */
int lumi_field_write_memory(const struct lumi_field_content *content, struct lumi_writer *writer,
                            struct lumi_error *error);

#ifdef __cplusplus
}
#endif
#endif
