/* Reference images without their noise.
 *
 * For each block of 8×8 and each other view a vector of quarter pixels is found, by the differences of the 16×16 around
 * it. The least quarter of the views' squared differences there is taken for noise (twice its variance): views and
 * pixels whose differences are larger weigh less, as e to the excess over the noise. Integers throughout. */
#include "pipeline/compress/reference_filter.h"

#include "proto/base/memory.h"
#include "proto/base/sort.h"
#include "proto/lightfield/block_difference.h"
#include "proto/lightfield/tile_encoder.h"

#include <limits.h>
#include <string.h>

enum { BLOCK = 8, SUPPORT = LUMI_DIFFERENCE_BLOCK, MARGIN = (SUPPORT - BLOCK) / 2, PAD = 32 };
enum { AROUND = 2, PATCH = BLOCK + 2 * AROUND, WINDOW = 2 * AROUND + 1 }; /* differences are summed over WINDOW² */
enum { ONE = 256 };                                                       /* a weight */
/* Squared differences over a block: of rounding alone, and more than is ever taken for noise. */
enum { NOISE_FLOOR = BLOCK * BLOCK, NOISE_MOST = 128 * BLOCK * BLOCK };

/* A plane whose edge pixels go on for PAD pixels. */
struct padded {
    int width, height, stride;
    uint8_t *pixels; /* of the top left of the padding */
};

/* Quarters of a pixel. */
struct vector {
    int x, y;
};

struct other {
    struct padded planes[3];
    struct vector *vectors; /* a block each */
};

struct filter {
    const struct lumi_yuv *reference;
    struct padded luma; /* the reference's */
    int cols, rows;     /* blocks */
    int *noise;         /* for a block each: see limit_noise */
    int noise_most;
    int used; /* of the other views: all or none */
    int count;
    struct other others[LUMI_FILTER_OTHERS_MAX];
};

static inline int clamp(int value, int low, int high)
{
    return value < low ? low : value > high ? high : value;
}

static int pad_plane(const struct lumi_yuv *image, int plane, struct padded *padded)
{
    const int width = lumi_yuv_width(image, plane), height = lumi_yuv_height(image, plane);

    *padded = (struct padded){width, height, width + 2 * PAD, NULL};
    padded->pixels = lumi_alloc((size_t)padded->stride * (size_t)(height + 2 * PAD), 1);
    if (!padded->pixels)
        return LUMI_ERR_NOMEM;
    for (int y = 0; y < height + 2 * PAD; y++) {
        const uint8_t *from = image->plane[plane] + (size_t)clamp(y - PAD, 0, height - 1) * (size_t)width;
        uint8_t *to = padded->pixels + (size_t)y * (size_t)padded->stride;
        memset(to, from[0], PAD);
        memcpy(to + PAD, from, (size_t)width);
        memset(to + PAD + width, from[width - 1], PAD);
    }
    return LUMI_OK;
}

/* The pixel at (x, y), which is moved so that `size` pixels each way, and two more around, lie inside the padding. */
static inline const uint8_t *pixel_at(const struct padded *plane, int x, int y, int size)
{
    x = clamp(x, 2 - PAD, plane->width + PAD - size - 2);
    y = clamp(y, 2 - PAD, plane->height + PAD - size - 2);
    return plane->pixels + (ptrdiff_t)(y + PAD) * plane->stride + x + PAD;
}

/* size × size samples from (x, y), in eighths of a pixel: cubic convolution (Catmull-Rom). */
static inline void sample(const struct padded *plane, int x, int y, int size, uint8_t *out)
{
    static const int16_t taps[8][4] = {{0, 128, 0, 0},   {-6, 123, 12, -1}, {-9, 111, 29, -3}, {-9, 93, 50, -6},
                                       {-8, 72, 72, -8}, {-6, 50, 93, -9},  {-3, 29, 111, -9}, {-1, 12, 123, -6}};
    const uint8_t *from = pixel_at(plane, x >> 3, y >> 3, size) - plane->stride;
    const int16_t *across = taps[x & 7], *down = taps[y & 7];
    int16_t rows[(SUPPORT + 3) * SUPPORT]; /* eight times the value */

    for (int v = 0; v < size + 3; v++, from += plane->stride)
        for (int u = 0; u < size; u++)
            rows[v * size + u] = (int16_t)((from[u - 1] * across[0] + from[u] * across[1] + from[u + 1] * across[2] +
                                            from[u + 2] * across[3] + 8) >>
                                           4);
    for (int i = 0; i < size * size; i++) {
        int value =
            rows[i] * down[0] + rows[i + size] * down[1] + rows[i + 2 * size] * down[2] + rows[i + 3 * size] * down[3];
        out[i] = (uint8_t)clamp((value + 512) >> 10, 0, 255);
    }
}

/* The search for one block. */
struct search {
    const struct padded *from, *in;
    int x, y; /* of the support */
    unsigned least;
    struct vector best;
};

static void try_whole(struct search *search, int x, int y)
{
    const uint8_t *a = pixel_at(search->from, search->x, search->y, SUPPORT);
    const uint8_t *b = pixel_at(search->in, search->x + x, search->y + y, SUPPORT);
    unsigned sum = lumi_block_difference(a, search->from->stride, b, search->in->stride);

    if (sum < search->least) {
        search->least = sum;
        search->best = (struct vector){4 * x, 4 * y};
    }
}

static void try_quarter(struct search *search, int x, int y)
{
    uint8_t patch[SUPPORT * SUPPORT];
    const uint8_t *a = pixel_at(search->from, search->x, search->y, SUPPORT);

    sample(search->in, 8 * search->x + 2 * x, 8 * search->y + 2 * y, SUPPORT, patch);
    unsigned sum = lumi_block_difference(a, search->from->stride, patch, SUPPORT);
    if (sum < search->least) {
        search->least = sum;
        search->best = (struct vector){x, y};
    }
}

/* Around the best so far: whole pixels twice, then halves and quarters. */
static void refine(struct search *search)
{
    enum { REACH = 2, ROUNDS = 2 };

    for (int round = 0; round < ROUNDS; round++) {
        struct vector centre = search->best;
        for (int y = -REACH; y <= REACH; y++)
            for (int x = -REACH; x <= REACH; x++)
                try_whole(search, centre.x / 4 + x, centre.y / 4 + y);
        if (search->best.x == centre.x && search->best.y == centre.y)
            break;
    }
    for (int step = 2; step > 0; step--) {
        struct vector centre = search->best;
        for (int y = -step; y <= step; y += step)
            for (int x = -step; x <= step; x += step)
                if (x != 0 || y != 0)
                    try_quarter(search, centre.x + x, centre.y + y);
    }
}

/* Candidates: the tile's two shifts, and what was found to the left and above. */
static void find_vectors(const struct filter *filter, struct other *other, const struct lumi_shift (*shifts)[2])
{
    const int tile_cols = (filter->reference->width + LUMI_TILE - 1) / LUMI_TILE, cols = filter->cols;

    for (int i = 0; i < cols * filter->rows; i++) {
        int x = i % cols * BLOCK, y = i / cols * BLOCK;
        const struct lumi_shift *shift = shifts[y / LUMI_TILE * tile_cols + x / LUMI_TILE];
        struct search search = {&filter->luma, &other->planes[0], x - MARGIN, y - MARGIN, -1U, {0, 0}};
        for (int k = 0; k < LUMI_WINDOWS; k++)
            try_whole(&search, shift[k].x, shift[k].y);
        if (x > 0)
            try_whole(&search, other->vectors[i - 1].x / 4, other->vectors[i - 1].y / 4);
        if (y > 0)
            try_whole(&search, other->vectors[i - cols].x / 4, other->vectors[i - cols].y / 4);
        refine(&search);
        other->vectors[i] = search.best;
    }
}

static int add_other(struct filter *filter, const struct lumi_filter_view *view, int range, struct lumi_error *error)
{
    const struct lumi_yuv *reference = filter->reference;
    const int cols = (reference->width + LUMI_TILE - 1) / LUMI_TILE;
    const int tiles = cols * ((reference->height + LUMI_TILE - 1) / LUMI_TILE);
    struct other *other = &filter->others[filter->count++];
    struct lumi_shift(*shifts)[LUMI_WINDOWS] = lumi_calloc((size_t)tiles, sizeof *shifts);
    int code = shifts ? LUMI_OK : LUMI_ERR_NOMEM;

    other->vectors = lumi_alloc((size_t)filter->cols * (size_t)filter->rows, sizeof *other->vectors);
    if (!other->vectors)
        code = LUMI_ERR_NOMEM;
    for (int p = 0; code == LUMI_OK && p < 3; p++)
        code = pad_plane(view->image, p, &other->planes[p]);
    if (code != LUMI_OK)
        lumi_fail(error, code, "no memory to filter a reference image");
    for (int i = 0; code == LUMI_OK && i < tiles; i++) {
        struct lumi_tile_pixels source;
        int x = i % cols * LUMI_TILE, y = i / cols * LUMI_TILE;
        lumi_window_copy(reference, x, y, &source);
        code = lumi_shift_search(view->image, x, y, &source, view->seeds ? view->seeds[i] : (struct lumi_shift){0, 0},
                                 range, shifts[i], error);
    }
    if (code == LUMI_OK)
        find_vectors(filter, other, (const struct lumi_shift(*)[LUMI_WINDOWS])shifts);
    lumi_free(shifts);
    return code;
}

/* A block as the other views show it. */
struct stack {
    uint8_t patch[LUMI_FILTER_OTHERS_MAX][PATCH * PATCH];
    int squares[LUMI_FILTER_OTHERS_MAX][PATCH * PATCH];
    int sums[LUMI_FILTER_OTHERS_MAX]; /* of the squares within the block */
    int noise;
};

static void fill_stack(const struct filter *filter, int block, struct stack *stack)
{
    const int x = block % filter->cols * BLOCK - AROUND, y = block / filter->cols * BLOCK - AROUND;
    const uint8_t *own = pixel_at(&filter->luma, x, y, PATCH);
    int sorted[LUMI_FILTER_OTHERS_MAX] = {0};

    for (int k = 0; k < filter->count; k++) {
        struct vector vector = filter->others[k].vectors[block];
        sample(&filter->others[k].planes[0], 8 * x + 2 * vector.x, 8 * y + 2 * vector.y, PATCH, stack->patch[k]);
        stack->sums[k] = 0;
        for (int i = 0; i < PATCH * PATCH; i++) {
            int u = i % PATCH, v = i / PATCH, d = own[v * filter->luma.stride + u] - stack->patch[k][i];
            stack->squares[k][i] = d * d;
            if (u >= AROUND && u < AROUND + BLOCK && v >= AROUND && v < AROUND + BLOCK)
                stack->sums[k] += d * d;
        }
        sorted[k] = stack->sums[k];
    }
    lumi_sort_ints(sorted, filter->count);
    stack->noise = sorted[filter->count / 4] + NOISE_FLOOR;
    stack->noise = stack->noise < filter->noise_most ? stack->noise : filter->noise_most;
}

/* Noise is about the same all over an image; what differs much more than most blocks do is texture or an edge that the
 * other views do not show the same way. Where most blocks differ beyond all noise the views show something else. */
static void limit_noise(struct filter *filter, struct stack *stack)
{
    const int count = filter->cols * filter->rows;

    filter->noise_most = INT_MAX;
    for (int i = 0; i < count; i++) {
        fill_stack(filter, i, stack);
        filter->noise[i] = stack->noise;
    }
    lumi_sort_ints(filter->noise, count);
    int middle = filter->noise[count / 2];
    filter->noise_most = 2 * middle < NOISE_MOST ? 2 * middle : NOISE_MOST;
    filter->used = middle < NOISE_MOST ? filter->count : 0;
}

/* ONE · e^−(excess / noise). */
static int fall(int excess, int noise)
{
    static const uint16_t table[] = {256, 226, 199, 176, 155, 137, 121, 107, 94, 83, 73, 65, 57, 50, 44, 39,
                                     35,  31,  27,  24,  21,  19,  16,  14,  13, 11, 10, 9,  8,  7,  6,  5,
                                     5,   4,   4,   3,   3,   3,   2,   2,   2,  2,  1,  1,  1,  1,  1,  1};
    int64_t at = excess > 0 ? (int64_t)excess * 8 / noise : 0;

    return at < (int64_t)(sizeof table / sizeof *table) ? table[at] : 0;
}

/* The weights of the pixels of the k-th view: by the block's difference and by each pixel's surroundings, which may
 * have half more, there being fewer of them. */
static void weigh(const struct stack *stack, int k, int weights[BLOCK * BLOCK])
{
    const int whole = fall(stack->sums[k] - stack->noise, stack->noise);

    for (int i = 0; i < BLOCK * BLOCK; i++) {
        const int *square = &stack->squares[k][i / BLOCK * PATCH + i % BLOCK];
        int sum = 0;
        for (int v = 0; v < WINDOW; v++)
            for (int u = 0; u < WINDOW; u++)
                sum += square[v * PATCH + u];
        weights[i] = whole * fall(sum * BLOCK * BLOCK / (WINDOW * WINDOW) - stack->noise * 3 / 2, stack->noise) / ONE;
    }
}

/* Sums of the samples of a block in a plane, and of their weights. */
struct mean {
    int size, value[BLOCK * BLOCK], weight[BLOCK * BLOCK];
};

static void begin_mean(const struct lumi_yuv *image, int plane, int x0, int y0, int own_weight, struct mean *mean)
{
    const int width = lumi_yuv_width(image, plane), height = lumi_yuv_height(image, plane);

    mean->size = plane ? BLOCK / 2 : BLOCK;
    for (int i = 0; i < mean->size * mean->size; i++) {
        int x = clamp(x0 + i % mean->size, 0, width - 1), y = clamp(y0 + i / mean->size, 0, height - 1);
        mean->weight[i] = ONE * own_weight;
        mean->value[i] = mean->weight[i] * image->plane[plane][(size_t)y * (size_t)width + (size_t)x];
    }
}

static void end_mean(const struct mean *mean, int plane, int x0, int y0, struct lumi_yuv *image)
{
    const int width = lumi_yuv_width(image, plane), height = lumi_yuv_height(image, plane);

    for (int i = 0; i < mean->size * mean->size; i++) {
        int x = x0 + i % mean->size, y = y0 + i / mean->size;
        if (x < width && y < height)
            image->plane[plane][(size_t)y * (size_t)width + (size_t)x] =
                (uint8_t)((mean->value[i] + mean->weight[i] / 2) / mean->weight[i]);
    }
}

static void add_luma(const struct stack *stack, int k, const int weights[BLOCK * BLOCK], struct mean *mean)
{
    for (int i = 0; i < BLOCK * BLOCK; i++) {
        mean->value[i] += weights[i] * stack->patch[k][(i / BLOCK + AROUND) * PATCH + i % BLOCK + AROUND];
        mean->weight[i] += weights[i];
    }
}

/* Chroma weighs as the least of its four luma pixels. */
static void add_chroma(const struct other *other, int plane, int x, int y, struct vector vector,
                       const int weights[BLOCK * BLOCK], struct mean *mean)
{
    enum { HALF = BLOCK / 2 };
    uint8_t patch[HALF * HALF];

    sample(&other->planes[plane], 8 * x + vector.x, 8 * y + vector.y, HALF, patch);
    for (int i = 0; i < HALF * HALF; i++) {
        const int *four = &weights[i / HALF * 2 * BLOCK + i % HALF * 2];
        int a = four[0] < four[1] ? four[0] : four[1];
        int b = four[BLOCK] < four[BLOCK + 1] ? four[BLOCK] : four[BLOCK + 1];
        int weight = a < b ? a : b;
        mean->value[i] += weight * patch[i];
        mean->weight[i] += weight;
    }
}

static void filter_block(const struct filter *filter, int block, int own_weight, struct stack *stack,
                         struct lumi_yuv *filtered)
{
    const int x = block % filter->cols * BLOCK, y = block / filter->cols * BLOCK;
    int weights[BLOCK * BLOCK];
    struct mean means[3];

    fill_stack(filter, block, stack);
    for (int p = 0; p < 3; p++)
        begin_mean(filter->reference, p, p ? x / 2 : x, p ? y / 2 : y, own_weight, &means[p]);
    for (int k = 0; k < filter->used; k++) {
        weigh(stack, k, weights);
        add_luma(stack, k, weights, &means[0]);
        for (int p = 1; p < 3; p++)
            add_chroma(&filter->others[k], p, x / 2, y / 2, filter->others[k].vectors[block], weights, &means[p]);
    }
    for (int p = 0; p < 3; p++)
        end_mean(&means[p], p, p ? x / 2 : x, p ? y / 2 : y, filtered);
}

int lumi_filter_own_weight(int quantizer)
{
    return quantizer >= 18 ? 1 : quantizer < 10 ? 0 : 1 + (18 - quantizer) / 2;
}

static int run(struct filter *filter, const struct lumi_filter_view *others, int count, int range, int own_weight,
               struct lumi_yuv *filtered, struct lumi_error *error)
{
    struct stack *stack = lumi_alloc(1, sizeof *stack);
    int code = LUMI_ERR_NOMEM;

    filter->noise = lumi_alloc((size_t)filter->cols * (size_t)filter->rows, sizeof *filter->noise);
    if (stack && filter->noise)
        code = pad_plane(filter->reference, 0, &filter->luma);
    if (code == LUMI_OK)
        code = lumi_yuv_create(filtered, filter->reference->width, filter->reference->height);
    if (code != LUMI_OK)
        lumi_fail(error, code, "no memory to filter a reference image");
    for (int i = 0; code == LUMI_OK && i < count; i++)
        code = add_other(filter, &others[i], range, error);
    if (code == LUMI_OK)
        limit_noise(filter, stack);
    for (int i = 0; code == LUMI_OK && i < filter->cols * filter->rows; i++)
        filter_block(filter, i, own_weight, stack, filtered);
    lumi_free(stack);
    return code;
}

int lumi_reference_filter(const struct lumi_yuv *reference, const struct lumi_filter_view *others, int count, int range,
                          int own_weight, struct lumi_yuv *filtered, struct lumi_error *error)
{
    struct filter *filter = lumi_calloc(1, sizeof *filter);

    *filtered = (struct lumi_yuv){0};
    if (!filter)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory to filter a reference image");
    filter->reference = reference;
    filter->cols = (reference->width + BLOCK - 1) / BLOCK;
    filter->rows = (reference->height + BLOCK - 1) / BLOCK;
    int code = run(filter, others, count > LUMI_FILTER_OTHERS_MAX ? LUMI_FILTER_OTHERS_MAX : count, range, own_weight,
                   filtered, error);
    if (code != LUMI_OK)
        lumi_yuv_finish(filtered);
    for (int i = 0; i < filter->count; i++) {
        for (int p = 0; p < 3; p++)
            lumi_free(filter->others[i].planes[p].pixels);
        lumi_free(filter->others[i].vectors);
    }
    lumi_free(filter->noise);
    lumi_free(filter->luma.pixels);
    lumi_free(filter);
    return code;
}
