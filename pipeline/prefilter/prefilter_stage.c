/* The stage `prefilter`: dense views kept from image to image, the filter of one view, its file. */
#include "pipeline/prefilter/dense_views.h"
#include "pipeline/prefilter/disk_plan.h"
#include "pipeline/prefilter/display.h"
#include "pipeline/prefilter/prefilter.h"
#include "pipeline/run/key.h"
#include "proto/base/file.h"
#include "proto/base/memory.h"
#include "proto/image/image.h"

#include <glib.h>
#include <math.h>
#include <pthread.h>
#include <string.h>

#define MESH_LIMIT ((size_t)1 << 28) /* bytes */

struct state {
    struct prefilter_plan plan;
    struct prefilter_shelf *shelf;
};

/* Plans are made once for all keys of a run, which are asked for one by one. */
static struct {
    pthread_mutex_t lock;
    char key[LUMI_KEY_HEX];
    int count;
    struct prefilter_plan plan;
} last = {.lock = PTHREAD_MUTEX_INITIALIZER};

static void plan_key(const struct lumi_run *run, char hex[LUMI_KEY_HEX])
{
    struct lumi_key key;

    lumi_key_init(&key, "prefilter-plan", 1);
    lumi_key_int(&key, run->surface);
    lumi_key_double(&key, run->radius);
    lumi_key_bytes(&key, &run->centre, sizeof run->centre);
    lumi_key_double(&key, run->parameters.disk_scale);
    for (int i = 0; i < run->count; i++) {
        lumi_key_pose(&key, &run->sources[i].pose);
        lumi_key_int(&key, run->sources[i].kept);
    }
    lumi_key_hex(&key, hex);
}

/* The disks of the run, the caller's own. */
static int find_plan(const struct lumi_run *run, struct prefilter_plan *plan, struct lumi_error *error)
{
    char hex[LUMI_KEY_HEX];
    int code = LUMI_OK;

    plan_key(run, hex);
    pthread_mutex_lock(&last.lock);
    if (strcmp(hex, last.key) != 0) {
        prefilter_plan_finish(&last.plan);
        last.key[0] = '\0';
        code = prefilter_plan_make(run, &last.plan, error);
        if (code == LUMI_OK)
            g_strlcpy(last.key, hex, sizeof last.key);
    }
    if (code == LUMI_OK) {
        plan->dense = g_memdup2(last.plan.dense, (gsize)run->count * sizeof *plan->dense);
        plan->kept = g_memdup2(last.plan.kept, (gsize)run->count * sizeof *plan->kept);
    }
    pthread_mutex_unlock(&last.lock);
    return code;
}

static bool wanted(const struct lumi_run *run, int index)
{
    (void)index;
    return run->wants.prefilter;
}

static uint32_t seed_of(const char *name)
{
    uint32_t hash = 2166136261u; /* FNV-1a */

    for (; *name; name++)
        hash = (hash ^ (unsigned char)*name) * 16777619u;
    return hash;
}

void lumi_prefilter_settings_of(const struct lumi_run *run, int index, struct lumi_prefilter_settings *settings)
{
    const int asked = run->parameters.prefilter;

    lumi_prefilter_defaults(settings);
    if (asked > 0) {
        settings->base = 2;
        while (settings->base < asked)
            settings->base *= 2;
        settings->most = settings->base * (LUMI_PREFILTER_MOST / LUMI_PREFILTER_BASE);
    }
    settings->seed = seed_of(run->sources[index].name);
    settings->threads = run->threads;
}

static void key_disk(struct lumi_key *key, const struct lumi_disk *disk)
{
    lumi_key_double(key, disk->u_neg);
    lumi_key_double(key, disk->u_pos);
    lumi_key_double(key, disk->v_neg);
    lumi_key_double(key, disk->v_pos);
}

static int key(struct lumi_run *run, int index, struct lumi_key *k, struct lumi_error *error)
{
    g_autofree int *sources = g_new(int, (gsize)run->count);
    struct lumi_prefilter_settings settings;
    struct prefilter_plan plan;

    LUMI_TRY(find_plan(run, &plan, error));
    const int count = prefilter_sources(run, &plan, index, sources);
    lumi_prefilter_settings_of(run, index, &settings);
    lumi_key_int(k, settings.base);
    lumi_key_int(k, settings.most);
    lumi_key_double(k, settings.tolerance);
    lumi_key_int(k, settings.seed);
    lumi_key_int(k, run->parameters.disk_shape);
    lumi_key_int(k, run->parameters.kernel);
    lumi_key_pose(k, &run->sources[index].pose);
    key_disk(k, &plan.kept[index]);
    lumi_key_input(k, run, "geometry", index);
    lumi_key_view(k, run, index, LUMI_VIEW_PICTURE);
    lumi_key_int(k, count);
    for (int i = 0; i < count; i++) {
        lumi_key_pose(k, &run->sources[sources[i]].pose);
        key_disk(k, &plan.dense[sources[i]]);
        lumi_key_view(k, run, sources[i], LUMI_VIEW_PICTURE);
        lumi_key_view(k, run, sources[i], LUMI_VIEW_DEPTH);
    }
    prefilter_plan_finish(&plan);
    return LUMI_OK;
}

static int begin(struct lumi_run *run, void **result, struct lumi_error *error)
{
    struct state *state = g_new0(struct state, 1);
    const int code = find_plan(run, &state->plan, error);

    if (code != LUMI_OK)
        g_clear_pointer(&state, g_free);
    else
        state->shelf = prefilter_shelf_create();
    *result = state;
    return code;
}

static void end(struct lumi_run *run, void *data)
{
    struct state *state = data;

    (void)run;
    if (!state)
        return;
    prefilter_shelf_destroy(state->shelf);
    prefilter_plan_finish(&state->plan);
    g_free(state);
}

static int read_surface(struct lumi_run *run, int index, struct lumi_raster *surface, struct lumi_error *error)
{
    g_autofree char *path = lumi_run_path(run, "geometry", index, ".mesh");
    struct lumi_view_mesh mesh = {0};
    struct lumi_reader reader;
    uint8_t *data;
    size_t size;

    LUMI_TRY(lumi_file_read(path, MESH_LIMIT, &data, &size, error));
    lumi_reader_init(&reader, data, size);
    int code = lumi_view_mesh_decode(&reader, run->grid.cols, run->grid.rows, &mesh, error);
    if (code == LUMI_OK)
        code = lumi_prefilter_surface(&run->grid, &mesh, surface, error);
    else
        lumi_fail_prefix(error, "%s", path);
    lumi_view_mesh_finish(&mesh);
    lumi_free(data);
    return code;
}

/* One image's work. */
struct job {
    struct lumi_run *run;
    struct lumi_prefilter_view view;
    struct lumi_raster surface;
    int count; /* of the dense views that its rays go through */
    int *sources;
    struct lumi_view *views;
    struct lumi_raster *pictures;
};

/* Of the views that can matter, those that do. */
static void choose(struct job *job, const struct state *state, int index, uint32_t seed, int samples)
{
    const struct lumi_run *run = job->run;
    const int count = prefilter_sources(run, &state->plan, index, job->sources);

    for (int i = 0; i < count; i++) {
        const int source = job->sources[i];
        const struct lumi_view dense = {
            .grid = &run->grid, .pose = run->sources[source].pose, .disk = state->plan.dense[source]};
        if (source == index || prefilter_sees(&job->view, &dense, seed, samples)) {
            job->sources[job->count] = source;
            job->views[job->count++] = dense;
        }
    }
}

static int filter(struct job *job, struct state *state, int index, const struct lumi_prefilter_settings *settings,
                  struct lumi_raster *result, struct lumi_prefilter_report *report, struct lumi_error *error)
{
    struct lumi_viewset *set;

    LUMI_TRY(read_surface(job->run, index, &job->surface, error));
    job->view.surface = &job->surface;
    choose(job, state, index, settings->seed, settings->base);
    LUMI_TRY(prefilter_shelf_hold(state->shelf, job->run, job->count, job->sources, error));
    for (int i = 0; i < job->count; i++) {
        const struct prefilter_dense *dense = prefilter_shelf_view(state->shelf, job->sources[i]);
        job->pictures[i] = dense->picture;
        job->views[i].inverse_depth = &dense->depth;
        if (job->sources[i] == index)
            job->view.picture = &dense->picture;
    }
    LUMI_TRY(
        lumi_viewset_create(job->count, job->views, job->pictures, job->view.shape, job->view.kernel, &set, error));
    const int code = lumi_prefilter(set, &job->view, settings, result, report, error);
    lumi_viewset_destroy(set);
    return code;
}

int lumi_prefilter_image(struct lumi_run *run, void *data, int index, const struct lumi_prefilter_settings *settings,
                         struct lumi_raster *result, struct lumi_prefilter_report *report, struct lumi_error *error)
{
    struct state *state = data;
    struct job job = {.run = run,
                      .view = {.grid = &run->grid,
                               .pose = run->sources[index].pose,
                               .disk = state->plan.kept[index],
                               .shape = run->parameters.disk_shape,
                               .kernel = run->parameters.kernel},
                      .sources = g_new(int, (gsize)run->count),
                      .views = g_new0(struct lumi_view, (gsize)run->count),
                      .pictures = g_new0(struct lumi_raster, (gsize)run->count)};
    const int code = filter(&job, state, index, settings, result, report, error);

    lumi_raster_finish(&job.surface);
    g_free(job.sources);
    g_free(job.views);
    g_free(job.pictures);
    return code == LUMI_OK ? code : lumi_fail_prefix(error, "%s", run->sources[index].name);
}

static int make(struct lumi_run *run, void *state, int index, int thread, const char *path, struct lumi_error *error)
{
    struct lumi_prefilter_settings settings;
    struct lumi_image_options options;
    struct lumi_raster picture = {0};

    (void)thread;
    lumi_image_options_init(&options);
    options.format = LUMI_IMAGE_EXR;
    lumi_prefilter_settings_of(run, index, &settings);
    LUMI_TRY(lumi_prefilter_image(run, state, index, &settings, &picture, NULL, error));
    prefilter_to_linear(&picture);
    const int code = lumi_image_write(path, &picture, &options, error);
    lumi_raster_finish(&picture);
    return code;
}

const struct lumi_stage lumi_stage_prefilter = {
    .name = "prefilter",
    .title = "prefilter",
    .version = 1,
    .extension = ".exr",
    .set = LUMI_SET_KEPT,
    .wanted = wanted,
    .key = key,
    .begin = begin,
    .end = end,
    .make = make,
    .serial = true,
};
