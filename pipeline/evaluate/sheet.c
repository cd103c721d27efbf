/* Pictures for people. */
#include "pipeline/evaluate/sheet.h"

#include "proto/base/memory.h"
#include "proto/image/image.h"

#include <stdlib.h>
#include <string.h>

#define CELL_WIDTH 320 /* pixels at most; heights follow */
#define GAP 4
#define VIEWS_ABREAST 2
#define EACH 3 /* truth, rendering, difference */

int lumi_difference_picture(const struct lumi_raster *truth, const struct lumi_raster *rendered,
                            struct lumi_raster *difference, struct lumi_error *error)
{
    if (lumi_raster_create(difference, truth->width, truth->height, 3, LUMI_U8) != LUMI_OK)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a difference picture");
    for (int y = 0; y < truth->height; y++) {
        const uint8_t *a = lumi_row_u8(truth, y), *b = lumi_row_u8(rendered, y);
        uint8_t *d = lumi_row_u8(difference, y);
        for (int x = 0; x < 3 * truth->width; x++) {
            int value = 4 * abs(a[x] - b[x]);
            d[x] = (uint8_t)(value > 255 ? 255 : value);
        }
    }
    return LUMI_OK;
}

/* Mean over the source pixels that a smaller pixel stands for. */
static int shrink(const struct lumi_raster *source, struct lumi_raster *cell)
{
    int width = source->width < CELL_WIDTH ? source->width : CELL_WIDTH;
    int height = (int)((long)source->height * width / source->width);

    LUMI_TRY(lumi_raster_create(cell, width, height > 0 ? height : 1, 3, LUMI_U8));
    for (int y = 0; y < cell->height; y++)
        for (int x = 0; x < width; x++) {
            int x0 = (int)((long)x * source->width / width), x1 = (int)((long)(x + 1) * source->width / width);
            int y0 = (int)((long)y * source->height / cell->height),
                y1 = (int)((long)(y + 1) * source->height / cell->height);
            for (int c = 0; c < 3; c++) {
                int sum = 0, count = (x1 - x0) * (y1 - y0);
                for (int j = y0; j < y1; j++)
                    for (int i = x0; i < x1; i++)
                        sum += lumi_row_u8(source, j)[3 * i + c];
                lumi_row_u8(cell, y)[3 * x + c] = (uint8_t)((sum + count / 2) / count);
            }
        }
    return LUMI_OK;
}

int lumi_sheet_add(struct lumi_sheet *sheet, const struct lumi_raster *truth, const struct lumi_raster *rendered,
                   const struct lumi_raster *difference, struct lumi_error *error)
{
    const struct lumi_raster *pictures[EACH] = {truth, rendered, difference};

    if (sheet->count + EACH > sheet->capacity) {
        int capacity = sheet->capacity ? 2 * sheet->capacity : 8 * EACH;
        void *grown = lumi_realloc(sheet->cells, (size_t)capacity, sizeof *sheet->cells);
        if (!grown)
            return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a contact sheet");
        sheet->cells = grown;
        sheet->capacity = capacity;
    }
    for (int i = 0; i < EACH; i++) {
        if (shrink(pictures[i], &sheet->cells[sheet->count]) != LUMI_OK)
            return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a contact sheet");
        sheet->count++;
    }
    return LUMI_OK;
}

static void paste(const struct lumi_raster *page, const struct lumi_raster *cell, int x, int y)
{
    for (int row = 0; row < cell->height; row++)
        memcpy(lumi_row_u8(page, y + row) + 3 * (size_t)x, lumi_row_u8(cell, row), 3 * (size_t)cell->width);
}

int lumi_sheet_write(const struct lumi_sheet *sheet, const char *path, struct lumi_error *error)
{
    const int across = VIEWS_ABREAST * EACH;
    int rows = (sheet->count + across - 1) / across, cell_width = 1, cell_height = 1;
    struct lumi_raster page;

    if (sheet->count == 0)
        return lumi_fail(error, LUMI_ERR_ARG, "%s: no pictures for the contact sheet", path);
    for (int i = 0; i < sheet->count; i++) {
        if (sheet->cells[i].width > cell_width)
            cell_width = sheet->cells[i].width;
        if (sheet->cells[i].height > cell_height)
            cell_height = sheet->cells[i].height;
    }
    int abreast = sheet->count < across ? sheet->count : across;
    if (lumi_raster_create(&page, abreast * (cell_width + GAP) + GAP, rows * (cell_height + GAP) + GAP, 3, LUMI_U8) !=
        LUMI_OK)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: no memory for a contact sheet of %d pictures", path, sheet->count);
    for (int y = 0; y < page.height; y++)
        memset(lumi_row_u8(&page, y), 255, 3 * (size_t)page.width);
    for (int i = 0; i < sheet->count; i++)
        paste(&page, &sheet->cells[i], GAP + i % across * (cell_width + GAP), GAP + i / across * (cell_height + GAP));
    int code = lumi_image_write(path, &page, NULL, error);
    lumi_raster_finish(&page);
    return code;
}

void lumi_sheet_finish(struct lumi_sheet *sheet)
{
    for (int i = 0; i < sheet->count; i++)
        lumi_raster_finish(&sheet->cells[i]);
    lumi_free(sheet->cells);
    memset(sheet, 0, sizeof *sheet);
}
