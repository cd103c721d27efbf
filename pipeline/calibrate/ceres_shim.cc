/* Ceres as C: see ceres_shim.h. */
#include "pipeline/calibrate/ceres_shim.h"

#include <ceres/cost_function.h>
#include <ceres/covariance.h>
#include <ceres/loss_function.h>
#include <ceres/manifold.h>
#include <ceres/ordered_groups.h>
#include <ceres/problem.h>
#include <ceres/solver.h>
#include <algorithm>
#include <cstdio>
#include <glog/logging.h>
#include <memory>
#include <unordered_map>
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

/* Ceres orders what it is free to order by address. So the blocks it sees lie one after the other, in the order in which
 * they were named, whatever the caller's memory looks like: the same problem gives the same bytes. */
namespace {

struct block_entry {
    double *outside; // the caller's
    int size;
    bool quaternion, constant, first;
    std::vector<int> still; // numbers of it that stay
    double *inside;
};

struct residual_entry {
    shim_residual function;
    const void *context;
    int count;
    std::vector<int> blocks;
    enum shim_loss loss;
    double scale;
};

} // namespace

struct shim_problem {
    std::vector<block_entry> blocks;
    std::unordered_map<double *, int> numbers;
    std::vector<residual_entry> residuals;
    std::vector<double> inside;
    std::unique_ptr<ceres::Problem> problem; // none: to be made anew

    int number(double *block, int size)
    {
        auto found = numbers.try_emplace(block, static_cast<int>(blocks.size()));
        if (found.second)
            blocks.push_back({block, size, false, false, false, {}, nullptr});
        problem.reset();
        return found.first->second;
    }
    void make();
    void bring_in();
    void bring_out();
};

void shim_problem::make()
{
    size_t size = 0;

    if (problem)
        return;
    problem = std::make_unique<ceres::Problem>();
    for (const auto &b : blocks)
        size += static_cast<size_t>(b.size);
    inside.resize(size);
    size = 0;
    for (auto &b : blocks) {
        b.inside = inside.data() + size;
        size += static_cast<size_t>(b.size);
        ceres::Manifold *manifold = b.quaternion      ? new ceres::QuaternionManifold
                                    : b.still.empty() ? static_cast<ceres::Manifold *>(nullptr)
                                                      : new ceres::SubsetManifold(b.size, b.still);
        problem->AddParameterBlock(b.inside, b.size, manifold);
        if (b.constant)
            problem->SetParameterBlockConstant(b.inside);
    }
    for (const auto &r : residuals) {
        std::vector<double *> at;
        std::vector<int> sizes;
        for (int i : r.blocks) {
            at.push_back(blocks[static_cast<size_t>(i)].inside);
            sizes.push_back(blocks[static_cast<size_t>(i)].size);
        }
        problem->AddResidualBlock(
            new residual(r.function, r.context, r.count, sizes.data(), static_cast<int>(sizes.size())),
            make_loss(r.loss, r.scale), at);
    }
}

void shim_problem::bring_in()
{
    make();
    for (const auto &b : blocks)
        std::copy(b.outside, b.outside + b.size, b.inside);
}

void shim_problem::bring_out()
{
    for (const auto &b : blocks)
        std::copy(b.inside, b.inside + b.size, b.outside);
}

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
    const int number = problem->number(block, size);
    problem->blocks[static_cast<size_t>(number)].quaternion = quaternion;
    return true;
} catch (...) {
    return false;
}

void shim_set_constant(struct shim_problem *problem, double *block, bool constant)
{
    auto found = problem->numbers.find(block);
    if (found != problem->numbers.end())
        problem->blocks[static_cast<size_t>(found->second)].constant = constant;
    problem->problem.reset();
}

bool shim_set_constant_part(struct shim_problem *problem, double *block, int size, const int *which, int count)
try {
    const int number = problem->number(block, size);
    problem->blocks[static_cast<size_t>(number)].still.assign(which, which + count);
    return true;
} catch (...) {
    return false;
}

bool shim_add_residual(struct shim_problem *problem, shim_residual function, const void *context, int residual_count,
                       double *const *blocks, const int *sizes, int block_count, enum shim_loss loss, double scale)
try {
    residual_entry entry = {function, context, residual_count, {}, loss, scale};
    for (int i = 0; i < block_count; i++)
        entry.blocks.push_back(problem->number(blocks[i], sizes[i]));
    problem->residuals.push_back(std::move(entry));
    return true;
} catch (...) {
    return false;
}

void shim_eliminate_first(struct shim_problem *problem, double *block)
{
    auto found = problem->numbers.find(block);
    if (found != problem->numbers.end())
        problem->blocks[static_cast<size_t>(found->second)].first = true;
}

void shim_solve(struct shim_problem *problem, const struct shim_options *options, struct shim_summary *summary)
try {
    static const ceres::LinearSolverType types[] = {ceres::DENSE_QR, ceres::SPARSE_SCHUR, ceres::DENSE_SCHUR,
                                                    ceres::SPARSE_NORMAL_CHOLESKY, ceres::ITERATIVE_SCHUR};
    ceres::Solver::Options given;
    ceres::Solver::Summary said;

    given.linear_solver_type = types[options->solver];
    /* CHOLMOD stands on whatever BLAS is installed, and some give other bytes from call to call. */
    given.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;
    /* Coarser steps are no cheaper altogether: more of them are wanted. */
    given.preconditioner_type = ceres::SCHUR_JACOBI;
    given.use_explicit_schur_complement = true;
    given.eta = 0.01;
    given.max_num_iterations = options->iterations;
    given.function_tolerance = options->function_tolerance > 0 ? options->function_tolerance : 1e-6;
    given.num_threads = 1;
    given.logging_type = ceres::SILENT;
    given.minimizer_progress_to_stdout = false;
    problem->bring_in();
    auto order = std::make_shared<ceres::ParameterBlockOrdering>();
    bool ordered = false;
    for (const auto &b : problem->blocks) {
        order->AddElementToGroup(b.inside, b.first ? 0 : 1);
        ordered = ordered || b.first;
    }
    if (ordered)
        given.linear_solver_ordering = order;
    ceres::Solve(given, problem->problem.get(), &said);
    problem->bring_out();
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
    problem->bring_in();
    for (int i = 0; i < count; i++) {
        const double *inside = problem->blocks[static_cast<size_t>(problem->numbers.at(blocks[i]))].inside;
        wanted.emplace_back(inside, inside);
    }
    ceres::Covariance covariance(given);
    if (!covariance.Compute(wanted, problem->problem.get()))
        return false;
    for (int i = 0; i < count; i++)
        if (!covariance.GetCovarianceBlock(wanted[static_cast<size_t>(i)].first, wanted[static_cast<size_t>(i)].first,
                                           results[i]))
            return false;
    return true;
} catch (...) {
    return false;
}
