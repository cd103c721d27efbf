/* The stages of the pipeline over the images of a capture: what a stage is, where it finds its input and leaves its
 * output, what is skipped because it is there already.
 *
 * Invariants.
 * 1. A stage makes one file an image (some make one for all), written under a temporary name and renamed.
 * 2. Beside each output lies its key: SHA-256 over the stage's name, version and parameters and the keys of all inputs.
 *    An output whose key is as expected is not made again. The key is written after the output.
 * 3. What a stage writes depends on its inputs and parameters alone, not on threads, order, or time.
 * 4. A run has two phases. First it holds the capture's frames as they were taken; calibration and the choice of views
 *    end that with a list of places (places.h). lumi_run_place takes it up: from then on the run holds the views, real
 *    ones first, synthetic ones after them. Indices mean other things then; names stay. */
#ifndef LUMI_PIPELINE_RUN_RUN_H
#define LUMI_PIPELINE_RUN_RUN_H

#include "proto/base/lens.h"
#include "proto/base/raster.h"
#include "proto/base/result.h"
#include "proto/capture/capture.h"
#include "proto/lightfield/disk.h"
#include "proto/lightfield/field.h"
#include "proto/lightfield/grid.h"
#include "proto/mechanism/rig.h"

#include <stdbool.h>
#include <stddef.h>

struct lumi_places;

/* How source images become views. */
enum lumi_projection { LUMI_PROJECTION_AUTO = 0, LUMI_PROJECTION_EQUIANGULAR = 1, LUMI_PROJECTION_RECTILINEAR = 2 };

/* Whether something is done: auto leaves it to what the capture is. */
enum lumi_choice { LUMI_CHOICE_AUTO = 0, LUMI_CHOICE_NO = 1, LUMI_CHOICE_YES = 2 };

/* How more light than a display shows is brought down to it: auto for captures with brackets only. */
enum lumi_tone { LUMI_TONE_AUTO = 0, LUMI_TONE_NONE = 1, LUMI_TONE_REINHARD = 2, LUMI_TONE_HABLE = 3 };

/* Parameters of all stages; lumi_run_defaults fills them. A stage's key covers only those it names. */
struct lumi_parameters {
    /* which stages there are */
    enum lumi_choice calibrate;  /* auto: all poses are the rig's own idea of where it was */
    enum lumi_choice equalize;   /* auto: where it is calibrated */
    enum lumi_choice synthesize; /* auto: a rig that turns took it */
    enum lumi_choice subsample;  /* auto: as synthesize */
    bool backwards;              /* the rig turned the other way than the capture says */
    const char *exchange;        /* cameras that are in each other's place, "c02:c03,…"; NULL: none; the caller's */
    bool rolling_shutter;        /* the cameras read their rows one after the other while the rig turns */
    int prefilter;               /* samples a pixel, 0: none; −1: auto, as synthesize, the stage's own number */
    /* subsample, synthesize */
    double density; /* views an area that are kept, as a share of the equator's */
    double stand_m; /* how far the stand's feet are from the axis; 0: none; −1: found */
    /* merge; NULL: an sRGB response */
    const char *masks;    /* folder of masks drawn by hand, CAMERA.png or NAME.png; NULL: none; the caller's */
    const char *response; /* "srgb", "linear", "estimate" or a file; the caller's */
    /* color; NULL, all zero: nothing is changed */
    const char *icc, *lut; /* files, the caller's */
    double color_matrix[9];
    double exposure;         /* stops */
    double white_balance[3]; /* factors */
    enum lumi_tone tone;
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

/* One shot of a bracket. */
struct lumi_source_part {
    char *path, sha256[65]; /* path is owned */
    double exposure_s, iso; /* as the camera reported them, 0: it did not */
    double exposure_offset; /* stops, as asked for */
};

/* One image: a frame of the capture (or the frames of a bracket) with its pose, in the order of the capture's
 * positions; once the run is placed also a view that nobody took. */
struct lumi_source {
    char name[64];   /* unique, safe as a file name, no extension; of a bracket: its middle shot's */
    char *path;      /* absolute path of the frame's file; NULL: synthetic */
    char sha256[65]; /* of that file */
    struct lumi_lens lens;
    struct lumi_pose pose;
    int row, column; /* place in the sweep, −1 where there is none */
    /* As the capture has it; all zero where it is synthetic. */
    int camera;    /* number in the capture, −1: synthetic */
    int lens_slot; /* equal for frames of one lens of the capture, from 0 */
    char camera_name[64];
    int position, turn;
    double turn_angle, drop;
    double exposure_s, iso, exposure_offset; /* as in struct lumi_source_part */
    enum lumi_pose_source pose_source;
    struct lumi_pose prior; /* the capture's pose, whatever calibration says */
    double white[3];        /* white balance of its raw files, the capture's; green 0: their own */
    int part_count;         /* of a bracket, darkest first as asked for, 1 where the rest of it is not there; 0: the
                               capture has no brackets */
    struct lumi_source_part *parts; /* owned */
    /* Once the run is placed; until then kept is true, the others false. */
    bool synthetic, masked, kept; /* as in struct lumi_place */
};

/* A picture that was planned and never came, or cannot be used, with nothing in its place. */
struct lumi_missing {
    char name[64], camera_name[64];
    char why[160]; /* as the capture tells; "" */
    int camera, position, turn;
    double exposure_offset;
    bool part; /* other shots of its bracket are there */
};

/* What is done, once parameters and capture are known. */
struct lumi_wants {
    bool calibrate, equalize, synthesize, subsample, prefilter, color;
};

struct lumi_stage;
struct lumi_run {
    char *capture, *work; /* directories; work lies beside the capture */
    struct lumi_rig *rig; /* the capture's profile; NULL: none */
    struct lumi_source *sources;
    int count;
    struct lumi_missing *missing; /* in the capture's order */
    int missing_count;
    int dense; /* the first so many are photographs */
    int *kept; /* indices of those that become views of the field, ascending */
    int kept_count;
    bool placed;
    struct lumi_wants wants;
    struct lumi_grid grid;     /* the lens of every view, chosen by the equiangular stage's plan */
    enum lumi_surface surface; /* of the centres of projection */
    struct lumi_vec3 centre;
    double radius;
    struct lumi_parameters parameters;
    int threads; /* as lumi_parallel_for */
    /* Asked before a stage with `images` outputs to make: how many at once. NULL: run->threads. */
    int (*parallel)(struct lumi_run *run, const struct lumi_stage *stage, int images);
    /* Told after each image, by one thread at a time; may be NULL. */
    void (*progress)(const char *title, long done, long total);
    struct lumi_run_private *priv;
};

void lumi_run_defaults(struct lumi_parameters *parameters);

/* Reads the capture (every frame that has a pose, in the order of the positions), finds the surface its centres lie on,
 * makes the work directory. `work` NULL: "<capture>.work". The grid is chosen by the caller. */
enum lumi_run_use {
    LUMI_RUN_SHARED = 0, /* several runs share the work directory, each with its own range */
    LUMI_RUN_ALONE = 1,  /* nobody else works in it (LUMI_ERR_BUSY if somebody does): what a killed run left goes */
    LUMI_RUN_LOOK = 2    /* nothing is made and nobody kept out; the directory need not be there */
};
int lumi_run_open(const char *capture, const char *work, const struct lumi_parameters *parameters, int threads,
                  enum lumi_run_use use, struct lumi_run **run, struct lumi_error *error);
void lumi_run_close(struct lumi_run *run);

/* What the stages that want places start from: the run's own frames, all used and kept; or what calibration made of
 * them where it is wanted. Release with lumi_places_finish. LUMI_ERR_NOTFOUND: the stage has not been run. */
int lumi_run_frames_places(const struct lumi_run *run, struct lumi_places *places, struct lumi_error *error);
int lumi_run_calibrated_places(const struct lumi_run *run, struct lumi_places *places, struct lumi_error *error);
/* Ends the first phase with what calibration and the choice of views left in the work directory, as far as they are
 * wanted; nothing happens where the run is placed already. LUMI_ERR_NOTFOUND: one of them has not been run. */
int lumi_run_place(struct lumi_run *run, struct lumi_error *error);

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

/* A lens, a pose, the views' pixels. */
void lumi_key_lens(struct lumi_key *key, const struct lumi_lens *lens);
void lumi_key_pose(struct lumi_key *key, const struct lumi_pose *pose);
void lumi_key_grid(struct lumi_key *key, const struct lumi_grid *grid);

/* The picture of a frame: the file, or what the stage `merge` made of a bracket; free with g_free. And what stands for
 * it in a key. */
char *lumi_run_image(const struct lumi_run *run, int index);
/* Reads one of a source's files as RGB, raw ones with the capture's white balance; in keys beside the file's checksum.
 */
int lumi_source_read(const struct lumi_source *source, const char *path, struct lumi_raster *raster,
                     struct lumi_error *error);
void lumi_key_white(struct lumi_key *key, const struct lumi_source *source);
void lumi_key_image(struct lumi_key *key, const struct lumi_run *run, int index);

/* A view, as it stands after some stages: picture (linear light), inverse depth (channel "W"), picture after the
 * prefilter, picture in its final colours. What was not wanted is passed over. Free with g_free. */
enum lumi_view_part { LUMI_VIEW_PICTURE, LUMI_VIEW_DEPTH, LUMI_VIEW_FILTERED, LUMI_VIEW_FINAL };
char *lumi_run_view(const struct lumi_run *run, int index, enum lumi_view_part part);
void lumi_key_view(struct lumi_key *key, const struct lumi_run *run, int index, enum lumi_view_part part);
/* What was read from `path` is a view's, pixel for pixel. */
int lumi_run_check_view(const struct lumi_run *run, const struct lumi_raster *raster, const char *path,
                        struct lumi_error *error);

/* Which images a stage works on. All but the first want a placed run. */
enum lumi_stage_set {
    LUMI_SET_FRAMES, /* all, before the run is placed */
    LUMI_SET_DENSE,  /* all photographs */
    LUMI_SET_FILLED, /* synthetic or masked */
    LUMI_SET_KEPT    /* what goes into the field */
};

/* One stage. The entries are called with indices in [0, run->count). */
struct lumi_stage {
    const char *name;
    const char *title;     /* for progress: "depth" */
    int version;           /* raise it when the same inputs give other bytes */
    const char *extension; /* of its output files, ".exr" */
    bool whole;            /* one output for all images (make is called once, with index −1) */
    enum lumi_stage_set set;
    /* Whether it has anything to do at all (index −1), and for an image of its set; NULL: always. */
    bool (*wanted)(const struct lumi_run *run, int index);
    /* What image `index`'s output depends on, beyond name and version. */
    int (*key)(struct lumi_run *run, int index, struct lumi_key *key, struct lumi_error *error);
    /* Called once before a range with something to do, and after it; may be NULL. */
    int (*begin)(struct lumi_run *run, void **state, struct lumi_error *error);
    void (*end)(struct lumi_run *run, void *state);
    /* Makes the output of image `index` at `path` (a temporary name; the caller renames). Called from several threads
     * at once for different images, unless `serial` (then the stage uses run->threads itself). */
    int (*make)(struct lumi_run *run, void *state, int index, int thread, const char *path, struct lumi_error *error);
    bool serial;
    /* What one image in work holds at most, bytes a pixel of the larger of its source and its view (measured:
     * tests/bench/process.sh); an engine makes no more images at once than there is memory for. 0: next to nothing. */
    double bytes_per_pixel;
};

/* How many outputs a stage has with these parameters; 0 where it is not wanted. */
int lumi_stage_count(const struct lumi_run *run, const struct lumi_stage *stage);

/* Which of them are there, made from what they would be made from now: done[0 .. count). Nothing is made; what cannot
 * be told (an input is missing) is not done. Returns how many are. */
int lumi_stage_done(struct lumi_run *run, const struct lumi_stage *stage, bool *done);

/* Runs one stage for images [first, last), counted within those it works on; last −1: to the end. Outputs that are
 * there already are skipped; their number goes to *skipped (may be NULL). Nothing happens where it is not wanted. */
int lumi_run_stage(struct lumi_run *run, const struct lumi_stage *stage, int first, int last, int *skipped,
                   struct lumi_error *error);

#endif
