/* The stages "match" and "depth": which files go in and out; the most recent views are kept in memory. */
#include "pipeline/depth/depth.h"
#include "pipeline/depth/mvs.h"
#include "pipeline/run/recent.h"
#include "proto/base/memory.h"
#include "proto/image/image.h"

#include <glib.h>
#include <string.h>

/* Enough for a view, its neighbours, and most of the next one's: two turns of sixteen cameras and the one between. */
enum { KEPT = 40 };

struct kept_view {
    struct lumi_raster image, depth; /* depth: of the stage "match"; all zero in that stage itself */
};

struct depth_state {
    struct lumi_pose *poses;
    bool with_depth;
    struct lumi_recent recent; /* which view stands where in `kept` */
    struct kept_view kept[KEPT];
};

static int neighbours_of(const struct lumi_run *run, const struct lumi_pose *poses, int index,
                         int neighbours[LUMI_MVS_NEIGHBOURS])
{
    return lumi_mvs_neighbours(run->dense, poses, index, run->parameters.depth_neighbours, neighbours);
}

static struct lumi_pose *all_poses(const struct lumi_run *run)
{
    struct lumi_pose *poses = g_new(struct lumi_pose, (gsize)run->count);

    for (int i = 0; i < run->count; i++)
        poses[i] = run->sources[i].pose;
    return poses;
}

/* The view and its neighbours: their poses and their files from `stages`. */
static void key_views(struct lumi_run *run, int index, const char *const *stages, struct lumi_key *key)
{
    g_autofree struct lumi_pose *poses = all_poses(run);
    int views[1 + LUMI_MVS_NEIGHBOURS] = {index};
    const int count = 1 + neighbours_of(run, poses, index, views + 1);

    lumi_key_int(key, count);
    for (int i = 0; i < count; i++) {
        lumi_key_pose(key, &poses[views[i]]);
        for (int s = 0; stages[s]; s++)
            lumi_key_input(key, run, stages[s], views[i]);
    }
    lumi_key_grid(key, &run->grid);
}

static int match_key(struct lumi_run *run, int index, struct lumi_key *key, struct lumi_error *error)
{
    static const char *const stages[] = {"equiangular", NULL};

    (void)error;
    lumi_key_double(key, run->parameters.near_m);
    lumi_key_double(key, run->parameters.far_m);
    key_views(run, index, stages, key);
    return LUMI_OK;
}

static int depth_key(struct lumi_run *run, int index, struct lumi_key *key, struct lumi_error *error)
{
    static const char *const stages[] = {"equiangular", "match", NULL};

    (void)error;
    key_views(run, index, stages, key);
    return LUMI_OK;
}

static int begin(struct lumi_run *run, bool with_depth, void **result)
{
    struct depth_state *state = g_new0(struct depth_state, 1);

    state->poses = all_poses(run);
    state->with_depth = with_depth;
    lumi_recent_init(&state->recent, KEPT);
    *result = state;
    return LUMI_OK;
}

static int match_begin(struct lumi_run *run, void **state, struct lumi_error *error)
{
    (void)error;
    return begin(run, false, state);
}

static int depth_begin(struct lumi_run *run, void **state, struct lumi_error *error)
{
    (void)error;
    return begin(run, true, state);
}

static void drop(struct kept_view *kept)
{
    lumi_raster_finish(&kept->image);
    lumi_raster_finish(&kept->depth);
    memset(kept, 0, sizeof(*kept));
}

static void end(struct lumi_run *run, void *data)
{
    struct depth_state *state = data;

    (void)run;
    for (int i = 0; i < KEPT; i++)
        drop(&state->kept[i]);
    g_free(state->poses);
    g_free(state);
}

static int read_view(struct lumi_run *run, int index, bool with_depth, struct kept_view *kept, struct lumi_error *error)
{
    g_autofree char *path = lumi_run_path(run, "equiangular", index, ".exr");
    g_autofree char *depth_path = lumi_run_path(run, "match", index, ".exr");
    struct lumi_raster linear;

    LUMI_TRY(lumi_image_read(path, 3, &linear, NULL, error));
    int code = lumi_run_check_view(run, &linear, path, error);
    if (code == LUMI_OK && lumi_raster_convert(&linear, LUMI_U8, &kept->image))
        code = lumi_fail(error, LUMI_ERR_NOMEM, "%s: out of memory", path);
    lumi_raster_finish(&linear);
    if (code == LUMI_OK && with_depth)
        code = lumi_image_read_channel(depth_path, "W", &kept->depth, error);
    if (code == LUMI_OK && with_depth)
        code = lumi_run_check_view(run, &kept->depth, depth_path, error);
    if (code != LUMI_OK)
        drop(kept);
    return code;
}

/* The view's pixels (the state's, valid for the KEPT − 1 calls that follow). */
static int view_of(struct lumi_run *run, struct depth_state *state, int index, struct lumi_mvs_view *view,
                   struct lumi_error *error)
{
    int slot;

    if (!lumi_recent_find(&state->recent, index, &slot)) {
        drop(&state->kept[slot]);
        LUMI_TRY(read_view(run, index, state->with_depth, &state->kept[slot], error));
        lumi_recent_take(&state->recent, slot, index);
    }
    const struct kept_view *kept = &state->kept[slot];

    *view = (struct lumi_mvs_view){&run->grid, state->poses[index], kept->image, kept->depth};
    return LUMI_OK;
}

static int write_depth(const char *path, struct lumi_raster *depth, struct lumi_error *error)
{
    struct lumi_image_options options;

    lumi_image_options_init(&options);
    options.format = LUMI_IMAGE_EXR;
    options.half = false;
    options.channel = "W";
    return lumi_image_write(path, depth, &options, error);
}

static int make(struct lumi_run *run, void *data, int index, int thread, const char *path, struct lumi_error *error)
{
    struct depth_state *state = data;
    struct lumi_mvs_view view, neighbours[LUMI_MVS_NEIGHBOURS];
    struct lumi_mvs_settings settings;
    struct lumi_raster depth = {0};
    int indices[LUMI_MVS_NEIGHBOURS];
    const int count = neighbours_of(run, state->poses, index, indices);
    int code;

    (void)thread;
    LUMI_TRY(view_of(run, state, index, &view, error));
    for (int i = 0; i < count; i++)
        LUMI_TRY(view_of(run, state, indices[i], &neighbours[i], error));
    lumi_mvs_defaults(&settings);
    settings.near_m = run->parameters.near_m;
    settings.far_m = run->parameters.far_m;
    if (state->with_depth)
        code = lumi_mvs_refine(&view, count, neighbours, run->threads, &depth, error);
    else
        code = lumi_mvs_match(&view, count, neighbours, &settings, run->threads, &depth, error);
    if (code != LUMI_OK)
        return lumi_fail_prefix(error, "%s", run->sources[index].name);
    code = write_depth(path, &depth, error);
    lumi_raster_finish(&depth);
    return code;
}

const struct lumi_stage lumi_stage_match = {
    .name = "match",
    .title = "matching",
    .version = 3,
    .extension = ".exr",
    .set = LUMI_SET_DENSE,
    .key = match_key,
    .begin = match_begin,
    .end = end,
    .make = make,
    .serial = true,
};

const struct lumi_stage lumi_stage_depth = {
    .name = "depth",
    .title = "depth",
    .version = 2,
    .extension = ".exr",
    .set = LUMI_SET_DENSE,
    .key = depth_key,
    .begin = depth_begin,
    .end = end,
    .make = make,
    .serial = true,
};
