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

static struct mvs_planes choose_planes(const struct lumi_mvs_view *view, int count,
                                       const struct lumi_mvs_view *neighbours, double low, double high, double step_px)
{
    double longest = 0;

    for (int n = 0; n < count; n++)
        for (int i = 0; i < 25; i++)
            longest = fmax(longest, travel(view, &neighbours[n], view->grid->width * (0.1 + 0.2 * (i % 5)),
                                           view->grid->height * (0.1 + 0.2 * (i / 5)), low, high));
    int planes = (int)fmin(ceil(longest / step_px) + 1, MVS_PLANES_MAX);
    planes = (planes + 2 * MVS_LANES - 1) / (2 * MVS_LANES) * (2 * MVS_LANES);
    return (struct mvs_planes){low, (high - low) / (planes - 1), planes};
}

static void level_finish(struct mvs_level *level)
{
    lumi_free(level->chosen);
    memset(level, 0, sizeof(*level));
}

/* Sweep and choice at 1/divisor of the size, of the planes that `half`, a level of half the size, suggests, or of all
 * (NULL). */
static int match_at(const struct lumi_mvs_view *view, int count, const struct lumi_mvs_view *neighbours, int divisor,
                    const struct mvs_planes *planes, const struct mvs_level *half, int threads, struct mvs_level *level)
{
    struct mvs_image image = {0};
    struct mvs_search search = {0};
    struct mvs_target *targets = lumi_calloc((size_t)count, sizeof(*targets));
    uint8_t *volume = NULL;
    int code = LUMI_ERR_NOMEM;

    *level = (struct mvs_level){view->grid->width / divisor, view->grid->height / divisor, *planes, NULL};
    level->chosen = lumi_alloc((size_t)level->width * (size_t)level->height, sizeof(float));
    if (!targets || !level->chosen)
        goto done;
    if (half)
        LUMI_GOTO(code, done, mvs_search_from(&search, level->width, level->height, planes, half));
    else
        LUMI_GOTO(code, done, mvs_search_all(&search, level->width, level->height, planes->count));
    LUMI_GOTO(code, done, mvs_image_init(&image, view, divisor));
    for (int n = 0; n < count; n++)
        LUMI_GOTO(code, done, mvs_target_init(&targets[n], view, &neighbours[n], divisor));
    code = LUMI_ERR_NOMEM;
    volume = lumi_alloc(search.size, 1);
    if (!volume)
        goto done;
    LUMI_GOTO(code, done, mvs_volume(&image, count, targets, planes, &search, threads, volume));
    LUMI_GOTO(code, done, mvs_sgm(&image, volume, &search, threads, level->chosen));
done:
    lumi_free(volume);
    for (int n = 0; targets && n < count; n++)
        mvs_target_finish(&targets[n]);
    lumi_free(targets);
    mvs_search_finish(&search);
    mvs_image_finish(&image);
    if (code != LUMI_OK)
        level_finish(level);
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

/* Narrows [low, high] to the depths found at low resolution, less one in two thousand at either end. */
static void narrow_range(const struct mvs_level *level, double *low, double *high)
{
    const long pixels = (long)level->width * level->height, few = pixels / 2000 + 1;
    const struct mvs_planes *planes = &level->planes;
    long histogram[MVS_PLANES_MAX] = {0}, sum = 0;
    int first = 0, last = planes->count - 1;

    for (long i = 0; i < pixels; i++)
        histogram[(int)(level->chosen[i] + 0.5f)]++;
    for (sum = histogram[first]; first < last && sum < few;)
        sum += histogram[++first];
    for (sum = histogram[last]; last > first && sum < few;)
        sum += histogram[--last];
    *low = fmax(*low, planes->first + (first - 3) * planes->step);
    *high = fmin(*high, planes->first + (last + 3) * planes->step);
}

/* The search at low resolution; where nobody stated the range of depths, it finds that as well. */
static int match_coarse(const struct lumi_mvs_view *view, int count, const struct lumi_mvs_view *neighbours,
                        bool find_range, int threads, double *low, double *high, struct mvs_level *level)
{
    double before = INFINITY;

    if (view->grid->width / COARSE < 16 || view->grid->height / COARSE < 16)
        return LUMI_OK;
    for (int i = 0; i < (find_range ? ROUNDS_MAX : 1) && *high - *low < before / NARROWED; i++) {
        const struct mvs_planes planes = choose_planes(view, count, neighbours, *low, *high, 0.8 * COARSE);
        before = *high - *low;
        level_finish(level);
        LUMI_TRY(match_at(view, count, neighbours, COARSE, &planes, NULL, threads, level));
        if (find_range)
            narrow_range(level, low, high);
    }
    return LUMI_OK;
}

/* The whole search, from coarse to fine. */
static int match(const struct lumi_mvs_view *view, int count, const struct lumi_mvs_view *neighbours,
                 const struct lumi_mvs_settings *settings, int threads, double low, double high,
                 struct mvs_level *level)
{
    const bool find_range = !(settings->near_m > 0) || !(settings->far_m > 0);
    struct mvs_level coarse = {0}, half = {0};
    int code;

    LUMI_GOTO(code, done, match_coarse(view, count, neighbours, find_range, threads, &low, &high, &coarse));
    const struct mvs_planes planes = choose_planes(view, count, neighbours, low, high, settings->step_px);
    const struct mvs_planes half_planes = {planes.first, 2 * planes.step, planes.count / 2};
    LUMI_GOTO(code, done,
              match_at(view, count, neighbours, 2, &half_planes, coarse.chosen ? &coarse : NULL, threads, &half));
    LUMI_GOTO(code, done, match_at(view, count, neighbours, 1, &planes, &half, threads, level));
done:
    level_finish(&coarse);
    level_finish(&half);
    return code;
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
    struct mvs_level level = {0};
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
    if (count > 0)
        LUMI_GOTO(code, done, match(view, count, neighbours, settings, threads, low, high, &level));
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++)
            lumi_row_f32(inverse_depth, y)[x] =
                (float)(count > 0 ? level.planes.first +
                                        (double)level.chosen[(size_t)y * (size_t)width + (size_t)x] * level.planes.step
                                  : low);
    code = LUMI_OK;
done:
    level_finish(&level);
    if (code != LUMI_OK)
        lumi_raster_finish(inverse_depth);
    return code == LUMI_ERR_NOMEM ? lumi_fail(error, code, "depth: out of memory") : code;
}
