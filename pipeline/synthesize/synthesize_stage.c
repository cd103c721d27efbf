/* The stage `synthesize`: which files go in and out; the most recent views are kept in memory. */
#include "pipeline/calibrate/rig_mask.h"
#include "pipeline/run/recent.h"
#include "pipeline/subsample/poles.h"
#include "pipeline/synthesize/stand_mask.h"
#include "pipeline/synthesize/synthesize.h"
#include "pipeline/synthesize/view_synthesis.h"
#include "proto/base/memory.h"
#include "proto/image/image.h"

#include <glib.h>
#include <string.h>

enum {
    KEPT = LUMI_SYNTHESIS_SOURCES + 8, /* views kept: one's sources, and what the next one has besides */
    PROBES = 8                         /* views that are asked about floor and stand */
};
/* Of those that look down, so many see something where only a stand can be, on so much of the picture. */
#define STAND_VIEWS 3
#define STAND_SHARE 0.002
#define FLOOR_REACH 2.0 /* metres about the axis in which the floor counts */
/* Sources that see past the stand are this share of the sphere's radius away. */
#define WIDE 0.6

struct kept_view {
    struct lumi_raster image, depth;
    uint8_t *blocked;
    long blocked_count;
};

struct synthesis {
    struct lumi_pose *poses; /* of the photographs */
    bool has_stand;
    struct lumi_stand stand;
    struct lumi_recent recent; /* which view stands where in `kept` */
    struct kept_view kept[KEPT];
};

static bool wanted(const struct lumi_run *run, int index)
{
    (void)index;
    return run->wants.synthesize;
}

static struct lumi_pose *photograph_poses(const struct lumi_run *run)
{
    struct lumi_pose *poses = g_new(struct lumi_pose, (gsize)run->dense + 1);

    for (int i = 0; i < run->dense; i++)
        poses[i] = run->sources[i].pose;
    return poses;
}

/* The photographs that look down most, one for each direction around; none where no stand is looked for. */
static int find_probes(const struct lumi_run *run, const struct lumi_pose *poses, int probes[PROBES])
{
    int count = 0;

    if (run->parameters.stand_m == 0 || run->surface != LUMI_SURFACE_SPHERE)
        return 0;
    for (int sector = 0; sector < PROBES; sector++) {
        int best = -1;
        for (int i = 0; i < run->dense; i++) {
            const struct lumi_vec3 out = lumi_sub(poses[i].t, run->centre);
            const int here = (int)floor((atan2(out.y, out.x) / (2 * LUMI_PI) + 1) * PROBES) % PROBES;
            if (here == sector && poses[i].r[8] < -0.5 && (best < 0 || poses[i].r[8] < poses[best].r[8]))
                best = i;
        }
        if (best >= 0)
            probes[count++] = best;
    }
    return count;
}

static int find_sources(const struct lumi_run *run, const struct lumi_pose *poses, int index,
                        int sources[LUMI_SYNTHESIS_SOURCES])
{
    const double far = run->parameters.stand_m != 0 ? WIDE * run->radius : 0;

    return lumi_synthesis_sources(run->dense, poses, &run->sources[index].pose, index, far, sources);
}

static int key_photograph(struct lumi_key *k, const struct lumi_run *run, int index, struct lumi_error *error)
{
    lumi_key_pose(k, &run->sources[index].pose);
    lumi_key_lens(k, &run->sources[index].lens);
    lumi_key_input(k, run, "equiangular", index);
    lumi_key_input(k, run, "depth", index);
    return lumi_rig_mask_key(k, run, index, error);
}

static int key(struct lumi_run *run, int index, struct lumi_key *k, struct lumi_error *error)
{
    g_autofree struct lumi_pose *poses = photograph_poses(run);
    int sources[LUMI_SYNTHESIS_SOURCES], probes[PROBES];
    const int probe_count = find_probes(run, poses, probes), count = find_sources(run, poses, index, sources);

    lumi_key_double(k, run->parameters.stand_m);
    lumi_key_double(k, run->radius);
    lumi_key_pose(k, &run->sources[index].pose);
    lumi_key_int(k, run->sources[index].synthetic);
    if (!run->sources[index].synthetic)
        LUMI_TRY(key_photograph(k, run, index, error));
    lumi_key_int(k, count);
    for (int i = 0; i < count; i++)
        LUMI_TRY(key_photograph(k, run, sources[i], error));
    lumi_key_int(k, probe_count);
    for (int i = 0; i < probe_count; i++)
        LUMI_TRY(key_photograph(k, run, probes[i], error));
    lumi_key_grid(k, &run->grid);
    return LUMI_OK;
}

static void drop(struct kept_view *kept)
{
    lumi_raster_finish(&kept->image);
    lumi_raster_finish(&kept->depth);
    lumi_free(kept->blocked);
    *kept = (struct kept_view){0};
}

static int read_depth(struct lumi_run *run, int index, struct lumi_raster *depth, struct lumi_error *error)
{
    g_autofree char *path = lumi_run_path(run, "depth", index, ".exr");

    LUMI_TRY(lumi_image_read_channel(path, "W", depth, error));
    return lumi_run_check_view(run, depth, path, error);
}

/* What the frame's mask says, in the view's pixels. */
static int add_rig_mask(const struct lumi_run *run, int index, uint8_t *blocked, struct lumi_error *error)
{
    const struct lumi_grid *grid = &run->grid;
    struct lumi_raster mask;

    LUMI_TRY(lumi_rig_mask_read(run, index, &mask, error));
    for (int y = 0; mask.data && y < grid->height; y++)
        for (int x = 0; x < grid->width; x++) {
            double tan_x, tan_y, px, py;
            lumi_grid_unproject(grid, x + 0.5, y + 0.5, &tan_x, &tan_y);
            if (lumi_lens_project(&run->sources[index].lens, lumi_vec3(tan_x, tan_y, 1), &px, &py) && px >= 0 &&
                py >= 0 && px < mask.width && py < mask.height && !lumi_row_u8(&mask, (int)py)[(int)px])
                blocked[(size_t)y * (size_t)grid->width + (size_t)x] = 1;
        }
    lumi_raster_finish(&mask);
    return LUMI_OK;
}

static int find_blocked(struct lumi_run *run, struct synthesis *state, int index, struct kept_view *kept,
                        struct lumi_error *error)
{
    const struct lumi_grid *grid = &run->grid;
    const size_t pixels = (size_t)grid->width * (size_t)grid->height;

    kept->blocked = lumi_calloc(pixels, 1);
    if (!kept->blocked)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for the mask of %s", run->sources[index].name);
    LUMI_TRY(add_rig_mask(run, index, kept->blocked, error));
    if (state->has_stand)
        lumi_stand_mask(&state->stand, grid, &run->sources[index].pose, &kept->depth, kept->blocked);
    if (lumi_mask_widen(kept->blocked, grid->width, grid->height, MAX(2, (grid->width + 80) / 160)) != LUMI_OK)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for the mask of %s", run->sources[index].name);
    for (size_t i = 0; i < pixels; i++)
        kept->blocked_count += kept->blocked[i];
    return LUMI_OK;
}

static int read_view(struct lumi_run *run, struct synthesis *state, int index, struct kept_view *kept,
                     struct lumi_error *error)
{
    g_autofree char *path = lumi_run_path(run, "equiangular", index, ".exr");
    int code = lumi_image_read(path, 3, &kept->image, NULL, error);

    if (code == LUMI_OK)
        code = lumi_run_check_view(run, &kept->image, path, error);
    if (code == LUMI_OK)
        code = read_depth(run, index, &kept->depth, error);
    if (code == LUMI_OK)
        code = find_blocked(run, state, index, kept, error);
    if (code != LUMI_OK)
        drop(kept);
    return code;
}

/* A photograph (the state's, valid for the KEPT − 1 calls that follow). */
static int view_of(struct lumi_run *run, struct synthesis *state, int index, const struct kept_view **view,
                   struct lumi_error *error)
{
    int slot;

    if (!lumi_recent_find(&state->recent, index, &slot)) {
        drop(&state->kept[slot]);
        LUMI_TRY(read_view(run, state, index, &state->kept[slot], error));
        lumi_recent_take(&state->recent, slot, index);
    }
    *view = &state->kept[slot];
    return LUMI_OK;
}

/* Where the floor is, and whether there is a stand on it. */
static int find_stand(struct lumi_run *run, struct synthesis *state, struct lumi_error *error)
{
    g_autofree struct lumi_vec3 *points = g_new(struct lumi_vec3, (gsize)run->dense + 1);
    g_autofree struct lumi_floor *floor = g_new(struct lumi_floor, 1);
    struct lumi_raster depths[PROBES] = {{0}};
    int probes[PROBES], seen = 0, code = LUMI_OK;
    const int count = find_probes(run, state->poses, probes);
    double height;

    for (int i = 0; i < run->dense; i++)
        points[i] = state->poses[i].t;
    const double gap = lumi_pole_gap(run->dense, points, run->centre, true);
    lumi_floor_init(floor, run->centre.z - run->radius);
    for (int i = 0; code == LUMI_OK && i < count; i++) {
        code = read_depth(run, probes[i], &depths[i], error);
        if (code == LUMI_OK)
            lumi_floor_add(floor, &run->grid, &state->poses[probes[i]], &depths[i], run->centre, FLOOR_REACH);
    }
    if (code == LUMI_OK && count > 0 && lumi_floor_find(floor, &height) &&
        lumi_stand_place(run->centre, run->radius, gap, run->parameters.stand_m, height, &state->stand)) {
        for (int i = 0; i < count; i++)
            seen += lumi_stand_share(&state->stand, &run->grid, &state->poses[probes[i]], &depths[i]) > STAND_SHARE;
        state->has_stand = run->parameters.stand_m > 0 || seen >= MIN(STAND_VIEWS, count);
    }
    for (int i = 0; i < count; i++)
        lumi_raster_finish(&depths[i]);
    return code;
}

static void end(struct lumi_run *run, void *data)
{
    struct synthesis *state = data;

    (void)run;
    for (int i = 0; i < KEPT; i++)
        drop(&state->kept[i]);
    g_free(state->poses);
    g_free(state);
}

static int begin(struct lumi_run *run, void **result, struct lumi_error *error)
{
    struct synthesis *state = g_new0(struct synthesis, 1);

    state->poses = photograph_poses(run);
    lumi_recent_init(&state->recent, KEPT);
    const int code = find_stand(run, state, error);
    if (code != LUMI_OK) {
        end(run, state);
        return code;
    }
    *result = state;
    return LUMI_OK;
}

/* R, G, B and W in one raster. */
static int write_view(const char *path, const struct lumi_raster *image, const struct lumi_raster *depth,
                      struct lumi_error *error)
{
    struct lumi_image_options options;
    struct lumi_raster joined;

    if (lumi_raster_create(&joined, image->width, image->height, 4, LUMI_F32) != LUMI_OK)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: out of memory", path);
    for (int y = 0; y < image->height; y++)
        for (int x = 0; x < image->width; x++) {
            memcpy(lumi_row_f32(&joined, y) + 4 * (size_t)x, lumi_row_f32(image, y) + 3 * (size_t)x, 3 * sizeof(float));
            lumi_row_f32(&joined, y)[4 * (size_t)x + 3] = lumi_row_f32(depth, y)[x];
        }
    lumi_image_options_init(&options);
    options.format = LUMI_IMAGE_EXR;
    options.half = true;
    options.channel = "W";
    const int code = lumi_image_write(path, &joined, &options, error);
    lumi_raster_finish(&joined);
    return code;
}

static int copy_raster(const struct lumi_raster *from, struct lumi_raster *to)
{
    LUMI_TRY(lumi_raster_create(to, from->width, from->height, from->channels, from->sample));
    for (int y = 0; y < from->height; y++)
        memcpy(lumi_row_u8(to, y), lumi_row_u8(from, y), (size_t)from->width * (size_t)from->channels * sizeof(float));
    return LUMI_OK;
}

static int gather(struct lumi_run *run, struct synthesis *state, int index,
                  struct lumi_synthesis_source sources[LUMI_SYNTHESIS_SOURCES], int *count, struct lumi_error *error)
{
    int indices[LUMI_SYNTHESIS_SOURCES];

    *count = find_sources(run, state->poses, index, indices);
    for (int i = 0; i < *count; i++) {
        const struct kept_view *view;
        LUMI_TRY(view_of(run, state, indices[i], &view, error));
        sources[i] = (struct lumi_synthesis_source){.grid = &run->grid,
                                                    .pose = state->poses[indices[i]],
                                                    .image = view->image,
                                                    .depth = view->depth,
                                                    .blocked = view->blocked_count ? view->blocked : NULL};
    }
    return LUMI_OK;
}

static int make(struct lumi_run *run, void *data, int index, int thread, const char *path, struct lumi_error *error)
{
    struct lumi_synthesis_source sources[LUMI_SYNTHESIS_SOURCES];
    struct synthesis *state = data;
    struct lumi_raster image = {0}, depth = {0};
    const struct kept_view *own = NULL;
    int count = 0, code = LUMI_OK;

    (void)thread;
    if (!run->sources[index].synthetic)
        LUMI_TRY(view_of(run, state, index, &own, error));
    if (own && own->blocked_count == 0)
        return write_view(path, &own->image, &own->depth, error);
    LUMI_TRY(gather(run, state, index, sources, &count, error));
    if (own && (copy_raster(&own->image, &image) != LUMI_OK || copy_raster(&own->depth, &depth) != LUMI_OK))
        code = lumi_fail(error, LUMI_ERR_NOMEM, "%s: out of memory", path);
    if (!own && (lumi_raster_create(&image, run->grid.width, run->grid.height, 3, LUMI_F32) != LUMI_OK ||
                 lumi_raster_create(&depth, run->grid.width, run->grid.height, 1, LUMI_F32) != LUMI_OK))
        code = lumi_fail(error, LUMI_ERR_NOMEM, "%s: out of memory", path);
    if (code == LUMI_OK)
        code = lumi_synthesize_view(&run->grid, &run->sources[index].pose, count, sources, own ? own->blocked : NULL,
                                    run->threads, &image, &depth, NULL, error);
    if (code == LUMI_OK)
        code = write_view(path, &image, &depth, error);
    lumi_raster_finish(&image);
    lumi_raster_finish(&depth);
    return code;
}

const struct lumi_stage lumi_stage_synthesize = {
    .name = "synthesize",
    .title = "synthesis",
    .version = 2,
    .extension = ".exr",
    .set = LUMI_SET_FILLED,
    .wanted = wanted,
    .key = key,
    .begin = begin,
    .end = end,
    .make = make,
    .serial = true,
};
