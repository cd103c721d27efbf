/* View sets from a field: views decoded when they are first asked for. */
#include "proto/base/memory.h"
#include "proto/lightfield/yuv.h"
#include "render/viewset/viewset_priv.h"

#include <string.h>

#define CACHE_BYTES ((size_t)256 << 20)

struct source {
    const struct lumi_field *field;
    struct lumi_field *own; /* the field, where it was opened for this set */
    int level;
    struct lumi_tile_decoder **idle; /* decoders nobody uses; room for all there are */
    int idle_count, made;
    pthread_mutex_t lock; /* guards the above */
};

static int take_decoder(struct source *source, struct lumi_tile_decoder **decoder, struct lumi_error *error)
{
    int code = LUMI_OK;

    *decoder = NULL;
    pthread_mutex_lock(&source->lock);
    if (source->idle_count > 0) {
        *decoder = source->idle[--source->idle_count];
    } else {
        void *grown = lumi_realloc(source->idle, (size_t)source->made + 1, sizeof(struct lumi_tile_decoder *));
        if (grown) {
            source->idle = grown;
            source->made++;
        } else {
            code = lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a tile decoder");
        }
    }
    pthread_mutex_unlock(&source->lock);
    if (code == LUMI_OK && !*decoder)
        code = lumi_tile_decoder_create(source->field, decoder, error);
    return code;
}

static void return_decoder(struct source *source, struct lumi_tile_decoder *decoder)
{
    if (!decoder)
        return;
    pthread_mutex_lock(&source->lock);
    source->idle[source->idle_count++] = decoder;
    pthread_mutex_unlock(&source->lock);
}

/* The same view at the coarse level, or −1. */
static int coarse_view(const struct source *source, int view)
{
    const char *name = lumi_field_view(source->field, source->level, view)->name;

    if (source->level == LUMI_LEVEL_COARSE)
        return -1;
    for (int i = 0; i < lumi_field_info(source->field)->view_count[LUMI_LEVEL_COARSE]; i++)
        if (!strcmp(lumi_field_view(source->field, LUMI_LEVEL_COARSE, i)->name, name))
            return i;
    return -1;
}

/* A coarse view and the tile of it that was decoded last. */
struct coarse {
    struct lumi_tile_decoder *decoder;
    const struct lumi_grid *grid;
    int view, column, row; /* what `pixels` holds */
    struct lumi_tile_pixels pixels;
};

static int coarse_tile(struct coarse *coarse, int column, int row)
{
    if (coarse->column == column && coarse->row == row)
        return LUMI_OK;
    coarse->column = -1;
    LUMI_TRY(
        lumi_field_decode_tile(coarse->decoder, LUMI_LEVEL_COARSE, coarse->view, column, row, &coarse->pixels, NULL));
    coarse->column = column;
    coarse->row = row;
    return LUMI_OK;
}

/* The coarse level's picture of a tile, nearest sample: it stands for something broken, sharpness is not to be had. */
static int patch_tile(struct coarse *coarse, const struct lumi_grid *grid, int column, int row,
                      struct lumi_tile_pixels *pixels)
{
    for (int y = 0; y < LUMI_TILE; y++)
        for (int x = 0; x < LUMI_TILE; x++) {
            double tx, ty, cx, cy;
            lumi_grid_unproject(grid, column * LUMI_TILE + x + 0.5, row * LUMI_TILE + y + 0.5, &tx, &ty);
            if (!lumi_grid_project(coarse->grid, lumi_vec3(tx, ty, 1), &cx, &cy))
                return LUMI_ERR_FORMAT;
            int px = (int)fmin(fmax(cx, 0), coarse->grid->width - 1);
            int py = (int)fmin(fmax(cy, 0), coarse->grid->height - 1);
            LUMI_TRY(coarse_tile(coarse, px / LUMI_TILE, py / LUMI_TILE));
            px %= LUMI_TILE, py %= LUMI_TILE;
            int half = LUMI_TILE / 2;
            pixels->y[y * LUMI_TILE + x] = coarse->pixels.y[py * LUMI_TILE + px];
            pixels->u[y / 2 * half + x / 2] = coarse->pixels.u[py / 2 * half + px / 2];
            pixels->v[y / 2 * half + x / 2] = coarse->pixels.v[py / 2 * half + px / 2];
        }
    return LUMI_OK;
}

static int damaged_tile(const struct source *source, struct lumi_tile_decoder *decoder, int view, int column, int row,
                        const struct lumi_yuv *image, struct lumi_slot *slot, struct lumi_tile_pixels *pixels)
{
    const struct lumi_grid *grid =
        lumi_field_grid(source->field, lumi_field_view(source->field, source->level, view)->grid);
    struct coarse coarse = {.decoder = decoder, .view = coarse_view(source, view), .column = -1};

    slot->damaged++;
    if (coarse.view >= 0) {
        coarse.grid =
            lumi_field_grid(source->field, lumi_field_view(source->field, LUMI_LEVEL_COARSE, coarse.view)->grid);
        if (patch_tile(&coarse, grid, column, row, pixels) == LUMI_OK) {
            lumi_tile_place(pixels, column, row, image);
            return LUMI_OK;
        }
    }
    memset(pixels, 128, sizeof *pixels);
    lumi_tile_place(pixels, column, row, image);
    if (!slot->missing)
        slot->missing = lumi_calloc((size_t)grid->cols * (size_t)grid->rows, 1);
    if (!slot->missing)
        return LUMI_ERR_NOMEM;
    slot->missing[row * grid->cols + column] = 1;
    return LUMI_OK;
}

static int decode_tiles(const struct source *source, struct lumi_tile_decoder *decoder, int view,
                        const struct lumi_yuv *image, struct lumi_slot *slot, struct lumi_error *error)
{
    const struct lumi_grid *grid =
        lumi_field_grid(source->field, lumi_field_view(source->field, source->level, view)->grid);
    struct lumi_tile_pixels pixels;

    for (int row = 0; row < grid->rows; row++)
        for (int column = 0; column < grid->cols; column++) {
            int code = lumi_field_decode_tile(decoder, source->level, view, column, row, &pixels, error);
            if (code == LUMI_ERR_NOMEM)
                return code;
            if (code == LUMI_OK)
                lumi_tile_place(&pixels, column, row, image);
            else if (damaged_tile(source, decoder, view, column, row, image, slot, &pixels) != LUMI_OK)
                return lumi_fail(error, LUMI_ERR_NOMEM, "no memory to decode a view");
        }
    return LUMI_OK;
}

static int decode_view(void *state, int view, struct lumi_slot *slot, struct lumi_error *error)
{
    struct source *source = state;
    const struct lumi_grid *grid =
        lumi_field_grid(source->field, lumi_field_view(source->field, source->level, view)->grid);
    struct lumi_tile_decoder *decoder = NULL;
    struct lumi_yuv image = {0};
    int code;

    if (lumi_yuv_create(&image, grid->width, grid->height) != LUMI_OK ||
        lumi_raster_create(&slot->pixels, grid->width, grid->height, 3, LUMI_U8) != LUMI_OK) {
        code = lumi_fail(error, LUMI_ERR_NOMEM, "no memory to decode a view of %d×%d", grid->width, grid->height);
        goto out;
    }
    LUMI_GOTO(code, out, take_decoder(source, &decoder, error));
    LUMI_GOTO(code, out, decode_tiles(source, decoder, view, &image, slot, error));
    code = lumi_yuv_to_raster(&image, &slot->pixels);
out:
    return_decoder(source, decoder);
    lumi_yuv_finish(&image);
    if (code != LUMI_OK) {
        lumi_raster_finish(&slot->pixels);
        lumi_free(slot->missing);
        slot->missing = NULL;
    }
    return code;
}

static void destroy_source(void *state)
{
    struct source *source = state;

    for (int i = 0; i < source->idle_count; i++)
        lumi_tile_decoder_destroy(source->idle[i]);
    lumi_free(source->idle);
    lumi_field_close(source->own);
    pthread_mutex_destroy(&source->lock);
    lumi_free(source);
}

int lumi_viewset_from_field(const struct lumi_field *field, int level, size_t cache_bytes, struct lumi_viewset **result,
                            struct lumi_error *error)
{
    static const struct lumi_viewset_source from_field = {decode_view, destroy_source};
    const struct lumi_field_info *info = lumi_field_info(field);
    struct lumi_viewset *set;

    if (level < 0 || level >= LUMI_LEVELS || info->view_count[level] < 1)
        return lumi_fail(error, LUMI_ERR_ARG, "the field has no views at level %d", level);
    struct source *source = lumi_calloc(1, sizeof *source);
    if (!source)
        return lumi_fail(error, LUMI_ERR_NOMEM, "no memory for a set of views");
    int code = lumi_viewset_alloc(info->view_count[level], &set, error);
    if (code != LUMI_OK) {
        lumi_free(source);
        return code;
    }
    source->field = field;
    source->level = level;
    pthread_mutex_init(&source->lock, NULL);
    for (int i = 0; i < set->count; i++) {
        const struct lumi_field_view *view = lumi_field_view(field, level, i);
        set->views[i] = (struct lumi_view){.grid = lumi_field_grid(field, view->grid),
                                           .pose = view->pose,
                                           .disk = view->disk,
                                           .mesh = lumi_field_mesh(field, level, i)};
    }
    set->centre = info->centre;
    set->shape = info->disk_shape;
    set->kernel = info->kernel;
    set->source = &from_field;
    set->state = source;
    set->cache_bytes = cache_bytes;
    *result = set;
    return LUMI_OK;
}

int lumi_viewset_open(const char *path, struct lumi_viewset **set, struct lumi_error *error)
{
    struct lumi_field *field;

    LUMI_TRY(lumi_field_open(path, 0, &field, error));
    int code = lumi_viewset_from_field(field, LUMI_LEVEL_FINE, CACHE_BYTES, set, error);
    if (code == LUMI_OK)
        ((struct source *)(*set)->state)->own = field;
    else
        lumi_field_close(field);
    return code;
}
