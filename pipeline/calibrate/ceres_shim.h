/* Ceres as C: non-linear least squares over blocks of doubles. Calls handed through; only memory is ours, for the order
 * of addresses would decide.
 *
 * A problem is blocks (the caller's arrays, which must stay where they are while the problem lives) and residuals, each
 * a C function of some of these blocks. Solving writes into the blocks. One thread; the same problem gives the same
 * bytes. */
#ifndef LUMI_PIPELINE_CALIBRATE_CERES_SHIM_H
#define LUMI_PIPELINE_CALIBRATE_CERES_SHIM_H

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

struct shim_problem;

/* Fills residuals[residual_count]; where jacobians is not NULL and jacobians[b] is not, also d residual / d block b,
 * row by row (residual_count × the size of block b). False: cannot be evaluated there, the step is taken back. */
typedef bool (*shim_residual)(const void *context, const double *const *blocks, double *residuals, double **jacobians);

/* NULL where there is no memory. */
struct shim_problem *shim_problem_create(void);
void shim_problem_destroy(struct shim_problem *problem);

/* A block before the residuals that use it. `quaternion`: four numbers (w, x, y, z) that stay of unit length, with
 * three degrees of freedom. */
bool shim_add_block(struct shim_problem *problem, double *block, int size, bool quaternion);
void shim_set_constant(struct shim_problem *problem, double *block, bool constant);
/* Some numbers of a block stay as they are (of a block that is no quaternion; before solving). */
bool shim_set_constant_part(struct shim_problem *problem, double *block, int size, const int *which, int count);

/* Context is the caller's and must live as long as the problem. Loss: with s the squared length of the residuals and a
 * the scale, none is s, Huber is s up to a² and then linear in its root, Cauchy is a² log(1 + s / a²). At most
 * SHIM_BLOCKS blocks. */
#define SHIM_BLOCKS 8
enum shim_loss { SHIM_LOSS_NONE = 0, SHIM_LOSS_HUBER = 1, SHIM_LOSS_CAUCHY = 2 };
bool shim_add_residual(struct shim_problem *problem, shim_residual function, const void *context, int residual_count,
                       double *const *blocks, const int *sizes, int block_count, enum shim_loss loss, double scale);

/* Block belongs to those eliminated first (points); all others stay. Without any such call Ceres finds an order itself.
 */
void shim_eliminate_first(struct shim_problem *problem, double *block);

enum shim_solver {
    SHIM_DENSE_QR = 0,
    SHIM_SPARSE_SCHUR = 1,
    SHIM_DENSE_SCHUR = 2,
    SHIM_SPARSE_CHOLESKY = 3,
    SHIM_ITERATIVE_SCHUR = 4 /* for many blocks that stay: each step only to a hundredth, by conjugate gradients */
};
struct shim_options {
    enum shim_solver solver;
    int iterations;
    double function_tolerance; /* relative change of the cost that ends it; 0: 1e-6 */
};
struct shim_summary {
    bool usable, converged;
    int iterations;
    double initial_cost, final_cost; /* half the sum of squares, after the loss */
    char text[256];
};
void shim_solve(struct shim_problem *problem, const struct shim_options *options, struct shim_summary *summary);

/* Covariance of `block` with itself (size × size, row by row), where the problem stands, for each of `count` blocks.
 * False where it cannot be had (rank deficient). */
bool shim_covariance(struct shim_problem *problem, double *const *blocks, int count, double *const *results);

#ifdef __cplusplus
}
#endif
#endif
