#pragma once

#include "firmware/base/executor.hpp"
#include "sfm/mapping/bundle_problem.hpp"

// The two solvers of a bundle problem. Both minimise the same cost over the same parameters with
// the same trust region rule and leave the problem at the best state that they found.

namespace trigmesh {

/// What a solver did.
struct SolverSummary {
  BundleOutcome outcome = BundleOutcome::kFailed;  ///< never kNothingToDo
  int iterations = 0;
  double initial_cost = 0.0;
  double final_cost = 0.0;
};

/// Levenberg-Marquardt on our own Schur complement with a dense reduced system. The same bits for
/// every executor.
[[nodiscard]] SolverSummary solve_with_schur(BundleProblem& problem,
                                             const BundleOptions& options,
                                             Executor& executor);

/// Ceres; the reduced system dense or sparse as the options say. Single thread.
[[nodiscard]] SolverSummary solve_with_ceres(BundleProblem& problem, const BundleOptions& options);

}  // namespace trigmesh
