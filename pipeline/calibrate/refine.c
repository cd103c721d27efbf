/* Matching the observations of a bundle anew, in the pictures. */
#include "pipeline/calibrate/refine.h"

#include "pipeline/calibrate/grey.h"
#include "pipeline/calibrate/patch_align.h"
#include "proto/base/memory.h"
#include "proto/base/parallel.h"
#include "proto/base/sort.h"

#include <glib.h>
#include <pthread.h>
#include <string.h>

#define BEST_SIGMA 0.04 /* pixels: what the stretch, the lens and the surface leave where noise leaves nothing */
#define NOISE_MORE 1.5  /* neighbouring pixels' noise is not independent once they were resampled */
#define STRETCH_STEP 3  /* pixels, that the stretch is measured over */
#define STRETCH_MOST 1.45

struct refining {
    const struct lumi_run *run;
    struct lumi_bundle *bundle;
    struct lumi_patch_pixels *patches; /* one an observation */
    int *of, *first;                   /* observations by camera */
    double *moved;                     /* of each observation; −1: it stays */
    pthread_mutex_t lock;              /* guards error and failed */
    struct lumi_error *error;
    int failed; /* the first camera that failed */
};

static int sort_by_camera(struct refining *r, struct lumi_error *error)
{
    const struct lumi_bundle *b = r->bundle;
    const size_t count = (size_t)b->observation_count + 1;

    r->patches = lumi_calloc(count, sizeof *r->patches);
    r->of = lumi_calloc(count, sizeof *r->of);
    r->moved = lumi_calloc(count, sizeof *r->moved);
    r->first = lumi_calloc((size_t)b->camera_count + 2, sizeof *r->first);
    if (!r->patches || !r->of || !r->moved || !r->first)
        return lumi_fail(error, LUMI_ERR_NOMEM, "calibration: not enough memory");
    for (int i = 0; i < b->observation_count; i++) {
        r->moved[i] = -1;
        r->first[b->observations[i].camera + 2] += lumi_bundle_counts(b, i);
    }
    for (int i = 2; i < b->camera_count + 2; i++)
        r->first[i] += r->first[i - 1];
    for (int i = 0; i < b->observation_count; i++)
        if (lumi_bundle_counts(b, i))
            r->of[r->first[b->observations[i].camera + 1]++] = i;
    return LUMI_OK;
}

static int cut_patches(struct refining *r, int camera, struct lumi_error *error)
{
    const struct lumi_bundle *b = r->bundle;
    g_autofree char *path = lumi_run_image(r->run, camera);
    int width, height;
    float *grey;

    if (r->first[camera] == r->first[camera + 1])
        return LUMI_OK;
    LUMI_TRY(lumi_grey_read(path, &grey, &width, &height, error));
    for (int k = r->first[camera]; k < r->first[camera + 1]; k++) {
        const struct lumi_bundle_observation *o = &b->observations[r->of[k]];
        lumi_patch_cut(grey, width, height, o->x, o->y, &r->patches[r->of[k]]);
    }
    lumi_free(grey);
    return LUMI_OK;
}

static int cut_one(void *context, int camera, int thread)
{
    struct refining *r = context;
    struct lumi_error error = {0};
    const int code = cut_patches(r, camera, &error);

    (void)thread;
    pthread_mutex_lock(&r->lock);
    if (code != LUMI_OK && camera < r->failed) {
        r->failed = camera;
        if (r->error)
            *r->error = error;
    }
    pthread_mutex_unlock(&r->lock);
    return code;
}

/* A lens as it stands: given, and how far it was found to be from that. */
static struct lumi_lens lens_now(const struct lumi_bundle_lens *l)
{
    double numbers[LUMI_LENS_NUMBERS];
    struct lumi_lens lens = l->lens;

    lumi_lens_numbers(&l->lens, numbers);
    for (int i = 0; i < LUMI_LENS_NUMBERS; i++)
        numbers[i] += l->sigma[i] * l->block[i];
    lumi_lens_from_numbers(numbers, &lens);
    return lens;
}

/* Both cameras of a match, and the point between them. */
struct view_pair {
    struct lumi_lens from, to;
    const struct lumi_pose *from_pose, *to_pose;
    struct lumi_vec3 normal, point; /* of the plane the surface is taken to be: towards the first camera; point · w */
    double w;                       /* inverse distance that goes with `point`, from its anchor */
    struct lumi_vec3 anchor;
};

/* Where (x, y) of the first picture, on the plane, is in the second. */
static bool carry(const struct view_pair *v, double x, double y, double at[2])
{
    struct lumi_vec3 direction;

    if (!lumi_lens_unproject(&v->from, x, y, &direction))
        return false;
    direction = lumi_rotate(v->from_pose->r, direction);
    /* Homogeneous: the plane n · (X − P) = 0 with P = anchor + point / w, and X = centre + s · direction. */
    const struct lumi_vec3 to_point =
        lumi_add(v->point, lumi_scale(lumi_sub(v->anchor, v->from_pose->t), v->w)); /* (P − centre) w */
    const double across = lumi_dot(v->normal, direction),
                 depth = lumi_dot(v->normal, to_point); /* s w = depth/across */
    if (!(across * depth > 0))
        return false;
    const struct lumi_vec3 seen =
        lumi_add(lumi_scale(direction, depth / across), lumi_scale(lumi_sub(v->from_pose->t, v->to_pose->t), v->w));
    return lumi_lens_project(&v->to, lumi_rotate_back(v->to_pose->r, seen), &at[0], &at[1]);
}

static bool stretch_of(const struct view_pair *v, double x, double y, double stretch[4])
{
    double a[2], b[2], c[2], d[2];
    const double h = STRETCH_STEP;

    if (!carry(v, x - h, y, a) || !carry(v, x + h, y, b) || !carry(v, x, y - h, c) || !carry(v, x, y + h, d))
        return false;
    stretch[0] = (b[0] - a[0]) / (2 * h);
    stretch[2] = (b[1] - a[1]) / (2 * h);
    stretch[1] = (d[0] - c[0]) / (2 * h);
    stretch[3] = (d[1] - c[1]) / (2 * h);
    for (int i = 0; i < 4; i++)
        if (!(fabs(stretch[i]) < STRETCH_MOST))
            return false;
    return fabs(stretch[0] * stretch[3] - stretch[1] * stretch[2]) > 1 / (STRETCH_MOST * STRETCH_MOST);
}

/* The observation the others are matched against: from the middle of all, so that none is seen much otherwise. −1. */
static int middle_of(const struct refining *r, int point)
{
    const struct lumi_bundle *b = r->bundle;
    struct lumi_vec3 sum = {0, 0, 0};
    double best = INFINITY;
    int count = 0, middle = -1;

    for (int i = b->first[point]; i < b->first[point + 1]; i++)
        if (lumi_bundle_counts(b, i)) {
            sum = lumi_add(sum, b->cameras[b->observations[i].camera].pose.t);
            count++;
        }
    for (int i = b->first[point]; i < b->first[point + 1]; i++) {
        if (!lumi_bundle_counts(b, i) || !r->patches[i].there)
            continue;
        const struct lumi_vec3 at = b->cameras[b->observations[i].camera].pose.t;
        const double away = lumi_length(lumi_sub(at, lumi_scale(sum, 1.0 / count)));
        if (away < best) {
            best = away;
            middle = i;
        }
    }
    return middle;
}

static bool match(struct refining *r, int point, int reference, int other)
{
    struct lumi_bundle *b = r->bundle;
    const struct lumi_bundle_observation *from = &b->observations[reference];
    struct lumi_bundle_observation *to = &b->observations[other];
    const struct lumi_bundle_camera *a = &b->cameras[from->camera], *c = &b->cameras[to->camera];
    const struct lumi_bundle_point *p = &b->points[point];
    struct view_pair pair = {.from = lens_now(&b->lenses[a->lens]),
                             .to = lens_now(&b->lenses[c->lens]),
                             .from_pose = &a->pose,
                             .to_pose = &c->pose,
                             .point = lumi_bundle_ray(p),
                             .w = p->block[2],
                             .anchor = p->anchor};
    struct lumi_patch_match found = {.x = to->x, .y = to->y};
    double stretch[4];

    if (!lumi_lens_unproject(&pair.from, from->x, from->y, &pair.normal))
        return false;
    pair.normal = lumi_rotate(a->pose.r, pair.normal);
    if (!stretch_of(&pair, from->x, from->y, stretch) ||
        !lumi_patch_align(&r->patches[reference], from->x, from->y, &r->patches[other], stretch, &found))
        return false;
    r->moved[other] = hypot(found.x - to->x, found.y - to->y);
    to->x = found.x;
    to->y = found.y;
    to->sigma = hypot(BEST_SIGMA, NOISE_MORE * found.sigma);
    return true;
}

static int match_point(void *context, int point, int thread)
{
    struct refining *r = context;
    const struct lumi_bundle *b = r->bundle;
    const int reference = b->points[point].used ? middle_of(r, point) : -1;
    bool any = false;

    (void)thread;
    if (reference < 0)
        return LUMI_OK;
    for (int i = b->first[point]; i < b->first[point + 1]; i++)
        if (i != reference && lumi_bundle_counts(b, i) && r->patches[i].there)
            any = match(r, point, reference, i) || any;
    if (any) {
        r->moved[reference] = 0;
        b->observations[reference].sigma = BEST_SIGMA;
    }
    return LUMI_OK;
}

static void count_all(struct refining *r, struct lumi_refined *refined)
{
    int moved = 0;

    *refined = (struct lumi_refined){0};
    for (int i = 0; i < r->bundle->observation_count; i++) {
        refined->left += lumi_bundle_counts(r->bundle, i) && r->moved[i] < 0;
        refined->matched += r->moved[i] >= 0;
        if (r->moved[i] > 0)
            r->moved[moved++] = r->moved[i];
    }
    refined->moved = lumi_sort_median(r->moved, moved);
}

int lumi_refine(const struct lumi_run *run, struct lumi_bundle *b, struct lumi_refined *refined,
                struct lumi_error *error)
{
    struct refining r = {
        .run = run, .bundle = b, .lock = PTHREAD_MUTEX_INITIALIZER, .error = error, .failed = G_MAXINT};
    int code = sort_by_camera(&r, error);

    if (code == LUMI_OK)
        code = lumi_parallel_for(b->camera_count, run->threads, cut_one, &r);
    if (code == LUMI_OK)
        code = lumi_parallel_for(b->point_count, run->threads, match_point, &r);
    if (code == LUMI_OK)
        count_all(&r, refined);
    lumi_free(r.patches);
    lumi_free(r.of);
    lumi_free(r.first);
    lumi_free(r.moved);
    return code;
}
