/* A frame against those beside it, at the scale of their small pictures.
 *
 * 1. What a block of the frame shows lies somewhere on a ray; where on it is not known. In the neighbour it is looked
 *    for along the image of that ray (plane sweep, Collins, "A space-sweep approach to true multi-image matching",
 *    1996), and a little to both sides of it.
 * 2. To the sides of the ray's image nothing belongs that the poses are right about: the median of what is found there
 *    is how far the picture is shifted in that direction. Neighbours in different directions give both components.
 * 3. A block that no neighbour has, although it should be seen there, is something that moved (or is hidden from all of
 *    them). Only neighbours so near by that no thing comes before another by much of a block can tell. */
#include "daemon/judge/judge_priv.h"
#include "proto/base/memory.h"

#include <stdlib.h>

#define BLOCK 16
#define SAMPLES 8 /* across a block */
#define DEPTHS 24
#define INVERSE_MOST 1.6      /* 1/m: nothing is nearer than that */
#define REACH 12              /* small pixels to either side */
#define PARALLAX_MOST 12      /* small pixels between far and near: with more, a block has parts hidden behind others */
#define DIFFERENCE_FLOOR 0.06 /* of a block's mean: contrast less than that says nothing */
#define COVERED_LEAST 4       /* of so many blocks one must be seen beside, or nothing is said of things that moved */
#define WHITE 0.9f            /* small pixels from here on are partly white: they say nothing */
#define MATCH 0.35            /* difference, of the blocks' own contrast, up to which they are the same */

struct view {
    const struct lumi_judge_picture *picture;
    const struct lumi_lens *lens;
    const struct lumi_pose *pose;
    double scale_x, scale_y; /* small pixels a pixel of the lens's */
};

/* One block in one neighbour. */
struct match {
    bool seen;
    bool near_by;      /* little parallax: what is not found, is not there */
    double side;       /* where it was found, small pixels off the ray's image */
    double nx, ny;     /* that direction in the neighbour, unit */
    double difference; /* of what was found */
    double ratio;      /* log2 of the brightness against the neighbour's */
};

struct job {
    struct view own, other;
    int across, down;
    double gain;           /* the neighbour's light times this is the frame's */
    struct match *matches; /* by block */
};

static void init_view(struct view *view, const struct lumi_judge_picture *picture, const struct lumi_lens *lens,
                      const struct lumi_pose *pose)
{
    *view = (struct view){picture, lens, pose, (double)picture->width / lens->width / picture->step,
                          (double)picture->height / lens->height / picture->step};
}

static bool sample(const struct judge_plane *plane, double x, double y, float *value)
{
    double left = floor(x - 0.5), top = floor(y - 0.5);

    if (!(left >= 0 && top >= 0 && left + 1 < plane->width && top + 1 < plane->height))
        return false;
    float a = (float)(x - 0.5 - left), b = (float)(y - 0.5 - top);
    const float *p = plane->data + (size_t)top * (size_t)plane->width + (size_t)left, *q = p + plane->width;
    *value = (1 - b) * ((1 - a) * p[0] + a * p[1]) + b * ((1 - a) * q[0] + a * q[1]);
    return true;
}

/* Where the neighbour sees what the frame has at small pixel x, y, at an inverse distance. */
static bool locate(const struct job *job, double x, double y, double inverse, double *u, double *v)
{
    struct lumi_vec3 ray;

    if (!lumi_lens_unproject(job->own.lens, x / job->own.scale_x, y / job->own.scale_y, &ray))
        return false;
    struct lumi_vec3 world = lumi_rotate(job->own.pose->r, ray);
    struct lumi_vec3 between = lumi_sub(job->own.pose->t, job->other.pose->t);
    struct lumi_vec3 seen = lumi_rotate_back(job->other.pose->r, lumi_add(world, lumi_scale(between, inverse)));
    if (!lumi_lens_project(job->other.lens, seen, u, v))
        return false;
    *u *= job->other.scale_x;
    *v *= job->other.scale_y;
    return true;
}

/* The block's corners at this inverse distance; what is between them is between their images. */
struct patch {
    double x[4], y[4];
};
static bool locate_patch(const struct job *job, int x0, int y0, double inverse, struct patch *patch)
{
    for (int i = 0; i < 4; i++)
        if (!locate(job, x0 + (i % 2) * BLOCK, y0 + (i / 2) * BLOCK, inverse, &patch->x[i], &patch->y[i]))
            return false;
    return true;
}

static bool take_own(const struct job *job, int x0, int y0, float values[SAMPLES * SAMPLES])
{
    for (int j = 0; j < SAMPLES; j++)
        for (int i = 0; i < SAMPLES; i++)
            if (!sample(&job->own.picture->small, x0 + (i + 0.5) * BLOCK / SAMPLES, y0 + (j + 0.5) * BLOCK / SAMPLES,
                        &values[j * SAMPLES + i]))
                return false;
    return true;
}

static bool take_other(const struct job *job, const struct patch *patch, double dx, double dy,
                       float values[SAMPLES * SAMPLES])
{
    for (int j = 0; j < SAMPLES; j++)
        for (int i = 0; i < SAMPLES; i++) {
            double a = (i + 0.5) / SAMPLES, b = (j + 0.5) / SAMPLES;
            double x =
                (1 - b) * ((1 - a) * patch->x[0] + a * patch->x[1]) + b * ((1 - a) * patch->x[2] + a * patch->x[3]);
            double y =
                (1 - b) * ((1 - a) * patch->y[0] + a * patch->y[1]) + b * ((1 - a) * patch->y[2] + a * patch->y[3]);
            if (!sample(&job->other.picture->small, x + dx, y + dy, &values[j * SAMPLES + i]))
                return false;
        }
    return true;
}

/* Squares of the difference against the squares of what there is to see, where neither picture is white. False: that
 * is hardly anywhere. */
static bool differ(const struct job *job, const float *a, const float *b, double *found, double *ratio)
{
    double mean_a = 0, mean_b = 0, difference = 0, contrast = 0;
    int n = 0;

    for (int i = 0; i < SAMPLES * SAMPLES; i++) {
        if (a[i] >= WHITE || b[i] >= WHITE)
            continue;
        mean_a += (double)a[i];
        mean_b += (double)b[i] * job->gain;
        n++;
    }
    if (n < SAMPLES * SAMPLES / 4)
        return false;
    mean_a /= n;
    mean_b /= n;
    for (int i = 0; i < SAMPLES * SAMPLES; i++) {
        double p = (double)a[i], q = (double)b[i] * job->gain;
        if (a[i] >= WHITE || b[i] >= WHITE)
            continue;
        difference += (p - q) * (p - q);
        contrast += ((p - mean_a) * (p - mean_a) + (q - mean_b) * (q - mean_b)) / 2;
    }
    double floor = DIFFERENCE_FLOOR * fmax((mean_a + mean_b) / 2, 0.01);
    *ratio = log2(fmax(mean_a, 1e-4) / fmax(mean_b / job->gain, 1e-4));
    *found = difference / (contrast + n * floor * floor);
    return true;
}

/* Looks along the ray's image and `reach` to the sides of `middle`. */
static void find_block(const struct job *job, int x0, int y0, double middle, double reach, double step,
                       struct match *match)
{
    float own[SAMPLES * SAMPLES], other[SAMPLES * SAMPLES];
    struct patch far, near, patch;

    *match = (struct match){.difference = HUGE_VAL};
    if (!take_own(job, x0, y0, own) || !locate_patch(job, x0, y0, 0, &far) ||
        !locate_patch(job, x0, y0, INVERSE_MOST, &near))
        return;
    double dx = near.x[0] - far.x[0], dy = near.y[0] - far.y[0], length = hypot(dx, dy);
    int depths = (int)(length / 0.7) + 1;
    depths = depths > DEPTHS ? DEPTHS : depths;
    match->near_by = length <= PARALLAX_MOST;
    match->nx = length > 0.5 ? -dy / length : 1;
    match->ny = length > 0.5 ? dx / length : 0;
    for (int d = 0; d < depths; d++) {
        double inverse = depths > 1 ? INVERSE_MOST * d / (depths - 1) : 0;
        if (!locate_patch(job, x0, y0, inverse, &patch))
            continue;
        for (double side = middle - reach; side <= middle + reach + 1e-9; side += step) {
            double difference, ratio;
            if (!take_other(job, &patch, side * match->nx, side * match->ny, other) ||
                !differ(job, own, other, &difference, &ratio))
                continue;
            match->seen = true;
            if (difference < match->difference) {
                match->difference = difference;
                match->side = side;
                match->ratio = ratio;
            }
        }
    }
}

static int by_number(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;

    return (x > y) - (x < y);
}

static double median(double *values, int count)
{
    qsort(values, (size_t)count, sizeof *values, by_number);
    return count % 2 ? values[count / 2] : (values[count / 2 - 1] + values[count / 2]) / 2;
}

enum what { SIDES, RATIOS };
/* Of blocks that were found. NaN: too few. */
static double median_of(const struct job *job, enum what what, double *scratch)
{
    int count = 0;

    for (int i = 0; i < job->across * job->down; i++) {
        const struct match *m = &job->matches[i];
        if (m->seen && m->difference < MATCH)
            scratch[count++] = what == SIDES ? m->side : m->ratio;
    }
    return count >= 6 ? median(scratch, count) : (double)NAN;
}

static void match_all(const struct job *job, int every, double middle, double reach, double step)
{
    for (int j = 0; j < job->down; j++)
        for (int i = 0; i < job->across; i++) {
            struct match *match = &job->matches[j * job->across + i];
            *match = (struct match){.difference = HUGE_VAL};
            if (i % every == 0 && j % every == 0)
                find_block(job, i * BLOCK, j * BLOCK, middle, reach, step, match);
        }
}

/* The brightness of the frame against the neighbour's before anything is aligned: means of blocks, at two metres. */
static double first_gain(const struct job *job, double *scratch)
{
    float own[SAMPLES * SAMPLES], other[SAMPLES * SAMPLES];
    struct patch patch;
    double difference;
    int count = 0;

    for (int j = 0; j < job->down; j++)
        for (int i = 0; i < job->across; i++)
            if (take_own(job, i * BLOCK, j * BLOCK, own) && locate_patch(job, i * BLOCK, j * BLOCK, 0.5, &patch) &&
                take_other(job, &patch, 0, 0, other) && differ(job, own, other, &difference, &scratch[count]))
                count++;
    return count >= 6 ? exp2(median(scratch, count)) : 0;
}

struct sums {
    double xx, xy, yy, x, y; /* of sides and their directions: n nᵀ s = n side */
    double stops[16];
    int neighbours, with_shift;
};

static void compare_one(struct job *job, double *scratch, double expected, struct sums *sums)
{
    job->gain = 1;
    job->gain = first_gain(job, scratch);
    if (!(job->gain > 0))
        return;
    match_all(job, 2, 0, REACH, 1);
    double side = median_of(job, SIDES, scratch);
    if (isnan(side)) {
        match_all(job, 1, 0, 1, 0.5);
    } else {
        match_all(job, 1, side, 1, 0.25);
        side = median_of(job, SIDES, scratch);
    }
    double stops = median_of(job, RATIOS, scratch);
    if (isnan(stops))
        stops = log2(job->gain);
    if (sums->neighbours < 16)
        sums->stops[sums->neighbours++] = stops - expected;
    if (isnan(side))
        return;
    for (int i = 0; i < job->across * job->down; i++) {
        const struct match *m = &job->matches[i];
        if (!m->seen || m->difference >= MATCH)
            continue;
        sums->xx += m->nx * m->nx;
        sums->xy += m->nx * m->ny;
        sums->yy += m->ny * m->ny;
        sums->x += m->nx * m->side;
        sums->y += m->ny * m->side;
    }
    sums->with_shift++;
}

/* Least squares; where the neighbours say nothing of one direction, that component is left at 0. */
static double solve_shift(const struct sums *s)
{
    double weight = 0.02 * (s->xx + s->yy), xx = s->xx + weight, yy = s->yy + weight;
    double det = xx * yy - s->xy * s->xy;

    return det > 0 ? hypot((yy * s->x - s->xy * s->y) / det, (xx * s->y - s->xy * s->x) / det) : 0;
}

int judge_compare(const struct lumi_judge_picture *picture, const struct lumi_lens *lens, const struct lumi_pose *pose,
                  double exposure_s, double gain, const struct lumi_judge_neighbour *neighbours, int count,
                  struct lumi_judge_numbers *numbers)
{
    struct job job = {.across = picture->small.width / BLOCK, .down = picture->small.height / BLOCK};
    int blocks = job.across * job.down, covered = 0, lost = 0;
    struct sums sums = {0};

    if (blocks < 6)
        return LUMI_OK;
    job.matches = lumi_alloc((size_t)blocks, sizeof *job.matches);
    double *scratch = lumi_alloc((size_t)blocks, sizeof *scratch);
    uint8_t *state = lumi_calloc((size_t)blocks, 1); /* 1 seen by a neighbour, 2 found there */
    if (!job.matches || !scratch || !state) {
        lumi_free(job.matches);
        lumi_free(scratch);
        lumi_free(state);
        return LUMI_ERR_NOMEM;
    }
    init_view(&job.own, picture, lens, pose);
    for (int n = 0; n < count; n++) {
        const struct lumi_judge_neighbour *other = &neighbours[n];
        bool known = exposure_s > 0 && other->exposure_s > 0;
        double expected = known ? log2(exposure_s / other->exposure_s) : 0;
        if (known && gain > 0 && other->gain > 0)
            expected += log2(gain / other->gain);
        init_view(&job.other, other->picture, other->lens, &other->pose);
        int before = sums.neighbours;
        compare_one(&job, scratch, expected, &sums);
        for (int i = 0; sums.neighbours > before && i < blocks; i++) {
            if (job.matches[i].seen && job.matches[i].near_by)
                state[i] |= 1;
            if (job.matches[i].seen && job.matches[i].near_by && job.matches[i].difference < MATCH)
                state[i] |= 2;
        }
    }
    for (int i = 0; i < blocks; i++) {
        covered += state[i] & 1;
        lost += state[i] == 1;
    }
    if (sums.neighbours > 0)
        numbers->exposure_stops = median(sums.stops, sums.neighbours);
    if (sums.with_shift > 0)
        numbers->shift_pixels = solve_shift(&sums) * picture->step;
    if (covered >= 6 && COVERED_LEAST * covered >= blocks)
        numbers->moved = (double)lost / covered;
    lumi_free(job.matches);
    lumi_free(scratch);
    lumi_free(state);
    return LUMI_OK;
}
