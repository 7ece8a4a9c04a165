#include "sfm/mapping/bundle_adjustment.hpp"

#include <algorithm>

#include "firmware/base/check.hpp"
#include "sfm/mapping/bundle_problem.hpp"
#include "sfm/mapping/bundle_solvers.hpp"

namespace trigmesh {
namespace {

bool in_range(double value, double low, double high) {
  return value >= low && value <= high;
}

Result<> validate_freedom(const IntrinsicsFreedom& freedom, std::size_t camera) {
  if (freedom.distortion < 0 || freedom.distortion > 4) {
    return fail(ErrorCode::kInvalidArgument,
                "intrinsics[{}].distortion is {}, must be in [0, 4]",
                camera,
                freedom.distortion);
  }
  for (const double sigma :
       {freedom.focal_sigma_ratio, freedom.principal_point_sigma_px, freedom.distortion_sigma}) {
    if (!in_range(sigma, 0.0, 1e9)) {
      return fail(ErrorCode::kInvalidArgument,
                  "intrinsics[{}] has a prior with sigma {}, must be in [0, 1e9]",
                  camera,
                  sigma);
    }
  }
  if (freedom.focal_sigma_ratio > 0.0 && !(freedom.prior.fx_px > 0.0)) {
    return fail(ErrorCode::kInvalidArgument,
                "intrinsics[{}].prior.fx_px is {}, must be > 0 for a prior",
                camera,
                freedom.prior.fx_px);
  }
  return {};
}

SolverSummary solve(BundleProblem& problem, const BundleOptions& options, Executor& executor) {
  switch (options.solver) {
    case BundleSolver::kSchur:
      return solve_with_schur(problem, options, executor);
    case BundleSolver::kCeres:
      return solve_with_ceres(problem, options);
    case BundleSolver::kAutomatic:
      break;
  }
  const auto views = static_cast<int>(problem.variable_pose_count());
  return views <= options.dense_views ? solve_with_schur(problem, options, executor)
                                      : solve_with_ceres(problem, options);
}

}  // namespace

Result<> BundleOptions::validate() const {
  if (!in_range(loss_scale_px, 1e-6, 1e6)) {
    return fail(
        ErrorCode::kInvalidArgument, "loss_scale_px is {}, must be in [1e-6, 1e6]", loss_scale_px);
  }
  if (max_iterations < 1) {
    return fail(ErrorCode::kInvalidArgument, "max_iterations is {}, must be >= 1", max_iterations);
  }
  if (!in_range(function_tolerance, 0.0, 1.0) || !in_range(parameter_tolerance, 0.0, 1.0)) {
    return fail(ErrorCode::kInvalidArgument,
                "function_tolerance is {} and parameter_tolerance {}, must be in [0, 1]",
                function_tolerance,
                parameter_tolerance);
  }
  if (dense_views < 0) {
    return fail(ErrorCode::kInvalidArgument, "dense_views is {}, must be >= 0", dense_views);
  }
  for (std::size_t i = 0; i < intrinsics.size(); ++i) {
    TM_RETURN_IF_ERROR(validate_freedom(intrinsics[i], i));
  }
  return {};
}

std::string_view to_string(BundleOutcome outcome) {
  switch (outcome) {
    case BundleOutcome::kConverged:
      return "converged";
    case BundleOutcome::kMaxIterations:
      return "max_iterations";
    case BundleOutcome::kFailed:
      return "failed";
    case BundleOutcome::kNothingToDo:
      return "nothing_to_do";
  }
  return "unknown";
}

BundleReport adjust_bundle(Scene& scene,
                           const BundleSelection& selection,
                           const BundleOptions& options,
                           std::span<const std::vector<float>> sigmas_px,
                           Executor& executor) {
  TM_CHECK(options.validate().has_value());
  BundleProblem problem = build_bundle_problem(scene, selection, options, sigmas_px);
  BundleReport report;
  report.observations = problem.observations.size();
  report.skipped_observations = problem.skipped_observations;
  report.variable_views = problem.variable_pose_count();
  report.landmarks = problem.points.size();
  report.initial_rmse_px = problem.rmse_px();
  report.final_rmse_px = report.initial_rmse_px;
  const bool something_moves =
      report.variable_views > 0 || problem.has_free_intrinsics() || problem.points_are_variable;
  if (problem.observations.empty() || !something_moves) {
    return report;
  }
  const SolverSummary summary = solve(problem, options, executor);
  report.outcome = is_sane(problem) ? summary.outcome : BundleOutcome::kFailed;
  report.iterations = summary.iterations;
  report.initial_cost = summary.initial_cost;
  report.final_cost = summary.final_cost;
  if (report.outcome != BundleOutcome::kFailed) {
    report.final_rmse_px = problem.rmse_px();
    apply_bundle_problem(problem, scene);
  }
  return report;
}

BundleReport adjust_bundle(Scene& scene,
                           const BundleSelection& selection,
                           const BundleOptions& options,
                           std::span<const std::vector<float>> sigmas_px) {
  SerialExecutor executor;
  return adjust_bundle(scene, selection, options, sigmas_px, executor);
}

}  // namespace trigmesh
