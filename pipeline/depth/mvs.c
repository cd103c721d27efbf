/* The first pass: which planes, then sweep and choice. */
#include "pipeline/depth/mvs_priv.h"
#include "proto/base/memory.h"

#include <math.h>
#include <string.h>

#define NEAREST_SEARCHED 0.25 /* metres, where nobody says how near things are */
/* But poses need not be in metres: in terms of the longest baseline, that is kept between these. */
#define LEAST_BASELINES 0.3
#define MOST_BASELINES 3.0

enum { COARSE = 4 };   /* the range of depths is found at a quarter of the size */
enum { NARROWED = 8 }; /* a range that shrinks so much was searched in steps that are too wide */
enum { ROUNDS_MAX = 4 };

struct plane_range {
    double first, step; /* w of plane 0, and between planes */
    int planes;
};

void lumi_mvs_defaults(struct lumi_mvs_settings *settings)
{
    *settings = (struct lumi_mvs_settings){.step_px = 0.6};
}

/* How far, in pixels, an image point moves in the neighbour while w goes from low to high. */
static double travel(const struct lumi_mvs_view *view, const struct lumi_mvs_view *neighbour, double x, double y,
                     double low, double high)
{
    enum { STEPS = 32 };
    double tan_x, tan_y, sum = 0, last_x = 0, last_y = 0;
    bool had = false;

    lumi_grid_unproject(view->grid, x, y, &tan_x, &tan_y);
    struct lumi_vec3 ray = lumi_rotate(view->pose.r, lumi_vec3(tan_x, tan_y, 1));
    struct lumi_vec3 shift = lumi_sub(view->pose.t, neighbour->pose.t);
    for (int i = 0; i <= STEPS; i++) {
        double w = low + (high - low) * i / STEPS, at_x = 0, at_y = 0;
        struct lumi_vec3 direction = lumi_rotate_back(neighbour->pose.r, lumi_add(ray, lumi_scale(shift, w)));
        bool inside = lumi_grid_project(neighbour->grid, direction, &at_x, &at_y) && at_x >= 0 && at_y >= 0 &&
                      at_x <= neighbour->grid->width && at_y <= neighbour->grid->height;
        if (inside && had)
            sum += hypot(at_x - last_x, at_y - last_y);
        had = inside;
        last_x = at_x;
        last_y = at_y;
    }
    return sum;
}

static struct plane_range choose_planes(const struct lumi_mvs_view *view, int count,
                                        const struct lumi_mvs_view *neighbours, double low, double high, double step_px,
                                        int most)
{
    double longest = 0;

    for (int n = 0; n < count; n++)
        for (int i = 0; i < 25; i++)
            longest = fmax(longest, travel(view, &neighbours[n], view->grid->width * (0.1 + 0.2 * (i % 5)),
                                           view->grid->height * (0.1 + 0.2 * (i / 5)), low, high));
    int planes = (int)fmin(ceil(longest / step_px) + 1, most);
    planes = (planes + 15) / 16 * 16;
    return (struct plane_range){low, (high - low) / (planes - 1), planes};
}

/* Sweep and choice at 1/divisor of the size; result in planes. */
static int match_at(const struct lumi_mvs_view *view, int count, const struct lumi_mvs_view *neighbours, int divisor,
                    const struct plane_range *range, int threads, float *result)
{
    struct mvs_image image = {0};
    struct mvs_target *targets = lumi_calloc((size_t)count, sizeof(*targets));
    uint8_t *volume = NULL;
    int code = LUMI_ERR_NOMEM;

    if (!targets)
        goto done;
    LUMI_GOTO(code, done, mvs_image_init(&image, view, divisor));
    for (int n = 0; n < count; n++) {
        LUMI_GOTO(code, done, mvs_target_init(&targets[n], view, &neighbours[n], divisor));
        mvs_target_planes(&targets[n], range->planes, (float)range->first, (float)range->step);
    }
    code = LUMI_ERR_NOMEM;
    volume = lumi_alloc((size_t)image.width * (size_t)image.height, (size_t)range->planes);
    if (!volume)
        goto done;
    LUMI_GOTO(code, done, mvs_volume(&image, count, targets, range->planes, threads, volume));
    LUMI_GOTO(code, done, mvs_sgm(&image, volume, range->planes, threads, result));
done:
    lumi_free(volume);
    for (int n = 0; targets && n < count; n++)
        mvs_target_finish(&targets[n]);
    lumi_free(targets);
    mvs_image_finish(&image);
    return code;
}

/* Inverse depth of the nearest surface that is looked for. */
static double nearest_searched(const struct lumi_mvs_view *view, int count, const struct lumi_mvs_view *neighbours)
{
    double longest = 0;

    for (int n = 0; n < count; n++)
        longest = fmax(longest, lumi_length(lumi_sub(neighbours[n].pose.t, view->pose.t)));
    if (!(longest > 0))
        return 1 / NEAREST_SEARCHED;
    return 1 / fmin(fmax(NEAREST_SEARCHED, LEAST_BASELINES * longest), MOST_BASELINES * longest);
}

/* Narrows [low, high] to the depths that a search at low resolution finds, less one in two thousand at either end. */
static int narrow_range(const struct lumi_mvs_view *view, int count, const struct lumi_mvs_view *neighbours,
                        int threads, double *low, double *high)
{
    const int width = view->grid->width / COARSE, height = view->grid->height / COARSE;
    const long pixels = (long)width * height, few = pixels / 2000 + 1;
    struct plane_range range = choose_planes(view, count, neighbours, *low, *high, 0.8 * COARSE, MVS_PLANES_MAX);
    long histogram[MVS_PLANES_MAX] = {0}, sum = 0;
    int first = 0, last = range.planes - 1;
    float *coarse;

    if (width < 16 || height < 16)
        return LUMI_OK;
    coarse = lumi_alloc((size_t)pixels, sizeof(float));
    if (!coarse)
        return LUMI_ERR_NOMEM;
    int code = match_at(view, count, neighbours, COARSE, &range, threads, coarse);
    for (long i = 0; code == LUMI_OK && i < pixels; i++)
        histogram[(int)(coarse[i] + 0.5f)]++;
    for (sum = histogram[first]; first < last && sum < few;)
        sum += histogram[++first];
    for (sum = histogram[last]; last > first && sum < few;)
        sum += histogram[--last];
    double w_low = range.first + (first - 3) * range.step, w_high = range.first + (last + 3) * range.step;
    *low = fmax(*low, w_low);
    *high = fmin(*high, w_high);
    lumi_free(coarse);
    return code;
}

static int find_range(const struct lumi_mvs_view *view, int count, const struct lumi_mvs_view *neighbours, int threads,
                      double *low, double *high)
{
    double before = INFINITY;

    for (int i = 0; i < ROUNDS_MAX && *high - *low < before / NARROWED; i++) {
        before = *high - *low;
        LUMI_TRY(narrow_range(view, count, neighbours, threads, low, high));
    }
    return LUMI_OK;
}

int mvs_check(const struct lumi_mvs_view *view, bool depth, struct lumi_error *error)
{
    if (!lumi_grid_valid(view->grid) || !lumi_pose_valid(&view->pose, 1e-3))
        return lumi_fail(error, LUMI_ERR_ARG, "depth: a view's lens or pose is not valid");
    if (view->image.channels != 3 || view->image.sample != LUMI_U8 || view->image.width != view->grid->width ||
        view->image.height != view->grid->height)
        return lumi_fail(error, LUMI_ERR_ARG, "depth: a view's image is not 8 bit RGB of its grid's size");
    if (depth && (view->depth.channels != 1 || view->depth.sample != LUMI_F32 ||
                  view->depth.width != view->grid->width || view->depth.height != view->grid->height))
        return lumi_fail(error, LUMI_ERR_ARG, "depth: a view's map is not one float channel of its grid's size");
    return LUMI_OK;
}

int lumi_mvs_match(const struct lumi_mvs_view *view, int count, const struct lumi_mvs_view *neighbours,
                   const struct lumi_mvs_settings *settings, int threads, struct lumi_raster *inverse_depth,
                   struct lumi_error *error)
{
    double low = settings->far_m > 0 ? 1 / settings->far_m : 0;
    double high =
        settings->near_m > 0 ? 1 / settings->near_m : fmax(nearest_searched(view, count, neighbours), 2 * low);
    float *planes = NULL;
    int code;

    memset(inverse_depth, 0, sizeof(*inverse_depth));
    if (!(high > low))
        return lumi_fail(error, LUMI_ERR_ARG, "depth: the nearest distance must be less than the farthest");
    if (count < 0 || count > LUMI_MVS_NEIGHBOURS)
        return lumi_fail(error, LUMI_ERR_ARG, "depth: %d neighbours, at most %d can be matched", count,
                         LUMI_MVS_NEIGHBOURS);
    LUMI_TRY(mvs_check(view, false, error));
    for (int n = 0; n < count; n++)
        LUMI_TRY(mvs_check(&neighbours[n], false, error));
    const int width = view->grid->width, height = view->grid->height;
    LUMI_GOTO(code, done, lumi_raster_create(inverse_depth, width, height, 1, LUMI_F32));
    struct plane_range range = {low, 0, 16};
    code = LUMI_ERR_NOMEM;
    planes = lumi_calloc((size_t)width * (size_t)height, sizeof(float));
    if (!planes)
        goto done;
    if (count > 0) {
        if (!(settings->near_m > 0) || !(settings->far_m > 0))
            LUMI_GOTO(code, done, find_range(view, count, neighbours, threads, &low, &high));
        range = choose_planes(view, count, neighbours, low, high, settings->step_px, MVS_PLANES_MAX);
        LUMI_GOTO(code, done, match_at(view, count, neighbours, 1, &range, threads, planes));
    }
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++)
            lumi_row_f32(inverse_depth, y)[x] =
                (float)(range.first + (double)planes[(size_t)y * (size_t)width + (size_t)x] * range.step);
    code = LUMI_OK;
done:
    lumi_free(planes);
    if (code != LUMI_OK)
        lumi_raster_finish(inverse_depth);
    return code == LUMI_ERR_NOMEM ? lumi_fail(error, code, "depth: out of memory") : code;
}
