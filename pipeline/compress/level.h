/* Coding the images of one level of a field, with its pieces kept in files. */
#ifndef LUMI_PIPELINE_COMPRESS_LEVEL_H
#define LUMI_PIPELINE_COMPRESS_LEVEL_H

#include "pipeline/compress/cluster.h"
#include "pipeline/equiangular/warp.h"
#include "pipeline/run/run.h"
#include "proto/lightfield/training.h"

/* What a quality means. Reference images are coded finer than tiles: every tile profits from them. */
struct compress_quality {
    int tile_quantizer, reference_quantizer; /* 0..63 */
    int speed;                               /* libvpx's cpu-used */
    int range;                               /* of the shift search, pixels */
    int own_weight;                          /* of reference images when they are filtered; 0: they are not */
};

void compress_quality_init(struct compress_quality *quality, int value);

struct compress_level {
    struct lumi_run *run;
    int index; /* LUMI_LEVEL_COARSE or LUMI_LEVEL_FINE */
    struct compress_quality quality;
    int count;
    int *sources; /* the source of each view */
    struct lumi_pose *poses;
    struct lumi_grid grid;
    struct lumi_warp *half; /* from the run's grid to the coarse one; NULL for the fine level */
    struct lumi_clusters clusters;
    bool sample;                 /* `clusters` are some only, with some of their views; their pieces are kept apart */
    struct lumi_yuv *references; /* as decoded, a cluster each */
    struct lumi_training_tile *training;
    int training_count;
    struct lumi_tile_encoder *encoder; /* the first one; its priming is the level's */
    long total, done;                  /* for progress */
};

/* Chooses views and clusters; codes nothing yet. Finish it also after a failure. */
int compress_level_init(struct compress_level *level, struct lumi_run *run, int index, int quality,
                        struct lumi_error *error);
void compress_level_finish(struct compress_level *level);

/* Codes what is not there yet: reference images, then clusters. */
int compress_level_code(struct compress_level *level, struct lumi_error *error);

/* The bytes of what compress_level_code has made. */
int compress_level_bytes(const struct compress_level *level, double *references, double *clusters,
                         struct lumi_error *error);

/* The pieces, as struct lumi_field_content asks for them. */
int compress_level_references(const struct compress_level *level, int run_index, uint32_t *sizes,
                              struct lumi_writer *bytes, struct lumi_error *error);
int compress_level_cluster(const struct compress_level *level, int cluster, struct lumi_writer *bytes,
                           struct lumi_error *error);

/* A view's picture, and where to look for its tiles in another view's picture (a tile each; NULL if there is no depth).
 * *seeds is released with lumi_free. */
int compress_view_image(const struct compress_level *level, int view, struct lumi_yuv *image, struct lumi_error *error);
int compress_view_seeds(const struct compress_level *level, int view, int reference, struct lumi_shift **seeds,
                        struct lumi_error *error);

#endif
