/* A vote on every pixel's depth, then on its colour. */
#include "pipeline/synthesize/view_synthesis.h"
#include "proto/base/memory.h"
#include "proto/base/parallel.h"

#include <string.h>

/* Depths that differ by less than a parallax of so many pixels, or this share, are the same surface. */
#define SAME_PX 1.5
#define SAME_SHARE 0.03
/* A nearer surface counts when so much of those who see anything there see it. */
#define QUORUM 0.3f
/* Colours (square roots of light) farther from the middle than this weigh half or less. */
#define COLOUR_SPREAD 0.06f

struct gathering {
    const struct lumi_synthesis_source *source;
    struct lumi_raster carried; /* its depth in the view; data NULL: not carried */
    double m[9];                /* from the view's directions to the source's */
    struct lumi_vec3 offset;    /* the view's centre in the source */
    float weight;
};

struct blending {
    const struct lumi_grid *grid;
    const struct lumi_pose *pose;
    int count;
    struct gathering items[LUMI_SYNTHESIS_SOURCES];
    const uint8_t *wanted;
    uint8_t *known;
    struct lumi_raster *image, *depth;
    float tolerance; /* inverse depth */
};

struct vote {
    float w;
    int item;
};

static int carry_one(void *context, int index, int thread)
{
    struct blending *job = context;
    struct gathering *item = &job->items[index];

    (void)thread;
    return lumi_synthesis_carry(item->source, job->grid, job->pose, &item->carried);
}

static float same(const struct blending *job, float w)
{
    return job->tolerance + (float)SAME_SHARE * w;
}

/* The votes of the surface the pixel shows: votes[*first .. return value). The nearest that has a quorum, shifted to
 * where it has most votes; without any, the one that most see. */
static int elect(const struct blending *job, const struct vote *votes, int count, int *first)
{
    const int members = count < 3 ? 1 : 2;
    float total = 0, best = 0;
    int best_last = 0;
    bool elected = false;

    *first = 0;
    for (int i = 0; i < count; i++)
        total += job->items[votes[i].item].weight;
    for (int i = 0; i < count && !(elected && i >= best_last); i++) {
        float support = 0;
        int last = i;
        while (last < count && votes[last].w >= votes[i].w - same(job, votes[i].w))
            support += job->items[votes[last++].item].weight;
        const bool quorum = support >= QUORUM * total && last - i >= members;
        if ((quorum && !elected) || (support > best && quorum == elected)) {
            best = support;
            *first = i;
            best_last = last;
        }
        elected = elected || quorum;
    }
    return best_last;
}

static float middle_depth(const struct blending *job, const struct vote *votes, int first, int last)
{
    float total = 0, sum = 0;

    for (int i = first; i < last; i++)
        total += job->items[votes[i].item].weight;
    for (int i = first; i < last; i++) {
        sum += job->items[votes[i].item].weight;
        if (2 * sum >= total)
            return votes[i].w;
    }
    return votes[first].w;
}

static void cubic(float t, float weights[4])
{
    weights[0] = t * (-0.5f + t * (1 - 0.5f * t));
    weights[1] = 1 + t * t * (-2.5f + 1.5f * t);
    weights[2] = t * (0.5f + t * (2 - 1.5f * t));
    weights[3] = t * t * (-0.5f + 0.5f * t);
}

static int hold(int value, int size)
{
    return value < 0 ? 0 : value >= size ? size - 1 : value;
}

/* Catmull and Rom's cubic over the pixels whose depth is within `tolerance` of `w`, so that colours do not run over an
 * edge; held to those of the nearest four, so that it does not ring. False where those are of something else. */
static bool sample(const struct lumi_synthesis_source *source, double x, double y, float w, float tolerance,
                   float colour[3])
{
    const int x0 = (int)floor(x - 0.5), y0 = (int)floor(y - 0.5);
    float across[4], down[4], sum[3] = {0}, total = 0;
    float least[3] = {INFINITY, INFINITY, INFINITY}, most[3] = {-INFINITY, -INFINITY, -INFINITY};

    cubic((float)(x - 0.5 - x0), across);
    cubic((float)(y - 0.5 - y0), down);
    for (int k = 0; k < 16; k++) {
        const int i = k & 3, j = k >> 2;
        const int sx = hold(x0 - 1 + i, source->image.width), sy = hold(y0 - 1 + j, source->image.height);
        const float *pixel = lumi_row_f32(&source->image, sy) + 3 * (size_t)sx, weight = across[i] * down[j];
        if (fabsf(lumi_row_f32(&source->depth, sy)[sx] - w) > tolerance)
            continue;
        total += weight;
        for (int c = 0; c < 3; c++) {
            sum[c] += weight * pixel[c];
            if ((i == 1 || i == 2) && (j == 1 || j == 2)) {
                least[c] = fminf(least[c], pixel[c]);
                most[c] = fmaxf(most[c], pixel[c]);
            }
        }
    }
    if (!(total > 0.1f) || !(least[0] <= most[0]))
        return false;
    for (int c = 0; c < 3; c++)
        colour[c] = fminf(fmaxf(sum[c] / total, least[c]), most[c]);
    return true;
}

/* What a source shows of the point on the view's ray; false where it shows something else, or nothing. */
static bool look_up(const struct blending *job, const struct gathering *item, struct lumi_vec3 ray, float w,
                    float colour[3])
{
    const struct lumi_synthesis_source *source = item->source;
    const struct lumi_vec3 q = lumi_add(lumi_rotate(item->m, ray), lumi_scale(item->offset, w));
    double x, y;

    if (!(q.z > 1e-3) || !lumi_grid_project(source->grid, q, &x, &y) || x < 0 || y < 0 || x >= source->grid->width ||
        y >= source->grid->height)
        return false;
    const int px = (int)x, py = (int)y;
    if (source->blocked && source->blocked[(size_t)py * (size_t)source->grid->width + (size_t)px])
        return false;
    const float expected = w / (float)q.z;
    return sample(source, x, y, expected, 1.5f * same(job, expected), colour);
}

static float root(float light)
{
    return sqrtf(fmaxf(light, 0));
}

/* The sources' colour: about the weighted median of each channel, those that differ weighing less. */
static void mix(const float colours[][3], const float *weights, int count, float result[3])
{
    float middle[3], sum[3] = {0}, total = 0;

    for (int c = 0; c < 3; c++) {
        int order[LUMI_SYNTHESIS_SOURCES];
        float half = 0, so_far = 0;
        for (int i = 0; i < count; i++) {
            int at = i;
            for (; at > 0 && colours[order[at - 1]][c] > colours[i][c]; at--)
                order[at] = order[at - 1];
            order[at] = i;
            half += weights[i] / 2;
        }
        int k = 0;
        while (k + 1 < count && (so_far += weights[order[k]]) < half)
            k++;
        middle[c] = root(colours[order[k]][c]);
    }
    for (int i = 0; i < count; i++) {
        float off = 0;
        for (int c = 0; c < 3; c++) {
            const float d = (root(colours[i][c]) - middle[c]) / COLOUR_SPREAD;
            off += d * d;
        }
        const float weight = weights[i] / (1 + off * off);
        for (int c = 0; c < 3; c++)
            sum[c] += weight * colours[i][c];
        total += weight;
    }
    for (int c = 0; c < 3; c++)
        result[c] = sum[c] / total;
}

static bool blend_pixel(const struct blending *job, int x, int y, struct lumi_vec3 ray)
{
    struct vote votes[LUMI_SYNTHESIS_SOURCES];
    float colours[LUMI_SYNTHESIS_SOURCES][3], weights[LUMI_SYNTHESIS_SOURCES];
    int count = 0, first, seen = 0;

    for (int i = 0; i < job->count; i++) {
        const float w = lumi_row_f32(&job->items[i].carried, y)[x];
        int at = count;
        if (w < 0)
            continue;
        for (; at > 0 && votes[at - 1].w < w; at--)
            votes[at] = votes[at - 1];
        votes[at] = (struct vote){w, i};
        count++;
    }
    if (count == 0)
        return false;
    const int last = elect(job, votes, count, &first);
    const float w = middle_depth(job, votes, first, last);
    for (int i = first; i < last; i++)
        if (look_up(job, &job->items[votes[i].item], ray, w, colours[seen]))
            weights[seen++] = job->items[votes[i].item].weight;
    if (seen == 0)
        return false;
    mix((const float(*)[3])colours, weights, seen, lumi_row_f32(job->image, y) + 3 * (size_t)x);
    lumi_row_f32(job->depth, y)[x] = w;
    return true;
}

static int blend_row(void *context, int y, int thread)
{
    struct blending *job = context;
    const size_t first = (size_t)y * (size_t)job->grid->width;

    (void)thread;
    for (int x = 0; x < job->grid->width; x++) {
        double tan_x, tan_y;
        if (job->wanted && !job->wanted[first + (size_t)x]) {
            job->known[first + (size_t)x] = 1;
            continue;
        }
        lumi_grid_unproject(job->grid, x + 0.5, y + 0.5, &tan_x, &tan_y);
        job->known[first + (size_t)x] = blend_pixel(job, x, y, lumi_vec3(tan_x, tan_y, 1));
    }
    return LUMI_OK;
}

static void set_up(struct blending *job, const struct lumi_synthesis_source *sources)
{
    const struct lumi_grid *grid = job->grid;
    double left, right, top, middle = 0;

    for (int i = 0; i < job->count; i++) {
        struct gathering *item = &job->items[i];
        const double distance = lumi_length(lumi_sub(sources[i].pose.t, job->pose->t));
        item->source = &sources[i];
        for (int a = 0; a < 3; a++)
            for (int b = 0; b < 3; b++)
                item->m[3 * a + b] = lumi_dot(lumi_axis(&sources[i].pose, a), lumi_axis(job->pose, b));
        item->offset = lumi_to_camera(&sources[i].pose, job->pose->t);
        item->weight = (float)distance;
    }
    /* Half of the sources are nearer: their baseline says how well depth is known. */
    middle = job->items[job->count / 2].weight;
    for (int i = 0; i < job->count; i++) {
        const float d = job->items[i].weight / (float)middle;
        job->items[i].weight = 1 / (0.01f + d * d);
    }
    lumi_grid_unproject(grid, grid->width / 2.0 - 0.5, grid->height / 2.0, &left, &top);
    lumi_grid_unproject(grid, grid->width / 2.0 + 0.5, grid->height / 2.0, &right, &top);
    job->tolerance = (float)(SAME_PX * (right - left) / fmax(middle, 1e-6));
}

/* Nobody knows anything of it: the middle of what the sources show, which at least is no hole. */
static void grey(const struct blending *job)
{
    double sum[3] = {0};
    long count = 0;

    for (int i = 0; i < job->count; i++)
        for (int y = 0; y < job->items[i].source->grid->height; y++)
            for (int x = 0; x < job->items[i].source->grid->width; x++, count++)
                for (int c = 0; c < 3; c++)
                    sum[c] += lumi_row_f32(&job->items[i].source->image, y)[3 * x + c];
    for (int y = 0; y < job->grid->height; y++)
        for (int x = 0; x < job->grid->width; x++) {
            for (int c = 0; c < 3; c++)
                lumi_row_f32(job->image, y)[3 * x + c] = (float)(count ? sum[c] / (double)count : 0.18);
            lumi_row_f32(job->depth, y)[x] = 0;
        }
}

int lumi_synthesize_view(const struct lumi_grid *grid, const struct lumi_pose *pose, int count,
                         const struct lumi_synthesis_source *sources, const uint8_t *wanted, int threads,
                         struct lumi_raster *image, struct lumi_raster *depth, long *filled, struct lumi_error *error)
{
    const size_t pixels = (size_t)grid->width * (size_t)grid->height;
    struct blending job = {.grid = grid, .pose = pose, .wanted = wanted, .image = image, .depth = depth};
    long known = 0;

    job.count = count < LUMI_SYNTHESIS_SOURCES ? count : LUMI_SYNTHESIS_SOURCES;
    job.known = lumi_calloc(pixels, 1);
    int code = job.known ? LUMI_OK : LUMI_ERR_NOMEM;
    if (code == LUMI_OK && job.count > 0) {
        set_up(&job, sources);
        code = lumi_parallel_for(job.count, threads, carry_one, &job);
    }
    if (code == LUMI_OK)
        code = lumi_parallel_for(grid->height, threads, blend_row, &job);
    for (size_t i = 0; code == LUMI_OK && i < pixels; i++)
        known += job.known[i];
    if (code == LUMI_OK && known == 0)
        grey(&job);
    else if (code == LUMI_OK && known < (long)pixels)
        code = lumi_synthesis_fill(image, depth, job.known, job.tolerance);
    if (filled)
        *filled = (long)pixels - known;
    for (int i = 0; i < job.count; i++)
        lumi_raster_finish(&job.items[i].carried);
    lumi_free(job.known);
    return code == LUMI_OK ? LUMI_OK
                           : lumi_fail(error, code, "no memory for a view of %d × %d", grid->width, grid->height);
}
