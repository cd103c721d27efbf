/* Poses that were found, against the true ones. */
#include "pipeline/evaluate/pose_error.h"

#include "pipeline/calibrate/rotation.h"
#include "pipeline/exchange/exchange.h"
#include "pipeline/run/json_put.h"
#include "pipeline/run/places.h"

#include <stdlib.h>
#include <string.h>

#define MM 1000
#define DEGREES (180 / LUMI_PI)

static char *plain_name(const char *path)
{
    char *name = g_path_get_basename(path), *dot = strrchr(name, '.');

    if (dot && dot != name && strlen(dot) <= 5)
        *dot = 0;
    return name;
}

static void add(struct lumi_pose_set *set, const char *name, const struct lumi_pose *pose)
{
    set->names[set->count] = plain_name(name);
    set->poses[set->count++] = *pose;
}

static void make_room(struct lumi_pose_set *set, int count)
{
    set->names = g_new0(char *, (gsize)count + 1);
    set->poses = g_new0(struct lumi_pose, (gsize)count + 1);
}

static int read_places(const char *path, struct lumi_pose_set *set, struct lumi_error *error)
{
    struct lumi_places places = {0};

    LUMI_TRY(lumi_places_read(path, &places, error));
    make_room(set, places.count);
    for (int i = 0; i < places.count; i++)
        if (places.items[i].used && !places.items[i].synthetic)
            add(set, places.items[i].name, &places.items[i].pose);
    lumi_places_finish(&places);
    return LUMI_OK;
}

static int read_other(const char *path, struct lumi_pose_set *set, struct lumi_error *error)
{
    struct lumi_import_options options;
    struct lumi_exchange list;

    lumi_import_options_init(&options);
    options.trust = options.poses_only = true;
    lumi_exchange_init(&list);
    int code = lumi_import_list(path, &options, &list, error);
    if (code == LUMI_OK) {
        make_room(set, (int)list.images->len);
        for (int i = 0; i < (int)list.images->len; i++) {
            const struct lumi_exchange_image *image = lumi_exchange_image(&list, i);
            add(set, image->original ? image->original : image->name, &image->pose);
        }
    }
    lumi_exchange_finish(&list);
    return code;
}

int lumi_pose_set_read(const char *path, struct lumi_pose_set *set, struct lumi_error *error)
{
    g_autofree char *inside = g_build_filename(path, "calibrate", "all.places", NULL);

    *set = (struct lumi_pose_set){0};
    if (g_file_test(inside, G_FILE_TEST_IS_REGULAR))
        return read_places(inside, set, error);
    if (g_str_has_suffix(path, ".places"))
        return read_places(path, set, error);
    return read_other(path, set, error);
}

void lumi_pose_set_finish(struct lumi_pose_set *set)
{
    for (int i = 0; i < set->count; i++)
        g_free(set->names[i]);
    g_free(set->names);
    g_free(set->poses);
    *set = (struct lumi_pose_set){0};
}

/* The poses of those that both sets name; `which` are indices of the second. */
struct shared {
    struct lumi_pose *a, *b;
    int *which;
    int count;
};

static void share(const struct lumi_pose_set *first, const struct lumi_pose_set *second, struct shared *shared)
{
    g_autoptr(GHashTable) table = g_hash_table_new(g_str_hash, g_str_equal);
    const gsize room = (gsize)second->count + 1;

    *shared = (struct shared){g_new(struct lumi_pose, room), g_new(struct lumi_pose, room), g_new(int, room), 0};
    for (int i = 0; i < first->count; i++)
        g_hash_table_insert(table, first->names[i], GINT_TO_POINTER(i + 1));
    for (int i = 0; i < second->count; i++) {
        int at = GPOINTER_TO_INT(g_hash_table_lookup(table, second->names[i])) - 1;
        if (at < 0)
            continue;
        shared->a[shared->count] = first->poses[at];
        shared->b[shared->count] = second->poses[i];
        shared->which[shared->count++] = i;
    }
}

static void shared_finish(struct shared *shared)
{
    g_free(shared->a);
    g_free(shared->b);
    g_free(shared->which);
}

static int furthest_first(const void *left, const void *right)
{
    const struct lumi_pose_off *a = left, *b = right;

    if (a->position != b->position)
        return a->position > b->position ? -1 : 1;
    return strcmp(a->name, b->name);
}

static void list_all(const struct shared *s, const struct lumi_pose_set *truth,
                     const struct lumi_similarity *similarity, struct lumi_pose_error *result)
{
    result->off = g_new0(struct lumi_pose_off, (gsize)s->count);
    for (int i = 0; i < s->count; i++) {
        struct lumi_pose moved;
        lumi_similarity_apply(similarity, &s->a[i], &moved);
        result->off[i] =
            (struct lumi_pose_off){g_strdup(truth->names[s->which[i]]), lumi_length(lumi_sub(moved.t, s->b[i].t)),
                                   lumi_rotation_angle(moved.r, s->b[i].r)};
    }
    result->worst_turned = result->off[result->distance.worst_turned].name;
    qsort(result->off, (gsize)s->count, sizeof *result->off, furthest_first);
}

int lumi_pose_error(const struct lumi_pose_set *found, const struct lumi_pose_set *truth,
                    struct lumi_pose_error *result, struct lumi_error *error)
{
    struct lumi_similarity similarity;
    struct shared s;
    int code;

    *result = (struct lumi_pose_error){.truths = truth->count};
    share(found, truth, &s);
    LUMI_GOTO(code, out, lumi_align(s.count, s.a, s.b, &similarity, error));
    LUMI_GOTO(code, out, lumi_pose_compare(s.count, s.a, s.b, &similarity, &result->distance, error));
    result->scale = similarity.scale;
    list_all(&s, truth, &similarity, result);
out:
    shared_finish(&s);
    return code;
}

int lumi_pose_set_align(const struct lumi_pose_set *truth, const struct lumi_pose_set *found, struct lumi_pose *poses,
                        size_t stride, int count, struct lumi_error *error)
{
    struct lumi_similarity similarity;
    struct shared s;

    share(truth, found, &s);
    int code = lumi_align_robust(s.count, s.a, s.b, &similarity, error);
    for (int i = 0; code == LUMI_OK && i < count; i++) {
        struct lumi_pose *pose = (struct lumi_pose *)(void *)((char *)poses + (size_t)i * stride), moved;
        lumi_similarity_apply(&similarity, pose, &moved);
        *pose = moved;
    }
    shared_finish(&s);
    return code;
}

void lumi_pose_error_finish(struct lumi_pose_error *result)
{
    for (int i = 0; result->off && i < result->distance.count; i++)
        g_free(result->off[i].name);
    g_free(result->off);
    *result = (struct lumi_pose_error){0};
}

char *lumi_pose_error_text(const struct lumi_pose_error *r, int listed)
{
    const struct lumi_pose_distance *d = &r->distance;
    GString *text = g_string_new(NULL);

    g_string_printf(text,
                    "poses: %d of %d; after the best similarity (scale %.6f):\n"
                    "position  median %.3f mm, rms %.3f mm, worst %.3f mm (%s)\n"
                    "rotation  median %.4f°, rms %.4f°, worst %.4f° (%s)\n",
                    d->count, r->truths, r->scale, MM * d->median_m, MM * d->rms_m, MM * d->worst_m, r->off[0].name,
                    DEGREES * d->median_rotation, DEGREES * d->rms_rotation, DEGREES * d->worst_rotation,
                    r->worst_turned);
    if (listed > 0)
        g_string_append(text, "furthest off:\n");
    for (int i = 0; i < MIN(listed, d->count); i++)
        g_string_append_printf(text, "  %-12s %8.3f mm  %.4f°\n", r->off[i].name, MM * r->off[i].position,
                               DEGREES * r->off[i].rotation);
    return g_string_free(text, FALSE);
}

char *lumi_pose_error_json(const struct lumi_pose_error *r, int listed)
{
    g_autoptr(JsonBuilder) builder = json_builder_new();
    const struct lumi_pose_distance *d = &r->distance;

    json_builder_begin_object(builder);
    lumi_put_double(builder, "truths", r->truths);
    lumi_put_double(builder, "found", d->count);
    lumi_put_double(builder, "scale", r->scale);
    lumi_put_double(builder, "position_median_mm", MM * d->median_m);
    lumi_put_double(builder, "position_rms_mm", MM * d->rms_m);
    lumi_put_double(builder, "position_worst_mm", MM * d->worst_m);
    lumi_put_double(builder, "rotation_median_degrees", DEGREES * d->median_rotation);
    lumi_put_double(builder, "rotation_rms_degrees", DEGREES * d->rms_rotation);
    lumi_put_double(builder, "rotation_worst_degrees", DEGREES * d->worst_rotation);
    lumi_put_string(builder, "worst", r->off[0].name);
    json_builder_set_member_name(builder, "furthest");
    json_builder_begin_array(builder);
    for (int i = 0; i < MIN(listed, d->count); i++) {
        json_builder_begin_object(builder);
        lumi_put_string(builder, "name", r->off[i].name);
        lumi_put_double(builder, "position_mm", MM * r->off[i].position);
        lumi_put_double(builder, "rotation_degrees", DEGREES * r->off[i].rotation);
        json_builder_end_object(builder);
    }
    json_builder_end_array(builder);
    return lumi_put_end(builder, FALSE);
}
