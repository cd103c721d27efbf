/* What compression alone cost. */
#include "pipeline/evaluate/codec_cost.h"

#include "pipeline/evaluate/metrics.h"
#include "pipeline/run/json_put.h"
#include "proto/base/memory.h"
#include "proto/base/parallel.h"
#include "proto/image/image.h"
#include "proto/lightfield/field.h"
#include "proto/lightfield/yuv.h"

#include <glib.h>
#include <inttypes.h>
#include <stdio.h>
#include <string.h>

struct measure {
    const struct lumi_field *field;
    const char *folder; /* of the views before coding */
    int threads;
    struct lumi_tile_decoder **decoders; /* one a thread */
    struct lumi_error *errors;           /* one a thread */
    struct lumi_codec_cost *cost;
    int first;    /* of the batch that is being measured */
    double *sums; /* squared error a view */
    int *damaged; /* tiles a view */
};

static double plane_error(const struct lumi_yuv *image, int plane, const uint8_t *tile, int size, int column, int row)
{
    int width = lumi_yuv_width(image, plane), height = lumi_yuv_height(image, plane);
    double sum = 0;

    for (int y = 0; y < size && row * size + y < height; y++)
        for (int x = 0; x < size && column * size + x < width; x++) {
            int d = tile[y * size + x] -
                    image->plane[plane][(size_t)(row * size + y) * (size_t)width + (size_t)(column * size + x)];
            sum += d * d;
        }
    return sum;
}

static int view_error(const struct measure *m, int view, int thread, const struct lumi_yuv *image,
                      const struct lumi_grid *grid)
{
    struct lumi_tile_pixels pixels;

    for (int row = 0; row < grid->rows; row++)
        for (int column = 0; column < grid->cols; column++) {
            int code = lumi_field_decode_tile(m->decoders[thread], LUMI_LEVEL_FINE, view, column, row, &pixels,
                                              &m->errors[thread]);
            if (code == LUMI_ERR_NOMEM)
                return code;
            if (code != LUMI_OK) {
                memset(&pixels, 128, sizeof pixels);
                m->damaged[view]++;
            }
            m->sums[view] += plane_error(image, 0, pixels.y, LUMI_TILE, column, row) +
                             plane_error(image, 1, pixels.u, LUMI_TILE / 2, column, row) +
                             plane_error(image, 2, pixels.v, LUMI_TILE / 2, column, row);
        }
    return LUMI_OK;
}

static int measure_view(void *context, int index, int thread)
{
    struct measure *m = context;
    int view = m->first + index;
    const struct lumi_field_view *v = lumi_field_view(m->field, LUMI_LEVEL_FINE, view);
    const struct lumi_grid *grid = lumi_field_grid(m->field, v->grid);
    g_autofree char *file = g_strdup_printf("%s.exr", v->name);
    g_autofree char *path = g_build_filename(m->folder, file, NULL);
    struct lumi_raster raster = {0};
    struct lumi_yuv image = {0};
    int code;

    LUMI_GOTO(code, out, lumi_image_read(path, 3, &raster, NULL, &m->errors[thread]));
    if (raster.width != grid->width || raster.height != grid->height) {
        code = lumi_fail(&m->errors[thread], LUMI_ERR_FORMAT, "%s: %d×%d pixels, the field's view has %d×%d", path,
                         raster.width, raster.height, grid->width, grid->height);
        goto out;
    }
    code = lumi_yuv_from_raster(&raster, &image);
    if (code != LUMI_OK)
        lumi_fail(&m->errors[thread], code, "%s: no memory", path);
    else
        code = view_error(m, view, thread, &image, grid);
    snprintf(m->cost->views[view].name, sizeof m->cost->views[view].name, "%s", v->name);
    m->cost->views[view].psnr_yuv = lumi_psnr(m->sums[view], 1.5 * grid->width * grid->height);
out:
    lumi_raster_finish(&raster);
    lumi_yuv_finish(&image);
    return code;
}

static void summarize(struct measure *m)
{
    const struct lumi_field_info *info = lumi_field_info(m->field);
    struct lumi_codec_cost *cost = m->cost;
    double sum = 0;

    for (int i = 0; i < cost->count; i++) {
        cost->mean_yuv += cost->views[i].psnr_yuv / cost->count;
        sum += m->sums[i];
        cost->damaged += m->damaged[i];
        if (cost->views[i].psnr_yuv < cost->views[cost->worst].psnr_yuv)
            cost->worst = i;
    }
    cost->pixels = info->pixels[LUMI_LEVEL_FINE];
    cost->pooled_yuv = lumi_psnr(sum, 1.5 * (double)cost->pixels);
    cost->image_bytes = info->image_bytes[LUMI_LEVEL_FINE];
    cost->reference_bytes = info->reference_bytes[LUMI_LEVEL_FINE];
    cost->side_bytes = info->side_bytes[LUMI_LEVEL_FINE];
    cost->geometry_bytes = info->geometry_bytes[LUMI_LEVEL_FINE];
    cost->file_bytes = info->file_bytes;
}

static int measure_all(struct measure *m, void (*progress)(void *, const char *, int, int), void *context,
                       struct lumi_error *error)
{
    const int batch = 4 * m->threads;

    for (int i = 0; i < m->threads; i++)
        LUMI_TRY(lumi_tile_decoder_create(m->field, &m->decoders[i], error));
    for (m->first = 0; m->first < m->cost->count; m->first += batch) {
        int left = m->cost->count - m->first;
        if (progress)
            progress(context, "views", m->first, m->cost->count);
        int code = lumi_parallel_for(left < batch ? left : batch, m->threads, measure_view, m);
        for (int i = 0; code != LUMI_OK && error && i < m->threads; i++)
            if (m->errors[i].code == code)
                *error = m->errors[i];
        LUMI_TRY(code);
    }
    return LUMI_OK;
}

/* "<capture>/equiangular" if it is a work folder, else "<capture>.work/equiangular". */
static char *views_folder(const char *capture)
{
    g_autofree char *inside = g_build_filename(capture, "equiangular", NULL);
    g_autofree char *plain = g_strdup(capture);

    if (g_file_test(inside, G_FILE_TEST_IS_DIR))
        return g_steal_pointer(&inside);
    while (strlen(plain) > 1 && plain[strlen(plain) - 1] == '/')
        plain[strlen(plain) - 1] = '\0';
    g_autofree char *work = g_strconcat(plain, ".work", NULL);
    return g_build_filename(work, "equiangular", NULL);
}

int lumi_codec_cost(const char *path, const char *capture, int threads,
                    void (*progress)(void *context, const char *what, int done, int total), void *context,
                    struct lumi_codec_cost *cost, struct lumi_error *error)
{
    g_autofree char *folder = views_folder(capture);
    struct lumi_field *field = NULL;
    int code;

    memset(cost, 0, sizeof *cost);
    if (!g_file_test(folder, G_FILE_TEST_IS_DIR))
        return lumi_fail(error, LUMI_ERR_NOTFOUND, "%s: no such folder; the capture's views before coding are wanted",
                         folder);
    LUMI_TRY(lumi_field_open(path, threads, &field, error));
    struct measure m = {.field = field, .folder = folder, .cost = cost};
    m.threads = threads > 0 ? threads : lumi_thread_count();
    cost->count = lumi_field_info(field)->view_count[LUMI_LEVEL_FINE];
    cost->views = lumi_calloc((size_t)cost->count, sizeof *cost->views);
    m.decoders = lumi_calloc((size_t)m.threads, sizeof(struct lumi_tile_decoder *));
    m.errors = lumi_calloc((size_t)m.threads, sizeof *m.errors);
    m.sums = lumi_calloc((size_t)cost->count, sizeof *m.sums);
    m.damaged = lumi_calloc((size_t)cost->count, sizeof *m.damaged);
    if (!cost->views || !m.decoders || !m.errors || !m.sums || !m.damaged)
        code = lumi_fail(error, LUMI_ERR_NOMEM, "%s: no memory", path);
    else
        code = measure_all(&m, progress, context, error);
    if (code == LUMI_OK)
        summarize(&m);
    else
        lumi_codec_cost_finish(cost);
    for (int i = 0; m.decoders && i < m.threads; i++)
        lumi_tile_decoder_destroy(m.decoders[i]);
    lumi_free(m.decoders);
    lumi_free(m.errors);
    lumi_free(m.sums);
    lumi_free(m.damaged);
    lumi_field_close(field);
    return code;
}

void lumi_codec_cost_finish(struct lumi_codec_cost *cost)
{
    lumi_free(cost->views);
    memset(cost, 0, sizeof *cost);
}

char *lumi_codec_cost_text(const struct lumi_codec_cost *c)
{
    const double pixels = c->pixels > 0 ? (double)c->pixels : 1;

    return g_strdup_printf("%d views, YUV PSNR: mean %.2f dB, of the mean error %.2f dB, worst %s with %.2f dB\n"
                           "images %" PRIu64 " bytes (%.3f bits a pixel; of these references %" PRIu64
                           ", side information %" PRIu64 "), geometry %" PRIu64 ", file %" PRIu64 "\n%s",
                           c->count, c->mean_yuv, c->pooled_yuv, c->views[c->worst].name, c->views[c->worst].psnr_yuv,
                           c->image_bytes, 8 * (double)c->image_bytes / pixels, c->reference_bytes, c->side_bytes,
                           c->geometry_bytes, c->file_bytes, c->damaged ? "there are damaged tiles\n" : "");
}

static void add_number(JsonBuilder *builder, const char *name, double value)
{
    json_builder_set_member_name(builder, name);
    if (value == (double)(gint64)value)
        json_builder_add_int_value(builder, (gint64)value);
    else
        json_builder_add_double_value(builder, value);
}

char *lumi_codec_cost_json(const struct lumi_codec_cost *c)
{
    g_autoptr(JsonBuilder) builder = json_builder_new();

    json_builder_begin_object(builder);
    add_number(builder, "psnr_yuv_mean", c->mean_yuv);
    add_number(builder, "psnr_yuv_pooled", c->pooled_yuv);
    add_number(builder, "image_bytes", (double)c->image_bytes);
    add_number(builder, "reference_bytes", (double)c->reference_bytes);
    add_number(builder, "side_bytes", (double)c->side_bytes);
    add_number(builder, "geometry_bytes", (double)c->geometry_bytes);
    add_number(builder, "file_bytes", (double)c->file_bytes);
    add_number(builder, "pixels", (double)c->pixels);
    add_number(builder, "damaged_tiles", c->damaged);
    lumi_put_array(builder, "views");
    for (int i = 0; i < c->count; i++) {
        json_builder_begin_object(builder);
        lumi_put_string(builder, "name", c->views[i].name);
        add_number(builder, "psnr_yuv", c->views[i].psnr_yuv);
        json_builder_end_object(builder);
    }
    json_builder_end_array(builder);
    return lumi_put_end(builder, TRUE);
}
