/* Views made ready for matching: colours packed, neighbours at twice the density, lenses as tables. */
#include "pipeline/depth/mvs_priv.h"
#include "proto/base/memory.h"

#include <math.h>
#include <string.h>

#define BENT_PX 0.06f /* of an axis from a straight line, at twice the density: too little to tell */

static uint8_t clamp_byte(int value)
{
    return (uint8_t)(value < 0 ? 0 : value > 255 ? 255 : value);
}

/* A row of colours, averaged over divisor × divisor pixels. */
static void pack_colours(const struct lumi_raster *source, int divisor, int y, int width, uint32_t *pixels)
{
    const unsigned area = (unsigned)(divisor * divisor);

    if (divisor == 1) {
        const uint8_t *row = lumi_row_u8(source, y);
        for (int x = 0; x < width; x++)
            pixels[x] = row[3 * x] | (uint32_t)row[3 * x + 1] << 8 | (uint32_t)row[3 * x + 2] << 16;
        return;
    }
    for (int x = 0; x < width; x++) {
        unsigned sum[3] = {0};
        for (int j = 0; j < divisor; j++) {
            const uint8_t *row = lumi_row_u8(source, y * divisor + j) + 3 * x * divisor;
            for (int i = 0; i < divisor; i++)
                for (int c = 0; c < 3; c++)
                    sum[c] += row[3 * i + c];
        }
        pixels[x] = (sum[0] + area / 2) / area | (sum[1] + area / 2) / area << 8 | (sum[2] + area / 2) / area << 16;
    }
}

static uint16_t luma(uint32_t pixel)
{
    return (uint16_t)(((pixel & 255) + 2 * (pixel >> 8 & 255) + (pixel >> 16 & 255) + 2) >> 2);
}

/* Sums of brightness over five pixels of a row, with the border repeated. `bright`: width + 4 elements. */
static void blur_row(const uint32_t *pixels, int width, uint16_t *bright, uint16_t *sums)
{
    for (int x = 0; x < width; x++)
        bright[x + 2] = luma(pixels[x]);
    bright[0] = bright[1] = bright[2];
    bright[width + 2] = bright[width + 3] = bright[width + 1];
    for (int x = 0; x < width; x++)
        sums[x] = (uint16_t)(bright[x] + bright[x + 1] + bright[x + 2] + bright[x + 3] + bright[x + 4]);
}

/* Local contrast, brightness over its mean in 5×5 pixels, in the fourth byte: what a change of exposure or a soft
 * highlight leaves as it is. */
static int pack_contrast(int width, int height, uint32_t *pixels)
{
    enum { ROWS = 5 };
    const size_t line = (size_t)width;
    uint16_t *sums = lumi_alloc((ROWS + 1) * line + 4, sizeof(uint16_t)), *bright = sums + ROWS * line;

    if (!sums)
        return LUMI_ERR_NOMEM;
    for (int y = -2; y < height; y++) {
        /* sums: of row r at r % 5, of all within two rows of y */
        for (int r = y == -2 ? 0 : y + 2; r <= y + 2 && r < height; r++)
            blur_row(pixels + (size_t)r * line, width, bright, sums + (size_t)(r % ROWS) * line);
        const uint16_t *around[ROWS];
        for (int j = 0; j < ROWS; j++) {
            const int r = y + j - 2;
            around[j] = sums + (size_t)((r < 0 ? 0 : r < height ? r : height - 1) % ROWS) * line;
        }
        uint32_t *row = pixels + (size_t)(y < 0 ? 0 : y) * line;
        for (int x = 0; y >= 0 && x < width; x++) {
            int mean = around[0][x] + around[1][x] + around[2][x] + around[3][x] + around[4][x];
            row[x] |= (uint32_t)clamp_byte(128 + (25 * luma(row[x]) - mean) / 25) << 24;
        }
    }
    lumi_free(sums);
    return LUMI_OK;
}

static int image_pixels(const struct lumi_mvs_view *view, int divisor, int *width, int *height, uint32_t **pixels)
{
    *width = view->grid->width / divisor;
    *height = view->grid->height / divisor;
    *pixels = lumi_alloc((size_t)*width * (size_t)*height, sizeof(uint32_t));
    if (!*pixels)
        return LUMI_ERR_NOMEM;
    for (int y = 0; y < *height; y++)
        pack_colours(&view->image, divisor, y, *width, *pixels + (size_t)y * (size_t)*width);
    return pack_contrast(*width, *height, *pixels);
}

int mvs_image_init(struct mvs_image *image, const struct lumi_mvs_view *view, int divisor)
{
    memset(image, 0, sizeof(*image));
    LUMI_TRY(image_pixels(view, divisor, &image->width, &image->height, &image->pixels));
    image->tan_x = lumi_alloc((size_t)image->width, sizeof(float));
    image->tan_y = lumi_alloc((size_t)image->height, sizeof(float));
    if (!image->tan_x || !image->tan_y)
        return LUMI_ERR_NOMEM;
    for (int x = 0; x < image->width; x++) {
        double tan_x, tan_y;
        lumi_grid_unproject(view->grid, (x + 0.5) * divisor, 0, &tan_x, &tan_y);
        image->tan_x[x] = (float)tan_x;
    }
    for (int y = 0; y < image->height; y++) {
        double tan_x, tan_y;
        lumi_grid_unproject(view->grid, 0, (y + 0.5) * divisor, &tan_x, &tan_y);
        image->tan_y[y] = (float)tan_y;
    }
    return LUMI_OK;
}

void mvs_image_finish(struct mvs_image *image)
{
    lumi_free(image->pixels);
    lumi_free(image->tan_x);
    lumi_free(image->tan_y);
    memset(image, 0, sizeof(*image));
}

/* Half-way between b and c by cubic interpolation, byte by byte. */
static void between(const uint8_t *a, const uint8_t *b, const uint8_t *c, const uint8_t *d, size_t count,
                    uint8_t *restrict result)
{
    for (size_t i = 0; i < count; i++) {
        int value = (9 * (b[i] + c[i]) - (a[i] + d[i]) + 8) >> 4;
        value = value < 0 ? 0 : value;
        result[i] = (uint8_t)(value < 255 ? value : 255);
    }
}

/* A row at twice the density; `line` has room for `width` + 3 pixels, `middle` for `width`. */
static void double_row(const uint32_t *pixels, int width, uint32_t *line, uint32_t *middle, uint32_t *result)
{
    const size_t pixel = sizeof(*pixels), last = (size_t)width - 1;
    const uint8_t *bytes = (const uint8_t *)line;

    memcpy(line + 1, pixels, (size_t)width * pixel);
    line[0] = pixels[0];
    line[width + 1] = line[width + 2] = pixels[last];
    between(bytes, bytes + pixel, bytes + 2 * pixel, bytes + 3 * pixel, last * pixel, (uint8_t *)middle);
    for (size_t x = 0; x < last; x++) {
        result[2 * x] = pixels[x];
        result[2 * x + 1] = middle[x];
    }
    result[2 * last] = pixels[last];
}

/* `pixels` at twice the density. */
static int double_pixels(struct mvs_target *target, const uint32_t *pixels, int width, int height)
{
    const size_t wide = 2 * (size_t)width - 1;
    uint32_t *line = lumi_alloc(2 * (size_t)width + 3, sizeof(uint32_t));

    target->width = 2 * width - 1;
    target->height = 2 * height - 1;
    target->pixels = lumi_alloc(wide * (size_t)target->height, sizeof(uint32_t));
    if (!line || !target->pixels) {
        lumi_free(line);
        return LUMI_ERR_NOMEM;
    }
    for (int y = 0; y < height; y++)
        double_row(pixels + (size_t)y * (size_t)width, width, line, line + width + 3,
                   target->pixels + 2 * (size_t)y * wide);
    for (int y = 0; y + 1 < height; y++) {
        const uint32_t *at = target->pixels + 2 * (size_t)y * wide;
        const uint32_t *before = y > 0 ? at - 2 * wide : at, *after = y + 2 < height ? at + 4 * wide : at + 2 * wide;
        between((const uint8_t *)before, (const uint8_t *)at, (const uint8_t *)(at + 2 * wide), (const uint8_t *)after,
                wide * sizeof(uint32_t), (uint8_t *)(target->pixels + (2 * (size_t)y + 1) * wide));
    }
    lumi_free(line);
    return LUMI_OK;
}

/* Exact at the cells' ends, which lie closer together than pixels do. */
void mvs_axis_init(struct mvs_axis *axis, const double *tangents, int tiles, int divisor)
{
    const double low = tangents[0], high = tangents[tiles];
    const double pitch = (tangents[1] - tangents[0]) / LUMI_TILE;
    double worst = 0;
    int tile = 0;

    for (int i = 0; i <= tiles; i++)
        worst = fmax(worst, fabs(tangents[0] + i * LUMI_TILE * pitch - tangents[i]));
    axis->linear = worst < 1e-4 * pitch;
    axis->origin = (float)low;
    axis->scale = (float)(MVS_AXIS_CELLS / (high - low));
    double from = 0, to = 0;
    for (int i = 0; i <= MVS_AXIS_CELLS; i++) {
        double tangent = low + (high - low) * i / MVS_AXIS_CELLS;
        while (tile + 1 < tiles && tangent >= tangents[tile + 1])
            tile++;
        to = LUMI_TILE * (tile + (tangent - tangents[tile]) / (tangents[tile + 1] - tangents[tile]));
        to = 2 * to / divisor - 1;
        if (i > 0) {
            double cell = (high - low) / MVS_AXIS_CELLS, slope = (to - from) / cell;
            axis->b[i - 1] = (float)slope;
            axis->a[i - 1] = (float)(to - slope * tangent);
        }
        from = to;
    }
    if (axis->linear) {
        axis->b[0] = (float)(2 / (pitch * divisor));
        axis->a[0] = (float)(-1 - 2 * low / (pitch * divisor));
    }
}

struct mvs_line mvs_axis_line(const struct mvs_axis *axis, float low, float high)
{
    const float first = mvs_axis_position(axis, low), last = mvs_axis_position(axis, high);
    const float cell = 1 / axis->scale, width = high - low;

    if (axis->linear || !(width > 0 && width < MVS_AXIS_CELLS * cell))
        return (struct mvs_line){axis->linear, axis->a[0], axis->b[0]};
    const float b = (last - first) / width, a = first - b * low;
    for (float tangent = low + cell; tangent < high; tangent += cell)
        if (!(fabsf(mvs_axis_position(axis, tangent) - (a + b * tangent)) <= BENT_PX))
            return (struct mvs_line){false, 0, 0};
    return (struct mvs_line){true, a, b};
}

int mvs_target_init(struct mvs_target *target, const struct lumi_mvs_view *view, const struct lumi_mvs_view *neighbour,
                    int divisor)
{
    uint32_t *pixels = NULL;
    int width, height, code;

    memset(target, 0, sizeof(*target));
    LUMI_GOTO(code, done, image_pixels(neighbour, divisor, &width, &height, &pixels));
    LUMI_GOTO(code, done, double_pixels(target, pixels, width, height));
    const struct lumi_grid *grid = neighbour->grid;
    mvs_axis_init(&target->x, grid->tan_x, grid->cols, divisor);
    mvs_axis_init(&target->y, grid->tan_y, grid->rows, divisor);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            target->rotation[3 * i + j] = (float)lumi_dot(lumi_axis(&neighbour->pose, i), lumi_axis(&view->pose, j));
    struct lumi_vec3 shift = lumi_to_camera(&neighbour->pose, view->pose.t);
    target->shift[0] = (float)shift.x;
    target->shift[1] = (float)shift.y;
    target->shift[2] = (float)shift.z;
    code = LUMI_OK;
done:
    lumi_free(pixels);
    return code;
}

void mvs_target_finish(struct mvs_target *target)
{
    lumi_free(target->pixels);
    target->pixels = NULL;
}
