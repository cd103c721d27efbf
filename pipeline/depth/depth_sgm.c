/* Semi-global matching (Hirschmüller 2008, "Stereo processing by semiglobal matching and mutual information"): eight
 * paths, the penalty of a jump lower where the colour jumps. The image is worked in bands that overlap, so that the
 * sums need little memory and threads have something to share. Pixels search the planes of their block only; on a path
 * from one block to the next, what the other did not search is reached by a jump. */
#include "pipeline/depth/mvs_priv.h"
#include "proto/base/memory.h"
#include "proto/base/parallel.h"

#include <stdlib.h>
#include <string.h>

enum { BAND_BLOCKS = 8, OVERLAP_BLOCKS = 2, PAD = 16 };
enum { STEP_PENALTY = 4, JUMP_LOW = 12, JUMP_HIGH = 60, JUMP_SLOPE = 2 };

struct sgm_job {
    const struct mvs_image *image;
    const struct mvs_kernels *kernels;
    const struct mvs_search *search;
    const uint8_t *volume;
    float *planes;
};

/* A block and what its steps need. */
struct place {
    const struct mvs_block *block;
    uint8_t below[MVS_PLANES_MAX], above[MVS_PLANES_MAX];
};

/* The three paths that come from the row before, and the one along the row. `before` and `now`: a row's pixels side by
 * side, `lanes` each. lowest: a pixel. */
struct sgm_scratch {
    uint8_t *before[3], *now[3], *along[2];
    uint8_t *lowest_before[3], *lowest_now[3];
    uint8_t moved[MVS_PATHS][MVS_PLANES_MAX + 2 * PAD]; /* of a block with other planes, in this one's order */
    uint8_t nothing[MVS_PLANES_MAX + 2 * PAD];          /* where a path begins */
    uint16_t *sum;                                      /* of the band */
    size_t begin;                                       /* where in a volume the band begins */
    uint8_t *bytes;
};

static int jump_penalty(uint32_t a, uint32_t b)
{
    int largest = 0;

    for (int shift = 0; shift < 24; shift += 8) {
        int difference = abs((int)(a >> shift & 255) - (int)(b >> shift & 255));
        largest = difference > largest ? difference : largest;
    }
    int penalty = JUMP_HIGH - JUMP_SLOPE * largest;
    return penalty > JUMP_LOW ? penalty : JUMP_LOW;
}

static int scratch_init(struct sgm_scratch *s, const struct mvs_search *search, int width, size_t begin, size_t end)
{
    const size_t line = (size_t)search->widest * MVS_BLOCK + 2 * PAD, pixels = (size_t)width;

    memset(s, 0, sizeof(*s));
    s->begin = begin;
    s->bytes = lumi_calloc(6 * (line + pixels) + 2 * (MVS_PLANES_MAX + 2 * PAD), 1);
    s->sum = lumi_alloc(end - begin, sizeof(uint16_t));
    if (!s->bytes || !s->sum)
        return LUMI_ERR_NOMEM;
    uint8_t *at = s->bytes;
    for (int d = 0; d < 3; d++) {
        s->before[d] = at + PAD;
        s->now[d] = at + line + PAD;
        s->lowest_before[d] = at + 2 * line;
        s->lowest_now[d] = at + 2 * line + pixels;
        at += 2 * (line + pixels);
    }
    s->along[0] = at + PAD;
    s->along[1] = at + MVS_PLANES_MAX + 3 * PAD;
    memset(s->nothing, 255, sizeof(s->nothing));
    return LUMI_OK;
}

static void scratch_finish(struct sgm_scratch *s)
{
    lumi_free(s->bytes);
    lumi_free(s->sum);
}

/* A step to the next plane stays between neighbouring groups. */
static void init_place(struct place *place, const struct mvs_block *block)
{
    uint8_t groups[MVS_GROUPS_MAX];
    const int count = mvs_groups(block->groups, groups);

    place->block = block;
    memset(place->below, STEP_PENALTY, (size_t)block->lanes);
    memset(place->above, STEP_PENALTY, (size_t)block->lanes);
    for (int i = 0; i < count; i++) {
        if (i == 0 || groups[i - 1] + 1 != groups[i])
            place->below[MVS_GROUP * i] = 255;
        if (i + 1 == count || groups[i + 1] != groups[i] + 1)
            place->above[MVS_GROUP * i + MVS_GROUP - 1] = 255;
    }
}

/* `path` of a pixel of another block, as this block's planes. */
static const uint8_t *move(const struct mvs_block *from, const struct mvs_block *to, const uint8_t *path,
                           uint8_t *moved)
{
    int lane = 0;

    if (from->groups == to->groups)
        return path;
    for (uint32_t rest = from->groups | to->groups, bit; rest; rest &= ~bit) {
        bit = rest & (0 - rest);
        if (to->groups & bit) {
            if (from->groups & bit)
                memcpy(moved + lane, path, MVS_GROUP);
            else
                memset(moved + lane, 255, MVS_GROUP);
            lane += MVS_GROUP;
        }
        path += from->groups & bit ? MVS_GROUP : 0;
    }
    return moved;
}

/* Where in a row's lines a pixel's lanes are. */
static size_t line_at(const struct mvs_block *block, int x)
{
    return (size_t)block->column * MVS_BLOCK + (size_t)(x % MVS_BLOCK) * (size_t)block->lanes;
}

/* One path's way into pixel x from pixel `from`, whose block is given (NULL: the path begins). */
static void enter(struct mvs_step *step, int d, struct sgm_scratch *s, const struct place *place,
                  const struct mvs_block *from, const uint8_t *path, int lowest, int p2)
{
    if (from) {
        step->previous[d] = move(from, place->block, path, s->moved[d] + PAD);
        step->lowest[d] = lowest;
        step->p2[d] = p2;
    } else {
        step->previous[d] = s->nothing + PAD;
        step->lowest[d] = step->p2[d] = 0;
    }
}

/* One row of a pass. direction: +1 rightwards and from above, −1 leftwards and from below. add: the row has sums. */
static void pass_row(const struct sgm_job *job, struct sgm_scratch *s, int y, bool first, int direction, bool add)
{
    const int width = job->image->width, columns = job->search->columns;
    const struct mvs_block *blocks = job->search->blocks + (size_t)(y / MVS_BLOCK) * (size_t)columns;
    const int y_before = first ? y : y - direction;
    const struct mvs_block *blocks_before = job->search->blocks + (size_t)(y_before / MVS_BLOCK) * (size_t)columns;
    const uint32_t *pixels = job->image->pixels + (size_t)y * (size_t)width;
    const uint32_t *pixels_before = job->image->pixels + (size_t)y_before * (size_t)width;
    struct place place = {0};
    struct mvs_step step = {.add = add};
    int lowest_along = 0;

    for (int i = 0; i < width; i++) {
        const int x = direction > 0 ? i : width - 1 - i;
        const struct mvs_block *block = blocks + x / MVS_BLOCK, *beside = blocks + (x - direction) / MVS_BLOCK;
        const size_t at = block->at + (size_t)(y % MVS_BLOCK * MVS_BLOCK + x % MVS_BLOCK) * (size_t)block->lanes;
        if (block != place.block) {
            init_place(&place, block);
            step.below = place.below;
            step.above = place.above;
            step.lanes = block->lanes;
        }
        step.cost = job->volume + at;
        step.sum = s->sum + (at - s->begin);
        enter(&step, 3, s, &place, i > 0 ? beside : NULL, s->along[(i + 1) & 1], lowest_along,
              i > 0 ? jump_penalty(pixels[x], pixels[x - direction]) : 0);
        step.path[3] = s->along[i & 1];
        for (int d = 0; d < 3; d++) {
            const int from = x + d - 1;
            const bool there = !first && from >= 0 && from < width;
            const struct mvs_block *other = there ? blocks_before + from / MVS_BLOCK : NULL;
            enter(&step, d, s, &place, other, there ? s->before[d] + line_at(other, from) : NULL,
                  there ? s->lowest_before[d][from] : 0, there ? jump_penalty(pixels[x], pixels_before[from]) : 0);
            step.path[d] = s->now[d] + line_at(block, x);
        }
        job->kernels->step(&step);
        lowest_along = step.lowest[3];
        for (int d = 0; d < 3; d++)
            s->lowest_now[d][x] = (uint8_t)step.lowest[d];
    }
    for (int d = 0; d < 3; d++) {
        uint8_t *lines = s->before[d], *lowest = s->lowest_before[d];
        s->before[d] = s->now[d];
        s->now[d] = lines;
        s->lowest_before[d] = s->lowest_now[d];
        s->lowest_now[d] = lowest;
    }
}

/* The plane of sum[best], to a fraction by the parabola through its neighbours. */
static float pick(const struct place *place, const uint8_t *groups, const uint16_t *sum, int best)
{
    const float plane = (float)(MVS_GROUP * groups[best / MVS_GROUP] + best % MVS_GROUP);

    if (place->below[best] == 255 || place->above[best] == 255)
        return plane;
    float before = sum[best - 1], after = sum[best + 1], curve = before - 2 * (float)sum[best] + after;
    return plane + (curve > 0 ? 0.5f * (before - after) / curve : 0);
}

static void pick_row(const struct sgm_job *job, const struct sgm_scratch *s, int y)
{
    const int width = job->image->width;
    const struct mvs_block *blocks = job->search->blocks + (size_t)(y / MVS_BLOCK) * (size_t)job->search->columns;
    struct place place = {0};
    uint8_t groups[MVS_GROUPS_MAX];

    for (int x = 0; x < width; x++) {
        const struct mvs_block *block = blocks + x / MVS_BLOCK;
        const size_t at = block->at + (size_t)(y % MVS_BLOCK * MVS_BLOCK + x % MVS_BLOCK) * (size_t)block->lanes;
        if (block != place.block) {
            init_place(&place, block);
            mvs_groups(block->groups, groups);
        }
        const uint16_t *sum = s->sum + (at - s->begin);
        const int best = job->kernels->smallest(sum, block->lanes);
        job->planes[(size_t)y * (size_t)width + (size_t)x] = pick(&place, groups, sum, best);
    }
}

static int sgm_band(void *context, int band, int thread)
{
    const struct sgm_job *job = context;
    const struct mvs_search *search = job->search;
    const int height = job->image->height, top = band * BAND_BLOCKS * MVS_BLOCK;
    const int bottom = top + BAND_BLOCKS * MVS_BLOCK < height ? top + BAND_BLOCKS * MVS_BLOCK : height;
    const int first = band > 0 ? top - OVERLAP_BLOCKS * MVS_BLOCK : 0;
    const int last = bottom + OVERLAP_BLOCKS * MVS_BLOCK < height ? bottom + OVERLAP_BLOCKS * MVS_BLOCK : height;
    const int end_block = (last + MVS_BLOCK - 1) / MVS_BLOCK * search->columns;
    const size_t begin = search->blocks[first / MVS_BLOCK * search->columns].at;
    const size_t end = end_block < search->rows * search->columns ? search->blocks[end_block].at : search->size;
    struct sgm_scratch scratch;
    int code;

    (void)thread;
    LUMI_GOTO(code, done, scratch_init(&scratch, search, job->image->width, begin, end));
    for (int y = first; y < bottom; y++)
        pass_row(job, &scratch, y, y == first, 1, false);
    for (int y = last - 1; y >= top; y--)
        pass_row(job, &scratch, y, y == last - 1, -1, y < bottom);
    for (int y = top; y < bottom; y++)
        pick_row(job, &scratch, y);
done:
    scratch_finish(&scratch);
    return code;
}

int mvs_sgm(const struct mvs_image *image, const uint8_t *volume, const struct mvs_search *search, int threads,
            float *planes)
{
    struct sgm_job job = {image, mvs_kernels(), search, volume, planes};
    const int rows = BAND_BLOCKS * MVS_BLOCK, bands = (image->height + rows - 1) / rows;

    return lumi_parallel_for(bands, threads, sgm_band, &job);
}
