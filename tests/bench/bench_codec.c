/* Bytes of the tile codec against WebP and a VP9 video of the same images, at equal PSNR (Overbeck et al. 2018, section
 * 8.2: over the three planes of YUV 4:2:0), and tiles decoded a second.
 *
 *   bench_codec [--crop WxH] [--scale WxH] [--quantizers A,B,...] [--speed CPU-USED] [--neighbours N] COLUMNS RANGE
 *       FILE...
 *
 * The files are images of one size from cameras on a grid of COLUMNS columns, row by row: also the video's order, back
 * and forth. RANGE: of the shift search, pixels. All bytes of the level are counted: reference images, priming, side
 * information, tiles. WebP gets the planes as they are (method 6); so does the video (two seconds a key frame at most
 * are not asked for: one stream). Their bytes at our PSNR are interpolated between neighbouring qualities.
 * --crop: so much out of the middle of every image; --scale: then averaged to this size, which may squeeze it.
 * --quantizers: the tiles' (0..63), a row each. --neighbours: that reference images are filtered with (12; 0: none).
 * The time of encoding is that of the thread, with shifts, training, filter and reference images. */
#include "pipeline/compress/cluster.h"
#include "pipeline/compress/reference_filter.h"
#include "proto/base/memory.h"
#include "proto/image/image.h"
#include "proto/lightfield/cluster_code.h"
#include "proto/lightfield/field_write.h"
#include "proto/lightfield/training.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <vpx/vp8cx.h>
#include <vpx/vpx_encoder.h>
#include <webp/decode.h>
#include <webp/encode.h>

struct point {
    double psnr, bytes;
};

struct bench {
    int count, columns, range, quantizer, speed;
    int neighbours; /* that reference images are filtered with */
    struct lumi_yuv *images;
    struct lumi_yuv *sources, *references; /* filtered, then decoded reference images */
    struct lumi_clusters clusters;
    struct lumi_grid grids[LUMI_LEVELS];
    struct lumi_field_view *views;
    struct lumi_training_tile *training;
    int training_count;
    struct lumi_writer *coded; /* a cluster each */
    int *numbers;              /* 0, 1, 2 ... to the number of clusters: the coarse level's, of one image each */
};

static void must(int code, const struct lumi_error *error)
{
    if (code == LUMI_OK)
        return;
    fprintf(stderr, "bench_codec: %s\n", error->text);
    exit(1);
}

static double seconds(void)
{
    struct timespec now;

    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static double image_samples(const struct lumi_yuv *image)
{
    return (double)image->width * image->height + 2.0 * lumi_yuv_width(image, 1) * lumi_yuv_height(image, 1);
}

static double samples(const struct bench *bench)
{
    return bench->count * image_samples(&bench->images[0]);
}

static double psnr(const struct bench *bench, double squared_error)
{
    return 10 * log10(255.0 * 255.0 * samples(bench) / squared_error);
}

static double plane_error(const uint8_t *a, int stride_a, const uint8_t *b, int stride_b, int width, int height)
{
    double sum = 0;

    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            int difference = a[(ptrdiff_t)y * stride_a + x] - b[(ptrdiff_t)y * stride_b + x];
            sum += difference * difference;
        }
    return sum;
}

static double image_error(const struct lumi_yuv *image, const uint8_t *const planes[3], const int strides[3])
{
    double sum = 0;

    for (int p = 0; p < 3; p++)
        sum += plane_error(image->plane[p], lumi_yuv_width(image, p), planes[p], strides[p], lumi_yuv_width(image, p),
                           lumi_yuv_height(image, p));
    return sum;
}

/* WebP, one picture an image. */
static struct point webp(const struct bench *bench, float quality)
{
    double bytes = 0, error = 0;

    for (int i = 0; i < bench->count; i++) {
        const struct lumi_yuv *image = &bench->images[i];
        WebPMemoryWriter memory;
        WebPConfig config;
        WebPPicture picture;
        int width, height, stride, chroma_stride;
        uint8_t *u, *v;
        if (!WebPConfigInit(&config) || !WebPPictureInit(&picture))
            exit(1);
        config.quality = quality;
        config.method = 6;
        picture.width = image->width;
        picture.height = image->height;
        picture.y = image->plane[0];
        picture.u = image->plane[1];
        picture.v = image->plane[2];
        picture.y_stride = image->width;
        picture.uv_stride = lumi_yuv_width(image, 1);
        WebPMemoryWriterInit(&memory);
        picture.writer = WebPMemoryWrite;
        picture.custom_ptr = &memory;
        if (!WebPEncode(&config, &picture))
            exit(1);
        uint8_t *y = WebPDecodeYUV(memory.mem, memory.size, &width, &height, &u, &v, &stride, &chroma_stride);
        const uint8_t *const planes[3] = {y, u, v};
        const int strides[3] = {stride, chroma_stride, chroma_stride};
        error += image_error(image, planes, strides);
        bytes += (double)memory.size;
        WebPFree(y);
        WebPMemoryWriterClear(&memory);
    }
    return (struct point){psnr(bench, error), bytes / bench->count};
}

/* The i-th image of the video: rows back and forth. */
static const struct lumi_yuv *video_image(const struct bench *bench, int i)
{
    int row = i / bench->columns, column = i % bench->columns;
    int at = row * bench->columns + (row % 2 ? bench->columns - 1 - column : column);

    return &bench->images[at < bench->count ? at : i];
}

static void take_packets(vpx_codec_ctx_t *encoder, double *bytes)
{
    const vpx_codec_cx_pkt_t *packet;
    vpx_codec_iter_t iterator = NULL;

    while ((packet = vpx_codec_get_cx_data(encoder, &iterator)))
        if (packet->kind == VPX_CODEC_CX_FRAME_PKT)
            *bytes += (double)packet->data.frame.sz;
        else if (packet->kind == VPX_CODEC_PSNR_PKT)
            bytes[1] += (double)packet->data.psnr.sse[0];
}

/* A VP9 video of them all, constant quality, with alternate reference frames. */
static struct point video(const struct bench *bench, unsigned quantizer)
{
    vpx_codec_enc_cfg_t config;
    vpx_codec_ctx_t encoder;
    vpx_image_t wrapped;
    double sums[2] = {0, 0}, before; /* bytes, squared error */

    vpx_codec_enc_config_default(vpx_codec_vp9_cx(), &config, 0);
    config.g_w = (unsigned)bench->images[0].width;
    config.g_h = (unsigned)bench->images[0].height;
    config.g_threads = 1;
    config.g_lag_in_frames = 25;
    config.rc_end_usage = VPX_Q;
    config.kf_max_dist = 1000000;
    if (vpx_codec_enc_init(&encoder, vpx_codec_vp9_cx(), &config, VPX_CODEC_USE_PSNR) != VPX_CODEC_OK)
        exit(1);
    vpx_codec_control(&encoder, VP8E_SET_CPUUSED, 2);
    vpx_codec_control(&encoder, VP8E_SET_CQ_LEVEL, quantizer);
    for (int i = 0; i < bench->count; i++) {
        const struct lumi_yuv *image = video_image(bench, i);
        vpx_img_wrap(&wrapped, VPX_IMG_FMT_I420, (unsigned)image->width, (unsigned)image->height, 1, image->plane[0]);
        for (int p = 0; p < 3; p++) {
            wrapped.planes[p] = image->plane[p];
            wrapped.stride[p] = lumi_yuv_width(image, p);
        }
        if (vpx_codec_encode(&encoder, &wrapped, i, 1, 0, VPX_DL_GOOD_QUALITY) != VPX_CODEC_OK)
            exit(1);
        take_packets(&encoder, sums);
    }
    /* An encode call hands out no more than its buffer holds. */
    do {
        before = sums[0];
        if (vpx_codec_encode(&encoder, NULL, -1, 1, 0, VPX_DL_GOOD_QUALITY) != VPX_CODEC_OK)
            exit(1);
        take_packets(&encoder, sums);
    } while (sums[0] > before);
    vpx_codec_destroy(&encoder);
    return (struct point){psnr(bench, sums[1]), sums[0] / bench->count};
}

/* Bytes at a PSNR, their logarithm linear between points that rise in both; beyond the points the last slope. */
static double bytes_at(const struct point *points, int count, double value)
{
    int i = 1;

    while (i < count - 1 && points[i].psnr < value)
        i++;
    double slope = (log(points[i].bytes) - log(points[i - 1].bytes)) / (points[i].psnr - points[i - 1].psnr);
    return exp(log(points[i - 1].bytes) + (value - points[i - 1].psnr) * slope);
}

static int no_mesh(void *context, int level, int view, struct lumi_writer *bytes, struct lumi_error *error)
{
    (void)context, (void)level, (void)view, (void)bytes, (void)error;
    return LUMI_OK;
}

/* Reference images; the coarse level is these alone. */
static int references(void *context, int level, int run, uint32_t *sizes, struct lumi_writer *bytes,
                      struct lumi_error *error)
{
    (void)level;
    const struct bench *bench = context;
    struct lumi_yuv sources[LUMI_REFERENCE_RUN];
    int count = 0, first = run * LUMI_REFERENCE_RUN;

    for (; count < LUMI_REFERENCE_RUN && first + count < bench->clusters.count; count++)
        sources[count] = bench->sources[first + count];
    return lumi_references_encode(sources, count, bench->quantizer / 3, bench->speed, sizes, bytes, error);
}

static int cluster(void *context, int level, int index, struct lumi_writer *bytes, struct lumi_error *error)
{
    const struct bench *bench = context;

    (void)level, (void)error;
    lumi_write_bytes(bytes, bench->coded[index].data, bench->coded[index].size);
    return LUMI_OK;
}

/* Those of a cluster nearest its reference image. */
static int choose_others(const struct bench *bench, int cluster, struct lumi_filter_view *others)
{
    const int *members = bench->clusters.members + bench->clusters.first[cluster], columns = bench->columns;
    const int size = bench->clusters.first[cluster + 1] - bench->clusters.first[cluster];
    int count = 0;

    for (int distance = 1; distance < 2 * columns * columns; distance++)
        for (int i = 1; i < size && count < bench->neighbours; i++) {
            int x = members[i] % columns - members[0] % columns, y = members[i] / columns - members[0] / columns;
            if (x * x + y * y == distance)
                others[count++] = (struct lumi_filter_view){&bench->images[members[i]], NULL};
        }
    return count;
}

static void filter_references(struct bench *bench)
{
    const int own_weight = lumi_filter_own_weight(bench->quantizer);
    struct lumi_filter_view others[LUMI_FILTER_OTHERS_MAX];
    struct lumi_error error;

    for (int i = 0; i < bench->clusters.count; i++) {
        const struct lumi_yuv *reference = &bench->images[bench->clusters.members[bench->clusters.first[i]]];
        int count = own_weight > 0 ? choose_others(bench, i, others) : 0;
        must(lumi_reference_filter(reference, others, count, bench->range, own_weight > 0 ? own_weight : 1,
                                   &bench->sources[i], &error),
             &error);
    }
}

static void decode_references(struct bench *bench)
{
    struct lumi_error error;

    for (int first = 0; first < bench->clusters.count; first += LUMI_REFERENCE_RUN) {
        uint32_t sizes[LUMI_REFERENCE_RUN];
        struct lumi_writer bytes;
        int count = bench->clusters.count - first;
        count = count > LUMI_REFERENCE_RUN ? LUMI_REFERENCE_RUN : count;
        lumi_writer_init(&bytes);
        must(references(bench, LUMI_LEVEL_FINE, first / LUMI_REFERENCE_RUN, sizes, &bytes, &error), &error);
        must(lumi_references_decode(bytes.data, sizes, count, bench->images[0].width, bench->images[0].height,
                                    bench->references + first),
             &error);
        lumi_writer_finish(&bytes);
    }
}

static void train(struct bench *bench)
{
    const struct lumi_clusters *clusters = &bench->clusters;
    struct lumi_error error;
    int coded = bench->count - clusters->count;
    int wanted = lumi_training_count((long)coded * bench->grids[1].cols * bench->grids[1].rows);

    bench->training = lumi_calloc((size_t)wanted + 1, sizeof *bench->training);
    bench->training_count = 0;
    for (int i = 0; i < clusters->count; i++) {
        int count = wanted * (i + 1) / clusters->count - bench->training_count;
        if (clusters->first[i + 1] - clusters->first[i] < 2)
            continue;
        must(lumi_training_pick(&bench->images[clusters->members[clusters->first[i] + 1]], i, &bench->references[i],
                                NULL, bench->range, count, (uint64_t)i + 1, bench->training + bench->training_count,
                                &error),
             &error);
        bench->training_count += count;
    }
}

static double encode_clusters(struct bench *bench, struct lumi_tile_encoder *encoder)
{
    const struct lumi_clusters *clusters = &bench->clusters;
    struct lumi_error error;
    double sum = 0;

    for (int i = 0; i < clusters->count; i++) {
        const struct lumi_yuv *reference = &bench->references[i];
        const uint8_t *const planes[3] = {reference->plane[0], reference->plane[1], reference->plane[2]};
        const int strides[3] = {reference->width, lumi_yuv_width(reference, 1), lumi_yuv_width(reference, 1)};
        lumi_writer_init(&bench->coded[i]);
        sum += image_error(&bench->images[clusters->members[clusters->first[i]]], planes, strides);
        for (int k = clusters->first[i] + 1; k < clusters->first[i + 1]; k++)
            must(lumi_cluster_encode_image(encoder, reference, &bench->images[clusters->members[k]], NULL, bench->range,
                                           &bench->coded[i], &sum, &error),
                 &error);
    }
    return sum;
}

static void decode_at_random(const struct lumi_writer *file, const struct bench *bench, double *rate, double *side,
                             double *bytes)
{
    struct lumi_tile_decoder *decoder;
    struct lumi_tile_pixels pixels;
    struct lumi_field *field;
    struct lumi_error error;
    const struct lumi_grid *grid = &bench->grids[1];
    unsigned seed = 1;
    int decoded = 0;
    double spent = 0;

    must(lumi_field_open_memory(file->data, file->size, "bench", 1, &field, &error), &error);
    must(lumi_tile_decoder_create(field, &decoder, &error), &error);
    for (int i = 0; i < 20000; i++) {
        seed = seed * 1664525 + 1013904223;
        int view = (int)((seed >> 8) % (unsigned)bench->count);
        seed = seed * 1664525 + 1013904223;
        int tile = (int)((seed >> 8) % (unsigned)(grid->cols * grid->rows));
        if (lumi_field_view(field, LUMI_LEVEL_FINE, view)->reference == view)
            continue;
        double before = seconds();
        must(lumi_field_decode_tile(decoder, LUMI_LEVEL_FINE, view, tile % grid->cols, tile / grid->cols, &pixels,
                                    &error),
             &error);
        spent += decoded++ > 0 ? seconds() - before : 0; /* the first one primes */
    }
    const struct lumi_field_info *info = lumi_field_info(field);
    *rate = decoded / spent;
    *side = (double)info->side_bytes[1] / (double)info->coded_tiles[1];
    *bytes = (double)info->image_bytes[1] / bench->count;
    lumi_tile_decoder_destroy(decoder);
    lumi_field_close(field);
}

static void measure(struct bench *bench, int quantizer, const struct point *webps, const struct point *videos,
                    int points)
{
    const struct lumi_tile_encoder_settings settings = {.quantizer = quantizer, .speed = bench->speed};
    struct lumi_tile_encoder *encoder;
    struct lumi_writer file;
    struct lumi_error error;
    double rate, side, bytes, before;

    bench->quantizer = quantizer;
    before = seconds();
    filter_references(bench);
    decode_references(bench);
    train(bench);
    must(lumi_tile_encoder_create(&settings, bench->training, bench->training_count, bench->references, &encoder,
                                  &error),
         &error);
    double ours = psnr(bench, encode_clusters(bench, encoder));
    double spent = seconds() - before;

    struct lumi_field_content content = {.radius = 1,
                                         .grid_count = LUMI_LEVELS,
                                         .grids = bench->grids,
                                         .context = bench,
                                         .mesh = no_mesh,
                                         .references = references,
                                         .cluster = cluster};
    content.levels[0] = (struct lumi_field_level_content){.view_count = bench->clusters.count,
                                                          .views = bench->views,
                                                          .cluster_count = bench->clusters.count,
                                                          .first = bench->numbers,
                                                          .members = bench->numbers,
                                                          .priming = lumi_tile_encoder_priming(encoder)};
    content.levels[1] = content.levels[0];
    content.levels[1].view_count = bench->count;
    content.levels[1].first = bench->clusters.first;
    content.levels[1].members = bench->clusters.members;
    lumi_writer_init(&file);
    must(lumi_field_write_memory(&content, &file, &error), &error);
    decode_at_random(&file, bench, &rate, &side, &bytes);
    double webp_bytes = bytes_at(webps, points, ours), video_bytes = bytes_at(videos, points, ours);
    printf("%7.2f %9.0f %10.0f %7.2f %10.0f %8.2f %7.2f %10.0f %8.2f\n", ours, bytes, webp_bytes, webp_bytes / bytes,
           video_bytes, bytes / video_bytes, side, rate, spent / samples(bench) * 1.5e6);
    fflush(stdout);
    for (int i = 0; i < bench->clusters.count; i++) {
        lumi_writer_finish(&bench->coded[i]);
        lumi_yuv_finish(&bench->references[i]);
        lumi_yuv_finish(&bench->sources[i]);
    }
    lumi_writer_finish(&file);
    lumi_tile_encoder_destroy(encoder);
    lumi_free(bench->training);
}

/* How the files' pixels become images: cut out of the middle, or averaged. */
struct shape {
    int crop_width, crop_height, width, height; /* 0: as it is */
};

/* The mean over the rectangle of the source that a pixel covers. */
static void average(const struct lumi_raster *from, struct lumi_raster *to)
{
    const double step_x = (double)from->width / to->width, step_y = (double)from->height / to->height;

    for (int y = 0; y < to->height; y++)
        for (int x = 0; x < to->width; x++) {
            double sum[3] = {0, 0, 0}, weight = 0;
            for (int v = (int)(y * step_y); v < from->height && v < (y + 1) * step_y; v++)
                for (int u = (int)(x * step_x); u < from->width && u < (x + 1) * step_x; u++) {
                    double w = (fmin(u + 1, (x + 1) * step_x) - fmax(u, x * step_x)) *
                               (fmin(v + 1, (y + 1) * step_y) - fmax(v, y * step_y));
                    const uint8_t *pixel = lumi_row_u8(from, v) + 3 * u;
                    for (int c = 0; c < 3; c++)
                        sum[c] += w * pixel[c];
                    weight += w;
                }
            for (int c = 0; c < 3; c++)
                lumi_row_u8(to, y)[3 * x + c] = (uint8_t)(sum[c] / weight + 0.5);
        }
}

static void read_image(const char *file, const struct shape *shape, struct lumi_raster *image)
{
    struct lumi_error error;
    struct lumi_raster raw, whole, part;

    must(lumi_image_read(file, 3, &raw, NULL, &error), &error);
    if (lumi_raster_convert(&raw, LUMI_U8, &whole) != LUMI_OK)
        exit(1);
    lumi_raster_finish(&raw);
    int width = shape->crop_width ? shape->crop_width : whole.width;
    int height = shape->crop_height ? shape->crop_height : whole.height;
    int left = (whole.width - width) / 2, top = (whole.height - height) / 2;
    if (left < 0 || top < 0 || lumi_raster_create(&part, width, height, 3, LUMI_U8) != LUMI_OK ||
        lumi_raster_create(image, shape->width ? shape->width : width, shape->height ? shape->height : height, 3,
                           LUMI_U8) != LUMI_OK)
        exit(1);
    for (int y = 0; y < height; y++)
        memcpy(lumi_row_u8(&part, y), lumi_row_u8(&whole, top + y) + (size_t)3 * (size_t)left,
               (size_t)3 * (size_t)width);
    average(&part, image);
    lumi_raster_finish(&part);
    lumi_raster_finish(&whole);
}

static void load(struct bench *bench, char **files, const struct shape *shape)
{
    struct lumi_pose *poses = lumi_calloc((size_t)bench->count, sizeof *poses);
    struct lumi_error error;

    bench->images = lumi_calloc((size_t)bench->count, sizeof *bench->images);
    bench->views = lumi_calloc((size_t)bench->count, sizeof *bench->views);
    if (!poses || !bench->images || !bench->views)
        exit(1);
    for (int i = 0; i < bench->count; i++) {
        struct lumi_raster raster;
        read_image(files[i], shape, &raster);
        must(lumi_yuv_from_raster(&raster, &bench->images[i]), &error);
        lumi_raster_finish(&raster);
        poses[i] = (struct lumi_pose){{1, 0, 0, 0, 1, 0, 0, 0, 1}, {i % bench->columns, i / bench->columns, 0}};
        bench->views[i].pose = poses[i];
        bench->views[i].grid = 1;
        bench->views[i].disk = (struct lumi_disk){1, 1, 1, 1};
        snprintf(bench->views[i].name, sizeof bench->views[i].name, "%d", i);
    }
    must(lumi_clusters_make(bench->count, poses, 25, &bench->clusters, &error), &error);
    for (int i = 0; i < LUMI_LEVELS; i++)
        lumi_grid_init_pinhole(&bench->grids[i], bench->images[0].width, bench->images[0].height, 1000, 1000, 0, 0);
    bench->references = lumi_calloc((size_t)bench->clusters.count, sizeof *bench->references);
    bench->sources = lumi_calloc((size_t)bench->clusters.count, sizeof *bench->sources);
    bench->coded = lumi_calloc((size_t)bench->clusters.count, sizeof *bench->coded);
    bench->numbers = lumi_calloc((size_t)bench->clusters.count + 1, sizeof *bench->numbers);
    lumi_free(poses);
    if (!bench->references || !bench->sources || !bench->coded || !bench->numbers)
        exit(1);
    for (int i = 0; i <= bench->clusters.count; i++)
        bench->numbers[i] = i;
}

struct options {
    struct shape shape;
    int quantizers[8], count, speed, neighbours;
};

static bool read_size(const char *text, int *width, int *height)
{
    return sscanf(text, "%dx%d", width, height) == 2 && *width > 0 && *height > 0;
}

/* Takes the options off the command line. */
static bool read_options(int *argc, char ***argv, struct options *options)
{
    for (; *argc > 2 && strncmp((*argv)[1], "--", 2) == 0; *argc -= 2, *argv += 2) {
        const char *name = (*argv)[1], *value = (*argv)[2];
        if (strcmp(name, "--crop") == 0 && read_size(value, &options->shape.crop_width, &options->shape.crop_height))
            continue;
        if (strcmp(name, "--scale") == 0 && read_size(value, &options->shape.width, &options->shape.height))
            continue;
        if (strcmp(name, "--speed") == 0 && sscanf(value, "%d", &options->speed) == 1)
            continue;
        if (strcmp(name, "--neighbours") == 0 && sscanf(value, "%d", &options->neighbours) == 1 &&
            options->neighbours >= 0 && options->neighbours <= LUMI_FILTER_OTHERS_MAX)
            continue;
        if (strcmp(name, "--quantizers") != 0)
            return false;
        options->count = 0;
        for (const char *at = value; at && options->count < 8; at = strchr(at, ','), at = at ? at + 1 : NULL)
            options->quantizers[options->count++] = atoi(at);
    }
    return *argc >= 4;
}

int main(int argc, char **argv)
{
    static const float qualities[] = {30, 55, 75, 88, 94, 98};
    static const unsigned quantizers[] = {52, 40, 30, 20, 12, 5};
    enum { POINTS = sizeof qualities / sizeof *qualities };
    struct point webps[POINTS], videos[POINTS];
    struct options options = {.quantizers = {32, 26, 21, 15, 8}, .count = 5, .speed = 2, .neighbours = 12};
    struct bench bench = {0};

    if (!read_options(&argc, &argv, &options)) {
        fputs("usage: bench_codec [--crop WxH] [--scale WxH] [--quantizers A,B,...] [--speed CPU-USED] "
              "[--neighbours N] COLUMNS RANGE FILE...\n",
              stderr);
        return 2;
    }
    bench.columns = atoi(argv[1]);
    bench.range = atoi(argv[2]);
    bench.count = argc - 3;
    bench.speed = options.speed;
    bench.neighbours = options.neighbours;
    if (bench.columns < 1)
        return 2;
    load(&bench, argv + 3, &options.shape);
    for (int i = 0; i < POINTS; i++) {
        webps[i] = webp(&bench, qualities[i]);
        videos[i] = video(&bench, quantizers[i]);
    }
    printf("%d images of %d x %d, %d reference images\n", bench.count, bench.images[0].width, bench.images[0].height,
           bench.clusters.count);
    puts("PSNR dB  B/image  WebP B/im  /ours  video B/im  ours/vid  side/tile  tiles/s  enc core-s/Mpx");
    for (int i = 0; i < options.count; i++)
        measure(&bench, options.quantizers[i], webps, videos, POINTS);
    return 0;
}
