/* The images of a capture as the pipeline sees them. */
#include "pipeline/run/sources.h"

#include "proto/base/memory.h"

#include <glib.h>
#include <math.h>
#include <string.h>

/* What a capture numbers by its database, numbered from 0. */
struct loading {
    struct lumi_capture *capture;
    GArray *cameras; /* ids, in the order they were added */
    GArray *lenses;  /* ids, as they come */
};

static int number_in(GArray *ids, int64_t id)
{
    for (guint i = 0; i < ids->len; i++)
        if (g_array_index(ids, int64_t, i) == id)
            return (int)i;
    g_array_append_val(ids, id);
    return (int)ids->len - 1;
}

static int take_frame(struct loading *loading, const struct lumi_capture_frame *frame, struct lumi_source *source,
                      struct lumi_error *error)
{
    char *path = lumi_capture_join(loading->capture, frame->file);

    if (!path)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: not enough memory", lumi_capture_path(loading->capture));
    if (!lumi_lens_valid(&frame->lens) || !lumi_pose_valid(&frame->pose, 1e-3)) {
        int code = lumi_fail(error, LUMI_ERR_FORMAT, "%s: its lens or its pose is no lens or no pose", path);
        lumi_free(path);
        return code;
    }
    *source = (struct lumi_source){.path = g_strdup(path),
                                   .lens = frame->lens,
                                   .pose = frame->pose,
                                   .row = frame->row,
                                   .column = frame->column,
                                   .camera = number_in(loading->cameras, frame->camera),
                                   .lens_slot = number_in(loading->lenses, frame->lens_id),
                                   .position = frame->position,
                                   .turn = frame->turn,
                                   .turn_angle = frame->turn_angle,
                                   .drop = frame->drop,
                                   .exposure_s = frame->exposure_s,
                                   .iso = frame->iso,
                                   .exposure_offset = frame->exposure_offset,
                                   .pose_source = frame->pose_source,
                                   .kept = true};
    lumi_free(path);
    g_strlcpy(source->name, frame->name, sizeof source->name);
    g_strlcpy(source->sha256, frame->sha256, sizeof source->sha256);
    g_strlcpy(source->camera_name, frame->camera_name, sizeof source->camera_name);
    lumi_rotation_orthonormalize(source->pose.r);
    source->prior = source->pose;
    return LUMI_OK;
}

static int by_exposure(const void *a, const void *b)
{
    const struct lumi_source_part *x = a, *y = b;

    return x->exposure_offset < y->exposure_offset ? -1 : x->exposure_offset > y->exposure_offset;
}

static struct lumi_source_part part_of(const struct lumi_source *source)
{
    struct lumi_source_part part = {.path = g_strdup(source->path),
                                    .exposure_s = source->exposure_s,
                                    .iso = source->iso,
                                    .exposure_offset = source->exposure_offset};

    memcpy(part.sha256, source->sha256, sizeof part.sha256);
    return part;
}

static bool has_exposure(const struct lumi_source *source, double offset)
{
    for (int i = 0; i < source->part_count; i++)
        if (source->parts[i].exposure_offset == offset)
            return true;
    return source->part_count == 0 && source->exposure_offset == offset;
}

/* `other`, another exposure of the same place, becomes a part of `source`. The one asked for nearest to 0 stands for
 * all. */
static void join(struct lumi_source *source, struct lumi_source *other)
{
    struct lumi_source_part *parts = g_renew(struct lumi_source_part, source->parts, source->part_count + 2);

    if (source->part_count == 0)
        parts[source->part_count++] = part_of(source);
    parts[source->part_count++] = part_of(other);
    qsort(parts, (size_t)source->part_count, sizeof *parts, by_exposure);
    source->parts = parts;
    if (fabs(other->exposure_offset) < fabs(source->exposure_offset)) {
        struct lumi_source outer = *source;
        *source = *other;
        source->part_count = outer.part_count;
        source->parts = outer.parts;
        *other = outer;
        other->parts = NULL;
    }
    sources_free(other);
}

/* Shots of one camera at one position that were asked for with different exposures are a bracket: one image. */
static void join_brackets(struct lumi_run *run, const int64_t *positions)
{
    g_autoptr(GHashTable) first = g_hash_table_new_full(g_str_hash, g_str_equal, g_free, NULL);
    int kept = 0;

    for (int i = 0; i < run->count; i++) {
        struct lumi_source *source = &run->sources[i];
        g_autofree char *place = g_strdup_printf("%d@%lld", source->camera, (long long)positions[i]);
        const int at = GPOINTER_TO_INT(g_hash_table_lookup(first, place)) - 1;
        if (at >= 0 && !has_exposure(&run->sources[at], source->exposure_offset)) {
            join(&run->sources[at], source);
            continue;
        }
        run->sources[kept] = *source;
        g_hash_table_insert(first, g_steal_pointer(&place), GINT_TO_POINTER(kept + 1));
        kept++;
    }
    run->count = kept;
}

/* Where there are brackets, what is left of one is one too: it was exposed by another exposure than the rest. */
static void mend_brackets(struct lumi_run *run)
{
    bool any = false;

    for (int i = 0; i < run->count; i++)
        any = any || run->sources[i].part_count > 0;
    for (int i = 0; any && i < run->count; i++) {
        struct lumi_source *source = &run->sources[i];
        if (source->part_count > 0)
            continue;
        source->parts = g_new(struct lumi_source_part, 1);
        source->parts[0] = part_of(source);
        source->part_count = 1;
    }
}

void sources_free(struct lumi_source *source)
{
    g_free(source->path);
    for (int i = 0; i < source->part_count && source->parts; i++)
        g_free(source->parts[i].path);
    g_free(source->parts);
    source->path = NULL;
    source->parts = NULL;
    source->part_count = 0;
}

static void load_cameras(struct loading *loading)
{
    char name[LUMI_CAPTURE_NAME];
    int64_t id;

    for (int i = 0; lumi_capture_camera(loading->capture, i, &id, name, NULL) == LUMI_OK; i++)
        g_array_append_val(loading->cameras, id);
}

static int load_rig(struct lumi_run *run, struct lumi_capture *capture, struct lumi_error *error)
{
    char *text = NULL;
    int code = lumi_capture_get_profile(capture, &text, error);

    if (code == LUMI_ERR_NOTFOUND)
        return LUMI_OK;
    if (code == LUMI_OK) {
        run->rig = g_new0(struct lumi_rig, 1);
        code = lumi_rig_parse(text, strlen(text), run->capture, run->rig, error);
    }
    lumi_free(text);
    return code;
}

static bool is_usable(const struct lumi_capture_frame *frame)
{
    return frame->has_pose && frame->file[0] &&
           (frame->state == LUMI_FRAME_RECEIVED || frame->state == LUMI_FRAME_ACCEPTED);
}

static char *place_of(const struct lumi_capture_frame *frame)
{
    return g_strdup_printf("%lld@%lld", (long long)frame->camera, (long long)frame->position_id);
}

static char *shot_of(const struct lumi_capture_frame *frame)
{
    g_autofree char *place = place_of(frame);

    return g_strdup_printf("%s@%g", place, frame->exposure_offset);
}

static void add_missing(struct lumi_run *run, struct loading *loading, const struct lumi_capture_frame *frame,
                        bool part)
{
    struct lumi_missing *missing = &run->missing[run->missing_count++];

    *missing = (struct lumi_missing){.camera = number_in(loading->cameras, frame->camera),
                                     .position = frame->position,
                                     .turn = frame->turn,
                                     .exposure_offset = frame->exposure_offset,
                                     .part = part};
    g_strlcpy(missing->name, frame->name, sizeof missing->name);
    g_strlcpy(missing->camera_name, frame->camera_name, sizeof missing->camera_name);
    g_strlcpy(missing->why, frame->reason, sizeof missing->why);
}

/* Frames that cannot be used and were not taken again. */
static int load_missing(struct lumi_run *run, struct loading *loading, struct lumi_error *error)
{
    g_autoptr(GHashTable) there = g_hash_table_new_full(g_str_hash, g_str_equal, g_free, NULL);
    struct lumi_capture_frame *frames = NULL;
    int count = 0;

    LUMI_TRY(lumi_capture_frames(loading->capture, LUMI_FRAMES_ALL, &frames, &count, error));
    run->missing = g_new0(struct lumi_missing, (gsize)count + 1);
    for (int i = 0; i < count; i++)
        if (is_usable(&frames[i])) {
            g_hash_table_add(there, place_of(&frames[i]));
            g_hash_table_add(there, shot_of(&frames[i]));
        }
    for (int i = 0; i < count; i++) {
        g_autofree char *place = place_of(&frames[i]), *shot = shot_of(&frames[i]);
        if (g_hash_table_contains(there, shot))
            continue;
        add_missing(run, loading, &frames[i], g_hash_table_contains(there, place));
        g_hash_table_add(there, g_steal_pointer(&shot));
    }
    lumi_free(frames);
    return LUMI_OK;
}

static int load_frames(struct lumi_run *run, struct loading *loading, struct lumi_error *error)
{
    struct lumi_capture_frame *frames = NULL;
    int count = 0, code = LUMI_OK;

    LUMI_TRY(lumi_capture_frames(loading->capture, LUMI_FRAMES_USABLE, &frames, &count, error));
    g_autofree int64_t *positions = g_new0(int64_t, count + 1);
    run->sources = g_new0(struct lumi_source, count + 1);
    for (int i = 0; code == LUMI_OK && i < count; i++)
        if (frames[i].has_pose) {
            positions[run->count] = frames[i].position_id;
            code = take_frame(loading, &frames[i], &run->sources[run->count], error);
            run->count += code == LUMI_OK;
        }
    lumi_free(frames);
    if (code == LUMI_OK && run->count == 0)
        code = lumi_fail(error, LUMI_ERR_FORMAT, "%s: %s", run->capture,
                         count ? "none of its frames has a pose" : "it holds no frame");
    if (code == LUMI_OK) {
        join_brackets(run, positions);
        mend_brackets(run);
    }
    return code;
}

/* "R,G,B" under the key that imports write. */
static int load_white(struct lumi_run *run, struct lumi_capture *capture, struct lumi_error *error)
{
    double white[3] = {0};
    char text[128], *at = text;

    LUMI_TRY(lumi_capture_get_meta(capture, "white balance", text, sizeof text, error));
    for (int c = 0; text[0] && c < 3; c++) {
        white[c] = g_ascii_strtod(at, &at);
        if (!(white[c] > 0 && white[c] < 1000) || (c < 2 && *at++ != ','))
            return lumi_fail(error, LUMI_ERR_FORMAT, "%s: its white balance is '%s', not three factors", run->capture,
                             text);
    }
    for (int i = 0; i < run->count; i++)
        memcpy(run->sources[i].white, white, sizeof white);
    return LUMI_OK;
}

int lumi_sources_load(struct lumi_run *run, struct lumi_error *error)
{
    g_autoptr(GArray) cameras = g_array_new(FALSE, FALSE, sizeof(int64_t));
    g_autoptr(GArray) lenses = g_array_new(FALSE, FALSE, sizeof(int64_t));
    struct loading loading = {NULL, cameras, lenses};
    int code;

    LUMI_GOTO(code, out, lumi_capture_open(run->capture, LUMI_CAPTURE_READ, &loading.capture, error));
    load_cameras(&loading);
    LUMI_GOTO(code, out, load_rig(run, loading.capture, error));
    LUMI_GOTO(code, out, load_frames(run, &loading, error));
    LUMI_GOTO(code, out, load_missing(run, &loading, error));
    code = load_white(run, loading.capture, error);
out:
    lumi_capture_close(loading.capture);
    return code;
}
