/* Which frame is worth reading next, which view is worth matching next. */
#include "pipeline/preview/preview_priv.h"

#include <math.h>
#include <string.h>

#define WORTH                                                                                                          \
    1.5 /* a frame takes the memory of another where it is so much farther from all others than that one is            \
         */

static double between(const struct preview_frame *a, const struct preview_frame *b)
{
    return lumi_length(lumi_sub(a->pose.t, b->pose.t));
}

void preview_note_loaded(struct lumi_preview *preview, const struct preview_frame *frame)
{
    for (guint i = 0; i < preview->frames->len; i++) {
        struct preview_frame *other = preview_frame(preview, (int)i);
        if (other == frame)
            continue;
        const double distance = between(other, frame);
        other->stale = other->stale || distance < 3 * other->distance;
        other->distance = fmin(other->distance, distance);
    }
}

void preview_measure_distances(struct lumi_preview *preview)
{
    const int count = (int)preview->frames->len;

    for (int i = 0; i < count; i++)
        preview_frame(preview, i)->distance = INFINITY;
    for (int i = 0; i < count; i++) {
        const struct preview_frame *loaded = preview_frame(preview, i);
        for (int k = 0; loaded->state == PREVIEW_LOADED && k < count; k++) {
            struct preview_frame *other = preview_frame(preview, k);
            if (k != i)
                other->distance = fmin(other->distance, between(other, loaded));
        }
    }
}

/* Memory is full: the view that is nearest to another makes room for `frame`, if that is worth it. */
static bool make_room(struct lumi_preview *preview, const struct preview_frame *frame)
{
    struct preview_frame *least = NULL;
    int loaded = 0;

    for (guint i = 0; i < preview->frames->len; i++) {
        struct preview_frame *other = preview_frame(preview, (int)i);
        if (other->state != PREVIEW_LOADED)
            continue;
        loaded++;
        if (!least || other->distance < least->distance)
            least = other;
    }
    if (loaded < preview->most)
        return true;
    if (!least || !(frame->distance > WORTH * least->distance))
        return false;
    preview_unload(least);
    least->state = PREVIEW_LEFT_OUT;
    preview_measure_distances(preview);
    return true;
}

struct preview_frame *preview_choose_frame(struct lumi_preview *preview)
{
    struct preview_frame *best = NULL;

    for (guint i = 0; i < preview->frames->len; i++) {
        struct preview_frame *frame = preview_frame(preview, (int)i);
        if (frame->state == PREVIEW_WAITING && (!best || frame->distance > best->distance))
            best = frame;
    }
    return best && make_room(preview, best) ? best : NULL;
}

/* ---- what is matched against what ---- */

static int find_neighbours(GPtrArray *loaded, const struct lumi_pose *poses, int index,
                           struct preview_frame **neighbours)
{
    int indices[LUMI_MVS_NEIGHBOURS];
    const int count = lumi_mvs_neighbours((int)loaded->len, poses, index, 0, indices);

    for (int i = 0; i < count; i++)
        neighbours[i] = g_ptr_array_index(loaded, (guint)indices[i]);
    return count;
}

static bool same_neighbours(const struct preview_frame *frame, struct preview_frame *const *neighbours, int count)
{
    if (count != frame->neighbour_count)
        return false;
    for (int i = 0; i < count; i++)
        if (neighbours[i]->id != frame->neighbours[i])
            return false;
    return true;
}

/* One with `shaped` as wanted that has other neighbours than when it was matched. */
static struct preview_frame *find_stale(GPtrArray *loaded, const struct lumi_pose *poses, bool shaped,
                                        struct preview_frame **neighbours, int *count)
{
    for (guint i = 0; i < loaded->len; i++) {
        struct preview_frame *frame = g_ptr_array_index(loaded, i);
        if (frame->shaped != shaped || (shaped && !frame->stale))
            continue;
        *count = find_neighbours(loaded, poses, (int)i, neighbours);
        if (*count > 0 && !same_neighbours(frame, neighbours, *count))
            return frame;
        frame->stale = false;
    }
    return NULL;
}

struct preview_frame *preview_choose_shape(struct lumi_preview *preview, struct preview_frame **neighbours,
                                           int *neighbour_count)
{
    g_autoptr(GPtrArray) loaded = g_ptr_array_new();
    g_autofree struct lumi_pose *poses = g_new(struct lumi_pose, preview->frames->len + 1);

    for (guint i = 0; i < preview->frames->len; i++) {
        struct preview_frame *frame = preview_frame(preview, (int)i);
        if (frame->state != PREVIEW_LOADED)
            continue;
        poses[loaded->len] = frame->pose;
        g_ptr_array_add(loaded, frame);
    }
    struct preview_frame *found = find_stale(loaded, poses, false, neighbours, neighbour_count);
    return found ? found : find_stale(loaded, poses, true, neighbours, neighbour_count);
}
