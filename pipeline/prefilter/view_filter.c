/* The prefilter of one view: equation 5, tile by tile.
 *
 * Every sample j looks from one place on the disk for the whole picture, and at one place within every pixel. So the
 * rays of a sample stand on a lattice of pixels' pitch, and one ray serves every pixel that its place is within reach
 * of (σ is four pixels wide): equation 5's sum over a pixel's rays takes sixteen of each sample, and over the pixel it
 * is all but an integral. What is left to chance is the place on the disk, where rays of all samples converge if the
 * depth is right.
 *
 * A tile is 29 × 29 pixels, made from 32 × 32 rays: one block of the renderer's. It takes samples by doubling; the
 * halves, each spread evenly over disk and pixel, are estimates of the same integral that differ by twice the standard
 * error of their mean, which is what the decision to go on is made by. */
#include "pipeline/prefilter/view_filter.h"

#include "pipeline/prefilter/aperture.h"
#include "proto/base/memory.h"
#include "proto/base/parallel.h"
#include "render/cpu/dense_cast.h"

#include <string.h>

#define TILE (LUMI_BLOCK - PREFILTER_TAPS + 1)
#define CHANNELS 4        /* red, green, blue, and whether anything is known */
#define KNOWN 0.1f        /* the least share of σ that makes a pixel of a sample */
#define MARGIN LUMI_BLOCK /* tangents kept beyond the picture */

/* Everything about a sample that the tiles share. */
struct pass {
    struct prefilter_sample sample;
    struct lumi_cast_eye *eye;
    float *tan_x, *tan_y; /* of the rays of pixels −MARGIN and on */
};

/* Sums over samples, of a tile's pixels. */
struct sums {
    float value[CHANNELS][TILE * TILE];
};

/* What a thread works in. */
struct scratch {
    float x[LUMI_BLOCK_PIXELS], y[LUMI_BLOCK_PIXELS], z[LUMI_BLOCK_PIXELS];
    float cast[CHANNELS][LUMI_BLOCK_PIXELS];
    float rays[CHANNELS][LUMI_BLOCK][LUMI_BLOCK]; /* a picture of what they see */
    float rows[CHANNELS][LUMI_BLOCK][TILE];       /* filtered along x */
    struct sums first, second;                    /* halves of the samples */
};

struct tile_report {
    int pixels, samples, uncovered;
    float error;
};

struct work {
    const struct lumi_prefilter_view *view;
    const struct lumi_prefilter_settings *settings;
    struct lumi_cast *cast;
    struct pass *passes;
    struct scratch *scratch; /* one a thread */
    struct tile_report *reports;
    struct lumi_raster *result;
    int tile_cols;
};

void lumi_prefilter_defaults(struct lumi_prefilter_settings *settings)
{
    *settings = (struct lumi_prefilter_settings){
        .base = LUMI_PREFILTER_BASE, .most = LUMI_PREFILTER_MOST, .tolerance = 0.5f / 255};
}

static int held(int value, int count)
{
    return value < 0 ? 0 : value >= count ? count - 1 : value;
}

/* Where an axis' samples stand between the surface's pixels: from pixel n + step on, so much of the way. */
static float between(const struct prefilter_axis *axis, int *step)
{
    *step = axis->offset < 0 ? -1 : 0;
    return (float)(axis->offset - *step);
}

/* A row of the surface between two of its own: LUMI_BLOCK + 1 values from pixel x0 on. */
static void surface_row(const struct lumi_raster *surface, int x0, int y, float share, float *row)
{
    const float *top = lumi_row_f32(surface, held(y, surface->height));
    const float *bottom = lumi_row_f32(surface, held(y + 1, surface->height));

    for (int i = 0; i <= LUMI_BLOCK; i++) {
        const int x = held(x0 + i, surface->width);
        row[i] = top[x] + share * (bottom[x] - top[x]);
    }
}

/* The rays of the block whose first pixel is (x0, y0): from the eye through the points of the view's own surface. */
static void fill_rays(const struct work *work, const struct pass *pass, int x0, int y0, struct scratch *s)
{
    const float u = pass->sample.u, v = pass->sample.v;
    int step_x, step_y;
    const float fx = between(&pass->sample.x, &step_x), fy = between(&pass->sample.y, &step_y);
    const float *tan_x = pass->tan_x + x0 + MARGIN;
    float r[9], row[LUMI_BLOCK + 1];

    for (int i = 0; i < 9; i++)
        r[i] = (float)work->view->pose.r[i];
    for (int j = 0; j < LUMI_BLOCK; j++) {
        const float ty = pass->tan_y[y0 + j + MARGIN];
        surface_row(work->view->surface, x0 + step_x, y0 + j + step_y, fy, row);
        for (int cell = 0; cell < LUMI_BLOCK / LUMI_CELL; cell++) {
            const int first = cell * LUMI_CELL, place = (j / LUMI_CELL * (LUMI_BLOCK / LUMI_CELL) + cell);
            float *x = s->x + place * LUMI_CELL_PIXELS + j % LUMI_CELL * LUMI_CELL;
            float *y = s->y + (x - s->x), *z = s->z + (x - s->x);
            for (int i = 0; i < LUMI_CELL; i++) {
                const float a = row[first + i], w = a + fx * (row[first + i + 1] - a);
                const float dx = tan_x[first + i] - w * u, dy = ty - w * v;
                const float scale = 1 / sqrtf(dx * dx + dy * dy + 1);
                x[i] = (r[0] * dx + r[1] * dy + r[2]) * scale;
                y[i] = (r[3] * dx + r[4] * dy + r[5]) * scale;
                z[i] = (r[6] * dx + r[7] * dy + r[8]) * scale;
            }
        }
    }
}

/* What the rays see, out of the renderer's layout. */
static void take_rays(struct scratch *s)
{
    for (int row = 0; row < LUMI_BLOCK_PIXELS / LUMI_CELL; row++) {
        const int cell = row / LUMI_CELL, at = row * LUMI_CELL;
        const int j = cell / (LUMI_BLOCK / LUMI_CELL) * LUMI_CELL + row % LUMI_CELL;
        const int first = cell % (LUMI_BLOCK / LUMI_CELL) * LUMI_CELL;
        float share[LUMI_CELL];
        for (int i = 0; i < LUMI_CELL; i++) {
            const float weight = s->cast[3][at + i];
            share[i] = weight > 1e-6f ? 1 / weight : 0;
            s->rays[3][j][first + i] = weight > 1e-6f ? 1 : 0;
        }
        for (int c = 0; c < 3; c++)
            for (int i = 0; i < LUMI_CELL; i++)
                s->rays[c][j][first + i] = s->cast[c][at + i] * share[i];
    }
}

/* σ, along x and then y, and the sample's ρ. */
static void add_filtered(const struct prefilter_sample *sample, struct scratch *s, struct sums *sums)
{
    const float *hx = sample->x.taps, *hy = sample->y.taps;
    float out[CHANNELS][TILE];

    for (int c = 0; c < CHANNELS; c++)
        for (int j = 0; j < LUMI_BLOCK; j++) {
            const float *in = s->rays[c][j];
            for (int i = 0; i < TILE; i++)
                s->rows[c][j][i] = hx[0] * in[i] + hx[1] * in[i + 1] + hx[2] * in[i + 2] + hx[3] * in[i + 3];
        }
    for (int j = 0; j < TILE; j++) {
        for (int c = 0; c < CHANNELS; c++)
            for (int i = 0; i < TILE; i++)
                out[c][i] = hy[0] * s->rows[c][j][i] + hy[1] * s->rows[c][j + 1][i] + hy[2] * s->rows[c][j + 2][i] +
                            hy[3] * s->rows[c][j + 3][i];
        for (int c = 0; c < CHANNELS; c++)
            for (int i = 0; i < TILE; i++)
                sums->value[c][j * TILE + i] += out[3][i] > KNOWN ? sample->weight * out[c][i] : 0;
    }
}

static void take_samples(const struct work *work, int x0, int y0, int first, int last, struct scratch *s,
                         struct sums *sums)
{
    struct lumi_sums cast = {s->cast[0], s->cast[1], s->cast[2], s->cast[3], NULL};

    memset(sums, 0, sizeof *sums);
    for (int k = first; k < last; k++) {
        const struct pass *pass = &work->passes[k];
        fill_rays(work, pass, x0 + pass->sample.x.start, y0 + pass->sample.y.start, s);
        memset(s->cast, 0, sizeof s->cast);
        lumi_cast_block(work->cast, pass->eye, s->x, s->y, s->z, &cast);
        take_rays(s);
        add_filtered(&pass->sample, s, sums);
    }
}

/* Root mean square over the tile's pixels of the standard error of the halves' mean. */
static float standard_error(const struct scratch *s, int width, int height)
{
    double sum = 0;
    int count = 0;

    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            const int at = y * TILE + x;
            const float a = s->first.value[3][at], b = s->second.value[3][at];
            if (!(a > 0) || !(b > 0))
                continue;
            for (int c = 0; c < 3; c++) {
                const float half = 0.5f * (s->first.value[c][at] / a - s->second.value[c][at] / b);
                sum += (double)half * half;
            }
            count++;
        }
    return count ? (float)sqrt(sum / (3.0 * count)) : 0;
}

static void add_halves(struct scratch *s)
{
    for (int c = 0; c < CHANNELS; c++)
        for (int i = 0; i < TILE * TILE; i++)
            s->first.value[c][i] += s->second.value[c][i];
}

static void write_tile(const struct work *work, int x0, int y0, int width, int height, const struct sums *sums,
                       struct tile_report *report)
{
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            float *to = lumi_row_f32(work->result, y0 + y) + 3 * (x0 + x);
            const float *from = lumi_row_f32(work->view->picture, y0 + y) + 3 * (x0 + x);
            const int at = y * TILE + x;
            const float weight = sums->value[3][at];
            for (int c = 0; c < 3; c++)
                to[c] = weight > 0 ? sums->value[c][at] / weight : from[c];
            report->uncovered += !(weight > 0);
        }
}

static int filter_tile(void *context, int index, int thread)
{
    const struct work *work = context;
    const struct lumi_prefilter_settings *settings = work->settings;
    struct scratch *s = &work->scratch[thread];
    struct tile_report *report = &work->reports[index];
    const int x0 = index % work->tile_cols * TILE, y0 = index / work->tile_cols * TILE;
    const int width = work->result->width - x0 < TILE ? work->result->width - x0 : TILE;
    const int height = work->result->height - y0 < TILE ? work->result->height - y0 : TILE;
    int samples = settings->base;

    take_samples(work, x0, y0, 0, samples / 2, s, &s->first);
    take_samples(work, x0, y0, samples / 2, samples, s, &s->second);
    *report = (struct tile_report){.pixels = width * height, .error = standard_error(s, width, height)};
    while (report->error > settings->tolerance && 2 * samples <= settings->most) {
        add_halves(s);
        take_samples(work, x0, y0, samples, 2 * samples, s, &s->second);
        report->error = standard_error(s, width, height);
        samples *= 2;
    }
    add_halves(s);
    report->samples = samples;
    write_tile(work, x0, y0, width, height, &s->first, report);
    return LUMI_OK;
}

static int make_tangents(const struct lumi_grid *grid, struct pass *pass)
{
    const int across = grid->width + 2 * MARGIN, down = grid->height + 2 * MARGIN;
    double tx, ty;

    pass->tan_x = lumi_alloc((size_t)across, sizeof(float));
    pass->tan_y = lumi_alloc((size_t)down, sizeof(float));
    if (!pass->tan_x || !pass->tan_y)
        return LUMI_ERR_NOMEM;
    for (int i = 0; i < across; i++) {
        lumi_grid_unproject(grid, i - MARGIN + 0.5 + pass->sample.x.offset, 0, &tx, &ty);
        pass->tan_x[i] = (float)tx;
    }
    for (int i = 0; i < down; i++) {
        lumi_grid_unproject(grid, 0, i - MARGIN + 0.5 + pass->sample.y.offset, &tx, &ty);
        pass->tan_y[i] = (float)ty;
    }
    return LUMI_OK;
}

static int make_passes(struct work *work, int count, struct lumi_error *error)
{
    const struct lumi_prefilter_view *view = work->view;
    struct prefilter_sample *samples = lumi_alloc((size_t)count, sizeof *samples);
    int code = LUMI_ERR_NOMEM;

    work->passes = lumi_calloc((size_t)count, sizeof *work->passes);
    if (samples && work->passes)
        code = prefilter_samples(view, work->settings->seed, count, samples);
    for (int i = 0; code == LUMI_OK && i < count; i++) {
        struct pass *pass = &work->passes[i];
        pass->sample = samples[i];
        code = make_tangents(view->grid, pass);
        if (code == LUMI_OK)
            code = lumi_cast_eye_create(
                work->cast, lumi_to_world(&view->pose, lumi_vec3(samples[i].u, samples[i].v, 0)), &pass->eye, NULL);
    }
    lumi_free(samples);
    return code == LUMI_OK ? LUMI_OK : lumi_fail(error, code, "no memory for %d samples", count);
}

static void finish(struct work *work)
{
    for (int i = 0; work->passes && i < work->settings->most; i++) {
        lumi_cast_eye_destroy(work->passes[i].eye);
        lumi_free(work->passes[i].tan_x);
        lumi_free(work->passes[i].tan_y);
    }
    lumi_free(work->passes);
    lumi_free(work->scratch);
    lumi_free(work->reports);
    lumi_cast_destroy(work->cast);
}

static void summarise(const struct work *work, int tiles, struct lumi_prefilter_report *report)
{
    double pixels = 0;

    *report = (struct lumi_prefilter_report){0};
    for (int i = 0; i < tiles; i++) {
        const struct tile_report *tile = &work->reports[i];
        pixels += tile->pixels;
        report->samples += (double)tile->pixels * tile->samples;
        report->error += (double)tile->pixels * tile->error;
        report->rms += (double)tile->pixels * tile->error * tile->error;
        report->over += tile->error > work->settings->tolerance ? tile->pixels : 0;
        report->uncovered += tile->uncovered;
        report->worst = fmax(report->worst, tile->error);
    }
    report->samples /= pixels;
    report->error /= pixels;
    report->rms = sqrt(report->rms / pixels);
    report->over /= pixels;
    report->uncovered /= pixels;
}

static bool power_of_two(int value)
{
    return value >= 2 && !(value & (value - 1));
}

int lumi_prefilter(struct lumi_viewset *dense, const struct lumi_prefilter_view *view,
                   const struct lumi_prefilter_settings *settings, struct lumi_raster *result,
                   struct lumi_prefilter_report *report, struct lumi_error *error)
{
    struct work work = {.view = view, .settings = settings, .result = result};
    const int threads = settings->threads > 0 ? settings->threads : lumi_thread_count();
    const int tile_rows = (view->grid->height + TILE - 1) / TILE;
    int code;

    *result = (struct lumi_raster){0};
    if (!power_of_two(settings->base) || !power_of_two(settings->most) || settings->most < settings->base)
        return lumi_fail(error, LUMI_ERR_ARG, "%d to %d samples: not powers of two, or not in this order",
                         settings->base, settings->most);
    work.tile_cols = (view->grid->width + TILE - 1) / TILE;
    LUMI_TRY(lumi_cast_create(dense, NULL, &work.cast, error));
    LUMI_GOTO(code, done, make_passes(&work, settings->most, error));
    work.scratch = lumi_calloc((size_t)threads, sizeof *work.scratch);
    work.reports = lumi_calloc((size_t)(work.tile_cols * tile_rows), sizeof *work.reports);
    if (!work.scratch || !work.reports ||
        lumi_raster_create(result, view->grid->width, view->grid->height, 3, LUMI_F32) != LUMI_OK) {
        code = lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a view of %d×%d", view->grid->width, view->grid->height);
        goto done;
    }
    code = lumi_parallel_for(work.tile_cols * tile_rows, threads, filter_tile, &work);
    if (report)
        summarise(&work, work.tile_cols * tile_rows, report);
done:
    finish(&work);
    if (code != LUMI_OK)
        lumi_raster_finish(result);
    return code;
}
