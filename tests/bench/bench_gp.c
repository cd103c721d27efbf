/* The picture of meshes at several precisions, after Overbeck et al. 2018, figure 7.
 *
 *   bench_gp OUT VIEW PHOTO DEPTH TRUTH (FIELD RENDERED)...
 *
 * First row: the photograph of view number VIEW, its dense depth map (OpenEXR, channel W, inverse depth), the truth of
 * a view between the cameras. Then a column a field: VIEW's mesh, its triangles shaded by inverse depth and outlined;
 * what the field renders at the truth's pose; 4 × its absolute difference from the truth. A line a field is printed:
 * triangles a tile of VIEW, bytes of its geometry, PSNR of the rendered view. */
#include "pipeline/evaluate/metrics.h"
#include "pipeline/evaluate/sheet.h"
#include "proto/base/memory.h"
#include "proto/image/image.h"
#include "proto/lightfield/field.h"
#include "proto/lightfield/mesh.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { GAP = 6, FIRST = 5, EACH = 2, ROWS = 4 };

static void must(int code, const struct lumi_error *error)
{
    if (code == LUMI_OK)
        return;
    fprintf(stderr, "bench_gp: %s\n", error->text);
    exit(1);
}

/* The range of inverse depth that colours span. */
struct range {
    float low, high;
};

/* Near red, far blue: a smooth ramp. */
static void colour_of(const struct range *range, float w, uint8_t rgb[3])
{
    float t = (w - range->low) / (range->high - range->low);

    t = t < 0 ? 0 : t > 1 ? 1 : t;
    for (int c = 0; c < 3; c++) {
        float centre = 0.85F - 0.35F * (float)c, value = 1.15F - 2.2F * fabsf(t - centre);
        rgb[c] = (uint8_t)(255 * (value < 0.08F ? 0.08F : value > 1 ? 1 : value));
    }
}

static void read_picture(const char *path, struct lumi_raster *picture)
{
    struct lumi_error error;
    struct lumi_raster raw;

    must(lumi_image_read(path, 3, &raw, NULL, &error), &error);
    if (lumi_raster_convert(&raw, LUMI_U8, picture) != LUMI_OK)
        exit(1);
    lumi_raster_finish(&raw);
}

static void depth_picture(const char *path, struct range *range, struct lumi_raster *picture)
{
    struct lumi_error error;
    struct lumi_raster depth;

    must(lumi_image_read_channel(path, "W", &depth, &error), &error);
    *range = (struct range){INFINITY, 0};
    for (int y = 0; y < depth.height; y++)
        for (int x = 0; x < depth.width; x++) {
            float w = lumi_row_f32(&depth, y)[x];
            range->low = fminf(range->low, w);
            range->high = fmaxf(range->high, w);
        }
    if (!(range->high > range->low))
        range->high = range->low + 1;
    if (lumi_raster_create(picture, depth.width, depth.height, 3, LUMI_U8) != LUMI_OK)
        exit(1);
    for (int y = 0; y < depth.height; y++)
        for (int x = 0; x < depth.width; x++)
            colour_of(range, lumi_row_f32(&depth, y)[x], lumi_row_u8(picture, y) + (ptrdiff_t)3 * x);
    lumi_raster_finish(&depth);
}

struct corner {
    double x, y, w;
};

static struct corner corner_of(const struct lumi_view_mesh *mesh, int tile, int vertex)
{
    const struct lumi_mesh_vertex *v = &mesh->tiles[tile].vertices[vertex];

    return (struct corner){tile % mesh->cols * LUMI_TILE + v->s * (LUMI_TILE / 255.0),
                           tile / mesh->cols * LUMI_TILE + v->t * (LUMI_TILE / 255.0),
                           lumi_mesh_inverse_depth(mesh, &mesh->tiles[tile], v->d)};
}

/* Shaded by depth, dark where an edge is within half a pixel (tile edges lie between pixels). */
static void draw_triangle(const struct corner c[3], const struct range *range, const struct lumi_raster *out)
{
    double area = (c[1].x - c[0].x) * (c[2].y - c[0].y) - (c[1].y - c[0].y) * (c[2].x - c[0].x);
    double share[3], height[3];

    for (int k = 0; k < 3; k++) {
        const struct corner *a = &c[(k + 1) % 3], *b = &c[(k + 2) % 3];
        height[k] = fabs(area) / fmax(hypot(a->x - b->x, a->y - b->y), 1e-9);
    }
    int x0 = (int)fmax(0, floor(fmin(fmin(c[0].x, c[1].x), c[2].x)));
    int y0 = (int)fmax(0, floor(fmin(fmin(c[0].y, c[1].y), c[2].y)));
    int x1 = (int)fmin(out->width - 1, fmax(fmax(c[0].x, c[1].x), c[2].x));
    int y1 = (int)fmin(out->height - 1, fmax(fmax(c[0].y, c[1].y), c[2].y));
    for (int y = y0; area != 0 && y <= y1; y++)
        for (int x = x0; x <= x1; x++) {
            double px = x + 0.5, py = y + 0.5, edge = INFINITY, w = 0;
            uint8_t *pixel = lumi_row_u8(out, y) + (ptrdiff_t)3 * x;
            for (int k = 0; k < 3; k++) {
                const struct corner *a = &c[(k + 1) % 3], *b = &c[(k + 2) % 3];
                share[k] = ((a->x - px) * (b->y - py) - (a->y - py) * (b->x - px)) / area;
                edge = fmin(edge, share[k] * height[k]);
                w += share[k] * c[k].w;
            }
            if (edge < -1e-9)
                continue;
            colour_of(range, (float)w, pixel);
            for (int k = 0; edge < 0.51 && k < 3; k++)
                pixel[k] = (uint8_t)(pixel[k] / 4);
        }
}

static void mesh_picture(const struct lumi_field *field, int view, const struct range *range,
                         struct lumi_raster *picture)
{
    const struct lumi_grid *grid = lumi_field_grid(field, lumi_field_view(field, LUMI_LEVEL_FINE, view)->grid);
    const struct lumi_view_mesh *mesh = lumi_field_mesh(field, LUMI_LEVEL_FINE, view);
    int triangles = 0, tiles = mesh->cols * mesh->rows;
    struct lumi_writer bytes;

    if (lumi_raster_create(picture, grid->width, grid->height, 3, LUMI_U8) != LUMI_OK)
        exit(1);
    for (int y = 0; y < picture->height; y++)
        memset(lumi_row_u8(picture, y), 255, (size_t)3 * (size_t)picture->width);
    for (int i = 0; i < tiles; i++)
        for (int t = 0; t < mesh->tiles[i].triangle_count; t++, triangles++) {
            const uint16_t *at = mesh->tiles[i].indices + (ptrdiff_t)3 * t;
            const struct corner c[3] = {corner_of(mesh, i, at[0]), corner_of(mesh, i, at[1]),
                                        corner_of(mesh, i, at[2])};
            draw_triangle(c, range, picture);
        }
    lumi_writer_init(&bytes);
    lumi_view_mesh_encode(mesh, &bytes);
    printf("%10.1f %10.1f", (double)triangles / tiles, (double)bytes.size / tiles);
    lumi_writer_finish(&bytes);
}

static void paste(const struct lumi_raster *page, const struct lumi_raster *picture, int column, int row, int width,
                  int height)
{
    for (int y = 0; y < picture->height && y < height; y++)
        memcpy(lumi_row_u8(page, GAP + row * (height + GAP) + y) + (ptrdiff_t)3 * (GAP + column * (width + GAP)),
               lumi_row_u8(picture, y), (size_t)3 * (size_t)(picture->width < width ? picture->width : width));
}

/* The column of one field. */
static void add_field(const struct lumi_raster *page, int column, char **names, int view, const struct range *range,
                      const struct lumi_raster *truth)
{
    struct lumi_raster mesh, rendered, difference;
    struct lumi_comparison comparison;
    struct lumi_field *field;
    struct lumi_error error;

    must(lumi_field_open(names[0], 1, &field, &error), &error);
    mesh_picture(field, view, range, &mesh);
    read_picture(names[1], &rendered);
    must(lumi_compare_pictures(truth, &rendered, 1, &comparison, &error), &error);
    must(lumi_difference_picture(truth, &rendered, &difference, &error), &error);
    printf(" %10.2f\n", comparison.psnr_rgb);
    paste(page, &mesh, column, 1, truth->width, truth->height);
    paste(page, &rendered, column, 2, truth->width, truth->height);
    paste(page, &difference, column, 3, truth->width, truth->height);
    lumi_raster_finish(&mesh);
    lumi_raster_finish(&rendered);
    lumi_raster_finish(&difference);
    lumi_field_close(field);
}

int main(int argc, char **argv)
{
    struct lumi_raster photo, depth, truth, page;
    struct lumi_error error;
    struct range range;
    int fields = (argc - 1 - FIRST) / EACH, columns = fields > 3 ? fields : 3;

    if (argc < 1 + FIRST + EACH) {
        fprintf(stderr, "usage: bench_gp OUT VIEW PHOTO DEPTH TRUTH (FIELD RENDERED)...\n");
        return 2;
    }
    read_picture(argv[3], &photo);
    depth_picture(argv[4], &range, &depth);
    read_picture(argv[5], &truth);
    if (lumi_raster_create(&page, columns * (truth.width + GAP) + GAP, ROWS * (truth.height + GAP) + GAP, 3, LUMI_U8))
        return 1;
    for (int y = 0; y < page.height; y++)
        memset(lumi_row_u8(&page, y), 255, (size_t)3 * (size_t)page.width);
    paste(&page, &photo, 0, 0, truth.width, truth.height);
    paste(&page, &depth, 1, 0, truth.width, truth.height);
    paste(&page, &truth, 2, 0, truth.width, truth.height);
    printf("%10s %10s %10s\n", "tri./tile", "B/tile", "PSNR dB");
    for (int i = 0; i < fields; i++)
        add_field(&page, i, argv + 1 + FIRST + (ptrdiff_t)EACH * i, atoi(argv[2]), &range, &truth);
    must(lumi_image_write(argv[1], &page, NULL, &error), &error);
    lumi_raster_finish(&photo);
    lumi_raster_finish(&depth);
    lumi_raster_finish(&truth);
    lumi_raster_finish(&page);
    return 0;
}
