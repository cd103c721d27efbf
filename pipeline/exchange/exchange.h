/* Other people's formats: what they say about pictures, cameras and poses, as one list; from there into a capture, and
 * back. docs/import-export.md has the conventions and what each format's fields become.
 *
 * Poses in the list are ours: camera to world, x right, y down, z forward. Pixel centres are at half-integers in all of
 * the formats and here, so principal points pass unchanged. */
#ifndef LUMI_PIPELINE_EXCHANGE_EXCHANGE_H
#define LUMI_PIPELINE_EXCHANGE_EXCHANGE_H

#include "proto/base/geometry.h"
#include "proto/base/lens.h"
#include "proto/base/result.h"

#include <glib.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define LUMI_EXCHANGE_PARAMETERS 16
#define LUMI_EXCHANGE_MAX_IMAGES 1000000

/* A camera as the source describes it. Model and parameters are COLMAP's (nerfstudio's fields fit them); width and
 * height are 0 where the source leaves them to the image. */
struct lumi_exchange_camera {
    char model[32];
    int parameter_count;
    double parameters[LUMI_EXCHANGE_PARAMETERS];
    int width, height;
    double angle_x; /* with parameter_count 0: the horizontal field of view that stands for them, radians */
};

/* What the numbers in `source` are, if the source's own are kept because the pose does not give them back exactly. */
enum lumi_exchange_numbers {
    LUMI_EXCHANGE_NONE = 0,
    LUMI_EXCHANGE_MATRIX = 12,   /* transforms.json: the first three rows */
    LUMI_EXCHANGE_QUATERNION = 7 /* COLMAP: qw qx qy qz tx ty tz */
};

struct lumi_exchange_image {
    char *original; /* as the source names it; owned */
    char *name;     /* unique, safe as a file name; NULL until lumi_exchange_name; owned */
    char *path;     /* where the file lies; NULL until it was looked for; owned */
    int camera;     /* index */
    int row, column;
    struct lumi_pose pose;
    bool in_metres; /* whatever --unit says: the source's reader has applied it */
    enum lumi_exchange_numbers numbers;
    double source[12];
};

struct lumi_exchange {
    GArray *cameras; /* struct lumi_exchange_camera */
    GArray *images;  /* struct lumi_exchange_image, in the source's order */
};

void lumi_exchange_init(struct lumi_exchange *exchange);
void lumi_exchange_finish(struct lumi_exchange *exchange);
static inline struct lumi_exchange_camera *lumi_exchange_camera(const struct lumi_exchange *exchange, int index)
{
    return &g_array_index(exchange->cameras, struct lumi_exchange_camera, index);
}
static inline struct lumi_exchange_image *lumi_exchange_image(const struct lumi_exchange *exchange, int index)
{
    return &g_array_index(exchange->images, struct lumi_exchange_image, index);
}
/* The index of a camera like this one, which is added if there is none. */
int lumi_exchange_add_camera(struct lumi_exchange *exchange, const struct lumi_exchange_camera *camera);

/* COLMAP's models, by name or number (src/colmap/sensor/models.h). `supported` ones have a lens of ours. */
struct lumi_exchange_model {
    int id;
    const char *name;
    int parameter_count;
    bool supported;
};
const struct lumi_exchange_model *lumi_exchange_model_by_name(const char *name);
const struct lumi_exchange_model *lumi_exchange_model_by_id(int id);
/* The lens of a camera whose size is known. LUMI_ERR_UNSUPPORTED, LUMI_ERR_FORMAT; `what` begins the text. */
int lumi_exchange_lens(const struct lumi_exchange_camera *camera, const char *what, struct lumi_lens *lens,
                       struct lumi_error *error);
/* The plainest model that describes a lens exactly. False for lenses that no model of COLMAP describes. */
bool lumi_exchange_describe_lens(const struct lumi_lens *lens, struct lumi_exchange_camera *camera);

/* Poses from and to a source's numbers. Checks: LUMI_ERR_FORMAT for NaN, singular ones, and such that are no rotation.
 * A matrix of nerfstudio: three rows of four; a quaternion with translation: world to camera. */
int lumi_exchange_pose_from(enum lumi_exchange_numbers numbers, const double *source, const char *what,
                            struct lumi_pose *pose, struct lumi_error *error);
void lumi_exchange_pose_to(enum lumi_exchange_numbers numbers, const struct lumi_pose *pose, double *source);

/* nerfstudio's transforms.json (also instant-ngp's and Blender's dialects). `name` stands for the file in errors. */
int lumi_exchange_parse_transforms(const char *text, size_t size, const char *name, struct lumi_exchange *exchange,
                                   struct lumi_error *error);
/* Written with 17 digits: reading gives the same numbers. Release *text with g_free. */
int lumi_exchange_format_transforms(const struct lumi_exchange *exchange, char **text, struct lumi_error *error);

/* COLMAP: first the cameras, then the images. `table` remembers COLMAP's camera numbers from one to the other:
 * g_hash_table_new(NULL, NULL), number → index + 1. */
int lumi_exchange_parse_colmap_cameras(const void *data, size_t size, bool binary, const char *name, GHashTable *table,
                                       struct lumi_exchange *exchange, struct lumi_error *error);
int lumi_exchange_parse_colmap_images(const void *data, size_t size, bool binary, const char *name, GHashTable *table,
                                      struct lumi_exchange *exchange, struct lumi_error *error);
void lumi_exchange_format_colmap_cameras(const struct lumi_exchange *exchange, bool binary, GByteArray *out);
void lumi_exchange_format_colmap_images(const struct lumi_exchange *exchange, bool binary, GByteArray *out);

/* One file name of the Stanford Light Field Archive's kind, PREFIX_ROW_COLUMN_Y_X.png (also with '_' before the dot).
 * False if it is none. */
struct lumi_exchange_stanford {
    int row, column;
    double y, x;
};
bool lumi_exchange_parse_stanford(const char *file, struct lumi_exchange_stanford *place);

/* ---- Importing ---- */

struct lumi_import_options {
    const char *images;          /* folder that the pictures' names are relative to; NULL: the source's own */
    int every_row, every_column; /* grid stride; with every_column 0, every_row counts through the frames; 0: all */
    int limit;                   /* 0: all */
    double unit;                 /* metres a unit of the source; 0: 1, for Stanford names 0.001 */
    double focal, fov;           /* Stanford names: pixels, or radians across */
    double plane;                /* Stanford names: metres to the plane the pictures are aligned on; 0: infinity */
    bool flip_x, flip_y;         /* Stanford names: positions count to the left, upwards */
    bool trust;                  /* do not decode the pictures to see whether they are whole */
    bool poses_only;             /* the pictures need not be there (unless only they tell their size) */
    int threads;                 /* as lumi_parallel_for */
    const char *date;            /* YYYY-MM-DD, for the bag; may be NULL */
    void (*progress)(const char *what, long done, long total); /* may be NULL */
};
void lumi_import_options_init(struct lumi_import_options *options);

/* Reads a source (transforms.json, a COLMAP model's folder, a folder of Stanford names; told by what is there) into a
 * list with the files looked up, named, chosen by --every and --limit, and checked. */
int lumi_import_list(const char *source, const struct lumi_import_options *options, struct lumi_exchange *exchange,
                     struct lumi_error *error);
/* The same, and a capture at `path` made of it. Nothing is left behind on failure. */
int lumi_import(const char *source, const char *path, const struct lumi_import_options *options,
                struct lumi_error *error);

/* ---- Exporting ---- */

/* A capture's frames with poses. With `original_names` the pictures have the names their source gave them; otherwise
 * paths of the capture's own files relative to `folder`. */
int lumi_export_list(const char *capture, const char *folder, bool original_names, struct lumi_exchange *exchange,
                     struct lumi_error *error);
int lumi_export_transforms(const char *capture, const char *path, bool original_names, struct lumi_error *error);
/* cameras, images and an empty points3D in `folder`, which is made if it is not there. */
int lumi_export_colmap(const char *capture, const char *folder, bool text, bool original_names,
                       struct lumi_error *error);

#endif
