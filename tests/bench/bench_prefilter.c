/* What the prefilter of one view costs, and how near to its integral it comes.
 *
 *   bench_prefilter CAPTURE VIEW BASE MOST [REFERENCE [FOLDER]]
 *
 * CAPTURE has been processed; VIEW counts among the views of its field. Prints samples a pixel, standard errors as
 * estimated (grey levels of 255), core-seconds without reading; with REFERENCE, how far the picture is from one of so
 * many samples everywhere (another seed): root mean square, and mean over the pixels. FOLDER gets the pictures. */
#include "pipeline/graph/graph.h"
#include "pipeline/prefilter/display.h"
#include "pipeline/prefilter/prefilter.h"
#include "proto/image/image.h"

#include <glib.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

static double core_seconds(void)
{
    struct timespec now;

    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static int check(int code, const struct lumi_error *error)
{
    if (code != LUMI_OK) {
        fprintf(stderr, "bench_prefilter: %s\n", error->text);
        exit(1);
    }
    return code;
}

static void save(const char *folder, const char *name, const struct lumi_raster *display)
{
    g_autofree char *path = g_build_filename(folder, name, NULL);
    struct lumi_raster linear;
    struct lumi_error error = {0};

    check(lumi_raster_create(&linear, display->width, display->height, 3, LUMI_F32), &error);
    for (int y = 0; y < display->height; y++)
        for (int i = 0; i < 3 * display->width; i++)
            lumi_row_f32(&linear, y)[i] = lumi_row_f32(display, y)[i];
    prefilter_to_linear(&linear);
    struct lumi_raster bytes;
    check(lumi_raster_convert(&linear, LUMI_U8, &bytes), &error);
    check(lumi_image_write(path, &bytes, NULL, &error), &error);
    lumi_raster_finish(&linear);
    lumi_raster_finish(&bytes);
}

static void compare(const struct lumi_raster *a, const struct lumi_raster *b)
{
    double squares = 0, sum = 0;
    const double values = 3.0 * a->width * a->height;

    for (int y = 0; y < a->height; y++)
        for (int i = 0; i < 3 * a->width; i++) {
            const double d = 255 * (double)(lumi_row_f32(a, y)[i] - lumi_row_f32(b, y)[i]);
            squares += d * d;
            sum += fabs(d);
        }
    printf("against the reference: rms %.3f, mean %.3f grey levels\n", sqrt(squares / values), sum / values);
}

static void measure(struct lumi_run *run, void *state, int index, int argc, char **argv)
{
    struct lumi_prefilter_settings settings;
    struct lumi_prefilter_report report;
    struct lumi_raster picture, other;
    struct lumi_error error = {0};

    lumi_prefilter_settings_of(run, index, &settings);
    settings.base = settings.most = 2; /* reads what there is to be read */
    check(lumi_prefilter_image(run, state, index, &settings, &picture, &report, &error), &error);
    lumi_raster_finish(&picture);
    settings.base = atoi(argv[3]);
    settings.most = atoi(argv[4]);
    const double before = core_seconds();
    check(lumi_prefilter_image(run, state, index, &settings, &picture, &report, &error), &error);
    printf("%.2f core-seconds, %.1f samples a pixel, standard error %.3f grey levels (worst block %.2f, %.2f %% over "
           "%.2f), %.3f %% uncovered\n",
           core_seconds() - before, report.samples, 255 * report.error, 255 * report.worst, 100 * report.over,
           255 * (double)settings.tolerance, 100 * report.uncovered);
    if (argc > 6)
        save(argv[6], "prefiltered.png", &picture);
    if (argc > 5) {
        settings.base = settings.most = atoi(argv[5]);
        settings.seed += 1;
        check(lumi_prefilter_image(run, state, index, &settings, &other, &report, &error), &error);
        compare(&picture, &other);
        if (argc > 6)
            save(argv[6], "reference.png", &other);
        lumi_raster_finish(&other);
    }
    lumi_raster_finish(&picture);
}

int main(int argc, char **argv)
{
    struct lumi_parameters parameters;
    struct lumi_error error = {0};
    struct lumi_run *run;
    void *state;

    if (argc < 5) {
        fprintf(stderr, "usage: bench_prefilter CAPTURE VIEW BASE MOST [REFERENCE [FOLDER]]\n");
        return 2;
    }
    lumi_run_defaults(&parameters);
    parameters.prefilter = LUMI_PREFILTER_BASE;
    check(lumi_graph_open(argv[1], NULL, &parameters, 1, false, &run, &error), &error);
    const int number = atoi(argv[2]);
    if (number < 0 || number >= run->kept_count)
        return 2;
    check(lumi_stage_prefilter.begin(run, &state, &error), &error);
    measure(run, state, run->kept[number], argc, argv);
    lumi_stage_prefilter.end(run, state);
    lumi_run_close(run);
    return 0;
}
