/* The plane sweep: costs of the planes searched at every pixel, over the neighbours that see it best (after Collins
 * 1996, "A space-sweep approach to true multi-image matching"; the choice of neighbours is Kang, Szeliski and Chai
 * 2001, "Handling occlusions in dense multi-view stereo", temporal selection). */
#include "pipeline/depth/mvs_priv.h"
#include "proto/base/parallel.h"

#include <math.h>
#include <string.h>

struct volume_job {
    const struct mvs_image *image;
    const struct mvs_target *targets;
    const struct mvs_planes *planes;
    const struct mvs_search *search;
    const struct mvs_kernels *kernels;
    int count;
    uint8_t *volume;
};

static void init_ends(struct mvs_ends *ends, const struct mvs_target *target, const struct mvs_planes *planes,
                      int groups, const uint8_t *group)
{
    float w[2 * MVS_GROUPS_MAX];
    int count = 0;

    for (int i = 0; i < groups; i++) {
        if (i == 0 || group[i] != group[i - 1] + 1)
            w[count++] = (float)(planes->first + MVS_GROUP * group[i] * planes->step);
        ends->end[i] = (uint8_t)(count - 1);
        w[count++] = (float)(planes->first + MVS_GROUP * (group[i] + 1) * planes->step);
    }
    while (count % 8) {
        w[count] = w[count - 1];
        count++;
    }
    ends->groups = groups;
    ends->count = count;
    for (int i = 0; i < count; i++) {
        ends->x[i] = w[i] * target->shift[0];
        ends->y[i] = w[i] * target->shift[1];
        ends->z[i] = w[i] * target->shift[2];
    }
}

/* A pixel's ray, turned into a neighbour's frame. */
static void turn(const struct mvs_target *target, float tan_x, float tan_y, float a[3])
{
    for (int i = 0; i < 3; i++) {
        const float *r = target->rotation + 3 * i;
        a[i] = r[0] * tan_x + r[1] * tan_y + r[2];
    }
}

/* The lines that the axes are over all the block's rays and planes: what a convex body is seen within is seen at its
 * corners. */
static void init_lines(struct mvs_ends *ends, const struct mvs_target *target, const struct mvs_image *image, int left,
                       int right, int top, int bottom)
{
    float low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};

    ends->column = ends->row = (struct mvs_line){false, 0, 0};
    for (int i = 0; i < 8; i++) {
        const int e = i & 4 ? ends->count - 1 : 0;
        float a[3];
        turn(target, image->tan_x[i & 1 ? right - 1 : left], image->tan_y[i & 2 ? bottom - 1 : top], a);
        const float z = a[2] + ends->z[e], tangent[2] = {(a[0] + ends->x[e]) / z, (a[1] + ends->y[e]) / z};
        if (!(z > 0))
            return;
        for (int axis = 0; axis < 2; axis++) {
            low[axis] = fminf(low[axis], tangent[axis]);
            high[axis] = fmaxf(high[axis], tangent[axis]);
        }
    }
    ends->column = mvs_axis_line(&target->x, low[0], high[0]);
    ends->row = mvs_axis_line(&target->y, low[1], high[1]);
}

/* A row of pixels of a block, neighbour by neighbour: what one pixel's sweep reads, the next one's mostly reads again.
 */
struct block_row {
    uint8_t cost[MVS_BLOCK][LUMI_MVS_NEIGHBOURS][MVS_PLANES_MAX];
};

static void sweep_row(const struct volume_job *job, const struct mvs_ends *ends, int left, int right, int y,
                      struct block_row *row)
{
    const struct mvs_image *image = job->image;
    const uint32_t *colours = image->pixels + (size_t)y * (size_t)image->width;

    for (int n = 0; n < job->count; n++) {
        const struct mvs_target *target = &job->targets[n];
        for (int x = left; x < right; x++) {
            float a[3];
            turn(target, image->tan_x[x], image->tan_y[y], a);
            job->kernels->sweep(target, &ends[n], a, colours[x], row->cost[x - left][n]);
        }
    }
}

static void sweep_block(const struct volume_job *job, int row, int column, struct block_row *costs)
{
    const struct mvs_image *image = job->image;
    const struct mvs_block *block = job->search->blocks + (size_t)row * (size_t)job->search->columns + column;
    const int best = (job->count + 1) / 2, left = column * MVS_BLOCK, top = row * MVS_BLOCK;
    const int right = left + MVS_BLOCK < image->width ? left + MVS_BLOCK : image->width;
    const int bottom = top + MVS_BLOCK < image->height ? top + MVS_BLOCK : image->height;
    struct mvs_ends ends[LUMI_MVS_NEIGHBOURS];
    uint8_t group[MVS_GROUPS_MAX];
    const int groups = mvs_groups(block->groups, group);

    for (int n = 0; n < job->count; n++) {
        init_ends(&ends[n], &job->targets[n], job->planes, groups, group);
        init_lines(&ends[n], &job->targets[n], image, left, right, top, bottom);
    }
    for (int y = top; y < bottom; y++) {
        uint8_t *result = job->volume + block->at + (size_t)(y - top) * MVS_BLOCK * (size_t)block->lanes;
        sweep_row(job, ends, left, right, y, costs);
        for (int x = left; x < right; x++, result += block->lanes)
            job->kernels->combine(costs->cost[x - left], best, block->lanes, result);
    }
}

static int volume_row(void *context, int row, int thread)
{
    const struct volume_job *job = context;
    struct block_row costs;

    (void)thread;
    memset(&costs, MVS_INVALID, sizeof(costs)); /* neighbours that are not there */
    for (int column = 0; column < job->search->columns; column++)
        sweep_block(job, row, column, &costs);
    return LUMI_OK;
}

int mvs_volume(const struct mvs_image *image, int count, const struct mvs_target *targets,
               const struct mvs_planes *planes, const struct mvs_search *search, int threads, uint8_t *volume)
{
    struct volume_job job = {image, targets, planes, search, mvs_kernels(), count, volume};

    return lumi_parallel_for(search->rows, threads, volume_row, &job);
}
