/* How near features lie to where they should: a capture with true poses whose stages "features" and "pairs" have been
 * run; points are found from the true poses, and what is left of every observation is listed by the feature's size.
 * usage: bench_tracks CAPTURE */
#include "pipeline/calibrate/bundle.h"
#include "pipeline/calibrate/tracks.h"
#include "pipeline/run/run.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { CLASSES = 6 };

static int by_value(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;

    return x < y ? -1 : x > y;
}

static void report(const struct lumi_bundle *b, const struct lumi_tracks *tracks)
{
    static const double from[CLASSES + 1] = {0, 0.15, 0.18, 0.22, 0.3, 0.6, 1e9}; /* expected sigma */
    double *errors = calloc((size_t)b->observation_count, sizeof *errors);

    for (int c = 0; errors && c <= CLASSES; c++) {
        int count = 0, far = 0;
        for (int i = 0; i < b->observation_count; i++) {
            const struct lumi_bundle_observation *o = &b->observations[i];
            const double error = hypot(o->residual[0], o->residual[1]);
            if (!isfinite(error) || (c < CLASSES && (o->sigma < from[c] || o->sigma >= from[c + 1])))
                continue;
            errors[count++] = error;
            far += error > 3;
        }
        qsort(errors, (size_t)count, sizeof *errors, by_value);
        if (count && c < CLASSES)
            printf("sigma %.2f..%.2f: %7d observations, error median %.3f px, 90 %% %.3f px, over 3 px %.2f %%\n",
                   from[c], from[c + 1], count, errors[count / 2], errors[count * 9 / 10], 100.0 * far / count);
        else if (count)
            printf("all: %d observations of %d tracks, median %.3f px, 90 %% %.3f px, over 3 px %.2f %%\n", count,
                   tracks->track_count, errors[count / 2], errors[count * 9 / 10], 100.0 * far / count);
    }
    free(errors);
}

static int measure(struct lumi_run *run, struct lumi_error *error)
{
    struct lumi_tracks_settings settings;
    struct lumi_tracks tracks;
    struct lumi_bundle b;
    struct timespec begin, end;

    lumi_tracks_defaults(&settings);
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &begin);
    LUMI_TRY(lumi_tracks_build(run, &settings, &tracks, error));
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &end);
    printf("tracks: %.2f core-seconds\n",
           (double)(end.tv_sec - begin.tv_sec) + 1e-9 * (double)(end.tv_nsec - begin.tv_nsec));
    LUMI_TRY(lumi_bundle_init(&b, run->count, run->count, tracks.track_count, tracks.observation_count, error));
    for (int i = 0; i < run->count; i++) {
        b.lenses[i].lens = run->sources[i].lens;
        b.cameras[i] = (struct lumi_bundle_camera){.lens = i, .used = true, .pose = run->sources[i].pose};
    }
    for (int t = 0; t < tracks.track_count; t++) {
        b.first[t] = tracks.tracks[t].first;
        for (int k = 0; k < tracks.tracks[t].count; k++) {
            const struct lumi_observation *o = &tracks.observations[tracks.tracks[t].first + k];
            b.observations[tracks.tracks[t].first + k] = (struct lumi_bundle_observation){
                .camera = o->image, .point = t, .x = o->x, .y = o->y, .sigma = o->sigma};
        }
    }
    b.first[tracks.track_count] = tracks.observation_count;
    lumi_bundle_triangulate(&b, 2);
    lumi_bundle_residuals(&b);
    report(&b, &tracks);
    lumi_bundle_reject(&b, 4);
    lumi_bundle_triangulate(&b, 2);
    lumi_bundle_residuals(&b);
    printf("without those over four sigmas:\n");
    report(&b, &tracks);
    lumi_bundle_finish(&b);
    lumi_tracks_finish(&tracks);
    return LUMI_OK;
}

int main(int argc, char **argv)
{
    struct lumi_error error = {0};
    struct lumi_parameters parameters;
    struct lumi_run *run;

    if (argc != 2) {
        fprintf(stderr, "usage: bench_tracks CAPTURE\n");
        return 2;
    }
    lumi_run_defaults(&parameters);
    parameters.calibrate = LUMI_CHOICE_YES;
    int code = lumi_run_open(argv[1], NULL, &parameters, 1, false, &run, &error);
    if (code == LUMI_OK) {
        code = measure(run, &error);
        lumi_run_close(run);
    }
    if (code != LUMI_OK)
        fprintf(stderr, "bench_tracks: %s\n", error.text);
    return lumi_exit_status(code);
}
