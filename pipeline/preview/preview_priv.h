/* What the files of this folder share. */
#ifndef LUMI_PIPELINE_PREVIEW_PREVIEW_PRIV_H
#define LUMI_PIPELINE_PREVIEW_PREVIEW_PRIV_H

#include "pipeline/depth/mvs.h"
#include "pipeline/preview/preview.h"
#include "proto/capture/capture.h"
#include "proto/lightfield/field.h"
#include "render/viewset/viewset.h"

#include <glib.h>

enum preview_state { PREVIEW_WAITING = 0, PREVIEW_LOADED = 1, PREVIEW_BAD = 2, PREVIEW_LEFT_OUT = 3 };

struct preview_frame {
    int64_t id;
    char name[LUMI_CAPTURE_NAME], file[LUMI_CAPTURE_PATH];
    struct lumi_pose pose;
    struct lumi_lens lens;
    enum preview_state state;
    bool seen;                /* in the look that is under way */
    double distance;          /* to the nearest view that is loaded (metres); INFINITY: there is none */
    struct lumi_raster image; /* U8, the grid's size */
    struct lumi_raster small; /* U8, half that */
    struct lumi_view_mesh mesh;
    double proxy;       /* inverse distance of the sphere that the mesh is; −1: a shape of its own */
    bool shaped, stale; /* stale: views came after it was matched */
    double nearness;    /* of what the shape shows: mean inverse distance from the centre, 1/m */
    int neighbour_count;
    int64_t neighbours[LUMI_MVS_NEIGHBOURS]; /* what it was matched against */
};

struct preview_warp {
    struct lumi_lens lens; /* at the size its pictures are read in */
    float *positions;      /* x, y in them of a view's pixels */
};

struct lumi_preview {
    char *path;
    struct lumi_preview_options options;
    struct lumi_capture_stamp stamp;
    GPtrArray *frames; /* struct preview_frame, as they came */
    GHashTable *by_id; /* of them */
    GArray *warps;     /* struct preview_warp */
    struct lumi_preview_status status;
    enum lumi_surface surface;
    struct lumi_vec3 centre;
    double radius;
    bool has_grid;
    int placed; /* frames whose poses surface, centre and radius are of */
    int most;   /* views that memory holds */
    struct lumi_grid grid, half;
    float *halving;  /* likewise, of the half's pixels in a view */
    double nearness; /* of the place, by the shapes there are; what has no shape lies there */
    /* What is drawn: the views that are loaded. NULL: to be made anew. */
    struct lumi_viewset *set;
};

static inline struct preview_frame *preview_frame(const struct lumi_preview *preview, int index)
{
    return g_ptr_array_index(preview->frames, (guint)index);
}

/* preview_load.c */
/* Which size views have, from the lenses there are. */
int preview_choose_grid(struct lumi_preview *preview, const struct lumi_lens *lenses, int count, int planned,
                        struct lumi_error *error);
int preview_load(struct lumi_preview *preview, struct preview_frame *frame, struct lumi_error *error);
void preview_unload(struct preview_frame *frame);
void preview_finish_warps(struct lumi_preview *preview);

/* preview_choice.c */
/* The frame that is to be loaded next, or NULL. May take another view out of memory for it. */
struct preview_frame *preview_choose_frame(struct lumi_preview *preview);
/* The distances of the others, after `frame` was loaded. */
void preview_note_loaded(struct lumi_preview *preview, const struct preview_frame *frame);
void preview_measure_distances(struct lumi_preview *preview);
/* The view that is to be matched next, or NULL; fills its neighbours. */
struct preview_frame *preview_choose_shape(struct lumi_preview *preview, struct preview_frame **neighbours,
                                           int *neighbour_count);

/* preview_shape.c */
int preview_shape(struct lumi_preview *preview, struct preview_frame *frame, struct preview_frame *const *neighbours,
                  int neighbour_count, struct lumi_error *error);
/* A mesh for every view that has no shape: the sphere at 1 / preview->nearness. */
int preview_place_proxies(struct lumi_preview *preview, struct lumi_error *error);
/* How near things are, by the shapes there are. */
void preview_measure_nearness(struct lumi_preview *preview);

/* preview_disks.c */
/* Disks of views of which there may be a few on one side only: towards where no view is they reach far. */
int preview_disks(int count, const struct lumi_pose *poses, enum lumi_surface surface, struct lumi_vec3 centre,
                  double radius, struct lumi_disk *disks, struct lumi_error *error);

#endif
