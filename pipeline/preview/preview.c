/* The frames there are, and the pieces of work on them. */
#include "pipeline/preview/preview.h"

#include "pipeline/geometry/disks.h"
#include "pipeline/preview/preview_priv.h"
#include "proto/base/memory.h"

#include <math.h>
#include <string.h>

#define FIRST_SHAPES 16 /* so many views are matched while others are still read: they tell how far things are */
#define VIEWS_A_SHAPE 12

void lumi_preview_options_init(struct lumi_preview_options *options)
{
    *options = (struct lumi_preview_options){
        .memory_bytes = (size_t)512 << 20, .pixels_per_degree = 6, .shapes = true, .threads = 0};
}

static void free_frame(void *data)
{
    preview_unload(data);
    g_free(data);
}

int lumi_preview_open(const char *path, const struct lumi_preview_options *options, struct lumi_preview **preview,
                      struct lumi_error *error)
{
    struct lumi_preview *made = g_new0(struct lumi_preview, 1);

    made->path = g_strdup(path);
    made->options = *options;
    made->frames = g_ptr_array_new_with_free_func(free_frame);
    made->by_id = g_hash_table_new(g_int64_hash, g_int64_equal);
    made->warps = g_array_new(FALSE, FALSE, sizeof(struct preview_warp));
    const int code = lumi_preview_look(made, NULL, error);
    if (code != LUMI_OK) {
        lumi_preview_close(made);
        made = NULL;
    }
    *preview = made;
    return code;
}

void lumi_preview_close(struct lumi_preview *preview)
{
    if (!preview)
        return;
    lumi_viewset_destroy(preview->set);
    preview_finish_warps(preview);
    g_array_unref(preview->warps);
    g_hash_table_unref(preview->by_id);
    g_ptr_array_unref(preview->frames);
    g_free(preview->path);
    g_free(preview);
}

void lumi_preview_status(const struct lumi_preview *preview, struct lumi_preview_status *status)
{
    *status = preview->status;
}

static void forget_set(struct lumi_preview *preview)
{
    lumi_viewset_destroy(preview->set);
    preview->set = NULL;
}

/* ---- looking ---- */

static bool is_usable(const struct lumi_capture_frame *frame)
{
    return (frame->state == LUMI_FRAME_RECEIVED || frame->state == LUMI_FRAME_ACCEPTED) && frame->has_pose &&
           frame->file[0] && lumi_pose_valid(&frame->pose, 1e-3) && lumi_lens_valid(&frame->lens);
}

/* Still to come, or under way. */
static bool is_awaited(const struct lumi_capture_frame *frame)
{
    return (frame->state == LUMI_FRAME_PLANNED && !frame->reason[0]) || frame->state == LUMI_FRAME_TRIGGERED;
}

/* Lines with a frame that is here and none that is awaited. */
static int count_rows(const struct lumi_capture_frame *frames, int count)
{
    g_autoptr(GHashTable) lines = g_hash_table_new(NULL, NULL); /* 1: a frame is here; 2: one is awaited */
    GHashTableIter at;
    void *key, *value;
    bool by_row = count > 0, one_camera = true;
    int turns = 0, rows = 0;

    for (int i = 0; i < count; i++) {
        turns = MAX(turns, frames[i].turn);
        one_camera = one_camera && frames[i].camera == frames[0].camera;
        by_row = by_row && frames[i].row >= 0;
    }
    by_row = by_row && (turns > 0 || one_camera);
    for (int i = 0; i < count; i++) {
        if (frames[i].state == LUMI_FRAME_RETAKEN)
            continue;
        void *line = GINT_TO_POINTER((by_row ? frames[i].row : frames[i].position) + 1);
        int state = GPOINTER_TO_INT(g_hash_table_lookup(lines, line));
        state |= (is_usable(&frames[i]) ? 1 : 0) | (is_awaited(&frames[i]) ? 2 : 0);
        g_hash_table_insert(lines, line, GINT_TO_POINTER(state));
    }
    g_hash_table_iter_init(&at, lines);
    while (g_hash_table_iter_next(&at, &key, &value))
        rows += GPOINTER_TO_INT(value) == 1;
    return rows;
}

/* The surface the cameras are on. A rig's poses are about its centre of rotation; of others it is found, the frames
 * that are still to come counted in. */
static int place(struct lumi_preview *preview, const struct lumi_capture_frame *frames, int count, bool rig,
                 struct lumi_error *error)
{
    struct lumi_pose *poses = lumi_alloc((size_t)count + 1, sizeof *poses);
    int posed = 0;

    if (!poses)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: out of memory", preview->path);
    for (int i = 0; i < count; i++)
        if (frames[i].has_pose && lumi_pose_valid(&frames[i].pose, 1e-3))
            poses[posed++] = frames[i].pose;
    if (posed > 0 && posed != preview->placed) {
        preview->placed = posed;
        lumi_surface_fit(posed, poses, &preview->surface, &preview->centre, &preview->radius);
        if (rig) {
            preview->surface = LUMI_SURFACE_SPHERE;
            preview->centre = lumi_vec3(0, 0, 0);
            preview->radius = 0;
            for (int i = 0; i < posed; i++)
                preview->radius += lumi_length(poses[i].t) / posed;
        }
        forget_set(preview);
    }
    lumi_free(poses);
    return LUMI_OK;
}

static int choose_grid(struct lumi_preview *preview, const struct lumi_capture_frame *frames, int count,
                       struct lumi_error *error)
{
    struct lumi_lens *lenses = lumi_alloc((size_t)count + 1, sizeof *lenses);
    int lens_count = 0, planned = 0;
    bool any = false;

    if (!lenses)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: out of memory", preview->path);
    for (int i = 0; i < count; i++) {
        if (!frames[i].has_pose || frames[i].state == LUMI_FRAME_RETAKEN)
            continue;
        planned++;
        any = any || is_usable(&frames[i]);
        int k = lens_count - 1;
        while (k >= 0 && !lumi_lens_equal(&lenses[k], &frames[i].lens))
            k--;
        if (k < 0)
            lenses[lens_count++] = frames[i].lens;
    }
    const int code = any ? preview_choose_grid(preview, lenses, lens_count, planned, error) : LUMI_OK;
    lumi_free(lenses);
    return code;
}

/* Whether it is a new one. */
static bool take_frame(struct lumi_preview *preview, const struct lumi_capture_frame *frame)
{
    struct preview_frame *known = g_hash_table_lookup(preview->by_id, &frame->id);

    if (known) {
        known->seen = true;
        return false;
    }
    known = g_new0(struct preview_frame, 1);
    known->id = frame->id;
    known->seen = true;
    known->distance = INFINITY;
    known->pose = frame->pose;
    lumi_rotation_orthonormalize(known->pose.r);
    known->lens = frame->lens;
    g_strlcpy(known->name, frame->name, sizeof known->name);
    g_strlcpy(known->file, frame->file, sizeof known->file);
    g_ptr_array_add(preview->frames, known);
    g_hash_table_insert(preview->by_id, &known->id, known);
    return true;
}

static bool merge(struct lumi_preview *preview, const struct lumi_capture_frame *frames, int count)
{
    const guint before = preview->frames->len;
    bool gone = false;

    for (guint i = 0; i < before; i++)
        preview_frame(preview, (int)i)->seen = false;
    for (int i = 0; i < count; i++)
        if (is_usable(&frames[i]))
            take_frame(preview, &frames[i]);
    const bool come = preview->frames->len > before;
    for (guint i = 0; i < preview->frames->len;) {
        struct preview_frame *frame = preview_frame(preview, (int)i);
        if (frame->seen) {
            i++;
            continue;
        }
        gone = true;
        g_hash_table_remove(preview->by_id, &frame->id);
        g_ptr_array_remove_index(preview->frames, i);
    }
    if (gone)
        forget_set(preview);
    if (gone || come)
        preview_measure_distances(preview);
    return gone || come;
}

static void count_views(struct lumi_preview *preview)
{
    preview->status.frames = (int)preview->frames->len;
    preview->status.views = preview->status.shapes = 0;
    for (int i = 0; i < preview->status.frames; i++) {
        const struct preview_frame *frame = preview_frame(preview, i);
        preview->status.views += frame->state == PREVIEW_LOADED;
        preview->status.shapes += frame->state == PREVIEW_LOADED && frame->shaped;
    }
}

static int read_rows(struct lumi_preview *preview, bool *news, struct lumi_error *error)
{
    struct lumi_capture *capture = NULL;
    struct lumi_capture_frame *frames = NULL;
    char *profile = NULL;
    int count = 0, code;

    LUMI_GOTO(code, out, lumi_capture_open_copy(preview->path, &capture, error));
    LUMI_GOTO(code, out, lumi_capture_frames(capture, LUMI_FRAMES_ALL, &frames, &count, error));
    preview->status.sealed = lumi_capture_sealed(capture);
    const bool rig = lumi_capture_get_profile(capture, &profile, NULL) == LUMI_OK;
    LUMI_GOTO(code, out, place(preview, frames, count, rig, error));
    if (!preview->has_grid)
        LUMI_GOTO(code, out, choose_grid(preview, frames, count, error));
    const int rows = count_rows(frames, count);
    *news = merge(preview, frames, count) || rows != preview->status.rows;
    preview->status.rows = rows;
    count_views(preview);
out:
    lumi_free(profile);
    lumi_free(frames);
    lumi_capture_close(capture);
    return code;
}

int lumi_preview_look(struct lumi_preview *preview, bool *news, struct lumi_error *error)
{
    struct lumi_capture_stamp stamp = preview->stamp;
    bool changed, come = false;

    if (news)
        *news = false;
    LUMI_TRY(lumi_capture_changed(preview->path, &stamp, &changed, error));
    if (!changed)
        return LUMI_OK;
    LUMI_TRY(read_rows(preview, &come, error));
    preview->stamp = stamp;
    if (news)
        *news = come;
    return LUMI_OK;
}

/* ---- work ---- */

static void skip(struct lumi_preview *preview, struct preview_frame *frame, const struct lumi_error *error)
{
    frame->state = PREVIEW_BAD;
    if (preview->options.skipped)
        preview->options.skipped(preview->options.context, error->text);
}

static bool load_one(struct lumi_preview *preview)
{
    struct preview_frame *frame = preview->has_grid ? preview_choose_frame(preview) : NULL;
    struct lumi_error error = {0};

    if (!frame)
        return false;
    forget_set(preview);
    if (preview_load(preview, frame, &error) != LUMI_OK) {
        skip(preview, frame, &error);
        return true;
    }
    frame->state = PREVIEW_LOADED;
    preview_note_loaded(preview, frame);
    return true;
}

static bool shape_one(struct lumi_preview *preview)
{
    struct preview_frame *neighbours[LUMI_MVS_NEIGHBOURS], *frame;
    struct lumi_error error = {0};
    int count;

    frame = preview->options.shapes ? preview_choose_shape(preview, neighbours, &count) : NULL;
    if (!frame)
        return false;
    forget_set(preview);
    if (preview_shape(preview, frame, neighbours, count, &error) != LUMI_OK) {
        preview_unload(frame);
        skip(preview, frame, &error);
    } else if (preview->status.shapes < FIRST_SHAPES) {
        preview_measure_nearness(preview);
    }
    return true;
}

bool lumi_preview_work(struct lumi_preview *preview)
{
    const struct lumi_preview_status *status = &preview->status;
    const bool look_first = status->shapes < FIRST_SHAPES && status->shapes < status->views / VIEWS_A_SHAPE;
    const bool done = (look_first && shape_one(preview)) || load_one(preview) || shape_one(preview);

    count_views(preview);
    return done;
}
