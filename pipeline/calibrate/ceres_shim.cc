/* Ceres as C: see ceres_shim.h. */
#include "pipeline/calibrate/ceres_shim.h"

#include <ceres/cost_function.h>
#include <ceres/covariance.h>
#include <ceres/loss_function.h>
#include <ceres/manifold.h>
#include <ceres/ordered_groups.h>
#include <ceres/problem.h>
#include <ceres/solver.h>
#include <cstdio>
#include <glog/logging.h>
#include <memory>
#include <utility>
#include <vector>

namespace {

class residual final : public ceres::CostFunction {
  public:
    residual(shim_residual function, const void *context, int residual_count, const int *sizes, int count)
        : function_(function), context_(context)
    {
        set_num_residuals(residual_count);
        for (int i = 0; i < count; i++)
            mutable_parameter_block_sizes()->push_back(sizes[i]);
    }
    bool Evaluate(double const *const *blocks, double *residuals, double **jacobians) const override
    {
        return function_(context_, blocks, residuals, jacobians);
    }

  private:
    shim_residual function_;
    const void *context_;
};

ceres::LossFunction *make_loss(enum shim_loss loss, double scale)
{
    if (loss == SHIM_LOSS_HUBER)
        return new ceres::HuberLoss(scale);
    if (loss == SHIM_LOSS_CAUCHY)
        return new ceres::CauchyLoss(scale);
    return nullptr;
}

} // namespace

struct shim_problem {
    ceres::Problem problem;
    std::vector<double *> first; // eliminated first
};

struct shim_problem *shim_problem_create(void)
try {
    FLAGS_minloglevel = google::GLOG_FATAL; // what it would print is in the summary
    return new shim_problem;
} catch (...) {
    return nullptr;
}

void shim_problem_destroy(struct shim_problem *problem)
{
    delete problem;
}

bool shim_add_block(struct shim_problem *problem, double *block, int size, bool quaternion)
try {
    if (quaternion)
        problem->problem.AddParameterBlock(block, size, new ceres::QuaternionManifold);
    else
        problem->problem.AddParameterBlock(block, size);
    return true;
} catch (...) {
    return false;
}

void shim_set_constant(struct shim_problem *problem, double *block, bool constant)
{
    if (constant)
        problem->problem.SetParameterBlockConstant(block);
    else
        problem->problem.SetParameterBlockVariable(block);
}

bool shim_set_constant_part(struct shim_problem *problem, double *block, int size, const int *which, int count)
try {
    problem->problem.SetManifold(block, new ceres::SubsetManifold(size, std::vector<int>(which, which + count)));
    return true;
} catch (...) {
    return false;
}

bool shim_add_residual(struct shim_problem *problem, shim_residual function, const void *context, int residual_count,
                       double *const *blocks, const int *sizes, int block_count, enum shim_loss loss, double scale)
try {
    problem->problem.AddResidualBlock(new residual(function, context, residual_count, sizes, block_count),
                                      make_loss(loss, scale), std::vector<double *>(blocks, blocks + block_count));
    return true;
} catch (...) {
    return false;
}

void shim_eliminate_first(struct shim_problem *problem, double *block)
{
    problem->first.push_back(block);
}

void shim_solve(struct shim_problem *problem, const struct shim_options *options, struct shim_summary *summary)
try {
    static const ceres::LinearSolverType types[] = {ceres::DENSE_QR, ceres::SPARSE_SCHUR, ceres::DENSE_SCHUR,
                                                    ceres::SPARSE_NORMAL_CHOLESKY};
    ceres::Solver::Options given;
    ceres::Solver::Summary said;

    given.linear_solver_type = types[options->solver];
    given.max_num_iterations = options->iterations;
    given.function_tolerance = options->function_tolerance > 0 ? options->function_tolerance : 1e-6;
    given.num_threads = 1;
    given.logging_type = ceres::SILENT;
    given.minimizer_progress_to_stdout = false;
    if (!problem->first.empty()) {
        auto order = std::make_shared<ceres::ParameterBlockOrdering>();
        std::vector<double *> all;

        problem->problem.GetParameterBlocks(&all);
        for (double *block : all)
            order->AddElementToGroup(block, 1);
        for (double *block : problem->first)
            order->AddElementToGroup(block, 0);
        given.linear_solver_ordering = order;
    }
    ceres::Solve(given, &problem->problem, &said);
    summary->usable = said.IsSolutionUsable();
    summary->converged = said.termination_type == ceres::CONVERGENCE;
    summary->iterations = said.num_successful_steps + said.num_unsuccessful_steps;
    summary->initial_cost = said.initial_cost;
    summary->final_cost = said.final_cost;
    std::snprintf(summary->text, sizeof summary->text, "%s", said.message.c_str());
} catch (...) {
    *summary = {};
    std::snprintf(summary->text, sizeof summary->text, "not enough memory");
}

bool shim_covariance(struct shim_problem *problem, double *const *blocks, int count, double *const *results)
try {
    ceres::Covariance::Options given;
    std::vector<std::pair<const double *, const double *>> wanted;

    given.num_threads = 1;
    for (int i = 0; i < count; i++)
        wanted.emplace_back(blocks[i], blocks[i]);
    ceres::Covariance covariance(given);
    if (!covariance.Compute(wanted, &problem->problem))
        return false;
    for (int i = 0; i < count; i++)
        if (!covariance.GetCovarianceBlock(blocks[i], blocks[i], results[i]))
            return false;
    return true;
} catch (...) {
    return false;
}
