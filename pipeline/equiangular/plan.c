/* The choice of the views' lens (Overbeck et al. 2018, section 7.1, "Equiangular conversion"). */
#include "pipeline/equiangular/plan.h"

#include "proto/base/memory.h"

#include <math.h>

#define DEGREE (LUMI_PI / 180)
#define PINHOLE_FOV (75 * DEGREE) /* narrower pinholes keep their pixels: their tangents hardly stretch */
#define NARROWEST_FOV (0.1 * DEGREE)
#define LARGEST_FOV (150 * DEGREE) /* of a view: beyond it the tangents of the outer tiles grow without use */

static bool plain_pinhole(const struct lumi_lens *lens)
{
    return lens->model == LUMI_LENS_BROWN && lens->k1 == 0 && lens->k2 == 0 && lens->k3 == 0 && lens->p1 == 0 &&
           lens->p2 == 0;
}

static double pinhole_fov(double f, double c, int size)
{
    return atan2(c, f) + atan2(size - c, f);
}

/* Whether the image holds the direction with these tangents. Half a pixel of grace at its edge: resampling repeats the
 * outermost pixels. */
static bool holds(const struct lumi_lens *lens, double tan_x, double tan_y)
{
    double x, y;

    return lumi_lens_project(lens, lumi_vec3(tan_x, tan_y, 1), &x, &y) && x >= -0.5 && y >= -0.5 &&
           x <= lens->width + 0.5 && y <= lens->height + 0.5;
}

/* Whether every image holds the whole rim of a fov_x × fov_y view (and then its inside: images are convex enough). */
static bool covered(const struct lumi_lens *lenses, int count, double fov_x, double fov_y)
{
    enum { STEPS = 32 };

    for (int i = 0; i < count; i++)
        for (int k = -STEPS; k <= STEPS; k++) {
            double x = tan(fov_x / 2), y = tan(fov_y / 2), share = (double)k / STEPS;
            double across = tan(share * fov_x / 2), down = tan(share * fov_y / 2);
            if (!holds(&lenses[i], across, -y) || !holds(&lenses[i], across, y) || !holds(&lenses[i], -x, down) ||
                !holds(&lenses[i], x, down))
                return false;
        }
    return true;
}

/* The widest angle on both sides of the axis that every image holds along one image axis. */
static double axis_cover(const struct lumi_lens *lenses, int count, bool vertical)
{
    double cover = LARGEST_FOV / 2;

    for (int i = 0; i < count; i++) {
        double low = 0, high = cover;
        for (int side = -1; side <= 1; side += 2) {
            low = 0;
            for (int k = 0; k < 60; k++) {
                double middle = k == 0 ? high : (low + high) / 2;
                double t = side * tan(middle);
                if (holds(&lenses[i], vertical ? 0 : t, vertical ? t : 0))
                    low = middle;
                else
                    high = middle;
                if (low == high)
                    break;
            }
            high = low;
        }
        cover = low;
    }
    return 2 * cover;
}

/* Fields of view not given (0) become the widest that are covered, both by the same share of what the axes allow. */
static int choose_fov(const struct lumi_lens *lenses, int count, double *fov_x, double *fov_y, struct lumi_error *error)
{
    const double x = *fov_x > 0 ? *fov_x : axis_cover(lenses, count, false);
    const double y = *fov_y > 0 ? *fov_y : axis_cover(lenses, count, true);
    const bool fixed_x = *fov_x > 0, fixed_y = *fov_y > 0;
    double low = 0, high = 1;

    if (x > LARGEST_FOV || y > LARGEST_FOV)
        return lumi_fail(error, LUMI_ERR_ARG, "a field of view of %.1f° × %.1f° is over the limit of %.0f°", x / DEGREE,
                         y / DEGREE, LARGEST_FOV / DEGREE);
    for (int k = 0; k < 40; k++) {
        double s = k == 0 ? 1 : (low + high) / 2;
        if (covered(lenses, count, fixed_x ? x : s * x, fixed_y ? y : s * y))
            low = s;
        else
            high = s;
        if (low == high)
            break;
    }
    if (!fixed_x && !fixed_y && low * fmin(x, y) < NARROWEST_FOV)
        return lumi_fail(
            error, LUMI_ERR_FORMAT,
            "the images see no more than %.2g° × %.2g° about their lenses' axes: is the middle outside the "
            "image, or the distortion too strong?",
            low * x / DEGREE, low * y / DEGREE);
    if (low == 0)
        return lumi_fail(error, LUMI_ERR_ARG,
                         "the images do not cover a field of view of %.1f° × %.1f°; along their axes they cover "
                         "%.1f° × %.1f°",
                         x / DEGREE, y / DEGREE, axis_cover(lenses, count, false) / DEGREE,
                         axis_cover(lenses, count, true) / DEGREE);
    *fov_x = fixed_x ? x : low * x;
    *fov_y = fixed_y ? y : low * y;
    return LUMI_OK;
}

/* The multiple of a tile nearest to `pixels`. */
static int tile_size(double pixels)
{
    double tiles = floor(pixels / LUMI_TILE + 0.5);

    return LUMI_TILE * (int)fmax(1, fmin(tiles, LUMI_GRID_MAX + 1));
}

static int choose_resampled(const struct lumi_lens *lenses, int count, enum lumi_projection projection, double fov_x,
                            double fov_y, double pixels_per_degree, struct lumi_grid *grid, struct lumi_error *error)
{
    double density = pixels_per_degree / DEGREE;
    bool good;

    if (!(density > 0))
        for (int i = 0; i < count; i++)
            density = fmax(density, sqrt(lenses[i].fx * lenses[i].fy));
    LUMI_TRY(choose_fov(lenses, count, &fov_x, &fov_y, error));
    if (projection == LUMI_PROJECTION_RECTILINEAR) {
        double x = tan(fov_x / 2), y = tan(fov_y / 2);
        int width = tile_size(2 * x * density), height = tile_size(2 * y * density);
        good =
            lumi_grid_init_pinhole(grid, width, height, width / (2 * x), height / (2 * y), width / 2.0, height / 2.0);
    } else {
        good = lumi_grid_init_equiangular(grid, tile_size(fov_x * density), tile_size(fov_y * density), fov_x, fov_y);
    }
    if (!good)
        return lumi_fail(error, LUMI_ERR_ARG,
                         "views of %.1f° × %.1f° with %.1f pixels a degree are over %d pixels a side", fov_x / DEGREE,
                         fov_y / DEGREE, density * DEGREE, LUMI_TILE * LUMI_GRID_MAX);
    return LUMI_OK;
}

int lumi_equiangular_choose(const struct lumi_lens *lenses, int count, enum lumi_projection projection, double fov_x,
                            double fov_y, double pixels_per_degree, struct lumi_grid *grid, struct lumi_error *error)
{
    bool keep = projection != LUMI_PROJECTION_EQUIANGULAR && fov_x == 0 && fov_y == 0 && pixels_per_degree == 0;

    if (count < 1 || !(fov_x >= 0) || !(fov_y >= 0) || !(pixels_per_degree >= 0))
        return lumi_fail(error, LUMI_ERR_ARG, "views: no images, or a field of view or density below 0");
    for (int i = 0; i < count; i++) {
        if (!lumi_lens_valid(&lenses[i]) || lenses[i].model == LUMI_LENS_EQUIRECTANGULAR)
            return lumi_fail(error, LUMI_ERR_UNSUPPORTED, "views cannot be made from images with this lens");
        keep = keep && plain_pinhole(&lenses[i]) && lumi_lens_equal(&lenses[i], &lenses[0]);
    }
    const struct lumi_lens *lens = &lenses[0];
    if (keep && projection == LUMI_PROJECTION_AUTO)
        keep = pinhole_fov(lens->fx, lens->cx, lens->width) < PINHOLE_FOV &&
               pinhole_fov(lens->fy, lens->cy, lens->height) < PINHOLE_FOV;
    if (keep && lumi_grid_init_pinhole(grid, lens->width, lens->height, lens->fx, lens->fy, lens->cx, lens->cy))
        return LUMI_OK;
    return choose_resampled(lenses, count, projection, fov_x, fov_y, pixels_per_degree, grid, error);
}

int lumi_equiangular_plan(struct lumi_run *run, struct lumi_error *error)
{
    const struct lumi_parameters *p = &run->parameters;
    struct lumi_lens *lenses = lumi_alloc((size_t)run->count + 1, sizeof *lenses);
    int count = 0;

    if (!lenses)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: out of memory", run->capture);
    for (int i = 0; i < run->dense; i++) {
        int k = count - 1;
        while (k >= 0 && !lumi_lens_equal(&lenses[k], &run->sources[i].lens))
            k--;
        if (k < 0)
            lenses[count++] = run->sources[i].lens;
    }
    int result = lumi_equiangular_choose(lenses, count, p->projection, p->fov_x, p->fov_y, p->pixels_per_degree,
                                         &run->grid, error);
    lumi_free(lenses);
    return result == LUMI_OK ? LUMI_OK : lumi_fail_prefix(error, "%s", run->capture);
}
