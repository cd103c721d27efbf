/* The stages of the pipeline over the images of a capture: what a stage is, where it finds its input and leaves its
 * output, what is skipped because it is there already.
 *
 * Invariants.
 * 1. A stage makes one file an image (some make one for all), written under a temporary name and renamed.
 * 2. Beside each output lies its key: SHA-256 over the stage's name, version and parameters and the keys of all inputs.
 *    An output whose key is as expected is not made again. The key is written after the output.
 * 3. What a stage writes depends on its inputs and parameters alone, not on threads, order, or time. */
#ifndef LUMI_PIPELINE_RUN_RUN_H
#define LUMI_PIPELINE_RUN_RUN_H

#include "proto/base/lens.h"
#include "proto/base/result.h"
#include "proto/lightfield/disk.h"
#include "proto/lightfield/field.h"
#include "proto/lightfield/grid.h"

#include <stdbool.h>
#include <stddef.h>

/* How source images become views. */
enum lumi_projection { LUMI_PROJECTION_AUTO = 0, LUMI_PROJECTION_EQUIANGULAR = 1, LUMI_PROJECTION_RECTILINEAR = 2 };

/* Parameters of all stages; lumi_run_defaults fills them. A stage's key covers only those it names. */
struct lumi_parameters {
    /* equiangular */
    enum lumi_projection projection; /* auto: rectilinear pinholes under 75° keep their pixels, others equiangular */
    double fov_x, fov_y;             /* radians, 0: from the source */
    double pixels_per_degree;        /* 0: from the source */
    /* depth */
    double near_m, far_m; /* nearest and farthest surface; 0: found from the images */
    int depth_neighbours; /* views matched against, 0: the stage's choice */
    /* geometry */
    double geometry_precision; /* gp: 2·gp triangles a tile on average */
    double disk_scale;         /* widens every disk */
    enum lumi_disk_shape disk_shape;
    enum lumi_disk_kernel kernel;
    /* compress */
    int quality;            /* 0..100, higher is better */
    long long target_bytes; /* 0: none; else the quality is searched for */
    int cluster_size;       /* images a reference */
};

/* One source image of the capture: a frame with its pose. In the order of the capture's positions. */
struct lumi_source {
    char name[64];   /* unique, safe as a file name, no extension */
    char *path;      /* absolute path of the frame's file */
    char sha256[65]; /* of that file */
    struct lumi_lens lens;
    struct lumi_pose pose;
    int row, column; /* place in the sweep, −1 where there is none */
};

struct lumi_run {
    char *capture, *work; /* directories; work lies beside the capture */
    struct lumi_source *sources;
    int count;
    struct lumi_grid grid;     /* the lens of every view, chosen by the equiangular stage's plan */
    enum lumi_surface surface; /* of the centres of projection */
    struct lumi_vec3 centre;
    double radius;
    struct lumi_parameters parameters;
    int threads; /* as lumi_parallel_for */
    /* Told after each image, by one thread at a time; may be NULL. */
    void (*progress)(const char *title, long done, long total);
    struct lumi_run_private *priv;
};

void lumi_run_defaults(struct lumi_parameters *parameters);

/* Reads the capture (every frame that has a pose, in the order of the positions), finds the surface its centres lie on,
 * makes the work directory. `work` NULL: "<capture>.work". `alone`: nobody else works in it (LUMI_ERR_BUSY if somebody
 * does), so what a killed run left half-written is removed; otherwise several runs may share it, each with its own
 * range. The grid is chosen by the caller. */
int lumi_run_open(const char *capture, const char *work, const struct lumi_parameters *parameters, int threads,
                  bool alone, struct lumi_run **run, struct lumi_error *error);
void lumi_run_close(struct lumi_run *run);

/* "<work>/<stage>/<name><extension>"; free with g_free. index < 0: "<work>/<stage>/all<extension>". */
char *lumi_run_path(const struct lumi_run *run, const char *stage, int index, const char *extension);

/* Hashing of keys. */
struct lumi_key;
void lumi_key_bytes(struct lumi_key *key, const void *data, size_t size);
void lumi_key_int(struct lumi_key *key, long long value);
void lumi_key_double(struct lumi_key *key, double value);
/* The key of another stage's output for image `index` (−1: of its output for all). Where that is not there, the stage
 * that asks fails with a line that says which to run first. */
void lumi_key_input(struct lumi_key *key, const struct lumi_run *run, const char *stage, int index);

/* One stage. The entries are called with indices in [0, run->count). */
struct lumi_stage {
    const char *name;
    const char *title;     /* for progress: "depth" */
    int version;           /* raise it when the same inputs give other bytes */
    const char *extension; /* of its output files, ".exr" */
    bool whole;            /* one output for all images (view is called once, with index −1) */
    /* What image `index`'s output depends on, beyond name and version. */
    int (*key)(struct lumi_run *run, int index, struct lumi_key *key, struct lumi_error *error);
    /* Called once before a range with something to do, and after it; may be NULL. */
    int (*begin)(struct lumi_run *run, void **state, struct lumi_error *error);
    void (*end)(struct lumi_run *run, void *state);
    /* Makes the output of image `index` at `path` (a temporary name; the caller renames). Called from several threads
     * at once for different images, unless `serial` (then the stage uses run->threads itself). */
    int (*make)(struct lumi_run *run, void *state, int index, int thread, const char *path, struct lumi_error *error);
    bool serial;
};

/* Runs one stage for images [first, last). Outputs that are there already are skipped; their number goes to *skipped
 * (may be NULL). */
int lumi_run_stage(struct lumi_run *run, const struct lumi_stage *stage, int first, int last, int *skipped,
                   struct lumi_error *error);

#endif
