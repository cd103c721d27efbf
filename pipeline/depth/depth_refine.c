/* The second pass: what the neighbours' maps confirm is kept, the rest is filled, and edges of depth move to edges of
 * colour. */
#include "pipeline/depth/mvs_priv.h"
#include "proto/base/memory.h"
#include "proto/base/parallel.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { RADIUS = 6, BINS = 64, COLOURS = 766 };

#define AGREE_PX 1.0f  /* two maps agree where they put a point so close together */
#define EDGE_PX 1.5f   /* a pixel whose surroundings differ by more lies at an edge */
#define COLOUR_FALL 16 /* sum of differences of R, G and B at which a pixel's say falls to 1/e */

/* A neighbour's map and the way into it. */
struct confirmer {
    const struct lumi_raster *depth;
    struct mvs_axis x, y;
    float rotation[9], shift[3];
    float tolerance; /* of w: AGREE_PX in that neighbour */
};

struct refine_job {
    const struct lumi_mvs_view *view;
    struct confirmer *confirmers;
    int count;
    float tolerance; /* of w: a pixel in the neighbour that has the longest baseline */
    float *fused;    /* median of what this map and those that agree with it say */
    uint8_t *sure;
    struct lumi_raster *result;
    float say[COLOURS];
};

static float pixel_pitch(const struct lumi_grid *grid)
{
    const int middle = grid->cols / 2;

    return (float)((grid->tan_x[middle + 1 <= grid->cols ? middle + 1 : middle] -
                    grid->tan_x[middle + 1 <= grid->cols ? middle : middle - 1]) /
                   LUMI_TILE);
}

static void init_confirmer(struct confirmer *confirmer, const struct lumi_mvs_view *view,
                           const struct lumi_mvs_view *neighbour)
{
    const struct lumi_vec3 shift = lumi_to_camera(&neighbour->pose, view->pose.t);

    confirmer->depth = &neighbour->depth;
    mvs_axis_init(&confirmer->x, neighbour->grid->tan_x, neighbour->grid->cols, 1);
    mvs_axis_init(&confirmer->y, neighbour->grid->tan_y, neighbour->grid->rows, 1);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            confirmer->rotation[3 * i + j] = (float)lumi_dot(lumi_axis(&neighbour->pose, i), lumi_axis(&view->pose, j));
    confirmer->shift[0] = (float)shift.x;
    confirmer->shift[1] = (float)shift.y;
    confirmer->shift[2] = (float)shift.z;
    confirmer->tolerance = AGREE_PX * pixel_pitch(view->grid) / (float)fmax(lumi_length(shift), 1e-6);
}

/* What a neighbour says about the point at inverse depth w of a ray: its inverse depth there, in this view's terms.
 * False where it does not see the place. */
static bool ask(const struct confirmer *confirmer, float tan_x, float tan_y, float w, float *said)
{
    float q[3];

    for (int i = 0; i < 3; i++) {
        const float *r = confirmer->rotation + 3 * i;
        q[i] = r[0] * tan_x + r[1] * tan_y + r[2] + w * confirmer->shift[i];
    }
    if (!(q[2] > 1e-6f))
        return false;
    const float scale = 1 / q[2];
    const float x = mvs_axis_position(&confirmer->x, q[0] * scale) + 1;
    const float y = mvs_axis_position(&confirmer->y, q[1] * scale) + 1;
    if (!(x >= 0 && y >= 0 && x < 2 * (float)confirmer->depth->width && y < 2 * (float)confirmer->depth->height))
        return false;
    *said = lumi_row_f32(confirmer->depth, (int)(0.5f * y))[(int)(0.5f * x)] * q[2];
    return true;
}

static float median(float *values, int count)
{
    for (int i = 1; i < count; i++) {
        float value = values[i];
        int at = i;
        for (; at > 0 && values[at - 1] > value; at--)
            values[at] = values[at - 1];
        values[at] = value;
    }
    return count & 1 ? values[count / 2] : 0.5f * (values[count / 2 - 1] + values[count / 2]);
}

static int confirm_row(void *context, int y, int thread)
{
    struct refine_job *job = context;
    const int width = job->view->grid->width;
    const float *depth = lumi_row_f32(&job->view->depth, y);

    (void)thread;
    for (int x = 0; x < width; x++) {
        float values[LUMI_MVS_NEIGHBOURS + 1] = {depth[x]};
        int agree = 0, against = 0;
        double tan_x, tan_y;
        lumi_grid_unproject(job->view->grid, x + 0.5, y + 0.5, &tan_x, &tan_y);
        for (int n = 0; n < job->count; n++) {
            float said;
            if (!ask(&job->confirmers[n], (float)tan_x, (float)tan_y, depth[x], &said))
                continue;
            if (fabsf(said - depth[x]) <= job->confirmers[n].tolerance)
                values[1 + agree++] = said;
            else if (said < depth[x])
                against++; /* it looks through the point; one that sees something nearer has no say */
        }
        const size_t at = (size_t)y * (size_t)width + (size_t)x;
        job->sure[at] = agree >= (job->count > 2 ? 2 : 1) && agree >= against;
        job->fused[at] = job->sure[at] ? median(values, agree + 1) : depth[x];
    }
    return LUMI_OK;
}

/* Weighted median of the sure pixels around, by likeness of colour; `fallback` where there are none. */
static float weighted_median(const struct refine_job *job, int x, int y, int stride, float fallback)
{
    const int width = job->view->grid->width, height = job->view->grid->height;
    const uint8_t *own = lumi_row_u8(&job->view->image, y) + 3 * x;
    float values[(2 * RADIUS + 1) * (2 * RADIUS + 1)], says[(2 * RADIUS + 1) * (2 * RADIUS + 1)];
    float low = INFINITY, high = -INFINITY, total = 0, bin_says[BINS] = {0}, bin_values[BINS] = {0};
    int count = 0;

    for (int py = y - RADIUS * stride; py <= y + RADIUS * stride; py += stride) {
        if (py < 0 || py >= height)
            continue;
        const uint8_t *colours = lumi_row_u8(&job->view->image, py), *sure = job->sure + (size_t)py * (size_t)width;
        const float *fused = job->fused + (size_t)py * (size_t)width;
        for (int px = x - RADIUS * stride; px <= x + RADIUS * stride; px += stride) {
            if (px < 0 || px >= width || !sure[px])
                continue;
            const uint8_t *other = colours + 3 * px;
            const int difference = abs(own[0] - other[0]) + abs(own[1] - other[1]) + abs(own[2] - other[2]);
            const float value = fused[px];
            values[count] = value;
            says[count] = job->say[difference];
            low = value < low ? value : low;
            high = value > high ? value : high;
            total += says[count++];
        }
    }
    if (count < 4)
        return fallback;
    const float scale = high > low ? (BINS - 1) / (high - low) : 0;
    for (int i = 0; i < count; i++) {
        int bin = (int)((values[i] - low) * scale);
        bin_says[bin] += says[i];
        bin_values[bin] += says[i] * values[i];
    }
    float sum = 0;
    for (int bin = 0; bin < BINS; bin++) {
        sum += bin_says[bin];
        if (2 * sum >= total && bin_says[bin] > 0)
            return bin_values[bin] / bin_says[bin];
    }
    return fallback;
}

/* How much the depths within two pixels differ, for each pixel of a row; low, high: scratch of the same length. */
static void spread_row(const struct refine_job *job, int y, float *restrict low, float *restrict high,
                       float *restrict spread)
{
    const int width = job->view->grid->width, height = job->view->grid->height;
    const int top = y > 2 ? y - 2 : 0, bottom = y + 2 < height ? y + 2 : height - 1;

    memcpy(low, job->fused + (size_t)top * (size_t)width, (size_t)width * sizeof(float));
    memcpy(high, low, (size_t)width * sizeof(float));
    for (int j = top + 1; j <= bottom; j++) {
        const float *row = job->fused + (size_t)j * (size_t)width;
        for (int x = 0; x < width; x++) {
            low[x] = row[x] < low[x] ? row[x] : low[x];
            high[x] = row[x] > high[x] ? row[x] : high[x];
        }
    }
    for (int x = 0; x < width; x++) {
        float lowest = low[x], highest = high[x];
        for (int i = x > 2 ? x - 2 : 0; i <= x + 2 && i < width; i++) {
            lowest = low[i] < lowest ? low[i] : lowest;
            highest = high[i] > highest ? high[i] : highest;
        }
        spread[x] = highest - lowest;
    }
}

static int filter_row(void *context, int y, int thread)
{
    const struct refine_job *job = context;
    const int width = job->view->grid->width;
    float *result = lumi_row_f32(job->result, y);
    float *spread = lumi_alloc(3 * (size_t)width, sizeof(float));

    (void)thread;
    if (!spread)
        return LUMI_ERR_NOMEM;
    spread_row(job, y, spread + width, spread + 2 * width, spread);
    for (int x = 0; x < width; x++) {
        const size_t at = (size_t)y * (size_t)width + (size_t)x;
        result[x] = job->fused[at];
        if (job->sure[at] && spread[x] <= EDGE_PX * job->tolerance)
            continue;
        float wide = job->sure[at] ? job->fused[at] : weighted_median(job, x, y, 4, job->fused[at]);
        result[x] = weighted_median(job, x, y, 1, wide);
    }
    lumi_free(spread);
    return LUMI_OK;
}

int lumi_mvs_refine(const struct lumi_mvs_view *view, int count, const struct lumi_mvs_view *neighbours, int threads,
                    struct lumi_raster *inverse_depth, struct lumi_error *error)
{
    struct refine_job job = {.view = view, .count = count, .tolerance = INFINITY, .result = inverse_depth};
    int code;

    memset(inverse_depth, 0, sizeof(*inverse_depth));
    if (count < 0 || count > LUMI_MVS_NEIGHBOURS)
        return lumi_fail(error, LUMI_ERR_ARG, "depth: %d neighbours, at most %d can be matched", count,
                         LUMI_MVS_NEIGHBOURS);
    LUMI_TRY(mvs_check(view, true, error));
    for (int n = 0; n < count; n++)
        LUMI_TRY(mvs_check(&neighbours[n], true, error));
    job.confirmers = lumi_calloc((size_t)count + 1, sizeof(*job.confirmers));
    code = LUMI_ERR_NOMEM;
    if (!job.confirmers)
        goto done;
    for (int n = 0; n < count; n++) {
        init_confirmer(&job.confirmers[n], view, &neighbours[n]);
        job.tolerance = fminf(job.tolerance, job.confirmers[n].tolerance);
    }
    const size_t pixels = (size_t)view->grid->width * (size_t)view->grid->height;
    for (int i = 0; i < COLOURS; i++)
        job.say[i] = expf(-(float)i / COLOUR_FALL) + 1e-4f;
    LUMI_GOTO(code, done, lumi_raster_create(inverse_depth, view->grid->width, view->grid->height, 1, LUMI_F32));
    job.fused = lumi_alloc(pixels, sizeof(float));
    job.sure = lumi_alloc(pixels, 1);
    code = LUMI_ERR_NOMEM;
    if (!job.fused || !job.sure)
        goto done;
    LUMI_GOTO(code, done, lumi_parallel_for(view->grid->height, threads, confirm_row, &job));
    LUMI_GOTO(code, done, lumi_parallel_for(view->grid->height, threads, filter_row, &job));
done:
    lumi_free(job.confirmers);
    lumi_free(job.fused);
    lumi_free(job.sure);
    if (code != LUMI_OK)
        lumi_raster_finish(inverse_depth);
    return code == LUMI_ERR_NOMEM ? lumi_fail(error, code, "depth: out of memory") : code;
}
