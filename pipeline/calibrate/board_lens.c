/* A lens from pictures of a board. */
#include "pipeline/calibrate/board_lens.h"

#include "pipeline/calibrate/board_shim.h"
#include "pipeline/calibrate/ceres_shim.h"
#include "pipeline/calibrate/grey.h"
#include "pipeline/calibrate/rotation.h"
#include "proto/base/memory.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { FEWEST = 3, HOMOGRAPHY = 9 };

int lumi_board_find(const char *path, int columns, int rows, float *corners, int *width, int *height,
                    struct lumi_error *error)
{
    float *grey;

    LUMI_TRY(lumi_grey_read(path, &grey, width, height, error));
    const size_t count = (size_t)*width * (size_t)*height;
    uint8_t *bytes = lumi_alloc(count, 1);
    for (size_t i = 0; bytes && i < count; i++)
        bytes[i] = (uint8_t)(fminf(grey[i], 255) + 0.5f);
    const bool found = bytes && shim_find_board(bytes, *width, *height, columns, rows, corners);
    for (int i = 0; found && i < 2 * columns * rows; i++)
        corners[i] += 0.5f;
    lumi_free(grey);
    if (!bytes)
        return lumi_fail(error, LUMI_ERR_NOMEM, "%s: not enough memory", path);
    lumi_free(bytes);
    return found
               ? LUMI_OK
               : lumi_fail(error, LUMI_ERR_NOTFOUND, "%s: no board of %d×%d inner corners in it", path, columns, rows);
}

/* One corner: its place on the board, and where it was seen. */
struct corner {
    const struct lumi_lens *kind; /* the model and the size */
    double board[2], seen[2];
};

static bool corner_residual(const void *context, const double *const *blocks, double *residuals, double **jacobians)
{
    const struct corner *corner = context;
    const double *pose = blocks[1];
    const struct lumi_vec3 at = lumi_vec3(corner->board[0], corner->board[1], 0);
    struct lumi_lens lens = *corner->kind;
    double r[9], slope[9], by_direction[6], by_lens[2 * LUMI_LENS_NUMBERS], xy[2];

    lumi_lens_from_numbers(blocks[0], &lens);
    if (!(lens.fx > 1) || !(lens.fy > 1))
        return false;
    lumi_rotation_exp(pose, r);
    const struct lumi_vec3 d = lumi_add(lumi_rotate(r, at), lumi_vec3(pose[3], pose[4], pose[5]));
    if (!lumi_lens_project_slope(&lens, d, xy, by_direction, by_lens))
        return false;
    residuals[0] = xy[0] - corner->seen[0];
    residuals[1] = xy[1] - corner->seen[1];
    if (jacobians && jacobians[0])
        memcpy(jacobians[0], by_lens, sizeof by_lens);
    if (!jacobians || !jacobians[1])
        return true;
    lumi_rotation_slope(pose, slope);
    for (int k = 0; k < 3; k++) {
        const struct lumi_vec3 axis = lumi_vec3(slope[k], slope[3 + k], slope[6 + k]);
        const struct lumi_vec3 moved = lumi_rotate(r, lumi_cross(axis, at));
        for (int i = 0; i < 2; i++) {
            const double *g = by_direction + 3 * i;
            jacobians[1][6 * i + k] = g[0] * moved.x + g[1] * moved.y + g[2] * moved.z;
            jacobians[1][6 * i + 3 + k] = g[k];
        }
    }
    return true;
}

/* The vector of unit length that a symmetric matrix shortens most: by inverse iteration (Gauss with pivots). */
static bool smallest(double a[HOMOGRAPHY][HOMOGRAPHY], double x[HOMOGRAPHY])
{
    double trace = 0;

    for (int i = 0; i < HOMOGRAPHY; i++)
        trace += a[i][i];
    for (int i = 0; i < HOMOGRAPHY; i++) {
        a[i][i] += 1e-13 * trace;
        x[i] = 1 + 0.1 * i;
    }
    for (int round = 0; round < 12; round++) {
        double m[HOMOGRAPHY][HOMOGRAPHY + 1], length = 0;
        for (int i = 0; i < HOMOGRAPHY; i++) {
            memcpy(m[i], a[i], sizeof a[i]);
            m[i][HOMOGRAPHY] = x[i];
        }
        for (int c = 0; c < HOMOGRAPHY; c++) {
            if (!(fabs(m[c][c]) > 0))
                return false;
            for (int i = 0; i < HOMOGRAPHY; i++)
                for (int k = HOMOGRAPHY; i != c && k >= c; k--)
                    m[i][k] -= m[i][c] / m[c][c] * m[c][k];
        }
        for (int i = 0; i < HOMOGRAPHY; i++) {
            x[i] = m[i][HOMOGRAPHY] / m[i][i];
            length += x[i] * x[i];
        }
        for (int i = 0; i < HOMOGRAPHY; i++)
            x[i] /= sqrt(length);
    }
    return isfinite(x[0]);
}

/* From the homography of directions: its columns are the board's axes and its place. */
static bool pose_of_columns(const double h[HOMOGRAPHY], double pose[6])
{
    struct lumi_vec3 a = lumi_vec3(h[0], h[3], h[6]), b = lumi_vec3(h[1], h[4], h[7]), t = lumi_vec3(h[2], h[5], h[8]);
    const double scale = (t.z < 0 ? -2 : 2) / (lumi_length(a) + lumi_length(b));

    a = lumi_normalize(lumi_scale(a, scale));
    b = lumi_scale(b, scale);
    b = lumi_normalize(lumi_sub(b, lumi_scale(a, lumi_dot(a, b))));
    const struct lumi_vec3 c = lumi_cross(a, b);
    const double r[9] = {a.x, b.x, c.x, a.y, b.y, c.y, a.z, b.z, c.z};
    if (!isfinite(c.x + c.y + c.z + scale))
        return false;
    lumi_rotation_log(r, pose);
    pose[3] = t.x * scale;
    pose[4] = t.y * scale;
    pose[5] = t.z * scale;
    return true;
}

/* Where the board is if the lens is this one. */
static bool first_pose(const struct lumi_lens *lens, int columns, int rows, const float *corners, double pose[6])
{
    double normal[HOMOGRAPHY][HOMOGRAPHY] = {{0}}, h[HOMOGRAPHY];

    for (int i = 0; i < columns * rows; i++) {
        struct lumi_vec3 d;
        if (!lumi_lens_unproject(lens, corners[2 * i], corners[2 * i + 1], &d))
            return false;
        const double x = i % columns, y = i / columns;
        const double lines[2][HOMOGRAPHY] = {{d.z * x, d.z * y, d.z, 0, 0, 0, -d.x * x, -d.x * y, -d.x},
                                             {0, 0, 0, d.z * x, d.z * y, d.z, -d.y * x, -d.y * y, -d.y}};
        for (int line = 0; line < 2; line++)
            for (int j = 0; j < HOMOGRAPHY; j++)
                for (int k = 0; k < HOMOGRAPHY; k++)
                    normal[j][k] += lines[line][j] * lines[line][k];
    }
    return smallest(normal, h) && pose_of_columns(h, pose);
}

struct trial {
    struct lumi_lens lens;
    double numbers[LUMI_LENS_NUMBERS], sigma[LUMI_LENS_NUMBERS];
    double cost;
    int used;
};

static void fix_numbers(struct shim_problem *problem, struct trial *trial, double reach)
{
    int fixed[LUMI_LENS_NUMBERS], count = 0;

    for (int i = 0; i < LUMI_LENS_NUMBERS; i++) {
        const bool high = i == LUMI_LENS_K3 || i == LUMI_LENS_K4;
        if (!lumi_lens_has(&trial->lens, (enum lumi_lens_number)i) ||
            (high && (trial->lens.model == LUMI_LENS_BROWN || reach < 1)))
            fixed[count++] = i;
    }
    if (count)
        shim_set_constant_part(problem, trial->numbers, LUMI_LENS_NUMBERS, fixed, count);
}

static void solve(struct trial *trial, struct corner *corners, int columns, int rows, int count,
                  struct lumi_board_view *views, double reach, bool with_sigma)
{
    static const int sizes[2] = {LUMI_LENS_NUMBERS, 6};
    const struct shim_options options = {.solver = SHIM_DENSE_SCHUR, .iterations = 200, .function_tolerance = 1e-10};
    struct shim_problem *problem = shim_problem_create();
    struct shim_summary summary = {0};
    double covariance[LUMI_LENS_NUMBERS * LUMI_LENS_NUMBERS], *blocks[2] = {trial->numbers, NULL};
    double *lens = trial->numbers, *result = covariance;

    trial->cost = INFINITY;
    if (!problem)
        return;
    lumi_lens_numbers(&trial->lens, trial->numbers);
    shim_add_block(problem, trial->numbers, LUMI_LENS_NUMBERS, false);
    for (int v = 0; v < count; v++) {
        if (!views[v].used)
            continue;
        blocks[1] = views[v].pose;
        shim_add_block(problem, views[v].pose, 6, false);
        for (int i = v * columns * rows; i < (v + 1) * columns * rows; i++)
            shim_add_residual(problem, corner_residual, &corners[i], 2, blocks, sizes, 2, SHIM_LOSS_HUBER, 1);
        shim_eliminate_first(problem, views[v].pose);
    }
    fix_numbers(problem, trial, reach);
    shim_solve(problem, &options, &summary);
    if (summary.usable) {
        trial->cost = summary.final_cost;
        lumi_lens_from_numbers(trial->numbers, &trial->lens);
    }
    memset(trial->sigma, 0, sizeof trial->sigma);
    const int freedom = 2 * columns * rows * trial->used - 6 * trial->used - LUMI_LENS_NUMBERS;
    if (with_sigma && shim_covariance(problem, &lens, 1, &result))
        for (int i = 0; i < LUMI_LENS_NUMBERS; i++)
            trial->sigma[i] =
                sqrt(fmax(0, covariance[i * (LUMI_LENS_NUMBERS + 1)]) * 2 * trial->cost / fmax(1, freedom));
    shim_problem_destroy(problem);
}

/* A lens of that field of view, and where the boards are then. */
static void guess(struct trial *trial, enum lumi_lens_model model, int width, int height, double fov, int columns,
                  int rows, int count, struct lumi_board_view *views)
{
    const double f = model == LUMI_LENS_FISHEYE ? width / fov : width / 2.0 / tan(fov / 2);

    trial->lens = (struct lumi_lens){
        .model = model, .width = width, .height = height, .fx = f, .fy = f, .cx = width / 2.0, .cy = height / 2.0};
    trial->used = 0;
    for (int v = 0; v < count; v++) {
        views[v].used = first_pose(&trial->lens, columns, rows, views[v].corners, views[v].pose);
        trial->used += views[v].used;
    }
}

/* What is left of each view and all, and how far out corners were seen. */
static void judge(const struct lumi_lens *lens, const struct corner *corners, int per_view, int count,
                  struct lumi_board_view *views, struct lumi_board_lens *result)
{
    double numbers[LUMI_LENS_NUMBERS], all = 0;
    long seen = 0;

    lumi_lens_numbers(lens, numbers);
    result->reach = 0;
    for (int v = 0; v < count; v++) {
        double sum = 0;
        for (int i = v * per_view; views[v].used && i < (v + 1) * per_view; i++) {
            const double *blocks[2] = {numbers, views[v].pose};
            double left[2];
            struct lumi_vec3 d;
            if (corner_residual(&corners[i], blocks, left, NULL))
                sum += left[0] * left[0] + left[1] * left[1];
            if (lumi_lens_unproject(lens, corners[i].seen[0], corners[i].seen[1], &d))
                result->reach = fmax(result->reach, acos(fmin(1, d.z)));
        }
        views[v].error = sqrt(sum / per_view);
        all += sum;
        seen += views[v].used ? per_view : 0;
    }
    result->error = seen ? sqrt(all / (double)seen) : 0;
}

int lumi_board_solve(enum lumi_lens_model model, int width, int height, int columns, int rows, int count,
                     struct lumi_board_view *views, struct lumi_board_lens *result, struct lumi_error *error)
{
    static const double fovs[] = {0.5, 0.8, 1.2, 1.7, 2.2, 2.8};
    const int per_view = columns * rows;
    struct corner *corners = lumi_calloc((size_t)(count ? count : 1) * (size_t)per_view, sizeof *corners);
    struct trial best = {.cost = INFINITY}, trial = {0};

    *result = (struct lumi_board_lens){0};
    if (!corners)
        return lumi_fail(error, LUMI_ERR_NOMEM, "not enough memory to find a lens");
    for (int i = 0; i < count * per_view; i++)
        corners[i] = (struct corner){
            &best.lens,
            {i % per_view % columns, i % per_view / columns},
            {views[i / per_view].corners[2 * (i % per_view)], views[i / per_view].corners[2 * (i % per_view) + 1]}};
    double fov = 0;
    for (size_t i = 0; i < sizeof fovs / sizeof *fovs; i++) {
        guess(&trial, model, width, height, fovs[i], columns, rows, count, views);
        best.lens = trial.lens;
        if (trial.used < FEWEST)
            continue;
        solve(&trial, corners, columns, rows, count, views, 0, false);
        /* Whoever leaves out views has less to explain. */
        if (trial.cost / trial.used < best.cost) {
            best.cost = trial.cost / trial.used;
            fov = fovs[i];
        }
    }
    if (fov > 0) {
        guess(&best, model, width, height, fov, columns, rows, count, views);
        solve(&best, corners, columns, rows, count, views, 0, false);
        judge(&best.lens, corners, per_view, count, views, result);
        solve(&best, corners, columns, rows, count, views, result->reach, true);
        judge(&best.lens, corners, per_view, count, views, result);
        result->lens = best.lens;
        memcpy(result->sigma, best.sigma, sizeof best.sigma);
    }
    lumi_free(corners);
    if (!(fov > 0) || !isfinite(best.cost) || !(result->sigma[LUMI_LENS_FX] > 0) ||
        result->sigma[LUMI_LENS_FX] > 0.1 * result->lens.fx)
        return lumi_fail(error, LUMI_ERR_FORMAT,
                         "%d pictures of the board do not tell the lens: take more, tilted, from different sides",
                         count);
    return LUMI_OK;
}

int lumi_board_print(const struct lumi_lens *lens, const char *name, char *text, size_t size)
{
    static const char *const names[LUMI_LENS_NUMBERS] = {"fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4", "p1", "p2"};
    const bool fisheye = lens->model == LUMI_LENS_FISHEYE;
    double numbers[LUMI_LENS_NUMBERS];
    int length = snprintf(text, size, "[lens %s]\nmodel = %s\nwidth = %d\nheight = %d\n", name,
                          fisheye ? "fisheye" : "pinhole", lens->width, lens->height);

    lumi_lens_numbers(lens, numbers);
    for (int i = 0; i < LUMI_LENS_NUMBERS; i++)
        if (numbers[i] != 0)
            length += snprintf(length < (int)size ? text + length : NULL,
                               length < (int)size ? size - (size_t)length : 0, "%s = %.17g\n", names[i], numbers[i]);
    return length;
}
