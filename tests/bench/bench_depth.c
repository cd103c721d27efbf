/* Dense depth judged by the pictures it makes: every third row and column of a planar light field is input, views one
 * step diagonally off are made from the four inputs around them and compared with what was photographed there. No mesh,
 * no compression: what this reports is what the depth alone can give.
 * Usage: bench_depth SHOP_FOLDER [VIEWS] */
#include "pipeline/depth/mvs.h"
#include "proto/base/memory.h"
#include "proto/image/image.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* The folder's SOURCE.txt and transforms.json: 21 × 21 views, focal length 800 pixels, rows down, columns from +x. */
enum { SIDE = 21, STEP = 3, INPUTS = SIDE / STEP, WIDTH = 960, HEIGHT = 640, FOCAL = 800 };
#define SPACING 0.0307692

struct bench {
    const char *folder;
    struct lumi_grid grid;
    struct lumi_pose poses[INPUTS * INPUTS];
    struct lumi_mvs_view views[INPUTS * INPUTS]; /* depth: the first pass */
    struct lumi_raster depths[INPUTS * INPUTS];  /* the second */
    double match_s, refine_s;
    int matched, refined;
    struct lumi_error error;
};

static double processor_seconds(void)
{
    struct timespec time;

    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

static struct lumi_pose pose_of(int row, int column)
{
    return (struct lumi_pose){{1, 0, 0, 0, -1, 0, 0, 0, -1},
                              {SPACING * (SIDE / 2 - column), SPACING * (row - SIDE / 2), 0}};
}

static int read_image(struct bench *bench, int row, int column, struct lumi_raster *image)
{
    char path[1024];

    snprintf(path, sizeof(path), "%s/images/r%02dc%02d.jpg", bench->folder, row, column);
    return lumi_image_read(path, 3, image, NULL, &bench->error);
}

static int need_image(struct bench *bench, int input)
{
    struct lumi_mvs_view *view = &bench->views[input];

    if (view->image.data)
        return LUMI_OK;
    view->grid = &bench->grid;
    view->pose = bench->poses[input];
    return read_image(bench, input / INPUTS * STEP, input % INPUTS * STEP, &view->image);
}

static int need_match(struct bench *bench, int input)
{
    struct lumi_mvs_view neighbours[LUMI_MVS_NEIGHBOURS];
    struct lumi_mvs_settings settings;
    int indices[LUMI_MVS_NEIGHBOURS];

    if (bench->views[input].depth.data)
        return LUMI_OK;
    const int count = lumi_mvs_neighbours(INPUTS * INPUTS, bench->poses, input, 0, indices);
    LUMI_TRY(need_image(bench, input));
    for (int i = 0; i < count; i++) {
        LUMI_TRY(need_image(bench, indices[i]));
        neighbours[i] = bench->views[indices[i]];
    }
    lumi_mvs_defaults(&settings);
    double start = processor_seconds();
    LUMI_TRY(lumi_mvs_match(&bench->views[input], count, neighbours, &settings, 0, &bench->views[input].depth,
                            &bench->error));
    bench->match_s += processor_seconds() - start;
    bench->matched++;
    return LUMI_OK;
}

static int need_depth(struct bench *bench, int input)
{
    struct lumi_mvs_view neighbours[LUMI_MVS_NEIGHBOURS];
    int indices[LUMI_MVS_NEIGHBOURS];

    if (bench->depths[input].data)
        return LUMI_OK;
    const int count = lumi_mvs_neighbours(INPUTS * INPUTS, bench->poses, input, 0, indices);
    LUMI_TRY(need_match(bench, input));
    for (int i = 0; i < count; i++) {
        LUMI_TRY(need_match(bench, indices[i]));
        neighbours[i] = bench->views[indices[i]];
    }
    double start = processor_seconds();
    LUMI_TRY(lumi_mvs_refine(&bench->views[input], count, neighbours, 0, &bench->depths[input], &bench->error));
    bench->refine_s += processor_seconds() - start;
    bench->refined++;
    return LUMI_OK;
}

/* A corner of a triangle in the picture. */
struct corner {
    float x, y, w;
};

/* Nearest surface wins. Corners that are not clockwise face away: nothing. */
static void draw_triangle(const struct corner *a, const struct corner *b, const struct corner *c, float *nearest)
{
    const float area = (b->x - a->x) * (c->y - a->y) - (c->x - a->x) * (b->y - a->y);
    const int left = (int)fmaxf(0, floorf(fminf(a->x, fminf(b->x, c->x)) - 0.5f));
    const int top = (int)fmaxf(0, floorf(fminf(a->y, fminf(b->y, c->y)) - 0.5f));
    const int right = (int)fminf(WIDTH - 1, ceilf(fmaxf(a->x, fmaxf(b->x, c->x))));
    const int bottom = (int)fminf(HEIGHT - 1, ceilf(fmaxf(a->y, fmaxf(b->y, c->y))));

    if (!(area > 1e-6f))
        return;
    for (int y = top; y <= bottom; y++)
        for (int x = left; x <= right; x++) {
            const float px = (float)x + 0.5f, py = (float)y + 0.5f;
            float u = ((b->x - px) * (c->y - py) - (c->x - px) * (b->y - py)) / area;
            float v = ((c->x - px) * (a->y - py) - (a->x - px) * (c->y - py)) / area;
            if (u < -1e-4f || v < -1e-4f || u + v > 1.0001f)
                continue;
            float w = u * a->w + v * b->w + (1 - u - v) * c->w;
            if (w > nearest[y * WIDTH + x])
                nearest[y * WIDTH + x] = w;
        }
}

/* Inverse depth in the new view (all views share orientation and lens, so it is the input's own); negative: nothing. */
static int draw_depth(const struct lumi_raster *depth, float shift_x, float shift_y, float *nearest)
{
    struct corner *corners = lumi_alloc((size_t)WIDTH * HEIGHT, sizeof(*corners));

    if (!corners)
        return LUMI_ERR_NOMEM;
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            float w = lumi_row_f32(depth, y)[x];
            corners[y * WIDTH + x] = (struct corner){(float)x + 0.5f + shift_x * w, (float)y + 0.5f + shift_y * w, w};
            nearest[y * WIDTH + x] = -1;
        }
    for (int y = 0; y + 1 < HEIGHT; y++)
        for (int x = 0; x + 1 < WIDTH; x++) {
            const struct corner *at = corners + (size_t)y * WIDTH + x;
            draw_triangle(at, at + 1, at + WIDTH + 1, nearest);
            draw_triangle(at, at + WIDTH + 1, at + WIDTH, nearest);
        }
    lumi_free(corners);
    return LUMI_OK;
}

static void add_colours(const struct lumi_raster *image, const float *nearest, float shift_x, float shift_y,
                        float weight, float *sum)
{
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            const float w = nearest[y * WIDTH + x];
            const float from_x = (float)x - shift_x * w, from_y = (float)y - shift_y * w;
            float *pixel = sum + 4 * ((size_t)y * WIDTH + (size_t)x);
            if (w < 0 || !(from_x >= 0 && from_y >= 0 && from_x <= WIDTH - 1 && from_y <= HEIGHT - 1))
                continue;
            const int left = (int)fminf(from_x, WIDTH - 2), top = (int)fminf(from_y, HEIGHT - 2);
            const float u = from_x - (float)left, v = from_y - (float)top;
            const uint8_t *a = lumi_row_u8(image, top) + 3 * left, *b = lumi_row_u8(image, top + 1) + 3 * left;
            for (int c = 0; c < 3; c++)
                pixel[c] += weight * ((1 - v) * ((1 - u) * a[c] + u * a[3 + c]) + v * ((1 - u) * b[c] + u * b[3 + c]));
            pixel[3] += weight;
        }
}

static double compare(const struct lumi_raster *truth, const float *sum)
{
    double error = 0;
    long count = 0;

    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            const float *pixel = sum + 4 * ((size_t)y * WIDTH + (size_t)x);
            for (int c = 0; c < 3 && pixel[3] > 0; c++, count++) {
                double difference = floor(pixel[c] / pixel[3] + 0.5) - lumi_row_u8(truth, y)[3 * x + c];
                error += difference * difference;
            }
        }
    return 10 * log10(255.0 * 255.0 * (double)count / error);
}

/* The view at (row, column), from the inputs around it, weighted bilinearly. */
static int judge(struct bench *bench, int row, int column, double *psnr)
{
    float *sum = lumi_calloc(4 * (size_t)WIDTH * HEIGHT, sizeof(float));
    float *nearest = lumi_alloc((size_t)WIDTH * HEIGHT, sizeof(float));
    struct lumi_raster truth = {0};
    int code = LUMI_ERR_NOMEM;

    if (!sum || !nearest)
        goto done;
    LUMI_GOTO(code, done, read_image(bench, row, column, &truth));
    for (int k = 0; k < 4; k++) {
        const int r = row / STEP + k / 2, c = column / STEP + k % 2, input = r * INPUTS + c;
        const float weight =
            (1 - fabsf((float)(row - r * STEP)) / STEP) * (1 - fabsf((float)(column - c * STEP)) / STEP);
        const struct lumi_pose pose = pose_of(row, column);
        const struct lumi_vec3 shift = lumi_to_camera(&pose, bench->poses[input].t);
        const float shift_x = (float)(FOCAL * shift.x), shift_y = (float)(FOCAL * shift.y);
        LUMI_GOTO(code, done, need_depth(bench, input));
        LUMI_GOTO(code, done, draw_depth(&bench->depths[input], shift_x, shift_y, nearest));
        add_colours(&bench->views[input].image, nearest, shift_x, shift_y, weight, sum);
    }
    *psnr = compare(&truth, sum);
done:
    lumi_raster_finish(&truth);
    lumi_free(nearest);
    lumi_free(sum);
    return code;
}

static void finish(struct bench *bench)
{
    for (int i = 0; i < INPUTS * INPUTS; i++) {
        lumi_raster_finish(&bench->views[i].image);
        lumi_raster_finish(&bench->views[i].depth);
        lumi_raster_finish(&bench->depths[i]);
    }
    lumi_free(bench);
}

int main(int argc, char **argv)
{
    static const int places[][2] = {{10, 10}, {4, 4}, {16, 16}, {1, 1}, {1, 17}, {13, 5}};
    const int most = (int)(sizeof(places) / sizeof(places[0]));
    const int wanted = argc > 2 ? atoi(argv[2]) : most, count = wanted > 0 && wanted < most ? wanted : most;
    struct bench *bench = lumi_calloc(1, sizeof(*bench));
    double sum = 0;
    int code = LUMI_OK;

    if (argc < 2 || !bench) {
        fprintf(stderr, "usage: bench_depth SHOP_FOLDER [VIEWS]\n");
        return 2;
    }
    bench->folder = argv[1];
    lumi_grid_init_pinhole(&bench->grid, WIDTH, HEIGHT, FOCAL, FOCAL, WIDTH / 2.0, HEIGHT / 2.0);
    for (int i = 0; i < INPUTS * INPUTS; i++)
        bench->poses[i] = pose_of(i / INPUTS * STEP, i % INPUTS * STEP);
    for (int i = 0; i < count && code == LUMI_OK; i++) {
        double psnr = 0;
        code = judge(bench, places[i][0], places[i][1], &psnr);
        if (code == LUMI_OK)
            printf("r%02dc%02d %.2f dB\n", places[i][0], places[i][1], psnr);
        sum += psnr;
    }
    if (code == LUMI_OK)
        printf("mean %.2f dB; core-seconds a view of %d×%d: first pass %.2f, second %.2f\n", sum / count, WIDTH, HEIGHT,
               bench->match_s / bench->matched, bench->refine_s / bench->refined);
    else
        fprintf(stderr, "bench_depth: %s\n", bench->error.text);
    finish(bench);
    return lumi_exit_status(code);
}
