/* Views made ready for matching: colours packed, neighbours at twice the density, lenses as tables. */
#include "pipeline/depth/mvs_priv.h"
#include "proto/base/memory.h"

#include <math.h>
#include <string.h>

static uint8_t clamp_byte(int value)
{
    return (uint8_t)(value < 0 ? 0 : value > 255 ? 255 : value);
}

/* Colours, averaged over divisor × divisor pixels. */
static void pack_colours(const struct lumi_raster *source, int divisor, int width, int height, uint32_t *pixels)
{
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            unsigned sum[3] = {0}, area = (unsigned)(divisor * divisor);
            for (int j = 0; j < divisor; j++) {
                const uint8_t *row = lumi_row_u8(source, y * divisor + j) + 3 * x * divisor;
                for (int i = 0; i < divisor; i++)
                    for (int c = 0; c < 3; c++)
                        sum[c] += row[3 * i + c];
            }
            uint32_t packed = 0;
            for (int c = 0; c < 3; c++)
                packed |= (sum[c] + area / 2) / area << 8 * c;
            pixels[(size_t)y * (size_t)width + (size_t)x] = packed;
        }
}

static int luma(uint32_t pixel)
{
    return (int)(((pixel & 255) + 2 * (pixel >> 8 & 255) + (pixel >> 16 & 255) + 2) >> 2);
}

/* Sums over five places, with the border repeated. */
static void blur_line(const int *source, int count, int step, int *result)
{
    for (int i = 0; i < count; i++) {
        int sum = 0;
        for (int j = i - 2; j <= i + 2; j++)
            sum += source[(j < 0 ? 0 : j >= count ? count - 1 : j) * step];
        result[i * step] = sum;
    }
}

/* Local contrast, brightness over its mean in 5×5 pixels, in the fourth byte: what a change of exposure or a soft
 * highlight leaves as it is. */
static int pack_contrast(int width, int height, uint32_t *pixels)
{
    const size_t count = (size_t)width * (size_t)height;
    int *bright = lumi_alloc(count, 3 * sizeof(int)), *rows = bright + count, *both = rows + count;

    if (!bright)
        return LUMI_ERR_NOMEM;
    for (size_t i = 0; i < count; i++)
        bright[i] = luma(pixels[i]);
    for (int y = 0; y < height; y++)
        blur_line(bright + (size_t)y * (size_t)width, width, 1, rows + (size_t)y * (size_t)width);
    for (int x = 0; x < width; x++)
        blur_line(rows + x, height, width, both + x);
    for (size_t i = 0; i < count; i++)
        pixels[i] |= (uint32_t)clamp_byte(128 + (25 * bright[i] - both[i]) / 25) << 24;
    lumi_free(bright);
    return LUMI_OK;
}

static int image_pixels(const struct lumi_mvs_view *view, int divisor, int *width, int *height, uint32_t **pixels)
{
    *width = view->grid->width / divisor;
    *height = view->grid->height / divisor;
    *pixels = lumi_alloc((size_t)*width * (size_t)*height, sizeof(uint32_t));
    if (!*pixels)
        return LUMI_ERR_NOMEM;
    pack_colours(&view->image, divisor, *width, *height, *pixels);
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
static uint32_t between(uint32_t a, uint32_t b, uint32_t c, uint32_t d)
{
    uint32_t result = 0;

    for (int shift = 0; shift < 32; shift += 8) {
        int outer = (int)(a >> shift & 255) + (int)(d >> shift & 255);
        int inner = (int)(b >> shift & 255) + (int)(c >> shift & 255);
        result |= (uint32_t)clamp_byte((9 * inner - outer + 8) >> 4) << shift;
    }
    return result;
}

static void double_line(const uint32_t *source, int count, size_t step, uint32_t *result, size_t result_step)
{
    for (int i = 0; i < count; i++) {
        const uint32_t *at = source + (size_t)i * step;
        result[2 * (size_t)i * result_step] = *at;
        if (i + 1 < count) {
            uint32_t before = i > 0 ? *(at - step) : *at, next = at[step];
            uint32_t after = i + 2 < count ? at[2 * step] : next;
            result[(2 * (size_t)i + 1) * result_step] = between(before, *at, next, after);
        }
    }
}

/* The table of one axis: exact at the cells' ends, which lie closer together than pixels do. */
static void init_axis(struct mvs_axis *axis, const double *tangents, int tiles, int divisor)
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

int mvs_target_init(struct mvs_target *target, const struct lumi_mvs_view *view, const struct lumi_mvs_view *neighbour,
                    int divisor)
{
    uint32_t *pixels = NULL;
    int width, height, code = LUMI_ERR_NOMEM;

    memset(target, 0, sizeof(*target));
    LUMI_GOTO(code, done, image_pixels(neighbour, divisor, &width, &height, &pixels));
    target->width = 2 * width - 1;
    target->height = 2 * height - 1;
    target->pixels = lumi_alloc((size_t)target->width * (size_t)target->height, sizeof(uint32_t));
    code = LUMI_ERR_NOMEM;
    if (!target->pixels)
        goto done;
    for (int y = 0; y < height; y++)
        double_line(pixels + (size_t)y * (size_t)width, width, 1,
                    target->pixels + 2 * (size_t)y * (size_t)target->width, 1);
    for (int x = 0; x < target->width; x++)
        double_line(target->pixels + x, height, 2 * (size_t)target->width, target->pixels + x, (size_t)target->width);
    const struct lumi_grid *grid = neighbour->grid;
    init_axis(&target->x, grid->tan_x, grid->cols, divisor);
    init_axis(&target->y, grid->tan_y, grid->rows, divisor);
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

void mvs_target_planes(struct mvs_target *target, int planes, float w_first, float w_step)
{
    for (int k = 0; k < planes; k++) {
        float w = w_first + (float)k * w_step;
        target->plane_x[k] = w * target->shift[0];
        target->plane_y[k] = w * target->shift[1];
        target->plane_z[k] = w * target->shift[2];
    }
}
