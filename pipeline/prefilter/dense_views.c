/* Dense views in memory. */
#include "pipeline/prefilter/dense_views.h"

#include "pipeline/prefilter/display.h"
#include "proto/base/parallel.h"
#include "proto/image/image.h"

#include <glib.h>
#include <math.h>

/* Memory for views (16 bytes a pixel); more only where one image's views need it. */
#define KEPT_BYTES ((size_t)1 << 30)

struct prefilter_shelf {
    GArray *held; /* struct prefilter_dense */
    long clock;
};

static void drop(struct prefilter_dense *held)
{
    lumi_raster_finish(&held->picture);
    lumi_raster_finish(&held->depth);
    held->index = -1;
}

struct prefilter_shelf *prefilter_shelf_create(void)
{
    struct prefilter_shelf *shelf = g_new0(struct prefilter_shelf, 1);

    shelf->held = g_array_new(FALSE, TRUE, sizeof(struct prefilter_dense));
    return shelf;
}

void prefilter_shelf_destroy(struct prefilter_shelf *shelf)
{
    if (!shelf)
        return;
    for (guint i = 0; i < shelf->held->len; i++)
        drop(&g_array_index(shelf->held, struct prefilter_dense, i));
    g_array_unref(shelf->held);
    g_free(shelf);
}

static int read_picture(const struct lumi_run *run, int index, struct lumi_raster *picture, struct lumi_error *error)
{
    g_autofree char *path = lumi_run_view(run, index, LUMI_VIEW_PICTURE);

    LUMI_TRY(lumi_image_read(path, 3, picture, NULL, error));
    LUMI_TRY(lumi_run_check_view(run, picture, path, error));
    if (picture->sample != LUMI_F32)
        return lumi_fail(error, LUMI_ERR_FORMAT, "%s: is not a picture of floats", path);
    prefilter_to_display(picture);
    return LUMI_OK;
}

static int read_depth(const struct lumi_run *run, int index, struct lumi_raster *depth, struct lumi_error *error)
{
    g_autofree char *path = lumi_run_view(run, index, LUMI_VIEW_DEPTH);

    LUMI_TRY(lumi_image_read_channel(path, "W", depth, error));
    LUMI_TRY(lumi_run_check_view(run, depth, path, error));
    for (int y = 0; y < depth->height; y++) {
        float *row = lumi_row_f32(depth, y);
        for (int x = 0; x < depth->width; x++)
            row[x] = isfinite(row[x]) && row[x] > 0 ? row[x] : 0;
    }
    return LUMI_OK;
}

struct reading {
    struct lumi_run *run;
    struct prefilter_dense **views; /* to be read: index set, rasters empty */
    struct lumi_error *errors;
};

static int read_view(void *context, int number, int thread)
{
    struct reading *reading = context;
    struct prefilter_dense *view = reading->views[number];

    (void)thread;
    LUMI_TRY(read_picture(reading->run, view->index, &view->picture, &reading->errors[number]));
    return read_depth(reading->run, view->index, &view->depth, &reading->errors[number]);
}

static struct prefilter_dense *find_held(const struct prefilter_shelf *shelf, int index)
{
    for (guint i = 0; i < shelf->held->len; i++)
        if (g_array_index(shelf->held, struct prefilter_dense, i).index == index)
            return &g_array_index(shelf->held, struct prefilter_dense, i);
    return NULL;
}

/* Makes room for one more view: that used longest ago goes, unless this image uses it or there is memory for more. */
static void make_room(const struct lumi_run *run, struct prefilter_shelf *shelf, int index)
{
    const size_t bytes = (size_t)run->grid.width * (size_t)run->grid.height * 16;
    const struct prefilter_dense fresh = {.index = index, .used = shelf->clock};
    struct prefilter_dense *oldest = NULL;

    for (guint i = 0; i < shelf->held->len; i++) {
        struct prefilter_dense *held = &g_array_index(shelf->held, struct prefilter_dense, i);
        if (held->used < shelf->clock && (!oldest || held->used < oldest->used))
            oldest = held;
    }
    if (oldest && (oldest->index < 0 || (shelf->held->len + 1) * bytes > KEPT_BYTES)) {
        drop(oldest);
        *oldest = fresh;
    } else {
        g_array_append_val(shelf->held, fresh);
    }
}

int prefilter_shelf_hold(struct prefilter_shelf *shelf, struct lumi_run *run, int count, const int *indices,
                         struct lumi_error *error)
{
    g_autofree struct prefilter_dense **missing = g_new0(struct prefilter_dense *, (gsize)count);
    g_autofree struct lumi_error *errors = g_new0(struct lumi_error, (gsize)count);
    struct reading reading = {run, missing, errors};
    int reads = 0;

    shelf->clock++;
    for (int i = 0; i < count; i++) {
        struct prefilter_dense *held = find_held(shelf, indices[i]);
        if (held)
            held->used = shelf->clock;
    }
    for (int i = 0; i < count; i++)
        if (!find_held(shelf, indices[i]))
            make_room(run, shelf, indices[i]);
    for (int i = 0; i < count; i++) {
        struct prefilter_dense *held = find_held(shelf, indices[i]);
        if (!held->picture.data)
            missing[reads++] = held;
    }
    const int code = lumi_parallel_for(reads, run->threads, read_view, &reading);
    for (int i = reads - 1; code != LUMI_OK && i >= 0; i--) {
        if (errors[i].code == code && error)
            *error = errors[i];
        drop(missing[i]);
        missing[i]->used = 0;
    }
    return code;
}

const struct prefilter_dense *prefilter_shelf_view(const struct prefilter_shelf *shelf, int index)
{
    return find_held(shelf, index);
}
