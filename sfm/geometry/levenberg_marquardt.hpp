// Small dense nonlinear least squares: minimise sum_i w_i |r_i(x)|^2 for a handful of unknowns.
// Damping and acceptance as in K. Madsen, H. B. Nielsen, O. Tingleff, "Methods for Non-Linear Least
// Squares Problems", DTU 2004, algorithm 3.16, with Marquardt's scaling: (J^T W J + mu diag(J^T W
// J)) d = -J^T W r.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <Eigen/Cholesky>
#include <Eigen/Core>

namespace trigmesh {

/// What one pass over the residuals leaves. Only the lower triangle of `jtj` needs to be filled.
template <int kDof>
struct NormalEquations {
  Eigen::Matrix<double, kDof, kDof> jtj = Eigen::Matrix<double, kDof, kDof>::Zero();
  Eigen::Matrix<double, kDof, 1> jtr = Eigen::Matrix<double, kDof, 1>::Zero();
  double cost = 0.0;

  /// Adds a block of residuals with its Jacobian, weighted.
  template <typename Jacobian, typename Residual>
  void add(const Jacobian& jacobian, const Residual& residual, double weight) {
    for (int j = 0; j < kDof; ++j) {
      for (int i = j; i < kDof; ++i) {
        jtj(i, j) += weight * jacobian.col(i).dot(jacobian.col(j));
      }
      jtr[j] += weight * jacobian.col(j).dot(residual);
    }
  }
};

struct LevenbergMarquardtOptions {
  int max_iterations = 10;
  /// Stop when a step lowers the cost by less than this part of it.
  double relative_tolerance = 1e-8;
  double initial_damping = 1e-4;
};

template <typename State>
struct LevenbergMarquardtResult {
  State state;
  double cost = 0.0;
  bool usable = false;  ///< false when the starting point itself could not be evaluated
};

/// Minimises from `state`. `linearize(state)` gives std::optional<NormalEquations<kDof>>, nothing
/// where the cost is undefined (such steps are refused); `step(state, delta)` gives the moved
/// state.
template <int kDof, typename State, typename Linearize, typename Step>
[[nodiscard]] LevenbergMarquardtResult<State> levenberg_marquardt(
    const State& start,
    const Linearize& linearize,
    const Step& step,
    const LevenbergMarquardtOptions& options) {
  using Matrix = Eigen::Matrix<double, kDof, kDof>;
  using Vector = Eigen::Matrix<double, kDof, 1>;
  LevenbergMarquardtResult<State> best{start};
  std::optional<NormalEquations<kDof>> equations = linearize(start);
  if (!equations) {
    return best;
  }
  best.usable = true;
  best.cost = equations->cost;
  double damping = options.initial_damping;
  double growth = 2.0;
  for (int i = 0; i < options.max_iterations; ++i) {
    Matrix damped = equations->jtj;
    const double floor = 1e-12 * equations->jtj.diagonal().maxCoeff();
    for (int k = 0; k < kDof; ++k) {
      damped(k, k) += damping * damped(k, k) + floor;
    }
    const Eigen::LDLT<Matrix, Eigen::Lower> factor(damped);
    const Vector delta = factor.solve(-equations->jtr);
    const State moved = step(best.state, delta);
    std::optional<NormalEquations<kDof>> next;
    if (delta.allFinite()) {
      next = linearize(moved);
    }
    if (!next || !(next->cost <= best.cost)) {
      damping = std::max(damping, 1e-8) * growth;
      growth *= 2.0;
      if (damping > 1e12) {
        break;
      }
      continue;
    }
    const double gain = best.cost - next->cost;
    best.state = moved;
    best.cost = next->cost;
    equations = next;
    damping *= 0.1;
    growth = 2.0;
    if (gain <= options.relative_tolerance * best.cost) {
      break;
    }
  }
  return best;
}

}  // namespace trigmesh
