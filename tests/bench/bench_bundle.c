/* How long a whole rig takes to solve, on points that nobody photographed: bench_bundle [CAMERAS POSITIONS PER_IMAGE].
 */
#include "pipeline/calibrate/align.h"
#include "pipeline/calibrate/solve.h"
#include "tests/unit/shaken_rig.h"

#include <stdio.h>
#include <sys/resource.h>
#include <time.h>

#define DEGREE (LUMI_PI / 180)

int main(int argc, char **argv)
{
    int cameras = argc > 1 ? atoi(argv[1]) : 16, positions = argc > 2 ? atoi(argv[2]) : 72;
    int per_image = argc > 3 ? atoi(argv[3]) : 200;
    const struct shaken_settings settings = {
        1, 0.005, 0.5 * DEGREE, 0.3, 0.03, cameras * positions * per_image / 8, per_image};
    const struct lumi_solve_settings rounds = {.lenses = true};
    struct lumi_solve_result result;
    struct lumi_similarity similarity;
    struct lumi_pose_distance d;
    struct lumi_error error = {0};
    struct rusage usage;
    struct lumi_rig rig;
    struct shaken s;

    if (lumi_rig_arc(&rig, cameras, positions, 1, 0.7, 1280, 1024, 110 * DEGREE, 88 * DEGREE, &error))
        return fprintf(stderr, "%s\n", error.text), 1;
    shaken_init(&s, &rig, &settings);
    clock_t begin = clock();
    if (lumi_solve(&s.bundle, &s.mechanism, &rounds, &result, &error))
        return fprintf(stderr, "%s\n", error.text), 1;
    double seconds = (double)(clock() - begin) / CLOCKS_PER_SEC;
    struct lumi_pose *found = calloc((size_t)s.bundle.camera_count, sizeof *found);
    for (int i = 0; i < s.bundle.camera_count; i++)
        found[i] = s.bundle.cameras[i].pose;
    if (lumi_align(s.bundle.camera_count, found, s.truth, &similarity, &error) ||
        lumi_pose_compare(s.bundle.camera_count, found, s.truth, &similarity, &d, &error))
        return fprintf(stderr, "%s\n", error.text), 1;
    getrusage(RUSAGE_SELF, &usage);
    printf("%d cameras, %d points, %d observations: %.1f core-s, %.0f MB; median %.3f mm %.4f°, worst %.2f mm %.3f°\n",
           s.bundle.camera_count, s.bundle.point_count, s.bundle.observation_count, seconds,
           (double)usage.ru_maxrss / 1000, 1e3 * d.median_m, d.median_rotation / DEGREE, 1e3 * d.worst_m,
           d.worst_rotation / DEGREE);
    free(found);
    shaken_finish(&s);
    return 0;
}
